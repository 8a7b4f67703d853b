//! Changes of a document: renaming and formatting.
//!
//! In: a document. Out: edits. Invariant: a renamed program means the same: a name that is already in use, or that does not
//! compile in its new places, is refused with the reason.

use super::document::Document;
use super::symbols::names;
use bp_core::compiler::source::{Source, Span};
use bp_core::compiler::syntax::compile;
use lsp_types::{PrepareRenameResponse, TextEdit, Uri};
use std::collections::BTreeMap;

/// The edits of one document, as a `WorkspaceEdit`.
pub(super) fn of_document(uri: &Uri, edits: Vec<TextEdit>) -> serde_json::Value {
    serde_json::json!({ "changes": BTreeMap::from([(uri.as_str(), edits)]) })
}

impl Document {
    /// The range of the name at an offset, if it can be renamed.
    pub(super) fn renameable(&self, offset: usize) -> Option<PrepareRenameResponse> {
        let word = self.word(offset)?;
        self.uses(offset)?;
        let (range, placeholder) = (self.range(word.span), word.name);
        Some(PrepareRenameResponse::RangeWithPlaceholder { range, placeholder })
    }

    /// The edits that give the symbol at an offset another name.
    pub(super) fn rename(&self, offset: usize, new: &str) -> Result<Vec<TextEdit>, String> {
        let Some((symbol, uses)) = self.uses(offset) else {
            return Err(match self.tree {
                None => "the program has mistakes: mend them first".to_owned(),
                Some(_) => "this is not a name that the program declares".to_owned(),
            });
        };
        let words = names(new);
        if !matches!(words.as_slice(), [word] if word.span == Span::new(0, new.len())) {
            return Err(format!("`{new}` is not a name"));
        }
        let own = &words[0].name;
        let is_inside = |span: Span| symbol.within.start <= span.start && span.end <= symbol.within.end;
        if names(&self.source.text).iter().any(|word| word.name == *own && is_inside(word.span)) {
            return Err(format!("`{new}` is already in use"));
        }
        let mut text = String::with_capacity(self.source.text.len());
        let mut end = 0;
        for word in &uses {
            text.push_str(&self.source.text[end..word.span.start]);
            text.push_str(new);
            end = word.span.end;
        }
        text.push_str(&self.source.text[end..]);
        if let (Ok(_), Err(wrong)) = (compile(&self.source), compile(&Source::new("program", text))) {
            let first = wrong.iter().next().map_or_else(String::new, |first| format!(": {}", first.message));
            return Err(format!("`{new}` does not fit everywhere{first}"));
        }
        let edit = |span: Span| TextEdit { range: self.range(span), new_text: new.to_owned() };
        Ok(uses.iter().map(|word| edit(word.span)).collect())
    }

    /// The edit that formats the document, as `bp fmt`; none if it has mistakes, or is formatted.
    pub(super) fn formatted(&self) -> Vec<TextEdit> {
        let Some(tree) = &self.tree else { return Vec::new() };
        let text = tree.to_string();
        if text == self.source.text {
            return Vec::new();
        }
        let whole = Span::new(0, self.source.text.len());
        vec![TextEdit { range: self.range(whole), new_text: text }]
    }
}

//! What is known about a name: its declaration and its form, or its entry in the reference; and names to complete.
//!
//! In: a place in a document. Out: Markdown, completions. Invariant: entries are those that `bp reference` prints.

use super::document::Document;
use super::symbols::{Kind, Symbol};
use crate::highlight::{KEYWORDS, TYPES};
use bp_core::compiler::reference::{self, Entry};
use lsp_types::{
    CompletionItem, CompletionItemKind, Documentation, Hover, HoverContents, MarkupContent, MarkupKind,
};

fn markdown(value: String) -> MarkupContent {
    MarkupContent { kind: MarkupKind::Markdown, value }
}

/// A symbol, described.
fn described(symbol: &Symbol) -> String {
    let mut text = format!("```bp\n{}\n", symbol.declaration);
    for form in &symbol.forms {
        text.push_str(&format!("{form}\n"));
    }
    text.push_str("```");
    if !symbol.documentation.is_empty() {
        text.push_str(&format!("\n\n{}", symbol.documentation));
    }
    text
}

/// Entries of the reference; links lead nowhere in an editor.
fn explained(entries: &[Entry]) -> String {
    let one = |entry: &Entry| {
        format!("**{}** ({})\n\n{}", entry.names.join(", "), entry.kind, without_links(entry.text))
    };
    entries.iter().map(one).collect::<Vec<_>>().join("\n\n---\n\n")
}

/// Whether a name of the reference can be completed: a word of the language.
fn is_word(name: &str) -> bool {
    !name.is_empty() && name.chars().all(|letter| letter.is_alphanumeric() || letter == '_')
}

/// `[text](target)` as its text.
fn without_links(text: &str) -> String {
    let mut found = String::with_capacity(text.len());
    let mut rest = text;
    while let Some((before, after)) = rest.split_once("](") {
        match (before.rfind('['), after.split_once(')')) {
            (Some(open), Some((_, behind))) => {
                found.push_str(&before[..open]);
                found.push_str(&before[open + 1..]);
                rest = behind;
            }
            _ => break,
        }
    }
    found + rest
}

impl Document {
    /// What is known about the name at an offset.
    pub(super) fn hover(&self, offset: usize) -> Option<Hover> {
        let word = self.word(offset)?;
        let text = match self.symbol(&word) {
            Some(symbol) => described(symbol),
            None => {
                let entries = reference::named(&word.name);
                (!entries.is_empty()).then(|| explained(&entries))?
            }
        };
        Some(Hover { contents: HoverContents::Markup(markdown(text)), range: Some(self.range(word.span)) })
    }

    /// The names that may stand at an offset: those of its program, forms and functions, words of the language.
    pub(super) fn completions(&self, offset: usize) -> Vec<CompletionItem> {
        let visible = |symbol: &&Symbol| symbol.within.start <= offset && offset <= symbol.within.end;
        let mut items: Vec<CompletionItem> = Vec::new();
        let mut add = |label: &str, kind, detail: Option<String>, about: Option<String>| {
            if items.iter().all(|known| known.label != label) {
                let documentation = about.map(|about| Documentation::MarkupContent(markdown(about)));
                let label = label.to_owned();
                items.push(CompletionItem {
                    label,
                    kind: Some(kind),
                    detail,
                    documentation,
                    ..Default::default()
                });
            }
        };
        for symbol in self.symbols.iter().filter(visible) {
            let kind = match symbol.kind {
                Kind::Program => CompletionItemKind::MODULE,
                Kind::Parameter => CompletionItemKind::CONSTANT,
                Kind::Variable => CompletionItemKind::VARIABLE,
                Kind::Index => CompletionItemKind::REFERENCE,
                Kind::Question => CompletionItemKind::METHOD,
                Kind::Label => CompletionItemKind::ENUM_MEMBER,
            };
            add(&symbol.name, kind, Some(symbol.declaration.clone()), Some(described(symbol)));
        }
        let entries = reference::entries();
        for name in entries.iter().flat_map(|entry| &entry.names).filter(|name| is_word(name)) {
            let own: Vec<Entry> =
                entries.iter().filter(|entry| entry.names.contains(name)).cloned().collect();
            let kind = match own[0].kind {
                "forms" | "functions" => CompletionItemKind::FUNCTION,
                _ => CompletionItemKind::KEYWORD,
            };
            let detail = without_links(own[0].summary()).replace('`', "");
            add(name, kind, Some(detail), Some(explained(&own)));
        }
        for keyword in KEYWORDS.iter().chain(&TYPES) {
            add(keyword, CompletionItemKind::KEYWORD, None, None);
        }
        items
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn entries_have_no_links() {
        assert_eq!(without_links("mean m, [covariance](#vectors) S"), "mean m, covariance S");
        assert_eq!(without_links("see [forms](forms.md#normal)."), "see forms.");
        assert_eq!(without_links("a [b] (c)"), "a [b] (c)");
        assert!(is_word("half_flat") && !is_word("P(X | Y)"));
    }
}

//! An open document: its text, positions in it, and its diagnostics.
//!
//! In: the text of a program. Out: what the compiler says about it. Invariant: a position is a line and a number of UTF-16
//! units; a position outside a character or beyond a line is moved to the nearest one before it.

use super::symbols::{Symbol, symbols};
use bp_core::compiler::source::{Source, Span};
use bp_core::compiler::syntax::{ast, compile, parse};
use lsp_types::{
    Diagnostic, DiagnosticRelatedInformation, DiagnosticSeverity, Location, Position, Range, Uri,
};

/// An open document.
pub(super) struct Document {
    pub(super) source: Source,
    /// The offsets at which lines begin.
    lines: Vec<usize>,
    /// Its tree; `None` while it does not parse.
    pub(super) tree: Option<ast::File>,
    /// What it declares, or declared when it parsed last.
    pub(super) symbols: Vec<Symbol>,
}

impl Document {
    pub(super) fn new(text: String) -> Self {
        Self::after(text, None)
    }

    /// The document with another text.
    pub(super) fn after(text: String, before: Option<Self>) -> Self {
        let source = Source::new("program", text);
        let tree = parse(&source).ok();
        let symbols = match (&tree, before) {
            (Some(tree), _) => symbols(tree, &source),
            (None, Some(before)) => before.symbols,
            (None, None) => Vec::new(),
        };
        let begins = source.text.match_indices('\n').map(|(at, _)| at + 1);
        let lines = std::iter::once(0).chain(begins).collect();
        Self { source, lines, tree, symbols }
    }

    /// The position of an offset.
    pub(super) fn position(&self, offset: usize) -> Position {
        let text = &self.source.text;
        let offset = text.floor_char_boundary(offset.min(text.len()));
        let line = self.lines.partition_point(|begin| *begin <= offset) - 1;
        let units = text[self.lines[line]..offset].encode_utf16().count();
        Position { line: line as u32, character: units as u32 }
    }

    /// The offset of a position.
    pub(super) fn offset(&self, position: Position) -> usize {
        let text = &self.source.text;
        let Some(begin) = self.lines.get(position.line as usize) else { return text.len() };
        let end = self.lines.get(position.line as usize + 1).map_or(text.len(), |next| next - 1);
        let line = text[*begin..end].trim_end_matches('\r');
        let mut units = 0;
        for (at, character) in line.char_indices() {
            units += character.len_utf16();
            if units > position.character as usize {
                return begin + at;
            }
        }
        begin + line.len()
    }

    pub(super) fn range(&self, span: Span) -> Range {
        Range { start: self.position(span.start), end: self.position(span.end) }
    }

    /// All mistakes, with their help and their labels.
    pub(super) fn diagnostics(&self, uri: &Uri) -> Vec<Diagnostic> {
        let Err(wrong) = compile(&self.source) else { return Vec::new() };
        let one = |one: &bp_core::compiler::diagnostic::Diagnostic| {
            let help = one.help.as_ref().map_or_else(String::new, |help| format!("\nhelp: {help}"));
            let related = one.labels.iter().map(|(span, remark)| DiagnosticRelatedInformation {
                location: Location { uri: uri.clone(), range: self.range(*span) },
                message: remark.clone(),
            });
            let related: Vec<_> = related.collect();
            Diagnostic {
                range: self.range(one.span),
                severity: Some(DiagnosticSeverity::ERROR),
                source: Some("bp".to_owned()),
                message: format!("{}{help}", one.message),
                related_information: (!related.is_empty()).then_some(related),
                ..Diagnostic::default()
            }
        };
        wrong.iter().map(one).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn positions_count_utf_16_units() {
        // é is one unit, 𝛼 two; a line may end in \r\n.
        let document = Document::new("aé𝛼b\r\nc\n".to_owned());
        let at = |line, character| document.offset(Position { line, character });
        assert_eq!([at(0, 0), at(0, 1), at(0, 2), at(0, 4), at(0, 5)], [0, 1, 3, 7, 8]);
        assert_eq!(at(0, 3), 3, "inside a pair");
        assert_eq!([at(0, 99), at(1, 0), at(1, 9), at(2, 0), at(7, 0)], [8, 10, 11, 12, 12]);
        for offset in [0, 1, 3, 7, 8, 10, 11, 12] {
            assert_eq!(document.offset(document.position(offset)), offset);
        }
    }
}

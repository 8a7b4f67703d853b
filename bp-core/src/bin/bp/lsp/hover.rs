//! What is known about a name: its declaration, its form, the reference of a form; and names to complete.
//!
//! In: a place in a document. Out: Markdown, completions. Invariant: the reference of forms is that of `docs/language.md`.

use super::document::Document;
use super::symbols::{Kind, Symbol};
use crate::highlight::{KEYWORDS, TYPES};
use lsp_types::{
    CompletionItem, CompletionItemKind, Documentation, Hover, HoverContents, MarkupContent, MarkupKind,
};

/// The rows of the tables of forms, distributions and functions of `docs/language.md`.
const REFERENCE: &str = include_str!("forms.md");

/// The rows about a form, each as its cells.
fn reference(name: &str) -> Vec<Vec<String>> {
    REFERENCE.lines().filter(|row| names_of(row).iter().any(|own| own == name)).map(cells).collect()
}

/// The cells of a row. A bar in a cell is written `\|`.
fn cells(row: &str) -> Vec<String> {
    let inner = row.trim().trim_start_matches('|').trim_end_matches('|').replace("\\|", "\u{1}");
    inner.split('|').map(|cell| cell.trim().replace('\u{1}', "|")).collect()
}

/// The names of the forms or functions in the first cell of a row: `exp(x)`, `ln(x)`.
fn names_of(row: &str) -> Vec<String> {
    let first = cells(row).into_iter().next().unwrap_or_default();
    let codes = first.split('`').skip(1).step_by(2);
    let name = |code: &str| {
        code.split(|letter: char| !(letter.is_alphanumeric() || letter == '_')).next().map(str::to_owned)
    };
    codes.filter_map(name).filter(|name| !name.is_empty()).collect()
}

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

/// The reference of a form, as a list; links lead nowhere in an editor.
fn of_form(rows: &[Vec<String>]) -> String {
    let line = |row: &Vec<String>| format!("- {}", row.join(" · "));
    rows.iter().map(line).map(|line| without_links(&line)).collect::<Vec<_>>().join("\n")
}

/// `[text](target)` as its text.
fn without_links(text: &str) -> String {
    let mut found = String::with_capacity(text.len());
    let mut rest = text;
    while let Some((before, after)) = rest.split_once("](#") {
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
                let rows = reference(&word.name);
                (!rows.is_empty()).then(|| of_form(&rows))?
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
        for name in REFERENCE.lines().flat_map(names_of) {
            let rows = reference(&name);
            let detail = rows.first().and_then(|row| row.first().cloned());
            add(
                &name,
                CompletionItemKind::FUNCTION,
                detail.map(|cell| cell.replace('`', "")),
                Some(of_form(&rows)),
            );
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
    fn rows_are_found_by_the_names_in_their_first_cell() {
        assert_eq!(names_of("| `exp(x)`, `ln(x)` | eˣ |"), ["exp", "ln"]);
        assert_eq!(reference("normal").len(), 4);
        assert_eq!(cells("| `laplace(m, b)` | exp(−\\|x − m\\|/b) |")[1], "exp(−|x − m|/b)");
        assert_eq!(without_links("mean m, [covariance](#vectors) S"), "mean m, covariance S");
    }
}

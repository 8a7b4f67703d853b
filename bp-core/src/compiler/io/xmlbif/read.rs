//! The reader of XMLBIF.
//!
//! In: a text. Out: a model and warnings, or the first mistake. Invariant: names of elements are case-insensitive;
//! unknown elements are ignored.

use crate::diagnostic::{Diagnostic, Diagnostics};
use crate::io::Warning;
use crate::io::draft::{Draft, Fastest, Table};
use crate::io::lexer::{probability, shortened};
use crate::model::Model;
use crate::source::{Source, Span};
use roxmltree::{Document, Node, NodeType, ParsingOptions};

/// Reads a network, with warnings about corrections.
pub fn read(source: &Source) -> Result<(Model, Vec<Warning>), Diagnostics> {
    let text = source.text.trim_start_matches('\u{feff}');
    let shift = source.text.len() - text.len();
    // Blank lines before the declaration are not valid XML, but occur in practice.
    let trimmed = text.trim_start();
    let shift = shift + text.len() - trimmed.len();
    let options = ParsingOptions { allow_dtd: true, ..ParsingOptions::default() };
    let document = Document::parse_with_options(trimmed, options).map_err(|error| {
        let place = shift + offset(trimmed, error.pos());
        let message = error.to_string();
        // The end of the message contains the position, which is shown anyway.
        let message = message.rsplit_once(" at ").map_or(message.as_str(), |(what, _)| what);
        Diagnostic::new(
            Span::new(place, (place + 1).min(source.text.len())),
            format!("this is not XML: {message}"),
        )
    })?;
    let mut reader = Reader { draft: Draft::default(), shift };
    let root = document.root_element();
    let network = match is(root, "NETWORK") {
        true => root,
        false => root
            .children()
            .find(|node| is(*node, "NETWORK"))
            .ok_or_else(|| Diagnostic::new(reader.head(root), "expected `<BIF>` with a `<NETWORK>` in it"))?,
    };
    reader.network(network)?;
    reader.draft.model(Span::new(0, 0))
}

/// The offset of a line and a column.
fn offset(text: &str, place: roxmltree::TextPos) -> usize {
    let line = (place.row as usize).saturating_sub(1);
    let start: usize = text.split_inclusive('\n').take(line).map(str::len).sum();
    let rest = text.get(start..).unwrap_or("");
    let column = (place.col as usize).saturating_sub(1);
    start + rest.char_indices().nth(column).map_or(rest.len(), |(at, _)| at)
}

fn is(node: Node<'_, '_>, name: &str) -> bool {
    node.is_element() && node.tag_name().name().eq_ignore_ascii_case(name)
}

struct Reader {
    draft: Draft,
    /// Number of bytes skipped before the XML.
    shift: usize,
}

impl Reader {
    fn network(&mut self, network: Node<'_, '_>) -> Result<(), Diagnostic> {
        for node in network.children().filter(Node::is_element) {
            if is(node, "NAME") {
                self.draft.name = self.words(node).0;
            } else if is(node, "VARIABLE") {
                self.variable(node)?;
            }
        }
        let definitions =
            network.children().filter(|node| is(*node, "DEFINITION") || is(*node, "PROBABILITY"));
        definitions.into_iter().try_for_each(|node| self.definition(node))
    }

    fn variable(&mut self, node: Node<'_, '_>) -> Result<(), Diagnostic> {
        let mut name = None;
        let mut states = Vec::new();
        let kind = node.attributes().find(|attribute| attribute.name().eq_ignore_ascii_case("TYPE"));
        if let Some(kind) =
            kind.filter(|kind| !["nature", "discrete"].contains(&kind.value().to_ascii_lowercase().as_str()))
        {
            let message =
                format!("a `{}` variable: a Bayesian network has those of `nature`", shortened(kind.value()));
            return Err(Diagnostic::new(self.head(node), message));
        }
        for child in node.children().filter(Node::is_element) {
            if is(child, "NAME") {
                name = Some(self.words(child));
            } else if is(child, "OUTCOME") || is(child, "VALUE") {
                let (state, span) = self.words(child);
                if state.is_empty() {
                    return Err(Diagnostic::new(span, "this value has no name"));
                }
                states.push(state);
            }
        }
        let Some((name, span)) = name else {
            return Err(Diagnostic::new(self.head(node), "this variable has no `<NAME>`"));
        };
        if name.is_empty() {
            return Err(Diagnostic::new(span, "this variable has no name"));
        }
        self.draft.node(&name, span, states)?;
        Ok(())
    }

    fn definition(&mut self, node: Node<'_, '_>) -> Result<(), Diagnostic> {
        let (mut left, mut parents, mut table) = (None, Vec::new(), None);
        for child in node.children().filter(Node::is_element) {
            if is(child, "FOR") || is(child, "GIVEN") {
                let (name, span) = self.words(child);
                let known = self.draft.known(&name, span)?;
                match is(child, "FOR") {
                    true if left.is_some() => {
                        return Err(Diagnostic::new(span, "a definition is `<FOR>` one variable"));
                    }
                    true => left = Some(known),
                    false => parents.push(known),
                }
            } else if is(child, "TABLE") {
                table = Some(child);
            }
        }
        let head = self.head(node);
        let left = left.ok_or_else(|| Diagnostic::new(head, "expected `<FOR>` in this definition"))?;
        let table = table.ok_or_else(|| Diagnostic::new(head, "expected `<TABLE>` in this definition"))?;
        let (rows, entries) = self.draft.shape(left, &parents, head)?;
        let mut numbers = Vec::new();
        for part in table.children().filter(|part| part.node_type() == NodeType::Text) {
            let (text, range) = (part.text().unwrap_or(""), part.range());
            // If the text has no entities, offsets in it are offsets in the file.
            let exact = range.len() == text.len();
            for word in text
                .split(|letter: char| letter.is_whitespace() || letter == ',')
                .filter(|word| !word.is_empty())
            {
                let span = match exact {
                    true => {
                        let start =
                            self.shift + range.start + (word.as_ptr() as usize - text.as_ptr() as usize);
                        Span::new(start, start + word.len())
                    }
                    false => Span::new(self.shift + range.start, self.shift + range.end),
                };
                numbers.push(probability(word, span)?);
            }
        }
        let at = self.head(table);
        if numbers.len() != rows * entries {
            let expected = rows * entries;
            let message = format!(
                "expected {expected} probabilities ({rows} rows of {entries}), found {}",
                numbers.len()
            );
            return Err(Diagnostic::new(at, message));
        }
        let numbers = self.draft.by_rows(numbers, left, Fastest::Child, at);
        self.draft.distribution(left, parents, Table { numbers, places: vec![at] }, head)
    }

    /// The text of an element, without surrounding blanks.
    fn words(&self, node: Node<'_, '_>) -> (String, Span) {
        let text: String =
            node.children().filter_map(|child| child.text().filter(|_| child.is_text())).collect();
        let span = node.children().find(Node::is_text).map_or(node.range(), |text| text.range());
        (text.trim().to_owned(), Span::new(self.shift + span.start, self.shift + span.end))
    }

    /// The opening of an element.
    fn head(&self, node: Node<'_, '_>) -> Span {
        let start = self.shift + node.range().start;
        Span::new(start, start + 1 + node.tag_name().name().len())
    }
}

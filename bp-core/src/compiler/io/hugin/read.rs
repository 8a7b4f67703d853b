//! The reader of Hugin NET.
//!
//! In: a text. Out: a model and warnings, or the first mistake. Invariant: attributes that do not concern the
//! distribution are ignored; a potential without data is uniform, with a warning.

use super::expressions;
use crate::diagnostic::{Diagnostic, Diagnostics};
use crate::io::Warning;
use crate::io::draft::{Draft, Fastest, Table};
use crate::io::lexer::{Dialect, Lexer, Token, probability, shortened, unexpected};
use crate::model::Model;
use crate::radix;
use crate::source::{Source, Span};
use std::collections::HashMap;

const NET: Dialect = Dialect { signs: b"{}()=;|", percent: true, escapes: true };

/// Reads a network, with warnings about corrections.
pub fn read(source: &Source) -> Result<(Model, Vec<Warning>), Diagnostics> {
    let mut reader = Reader {
        text: &source.text,
        lexer: Lexer::new(&source.text, &NET),
        draft: Draft::default(),
        nodes: HashMap::new(),
        bounds: HashMap::new(),
    };
    reader.file()?;
    reader.draft.model(Span::new(0, 0))
}

struct Reader<'s> {
    text: &'s str,
    lexer: Lexer<'s>,
    draft: Draft,
    /// The variables by their identifiers.
    nodes: HashMap<&'s str, usize>,
    /// The bounds of variables whose values are intervals.
    bounds: HashMap<usize, Vec<f64>>,
}

/// A potential given by expressions: their nodes, and the span of their text.
#[derive(Default)]
struct Expressions {
    nodes: Vec<usize>,
    text: Span,
}

/// A potential whose variables are not read yet.
type Waiting<'s> = Vec<Lexer<'s>>;

impl<'s> Reader<'s> {
    fn file(&mut self) -> Result<(), Diagnostic> {
        let (mut waiting, mut classes): (Waiting<'s>, usize) = (Vec::new(), 0);
        loop {
            match self.lexer.next()? {
                (Token::End, _) => break,
                (Token::Word("net"), _) => self.heading()?,
                (Token::Word("class"), _) => {
                    self.lexer.name("the name of a class")?;
                    self.lexer.sign(b'{', "the name of the class")?;
                    classes += 1;
                }
                (Token::Sign(b'}'), _) if classes > 0 => classes -= 1,
                (Token::Word("discrete"), _) => {}
                (Token::Word("node"), _) => self.node()?,
                (Token::Word("potential"), _) => {
                    // Variables may be declared after their potentials.
                    waiting.push(self.lexer.clone());
                    self.skip_block()?;
                }
                (Token::Word(kind @ ("continuous" | "decision" | "utility" | "function")), span) => {
                    let message = format!("a `{kind}` node: only discrete nodes can be read");
                    return Err(Diagnostic::new(span, message));
                }
                (Token::Word(_), _) if classes > 0 && self.lexer.takes(b'=')? => self.skip_value()?,
                (Token::Sign(b';'), _) => {}
                (found, span) => return Err(unexpected(span, found, "`net`, `node` or `potential`")),
            }
        }
        for lexer in waiting {
            self.lexer = lexer;
            self.potential()?;
        }
        Ok(())
    }

    /// `net { name = "…"; }`
    fn heading(&mut self) -> Result<(), Diagnostic> {
        self.lexer.sign(b'{', "`net`")?;
        self.attributes(|reader, name| {
            if name == "name" {
                reader.draft.name = reader.text()?;
            }
            Ok(())
        })
    }

    /// `node X { states = ("a" "b"); }`
    fn node(&mut self) -> Result<(), Diagnostic> {
        let (identifier, span) = self.lexer.name("the name of a node")?;
        self.lexer.sign(b'{', "the name of the node")?;
        let (mut name, mut states) = (identifier.to_owned(), Vec::new());
        let mut values: Vec<String> = Vec::new();
        self.attributes(|reader, attribute| {
            match attribute {
                "bp_name" => name = reader.text()?,
                "states" => states = reader.states()?,
                "state_values" => values = reader.states()?,
                _ => {}
            }
            Ok(())
        })?;
        if states.is_empty() {
            let message = format!("node `{}` has no `states`", shortened(identifier));
            return Err(Diagnostic::new(span, message).with_help("write `states = (\"yes\" \"no\");`"));
        }
        // Values without names are named by their numbers, or by the bounds of their intervals.
        let bounds = values.len() == states.len() + 1;
        for (place, state) in states.iter_mut().enumerate().filter(|(_, state)| state.is_empty()) {
            *state = match (bounds, values.get(place)) {
                (true, Some(low)) => format!("{}..{}", bound(low), bound(&values[place + 1])),
                (false, Some(value)) => value.clone(),
                _ => continue,
            };
        }
        let node = self.draft.node(&name, span, states)?;
        self.nodes.insert(identifier, node);
        let numbers: Option<Vec<f64>> = values.iter().map(|value| bound(value).parse().ok()).collect();
        if let (true, Some(numbers)) = (bounds, numbers) {
            self.bounds.insert(node, numbers);
        }
        Ok(())
    }

    /// Attributes up to `}`; those that `take` does not use are ignored.
    fn attributes(
        &mut self,
        mut take: impl FnMut(&mut Self, &str) -> Result<(), Diagnostic>,
    ) -> Result<(), Diagnostic> {
        loop {
            match self.lexer.next()? {
                (Token::Sign(b'}'), _) => return Ok(()),
                (Token::Sign(b';'), _) => {}
                (Token::Word(name), _) => {
                    self.lexer.sign(b'=', &format!("`{}`", shortened(name)))?;
                    take(self, name)?;
                    self.skip_value()?;
                }
                (found, span) => return Err(unexpected(span, found, "an attribute or `}`")),
            }
        }
    }

    /// The rest of an attribute's value.
    fn skip_value(&mut self) -> Result<(), Diagnostic> {
        loop {
            match self.lexer.peek()? {
                (Token::Sign(b'}'), _) => return Ok(()),
                (Token::End, span) => return Err(unexpected(span, Token::End, "`;`")),
                (Token::Sign(b';'), _) => {
                    self.lexer.next()?;
                    return Ok(());
                }
                _ => self.lexer.next()?,
            };
        }
    }

    fn text(&mut self) -> Result<String, Diagnostic> {
        Ok(unescaped(self.lexer.name("a text in quotes")?.0))
    }

    fn states(&mut self) -> Result<Vec<String>, Diagnostic> {
        self.lexer.sign(b'(', "`states =`")?;
        let mut states = Vec::new();
        loop {
            match self.lexer.next()? {
                (Token::Sign(b')'), _) => return Ok(states),
                (Token::Word(state) | Token::Quoted(state), _) => states.push(unescaped(state)),
                (found, span) => return Err(unexpected(span, found, "the name of a state or `)`")),
            }
        }
    }

    /// Skips `( … ) { … }`.
    fn skip_block(&mut self) -> Result<(), Diagnostic> {
        loop {
            match self.lexer.next()? {
                (Token::Sign(b'}'), _) => return Ok(()),
                (Token::End, span) => return Err(unexpected(span, Token::End, "`}`")),
                _ => {}
            }
        }
    }

    /// `(X | Y Z) { data = (…); }`
    fn potential(&mut self) -> Result<(), Diagnostic> {
        let mut head = self.lexer.sign(b'(', "`potential`")?;
        let mut variables = Vec::new();
        let mut left = None;
        loop {
            match self.lexer.next()? {
                (Token::Word(name) | Token::Quoted(name), span) => {
                    let node = self.nodes.get(name).copied();
                    variables.push(node.ok_or_else(|| {
                        Diagnostic::new(span, format!("unknown node `{}`", shortened(name)))
                    })?);
                }
                (Token::Sign(b'|'), _) if left.is_none() => left = Some(variables.len()),
                (Token::Sign(b')'), end) => {
                    head = head.to(end);
                    break;
                }
                (found, span) => return Err(unexpected(span, found, "the name of a node or `)`")),
            }
        }
        if left.unwrap_or(variables.len()) != 1 {
            let message = "expected one node before the `|`: a potential of several nodes is not a conditional distribution";
            return Err(Diagnostic::new(head, message));
        }
        let (node, parents) = (variables[0], variables[1..].to_vec());
        let (rows, entries) = self.draft.shape(node, &parents, head)?;
        self.lexer.sign(b'{', "the nodes of the potential")?;
        let mut data: Option<(Vec<f64>, Span)> = None;
        let mut expressions: Option<Expressions> = None;
        self.attributes(|reader, attribute| {
            match attribute {
                "data" => data = Some(reader.data()?),
                "model_nodes" => {
                    let names = reader.states()?;
                    let known = |name: &String| reader.nodes.get(name.as_str()).copied();
                    let nodes = names.iter().filter_map(known).collect();
                    expressions.get_or_insert_default().nodes = nodes;
                }
                "model_data" => expressions.get_or_insert_default().text = reader.raw()?,
                _ => {}
            }
            Ok(())
        })?;
        if let (None, Some(expressions)) = (&data, expressions) {
            let numbers = self.evaluated(node, &parents, rows, &expressions).map_err(|reason| {
                let name = shortened(&self.draft.nodes[node].name);
                let message = format!("the potential of `{name}` has no table, only expressions: {reason}");
                let help =
                    "in Hugin, switch the table of the node to manual values, and save the network again";
                Diagnostic::new(expressions.text, message).with_help(help)
            })?;
            data = Some((numbers, expressions.text));
        }
        let (numbers, at) = data.unwrap_or_else(|| {
            let name = shortened(&self.draft.nodes[node].name);
            let message = format!("the potential of `{name}` has no data; it is taken as uniform");
            self.draft.warnings.push(Warning::new(head, message));
            (vec![1.0 / entries as f64; rows * entries], head)
        });
        if numbers.len() != rows * entries {
            let expected = rows * entries;
            let message =
                format!("expected {expected} numbers ({rows} rows of {entries}), found {}", numbers.len());
            return Err(Diagnostic::new(at, message));
        }
        let numbers = self.draft.by_rows(numbers, node, Fastest::Child, at);
        self.draft.distribution(node, parents, Table { numbers, places: vec![at] }, head)
    }

    /// The span of a value, which stays as it is written.
    fn raw(&mut self) -> Result<Span, Diagnostic> {
        let (_, mut span) = self.lexer.peek()?;
        loop {
            match self.lexer.peek()? {
                (Token::Sign(b';' | b'}') | Token::End, _) => return Ok(span),
                (_, at) => span = span.to(at),
            }
            self.lexer.next()?;
        }
    }

    /// The table of expressions, or the reason why there is none.
    fn evaluated(
        &self,
        node: usize,
        parents: &[usize],
        rows: usize,
        model: &Expressions,
    ) -> Result<Vec<f64>, String> {
        let text = &self.text[model.text.start..model.text.end];
        let size = |one: &usize| self.draft.nodes[*one].states.len();
        let bounds = self.bounds.get(&node).map(Vec::as_slice);
        let given = expressions::rows(text, size(&node), bounds)?;
        let places = model.nodes.iter().map(|one| parents.iter().position(|parent| parent == one));
        let places: Option<Vec<usize>> = places.collect();
        let places = places.ok_or_else(|| "its model has nodes that are not parents".to_owned())?;
        let expected: usize = model.nodes.iter().map(size).product();
        if given.len() != expected {
            return Err(format!("expected {expected} expressions, found {}", given.len()));
        }
        let mut numbers = Vec::new();
        for row in 0..rows {
            let values = radix::in_order(row, parents.iter().map(size));
            let own = radix::position(places.iter().map(|place| (values[*place], size(&parents[*place]))));
            numbers.extend_from_slice(&given[own]);
        }
        Ok(numbers)
    }

    /// `((0.1 0.9)(0.5 0.5))`: the nesting of the brackets is implied by the order.
    fn data(&mut self) -> Result<(Vec<f64>, Span), Diagnostic> {
        let (_, mut at) = self.lexer.peek()?;
        let mut numbers = Vec::new();
        loop {
            match self.lexer.peek()? {
                (Token::Sign(b'(' | b')'), span) => {
                    self.lexer.next()?;
                    at = at.to(span);
                }
                (Token::Word(word), span) => {
                    self.lexer.next()?;
                    numbers.push(probability(word, span)?);
                }
                (Token::Sign(b';' | b'}'), _) => return Ok((numbers, at)),
                (found, span) => return Err(unexpected(span, found, "a number, `(` or `)`")),
            }
        }
    }
}

/// A bound of an interval, as Rust reads it.
fn bound(word: &str) -> &str {
    match word {
        "infinity" | "+infinity" | "+inf" => "inf",
        "-infinity" => "-inf",
        other => other,
    }
}

/// A text without the `\` before quotation marks.
fn unescaped(text: &str) -> String {
    let mut plain = String::with_capacity(text.len());
    let mut letters = text.chars();
    while let Some(letter) = letters.next() {
        match letter {
            '\\' => plain.extend(letters.next()),
            other => plain.push(other),
        }
    }
    plain
}

//! A network under construction, for the readers of all formats.
//!
//! In: variables with the names of their values, and tables with the span of each row. Out: a [`Model`] whose factors
//! are in the order of their variables. Invariant: every row of the model is divided by its sum, with a warning if the
//! deviation is more than rounding; linear in the size of the file.

use super::Warning;
use super::lexer::shortened;
use crate::diagnostic::{Diagnostic, Diagnostics};
use crate::ids::{Id, VariableId};
use crate::model::{Domain, Factor, Form, Model, ModelBuilder, Place, VariableUse};
use crate::radix;
use crate::source::Span;
use crate::spelling::number as written;
use std::collections::HashMap;

/// Limit of the numbers of all tables together.
const MOST_NUMBERS: usize = 1 << 26;

/// Deviation of the sum of a row from one above which the row is refused.
const MOST_OFF: f64 = 0.01;

/// Deviation above which the division is reported.
const LEAST_REPORTED: f64 = 1e-9;

/// The fastest variable of a flat table.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Fastest {
    /// The variable that it distributes: its rows are consecutive.
    Child,
    /// The last parent.
    Parents,
}

/// The numbers of a table, rows in the order of [`Form::Table`].
pub(super) struct Table {
    pub(super) numbers: Vec<f64>,
    /// The span of each row, or one span for all.
    pub(super) places: Vec<Span>,
}

/// A variable of a network.
pub(super) struct Node {
    pub(super) name: String,
    pub(super) span: Span,
    pub(super) states: Vec<String>,
    /// The states by their names.
    pub(super) ordinals: HashMap<String, usize>,
    distribution: Option<(Vec<usize>, Table, Span)>,
}

/// A network under construction.
#[derive(Default)]
pub(super) struct Draft {
    pub(super) name: String,
    pub(super) nodes: Vec<Node>,
    names: HashMap<String, usize>,
    pub(super) warnings: Vec<Warning>,
    /// Rows that were divided by their sums: the number, and the largest deviation with its span and variable.
    divided: usize,
    /// Whether rows of zeros are allowed: their contexts are impossible.
    zero_rows: bool,
    /// Number of rows of zeros, with the span and variable of the first.
    impossible: Option<(usize, Span, usize)>,
    /// The numbers of all tables so far.
    numbers: usize,
    farthest: Option<(f64, Span, usize)>,
}

impl Draft {
    /// A network in a format that allows rows of zeros.
    pub(super) fn with_zero_rows() -> Self {
        Self { zero_rows: true, ..Self::default() }
    }

    /// A variable.
    pub(super) fn node(&mut self, name: &str, span: Span, states: Vec<String>) -> Result<usize, Diagnostic> {
        if let Some(first) = self.names.get(name) {
            let message = format!("variable `{}` is declared twice", shortened(name));
            return Err(Diagnostic::new(span, message).with_label(self.nodes[*first].span, "first here"));
        }
        if name.is_empty() {
            return Err(Diagnostic::new(span, "this variable has no name"));
        }
        if states.is_empty() {
            return Err(Diagnostic::new(span, format!("variable `{}` has no values", shortened(name))));
        }
        if let Some(place) = states.iter().position(String::is_empty) {
            let message = format!("value {} of variable `{}` has no name", place + 1, shortened(name));
            return Err(Diagnostic::new(span, message));
        }
        let mut ordinals = HashMap::with_capacity(states.len());
        for (ordinal, state) in states.iter().enumerate() {
            if ordinals.insert(state.clone(), ordinal).is_some() {
                let message =
                    format!("two values of `{}` are called `{}`", shortened(name), shortened(state));
                return Err(Diagnostic::new(span, message));
            }
        }
        self.names.insert(name.to_owned(), self.nodes.len());
        self.nodes.push(Node { name: name.to_owned(), span, states, ordinals, distribution: None });
        Ok(self.nodes.len() - 1)
    }

    /// The variable of this name.
    pub(super) fn find(&self, name: &str) -> Option<usize> {
        self.names.get(name).copied()
    }

    /// The variable of this name, which must exist.
    pub(super) fn known(&self, name: &str, span: Span) -> Result<usize, Diagnostic> {
        self.find(name)
            .ok_or_else(|| Diagnostic::new(span, format!("unknown variable `{}`", shortened(name))))
    }

    /// The value of this name.
    pub(super) fn ordinal(&self, node: usize, state: &str, span: Span) -> Result<usize, Diagnostic> {
        let node = &self.nodes[node];
        node.ordinals.get(state).copied().ok_or_else(|| {
            let first: Vec<_> =
                node.states.iter().take(8).map(|state| format!("`{}`", shortened(state))).collect();
            let more = if node.states.len() > 8 { ", …" } else { "" };
            let message = format!("`{}` is not a value of `{}`", shortened(state), shortened(&node.name));
            Diagnostic::new(span, message).with_help(format!("its values are {}{more}", first.join(", ")))
        })
    }

    /// Number of rows and entries of the table of a variable with these parents.
    pub(super) fn shape(
        &self,
        node: usize,
        parents: &[usize],
        span: Span,
    ) -> Result<(usize, usize), Diagnostic> {
        for (position, parent) in parents.iter().enumerate() {
            if *parent == node || parents[..position].contains(parent) {
                let message = format!("`{}` occurs twice here", shortened(&self.nodes[*parent].name));
                return Err(Diagnostic::new(span, message));
            }
        }
        let entries = self.nodes[node].states.len();
        let rows = parents
            .iter()
            .try_fold(1usize, |rows, parent| rows.checked_mul(self.nodes[*parent].states.len()));
        let cells = rows.and_then(|rows| rows.checked_mul(entries)?.checked_add(self.numbers));
        match rows.filter(|_| cells.is_some_and(|cells| cells <= MOST_NUMBERS)) {
            Some(rows) => Ok((rows, entries)),
            None => {
                let name = shortened(&self.nodes[node].name);
                let message =
                    format!("with the table of `{name}` there would be more than {MOST_NUMBERS} numbers");
                Err(Diagnostic::new(span, message))
            }
        }
    }

    /// The values of the parents in a row, for messages.
    pub(super) fn row_name(&self, parents: &[usize], row: usize) -> String {
        let nodes = || parents.iter().map(|parent| &self.nodes[*parent]);
        let ordinals = radix::in_order(row, nodes().map(|node| node.states.len()));
        let words = nodes()
            .zip(ordinals)
            .map(|(node, state)| format!("{} = {}", shortened(&node.name), shortened(&node.states[state])));
        words.collect::<Vec<String>>().join(", ")
    }

    /// A flat table row by row. If the rows sum to one only in the other order than the format's, that order is used.
    pub(super) fn by_rows(&mut self, numbers: Vec<f64>, node: usize, order: Fastest, at: Span) -> Vec<f64> {
        let entries = self.nodes[node].states.len();
        let rows = numbers.len() / entries;
        let near = |sum: f64| (sum - 1.0).abs() <= MOST_OFF;
        let child = || numbers.chunks_exact(entries).all(|row| near(row.iter().sum()));
        let parents =
            || (0..rows).all(|row| near((0..entries).map(|entry| numbers[entry * rows + row]).sum()));
        let found = match order {
            Fastest::Child if !child() && parents() => Fastest::Parents,
            Fastest::Parents if !parents() && child() => Fastest::Child,
            same => same,
        };
        if found != order {
            let name = shortened(&self.nodes[node].name);
            let message = match found {
                Fastest::Child => format!(
                    "the table of `{name}` was read with its values changing fastest, because only then its rows sum to 1"
                ),
                Fastest::Parents => format!(
                    "the table of `{name}` was read with its values changing slowest, because only then its rows sum to 1"
                ),
            };
            self.warnings.push(Warning::new(at, message));
        }
        match found {
            Fastest::Child => numbers,
            Fastest::Parents => {
                (0..rows * entries).map(|place| numbers[place % entries * rows + place / entries]).collect()
            }
        }
    }

    /// The distribution of a variable. Its rows are divided by their sums.
    pub(super) fn distribution(
        &mut self,
        node: usize,
        parents: Vec<usize>,
        mut table: Table,
        span: Span,
    ) -> Result<(), Diagnostic> {
        if let Some((_, _, first)) = &self.nodes[node].distribution {
            let message = format!("variable `{}` has two distributions", shortened(&self.nodes[node].name));
            return Err(Diagnostic::new(span, message).with_label(*first, "first here"));
        }
        let entries = self.nodes[node].states.len();
        for (row, numbers) in table.numbers.chunks_exact_mut(entries).enumerate() {
            let sum: f64 = numbers.iter().sum();
            let off = (sum - 1.0).abs();
            // Only rounding: dividing again would not be more exact, and a second reading changes nothing.
            if off <= entries as f64 * f64::EPSILON {
                continue;
            }
            let place = table.places.get(row).or(table.places.first()).copied().unwrap_or(span);
            if self.zero_rows && sum == 0.0 && !parents.is_empty() {
                let (count, place, whose) = self.impossible.unwrap_or((0, place, node));
                self.impossible = Some((count + 1, place, whose));
                continue;
            }
            if self.zero_rows && sum == 0.0 {
                let name = shortened(&self.nodes[node].name);
                let message = format!("the probabilities of `{name}` are all 0: nothing is possible");
                return Err(Diagnostic::new(place, message).with_label(place, "these"));
            }
            if off.is_nan() || off > MOST_OFF {
                let at = match parents.is_empty() {
                    true => format!("`{}`", shortened(&self.nodes[node].name)),
                    false => {
                        format!("`{}` at {}", shortened(&self.nodes[node].name), self.row_name(&parents, row))
                    }
                };
                let message =
                    format!("the probabilities of {at} sum to {}, more than 1 % away from 1", written(sum));
                return Err(Diagnostic::new(place, message).with_label(place, "these"));
            }
            numbers.iter_mut().for_each(|number| *number /= sum);
            if off > LEAST_REPORTED {
                self.divided += 1;
                if self.farthest.is_none_or(|(far, ..)| off > (far - 1.0).abs()) {
                    self.farthest = Some((sum, place, node));
                }
            }
        }
        table.places = Vec::new();
        self.numbers += table.numbers.len();
        self.nodes[node].distribution = Some((parents, table, span));
        Ok(())
    }

    /// The model. `whole` is the span for reports without a span of their own.
    pub(super) fn model(mut self, whole: Span) -> Result<(Model, Vec<Warning>), Diagnostics> {
        if self.nodes.is_empty() {
            return Err(Diagnostic::new(whole, "this file declares no variable").into());
        }
        let mut model = ModelBuilder::new(if self.name.is_empty() { "unknown" } else { &self.name });
        let mut spans: Vec<(Span, Span)> = Vec::with_capacity(self.nodes.len());
        if let Some((sum, place, node)) = self.farthest {
            let rows = match self.divided {
                1 => "1 row was divided by its sum".to_owned(),
                several => format!("{several} rows were divided by their sums"),
            };
            let name = shortened(&self.nodes[node].name);
            let message = format!("{rows}; the farthest from 1 is {}, of `{name}`", written(sum));
            self.warnings.push(Warning::new(place, message));
        }
        if let Some((count, place, node)) = self.impossible {
            let rows = if count == 1 { "1 row is".to_owned() } else { format!("{count} rows are") };
            let name = shortened(&self.nodes[node].name);
            let message =
                format!("{rows} zero everywhere, the first of `{name}`: these contexts are impossible");
            self.warnings.push(Warning::new(place, message));
        }
        let ids: Vec<VariableId> = (self.nodes.iter_mut())
            .map(|node| model.variable(&node.name, domain(std::mem::take(&mut node.states))))
            .collect();
        for (id, node) in ids.iter().zip(&mut self.nodes) {
            let Some((parents, table, span)) = node.distribution.take() else {
                let message = format!("variable `{}` has no distribution", shortened(&node.name));
                return Err(Diagnostic::new(node.span, message).into());
            };
            spans.push((node.span, span));
            model.push_factor(Factor {
                left: vec![VariableUse::from(*id)],
                right: parents.iter().map(|parent| ids[*parent].into()).collect(),
                form: Form::Constants(table.numbers),
                products: Vec::new(),
            });
        }
        match model.build() {
            Ok(model) => Ok((model, self.warnings)),
            Err(faults) => {
                let mut wrong = Diagnostics::default();
                for fault in faults {
                    let span = match fault.place {
                        Place::Variable(id) => spans[id.position()].0,
                        Place::Factor(id) | Place::Form(id) => spans[id.position()].1,
                        _ => whole,
                    };
                    let mut diagnostic = Diagnostic::new(span, fault.message);
                    diagnostic.help = fault.help;
                    wrong.push(diagnostic);
                }
                wrong.sort();
                Err(wrong)
            }
        }
    }
}

/// A domain with these names: consecutive whole numbers are a range, `false, true` is `bool`.
fn domain(states: Vec<String>) -> Domain {
    if states == ["false", "true"] {
        return Domain::Boolean;
    }
    let first: Option<i64> = states[0].parse().ok().filter(|low: &i64| low.abs() < 1 << 40);
    match first {
        Some(low) if (low..).zip(&states).all(|(number, state)| number.to_string() == *state) => {
            Domain::integers(low, low + states.len() as i64 - 1)
        }
        _ => Domain::Finite { labels: states, range: None },
    }
}

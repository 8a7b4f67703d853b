//! The writer of UAI networks.
//!
//! In: a model of finite variables, and evidence that always holds. Out: a text: `BAYES`, or `MARKOV` if there is
//! evidence. Invariant: variables keep their order; an observed variable is omitted, and its table becomes a potential
//! of its parents.

use crate::error::Error;
use crate::ids::Id;
use crate::io::finite::Node;
use crate::model::{Finding, Known, Model, Value};
use std::fmt::Write;

/// The text of a model.
///
/// # Errors
/// A variable that is not finite, a form without a table, a known value without an index.
pub(in crate::compiler::io) fn write(
    model: &Model,
    nodes: &[Node<'_>],
    known: &[Known],
) -> Result<String, Error> {
    let mut values = vec![None; nodes.len()];
    for known in known {
        let Finding::Hard(Value::Ordinal(ordinal)) = known.evidence else {
            return Err(Error::input(
                model.variable_name(known.variable),
                "UAI evidence can only contain known values",
            ));
        };
        values[known.variable.position()] = Some(ordinal);
    }
    let (mut places, mut sizes) = (Vec::with_capacity(nodes.len()), Vec::new());
    for (node, value) in nodes.iter().zip(&values) {
        places.push(value.is_none().then_some(sizes.len()));
        if value.is_none() {
            sizes.push(node.states.len().to_string());
        }
    }
    // For each table: the positions of its variables, and its numbers.
    let mut tables: Vec<(Vec<String>, Vec<f64>)> = Vec::new();
    for (position, node) in nodes.iter().enumerate() {
        let variables: Vec<usize> = node.parents.iter().copied().chain([position]).collect();
        let uniform = node.parents.is_empty() && node.numbers.iter().all(|p| *p == node.numbers[0]);
        if !known.is_empty() && uniform && values[position].is_none() {
            continue;
        }
        let scope = variables.iter().filter_map(|variable| places[*variable]);
        let scope = scope.map(|place| place.to_string()).collect();
        let mut ordinals = vec![0usize; variables.len()];
        let mut numbers = Vec::new();
        for number in node.numbers.iter() {
            let fits = |(variable, ordinal): (&usize, &usize)| {
                values[*variable].is_none_or(|value| value == *ordinal)
            };
            if variables.iter().zip(&ordinals).all(fits) {
                numbers.push(*number);
            }
            for (ordinal, variable) in ordinals.iter_mut().zip(&variables).rev() {
                *ordinal += 1;
                if *ordinal < nodes[*variable].states.len() {
                    break;
                }
                *ordinal = 0;
            }
        }
        tables.push((scope, numbers));
    }
    let kind = if known.is_empty() { "BAYES" } else { "MARKOV" };
    let mut text = format!("{kind}\n{}\n{}\n{}\n", sizes.len(), sizes.join(" "), tables.len());
    for (scope, _) in &tables {
        let _ =
            writeln!(text, "{}{}{}", scope.len(), if scope.is_empty() { "" } else { " " }, scope.join(" "));
    }
    for (_, numbers) in &tables {
        let words: Vec<_> = numbers.iter().map(|number| format!("{number:?}")).collect();
        let _ = write!(text, "\n{}\n{}\n", numbers.len(), words.join(" "));
    }
    Ok(text)
}

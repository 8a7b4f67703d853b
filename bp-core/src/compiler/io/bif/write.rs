//! The writer of BIF.
//!
//! In: a model of finite variables. Out: a text, one row to a line. Invariant: names that are not words are quoted; a
//! quotation mark in a name, which BIF cannot hold, is an error.

use crate::error::Error;
use crate::io::finite::Node;
use crate::model::Model;
use std::borrow::Cow;
use std::fmt::Write;

/// The text of a model.
///
/// # Errors
/// A variable that is not finite, a form without a table, a quotation mark or a line break in a name.
pub(in crate::compiler::io) fn write(model: &Model, nodes: &[Node<'_>]) -> Result<String, Error> {
    let mut text = format!("network {} {{\n}}\n", name(&model.name)?);
    for node in nodes {
        let states: Vec<_> = node.states.iter().map(|state| name(state)).collect::<Result<_, _>>()?;
        let (count, states) = (states.len(), states.join(", "));
        let _ = write!(
            text,
            "variable {} {{\n  type discrete [ {count} ] {{ {states} }};\n}}\n",
            name(node.name)?
        );
    }
    for node in nodes {
        distribution(&mut text, node, nodes)?;
    }
    Ok(text)
}

fn distribution(text: &mut String, node: &Node<'_>, nodes: &[Node<'_>]) -> Result<(), Error> {
    let parents: Vec<_> =
        node.parents.iter().map(|parent| name(nodes[*parent].name)).collect::<Result<_, _>>()?;
    let bar = if parents.is_empty() { "" } else { " | " };
    let _ = writeln!(text, "probability ( {}{bar}{} ) {{", name(node.name)?, parents.join(", "));
    let mut ordinals = vec![0usize; parents.len()];
    for row in node.numbers.chunks_exact(node.states.len()) {
        text.push_str(if parents.is_empty() { "  table" } else { "  (" });
        for (position, (parent, ordinal)) in node.parents.iter().zip(&ordinals).enumerate() {
            text.push_str(if position > 0 { ", " } else { "" });
            text.push_str(&name(&nodes[*parent].states[*ordinal])?);
        }
        text.push_str(if parents.is_empty() { "" } else { ")" });
        for (position, number) in row.iter().enumerate() {
            let _ = write!(text, "{} {number:?}", if position > 0 { "," } else { "" });
        }
        text.push_str(";\n");
        for (ordinal, parent) in ordinals.iter_mut().zip(&node.parents).rev() {
            *ordinal += 1;
            if *ordinal < nodes[*parent].states.len() {
                break;
            }
            *ordinal = 0;
        }
    }
    text.push_str("}\n");
    Ok(())
}

fn name(name: &str) -> Result<Cow<'_, str>, Error> {
    if name.contains(['"', '\n', '\r']) {
        let message = "a name in BIF cannot contain a quotation mark or a line break; write another format, or rename it";
        return Err(Error::input(name, message));
    }
    let sign = |letter: char| letter.is_whitespace() || letter.is_control() || "{}()[];,|".contains(letter);
    let comment = name.starts_with(['#', '%']) || name.starts_with("//") || name.starts_with("/*");
    let quotes = name.is_empty() || comment || name.contains(sign) || name.starts_with('\u{feff}');
    Ok(if quotes { format!("\"{name}\"").into() } else { name.into() })
}

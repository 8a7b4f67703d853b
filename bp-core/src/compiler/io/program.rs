//! A network as a Bayesian Program.
//!
//! In: a model of finite variables. Out: its text. Invariant: it reads back as the same variables, values and numbers;
//! names that are not words of the language are quoted.

use super::finite::Node;
use crate::error::Error;
use crate::model::Model;
use crate::spelling::quoted;
use std::fmt::Write;

/// The text of a model: each table written out.
///
/// # Errors
/// A variable that is not finite, or a form without a table.
pub(in crate::compiler::io) fn write(model: &Model, nodes: &[Node<'_>]) -> Result<String, Error> {
    let names: Vec<_> = nodes.iter().map(|node| quoted(node.name)).collect();
    let spelled: Vec<Vec<String>> = (model.variables.values().zip(nodes))
        .map(|(variable, node)| {
            (0..node.states.len()).map(|ordinal| variable.domain.value_spelled(ordinal)).collect()
        })
        .collect();
    let heads: Vec<String> = (nodes.iter().zip(&names))
        .map(|(node, name)| {
            let parents: Vec<_> = node.parents.iter().map(|parent| names[*parent].as_ref()).collect();
            let bar = if parents.is_empty() { "" } else { " | " };
            format!("P({name}{bar}{})", parents.join(" "))
        })
        .collect();
    let mut text = format!("program {} {{\n    variables {{\n", quoted(&model.name));
    for (name, variable) in names.iter().zip(model.variables.values()) {
        let _ = writeln!(text, "        {name} : {};", model.domain_text(&variable.domain));
    }
    text.push_str("    }\n    decomposition {\n");
    for head in &heads {
        let _ = writeln!(text, "        {head}");
    }
    text.push_str("    }\n    forms {\n");
    for (node, head) in nodes.iter().zip(&heads) {
        let rows = node.numbers.chunks_exact(node.states.len().max(1));
        let numbers = |row: &[f64]| row.iter().map(|p| format!("{p:?}")).collect::<Vec<_>>().join(", ");
        if node.parents.is_empty() {
            let _ = writeln!(text, "        {head} = categorical({});", numbers(&node.numbers));
            continue;
        }
        let _ = writeln!(text, "        {head} = table {{");
        let mut ordinals = vec![0usize; node.parents.len()];
        for row in rows {
            let keys: Vec<&str> = (node.parents.iter().zip(&ordinals))
                .map(|(parent, ordinal)| spelled[*parent][*ordinal].as_str())
                .collect();
            let _ = writeln!(text, "            {}: {};", keys.join(", "), numbers(row));
            for (ordinal, parent) in ordinals.iter_mut().zip(&node.parents).rev() {
                *ordinal += 1;
                if *ordinal < nodes[*parent].states.len() {
                    break;
                }
                *ordinal = 0;
            }
        }
        text.push_str("        };\n");
    }
    text.push_str("    }\n}\n");
    Ok(text)
}

//! The writer of Hugin NET.
//!
//! In: a model of finite variables. Out: a text. Invariant: every variable has an identifier of its own.

use crate::error::Error;
use crate::io::finite::Node;
use crate::model::Model;
use std::collections::HashSet;
use std::fmt::Write;

/// The text of a model.
///
/// # Errors
/// A variable that is not finite, or a form without a table.
pub(in crate::compiler::io) fn write(model: &Model, nodes: &[Node<'_>]) -> Result<String, Error> {
    let identifiers = identifiers(nodes.iter().map(|node| node.name));
    let mut text = format!("net\n{{\n    name = {};\n}}\n", quoted(&model.name));
    for (node, identifier) in nodes.iter().zip(&identifiers) {
        let states: Vec<_> = node.states.iter().map(|state| quoted(state)).collect();
        let _ = write!(text, "node {identifier}\n{{\n    states = ({});\n", states.join(" "));
        if identifier != node.name {
            let _ = writeln!(text, "    label = {0};\n    bp_name = {0};", quoted(node.name));
        }
        text.push_str("}\n");
    }
    for (node, identifier) in nodes.iter().zip(&identifiers) {
        let parents: Vec<&str> = node.parents.iter().map(|parent| identifiers[*parent].as_str()).collect();
        let bar = if parents.is_empty() { "" } else { " | " };
        let _ = write!(text, "potential ({identifier}{bar}{})\n{{\n    data = (", parents.join(" "));
        // A bracket is opened before a row for each parent that is at its first value, and closed after it.
        let sizes: Vec<usize> = node.parents.iter().map(|parent| nodes[*parent].states.len()).collect();
        for (row, numbers) in node.numbers.chunks_exact(node.states.len()).enumerate() {
            let (mut block, mut opens, mut closes) = (1, 0, 0);
            for size in sizes.iter().rev() {
                opens += usize::from(row % block == 0);
                closes += usize::from((row + 1) % block == 0);
                block *= size;
            }
            let numbers: Vec<_> = numbers.iter().map(|p| format!("{p:?}")).collect();
            text.push_str(if row > 0 { "\n            " } else { "" });
            let _ = write!(text, "{}{}{}", "(".repeat(opens), numbers.join(" "), ")".repeat(closes));
        }
        text.push_str(");\n}\n");
    }
    Ok(text)
}

/// An identifier for each name: the name itself if it is one.
fn identifiers<'n>(names: impl Iterator<Item = &'n str> + Clone) -> Vec<String> {
    const KEPT: [&str; 9] =
        ["net", "node", "potential", "class", "discrete", "continuous", "decision", "utility", "function"];
    let is = |name: &str| {
        let mut letters = name.chars();
        letters.next().is_some_and(|first| first.is_ascii_alphabetic() || first == '_')
            && letters.all(|letter| letter.is_ascii_alphanumeric() || letter == '_')
            && !KEPT.contains(&name)
    };
    let mut taken: HashSet<String> = names.clone().filter(|name| is(name)).map(str::to_owned).collect();
    let mut count = 0;
    names
        .map(|name| {
            if is(name) {
                return name.to_owned();
            }
            let base: String = name
                .chars()
                .map(|letter| if letter.is_ascii_alphanumeric() { letter } else { '_' })
                .collect();
            let mut identifier = format!("n_{base}");
            while !taken.insert(identifier.clone()) {
                count += 1;
                identifier = format!("n_{base}_{count}");
            }
            identifier
        })
        .collect()
}

fn quoted(name: &str) -> String {
    format!("\"{}\"", name.replace('\\', "\\\\").replace('"', "\\\""))
}

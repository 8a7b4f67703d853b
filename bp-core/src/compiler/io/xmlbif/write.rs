//! The writer of XMLBIF 0.3.
//!
//! In: a model of finite variables. Out: a text. Invariant: names that XML cannot hold, or whose blanks it would lose, are
//! an error.

use crate::error::Error;
use crate::io::finite::Node;
use crate::model::Model;
use crate::xml::escaped;
use std::fmt::Write;

/// The text of a model.
///
/// # Errors
/// A variable that is not finite, a form without a table, a name with control characters or blanks around it.
pub(in crate::compiler::io) fn write(model: &Model, nodes: &[Node<'_>]) -> Result<String, Error> {
    let mut text = format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<BIF VERSION=\"0.3\">\n<NETWORK>\n<NAME>{}</NAME>\n",
        name(&model.name)?
    );
    for node in nodes {
        let _ = writeln!(text, "<VARIABLE TYPE=\"nature\">\n  <NAME>{}</NAME>", name(node.name)?);
        for state in &node.states {
            let _ = writeln!(text, "  <OUTCOME>{}</OUTCOME>", name(state)?);
        }
        text.push_str("</VARIABLE>\n");
    }
    for node in nodes {
        let _ = writeln!(text, "<DEFINITION>\n  <FOR>{}</FOR>", name(node.name)?);
        for parent in &node.parents {
            let _ = writeln!(text, "  <GIVEN>{}</GIVEN>", name(nodes[*parent].name)?);
        }
        text.push_str("  <TABLE>\n");
        for row in node.numbers.chunks_exact(node.states.len()) {
            let numbers: Vec<_> = row.iter().map(|p| format!("{p:?}")).collect();
            let _ = writeln!(text, "    {}", numbers.join(" "));
        }
        text.push_str("  </TABLE>\n</DEFINITION>\n");
    }
    text.push_str("</NETWORK>\n</BIF>\n");
    Ok(text)
}

fn name(name: &str) -> Result<String, Error> {
    let odd = |letter: char| letter.is_control() || matches!(letter, '\u{fffe}' | '\u{ffff}');
    match name.contains(odd) || name.trim() != name {
        true => Err(Error::input(
            name,
            "a name in XML cannot contain control characters or surrounding blanks; rename it",
        )),
        false => Ok(escaped(name)),
    }
}

//! Names of emitted things.
//!
//! In: names of buffers, sizes and questions. Out: Rust identifiers. Invariant: `P(O | Z)` is `p_o_z`,
//! `previous V` is `previous_v`, `Sensors[i].reading` is `sensors_i_reading`; words that Rust keeps get a `_`. Two
//! names that would be one identifier are an error, never broken Rust.

use crate::error::Error;
use crate::ids::{BufferId, Id};
use crate::kernel::{Extent, Kernel, Role};
use std::collections::HashMap;

/// The keywords of Rust 2024, those that it only keeps for later included; `Self` is `self` in snake case.
const KEPT: [&str; 51] = [
    "abstract", "as", "async", "await", "become", "box", "break", "const", "continue", "crate", "do", "dyn",
    "else", "enum", "extern", "false", "final", "fn", "for", "gen", "if", "impl", "in", "let", "loop",
    "macro", "match", "mod", "move", "mut", "override", "priv", "pub", "ref", "return", "self", "static",
    "struct", "super", "trait", "true", "try", "type", "typeof", "unsafe", "unsized", "use", "virtual",
    "where", "while", "yield",
];

/// Identifiers of one place, and the names that they come from.
#[derive(Default)]
pub(super) struct Taken(HashMap<String, String>);

impl Taken {
    /// Takes an identifier for a name.
    ///
    /// # Errors
    /// Another name has it.
    pub(super) fn take(&mut self, identifier: String, name: &str) -> Result<(), Error> {
        match self.0.get(&identifier) {
            Some(first) => Err(Error::SameName { first: first.clone(), second: name.to_owned(), identifier }),
            None => {
                self.0.insert(identifier, name.to_owned());
                Ok(())
            }
        }
    }
}

/// A name in snake case.
pub fn snake(name: &str) -> String {
    let mut snake = String::new();
    let mut previous_lower = false;
    for character in name.chars() {
        if character.is_alphanumeric() {
            if character.is_uppercase() && previous_lower {
                snake.push('_');
            }
            snake.extend(character.to_lowercase());
            previous_lower = character.is_lowercase() || character.is_numeric();
        } else {
            if !snake.ends_with('_') && !snake.is_empty() {
                snake.push('_');
            }
            previous_lower = false;
        }
    }
    let mut snake = snake.trim_end_matches('_').to_owned();
    // What an author wrote at the end stays; what stands for a bracket goes.
    let underscores = name.len() - name.trim_end_matches('_').len();
    snake.push_str(&"_".repeat(underscores));
    match snake.chars().next() {
        None => "nameless".to_owned(),
        Some(first) if first.is_numeric() => format!("_{snake}"),
        // `_` alone is no name.
        Some('_') if snake == "_" => "__".to_owned(),
        _ if KEPT.contains(&snake.as_str()) => format!("{snake}_"),
        _ => snake,
    }
}

/// How an input is given.
pub(super) enum Given {
    /// A field of the inputs, one number.
    Number(String),
    /// A field of the inputs, a slice.
    Slice(String),
    /// An expression of other fields.
    Derived(String),
}

/// How a buffer of the host is given.
pub(super) fn given(kernel: &Kernel, id: BufferId) -> Given {
    let buffer = &kernel.buffers[id];
    if let Some(grid) = buffer.name.strip_suffix(".wraps") {
        return Given::Derived(format!("if inputs.{}.wraps() {{ T::ONE }} else {{ T::ZERO }}", snake(grid)));
    }
    if let (Role::Positions, Some((set, part))) = (&buffer.role, buffer.name.split_once(" from ")) {
        return Given::Derived(match set.strip_suffix(" step") {
            Some(grid) => format!("&inputs.{}.steps().{part}", snake(grid)),
            None => format!("&inputs.{}.{part}", snake(set)),
        });
    }
    match buffer.axes.is_empty() {
        true => Given::Number(snake(&buffer.name)),
        false => Given::Slice(snake(&buffer.name)),
    }
}

/// The sets and sizes that the host gives: (field, type, what it is).
pub(super) fn sizes(kernel: &Kernel) -> Vec<(String, &'static str, String)> {
    let mut fields: Vec<(String, &'static str, String)> = Vec::new();
    for size in kernel.sizes() {
        let field = match size.split_once('.') {
            Some((grid, _)) => (snake(grid), "&'a ::bp_core::space::Space", format!("The grid `{grid}`.")),
            None if is_displacements(kernel, size) => (
                snake(size),
                "&'a ::bp_core::space::Moves",
                format!("Where the displacements `{size}` come from."),
            ),
            None => (snake(size), "usize", format!("How many `{size}` there are.")),
        };
        if !fields.contains(&field) {
            fields.push(field);
        }
    }
    fields
}

fn is_displacements(kernel: &Kernel, size: &str) -> bool {
    kernel.buffer(&format!("{size} from depth")).is_some()
}

/// An extent, as an expression of the inputs.
pub(super) fn extent(kernel: &Kernel, extent: &Extent) -> String {
    let Some(size) = &extent.size else { return extent.offset.to_string() };
    let field = match size.split_once('.') {
        Some((grid, part)) => {
            let axis = ["depth", "rows", "lanes"].iter().position(|known| *known == part).unwrap_or(0);
            format!("inputs.{}.extents()[{axis}]", snake(grid))
        }
        None if is_displacements(kernel, size) => format!("inputs.{}.displacements", snake(size)),
        None => format!("inputs.{}", snake(size)),
    };
    match extent.offset {
        0 => field,
        more if more > 0 => format!("{field} + {more}"),
        less => format!("{field}.saturating_sub({})", -less),
    }
}

/// A local name.
pub(super) fn local(prefix: &str, id: impl Id) -> String {
    format!("{prefix}{}", id.position())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_identifiers() {
        let cases = [
            ("P(O | Z)", "p_o_z"),
            ("WetGrass", "wet_grass"),
            ("Sensors[i].reading", "sensors_i_reading"),
            ("O^-1", "o_1"),
            ("crate", "crate_"),
            ("crate_", "crate_"),
            ("Self", "self_"),
            ("gen", "gen_"),
            ("async", "async_"),
            ("rate_", "rate_"),
            ("__", "__"),
            ("_", "__"),
            ("2nd", "_2nd"),
            ("()", "nameless"),
        ];
        for (name, identifier) in cases {
            assert_eq!(snake(name), identifier, "{name}");
        }
    }

    #[test]
    fn an_identifier_is_taken_once() {
        let mut taken = Taken::default();
        taken.take(snake("rain"), "rain").unwrap();
        let error = taken.take(snake("Rain"), "Rain").unwrap_err();
        assert_eq!(
            error.to_string(),
            "`rain` and `Rain` would both be called `rain` in Rust; rename one of them"
        );
    }
}

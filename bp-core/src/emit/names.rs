//! Names of emitted things.
//!
//! In: names of buffers, sizes and questions. Out: Rust identifiers. Invariant: `P(O | Z)` is `p_o_z`,
//! `previous V` is `previous_v`, `Sensors[i].reading` is `sensors_i_reading`; words that Rust keeps get a `_`.

use crate::ids::{BufferId, Id};
use crate::kernel::{Extent, Kernel, Role};

const KEPT: [&str; 21] = [
    "as", "box", "const", "dyn", "else", "enum", "fn", "for", "if", "impl", "in", "let", "loop", "match",
    "mod", "move", "ref", "self", "type", "use", "where",
];

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
    let snake = snake.trim_end_matches('_').to_owned();
    if KEPT.contains(&snake.as_str()) { format!("{snake}_") } else { snake }
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

//! The brace layout for a terminal.
//!
//! In: a sheet in Unicode. Out: lines of at most 80 columns. Invariant: a brace spans the lines of its parts, and its
//! name stands at its middle.

use super::{Line, Part, Sheet};
use crate::wrap::{self, columns, filled};

impl Sheet {
    /// The layout as text, with the network as a list of arrows; the sheet must be in Unicode.
    pub fn text(&self) -> String {
        let mut page = match self.documentation.is_empty() {
            true => format!("{}\n", self.name),
            false => {
                wrap::wrapped("", &format!("{}: {}", self.name, self.documentation.replace('\n', " ")), 2)
            }
        };
        page.push('\n');
        for line in layout(&self.whole, wrap::WIDTH) {
            page.push_str(line.trim_end());
            page.push('\n');
        }
        let arrows = self.arrows();
        if !arrows.is_empty() {
            page.push_str("\nNetwork\n");
            arrows.iter().for_each(|line| page.push_str(&wrap::wrapped("  ", line, 4)));
        }
        if !self.missing.is_empty() {
            page.push_str("\nMissing\n");
            self.missing.iter().for_each(|line| page.push_str(&wrap::wrapped("  - ", line, 4)));
        }
        page
    }

    /// `Rain → Sprinkler, Wet`: each variable with those that depend on it.
    fn arrows(&self) -> Vec<String> {
        let name = |at: usize| {
            let node = &self.network.nodes[at];
            let index = node.index.as_ref().map_or_else(String::new, |index| format!("[{index}]"));
            format!("{}{}{index}", node.name, if node.previous { "⁻¹" } else { "" })
        };
        let mut lines = Vec::new();
        for from in 0..self.network.nodes.len() {
            let children = self.network.edges.iter().filter(|(parent, _)| *parent == from);
            let children: Vec<String> = children.map(|(_, child)| name(*child)).collect();
            if !children.is_empty() {
                lines.push(format!("{} → {}", name(from), children.join(", ")));
            }
        }
        lines
    }
}

/// The lines of a part within a width.
pub(super) fn layout(part: &Part, width: usize) -> Vec<String> {
    match part {
        Part::Lines(title, lines) => {
            let mut shown = vec![format!("{title}:")];
            shown.extend(lines.iter().flat_map(|line| broken(line, width)));
            shown
        }
        Part::Brace(title, parts) => {
            let before = columns(title) + 3;
            let mut inside: Vec<String> =
                parts.iter().flat_map(|part| layout(part, width.saturating_sub(before))).collect();
            while inside.len() < 3 {
                inside.push(String::new());
            }
            let (middle, last) = (inside.len() / 2, inside.len() - 1);
            let brace = |at: usize| match at {
                0 => '⎧',
                _ if at == middle => '⎨',
                _ if at == last => '⎩',
                _ => '⎪',
            };
            (inside.iter().enumerate())
                .map(|(at, line)| {
                    let name = filled(if at == middle { title } else { "" }, columns(title));
                    format!("{name} {} {line}", brace(at))
                })
                .collect()
        }
    }
}

/// A line in lines of a width, the others indented further.
pub(super) fn broken(line: &Line, width: usize) -> Vec<String> {
    let first = " ".repeat(2 + 2 * line.depth);
    let hang = " ".repeat(4 + 2 * line.depth);
    let (mut lines, mut current) = (Vec::new(), first);
    let mut empty = true;
    for piece in pieces(&line.mathematics) {
        let mut piece = piece;
        if !empty && columns(&current) + 1 + columns(&piece) > width {
            lines.push(std::mem::replace(&mut current, hang.clone()));
            empty = true;
        }
        // A piece that no line holds is broken at its least nested blank, or where the line ends.
        while columns(&current) + 1 + columns(&piece) > width && columns(&piece) > 8 {
            let room = width.saturating_sub(columns(&current)).max(8);
            let fits: String = piece.chars().take(room).collect();
            let cut = least_nested(&fits).map_or(fits.len(), |blank| blank + 1);
            if piece.len() <= cut {
                break;
            }
            current.push_str(piece[..cut].trim_end());
            piece = piece[cut..].to_owned();
            lines.push(std::mem::replace(&mut current, hang.clone()));
        }
        if !empty {
            current.push(' ');
        }
        current.push_str(&piece);
        empty = false;
    }
    lines.push(current);
    lines
}

/// The last of the blanks within the fewest brackets.
fn least_nested(text: &str) -> Option<usize> {
    let (mut depth, mut best) = (0_usize, None);
    for (at, letter) in text.char_indices() {
        match letter {
            '(' | '[' | '{' => depth += 1,
            ')' | ']' | '}' => depth = depth.saturating_sub(1),
            ' ' if best.is_none_or(|(fewest, _)| depth <= fewest) => best = Some((depth, at)),
            _ => {}
        }
    }
    best.map(|(_, at)| at)
}

/// The pieces of a line, between which it can be broken: not within `P(…)` or the brackets of a call.
fn pieces(text: &str) -> Vec<String> {
    let (mut pieces, mut piece) = (Vec::new(), String::new());
    let mut depth = 0_usize;
    for letter in text.chars() {
        match letter {
            '(' | '[' | '{' => depth += 1,
            ')' | ']' | '}' => depth = depth.saturating_sub(1),
            _ => {}
        }
        match letter == ' ' && depth == 0 {
            true => pieces.push(std::mem::take(&mut piece)),
            false => piece.push(letter),
        }
    }
    pieces.push(piece);
    pieces
}

//! The frame of a pass as Rust: rows of the plate, blocks of lanes in them, and the memory of a block.
//!
//! In: the statements of a block. Out: the body of `Pass::piece`, and the outer names in it. Invariant: memory is allocated
//! once, before the loops.

use super::print::{self, expression, name};
use super::text::Text;
use crate::ids::{AxisId, BufferId, Id};
use crate::kernel::{Kernel, Role};
use crate::loops::{Expression, Local, Of, Statement};
use std::collections::BTreeMap;

/// The lanes of a block of a plate without rows, if arrays are passed between nests.
const SHORT_BLOCK: usize = 128;

/// Allocations outside the loops of a pass.
pub(super) enum Room {
    /// A block of lanes.
    Block,
    /// This number of contiguous blocks, aligned to a cache line.
    Blocks(Expression),
    /// An array of this length.
    Array { of: &'static str, count: Expression },
}

impl Room {
    fn write(&self, name: &str, text: &mut Text) {
        match self {
            Self::Block => text.line(format!("let mut {name} = Aligned([T::ZERO; LANES]);")),
            Self::Blocks(count) => {
                let count = expression(count);
                text.line(format!("let mut {name} = ::std::vec![T::ZERO; {count} * LANES + LINE];"));
                text.line(format!("let {name}: &mut [T] = on_a_line(&mut {name});"));
            }
            Self::Array { of, count } => {
                text.line(format!("let mut {name} = ::std::vec![{of}; {}];", expression(count)));
            }
        }
    }
}

/// One pass over blocks of lanes.
pub(super) struct Blocks {
    pub(super) is_short: bool,
    pub(super) rooms: BTreeMap<Local, Room>,
    /// The buffers of which a piece computes a part.
    pub(super) shared: Vec<BufferId>,
    /// The axes of the plate, the lanes' last.
    pub(super) axes: Vec<AxisId>,
    pub(super) before: String,
    pub(super) items: Vec<Statement>,
    pub(super) after: String,
}

impl Blocks {
    fn lane(&self) -> (AxisId, &[AxisId]) {
        let (lane, rows) = self.axes.split_last().expect("internal: a parallel group has axes");
        (*lane, rows)
    }

    /// The allocations, in the order of their names.
    fn rooms(&self) -> Vec<(String, &Room)> {
        let mut rooms: Vec<(String, &Room)> =
            self.rooms.iter().map(|(local, room)| (name(local), room)).collect();
        rooms.sort_by(|left, right| left.0.cmp(&right.0));
        rooms
    }

    /// Writes the body of the pass.
    pub(super) fn write(&self, text: &mut Text) {
        if self.is_short {
            text.line(format!("const LANES: usize = {SHORT_BLOCK};"));
        }
        self.rooms().iter().for_each(|(name, room)| room.write(name, text));
        let names: Vec<String> = self.shared.iter().map(|out| name(&Of::Planes(*out).into())).collect();
        text.line(format!(
            "let [{}] = planes else {{ ::core::unreachable!(\"internal: a part of each\") }};",
            names.join(", ")
        ));
        let (lane, rows) = self.lane();
        let extent = name(&Of::Extent(lane).into());
        let (row_range, first, end) = match rows.is_empty() {
            true => ("0..1", "first", "first + count"),
            false => ("first..first + count", "0", extent.as_str()),
        };
        text.line(&self.before);
        text.open(format!("for row in {row_range}"));
        text.line("let mut rest = row;");
        for axis in rows.iter().rev() {
            text.line(format!("let i{0} = rest % e{0}; rest /= e{0};", axis.position()));
        }
        text.line(format!("let mut start: usize = {first};"));
        text.open(format!("while start < {end}"));
        text.line(format!("let width = LANES.min({end} - start);"));
        text.line("let filled = LANES.min(width.next_multiple_of(LINE));");
        text.line(match rows.is_empty() {
            true => "let place = start - first;".to_owned(),
            false => format!("let place = (row - first) * {extent} + start;"),
        });
        print::statements(&self.items, text);
        text.line("start += LANES;");
        text.close();
        text.close();
        text.line(&self.after);
        text.line("suspects");
    }

    /// The outer names used in a pass, and their types, in the order of the text.
    pub(super) fn captured(&self, kernel: &Kernel, made: &[BufferId]) -> Vec<(String, &'static str)> {
        let mut names: Vec<Local> = Vec::new();
        for (_, room) in self.rooms() {
            if let Room::Blocks(count) | Room::Array { count, .. } = room {
                count.names(&mut |name| names.push(name));
            }
        }
        let (lane, rows) = self.lane();
        names.extend(rows.iter().rev().map(|axis| Of::Extent(*axis).into()));
        if !rows.is_empty() {
            names.push(Of::Extent(lane).into());
        }
        self.items.iter().for_each(|item| item.names(&mut |name| names.push(name)));
        let mut fields: Vec<(String, &'static str)> = Vec::new();
        for local in names {
            let kind = match local.of {
                Of::Extent(_) | Of::Stride(..) | Of::IsWhole(_) => "usize",
                Of::Array(id) if !made.contains(&id) => match kernel.buffers[id].role {
                    Role::Positions(..) => "&'g [i32]",
                    Role::Table { .. } => "&'g [f64]",
                    _ => "&'g [T]",
                },
                _ => continue,
            };
            let name = name(&local);
            if !fields.iter().any(|(known, _)| *known == name) {
                fields.push((name, kind));
            }
        }
        fields
    }
}

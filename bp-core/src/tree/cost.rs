//! What a tree takes, and whether there is room for it.
//!
//! In: cells. Out: a [`Cost`]; an error that says how much would be needed. Invariant: nothing is allocated that does not
//! fit; on a machine that does not say how much memory it has, eight gigabytes do.

use crate::error::Error;

/// What a tree would take, before it is made.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Cost {
    /// Cells of all cliques.
    pub cells: f64,
    /// Variables of the largest clique.
    pub width: usize,
    /// Bytes of working memory.
    pub bytes: f64,
}

/// Bytes for each cell: the cell itself, its share of the messages, and where they are read.
const BYTES: f64 = 10.0;

impl Cost {
    /// The cost of some cells.
    pub(super) fn of(cells: f64, width: usize) -> Self {
        Self { cells, width, bytes: BYTES * cells }
    }

    /// Both together.
    pub(super) fn and(self, other: Self) -> Self {
        Self::of(self.cells + other.cells, self.width.max(other.width))
    }

    /// Refuses what does not fit.
    pub(super) fn fits(self) -> Result<(), Error> {
        let most = free_memory() / BYTES;
        match self.cells <= most {
            true => Ok(()),
            false => Err(Error::TooLarge {
                name: "the junction tree".to_owned(),
                cells: self.cells,
                most: most.floor(),
                help: "observe more variables, ask for fewer of them, or estimate by sampling".to_owned(),
            }),
        }
    }
}

/// The bytes that the machine can still give, as Linux tells it.
fn free_memory() -> f64 {
    let told = std::fs::read_to_string("/proc/meminfo").ok().and_then(|text| {
        let line = text.lines().find_map(|line| line.strip_prefix("MemAvailable:"))?;
        Some(line.split_whitespace().next()?.parse::<f64>().ok()? * 1024.0)
    });
    told.unwrap_or(8e9)
}

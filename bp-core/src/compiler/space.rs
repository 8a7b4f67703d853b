//! Spaces: grids of cells, and displacements on them.
//!
//! In: three extents and the behaviour of each axis at its ends. Out: tables of the antecedent cell of each
//! displacement, which kernels read as positions. Invariant: a displacement moves all cells of a row equally along the
//! last axis, so that a gather along it is a rotation of contiguous memory.
//!
//! The axes are (depth, row, lane); the Bayesian Volumetric Map uses them as (log ρ, φ, θ).

use serde::{Deserialize, Serialize};

/// The behaviour of an axis at its ends.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
pub enum Edge {
    /// Cells beyond the ends are outside.
    Open,
    /// The ends meet. Only for lanes.
    Circle,
    /// Only for rows: a displacement beyond an end continues on the other side, half a turn further along the lanes.
    Pole,
}

/// A grid of cells.
#[derive(Clone, PartialEq, Eq, Debug, Serialize, Deserialize)]
pub struct Space {
    extents: [usize; 3],
    edges: [Edge; 3],
    steps: Moves,
}

/// An invalid space.
#[derive(Clone, Copy, PartialEq, Eq, Debug, thiserror::Error)]
pub enum SpaceError {
    /// An axis without cells.
    #[error("axis {0} of the grid has no cells")]
    Empty(usize),
    /// An axis with an invalid kind of ends.
    #[error("axis {0} of the grid cannot have {1:?} ends")]
    Edge(usize, Edge),
    /// Poles need an even number of lanes.
    #[error("a grid with poles needs an even number of cells around, but it has {0}")]
    OddLanes(usize),
}

impl Space {
    /// A space of (depth, row, lane) cells.
    ///
    /// # Errors
    /// No cells along an axis; a circle that is not along the lanes; a pole that is not along the rows, or over
    /// an odd number of lanes.
    pub fn new(extents: [usize; 3], edges: [Edge; 3]) -> Result<Self, SpaceError> {
        if let Some(axis) = extents.iter().position(|extent| *extent == 0) {
            return Err(SpaceError::Empty(axis));
        }
        let allowed = [&[Edge::Open][..], &[Edge::Open, Edge::Pole], &[Edge::Open, Edge::Circle]];
        if let Some(axis) = (0..3).find(|axis| !allowed[*axis].contains(&edges[*axis])) {
            return Err(SpaceError::Edge(axis, edges[axis]));
        }
        if edges[1] == Edge::Pole && !extents[2].is_multiple_of(2) {
            return Err(SpaceError::OddLanes(extents[2]));
        }
        let [depth, _, lane] = edges;
        let steps = antecedents(extents, [depth, Edge::Open, lane], &[[1, 0, 0], [0, 1, 0], [0, 0, 1]]);
        Ok(Self { extents, edges, steps })
    }

    /// Cells along (depth, row, lane).
    pub fn extents(&self) -> [usize; 3] {
        self.extents
    }

    /// Number of cells.
    pub fn cells(&self) -> usize {
        self.extents.iter().product()
    }

    /// Whether the last axis is periodic.
    pub fn wraps(&self) -> bool {
        self.edges[2] == Edge::Circle
    }

    /// The antecedents of each displacement: for a cell c and displacement v, the cell c − v.
    pub fn antecedents(&self, displacements: &[[i32; 3]]) -> Moves {
        antecedents(self.extents, self.edges, displacements)
    }

    /// The contiguous cell along the negative direction of each axis, as differences are taken over it (paper,
    /// Eq. 6). A pole is an end here: there is no cell below the lowest row.
    pub fn steps(&self) -> &Moves {
        &self.steps
    }
}

fn antecedents([depths, rows, lanes]: [usize; 3], edges: [Edge; 3], displacements: &[[i32; 3]]) -> Moves {
    let count = displacements.len() * depths * rows;
    let mut moves = Moves {
        depth: Vec::with_capacity(count),
        row: Vec::with_capacity(count),
        turn: Vec::with_capacity(count),
        displacements: displacements.len(),
    };
    let (depths, rows, lanes) = (depths as i32, rows as i32, lanes as i32);
    for displacement in displacements {
        for (depth, row) in (0..depths).flat_map(|depth| (0..rows).map(move |row| (depth, row))) {
            let depth = depth - displacement[0];
            let (mut row, mut turn) = (row - displacement[1], -displacement[2]);
            if edges[1] == Edge::Pole && !(0..rows).contains(&row) {
                row = if row < 0 { -1 - row } else { 2 * rows - 1 - row };
                turn += lanes / 2;
            }
            let inside = (0..depths).contains(&depth) && (0..rows).contains(&row);
            moves.depth.push(if inside { depth } else { -1 });
            moves.row.push(if inside { row } else { -1 });
            moves.turn.push(turn);
        }
    }
    moves
}

/// The antecedents of displacements; each table is \[displacement\]\[depth\]\[row\].
#[derive(Clone, PartialEq, Eq, Debug, Serialize, Deserialize)]
pub struct Moves {
    /// Depth of the antecedent, −1 outside.
    pub depth: Vec<i32>,
    /// Row of the antecedent, −1 outside.
    pub row: Vec<i32>,
    /// The offset of the antecedent's lane.
    pub turn: Vec<i32>,
    /// The number of displacements.
    pub displacements: usize,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cell_comes_from_where_its_content_was() {
        let space = Space::new([2, 3, 4], [Edge::Open, Edge::Pole, Edge::Circle]).unwrap();
        let moves = space.antecedents(&[[0, 0, 0], [1, 0, 0], [0, 1, 1], [0, -1, 0]]);
        let at = |displacement: usize, depth: usize, row: usize| {
            let position = (displacement * 2 + depth) * 3 + row;
            (moves.depth[position], moves.row[position], moves.turn[position])
        };
        assert_eq!(at(0, 1, 2), (1, 2, 0));
        assert_eq!(at(1, 1, 2), (0, 2, 0));
        assert_eq!(at(1, 0, 2), (-1, -1, 0), "nearer than the first cell is outside");
        assert_eq!(at(2, 1, 1), (1, 0, -1));
        assert_eq!(at(2, 1, 0), (1, 0, 1), "over the lower pole: same row, half a turn (2 of 4) on");
        assert_eq!(at(3, 0, 2), (0, 2, 2), "over the upper pole");
    }

    #[test]
    fn spaces_that_cannot_be_are_refused() {
        assert_eq!(Space::new([1, 0, 1], [Edge::Open; 3]), Err(SpaceError::Empty(1)));
        let circle_in_depth = [Edge::Circle, Edge::Open, Edge::Open];
        assert_eq!(Space::new([1, 1, 1], circle_in_depth), Err(SpaceError::Edge(0, Edge::Circle)));
        let poles = [Edge::Open, Edge::Pole, Edge::Circle];
        assert_eq!(Space::new([1, 1, 3], poles), Err(SpaceError::OddLanes(3)));
    }
}

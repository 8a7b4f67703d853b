//! The fastest known loops for the cell program, written by hand for seven velocities: rows that wrap around are copied
//! whole, so that no tile decides where its lanes are; one loop over the lanes of a tile holds all velocities, so that sums
//! stay in registers and each number is stored once.
//!
//! In: as [`crate::hand`]. Out: the same answers; [`compact`]: P(O = 1) and P(V) alone, from one plane of likelihood, in any
//! [`Stored`] type. Invariant: rows of at least [`TILE`] and at most [`LONGEST`] cells.

use crate::hand::Cells;
use bp_core::compiler::space::Moves;

/// Velocities.
pub(crate) const SEVEN: usize = 7;

/// Cells of a row that are processed together.
const TILE: usize = 32;

/// The longest row.
const LONGEST: usize = 512;

/// A number in memory; the loops compute in f32.
pub(crate) trait Stored: Copy + Default + Send + Sync + std::fmt::Debug {
    fn number(self) -> f32;
    /// The nearest number of the type; halves to even.
    fn nearest(number: f32) -> Self;
}

impl Stored for f32 {
    #[inline(always)]
    fn number(self) -> f32 {
        self
    }
    #[inline(always)]
    fn nearest(number: f32) -> Self {
        number
    }
}

/// Whole parts of 65535.
impl Stored for u16 {
    #[inline(always)]
    fn number(self) -> f32 {
        f32::from(self) * (1.0 / 65535.0)
    }
    #[inline(always)]
    fn nearest(number: f32) -> Self {
        // The sum rounds to a whole number, which stands in its low bits.
        (number * 65535.0 + 12_582_912.0).to_bits() as u16
    }
}

/// The antecedents of one row for one velocity: their first cell and the lane at which they begin; nothing outside the grid.
#[inline(always)]
fn antecedents(
    moves: &Moves,
    [depths, rows, lanes]: [usize; 3],
    velocity: usize,
    row: usize,
) -> Option<[usize; 2]> {
    let table = velocity * depths * rows + row;
    let (depth, from) = (moves.depth[table], moves.row[table]);
    let turn = moves.turn[table].rem_euclid(lanes as i32) as usize;
    (depth >= 0 && from >= 0).then(|| [(depth as usize * rows + from as usize) * lanes, turn])
}

/// A row from lane `turn` on, wrapped.
#[inline(always)]
fn turned<'s, S: Copy>(row: &'s [S], turn: usize, copy: &'s mut [S; LONGEST]) -> &'s [S] {
    if turn == 0 {
        return row;
    }
    let (start, end) = row.split_at(turn);
    copy[..end.len()].copy_from_slice(end);
    copy[end.len()..row.len()].copy_from_slice(start);
    &copy[..row.len()]
}

#[inline(always)]
fn filled<S: Copy>(copy: &mut [S; LONGEST], lanes: usize, number: S) -> &[S] {
    copy[..lanes].fill(number);
    &copy[..lanes]
}

#[inline(always)]
fn tile<S>(row: &[S], at: usize) -> &[S; TILE] {
    row[at..].first_chunk().expect("internal: a whole tile")
}

/// [`crate::hand::step`].
#[inline(always)]
pub(crate) fn step(cells: &Cells<'_>, first: usize, made: &mut [&mut [f32]]) {
    let [depths, rows, lanes] = cells.extents;
    let plane = depths * rows * lanes;
    let stays = 1.0 - cells.epsilon;
    let mut copies = [[[0.0f32; LONGEST]; 3]; SEVEN];
    for row in 0..made[0].len() / lanes {
        let here = (first + row) * lanes;
        let mut copies = copies.iter_mut();
        let sources: [[&[f32]; 3]; SEVEN] = std::array::from_fn(|velocity| {
            let [empty, full, before] = copies.next().expect("internal: room for each");
            match antecedents(cells.moves, cells.extents, velocity, first + row) {
                Some([base, turn]) => {
                    let read =
                        |array: &[f32], plane: usize| plane + base..(plane + base + lanes).min(array.len());
                    [
                        turned(&cells.occupancy[read(cells.occupancy, 0)], turn, empty),
                        turned(&cells.occupancy[read(cells.occupancy, plane)], turn, full),
                        turned(&cells.velocity[read(cells.velocity, velocity * plane)], turn, before),
                    ]
                }
                None => [
                    filled(empty, lanes, 0.5),
                    filled(full, lanes, 0.5),
                    filled(before, lanes, cells.motion[velocity]),
                ],
            }
        });
        let likelihood = [0, plane].map(|from| &cells.likelihood[from + here..from + here + lanes]);
        // The last tile overlaps with the one before.
        for at in (0..lanes).step_by(TILE).map(|at| at.min(lanes - TILE)) {
            let sources = sources.map(|rows| rows.map(|row| tile(row, at)));
            let likelihood = likelihood.map(|row| tile(row, at));
            let (mut occupied, mut marginals) = ([[0.0f32; TILE]; 2], [[0.0f32; TILE]; SEVEN]);
            for lane in 0..TILE {
                let (mut sums, mut marginal) = ([0.0f32; 2], [0.0f32; SEVEN]);
                for (marginal, [empty, full, before]) in marginal.iter_mut().zip(&sources) {
                    let (empty, full, before) = (empty[lane], full[lane], before[lane]);
                    let joint = [
                        likelihood[0][lane] * before * (stays * empty + cells.epsilon * full),
                        likelihood[1][lane] * before * (cells.epsilon * empty + stays * full),
                    ];
                    sums[0] += joint[0];
                    sums[1] += joint[1];
                    *marginal = joint[0] + joint[1];
                }
                let scale = 1.0 / (sums[0] + sums[1]);
                (occupied[0][lane], occupied[1][lane]) = (sums[0] * scale, sums[1] * scale);
                for (tile, marginal) in marginals.iter_mut().zip(marginal) {
                    tile[lane] = marginal * scale;
                }
            }
            let to = row * lanes + at;
            for (plane, tile) in made.iter_mut().zip(occupied.iter().chain(&marginals)) {
                plane[to..to + TILE].copy_from_slice(tile);
            }
        }
    }
}

/// A compact state: P(O = 1), P(V) by plane, and the likelihood that the cell is occupied, of the two together.
pub(crate) struct Compact<'a, S> {
    pub(crate) extents: [usize; 3],
    pub(crate) moves: &'a Moves,
    pub(crate) epsilon: f32,
    pub(crate) motion: &'a [f32],
    pub(crate) occupied: &'a [S],
    pub(crate) velocity: &'a [S],
    pub(crate) likelihood: &'a [S],
    /// The planes of the answer.
    pub(crate) made: [&'a mut [S]; 1 + SEVEN],
}

impl<S: Stored> pulp::NullaryFnOnce for Compact<'_, S> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        compact(self);
    }
}

/// The step with a compact state.
#[inline(always)]
fn compact<S: Stored>(cells: Compact<'_, S>) {
    let Compact { extents, moves, epsilon, motion, occupied, velocity, likelihood, mut made } = cells;
    let [depths, rows, lanes] = extents;
    let plane = depths * rows * lanes;
    let changes = 1.0 - 2.0 * epsilon;
    let mut copies = [[[S::default(); LONGEST]; 2]; SEVEN];
    for row in 0..depths * rows {
        let here = row * lanes;
        let mut copies = copies.iter_mut();
        let sources: [[&[S]; 2]; SEVEN] = std::array::from_fn(|moved| {
            let [full, before] = copies.next().expect("internal: room for each");
            match antecedents(moves, extents, moved, row) {
                Some([base, turn]) => [
                    turned(&occupied[base..base + lanes], turn, full),
                    turned(&velocity[moved * plane + base..][..lanes], turn, before),
                ],
                None => {
                    [filled(full, lanes, S::nearest(0.5)), filled(before, lanes, S::nearest(motion[moved]))]
                }
            }
        });
        let likelihood = &likelihood[here..here + lanes];
        for at in (0..lanes).step_by(TILE).map(|at| at.min(lanes - TILE)) {
            let sources = sources.map(|rows| rows.map(|row| tile(row, at)));
            let likelihood = tile(likelihood, at);
            let mut tiles = [[S::default(); TILE]; 1 + SEVEN];
            for lane in 0..TILE {
                let (mut total, mut full, mut marginal) = (0.0f32, 0.0f32, [0.0f32; SEVEN]);
                let if_full = likelihood[lane].number();
                let if_empty = 1.0 - if_full;
                for (marginal, [occupied, before]) in marginal.iter_mut().zip(&sources) {
                    let before = before[lane].number();
                    let stays_full = before * (occupied[lane].number() * changes + epsilon);
                    let joint = stays_full * if_full;
                    *marginal = (before - stays_full) * if_empty + joint;
                    full += joint;
                    total += *marginal;
                }
                let scale = 1.0 / total;
                let [first, rest @ ..] = &mut tiles;
                first[lane] = S::nearest(full * scale);
                for (tile, marginal) in rest.iter_mut().zip(marginal) {
                    tile[lane] = S::nearest(marginal * scale);
                }
            }
            for (plane, tile) in made.iter_mut().zip(&tiles) {
                plane[here + at..][..TILE].copy_from_slice(tile);
            }
        }
    }
}

/// Reads 11 planes and writes 9, as the step of nine planes does, with an addition for each number that is read: the time
/// of its streams alone.
pub(crate) struct Streams<'a> {
    pub(crate) read: [&'a [f32]; 11],
    pub(crate) made: [&'a mut [f32]; 9],
}

impl pulp::NullaryFnOnce for Streams<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { read, mut made } = self;
        for at in (0..made[0].len() - TILE + 1).step_by(TILE) {
            let read = read.map(|plane| tile(plane, at));
            let mut sums = [0.0f32; TILE];
            for (lane, sum) in sums.iter_mut().enumerate() {
                *sum = read.iter().map(|tile| tile[lane]).sum();
            }
            made.iter_mut().for_each(|plane| plane[at..at + TILE].copy_from_slice(&sums));
        }
    }
}

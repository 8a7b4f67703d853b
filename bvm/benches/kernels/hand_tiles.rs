//! The fastest known loop for the cell program, written by hand for seven velocities: all of them together, sixteen
//! cells at a time, so that sums stay in registers and each number is stored once.
//!
//! In: as [`crate::hand`]. Out: the same answers. Invariant: rows of at least [`TILE`] and at most [`LONGEST`] cells.

use crate::hand::Cells;
use bp_core::compiler::exec::compiled::Aligned;

/// Velocities.
const SEVEN: usize = 7;

/// Cells of a row that are processed together.
const TILE: usize = 16;

/// The longest row.
const LONGEST: usize = 512;

/// The inputs of the cells of a row: P(O) and P(V) at the antecedent, for each velocity.
struct Sources<'s> {
    empty: [&'s [f32]; SEVEN],
    full: [&'s [f32]; SEVEN],
    velocity: [&'s [f32]; SEVEN],
    likelihood: [&'s [f32]; 2],
}

#[inline(always)]
fn tile(lanes: &[f32], at: usize) -> [f32; TILE] {
    lanes[at..at + TILE].try_into().expect("internal: a whole tile")
}

/// [`crate::hand::step`].
#[inline(always)]
pub(crate) fn step(cells: &Cells<'_>, first: usize, made: &mut [&mut [f32]]) {
    let [depths, rows, lanes] = cells.extents;
    let plane = depths * rows * lanes;
    let constant = [0.5f32; LONGEST];
    let entering: [[f32; LONGEST]; SEVEN] = std::array::from_fn(|velocity| [cells.motion[velocity]; LONGEST]);
    let mut copies = vec![0.0f32; 3 * SEVEN * LONGEST];
    for row in 0..made[0].len() / lanes {
        let here = (first + row) * lanes;
        let mut sources = Sources {
            empty: [&constant[..lanes]; SEVEN],
            full: [&constant[..lanes]; SEVEN],
            velocity: std::array::from_fn(|velocity| &entering[velocity][..lanes]),
            likelihood: [0, plane].map(|from| &cells.likelihood[from + here..from + here + lanes]),
        };
        let mut copies = copies.chunks_exact_mut(LONGEST);
        for velocity in 0..SEVEN {
            let table = velocity * depths * rows + first + row;
            let (depth, from) = (cells.moves.depth[table], cells.moves.row[table]);
            if depth < 0 || from < 0 {
                continue;
            }
            let base = (depth as usize * rows + from as usize) * lanes;
            let turn = cells.moves.turn[table].rem_euclid(lanes as i32) as usize;
            let read = [
                &cells.occupancy[base..base + lanes],
                &cells.occupancy[plane + base..plane + base + lanes],
                &cells.velocity[velocity * plane + base..velocity * plane + base + lanes],
            ]
            .map(|row| match turn {
                0 => row,
                _ => {
                    let copy = &mut copies.next().expect("internal: room for each")[..lanes];
                    copy[..lanes - turn].copy_from_slice(&row[turn..]);
                    copy[lanes - turn..].copy_from_slice(&row[..turn]);
                    copy
                }
            });
            [sources.empty[velocity], sources.full[velocity], sources.velocity[velocity]] = read;
        }
        // The last tile overlaps with the one before.
        for at in (0..lanes).step_by(TILE).map(|at| at.min(lanes - TILE)) {
            step_tile(&sources, at, row * lanes + at, made, cells.epsilon);
        }
    }
}

#[inline(always)]
fn step_tile(sources: &Sources<'_>, at: usize, to: usize, made: &mut [&mut [f32]], epsilon: f32) {
    let stays = 1.0 - epsilon;
    let likelihood = sources.likelihood.map(|row| tile(row, at));
    // Tiles that do not fit in registers are aligned to cache lines.
    let mut sums = [Aligned([0.0f32; TILE]); 2];
    let mut marginals = [Aligned([0.0f32; TILE]); SEVEN];
    for (velocity, marginal) in marginals.iter_mut().enumerate() {
        let (empty, full) = (tile(sources.empty[velocity], at), tile(sources.full[velocity], at));
        let before = tile(sources.velocity[velocity], at);
        for lane in 0..TILE {
            let joint_empty =
                likelihood[0][lane] * before[lane] * (stays * empty[lane] + epsilon * full[lane]);
            let joint_full =
                likelihood[1][lane] * before[lane] * (epsilon * empty[lane] + stays * full[lane]);
            sums[0][lane] += joint_empty;
            sums[1][lane] += joint_full;
            marginal[lane] = joint_empty + joint_full;
        }
    }
    let mut scale = [0.0f32; TILE];
    for lane in 0..TILE {
        scale[lane] = 1.0 / (sums[0][lane] + sums[1][lane]);
    }
    for (plane, tile) in made.iter_mut().zip(sums.iter().chain(&marginals)) {
        let mut scaled = [0.0f32; TILE];
        for lane in 0..TILE {
            scaled[lane] = tile[lane] * scale[lane];
        }
        plane[to..to + TILE].copy_from_slice(&scaled);
    }
}

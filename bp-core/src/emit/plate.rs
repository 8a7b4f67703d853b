//! A nest without a plate, along the axes of what it makes: its cells are as independent as those of a plate.
//!
//! In: a nest. Out: a kernel of that nest alone, with a plate, and its schedule. Invariant: no answer changes; a plate has
//! enough cells to pay for blocks of lanes.
//!
//! Before: `total[x, y] = Σ_b f(x, y, b)`, cell by cell. After: x are rows, shared out among threads, and y lanes.

use crate::kernel::schedule::Schedule;
use crate::kernel::{Kernel, Reduce};

/// Fewer cells are made one by one.
const LEAST_CELLS: usize = 256;

/// Of fewer lanes, too few are worth their block.
const LEAST_LANES: usize = 32;

/// The nest with a plate of its own, if that pays.
pub(super) fn with_plate(kernel: &Kernel, nest: usize) -> Option<(Kernel, Schedule)> {
    let mut alone = Kernel { nests: vec![kernel.nests[nest].clone()], ..kernel.clone() };
    alone.parallel = kernel.buffers[alone.nests[0].out].axes.clone();
    let is_scan = matches!(alone.nests[0].reduce, Reduce::Scan { .. });
    let extents = alone.parallel.iter().map(|axis| kernel.axes[*axis].extent.known());
    let extents: Vec<usize> = extents.collect::<Option<_>>()?;
    let pays = extents.iter().product::<usize>() >= LEAST_CELLS && *extents.last()? >= LEAST_LANES;
    let mut schedule = Schedule::of(&alone);
    // What is made is for other nests.
    schedule.local.fill(false);
    (pays && !is_scan).then_some((alone, schedule))
}

//! Vectorisation of a nest without a plate, along the axes of its result.
//!
//! In: a nest. Out: the axes that can be its plate, and a kernel of that nest with this plate. Invariant: each cell is
//! computed as before; a plate has enough cells for blocks of lanes.
//!
//! Before: `total[x, y] = Σ_b f(x, y, b)`, cell by cell. After: x are rows, shared out among threads, and y lanes.

use super::schedule::{Schedule, reachable};
use super::{Kernel, Node, Reduce, Role};
use crate::ids::AxisId;

/// Fewer cells are computed one by one.
const LEAST_CELLS: usize = 256;

/// Blocks with fewer lanes are not worthwhile.
const LEAST_LANES: usize = 32;

/// The axes along which a nest without a plate is vectorised, if that is worthwhile.
pub(super) fn own_plate(kernel: &Kernel, nest: usize) -> Option<&[AxisId]> {
    let nest = &kernel.nests[nest];
    let axes = kernel.buffers[nest.out].axes.as_slice();
    let lanes = kernel.axes[*axes.last()?].extent.known()?;
    let pays = kernel.known_cells(axes)? >= LEAST_CELLS && lanes >= LEAST_LANES;
    // An input that may be given once for the kernel's own plate is read along no other axis.
    let is_given_once = |node: &Node| match node {
        Node::Load { buffer, .. } => {
            matches!(kernel.buffers[*buffer].role, Role::Input { broadcast: true, .. })
        }
        _ => false,
    };
    let reads_such =
        || reachable(kernel, nest.value).into_iter().any(|value| is_given_once(&kernel.nodes[value]));
    (pays && !matches!(nest.reduce, Reduce::Scan { .. }) && !reads_such()).then_some(axes)
}

/// A single nest, with its own plate and schedule, if that is worthwhile.
pub(crate) fn with_plate(kernel: &Kernel, nest: usize) -> Option<(Kernel, Schedule)> {
    let parallel = own_plate(kernel, nest)?.to_vec();
    let alone = Kernel { nests: vec![kernel.nests[nest].clone()], parallel, ..kernel.clone() };
    let mut schedule = Schedule::of(&alone);
    // The result is for other nests.
    schedule.local.fill(false);
    Some((alone, schedule))
}

#[cfg(test)]
mod tests {
    use super::super::{Extent, Fold, KernelBuilder, OutputKey, Role};
    use super::*;

    /// `out[x, y] = Σ_b (x + y + b)` over these extents.
    fn kernel(rows: usize, lanes: usize) -> Kernel {
        let mut builder = KernelBuilder::new("sum");
        let [x, y, b] = [("x", rows), ("y", lanes), ("b", 5)]
            .map(|(name, count)| builder.axis(name, Extent::constant(count)));
        let [at_x, at_y, at_b] = [x, y, b].map(|axis| builder.running(axis));
        let sum = builder.binary(crate::operators::Binary::Add, at_x, at_y);
        let sum = builder.binary(crate::operators::Binary::Add, sum, at_b);
        let out = builder.buffer("out", Role::Output(OutputKey::Ask(0)), &[x, y]);
        builder.nest(out, Reduce::Fold(Fold::Sum, vec![b]), sum);
        builder.build()
    }

    #[test]
    fn a_nest_of_many_cells_gets_a_plate_and_one_of_few_does_not() {
        let (many, few, narrow) = (kernel(8, 32), kernel(7, 32), kernel(64, 8));
        let (alone, schedule) = with_plate(&many, 0).expect("enough cells");
        assert_eq!(alone.parallel, many.buffers[many.nests[0].out].axes);
        assert!(schedule.groups.len() == 1 && schedule.groups[0].parallel);
        assert!(with_plate(&few, 0).is_none() && with_plate(&narrow, 0).is_none());
    }
}

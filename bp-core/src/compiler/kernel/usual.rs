//! Kernels for the number of displacements that a grid usually has.
//!
//! In: a kernel whose loops over displacements are as long as the host says. Out: the same kernel with their length known, so
//! that a printer can unroll them. Invariant: the arithmetic and its order are the same.

use super::schedule::Group;
use super::{Displacements, Extent, Kernel, Role, SizeKey};
use crate::ids::AxisId;

/// The number of displacements for which a pass is also compiled: none, and one step along each axis of a grid, either way.
pub(crate) const USUAL_DISPLACEMENTS: usize = 7;

/// The kernel for the usual number of displacements, and an axis whose extent is that number; nothing if it reads no
/// displacements, or those of several sets.
pub(crate) fn with_usual_displacements(kernel: &Kernel) -> Option<(AxisId, Kernel)> {
    let mut sets = kernel.buffers.values().filter_map(|buffer| match buffer.role {
        Role::Positions(Displacements::Of(set), _) => Some(SizeKey::Set(set)),
        _ => None,
    });
    let key = sets.next()?;
    let axis = kernel.axes.find(|axis| axis.extent == Extent::sized(key))?;
    let name = &kernel.size(key).name;
    let known = kernel.with_sizes(|size| (size == name).then_some(USUAL_DISPLACEMENTS)).ok()?;
    sets.all(|other| other == key).then_some((axis, known))
}

/// Whether a pass has a loop as long as this axis.
pub(crate) fn has_loop(kernel: &Kernel, group: &Group, axis: AxisId) -> bool {
    let mut axes = group.nests.iter().flat_map(|nest| nest.outer.iter().chain(&nest.inner));
    axes.any(|own| kernel.axes[*own].extent == kernel.axes[axis].extent)
}

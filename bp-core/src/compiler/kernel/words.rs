//! A description of a kernel: its schedule, and its reads and writes.
//!
//! In: a kernel. Out: lines. Invariant: the lines describe the [`Schedule`].

use super::plate::own_plate;
use super::schedule::{Group, Schedule};
use super::usual::{USUAL_DISPLACEMENTS, has_loop, with_usual_displacements};
use super::{Extent, Kernel, Reduce, Role};
use crate::ids::{AxisId, BufferId, Id};

/// The passes of a kernel, and its memory, a line each.
pub fn in_words(kernel: &Kernel) -> Vec<String> {
    let schedule = Schedule::of(kernel);
    let passes: Vec<String> = schedule.groups.iter().map(|group| pass(kernel, group)).collect();
    let mut number = 1;
    let mut lines = Vec::new();
    // Equal passes are described together.
    for alike in passes.chunk_by(|one, other| one == other) {
        lines.push(match alike.len() {
            1 => format!("pass {number}: {}", alike[0]),
            more => format!("passes {number} to {}: each {}", number + more - 1, alike[0]),
        });
        number += alike.len();
    }
    let is_made = |id: BufferId| kernel.nests.iter().any(|nest| nest.out == id);
    let local = kernel.buffers.iter().filter(|(id, _)| schedule.local[id.position()] && is_made(*id));
    let local: Vec<String> = local.map(|(id, _)| buffer(kernel, id, true)).collect();
    if !local.is_empty() {
        lines.push(format!("kept within a block of cells, never in memory: {}", local.join(", ")));
    }
    let line = |verb: &str, wanted: &dyn Fn(&Role) -> bool| {
        let found = kernel.buffers.iter().filter(|(_, buffer)| wanted(&buffer.role));
        let found: Vec<String> = found.map(|(id, _)| buffer(kernel, id, false)).collect();
        (!found.is_empty()).then(|| format!("{verb}: {}", found.join(", ")))
    };
    lines.extend(unrolled(kernel, &schedule));
    lines.extend(line("reads", &|role| matches!(role, Role::Input { .. })));
    lines.extend(line("looks up", &|role| matches!(role, Role::Table { .. } | Role::Positions(..))));
    lines.extend(line("writes", &|role| matches!(role, Role::Output(_))));
    lines
}

/// The number of displacements for which emitted Rust also has a pass without loops over them, and what a cell then costs in
/// memory.
fn unrolled(kernel: &Kernel, schedule: &Schedule) -> Option<String> {
    let (axis, known) = with_usual_displacements(kernel)?;
    let is_looped = |group: &&Group| group.parallel && has_loop(kernel, group, axis);
    schedule.groups.iter().find(is_looped)?;
    let is_of_cells = |id: BufferId| kernel.parallel.iter().all(|own| known.buffers[id].axes.contains(own));
    let others = |id: BufferId| -> Vec<AxisId> {
        known.buffers[id].axes.iter().copied().filter(|own| !kernel.parallel.contains(own)).collect()
    };
    // The numbers of a cell: the product of the other axes.
    let numbers = |wanted: &dyn Fn(&Role) -> bool| {
        let found = known.buffers.ids().filter(|id| wanted(&known.buffers[*id].role) && is_of_cells(*id));
        let each = found.map(|id| match others(id).as_slice() {
            [] => "1".to_owned(),
            own => axes(&known, own),
        });
        each.collect::<Vec<String>>().join(" + ")
    };
    let within = known.buffers.ids().filter(|id| schedule.local[id.position()] && is_of_cells(*id));
    let kept: usize = within.filter_map(|id| known.known_cells(&others(id))).sum();
    Some(format!(
        "for {USUAL_DISPLACEMENTS} displacements, emitted Rust unrolls the loops over them: a cell reads {} numbers, writes {}, \
         and has {kept} more in no array",
        numbers(&|role| matches!(role, Role::Input { .. })),
        numbers(&|role| matches!(role, Role::Output(_)))
    ))
}

/// One pass: its cells, and the nests that share it.
fn pass(kernel: &Kernel, group: &Group) -> String {
    let scans =
        group.nests.iter().filter(|nest| matches!(kernel.nests[nest.nest].reduce, Reduce::Scan { .. }));
    let scans = match scans.count() {
        0 => String::new(),
        1 => ", one of them a scan".to_owned(),
        more => format!(", {more} of them scans"),
    };
    let nests = match group.nests.len() {
        1 => format!("1 nest{}", scans.replace("one of them", "which is")),
        more => format!("{more} nests{scans}"),
    };
    let over = |plate: &[AxisId]| {
        let lane = plate.last().map_or("", |lane| kernel.axes[*lane].name.as_str());
        format!("over {}; neighbours in memory along {lane}", axes(kernel, plate))
    };
    match (group.parallel, own_plate(kernel, group.nests[0].nest)) {
        (true, _) => format!("{nests}, {}", over(&kernel.parallel)),
        (false, Some(own)) => format!("{nests}, done once; as emitted Rust {}", over(own)),
        (false, None) => format!("{nests}, done once"),
    }
}

fn buffer(kernel: &Kernel, id: BufferId, serial: bool) -> String {
    let buffer = &kernel.buffers[id];
    let own: Vec<AxisId> =
        buffer.axes.iter().copied().filter(|axis| !(serial && kernel.parallel.contains(axis))).collect();
    match own.is_empty() {
        true => format!("`{}`", buffer.name),
        false => format!("`{}` ({})", buffer.name, axes(kernel, &own)),
    }
}

fn axes(kernel: &Kernel, axes: &[AxisId]) -> String {
    let extents: Vec<String> = axes.iter().map(|axis| extent(kernel, &kernel.axes[*axis].extent)).collect();
    extents.join(" × ")
}

fn extent(kernel: &Kernel, extent: &Extent) -> String {
    match (extent.size.map(|key| &kernel.size(key).name), extent.offset) {
        (None, count) => count.to_string(),
        (Some(size), 0) => size.clone(),
        (Some(size), more) if more > 0 => format!("({size} + {more})"),
        (Some(size), less) => format!("({size} − {})", -less),
    }
}

//! What a block reads: elements of buffers, one by one or a row of lanes at once.
//!
//! In: a buffer and indices. Out: numbers; `otherwise` where an index falls outside. Invariant: lanes that are
//! neighbours in a buffer are read where they are, and give what one by one would.

use super::{Array, Block, Scalar, View};
use crate::ids::{AxisId, BufferId, Id, ValueId};
use crate::kernel::Index;

impl<T: Scalar> Block<'_, T> {
    pub(super) fn cell(&self, buffer: BufferId, offset: usize) -> f64 {
        match self.source(buffer) {
            Cells::Numbers(cells) => cells[offset].to_f64(),
            Cells::Positions(cells) => f64::from(cells[offset]),
            Cells::Default(number) => number,
        }
    }

    fn source(&self, buffer: BufferId) -> Cells<'_, T> {
        match &self.bound.arrays[buffer] {
            Array::Given(cells) | Array::Broadcast(cells) => Cells::Numbers(cells),
            Array::Owned(cells) => Cells::Numbers(cells),
            Array::Default => Cells::Default(self.bound.default(buffer)),
            Array::Positions(cells) => Cells::Positions(cells),
            Array::Made if !self.made[buffer.position()].is_empty() => {
                Cells::Numbers(&self.made[buffer.position()])
            }
            Array::Made => Cells::Numbers(&self.finished[buffer.position()]),
        }
    }

    /// The offset of an element at a lane of this block; `None` outside.
    pub(super) fn offset(&self, buffer: BufferId, indices: &[Index], lane: usize) -> Option<usize> {
        let mut offset = 0;
        let axes = &self.kernel.buffers[buffer].axes;
        let own =
            !self.made[buffer.position()].is_empty() && matches!(self.bound.arrays[buffer], Array::Made);
        let running = |axis: AxisId| {
            let is_lane = self.group.parallel && self.kernel.parallel.last() == Some(&axis);
            self.running[axis.position()] as i64 + if is_lane { lane as i64 } else { 0 }
        };
        for ((index, axis), stride) in indices.iter().zip(axes).zip(self.strides(buffer)) {
            let extent = self.bound.extent(*axis) as i64;
            let at = match index {
                Index::Axis(axis) => running(*axis),
                Index::At(value) => self.lane(*value, lane).to_f64() as i64,
                Index::Turned { axis, by, wraps } => {
                    let at = running(*axis) + self.uniform[by.position()] as i64;
                    if self.uniform[wraps.position()] != 0.0 { at.rem_euclid(extent) } else { at }
                }
            };
            if !(0..extent).contains(&at) {
                return None;
            }
            offset += at as usize * stride;
        }
        Some(if own && self.group.parallel { offset + lane } else { offset })
    }

    /// The numbers of a buffer that has some.
    pub(super) fn numbers(&self, buffer: BufferId) -> &[T] {
        match self.source(buffer) {
            Cells::Numbers(cells) => cells,
            _ => unreachable!("internal: only numbers are viewed"),
        }
    }

    /// Reads lanes: says where they are, or puts them into `out`.
    pub(super) fn load_lanes(
        &self,
        out: &mut [T],
        buffer: BufferId,
        indices: &[Index],
        otherwise: Option<ValueId>,
    ) -> View {
        let fallback = |lane: usize| otherwise.map_or(T::ZERO, |value| self.lane(value, lane));
        let scattered = |index: &Index| matches!(index, Index::At(value) if self.schedule.is_varying(*value));
        if indices.iter().any(scattered) {
            return self.one_by_one(out, buffer, indices, fallback);
        }
        let cells = match self.source(buffer) {
            Cells::Numbers(cells) => cells,
            Cells::Default(number) => return same(out, T::from_f64(number)),
            Cells::Positions(_) => return self.one_by_one(out, buffer, indices, fallback),
        };
        let (first, width) = (self.offset(buffer, indices, 0), out.len());
        let last = self.offset(buffer, indices, width - 1);
        match (first, last) {
            (Some(first), Some(last)) if last == first + width - 1 => return View::There(buffer, first),
            (Some(first), Some(last)) if last == first => return same(out, cells[first]),
            _ => {}
        }
        // Stretches that are in one piece: a row that goes round, or begins or ends within the block.
        let mut lane = 0;
        while lane < width {
            let here = self.offset(buffer, indices, lane);
            let more = self.stretch(buffer, indices, lane).min(width - lane);
            match here {
                Some(offset) => out[lane..lane + more].copy_from_slice(&cells[offset..offset + more]),
                None => (lane..lane + more).for_each(|lane| out[lane] = fallback(lane)),
            }
            lane += more;
        }
        View::Own
    }

    fn one_by_one(
        &self,
        out: &mut [T],
        buffer: BufferId,
        indices: &[Index],
        fallback: impl Fn(usize) -> T,
    ) -> View {
        for (lane, out) in out.iter_mut().enumerate() {
            *out = match self.offset(buffer, indices, lane) {
                Some(offset) => T::from_f64(self.cell(buffer, offset)),
                None => fallback(lane),
            };
        }
        View::Own
    }

    /// How many lanes from this one on are read alike: to an end of the row along the lanes, at most.
    fn stretch(&self, buffer: BufferId, indices: &[Index], lane: usize) -> usize {
        let along = self.kernel.parallel.last();
        let axes = &self.kernel.buffers[buffer].axes;
        let turned = indices.iter().zip(axes).find_map(|(index, axis)| match index {
            Index::Turned { axis: running, by, wraps } if Some(running) == along => {
                let at = self.running[running.position()] as i64 + lane as i64;
                let extent = self.bound.extent(*axis) as i64;
                let at = at + self.uniform[by.position()] as i64;
                Some((if self.uniform[wraps.position()] != 0.0 { at.rem_euclid(extent) } else { at }, extent))
            }
            _ => None,
        });
        match turned {
            Some((at, _)) if at < 0 => at.unsigned_abs() as usize,
            Some((at, extent)) if at < extent => (extent - at) as usize,
            _ => usize::MAX,
        }
    }
}

/// The same number in all lanes.
fn same<T: Scalar>(out: &mut [T], number: T) -> View {
    out[0] = number;
    View::Same
}

enum Cells<'c, T> {
    Numbers(&'c [T]),
    Positions(&'c [i32]),
    Default(f64),
}

//! What a block reads: elements of buffers, one by one or a row of lanes at once.
//!
//! In: a buffer and indices. Out: numbers; `otherwise` where an index falls outside. Invariant: lanes that are
//! neighbours in a buffer are copied at once, and give what one by one would.

use super::{Array, Block, Scalar};
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
        for ((index, axis), stride) in indices.iter().zip(axes).zip(&self.strides[buffer.position()]) {
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

    pub(super) fn load_lanes(
        &mut self,
        start: usize,
        buffer: BufferId,
        indices: &[Index],
        otherwise: Option<ValueId>,
    ) {
        let mut target = std::mem::take(&mut self.varying);
        let fallback: Vec<T> = match otherwise {
            Some(value) if self.schedule.is_varying(value) => {
                let at = self.slot[value.position()] * self.stride;
                target[at..at + self.width].to_vec()
            }
            Some(value) => vec![T::from_f64(self.uniform[value.position()]); self.width],
            None => vec![T::ZERO; self.width],
        };
        let out = &mut target[start..start + self.width];
        let scattered = |index: &Index| matches!(index, Index::At(value) if self.schedule.is_varying(*value));
        let (first, last) = match indices.iter().any(scattered) {
            true => (None, None),
            false => (self.offset(buffer, indices, 0), self.offset(buffer, indices, self.width - 1)),
        };
        match (self.source(buffer), first, last) {
            (Cells::Default(number), ..) => out.fill(T::from_f64(number)),
            (Cells::Numbers(cells), Some(first), Some(last)) if last == first + self.width - 1 => {
                out.copy_from_slice(&cells[first..=last]);
            }
            (Cells::Numbers(cells), Some(first), Some(last)) if last == first && self.width > 1 => {
                out.fill(cells[first]);
            }
            _ => {
                self.varying = target;
                for (lane, fallback) in fallback.into_iter().enumerate() {
                    let value = match self.offset(buffer, indices, lane) {
                        Some(offset) => T::from_f64(self.cell(buffer, offset)),
                        None => fallback,
                    };
                    self.varying[start + lane] = value;
                }
                return;
            }
        }
        self.varying = target;
    }
}

enum Cells<'c, T> {
    Numbers(&'c [T]),
    Positions(&'c [i32]),
    Default(f64),
}

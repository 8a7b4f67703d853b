//! Addresses of loads, with their constant parts.
//!
//! In: a buffer and indices. Out: a value. Invariant: contiguous lanes are read in place; others use a pattern that is
//! computed once, or are located one by one.

use super::build::{Builder, Running};
use super::code::{Address, Along, Numeric, Place, Read, Source, Term};
use super::values::Value;
use crate::ids::{AxisId, BufferId, Id};
use crate::kernel::{Index, Role};
use crate::operators::Binary;

/// An index that is always in range.
const ANY: usize = i64::MAX as usize;

/// The known parts of an address.
#[derive(Default)]
struct Found {
    base: usize,
    terms: Vec<Term>,
    /// Indices that differ among lanes: stride and extent.
    scattered: Vec<(Value, usize, usize)>,
    /// The strides along the axes of the lanes.
    lanes: Vec<usize>,
    turned: Option<(usize, usize, usize)>,
    outside: bool,
}

impl Builder<'_> {
    /// The current index of an axis.
    pub(super) fn axis(&mut self, axis: AxisId) -> Value {
        match self.running[axis.position()] {
            Running::At(at) => self.values.constant(at as f64),
            Running::Counts => self.values.number(Numeric::Counter(axis.position())),
            Running::Lane => {
                let strides: Vec<usize> =
                    self.shape.lanes.iter().map(|lane| usize::from(*lane == axis)).collect();
                let pattern = self.pattern(&strides);
                self.values.read(Read::Pattern(pattern))
            }
        }
    }

    /// The offsets of all lanes, for these strides.
    fn pattern(&mut self, strides: &[usize]) -> usize {
        let mut offsets = vec![0u32];
        for (axis, stride) in self.shape.lanes.iter().zip(strides) {
            let extent = self.extent(*axis);
            let along = |from: u32| (0..extent).map(move |at| from + (at * stride) as u32);
            offsets = offsets.into_iter().flat_map(along).collect();
        }
        self.values.patterns.add(offsets, |_| 0)
    }

    pub(super) fn load(&mut self, buffer: BufferId, indices: &[Index], otherwise: Option<Value>) -> Value {
        let zero = self.values.constant(0.0);
        let other = otherwise.unwrap_or(zero);
        let made_here = self.makes(buffer);
        let found = match made_here {
            true => self.find_made(buffer, indices),
            false => self.find(buffer, indices),
        };
        if found.outside {
            return other;
        }
        if made_here && self.shape.unroll.is_none() {
            let known = found.terms.is_empty() && found.scattered.is_empty();
            let made = self.forward.get(&(buffer, found.base)).filter(|_| known).copied();
            self.lost |= made.is_none();
            return made.unwrap_or(zero);
        }
        let source = match made_here {
            true => Source::Block(self.of_block[&buffer]),
            false => Source::Whole(buffer),
        };
        let has_lanes = made_here || found.turned.is_some() || found.lanes.iter().any(|stride| *stride > 0);
        let positions = matches!(self.known.kernel.buffers[buffer].role, Role::Positions(..));
        let alike = !has_lanes && !matches!(other, Value::Number(_));
        if !found.scattered.is_empty() || alike || (positions && has_lanes) {
            return self.gather(source, found, otherwise);
        }
        if let (Value::Number(number), false) = (other, has_lanes) {
            return match self.own_cell(buffer, found.base).filter(|_| found.terms.is_empty()) {
                Some(own) => self.values.constant(own),
                None => {
                    let address = Address { source: buffer, base: found.base, terms: found.terms };
                    self.values.number(Numeric::Load(address, otherwise.map(|_| number)))
                }
            };
        }
        let address = Address { source, base: found.base, terms: found.terms };
        let along = match found.turned {
            _ if made_here => Along::Straight,
            Some((by, wraps, extent)) => Along::Turned { by, wraps, extent },
            None if has_lanes && self.is_contiguous(&found.lanes) => Along::Straight,
            None => Along::Pattern(self.pattern(&found.lanes)),
        };
        match other {
            Value::Number(number) if !matches!(along, Along::Pattern(_)) => {
                Value::Place(self.values.place(Place { address, along, otherwise: Some(number) }))
            }
            _ => {
                let place = self.values.place(Place { address, along, otherwise: None });
                self.values.read(Read::Fetch(place, Some(other)))
            }
        }
    }

    /// A number that comes with the kernel.
    fn own_cell(&self, buffer: BufferId, at: usize) -> Option<f64> {
        match &self.known.kernel.buffers[buffer].role {
            Role::Table { numbers, .. } if (self.known.own)(buffer) => {
                let narrow = |number: f64| if self.known.narrow { f64::from(number as f32) } else { number };
                numbers.get(at).copied().map(narrow)
            }
            _ => None,
        }
    }

    /// Whether these strides are those of the lanes, in order.
    fn is_contiguous(&self, strides: &[usize]) -> bool {
        let mut expected = 1;
        self.shape.lanes.iter().zip(strides).rev().all(|(axis, stride)| {
            let extent = self.extent(*axis);
            let fits = *stride == expected || extent == 1;
            expected *= extent;
            fits
        })
    }

    fn find(&mut self, buffer: BufferId, indices: &[Index]) -> Found {
        let mut found = Found { lanes: vec![0; self.shape.lanes.len()], ..Found::default() };
        let (kernel, strides) = (self.known.kernel, &self.known.strides[buffer.position()]);
        let single_lane_axis = self.shape.lanes.len() == 1;
        for ((index, axis), stride) in indices.iter().zip(&kernel.buffers[buffer].axes).zip(strides) {
            let extent = self.extent(*axis);
            let position = match index {
                Index::Axis(running) => match self.running[running.position()] {
                    Running::Lane if self.extent(*running) <= extent => {
                        let lane = self.shape.lanes.iter().position(|lane| lane == running);
                        found.lanes[lane.expect("internal: it is among the lanes")] += stride;
                        continue;
                    }
                    _ => self.axis(*running),
                },
                Index::At(value) => self.at[value.position()],
                Index::Turned { axis: running, by, wraps } => {
                    let (by, wraps) = (self.at[by.position()], self.at[wraps.position()]);
                    let along = self.running[running.position()] == Running::Lane;
                    match (by, wraps) {
                        (Value::Number(by), Value::Number(wraps))
                            if along && single_lane_axis && *stride == 1 && found.turned.is_none() =>
                        {
                            found.turned = Some((by, wraps, extent));
                            continue;
                        }
                        _ => self.turned(*running, by, wraps, extent),
                    }
                }
            };
            self.add(&mut found, position, *stride, extent);
        }
        if found.turned.is_some()
            && (found.lanes.iter().any(|stride| *stride > 0) || !found.scattered.is_empty())
        {
            // Wrapped, and read along the lanes in another way too: located one by one.
            let (by, wraps, extent) = found.turned.take().expect("internal: it is turned");
            let at = self.turned(self.shape.lanes[0], Value::Number(by), Value::Number(wraps), extent);
            found.scattered.push((at, 1, extent));
        }
        found
    }

    /// The plane of a buffer that this pass computes, at the current rows and lanes.
    fn find_made(&mut self, buffer: BufferId, indices: &[Index]) -> Found {
        let mut found = Found::default();
        let axes = &self.known.kernel.buffers[buffer].axes;
        let mut stride: usize = self.serial(buffer).map(|axis| self.extent(axis)).product();
        let serial: Vec<AxisId> = self.serial(buffer).collect();
        for (index, axis) in indices.iter().zip(axes) {
            if !serial.contains(axis) {
                continue;
            }
            let extent = self.extent(*axis);
            stride /= extent;
            let position = match index {
                Index::Axis(running) => self.axis(*running),
                Index::At(value) => self.at[value.position()],
                Index::Turned { axis: running, by, wraps } => {
                    let (by, wraps) = (self.at[by.position()], self.at[wraps.position()]);
                    self.turned(*running, by, wraps, extent)
                }
            };
            self.add(&mut found, position, stride, extent);
        }
        found
    }

    fn add(&mut self, found: &mut Found, position: Value, stride: usize, extent: usize) {
        match (position, self.values.known(position)) {
            (_, Some(at)) => match (0..extent as i64).contains(&(at as i64)) {
                true => found.base += at as usize * stride,
                false => found.outside = true,
            },
            (Value::Number(number), None) => found.terms.push(Term { number, stride, extent }),
            _ => found.scattered.push((position, stride, extent)),
        }
    }

    /// The current index of an axis plus an offset, possibly wrapped.
    fn turned(&mut self, axis: AxisId, by: Value, wraps: Value, extent: usize) -> Value {
        let running = self.axis(axis);
        let at = self.values.binary(Binary::Add, running, by);
        let extent = self.values.constant(extent as f64);
        let round = self.values.binary(Binary::Remainder, at, extent);
        self.values.select(wraps, round, at)
    }

    fn gather(&mut self, source: Source, found: Found, otherwise: Option<Value>) -> Value {
        let mut terms = found.scattered;
        terms.extend(found.terms.iter().map(|term| (Value::Number(term.number), term.stride, term.extent)));
        if found.base > 0 {
            terms.push((self.values.constant(1.0), found.base, ANY));
        }
        if let Some((by, wraps, extent)) = found.turned {
            let at = self.turned(self.shape.lanes[0], Value::Number(by), Value::Number(wraps), extent);
            terms.push((at, 1, extent));
        }
        for (number, stride) in found.lanes.iter().enumerate().filter(|(_, stride)| **stride > 0) {
            let running = self.axis(self.shape.lanes[number]);
            terms.push((running, *stride, ANY));
        }
        self.values.read(Read::Gather(source, terms.into(), otherwise))
    }
}

//! The interpreter: the meaning of a kernel, in f64, one cell at a time.
//!
//! In: a kernel and its inputs. Out: its outputs. Invariant: its results are correct by definition; every other back
//! end is tested against it. It is slow and simple.

use super::inputs::{Array, Bound};
use super::{Inputs, Outputs};
use crate::error::Error;
use crate::ids::{AxisId, BufferId, Id, ValueId};
use crate::kernel::{Fold, Index, Kernel, Node, Reduce};
use crate::operators::OPERANDS;

/// Runs a kernel in f64.
///
/// # Errors
/// An input that is missing or does not fit.
pub fn interpret(kernel: &Kernel, inputs: &Inputs<'_, f64>) -> Result<Outputs<f64>, Error> {
    let bound = inputs.bind(kernel)?;
    let mut machine = Machine {
        made: kernel.buffers.ids().map(|_| Vec::new()).collect(),
        strides: kernel.buffers.ids().map(|id| bound.strides(id)).collect(),
        running: vec![0; kernel.axes.len()],
        known: vec![(0, 0.0); kernel.nodes.len()],
        round: 0,
        bound,
    };
    for nest in &kernel.nests {
        machine.nest(nest.out, &nest.reduce, nest.value);
    }
    let outputs = kernel.outputs().map(|(id, key)| (key, std::mem::take(&mut machine.made[id.position()])));
    Ok(Outputs { arrays: outputs.collect() })
}

struct Machine<'k> {
    bound: Bound<'k, f64>,
    made: Vec<Vec<f64>>,
    strides: Vec<Vec<usize>>,
    running: Vec<usize>,
    /// The round in which each node was last computed, and its value.
    known: Vec<(u64, f64)>,
    round: u64,
}

impl Machine<'_> {
    fn nest(&mut self, out: BufferId, reduce: &Reduce, value: ValueId) {
        let length = self.bound.length(out);
        let axes = self.bound.kernel.buffers[out].axes.clone();
        let mut cells = vec![0.0; length];
        if let Reduce::Scan { axis, backward, keep, initial } = reduce {
            let others: Vec<AxisId> = axes.iter().copied().filter(|other| other != axis).collect();
            let strides = self.strides[out.position()].clone();
            self.each(&others, &mut |machine| {
                let last = machine.bound.extent(*axis) - 1;
                let mut state = machine.value(*initial);
                for step in 0..=last {
                    machine.running[axis.position()] = if *backward { last - step } else { step };
                    let offset =
                        |(axis, stride): (&AxisId, &usize)| machine.running[axis.position()] * stride;
                    let position: usize = axes.iter().zip(&strides).map(offset).sum();
                    cells[position] = state;
                    state = machine.value(*keep) * state + machine.value(value);
                }
            });
        } else {
            let mut position = 0;
            self.each(&axes, &mut |machine| {
                cells[position] = match reduce {
                    Reduce::Fold(fold, over) => {
                        let mut folded = fold.start();
                        machine.each(over, &mut |machine| folded = fold.apply(folded, machine.value(value)));
                        folded
                    }
                    _ => machine.value(value),
                };
                position += 1;
            });
        }
        self.made[out.position()] = cells;
    }

    /// Iterates over all values of some axes, the last one fastest.
    fn each(&mut self, axes: &[AxisId], body: &mut dyn FnMut(&mut Self)) {
        match axes {
            [] => body(self),
            [first, rest @ ..] => {
                for value in 0..self.bound.extent(*first) {
                    self.running[first.position()] = value;
                    self.each(rest, body);
                }
            }
        }
    }

    /// The value of a node at the current indices. A chain of nodes is as long as the program, so there is no
    /// recursion: operands are computed first.
    fn value(&mut self, id: ValueId) -> f64 {
        self.round += 1;
        let mut open = vec![id];
        while let Some(next) = open.last() {
            match self.node(*next) {
                Ok(value) => {
                    self.known[next.position()] = (self.round, value);
                    open.pop();
                }
                Err(needed) => open.push(needed),
            }
        }
        self.known[id.position()].1
    }

    /// The value of a node, or another node that it needs first.
    fn node(&self, id: ValueId) -> Result<f64, ValueId> {
        let value = |id: ValueId| match self.known[id.position()] {
            (round, value) if round == self.round => Ok(value),
            _ => Err(id),
        };
        Ok(match &self.bound.kernel.nodes[id] {
            Node::Constant(bits) => f64::from_bits(*bits),
            Node::Axis(axis) => self.running[axis.position()] as f64,
            Node::Unary(operator, operand) => operator.apply(value(*operand)?),
            Node::Binary(operator, left, right) => operator.apply(value(*left)?, value(*right)?),
            Node::Select(condition, then, otherwise) => {
                value(if value(*condition)? != 0.0 { *then } else { *otherwise })?
            }
            Node::Mass(law, operands) => {
                let mut numbers = [0.0; OPERANDS];
                for (number, operand) in numbers.iter_mut().zip(operands) {
                    *number = value(*operand)?;
                }
                law.apply(numbers)
            }
            Node::Load { buffer, indices, otherwise } => {
                match (self.position(*buffer, indices, &value)?, otherwise) {
                    (Some(position), _) => match &self.bound.arrays[*buffer] {
                        Array::Given(values) | Array::Broadcast(values) | Array::Owned(values) => {
                            values[position]
                        }
                        Array::Default => self.bound.default(*buffer),
                        Array::Positions(values) => f64::from(values[position]),
                        Array::Made => self.made[buffer.position()][position],
                    },
                    (None, Some(otherwise)) => value(*otherwise)?,
                    (None, None) => {
                        let name = &self.bound.kernel.buffers[*buffer].name;
                        panic!("internal: an index of `{name}` is outside")
                    }
                }
            }
        })
    }

    fn position(
        &self,
        buffer: BufferId,
        indices: &[Index],
        value: &impl Fn(ValueId) -> Result<f64, ValueId>,
    ) -> Result<Option<usize>, ValueId> {
        let mut position = 0;
        let axes = &self.bound.kernel.buffers[buffer].axes;
        for ((index, axis), stride) in indices.iter().zip(axes).zip(&self.strides[buffer.position()]) {
            let extent = self.bound.extent(*axis) as i64;
            let at = match index {
                Index::Axis(axis) => self.running[axis.position()] as i64,
                Index::At(place) => value(*place)? as i64,
                Index::Turned { axis, by, wraps } => {
                    let at = self.running[axis.position()] as i64 + value(*by)? as i64;
                    if value(*wraps)? != 0.0 { at.rem_euclid(extent) } else { at }
                }
            };
            if !(0..extent).contains(&at) {
                return Ok(None);
            }
            position += at as usize * stride;
        }
        Ok(Some(position))
    }
}

impl Fold {
    /// The initial value of a fold.
    pub(crate) fn start(self) -> f64 {
        match self {
            Fold::Sum => 0.0,
            Fold::Product => 1.0,
            Fold::Maximum => f64::NEG_INFINITY,
        }
    }

    /// One step of a fold.
    pub(crate) fn apply(self, folded: f64, value: f64) -> f64 {
        match self {
            Fold::Sum => folded + value,
            Fold::Product => folded * value,
            Fold::Maximum => folded.max(value),
        }
    }
}

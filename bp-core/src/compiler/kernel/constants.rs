//! Nests that read no input are computed when the kernel is made: their results are tables.
//!
//! In: a kernel. Out: the same with fewer nests. Invariant: values are those of the interpreter, in f64; a result that is not
//! finite, or too large for a table, is computed when the kernel runs.

use super::schedule::{reachable, roots};
use super::{Fold, Index, Kernel, Nest, Node, Reduce, Role};
use crate::ids::{AxisId, BufferId, Id, ValueId};
use crate::operators::Binary;
use crate::radix;
use std::collections::HashMap;

/// The most numbers of a table that is made.
const MOST_CELLS: usize = 65_536;

/// The most operations of a nest that is computed here.
const MOST_WORK: usize = 20_000_000;

/// The kernel with the results of such nests as tables.
pub(crate) fn with_tables(mut kernel: Kernel) -> Kernel {
    let mut known: HashMap<BufferId, Vec<f64>> = HashMap::new();
    for (id, buffer) in kernel.buffers.iter() {
        if let Role::Table { key: None, numbers } = &buffer.role {
            known.insert(id, numbers.clone());
        }
    }
    let nests = std::mem::take(&mut kernel.nests);
    for nest in nests {
        let is_checked = kernel.checks.iter().any(|(checked, _)| *checked == nest.out);
        let own = &kernel.buffers[nest.out];
        let numbers = match own.role == Role::Scratch && !own.axes.is_empty() && !is_checked {
            true => computed(&kernel, &nest, &known),
            false => None,
        };
        match numbers {
            Some(numbers) => {
                known.insert(nest.out, numbers.clone());
                kernel.buffers[nest.out].role = Role::Table { key: None, numbers };
            }
            None => kernel.nests.push(nest),
        }
    }
    kernel
}

/// The numbers of a nest that reads known arrays only.
fn computed(kernel: &Kernel, nest: &Nest, known: &HashMap<BufferId, Vec<f64>>) -> Option<Vec<f64>> {
    let own = &kernel.buffers[nest.out].axes;
    let (fold, over) = match &nest.reduce {
        Reduce::None => (Fold::Sum, Vec::new()),
        Reduce::Fold(fold, over) => (*fold, over.clone()),
        Reduce::Scan { .. } => return None,
    };
    let cells = kernel.known_cells(own).filter(|cells| *cells <= MOST_CELLS)?;
    let turns = kernel.known_cells(&over)?;
    let values: Vec<ValueId> =
        roots(&nest.reduce, nest.value).into_iter().flat_map(|root| reachable(kernel, root)).collect();
    let is_known = |value: &ValueId| match &kernel.nodes[*value] {
        Node::Load { buffer, indices, .. } => {
            let is_plain = indices.iter().all(|index| !matches!(index, Index::Turned { .. }));
            known.contains_key(buffer)
                && is_plain
                && kernel.known_cells(&kernel.buffers[*buffer].axes).is_some()
        }
        _ => true,
    };
    if !values.iter().all(is_known) || cells.checked_mul(turns)?.checked_mul(values.len())? > MOST_WORK {
        return None;
    }
    let mut run =
        Run { kernel, known, at: vec![0; kernel.axes.len()], numbers: vec![0.0; kernel.nodes.len()] };
    let mut made = Vec::with_capacity(cells);
    for cell in 0..cells {
        run.set(own, cell);
        let mut folded = fold.start();
        for turn in 0..turns {
            run.set(&over, turn);
            let value = run.value(&values, nest.value);
            folded = match fold {
                Fold::Sum => folded + value,
                Fold::Product => folded * value,
                Fold::Maximum => folded.max(value),
            };
        }
        made.push(folded);
    }
    made.iter().all(|number| number.is_finite()).then_some(made)
}

/// The evaluation of a nest.
struct Run<'k> {
    kernel: &'k Kernel,
    known: &'k HashMap<BufferId, Vec<f64>>,
    /// The current index of each axis.
    at: Vec<usize>,
    numbers: Vec<f64>,
}

impl Run<'_> {
    /// Sets the indices of some axes to those of a cell, the last one fastest.
    fn set(&mut self, axes: &[AxisId], cell: usize) {
        let counts = axes.iter().rev().map(|axis| self.kernel.axes[*axis].extent.known().unwrap_or(1).max(1));
        for (axis, ordinal) in axes.iter().rev().zip(radix::ordinals(cell, counts)) {
            self.at[axis.position()] = ordinal;
        }
    }

    /// A value at the current indices; `values` are its operands and itself, operands first.
    fn value(&mut self, values: &[ValueId], root: ValueId) -> f64 {
        for value in values {
            self.numbers[value.position()] = self.node(&self.kernel.nodes[*value]);
        }
        self.numbers[root.position()]
    }

    fn node(&self, node: &Node) -> f64 {
        let of = |value: &ValueId| self.numbers[value.position()];
        match node {
            Node::Constant(bits) => f64::from_bits(*bits),
            Node::Axis(axis) => self.at[axis.position()] as f64,
            Node::Unary(operator, operand) => operator.apply(of(operand)),
            Node::Binary(operator, left, right) => Binary::apply(*operator, of(left), of(right)),
            Node::Select(condition, then, otherwise) => {
                of(if of(condition) != 0.0 { then } else { otherwise })
            }
            Node::Mass(law, operands) => law.apply(operands.map(|operand| of(&operand))),
            Node::Load { buffer, indices, otherwise } => {
                let digit = |(index, axis): (&Index, &AxisId)| {
                    let count = self.kernel.axes[*axis].extent.known().unwrap_or(0);
                    let at = match index {
                        Index::Axis(axis) => self.at[axis.position()] as f64,
                        Index::At(value) | Index::Turned { by: value, .. } => of(value),
                    };
                    (at >= 0.0 && at < count as f64).then_some((at as usize, count))
                };
                let digits = indices.iter().zip(&self.kernel.buffers[*buffer].axes).map(digit);
                match radix::position_inside(digits) {
                    Some(place) => self.known[buffer][place],
                    None => otherwise.as_ref().map_or(f64::NAN, of),
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Extent, KernelBuilder, OutputKey};
    use super::*;

    #[test]
    fn a_sum_without_inputs_is_a_table() {
        let mut builder = KernelBuilder::new("table");
        let [x, y] = [("x", 2), ("y", 3)].map(|(name, count)| builder.axis(name, Extent::constant(count)));
        let [at_x, at_y] = [x, y].map(|axis| builder.running(axis));
        let product = builder.binary(Binary::Multiply, at_x, at_y);
        let products = builder.compute("products", &[x, y], Reduce::None, product);
        let sums = builder.fold("sums", &[x], Fold::Sum, &[y], products);
        let out = builder.buffer("out", Role::Output(OutputKey::Ask(0)), &[x]);
        builder.nest(out, Reduce::None, sums);
        let kernel = with_tables(builder.build()).validated();
        assert_eq!(kernel.nests.len(), 1);
        let numbers = |role: &Role| match role {
            Role::Table { numbers, .. } => Some(numbers.clone()),
            _ => None,
        };
        let tables: Vec<Vec<f64>> = kernel.buffers.values().filter_map(|own| numbers(&own.role)).collect();
        assert_eq!(tables, [vec![0.0, 0.0, 0.0, 0.0, 1.0, 2.0], vec![0.0, 3.0]]);
    }
}

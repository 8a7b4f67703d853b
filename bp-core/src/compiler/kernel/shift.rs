//! Sharing of values between neighbouring cells.
//!
//! In: a kernel. Out: one in which a costly value that equals another at the next index of a loop is computed once for
//! both, in an array that is one longer than the loop. Invariant: the same numbers, except for the rounding of
//! rearranged sums.
//!
//! For example, the bins of a histogram share their edges: Φ((j − m)/s) − Φ((j − 1 − m)/s) at the mean m, and the same
//! at m + 1. Values are compared by their *forms*: sums of atoms with factors, and operators over forms.

use super::rewrite::{at_another, rewritten};
use super::schedule::roots;
use super::{Extent, Index, Kernel, Nest, Node, Reduce, Role};
use crate::ids::{AxisId, Id, ValueId};
use crate::operators::{Binary, Unary};
use std::collections::{BTreeMap, BTreeSet, HashMap};

/// Σ factor · atom + constant, numbers by their bits.
type Form = (BTreeMap<Atom, u64>, u64);

#[derive(Clone, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
enum Atom {
    /// The running value of the loop.
    Running,
    /// The part that does not depend on the loop.
    Value(ValueId),
    Unary(String, Box<Form>),
    Binary(String, Box<Form>, Box<Form>),
}

/// A value, and its value at the next index.
struct Pair {
    here: ValueId,
    next: ValueId,
    axis: AxisId,
}

/// Limit of the values examined for a form.
const MOST_VALUES: usize = 256;

/// Shares values that neighbours along a loop both compute.
pub(crate) fn share_between_neighbours(mut kernel: Kernel) -> Kernel {
    while let Some(pair) = find(&kernel) {
        kernel = shared(&kernel, &pair);
    }
    kernel
}

/// The first pair of costly values in use along some loop.
fn find(kernel: &Kernel) -> Option<Pair> {
    let axes = kernel.axes_of();
    let is_costly = |value: &ValueId| {
        let node = &kernel.nodes[*value];
        matches!(node, Node::Unary(Unary::NormalCumulative | Unary::LnGamma | Unary::LnBessel, _))
    };
    let values: Vec<ValueId> = kernel.nodes.ids().filter(is_costly).collect();
    let loops = kernel.axes.ids().filter(|axis| !kernel.parallel.contains(axis));
    loops.into_iter().find_map(|axis| {
        let depends = |value: &&ValueId| axes[value.position()].contains(&axis);
        let form = |value: ValueId, by: f64| Forms { kernel, axes: &axes, axis, by, seen: 0 }.of(value);
        let forms: Vec<(ValueId, Form)> = (values.iter().filter(depends))
            .filter_map(|value| form(*value, 0.0).map(|form| (*value, form)))
            .collect();
        forms.iter().find_map(|(here, _)| {
            let further = form(*here, 1.0)?;
            let next = forms.iter().find(|(next, form)| {
                *form == further && axes[next.position()] == axes[here.position()] && next != here
            });
            next.map(|(next, _)| Pair { here: *here, next: *next, axis })
        })
    })
}

/// The kernel in which both values of a pair are read from one array.
fn shared(kernel: &Kernel, pair: &Pair) -> Kernel {
    let mut others: Vec<AxisId> = kernel.axes_of()[pair.here.position()].iter().copied().collect();
    others.retain(|axis| *axis != pair.axis);
    // The plate's axes come last, in their order.
    let plate = |axis: &AxisId| kernel.parallel.iter().position(|own| own == axis);
    others.sort_by_key(|axis| plate(axis).map_or(0, |position| position + 1));
    let Extent { size, offset } = kernel.axes[pair.axis].extent;
    let name = format!("{} and the next", kernel.axes[pair.axis].name);
    let (mut array, mut position) = (None, 0);
    let mut made = rewritten(kernel, |builder, node| {
        let value = ValueId::new(position);
        position += 1;
        let is_next = value == pair.next;
        if value != pair.here && !is_next {
            return None;
        }
        let one = builder.constant(1.0);
        let (buffer, _) = *array.get_or_insert_with(|| {
            let value = builder.made_again(node.clone());
            let longer = builder.axis(&name, Extent { size, offset: offset + 1 });
            let mut at = builder.running(longer);
            if is_next {
                at = builder.binary(Binary::Subtract, at, one);
            }
            let value = at_another(builder, value, (pair.axis, at), &mut HashMap::new());
            let axes: Vec<AxisId> = std::iter::once(longer).chain(others.iter().copied()).collect();
            (builder.buffer(&name, Role::Scratch, &axes), value)
        });
        let place = match is_next {
            false => Index::Axis(pair.axis),
            true => {
                let running = builder.running(pair.axis);
                Index::At(builder.binary(Binary::Add, running, one))
            }
        };
        let indices = std::iter::once(place).chain(others.iter().map(|axis| Index::Axis(*axis)));
        Some(builder.load(buffer, indices.collect()))
    });
    let (out, value) = array.expect("internal: the pair is a part of the kernel");
    let mut reads = vec![false; made.nodes.len()];
    for (id, node) in made.nodes.iter() {
        reads[id.position()] = matches!(node, Node::Load { buffer, .. } if *buffer == out)
            || made.operands(id).into_iter().any(|operand| reads[operand.position()]);
    }
    let is_reader = |nest: &Nest| roots(&nest.reduce, nest.value).iter().any(|root| reads[root.position()]);
    let first = made.nests.iter().position(is_reader).unwrap_or(made.nests.len());
    made.nests.insert(first, Nest { out, reduce: Reduce::None, value });
    made
}

/// The forms of values, `by` steps further along an axis.
struct Forms<'k> {
    kernel: &'k Kernel,
    axes: &'k [BTreeSet<AxisId>],
    axis: AxisId,
    by: f64,
    seen: usize,
}

impl Forms<'_> {
    /// The form of a value, if it can be determined.
    fn of(&mut self, value: ValueId) -> Option<Form> {
        self.seen += 1;
        if self.seen > MOST_VALUES {
            return None;
        }
        let alone = |atom: Atom| Some((BTreeMap::from([(atom, 1f64.to_bits())]), 0f64.to_bits()));
        match &self.kernel.nodes[value] {
            Node::Constant(bits) => Some((BTreeMap::new(), *bits)),
            Node::Axis(running) if *running == self.axis => {
                Some((BTreeMap::from([(Atom::Running, 1f64.to_bits())]), self.by.to_bits()))
            }
            Node::Binary(Binary::Add, left, right) => Some(sum(self.of(*left)?, self.of(*right)?, 1.0)),
            Node::Binary(Binary::Subtract, left, right) => Some(sum(self.of(*left)?, self.of(*right)?, -1.0)),
            _ if !self.axes[value.position()].contains(&self.axis) => alone(Atom::Value(value)),
            Node::Unary(operator, operand) => {
                alone(Atom::Unary(format!("{operator:?}"), Box::new(self.of(*operand)?)))
            }
            Node::Binary(operator, left, right) => {
                let (left, right) = (Box::new(self.of(*left)?), Box::new(self.of(*right)?));
                alone(Atom::Binary(format!("{operator:?}"), left, right))
            }
            _ => None,
        }
    }
}

/// left + sign · right
fn sum(left: Form, right: Form, sign: f64) -> Form {
    let add = |one: u64, other: u64| (f64::from_bits(one) + sign * f64::from_bits(other)).to_bits();
    let (mut terms, constant) = left;
    for (atom, factor) in right.0 {
        let own = terms.entry(atom).or_insert_with(|| 0f64.to_bits());
        *own = add(*own, factor);
    }
    terms.retain(|_, factor| f64::from_bits(*factor) != 0.0);
    (terms, add(constant, right.1))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernel::{KernelBuilder, OutputKey};

    /// Φ(i + upper − 2.25) − Φ(i − 2.25) for each i.
    fn kernel(upper: f64) -> Kernel {
        let mut builder = KernelBuilder::new("bins");
        let axis = builder.axis("i", Extent::constant(5));
        let out = builder.buffer("out", Role::Output(OutputKey::Ask(0)), &[axis]);
        let running = builder.running(axis);
        let [mean, upper] = [2.25, upper].map(|number| builder.constant(number));
        let low = builder.binary(Binary::Subtract, running, mean);
        let high = builder.binary(Binary::Add, running, upper);
        let high = builder.binary(Binary::Subtract, high, mean);
        let [low, high] = [low, high].map(|edge| builder.unary(Unary::NormalCumulative, edge));
        let bin = builder.binary(Binary::Subtract, high, low);
        builder.nest(out, Reduce::None, bin);
        builder.build()
    }

    /// The result of a nest over one axis, by definition.
    fn made(kernel: &Kernel, nest: &Nest, before: &HashMap<usize, Vec<f64>>) -> Vec<f64> {
        fn at(kernel: &Kernel, value: ValueId, i: f64, before: &HashMap<usize, Vec<f64>>) -> f64 {
            let of = |value: &ValueId| at(kernel, *value, i, before);
            match &kernel.nodes[value] {
                Node::Constant(bits) => f64::from_bits(*bits),
                Node::Axis(_) => i,
                Node::Unary(operator, x) => operator.apply(of(x)),
                Node::Binary(operator, x, y) => operator.apply(of(x), of(y)),
                Node::Load { buffer, indices, .. } => {
                    let place = match &indices[0] {
                        Index::At(place) => of(place),
                        _ => i,
                    };
                    before[&buffer.position()][place as usize]
                }
                Node::Select(..) | Node::Mass(..) => unreachable!("nothing is selected or integrated here"),
            }
        }
        let count = kernel.axes[kernel.buffers[nest.out].axes[0]].extent.known().unwrap();
        (0..count).map(|i| at(kernel, nest.value, i as f64, before)).collect()
    }

    #[test]
    fn neighbouring_bins_share_an_edge() {
        let shared = share_between_neighbours(kernel(1.0));
        let [edges, bins] = shared.nests.as_slice() else { panic!("{} nests", shared.nests.len()) };
        let found = made(&shared, edges, &HashMap::new());
        assert_eq!(found.len(), 6, "one more edge than bins");
        let found = made(&shared, bins, &HashMap::from([(edges.out.position(), found)]));
        for (i, bin) in found.iter().enumerate() {
            let cumulative = |edge: f64| crate::operators::normal_cumulative(edge - 2.25);
            let expected = cumulative(i as f64 + 1.0) - cumulative(i as f64);
            assert!((bin - expected).abs() < 1e-15, "bin {i}: {bin} is not {expected}");
        }
    }

    #[test]
    fn edges_that_do_not_meet_are_left_alone() {
        assert_eq!(share_between_neighbours(kernel(1.5)), kernel(1.5));
    }
}

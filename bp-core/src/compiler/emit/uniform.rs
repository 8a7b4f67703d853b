//! Hoists conditions that are the same in all lanes.
//!
//! In: a kernel. Out: the same, where `u and x < y` is `x < (u ? y : NaN)` if u and y are the same in all lanes.
//! Invariant: comparisons with NaN are false, so one comparison for each lane tests both conditions.

use crate::ids::ValueId;
use crate::kernel::schedule::reachable;
use crate::kernel::{Kernel, Node, rewritten};
use crate::operators::Binary;

/// The kernel with such conditions outside the lanes.
pub(super) fn with_uniform_conditions(kernel: &Kernel) -> Kernel {
    let Some(lane) = kernel.parallel.last() else { return kernel.clone() };
    rewritten(kernel, |builder, node| {
        let Node::Binary(Binary::And, left, right) = node else { return None };
        let varies = |value: ValueId| {
            let kernel = builder.so_far();
            reachable(kernel, value).into_iter().any(|part| kernel.nodes[part].axes().contains(lane))
        };
        let (condition, comparison) = match (varies(*left), varies(*right)) {
            (false, true) => (*left, *right),
            (true, false) => (*right, *left),
            _ => return None,
        };
        let Node::Binary(operator, x, y) = builder.so_far().nodes[comparison] else { return None };
        let is_false_of_nan = matches!(
            operator,
            Binary::Equal | Binary::Less | Binary::LessOrEqual | Binary::Greater | Binary::GreaterOrEqual
        );
        let uniform = match (is_false_of_nan, varies(x), varies(y)) {
            (true, false, true) => x,
            (true, true, false) => y,
            _ => return None,
        };
        let nothing = builder.constant(f64::NAN);
        let bound = builder.select(condition, uniform, nothing);
        let (x, y) = if uniform == x { (bound, y) } else { (x, bound) };
        Some(builder.binary(operator, x, y))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::exec::{Inputs, interpret};
    use crate::kernel::{Extent, Index, KernelBuilder, OutputKey, Reduce, Role};

    #[test]
    fn a_condition_of_a_row_is_part_of_the_bound() {
        let mut builder = KernelBuilder::new("rows");
        let [row, lane] =
            [("row", 2), ("lane", 3)].map(|(name, count)| builder.axis(name, Extent::constant(count)));
        let numbers = vec![0.25, 0.75, f64::NAN, 0.25, 0.75, f64::NAN];
        let input = builder.buffer("x", Role::Table { key: None, numbers }, &[row, lane]);
        let x = builder.load(input, vec![Index::Axis(row), Index::Axis(lane)]);
        let (at, one, bound) = (builder.running(row), builder.constant(1.0), builder.constant(0.5));
        let second = builder.binary(Binary::Equal, at, one);
        let below = builder.binary(Binary::Less, x, bound);
        let apart = builder.binary(Binary::NotEqual, x, bound);
        let pairs = [(second, below), (below, second), (second, apart)];
        for (number, (left, right)) in pairs.into_iter().enumerate() {
            let both = builder.binary(Binary::And, left, right);
            let key = OutputKey::Ask(number);
            let out = builder.buffer(&number.to_string(), Role::Output(key), &[row, lane]);
            builder.nest(out, Reduce::None, both);
        }
        builder.parallel(&[row, lane]);
        let before = builder.build();
        let after = with_uniform_conditions(&before);
        let is_and =
            |nest: usize| matches!(after.nodes[after.nests[nest].value], Node::Binary(Binary::And, ..));
        assert_eq!([0, 1, 2].map(is_and), [false, false, true], "≠ holds of NaN");
        // In the first row no condition holds; in the second 0.25 is below, and 0.25, 0.75 and NaN are not equal to
        // 0.5.
        let made = interpret(&after, &Inputs::new()).expect("it fits");
        let expected =
            [[0.0, 0.0, 0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0, 1.0, 1.0]];
        for (number, expected) in expected.iter().enumerate() {
            assert_eq!(made.get(OutputKey::Ask(number)), expected);
        }
    }
}

//! Numbers with a derivative: forward differentiation of expressions.
//!
//! In: an operator and numbers with their slopes in one slot. Out: the value and its slope. Invariant: the value is the one that
//! the operator has in f64; a step (a comparison, `floor`) has slope 0, and `abs`, `min` and `max` that of the branch taken.
//!
//! (f ∘ x)′ = f′(x) x′ (Wengert, *Communications of the ACM* 7:463-464, 1964).

use crate::exec::scalar::Number;
use crate::law::Arithmetic;
use crate::operators::{Binary, Mass, OPERANDS, Unary};
use std::f64::consts::{LN_2, TAU};

/// A value, and its derivative in one slot.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub(super) struct Dual {
    value: f64,
    pub(super) slope: f64,
}

/// Arithmetic with derivatives in one slot.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Duals {
    /// The slot; `None`: all numbers are constant.
    pub(super) of: Option<usize>,
}

/// The derivative of a function whose derivative is no operator, by differences of fourth order.
fn differentiated(operator: Unary, x: f64) -> f64 {
    let step = 1e-3 * x.abs().max(1e-3);
    let across = |steps: f64| operator.apply(x + steps * step) - operator.apply(x - steps * step);
    (8.0 * across(1.0) - across(2.0)) / (12.0 * step)
}

/// The derivative of an operator at `x`, where it has this value.
pub(super) fn slope_of(operator: Unary, x: f64, value: f64) -> f64 {
    match operator {
        Unary::Negate | Unary::Not => -1.0,
        Unary::Absolute => x.signum(),
        Unary::Exponential => value,
        Unary::NaturalLogarithm => 1.0 / x,
        Unary::SquareRoot => 0.5 / value,
        Unary::Floor | Unary::Ceiling | Unary::Round => 0.0,
        Unary::Sine => x.cos(),
        Unary::Cosine => -x.sin(),
        Unary::BinaryLogarithm => 1.0 / (x * LN_2),
        Unary::LnGamma | Unary::LnBessel => differentiated(operator, x),
        Unary::NormalCumulative => (-0.5 * x * x).exp() / TAU.sqrt(),
        Unary::EntropyTerm if value == 0.0 => 0.0,
        Unary::EntropyTerm => -x.ln() - 1.0,
    }
}

/// The derivatives of an operator by both operands.
pub(super) fn slopes_of(operator: Binary, x: f64, y: f64, value: f64) -> [f64; 2] {
    match operator {
        Binary::Add => [1.0, 1.0],
        Binary::Subtract => [1.0, -1.0],
        Binary::Multiply => [y, x],
        Binary::Divide => [1.0 / y, -value / y],
        Binary::Minimum | Binary::Maximum if value == x => [1.0, 0.0],
        Binary::Minimum | Binary::Maximum => [0.0, 1.0],
        Binary::Power => [y * x.powf(y - 1.0), value * x.ln()],
        Binary::Remainder => [1.0, -(x - value) / y],
        // The angle of the point (y, x): its first operand is the ordinate.
        Binary::ArcTangent => [y / (x * x + y * y), -x / (x * x + y * y)],
        _ => [0.0, 0.0],
    }
}

impl Number for Dual {
    fn known(number: f64) -> Self {
        Self { value: number, slope: 0.0 }
    }
    fn rounded(self) -> f64 {
        self.value
    }
    fn is_zero(self) -> bool {
        self.value == 0.0
    }
    fn unary(operator: Unary, Self { value: x, slope }: Self) -> Self {
        let value = operator.apply(x);
        if slope == 0.0 {
            return Self::known(value);
        }
        let factor = slope_of(operator, x, value);
        Self { value, slope: factor * slope }
    }
    fn binary(operator: Binary, x: Self, y: Self) -> Self {
        let value = operator.apply(x.value, y.value);
        if x.slope == 0.0 && y.slope == 0.0 {
            return Self::known(value);
        }
        let [by_x, by_y] = slopes_of(operator, x.value, y.value, value);
        // A slope may be undefined in the operand that does not move.
        let part = |by: f64, slope: f64| if slope == 0.0 { 0.0 } else { by * slope };
        let slope = part(by_x, x.slope) + part(by_y, y.slope);
        Self { value, slope }
    }
    /// The slope by differences of fourth order along the slopes of the operands.
    fn mass(law: Mass, operands: [Self; OPERANDS]) -> Self {
        let value = law.apply(operands.map(|operand| operand.value));
        let steepest = operands
            .iter()
            .fold(0.0, |most: f64, operand| most.max(operand.slope.abs() / operand.value.abs().max(1e-3)));
        if steepest == 0.0 {
            return Self::known(value);
        }
        let step = 1e-3 / steepest;
        let at = |steps: f64| law.apply(operands.map(|operand| operand.value + steps * step * operand.slope));
        let across = |steps: f64| at(steps) - at(-steps);
        Self { value, slope: (8.0 * across(1.0) - across(2.0)) / (12.0 * step) }
    }
}

impl Arithmetic for Duals {
    type Number = Dual;
    fn constant(&mut self, number: f64) -> Dual {
        Dual::known(number)
    }
    fn known(&self, x: Dual) -> Option<f64> {
        Some(x.value)
    }
    fn unary(&mut self, operator: Unary, x: Dual) -> Dual {
        Dual::unary(operator, x)
    }
    fn binary(&mut self, operator: Binary, x: Dual, y: Dual) -> Dual {
        Dual::binary(operator, x, y)
    }
    fn mass(&mut self, law: Mass, operands: [Dual; OPERANDS]) -> Dual {
        <Dual as Number>::mass(law, operands)
    }
    fn select(&mut self, condition: Dual, then: Dual, otherwise: Dual) -> Dual {
        if condition.value != 0.0 { then } else { otherwise }
    }
}

impl super::number::Known for Duals {
    fn variable(&mut self, slot: Option<usize>, number: f64) -> Dual {
        Dual { value: number, slope: f64::from(u8::from(self.of.is_some() && slot == self.of)) }
    }
}

#[cfg(test)]
mod tests {
    use super::Dual;
    use crate::exec::scalar::Number;
    use crate::operators::{Binary, Unary};

    #[test]
    fn slopes_are_the_limits_of_differences() {
        let at = |value: f64| Dual { value, slope: 1.0 };
        let unaries = [
            Unary::Negate,
            Unary::Absolute,
            Unary::Exponential,
            Unary::NaturalLogarithm,
            Unary::SquareRoot,
            Unary::Sine,
            Unary::Cosine,
            Unary::BinaryLogarithm,
            Unary::LnGamma,
            Unary::LnBessel,
            Unary::NormalCumulative,
            Unary::EntropyTerm,
        ];
        for operator in unaries {
            let (x, step) = (0.7, 1e-5);
            let expected = (operator.apply(x + step) - operator.apply(x - step)) / (2.0 * step);
            let found = Dual::unary(operator, at(x)).slope;
            assert!((found - expected).abs() < 1e-8, "{operator:?}: {found}, expected {expected}");
        }
        let binaries = [
            Binary::Add,
            Binary::Subtract,
            Binary::Multiply,
            Binary::Divide,
            Binary::Minimum,
            Binary::Maximum,
            Binary::Power,
            Binary::Remainder,
            Binary::ArcTangent,
        ];
        for operator in binaries {
            for (dx, dy) in [(1.0, 0.0), (0.0, 1.0), (2.0, -3.0)] {
                let (x, y, step) = (1.7, 0.6, 1e-6);
                let moved = |by: f64| operator.apply(x + by * dx, y + by * dy);
                let expected = (moved(step) - moved(-step)) / (2.0 * step);
                let duals = (Dual { value: x, slope: dx }, Dual { value: y, slope: dy });
                let found = Dual::binary(operator, duals.0, duals.1).slope;
                assert!((found - expected).abs() < 1e-7, "{operator:?}: {found}, expected {expected}");
            }
        }
    }
}

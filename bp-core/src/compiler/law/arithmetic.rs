//! Arithmetic that is either evaluated or emitted.
//!
//! In: operators on numbers. Out: numbers. Invariant: an equation that is written once, over an [`Arithmetic`], is the
//! same in f64 ([`Numbers`]), with separate exponents ([`Wide`]) and in a kernel, where its numbers are nodes.

use crate::exec::scalar::{self, Extended, Scalar};
use crate::operators::{Binary, Mass, OPERANDS, Unary};

/// Reals that differ by at most this share of the larger one are equal.
pub const ROUNDING: f64 = 1e-12;

/// A type of arithmetic in which an equation can be evaluated.
pub trait Arithmetic {
    /// A number, or a node.
    type Number: Copy;
    /// A known number.
    fn constant(&mut self, number: f64) -> Self::Number;
    /// The number itself, if it is known at this time.
    fn known(&self, x: Self::Number) -> Option<f64>;
    /// An operator on one number.
    fn unary(&mut self, operator: Unary, x: Self::Number) -> Self::Number;
    /// An operator on two.
    fn binary(&mut self, operator: Binary, x: Self::Number, y: Self::Number) -> Self::Number;
    /// The second if the first is not 0, else the third.
    fn select(
        &mut self,
        condition: Self::Number,
        then: Self::Number,
        otherwise: Self::Number,
    ) -> Self::Number;

    /// The probability of an interval.
    fn mass(&mut self, law: Mass, operands: [Self::Number; OPERANDS]) -> Self::Number;

    /// x + y
    fn add(&mut self, x: Self::Number, y: Self::Number) -> Self::Number {
        self.binary(Binary::Add, x, y)
    }
    /// x − y
    fn subtract(&mut self, x: Self::Number, y: Self::Number) -> Self::Number {
        self.binary(Binary::Subtract, x, y)
    }
    /// x · y
    fn multiply(&mut self, x: Self::Number, y: Self::Number) -> Self::Number {
        self.binary(Binary::Multiply, x, y)
    }
    /// x / y
    fn divide(&mut self, x: Self::Number, y: Self::Number) -> Self::Number {
        self.binary(Binary::Divide, x, y)
    }
    /// ln x
    fn ln(&mut self, x: Self::Number) -> Self::Number {
        self.unary(Unary::NaturalLogarithm, x)
    }
    /// eˣ
    fn exp(&mut self, x: Self::Number) -> Self::Number {
        self.unary(Unary::Exponential, x)
    }
    /// x · ln y, which is 0 where x is 0, whatever y is.
    fn times_ln(&mut self, x: Self::Number, y: Self::Number) -> Self::Number {
        let (ln, zero) = (self.ln(y), self.constant(0.0));
        let product = self.multiply(x, ln);
        self.select(x, product, zero)
    }
    /// The value where the condition holds, else −∞: the logarithm of a density that ends there.
    fn within(&mut self, condition: Self::Number, ln_density: Self::Number) -> Self::Number {
        let nothing = self.constant(f64::NEG_INFINITY);
        self.select(condition, ln_density, nothing)
    }
    /// 1 − e⁻ᵈ for d ≥ 0. With u = e⁻ᵈ it is 1 − u; of a small d, (1 − u) d / −ln u, where the rounding of u cancels (Kahan).
    fn complement_of_exp(&mut self, d: Self::Number) -> Self::Number {
        let (one, half, minus) = (self.constant(1.0), self.constant(0.5), self.unary(Unary::Negate, d));
        let u = self.exp(minus);
        let (rest, ln_u) = (self.subtract(one, u), self.ln(u));
        let part = self.multiply(rest, d);
        let exact = self.divide(part, ln_u);
        let exact = self.unary(Unary::Negate, exact);
        let large = self.binary(Binary::Less, u, half);
        let (no_change, exact) = (self.binary(Binary::Equal, u, one), self.select(large, rest, exact));
        self.select(no_change, d, exact)
    }
    /// Whether low ≤ x ≤ high. A number that differs from a bound by rounding only is the bound: 3 from 3 · 0.1 · 10.
    fn lies_between(&mut self, x: Self::Number, [low, high]: [Self::Number; 2]) -> Self::Number {
        let rounding = self.constant(ROUNDING);
        let [low_by, high_by] = [low, high].map(|bound| {
            let size = self.unary(Unary::Absolute, bound);
            self.multiply(rounding, size)
        });
        let (low, high) = (self.subtract(low, low_by), self.add(high, high_by));
        let above = self.binary(Binary::GreaterOrEqual, x, low);
        let below = self.binary(Binary::LessOrEqual, x, high);
        self.binary(Binary::And, above, below)
    }
    /// Whether x > y.
    fn greater(&mut self, x: Self::Number, y: Self::Number) -> Self::Number {
        self.binary(Binary::Greater, x, y)
    }
    /// Whether x is a whole number that is not negative.
    fn is_count(&mut self, x: Self::Number) -> Self::Number {
        let (zero, whole) = (self.constant(0.0), self.unary(Unary::Floor, x));
        let whole = self.binary(Binary::Equal, x, whole);
        let positive = self.binary(Binary::GreaterOrEqual, x, zero);
        self.binary(Binary::And, whole, positive)
    }
}

/// Arithmetic in f64.
#[derive(Clone, Copy, Debug, Default)]
pub struct Numbers;

impl Arithmetic for Numbers {
    type Number = f64;
    fn constant(&mut self, number: f64) -> f64 {
        number
    }
    fn known(&self, x: f64) -> Option<f64> {
        Some(x)
    }
    fn unary(&mut self, operator: Unary, x: f64) -> f64 {
        operator.apply(x)
    }
    fn binary(&mut self, operator: Binary, x: f64, y: f64) -> f64 {
        operator.apply(x, y)
    }
    fn mass(&mut self, law: Mass, operands: [f64; OPERANDS]) -> f64 {
        law.apply(operands)
    }
    fn select(&mut self, condition: f64, then: f64, otherwise: f64) -> f64 {
        if condition != 0.0 { then } else { otherwise }
    }
}

/// Arithmetic in numbers with unbounded exponents.
#[derive(Clone, Copy, Debug, Default)]
pub struct Wide;

impl Arithmetic for Wide {
    type Number = Extended;
    fn constant(&mut self, number: f64) -> Extended {
        Extended::from_f64(number)
    }
    fn known(&self, x: Extended) -> Option<f64> {
        // A number outside the range of f64 counts as not known.
        let number = x.to_f64();
        (number.is_normal() || x == Extended::ZERO).then_some(number)
    }
    fn unary(&mut self, operator: Unary, x: Extended) -> Extended {
        scalar::unary(operator, x)
    }
    fn binary(&mut self, operator: Binary, x: Extended, y: Extended) -> Extended {
        scalar::binary(operator, x, y)
    }
    fn mass(&mut self, law: Mass, operands: [Extended; OPERANDS]) -> Extended {
        <Extended as Scalar>::mass(law, operands)
    }
    fn select(&mut self, condition: Extended, then: Extended, otherwise: Extended) -> Extended {
        if condition == Extended::ZERO { otherwise } else { then }
    }
}

//! The operators shared by models and kernels.
//!
//! In: numbers. Out: a number; truth values are 1 and 0. Invariant: every operator has the same meaning in each back
//! end; the interpreter's evaluation ([`Unary::apply`], [`Binary::apply`]) is the definition.

pub use crate::special::{Mass, OPERANDS, ln_bessel, ln_gamma, normal_cumulative};
use serde::{Deserialize, Serialize};

/// An operator on one number.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, Serialize, Deserialize)]
pub enum Unary {
    /// −x
    Negate,
    /// 1 − x, for x ∈ {0, 1}
    Not,
    /// |x|
    Absolute,
    /// eˣ
    Exponential,
    /// natural logarithm
    NaturalLogarithm,
    /// √x
    SquareRoot,
    /// ⌊x⌋
    Floor,
    /// ⌈x⌉
    Ceiling,
    /// The nearest whole number, halves away from zero
    Round,
    /// sine of an angle in rad
    Sine,
    /// cosine of an angle in rad
    Cosine,
    /// logarithm to base 2, exact for powers of 2
    BinaryLogarithm,
    /// ln Γ(x), for x > 0
    LnGamma,
    /// ln I₀(x), the modified Bessel function of order 0, for x ≥ 0
    LnBessel,
    /// Φ(x), the cumulative distribution of the standard normal law
    NormalCumulative,
    /// −x ln x, and 0 at 0 and below: one term of an entropy. NaN stays NaN
    EntropyTerm,
}

/// An operator on two numbers.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, Serialize, Deserialize)]
pub enum Binary {
    /// x + y
    Add,
    /// x − y
    Subtract,
    /// x · y
    Multiply,
    /// x / y
    Divide,
    /// min(x, y)
    Minimum,
    /// max(x, y)
    Maximum,
    /// xʸ
    Power,
    /// the remainder of x modulo y, in [0, y)
    Remainder,
    /// the angle of the point (y, x) in rad, in (−π, π]
    ArcTangent,
    /// x = y
    Equal,
    /// x ≠ y
    NotEqual,
    /// x < y
    Less,
    /// x ≤ y
    LessOrEqual,
    /// x > y
    Greater,
    /// x ≥ y
    GreaterOrEqual,
    /// both
    And,
    /// either
    Or,
}

impl Unary {
    /// The operator's value at `x`.
    #[inline]
    pub fn apply(self, x: f64) -> f64 {
        match self {
            Unary::Negate => -x,
            Unary::Not => 1.0 - x,
            Unary::Absolute => x.abs(),
            Unary::Exponential => x.exp(),
            Unary::NaturalLogarithm => x.ln(),
            Unary::SquareRoot => x.sqrt(),
            Unary::Floor => x.floor(),
            Unary::Ceiling => x.ceil(),
            Unary::Round => x.round(),
            Unary::Sine => x.sin(),
            Unary::Cosine => x.cos(),
            Unary::BinaryLogarithm => x.log2(),
            Unary::LnGamma => ln_gamma(x),
            Unary::LnBessel => ln_bessel(x),
            Unary::NormalCumulative => normal_cumulative(x),
            Unary::EntropyTerm => entropy_term(x),
        }
    }

    /// The operator's value at a known `x`, unless it is outside the range of f64: then it is computed at run time,
    /// possibly in a wider range.
    pub fn folded(self, x: f64) -> Option<f64> {
        let value = self.apply(x);
        let may_lose = matches!(self, Unary::Exponential | Unary::NormalCumulative) && x.is_finite();
        (!may_lose || value.is_normal()).then_some(value)
    }
}

/// −p ln p, which is 0 at 0 and at 1, and also where rounding has put a probability above 1.
pub fn entropy_term(p: f64) -> f64 {
    if p <= 0.0 || p >= 1.0 { 0.0 } else { -p * p.ln() }
}

/// −Σ p ln p: the entropy of a finite law, in nats. It is never negative.
pub fn entropy(probabilities: impl IntoIterator<Item = f64>) -> f64 {
    probabilities.into_iter().fold(0.0, |sum, p| sum + entropy_term(p))
}

impl Binary {
    /// Whether it compares two numbers.
    pub fn compares(self) -> bool {
        use Binary::*;
        matches!(self, Equal | NotEqual | Less | LessOrEqual | Greater | GreaterOrEqual)
    }

    /// The operator's value at `x`, `y`.
    pub fn apply(self, x: f64, y: f64) -> f64 {
        let truth = |condition: bool| f64::from(u8::from(condition));
        match self {
            Binary::Add => x + y,
            Binary::Subtract => x - y,
            Binary::Multiply => x * y,
            Binary::Divide => x / y,
            Binary::Minimum => x.min(y),
            Binary::Maximum => x.max(y),
            Binary::Power => x.powf(y),
            Binary::Remainder => x - y * (x / y).floor(),
            Binary::ArcTangent => x.atan2(y),
            Binary::Equal => truth(x == y),
            Binary::NotEqual => truth(x != y),
            Binary::Less => truth(x < y),
            Binary::LessOrEqual => truth(x <= y),
            Binary::Greater => truth(x > y),
            Binary::GreaterOrEqual => truth(x >= y),
            Binary::And => truth(x != 0.0 && y != 0.0),
            Binary::Or => truth(x != 0.0 || y != 0.0),
        }
    }

    /// The operator's value at known numbers, unless it is outside the range of f64, as in [`Unary::folded`].
    pub fn folded(self, x: f64, y: f64) -> Option<f64> {
        let value = self.apply(x, y);
        let exact = match self {
            Binary::Multiply => x == 0.0 || y == 0.0,
            Binary::Divide | Binary::Power => x == 0.0,
            Binary::Add | Binary::Subtract => value.is_finite(),
            _ => true,
        };
        (exact || value.is_normal() || !(x.is_finite() && y.is_finite())).then_some(value)
    }

    /// Whether it is written as a function, `min(x, y)`, rather than between its operands.
    pub fn is_function(self) -> bool {
        use Binary::{ArcTangent, Maximum, Minimum, Power, Remainder};
        matches!(self, Minimum | Maximum | Power | Remainder | ArcTangent)
    }

    /// The precedence of the operator, loosest first; and its sign.
    pub fn notation(self) -> (u8, &'static str) {
        match self {
            Binary::Or => (1, "or"),
            Binary::And => (2, "and"),
            Binary::Equal => (3, "=="),
            Binary::NotEqual => (3, "!="),
            Binary::Less => (3, "<"),
            Binary::LessOrEqual => (3, "<="),
            Binary::Greater => (3, ">"),
            Binary::GreaterOrEqual => (3, ">="),
            Binary::Add => (4, "+"),
            Binary::Subtract => (4, "-"),
            Binary::Multiply => (5, "*"),
            Binary::Divide => (5, "/"),
            Binary::Minimum => (9, "min"),
            Binary::Maximum => (9, "max"),
            Binary::Power => (9, "pow"),
            Binary::Remainder => (9, "mod"),
            Binary::ArcTangent => (9, "atan2"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_bessel_function_is_its_integral() {
        // I₀(x) = 1/π ∫ exp(x cos t) dt over [0, π]; the trapezium rule converges faster than any power.
        for x in [0.0, 0.1, 1.0, 5.0, 29.9, 30.1, 100.0, 600.0] {
            let steps = 4000;
            let sum: f64 = (0..steps)
                .map(|step| (f64::from(step) + 0.5) * std::f64::consts::PI / f64::from(steps))
                .map(|t| (x * (t.cos() - 1.0)).exp())
                .sum();
            let exact = x + (sum / f64::from(steps)).ln();
            assert!((ln_bessel(x) - exact).abs() < 1e-12 * exact.abs().max(1.0), "{x}");
        }
    }

    #[test]
    fn remainders_and_powers_are_those_of_their_definitions() {
        assert_eq!(Binary::Remainder.apply(-10.0, 360.0), 350.0);
        assert_eq!(Binary::Remainder.apply(720.0, 360.0), 0.0);
        for power in 0..40 {
            assert_eq!(Unary::BinaryLogarithm.apply(2f64.powi(power)), f64::from(power));
        }
        assert_eq!(Binary::ArcTangent.apply(1.0, 0.0), std::f64::consts::FRAC_PI_2);
    }
}

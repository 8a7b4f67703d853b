//! The arithmetic that models and kernels share.
//!
//! In: numbers. Out: a number; truth values are 1 and 0. Invariant: every operator means the same in each
//! back end; the interpreter's reading of it ([`Unary::apply`], [`Binary::apply`]) is the definition.

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
    /// Φ(x), the cumulative distribution of the standard normal law
    NormalCumulative,
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
    pub fn apply(self, x: f64) -> f64 {
        match self {
            Unary::Negate => -x,
            Unary::Not => 1.0 - x,
            Unary::Absolute => x.abs(),
            Unary::Exponential => x.exp(),
            Unary::NaturalLogarithm => x.ln(),
            Unary::SquareRoot => x.sqrt(),
            Unary::Floor => x.floor(),
            Unary::NormalCumulative => normal_cumulative(x),
        }
    }
}

impl Binary {
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

    /// How tightly the operator binds when written, loosest first; and its sign.
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
        }
    }
}

/// Φ(x) = ½ erfc(−x/√2), accurate in both tails.
pub fn normal_cumulative(x: f64) -> f64 {
    0.5 * statrs::function::erf::erfc(-x * std::f64::consts::FRAC_1_SQRT_2)
}

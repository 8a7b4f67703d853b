//! The WGSL text of numbers and operators.
//!
//! In: an operator and the text of its operands. Out: text. Invariant: operands are names, so that none needs parentheses.

use crate::operators::{Binary, Unary};

pub(super) fn constant(number: f64) -> String {
    // Numbers out of the range of f32 become its largest or smallest number, since a literal must not overflow.
    let single = number as f32;
    match single.is_finite() {
        true => format!("f32({single:?})"),
        false if number.is_nan() => "(infinity() - infinity())".to_owned(),
        false => format!("{}infinity()", if number < 0.0 { "-" } else { "" }),
    }
}

pub(super) fn unary(operator: Unary, x: &str) -> String {
    match operator {
        Unary::Negate => format!("-{x}"),
        Unary::Not => format!("1.0 - {x}"),
        Unary::Absolute => format!("abs({x})"),
        Unary::Exponential => format!("exp({x})"),
        Unary::NaturalLogarithm => format!("log({x})"),
        Unary::SquareRoot => format!("sqrt({x})"),
        Unary::Floor => format!("floor({x})"),
        Unary::Ceiling => format!("ceil({x})"),
        Unary::Round => format!("sign({x}) * floor(abs({x}) + 0.5)"),
        Unary::Sine => format!("sin({x})"),
        Unary::Cosine => format!("cos({x})"),
        Unary::BinaryLogarithm => format!("log2({x})"),
        Unary::LnGamma => format!("ln_gamma({x})"),
        Unary::LnBessel => format!("ln_bessel({x})"),
        Unary::NormalCumulative => format!("normal_cumulative({x})"),
        Unary::EntropyTerm => format!("entropy_term({x})"),
    }
}

pub(super) fn binary(operator: Binary, x: &str, y: &str) -> String {
    let truth = |condition: String| format!("select(0.0, 1.0, {condition})");
    match operator {
        Binary::Add | Binary::Subtract | Binary::Multiply | Binary::Divide => {
            format!("{x} {} {y}", operator.notation().1)
        }
        Binary::Minimum => format!("min({x}, {y})"),
        Binary::Maximum => format!("max({x}, {y})"),
        Binary::Power => format!("power({x}, {y})"),
        Binary::Remainder => format!("{x} - {y} * floor({x} / {y})"),
        Binary::ArcTangent => format!("atan2({x}, {y})"),
        Binary::And => truth(format!("{x} != 0.0 && {y} != 0.0")),
        Binary::Or => truth(format!("{x} != 0.0 || {y} != 0.0")),
        _ => truth(format!("{x} {} {y}", operator.notation().1)),
    }
}

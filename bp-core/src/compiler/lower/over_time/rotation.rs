//! Functions of vectors, with slopes.
//!
//! In: components with their slopes. Out: a length, a rotated vector. Invariant: both have slopes at 0, where a rotation is
//! v + w × v to first order.
//!
//! rotate(v, w) = v cos a + (w × v) (sin a)/a + w (w · v) (1 − cos a)/a², a = |w| (Rodrigues 1840). The three functions are
//! analytic in q = a²: Σ (−q)ⁿ/(2n)!, Σ (−q)ⁿ/(2n+1)! and Σ (−q)ⁿ/(2n+2)!; near 0 they are these series.

use super::tangent::{Place, Tangents};
use crate::ids::ValueId;
use crate::law::Arithmetic;
use crate::operators::{Binary, Unary};

/// The q below which the series is used: its terms from the seventh on are below the rounding of f64.
const NEAR: f64 = 0.01;

/// The terms of a series.
const TERMS: usize = 6;

fn dot(by: &mut Tangents, v: &[Place], w: &[Place]) -> Place {
    let products: Vec<Place> = v.iter().zip(w).map(|(v, w)| by.multiply(*v, *w)).collect();
    let sum = products.into_iter().reduce(|sum, product| by.add(sum, product));
    sum.unwrap_or_else(|| by.constant(0.0))
}

/// √Σ vᵢ²
pub(super) fn norm(by: &mut Tangents, v: &[Place]) -> Place {
    let square = dot(by, v, v);
    by.unary(Unary::SquareRoot, square)
}

/// w × v
pub(super) fn cross(by: &mut Tangents, w: [Place; 3], v: [Place; 3]) -> [Place; 3] {
    [(1, 2), (2, 0), (0, 1)].map(|(i, j)| {
        let (one, other) = (by.multiply(w[i], v[j]), by.multiply(w[j], v[i]));
        by.subtract(one, other)
    })
}

/// v turned by |w| around w.
pub(super) fn rotated(by: &mut Tangents, v: [Place; 3], w: [Place; 3]) -> [Place; 3] {
    let square = dot(by, &w, &w);
    let [kept, turned, along] = functions(by, square);
    let (cross, inside) = (cross(by, w, v), dot(by, &w, &v));
    let along = by.multiply(inside, along);
    [0, 1, 2].map(|i| {
        let (kept, turned) = (by.multiply(v[i], kept), by.multiply(cross[i], turned));
        let (along, sum) = (by.multiply(w[i], along), by.add(kept, turned));
        by.add(sum, along)
    })
}

/// cos a, (sin a)/a and (1 − cos a)/a², with the slopes −f₁/2, (f₀ − f₁)/2q and (f₁ − 2 f₂)/2q of each in q = a².
fn functions(by: &mut Tangents, square: Place) -> [Place; 3] {
    let q = by.value(square);
    let (near, one) = (by.builder.constant(NEAR), by.builder.constant(1.0));
    let is_near = by.builder.binary(Binary::Less, q, near);
    // Where the series is used, the closed form is computed elsewhere, at a place where it is defined.
    let away = by.builder.select(is_near, one, q);
    let angle = by.builder.unary(Unary::SquareRoot, away);
    let (sine, cosine) = (by.builder.unary(Unary::Sine, angle), by.builder.unary(Unary::Cosine, angle));
    let two = |by: &mut Tangents, operator, x, y| by.builder.binary(operator, x, y);
    let rest = two(by, Binary::Subtract, one, cosine);
    let closed = [cosine, two(by, Binary::Divide, sine, angle), two(by, Binary::Divide, rest, away)];
    let values = [0, 1, 2].map(|n| {
        let series = series(by, q, |k| 1.0 / factorial(2 * k + n));
        by.builder.select(is_near, series, closed[n])
    });
    let (half, double) = (by.builder.constant(-0.5), by.builder.constant(2.0));
    let twice = two(by, Binary::Multiply, double, away);
    let second = two(by, Binary::Multiply, double, closed[2]);
    let differences =
        [two(by, Binary::Subtract, closed[0], closed[1]), two(by, Binary::Subtract, closed[1], second)];
    let slopes = [1, 2].map(|n| {
        let away = two(by, Binary::Divide, differences[n - 1], twice);
        // Σ n (−1)ⁿ qⁿ⁻¹ / (2n + 1)!
        let series = series(by, q, |k| -((k + 1) as f64) / factorial(2 * (k + 1) + n));
        by.builder.select(is_near, series, away)
    });
    let first = two(by, Binary::Multiply, half, values[1]);
    [first, slopes[0], slopes[1]]
        .into_iter()
        .zip(values)
        .map(|(slope, value)| by.chained(value, &[(square, Some(slope))]))
        .collect::<Vec<Place>>()
        .try_into()
        .expect("internal: three functions")
}

/// Σ cₖ (−q)ᵏ
fn series(by: &mut Tangents, q: ValueId, coefficient: impl Fn(usize) -> f64) -> ValueId {
    let mut sum = by.builder.constant(coefficient(TERMS - 1));
    for k in (0..TERMS - 1).rev() {
        let (product, own) =
            (by.builder.binary(Binary::Multiply, q, sum), by.builder.constant(coefficient(k)));
        sum = by.builder.binary(Binary::Subtract, own, product);
    }
    sum
}

fn factorial(n: usize) -> f64 {
    (1..=n).map(|factor| factor as f64).product()
}

//! Functions of vectors.
//!
//! In: components, in any arithmetic whose numbers are known. Out: a length, a rotated vector. Invariant: derivatives exist at 0,
//! where a rotation is v + w × v to first order.
//!
//! rotate(v, w): v turned by |w| around w (Rodrigues 1840): v cos a + (n × v) sin a + n (n · v)(1 − cos a).

use super::number::Known;
use crate::exec::scalar::Number;
use crate::operators::Unary;

/// √Σ vᵢ²
pub(super) fn norm<A: Known>(by: &mut A, v: &[A::Number]) -> A::Number {
    let mut sum = by.constant(0.0);
    for part in v {
        let square = by.multiply(*part, *part);
        sum = by.add(sum, square);
    }
    match sum.is_zero() {
        true => sum,
        false => by.unary(Unary::SquareRoot, sum),
    }
}

/// v turned by |w| around w; to first order v + w × v, where w is 0.
pub(super) fn rotated<A: Known>(by: &mut A, v: [A::Number; 3], w: [A::Number; 3]) -> [A::Number; 3] {
    let cross = |by: &mut A, w: &[A::Number; 3]| {
        [(1, 2), (2, 0), (0, 1)].map(|(i, j)| {
            let (one, other) = (by.multiply(w[i], v[j]), by.multiply(w[j], v[i]));
            by.subtract(one, other)
        })
    };
    let angle = norm(by, &w);
    if angle.is_zero() {
        let turned = cross(by, &w);
        return [0, 1, 2].map(|i| by.add(v[i], turned[i]));
    }
    let n = w.map(|part| by.divide(part, angle));
    let mut dot = by.constant(0.0);
    for i in 0..3 {
        let product = by.multiply(n[i], v[i]);
        dot = by.add(dot, product);
    }
    let cross = cross(by, &n);
    let (sine, cosine) = (by.unary(Unary::Sine, angle), by.unary(Unary::Cosine, angle));
    let one = by.constant(1.0);
    let rest = by.subtract(one, cosine);
    [0, 1, 2].map(|i| {
        let (kept, turned, along) =
            (by.multiply(v[i], cosine), by.multiply(cross[i], sine), by.multiply(n[i], dot));
        let (along, sum) = (by.multiply(along, rest), by.add(kept, turned));
        by.add(sum, along)
    })
}

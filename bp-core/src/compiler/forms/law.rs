//! A law over the values of a finite variable: the unnormalised weight of each value.
//!
//! In: a law with valid parameters, and a value. Out: its weight. Invariant: where the law gives the whole domain no
//! mass, all weights are 0.
//!
//! Integers: f(k).  Bins: F(bᵢ₊₁) − F(bᵢ); without a closed form of F, five Gauss–Legendre points; for a law of counts,
//! f at the centre.  Circles: the mass within half a bin of the centre, along the shorter arc; von Mises: f there, with
//! the full turn scaled to 2π.

use crate::law::{Arithmetic, Law, Support};
use crate::model::Bins;
use crate::operators::Binary;

/// Nodes and weights of the Gauss–Legendre rule of five points on [−1, 1] (Abramowitz and Stegun, table 25.4).
const RULE: [(f64, f64); 5] = [
    (0.0, 0.568_888_888_888_888_9),
    (-0.538_469_310_105_683_1, 0.478_628_670_499_366_47),
    (0.538_469_310_105_683_1, 0.478_628_670_499_366_47),
    (-0.906_179_845_938_664, 0.236_926_885_056_189_08),
    (0.906_179_845_938_664, 0.236_926_885_056_189_08),
];

/// A value of a finite variable.
pub(crate) trait Value {
    /// The arithmetic.
    type By: Arithmetic;
    /// The arithmetic.
    fn by(&mut self) -> &mut Self::By;
    /// The number of the value; of a bin, its centre.
    fn number(&mut self) -> Number<Self>;
    /// The edges of a bin.
    fn edges(&mut self) -> [Number<Self>; 2];
}

/// A number in the arithmetic of a value.
pub(crate) type Number<V> = <<V as Value>::By as Arithmetic>::Number;

/// The weight of a value of these bins or of integers under a law.
pub(crate) fn weight<V: Value>(
    value: &mut V,
    law: Law,
    bins: Option<&Bins>,
    parameters: &[Number<V>],
) -> Number<V> {
    match bins {
        Some(bins) if goes_round(law, bins) => {
            let centre = value.number();
            on_circle(value.by(), law, centre, bins, parameters)
        }
        Some(_) if law.support() != Support::Counts => {
            let edges = value.edges();
            mass(value.by(), law, edges, parameters)
        }
        _ => {
            let number = value.number();
            law.density_by(value.by(), number, parameters)
        }
    }
}

/// Whether a law wraps around a circle; others are cut at its ends.
pub(crate) fn goes_round(law: Law, bins: &Bins) -> bool {
    bins.is_circle() && matches!(law, Law::Normal | Law::VonMises)
}

/// The mass between two numbers.
fn mass<A: Arithmetic>(
    by: &mut A,
    law: Law,
    [from, to]: [A::Number; 2],
    parameters: &[A::Number],
) -> A::Number {
    law.mass(by, from, to, parameters).unwrap_or_else(|| quadrature(by, law, [from, to], parameters))
}

/// ∫ f between two numbers, by the five-point rule.
fn quadrature<A: Arithmetic>(
    by: &mut A,
    law: Law,
    [from, to]: [A::Number; 2],
    parameters: &[A::Number],
) -> A::Number {
    let half = by.constant(0.5);
    let (sum, width) = (by.add(from, to), by.subtract(to, from));
    let (middle, half_width) = (by.multiply(half, sum), by.multiply(half, width));
    let mut mass = by.constant(0.0);
    for (node, weight) in RULE {
        let (node, weight) = (by.constant(node), by.constant(weight));
        let offset = by.multiply(node, half_width);
        let x = by.add(middle, offset);
        let density = law.density_by(by, x, parameters);
        let part = by.multiply(weight, density);
        mass = by.add(mass, part);
    }
    by.multiply(mass, half_width)
}

fn on_circle<A: Arithmetic>(
    by: &mut A,
    law: Law,
    centre: A::Number,
    bins: &Bins,
    parameters: &[A::Number],
) -> A::Number {
    let (low, high) = bins.ends();
    let (turn, width) = (high - low, (high - low) / bins.count() as f64);
    let (half, whole) = (by.constant(0.5 * turn), by.constant(turn));
    let centred = by.subtract(centre, parameters[0]);
    let shifted = by.add(centred, half);
    let around = by.binary(Binary::Remainder, shifted, whole);
    let distance = by.subtract(around, half);
    let zero = by.constant(0.0);
    let centred = [zero, parameters[1]];
    if law == Law::VonMises {
        let scale = by.constant(std::f64::consts::TAU / turn);
        let angle = by.multiply(distance, scale);
        return law.density_by(by, angle, &centred);
    }
    let half_width = by.constant(0.5 * width);
    let edges = [by.subtract(distance, half_width), by.add(distance, half_width)];
    mass(by, law, edges, &centred)
}

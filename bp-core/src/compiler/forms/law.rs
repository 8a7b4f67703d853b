//! A law over the values of a finite variable: the unnormalised weight of each value.
//!
//! In: a law with valid parameters, and a value. Out: its weight. Invariant: where the law gives the whole domain no
//! mass, all weights are 0.
//!
//! Integers: f(k), up to a factor.  Bins: F(bᵢ₊₁) − F(bᵢ); for a law of counts, f at the centre.  Circles: the mass within half a bin of the centre, along the shorter arc; von Mises: f there, with
//! the full turn scaled to 2π.

use crate::law::{Arithmetic, Law, Support};
use crate::model::Bins;
use crate::operators::Binary;

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
    /// The numbers of the first and the last value of the variable.
    fn ends(&mut self) -> [Number<Self>; 2];
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
            let (number, ends) = (value.number(), value.ends());
            law.weight_by(value.by(), number, parameters, ends)
        }
    }
}

/// Whether a law wraps around a circle; others are cut at its ends.
pub(crate) fn goes_round(law: Law, bins: &Bins) -> bool {
    bins.is_circle() && matches!(law, Law::Normal | Law::VonMises)
}

/// The mass between two numbers under a law of reals.
fn mass<A: Arithmetic>(
    by: &mut A,
    law: Law,
    [from, to]: [A::Number; 2],
    parameters: &[A::Number],
) -> A::Number {
    law.mass(by, from, to, parameters).expect("internal: a law of reals has masses")
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

//! A law over the values of a finite variable: the unnormalised weight of each value.
//!
//! In: a law with valid parameters, and a value. Out: its weight. Invariant: where the law gives the whole domain no
//! mass, all weights are 0.
//!
//! Integers: f(k), up to a factor.  Bins: F(bᵢ₊₁) − F(bᵢ), which a law of counts has not: it is over integers.  Circles:
//! the mass within half a bin of the centre, along the shorter arc; von Mises: f there, with the full turn scaled to 2π.
//! Of a bin that is cut by bounds, the mass of the part between them; of von Mises the share of its width.

use super::truncated;
use crate::law::{Arithmetic, Law};
use crate::model::Bins;
use crate::operators::{Binary, Unary};

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

/// The weight of a value of these bins or of integers under a law; of a bin, that of its part within the bounds.
pub(crate) fn weight<V: Value>(
    value: &mut V,
    law: Law,
    bins: Option<&Bins>,
    parameters: &[Number<V>],
    bounds: Option<[Number<V>; 2]>,
) -> Number<V> {
    match bins {
        Some(bins) if goes_round(law, bins) => {
            let centre = value.number();
            on_circle(value.by(), law, (centre, bins), parameters, bounds)
        }
        Some(_) => {
            let edges = value.edges();
            let edges = match bounds {
                Some(bounds) => truncated::part(value.by(), edges, bounds),
                None => edges,
            };
            mass(value.by(), law, edges, parameters)
        }
        None => {
            let (number, ends) = (value.number(), value.ends());
            law.weight_by(value.by(), number, parameters, ends)
        }
    }
}

/// The law that is the same over bins whose ends do not enclose its location, but for a factor, and that has its location
/// at the nearest end, where differences from it keep their digits. A Laplace law is exponential on each side; so is a normal law many widths
/// away, by the slope of ln f at that end. A lognormal law so far away that all other bins have the mass 0 is in the bin at that end.
/// Parameters that are not known stay.
pub(crate) fn located<A: Arithmetic>(
    by: &mut A,
    law: Law,
    bins: Option<&Bins>,
    parameters: Vec<A::Number>,
) -> (Law, Vec<A::Number>) {
    // The distance, in widths of the domain, from which on the curvature of ln f is below its rounding.
    const FAR: f64 = 1e14;
    let known: Option<Vec<f64>> = parameters.iter().map(|number| by.known(*number)).collect();
    let (Some([location, scale]), Some(bins)) = (known.as_deref(), bins.filter(|it| !goes_round(law, it)))
    else {
        return (law, parameters);
    };
    let (low, high) = bins.ends();
    if law == Law::Lognormal {
        return match at_end(bins, *location, *scale) {
            Some(end) => {
                (Law::Laplace, [end, (high - low) * SURELY].map(|number| by.constant(number)).to_vec())
            }
            None => (law, parameters),
        };
    }
    let nearest = location.clamp(low, high);
    let distance = (location - nearest).abs();
    let scale = match law {
        Law::Laplace if distance > 0.0 => *scale,
        Law::Normal if distance > FAR * (high - low) => (scale / distance * scale).max(f64::MIN_POSITIVE),
        _ => return (law, parameters),
    };
    (Law::Laplace, [nearest, scale].map(|number| by.constant(number)).to_vec())
}

/// The scale, in widths of the domain, of a law that has all of its mass in the bin of its location.
const SURELY: f64 = 1e-10;

/// The end of the bins at which a lognormal law with these parameters has all of its mass, as far as f64 holds it: ln x has a normal
/// law, whose slope at that end takes more than e⁷⁵⁰ from the next bin.
fn at_end(bins: &Bins, location: f64, scale: f64) -> Option<f64> {
    const NOTHING: f64 = 750.0;
    let (edges, count) = (bins.edges(), bins.count());
    let (low, high) = bins.ends();
    let falls = |distance: f64, outer: f64, inner: f64| {
        distance / scale * (outer.ln() - inner.ln()).abs() / scale > NOTHING
    };
    let (above, below) = (location - high.ln(), low.ln() - location);
    match (above > 0.0 && high > 0.0, below > 0.0 && low > 0.0) {
        (true, _) => falls(above, high, edges[count - 1]).then_some(high),
        (_, true) => falls(below, low, edges[1]).then_some(low),
        _ => None,
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
    (centre, bins): (A::Number, &Bins),
    parameters: &[A::Number],
    bounds: Option<[A::Number; 2]>,
) -> A::Number {
    let (low, high) = bins.ends();
    let (turn, width) = (high - low, (high - low) / bins.count() as f64);
    let (half, whole) = (by.constant(0.5 * turn), by.constant(turn));
    // A mean many turns away would have no digits left beside the centre.
    let mean = match by.known(parameters[0]) {
        Some(mean) => by.constant(mean.rem_euclid(turn)),
        None => parameters[0],
    };
    let centred = by.subtract(centre, mean);
    let shifted = by.add(centred, half);
    let around = by.binary(Binary::Remainder, shifted, whole);
    let distance = by.subtract(around, half);
    let zero = by.constant(0.0);
    let centred = [zero, parameters[1]];
    let half_bin = by.constant(0.5 * width);
    // The ends of the part of the bin, from its centre.
    let ends = [by.unary(Unary::Negate, half_bin), half_bin];
    let ends = match bounds {
        Some(bounds) => {
            let bounds = bounds.map(|bound| by.subtract(bound, centre));
            truncated::part(by, ends, bounds)
        }
        None => ends,
    };
    if law == Law::VonMises {
        let scale = by.constant(std::f64::consts::TAU / turn);
        let angle = by.multiply(distance, scale);
        let density = law.density_by(by, angle, &centred);
        if bounds.is_none() {
            return density;
        }
        let (part, width) = (by.subtract(ends[1], ends[0]), by.constant(width));
        let share = by.divide(part, width);
        return by.multiply(density, share);
    }
    let edges = ends.map(|end| by.add(distance, end));
    mass(by, law, edges, &centred)
}

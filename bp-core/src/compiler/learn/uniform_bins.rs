//! The ends of a uniform distribution over bins.
//!
//! In: a sample of centres of bins. Out: the lower and the upper end. Invariant: each bin with a case has a positive probability, and
//! no other ends have a higher likelihood.
//!
//! A bin has the share of the interval that lies in it. With n₁ of N cases in the first bin, of which the width w₁ counts, n₂ and w₂ in
//! the last, and k between them, ln L = n₁ ln w₁ + n₂ ln w₂ − N ln(w₁ + k + w₂) + …, which for a given w₂ is largest at
//! w₁ = n₁ (k + w₂) / (N − n₁), or at the whole bin.

use crate::law::{Law, Sample};
use crate::model::Domain;

/// The most rounds of the two ends in turn.
const ROUNDS: usize = 1000;

/// The ends under which a sample of bins is most probable; `None` of another law or domain.
pub(super) fn ends(law: Law, sample: &Sample, domain: &Domain) -> Option<Vec<f64>> {
    let bins = domain.bins().filter(|bins| law == Law::Uniform && !bins.is_circle() && !sample.is_empty())?;
    let (low, high) = sample.ends();
    let (first, last) = (bins.holding(low)?, bins.holding(high)?);
    let edges = bins.edges();
    if first == last {
        return Some(vec![edges[first], edges[first + 1]]);
    }
    let cases = |bin: usize| -> f64 {
        let own = sample.iter().filter(|(number, _)| bins.holding(*number) == Some(bin));
        own.map(|(_, weight)| weight).sum()
    };
    let (total, between) = (sample.total(), edges[last] - edges[first + 1]);
    let whole = [edges[first + 1] - edges[first], edges[last + 1] - edges[last]];
    let share = |own: f64, other: f64, most: f64| match total - own {
        rest if rest > 0.0 => most.min(own * (between + other) / rest),
        _ => most,
    };
    let ([one, two], mut widths) = ([cases(first), cases(last)], whole);
    for _ in 0..ROUNDS {
        let before = widths;
        widths[0] = share(one, widths[1], whole[0]);
        widths[1] = share(two, widths[0], whole[1]);
        if widths == before {
            break;
        }
    }
    let [below, above] = [edges[first + 1] - widths[0], edges[last] + widths[1]];
    // A whole bin ends at its edge, without rounding.
    Some(vec![
        if widths[0] == whole[0] { edges[first] } else { below },
        if widths[1] == whole[1] { edges[last + 1] } else { above },
    ])
}

//! Densities of an observation far from the mean of every context: their ratios, with the common size kept apart.
//!
//! In: a normal law for each context, and a value. Out: ln of the densities relative to the largest, and ln of the
//! largest. Invariant: the ratios are accurate where the difference of two logarithms (−z²/2 and −(z − 1)²/2) would be
//! lost to rounding.
//!
//! With u = (z − m) / s: ln p − ln q = −½ (u_p − u_q) (u_p + u_q) − ln (s_p / s_q), and u_p − u_q = (m_q − m_p) / s
//! where both have the same s.

use crate::distribution::Distribution;
use crate::law::Law;

/// Writes the logarithms of the densities relative to the largest, and returns the logarithm of the largest. Where a
/// law is not normal, returns 0 and leaves the cells unchanged.
pub(super) fn relative(distributions: &[Distribution], value: f64, cells: &mut [f64]) -> f64 {
    let normal = |distribution: &Distribution| match distribution {
        Distribution::Law(Law::Normal, [mean, deviation, _]) => Some([*mean, *deviation]),
        _ => None,
    };
    let Some(laws) = distributions.iter().map(normal).collect::<Option<Vec<[f64; 2]>>>() else { return 0.0 };
    let standard = |[mean, deviation]: [f64; 2]| (value - mean) / deviation;
    let near = |one: &&[f64; 2], other: &&[f64; 2]| standard(**one).abs().total_cmp(&standard(**other).abs());
    let Some(nearest) = laws.iter().min_by(near).copied() else { return 0.0 };
    let [mean, deviation] = nearest;
    for (cell, law) in cells.iter_mut().zip(&laws) {
        let apart = match law[1] == deviation {
            true => (mean - law[0]) / deviation,
            false => standard(*law) - standard(nearest),
        };
        *cell = -0.5 * apart * (standard(*law) + standard(nearest)) - (law[1] / deviation).ln();
    }
    // Multiply by one half before squaring: the square may overflow where half of it does not.
    -0.5 * standard(nearest) * standard(nearest) - deviation.ln() - 0.5 * std::f64::consts::TAU.ln()
}

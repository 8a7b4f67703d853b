//! The densities of an observation that is far from what every context expects: their ratios, and their size apart.
//!
//! In: a normal law for each context, and a value. Out: ln of the densities relative to the largest, and its ln. Invariant: the
//! ratios have their digits, where those of the logarithms themselves (−z²/2 beside −(z − 1)²/2) are rounded away.
//!
//! With u = (z − m) / s: ln p − ln q = −½ (u_p − u_q) (u_p + u_q) − ln (s_p / s_q), and u_p − u_q = (m_q − m_p) / s where both
//! have the same s.

use crate::distribution::Distribution;
use crate::law::Law;

/// Makes logarithms of densities relative to the largest, whose logarithm is given; where a law is not normal, 0 is given
/// and nothing changes.
pub(super) fn relative(distributions: &[Distribution], value: f64, cells: &mut [f64]) -> f64 {
    let normal = |distribution: &Distribution| match distribution {
        Distribution::Law(Law::Normal, parameters) => Some(*parameters),
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
    // Halved before the second factor: the square may be beyond the range of numbers where the half is not.
    -0.5 * standard(nearest) * standard(nearest) - deviation.ln() - 0.5 * std::f64::consts::TAU.ln()
}

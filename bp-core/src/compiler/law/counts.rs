//! The entropy of laws of counts.
//!
//! In: a law of whole numbers and its parameters. Out: its entropy in nats. Invariant: values without probability add nothing.

use super::{Law, Numbers};

/// The entropy of a law of counts, by the sum over the values within 40 deviations of its mean.
pub(super) fn entropy(law: Law, parameters: &[f64]) -> f64 {
    let (mean, reach) = (law.mean(parameters), 40.0 * (law.variance(parameters).sqrt() + 1.0));
    let (mut sum, mut count) = (0.0, (mean - reach).max(0.0).floor());
    while count <= mean + reach {
        let ln = law.ln_density(&mut Numbers, count, parameters);
        if ln > f64::NEG_INFINITY {
            sum -= ln * ln.exp();
        }
        count += 1.0;
    }
    sum
}

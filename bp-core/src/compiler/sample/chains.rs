//! Diagnostics of Markov chains.
//!
//! In: one number of each draw, chain after chain of the same length. Out: the standard error of their mean, the
//! effective sample size, and split R-hat. Invariant: chains that never move but disagree give a large R-hat, not a
//! standard error of 0.
//!
//! Batch means: with b batches of √length draws and means mⱼ, error² = Σ (mⱼ − m)² / (b (b − 1)) (Flegal and Jones,
//! *Annals of Statistics* 38:1034-1070, 2010); chains that disagree are a batch each. Split R-hat: √((W (n − 1) / n + B
//! / n) / W) over the halves of the chains (Gelman and Rubin, *Statistical Science* 7:457-472, 1992), of the normal
//! scores of the ranks (Vehtari et al., *Bayesian Analysis* 16:667-718, 2021).

use statrs::distribution::{ContinuousCDF, Normal};

/// R-hat above which chains count as not converged.
pub const MOST_R_HAT: f64 = 1.05;

pub(super) fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// The unbiased sample variance: squared distances from the mean, over the count less one.
fn variance(values: &[f64]) -> f64 {
    let mean = mean(values);
    values.iter().map(|value| (value - mean) * (value - mean)).sum::<f64>() / (values.len() as f64 - 1.0)
}

/// The standard error of the mean.
pub(super) fn error(values: &[f64], length: usize) -> f64 {
    let batch = match split_r_hat(values, length) > MOST_R_HAT {
        true => length,
        false => (length as f64).sqrt() as usize,
    };
    let means: Vec<f64> =
        values.chunks(length).flat_map(|chain| chain.chunks_exact(batch.max(1)).map(mean)).collect();
    (variance(&means) / means.len() as f64).sqrt()
}

/// The effective sample size for the mean.
pub(super) fn effective(values: &[f64], length: usize) -> f64 {
    let (variance, error) = (variance(values), error(values, length));
    if error > 0.0 { (variance / (error * error)).min(values.len() as f64) } else { values.len() as f64 }
}

/// Split R-hat of the normal scores of the ranks.
pub(super) fn r_hat(values: &[f64], length: usize) -> f64 {
    split_r_hat(&normal_scores(values), length)
}

fn split_r_hat(values: &[f64], length: usize) -> f64 {
    let half = length / 2;
    let halves: Vec<&[f64]> =
        values.chunks(length).flat_map(|chain| chain.chunks_exact(half).take(2)).collect();
    let means: Vec<f64> = halves.iter().map(|half| mean(half)).collect();
    let within = halves.iter().map(|half| variance(half)).sum::<f64>() / halves.len() as f64;
    let between = variance(&means);
    match (within > 0.0, between > 0.0) {
        (true, _) => ((half as f64 - 1.0) / half as f64 + between / within).sqrt(),
        (false, true) => f64::INFINITY,
        (false, false) => 1.0,
    }
}

/// Φ⁻¹((rank − 3/8) / (count + 1/4)); ties have the mean of their ranks.
fn normal_scores(values: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..values.len()).collect();
    order.sort_by(|one, other| values[*one].total_cmp(&values[*other]));
    let mut scores = vec![0.0; values.len()];
    let mut before = 0.0;
    for equal in order.chunk_by(|one, other| values[*one] == values[*other]) {
        let rank = before + 0.5 * (equal.len() as f64 + 1.0);
        let score = Normal::standard().inverse_cdf((rank - 0.375) / (values.len() as f64 + 0.25));
        equal.iter().for_each(|draw| scores[*draw] = score);
        before += equal.len() as f64;
    }
    scores
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two chains of 2, 4, 4, 2 and of 1, 5, 5, 1: every half has the mean 3, and variance 2 or 8.
    #[test]
    fn chains_that_agree_have_less_than_one() {
        let values = [2.0, 4.0, 4.0, 2.0, 1.0, 5.0, 5.0, 1.0];
        assert!((split_r_hat(&values, 4) - 0.5f64.sqrt()).abs() < 1e-12);
        // Batches of two draws: all their means are 3.
        assert!(error(&values, 4) == 0.0 && effective(&values, 4) == 8.0);
    }

    /// Halves 0, 2 | 0, 2 and 4, 6 | 4, 6: W = 2, the means 1, 1, 5, 5 have variance 16/3: R² = 1/2 + 8/3.
    #[test]
    fn separated_chains_are_detected() {
        let values = [0.0, 2.0, 0.0, 2.0, 4.0, 6.0, 4.0, 6.0];
        assert!((split_r_hat(&values, 4) - (19.0f64 / 6.0).sqrt()).abs() < 1e-12);
        // Each chain is a batch: means 1 and 5, variance 8, over two.
        assert!((error(&values, 4) - 2.0).abs() < 1e-12);
        assert_eq!(r_hat(&[0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0], 4), f64::INFINITY);
        assert_eq!(r_hat(&[3.0; 8], 4), 1.0);
    }

    #[test]
    fn ranks_become_normal_scores() {
        // Of 1, 2, 2 the ranks are 1 and 2.5: Φ⁻¹(0.625 / 3.25) = −0.8694…, Φ⁻¹(2.125 / 3.25) = 0.3957… by tables.
        let scores = normal_scores(&[2.0, 1.0, 2.0]);
        assert!(
            scores[0] == scores[2] && (scores[1] + 0.869).abs() < 2e-3 && (scores[0] - 0.395).abs() < 2e-3
        );
    }
}

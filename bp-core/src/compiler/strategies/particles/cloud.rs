//! The particles of an instant: weights, resampling, and what they say of slots.
//!
//! In: particles and their weights. Out: draws and mixtures of normal laws. Invariant: particles that descend from one particle
//! are not independent: each has an origin, and standard errors are taken between origins.
//!
//! The error between origins: Chan and Lai, *Annals of Statistics* 41:2877-2904, 2013. Where too few origins are left, the
//! particles of a later instant become the origins: Olsson and Douc, *Bernoulli* 25:1504-1535, 2019.

use super::Particle;
use crate::distribution::ln_sum;
use crate::sample::{Draws, Normals};

/// The particles of an instant.
#[derive(Clone, Debug)]
pub(crate) struct Cloud {
    pub(crate) particles: Vec<Particle>,
    /// Memory for the particles after resampling.
    spare: Spare,
    /// ln of the weights, which sum to one.
    pub(crate) ln_weights: Vec<f64>,
    /// ln of what the guide expects of later observations, for each particle: it decides who survives, and does not weigh.
    pub(crate) ln_ahead: Vec<f64>,
    /// The origin of each particle; those that replace them when few are left.
    pub(crate) origins: Vec<u32>,
    successors: Vec<u32>,
    /// The particle of the last such replacement that each one descends from, or before the first instant; and the variance of the
    /// ln P of the observations up to then.
    roots: Vec<u32>,
    ln_variance: f64,
    /// Whether later values depend less and less on earlier ones; a constant is never forgotten.
    forgets: bool,
    /// For each particle, the one of the instant before that it continues.
    pub(crate) parents: Vec<u32>,
    /// ln P(observations)
    pub(crate) ln_evidence: f64,
    /// The effective sample size, instant by instant.
    pub(crate) effective: Vec<f64>,
}

/// Particles whose memory is used again; a clone has none.
#[derive(Debug, Default)]
struct Spare(Vec<Particle>);

impl Clone for Spare {
    fn clone(&self) -> Self {
        Self::default()
    }
}

/// The effective number of origins below which later ones replace them.
const FEW_ORIGINS: f64 = 40.0;

/// 1, 2, 3, …
fn numbered(count: usize) -> Vec<u32> {
    (0..count as u32).collect()
}

impl Cloud {
    /// Particles before the first instant, with the ln of their weights.
    pub(super) fn new(
        particles: Vec<Particle>,
        ln_weights: Vec<f64>,
        ln_ahead: Vec<f64>,
        forgets: bool,
    ) -> Self {
        let own = || numbered(particles.len());
        let (origins, successors, parents, roots) = (own(), own(), own(), own());
        let (ln_evidence, ln_variance, effective) = (0.0, 0.0, Vec::new());
        Self {
            spare: Spare::default(),
            ln_weights,
            ln_ahead,
            origins,
            successors,
            roots,
            ln_variance,
            forgets,
            parents,
            ln_evidence,
            effective,
            particles,
        }
    }

    /// The ln of the weights with what is expected of later observations.
    fn ln_chances(&self) -> Vec<f64> {
        self.ln_weights.iter().zip(&self.ln_ahead).map(|(weight, ahead)| weight + ahead).collect()
    }

    /// Divides the weights by their sum, which is a factor of P(observations); `false` where it is 0.
    pub(super) fn settle(&mut self) -> bool {
        let total = ln_sum(&self.ln_weights);
        if !total.is_finite() {
            return false;
        }
        self.ln_evidence += total;
        self.ln_weights.iter_mut().for_each(|weight| *weight -= total);
        let chances = self.ln_chances();
        let total = ln_sum(&chances);
        self.effective.push(1.0 / chances.iter().map(|ln| (2.0 * (ln - total)).exp()).sum::<f64>());
        true
    }

    /// The effective number of particles before the first instant that the present ones continue.
    pub(super) fn values_left(&self) -> f64 {
        effective_number(&self.origins)
    }

    /// Systematic resampling: copies of each in proportion to its chances, from one uniform number.
    pub(super) fn resample(&mut self, uniform: f64) {
        let count = self.particles.len();
        let chances = self.ln_chances();
        let total = ln_sum(&chances);
        // Only particles of positive weight: rounding of the sum must not choose any other.
        let possible: Vec<usize> = (0..count).filter(|own| (chances[*own] - total).exp() > 0.0).collect();
        let weight = |source: usize| (chances[possible[source]] - total).exp();
        let (mut sum, mut source, mut chosen) = (weight(0), 0, Vec::with_capacity(count));
        for number in 0..count {
            let position = (number as f64 + uniform) / count as f64;
            while sum < position && source + 1 < possible.len() {
                source += 1;
                sum += weight(source);
            }
            chosen.push(possible[source]);
        }
        let of = |labels: &[u32]| chosen.iter().map(|own| labels[*own]).collect::<Vec<u32>>();
        (self.origins, self.successors, self.roots) =
            (of(&self.origins), of(&self.successors), of(&self.roots));
        self.parents = chosen.iter().map(|own| *own as u32).collect();
        self.ln_ahead = chosen.iter().map(|own| self.ln_ahead[*own]).collect();
        self.ln_weights = self.ln_ahead.iter().map(|ahead| total - (count as f64).ln() - ahead).collect();
        let spare = &mut self.spare.0;
        spare.resize_with(count, || self.particles[0].clone());
        for (spare, own) in spare.iter_mut().zip(chosen) {
            spare.clone_from(&self.particles[own]);
        }
        std::mem::swap(&mut self.particles, spare);
        if self.forgets && effective_number(&self.roots) < FEW_ORIGINS {
            self.ln_variance += self.variance_of_roots();
            self.roots = numbered(count);
        }
        if self.forgets && effective_number(&self.origins) < FEW_ORIGINS {
            self.origins = std::mem::replace(&mut self.successors, numbered(count));
        }
    }

    /// The standard error of ln P(observations): the shares of P that descend from each root vary (Lee and Whiteley, *Biometrika*
    /// 105:609-625, 2018), and roots are exchanged where few are left.
    pub(crate) fn ln_evidence_error(&self) -> f64 {
        (self.ln_variance + self.variance_of_roots()).sqrt()
    }

    /// Σ (share of a root)² − 1/N
    fn variance_of_roots(&self) -> f64 {
        let mut shares = vec![0.0; self.roots.len()];
        self.roots.iter().zip(&self.ln_weights).for_each(|(root, ln)| shares[*root as usize] += ln.exp());
        let squares: f64 = shares.iter().map(|share: &f64| share * share).sum();
        (squares - 1.0 / self.roots.len() as f64).max(0.0)
    }

    /// Each particle continues itself.
    pub(super) fn keep_all(&mut self) {
        self.parents = numbered(self.particles.len());
    }

    /// Copies values to particles of weight zero, which have none: they contribute nothing but must be readable.
    pub(crate) fn complete(&mut self) {
        let Some(other) = self.ln_weights.iter().position(|weight| *weight > f64::NEG_INFINITY) else {
            return;
        };
        for number in 0..self.particles.len() {
            if self.ln_weights[number] == f64::NEG_INFINITY {
                self.particles[number] = self.particles[other].clone();
            }
        }
    }

    /// The draws of some drawn slots.
    pub(crate) fn draws(&self, slots: &[usize]) -> Draws {
        let of = |particle: &Particle| slots.iter().map(|slot| particle.values[*slot]).collect::<Vec<_>>();
        let values = self.particles.iter().flat_map(of).collect();
        Draws::weighted(values, slots.len(), &self.ln_weights).of_origins(self.origins.clone())
    }

    /// The distribution of a slot that was not drawn: a mixture of normal laws.
    pub(crate) fn mixture(&self, slot: usize) -> Normals {
        let law = |(ln, particle): (&f64, &Particle)| {
            let [mean, deviation] = particle.law.of(slot).expect("internal: a linear variable has a law");
            [ln.exp(), mean, deviation]
        };
        let laws = self.ln_weights.iter().zip(&self.particles).map(law).collect();
        Normals::of_origins(laws, Some(self.origins.clone()))
    }
}

/// 1 / Σ (share of a label)²
pub(super) fn effective_number(labels: &[u32]) -> f64 {
    let mut counts = vec![0.0; labels.len()];
    labels.iter().for_each(|label| counts[*label as usize] += 1.0 / labels.len() as f64);
    1.0 / counts.iter().map(|share: &f64| share * share).sum::<f64>()
}

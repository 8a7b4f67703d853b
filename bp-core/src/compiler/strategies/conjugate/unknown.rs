//! An unknown with a conjugate prior.
//!
//! In: the parameters of its prior, and observations. Out: the parameters of its posterior, and ln of the probability of what was
//! observed. Invariant: parameters only grow.

use crate::law::Law;
use crate::posterior::NamedLaw;
use crate::random::Random;
use crate::special::ln_gamma;

/// The distribution of an unknown.
#[derive(Clone, PartialEq, Debug)]
pub(super) enum Unknown {
    /// A probability: a beta distribution.
    Probability([f64; 2]),
    /// A rate: a gamma distribution, by its shape and its rate.
    Rate([f64; 2]),
    /// Proportions: a Dirichlet distribution.
    Proportions(Vec<f64>),
    /// A number of which nothing is observed.
    Alone(NamedLaw),
}

/// What is observed of an unknown, up to a factor that does not depend on it.
#[derive(Clone, PartialEq, Debug)]
pub(super) enum Observed {
    /// Successes and failures.
    Trials([f64; 2]),
    /// Events in a time.
    Events([f64; 2]),
    /// A count for each proportion.
    Counts(Vec<f64>),
}

impl Unknown {
    /// Adds an observation.
    pub(super) fn observe(&mut self, observed: &Observed) {
        match (self, observed) {
            (Unknown::Probability(own), Observed::Trials(more))
            | (Unknown::Rate(own), Observed::Events(more)) => {
                own.iter_mut().zip(more).for_each(|(own, more)| *own += more);
            }
            (Unknown::Proportions(own), Observed::Counts(more)) => {
                own.iter_mut().zip(more).for_each(|(own, more)| *own += more);
            }
            _ => unreachable!("internal: the offer has looked at the form"),
        }
    }

    /// ln of the integral of the density without its constant.
    fn ln_total(&self) -> f64 {
        let ln_beta = |a: &[f64]| a.iter().map(|a| ln_gamma(*a)).sum::<f64>() - ln_gamma(a.iter().sum());
        match self {
            Unknown::Probability(parameters) => ln_beta(parameters),
            Unknown::Proportions(parameters) => ln_beta(parameters),
            Unknown::Rate([shape, rate]) => ln_gamma(*shape) - shape * rate.ln(),
            Unknown::Alone(_) => 0.0,
        }
    }

    /// ln of the probability of all that led from a distribution to this one.
    pub(super) fn ln_evidence(&self, prior: &Self) -> f64 {
        self.ln_total() - prior.ln_total()
    }

    /// The probability of an observation whose other factor has this logarithm.
    pub(super) fn predicts(&self, observed: &Observed, ln_factor: f64) -> f64 {
        match (self, observed) {
            // One trial: shares of the parameters.
            (Unknown::Probability([a, b]), Observed::Trials([s, f])) if s + f == 1.0 => {
                (a * s + b * f) / (a + b)
            }
            (Unknown::Proportions(all), Observed::Counts(counts)) if counts.iter().sum::<f64>() == 1.0 => {
                all.iter().zip(counts).map(|(a, count)| a * count).sum::<f64>() / all.iter().sum::<f64>()
            }
            _ if ln_factor == f64::NEG_INFINITY => 0.0,
            _ => {
                let mut after = self.clone();
                after.observe(observed);
                (after.ln_evidence(self) + ln_factor).exp()
            }
        }
    }

    /// The distribution of one of its numbers.
    pub(super) fn law(&self, component: usize) -> NamedLaw {
        match self {
            Unknown::Probability([a, b]) => NamedLaw { law: Law::Beta, parameters: [*a, *b, 0.0] },
            Unknown::Rate([shape, rate]) => NamedLaw { law: Law::Gamma, parameters: [*shape, *rate, 0.0] },
            Unknown::Alone(law) => *law,
            Unknown::Proportions(all) => {
                let others = all.iter().enumerate().filter(|(own, _)| *own != component);
                let others = others.map(|(_, a)| a).sum();
                NamedLaw { law: Law::Beta, parameters: [all[component], others, 0.0] }
            }
        }
    }

    /// A draw of its numbers.
    pub(super) fn draw(&self, random: &mut Random) -> Vec<f64> {
        match self {
            Unknown::Probability(own) => vec![Law::Beta.draw(random, own)],
            Unknown::Rate(own) => vec![Law::Gamma.draw(random, own)],
            Unknown::Alone(own) => vec![own.draw(random)],
            Unknown::Proportions(all) => {
                // Each is a share of what the earlier ones leave.
                let (mut left, mut drawn) = (1.0, Vec::with_capacity(all.len()));
                for place in 0..all.len() {
                    let others: f64 = all[place + 1..].iter().sum();
                    let last = place + 1 == all.len();
                    let share =
                        if last { left } else { left * Law::Beta.draw(random, &[all[place], others]) };
                    drawn.push(share);
                    left -= share;
                }
                drawn
            }
        }
    }

    /// The covariance of two of its numbers.
    pub(super) fn covariance(&self, one: usize, other: usize) -> f64 {
        match self {
            Unknown::Proportions(all) if one != other => {
                let total: f64 = all.iter().sum();
                -(all[one] / total) * (all[other] / total) / (total + 1.0)
            }
            _ => self.law(one).variance(),
        }
    }
}

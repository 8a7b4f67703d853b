//! An unknown with a conjugate prior.
//!
//! In: the parameters of its prior, and observations. Out: the parameters of its posterior, and ln of the probability of what was
//! observed. Invariant: parameters only grow.

use crate::law::Law;
use crate::posterior::NamedLaw;
use crate::random::Random;
use crate::special::ln_rising;

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

impl Observed {
    /// Its numbers.
    fn numbers(&self) -> &[f64] {
        match self {
            Observed::Trials(both) | Observed::Events(both) => both,
            Observed::Counts(all) => all,
        }
    }
}

/// An unknown and all that is observed of it.
#[derive(Clone, PartialEq, Debug)]
pub(super) struct Evidenced {
    prior: Unknown,
    /// The sum of what is observed; empty if nothing is.
    observed: Vec<f64>,
}

impl Evidenced {
    pub(super) fn new(prior: Unknown) -> Self {
        Self { prior, observed: Vec::new() }
    }

    /// Adds an observation.
    pub(super) fn observe(&mut self, more: &Observed) {
        self.observed.resize(more.numbers().len(), 0.0);
        self.observed.iter_mut().zip(more.numbers()).for_each(|(own, more)| *own += more);
    }

    /// Its posterior.
    pub(super) fn posterior(&self) -> Unknown {
        self.prior.after(&self.observed)
    }

    /// ln of the probability of all that is observed.
    pub(super) fn ln_probability(&self) -> f64 {
        self.prior.ln_probability(&self.observed)
    }
}

impl Unknown {
    /// The distribution once this is observed.
    fn after(&self, observed: &[f64]) -> Self {
        let sums = |own: &[f64; 2]| [own[0] + observed[0], own[1] + observed[1]];
        match self {
            _ if observed.is_empty() => self.clone(),
            Unknown::Probability(own) => Unknown::Probability(sums(own)),
            Unknown::Rate(own) => Unknown::Rate(sums(own)),
            Unknown::Proportions(own) => {
                Unknown::Proportions(own.iter().zip(observed).map(|(own, more)| own + more).collect())
            }
            Unknown::Alone(law) => Unknown::Alone(*law),
        }
    }

    /// ln of the probability of what is observed, without the factors that do not depend on the unknown.
    ///
    /// With (a)ₛ = Γ(a + s) / Γ(a): of shares Π (aᵢ)ₙᵢ / (Σ aᵢ)_Σnᵢ, of a rate (k)ₙ (1 + t/r)⁻ᵏ (r + t)⁻ⁿ.
    pub(super) fn ln_probability(&self, observed: &[f64]) -> f64 {
        let of_shares = |all: &[f64]| {
            let each = all.iter().zip(observed).map(|(a, count)| ln_rising(*a, *count));
            each.sum::<f64>() - ln_rising(all.iter().sum(), observed.iter().sum())
        };
        match (self, observed) {
            (Unknown::Probability(all), [_, _]) => of_shares(all),
            (Unknown::Proportions(all), [_, ..]) => of_shares(all),
            (Unknown::Rate([shape, rate]), [events, time]) => {
                ln_rising(*shape, *events) - shape * (time / rate).ln_1p() - events * (rate + time).ln()
            }
            _ => 0.0,
        }
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
            _ => (self.ln_probability(observed.numbers()) + ln_factor).exp(),
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

//! An unknown with a conjugate prior.
//!
//! In: the parameters of its prior, and observations. Out: the parameters of its posterior, and ln of the probability of what was
//! observed. Invariant: parameters only grow.

use crate::law::Law;
use crate::posterior::NamedLaw;
use crate::random::Random;
use crate::special::{deviance, stirling_rest};

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

/// What is observed of an unknown.
#[derive(Clone, PartialEq, Debug)]
pub(super) enum Observed {
    /// Successes and failures.
    Trials([f64; 2]),
    /// Events in a time.
    Events([f64; 2]),
    /// Events, and the time until then.
    Waits([f64; 2]),
    /// A count for each proportion.
    Counts(Vec<f64>),
}

impl Observed {
    /// Its numbers.
    fn numbers(&self) -> &[f64] {
        match self {
            Observed::Trials(both) | Observed::Events(both) | Observed::Waits(both) => both,
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
    /// The sum of the single trials and of the waits, whose likelihoods are powers.
    powers: Vec<f64>,
    /// The counts of several trials or of events in a time.
    counts: Vec<Vec<f64>>,
}

impl Evidenced {
    pub(super) fn new(prior: Unknown) -> Self {
        Self { prior, observed: Vec::new(), powers: Vec::new(), counts: Vec::new() }
    }

    /// Adds an observation.
    pub(super) fn observe(&mut self, more: &Observed) {
        let numbers = more.numbers();
        let is_power = match more {
            Observed::Events(_) => false,
            Observed::Waits(_) => true,
            Observed::Trials(_) | Observed::Counts(_) => numbers.iter().sum::<f64>() == 1.0,
        };
        for sum in [&mut self.observed, &mut self.powers] {
            sum.resize(numbers.len(), 0.0);
        }
        let add = |sum: &mut [f64]| sum.iter_mut().zip(numbers).for_each(|(own, more)| *own += more);
        add(&mut self.observed);
        match is_power {
            true => add(&mut self.powers),
            false => self.counts.push(numbers.to_vec()),
        }
    }

    /// Its posterior.
    pub(super) fn posterior(&self) -> Unknown {
        self.prior.after(&self.observed)
    }

    /// ln of the probability of all that is observed, without ln S(n) − Σ ln S(nᵢ) of trials and −ln S(n) of events, S(n) = n! eⁿ/nⁿ.
    ///
    /// P(y) = P(y | x) p(x) / p(x | y) at any x (Besag, *Biometrika* 76:183, 1989), here at the posterior mean, where no large terms
    /// cancel: with D the deviance and δ the remainder of Stirling's formula, P(y | x) of trials is exp(−Σ D(nᵢ, n xᵢ)), of events
    /// exp(−D(n, t x)), and ln p(x) / p(x | y) is of shares a with sum m that become A with sum M
    /// Σ (−D(aᵢ, m Aᵢ/M) − ½ ln(Aᵢ/aᵢ) + δ(Aᵢ) − δ(aᵢ)) + ½ ln(M/m) − δ(M) + δ(m), and of a rate
    /// −D(k, r K/R) − ½ ln(K/k) + δ(K) − δ(k).
    pub(super) fn ln_probability(&self) -> f64 {
        let gain = |from: f64, to: f64| stirling_rest(to) - stirling_rest(from) - 0.5 * (to / from).ln();
        let of_shares = |all: &[f64]| {
            let after: Vec<f64> = all.iter().zip(&self.observed).map(|(a, count)| a + count).collect();
            let (before, total): (f64, f64) = (all.iter().sum(), after.iter().sum());
            let own = |(a, next): (&f64, &f64)| gain(*a, *next) - deviance(*a, before * (next / total));
            let prior = all.iter().zip(&after).map(own).sum::<f64>() - gain(before, total);
            let power =
                |(count, next): (&f64, &f64)| if *count > 0.0 { count * (next / total).ln() } else { 0.0 };
            let powers: f64 = self.powers.iter().zip(&after).map(power).sum();
            let trials = |counts: &Vec<f64>| {
                let trials: f64 = counts.iter().sum();
                let own = |(count, next): (&f64, &f64)| deviance(*count, trials * (next / total));
                counts.iter().zip(&after).map(own).sum::<f64>()
            };
            prior + powers - self.counts.iter().map(trials).sum::<f64>()
        };
        match (&self.prior, self.observed.as_slice()) {
            (Unknown::Probability(all), [_, _]) => of_shares(all),
            (Unknown::Proportions(all), [_, ..]) => of_shares(all),
            (Unknown::Rate([shape, rate]), [events, time]) => {
                let (next, mean) = (shape + events, (shape + events) / (rate + time));
                let prior = gain(*shape, next) - deviance(*shape, rate * mean);
                let powers = match self.powers[0] > 0.0 {
                    true => self.powers[0] * mean.ln() - self.powers[1] * mean,
                    false => 0.0,
                };
                let events = |own: &Vec<f64>| deviance(own[0], own[1] * mean);
                prior + powers - self.counts.iter().map(events).sum::<f64>()
            }
            _ => 0.0,
        }
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
                let mut own = Evidenced::new(self.clone());
                own.observe(observed);
                (own.ln_probability() + ln_factor).exp()
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

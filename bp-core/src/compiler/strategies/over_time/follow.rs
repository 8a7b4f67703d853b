//! An online filter: takes one instant after the other and keeps the carried variables only.
//!
//! In: a question over time, then the observations of an instant. Out: an [`InstantPosterior`] for that instant.
//! Invariant: the results equal those of [`super::answer`] for all instants together; a refused instant leaves the
//! filter unchanged.

use super::{By, Followed, Instant, InstantLaw, InstantPosterior, OverTime, always, unmet};
use crate::distribution::Setting;
use crate::error::Error;
use crate::potential::Product;
use crate::sample::{Observations, Sampling};
use crate::strategies::chain::{self, Chain};
use crate::strategies::gaussian::{Belief, Extended, Filter};
use crate::strategies::particles::{Cloud, Moves};
use std::sync::Arc;

/// A filter over time.
pub struct Follower<'m> {
    setting: Setting<'m>,
    route: OverTime,
    always: Instant,
    state: State<'m>,
    /// The number of instants followed.
    instants: usize,
    ln_evidence: f64,
}

/// The belief carried from instant to instant.
enum State<'m> {
    Chain { chain: Box<Chain<'m>>, searched: Vec<usize>, last: Option<Product> },
    Gaussian(Box<Filter>),
    Extended(Box<Extended<'m>>),
    Particles { moves: Box<Moves<'m>>, linear: Vec<usize>, kept: Vec<usize>, cloud: Box<Cloud> },
}

/// What a filter carries after an instant, before it is taken in.
enum Next<'m> {
    Chain(Product),
    Gaussian(Box<Filter>),
    Extended(Box<Extended<'m>>),
    Particles(Box<Cloud>),
}

/// A slot, and a likelihood for each of its values.
pub(crate) type Weighed = (usize, Vec<f64>);

impl<'m> Follower<'m> {
    /// A filter before its first instant.
    ///
    /// # Errors
    /// Numbers that are missing, or outside the range that a form accepts.
    pub fn new(setting: Setting<'m>, route: OverTime, sampling: Sampling) -> Result<Self, Error> {
        if let Some(absent) = route.absent_at_first(setting.model) {
            return Err(absent);
        }
        let slots = route.ask().searched.iter().flat_map(|item| setting.slots_of(item.variable));
        let searched: Vec<usize> = slots.collect();
        let state = match &route.by {
            By::Chain => {
                let chain = chain::chain(&setting, &route)?;
                State::Chain { chain: Box::new(chain), searched, last: None }
            }
            By::Gaussian(gaussian) => State::Gaussian(Box::new(Filter::of(&setting, gaussian)?)),
            By::Extended => State::Extended(Box::new(Extended::new(&setting, &route)?)),
            By::Particles { linear, .. } => {
                let moves = Box::new(Moves::new(&setting, route.ask(), &route.carried, linear, sampling)?);
                let (linear, kept): (Vec<usize>, Vec<usize>) =
                    searched.into_iter().partition(|slot| linear.contains(&setting.variable_of(*slot)));
                let cloud = Box::new(moves.begin()?);
                State::Particles { moves, linear, kept, cloud }
            }
        };
        let always = always(&setting, &route);
        Ok(Self { setting, route, always, state, instants: 0, ln_evidence: 0.0 })
    }

    /// The program with its numbers.
    pub fn setting(&self) -> &Setting<'m> {
        &self.setting
    }

    /// The question.
    pub fn route(&self) -> &OverTime {
        &self.route
    }

    /// The number of instants followed.
    pub fn instants(&self) -> usize {
        self.instants
    }

    /// ln P(all observations)
    pub fn ln_evidence(&self) -> f64 {
        self.ln_evidence
    }

    /// Follows an instant at which these slots have these values, as numbers of the program.
    ///
    /// # Errors
    /// A value outside its domain; observations that are impossible.
    pub fn step(&mut self, observed: &[(usize, f64)]) -> Result<InstantPosterior, Error> {
        self.step_if(observed, &[], |_, posterior, _| (posterior.clone(), true))
    }

    /// The same, with likelihoods of the values of other slots; the instant is taken in only if `accepts`, which is given the
    /// filter before it, the posterior and ln P(all observations), returns true with its result.
    ///
    /// # Errors
    /// As [`Follower::step`]; likelihoods in a filter of draws or of normal laws.
    pub(crate) fn step_if<T>(
        &mut self,
        observed: &[(usize, f64)],
        weighed: &[Weighed],
        accepts: impl FnOnce(&Self, &InstantPosterior, f64) -> (T, bool),
    ) -> Result<T, Error> {
        let mut checked = Observations::none(&self.setting);
        let mut instant = self.always.clone();
        for (slot, value) in observed {
            checked.observe(&self.setting, *slot, *value)?;
            instant.retain(|(own, _)| own != slot);
            instant.push((*slot, checked.values[*slot]));
        }
        instant.sort_by_key(|(slot, _)| *slot);
        if let (Some((slot, _)), false) = (weighed.first(), matches!(self.state, State::Chain { .. })) {
            return Err(only_values(&self.setting, *slot));
        }
        let (law, next, ln_evidence) = self.next(&instant, weighed)?;
        let posterior = InstantPosterior { instant: self.instants + 1, law };
        let (result, is_accepted) = accepts(self, &posterior, ln_evidence);
        if is_accepted {
            match (&mut self.state, next) {
                (State::Chain { last, .. }, Next::Chain(message)) => *last = Some(message),
                (State::Gaussian(filter), Next::Gaussian(next)) => *filter = next,
                (State::Extended(filter), Next::Extended(next)) => *filter = next,
                (State::Particles { cloud, .. }, Next::Particles(next)) => *cloud = next,
                _ => unreachable!("internal: the state of another filter"),
            }
            (self.instants, self.ln_evidence) = (posterior.instant, ln_evidence);
        }
        Ok(result)
    }

    /// The belief after one more instant, what the filter then carries, and ln P(all observations).
    fn next(&mut self, instant: &Instant, weighed: &[Weighed]) -> Result<(InstantLaw, Next<'m>, f64), Error> {
        let number = self.instants;
        let ln_of = |beliefs: &[Belief]| beliefs.iter().map(|belief| belief.ln_evidence).sum::<f64>();
        Ok(match &mut self.state {
            State::Chain { chain, searched, last } => {
                chain.weigh(weighed);
                let step = chain.step(last.as_ref(), instant, number, true);
                chain.weigh(&[]);
                let step = step?;
                let numbers =
                    chain.after(last.as_ref(), &step.product, |joint| joint.distribution(searched))?;
                let ln_evidence = self.ln_evidence + step.ln_total;
                (InstantLaw::Finite(numbers.into()), Next::Chain(step.message), ln_evidence)
            }
            State::Gaussian(filter) => {
                let mut next = filter.clone();
                let beliefs = next.filtered(std::slice::from_ref(instant))?;
                let ln_evidence = self.ln_evidence + ln_of(&beliefs);
                (last_of(beliefs), Next::Gaussian(next), ln_evidence)
            }
            State::Extended(filter) => {
                let mut next = filter.clone();
                let beliefs = next.filtered(std::slice::from_ref(instant))?;
                let ln_evidence = self.ln_evidence + ln_of(&beliefs);
                (last_of(beliefs), Next::Extended(next), ln_evidence)
            }
            State::Particles { moves, linear, kept, cloud } => {
                let mut next = cloud.clone();
                if !moves.advance(&mut next, instant)? {
                    let draws = cloud.particles.len();
                    return Err(unmet(&self.setting, &self.route, number, instant, draws));
                }
                moves.check_constants(&next, self.route.ask())?;
                let ln_evidence = next.ln_evidence;
                (cloud_of(&mut next, kept, linear), Next::Particles(next), ln_evidence)
            }
        })
    }

    /// The belief `steps` instants after the last one, without observations. The filter itself is unchanged.
    ///
    /// # Errors
    /// As [`Follower::step`].
    pub fn predict(&mut self, steps: usize) -> Result<InstantPosterior, Error> {
        let nothing = Instant::new();
        let law = match &mut self.state {
            State::Chain { chain, searched, last } => {
                let (mut before, mut number) = (last.clone(), self.instants);
                for _ in 1..steps {
                    before = Some(chain.step(before.as_ref(), &nothing, number, false)?.message);
                    number += 1;
                }
                let step = chain.step(before.as_ref(), &nothing, number, false)?;
                let numbers =
                    chain.after(before.as_ref(), &step.product, |joint| joint.distribution(searched))?;
                InstantLaw::Finite(numbers.into())
            }
            State::Gaussian(filter) => InstantLaw::Normal(filter.predicted(steps)),
            State::Extended(filter) => InstantLaw::Normal(filter.predicted(steps)?),
            State::Particles { moves, linear, kept, cloud } => {
                let mut ahead = cloud.clone();
                for step in 0..steps {
                    if !moves.advance(&mut ahead, &nothing)? {
                        let (number, draws) = (self.instants + step, cloud.particles.len());
                        return Err(unmet(&self.setting, &self.route, number, &nothing, draws));
                    }
                }
                cloud_of(&mut ahead, kept, linear)
            }
        };
        Ok(InstantPosterior { instant: self.instants + steps, law })
    }
}

/// The law of some slots by particles.
pub(super) fn cloud_of(cloud: &mut Cloud, kept: &[usize], linear: &[usize]) -> InstantLaw {
    cloud.complete();
    InstantLaw::Cloud {
        draws: Arc::new(cloud.draws(kept)),
        kept: kept.to_vec(),
        linear: linear.iter().map(|slot| (*slot, cloud.mixture(*slot))).collect(),
        followed: Followed::of(cloud),
    }
}

/// The refusal of a likelihood where draws or normal laws are followed.
pub(super) fn only_values(setting: &Setting<'_>, slot: usize) -> Error {
    let message = "a likelihood at one instant is followed where all variables that are carried are finite; give a value";
    Error::input(setting.slot_name(slot), message)
}

/// The last belief.
fn last_of(beliefs: Vec<Belief>) -> InstantLaw {
    InstantLaw::Normal(beliefs.into_iter().next_back().expect("internal: a belief for each instant"))
}

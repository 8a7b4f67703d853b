//! Time: beliefs about hidden variables, instant by instant.
//!
//! In: a model with numbers, an [`OverTime`] route, and the observations of each instant. Out: an [`InstantPosterior`]
//! for each instant asked about. Invariant: an instant without observations is still an instant.

mod answer;
mod code;
mod derive;
mod follow;
mod offer;
mod parts;

pub(crate) use answer::of_instant;
pub use code::InstantCode;
pub use follow::Follower;
pub(crate) use follow::Weighed;
pub use offer::{By, OverTime};
pub(crate) use offer::{check, check_sequence, draws_reals, not_of_normal, not_of_reals};

use crate::distribution::Setting;
use crate::door::Advice;
use crate::error::Error;
use crate::memory;
use crate::model::{Finding, Value, When};
use crate::posterior::Numbers;
use crate::sample::{Draws, Normals, Sampling};
use crate::strategies::gaussian::{Belief, Extended, Filter};
use crate::strategies::particles::{Cloud, Moves, Path, Paths};
use crate::strategies::{Likelihoods, chain};
use std::sync::Arc;

/// The observations of an instant: slots and their values.
pub type Instant = Vec<(usize, f64)>;

/// The posterior of the searched slots at an instant.
#[derive(Clone, PartialEq, Debug)]
pub struct InstantPosterior {
    /// The number of the instant, from 1.
    pub instant: usize,
    /// Its law.
    pub law: InstantLaw,
}

/// The law of the searched slots at an instant.
#[derive(Clone, PartialEq, Debug)]
pub enum InstantLaw {
    /// Of the finite searched slots jointly: the probability of each combination of values, the last slot fastest.
    Finite(Numbers),
    /// The normal law of reals.
    Normal(Belief),
    /// The values of the searched slots on the most probable path of particles.
    Values(Vec<f64>, Followed),
    /// Particles: draws of the kept slots, and moments of the slots that were not drawn.
    Cloud {
        /// Draws of the kept slots.
        draws: Arc<Draws>,
        /// The kept slots.
        kept: Vec<usize>,
        /// The slots that were not drawn.
        linear: Vec<(usize, Normals)>,
        /// How well the particles follow the observations.
        followed: Followed,
    },
}

/// How well particles follow the observations.
#[derive(Clone, PartialEq, Debug)]
pub struct Followed {
    /// Number of particles.
    pub particles: usize,
    /// The effective sample size, instant by instant.
    pub effective: Arc<[f64]>,
    /// The standard error of ln P(observations).
    pub ln_evidence_error: f64,
}

/// The values of the searched slots at all instants.
#[derive(Clone, PartialEq, Debug)]
pub struct Sequence {
    /// Its probability given all observations, where the question asks for it.
    pub probability: Option<f64>,
    /// The ordinals, instant by instant.
    pub values: Vec<Vec<usize>>,
}

/// Which instants a question about the last one answers.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Scope {
    /// The last one.
    Last,
    /// Each, given the observations up to it.
    Each,
}

/// The answer to a question over time.
#[derive(Clone, PartialEq, Debug)]
pub struct Answered {
    /// Instant by instant.
    pub posteriors: Vec<InstantPosterior>,
    /// The sequences, where the question asks for sequences of finite values.
    pub sequences: Vec<Sequence>,
    /// ln P(observations)
    pub ln_evidence: f64,
}

/// The slots and values of observations by name.
///
/// # Errors
/// A name that is not an observed variable, or a value outside its domain.
pub fn instants(
    setting: &Setting<'_>,
    route: &OverTime,
    observations: &[Vec<(String, f64)>],
) -> Result<Vec<Instant>, Error> {
    let slots = observed(setting, route);
    let always = always(setting, route);
    let mut all = Vec::with_capacity(observations.len());
    for (position, observed) in observations.iter().enumerate() {
        let mut checked = crate::sample::Observations::none(setting);
        let mut instant = always.clone();
        for (name, value) in observed {
            let slot = slot_named(&slots, name)?;
            checked
                .observe(setting, slot, *value)
                .map_err(|error| Error::input(format!("instant {}", position + 1), error.to_string()))?;
            instant.retain(|(own, _)| *own != slot);
            instant.push((slot, checked.values[slot]));
        }
        instant.sort_by_key(|(slot, _)| *slot);
        all.push(instant);
    }
    Ok(all)
}

/// The names of the slots that a question observes.
fn observed(setting: &Setting<'_>, route: &OverTime) -> Vec<(String, usize)> {
    let slots = route.observed(setting.model).into_iter().flat_map(|variable| setting.slots_of(variable));
    slots.map(|slot| (setting.slot_name(slot), slot)).collect()
}

fn slot_named(slots: &[(String, usize)], name: &str) -> Result<usize, Error> {
    let found = slots.iter().find(|(known, _)| known == name);
    found.map(|(_, slot)| *slot).ok_or_else(|| {
        let known: Vec<String> = slots.iter().map(|(name, _)| format!("`{name}`")).collect();
        Error::input(name, format!("the question does not know it; it knows {}", known.join(", ")))
    })
}

/// The slots and likelihoods of each instant, by name.
///
/// # Errors
/// A name that is not an observed variable; a strategy that follows values alone.
fn weighed(
    setting: &Setting<'_>,
    route: &OverTime,
    instants: &[Likelihoods],
) -> Result<Vec<Vec<Weighed>>, Error> {
    let slots = observed(setting, route);
    let one = |(name, weights): &(String, Vec<f64>)| Ok((slot_named(&slots, name)?, weights.clone()));
    let all: Vec<Vec<Weighed>> =
        instants.iter().map(|instant| instant.iter().map(one).collect()).collect::<Result<_, Error>>()?;
    match (all.iter().flatten().next(), &route.by) {
        (Some((slot, _)), By::Gaussian(_) | By::Extended | By::Particles { .. }) => {
            Err(follow::only_values(setting, *slot))
        }
        _ => Ok(all),
    }
}

/// A value that the question gives holds at every instant.
fn always(setting: &Setting<'_>, route: &OverTime) -> Instant {
    let mut always: Instant = Vec::new();
    for known in &route.ask().known {
        let slots = setting.slots_of(known.variable);
        match &known.evidence {
            Finding::Hard(Value::Ordinal(ordinal)) => {
                always.extend(slots.map(|slot| (slot, *ordinal as f64)))
            }
            Finding::Hard(Value::Real(number)) => always.extend(slots.map(|slot| (slot, *number))),
            Finding::Hard(Value::Vector(numbers)) => always.extend(slots.zip(numbers.iter().copied())),
            _ => {}
        }
    }
    always
}

/// Upper limit on the instants predicted, since the messages of all are stored.
const MOST_STEPS: usize = 1_000_000;

/// Answers a question over time.
///
/// # Errors
/// Observations that are impossible, numbers that are missing.
pub fn answer(
    setting: &Setting<'_>,
    route: &OverTime,
    (instants, likelihoods): (&[Instant], &[Likelihoods]),
    scope: Scope,
    sampling: Sampling,
) -> Result<Answered, Error> {
    let ahead = route.ask().when.ahead();
    if ahead > MOST_STEPS {
        let help = "predict fewer instants".to_owned();
        let name = setting.model.ask_text(route.ask());
        return Err(Error::TooLarge { name, cells: ahead as f64, most: MOST_STEPS as f64, help });
    }
    let weighed = weighed(setting, route, likelihoods)?;
    match &route.by {
        By::Chain => chain::answer(setting, route, (instants, weighed), scope, sampling.seed),
        By::Gaussian(gaussian) => {
            let mut filter = Filter::of(setting, gaussian)?;
            let beliefs = match route.ask().when.is_every_instant() {
                true => filter.smoothed(instants)?,
                false => filter.filtered(instants)?,
            };
            let predicted = (ahead > 0).then(|| filter.predicted(ahead));
            Ok(answer_normal(route, instants, scope, beliefs, predicted))
        }
        By::Extended => {
            let mut filter = Extended::new(setting, route)?;
            let beliefs = match route.ask().when.is_every_instant() {
                true => filter.smoothed(instants)?,
                false => filter.filtered(instants)?,
            };
            let predicted = if ahead > 0 { Some(filter.predicted(ahead)?) } else { None };
            Ok(answer_normal(route, instants, scope, beliefs, predicted))
        }
        By::Particles { linear, .. } => {
            let mut all = instants.to_vec();
            all.resize(instants.len() + ahead, Vec::new());
            let unmet = |number: usize| unmet(setting, route, number, &all[number], sampling.particles);
            let slots = route.ask().searched.iter().flat_map(|item| setting.slots_of(item.variable));
            if scope == Scope::Each && route.ask().when == When::Filter {
                return by_following(setting, route, instants, sampling);
            }
            if route.ask().when.is_every_instant() {
                return by_paths(setting, route, &all, &slots.collect::<Vec<_>>(), sampling, &unmet);
            }
            let moves = Moves::new(setting, route.ask(), &route.carried, linear, sampling)?;
            let (mut cloud, _) = moves.follow(&all, &mut |_| {})?.map_err(unmet)?;
            moves.check_constants(&cloud, route.ask())?;
            let (linear, kept): (Vec<usize>, Vec<usize>) =
                slots.partition(|slot| linear.contains(&setting.variable_of(*slot)));
            let law = follow::cloud_of(&mut cloud, &kept, &linear);
            let posteriors = vec![InstantPosterior { instant: all.len(), law }];
            Ok(Answered { posteriors, sequences: Vec::new(), ln_evidence: cloud.ln_evidence })
        }
    }
}

impl Followed {
    fn of(cloud: &Cloud) -> Self {
        Self {
            particles: cloud.particles.len(),
            effective: cloud.effective.as_slice().into(),
            ln_evidence_error: cloud.ln_evidence_error(),
        }
    }
}

/// The posterior after each instant, by particles that have seen no later one.
fn by_following(
    setting: &Setting<'_>,
    route: &OverTime,
    instants: &[Instant],
    sampling: Sampling,
) -> Result<Answered, Error> {
    let mut follower = Follower::new(setting.clone(), route.clone(), sampling)?;
    let mut posteriors = Vec::with_capacity(instants.len());
    for instant in instants {
        posteriors.push(follower.step(instant)?);
    }
    Ok(Answered { posteriors, sequences: Vec::new(), ln_evidence: follower.ln_evidence() })
}

/// The most particles whose paths are kept of many instants, and the most of all instants together.
const MOST_PATHS: usize = 10_000;
const MOST_OF_ALL_INSTANTS: usize = 2_000_000;

/// The particles whose paths are kept: those that are wanted, fewer of many instants.
fn paths_of(instants: usize, sampling: Sampling) -> usize {
    sampling.particles.min((MOST_OF_ALL_INSTANTS / instants.max(1)).max(MOST_PATHS))
}

/// The posteriors of all instants by paths of particles, or the most probable of the paths.
fn by_paths(
    setting: &Setting<'_>,
    route: &OverTime,
    instants: &[Instant],
    slots: &[usize],
    sampling: Sampling,
    unmet: &dyn Fn(usize) -> Error,
) -> Result<Answered, Error> {
    let sampling = Sampling { particles: paths_of(instants.len(), sampling), ..sampling };
    let cells = sampling.particles as f64 * instants.len() as f64 * (setting.slots() as f64 + 3.0);
    if let Some(free) = memory::free().filter(|free| 8.0 * cells > *free) {
        let help = format!("follow fewer particles (`{}`), or fewer instants", Advice::Draws);
        let name = setting.model.ask_text(route.ask());
        return Err(Error::TooLarge { name, cells, most: (free / 8.0).floor(), help });
    }
    let moves = Moves::new(setting, route.ask(), &route.carried, &[], sampling)?;
    // All is drawn, and no draw meets a point: an observed component is observed in its vector.
    let of_vector = |(slot, value): &(usize, f64)| {
        let component = setting.model.named_component(setting.variable_of(*slot));
        let of = component.map(|(use_, at)| setting.slots_of(use_.variable).start + at);
        (of.unwrap_or(*slot), *value)
    };
    let observed: Vec<Instant> =
        instants.iter().map(|instant| instant.iter().map(of_vector).collect()).collect();
    let instants = observed.as_slice();
    let mut paths = Paths::new(setting.slots());
    let (cloud, guide) = moves.follow(instants, &mut |cloud| paths.record(cloud))?.map_err(unmet)?;
    moves.check_constants(&cloud, route.ask())?;
    let laws: Vec<InstantLaw> = match route.ask().when {
        When::Sequence => {
            let followed = Followed::of(&cloud);
            let values = |values| InstantLaw::Values(values, followed.clone());
            moves.most_probable(&paths, slots)?.into_iter().map(values).collect()
        }
        _ => {
            let all = moves.smoothed(&paths, slots, (instants, guide.as_ref()))?;
            let effective = all.iter().map(|path| path.effective).collect();
            let followed = Followed { effective, ..Followed::of(&cloud) };
            let cloud = |path: Path| InstantLaw::Cloud {
                draws: Arc::new(path.draws),
                kept: slots.to_vec(),
                linear: Vec::new(),
                followed: followed.clone(),
            };
            all.into_iter().map(cloud).collect()
        }
    };
    let posterior = |(instant, law)| InstantPosterior { instant: instant + 1, law };
    let posteriors = laws.into_iter().enumerate().map(posterior).collect();
    Ok(Answered { posteriors, sequences: Vec::new(), ln_evidence: cloud.ln_evidence })
}

/// The normal laws of the instants: filtered, smoothed, or predicted.
fn answer_normal(
    route: &OverTime,
    instants: &[Instant],
    scope: Scope,
    beliefs: Vec<Belief>,
    predicted: Option<Belief>,
) -> Answered {
    let when = route.ask().when;
    let ln_evidence = beliefs.iter().map(|belief| belief.ln_evidence).sum();
    let posterior = |(instant, belief): (usize, Belief)| InstantPosterior {
        instant: instant + 1,
        law: InstantLaw::Normal(belief),
    };
    let mut all: Vec<(usize, Belief)> = beliefs.into_iter().enumerate().collect();
    all.extend(predicted.map(|belief| (instants.len() - 1 + when.ahead(), belief)));
    let from = if when.is_every_instant() || scope == Scope::Each { 0 } else { all.len().saturating_sub(1) };
    let posteriors = all.split_off(from).into_iter().map(posterior).collect();
    Answered { posteriors, sequences: Vec::new(), ln_evidence }
}

/// The error that no particle agrees with the observations of an instant; it names a factor that alone makes them
/// impossible, if there is one.
fn unmet(setting: &Setting<'_>, route: &OverTime, number: usize, instant: &Instant, draws: usize) -> Error {
    let question = format!("{}, instant {}", setting.model.ask_text(route.ask()), number + 1);
    let mut values = vec![f64::NAN; setting.slots()];
    instant.iter().for_each(|(slot, value)| values[*slot] = *value);
    setting.unmet(question, &values, draws)
}

//! The posterior: a distribution of named variables.
//!
//! In: an answer. Out: probabilities by value, the mode, moments, intervals. Invariant: values are looked up by
//! variable and element; a lookup of a name that does not exist is an error that lists those that do.

use super::lookup::{one_slot, slots_named};
use super::value::{ordinal, value};
use super::{Evidence, Program, Value};
use crate::answer::{Answer, AnswerRows, Drawn, Estimate, Numbers, Part, PartLaw, Slot, Stored, ordinals};
use crate::error::Error;
use crate::model::Model;
use crate::operators::entropy;
use crate::plan::Strategy;
use crate::radix;
use serde::{Serialize, Serializer};
use std::borrow::Cow;
use std::fmt::{self, Display, Formatter};

/// The answer to a question: a distribution of variables, or a statistic.
///
/// It prints as a table with bars (`{:#}` shows all rows of a large one), and serialises with serde as `bp ask --json`
/// does.
///
/// ```
/// # use bp_core::prelude::*;
/// # fn main() -> Result<(), bp_core::Error> {
/// # let grass = Program::parse("program Grass { variables { Rain, Wet : bool; } decomposition { P(Rain) P(Wet | Rain) }
/// #     forms { P(Rain) = bernoulli(0.5); P(Wet | Rain) = bernoulli(if Rain { 0.75 } else { 0.25 }); } }")?;
/// let rain = grass.ask("P(Rain | Wet = true)")?;
/// assert_eq!(rain.p(true)?, 0.75);
/// assert_eq!(rain.mode()?["Rain"], true);
/// let both = grass.ask("P(Rain Wet)")?;
/// assert_eq!(both.p((true, false))?, 0.125);
/// assert_eq!(both.of("Wet")?.p(true)?, 0.5);
/// let table = grass.ask("P(Rain | Wet)")?;
/// assert_eq!(table.given("Wet", false)?.p(true)?, 0.25);
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug)]
pub struct Posterior {
    pub(super) program: Program,
    pub(super) answer: Answer,
}

impl Posterior {
    pub(super) fn new(program: &Program, answer: Answer) -> Self {
        Self { program: program.clone(), answer }
    }

    /// It and its model as plain data, to be stored in a format of serde that is not for readers (CBOR, not JSON), and read again.
    pub fn to_stored(&self) -> (Cow<'_, Model>, Stored) {
        (Cow::Borrowed(self.model()), Stored::of(self.model(), &self.answer))
    }

    /// A posterior that was stored.
    pub fn of_stored((model, answer): (Cow<'_, Model>, Stored)) -> Self {
        let program = Program::from(model.into_owned());
        let answer = answer.answer(program.model());
        Self { program, answer }
    }

    /// The answer, for the stages of the compiler.
    pub fn answer(&self) -> &Answer {
        &self.answer
    }

    /// The question, as a user types it.
    pub fn question(&self) -> &str {
        &self.answer.question
    }

    /// The strategy that computed it.
    pub fn strategy(&self) -> Strategy {
        self.answer.strategy
    }

    /// ln P(evidence), if the evidence is one event; for reals the density.
    pub fn ln_evidence(&self) -> Option<f64> {
        self.answer.ln_evidence
    }

    /// The estimate, if it is not exact: number of draws, effective number, random seed, standard error of ln
    /// P(evidence).
    pub fn estimate(&self) -> Option<&Estimate> {
        self.answer.estimate.as_ref()
    }

    /// A warning about the estimate, if there is one.
    pub fn warning(&self) -> Option<&str> {
        self.answer.estimate.as_ref()?.warning.as_deref()
    }

    /// The probability of a value; for several variables a tuple of their values, in the order of the question, for a
    /// family the list of its elements. For a normal distribution it is a density.
    ///
    /// # Errors
    /// A different number of variables, or a value that a variable does not have; several contexts or instants, one of
    /// which must be chosen; draws of a real, which have no density.
    pub fn p(&self, value: impl Into<Value>) -> Result<f64, Error> {
        self.p_and_error(value).map(|[p, _]| p)
    }

    /// The probability of a value, and its standard error: 0 if the answer is exact.
    ///
    /// # Errors
    /// As [`Posterior::p`].
    pub fn p_and_error(&self, value: impl Into<Value>) -> Result<[f64; 2], Error> {
        let (part, value) = (self.one()?, value.into());
        let values = value.flat();
        if values.len() != part.of.len() {
            let (found, names) = (values.len(), self.names(&part.of));
            let expected = match part.of.len() {
                0 => "it is one number: read it with `number`".to_owned(),
                count => format!("it has the variables {names}: give {count}"),
            };
            return Err(self.lookup(format!("found {found} values, but {expected}")));
        }
        if let PartLaw::Laws { .. } | PartLaw::NamedMixture(_) = &part.law
            && part.of.len() > 1
        {
            return Err(self.lookup(
                "the density of several unknowns together is not known here: ask for one".to_owned(),
            ));
        }
        if let PartLaw::Normal { .. }
        | PartLaw::Mixture(_)
        | PartLaw::NamedMixture(_)
        | PartLaw::Laws { .. } = &part.law
        {
            let at: Option<Vec<f64>> = values.iter().map(|value| value.as_f64()).collect();
            let at = at.ok_or_else(|| self.lookup(format!("`{value}` is not a number; look up a real")))?;
            return Ok([part.law.density(&at), 0.0]);
        }
        if let PartLaw::ConditionalGaussian(law) = &part.law {
            let (mut finite, mut reals) = (Vec::new(), Vec::new());
            for (slot, value) in part.of.iter().zip(values) {
                match (slot.count, value.as_f64()) {
                    (0, Some(number)) => reals.push(number),
                    (0, None) => {
                        return Err(self.lookup(format!("`{value}` is not a number; look up a real")));
                    }
                    _ => finite
                        .push(ordinal(self.model(), slot, value).map_err(|message| self.lookup(message))?),
                }
            }
            return Ok([law.density(&finite, &reals), 0.0]);
        }
        if let Some(real) = part.of.iter().find(|slot| slot.count == 0) {
            let name = real.name(self.model());
            let message = format!("draws of `{name}` have no density: ask for `mean`, `interval` or `draws`");
            return Err(self.lookup(message));
        }
        let found = part.of.iter().zip(values).map(|(slot, value)| ordinal(self.model(), slot, value));
        let found: Vec<usize> = found.collect::<Result<_, _>>().map_err(|message| self.lookup(message))?;
        Ok(match &part.law {
            PartLaw::Draws(draws, drawn) => draws.mean(|draw| {
                let agrees = |(drawn, ordinal): (&Drawn, &usize)| match drawn {
                    Drawn::At(position) => draws.value(draw, *position) == *ordinal as f64,
                    Drawn::Normals(_) => false,
                };
                f64::from(u8::from(drawn.iter().zip(&found).all(agrees)))
            }),
            PartLaw::Finite(numbers) => {
                let place = radix::position(found.iter().zip(&part.of).map(|(at, slot)| (*at, slot.count)));
                [numbers[place], 0.0]
            }
            PartLaw::Normal { .. }
            | PartLaw::Mixture(_)
            | PartLaw::NamedMixture(_)
            | PartLaw::Laws { .. }
            | PartLaw::ConditionalGaussian(_) => [part.law.density(&[]), 0.0],
        })
    }

    /// The probability of each combination of values, in the order of the table.
    ///
    /// # Errors
    /// As [`Posterior::p`].
    pub fn values(&self) -> Result<Vec<(Evidence, f64)>, Error> {
        let part = self.one()?;
        let numbers = self.finite(part)?;
        let named = |(place, p): (usize, &f64)| (self.assignment(&part.of, place), *p);
        Ok(numbers.iter().enumerate().map(named).collect())
    }

    /// The entropy, in nats; for a normal distribution the differential entropy. For a question for an entropy it is
    /// the answer.
    ///
    /// # Errors
    /// As [`Posterior::p`].
    pub fn entropy(&self) -> Result<f64, Error> {
        let part = self.one()?;
        if let PartLaw::Normal { covariance, .. } = &part.law {
            return Ok(super::numbers::normal_entropy(covariance, part.of.len()));
        }
        if let Some(entropy) = part.entropy_of_one_real() {
            return Ok(entropy);
        }
        let numbers = self.finite(part)?;
        Ok(entropy(numbers.iter().copied()))
    }

    /// The value of a question for `entropy`, `information`, `divergence`, `expectation`, `variance`, `max`, or the
    /// probability of one value.
    ///
    /// # Errors
    /// The answer is not one number.
    pub fn number(&self) -> Result<f64, Error> {
        match self.answer.answer.as_slice() {
            [row] => row.figure.number(),
            _ => None,
        }
        .ok_or_else(|| self.lookup("the answer is not one number: look up values with `p`".to_owned()))
    }

    /// The distribution of one of its variables, of one element (`Z[2]`), or of a whole family; the others are summed out.
    ///
    /// # Errors
    /// It has no such variable.
    pub fn of(&self, name: &str) -> Result<Self, Error> {
        let found = self.answer.parts.iter().filter_map(|part| {
            let places = slots_named(self.model(), &part.of, name);
            (!places.is_empty()).then(|| part.marginal(&places))
        });
        let parts: Vec<Part> = found.collect();
        if parts.is_empty() {
            let mut all: Vec<String> = self
                .answer
                .parts
                .iter()
                .flat_map(|part| &part.of)
                .map(|slot| slot.name(self.model()))
                .collect();
            all.sort();
            all.dedup();
            return Err(self.lookup(super::lookup::absent(name, &all)));
        }
        Ok(self.with_parts(parts, format!("{}, {name}", self.question())))
    }

    /// The distribution in one context: at this value of a known variable without a value in the question.
    ///
    /// # Errors
    /// No such variable is open in the question, or it has no such value.
    pub fn given(&self, name: &str, value: impl Into<Value>) -> Result<Self, Error> {
        let (model, value) = (self.model(), value.into());
        let mut parts = Vec::new();
        for part in &self.answer.parts {
            let mut places = slots_named(model, &part.given, name);
            let values = value.flat();
            if places.is_empty() || places.len() != values.len() {
                let known: Vec<String> = part.given.iter().map(|slot| slot.name(model)).collect();
                return Err(self.lookup(super::lookup::not_given(name, &known)));
            }
            let mut chosen = part.clone();
            for value in values.iter().rev() {
                let place = places.pop().expect("internal: a place for each value");
                let at = ordinal(model, &part.given[place], value).map_err(|message| self.lookup(message))?;
                chosen = super::lookup::in_context(&chosen, place, at);
            }
            parts.push(chosen);
        }
        Ok(self.with_parts(parts, format!("{}, {name} = {value}", self.question())))
    }

    /// The distribution at an instant, from 1, of a question that answers for each (`smooth`, `sequence`).
    ///
    /// # Errors
    /// There is no such instant.
    pub fn at(&self, instant: usize) -> Result<Self, Error> {
        let parts = &self.answer.parts;
        let part = parts.binary_search_by_key(&Some(instant), |part| part.instant).map(|at| &parts[at]);
        let part = part.map_err(|_| {
            self.lookup(match parts.last().and_then(|part| part.instant) {
                Some(last) => format!("it has no instant {instant}; its instants are 1 to {last}"),
                None => "it has a single instant; `smooth` and `sequence` have several".to_owned(),
            })
        })?;
        let part = Part { instant: None, ..part.clone() };
        Ok(self.with_parts(vec![part], format!("{}, instant {instant}", self.question())))
    }

    /// Number of instants: 1 except for `smooth` and `sequence`.
    pub fn instants(&self) -> usize {
        self.answer.parts.last().and_then(|part| part.instant).unwrap_or(1)
    }

    fn with_parts(&self, parts: Vec<Part>, question: String) -> Self {
        let rows = AnswerRows::of_parts(self.model(), &parts);
        let answer =
            Answer { question, answer: rows, parts, estimate: self.answer.estimate.clone(), ..self.answer };
        Self { program: self.program.clone(), answer }
    }

    /// The model that was asked.
    pub fn model(&self) -> &Model {
        self.program.model()
    }

    /// The only part, in its only context.
    pub(super) fn one(&self) -> Result<&Part, Error> {
        let choose = |what: String| Err(self.lookup(what));
        match self.answer.parts.as_slice() {
            [] => choose("it is not a distribution: read it with `number`".to_owned()),
            [part] if part.given.is_empty() => Ok(part),
            [part] => {
                let names = self.names(&part.given);
                choose(format!("it has a context for each value of {names}: choose one with `given`"))
            }
            [first, ..] if first.instant.is_some() => {
                choose(format!("it has {} instants: choose one with `at`", self.instants()))
            }
            _ => choose("it has a marginal for each variable: choose one with `of`".to_owned()),
        }
    }

    /// The probabilities of the combinations of finite slots; for draws their estimates.
    pub(super) fn finite(&self, part: &Part) -> Result<Numbers, Error> {
        part.probabilities().ok_or_else(|| {
            let real = part.of.iter().find(|slot| slot.count == 0);
            let name = real.map_or_else(String::new, |slot| slot.name(self.model()));
            self.lookup(format!("`{name}` is a real, which is not finite: ask for `mean` or `interval`"))
        })
    }

    /// The only slot of the only part, and its position.
    pub(super) fn single(&self) -> Result<(&Part, &Slot), Error> {
        let part = self.one()?;
        one_slot(part).map(|slot| (part, slot)).ok_or_else(|| {
            let names = self.names(&part.of);
            self.lookup(format!("it has the variables {names}: choose one with `of`"))
        })
    }

    pub(super) fn assignment(&self, of: &[Slot], place: usize) -> Evidence {
        let values = of.iter().zip(ordinals(of, place));
        values.map(|(slot, at)| (slot.name(self.model()), value(self.model(), slot, at))).collect()
    }

    fn names(&self, slots: &[Slot]) -> String {
        let names: Vec<String> = slots.iter().map(|slot| slot.name(self.model())).collect();
        crate::guess::listed(names.iter().map(String::as_str), "and")
    }

    pub(super) fn lookup(&self, message: String) -> Error {
        Error::Lookup { question: self.answer.question.clone(), message }
    }
}

/// The table with bars.
impl Display for Posterior {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        self.answer.fmt(f)
    }
}

impl Serialize for Posterior {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.answer.serialize(serializer)
    }
}

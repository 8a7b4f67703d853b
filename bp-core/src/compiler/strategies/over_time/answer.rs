//! Answers over time.
//!
//! In: a question over time, and the observations of each instant. Out: [`Answer`]s, whose rows name the instant where
//! several are answered. Invariant: instants are numbered from 1; a statistic of a finite distribution over time is
//! computed as without time, with the instants as contexts.

use super::{self as time, Answered, Followed, InstantLaw, InstantPosterior, OverTime, Scope};
use crate::distribution::Setting;
use crate::door::Advice;
use crate::error::Error;
use crate::model::{Ask, Known, Model, Statistic, When};
use crate::posterior::{
    Answer, AnswerRows, Column, Drawn, Estimate, Figure, Numbers, Part, PartLaw, Reader, Row, Slot, Table,
    named,
};
use crate::progress;
use crate::radix;
use crate::random::seeded;
use crate::sample::{Draws, Sampling};
use crate::spelling::exact;
use crate::strategies::{
    Case, Found, Observed, Offered, Prepared, Purpose,
    gaussian::{self, Named},
    weighting as sampled,
};
use rand::Rng;
use std::borrow::Cow;
use std::sync::Arc;

/// A question over time with its compiled route.
#[derive(Debug)]
pub(super) struct Instants {
    pub(super) route: OverTime,
    pub(super) purpose: Purpose,
}

impl Prepared for Instants {
    fn run(&self, model: &Model, case: &Case<'_>) -> Result<Vec<Found>, Error> {
        let setting = Setting::new(model, case.inputs)?;
        let asker = Asker { setting: &setting, case, route: &self.route };
        Ok(vec![match self.purpose {
            Purpose::Shown { each } => Found::Answer(asker.answer(each)?),
            Purpose::Compared { each } => {
                let answered = asker.run(if each { Scope::Each } else { Scope::Last })?;
                match asker.laws(&answered, each) {
                    Some(laws) => Found::Normal(laws, None),
                    None => Found::Table(asker.table(&answered, each)?, None),
                }
            }
        }])
    }
}

/// A question with all of its inputs.
struct Asker<'q> {
    setting: &'q Setting<'q>,
    case: &'q Case<'q>,
    route: &'q OverTime,
}

impl Asker<'_> {
    fn answer(&self, each: bool) -> Result<Answer, Error> {
        let (setting, sampling, ask) = (self.setting, self.case.sampling, self.route.ask());
        let answered = self.run(if each { Scope::Each } else { Scope::Last })?;
        let several = each || ask.when.is_every_instant();
        let one = if each { answered.posteriors.last() } else { answered.posteriors.first() };
        let estimate = one.and_then(|posterior| estimate(posterior, sampling));
        let answer = match &ask.statistic {
            _ if !answered.sequences.is_empty() => self.sequence_rows(&answered)?.into(),
            _ if answered
                .posteriors
                .iter()
                .all(|posterior| matches!(posterior.law, InstantLaw::Finite(_))) =>
            {
                let table = self.table(&answered, several)?;
                let (model, inputs, seed) = (setting.model, self.case.inputs, sampling.seed);
                Reader { model, ask, table: &table, inputs, seed }.rows()?
            }
            _ => {
                let mut random = seeded(sampling.seed, &setting.model.ask_text(ask));
                let rows = answered
                    .posteriors
                    .iter()
                    .map(|posterior| self.real_rows((ask, several), posterior, &mut random));
                rows.collect::<Result<Vec<_>, Error>>()?.concat().into()
            }
        };
        Ok(Answer {
            question: setting.model.ask_text(ask),
            ln_evidence: Some(answered.ln_evidence),
            estimate,
            answer,
            strategy: self.route.strategy(),
            when: ask.when,
            parts: answered
                .posteriors
                .iter()
                .map(|posterior| part(setting, ask, posterior, several))
                .collect(),
        })
    }

    fn run(&self, scope: Scope) -> Result<Answered, Error> {
        if self.case.instants.is_empty() {
            let message = "no instant was given; it is asked over time, with a row for each";
            return Err(Error::input(self.setting.model.ask_text(self.route.ask()), message));
        }
        let instants = time::instants(self.setting, self.route, &self.observed())?;
        let likelihoods = self.case.findings.map(|findings| findings.instants.as_slice()).unwrap_or_default();
        let known = (instants.as_slice(), likelihoods);
        let mut answered = time::answer(self.setting, self.route, known, scope, self.case.sampling)?;
        let ask = self.route.ask();
        if let Some(absent) = self.route.absent_at_first(self.setting.model)
            && answered.posteriors.first().is_some_and(|posterior| posterior.instant == 1)
        {
            answered.posteriors.remove(0);
            answered.sequences.iter_mut().for_each(|sequence| drop(sequence.values.remove(0)));
            if answered.posteriors.is_empty() {
                return Err(absent);
            }
        }
        for posterior in &mut answered.posteriors {
            if let InstantLaw::Normal(belief) = &posterior.law
                && let Some(numbers) = gaussian::whether(self.setting, ask, &belief.law)
            {
                posterior.law = InstantLaw::Finite(numbers.into());
            }
        }
        Ok(answered)
    }

    /// The observations, without variables that only other asks of the question know.
    fn observed(&self) -> Cow<'_, [Observed]> {
        let names = |known: &[Known]| -> Vec<String> {
            let slots = known.iter().flat_map(|known| self.setting.slots_of(known.variable));
            slots.map(|slot| self.setting.slot_name(slot)).collect()
        };
        let own = names(&self.route.ask().known);
        let others = self.case.question.asks.iter().flat_map(|ask| [&ask.known[..], ask.statistic.from()]);
        let others: Vec<String> = others.flat_map(names).filter(|name| !own.contains(name)).collect();
        let mut all = Cow::Borrowed(self.case.instants);
        if !others.is_empty() {
            let retain = |observed: &mut Observed| observed.retain(|(name, _)| !others.contains(name));
            all.to_mut().iter_mut().for_each(retain);
        }
        all
    }

    /// The distributions of the instants as one table, with the instants as contexts where `several` are answered.
    fn table(&self, answered: &Answered, several: bool) -> Result<Table, Error> {
        let laws = answered.posteriors.iter().filter_map(|posterior| match &posterior.law {
            InstantLaw::Finite(numbers) => Some(numbers),
            _ => None,
        });
        if laws.clone().count() < answered.posteriors.len() {
            let reason = "it compares distributions of finite variables".to_owned();
            let question = self.setting.model.ask_text(self.route.ask());
            return Err(Error::Unplanned { question, reason });
        }
        let instants = answered.posteriors.iter().map(|posterior| posterior.instant.to_string()).collect();
        let right = Column { variable: None, element: 0, name: self.index(), values: instants };
        Ok(Table {
            question: self.setting.model.ask_text(self.route.ask()),
            right: if several { vec![right] } else { Vec::new() },
            left: self.columns(self.route.ask()),
            numbers: Numbers::concatenated(laws),
            extended: None,
        })
    }

    /// A column for each searched slot.
    fn columns(&self, ask: &Ask) -> Vec<Column> {
        let slots = ask.searched.iter().flat_map(|item| self.setting.slots_of(item.variable));
        let column = |slot: usize| {
            let variable = self.setting.variable_of(slot);
            let count = self.setting.count(variable);
            let value = |ordinal| self.setting.model.value_name(variable, ordinal);
            let values = (0..count).map(value).collect();
            let element = slot - self.setting.slots_of(variable).start;
            Column { variable: Some(variable), element, name: self.setting.slot_name(slot), values }
        };
        slots.map(column).collect()
    }

    /// The name of the instants' column.
    fn index(&self) -> String {
        let model = self.setting.model;
        model.plate_index().map_or("t".to_owned(), |index| model.variable_name(index))
    }

    fn sequence_rows(&self, answered: &Answered) -> Result<Vec<Row>, Error> {
        let columns = self.columns(self.route.ask());
        if let (Statistic::Maximum, [sequence]) = (&self.route.ask().statistic, answered.sequences.as_slice())
        {
            let p = sequence.probability.unwrap_or(f64::NAN);
            return Ok(vec![Row { values: Vec::new(), figure: Figure::Probability { p } }]);
        }
        let mut rows = Vec::new();
        for (number, sequence) in answered.sequences.iter().enumerate() {
            for (posterior, ordinals) in answered.posteriors.iter().zip(&sequence.values) {
                let mut values = Vec::with_capacity(columns.len() + 2);
                let figure = match (&self.route.ask().statistic, sequence.probability) {
                    (Statistic::Draw(_), _) => Figure::Draw { draw: number + 1 },
                    (_, Some(p)) => {
                        values.push(("sequence".to_owned(), (number + 1).to_string()));
                        Figure::Probability { p }
                    }
                    (_, None) => {
                        let InstantLaw::Finite(numbers) = &posterior.law else { continue };
                        let digits =
                            ordinals.iter().copied().zip(columns.iter().map(|column| column.values.len()));
                        let at = radix::position(digits);
                        Figure::Probability { p: numbers[at] }
                    }
                };
                values.push((self.index(), posterior.instant.to_string()));
                values.extend(named(&columns, ordinals));
                rows.push(Row { values, figure });
            }
        }
        Ok(rows)
    }

    /// The normal laws of the instants, named by them where `several` are answered; `None` where there are other laws.
    fn laws(&self, answered: &Answered, several: bool) -> Option<Vec<Named>> {
        let law = |posterior: &InstantPosterior| match &posterior.law {
            InstantLaw::Normal(belief) => {
                let instant = several.then(|| (self.index(), posterior.instant.to_string()));
                Some((instant.into_iter().collect(), belief.law.clone()))
            }
            _ => None,
        };
        answered.posteriors.iter().map(law).collect()
    }

    fn real_rows(
        &self,
        (ask, several): (&Ask, bool),
        posterior: &InstantPosterior,
        random: &mut impl Rng,
    ) -> Result<Vec<Row>, Error> {
        let instant = several.then(|| (self.index(), posterior.instant.to_string()));
        Ok(match &posterior.law {
            InstantLaw::Cloud { draws, kept, linear, .. } => {
                // Draws of different instants differ.
                let seed = self.case.sampling.seed;
                let seed = if instant.is_some() { seed.wrapping_add(posterior.instant as u64) } else { seed };
                let ask = &Ask { when: When::Now, ..ask.clone() };
                let mut rows = sampled::rows(self.setting, ask, draws, kept, (linear, seed))?;
                rows.iter_mut().for_each(|row| row.values.splice(0..0, instant.clone()).for_each(drop));
                rows
            }
            InstantLaw::Values(values, _) => {
                let slots = ask.searched.iter().flat_map(|item| self.setting.slots_of(item.variable));
                let spelled = |(slot, value): (usize, &f64)| {
                    let domain = &self.setting.model.variables[self.setting.variable_of(slot)].domain;
                    let value = match domain.is_finite() {
                        true => domain.value_name(*value as usize),
                        false => exact(*value),
                    };
                    (self.setting.slot_name(slot), value)
                };
                let values = instant.into_iter().chain(slots.zip(values).map(spelled)).collect();
                vec![Row { values, figure: Figure::Mode { by: Figure::MODES[1] } }]
            }
            InstantLaw::Normal(belief) => {
                gaussian::rows(self.setting, ask, &belief.law, instant.as_slice(), random)?
            }
            InstantLaw::Finite(_) => Vec::new(),
        })
    }
}

/// The particle estimate's figures, and a warning where effective particles were few.
fn estimate(posterior: &InstantPosterior, sampling: Sampling) -> Option<Estimate> {
    let (followed, draws) = match &posterior.law {
        InstantLaw::Cloud { draws, followed, .. } => (followed, Some(draws)),
        InstantLaw::Values(_, followed) => (followed, None),
        _ => return None,
    };
    let Followed { particles, effective, ln_evidence_error } = followed;
    let count = draws.map_or(*particles, |draws| draws.count());
    let least = (effective.iter().copied().enumerate()).min_by(|one, other| one.1.total_cmp(&other.1))?;
    let stopped = || format!("interrupted: this is the answer after instant {}", effective.len());
    let warning = progress::is_stopped().then(stopped).or((least.1 < sampled::FEW).then(|| {
        format!(
            "at instant {} the effective number of particles is {:.0}: {}",
            least.0 + 1,
            least.1,
            match count < sampling.particles {
                true => format!("of so many instants no more than {count} paths are drawn"),
                false => format!("use more (`{}`)", Advice::Draws),
            }
        )
    }));
    // After instants without an observation all weights are equal, but particles of one origin are not independent.
    let effective = draws.map_or(f64::INFINITY, |draws| draws.effective()).min(*effective.last()?);
    let ln_evidence_error = Some(*ln_evidence_error);
    Some(Estimate { particles: count, effective, seed: sampling.seed, ln_evidence_error, warning })
}

/// The distribution of an instant's slots, as part of an answer.
fn part(setting: &Setting<'_>, ask: &Ask, posterior: &InstantPosterior, several: bool) -> Part {
    let instant = several.then_some(posterior.instant);
    let slots = ask.searched.iter().flat_map(|item| setting.slots_of(item.variable));
    let of: Vec<Slot> = slots.map(|slot| Slot::of(setting, slot)).collect();
    let law = match &posterior.law {
        InstantLaw::Cloud { draws, kept, linear, .. } => {
            return Part { instant, ..sampled::part(setting, ask, draws, kept, linear) };
        }
        InstantLaw::Finite(numbers) => PartLaw::Finite(numbers.clone()),
        InstantLaw::Values(values, _) => {
            let draws = Draws::weighted(values.clone(), values.len(), &[0.0]);
            PartLaw::Draws(Arc::new(draws), (0..values.len()).map(Drawn::At).collect())
        }
        InstantLaw::Normal(belief) => gaussian::part(&belief.law),
    };
    Part { instant, given: Vec::new(), of, law }
}

/// The answer of a filter after an instant: the distribution of the searched variables.
pub(crate) fn of_instant(
    setting: &Setting<'_>,
    route: &OverTime,
    posterior: &InstantPosterior,
    ln_evidence: f64,
    sampling: Sampling,
) -> Answer {
    let part = part(setting, route.ask(), posterior, false);
    Answer {
        question: setting.model.ask_text(route.ask()),
        ln_evidence: Some(ln_evidence),
        estimate: estimate(posterior, sampling),
        answer: AnswerRows::of_parts(setting.model, std::slice::from_ref(&part)),
        strategy: route.strategy(),
        when: route.ask().when,
        parts: vec![part],
    }
}

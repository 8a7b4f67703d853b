//! Answers over time.
//!
//! In: a question over time, and what was observed at each instant. Out: [`Answer`]s, whose rows name the instant where
//! several are told. Invariant: instants are numbered from 1.

use super::{Answer, Estimate, Figure, Row, sampled};
use crate::distribution::Setting;
use crate::error::Error;
use crate::exec::Inputs;
use crate::model::{Ask, Model, Question, Reduction};
use crate::plan::{self, Options, Route};
use crate::progress;
use crate::sample::Sampling;
use crate::time::{self, Told, What};

pub(super) fn answers(
    model: &Model,
    question: &Question,
    observations: &[Vec<(String, f64)>],
    inputs: &Inputs<'_, f64>,
    sampling: Sampling,
) -> Result<Vec<Answer>, Error> {
    let setting = Setting::new(model, inputs)?;
    let mut answers = Vec::new();
    for route in plan::plan(model, question, Options::default())?.routes {
        let Route::OverTime(route) = route else {
            let reason = "it is not asked over time: write `filter P(…)`, `smooth P(…)`".to_owned();
            return Err(Error::Unplanned { question: question.name.clone(), reason });
        };
        if observations.is_empty() {
            let name = model.ask_text(&route.ask);
            return Err(Error::input(
                name,
                "no instant was given; it is asked over time, with a row for each",
            ));
        }
        let instants = time::instants(&setting, &route, observations)?;
        let answered = time::answer(&setting, &route, &instants, sampling)?;
        let several = matches!(route.ask.reduction, Reduction::Smooth | Reduction::Sequence);
        answers.push(Answer {
            question: model.ask_text(&route.ask),
            ln_evidence: Some(answered.ln_evidence),
            estimate: answered.told.iter().find_map(|told| estimate(told, sampling)),
            answer: (answered.told.iter())
                .map(|told| rows(&setting, &route.ask, told, several))
                .collect::<Result<Vec<_>, Error>>()?
                .concat(),
        });
    }
    Ok(answers)
}

/// How particles estimated it, and where they were few.
fn estimate(told: &Told, sampling: Sampling) -> Option<Estimate> {
    let What::Cloud { draws, effective, .. } = &told.what else { return None };
    let least = (effective.iter().copied().enumerate()).min_by(|one, other| one.1.total_cmp(&other.1))?;
    let stopped = || format!("interrupted: this is the answer after instant {}", effective.len());
    let warning = progress::is_stopped().then(stopped).or((least.1 < sampled::FEW).then(|| {
        format!(
            "at instant {} the particles say no more than {:.0} of equal weight would: take more (--particles)",
            least.0 + 1,
            least.1
        )
    }));
    let effective = *effective.last()?;
    Some(Estimate {
        particles: draws.count(),
        effective,
        seed: sampling.seed,
        ln_evidence_error: None,
        warning,
    })
}

fn rows(setting: &Setting<'_>, ask: &Ask, told: &Told, several: bool) -> Result<Vec<Row>, Error> {
    let index =
        setting.model.plate_index().map_or("t".to_owned(), |index| setting.model.variable_name(index));
    let instant = several.then(|| (index, told.instant.to_string()));
    Ok(match &told.what {
        What::Cloud { draws, kept, linear, .. } => {
            let plain = Ask { reduction: Reduction::Probability, ..ask.clone() };
            sampled::rows(setting, &plain, draws, kept, linear)?
        }
        What::Probabilities(slots, probabilities) => (probabilities.iter())
            .map(|(ordinals, p)| {
                let value = |(slot, ordinal): (&usize, &f64)| {
                    let domain = &setting.model.variables[setting.variable_of(*slot)].domain;
                    (setting.slot_name(*slot), domain.value_name(*ordinal as usize))
                };
                let values = instant.iter().cloned().chain(slots.iter().zip(ordinals).map(value)).collect();
                Row { values, figure: Figure::Probability { p: *p } }
            })
            .collect(),
        What::Normal(laws) => (laws.iter())
            .map(|(name, [mean, deviation])| {
                let values = instant.iter().cloned().chain([(name.clone(), String::new())]).collect();
                Row { values, figure: Figure::Normal { mean: *mean, deviation: *deviation } }
            })
            .collect(),
    })
}

//! The posterior of each variable: by the join tree if all are finite, otherwise by the planner.
//!
//! In: a program and evidence. Out: a [`Posterior`] with a part for each variable. Invariant: an observed variable has
//! its value with probability 1.

use super::value::{ordinal, read};
use super::{Evidence, Posterior, Program, Value};
use crate::answer::{Answer, Part, PartLaw, Slot, compile_by};
use crate::distribution::Setting;
use crate::error::Error;
use crate::model::{self, Ask, Known, Question, Searched, Statistic, When};
use crate::plan::Strategy;
use crate::strategies::join_tree::{Marginals, Named};

pub(super) fn marginals(program: &Program, evidence: &Evidence) -> Result<Posterior, Error> {
    let model = program.model();
    let finite = model.plate.is_none() && model.variables.values().all(|it| it.domain.is_finite());
    match finite {
        true => by_tree(program, evidence),
        false => by_planner(program, evidence),
    }
}

/// The title of the table.
fn text(program: &Program, evidence: &Evidence) -> String {
    let bar = if evidence.iter().next().is_some() { " | " } else { "" };
    format!("marginals of {}{bar}{evidence}", program.name())
}

fn by_tree(program: &Program, evidence: &Evidence) -> Result<Posterior, Error> {
    let model = program.model();
    let inputs = program.settings.inputs();
    let setting = Setting::new(model, &inputs)?;
    let named = Named::with(model.clone(), &program.opened.known, &inputs)?;
    let mut known = named.evidence([], [])?;
    for (name, value) in evidence.iter() {
        let places: Vec<usize> = match named.number_of(name) {
            Ok(one) => vec![one],
            // A family is given as a list.
            Err(error) => match model.variable(name) {
                Some(variable) => setting.slots_of(variable).collect(),
                None => return Err(error),
            },
        };
        if let ([one], Value::Likelihood(weights)) = (places.as_slice(), value) {
            let name = named.variable(*one);
            let likelihood = named.evidence([], [(name.as_str(), weights.as_slice())])?;
            known.likelihoods.extend(likelihood.likelihoods);
            continue;
        }
        let values = value.flat();
        if values.len() != places.len() {
            let message = format!("{} values were given, but {} are expected", values.len(), places.len());
            return Err(Error::input(name, message));
        }
        for (place, value) in places.into_iter().zip(values) {
            let value = ordinal(model, &Slot::of(&setting, place), value);
            known.hard.push((place, value.map_err(|message| Error::input(name, message))?));
        }
    }
    let wanted = named.shown();
    let given: Vec<usize> = known.hard.iter().map(|(variable, _)| *variable).collect();
    let weighed: Vec<usize> = known.likelihoods.iter().map(|(variable, _)| *variable).collect();
    let plan = Marginals::new(&named.network, &given, &weighed, &wanted)?;
    let mut session = plan.session();
    session.ask(&known).map_err(|error| named.tell(error))?;
    let parts = wanted.iter().map(|place| Part {
        instant: None,
        given: Vec::new(),
        of: vec![Slot::of(&setting, *place)],
        law: PartLaw::Finite(session.posterior(*place, &known)),
    });
    let parts: Vec<Part> = parts.collect();
    let ln_evidence = Some(session.ln_evidence() + program.opened.ln_scale);
    Ok(Posterior::new(program, whole(program, evidence, parts, Strategy::JoinTree, ln_evidence)))
}

/// An answer with a part for each variable.
fn whole(
    program: &Program,
    evidence: &Evidence,
    parts: Vec<Part>,
    strategy: Strategy,
    ln_evidence: Option<f64>,
) -> Answer {
    Answer {
        question: text(program, evidence),
        ln_evidence,
        estimate: None,
        answer: parts.iter().flat_map(|part| part.rows(program.model())).collect(),
        strategy,
        when: When::Now,
        parts,
    }
}

/// A question for each unobserved variable, all with the same known variables.
fn by_planner(program: &Program, evidence: &Evidence) -> Result<Posterior, Error> {
    let model = program.model();
    let mut known: Vec<Known> = Vec::new();
    for (name, value) in evidence.iter() {
        let variable = model.variable(name);
        let variable = variable.ok_or_else(|| {
            let names = program.variables();
            let message = super::lookup::unknown(name, names.iter().map(String::as_str).collect());
            Error::input(name, message)
        })?;
        let evidence = match value {
            Value::Likelihood(weights) => model::Evidence::Virtual(weights.clone()),
            value => {
                let size = |name: &str| program.settings.size(name);
                let read = read(model, variable, value, &size);
                let (ordinal, number) = read.map_err(|message| Error::input(name, message))?;
                model::Evidence::Hard(match ordinal {
                    Some(ordinal) => model::Value::Ordinal(ordinal),
                    None => model::Value::Real(number),
                })
            }
        };
        known.push(Known { variable, evidence });
    }
    let is_free = |id: &crate::ids::VariableId| {
        Some(*id) != model.plate_index()
            && model.variables[*id].previous_of.is_none()
            && !known.iter().any(|known| known.variable == *id)
    };
    let asks = model.variables.ids().filter(is_free).map(|variable| Ask {
        statistic: Statistic::Distribution,
        when: When::Now,
        searched: vec![Searched { variable, at: None }],
        known: known.clone(),
    });
    let question = Question { name: "marginals".to_owned(), asks: asks.collect() };
    let faults = model.question_faults(&question);
    if let Some(fault) = faults.first() {
        return Err(Error::Unplanned { question: text(program, evidence), reason: fault.message.clone() });
    }
    let answers =
        compile_by(model, &question, program.by)?.ask_with(&program.settings.inputs(), program.sampling)?;
    let mut all = whole(program, evidence, Vec::new(), Strategy::Sums, None);
    for answer in answers {
        all.ln_evidence = all.ln_evidence.or(answer.ln_evidence);
        all.estimate = all.estimate.or(answer.estimate);
        all.strategy = answer.strategy;
        all.answer.extend(answer.answer);
        all.parts.extend(answer.parts);
    }
    Ok(Posterior::new(program, all))
}

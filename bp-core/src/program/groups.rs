//! Questions about several variables: their joint posterior, the most probable assignment, the best observation.
//!
//! In: a program, names and evidence. Out: a [`Posterior`], or [`Observation`]s. Invariant: each question is a group of asks
//! with the same known variables, which the planner gives to one strategy.

use super::expanded::expanded;
use super::marginals::{Names, given};
use super::value::{of_text, ordinal};
use super::{Evidence, Posterior, Program};
use crate::answer::{Answer, Figure, Knowledge, Row, Slot, together};
use crate::distribution::Setting;
use crate::error::Error;
use crate::exec::Inputs;
use crate::ids::VariableId;
use crate::model::{Ask, Finding, Question, Searched, Statistic, Value, When};
use crate::plan::{Group, Options, Strategy};
use crate::sample::Observations;
use crate::spelling::exact;
use std::collections::HashMap;

/// The information gained by observing a variable, or an element of a family.
#[derive(Clone, PartialEq, Debug)]
pub struct Observation {
    /// Its name.
    pub variable: String,
    /// Its entropy given the evidence, in nats.
    pub entropy: f64,
    /// Its mutual information with the targets given the evidence, in nats: the expected decrease of their entropy.
    pub information: f64,
}

/// A program, names, and the evidence of a group of asks.
pub(super) struct Several<'p> {
    names: Names<'p>,
    knowledge: Knowledge,
    inputs: &'p Inputs<'p, f64>,
}

/// The joint posterior of some variables, or of elements of families.
pub(super) fn joint(program: &Program, of: &[String], evidence: &Evidence) -> Result<Posterior, Error> {
    if let Some((program, of, evidence)) = expanded(program, of, evidence)? {
        return joint(&program, &of, &evidence);
    }
    let inputs = program.settings.inputs();
    let setting = Setting::new(program.model(), &inputs)?;
    let mut all = Several::new(program, &setting, &inputs, evidence)?;
    let about = all.elements(&each_element(&setting, of))?;
    let ask = all.ask(Statistic::Distribution, &variables(&about));
    all.knowledge.elements.about = about;
    let answers = all.answers(vec![ask], Group::Joint)?;
    let mut answer = answers.into_iter().next().expect("internal: an answer to each ask");
    answer.ln_evidence = all.knowledge.ln_evidence(&answer).map(|ln| ln + program.opened.ln_scale);
    answer.question = format!("{}{}", of.join(" "), given(program, evidence));
    Ok(Posterior::new(program, answer))
}

/// The most probable assignment of all variables: one row, with ln of its joint probability with the evidence.
pub(super) fn most_probable(program: &Program, evidence: &Evidence) -> Result<Posterior, Error> {
    if let Some((program, _, evidence)) = expanded(program, &[], evidence)? {
        return most_probable(&program, &evidence);
    }
    let inputs = program.settings.inputs();
    let setting = Setting::new(program.model(), &inputs)?;
    let mut all = Several::new(program, &setting, &inputs, evidence)?;
    let mut free: Vec<VariableId> = all.shown().filter(|id| !all.is_observed(*id)).collect();
    if free.is_empty() {
        // The last observation is searched too; the join tree accepts its value as that of an element.
        let hard = |known: &crate::model::Known| match known.evidence {
            Finding::Hard(Value::Ordinal(ordinal)) => Some((known.variable, 0, ordinal)),
            _ => None,
        };
        let is_finite = program.model().variables.values().all(|variable| variable.domain.is_finite());
        match all.knowledge.known.pop().as_ref().and_then(hard).filter(|_| is_finite) {
            Some(last) => {
                all.knowledge.elements.hard.push(last);
                free.push(last.0);
            }
            None => return Several::new(program, &setting, &inputs, evidence)?.all_observed(evidence),
        }
    }
    let mode = all.ask(Statistic::Argmax { nearest: None }, &free);
    let answers = all.answers(vec![mode.clone()], Group::Mode)?;
    let mut answer = answers.into_iter().next().expect("internal: an answer to each ask");
    let ln_evidence = answer.ln_evidence.unwrap_or(0.0);
    let rows = answer.answer.as_list();
    rows.truncate(1);
    for row in rows {
        let ln_p = match row.figure {
            // Draws chose the values, or some reals are determined: the probability is that of the program.
            Figure::Estimated { .. } => all.ln_joint(&mode, row)?,
            Figure::Density { density } if density.is_infinite() => all.ln_joint(&mode, row)?,
            Figure::Probability { p } | Figure::Density { density: p } => p.ln() + ln_evidence,
            figure => figure.number().unwrap_or(f64::NAN),
        };
        *row = all.assignment(row, ln_p + program.opened.ln_scale);
    }
    answer.question = format!("argmax {}{}", program.name(), given(program, evidence));
    Ok(Posterior::new(program, answer))
}

/// The joint entropy of some targets, in nats, and the information that each candidate gives about them, the most informative
/// first. If no candidate is named, all variables are candidates.
pub(super) fn observations(
    program: &Program,
    (about, among): (&[String], &[String]),
    evidence: &Evidence,
) -> Result<(f64, Vec<Observation>), Error> {
    let inputs = program.settings.inputs();
    let setting = Setting::new(program.model(), &inputs)?;
    let (about, among) = (&each_element(&setting, about), &each_element(&setting, among));
    let named: Vec<String> = about.iter().chain(among).cloned().collect();
    if let Some((expanded, _, evidence)) = expanded(program, &named, evidence)? {
        return observations(&expanded, (about, among), &evidence);
    }
    let mut all = Several::new(program, &setting, &inputs, evidence)?;
    let about = all.elements(about)?;
    let mut among = match among.is_empty() {
        false => all.elements(among)?,
        true => {
            let slots = all.shown().flat_map(|id| (0..setting.slots_of(id).len()).map(move |at| (id, at)));
            slots.collect()
        }
    };
    let is_hard = |id: VariableId, at: usize| {
        all.knowledge.elements.hard.iter().any(|(known, element, _)| (*known, *element) == (id, at))
    };
    among.retain(|one| !about.contains(one) && !all.is_observed(one.0) && !is_hard(one.0, one.1));
    let targets = variables(&about);
    let mut asks = vec![all.ask(Statistic::Entropy, &targets)];
    for candidate in variables(&among) {
        let others = targets.iter().copied().filter(|target| *target != candidate);
        let both: Vec<VariableId> = [candidate].into_iter().chain(others).collect();
        asks.push(all.ask(Statistic::Information, &both));
        asks.push(all.ask(Statistic::Entropy, &[candidate]));
    }
    (all.knowledge.elements.about, all.knowledge.elements.among) = (about, among);
    let answers = all.answers(asks, Group::Information)?;
    let number = |row: &Row| row.figure.number().unwrap_or(f64::NAN);
    let entropy = answers[0].answer.first().map_or(0.0, number);
    let mut found = Vec::new();
    for (pair, candidate) in answers[1..].chunks(2).zip(variables(&all.knowledge.elements.among)) {
        // The row of an element has its name; the row of the targets, which may be of the same family, has none.
        let is_named = pair[0].answer.first().is_some_and(|row| !row.values.is_empty());
        let entropies = pair[1].answer.iter().filter(|row| row.values.is_empty() != is_named);
        for (information, entropy) in pair[0].answer.iter().zip(entropies) {
            let named = information.values.first().map(|(name, _)| name.clone());
            let variable = named.unwrap_or_else(|| program.model().variable_name(candidate));
            found.push(Observation { variable, entropy: number(entropy), information: number(information) });
        }
    }
    found.sort_by(|one, other| other.information.total_cmp(&one.information));
    Ok((entropy, found))
}

/// The names of elements: a family, or a vector, stands for all of its own.
fn each_element(setting: &Setting<'_>, names: &[String]) -> Vec<String> {
    let elements = |name: &String| match setting.model.variable(name).map(|id| setting.slots_of(id)) {
        Some(slots) if slots.len() > 1 => slots.map(|slot| setting.slot_name(slot)).collect(),
        _ => vec![name.clone()],
    };
    names.iter().flat_map(elements).collect()
}

/// The variables of some elements, each once.
fn variables(elements: &[(VariableId, usize)]) -> Vec<VariableId> {
    let mut all: Vec<VariableId> = Vec::new();
    for (variable, _) in elements {
        if !all.contains(variable) {
            all.push(*variable);
        }
    }
    all
}

impl<'p> Several<'p> {
    fn new(
        program: &'p Program,
        setting: &'p Setting<'p>,
        inputs: &'p Inputs<'p, f64>,
        evidence: &Evidence,
    ) -> Result<Self, Error> {
        let names = Names { program, setting };
        let knowledge = names.knowledge(evidence)?;
        Ok(Self { names, knowledge, inputs })
    }

    /// The variables that an answer shows.
    fn shown(&self) -> impl Iterator<Item = VariableId> + use<'p> {
        let program = self.names.program;
        let model = program.model();
        let is_shown = move |id: &VariableId| {
            Some(*id) != model.plate_index()
                && !program.opened.known.iter().any(|known| known.variable == *id)
        };
        model.variables.ids().filter(is_shown)
    }

    /// Elements by name; a variable without a family has one element.
    fn elements(&self, names: &[String]) -> Result<Vec<(VariableId, usize)>, Error> {
        let one = |name: &String| self.names.find(name).map(|(variable, at)| (variable, at.unwrap_or(0)));
        names.iter().map(one).collect()
    }

    fn is_observed(&self, id: VariableId) -> bool {
        let mut known = self.knowledge.known.iter();
        known.any(|it| it.variable == id && it.is_whole())
    }

    fn ask(&self, statistic: Statistic, of: &[VariableId]) -> Ask {
        let searched = of.iter().map(|id| Searched { variable: *id, at: None }).collect();
        Ask { statistic, when: When::Now, searched, known: self.knowledge.known.clone() }
    }

    fn answers(&self, asks: Vec<Ask>, group: Group) -> Result<Vec<Answer>, Error> {
        let program = self.names.program;
        let question = Question { name: "group".to_owned(), asks, derived: Vec::new() };
        let options = (program.sampling, Options { group, ..program.options });
        together(program.model(), &question, &self.knowledge.elements, self.inputs, options)
    }

    /// The only assignment, where every variable is observed.
    fn all_observed(&self, evidence: &Evidence) -> Result<Posterior, Error> {
        let program = self.names.program;
        let mode = self.ask(Statistic::Argmax { nearest: None }, &[]);
        let nothing = Row { values: Vec::new(), figure: Figure::LnProbability { ln_p: 0.0 } };
        let ln_p = self.ln_joint(&mode, &nothing)?;
        if ln_p == f64::NEG_INFINITY {
            let names = mode.known.iter().map(|known| program.model().variable_name(known.variable));
            return Err(Error::Impossible(names.collect::<Vec<_>>().join(", ").into()));
        }
        let row = self.assignment(&nothing, ln_p + program.opened.ln_scale);
        let answer = Answer {
            question: format!("argmax {}{}", program.name(), given(program, evidence)),
            ln_evidence: None,
            estimate: None,
            answer: vec![row].into(),
            strategy: Strategy::Sums,
            when: When::Now,
            parts: Vec::new(),
        };
        Ok(Posterior::new(program, answer))
    }

    /// ln of the joint probability of the evidence and of the values in a row, which holds all other variables.
    fn ln_joint(&self, ask: &Ask, row: &Row) -> Result<f64, Error> {
        let (model, setting) = (self.names.program.model(), self.names.setting);
        let mut observed = Observations::of(setting, ask)?;
        let elements = &self.knowledge.elements;
        let slot_of = |id: VariableId, element: usize| setting.slots_of(id).start + element;
        for (id, element, value) in &elements.hard {
            observed.values[slot_of(*id, *element)] = *value as f64;
        }
        for (name, text) in &row.values {
            let (id, element) = self.names.find(name)?;
            let place = slot_of(id, element.unwrap_or(0));
            let slot = Slot::of(setting, place);
            let value = match (slot.count, text.parse::<f64>()) {
                (0, Ok(number)) => Ok(number),
                _ => ordinal(model, &slot, &of_text(model, name, text)).map(|ordinal| ordinal as f64),
            };
            observed.values[place] = value.map_err(|message| Error::input(name, message))?;
        }
        let weighed = elements.weighed.iter().map(|(id, at, weights)| (slot_of(*id, *at), weights));
        let weighed = weighed.chain(observed.likelihoods.iter().map(|(slot, weights)| (*slot, weights)));
        let mut ln: f64 = weighed.map(|(slot, weights)| weights[observed.values[slot] as usize].ln()).sum();
        for instance in setting.ordered()? {
            ln += setting.ln_density(&instance, &observed.values)?;
        }
        Ok(ln)
    }

    /// A value for each shown variable: from the row, or the observed one.
    fn assignment(&self, row: &Row, ln_p: f64) -> Row {
        let (model, setting) = (self.names.program.model(), self.names.setting);
        let found: HashMap<&str, &str> =
            row.values.iter().map(|(name, value)| (name.as_str(), value.as_str())).collect();
        let mut values = Vec::new();
        for id in self.shown() {
            let known = self.knowledge.known.iter().find(|known| known.variable == id);
            for slot in setting.slots_of(id) {
                let name = Slot::of(setting, slot).name(model);
                let value = match (found.get(name.as_str()), known.map(|known| &known.evidence)) {
                    (Some(value), _) => (*value).to_owned(),
                    (None, Some(Finding::Hard(Value::Ordinal(ordinal)))) => model.value_name(id, *ordinal),
                    (None, Some(Finding::Hard(Value::Real(number)))) => exact(*number),
                    _ => continue,
                };
                values.push((name, value));
            }
        }
        Row { values, figure: Figure::LnProbability { ln_p } }
    }
}

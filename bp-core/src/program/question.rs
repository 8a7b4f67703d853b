//! A question, compiled once for repeated use.
//!
//! In: a program and a question. Out: a [`Question`], which takes values and is asked. Invariant: setting a value
//! returns a new question that shares the compiled code.

use super::marginals::check;
use super::settings::{Meaning, meaning, names_of};
use super::{Evidence, Posterior, Program, Value};
use crate::answer::{
    CompiledQuestion, Findings, Observed, ask_over_time_knowing, compile_by, compile_sized, filled, open,
    read_instants,
};
use crate::data::{self, Records};
use crate::distribution::Setting;
use crate::error::Error;
use crate::exec::Inputs;
use crate::ids::VariableId;
use crate::learn::sizes;
use crate::model::{self, Finding};
use std::collections::BTreeSet;
use std::path::Path;
use std::sync::Arc;

/// A prepared question to a program.
///
/// ```
/// # use bp_core::prelude::*;
/// # fn main() -> Result<(), bp_core::Error> {
/// # let grass = Program::parse("program Grass { variables { Rain, Wet : bool; } decomposition { P(Rain) P(Wet | Rain) }
/// #     forms { P(Rain) = bernoulli(0.3); P(Wet | Rain) = bernoulli(if Rain { 0.9 } else { 0.2 }); } }")?;
/// let asked = grass.question("P(Rain | Wet = wet)")?;
/// for wet in [true, false] {
///     println!("{}", asked.given("wet", wet)?.ask()?);
/// }
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug)]
pub struct Question {
    program: Program,
    asked: model::Question,
    compiled: Arc<CompiledQuestion<'static>>,
    given: Vec<(String, VariableId, Vec<f64>)>,
}

impl Question {
    pub(super) fn new(program: &Program, asked: model::Question) -> Result<Self, Error> {
        let (program, asked) = &program.posed(asked);
        let compiled = match program.opened.rows.is_empty() {
            true => compile_by(program.model(), asked, program.options)
                .or_else(|_| compile_sized(program.model(), asked, program.options))?,
            false => compile_sized(program.model(), asked, program.options)?,
        };
        let compiled = Arc::new(compiled.into_owned());
        Ok(Self { program: program.clone(), asked: asked.clone(), compiled, given: Vec::new() })
    }

    /// The question with a value, or a likelihood for each value of a variable: of a name in it (`wet` of `Wet = wet`), of a known variable that it leaves open (`Wet` of
    /// `P(Rain | Wet)`, which compiles the question anew), of a parameter, or of an input. Several values are a list.
    ///
    /// # Errors
    /// The name is unknown to the program and the question; a value outside its range.
    pub fn given(&self, name: &str, value: impl Into<Value>) -> Result<Self, Error> {
        let (model, value) = (self.program.model(), value.into());
        if let Value::Likelihood(weights) = &value {
            return self.weighed(name, weights);
        }
        let mut question = self.clone();
        let mut names = names_of(model, [&*self.compiled])?;
        let free = open(&self.asked).into_iter().find(|id| model.variable_name(*id) == name);
        if let Some(id) = free.filter(|_| !names.contains_key(name)) {
            let known = filled(model, &self.asked, &BTreeSet::from([id]), &BTreeSet::new());
            question = Self { given: self.given.clone(), ..Self::new(&self.program, known)? };
            names.insert(name.to_owned(), Meaning::Value(id));
        }
        match meaning(name, &names)? {
            Meaning::Value(variable) => {
                let values = self.program.settings.values(model, variable, name, &value)?;
                question.given.retain(|(known, ..)| known != name);
                question.given.push((name.to_owned(), variable, values));
            }
            other => question.program = question.program.set(name, &value, other)?,
        }
        Ok(question)
    }

    /// The question with a likelihood for each value of a variable that it leaves open; it is compiled anew.
    fn weighed(&self, name: &str, weights: &[f64]) -> Result<Self, Error> {
        let (model, inputs, mut asked) = (self.program.model(), self.inputs(), self.asked.clone());
        let setting = Setting::new(model, &inputs)?;
        let mut found = false;
        for ask in &mut asked.asks {
            for known in &mut ask.known {
                let is_named = match &known.evidence {
                    Finding::Each => model.variable_name(known.variable) == name,
                    Finding::Hard(model::Value::Given(given)) => given == name,
                    _ => false,
                };
                if is_named {
                    let count = setting.count(known.variable);
                    check(name, weights, count, setting.slots_of(known.variable).len() == 1)?;
                    (known.evidence, found) = (Finding::Virtual(weights.to_vec()), true);
                }
            }
        }
        if !found {
            let message =
                format!("a likelihood is given to a variable that the question leaves open: `P(… | {name})`");
            return Err(Error::input(name, message));
        }
        let given = self.given.iter().filter(|(known, ..)| known != name).cloned().collect();
        Ok(Self { given, ..Self::new(&self.program, asked)? })
    }

    /// Answers it.
    ///
    /// # Errors
    /// An open value was not given; evidence of probability zero; several answers ([`Question::ask_all`]).
    pub fn ask(&self) -> Result<Posterior, Error> {
        one(self.ask_all()?)
    }

    /// Answers it; returns an answer for each ask.
    ///
    /// # Errors
    /// As [`Question::ask`].
    pub fn ask_all(&self) -> Result<Vec<Posterior>, Error> {
        let answers = self.compiled.ask_filled(&self.inputs(), self.program.sampling)?;
        Ok(answers.into_iter().map(|answer| Posterior::new(&self.program, answer)).collect())
    }

    /// Answers it over time (`filter`, `predict`, `smooth`, `sequence`), given the observations at each instant.
    ///
    /// # Errors
    /// As [`Question::ask`]; it is not over time.
    pub fn over(&self, instants: &[Evidence]) -> Result<Posterior, Error> {
        let (model, settings) = (self.program.model(), &self.program.settings);
        let variables = model.variables_by_name();
        let (mut observed, mut weighed) = (Vec::with_capacity(instants.len()), Vec::new());
        let inputs = self.inputs();
        let setting = Setting::new(model, &inputs)?;
        for (number, evidence) in instants.iter().enumerate() {
            let (mut instant, mut likelihoods) = (Vec::new(), Vec::new());
            for (name, value) in evidence.iter() {
                let plain = name.split('[').next().unwrap_or(name);
                let place = || format!("instant {}, `{name}`", number + 1);
                let id = variables
                    .get(plain)
                    .ok_or_else(|| Error::input(place(), format!("`{}` has no such variable", model.name)))?;
                if let Value::Likelihood(weights) = value {
                    let is_one = name != plain || setting.slots_of(*id).len() == 1;
                    check(&place(), weights, setting.count(*id), is_one)?;
                    likelihoods.push((name.to_owned(), weights.clone()));
                    continue;
                }
                let values = settings.values(model, *id, &place(), value)?;
                let several = values.len() > 1;
                let first = model.variables[*id].family.map_or(0, |family| family.over.first());
                let named = |(at, number): (usize, f64)| match several {
                    true => (format!("{name}[{}]", first + at as i64), number),
                    false => (name.to_owned(), number),
                };
                // An element that is missing is not observed.
                let known = values.into_iter().enumerate().filter(|(_, number)| !number.is_nan());
                instant.extend(known.map(named));
            }
            if let Some((name, _)) =
                likelihoods.iter().find(|(name, _)| instant.iter().any(|(own, _)| own == name))
            {
                let message = format!("`{name}` is known twice");
                return Err(Error::input(format!("instant {}", number + 1), message));
            }
            observed.push(instant);
            weighed.push(likelihoods);
        }
        let findings = Findings { instants: weighed, ..Findings::default() };
        self.over_observed((&observed, Some(&findings)), &inputs)
    }

    /// Answers it over time, given a table (CSV) with a row for each instant; an empty cell is not observed.
    ///
    /// # Errors
    /// As [`Question::over`]; a table that cannot be read, or a cell that is not a value of its variable.
    pub fn over_table(&self, path: impl AsRef<Path>) -> Result<Posterior, Error> {
        self.over_records(&data::open(path.as_ref(), None)?)
    }

    /// The same, given a table that has been read.
    ///
    /// # Errors
    /// As [`Question::over_table`].
    pub fn over_records(&self, table: &Records) -> Result<Posterior, Error> {
        let inputs = sizes(self.program.model(), table, self.inputs())?;
        let instants = read_instants(self.program.model(), &self.asked, table, &inputs)?;
        self.over_observed((&instants, None), &inputs)
    }

    fn over_observed(
        &self,
        known: (&[Observed], Option<&Findings>),
        inputs: &Inputs<'_, f64>,
    ) -> Result<Posterior, Error> {
        let (model, sampling) = (self.program.model(), self.program.sampling);
        let by = self.program.options;
        let answers = ask_over_time_knowing(model, &self.asked, known, inputs, sampling, by)?;
        one(answers.into_iter().map(|answer| Posterior::new(&self.program, answer)).collect())
    }

    /// The settings of the program and of the question.
    fn inputs(&self) -> Inputs<'_, f64> {
        let settings = &self.program.settings;
        let mut inputs = settings.inputs();
        for (name, variable, values) in &self.given {
            inputs = inputs.array(name, values);
            if let Some((name, size)) = settings.size_by_values(self.program.model(), *variable, values.len())
            {
                inputs = inputs.size(&name, size).number(&name, size as f64);
            }
        }
        inputs
    }
}

/// The only answer.
fn one(mut answers: Vec<Posterior>) -> Result<Posterior, Error> {
    match (answers.pop(), answers.len()) {
        (Some(answer), 0) => Ok(answer),
        (last, _) => {
            let texts = answers.iter().chain(&last).map(|answer| format!("`{}`", answer.question()));
            let texts: Vec<String> = texts.collect();
            let message = format!("it asks several questions: `ask_all` returns {}", texts.join(", "));
            Err(Error::input("question", message))
        }
    }
}

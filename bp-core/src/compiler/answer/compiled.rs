//! Questions that are compiled once and asked repeatedly with different values.
//!
//! In: a model and a question. Out: a [`CompiledQuestion`], which gives [`Answer`]s or whole [`Table`]s. Invariant:
//! everything that does not depend on the inputs (plan, kernels, schedules) is made once; answers are located by
//! [`Place`].

use super::elements::{Elements, posed_with_constants};
use super::instants::after_each;
use super::{Answer, link, soft};
use crate::door::Advice;
use crate::error::Error;
use crate::exec::Inputs;
use crate::ids::VariableId;
use crate::kernel::Kernel;
use crate::model::{Ask, Finding, Known, Model, Question, Statistic};
use crate::plan::{self, Group, Options, Place, Plan, Strategy};
use crate::posterior::{Part, Reader, Table, check, compare, will_fit};
use crate::sample::Sampling;
use crate::strategies::{Case, Findings, Found, Observed, Prepared, Purpose, gaussian, sums};
use std::borrow::Cow;
use std::sync::Arc;

/// A compiled question.
#[derive(Clone, Debug)]
pub struct CompiledQuestion<'m> {
    model: Cow<'m, Model>,
    question: Question,
    /// Each ask, as a user would type it.
    texts: Vec<String>,
    routes: Arc<Vec<Box<dyn Prepared>>>,
    pub(super) strategies: Vec<Strategy>,
    /// The parts of each ask.
    places: Vec<Vec<Place>>,
    /// Whether families are expanded into single variables.
    pub(super) elements: Elements,
    /// The options of its plan.
    pub(super) options: Options,
    /// The known variables of which each value is answered alone, where no table has all.
    pub(super) contexts: Vec<VariableId>,
}

/// Compiles a question of a model.
///
/// # Errors
/// No route answers it; a subroutine that cannot be answered.
pub fn compile<'m>(model: &'m Model, question: &Question) -> Result<CompiledQuestion<'m>, Error> {
    compile_by(model, question, Options::default())
}

/// Compiles a question with options of the planner, such as the strategy that must answer.
///
/// # Errors
/// As [`compile`]; the strategy does not answer it.
pub fn compile_by<'m>(
    model: &'m Model,
    question: &Question,
    options: impl Into<Options>,
) -> Result<CompiledQuestion<'m>, Error> {
    let options = options.into();
    let (model, question) = posed_with_constants(link(model)?, question);
    let elements = Elements::of(&model, &question, options.by);
    match elements {
        Elements::Apart => Ok(later(model, question, elements, options)),
        Elements::Together | Elements::IfExact => together(model, question, options),
    }
}

/// Compiles a question as [`compile_by`]; where no strategy answers it without sizes, or only by draws, it is planned when it is
/// asked, with its families expanded to the elements that they then have.
///
/// # Errors
/// As [`compile_by`], where the program has no families.
pub fn compile_sized<'m>(
    model: &'m Model,
    question: &Question,
    options: Options,
) -> Result<CompiledQuestion<'m>, Error> {
    let families = model.variables.values().any(|variable| variable.family.is_some());
    let over_time = question.asks.iter().any(|ask| ask.when.is_over_time());
    let compiled = compile_by(model, question, options);
    if !families || over_time || model.plate.is_some() {
        return compiled;
    }
    match compiled {
        Err(Error::Unplanned { .. } | Error::Refused { .. }) => {
            let (model, question) = posed_with_constants(link(model)?, question);
            Ok(later(model, question, Elements::Apart, options))
        }
        Ok(compiled) if options.by.is_none() && options.budget.is_none() && compiled.is_estimated() => {
            Ok(CompiledQuestion { elements: Elements::IfExact, ..compiled })
        }
        compiled => compiled,
    }
}

/// Compiles a question with these options, without expanding families.
pub(super) fn compile_with<'m>(
    model: &'m Model,
    question: &Question,
    options: Options,
) -> Result<CompiledQuestion<'m>, Error> {
    let (model, question) = posed_with_constants(link(model)?, question);
    together(model, question, options)
}

/// A question that is planned when it is asked.
fn later(
    model: Cow<'_, Model>,
    question: Question,
    elements: Elements,
    options: Options,
) -> CompiledQuestion<'_> {
    let (texts, routes, strategies, places) = (Vec::new(), Arc::default(), Vec::new(), Vec::new());
    let contexts = Vec::new();
    CompiledQuestion { model, question, texts, routes, strategies, places, elements, options, contexts }
}

/// Plans and prepares a question.
pub(super) fn together(
    model: Cow<'_, Model>,
    question: Question,
    options: Options,
) -> Result<CompiledQuestion<'_>, Error> {
    let plan = plan::plan_for_answer(&model, &question, options)?;
    let routes = Arc::new(prepare(&model, &plan, options.each)?);
    let strategies = plan.routes.iter().map(|route| route.strategy()).collect();
    let each = question.asks.first().map_or_else(Vec::new, plan::contexts);
    let is_given = plan.question.asks.first().is_some_and(|ask| plan::contexts(ask) != each);
    let contexts = if is_given { each } else { Vec::new() };
    let texts = question.asks.iter().map(|ask| model.ask_text(ask)).collect();
    let (elements, places) = (Elements::Together, plan.places);
    Ok(CompiledQuestion { model, question, texts, routes, strategies, places, elements, options, contexts })
}

/// Prepares each route of a plan.
fn prepare(model: &Model, plan: &Plan, each: bool) -> Result<Vec<Box<dyn Prepared>>, Error> {
    let mut purposes = vec![Purpose::Shown { each }; plan.routes.len()];
    for (ask, places) in plan.question.asks.iter().zip(&plan.places) {
        if each {
            after_each(model, ask)?;
        }
        let Statistic::Divergence { when, .. } = &ask.statistic else { continue };
        if ask.when.is_over_time() != when.is_over_time() {
            return Err(not_over_time(model, ask));
        }
        let each = ask.when.is_every_instant() || when.is_every_instant();
        places.iter().for_each(|place| purposes[place.route] = Purpose::Compared { each });
    }
    (plan.routes.iter().zip(purposes))
        .map(|(route, purpose)| route.offered().prepare(model, &plan.question, purpose))
        .collect()
}

fn not_over_time(model: &Model, ask: &Ask) -> Error {
    let reason = "it is not asked over time: write `filter P(…)`, `smooth P(…)`".to_owned();
    Error::Unplanned { question: model.ask_text(ask), reason }
}

impl CompiledQuestion<'_> {
    /// The same with its own copy of the model.
    pub fn into_owned(self) -> CompiledQuestion<'static> {
        CompiledQuestion { model: Cow::Owned(self.model.into_owned()), ..self }
    }

    /// The model of the question.
    pub(super) fn model(&self) -> &Model {
        &self.model
    }

    /// Whether it is planned already; otherwise it is planned when it is asked.
    pub(super) fn is_compiled(&self) -> bool {
        !self.routes.is_empty()
    }

    /// Whether some of it is answered by draws.
    pub fn is_estimated(&self) -> bool {
        self.strategies.iter().any(|strategy| !strategy.is_exact())
    }

    /// Whether a strategy answers some of it.
    pub(super) fn is_answered_by(&self, strategy: Strategy) -> bool {
        self.strategies.contains(&strategy)
    }

    /// How it is planned.
    pub(super) fn options(&self) -> Options {
        self.options
    }

    /// The question.
    pub fn question(&self) -> &Question {
        &self.question
    }

    /// The kernels among its prepared routes, whose input names show what can be given.
    pub fn kernels(&self) -> impl Iterator<Item = &Kernel> {
        self.routes.iter().filter_map(|route| route.kernel())
    }

    /// Answers the question for these inputs.
    ///
    /// # Errors
    /// Inputs that are missing or do not fit; evidence of probability zero.
    pub fn ask(&self, inputs: &Inputs<'_, f64>) -> Result<Vec<Answer>, Error> {
        self.ask_with(inputs, Sampling::default())
    }

    /// Answers the question for these inputs; `sampling` sets the number of draws and the seed of estimates.
    ///
    /// # Errors
    /// As [`CompiledQuestion::ask`].
    pub fn ask_with(&self, inputs: &Inputs<'_, f64>, sampling: Sampling) -> Result<Vec<Answer>, Error> {
        if let Some(ask) = self.question.asks.iter().find(|ask| ask.when.is_over_time()) {
            let how = Advice::Instants;
            let message =
                format!("it is asked over time: give the observations, a row for each instant (`{how}`)");
            return Err(Error::input(self.model.ask_text(ask), message));
        }
        let inputs = &self.with_defaults(inputs);
        if let Some(answers) = self.ask_apart(inputs, sampling)? {
            return Ok(answers);
        }
        if let Some(other) = self.where_some_are_missing(inputs) {
            return other?.ask_with(inputs, sampling);
        }
        if !self.contexts.is_empty() {
            return self.in_contexts(inputs, sampling);
        }
        let case = Case { question: &self.question, inputs, instants: &[], sampling, findings: None };
        self.or_by_draws(self.answers(&case), inputs, |drawn| drawn.ask_with(inputs, sampling))
    }

    /// Answers a question over time, given the observations of each instant by name, and perhaps likelihoods.
    ///
    /// # Errors
    /// As [`CompiledQuestion::ask`]; a question that is not over time.
    pub fn ask_over(
        &self,
        (instants, findings): (&[Observed], Option<&Findings>),
        inputs: &Inputs<'_, f64>,
        sampling: Sampling,
    ) -> Result<Vec<Answer>, Error> {
        match self.question.asks.iter().find(|ask| !ask.when.is_over_time()) {
            Some(ask) => Err(not_over_time(&self.model, ask)),
            None => self.answers(&Case { question: &self.question, inputs, instants, sampling, findings }),
        }
    }

    pub(super) fn answers(&self, case: &Case<'_>) -> Result<Vec<Answer>, Error> {
        for (ask, places) in self.question.asks.iter().zip(&self.places) {
            let by_table = matches!(self.strategies[places[0].route], Strategy::Sums | Strategy::JoinTree)
                && self.options.group == Group::Tables
                && !matches!(ask.statistic, Statistic::Divergence { .. });
            if by_table {
                will_fit(&self.model, ask, case.inputs)?;
            }
        }
        let found = self.run(case)?;
        let asks = self.question.asks.iter().zip(&self.texts).zip(&self.places);
        let answers = asks.map(|(asked, places)| self.answer(asked, places, &found, case));
        check::answers(answers.collect::<Result<_, _>>()?)
    }

    /// The whole conditional table of each ask, whatever its statistic.
    ///
    /// # Errors
    /// As [`CompiledQuestion::ask`]; an answer that is not a table.
    pub fn tables(&self, inputs: &Inputs<'_, f64>) -> Result<Vec<Table>, Error> {
        if let Some(tables) = self.tables_apart(inputs)? {
            return Ok(tables);
        }
        if let (false, Some(ask)) = (self.contexts.is_empty(), self.question.asks.first()) {
            return Err(self.no_table(ask, "each context is answered alone"));
        }
        let case = Case {
            question: &self.question,
            inputs,
            instants: &[],
            sampling: Sampling::default(),
            findings: None,
        };
        let found = self.run(&case)?;
        let table = |(ask, places): (&Ask, &Vec<Place>)| {
            if ask.statistic != Statistic::Distribution {
                let word = ask.statistic.word();
                return Err(self.no_table(ask, &format!("`{word}` is computed of a distribution")));
            }
            let (table, _) = self.table(ask, &ask.known, self.found(places[0], &found), inputs)?;
            Ok(Table { question: self.model.ask_text(ask), ..table.into_owned() })
        };
        self.question.asks.iter().zip(&self.places).map(table).collect()
    }

    fn no_table(&self, ask: &Ask, reason: &str) -> Error {
        let reason = format!("{reason}: there is no table of it");
        Error::Unplanned { question: self.model.ask_text(ask), reason }
    }

    /// The results of each route.
    fn run(&self, case: &Case<'_>) -> Result<Vec<Vec<Found>>, Error> {
        check::inputs(&self.model, &self.question, case.inputs)?;
        let judged = |error| self.judged(error, case.inputs);
        self.routes.iter().map(|route| route.run(&self.model, case).map_err(judged)).collect()
    }

    /// Where no draw met the evidence, exact sums may decide whether it is possible.
    fn judged(&self, error: Error, inputs: &Inputs<'_, f64>) -> Error {
        let Error::Unmet { question, .. } = &error else { return error };
        match self.question.asks.iter().find(|ask| self.model.ask_text(ask) == *question) {
            Some(ask) => sums::judged(error, &self.model, ask, inputs),
            None => error,
        }
    }

    fn found<'f>(&self, place: Place, found: &'f [Vec<Found>]) -> &'f Found {
        &found[place.route][self.routes[place.route].place(place.ask)]
    }

    /// The table of an ask, from that of its part; and ln P(evidence), where the evidence is an event.
    fn table<'f>(
        &self,
        ask: &Ask,
        known: &[Known],
        found: &'f Found,
        inputs: &Inputs<'_, f64>,
    ) -> Result<(Cow<'f, Table>, Option<f64>), Error> {
        let is_event = |known: &Known| matches!(known.evidence, Finding::Hard(_) | Finding::Virtual(_));
        if let Found::Table(table, None) = found
            && self.model.plate.is_none()
            && known.iter().any(is_event)
            && ask.searched.iter().all(|searched| searched.at.is_none())
            && table.numbers.iter().all(|p| *p == 0.0)
        {
            // Soft evidence is applied to the answer of the rest.
            let mut ask = ask.clone();
            ask.known.retain(|known| !matches!(known.evidence, Finding::Soft(_)));
            return Err(sums::impossible(&self.model, &ask, inputs));
        }
        match found {
            Found::Normal(..) => Err(self.no_table(ask, "`gaussian` answers with a normal law")),
            Found::Answer(answer) => {
                let by = answer.strategy.name();
                let reason = match answer.strategy {
                    Strategy::Gaussian => format!("`{by}` answers with a normal law"),
                    Strategy::JoinTree => format!("`{by}` answers for each variable alone"),
                    Strategy::Mixture => format!("`{by}` answers with a mixture of normal laws"),
                    Strategy::Conjugate => format!("`{by}` answers with named laws"),
                    _ => format!("`{by}` answers by draws"),
                };
                Err(self.no_table(ask, &reason))
            }
            Found::Table(table, ln_evidence) if !is_soft(known) => Ok((Cow::Borrowed(table), *ln_evidence)),
            // Soft evidence is not an event, so it has no probability.
            Found::Table(table, _) => {
                Ok((Cow::Owned(soft::applied(&self.model, ask, known, table.clone())?), None))
            }
        }
    }

    fn answer(
        &self,
        (ask, text): (&Ask, &String),
        places: &[Place],
        all: &[Vec<Found>],
        case: &Case<'_>,
    ) -> Result<Answer, Error> {
        let found = self.found(places[0], all);
        let compared = matches!(ask.statistic, Statistic::Divergence { .. });
        if let (Found::Answer(answer) | Found::Normal(_, Some(answer)), false) =
            (found, compared || is_soft(&ask.known))
        {
            return Ok(answer.clone());
        }
        if let (Found::Answer(part), false) = (found, compared) {
            return soft::of_reals(&self.model, ask, part, case.sampling.seed);
        }
        let (question, when) = (text.clone(), ask.when);
        let strategy = self.strategies[places[0].route];
        let second = places.get(1).map(|second| self.found(*second, all));
        if let (Found::Normal(laws, _), Some(Found::Normal(from, _))) = (found, second) {
            let (answer, parts) = (gaussian::divergences(laws, from).into(), Vec::new());
            return Ok(Answer { question, ln_evidence: None, estimate: None, answer, strategy, when, parts });
        }
        let (table, ln_evidence) = self.table(ask, &ask.known, found, case.inputs)?;
        if let (Statistic::Divergence { from, .. }, Some(second)) = (&ask.statistic, second) {
            let (second, _) = self.table(ask, from, second, case.inputs)?;
            let answer = compare::divergences(&table, &second).into();
            let parts = Vec::new();
            return Ok(Answer { question, ln_evidence: None, estimate: None, answer, strategy, when, parts });
        }
        let (inputs, seed) = (case.inputs, case.sampling.seed);
        let answer = Reader { model: &self.model, ask, table: &table, inputs, seed }.rows()?;
        let parts = vec![Part::of_table(&self.model, &table)];
        Ok(Answer { question, ln_evidence, estimate: None, answer, strategy, when, parts })
    }
}

fn is_soft(known: &[Known]) -> bool {
    known.iter().any(|known| matches!(known.evidence, Finding::Soft(_)))
}

//! A question that is compiled once and asked again and again with other given values.
//!
//! In: a model and a question. Out: a [`CompiledQuestion`], which gives [`Answer`]s or whole [`Table`]s. Invariant: what
//! does not depend on the inputs (plan, kernels, schedules) is made once.

use super::{Answer, check, link, soft};
use crate::error::Error;
use crate::exec::{Guarded, Inputs, Lanes};
use crate::ids::VariableId;
use crate::kernel::{Kernel, OutputKey};
use crate::lower::{Output, lower_guarded};
use crate::model::{Ask, Evidence, Model, Question, Statistic};
use crate::plan::{self, Mark, Options, Plan, Route, Strategy, parts};
use crate::posterior::{Part as Law, Reader, Table, compare};
use crate::sample::Sampling;
use crate::strategies::gaussian::{self, Gaussian};
use crate::strategies::join_tree::{self as tree, JoinTree};
use crate::strategies::sums;
use crate::strategies::weighting::{self as sampled, Sampled};
use std::borrow::Cow;

/// A question that is ready to be asked.
#[derive(Clone, Debug)]
pub struct CompiledQuestion<'m> {
    model: Cow<'m, Model>,
    question: Question,
    routes: Vec<Compiled>,
    /// The parts of each ask.
    parts: Vec<Vec<Part>>,
}

/// Which ask of which route is asked for the sake of an ask.
#[derive(Clone, Copy, Debug)]
struct Part {
    route: usize,
    place: usize,
    /// Whether it is the ask itself.
    whole: bool,
}

#[derive(Clone, Debug)]
enum Compiled {
    Exact(Exact),
    Tree(JoinTree),
    Gaussian(Gaussian),
    Sampled(Sampled),
    OverTime(Ask),
}

/// Sums and products, ready to run.
#[derive(Clone, Debug)]
struct Exact {
    ln_evidence: bool,
    /// Whether exponents are kept apart from the start.
    log: bool,
    lanes: Lanes,
    outputs: Vec<Output>,
}

impl Compiled {
    /// What it is asked, in the order in which it answers.
    fn asks(&self) -> Vec<&Ask> {
        match self {
            Compiled::Exact(exact) => exact.outputs.iter().filter_map(|output| output.ask.as_ref()).collect(),
            Compiled::Tree(tree) => tree.exact.asks.iter().collect(),
            Compiled::Gaussian(gaussian) => gaussian.asks.iter().collect(),
            Compiled::Sampled(sampled) => sampled.asks.iter().collect(),
            Compiled::OverTime(ask) => vec![ask],
        }
    }
}

/// What a route says of one of its asks.
enum Said {
    Table(Table, Option<f64>),
    Answer(Answer),
}

/// What each route says of each of its asks.
type AllSaid = Vec<Vec<Said>>;

/// How a question to a model is planned when one wants to see the answer: with ln P(evidence) where the
/// evidence is one event.
///
/// # Errors
/// See [`plan::plan`].
pub fn plan_for_answer(model: &Model, question: &Question) -> Result<Plan, Error> {
    plan_for_answer_by(model, question, None)
}

fn plan_for_answer_by(model: &Model, question: &Question, by: Option<Strategy>) -> Result<Plan, Error> {
    let finite = |variable: VariableId| model.variables[variable].domain.is_finite();
    // The density of a real is told without ln P(evidence), for which it would have to be integrated.
    let event = |ask: &Ask| {
        ask.known.iter().all(|known| !matches!(known.evidence, Evidence::Each))
            && ask.searched.iter().all(|item| finite(item.variable) || item.at.is_none())
    };
    let asks = question.asks.iter().flat_map(|ask| parts(model, ask));
    let (events, tables): (Vec<Ask>, Vec<Ask>) = asks.partition(event);
    let (mut routes, mut offers) = (Vec::new(), Vec::new());
    for (asks, ln_evidence) in [(events, model.plate.is_none()), (tables, false)] {
        let part = Question { name: question.name.clone(), asks };
        let plan = plan::plan(model, &part, Options { ln_evidence, by, ..Options::default() })?;
        routes.extend(plan.routes);
        offers.extend(plan.offers);
    }
    Ok(Plan { question: question.clone(), routes, offers })
}

/// Compiles a question to a model.
///
/// # Errors
/// No route answers it; a subroutine that cannot be answered.
pub fn compile<'m>(model: &'m Model, question: &Question) -> Result<CompiledQuestion<'m>, Error> {
    compile_by(model, question, None)
}

/// Compiles a question that one strategy is to answer.
///
/// # Errors
/// As [`compile`]; the strategy does not answer it.
pub fn compile_by<'m>(
    model: &'m Model,
    question: &Question,
    by: Option<Strategy>,
) -> Result<CompiledQuestion<'m>, Error> {
    let model = link(model)?;
    let mut routes = Vec::new();
    for route in plan_for_answer_by(&model, question, by)?.routes {
        routes.push(match route {
            Route::Exact(mut exact) => {
                as_tables(&mut exact.asks);
                let lowered = lower_guarded(&model, &exact, &question.name)?;
                Compiled::Exact(Exact {
                    ln_evidence: exact.ln_evidence,
                    log: exact.mark(&model) == Mark::Log || question.asks.iter().any(compares),
                    lanes: Lanes::new(lowered.kernel),
                    outputs: lowered.outputs,
                })
            }
            Route::Tree(tree) => Compiled::Tree(tree),
            Route::Gaussian(gaussian) => Compiled::Gaussian(gaussian),
            Route::Sampled(sampled) => Compiled::Sampled(sampled),
            Route::OverTime(over_time) => Compiled::OverTime(over_time.ask),
        });
    }
    let exact = |route: &Compiled| matches!(route, Compiled::Exact(_));
    let tables = routes.iter().all(exact);
    let part = |ask: &Ask, part: &Ask| {
        let of_table = part.statistic == Statistic::Entropy && tables;
        let wanted = if of_table { &as_table(part) } else { part };
        let mut places = routes.iter().enumerate().filter_map(|(route, compiled)| {
            Some((route, compiled.asks().into_iter().position(|own| own == wanted)?))
        });
        let (route, place) = places.next().expect("internal: every part is planned");
        Part { route, place, whole: part == ask && !of_table }
    };
    let parts = (question.asks.iter())
        .map(|ask| plan::parts(&model, ask).iter().map(|own| part(ask, own)).collect())
        .collect();
    Ok(CompiledQuestion { model, question: question.clone(), routes, parts })
}

/// Whether the host divides by probabilities that may be tiny: they are then wanted with exponents apart.
fn compares(ask: &Ask) -> bool {
    matches!(ask.statistic, Statistic::Divergence { .. })
        || ask.known.iter().any(|known| matches!(known.evidence, Evidence::Soft(_)))
}

/// Entropies are made of whole tables, which say what context is impossible.
fn as_tables(asks: &mut Vec<Ask>) {
    for ask in std::mem::take(asks) {
        let ask = if ask.statistic == Statistic::Entropy { as_table(&ask) } else { ask };
        if !asks.contains(&ask) {
            asks.push(ask);
        }
    }
}

fn as_table(ask: &Ask) -> Ask {
    Ask { statistic: Statistic::Distribution, ..ask.clone() }
}

impl CompiledQuestion<'_> {
    /// The same with a model of its own.
    pub fn into_owned(self) -> CompiledQuestion<'static> {
        CompiledQuestion { model: Cow::Owned(self.model.into_owned()), ..self }
    }

    /// The model that it is asked of.
    pub(super) fn model(&self) -> &Model {
        &self.model
    }

    /// The question.
    pub fn question(&self) -> &Question {
        &self.question
    }

    /// The kernels that answer it, as far as kernels do: their inputs can be given.
    pub fn kernels(&self) -> impl Iterator<Item = &Kernel> {
        self.routes.iter().filter_map(|route| match route {
            Compiled::Exact(exact) => Some(exact.lanes.kernel()),
            _ => None,
        })
    }

    /// Asks it.
    ///
    /// # Errors
    /// Inputs that are missing or do not fit; evidence of probability zero.
    pub fn ask(&self, inputs: &Inputs<'_, f64>) -> Result<Vec<Answer>, Error> {
        self.ask_with(inputs, Sampling::default())
    }

    /// Asks it; what has no exact answer is estimated, and what is drawn is drawn, as `sampling` says.
    ///
    /// # Errors
    /// As [`CompiledQuestion::ask`].
    pub fn ask_with(&self, inputs: &Inputs<'_, f64>, sampling: Sampling) -> Result<Vec<Answer>, Error> {
        let said = self.run(inputs, sampling)?;
        let asks = self.question.asks.iter().zip(&self.parts);
        let answers = asks.map(|(ask, parts)| self.answer(ask, parts, &said, inputs, sampling));
        check::answers(answers.collect::<Result<_, _>>()?)
    }

    /// The whole conditional table of each thing asked, whatever is made of it otherwise.
    ///
    /// # Errors
    /// As [`CompiledQuestion::ask`]; an answer that is no table.
    pub fn tables(&self, inputs: &Inputs<'_, f64>) -> Result<Vec<Table>, Error> {
        let said = self.run(inputs, Sampling::default())?;
        let table = |(ask, parts): (&Ask, &Vec<Part>)| {
            if let Statistic::Entropy | Statistic::Divergence { .. } = ask.statistic {
                let word = ask.statistic.word();
                return Err(self.no_table(ask, &format!("`{word}` makes one number of a distribution")));
            }
            let (table, _) = self.table(ask, &ask.known, parts[0], &said)?;
            Ok(Table { question: self.model.ask_text(ask), ..table.into_owned() })
        };
        self.question.asks.iter().zip(&self.parts).map(table).collect()
    }

    fn no_table(&self, ask: &Ask, reason: &str) -> Error {
        let reason = format!("{reason}: there is no table of it");
        Error::Unplanned { question: self.model.ask_text(ask), reason }
    }

    /// What each route says of each of its asks.
    fn run(&self, inputs: &Inputs<'_, f64>, sampling: Sampling) -> Result<AllSaid, Error> {
        let model = &self.model;
        check::inputs(model, &self.question, inputs)?;
        let mut said = Vec::new();
        for route in &self.routes {
            let answers = match route {
                Compiled::Gaussian(gaussian) => gaussian::answers(model, gaussian, inputs)?,
                Compiled::Sampled(sampled) => sampled::answers(model, sampled, inputs, sampling)?,
                Compiled::OverTime(ask) => {
                    let message = "it is asked over time: give what was observed, a row for each instant (`--data FILE`)";
                    return Err(Error::input(model.ask_text(ask), message));
                }
                Compiled::Tree(route) => {
                    let tables = tree::tables(model, route, inputs)?.into_iter();
                    said.push(tables.map(|(table, ln)| Said::Table(table, ln)).collect());
                    continue;
                }
                Compiled::Exact(exact) => {
                    said.push(self.run_exact(exact, inputs)?);
                    continue;
                }
            };
            said.push(answers.into_iter().map(Said::Answer).collect());
        }
        Ok(said)
    }

    fn run_exact(&self, exact: &Exact, inputs: &Inputs<'_, f64>) -> Result<Vec<Said>, Error> {
        let Guarded { mut outputs, mut extended, extents } = exact.lanes.run_guarded(inputs, exact.log)?;
        let ln_evidence = exact.ln_evidence.then(|| outputs.get(OutputKey::LnEvidence)[0]);
        let mut said = Vec::new();
        for output in &exact.outputs {
            let Some(ask) = &output.ask else { continue };
            let own = outputs.arrays.iter().position(|(key, _)| *key == output.key);
            let own = own.expect("internal: the output exists");
            let cells = std::mem::take(&mut outputs.arrays[own].1);
            let number = |cell: &f64| *cell >= 0.0 && cell.is_finite();
            if !cells.iter().all(number) || ln_evidence.is_some_and(|ln| ln.is_nan() || ln == f64::INFINITY) {
                return Err(check::not_a_number(&self.model, ask, inputs));
            }
            if ln_evidence == Some(f64::NEG_INFINITY) {
                return Err(sums::impossible(&self.model, ask, inputs));
            }
            let extended = extended.as_mut().map(|all| std::mem::take(&mut all.arrays[own].1));
            let table = Table::read(&self.model, ask, &output.variables, cells, extended, &extents[own]);
            said.push(Said::Table(table, ln_evidence));
        }
        Ok(said)
    }

    /// The table that an ask means, of that of its part; and ln P(evidence), where the evidence is an event.
    fn table<'s>(
        &self,
        ask: &Ask,
        known: &[crate::model::Known],
        part: Part,
        said: &'s AllSaid,
    ) -> Result<(Cow<'s, Table>, Option<f64>), Error> {
        match &said[part.route][part.place] {
            Said::Answer(_) => Err(self.no_table(ask, "it is not answered by sums over finite values")),
            Said::Table(table, ln_evidence) => {
                let soft = known.iter().any(|known| matches!(known.evidence, Evidence::Soft(_)));
                if !soft {
                    return Ok((Cow::Borrowed(table), *ln_evidence));
                }
                // What is believed softly is no event.
                Ok((Cow::Owned(soft::applied(&self.model, ask, known, table.clone())?), None))
            }
        }
    }

    fn answer(
        &self,
        ask: &Ask,
        parts: &[Part],
        said: &AllSaid,
        inputs: &Inputs<'_, f64>,
        sampling: Sampling,
    ) -> Result<Answer, Error> {
        let question = self.model.ask_text(ask);
        if let (Said::Answer(answer), true) = (&said[parts[0].route][parts[0].place], parts[0].whole) {
            return Ok(answer.clone());
        }
        let (table, ln_evidence) = self.table(ask, &ask.known, parts[0], said)?;
        let strategy = match self.routes[parts[0].route] {
            Compiled::Tree(_) => Strategy::JoinTree,
            _ => Strategy::Sums,
        };
        if let (Statistic::Divergence { from, .. }, Some(second)) = (&ask.statistic, parts.get(1)) {
            let (second, _) = self.table(ask, from, *second, said)?;
            let answer = compare::divergences(&table, &second);
            let (parts, when) = (Vec::new(), ask.when);
            return Ok(Answer { question, ln_evidence: None, estimate: None, answer, strategy, when, parts });
        }
        let seed = sampling.seed;
        let answer = Reader { model: &self.model, ask, table: &table, inputs, seed }.rows()?;
        let parts = vec![Law::of_table(&self.model, &table)];
        let when = ask.when;
        Ok(Answer { question, ln_evidence, estimate: None, answer, strategy, when, parts })
    }
}

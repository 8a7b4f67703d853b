//! The posterior marginal of each variable: one question for each, all with the same evidence.
//!
//! In: a model, the wanted variables, and the evidence. Out: an [`Answer`] with a part for each variable or element.
//! Invariant: an observed variable has probability 1 at its value; one plan answers all, by the strategy that the
//! planner chooses.

use super::compiled::compile_with;
use super::{Answer, Part, PartLaw, Slot};
use crate::distribution::Setting;
use crate::error::Error;
use crate::exec::Inputs;
use crate::ids::VariableId;
use crate::law::{Law, Numbers};
use crate::model::{Ask, Finding, Known, Model, Question, Searched, Statistic, Value, When};
use crate::plan::{self, Group, Options, Strategy};
use crate::sample::Sampling;
use crate::strategies::{Case, Findings};

/// The evidence of all marginals.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Knowledge {
    /// Whole variables.
    pub known: Vec<Known>,
    /// Elements of families.
    pub elements: Findings,
}

impl Knowledge {
    /// Whether there is evidence on a variable, or on this element of it.
    pub(crate) fn holds(&self, variable: VariableId, element: Option<usize>) -> bool {
        let is_this =
            |id: VariableId, at: usize| id == variable && element.is_none_or(|element| element == at);
        self.known.iter().any(|known| known.variable == variable)
            || self.elements.hard.iter().any(|(id, at, _)| is_this(*id, *at))
            || self.elements.weighed.iter().any(|(id, at, _)| is_this(*id, *at))
    }

    /// Knows a component of a vector of this length, whose other components may be unknown (NaN); false where it is known already.
    pub(crate) fn know_component(
        &mut self,
        variable: VariableId,
        (component, number): (usize, f64),
        length: usize,
    ) -> bool {
        let own = self.known.iter_mut().find(|known| known.variable == variable);
        match own.map(|known| &mut known.evidence) {
            Some(Finding::Hard(Value::Vector(numbers))) if numbers[component].is_nan() => {
                numbers[component] = number;
                true
            }
            Some(_) => false,
            None => {
                let mut numbers = vec![f64::NAN; length];
                numbers[component] = number;
                self.known.push(Known { variable, evidence: Finding::Hard(Value::Vector(numbers)) });
                true
            }
        }
    }

    /// Whether there is no evidence.
    pub(crate) fn is_empty(&self) -> bool {
        self.known.is_empty() && self.elements.hard.is_empty() && self.elements.weighed.is_empty()
    }

    /// ln P(evidence) of an answer. A normal law is proper: without evidence it has probability 1.
    pub(crate) fn ln_evidence(&self, answer: &Answer) -> Option<f64> {
        let nothing = self.is_empty() && answer.strategy == Strategy::Gaussian;
        answer.ln_evidence.or(nothing.then_some(0.0))
    }
}

/// The posterior of each wanted variable.
///
/// # Errors
/// As [`ask`](super::ask).
pub fn marginals(
    model: &Model,
    wanted: &[VariableId],
    knowledge: &Knowledge,
    inputs: &Inputs<'_, f64>,
    (sampling, options): (Sampling, Options),
) -> Result<Answer, Error> {
    let asked = Asked::new(wanted, knowledge);
    let question = asked.question(knowledge, &|known| known.evidence.clone());
    let options = Options { group: Group::Marginals, ..options };
    let answers = together(model, &question, &knowledge.elements, inputs, (sampling, options))?;
    asked.answer(model, (wanted, knowledge), inputs, answers)
}

/// What is asked for the marginals of some variables: a question for each that is not observed.
pub(super) struct Asked {
    searched: Vec<VariableId>,
    /// The observation that is asked too, where all variables are observed: P(evidence) is P(all but the last observation) times
    /// the posterior probability of the last.
    last: Option<usize>,
}

impl Asked {
    pub(super) fn new(wanted: &[VariableId], knowledge: &Knowledge) -> Self {
        let known = &knowledge.known;
        let observed = |id: &VariableId| known.iter().any(|it| it.variable == *id && it.is_whole());
        let mut searched: Vec<VariableId> = wanted.iter().copied().filter(|id| !observed(id)).collect();
        // A finite one, where there is one: its posterior is a table in every strategy.
        let is_hard = |known: &Known| matches!(known.evidence, Finding::Hard(_));
        let place = |is: &dyn Fn(&Known) -> bool| known.iter().rposition(is);
        let last = || place(&|known| ordinal(known).is_some()).or_else(|| place(&is_hard));
        let last = if searched.is_empty() { last() } else { None };
        searched.extend(last.map(|at| known[at].variable));
        Self { searched, last }
    }

    /// The observations that are known to the question.
    fn known<'k>(&self, knowledge: &'k Knowledge) -> impl Iterator<Item = &'k Known> {
        let last = self.last;
        knowledge.known.iter().enumerate().filter(move |(at, _)| Some(*at) != last).map(|(_, known)| known)
    }

    fn ask(&self, variable: VariableId, known: &[Known]) -> Ask {
        Ask {
            statistic: Statistic::Distribution,
            when: When::Now,
            searched: vec![Searched { variable, at: None }],
            known: known.to_vec(),
        }
    }

    /// The question, with this evidence of each observation.
    pub(super) fn question(&self, knowledge: &Knowledge, evidence: &dyn Fn(&Known) -> Finding) -> Question {
        let known = |known: &Known| Known { variable: known.variable, evidence: evidence(known) };
        let known: Vec<Known> = self.known(knowledge).map(known).collect();
        Question {
            name: "marginals".to_owned(),
            asks: self.searched.iter().map(|id| self.ask(*id, &known)).collect(),
            derived: Vec::new(),
        }
    }

    /// The answers as one: a part for each wanted variable or element.
    ///
    /// # Errors
    /// The evidence is impossible.
    pub(super) fn answer(
        &self,
        model: &Model,
        (wanted, knowledge): (&[VariableId], &Knowledge),
        inputs: &Inputs<'_, f64>,
        mut answers: Vec<Answer>,
    ) -> Result<Answer, Error> {
        let observed = |id: &VariableId| knowledge.known.iter().any(|it| it.variable == *id && it.is_whole());
        // The components of a vector that are known are not shown.
        let is_shown = |slot: &Slot| {
            let own = knowledge.known.iter().find(|known| known.variable == slot.variable);
            match own.map(|known| &known.evidence) {
                Some(Finding::Hard(Value::Vector(numbers))) => {
                    slot.index.is_none_or(|component| numbers[component as usize].is_nan())
                }
                _ => true,
            }
        };
        // Some may be exact where others are estimated.
        let (exact, drawn): (Vec<&Answer>, Vec<&Answer>) =
            answers.iter().partition(|answer| answer.estimate.is_none());
        let mut all = Answer {
            question: String::new(),
            ln_evidence: exact.iter().chain(&drawn).find_map(|answer| knowledge.ln_evidence(answer)),
            estimate: drawn.first().and_then(|answer| answer.estimate.clone()),
            answer: Vec::new().into(),
            strategy: drawn.first().or(exact.first()).map_or(Strategy::JoinTree, |answer| answer.strategy),
            when: When::Now,
            parts: Vec::new(),
        };
        let setting = Setting::new(model, inputs)?;
        if let Some(last) = self.last.map(|at| &knowledge.known[at]) {
            let ln = answers.pop().and_then(|answer| ln_of(last, &answer));
            let nothing = self.known(knowledge).next().is_none();
            all.ln_evidence = all.ln_evidence.or(nothing.then_some(0.0)).zip(ln).map(|(one, two)| one + two);
            if all.ln_evidence == Some(f64::NEG_INFINITY) {
                let known = self.known(knowledge).chain([last]);
                let heads: Vec<String> = known.map(|known| model.variable_name(known.variable)).collect();
                return Err(Error::Impossible(heads.join(", ").into()));
            }
        }
        let (mut answers, mut rows) = (answers.into_iter(), Vec::new());
        for id in wanted {
            match observed(id) {
                false => {
                    let answer = answers.next().expect("internal: each variable is asked");
                    let parts = answer.parts.iter().flat_map(each);
                    let mut parts: Vec<Part> = parts.collect();
                    let whole = parts.len() == answer.parts.len();
                    let all_shown = parts.iter().flat_map(|part| &part.of).all(is_shown);
                    parts.retain(|part| part.of.iter().all(is_shown));
                    match whole && all_shown {
                        true => rows.extend(answer.answer.iter().cloned()),
                        false => rows.extend(parts.iter().flat_map(|part| part.rows(model))),
                    }
                    all.parts.extend(parts);
                }
                true => {
                    let known = knowledge.known.iter().find(|known| known.variable == *id);
                    for part in known.into_iter().flat_map(|known| certain(&setting, known)) {
                        rows.extend(part.rows(model));
                        all.parts.push(part);
                    }
                }
            }
        }
        all.answer = rows.into();
        Ok(all)
    }
}

/// The question for the marginal of each variable, without evidence.
fn of_each_variable(model: &Model) -> Question {
    let ask = |variable: VariableId| Ask {
        statistic: Statistic::Distribution,
        when: When::Now,
        searched: vec![Searched { variable, at: None }],
        known: Vec::new(),
    };
    let asks = model.variables.ids().map(ask).collect();
    Question { name: "marginals".to_owned(), asks, derived: Vec::new() }
}

/// The strategy that the planner takes for the marginals of all variables together.
///
/// # Errors
/// No strategy answers them.
pub(crate) fn marginals_strategy(model: &Model, options: Options) -> Result<Strategy, Error> {
    let elements = model.variables.values().any(|variable| variable.family.is_some());
    let options = Options { group: Group::Marginals, elements, ..options };
    let plan = plan::plan(model, &of_each_variable(model), options)?;
    Ok(plan.routes.first().map_or(Strategy::JoinTree, |route| route.strategy()))
}

/// The answers of asks with the same evidence, which may include single elements of families.
///
/// # Errors
/// As [`ask`](super::ask).
pub fn together(
    model: &Model,
    question: &Question,
    findings: &Findings,
    inputs: &Inputs<'_, f64>,
    (sampling, options): (Sampling, Options),
) -> Result<Vec<Answer>, Error> {
    check(model, question)?;
    let options = Options { elements: findings.are_elements(model), ..options };
    let compiled = compile_with(model, question, options)?;
    compiled.answers_or_draws(&Case { question, inputs, instants: &[], sampling, findings: Some(findings) })
}

/// Refuses evidence that no question may have. A variable with a likelihood remains a variable to be answered.
pub(super) fn check(model: &Model, question: &Question) -> Result<(), Error> {
    let weighed = |ask: &Ask| {
        ask.known.iter().any(|known| ask.searched.iter().any(|item| item.variable == known.variable))
    };
    let asks: Vec<Ask> = question.asks.iter().filter(|ask| !weighed(ask)).take(1).cloned().collect();
    if asks.is_empty() {
        return Ok(());
    }
    let faults = model.question_faults(&Question { name: question.name.clone(), asks, derived: Vec::new() });
    faults.first().map_or(Ok(()), |fault| {
        let question = model.ask_text(&question.asks[0]);
        Err(Error::Unplanned { question, reason: fault.message.clone() })
    })
}

/// The distribution of each slot of a part alone.
fn each(part: &Part) -> Vec<Part> {
    (0..part.of.len()).map(|place| part.marginal(&[place])).collect()
}

/// The ordinal of an observed value.
fn ordinal(known: &Known) -> Option<usize> {
    match known.evidence {
        Finding::Hard(Value::Ordinal(ordinal)) => Some(ordinal),
        _ => None,
    }
}

/// The distribution of an observed variable, concentrated at its value; a real has none.
fn certain(setting: &Setting<'_>, known: &Known) -> Vec<Part> {
    let Some(ordinal) = ordinal(known) else { return Vec::new() };
    let part = |slot: usize| {
        let slot = Slot::of(setting, slot);
        let law = (0..slot.count).map(|value| f64::from(u8::from(value == ordinal))).collect();
        Part { instant: None, given: Vec::new(), of: vec![slot], law: PartLaw::Finite(law) }
    };
    setting.slots_of(known.variable).map(part).collect()
}

/// ln of the probability, or density, of an observation in an answer.
fn ln_of(known: &Known, answer: &Answer) -> Option<f64> {
    let part = answer.parts.first()?;
    match (&part.law, &known.evidence) {
        (PartLaw::Finite(p), _) => p.get(ordinal(known)?).map(|p| p.ln()),
        (PartLaw::Normal { mean, covariance }, Finding::Hard(Value::Real(value))) => {
            Some(Law::Normal.ln_density(&mut Numbers, *value, &[*mean.first()?, covariance.first()?.sqrt()]))
        }
        (PartLaw::Draws(..), _) => part.probabilities()?.get(ordinal(known)?).map(|p| p.ln()),
        (law, Finding::Hard(Value::Real(value))) => {
            Some(law.density(&[*value])).filter(|density| *density > 0.0).map(f64::ln)
        }
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ids::Id;
    use crate::model::{Domain, Form, ModelBuilder};
    use crate::strategies::join_tree::propagations;

    /// A Markov chain of booleans, each equal to its predecessor with probability 3/4.
    fn chain(length: usize) -> Model {
        let mut model = ModelBuilder::new("Chain");
        let ids: Vec<VariableId> =
            (0..length).map(|number| model.variable(&format!("X{number}"), Domain::Boolean)).collect();
        model.factor([ids[0]], [], Form::Constants(vec![0.5, 0.5]));
        for pair in ids.windows(2) {
            model.factor([pair[1]], [pair[0]], Form::Constants(vec![0.75, 0.25, 0.25, 0.75]));
        }
        model.build().expect("a chain")
    }

    #[test]
    fn one_propagation_answers_all_that_know_the_same() {
        let model = chain(14);
        let all: Vec<VariableId> = model.variables.ids().collect();
        let last = Known { variable: all[13], evidence: Finding::Hard(Value::Ordinal(1)) };
        let knowledge = Knowledge { known: vec![last], ..Knowledge::default() };
        let before = propagations();
        let by = (Sampling::default(), Options::default());
        let found = marginals(&model, &all, &knowledge, &Inputs::new(), by).unwrap();
        assert_eq!((found.strategy, propagations() - before), (Strategy::JoinTree, 1));
        assert_eq!(found.parts.len(), 14);
        // P(X_k = X_13) = (1 + (3/4 - 1/4)^(13 - k)) / 2, and P(X_13) = 1/2.
        for (part, id) in found.parts.iter().zip(&all) {
            let p = part.probabilities().unwrap()[1];
            let expected = (1.0 + 0.5f64.powi(13 - id.position() as i32)) / 2.0;
            assert!((p - expected).abs() < 1e-15, "{p} {expected}");
        }
        assert!((found.ln_evidence.unwrap() - 0.5f64.ln()).abs() < 1e-15);
    }

    #[test]
    fn strategies_agree_and_all_may_be_observed() {
        let model = chain(3);
        let all: Vec<VariableId> = model.variables.ids().collect();
        let known = |ordinals: &[usize]| Knowledge {
            known: (all.iter().rev().zip(ordinals))
                .map(|(id, at)| Known { variable: *id, evidence: Finding::Hard(Value::Ordinal(*at)) })
                .collect(),
            ..Knowledge::default()
        };
        for by in [Strategy::Sums, Strategy::JoinTree] {
            let ask = |knowledge: &Knowledge| {
                marginals(
                    &model,
                    &all,
                    knowledge,
                    &Inputs::new(),
                    (Sampling::default(), Options::from(Some(by))),
                )
                .unwrap()
            };
            let one = ask(&known(&[1]));
            // (1 + 1/4) / 2 and (1 + 1/2) / 2.
            let p: Vec<f64> = one.parts.iter().map(|part| part.probabilities().unwrap()[1]).collect();
            assert!((p[0] - 0.625).abs() < 1e-15 && (p[1] - 0.75).abs() < 1e-15 && p[2] == 1.0, "{p:?}");
            // 1/2 · 1/4 · 3/4.
            let every = ask(&known(&[1, 1, 0]));
            assert!((every.ln_evidence.unwrap() - 0.09375f64.ln()).abs() < 1e-14);
        }
    }
}

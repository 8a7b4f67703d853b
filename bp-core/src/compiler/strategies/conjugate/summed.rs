//! Unknowns with conjugate priors given finite variables, which are summed out: a change-point, a hidden class.
//!
//! In: a program whose unknowns have conjugate priors once its finite variables have values. Out: the distribution of the finite
//! variables, and of the unknowns as mixtures of named distributions. Invariant: every combination of values of the finite variables
//! is one component.
//!
//! P(d, x | y) = Σ_d w_d p(x | d, y),  w_d ∝ P(d) p(y | d), both factors in closed form.

use super::answer::{Posterior, truth_cells};
use super::offer::{
    Conjugate, NO_PRIOR, conjugate_faults, dependent_draws, dependent_values, element_of, is_observed,
    kind_among, parted, predicate_of,
};
use crate::analysis::{of_form, relevant_factors};
use crate::distribution::{LnTerms, Setting, ln_terms, ln_weights};
use crate::door::Advice;
use crate::equation::{CLOSE, Line, Notation, OPEN, Strategy};
use crate::error::{Error, Impossible};
use crate::ids::{ExpressionId, FactorId, VariableId};
use crate::model::{Ask, Finding, Known, Model, Question, Statistic};
use crate::posterior::{
    Answer, NamedComponent, NamedMixture, Part, PartLaw, Slot, Table, refused_of_reals, refused_values,
};
use crate::radix;
use crate::sample::Observations;
use crate::strategies::{Case, Found, Offered, Prepared, Purpose};
use rayon::prelude::*;

/// The most combinations of values.
const MOST_COMBINATIONS: f64 = 131_072.0;

/// The cost of a variable whose number of values is not known yet.
const UNKNOWN_COUNT: f64 = 16.0;

/// An answer by conjugate priors given finite variables.
#[derive(Clone, PartialEq, Debug)]
pub struct Summed {
    /// Of the program in which the finite variables are known.
    pub(super) given: Conjugate,
    pub(super) finite: Vec<VariableId>,
}

/// The most combinations of values of which each is stored, to draw from.
const MOST_STORED: f64 = 4096.0;

/// The unknowns of what is observed, where all have conjugate priors given a few finite variables: whatever is asked depends on the
/// observations through them alone.
pub(crate) fn marginalised(model: &Model, asks: &[Ask]) -> Option<Summed> {
    let known = &asks[0].known;
    if model.plate.is_some() || known.is_empty() || !known.iter().all(|known| is_observed(model, known)) {
        return None;
    }
    let behind = relevant_factors(model, &[Ask { searched: Vec::new(), ..asks[0].clone() }]);
    let is_given = |id: VariableId| known.iter().any(|known| known.variable == id);
    let finite = hidden_finite(model, &behind, &is_given);
    let is_counted = finite.iter().all(|id| model.variables[*id].domain.count().is_some());
    if !is_counted || combinations(model, &finite).ok()? > MOST_STORED {
        return None;
    }
    let is_known = |id: VariableId| is_given(id) || finite.contains(&id);
    let (priors, observed) = parted(model, &behind, &is_known);
    let fits = conjugate_faults(model, &priors, &observed, &is_known).is_none();
    (!priors.is_empty() && fits)
        .then(|| Summed { given: Conjugate { asks: asks.to_vec(), priors, observed }, finite })
}

/// The finite variables that some factors distribute, and that are not given.
fn hidden_finite(
    model: &Model,
    factors: &[FactorId],
    is_given: &dyn Fn(VariableId) -> bool,
) -> Vec<VariableId> {
    let left = factors.iter().flat_map(|id| model.factors[*id].left.iter().map(|use_| use_.variable));
    let mut finite: Vec<VariableId> =
        left.filter(|id| model.variables[*id].domain.is_finite() && !is_given(*id)).collect();
    finite.sort_unstable();
    finite.dedup();
    finite
}

/// The number of combinations of values of some variables; a domain whose bounds are not known counts once.
///
/// # Errors
/// The length of a family is not known.
fn combinations(model: &Model, finite: &[VariableId]) -> Result<f64, String> {
    let mut combinations = 1.0;
    for id in finite {
        let variable = &model.variables[*id];
        let length = match variable.family {
            None => Some(1),
            Some(family) => model.index_count(&family.over),
        };
        let Some(length) = length else {
            return Err(format!("the number of values of `{}` depends on a size", model.variable_name(*id)));
        };
        combinations *= variable.domain.count().map_or(1.0, |count| count as f64).powf(length as f64);
    }
    Ok(combinations)
}

/// The offer, or why finite variables are not all that stands between the program and conjugate priors.
pub(super) fn offer(model: &Model, asks: &[Ask]) -> Result<Summed, String> {
    if model.plate.is_some() || asks[0].when.is_over_time() {
        return Err(NO_PRIOR.to_owned());
    }
    let is_weighed = |known: &Known| matches!(known.evidence, Finding::Virtual(_));
    if let Some(known) = asks[0].known.iter().find(|known| !is_observed(model, known) && !is_weighed(known)) {
        return Err(format!("`{}` is not observed at one value", model.variable_name(known.variable)));
    }
    let is_finite = |id: VariableId| model.variables[id].domain.is_finite();
    // A variable with a likelihood remains hidden.
    let observed = asks[0].known.iter().filter(|known| !is_weighed(known));
    let given: Vec<VariableId> = observed.map(|known| known.variable).collect();
    let is_given = |id: VariableId| given.contains(&id);
    let of_unknowns = |id: VariableId| {
        let unknown = |(use_, _): (&crate::model::VariableUse, Option<usize>)| !is_finite(use_.variable);
        element_of(model, id).is_some_and(unknown) || of_an_unknown(model, id).is_some()
    };
    // A likelihood of a predicate of an unknown is no term of a conjugate posterior.
    let weighed = asks[0].known.iter().filter(|known| is_weighed(known)).map(|known| known.variable);
    if let Some(id) = weighed.into_iter().find(|id| of_unknowns(*id)) {
        return Err(format!("`{}` has a likelihood, which has no conjugate prior", model.variable_name(id)));
    }
    let is_derived = |id: &FactorId| {
        let left = model.factors[*id].left[0].variable;
        !is_given(left) && of_unknowns(left)
    };
    let all: Vec<FactorId> = relevant_factors(model, asks).into_iter().filter(|id| !is_derived(id)).collect();
    let finite = hidden_finite(model, &all, &is_given);
    if finite.is_empty() {
        return Err("no finite variable is hidden".to_owned());
    }
    let combinations = combinations(model, &finite)?;
    if combinations > MOST_COMBINATIONS {
        return Err(format!("the finite variables have more than {MOST_COMBINATIONS} combinations"));
    }
    let is_known = |id: VariableId| is_given(id) || finite.contains(&id);
    let (priors, observed) = parted(model, &all, &is_known);
    if priors.is_empty() {
        return Err(NO_PRIOR.to_owned());
    }
    if let Some(why) = conjugate_faults(model, &priors, &observed, &is_known) {
        return Err(why);
    }
    let unknown = |id: VariableId| {
        let of = element_of(model, id).map_or(id, |(use_, _)| use_.variable);
        kind_among(model, &priors, of).is_some()
    };
    match asks.iter().find_map(|ask| refused_ask(model, ask, &finite, &unknown)) {
        Some(why) => Err(why),
        None => Ok(Summed { given: Conjugate { asks: asks.to_vec(), priors, observed }, finite }),
    }
}

/// The expression of a predicate of one unknown that is asked alone; a predicate of a finite variable is a finite variable.
fn of_an_unknown(model: &Model, variable: VariableId) -> Option<ExpressionId> {
    let root = predicate_of(model, variable)?;
    let is_real = |read: VariableId| !model.variables[read].domain.is_finite();
    let reads_a_real = |id: FactorId| of_form(model, id).into_iter().any(is_real);
    model.factor_of(variable).is_some_and(reads_a_real).then_some(root)
}

/// Why an ask is not answered.
fn refused_ask(
    model: &Model,
    ask: &Ask,
    finite: &[VariableId],
    is_unknown: &dyn Fn(VariableId) -> bool,
) -> Option<String> {
    let searched: Vec<VariableId> = ask.searched.iter().map(|item| item.variable).collect();
    if searched.iter().all(|id| finite.contains(id)) {
        return None;
    }
    if let [only] = searched.as_slice()
        && of_an_unknown(model, *only).is_some()
    {
        let other = (ask.statistic != Statistic::Distribution).then(|| ask.statistic.word());
        return other.map(|word| format!("`{word}` of a predicate of an unknown is not computed here"));
    }
    if !searched.iter().all(|id| is_unknown(*id)) {
        return Some("finite variables and unknowns are asked apart: ask for each".to_owned());
    }
    if let Some(why) = refused_values(model, ask).or_else(|| dependent_values(model, ask)) {
        return Some(why);
    }
    if let Some(why) = dependent_draws(model, ask) {
        return Some(why);
    }
    use Statistic::{Distribution, Draw, Entropy, Expectation, Variance};
    let moments = matches!(ask.statistic, Distribution | Expectation | Variance | Entropy | Draw(_));
    match moments || ask.statistic.levels().is_some() {
        true => refused_of_reals(&ask.statistic, searched.len()),
        false => {
            Some(format!("`{}` of a mixture of named distributions is not computed", ask.statistic.word()))
        }
    }
}

/// What a combination of values adds to an answer.
enum Piece {
    Values,
    Truth([f64; 2]),
    Laws(NamedComponent),
}

/// A combination of values, with ln of its probability together with the observations.
struct Combination {
    ln_weight: LnTerms,
    values: Vec<usize>,
    pieces: Vec<Piece>,
}

impl Summed {
    /// A combination of values of the finite slots; `None` where it is impossible.
    fn combination(
        &self,
        setting: &Setting<'_>,
        slots: &[usize],
        (observed, number): (&Observations, usize),
    ) -> Result<Option<Combination>, Error> {
        let counts = slots.iter().map(|slot| setting.count(setting.variable_of(*slot)));
        let ordinals = radix::in_order(number, counts);
        let mut values = observed.values.clone();
        slots.iter().zip(&ordinals).for_each(|(slot, ordinal)| values[*slot] = *ordinal as f64);
        let of = |(slot, weights): &(usize, Vec<f64>)| weights[values[*slot] as usize].ln();
        let likelihood: f64 = observed.likelihoods.iter().map(of).sum();
        if likelihood == f64::NEG_INFINITY {
            return Ok(None);
        }
        let (posterior, mut ln_weight) = Posterior::at(setting, &self.given, values)?;
        ln_weight.add(likelihood);
        if ln_weight.is_nothing() {
            return Ok(None);
        }
        let piece = |ask: &Ask| {
            let only = ask.searched[0].variable;
            match (setting.model.variables[only].domain.is_finite(), of_an_unknown(setting.model, only)) {
                (true, Some(root)) => {
                    Piece::Truth(truth_cells(setting, root, &|slot| posterior.law_of(slot)))
                }
                (true, None) => Piece::Values,
                (false, _) => {
                    let (_, laws, covariance) = posterior.laws(ask);
                    Piece::Laws(NamedComponent { weight: 0.0, laws, covariance })
                }
            }
        };
        let pieces = self.given.asks.iter().map(piece).collect();
        Ok(Some(Combination { ln_weight, values: ordinals, pieces }))
    }
}

impl Prepared for Summed {
    fn run(&self, model: &Model, case: &Case<'_>) -> Result<Vec<Found>, Error> {
        let setting = &Setting::new(model, case.inputs)?;
        let first = &self.given.asks[0];
        let observations = Observations::of(setting, first)?;
        let slots: Vec<usize> = self.finite.iter().flat_map(|id| setting.slots_of(*id)).collect();
        let counts: Vec<usize> = slots.iter().map(|slot| setting.count(setting.variable_of(*slot))).collect();
        let combinations: f64 = counts.iter().map(|count| *count as f64).product();
        if combinations > MOST_COMBINATIONS {
            let help = format!("take `{}`", Advice::By("gibbs"));
            let (name, most) = (model.ask_text(first), MOST_COMBINATIONS);
            return Err(Error::TooLarge { name, cells: combinations, most, help });
        }
        let found: Vec<Option<Combination>> = (0..combinations as usize)
            .into_par_iter()
            .map(|number| self.combination(setting, &slots, (&observations, number)))
            .collect::<Result<_, Error>>()?;
        let mut found: Vec<Combination> = found.into_iter().flatten().collect();
        let lns: Vec<LnTerms> = found.iter().map(|own| own.ln_weight).collect();
        let (weights, ln_total) = ln_weights(&lns, ln_terms::EXACT, || model.ask_text(first))?;
        if found.is_empty() {
            let reason = setting.zero_factor(&observations.values);
            return Err(Error::Impossible(Impossible { question: model.ask_text(first), reason }));
        }
        if !ln_total.is_finite() {
            return Err(setting.not_a_number(&model.ask_text(first), &observations.values));
        }
        let ln_evidence =
            (!first.known.is_empty() || self.has_values(setting, &observations)).then_some(ln_total);
        let answer = |(place, ask): (usize, &Ask)| {
            let text = (ask, model.ask_text(ask));
            let variables: Vec<VariableId> = ask.searched.iter().map(|item| item.variable).collect();
            let pieces = found
                .iter_mut()
                .zip(&weights)
                .map(|(own, weight)| (&own.values, &mut own.pieces[place], *weight));
            let (mut truths, mut components) = ([0.0; 2], Vec::new());
            let own: Vec<usize> = variables.iter().flat_map(|id| setting.slots_of(*id)).collect();
            let extents: Vec<usize> =
                own.iter().map(|slot| setting.count(setting.variable_of(*slot))).collect();
            let at: Vec<usize> =
                own.iter().filter_map(|slot| slots.iter().position(|other| other == slot)).collect();
            let mut cells = vec![0.0; if at.len() == own.len() { extents.iter().product() } else { 0 }];
            let mut is_truth = false;
            for (values, piece, weight) in pieces {
                match piece {
                    Piece::Values => {
                        let digits = at.iter().zip(&extents).map(|(at, extent)| (values[*at], *extent));
                        cells[radix::position(digits)] += weight;
                    }
                    Piece::Truth(own) => {
                        is_truth = true;
                        truths.iter_mut().zip(own).for_each(|(sum, p)| *sum += weight * *p);
                    }
                    Piece::Laws(component) => {
                        let component = std::mem::replace(
                            component,
                            NamedComponent { weight: 0.0, laws: Vec::new(), covariance: Vec::new() },
                        );
                        components.push(NamedComponent { weight, ..component });
                    }
                }
            }
            if is_truth {
                let table = Table::read(model, text, &variables, truths.to_vec(), None, &[2]);
                return Ok(Found::Table(table, ln_evidence));
            }
            if components.is_empty() {
                let table = Table::read(model, text, &variables, cells, None, &extents);
                return Ok(Found::Table(table, ln_evidence));
            }
            let of = own.iter().map(|slot| Slot::of(setting, *slot)).collect();
            let law = PartLaw::NamedMixture(NamedMixture(components));
            let part = Part { instant: None, given: Vec::new(), of, law };
            let rows = match Observations::searched(setting, ask)? {
                Some(values) => vec![part.row_at(model, &values)],
                None => part.rows_of(model, ask, case.sampling.seed)?,
            };
            Ok(Found::Answer(Answer {
                question: text.1,
                strategy: Strategy::Conjugate,
                when: ask.when,
                ln_evidence,
                estimate: None,
                answer: rows.into(),
                parts: vec![part],
            }))
        };
        self.given.asks.iter().enumerate().map(answer).collect()
    }
}

impl Summed {
    /// Whether anything is observed.
    fn has_values(&self, setting: &Setting<'_>, observations: &Observations) -> bool {
        let none = Observations::none(setting);
        observations.values.iter().zip(none.values).any(|(own, none)| !own.is_nan() && none.is_nan())
    }
}

impl Offered for Summed {
    fn strategy(&self) -> Strategy {
        Strategy::Conjugate
    }

    fn asks(&self) -> &[Ask] {
        &self.given.asks
    }

    /// One product for each form and combination of values; families count once.
    fn cost(&self, model: &Model) -> Option<f64> {
        let count =
            |id: &VariableId| model.variables[*id].domain.count().map_or(UNKNOWN_COUNT, |count| count as f64);
        let combinations: f64 = self.finite.iter().map(count).product();
        Some(combinations * self.given.cost(model).unwrap_or(1.0))
    }

    fn reason(&self) -> &'static str {
        "exact, in closed form: given the finite variables, which are summed out, all priors are conjugate to what is observed"
    }

    fn derive(&self, model: &Model, notation: Notation) -> (Vec<Line>, Vec<Line>) {
        let names =
            |ids: &mut dyn Iterator<Item = VariableId>| notation.names(model, &ids.collect::<Vec<_>>());
        let searched = names(&mut self.given.asks[0].searched.iter().map(|item| item.variable));
        let known = names(&mut self.given.asks[0].known.iter().map(|known| known.variable));
        let left = notation.distribution(&searched, &known);
        let finite = Notation::Unicode.names(model, &self.finite).join(" ");
        let mathml = format!(
            "<msub><mo>Σ</mo><mi>d</mi></msub><msub><mi>w</mi><mi>d</mi></msub><mi>p</mi>{OPEN}<mtext>x | d, y</mtext>{CLOSE}"
        );
        let right = notation.choose("Σ_d w_d p(x | d, y)", "\\sum_d w_d\\, p(x \\mid d, y)", &mathml);
        let reason = format!(
            "given the values d of `{finite}` the priors are conjugate to what is observed: w_d ∝ P(d) p(y | d), and each unknown has a \
             named distribution"
        );
        (vec![("conjugate, summed".to_owned(), reason, notation.equation(&left, "=", right))], Vec::new())
    }

    fn not_printed(&self, _: &Model) -> Option<String> {
        Some("conjugate posteriors are computed by `answer::ask`, not by emitted code".to_owned())
    }

    fn prepare(&self, _: &Model, _: &Question, _: Purpose) -> Result<Box<dyn Prepared>, Error> {
        Ok(Box::new(self.clone()))
    }
}

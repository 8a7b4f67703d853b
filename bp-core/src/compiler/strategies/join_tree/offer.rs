//! The offer of the join tree: one tree for thousands of factors, where loops would be as many.
//!
//! In: asks of a program of many factors, all finite, without a plate. Out: a [`JoinTree`]: the sum of products to
//! compute, without an order of the sums, which the tree finds. Invariant: barren factors are already removed, by the
//! rule that keeps improper ones; the remaining sum equals the one that loops would compute.

use crate::equation::{Draft, Exact, Line, Notation, Options, Strategy, Term, remove_barren};
use crate::error::Error;
use crate::ids::{FactorId, VariableId};
use crate::model::{Ask, Finding, IndexSpace, Model, Question, Searched, Statistic};
use crate::strategies::weighting::refused_factor;
use crate::strategies::{self, Offered, Prepared, Purpose, Route, Turn, refused};

/// Above this number of factors, finding a tree takes less time than writing loops.
pub const MANY_FACTORS: usize = 2000;

/// From this number of joint values of the searched variables on, marginals are computed by one propagation.
const MANY_TOGETHER: f64 = 4096.0;

/// An answer by sums and products over a join tree.
#[derive(Clone, PartialEq, Debug)]
pub struct JoinTree {
    /// The sum of products without an order of its sums: the asks, the names of the variables, the derivation.
    pub exact: Exact,
    /// The factors of the product.
    pub factors: Vec<FactorId>,
    /// Virtual evidence: variables with a likelihood for each value.
    pub likelihoods: Vec<(VariableId, Vec<f64>)>,
    /// Whether each variable is asked alone, so that one propagation answers all.
    pub alone: bool,
}

/// A join tree, where many factors remain and all have tables; where the user asks for one, of few factors too.
///
/// # Errors
/// The reason why there is none.
fn offer(model: &Model, asks: &[Ask], options: Options, asked_for: bool) -> Result<JoinTree, String> {
    let few = |count: usize| format!("{count} factors: loops are compiled faster than a tree");
    if model.plate.is_some() {
        return Err("the program is repeated over a plate".to_owned());
    }
    let alone = (asks.len() > 1 || options.alone) && are_alone(model, asks, options.alone);
    if options.elements && !alone {
        return Err("an element of a family is observed alone, and not all is finite".to_owned());
    }
    // Loops would build the joint distribution of all searched variables.
    let asked_for = asked_for || alone && (options.alone || together(model, asks) > MANY_TOGETHER);
    if model.factors.len() <= MANY_FACTORS && !asked_for {
        return Err(few(model.factors.len()));
    }
    let mut draft = Draft::define(model, asks.to_vec(), options);
    draft.marginalise();
    draft.decompose();
    draft.condition();
    remove_barren(&mut draft);
    let (mut factors, mut likelihoods) = (Vec::new(), Vec::new());
    for term in &draft.factors {
        match &draft.terms[*term] {
            Term::Factor(factor) if has_table(model, *factor) => factors.push(*factor),
            Term::Likelihood(variable, weights) => likelihoods.push((*variable, weights.clone())),
            Term::Factor(factor) => {
                return Err(format!("`{}` is not a table of numbers", model.head(&model.factors[*factor])));
            }
            _ => return Err("a factor is not a table of numbers".to_owned()),
        }
    }
    let is_finite = |variable: &VariableId| model.variables[*variable].domain.is_finite();
    let asked = draft.searched.iter().chain(&draft.each).all(is_finite);
    if !asked {
        return Err("a variable that is asked or known is not finite".to_owned());
    }
    if factors.len() <= MANY_FACTORS && !asked_for {
        return Err(few(factors.len()));
    }
    // The rows of an answer are laid out when the question is planned, so the sizes must be known by then.
    let grows = |variable: &&VariableId| match model.variables[**variable].family.map(|family| family.over) {
        Some(IndexSpace::Range(range)) => range.high.size.is_some(),
        Some(IndexSpace::Set(_)) => true,
        None => false,
    };
    if let Some(variable) = draft.searched.iter().chain(&draft.each).find(grows).filter(|_| !alone) {
        let name = model.variable_name(*variable);
        return Err(format!(
            "the length of the family `{name}` is given when it is asked: ask for its elements"
        ));
    }
    Ok(JoinTree { exact: draft.unordered(), factors, likelihoods, alone })
}

/// The strategy.
pub(crate) struct Engine;

impl strategies::Engine for Engine {
    fn offer(&self, model: &Model, asks: &[Ask], turn: &Turn<'_>) -> Result<Route, Error> {
        let tree = offer(model, asks, turn.options, turn.forced).map_err(|why| refused(model, asks, &why))?;
        Ok(Route::Tree(tree))
    }
}

impl Offered for JoinTree {
    fn strategy(&self) -> Strategy {
        Strategy::JoinTree
    }

    fn asks(&self) -> &[Ask] {
        &self.exact.asks
    }

    fn reason(&self) -> &'static str {
        "exact, by a join tree: sums and products of finite variables, too many for a loop each"
    }

    fn derive(&self, model: &Model, notation: Notation) -> (Vec<Line>, Vec<Line>) {
        self.exact.lines(model, notation)
    }

    fn not_printed(&self) -> Option<String> {
        Some(format!(
            "it takes {} factors; emitted code holds a loop for each, and at most {MANY_FACTORS} are written: \
             `answer::ask` answers it by a join tree",
            self.factors.len()
        ))
    }

    fn prepare(&self, _: &Model, _: &Question, _: Purpose) -> Result<Box<dyn Prepared>, Error> {
        Ok(Box::new(self.clone()))
    }
}

/// Whether each ask is for the distribution of one variable, in a program that is finite throughout.
fn are_alone(model: &Model, asks: &[Ask], families: bool) -> bool {
    let alone = |ask: &Ask| {
        let one = |item: &Searched| {
            item.at.is_none() && (families || model.variables[item.variable].family.is_none())
        };
        ask.statistic == Statistic::Distribution && matches!(ask.searched.as_slice(), [item] if one(item))
    };
    asks.iter().all(alone)
        && asks[0].known.iter().all(|known| !matches!(known.evidence, Finding::Each))
        && model.variables.values().all(|variable| variable.domain.is_finite())
}

/// The number of joint values of the searched variables; a size that is not known counts 16.
fn together(model: &Model, asks: &[Ask]) -> f64 {
    let values = |ask: &Ask| model.variables[ask.searched[0].variable].domain.count().unwrap_or(16) as f64;
    asks.iter().map(values).product()
}

/// Whether a factor is a table of numbers once its parameters have values.
fn has_table(model: &Model, factor: FactorId) -> bool {
    let factor = &model.factors[factor];
    let mut uses = factor.left.iter().chain(&factor.right);
    uses.all(|use_| model.variables[use_.variable].domain.is_finite())
        && refused_factor(model, factor).is_none()
}

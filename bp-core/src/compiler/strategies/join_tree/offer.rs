//! The offer of the join tree, and its cost.
//!
//! In: asks of a program whose factors are tables of finite variables, without a plate. Out: a [`JoinTree`]: the sum of
//! products to compute, without an order of the sums, which the tree finds. Invariant: barren factors are already
//! removed, by the rule that keeps improper ones; the remaining sum equals the one that loops would compute.

use crate::distribution::Setting;
use crate::door::Advice;
use crate::elimination::{Effort, triangulate};
use crate::equation::{
    Draft, Exact, Group, Line, MOST_PRODUCTS, Notation, Options, Strategy, Term, remove_barren,
};
use crate::error::Error;
use crate::exec::Inputs;
use crate::ids::{FactorId, VariableId};
use crate::model::{Ask, Factor, Finding, IndexSpace, Model, Question, Searched, Statistic};
use crate::strategies::weighting::refused_factor;
use crate::strategies::{self, Offered, Prepared, Purpose, Route, Turn, refused};
use std::collections::HashMap;

/// Above this number of factors, finding a tree takes less time than writing loops.
const MANY_FACTORS: usize = 500;

/// The cost of building a tree for each factor, in products: filling its table, finding an order, pairing nodes. A tree is
/// built for each case, whereas loops are compiled once; as measured, a factor takes about ten microseconds.
const MAKING: f64 = 1e4;

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
    /// The kind of the group of asks.
    pub group: Group,
    /// Whether building it takes less time than writing loops.
    pub(crate) outruns_loops: bool,
}

/// A join tree, where many factors remain and all have tables; where the user asks for one, of few factors too.
///
/// # Errors
/// The reason why a join tree makes no offer.
fn offer(model: &Model, asks: &[Ask], options: Options, asked_for: bool) -> Result<JoinTree, String> {
    if model.plate.is_some() {
        return Err("the program is repeated over a plate".to_owned());
    }
    let group = match options.group {
        Group::Tables if asks.len() > 1 && are_alone(model, asks) => Group::Marginals,
        Group::Tables => Group::Tables,
        group if is_finite(model, asks) => group,
        _ if options.elements => {
            return Err("an element of a family is observed or asked alone, and not all is finite".to_owned());
        }
        _ => return Err("not all is finite".to_owned()),
    };
    // Loops would build the joint distribution of all searched variables.
    let is_group =
        options.group != Group::Tables || group == Group::Marginals && together(model, asks) > MANY_TOGETHER;
    let of_elements = || "it has families, and few factors: loops need no table for each element".to_owned();
    let has_families = model.variables.values().any(|variable| variable.family.is_some());
    let any_number = asked_for || is_group || !has_families;
    if model.factors.len() <= MANY_FACTORS && !any_number {
        return Err(if is_finite(model, asks) { of_elements() } else { "not all is finite".to_owned() });
    }
    let mut draft = Draft::define(model, asks.to_vec(), options);
    draft.marginalise();
    draft.decompose();
    draft.condition().map_err(|error| error.to_string())?;
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
    let finite = |variable: &VariableId| model.variables[*variable].domain.is_finite();
    let asked = draft.searched.iter().chain(&draft.each).all(finite);
    if !asked {
        return Err("a variable that is asked or known is not finite".to_owned());
    }
    let outruns_loops = is_group || factors.len() > MANY_FACTORS;
    if !(any_number || outruns_loops) {
        return Err(of_elements());
    }
    // The rows of an answer are laid out when the question is planned, so the sizes must be known by then.
    let grows = |variable: &&VariableId| match model.variables[**variable].family.map(|family| family.over) {
        Some(IndexSpace::Range(range)) => range.high.size.is_some(),
        Some(IndexSpace::Set(_)) => true,
        None => false,
    };
    if let Some(variable) =
        draft.searched.iter().chain(&draft.each).find(grows).filter(|_| group == Group::Tables)
    {
        let name = model.variable_name(*variable);
        return Err(format!(
            "the length of the family `{name}` is given when it is asked: ask for its elements"
        ));
    }
    Ok(JoinTree { exact: draft.unordered(), factors, likelihoods, group, outruns_loops })
}

impl JoinTree {
    /// The variables of each factor, and the number of values of each; none where they are elements of families whose number is not
    /// known, or where a factor reads a parameter without a number.
    fn scopes(&self, model: &Model) -> Option<(Vec<f64>, Vec<Vec<u32>>)> {
        let is_bound = |id: VariableId| self.exact.bindings.contains_key(&id);
        let factors = || self.factors.iter().map(|id| &model.factors[*id]);
        let uses =
            |factor: &Factor| factor.left.iter().chain(&factor.right).map(|use_| use_.variable).collect();
        let each: Vec<Vec<VariableId>> = factors().map(uses).collect();
        let mut numbers: HashMap<(VariableId, usize), u32> = HashMap::new();
        let mut counts = Vec::new();
        let mut number = |id: VariableId, slot: usize, count: usize| {
            *numbers.entry((id, slot)).or_insert_with(|| {
                counts.push(count as f64);
                counts.len() as u32 - 1
            })
        };
        let mut scopes: Vec<Vec<u32>> = Vec::new();
        if each.iter().flatten().any(|id| model.variables[*id].family.is_some()) {
            let inputs = Inputs::new();
            let setting = Setting::new(model, &inputs).ok()?;
            for factor in &self.factors {
                for instance in setting.instances(*factor).ok()? {
                    let slots = setting.reads(&instance).into_iter().chain(instance.left.iter().copied());
                    let of = |slot| (setting.variable_of(slot), slot);
                    let slots = slots.map(of).filter(|(id, _)| !is_bound(*id));
                    scopes.push(slots.map(|(id, slot)| number(id, slot, setting.count(id))).collect());
                }
            }
        } else {
            let count = |id: VariableId| model.variables[id].domain.count().unwrap_or(16);
            for scope in each {
                let ids = scope.into_iter().filter(|id| !is_bound(*id));
                scopes.push(ids.map(|id| number(id, 0, count(id))).collect());
            }
        }
        for scope in &mut scopes {
            scope.sort_unstable();
            scope.dedup();
        }
        Some((counts, scopes))
    }

    /// The products of all propagations, one for each value of the variables that are conditioned on, and of building the
    /// tree; `None` for families whose elements cannot be counted.
    fn products(&self, model: &Model) -> Option<f64> {
        let Exact { each, searched, .. } = &self.exact;
        let count = |id: VariableId| model.variables[id].domain.count().unwrap_or(16) as f64;
        let (counts, scopes) = self.scopes(model)?;
        let factors = scopes.len();
        let cells = triangulate(counts, &scopes, Effort::Glance).cells;
        let values = |ids: &[VariableId]| ids.iter().map(|id| count(*id)).product::<f64>();
        let propagations = match self.group {
            // Sums on the way up, and two derivatives of each product on the way down.
            Group::Marginals => 3.0,
            // Largest values on the way up.
            Group::Mode => 1.0,
            // The marginals for each value of the targets.
            Group::Information => {
                3.0 * self.exact.asks.first().map_or(1.0, |ask| {
                    values(&ask.searched.iter().map(|item| item.variable).collect::<Vec<_>>())
                })
            }
            // A joint posterior takes a propagation for each value of all its variables but one.
            Group::Tables | Group::Joint => {
                values(each) * values(searched) / searched.last().map_or(1.0, |last| count(*last))
            }
        };
        Some(propagations * cells + MAKING * factors as f64)
    }
}

/// The strategy.
pub(crate) struct Engine;

impl strategies::Engine for Engine {
    fn offer(&self, model: &Model, asks: &[Ask], turn: &Turn<'_>) -> Result<Route, Error> {
        let asked_for = turn.forced || turn.by_element;
        let tree = offer(model, asks, turn.options, asked_for).map_err(|why| refused(model, asks, &why))?;
        let products = tree.products(model).unwrap_or(0.0);
        // The limit of sums; groups are limited by memory alone.
        if products > MOST_PRODUCTS && tree.group == Group::Tables && !turn.forced {
            let question = model.ask_text(&asks[0]);
            let help = format!("observe more variables, or name it: `{}`", Advice::By("join_tree"));
            return Err(Error::TooLong { question, products, most: MOST_PRODUCTS, help });
        }
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

    fn cost(&self, model: &Model) -> Option<f64> {
        self.products(model)
    }

    fn reason(&self) -> &'static str {
        "exact, by a join tree: sums and products of finite variables"
    }

    fn derive(&self, model: &Model, notation: Notation) -> (Vec<Line>, Vec<Line>) {
        self.exact.lines(model, notation)
    }

    fn not_printed(&self, _: &Model) -> Option<String> {
        Some(format!(
            "it takes {} factors, and a join tree is cheaper than a loop for each; emitted code holds loops: \
             `answer::ask` answers it by a join tree",
            self.factors.len()
        ))
    }

    fn prepare(&self, _: &Model, _: &Question, _: Purpose) -> Result<Box<dyn Prepared>, Error> {
        Ok(Box::new(self.clone()))
    }
}

/// Whether each ask is for the distribution of one variable, in a program that is finite throughout.
fn are_alone(model: &Model, asks: &[Ask]) -> bool {
    let alone = |ask: &Ask| {
        let one = |item: &Searched| item.at.is_none() && model.variables[item.variable].family.is_none();
        ask.statistic == Statistic::Distribution && matches!(ask.searched.as_slice(), [item] if one(item))
    };
    asks.iter().all(alone) && is_finite(model, asks)
}

/// Whether a program is finite throughout, and all that is known has a value.
fn is_finite(model: &Model, asks: &[Ask]) -> bool {
    asks[0].known.iter().all(|known| !matches!(known.evidence, Finding::Each))
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

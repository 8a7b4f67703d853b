//! Equations: the sums and products of a question, and their derivation.
//!
//! In: a [`Model`] and asks with the same known variables. Out: an [`Exact`]: terms, bindings of variables, and a
//! derivation whose steps print as equations, each with its reason. Invariant: every step of a derivation denotes the
//! same answer; switching off a rule ([`Rewrites`]) does not change the answer.
//!
//! P(S | K) = Σ_F P(S F K) / P(K): searched, known and free variables partition the variables of the program.

mod barren;
mod cancel;
mod cost;
mod definition;
mod dirac;
mod draft;
mod eliminate;
mod elision;
mod notation;
mod order;
mod parts;
mod print;
mod printer;
mod range;
mod scan;
mod scope;
mod size;
mod solve;
mod strategy;
mod tokens;
mod typeset;

pub(crate) use barren::remove as remove_barren;
pub use cost::{Cost, Elimination};
pub(crate) use definition::forms;
pub(crate) use draft::Draft;
pub(crate) use elision::elided;
pub use notation::Notation;
pub(crate) use notation::{CLOSE, OPEN};
pub(crate) use parts::lines as made_of_parts;
pub use parts::parts;
pub(crate) use print::Line;
pub use range::{Mark, Marked};
pub(crate) use size::MOST_PRODUCTS;
pub(crate) use solve::Solution;
pub use strategy::Strategy;

use crate::error::Error;
use crate::ids::{Arena, ExpressionId, FactorId, TermId, VariableId};
use crate::model::{Ask, Model, Value};
use std::collections::{BTreeMap, BTreeSet};

/// A node of the equation.
#[derive(Clone, PartialEq, Debug)]
pub enum Term {
    /// The joint distribution, not yet decomposed.
    Joint,
    /// A factor of the decomposition; under a `prod`, the product of all its elements.
    Factor(FactorId),
    /// The likelihood of virtual evidence.
    Likelihood(VariableId, Vec<f64>),
    /// 1 if the value bound to a variable lies in its domain, else 0.
    Inside(VariableId),
    /// 1 if a factor of known variables is positive, else 0: its value cancels, but an impossible context does not.
    Possible(FactorId),
    /// A product.
    Product(Vec<TermId>),
    /// A sum over the values of variables.
    Sum(Vec<VariableId>, TermId),
    /// A term at the value of a variable that fulfils a Dirac ([`Binding::Solved`]); 0 where it is outside the domain.
    At(VariableId, TermId),
    /// Σ over the hidden elements of a family of which only the first true one matters, as a scan.
    FirstScan(FirstScan),
    /// The body divided by its sum over variables.
    Normalise(Vec<VariableId>, TermId),
}

/// A sum over the 2ᴺ states of a family of booleans whose other factor depends only on the first true element.
#[derive(Clone, PartialEq, Debug)]
pub struct FirstScan {
    /// The family that is summed out.
    pub family: VariableId,
    /// The factor that distributes it: P(G\[j\] | …).
    pub prior: FactorId,
    /// The factor that depends on its first true element.
    pub factor: FactorId,
    /// The replacement of one element: (value, index).
    pub with: Option<(ExpressionId, ExpressionId)>,
}

/// The terms below some terms, themselves included.
pub(crate) fn reachable(terms: &Arena<TermId, Term>, roots: &[TermId]) -> BTreeSet<TermId> {
    let (mut seen, mut rest) = (BTreeSet::new(), roots.to_vec());
    while let Some(id) = rest.pop() {
        if seen.insert(id) {
            match &terms[id] {
                Term::Product(parts) => rest.extend(parts),
                Term::Sum(_, body) | Term::At(_, body) | Term::Normalise(_, body) => rest.push(*body),
                _ => {}
            }
        }
    }
    seen
}

/// The binding of a variable that is not summed.
#[derive(Clone, PartialEq, Debug)]
pub enum Binding {
    /// A value given by the question.
    Value(Value),
    /// The expression of a Dirac.
    Expression(ExpressionId),
    /// The antecedent of `cell` by `displacement`: `cell − displacement`.
    Antecedent {
        /// The cell.
        cell: VariableId,
        /// The displacement.
        displacement: VariableId,
    },
    /// The one value that fulfils a Dirac.
    Solved(Solution),
}

/// The enabled rules: all, except in tests of a rule.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Rewrites {
    /// Barren variables disappear.
    pub barren: bool,
    /// A Dirac is a substitution.
    pub dirac: bool,
    /// A sum over a Dirac is a read at the value that fulfils it.
    pub solve: bool,
    /// A chain is a scan.
    pub scan: bool,
    /// Sums are pushed inwards, in the cheapest order found.
    pub order: bool,
    /// Factors that cancel in the normaliser are dropped, and so is a normaliser that is 1.
    pub cancel: bool,
}

impl Default for Rewrites {
    fn default() -> Self {
        Self { barren: true, dirac: true, solve: true, scan: true, order: true, cancel: true }
    }
}

/// The kind of a group of asks with the same known variables; a join tree answers each kind with its own propagations.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Group {
    /// No special kind: each ask has its table.
    #[default]
    Tables,
    /// The marginal of each variable, and of each element of a family.
    Marginals,
    /// The joint distribution of some variables and elements.
    Joint,
    /// The most probable assignment of all variables; one of several equally probable ones.
    Mode,
    /// The information that observing each of some variables and elements gives about others.
    Information,
}

/// Options of the planner.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Options {
    /// The rules.
    pub rewrites: Rewrites,
    /// Whether ln P(evidence) is needed; then its factors may not be dropped.
    pub ln_evidence: bool,
    /// The selected strategy, if any; otherwise the planner chooses.
    pub by: Option<Strategy>,
    /// The largest number of products of an exact answer, if an estimate can replace it.
    pub budget: Option<u64>,
    /// Whether to collect the offers of all strategies.
    pub all_offers: bool,
    /// The kind of the group.
    pub group: Group,
    /// Whether single elements of families are observed or asked, in addition to the question's variables.
    pub elements: bool,
    /// Over time: whether `filter` is answered after each instant, and not after the last one alone.
    pub each: bool,
}

/// The options of a strategy that is asked for by name.
impl From<Option<Strategy>> for Options {
    fn from(by: Option<Strategy>) -> Self {
        Options { by, ..Options::default() }
    }
}

/// One line of a derivation.
#[derive(Clone, PartialEq, Debug)]
pub struct Step {
    /// The rule's name.
    pub rule: &'static str,
    /// The reason.
    pub reason: String,
    /// The right-hand side after it.
    pub term: TermId,
    /// The bindings after it.
    pub bindings: BTreeMap<VariableId, Binding>,
}

/// An answer by sums and products over finite domains.
#[derive(Clone, PartialEq, Debug)]
pub struct Exact {
    /// The asks, all with the same known variables.
    pub asks: Vec<Ask>,
    /// The nodes of the equations.
    pub terms: Arena<TermId, Term>,
    /// The joint distribution of all searched variables, up to a constant unless `normalised`.
    pub joint: TermId,
    /// Whether the joint sums to one by construction.
    pub normalised: bool,
    /// The bindings.
    pub bindings: BTreeMap<VariableId, Binding>,
    /// The known variables with a row of the answer for each value, in the order of the question.
    pub each: Vec<VariableId>,
    /// The searched variables, all asks together, in order of first appearance.
    pub searched: Vec<VariableId>,
    /// Whether ln P(evidence) is computed.
    pub ln_evidence: bool,
    /// The derivation.
    pub derivation: Vec<Step>,
    /// Number of summed products, with unknown sizes counted as 16.
    pub cost: f64,
    /// The sums in their order, each with its cost.
    pub eliminations: Vec<Elimination>,
}

/// Number of products above which an exact plan is compared with one that sums over its Diracs.
const MANY_PRODUCTS: f64 = 1e6;

/// An exact plan; if it is expensive, the cheaper of two. Substituting a Dirac saves a sum, but joins all variables of
/// its expression: a chain of them may join all variables.
pub(crate) fn exact(model: &Model, asks: Vec<Ask>, options: Options) -> Result<Exact, Error> {
    let mut exact = stages(model, asks.clone(), options)?;
    if exact.cost < MANY_PRODUCTS || !options.rewrites.dirac {
        size::check(model, &exact)?;
        return Ok(exact);
    }
    let summed = Options { rewrites: Rewrites { dirac: false, ..options.rewrites }, ..options };
    // A variable that cannot be summed, such as a real, is substituted anyway.
    let other = stages(model, asks, summed).ok().filter(|other| other.cost < exact.cost);
    exact = other.unwrap_or(exact);
    size::check(model, &exact)?;
    Ok(exact)
}

/// The stages of an exact plan.
fn stages(model: &Model, asks: Vec<Ask>, options: Options) -> Result<Exact, Error> {
    let mut draft = Draft::define(model, asks, options);
    draft.marginalise();
    draft.decompose();
    draft.condition()?;
    barren::remove(&mut draft);
    cancel::constants(&mut draft);
    dirac::substitute(&mut draft);
    scan::chains(&mut draft);
    cancel::normaliser(&mut draft);
    eliminate::order(&mut draft)?;
    solve::sums(&mut draft);
    draft.finish()
}

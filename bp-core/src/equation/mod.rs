//! Equations: what a question computes as sums and products of factors, and how that came about.
//!
//! In: a [`Model`] and asks that know the same. Out: an [`Exact`]: terms, what variables stand for, and a derivation whose steps
//! print as equations, each with its reason. Invariant: every step of a derivation denotes the same answer; a rule may be turned
//! off ([`Rewrites`]) and the answer stays what it was.
//!
//! P(S | K) = Σ_F P(S F K) / P(K): searched, known and free variables partition the variables of the program.

mod barren;
mod cancel;
mod cost;
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
mod strategy;

pub(crate) use barren::{is_proper, remove as remove_barren};
pub use cost::{Cost, Elimination};
pub(crate) use draft::Draft;
pub use notation::Notation;
pub(crate) use notation::{CLOSE, OPEN};
pub(crate) use parts::lines as made_of_parts;
pub use parts::parts;
pub(crate) use print::Line;
pub use range::{Mark, Marked};
pub(crate) use scope::{Scope, of_form};
pub use strategy::Strategy;

use crate::error::Error;
use crate::ids::{Arena, ExpressionId, FactorId, TermId, VariableId};
use crate::model::{Ask, Model, Value};
use std::collections::BTreeMap;

/// A node of the equation.
#[derive(Clone, PartialEq, Debug)]
pub enum Term {
    /// The joint distribution, not yet decomposed.
    Joint,
    /// A factor of the decomposition; under a `prod`, the product of all that it stands for.
    Factor(FactorId),
    /// The likelihood that virtual evidence gives to the values of a variable.
    Likelihood(VariableId, Vec<f64>),
    /// 1 where the value that a variable is bound to lies in its domain, else 0.
    Inside(VariableId),
    /// 1 where a factor of known variables is positive, else 0: its number cancels, an impossible context does not.
    Possible(FactorId),
    /// A product.
    Product(Vec<TermId>),
    /// A sum over the values of variables.
    Sum(Vec<VariableId>, TermId),
    /// Σ over the hidden elements of a family that matter only through the first true one, as a scan.
    FirstScan(FirstScan),
    /// The body divided by its sum over variables.
    Normalise(Vec<VariableId>, TermId),
}

/// A sum over the 2ᴺ states of a family of booleans whose other factor depends only on which is the first true.
#[derive(Clone, PartialEq, Debug)]
pub struct FirstScan {
    /// The family that is summed out.
    pub family: VariableId,
    /// The factor that distributes it: P(G\[j\] | …).
    pub prior: FactorId,
    /// The factor that depends on its first true element.
    pub factor: FactorId,
    /// What stands in the place of one element: (value, index).
    pub with: Option<(ExpressionId, ExpressionId)>,
}

/// What a variable that is not summed stands for.
#[derive(Clone, PartialEq, Debug)]
pub enum Binding {
    /// A value that the question gives.
    Value(Value),
    /// What a Dirac says that it is.
    Expression(ExpressionId),
    /// The cell from which the content of `cell` came by `displacement`: `cell − displacement`.
    Antecedent {
        /// Where it arrived.
        cell: VariableId,
        /// How it moved.
        displacement: VariableId,
    },
}

/// Which rules a planner may use. All, but in tests of a rule against its absence.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Rewrites {
    /// Barren variables disappear.
    pub barren: bool,
    /// A Dirac is a substitution.
    pub dirac: bool,
    /// A chain is a scan.
    pub scan: bool,
    /// Sums are pushed inwards, in the cheapest order found.
    pub order: bool,
    /// Factors that cancel in the normaliser are dropped, and so is a normaliser that is 1.
    pub cancel: bool,
}

impl Default for Rewrites {
    fn default() -> Self {
        Self { barren: true, dirac: true, scan: true, order: true, cancel: true }
    }
}

/// How a plan is to be made.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Options {
    /// The rules.
    pub rewrites: Rewrites,
    /// Whether ln P(evidence) is wanted too; then nothing that cancels may be dropped.
    pub ln_evidence: bool,
    /// The strategy that is to answer; the planner's choice where none is named.
    pub by: Option<Strategy>,
    /// Whether the offers of strategies that are not needed are wanted too.
    pub all_offers: bool,
}

/// One line of a derivation.
#[derive(Clone, PartialEq, Debug)]
pub struct Step {
    /// The rule's name.
    pub rule: &'static str,
    /// Why it applies here.
    pub reason: String,
    /// The right-hand side after it.
    pub term: TermId,
    /// What variables stand for after it.
    pub bindings: BTreeMap<VariableId, Binding>,
}

/// An answer by sums and products over finite domains.
#[derive(Clone, PartialEq, Debug)]
pub struct Exact {
    /// What is asked, all of it of the same known variables.
    pub asks: Vec<Ask>,
    /// The nodes of the equations.
    pub terms: Arena<TermId, Term>,
    /// The joint distribution of all searched variables, up to a constant unless `normalised`.
    pub joint: TermId,
    /// Whether the joint sums to one by construction.
    pub normalised: bool,
    /// What variables stand for.
    pub bindings: BTreeMap<VariableId, Binding>,
    /// The known variables of which each value is a row of the answer, in the order of the question.
    pub each: Vec<VariableId>,
    /// The searched variables, all asks together, in order of first appearance.
    pub searched: Vec<VariableId>,
    /// Whether ln P(evidence) is computed.
    pub ln_evidence: bool,
    /// How the equation came about.
    pub derivation: Vec<Step>,
    /// Products that are summed, where sizes are not known counting 16 for each.
    pub cost: f64,
    /// The sums in their order, with what each costs.
    pub eliminations: Vec<Elimination>,
}

/// Products from which on an exact plan is compared with one that sums over what its Diracs would be put in for.
const MANY_PRODUCTS: f64 = 1e6;

/// An exact plan; where it is dear, the cheaper of two. Putting a Dirac's value in the place of its variable spares a
/// sum, but brings together all that the value depends on: a chain of them may bring everything together.
pub(crate) fn exact(model: &Model, asks: Vec<Ask>, options: Options) -> Result<Exact, Error> {
    let mut exact = stages(model, asks.clone(), options)?;
    if exact.cost < MANY_PRODUCTS || !options.rewrites.dirac {
        size::check(model, &exact)?;
        return Ok(exact);
    }
    let summed = Options { rewrites: Rewrites { dirac: false, ..options.rewrites }, ..options };
    // What cannot be summed, such as a real, keeps its substitution.
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
    draft.condition();
    barren::remove(&mut draft);
    cancel::constants(&mut draft);
    dirac::substitute(&mut draft);
    scan::chains(&mut draft);
    cancel::normaliser(&mut draft);
    eliminate::order(&mut draft)?;
    draft.finish()
}

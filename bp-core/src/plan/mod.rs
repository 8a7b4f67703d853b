//! Plans: how one question to one model is answered, as the equation that is computed.
//!
//! In: a [`Model`] and a [`Question`]. Out: a [`Plan`], whose steps print as equations, each with its reason.
//! Invariant: every step of a derivation denotes the same answer; a rule may be turned off ([`Rewrites`]) and
//! the answer stays what it was.
//!
//! P(S | K) = Σ_F P(S F K) / P(K): searched, known and free variables partition the variables of the program.

mod barren;
mod cancel;
mod conditional;
mod cost;
mod dirac;
mod draft;
mod eliminate;
mod elision;
mod equation;
mod finite;
mod gaussian;
mod notation;
mod order;
mod over_time;
mod parts;
mod print;
mod range;
mod sampled;
mod scan;
mod scope;
mod size;
mod strategy;
mod tree;

pub(crate) use barren::is_proper;
pub(crate) use conditional::is_linear_in;
pub use cost::{Cost, Elimination};
pub(crate) use finite::{refusal, says_a_value};
pub(crate) use gaussian::components;
pub use gaussian::{Gaussian, LinearForm, Source};
pub use notation::Notation;
pub use over_time::{By, OverTime};
pub use parts::parts;
pub use range::{Mark, Marked};
pub(crate) use sampled::has_point;
pub use sampled::{Sampled, Treatment};
pub use strategy::{Offer, Strategy};
pub use tree::{JoinTree, MANY_FACTORS};

use crate::error::Error;
use crate::ids::{Arena, ExpressionId, FactorId, TermId, VariableId};
use crate::model::{Ask, Model, Question, Value};
use draft::Draft;
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

/// How some asks are answered.
#[derive(Clone, PartialEq, Debug)]
pub enum Route {
    /// Sums and products.
    Exact(Exact),
    /// Sums and products, too many for loops: over a join tree.
    Tree(JoinTree),
    /// All is linear and Gaussian: closed form.
    Gaussian(Gaussian),
    /// No exact route: estimated by draws.
    Sampled(Sampled),
    /// Over time, from instant to instant.
    OverTime(OverTime),
}

/// How a question is answered.
#[derive(Clone, PartialEq, Debug)]
pub struct Plan {
    /// The question.
    pub question: Question,
    /// One route for each group of asks that know the same.
    pub routes: Vec<Route>,
    /// What the strategies offered for each of these groups, in the order in which they were tried.
    pub offers: Vec<Vec<Offer>>,
}

/// Plans a question.
///
/// # Errors
/// No route answers it: no exact one, and something in it cannot be drawn or weighed.
pub fn plan(model: &Model, question: &Question, options: Options) -> Result<Plan, Error> {
    let (mut routes, mut all_offers) = (Vec::new(), Vec::new());
    let mut add = |asks: &[Ask]| -> Result<(), Error> {
        let (route, offers) = strategy::choose(model, asks, options)?;
        routes.push(route);
        all_offers.push(offers);
        Ok(())
    };
    let (over_time, asks): (Vec<Ask>, Vec<Ask>) =
        question.asks.iter().cloned().partition(|ask| ask.when.is_over_time());
    for ask in over_time {
        add(&[ask])?;
    }
    let mut rest: Vec<Ask> = Vec::new();
    for part in asks.iter().flat_map(|ask| parts(model, ask)) {
        if !rest.contains(&part) {
            rest.push(part);
        }
    }
    while let Some(first) = rest.first().cloned() {
        let closed = gaussian::applies(model, &first);
        // A searched real stands for one value, which must not be taken for that of another ask.
        let real =
            |ask: &Ask| ask.searched.iter().any(|item| !model.variables[item.variable].domain.is_finite());
        let (asks, others): (Vec<Ask>, Vec<Ask>) = rest.into_iter().partition(|ask| {
            *ask == first
                || ask.known == first.known
                    && gaussian::applies(model, ask) == closed
                    && (closed || !(real(ask) || real(&first)))
        });
        rest = others;
        add(&asks)?;
    }
    Ok(Plan { question: question.clone(), routes, offers: all_offers })
}

/// Products from which on an exact plan is compared with one that sums over what its Diracs would be put in for.
const MANY_PRODUCTS: f64 = 1e6;

/// An exact plan; where it is dear, the cheaper of two. Putting a Dirac's value in the place of its variable spares a
/// sum, but brings together all that the value depends on: a chain of them may bring everything together.
fn plan_exact(model: &Model, asks: Vec<Ask>, options: Options) -> Result<Exact, Error> {
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

//! The range of numbers: how the products of a plan avoid underflow and overflow.
//!
//! In: a model and an exact plan. Out: each product with its [`Mark`] and the reason. Invariant: a mark depends on the
//! program and the question alone, never on inputs.
//!
//! Probabilities are at most 1, so a product of them only decreases: if the normalising constant is at least 2⁻⁵¹², the
//! terms lost to underflow are below 2⁻⁵¹⁰ of it. Densities may decrease and increase again.

use super::printer::Printer;
use super::{Exact, Notation, Term};
use crate::ids::{ExpressionId, FactorId, TermId};
use crate::model::{Expression, Factor, Form, IndexSpace, Model};
use std::collections::HashSet;

/// The method of computing a product.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub enum Mark {
    /// Plain multiplication: it cannot underflow, or it is one of many over a plate.
    Linear,
    /// Plain multiplication, and again with separate exponents if the total is below 2⁻⁵¹².
    Guarded,
    /// With separate exponents.
    Log,
}

impl Mark {
    /// Its name.
    pub fn word(self) -> &'static str {
        match self {
            Mark::Linear => "linear",
            Mark::Guarded => "guarded",
            Mark::Log => "log",
        }
    }
}

/// A product with its mark and the reason.
#[derive(Clone, PartialEq, Debug)]
pub struct Marked {
    /// The product, as an equation.
    pub product: String,
    /// Its mark.
    pub mark: Mark,
    /// The reason.
    pub reason: String,
}

/// Limit of the number of printed products.
const MOST_MARKED: usize = 8;

/// log₂ of the total below which a guarded product is computed again.
const BOUND: f64 = -512.0;

/// Number of probabilities that emitted code multiplies without a guarantee that their product stays above 2⁻⁵¹²: with
/// more of them the total is often smaller, and computing again takes longer than logarithms.
const MOST_MULTIPLIED: usize = 16;

/// The properties of the operands of a product.
#[derive(Clone, PartialEq, Debug, Default)]
struct Operands {
    /// The first operand that may exceed 1, or underflow before it is normalised.
    density: Option<String>,
    /// The number of probabilities; `None` if it depends on sizes.
    count: Option<usize>,
    /// log₂ of the smallest nonzero product; `None` if it depends on inputs.
    smallest: Option<f64>,
}

impl Operands {
    fn one(smallest: Option<f64>) -> Self {
        Self { density: None, count: Some(1), smallest }
    }

    fn and(self, other: Self) -> Self {
        Self {
            density: self.density.or(other.density),
            count: self.count.zip(other.count).map(|(one, other)| one + other),
            smallest: self.smallest.zip(other.smallest).map(|(one, other)| one + other),
        }
    }

    fn nothing() -> Self {
        Self { density: None, count: Some(0), smallest: Some(0.0) }
    }
}

impl Exact {
    /// The mark of the whole answer: the strictest mark of its products.
    pub fn mark(&self, model: &Model) -> Mark {
        self.mark_of(model, self.joint).0
    }

    /// Whether emitted code multiplies: it computes suspect cells again, so a few probabilities need no logarithms.
    pub(crate) fn is_multiplied(&self, model: &Model) -> bool {
        let operands = self.operands(model, self.joint);
        operands.density.is_none() && operands.count.is_some_and(|count| count <= MOST_MULTIPLIED)
    }

    /// Whether the code of one instant multiplies: its factors are those of finite variables, normalised on their own, and few.
    /// An instant whose total is too small is computed again.
    pub(crate) fn is_multiplied_at(&self, model: &Model) -> bool {
        let mut factors: HashSet<FactorId> = HashSet::new();
        for term in self.terms.values() {
            match term {
                Term::Factor(id) | Term::Possible(id) => drop(factors.insert(*id)),
                Term::FirstScan(_) => return false,
                _ => {}
            }
        }
        let is_plain = |id: &FactorId| {
            let factor = &model.factors[*id];
            let finite = factor.left.iter().all(|left| model.variables[left.variable].domain.is_finite());
            factor.products.is_empty() && (finite || matches!(factor.form, Form::Dirac(_) | Form::Ask { .. }))
        };
        factors.len() <= MOST_MULTIPLIED && factors.iter().all(is_plain)
    }

    /// The products, outermost first; only the first few of many.
    pub(crate) fn marks(&self, model: &Model, notation: Notation) -> Vec<Marked> {
        let printer = Printer {
            model,
            exact: self,
            bindings: &self.bindings,
            conditioned: true,
            proportional: true,
            forms: false,
            notation,
        };
        let (mut open, mut marked) = (vec![self.joint], Vec::new());
        while let Some(id) = open.pop().filter(|_| marked.len() < MOST_MARKED) {
            match &self.terms[id] {
                Term::Product(factors) => open.extend(factors.iter().rev()),
                Term::Sum(_, body) | Term::At(_, body) | Term::Normalise(_, body) => open.push(*body),
                _ => {}
            }
            let many = |factor: &FactorId| !model.factors[*factor].products.is_empty();
            let is_product = match &self.terms[id] {
                Term::Product(factors) => factors.len() > 1,
                Term::Factor(factor) => id == self.joint || many(factor),
                _ => id == self.joint,
            };
            if is_product {
                let (mark, reason) = self.mark_of(model, id);
                marked.push(Marked { product: printer.term(id), mark, reason });
            }
        }
        marked
    }

    fn mark_of(&self, model: &Model, id: TermId) -> (Mark, String) {
        let operands = self.operands(model, id);
        if let Some(reason) = operands.density {
            return (Mark::Log, reason);
        }
        match (operands.smallest, operands.count) {
            (Some(smallest), _) if smallest >= BOUND => {
                (Mark::Linear, "its smallest product above 0 is at least 2^-512".to_owned())
            }
            _ if model.plate.is_some() => {
                (Mark::Linear, "probabilities over a plate, whose error is absolute".to_owned())
            }
            (_, None) => (Mark::Guarded, "the number of probabilities depends on a size".to_owned()),
            (None, Some(_)) => (Mark::Guarded, "the size of its probabilities depends on inputs".to_owned()),
            (Some(smallest), Some(_)) => {
                (Mark::Guarded, format!("its smallest product above 0 is 2^{smallest:.0}, below 2^-512"))
            }
        }
    }

    /// The factors of a term. A chain of terms is as long as the program, so there is no recursion.
    fn operands(&self, model: &Model, id: TermId) -> Operands {
        let (mut open, mut all) = (vec![id], Operands::nothing());
        while let Some(id) = open.pop() {
            let own = match &self.terms[id] {
                Term::Product(factors) => {
                    open.extend(factors);
                    continue;
                }
                Term::Sum(_, body) | Term::At(_, body) | Term::Normalise(_, body) => {
                    open.push(*body);
                    continue;
                }
                Term::Factor(factor) => of_factor(model, *factor),
                Term::FirstScan(scan) => of_factor(model, scan.prior).and(of_factor(model, scan.factor)),
                Term::Likelihood(variable, weights) => {
                    let largest = weights.iter().copied().fold(0.0, f64::max);
                    let name = model.variable_name(*variable);
                    let density = (largest > 1.0).then(|| format!("the likelihood of `{name}` exceeds 1"));
                    Operands { density, ..Operands::one(smallest_of(weights.iter().copied())) }
                }
                Term::Inside(_) | Term::Possible(_) | Term::Joint => Operands::nothing(),
            };
            all = all.and(own);
            if all.density.is_some() {
                break;
            }
        }
        all
    }
}

fn of_factor(model: &Model, id: FactorId) -> Operands {
    let factor = &model.factors[id];
    let mut operands = Operands::one(smallest(model, factor, &factor.form));
    operands.density = density(model, factor, &factor.form).map(|why| {
        let head = model.head(factor);
        format!("`{head}` {why}")
    });
    for (_, over) in &factor.products {
        let count = match over {
            IndexSpace::Set(_) => None,
            IndexSpace::Range(_) => model.index_count(over),
        };
        operands.count = operands.count.zip(count).map(|(own, count)| own * count);
        operands.smallest = operands.smallest.zip(count).map(|(own, count)| own * count as f64);
    }
    operands
}

/// The reason why the values of a form are not plain probabilities, if they are not.
fn density(model: &Model, factor: &Factor, form: &Form) -> Option<&'static str> {
    let finite = factor.left.iter().all(|left| model.variables[left.variable].domain.is_finite());
    match form {
        Form::If { then, otherwise, .. } => {
            density(model, factor, then).or_else(|| density(model, factor, otherwise))
        }
        Form::Mixture(parts) => parts.iter().find_map(|(_, part)| density(model, factor, part)),
        Form::Previous { otherwise, .. } => density(model, factor, otherwise),
        Form::Initial { first, later } => {
            density(model, factor, first).or_else(|| density(model, factor, later))
        }
        // A question to another program is normalised there; a Dirac is 0 or 1.
        Form::Ask { .. } | Form::Dirac(_) => None,
        _ if !finite => Some("is a density of a real"),
        // Over a plate their totals are those of probabilities: the error is absolute.
        Form::Law { .. } | Form::Weights(_) | Form::Truncated { .. } if model.plate.is_none() => {
            Some("is normalised over its values, which may be very small before")
        }
        _ => None,
    }
}

/// log₂ of the smallest nonzero probability of a form, if it is known.
fn smallest(model: &Model, factor: &Factor, form: &Form) -> Option<f64> {
    let left = factor.left.iter().map(|left| &model.variables[left.variable].domain);
    match form {
        Form::Uniform => left.map(|domain| Some(-(domain.count()? as f64).log2())).sum(),
        Form::Bernoulli(p, None) => {
            smallest_of(numbers(model, &[*p])?.into_iter().flat_map(|p| [p, 1.0 - p]))
        }
        Form::Bernoulli(p, Some(other)) => smallest_of(numbers(model, &[*p, *other])?),
        Form::Categorical(entries) => smallest_of(numbers(model, entries)?),
        Form::Table(rows) => smallest_of(numbers(model, &rows.concat())?),
        Form::Constants(entries) => smallest_of(entries.iter().copied()),
        Form::Dirac(_) => Some(0.0),
        Form::If { then, otherwise, .. } => {
            Some(smallest(model, factor, then)?.min(smallest(model, factor, otherwise)?))
        }
        _ => None,
    }
}

fn smallest_of(numbers: impl IntoIterator<Item = f64>) -> Option<f64> {
    let positive = numbers.into_iter().filter(|number| *number > 0.0);
    Some(positive.fold(1.0, f64::min).log2())
}

/// The possible values of expressions that select among constants.
fn numbers(model: &Model, expressions: &[ExpressionId]) -> Option<Vec<f64>> {
    let (mut open, mut found, mut seen) = (expressions.to_vec(), Vec::new(), HashSet::new());
    while let Some(id) = open.pop() {
        if !seen.insert(id) {
            continue;
        }
        match &model.expressions[id] {
            Expression::Number(number) => found.push(*number),
            Expression::If { then, otherwise, .. } => open.extend([*then, *otherwise]),
            _ => return None,
        }
    }
    Some(found)
}

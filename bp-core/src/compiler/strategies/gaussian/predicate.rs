//! Predicates of linear-Gaussian variables: the interval on which they hold, and its probability.
//!
//! In: a truth value made of comparisons of linear forms. Out: its probability under a normal law. Invariant: all
//! comparisons use one linear form: there is one comparison, or all compare one variable. Tail probabilities are never
//! computed as differences from one.

use super::offer::degree;
use crate::distribution::ROUNDING;
use crate::ids::{ExpressionId, VariableId};
use crate::model::{Expression, Form, Leaves, LinearForm, Model};
use crate::operators::{Binary, Unary};
use std::collections::BTreeSet;

/// From here on whole numbers are not all numbers of f64.
const WHOLE: f64 = 9_007_199_254_740_992.0;

/// One number: a variable, the bits of its index in its family, and those of its component.
type Number = (VariableId, Option<u64>, Option<u64>);

/// The expression of a predicate that a normal law answers; whether elements of families may stand in it.
pub(crate) fn of_normal(model: &Model, variable: VariableId, elements: bool) -> Option<ExpressionId> {
    let factor = Some(variable).filter(|id| model.is_predicate(*id)).and_then(|id| model.factor_of(id))?;
    let Form::Dirac(root) = model.factors[factor].form else { return None };
    let mut leaves = Vec::new();
    comparisons(model, root, elements, &mut leaves)?;
    // Of a family the element, of a vector the component; their indices are numbers in what a question derives.
    let index = |at| model.constant(at).map_or(u64::MAX, f64::to_bits);
    let variables = |leaf: &ExpressionId| -> BTreeSet<Number> {
        let below = |id| {
            model.nodes_below(id).into_iter().filter_map(|id| match &model.expressions[id] {
                Expression::Variable(use_) => Some((use_.variable, use_.element.map(index))),
                _ => None,
            })
        };
        let parts = model.nodes_below(*leaf).into_iter().filter_map(|id| match &model.expressions[id] {
            Expression::Vector(name, parts) if name == "component" => Some((parts[0], index(parts[1]))),
            _ => None,
        });
        let parts = parts.flat_map(|(vector, at)| below(vector).map(move |(id, of)| (id, of, Some(at))));
        let whole = below(*leaf).filter(|(id, _)| model.components(*id) == 1);
        parts.chain(whole.map(|(id, of)| (id, of, None))).collect()
    };
    let read: Vec<BTreeSet<Number>> = leaves.iter().map(variables).filter(|read| !read.is_empty()).collect();
    let of_one = read.iter().all(|own| own.len() == 1 && *own == read[0]);
    (read.len() == 1 || of_one && !read.is_empty()).then_some(root)
}

/// The comparisons that a truth value is made of; `None` where something else stands in it.
fn comparisons(
    model: &Model,
    id: ExpressionId,
    elements: bool,
    leaves: &mut Vec<ExpressionId>,
) -> Option<()> {
    match &model.expressions[id] {
        Expression::Binary(Binary::And | Binary::Or, left, right) => {
            comparisons(model, *left, elements, leaves)?;
            comparisons(model, *right, elements, leaves)
        }
        Expression::Unary(Unary::Not, operand) => comparisons(model, *operand, elements, leaves),
        Expression::Binary(operator, left, right) if operator.compares() => {
            leaves.push(id);
            (degree(model, *left, elements).is_some() && degree(model, *right, elements).is_some())
                .then_some(())
        }
        _ => None,
    }
}

/// The probabilities that a predicate is false and that it is true, where its linear form ([`LinearForm::of`] its
/// expression) has a normal law of this mean, with this rounding error at most, and deviation.
pub(crate) fn probabilities(
    model: &Model,
    root: ExpressionId,
    [mean, rounding, deviation]: [f64; 3],
    leaves_of: &dyn Leaves,
) -> [f64; 2] {
    if deviation == 0.0 {
        let truth = holds(model, root, &leaves(model, root, leaves_of), (mean, rounding));
        return [!truth, truth].map(|one| f64::from(u8::from(one)));
    }
    let mass = |low: f64, high: f64| mass((low - mean) / deviation, (high - mean) / deviation);
    by_intervals(model, root, &mass, leaves_of)
}

/// The same where the linear form has any law, of which `mass` is the probability of an interval.
pub(crate) fn by_intervals(
    model: &Model,
    root: ExpressionId,
    mass: &dyn Fn(f64, f64) -> f64,
    leaves_of: &dyn Leaves,
) -> [f64; 2] {
    let leaves = leaves(model, root, leaves_of);
    let holds = |at: f64| usize::from(holds(model, root, &leaves, (at, 0.0)));
    let mut probabilities = [0.0; 2];
    let mut edges: Vec<f64> = leaves.iter().filter_map(Leaf::edge).collect();
    edges.sort_by(f64::total_cmp);
    edges.dedup();
    let lows = std::iter::once(f64::NEG_INFINITY).chain(edges.iter().copied());
    let highs = edges.iter().copied().chain([f64::INFINITY]);
    for (low, high) in lows.zip(highs) {
        let inside = match (low.is_finite(), high.is_finite()) {
            (true, true) => 0.5 * low + 0.5 * high,
            (true, false) => low + low.abs().max(1.0),
            (false, true) => high - high.abs().max(1.0),
            (false, false) => 0.0,
        };
        probabilities[holds(inside)] += mass(low, high);
    }
    probabilities
}

/// The same where the linear form is scale · X + shift of a count X, of which `mass` is P(low ≤ X ≤ high).
pub(crate) fn by_counts(
    model: &Model,
    root: ExpressionId,
    (scale, shift): (f64, f64),
    mass: &dyn Fn(f64, f64) -> f64,
    leaves_of: &dyn Leaves,
) -> [f64; 2] {
    let leaves = leaves(model, root, leaves_of);
    let holds = |count: f64| {
        // Neighbouring counts differ.
        let rounding = (ROUNDING * (scale * count).abs().max(shift.abs())).min(0.25 * scale.abs());
        usize::from(holds(model, root, &leaves, (scale * count + shift, rounding)))
    };
    // A number that is a count up to rounding is this count.
    let whole = |edge: f64| match (edge - edge.round()).abs()
        <= ROUNDING * edge.abs().max(shift.abs() / scale.abs())
    {
        true => edge.round(),
        false => edge,
    };
    let edges: Vec<f64> =
        leaves.iter().filter_map(Leaf::edge).map(|edge| whole((edge - shift) / scale)).collect();
    // Beyond 2⁵³ numbers are no single counts, whose probabilities are below 1e-8 there.
    if edges.iter().any(|edge| edge.is_finite() && *edge >= WHOLE) {
        let of_count = |edge: f64| (edge - shift) / scale;
        let between = |low: f64, high: f64| {
            let (low, high) = (of_count(low), of_count(high));
            mass(low.min(high), low.max(high))
        };
        return by_intervals(model, root, &between, leaves_of);
    }
    // Between these counts the predicate does not change.
    let mut first: Vec<f64> = vec![0.0];
    first.extend(
        edges
            .into_iter()
            .filter(|edge| *edge >= 0.0 && edge.is_finite())
            .flat_map(|edge| [edge.ceil(), edge.floor() + 1.0]),
    );
    first.sort_by(f64::total_cmp);
    first.dedup();
    let lasts = first.iter().skip(1).map(|next| next - 1.0).chain([f64::INFINITY]);
    let mut probabilities = [0.0; 2];
    for (first, last) in first.iter().zip(lasts) {
        probabilities[holds(*first)] += mass(*first, last);
    }
    probabilities
}

/// The comparisons of a predicate, as linear forms.
fn leaves(model: &Model, root: ExpressionId, leaves_of: &dyn Leaves) -> Vec<Leaf> {
    let mut leaves = Vec::new();
    comparisons(model, root, true, &mut leaves).expect("internal: the plan has looked at the predicate");
    let line = LinearForm::of(model, root, 0, leaves_of);
    leaves.iter().map(|id| Leaf::of(model, *id, &line, leaves_of)).collect()
}

/// Φ(high) − Φ(low), computed in the smaller tail.
fn mass(low: f64, high: f64) -> f64 {
    let cumulative = |x: f64| Unary::NormalCumulative.apply(x);
    match low > 0.0 {
        true => cumulative(-low) - cumulative(-high),
        false => cumulative(high) - cumulative(low),
    }
}

/// A comparison as a linear form: `scale` · x + `shift` against 0.
struct Leaf {
    id: ExpressionId,
    scale: f64,
    shift: f64,
}

impl Leaf {
    fn of(model: &Model, id: ExpressionId, line: &LinearForm, leaves_of: &dyn Leaves) -> Self {
        let own = LinearForm::of(model, id, 0, leaves_of);
        let first = line.coefficients.iter().find(|(_, coefficient)| **coefficient != 0.0);
        let scale = first.map_or(0.0, |(slot, coefficient)| {
            own.coefficients.get(slot).map_or(0.0, |own| own / coefficient)
        });
        Self { id, scale, shift: own.constant - scale * line.constant }
    }

    fn edge(&self) -> Option<f64> {
        (self.scale != 0.0).then(|| -self.shift / self.scale)
    }
}

/// Whether a predicate holds where the linear form has this value, up to its rounding error.
fn holds(model: &Model, id: ExpressionId, leaves: &[Leaf], (at, rounding): (f64, f64)) -> bool {
    let of = |id: &ExpressionId| holds(model, *id, leaves, (at, rounding));
    match &model.expressions[id] {
        Expression::Binary(Binary::And, left, right) => of(left) && of(right),
        Expression::Binary(Binary::Or, left, right) => of(left) || of(right),
        Expression::Unary(Unary::Not, operand) => !of(operand),
        Expression::Binary(operator, ..) => leaves.iter().find(|leaf| leaf.id == id).is_some_and(|leaf| {
            let left = leaf.scale * at + leaf.shift;
            let is_zero = left.abs() <= leaf.scale.abs() * rounding;
            operator.apply(if is_zero { 0.0 } else { left }, 0.0) != 0.0
        }),
        _ => false,
    }
}

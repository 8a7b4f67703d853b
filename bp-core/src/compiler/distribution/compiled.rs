//! Densities of many instances of one form, compiled.
//!
//! In: instances of a factor, and which slots are fixed. Out: [`Densities`]: the sum of ln of their densities, or of those of some of
//! them, at any values of the other slots. Invariant: the equations are those of `model/evaluate.rs`, `forms/` and `law/`; what is not
//! valid for the form, or has no number, is left to [`Setting::ln_density`], which reports it.

mod assigned;

pub(crate) use assigned::{Assigned, scale_of};

use super::tape::{Cells, Node, Seed, Tape};
use super::{Instance, Setting};
use crate::forms::{bernoulli, row, surely};
use crate::ids::{ExpressionId, ParameterId, VariableId};
use crate::law::{Arithmetic, Constraint, Law};
use crate::model::{Domain, Environment, Expression, Form, Read, VariableUse, row_tolerance};
use crate::operators::{Binary, Unary};
use std::collections::HashMap;

/// Limit of the depth of an expression that is recorded.
const MOST_DEPTH: usize = 200;

/// The compiled densities of instances.
#[derive(Clone, Debug)]
pub(crate) struct Densities {
    tape: Tape,
    /// ln of the density, and whether the numbers of the form are valid.
    wanted: [Node; 2],
}

impl Densities {
    /// The densities of instances of one factor and one component; `fixed` gives the values of slots that never change. `None` where
    /// the form is not compiled.
    pub(crate) fn new(
        setting: &Setting<'_>,
        instances: &[&Instance],
        fixed: &dyn Fn(usize) -> Option<f64>,
    ) -> Option<Self> {
        let mut recording = Recording::new(setting, instances, fixed)?;
        let wanted = recording.form(setting.form_at(instances[0])).ok()?;
        let mut tape = recording.tape;
        let wanted = tape.finish(&wanted);
        Some(Self { tape, wanted: [wanted[0], wanted[1]] })
    }

    /// Σ ln of the densities of some of the instances, by their places; `None` where a number is not valid. `cells` is memory.
    pub(crate) fn ln(&self, rows: &[u32], values: &[f64], cells: &mut Vec<f64>) -> Option<f64> {
        let (ln, holds) = self.tape.sum(self.wanted, rows, values, cells);
        (holds && !ln.is_nan()).then_some(ln)
    }

    /// As [`Densities::ln`]; adds its derivatives by all slots to `slopes`.
    pub(crate) fn slopes(
        &self,
        rows: &[u32],
        values: &[f64],
        cells: &mut Cells,
        slopes: &mut [f64],
    ) -> Option<f64> {
        let (ln, holds) = self.tape.slopes(self.wanted, rows, values, Seed::One, cells, slopes);
        (holds && !ln.is_nan()).then_some(ln)
    }
}

/// What is not compiled.
struct NotCompiled;

/// An evaluation of expressions in all instances together.
struct Recording<'r, 'm> {
    setting: &'r Setting<'m>,
    instances: &'r [&'r Instance],
    component: usize,
    fixed: &'r dyn Fn(usize) -> Option<f64>,
    tape: Tape,
    known: HashMap<(ExpressionId, usize), Node>,
    depth: usize,
}

impl<'r, 'm> Recording<'r, 'm> {
    /// A recording of instances of one factor and one component; `None` of no instance.
    fn new(
        setting: &'r Setting<'m>,
        instances: &'r [&'r Instance],
        fixed: &'r dyn Fn(usize) -> Option<f64>,
    ) -> Option<Self> {
        let (component, tape) = (instances.first()?.component, Tape::new(instances.len()));
        Some(Self { setting, instances, component, fixed, tape, known: HashMap::new(), depth: 0 })
    }

    /// The values of a slot of each instance.
    fn slots(&mut self, slots: Vec<usize>) -> Node {
        match slots.iter().map(|slot| (self.fixed)(*slot)).collect::<Option<Vec<f64>>>() {
            Some(numbers) => self.tape.column(numbers),
            None => self.tape.slots(slots),
        }
    }

    /// The left-hand side of each instance.
    fn left(&mut self) -> Node {
        let slots = self.instances.iter().map(|instance| instance.left[0]).collect();
        self.slots(slots)
    }

    /// The domain of the left-hand side.
    fn domain(&self) -> (VariableId, &Domain) {
        let variable = self.setting.variable_of(self.instances[0].left[0]);
        (variable, &self.setting.model.variables[variable].domain)
    }

    /// ln of the density, and whether the numbers are valid.
    fn form(&mut self, form: &Form) -> Result<[Node; 2], NotCompiled> {
        match form {
            Form::Law { law, arguments } => self.law(*law, arguments),
            Form::Bernoulli(probability, complement) => {
                let p = self.probability(*probability)?;
                let other = complement.map(|id| self.probability(id)).transpose()?;
                let (holds, left) = (bernoulli::holds(&mut self.tape, p, 0.0), self.fixed_value()?);
                let p = bernoulli::probability(&mut self.tape, left, p, other);
                let entries: Vec<ExpressionId> = [*probability].into_iter().chain(*complement).collect();
                Ok(self.ln_of(p, &entries, holds))
            }
            Form::Categorical(entries) => {
                let value = self.fixed_value()?;
                let value = self.tape.known(value).ok_or(NotCompiled)? as usize;
                if self.is_link(entries) {
                    let (p, holds) = (self.operand(entries[value])?, self.tape.constant(1.0));
                    return Ok(self.ln_of(p, &entries[value..=value], holds));
                }
                let all: Vec<Node> =
                    entries.iter().map(|id| self.probability(*id)).collect::<Result<_, _>>()?;
                let holds = row::holds(&mut self.tape, &all, |_| Some(0.0));
                let p = *all.get(value).ok_or(NotCompiled)?;
                Ok(self.ln_of(p, &entries[value..=value], holds))
            }
            Form::If { condition, then, otherwise } => {
                let condition = self.scalar(*condition)?;
                match self.tape.known(condition) {
                    Some(known) => self.form(if known != 0.0 { then } else { otherwise }),
                    None => {
                        let (then, otherwise) = (self.form(then)?, self.form(otherwise)?);
                        Ok([0, 1].map(|at| self.tape.select(condition, then[at], otherwise[at])))
                    }
                }
            }
            Form::Mixture(parts) => self.mixture(parts),
            _ => Err(NotCompiled),
        }
    }

    /// ln of a probability of these expressions, and whether it is valid: one that f64 rounds to 0, or to fewer digits, is not.
    fn ln_of(&mut self, p: Node, entries: &[ExpressionId], holds: Node) -> [Node; 2] {
        let model = self.setting.model;
        if !entries.iter().any(|id| model.is_computed(*id)) {
            return [self.tape.ln(p), holds];
        }
        let least = self.tape.constant(f64::MIN_POSITIVE);
        let is_normal = self.tape.binary(Binary::GreaterOrEqual, p, least);
        [self.tape.ln(p), self.tape.binary(Binary::And, holds, is_normal)]
    }

    /// The fixed value of a finite left-hand side in each instance.
    fn fixed_value(&mut self) -> Result<Node, NotCompiled> {
        let all = self.instances.iter().all(|instance| (self.fixed)(instance.left[0]).is_some());
        if all { Ok(self.left()) } else { Err(NotCompiled) }
    }

    /// A law of a real, or a binomial count all of whose values are in the domain.
    fn law(&mut self, law: Law, arguments: &[ExpressionId]) -> Result<[Node; 2], NotCompiled> {
        let parameters: Vec<Node> = (arguments.iter().zip(law.parameters()))
            .map(|(id, (_, constraint))| match constraint.is_probability() {
                true => self.probability(*id),
                false => self.operand(*id),
            })
            .collect::<Result<_, _>>()?;
        let (variable, domain) = self.domain();
        let left = match (domain, law) {
            (Domain::Real | Domain::Vector(_), _) => self.left(),
            (Domain::Finite { labels, .. }, Law::Binomial) if labels.is_empty() => {
                let (low, last) = (domain.number(0), self.setting.count(variable) as f64 - 1.0);
                let mut trials = (0..self.instances.len()).map(|row| self.tape.number(parameters[0], row));
                if low != 0.0 || !trials.all(|trials| trials.is_some_and(|trials| trials <= last)) {
                    return Err(NotCompiled);
                }
                self.fixed_value()?
            }
            _ => return Err(NotCompiled),
        };
        // A number that is not finite, or a scale that is rounded to 0, makes the density 0, or undefined: the latter is found in the
        // sum.
        let infinity = self.tape.constant(f64::INFINITY);
        let is_open = |constraint: Constraint| matches!(constraint, Constraint::Real | Constraint::Positive);
        let mut holds = law.holds(&mut self.tape, &parameters, |_, constraint| is_open(constraint));
        let mut ln = law.ln_density(&mut self.tape, left, &parameters);
        for (number, (_, constraint)) in parameters.iter().zip(law.parameters()) {
            if *constraint == Constraint::Positive {
                let zero = self.tape.constant(0.0);
                let valid = self.tape.binary(Binary::GreaterOrEqual, *number, zero);
                holds = self.tape.binary(Binary::And, holds, valid);
                let positive = self.tape.greater(*number, zero);
                let finite = self.tape.binary(Binary::Less, *number, infinity);
                let inside = self.tape.binary(Binary::And, positive, finite);
                ln = self.tape.within(inside, ln);
            }
        }
        Ok([ln, holds])
    }

    /// ln Σ wᵢ fᵢ, the largest term apart.
    fn mixture(&mut self, parts: &[(ExpressionId, Form)]) -> Result<[Node; 2], NotCompiled> {
        if self.domain().1.is_finite() {
            return Err(NotCompiled);
        }
        let weights: Vec<Node> =
            parts.iter().map(|(weight, _)| self.probability(*weight)).collect::<Result<_, _>>()?;
        let mut holds = row::holds(&mut self.tape, &weights, |_| Some(0.0));
        let mut terms = Vec::new();
        for (weight, (_, part)) in weights.into_iter().zip(parts) {
            let [ln, valid] = self.form(part)?;
            let ln_weight = self.tape.ln(weight);
            terms.push(self.tape.add(ln_weight, ln));
            holds = self.tape.binary(Binary::And, holds, valid);
        }
        let mut most = terms[0];
        for term in &terms[1..] {
            most = self.tape.binary(Binary::Maximum, most, *term);
        }
        let nothing = self.tape.constant(f64::NEG_INFINITY);
        let is_possible = self.tape.greater(most, nothing);
        let mut sum = self.tape.constant(0.0);
        for term in terms {
            let ratio = self.tape.subtract(term, most);
            let ratio = self.tape.exp(ratio);
            sum = self.tape.add(sum, ratio);
        }
        let ln = self.tape.ln(sum);
        let ln = self.tape.add(most, ln);
        Ok([self.tape.within(is_possible, ln), holds])
    }

    /// A probability; rounding errors beyond [0, 1] are clamped.
    fn probability(&mut self, id: ExpressionId) -> Result<Node, NotCompiled> {
        let (number, model) = (self.operand(id)?, self.setting.model);
        let is_exact = surely::is_probability(model, id) || !model.is_computed(id);
        let tolerance = if is_exact { 0.0 } else { row_tolerance(1) };
        Ok(bernoulli::rounded(&mut self.tape, number, tolerance))
    }

    /// Whether the two probabilities of a truth value are those of a logistic or probit regression, whose sum is one.
    fn is_link(&self, entries: &[ExpressionId]) -> bool {
        let of = |id: ExpressionId| &self.setting.model.expressions[id];
        let [one, other] = entries else { return false };
        let score = |id: ExpressionId| match of(id) {
            Expression::Unary(Unary::NormalCumulative, score) => Some((true, *score)),
            Expression::Binary(Binary::Divide, above, below) => match (of(*above), of(*below)) {
                (Expression::Number(1.0), Expression::Binary(Binary::Add, first, odds)) => {
                    match (of(*first), of(*odds)) {
                        (Expression::Number(1.0), Expression::Unary(Unary::Exponential, minus)) => {
                            match of(*minus) {
                                Expression::Unary(Unary::Negate, score) => Some((false, *score)),
                                _ => None,
                            }
                        }
                        _ => None,
                    }
                }
                _ => None,
            },
            _ => None,
        };
        let (Some(one), Some(other)) = (score(*one), score(*other)) else { return false };
        let negates = |id: ExpressionId, of_what: ExpressionId| matches!(of(id), Expression::Unary(Unary::Negate, operand) if *operand == of_what);
        one.0 == other.0 && (negates(one.1, other.1) || negates(other.1, one.1))
    }
}

impl Environment for Recording<'_, '_> {
    type By = Tape;
    type Stop = NotCompiled;

    fn by(&mut self) -> &mut Tape {
        &mut self.tape
    }

    fn operand(&mut self, id: ExpressionId) -> Read<Self> {
        let key = (id, self.component);
        if let Some(node) = self.known.get(&key) {
            return Ok(*node);
        }
        if self.depth == MOST_DEPTH {
            return Err(NotCompiled);
        }
        self.depth += 1;
        let setting = self.setting;
        let node = self.value(&setting.model.expressions[id]);
        self.depth -= 1;
        let node = node?;
        self.known.insert(key, node);
        Ok(node)
    }

    fn scalar(&mut self, id: ExpressionId) -> Read<Self> {
        let component = std::mem::replace(&mut self.component, 0);
        let node = self.operand(id);
        self.component = component;
        node
    }

    fn parameter(&mut self, parameter: ParameterId, indices: &[ExpressionId]) -> Read<Self> {
        let indices: Vec<Node> = indices.iter().map(|id| self.scalar(*id)).collect::<Result<_, _>>()?;
        let number = |row: usize| {
            let at = indices.iter().map(|node| self.tape.number(*node, row)).collect::<Option<Vec<f64>>>()?;
            Some(self.setting.field(parameter, &at))
        };
        let numbers = (0..self.instances.len()).map(number).collect::<Option<Vec<f64>>>();
        Ok(self.tape.column(numbers.ok_or(NotCompiled)?))
    }

    fn variable(&mut self, use_: &VariableUse) -> Read<Self> {
        let setting = self.setting;
        let variable = &setting.model.variables[use_.variable];
        let component = if setting.components(use_.variable) == 1 { 0 } else { self.component };
        let element = use_.element.map(|element| self.scalar(element)).transpose()?;
        let is_whole = element.is_none() && variable.family.is_some();
        let is_outside = component >= setting.components(use_.variable);
        if matches!(variable.domain, Domain::Bins(_)) || is_whole || is_outside {
            return Err(NotCompiled);
        }
        let slot = |row: usize| {
            let index = element.map(|node| self.tape.number(node, row).ok_or(NotCompiled)).transpose()?;
            setting.slot_at(use_.variable, index, component).ok_or(NotCompiled)
        };
        let slots = (0..self.instances.len()).map(slot).collect::<Result<Vec<usize>, _>>()?;
        let value = self.slots(slots);
        match &variable.domain {
            Domain::Real | Domain::Vector(_) => Ok(value),
            domain => {
                let base = self.tape.constant(domain.base() as f64);
                Ok(self.tape.add(value, base))
            }
        }
    }

    fn index(&mut self, depth: usize) -> Read<Self> {
        let number = |instance: &&Instance| instance.indices.get(depth).copied();
        let numbers = self.instances.iter().map(number).collect::<Option<Vec<f64>>>();
        Ok(self.tape.column(numbers.ok_or(NotCompiled)?))
    }

    fn first(&mut self, _: VariableId, _: Option<(ExpressionId, ExpressionId)>) -> Read<Self> {
        Err(NotCompiled)
    }

    fn other(&mut self, expression: &Expression) -> Read<Self> {
        match expression {
            Expression::Vector(name, parts) if name == "vector" => {
                let part = *parts.get(self.component).ok_or(NotCompiled)?;
                self.scalar(part)
            }
            Expression::Vector(name, parts) if name == "component" => {
                let at = self.scalar(parts[1])?;
                let at =
                    self.tape.known(at).filter(|at| *at >= 0.0 && at.fract() == 0.0).ok_or(NotCompiled)?;
                let component = std::mem::replace(&mut self.component, at as usize);
                let node = self.operand(parts[0]);
                self.component = component;
                node
            }
            _ => Err(NotCompiled),
        }
    }
}

//! Observations over time that may be missing.
//!
//! In: a question over time of finite states, and the observations without which its kernels compute no instant. Out: a program
//! and an ask with the same answers, whose kernels have an input that says whether a number is given. Invariant: a number that
//! is not given is not read.
//!
//! An observed value of a finite Y becomes the evidence of a child: P(seen | Y) is 1 where Y has the value, or where none is given,
//! and else 0 (Pearl, *Probabilistic Reasoning in Intelligent Systems*, 1988). The density of a real on which nothing depends is 1
//! where it is not given.

use crate::analysis::{of_form, relevant_variables};
use crate::ids::{ExpressionId, FactorId, ParameterId, VariableId};
use crate::model::{
    Ask, Domain, Expression, Factor, Finding, Form, IndexSpace, Known, Model, Parameter, ParameterKind,
    Value, Variable, VariableUse,
};
use crate::operators::{Binary, Unary};

/// The program and the ask, and the observations that may be missing: all but reals on which others depend.
pub(super) fn with_missing(model: &Model, ask: &Ask, needed: &[String]) -> (Model, Ask, Vec<String>) {
    let (mut changed, mut known, mut done) = (model.clone(), Vec::new(), Vec::new());
    for item in &ask.known {
        let name = model.variable_name(item.variable);
        let is_needed = item.evidence == Finding::Each && needed.contains(&name);
        let is_finite = model.variables[item.variable].domain.is_finite();
        let evidence = || seen(&mut changed, item.variable, &name);
        match (is_needed && is_finite).then(evidence).flatten() {
            Some(evidence) => known.extend(evidence),
            None => {
                known.push(item.clone());
                let Some(factor) = leaf(model, ask, item.variable).filter(|_| is_needed && !is_finite) else {
                    continue;
                };
                flatten(&mut changed, factor, &name);
            }
        }
        done.extend(is_needed.then_some(name));
    }
    (changed, Ask { known, ..ask.clone() }, done)
}

/// The numbers of the elements of a variable, from the first index; those of one that is no family have none.
fn indices(model: &Model, variable: VariableId) -> Option<Vec<Option<f64>>> {
    let Some(family) = model.variables[variable].family else { return Some(vec![None]) };
    let count = super::open::count(model, &family.over).filter(|_| family.except.is_none())?;
    Some((0..count).map(|place| Some(family.over.first() as f64 + place as f64)).collect())
}

/// A parameter over the indices of a variable.
fn parameter(model: &mut Model, name: String, variable: VariableId) -> ParameterId {
    let over: Vec<IndexSpace> = model.variables[variable].family.iter().map(|family| family.over).collect();
    let kind = ParameterKind::Real;
    model.parameters.push(Parameter { name, kind, default: vec![1.0], rows: Vec::new(), over })
}

/// The name of the input that says whether an observation is given.
fn flag(name: &str) -> String {
    format!("whether {name} is given")
}

/// Adds the evidence of each element of a variable; gives what is known then.
fn seen(model: &mut Model, variable: VariableId, name: &str) -> Option<Vec<Known>> {
    // Numbers of values that differ by less are the same: those of bins are computed.
    let close = match &model.variables[variable].domain {
        Domain::Bins(bins) => {
            bins.edges().windows(2).map(|ends| 0.25 * (ends[1] - ends[0])).fold(f64::INFINITY, f64::min)
        }
        Domain::Boolean | Domain::Finite { .. } => 0.5,
        Domain::Set(_) | Domain::Real | Domain::Vector(_) => return None,
    };
    let all = indices(model, variable)?;
    let [given, value] = [flag(name), name.to_owned()].map(|name| parameter(model, name, variable));
    let mut known = Vec::new();
    for index in all {
        let mut node = |expression: Expression| model.expressions.push(expression);
        let element = index.map(|index| node(Expression::Number(index)));
        let indices: Vec<ExpressionId> = element.into_iter().collect();
        let of = VariableUse { variable, element };
        let own = node(Expression::Variable(of.clone()));
        let wanted = node(Expression::Parameter { parameter: value, indices: indices.clone() });
        let apart = node(Expression::Binary(Binary::Subtract, own, wanted));
        let apart = node(Expression::Unary(Unary::Absolute, apart));
        let close = node(Expression::Number(close));
        let then = node(Expression::Binary(Binary::Less, apart, close));
        let condition = node(Expression::Parameter { parameter: given, indices });
        let otherwise = node(Expression::Number(1.0));
        let probability = node(Expression::If { condition, then, otherwise });
        let name = format!("seen {name}{}", index.map_or_else(String::new, |index| format!("[{index}]")));
        let evidence = model.variables.push(Variable {
            name,
            previous_of: None,
            domain: Domain::Boolean,
            family: None,
            derived: None,
        });
        model.factors.push(Factor {
            left: vec![evidence.into()],
            right: vec![of],
            form: Form::Bernoulli(probability, None),
            products: Vec::new(),
        });
        known.push(Known { variable: evidence, evidence: Finding::Hard(Value::Ordinal(1)) });
    }
    Some(known)
}

/// The factor of a real on which nothing that matters depends.
fn leaf(model: &Model, ask: &Ask, variable: VariableId) -> Option<FactorId> {
    let id = model.factor_of(variable)?;
    let factor = &model.factors[id];
    let is_used = relevant_variables(model, std::slice::from_ref(ask))
        .into_iter()
        .filter_map(|other| model.factor_of(other))
        .any(|other| of_form(model, other).contains(&variable));
    let is_carried = model.variables.values().any(|other| other.previous_of == Some(variable));
    let has_density = factor.form.has_density() && !factor.form.is_improper();
    let has_index = factor.products.len() == usize::from(model.variables[variable].family.is_some());
    (!is_used && !is_carried && has_density && has_index && factor.left.len() == 1).then_some(id)
}

/// Makes the density of a factor 1 where its variable is not given.
fn flatten(model: &mut Model, id: FactorId, name: &str) {
    let variable = model.factors[id].left[0].variable;
    let given = parameter(model, flag(name), variable);
    let index = model.variables[variable].family.map(|_| model.expressions.push(Expression::Index(0)));
    let indices = index.into_iter().collect();
    let condition = model.expressions.push(Expression::Parameter { parameter: given, indices });
    let open = |form| Form::If { condition, then: Box::new(form), otherwise: Box::new(Form::Flat) };
    let form = &mut model.factors[id].form;
    *form = match std::mem::replace(form, Form::Flat) {
        Form::Initial { first, later } => {
            Form::Initial { first: Box::new(open(*first)), later: Box::new(open(*later)) }
        }
        form => open(form),
    };
}

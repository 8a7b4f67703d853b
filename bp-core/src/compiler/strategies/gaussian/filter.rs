//! Linear-Gaussian programs with numbers: a Kalman filter over time, or one conditioning.
//!
//! In: a [`Gaussian`] plan, numbers for the parameters, observations at each instant. Out: a normal [`Belief`] about
//! the searched variables. Invariant: the joint law over all variables of an instant is built factor by factor and
//! conditioned on one observation after the other; only the carried variables are kept for the next instant.

use super::{Gaussian, LinearEquation, NormalLaw};
use crate::error::{Error, Impossible};
use crate::ids::{ParameterId, VariableId};
use crate::model::{Leaves, LinearForm, Model, VariableUse};
use crate::spelling::number as written;
use nalgebra::{DMatrix, DVector};
use std::collections::{HashMap, HashSet};

/// A normal law of named variables.
#[derive(Clone, PartialEq, Debug)]
pub struct Belief {
    /// Names, in the order of the question.
    pub variables: Vec<String>,
    /// Means.
    pub mean: DVector<f64>,
    /// Covariances.
    pub covariance: DMatrix<f64>,
    /// ln of the density of the observations, given the past.
    pub ln_evidence: f64,
    /// The law, in factored form.
    pub(crate) law: NormalLaw,
}

impl Belief {
    /// The belief that a law represents.
    pub(super) fn of(variables: Vec<String>, law: NormalLaw, ln_evidence: f64) -> Self {
        Self { variables, mean: law.means(), covariance: law.covariance(), ln_evidence, law }
    }

    /// Mean of one variable.
    pub fn mean_of(&self, name: &str) -> Option<f64> {
        self.variables.iter().position(|variable| variable == name).map(|row| self.mean[row])
    }
}

/// One variable: its mean as a linear form of earlier rows, and the standard deviation of its own noise; infinite for a flat one.
#[derive(Clone, Debug)]
struct Extension {
    terms: Vec<(usize, f64)>,
    constant: f64,
    deviation: f64,
}

/// A linear and Gaussian program with numbers for its parameters; over time, a Kalman filter.
#[derive(Clone, Debug)]
pub struct Filter {
    question: String,
    pub(super) searched: Vec<(String, usize)>,
    /// Rows of the joint law that are observed.
    observed: Vec<(String, usize)>,
    /// Rows of X, whose law becomes that of X^-1: the first rows.
    pub(super) carried: Vec<usize>,
    extensions: Vec<Extension>,
    /// The law of the carried variables, its rows in the order of `carried`.
    pub(super) law: NormalLaw,
}

/// Upper limit on the instants that [`Filter::settle`] tries.
const MOST_INSTANTS: usize = 1_000_000;

impl Filter {
    /// A filter at rest: the carried variables are 0 with certainty.
    ///
    /// # Errors
    /// A parameter without a value or with a value outside its range; a standard deviation that is not positive.
    pub fn new(model: &Model, plan: &Gaussian, parameters: &[(&str, f64)]) -> Result<Self, Error> {
        let mut values: HashMap<&str, f64> = HashMap::new();
        for parameter in model.parameters.values().filter(|parameter| parameter.over.is_empty()) {
            let given = parameters.iter().find(|(name, _)| *name == parameter.name).map(|(_, value)| *value);
            let value = given.or(parameter.default_number()).ok_or_else(|| {
                Error::input(&parameter.name, "this parameter was not given, and it has no default")
            })?;
            if let Some(expected) = parameter.kind.refuses(value) {
                return Err(Error::input(
                    &parameter.name,
                    format!("it is {}, but it must be {expected}", written(value)),
                ));
            }
            values.insert(&parameter.name, value);
        }
        if let Some((name, _)) = parameters.iter().find(|(name, _)| !values.contains_key(name)) {
            return Err(Error::input(*name, format!("program `{}` has no such parameter", model.name)));
        }
        let carried = plan.carried.iter();
        let carried: Vec<(VariableId, usize)> = carried
            .flat_map(|(_, previous)| {
                (0..model.components(*previous)).map(|component| (*previous, component))
            })
            .collect();
        let mut rows: HashMap<(VariableId, usize), usize> = HashMap::new();
        // The law of the carried variables before the first instant; a variable without an initial form is 0.
        let mut law = NormalLaw::new(observes_dirac(plan));
        for slot in &carried {
            rows.insert(*slot, law.len());
            law.extend(&[], 0.0, 0.0);
        }
        for source in &plan.initial {
            for component in 0..model.components(source.variable) {
                let Extension { terms, constant, deviation } =
                    extension(model, source, component, &Rows { model, rows: &rows, values: &values })?;
                rows.insert((source.variable, component), law.len());
                law.extend(&terms, constant, deviation);
            }
        }
        let law = law.select(carried.iter().map(|slot| rows[slot])).reduced();
        rows = carried.iter().enumerate().map(|(row, slot)| (*slot, row)).collect();
        let mut extensions = Vec::new();
        for source in &plan.sources {
            for component in 0..model.components(source.variable) {
                extensions.push(extension(
                    model,
                    source,
                    component,
                    &Rows { model, rows: &rows, values: &values },
                )?);
                rows.insert((source.variable, component), carried.len() + extensions.len() - 1);
            }
        }
        let named = |variable: VariableId| {
            let (count, name) = (model.components(variable), model.variable_name(variable));
            let of =
                |component: usize| if count == 1 { name.clone() } else { format!("{name}[{component}]") };
            let rows = &rows;
            (0..count).map(|component| (of(component), rows[&(variable, component)])).collect::<Vec<_>>()
        };
        let searched = plan.asks.iter().flat_map(|ask| &ask.searched).flat_map(|item| named(item.variable));
        let carried: Vec<usize> =
            plan.carried.iter().flat_map(|(now, _)| named(*now)).map(|(_, row)| row).collect();
        let real = |variable: &&VariableId| !model.variables[**variable].domain.is_finite();
        Ok(Self {
            searched: searched.collect(),
            observed: plan.observed.iter().filter(real).flat_map(|variable| named(*variable)).collect(),
            question: model.ask_text(&plan.asks[0]),
            law,
            carried,
            extensions,
        })
    }

    /// The names of the observed variables; a vector is named by its components (`V[0]`).
    pub fn observed(&self) -> impl Iterator<Item = &str> {
        self.observed.iter().map(|(name, _)| name.as_str())
    }

    /// The joint law of this instant before conditioning: first the carried variables, then the others.
    pub(super) fn predict(&self) -> NormalLaw {
        let mut law = self.law.clone();
        for Extension { terms, constant, deviation } in &self.extensions {
            law.extend(terms, *constant, *deviation);
        }
        law
    }

    /// The gain of a searched variable for an observed one, at this instant.
    pub fn gain_of(&self, variable: &str, observed: &str) -> Option<f64> {
        let row = self.searched.iter().find(|(name, _)| name == variable)?.1;
        self.observed.iter().find(|(name, _)| name == observed)?;
        // The gain is the mean when all means are 0, this observation is 1 and the others are 0.
        let mut law = self.predict().centred();
        for (name, row) in &self.observed {
            law.observe(*row, if name == observed { 1.0 } else { 0.0 })?;
        }
        Some(law.mean(row))
    }

    /// Conditions one instant on its observations and returns the belief; keeps the law that the next instant needs.
    ///
    /// # Errors
    /// An observation that is missing, unknown or not finite.
    pub fn step(&mut self, observations: &[(&str, f64)]) -> Result<Belief, Error> {
        if let Some((name, _)) =
            observations.iter().find(|(name, _)| self.observed.iter().all(|(row, _)| row != name))
        {
            return Err(Error::input(*name, "the question does not know this variable"));
        }
        for (name, _) in &self.observed {
            if observations.iter().all(|(given, _)| given != name) {
                return Err(Error::input(name, "it was not observed"));
            }
        }
        let (law, ln_evidence) = self.advance(self.predict(), observations)?;
        proper(&law, observations.len(), &self.question)?;
        self.law = law.select(self.carried.iter().copied()).reduced();
        Ok(self.belief(&law.select(self.searched()), ln_evidence))
    }

    /// Conditions the law of an instant on its observed variables; returns ln of their density.
    ///
    /// # Errors
    /// An observation that is not finite, or that the others exclude.
    pub(super) fn advance(
        &self,
        mut law: NormalLaw,
        observations: &[(&str, f64)],
    ) -> Result<(NormalLaw, f64), Error> {
        let mut ln_evidence = 0.0;
        for (name, row) in &self.observed {
            if let Some((_, value)) = observations.iter().find(|(given, _)| given == name) {
                ln_evidence += observe(&mut law, *row, *value, name, &self.question)?;
            }
        }
        Ok((law, ln_evidence))
    }

    /// The rows of the searched variables.
    pub(super) fn searched(&self) -> impl Iterator<Item = usize> {
        self.searched.iter().map(|(_, row)| *row)
    }

    /// The belief about the searched variables, from their law.
    pub(super) fn belief(&self, law: &NormalLaw, ln_evidence: f64) -> Belief {
        let variables = self.searched.iter().map(|(name, _)| name.clone()).collect();
        Belief::of(variables, law.clone(), ln_evidence)
    }

    /// Iterates the covariance until it, and so the gains, are stationary; means do not change.
    ///
    /// # Errors
    /// The covariance does not converge: a carried variable is not observed (its noise accumulates without bound).
    pub fn settle(&mut self) -> Result<(), Error> {
        let law = self.law.clone();
        let at_rest: Vec<(String, f64)> = self.observed.iter().map(|(name, _)| (name.clone(), 0.0)).collect();
        let at_rest: Vec<(&str, f64)> = at_rest.iter().map(|(name, value)| (name.as_str(), *value)).collect();
        let mut before = law.covariance();
        for _ in 0..MOST_INSTANTS {
            self.step(&at_rest)?;
            let covariance = self.law.covariance();
            let scale = covariance.amax().max(f64::MIN_POSITIVE);
            if (&covariance - before).amax() <= 1e-14 * scale {
                self.law.take_means(&law);
                return Ok(());
            }
            before = covariance;
        }
        Err(Error::input("covariance", "it does not converge: a carried variable is not observed"))
    }
}

/// Whether a variable without noise of its own may be observed.
pub(super) fn observes_dirac(plan: &Gaussian) -> bool {
    let observed: HashSet<VariableId> = plan.observed.iter().copied().collect();
    let diracs = plan
        .sources
        .iter()
        .filter(|source| source.deviation.is_none() && source.mean.is_some())
        .map(|source| source.variable);
    let previous = plan.carried.iter().map(|(_, previous)| *previous);
    diracs.chain(previous).any(|variable| observed.contains(&variable))
}

/// Refuses a law of which a flat variable is not determined by the observations.
pub(super) fn proper(law: &NormalLaw, seen: usize, question: &str) -> Result<(), Error> {
    let flat = law.flats();
    if flat == 0 {
        return Ok(());
    }
    let reason = format!(
        "the posterior is improper: with {seen} observed {}, {flat} {} of its `flat` variables {} not determined; observe \
         more, or give a proper form such as `normal(0, 100)`",
        if seen == 1 { "number" } else { "numbers" },
        if flat == 1 { "direction" } else { "directions" },
        if flat == 1 { "is" } else { "are" },
    );
    Err(Error::Unplanned { question: question.to_owned(), reason })
}

/// Conditions a law on an observation; returns ln of its density.
pub(super) fn observe(
    law: &mut NormalLaw,
    row: usize,
    value: f64,
    name: &str,
    question: &str,
) -> Result<f64, Error> {
    if !value.is_finite() {
        return Err(Error::input(name, format!("an observation must be finite, but it is {value}")));
    }
    let determined = law.mean(row);
    law.observe(row, value).ok_or_else(|| {
        let reason = format!(
            "`{name} = {value}` is impossible: earlier observations determine `{name}` = {determined}"
        );
        Error::Impossible(Impossible { question: question.to_owned(), reason: Some(reason) })
    })
}

/// The leaves of an expression: variables are rows.
struct Rows<'r> {
    model: &'r Model,
    rows: &'r HashMap<(VariableId, usize), usize>,
    values: &'r HashMap<&'r str, f64>,
}

impl Leaves for Rows<'_> {
    fn parameter(&self, parameter: ParameterId, _: &[f64]) -> f64 {
        let name = self.model.parameters[parameter].name.as_str();
        self.values.get(name).copied().unwrap_or(f64::NAN)
    }

    fn variable(&self, use_: &VariableUse, _: Option<f64>, component: usize) -> Option<usize> {
        self.rows.get(&(use_.variable, component)).copied()
    }

    fn index(&self, _: usize) -> f64 {
        f64::NAN
    }
}

/// One component of a variable, as a linear form of the rows before it.
fn extension(
    model: &Model,
    source: &LinearEquation,
    component: usize,
    leaves: &Rows<'_>,
) -> Result<Extension, Error> {
    let (form, deviation) = law_of(model, source, component, leaves, &String::new)?;
    let terms = form.coefficients.into_iter().collect();
    Ok(Extension { terms, constant: form.constant, deviation })
}

/// The mean of a component of a variable, linear in others, and the deviation of its own noise; `context` says where an
/// error is.
pub(super) fn law_of(
    model: &Model,
    source: &LinearEquation,
    component: usize,
    leaves: &dyn Leaves,
    context: &dyn Fn() -> String,
) -> Result<(LinearForm, f64), Error> {
    let Some(mean) = source.mean else { return Ok((LinearForm::default(), f64::INFINITY)) };
    let form = LinearForm::of(model, mean, component, leaves);
    let deviation = source.deviation.map_or(0.0, |id| LinearForm::of(model, id, component, leaves).constant);
    let refused = |message: String| {
        let factor = &model.factors[source.factor];
        Error::Number { form: model.form_text(factor, &factor.form), context: context(), message }
    };
    let variance = deviation * deviation;
    if source.deviation.is_some() && !(deviation > 0.0 && deviation.is_finite()) {
        let found = written(deviation);
        return Err(refused(format!("the standard deviation is {found}, but it must be greater than 0")));
    }
    if source.deviation.is_some() && !(variance > 0.0 && variance.is_finite()) {
        let found = written(deviation);
        return Err(refused(format!(
            "the standard deviation is {found}, whose square is beyond the range of numbers"
        )));
    }
    let mut numbers = [form.constant].into_iter().chain(form.coefficients.values().copied());
    if let Some(number) = numbers.find(|number| !number.is_finite()) {
        return Err(refused(format!("the mean is {}, but it must be a finite number", written(number))));
    }
    Ok((form, deviation))
}

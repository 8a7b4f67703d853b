//! Linear and Gaussian programs, run: a filter over time, or one conditioning.
//!
//! In: a [`Gaussian`] plan, numbers for the parameters, observations at each instant. Out: a normal [`Belief`]
//! about the searched variables. Invariant: the joint law over all variables of an instant is built factor by
//! factor, conditioned once, and only what the next instant needs is carried.

mod frontier;
mod smooth;

pub(crate) use frontier::condition;

use crate::error::Error;
use crate::ids::VariableId;
use crate::model::Model;
use crate::plan::{Gaussian, LinearForm, Source, components};
use crate::spelling::number as written;
use nalgebra::{DMatrix, DVector};
use std::collections::HashMap;

/// A normal law of named variables.
#[derive(Clone, PartialEq, Debug)]
pub struct Belief {
    /// Names, in the order of the question.
    pub variables: Vec<String>,
    /// Means.
    pub mean: DVector<f64>,
    /// Covariances.
    pub covariance: DMatrix<f64>,
    /// ln of the density of what was observed, given the past.
    pub ln_evidence: f64,
}

impl Belief {
    /// Mean of one variable.
    pub fn mean_of(&self, name: &str) -> Option<f64> {
        self.variables.iter().position(|variable| variable == name).map(|row| self.mean[row])
    }

    /// Standard deviation of one variable.
    pub fn deviation_of(&self, name: &str) -> Option<f64> {
        let row = self.variables.iter().position(|variable| variable == name)?;
        Some(self.covariance[(row, row)].max(0.0).sqrt())
    }
}

/// The normal law of all variables of an instant: first what was carried, then the others.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Joint {
    mean: DVector<f64>,
    covariance: DMatrix<f64>,
    ln_evidence: f64,
}

/// One variable: row in the joint law, mean as a row over earlier rows, variance of its own noise.
#[derive(Clone, Debug)]
struct Extension {
    coefficients: DVector<f64>,
    constant: f64,
    variance: f64,
}

/// A linear and Gaussian program with numbers for its parameters; over time, a Kalman filter.
#[derive(Clone, Debug)]
pub struct Filter {
    searched: Vec<(String, usize)>,
    /// Rows of the joint law that are observed.
    observed: Vec<(String, usize)>,
    /// Rows of X, whose law becomes that of X^-1: the first rows.
    carried: Vec<usize>,
    extensions: Vec<Extension>,
    mean: DVector<f64>,
    covariance: DMatrix<f64>,
}

/// How many instants [`Filter::settle`] tries.
const MOST_INSTANTS: usize = 1_000_000;

impl Filter {
    /// A filter that starts at rest: what it carries is 0, and known to be.
    ///
    /// # Errors
    /// A parameter without a value, or whose value it cannot have; a standard deviation that is not positive.
    pub fn new(model: &Model, plan: &Gaussian, parameters: &[(&str, f64)]) -> Result<Self, Error> {
        let mut values: HashMap<&str, f64> = HashMap::new();
        for parameter in model.parameters.values() {
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
        let parameter = |name: &str| values[name];
        let mut rows: HashMap<(VariableId, usize), usize> = HashMap::new();
        for (_, previous) in &plan.carried {
            for component in 0..components(model, *previous) {
                rows.insert((*previous, component), rows.len());
            }
        }
        let start = rows.len();
        let mut extend = |source: &Source, all: usize| -> Result<Vec<(usize, Extension)>, Error> {
            let mut extensions = Vec::new();
            for component in 0..components(model, source.variable) {
                let row = rows.get(&(source.variable, component)).copied().unwrap_or(all + component);
                extensions
                    .push((row, extension(model, source, component, &rows, row.max(start), &parameter)?));
            }
            for (component, (row, _)) in extensions.iter().enumerate() {
                rows.insert((source.variable, component), *row);
            }
            Ok(extensions)
        };
        // Before the first instant: the law of what is carried.
        let (mut mean, mut covariance) = (DVector::zeros(start), DMatrix::zeros(start, start));
        for source in &plan.initial {
            for (row, extension) in extend(source, start)? {
                mean[row] = extension.coefficients.dot(&mean) + extension.constant;
                let cross = &covariance * &extension.coefficients;
                covariance.set_column(row, &cross);
                covariance.set_row(row, &cross.transpose());
                covariance[(row, row)] = extension.coefficients.dot(&cross) + extension.variance;
            }
        }
        let mut extensions = Vec::new();
        for source in &plan.sources {
            extensions.extend(
                extend(source, start + extensions.len())?.into_iter().map(|(_, extension)| extension),
            );
        }
        let named = |variable: VariableId| {
            let (count, name) = (components(model, variable), model.variable_name(variable));
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
            mean,
            covariance,
            carried,
            extensions,
        })
    }

    /// The names of what is observed: of a vector, those of its components (`V[0]`).
    pub fn observed(&self) -> impl Iterator<Item = &str> {
        self.observed.iter().map(|(name, _)| name.as_str())
    }

    /// The joint law of this instant, before anything is observed.
    fn predict(&self) -> (DVector<f64>, DMatrix<f64>) {
        let (start, size) = (self.carried.len(), self.carried.len() + self.extensions.len());
        let (mut mean, mut covariance) = (DVector::zeros(size), DMatrix::zeros(size, size));
        mean.rows_mut(0, start).copy_from(&self.mean);
        covariance.view_mut((0, 0), (start, start)).copy_from(&self.covariance);
        for (offset, extension) in self.extensions.iter().enumerate() {
            let row = start + offset;
            mean[row] = extension.coefficients.dot(&mean.rows(0, row)) + extension.constant;
            let cross = covariance.view((0, 0), (row, row)) * &extension.coefficients;
            covariance[(row, row)] = extension.coefficients.dot(&cross) + extension.variance;
            covariance.view_mut((0, row), (row, 1)).copy_from(&cross);
            covariance.view_mut((row, 0), (1, row)).copy_from(&cross.transpose());
        }
        (mean, covariance)
    }

    /// The gain of one searched variable for one observed one, at this instant.
    pub fn gain_of(&self, variable: &str, observed: &str) -> Option<f64> {
        let row = self.searched.iter().find(|(name, _)| name == variable)?.1;
        let column = self.observed.iter().position(|(name, _)| name == observed)?;
        let observed: Vec<_> = self.observed.iter().map(|(name, row)| (name.as_str(), *row, 0.0)).collect();
        let (gain, _) = gain(&observed, &self.predict().1).ok()?;
        Some(gain[(row, column)])
    }

    /// One instant: observations in, belief out; what the next instant needs is kept.
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
        let joint = self.advance(observations)?;
        Ok(self.belief(&joint))
    }

    /// One instant, of which some of what may be observed is: the law of all its variables, and of what was carried.
    ///
    /// # Errors
    /// An observation that is not finite, or that follows from the others.
    pub(crate) fn advance(&mut self, observations: &[(&str, f64)]) -> Result<Joint, Error> {
        let (mut mean, mut covariance) = self.predict();
        let mut ln_evidence = 0.0;
        let given =
            |name: &str| observations.iter().find(|(given, _)| *given == name).map(|(_, value)| *value);
        let observed: Vec<(&str, usize, f64)> = self
            .observed
            .iter()
            .filter_map(|(name, row)| Some((name.as_str(), *row, given(name)?)))
            .collect();
        if !observed.is_empty() {
            if let Some((name, _, value)) = observed.iter().find(|(_, _, value)| !value.is_finite()) {
                return Err(Error::input(*name, format!("an observation must be finite, but it is {value}")));
            }
            let rows: Vec<usize> = observed.iter().map(|(_, row, _)| *row).collect();
            let surprise = DVector::from_iterator(
                observed.len(),
                observed.iter().map(|(_, row, value)| value - mean[*row]),
            );
            let (gain, innovation) = gain(&observed, &covariance)?;
            let solved = innovation.cholesky().expect("internal: the gain was computed from it");
            let ln_determinant = 2.0 * solved.l().diagonal().map(f64::ln).sum();
            let count = observed.len() as f64;
            ln_evidence = -0.5
                * (surprise.dot(&solved.solve(&surprise))
                    + ln_determinant
                    + count * std::f64::consts::TAU.ln());
            mean += &gain * surprise;
            let reduced = &covariance - &gain * covariance.select_rows(&rows);
            covariance = (&reduced + reduced.transpose()) * 0.5;
        }
        self.mean = mean.select_rows(&self.carried);
        self.covariance = covariance.select_rows(&self.carried).select_columns(&self.carried);
        Ok(Joint { mean, covariance, ln_evidence })
    }

    /// What a joint law says of what is searched.
    pub(crate) fn belief(&self, joint: &Joint) -> Belief {
        let rows: Vec<usize> = self.searched.iter().map(|(_, row)| *row).collect();
        Belief {
            variables: self.searched.iter().map(|(name, _)| name.clone()).collect(),
            mean: joint.mean.select_rows(&rows),
            covariance: joint.covariance.select_rows(&rows).select_columns(&rows),
            ln_evidence: joint.ln_evidence,
        }
    }

    /// Lets the covariance, and so the gains, settle to what they become after a long time; means stay.
    ///
    /// # Errors
    /// They do not settle: something is carried that nothing observes (a sum of noise grows for ever).
    pub fn settle(&mut self) -> Result<(), Error> {
        let mean = self.mean.clone();
        let at_rest: Vec<(String, f64)> = self.observed.iter().map(|(name, _)| (name.clone(), 0.0)).collect();
        let at_rest: Vec<(&str, f64)> = at_rest.iter().map(|(name, value)| (name.as_str(), *value)).collect();
        for _ in 0..MOST_INSTANTS {
            let before = self.covariance.clone();
            self.step(&at_rest)?;
            let scale = self.covariance.amax().max(f64::MIN_POSITIVE);
            if (&self.covariance - before).amax() <= 1e-14 * scale {
                self.mean = mean;
                return Ok(());
            }
        }
        Err(Error::input("covariance", "it does not settle: something is carried that nothing observes"))
    }
}

/// One component of a variable, as a row over the rows before it.
fn extension(
    model: &Model,
    source: &Source,
    component: usize,
    rows: &HashMap<(VariableId, usize), usize>,
    size: usize,
    parameter: &dyn Fn(&str) -> f64,
) -> Result<Extension, Error> {
    let (form, variance) = law_of(model, source, component, parameter)?;
    let mut coefficients = DVector::zeros(size);
    for (variable, coefficient) in &form.coefficients {
        coefficients[rows[variable]] = *coefficient;
    }
    Ok(Extension { coefficients, constant: form.constant, variance })
}

/// The mean of a component of a variable, linear in others, and the variance of its own noise.
fn law_of(
    model: &Model,
    source: &Source,
    component: usize,
    parameter: &dyn Fn(&str) -> f64,
) -> Result<(LinearForm, f64), Error> {
    let form = LinearForm::of(model, source.mean, component, parameter);
    let deviation =
        source.deviation.map_or(0.0, |id| LinearForm::of(model, id, component, parameter).constant);
    let refused = |message: String| {
        let factor = model.factor_of(source.variable).map(|factor| &model.factors[factor]);
        let name = || model.variable_name(source.variable);
        let form = factor.map_or_else(name, |factor| model.form_text(factor, &factor.form));
        Error::Number { form, context: String::new(), message }
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
    Ok((form, variance))
}

/// K = Σ Hᵀ (H Σ Hᵀ)⁻¹, and H Σ Hᵀ.
fn gain(
    observed: &[(&str, usize, f64)],
    covariance: &DMatrix<f64>,
) -> Result<(DMatrix<f64>, DMatrix<f64>), Error> {
    let rows: Vec<usize> = observed.iter().map(|(_, row, _)| *row).collect();
    let cross = covariance.select_columns(&rows);
    let innovation = cross.select_rows(&rows);
    let inverse = innovation.clone().cholesky().ok_or_else(|| {
        let names: Vec<_> = observed.iter().map(|(name, _, _)| *name).collect();
        Error::input(
            names.join(" "),
            "its observations have no density together: one follows from the others",
        )
    })?;
    Ok((cross * inverse.inverse(), innovation))
}

//! One conditioning of a long program: only what is still needed is kept.
//!
//! In: a [`Gaussian`] plan of single numbers that carries nothing, numbers for its parameters, what is observed. Out: the
//! [`Belief`] that [`super::Filter`] gives, up to rounding. Invariant: a variable enters parents first, is conditioned at
//! once where it is observed, and leaves after the last form that speaks of it: a chain of n variables takes n steps and
//! the memory of two.

use super::{Belief, law_of};
use crate::error::Error;
use crate::ids::VariableId;
use crate::model::{Expression, Model};
use crate::plan::{Gaussian, LinearForm};
use nalgebra::{DMatrix, DVector};
use std::collections::{HashMap, HashSet};

/// The variables that are still needed, with their normal law.
#[derive(Default)]
struct Frontier {
    variables: Vec<VariableId>,
    places: HashMap<VariableId, usize>,
    mean: Vec<f64>,
    /// Row by row.
    covariance: Vec<Vec<f64>>,
}

impl Frontier {
    /// A variable enters: Σ coefficient · variable + constant, and noise of its own.
    fn enter(&mut self, variable: VariableId, form: &LinearForm, noise: f64) {
        let terms: Vec<(usize, f64)> =
            form.coefficients.iter().map(|((id, _), coefficient)| (self.places[id], *coefficient)).collect();
        let mean = terms.iter().map(|(place, c)| c * self.mean[*place]).sum::<f64>() + form.constant;
        let cross: Vec<f64> = (0..self.mean.len())
            .map(|row| terms.iter().map(|(place, c)| c * self.covariance[row][*place]).sum())
            .collect();
        let variance = terms.iter().map(|(place, c)| c * cross[*place]).sum::<f64>() + noise;
        self.covariance.iter_mut().zip(&cross).for_each(|(row, cross)| row.push(*cross));
        self.covariance.push(cross);
        self.covariance.last_mut().expect("internal: a row was added").push(variance);
        self.places.insert(variable, self.mean.len());
        self.variables.push(variable);
        self.mean.push(mean);
    }

    /// The last variable that entered is observed; gives ln of the density of its value, `None` where it has none.
    fn observe(&mut self, value: f64) -> Option<f64> {
        let last = self.mean.len() - 1;
        let (variance, surprise) = (self.covariance[last][last], value - self.mean[last]);
        if variance.is_nan() || variance <= 0.0 {
            return None;
        }
        let column = self.covariance[last].clone();
        for (row, cross) in column.iter().enumerate() {
            let gain = cross / variance;
            self.mean[row] += gain * surprise;
            self.covariance[row].iter_mut().zip(&column).for_each(|(cell, other)| *cell -= gain * other);
        }
        // It is known now, without the rounding of the above.
        self.mean[last] = value;
        self.covariance.iter_mut().for_each(|row| row[last] = 0.0);
        self.covariance[last].fill(0.0);
        Some(-0.5 * (surprise * surprise / variance + variance.ln() + std::f64::consts::TAU.ln()))
    }

    /// A variable is not needed any more.
    fn leave(&mut self, variable: VariableId) {
        let Some(place) = self.places.remove(&variable) else { return };
        self.variables.swap_remove(place);
        self.mean.swap_remove(place);
        self.covariance.swap_remove(place);
        for row in &mut self.covariance {
            row.swap_remove(place);
        }
        if let Some(moved) = self.variables.get(place) {
            self.places.insert(*moved, place);
        }
    }
}

/// The law of what is searched, given what is observed.
///
/// # Errors
/// A standard deviation that is not positive; a mean that is not finite; an observation that follows from others.
pub(crate) fn condition(
    model: &Model,
    plan: &Gaussian,
    parameter: &dyn Fn(&str) -> f64,
    observed: &HashMap<VariableId, f64>,
) -> Result<Belief, Error> {
    let searched: Vec<VariableId> =
        plan.asks.iter().flat_map(|ask| &ask.searched).map(|item| item.variable).collect();
    let kept: HashSet<VariableId> = searched.iter().copied().collect();
    // After which source each variable leaves.
    let mut last: HashMap<VariableId, usize> = HashMap::new();
    for (position, source) in plan.sources.iter().enumerate() {
        last.insert(source.variable, position);
        for id in model.nodes_below(source.mean) {
            if let Expression::Variable(use_) = &model.expressions[id] {
                last.insert(use_.variable, position);
            }
        }
    }
    let mut leaving: Vec<Vec<VariableId>> = vec![Vec::new(); plan.sources.len()];
    for (variable, position) in last.into_iter().filter(|(variable, _)| !kept.contains(variable)) {
        leaving[position].push(variable);
    }
    let (mut frontier, mut ln_evidence) = (Frontier::default(), 0.0);
    for (source, leaving) in plan.sources.iter().zip(&mut leaving) {
        let name = || model.variable_name(source.variable);
        let (form, noise) = law_of(model, source, 0, parameter)?;
        frontier.enter(source.variable, &form, noise);
        if let Some(value) = observed.get(&source.variable) {
            if !value.is_finite() {
                let message = format!("an observation must be finite, but it is {value}");
                return Err(Error::input(name(), message));
            }
            ln_evidence += frontier.observe(*value).ok_or_else(|| {
                Error::input(name(), "its observations have no density together: one follows from the others")
            })?;
        }
        // In the order of the model, so that the same question gives the same bits.
        leaving.sort_unstable();
        leaving.iter().for_each(|variable| frontier.leave(*variable));
    }
    let places: Vec<usize> = searched.iter().map(|variable| frontier.places[variable]).collect();
    let cell = |row: usize, column: usize| frontier.covariance[places[row]][places[column]];
    Ok(Belief {
        variables: searched.iter().map(|variable| model.variable_name(*variable)).collect(),
        mean: DVector::from_iterator(places.len(), places.iter().map(|place| frontier.mean[*place])),
        covariance: DMatrix::from_fn(places.len(), places.len(), cell),
        ln_evidence,
    })
}

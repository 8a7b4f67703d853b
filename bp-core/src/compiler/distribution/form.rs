//! Evaluation of a form to a distribution.
//!
//! In: an instance of a factor and the values of its right-hand variables. Out: a [`Distribution`]. Invariant: the
//! probabilities of a finite left-hand side sum to one, or are all 0 (a Dirac outside its domain, weights that are all
//! 0); no NaN is passed on.

mod components;

use super::least::Least;
use super::number::Scope;
use super::{Distribution, Instance, Setting, law};
use crate::error::Error;
use crate::exec::scalar::{Extended, Scalar};
use crate::forms::{bernoulli, dirac, mixture, normal_bins, truncated, uniform};
use crate::ids::{ExpressionId, VariableId};
use crate::law::{Law, Numbers, Support, Wide};
use crate::model::{Domain, Form, VariableUse};
use crate::radix;

impl Setting<'_> {
    /// The distribution of an instance's left-hand side at these values of the variables.
    ///
    /// # Errors
    /// A number outside the range of the form ([`Error::Number`]); a form without numbers of its own.
    pub fn distribution(&self, instance: &Instance, values: &[f64]) -> Result<Distribution, Error> {
        let scope = Scope {
            setting: self,
            values,
            indices: &instance.indices,
            component: instance.component,
            instead: None,
        };
        let form = &self.model.factors[instance.factor].form;
        let evaluation = Evaluation { scope, instance };
        let distribution = evaluation.form(form)?;
        if let Distribution::Finite(probabilities) = &distribution
            && probabilities.iter().any(|probability| !(*probability >= 0.0 && probability.is_finite()))
        {
            let message = "its probabilities are beyond the range of numbers".to_owned();
            return Err(evaluation.refused(form, message));
        }
        Ok(distribution)
    }

    /// ln of the density of an instance at the value of its left-hand side.
    ///
    /// # Errors
    /// As [`Setting::distribution`].
    pub fn ln_density(&self, instance: &Instance, values: &[f64]) -> Result<f64, Error> {
        if let Some(ln) = self.ln_count(instance, values)? {
            return Ok(ln);
        }
        Ok(self.distribution(instance, values)?.ln_density(self.left_value(instance, values)))
    }

    /// Whether the left-hand side is a binomial count, whose probability is computed without a sum where that is possible.
    pub(crate) fn is_count(&self, instance: &Instance) -> bool {
        matches!(self.form_at(instance), Form::Law { law: Law::Binomial, .. })
    }

    /// ln of the probability of a binomial count all of whose values are in the domain, so that nothing is normalised.
    fn ln_count(&self, instance: &Instance, values: &[f64]) -> Result<Option<f64>, Error> {
        let mut form = self.form_at(instance);
        while let Form::If { condition, then, otherwise } = form {
            let condition = self.scope(instance, values).with_component(0).number(*condition);
            form = if condition != 0.0 { then } else { otherwise };
        }
        let (Form::Law { law: Law::Binomial, arguments }, [slot]) = (form, instance.left.as_slice()) else {
            return Ok(None);
        };
        let variable = self.variable_of(*slot);
        let domain = &self.model.variables[variable].domain;
        if !matches!(domain, Domain::Finite { labels, .. } if labels.is_empty()) || values[*slot].is_nan() {
            return Ok(None);
        }
        let evaluation = Evaluation { scope: self.scope(instance, values), instance };
        let parameters = evaluation.parameters(form, Law::Binomial, arguments)?;
        let last = domain.number(0) + self.count(variable) as f64 - 1.0;
        let is_whole = domain.number(0) == 0.0 && parameters[0] <= last;
        let number = self.number_at(variable, values[*slot]);
        Ok(is_whole.then(|| law::ln_density(Law::Binomial, number, &parameters)))
    }

    /// The value of an instance's left-hand side; of several variables together, their joint ordinal.
    pub fn left_value(&self, instance: &Instance, values: &[f64]) -> f64 {
        match instance.left.as_slice() {
            [one] => values[*one],
            several if several.iter().any(|slot| values[*slot].is_nan()) => f64::NAN,
            several => {
                let digit = |slot: &usize| (values[*slot] as usize, self.count(self.variable_of(*slot)));
                radix::position(several.iter().map(digit)) as f64
            }
        }
    }

    /// Writes a value of an instance's left-hand side into an assignment.
    pub fn put(&self, instance: &Instance, value: f64, values: &mut [f64]) {
        if let [one] = instance.left.as_slice() {
            values[*one] = value;
            return;
        }
        let counts = instance.left.iter().rev().map(|slot| self.count(self.variable_of(*slot)));
        for (slot, ordinal) in instance.left.iter().rev().zip(radix::ordinals(value as usize, counts)) {
            values[*slot] = ordinal as f64;
        }
    }
}

/// The context in which a form is evaluated.
pub(super) struct Evaluation<'e> {
    pub(super) scope: Scope<'e>,
    pub(super) instance: &'e Instance,
}

impl Evaluation<'_> {
    pub(super) fn left(&self) -> VariableId {
        self.scope.setting.variable_of(self.instance.left[0])
    }

    fn count(&self) -> usize {
        let count = |slot: &usize| self.scope.setting.count(self.scope.setting.variable_of(*slot));
        self.instance.left.iter().map(count).product()
    }

    fn unplanned(&self, reason: String) -> Error {
        Error::Unplanned { question: self.scope.setting.model.name.clone(), reason }
    }

    fn numbers(&self, ids: &[ExpressionId]) -> Vec<f64> {
        ids.iter().map(|id| self.scope.number(*id)).collect()
    }

    /// The row of a table for the values of these variables.
    fn row_of(&self, right: &[VariableUse]) -> usize {
        let setting = self.scope.setting;
        // An unknown value counts as the first one.
        let digit =
            |use_: &VariableUse| (self.scope.value(use_).max(0.0) as usize, setting.count(use_.variable));
        radix::position(right.iter().map(digit))
    }

    /// A form's distribution.
    fn form(&self, form: &Form) -> Result<Distribution, Error> {
        let setting = self.scope.setting;
        let (left, count) = (self.left(), self.count());
        let domain = &setting.model.variables[left].domain;
        Ok(match form {
            Form::Uniform => {
                Distribution::Finite(vec![uniform::probability(&mut Numbers, count as f64); count])
            }
            Form::Bernoulli(probability, complement) => {
                let probability = self.probability(form, *probability)?;
                let complement = complement.map(|id| self.probability(form, id)).transpose()?;
                let of = |truth| bernoulli::probability(&mut Wide, truth, probability, complement);
                Distribution::finite(vec![of(Extended::ZERO), of(Extended::ONE)])
            }
            Form::Categorical(entries) => Distribution::finite(self.probabilities(form, entries)?),
            Form::Table(rows) => {
                let row = self.row_of(&setting.model.factors[self.instance.factor].right);
                let row =
                    rows.get(row).ok_or_else(|| self.unplanned("a table has too few rows".to_owned()))?;
                Distribution::finite(self.probabilities(form, row)?)
            }
            Form::Constants(numbers) => {
                let row = self.row_of(&setting.model.factors[self.instance.factor].right);
                let row = numbers.chunks_exact(count.max(1)).nth(row);
                Distribution::Finite(
                    row.ok_or_else(|| self.unplanned("a table has too few rows".to_owned()))?.to_vec(),
                )
            }
            Form::Law { law, arguments } => {
                let parameters = self.parameters(form, *law, arguments)?;
                match domain.is_finite() {
                    true => Distribution::finite(law::over(setting, left, *law, &parameters, None)),
                    false => Distribution::Law(*law, parameters),
                }
            }
            Form::Dirichlet(parameters) => self.share(form, parameters)?,
            Form::NormalVector { mean, covariance } => self.normal_component(form, *mean, covariance)?,
            Form::Multinomial { trials, probabilities } => self.count_of(form, *trials, probabilities)?,
            Form::Ordered(inner) => match (inner.as_ref(), domain) {
                (Form::Law { law, arguments }, Domain::Vector(length)) => {
                    let parameters = self.parameters(inner, *law, arguments)?;
                    let above = self.before().last().copied();
                    let draws = length - self.instance.component;
                    Distribution::Least(Least { law: *law, parameters, draws, above })
                }
                _ => return Err(self.unplanned("`ordered` takes a distribution of a real".to_owned())),
            },
            Form::Mixture(parts) => self.mixture(form, parts, domain)?,
            Form::Truncated { form: inner, low, high } => {
                let bounds = self.bounds(form, [self.scope.number(*low), self.scope.number(*high)])?;
                if let (Form::Law { law, arguments }, Some(_)) = (inner.as_ref(), domain.bins()) {
                    let parameters = self.parameters(inner, *law, arguments)?;
                    return Ok(Distribution::finite(law::over(
                        setting,
                        left,
                        *law,
                        &parameters,
                        Some(bounds),
                    )));
                }
                match (inner.as_ref(), self.form(inner)?) {
                    (_, finite @ (Distribution::Finite(_) | Distribution::Wide(_))) => {
                        let bounds = bounds.map(Extended::from_f64);
                        let inside = |(ordinal, probability): (usize, Extended)| {
                            let number = Extended::from_f64(setting.number_at(left, ordinal as f64));
                            truncated::density(&mut Wide, probability, number, bounds)
                        };
                        let probabilities = finite.extended().unwrap_or_default();
                        let inside = probabilities.into_iter().enumerate().map(inside).collect();
                        Distribution::finite(law::shares(inside))
                    }
                    (_, Distribution::Law(law, parameters)) => {
                        // A bound that is a count up to rounding is this count.
                        let is_count = law.support() == Support::Counts;
                        let whole = |bound| if is_count { dirac::whole(&mut Numbers, bound) } else { bound };
                        let bounds = bounds.map(whole);
                        let mass = law::mass(law, bounds, law::exactly(law, &parameters));
                        Distribution::Truncated { law, parameters, bounds, mass }
                    }
                    (form, _) => {
                        return Err(self.unplanned(format!(
                            "`truncated` takes a distribution such as `normal`, not `{}`",
                            form.name()
                        )));
                    }
                }
            }
            Form::NormalBins { mean, deviation } => {
                let [mean, deviation, _] = self.parameters(form, Law::Normal, &[*mean, *deviation])?;
                let by = &mut Wide;
                let [mean, deviation, bins] = [mean, deviation, (count - 1) as f64].map(Extended::from_f64);
                let is_beyond = normal_bins::is_beyond(by, mean, bins) != Extended::ZERO;
                let probability = |bin: usize| {
                    let bin = Extended::from_f64(bin as f64);
                    match is_beyond {
                        true => normal_bins::beyond(by, bin),
                        false => normal_bins::within(by, bin, bins, [mean, deviation]),
                    }
                };
                Distribution::finite((0..count).map(probability).collect())
            }
            Form::Dirac(value) => {
                let number = self.finite(form, self.determined(*value))?;
                if !domain.is_finite() {
                    return Ok(Distribution::Point(number));
                }
                // In a bin a number needs not be whole.
                let number =
                    if domain.bins().is_some() { number } else { dirac::whole(&mut Numbers, number) };
                let value = setting.value_at(left, number);
                let value = value.unwrap_or(f64::NAN);
                let is = |ordinal: usize| dirac::probability(&mut Numbers, ordinal as f64, value);
                Distribution::Finite((0..count).map(is).collect())
            }
            Form::Previous { of, at: None, otherwise } => {
                let kept = format!("previous {}", setting.model.variable_name(*of));
                match setting.inputs.find(&kept) {
                    Some(kept) if kept.len() == count && domain.is_finite() => {
                        Distribution::Finite(self.weights::<Numbers>(form, kept.to_vec())?)
                    }
                    _ => self.form(otherwise)?,
                }
            }
            Form::Weights(weight) => {
                let slot = self.instance.left[0];
                let at = |ordinal: usize| Scope { instead: Some((slot, ordinal as f64)), ..self.scope };
                let numbers: Vec<f64> = (0..count).map(|ordinal| at(ordinal).number(*weight)).collect();
                Distribution::finite(law::shares(match numbers.iter().all(|number| number.is_normal()) {
                    true => {
                        self.weights::<Numbers>(form, numbers)?.into_iter().map(Extended::from_f64).collect()
                    }
                    // The probabilities may be too small for f64.
                    false => {
                        let wide = (0..count).map(|ordinal| at(ordinal).number_by(*weight, Wide));
                        self.weights::<Wide>(form, wide.collect())?
                    }
                }))
            }
            Form::Flat | Form::HalfFlat => {
                let head = setting.model.head(&setting.model.factors[self.instance.factor]);
                return Err(self.unplanned(format!("`{head}` is improper: {}", Form::FLAT)));
            }
            Form::Initial { first, later } => match setting.first {
                Some(true) => self.form(first)?,
                Some(false) => self.form(later)?,
                None => {
                    let head = setting.model.head(&setting.model.factors[self.instance.factor]);
                    return Err(self.unplanned(format!(
                        "`{head}` has a form of its own at the first instant: ask over time, such as `filter P(…)`"
                    )));
                }
            },
            Form::If { condition, then, otherwise } => {
                let condition = Scope { component: 0, ..self.scope }.number(*condition);
                self.form(if condition != 0.0 { then } else { otherwise })?
            }
            Form::Unknown(_) => {
                let head = setting.model.head(&setting.model.factors[self.instance.factor]);
                return Err(self
                    .unplanned(format!("`{head}` is `unknown`: learn it from data first, with `bp learn`")));
            }
            Form::Ask { path, given } if setting.model.subroutine(path).is_some() => {
                self.subroutine(path, given, count)?
            }
            Form::Previous { .. } | Form::Ask { .. } => {
                let head = setting.model.head(&setting.model.factors[self.instance.factor]);
                return Err(self.unplanned(format!("`{head}` depends on another program or another cell")));
            }
        })
    }

    /// The answer of a subroutine at the values of its known variables.
    fn subroutine(&self, path: &str, given: &[VariableId], count: usize) -> Result<Distribution, Error> {
        let setting = self.scope.setting;
        let given: Vec<VariableUse> = given.iter().map(|variable| (*variable).into()).collect();
        let row = self.row_of(&given);
        let table = setting.model.subroutine(path).map_or(&[][..], |subroutine| &subroutine.table);
        match table.chunks_exact(count.max(1)).nth(row) {
            Some(row) => Ok(Distribution::Finite(row.to_vec())),
            None => Err(self.unplanned(format!("`{path}` has not been asked yet; link the model first"))),
        }
    }

    fn mixture(
        &self,
        form: &Form,
        parts: &[(ExpressionId, Form)],
        domain: &Domain,
    ) -> Result<Distribution, Error> {
        let weights: Vec<ExpressionId> = parts.iter().map(|(weight, _)| *weight).collect();
        let weights = self.row(form, &weights)?;
        let parts: Vec<(f64, Distribution)> = (weights.into_iter().zip(parts))
            .map(|(weight, (_, part))| Ok((weight, self.form(part)?)))
            .collect::<Result<_, Error>>()?;
        if !domain.is_finite() {
            return Ok(Distribution::Mixture(parts));
        }
        let parts: Vec<(Extended, Vec<Extended>)> = (parts.into_iter())
            .map(|(weight, part)| {
                let part = part.extended().expect("internal: a finite variable has a finite form");
                (Extended::from_f64(weight), part)
            })
            .collect();
        let at = |ordinal: usize| {
            let parts = parts.iter().map(|(weight, part)| (*weight, part[ordinal]));
            mixture::density(&mut Wide, parts)
        };
        let sum = (0..self.count()).map(at).collect();
        Ok(Distribution::finite(sum))
    }
}

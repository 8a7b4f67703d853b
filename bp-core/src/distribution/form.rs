//! From a form to its distribution.
//!
//! In: an instance of a factor and the values of its right-hand variables. Out: a [`Distribution`]. Invariant: the
//! probabilities of a finite left-hand side sum to one, or are all 0 (a Dirac outside its domain, weights without any);
//! no NaN is given on.

use super::number::Scope;
use super::{Distribution, Instance, Setting, law};
use crate::error::Error;
use crate::exec::scalar::{Extended, Scalar};
use crate::ids::{ExpressionId, VariableId};
use crate::law::Law;
use crate::model::{Domain, Form};

impl Setting<'_> {
    /// The distribution of an instance's left-hand side where variables have these values.
    ///
    /// # Errors
    /// A number that the form cannot have ([`Error::Number`]); a form that has no numbers of its own.
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

    /// ln of the density that an instance gives to the value which its left-hand side has.
    ///
    /// # Errors
    /// As [`Setting::distribution`].
    pub fn ln_density(&self, instance: &Instance, values: &[f64]) -> Result<f64, Error> {
        Ok(self.distribution(instance, values)?.ln_density(self.left_value(instance, values)))
    }

    /// The value of an instance's left-hand side; of several variables together, their joint ordinal.
    pub fn left_value(&self, instance: &Instance, values: &[f64]) -> f64 {
        match instance.left.as_slice() {
            [one] => values[*one],
            several => several
                .iter()
                .fold(0.0, |joint, slot| joint * self.count(self.variable_of(*slot)) as f64 + values[*slot]),
        }
    }

    /// Writes a value of an instance's left-hand side into an assignment.
    pub fn put(&self, instance: &Instance, value: f64, values: &mut [f64]) {
        let mut rest = value;
        for (position, slot) in instance.left.iter().enumerate().rev() {
            let count = self.count(self.variable_of(*slot)) as f64;
            values[*slot] = if position == 0 { rest } else { rest % count };
            rest = (rest / count).floor();
        }
    }
}

/// A form that is being evaluated.
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

    /// A form's distribution.
    fn form(&self, form: &Form) -> Result<Distribution, Error> {
        let setting = self.scope.setting;
        let (left, count) = (self.left(), self.count());
        let domain = &setting.model.variables[left].domain;
        Ok(match form {
            Form::Uniform => Distribution::Finite(vec![1.0 / count as f64; count]),
            Form::Bernoulli(probability) => {
                let probability = self.probability(form, self.scope.number(*probability))?;
                Distribution::Finite(vec![1.0 - probability, probability])
            }
            Form::Categorical(entries) => Distribution::Finite(self.row(form, self.numbers(entries))?),
            Form::Table(rows) => {
                let row = (setting.model.factors[self.instance.factor].right.iter()).fold(0, |row, use_| {
                    row * setting.count(use_.variable) + self.scope.value(use_).max(0.0) as usize
                });
                let row =
                    rows.get(row).ok_or_else(|| self.unplanned("a table has too few rows".to_owned()))?;
                Distribution::Finite(self.row(form, self.numbers(row))?)
            }
            Form::Constants(numbers) => {
                let row = (setting.model.factors[self.instance.factor].right.iter()).fold(0, |row, use_| {
                    row * setting.count(use_.variable) + self.scope.value(use_).max(0.0) as usize
                });
                let row = numbers.chunks_exact(count.max(1)).nth(row);
                Distribution::Finite(
                    row.ok_or_else(|| self.unplanned("a table has too few rows".to_owned()))?.to_vec(),
                )
            }
            Form::Law { law, arguments } => {
                let parameters = self.parameters(form, *law, arguments)?;
                match domain.is_finite() {
                    true => Distribution::finite(law::over(setting, left, *law, &parameters)),
                    false => Distribution::Law(*law, parameters),
                }
            }
            Form::Dirichlet(parameters) => self.share(form, parameters)?,
            Form::Mixture(parts) => self.mixture(form, parts, domain)?,
            Form::Truncated { form: inner, low, high } => {
                let bounds = self.bounds(form, [self.scope.number(*low), self.scope.number(*high)])?;
                match (inner.as_ref(), self.form(inner)?) {
                    (_, finite @ (Distribution::Finite(_) | Distribution::Wide(_))) => {
                        let inside = |(ordinal, probability): (usize, Extended)| {
                            let number = setting.number_at(left, ordinal as f64);
                            if bounds[0] <= number && number <= bounds[1] {
                                probability
                            } else {
                                Extended::ZERO
                            }
                        };
                        let probabilities = finite.extended().unwrap_or_default();
                        let inside = probabilities.into_iter().enumerate().map(inside).collect();
                        Distribution::finite(law::shares(inside))
                    }
                    (_, Distribution::Law(law, parameters)) => {
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
                let [mean, deviation] = self.parameters(form, Law::Normal, &[*mean, *deviation])?;
                Distribution::finite(normal_bins(count - 1, mean, deviation))
            }
            Form::Dirac(value) => {
                let number = self.finite(form, self.scope.number(*value))?;
                if !domain.is_finite() {
                    return Ok(Distribution::Point(number));
                }
                let value = setting.value_at(left, number);
                let is = |ordinal: usize| f64::from(u8::from(Some(ordinal as f64) == value));
                Distribution::Finite((0..count).map(is).collect())
            }
            Form::Previous { of, at: None, otherwise } => {
                let kept = format!("previous {}", setting.model.variable_name(*of));
                match setting.inputs.find(&kept) {
                    Some(kept) if kept.len() == count && domain.is_finite() => {
                        Distribution::Finite(self.weights(form, kept.to_vec())?)
                    }
                    _ => self.form(otherwise)?,
                }
            }
            Form::Weights(weight) => {
                let slot = self.instance.left[0];
                let at = |ordinal: usize| Scope { instead: Some((slot, ordinal as f64)), ..self.scope };
                let numbers: Vec<f64> = (0..count).map(|ordinal| at(ordinal).number(*weight)).collect();
                Distribution::finite(law::shares(match numbers.iter().all(|number| number.is_normal()) {
                    true => self.weights(form, numbers)?.into_iter().map(Extended::from_f64).collect(),
                    // Perhaps one that f64 does not hold.
                    false => {
                        let wide = (0..count).map(|ordinal| at(ordinal).number_in(*weight));
                        self.weights::<Extended>(form, wide.collect())?
                    }
                }))
            }
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

    /// What a subroutine answers where its known variables have these values.
    fn subroutine(&self, path: &str, given: &[VariableId], count: usize) -> Result<Distribution, Error> {
        let setting = self.scope.setting;
        let row = given.iter().fold(0, |row, variable| {
            row * setting.count(*variable) + self.scope.value(&(*variable).into()).max(0.0) as usize
        });
        let table = setting.model.subroutine(path).map_or(&[][..], |subroutine| &subroutine.table);
        match table.chunks_exact(count.max(1)).nth(row) {
            Some(row) => Ok(Distribution::Finite(row.to_vec())),
            None => Err(self.unplanned(format!("`{path}` has not been asked yet; link the model first"))),
        }
    }

    /// The law of a component of a vector of proportions, given those before it.
    fn share(&self, form: &Form, parameters: &[ExpressionId]) -> Result<Distribution, Error> {
        let slot = self.instance.left[0];
        let before = &self.scope.values[slot - self.instance.component..slot];
        Ok(Distribution::Share(self.dirichlet(form, self.numbers(parameters))?.share(before)))
    }

    fn mixture(
        &self,
        form: &Form,
        parts: &[(ExpressionId, Form)],
        domain: &Domain,
    ) -> Result<Distribution, Error> {
        let weights = self.row(form, parts.iter().map(|(weight, _)| self.scope.number(*weight)).collect())?;
        let parts: Vec<(f64, Distribution)> = (weights.into_iter().zip(parts))
            .map(|(weight, (_, part))| Ok((weight, self.form(part)?)))
            .collect::<Result<_, Error>>()?;
        if !domain.is_finite() {
            return Ok(Distribution::Mixture(parts));
        }
        let mut sum = vec![Extended::ZERO; self.count()];
        for (weight, part) in parts {
            let weight = Extended::from_f64(weight);
            let part = part.extended().expect("internal: a finite variable has a finite form");
            sum.iter_mut().zip(part).for_each(|(sum, part)| *sum = *sum + weight * part);
        }
        Ok(Distribution::finite(sum))
    }
}

/// "Nothing", then `count` unit bins, the first of which takes all that lies below it. Above the mean a bin is a difference of
/// upper tails, Φ(−b) − Φ(−a): there Φ(b) − Φ(a) would cancel.
fn normal_bins(count: usize, mean: f64, deviation: f64) -> Vec<Extended> {
    let standard = |edge: usize| (edge as f64 - mean) / deviation;
    let normal_cumulative = |x: f64| Extended::from_f64(x).normal_cumulative();
    let mut probabilities = vec![Extended::ZERO; count + 1];
    if mean >= count as f64 + 0.5 {
        probabilities[0] = Extended::ONE;
        return probabilities;
    }
    probabilities[0] = normal_cumulative(-standard(count));
    for (bin, probability) in probabilities.iter_mut().enumerate().skip(1) {
        let (low, high) = (standard(bin - 1), standard(bin));
        *probability = match bin {
            1 => normal_cumulative(high),
            _ if low > 0.0 => normal_cumulative(-low) - normal_cumulative(-high),
            _ => normal_cumulative(high) - normal_cumulative(low),
        };
    }
    probabilities
}

//! The factor that gives the observations probability 0.
//!
//! In: the values of the observed slots. Out: a description of the first factor whose variables are all known and whose
//! probability is 0, or whose form has no possible value where its right-hand side is known. Invariant: such a factor
//! excludes the evidence, whatever the others are. A variable is known if it is observed, or has one possible value
//! where its parents are known.

use super::{Distribution, Instance, Setting};
use crate::error::{Error, Impossible};
use crate::exec::scalar::{Extended, Scalar};
use crate::spelling::exact;

impl Setting<'_> {
    /// "`P(C | B)` is 0 for `C = true` where `B = false`", if there is such a factor; unobserved slots are NaN.
    pub fn zero_factor(&self, values: &[f64]) -> Option<String> {
        self.zero_factor_but(values, &|_| false)
    }

    /// The same; the values of some slots are examples, which the text leaves out.
    pub fn zero_factor_but(&self, values: &[f64], is_example: &dyn Fn(usize) -> bool) -> Option<String> {
        let mut values = values.to_vec();
        let mut is_zero = |instance: &Instance| {
            let right = self.model.factors[instance.factor].right.iter();
            let mut right = right.flat_map(|use_| self.slots_of(use_.variable));
            let is_known = |slot: usize| !values[slot].is_nan();
            let mut left = instance.left.iter().copied();
            match (right.all(is_known), left.all(is_known)) {
                (false, _) => false,
                (true, true) => self.ln_density(instance, &values).is_ok_and(|ln| ln == f64::NEG_INFINITY),
                (true, false) => {
                    let Ok(distribution) = self.distribution(instance, &values) else { return false };
                    let is_point = matches!(distribution, Distribution::Point(_));
                    let only = distribution.only_value();
                    let possible = distribution
                        .extended()
                        .map(|all| all.iter().filter(|p| **p > Extended::ZERO).count());
                    let is_free = instance.left.iter().all(|slot| values[*slot].is_nan());
                    if let (Some(only), true, true) = (only, is_point || possible == Some(1), is_free) {
                        self.put(instance, only, &mut values);
                    }
                    possible == Some(0)
                }
            }
        };
        let instance = self.ordered().ok()?.into_iter().find(&mut is_zero)?;
        let factor = &self.model.factors[instance.factor];
        let listed = |slots: &mut dyn Iterator<Item = usize>| {
            let texts: Vec<String> =
                slots.map(|slot| format!("`{}`", self.observed(slot, values[slot]))).collect();
            texts.join(", ")
        };
        let left = match instance.left.iter().all(|slot| !values[*slot].is_nan()) {
            true => listed(&mut instance.left.iter().copied()),
            false => "every value".to_owned(),
        };
        let right = factor.right.iter().flat_map(|use_| self.slots_of(use_.variable));
        let right = listed(&mut right.filter(|slot| !is_example(*slot)));
        let context = if right.is_empty() { right } else { format!(" where {right}") };
        Some(format!("`{}` is 0 for {left}{context}", self.model.head(factor)))
    }

    /// The error of evidence that no draw met; it is impossible if a factor excludes it.
    pub fn unmet(&self, question: String, values: &[f64], draws: usize) -> Error {
        match self.zero_factor(values) {
            Some(reason) => Error::Impossible(Impossible { question, reason: Some(reason) }),
            None => Error::unmet(question, draws),
        }
    }

    /// An observed value in its written form: `Z[2] = high`.
    pub(crate) fn observed(&self, slot: usize, value: f64) -> String {
        let variable = self.variable_of(slot);
        let domain = &self.model.variables[variable].domain;
        let value = match domain.is_finite() {
            true => domain.value_spelled(value as usize),
            false => exact(value),
        };
        let (name, written) = (self.model.variable_name(variable), self.model.spelled(variable));
        let element = self.slot_name(slot);
        format!("{written}{} = {value}", element.strip_prefix(&name).unwrap_or_default())
    }
}

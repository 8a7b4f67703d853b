//! The factor that gives the observations probability 0.
//!
//! In: the values of the observed slots. Out: a description of the first factor whose variables are all observed and
//! whose probability is 0, or whose form has no possible value where its right-hand side is observed. Invariant: such a
//! factor excludes the evidence, whatever the others are.

use super::{Distribution, Setting};
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
        let is_zero = |instance: &super::Instance| {
            let right = self.model.factors[instance.factor].right.iter();
            let mut right = right.flat_map(|use_| self.slots_of(use_.variable));
            let is_known = |slot: usize| !values[slot].is_nan();
            let mut left = instance.left.iter().copied();
            match (right.all(is_known), left.all(is_known)) {
                (false, _) => false,
                (true, true) => self.ln_density(instance, values).is_ok_and(|ln| ln == f64::NEG_INFINITY),
                (true, false) => {
                    let distribution = self.distribution(instance, values).ok();
                    let all = distribution.and_then(Distribution::extended);
                    all.is_some_and(|all| all.iter().all(|p| *p == Extended::ZERO))
                }
            }
        };
        let instance = self.ordered().ok()?.into_iter().find(is_zero)?;
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

//! The laws of components of a vector, given the earlier ones.
//!
//! In: an instance of a form of a vector. Out: a [`Distribution`] of one component. Invariant: the product over the components is the
//! form of the vector.

use super::Evaluation;
use crate::distribution::Distribution;
use crate::distribution::check::must;
use crate::error::Error;
use crate::ids::ExpressionId;
use crate::law::{Conditional, Constraint, Law};
use crate::model::Form;

impl Evaluation<'_> {
    /// The law of one component of a vector of proportions, given the earlier ones.
    pub(super) fn share(&self, form: &Form, parameters: &[ExpressionId]) -> Result<Distribution, Error> {
        Ok(Distribution::Share(self.dirichlet(form, self.numbers(parameters))?.share(self.before())))
    }

    /// The components of a vector before this one.
    pub(super) fn before(&self) -> &[f64] {
        let slot = self.instance.left[0];
        &self.scope.values[slot - self.instance.component..slot]
    }

    /// The law of one component of a normal vector, given those before it that have a value.
    pub(super) fn normal_component(
        &self,
        form: &Form,
        mean: ExpressionId,
        covariance: &[Vec<ExpressionId>],
    ) -> Result<Distribution, Error> {
        let scope = self.scope.with_component(0);
        let covariance = self.scope.setting.covariance(covariance, |id| scope.number(id));
        let covariance = covariance.map_err(|why| self.refused(form, why))?;
        let (before, component) = (self.before(), self.instance.component);
        let known: Vec<usize> = (0..component).filter(|at| !before[*at].is_nan()).collect();
        let Conditional { weights, deviation } = covariance.conditional(&known, component);
        let mean = |at: usize| self.scope.with_component(at).number(mean);
        let shifts = weights.iter().zip(&known).map(|(weight, at)| weight * (before[*at] - mean(*at)));
        let mean = mean(component) + shifts.sum::<f64>();
        if let Some(expected) = Constraint::Real.refuses(mean) {
            return Err(self.refused(form, must("the mean", mean, &format!("be {expected}"))));
        }
        Ok(match deviation > 0.0 {
            true => Distribution::Law(Law::Normal, [mean, deviation, 0.0]),
            false => Distribution::Point(mean),
        })
    }

    /// The law of one count of a multinomial law, given those before it: of the trials that these leave, binomial; the last is
    /// what is left.
    pub(super) fn count_of(
        &self,
        form: &Form,
        trials: ExpressionId,
        probabilities: &[ExpressionId],
    ) -> Result<Distribution, Error> {
        let (trials, row) = (self.scope.number(trials), self.row(form, probabilities)?);
        if let Some(expected) = Constraint::Count.refuses(trials) {
            return Err(self.refused(form, must("the number of trials", trials, &format!("be {expected}"))));
        }
        let (before, component) = (self.before(), self.instance.component);
        let left = (trials - before.iter().sum::<f64>()).max(0.0);
        let rest: f64 = row[component..].iter().sum();
        if component + 1 == row.len() {
            return Ok(Distribution::Point(left));
        }
        let share = if rest > 0.0 { (row[component] / rest).min(1.0) } else { 0.0 };
        Ok(Distribution::Law(Law::Binomial, [left, share, 0.0]))
    }
}

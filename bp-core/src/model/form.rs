//! Forms: the distribution that a factor of the decomposition has.
//!
//! In: expressions over the factor's right-hand variables. Out: a [`Form`]. Invariant: a form says what was
//! meant, not how it is computed; its density is written in one place, `lower/density.rs`.

mod noisy;
mod regression;
mod softmax;
mod succession;

use crate::ids::{ExpressionId, VariableId};
use crate::law::{Dirichlet, Law};
use serde::{Deserialize, Serialize};

/// How far the probabilities of a row may sum from one, and how far a computed one may lie beyond 0 or 1: rounding, also
/// that of f32.
pub fn row_tolerance(entries: usize) -> f64 {
    1e-6 + 1e-7 * entries as f64
}

/// The distribution of a factor's left-hand variable, given its right-hand ones.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub enum Form {
    /// Every value alike.
    Uniform,
    /// True with this probability.
    Bernoulli(ExpressionId),
    /// One probability for each value, in the domain's order.
    Categorical(Vec<ExpressionId>),
    /// Probabilities in rows: one row for each combination of right-hand values (in the factor's order, last
    /// one fastest), one entry for each left-hand value.
    Table(Vec<Vec<ExpressionId>>),
    /// A table whose entries are all known numbers, row after row in the order of `Table`: what network files hold, a
    /// million entries without a node for each.
    Constants(Vec<f64>),
    /// A law of one number. Of a real, its density. Over integers, its density at each, normalised over them. Over
    /// bins, its mass in each, normalised over the domain; on a circle it goes round.
    Law {
        /// Which.
        law: Law,
        /// Its parameters, in its order.
        arguments: Vec<ExpressionId>,
    },
    /// Proportions that sum to one, a Dirichlet law of a vector: one parameter for each component.
    Dirichlet(Vec<ExpressionId>),
    /// One of several forms, by chance: Σ wᵢ fᵢ. The weights sum to one.
    Mixture(Vec<(ExpressionId, Form)>),
    /// A form between two bounds, normalised over what is left; both bounds are inside.
    Truncated {
        /// The form.
        form: Box<Form>,
        /// Lower bound.
        low: ExpressionId,
        /// Upper bound.
        high: ExpressionId,
    },
    /// To be learned from data. It answers nothing until then.
    Unknown(Fit),
    /// A normal law read on an axis of unit bins ]j−1; j], j = 1..=N, the first of which takes all that lies
    /// below it, preceded by one label that takes all that lies beyond N (paper, Eq. 4). A mean beyond N + ½
    /// stands for "nothing there" and gives the label for sure.
    NormalBins {
        /// Mean, in bins from the inner edge.
        mean: ExpressionId,
        /// Standard deviation, in bins, > 0.
        deviation: ExpressionId,
    },
    /// This value, for sure. A value outside the domain has probability 0.
    Dirac(ExpressionId),
    /// What the last step's answer said of `of` (at cell `at`): its marginal. `otherwise` holds before the
    /// first step and outside the grid; without it, uniform.
    Previous {
        /// The variable, now; its marginal of a step ago is meant.
        of: VariableId,
        /// The cell at which it was kept.
        at: Option<VariableId>,
        /// What holds where nothing was kept.
        otherwise: Box<Form>,
    },
    /// The answer of another program, bound from outside under `path`: for an observed variable, its
    /// likelihood; it depends on the right-hand variables `given` (and on the plate).
    Ask {
        /// What was written, in normal spacing.
        path: String,
        /// The right-hand variables on which the answer depends.
        given: Vec<VariableId>,
    },
    /// Proportional to this, over the values of the left variable, of which it may speak. An index of the plate in it,
    /// where the plate runs over that same set, means the left variable's value.
    Weights(ExpressionId),
    /// One form or the other; a `match` is a chain of these.
    If {
        /// A truth value.
        condition: ExpressionId,
        /// Where it is true.
        then: Box<Form>,
        /// Where it is false.
        otherwise: Box<Form>,
    },
}

/// How a form that is to be learned is fitted, once for each combination of right-hand values.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub enum Fit {
    /// Laplace's law of succession: (nᵢ + 1) / (N + k).
    LaplaceSuccession,
    /// Relative frequencies: nᵢ / N.
    Histogram,
    /// Frequencies with a prior count for each value, a Dirichlet law: (nᵢ + a) / (N + k a).
    Dirichlet(f64),
    /// The chance of `true`, with a beta law before: (n₁ + a) / (N + a + b).
    Beta(f64, f64),
    /// The parameters of a law, of maximum likelihood.
    Law {
        /// Which.
        law: Law,
        /// Parameters that are known: the number of trials of a `binomial`.
        known: Vec<f64>,
    },
    /// A normal law whose variance is the sum of squares divided by N − 1.
    UnbiasedNormal,
    /// A law with a conjugate law before; the mean of what is believed after is put in.
    Conjugate {
        /// Which.
        law: Law,
        /// Parameters that are known: the number of trials of a `binomial`, the deviation of a `normal`.
        known: Vec<f64>,
        /// The parameters of the law before: of a gamma law for a rate, a beta law for a probability, a normal law
        /// for a mean.
        prior: [f64; 2],
    },
    /// Intercept, slopes and deviation of a linear regression on all variables of the right: least squares.
    LinearRegression,
}

impl Fit {
    /// A law fitted by maximum likelihood.
    pub fn law(law: Law) -> Self {
        Fit::Law { law, known: Vec::new() }
    }

    /// The law to which a law's conjugate prior belongs.
    pub fn prior_of(law: Law) -> Option<Law> {
        match law {
            Law::Poisson | Law::Exponential => Some(Law::Gamma),
            Law::Binomial => Some(Law::Beta),
            Law::Normal => Some(Law::Normal),
            _ => None,
        }
    }
}

impl Form {
    /// A normal law.
    pub fn normal(mean: ExpressionId, deviation: ExpressionId) -> Self {
        Form::Law { law: Law::Normal, arguments: vec![mean, deviation] }
    }

    /// Mean and standard deviation, where the form is a normal law.
    pub fn as_normal(&self) -> Option<(ExpressionId, ExpressionId)> {
        match self {
            Form::Law { law: Law::Normal, arguments } => Some((arguments[0], arguments[1])),
            _ => None,
        }
    }

    /// Calls `visit` with each form that stands directly in this one.
    pub fn each_part(&self, visit: &mut impl FnMut(&Form)) {
        match self {
            Form::Previous { otherwise, .. } => visit(otherwise),
            Form::If { then, otherwise, .. } => {
                visit(then);
                visit(otherwise);
            }
            Form::Mixture(parts) => parts.iter().for_each(|(_, part)| visit(part)),
            Form::Truncated { form, .. } => visit(form),
            _ => {}
        }
    }

    /// The name under which the language knows the form.
    pub fn name(&self) -> &'static str {
        match self {
            Form::Uniform => "uniform",
            Form::Bernoulli(_) => "bernoulli",
            Form::Categorical(_) => "categorical",
            Form::Table(_) | Form::Constants(_) => "table",
            Form::Law { law, .. } => law.name(),
            Form::Dirichlet(_) => Dirichlet::NAME,
            Form::Mixture(_) => "mixture",
            Form::Truncated { .. } => "truncated",
            Form::Unknown(_) => "unknown",
            Form::NormalBins { .. } => "normal_bins",
            Form::Dirac(_) => "dirac",
            Form::Previous { .. } => "previous",
            Form::Ask { .. } => "ask",
            Form::Weights(_) => "weights",
            Form::If { .. } => "if",
        }
    }

    /// Calls `visit` with each expression that stands directly in the form, those of its branches included.
    pub fn each_expression(&self, visit: &mut impl FnMut(ExpressionId)) {
        match self {
            Form::Uniform | Form::Constants(_) | Form::Ask { .. } | Form::Unknown(_) => {}
            Form::NormalBins { mean: first, deviation: second } => {
                visit(*first);
                visit(*second);
            }
            Form::Bernoulli(argument) | Form::Dirac(argument) | Form::Weights(argument) => visit(*argument),
            Form::Mixture(parts) => {
                for (weight, part) in parts {
                    visit(*weight);
                    part.each_expression(visit);
                }
            }
            Form::Truncated { form, low, high } => {
                form.each_expression(visit);
                visit(*low);
                visit(*high);
            }
            Form::Categorical(entries) | Form::Dirichlet(entries) | Form::Law { arguments: entries, .. } => {
                entries.iter().for_each(|entry| visit(*entry))
            }
            Form::Table(rows) => rows.iter().flatten().for_each(|entry| visit(*entry)),
            Form::Previous { otherwise, .. } => otherwise.each_expression(visit),
            Form::If { condition, then, otherwise } => {
                visit(*condition);
                then.each_expression(visit);
                otherwise.each_expression(visit);
            }
        }
    }
}

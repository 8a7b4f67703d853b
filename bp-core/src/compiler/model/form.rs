//! Forms: the distribution that a factor of the decomposition has.
//!
//! In: expressions over the factor's right-hand variables. Out: a [`Form`]. Invariant: a form describes a distribution,
//! not how it is computed; its equations are written once, in `forms/`.

mod noisy;
mod regression;
mod softmax;
mod succession;
mod unlearned;

pub use unlearned::{Apart, Unlearned};

use crate::ids::{ExpressionId, VariableId};
use crate::law::{Dirichlet, Law, Support};
use crate::model::{Expression, Folded, Model};
use crate::operators::Unary;
use serde::{Deserialize, Serialize};

/// Tolerance of the sum of the probabilities of a row, and of a computed probability outside [0, 1]: rounding, also
/// that of f32.
pub fn row_tolerance(entries: usize) -> f64 {
    1e-6 + 1e-7 * entries as f64
}

impl Model {
    /// Whether an expression contains arithmetic, so that it is subject to rounding. (A sign does not round.)
    pub(crate) fn is_computed(&self, id: ExpressionId) -> bool {
        let of = |expression: &Expression, below: &Folded<bool>| match expression {
            Expression::Unary(Unary::Negate, operand) => *below.of(*operand),
            Expression::Unary(..) | Expression::Binary(..) => true,
            Expression::If { then, otherwise, .. } => *below.of(*then) || *below.of(*otherwise),
            _ => false,
        };
        self.fold(id, of).root()
    }

    /// The number of an expression that is a probability: rounding errors beyond [0, 1] are clamped.
    pub(crate) fn rounded(&self, id: ExpressionId, number: f64) -> f64 {
        let (tolerance, nearest) = (row_tolerance(1), number.clamp(0.0, 1.0));
        let is_rounding = number != nearest && (number - nearest).abs() <= tolerance;
        if is_rounding && self.is_computed(id) { nearest } else { number }
    }
}

/// The distribution of a factor's left-hand variable, given its right-hand ones.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub enum Form {
    /// All values with equal probability.
    Uniform,
    /// True with this probability; and the probability of false, where it has more digits than 1 minus that of true.
    Bernoulli(ExpressionId, Option<ExpressionId>),
    /// One probability for each value, in the domain's order.
    Categorical(Vec<ExpressionId>),
    /// Probabilities in rows: one row for each combination of right-hand values (in the factor's order, last
    /// one fastest), one entry for each left-hand value.
    Table(Vec<Vec<ExpressionId>>),
    /// A table of constants, row after row in the order of `Table`: for network files, with a million entries without a
    /// node for each.
    Constants(Vec<f64>),
    /// A distribution of one number. For a real, its density. Over integers, its density at each, normalised over them.
    /// Over bins, its probability in each, normalised over the domain; on a circle it is periodic.
    Law {
        /// The law.
        law: Law,
        /// Its parameters, in its order.
        arguments: Vec<ExpressionId>,
    },
    /// A normal distribution of a vector, whose components are not independent.
    NormalVector {
        /// The mean: a vector, or one number for all components.
        mean: ExpressionId,
        /// The covariance matrix, row by row.
        covariance: Vec<Vec<ExpressionId>>,
    },
    /// Proportions that sum to one, a Dirichlet distribution of a vector: one parameter for each component.
    Dirichlet(Vec<ExpressionId>),
    /// Counts of independent trials, a multinomial distribution of a vector: how many trials have each of several results.
    Multinomial {
        /// The number of trials.
        trials: ExpressionId,
        /// One probability for each component.
        probabilities: Vec<ExpressionId>,
    },
    /// The components of a vector in ascending order: independent draws of a distribution, sorted.
    Ordered(Box<Form>),
    /// A mixture of several forms: Σ wᵢ fᵢ. The weights sum to one.
    Mixture(Vec<(ExpressionId, Form)>),
    /// A form truncated to two bounds and renormalised; both bounds are inside.
    Truncated {
        /// The form.
        form: Box<Form>,
        /// Lower bound.
        low: ExpressionId,
        /// Upper bound.
        high: ExpressionId,
    },
    /// To be learned from data; no answer until then.
    Unknown(Unlearned),
    /// A normal distribution on an axis of unit bins ]j−1; j], j = 1..=N, the first of which includes everything below
    /// it, preceded by a label with the probability beyond N (paper, Eq. 4). A mean beyond N + ½ means "no occupied
    /// cell" and gives the label with certainty.
    NormalBins {
        /// Mean, in bins from the inner edge.
        mean: ExpressionId,
        /// Standard deviation, in bins, > 0.
        deviation: ExpressionId,
    },
    /// This value, with probability 1. A value outside the domain has probability 0.
    Dirac(ExpressionId),
    /// The marginal of `of` (at cell `at`) in the answer of the previous step. `otherwise` holds before the first step
    /// and outside the grid; without it, uniform.
    Previous {
        /// The variable at this instant; its marginal one step ago is meant.
        of: VariableId,
        /// The cell of the marginal.
        at: Option<VariableId>,
        /// The form if there is no marginal.
        otherwise: Box<Form>,
    },
    /// Density 1 at every real: improper, a distribution only together with observations that determine the variable.
    Flat,
    /// Density 1 above 0: improper, as `Flat`.
    HalfFlat,
    /// One form at the first instant, another at those after it.
    Initial {
        /// The form at the first instant.
        first: Box<Form>,
        /// The form at the others.
        later: Box<Form>,
    },
    /// The answer of another program, given at run time under `path`: for an observed variable, its likelihood; it
    /// depends on the right-hand variables `given` (and on the plate).
    Ask {
        /// Its text, in normal spacing.
        path: String,
        /// The right-hand variables on which the answer depends.
        given: Vec<VariableId>,
    },
    /// Proportional to this, over the values of the left variable, which it may use. An index of the plate in it, if
    /// the plate runs over that same set, means the left variable's value.
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

/// The estimator of a form to be learned, fitted once for each combination of right-hand values.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub enum Fit {
    /// Laplace's law of succession: (nᵢ + 1) / (N + k).
    LaplaceSuccession,
    /// Relative frequencies: nᵢ / N.
    Histogram,
    /// Frequencies with a prior count for each value, a Dirichlet prior: (nᵢ + a) / (N + k a).
    Dirichlet(f64),
    /// The probability of `true`, with a beta prior: (n₁ + a) / (N + a + b).
    Beta(f64, f64),
    /// The parameters of a distribution, by maximum likelihood.
    Law {
        /// The law.
        law: Law,
        /// Parameters that are known: the number of trials of a `binomial`.
        known: Vec<f64>,
    },
    /// A normal distribution whose variance is the sum of squares divided by N − 1.
    UnbiasedNormal,
    /// A distribution with a conjugate prior; the estimate is the posterior mean.
    Conjugate {
        /// The law.
        law: Law,
        /// Parameters that are known: the number of trials of a `binomial`, the deviation of a `normal`.
        known: Vec<f64>,
        /// The parameters of the prior: a gamma distribution for a rate, a beta distribution for a probability, a
        /// normal distribution for a mean.
        prior: [f64; 2],
    },
    /// Intercept, slopes and deviation of a linear regression on all right-hand variables: least squares.
    LinearRegression,
}

impl Fit {
    /// A distribution fitted by maximum likelihood.
    pub fn law(law: Law) -> Self {
        Fit::Law { law, known: Vec::new() }
    }

    /// The distribution of the conjugate prior.
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

    /// Mean and standard deviation, if the form is a normal distribution.
    pub fn as_normal(&self) -> Option<(ExpressionId, ExpressionId)> {
        match self {
            Form::Law { law: Law::Normal, arguments } => Some((arguments[0], arguments[1])),
            _ => None,
        }
    }

    /// Where a `flat` form has an answer.
    pub(crate) const FLAT: &str = "`flat` is answered at one instant where all is linear and Gaussian, or by `gibbs`, and the \
                                   observations determine the variable; elsewhere give it a proper form, such as \
                                   `normal(0, 100)`";

    /// Whether it has no total.
    pub fn is_improper(&self) -> bool {
        matches!(self, Form::Flat | Form::HalfFlat)
    }

    /// Whether it has a form of its own at the first instant.
    pub fn is_initial(&self) -> bool {
        let mut found = matches!(self, Form::Initial { .. });
        self.each_part(&mut |part| found |= part.is_initial());
        found
    }

    /// Whether it, or a part of it, is neither a point nor a law of counts: over reals these parts have densities.
    pub fn has_density(&self) -> bool {
        let (mut parts, mut found) = (0, false);
        self.each_part(&mut |part| {
            parts += 1;
            found |= part.has_density();
        });
        let is_count = |law: &Law| law.support() == Support::Counts;
        let has_masses = match self {
            Form::Dirac(_) => true,
            Form::Law { law, .. } => is_count(law),
            _ => false,
        };
        if parts == 0 { !has_masses } else { found }
    }

    /// Whether it, or a part of it, is a point.
    pub fn has_point(&self) -> bool {
        let mut found = matches!(self, Form::Dirac(_));
        self.each_part(&mut |part| found |= part.has_point());
        found
    }

    /// Whether it, or a part of it, distributes the components of a vector together: each depends on those before it.
    pub fn couples(&self) -> bool {
        let mut found = matches!(
            self,
            Form::NormalVector { .. } | Form::Dirichlet(_) | Form::Multinomial { .. } | Form::Ordered(_)
        );
        self.each_part(&mut |part| found |= part.couples());
        found
    }

    /// Whether it, or a part of it, is a normal distribution of a vector with a covariance matrix.
    pub fn is_normal_vector(&self) -> bool {
        let mut found = matches!(self, Form::NormalVector { .. });
        self.each_part(&mut |part| found |= part.is_normal_vector());
        found
    }

    /// Calls `visit` with each direct subform.
    pub fn each_part(&self, visit: &mut impl FnMut(&Form)) {
        match self {
            Form::Previous { otherwise, .. } => visit(otherwise),
            Form::If { then, otherwise, .. } => {
                visit(then);
                visit(otherwise);
            }
            Form::Initial { first, later } => {
                visit(first);
                visit(later);
            }
            Form::Mixture(parts) => parts.iter().for_each(|(_, part)| visit(part)),
            Form::Truncated { form, .. } | Form::Ordered(form) => visit(form),
            _ => {}
        }
    }

    /// The name of the form in the language.
    pub fn name(&self) -> &'static str {
        match self {
            Form::Uniform => "uniform",
            Form::Bernoulli(..) => "bernoulli",
            Form::Categorical(_) => "categorical",
            Form::Table(_) | Form::Constants(_) => "table",
            Form::Law { law, .. } => law.name(),
            Form::NormalVector { .. } => Law::Normal.name(),
            Form::Dirichlet(_) => Dirichlet::NAME,
            Form::Multinomial { .. } => "multinomial",
            Form::Ordered(_) => "ordered",
            Form::Mixture(_) => "mixture",
            Form::Truncated { .. } => "truncated",
            Form::Unknown(_) => "unknown",
            Form::NormalBins { .. } => "normal_bins",
            Form::Dirac(_) => "dirac",
            Form::Flat => "flat",
            Form::HalfFlat => "half_flat",
            Form::Previous { .. } => "previous",
            Form::Initial { .. } => "initial",
            Form::Ask { .. } => "ask",
            Form::Weights(_) => "weights",
            Form::If { .. } => "if",
        }
    }

    /// Calls `visit` with each direct expression of the form, including those of its branches.
    pub fn each_expression(&self, visit: &mut impl FnMut(ExpressionId)) {
        match self {
            Form::Uniform
            | Form::Flat
            | Form::HalfFlat
            | Form::Constants(_)
            | Form::Ask { .. }
            | Form::Unknown(_) => {}
            Form::NormalBins { mean: first, deviation: second } => {
                visit(*first);
                visit(*second);
            }
            // The probability of false reads what that of true reads.
            Form::Bernoulli(argument, _) | Form::Dirac(argument) | Form::Weights(argument) => {
                visit(*argument);
            }
            Form::Mixture(parts) => {
                for (weight, part) in parts {
                    visit(*weight);
                    part.each_expression(visit);
                }
            }
            Form::NormalVector { mean, covariance } => {
                visit(*mean);
                covariance.iter().flatten().for_each(|entry| visit(*entry));
            }
            Form::Multinomial { trials, probabilities } => {
                visit(*trials);
                probabilities.iter().for_each(|probability| visit(*probability));
            }
            Form::Ordered(form) => form.each_expression(visit),
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
            Form::Initial { first, later } => {
                first.each_expression(visit);
                later.each_expression(visit);
            }
            Form::If { condition, then, otherwise } => {
                visit(*condition);
                then.each_expression(visit);
                otherwise.each_expression(visit);
            }
        }
    }
}

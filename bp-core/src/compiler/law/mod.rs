//! Laws: named parametric distributions of one number.
//!
//! In: parameters, and a number. Out: density, cumulative distribution, mass of an interval, a draw, moments; from a
//! sample, the parameters of maximum likelihood. Invariant: each law has one file, with its equation; its density is
//! written once, over an [`Arithmetic`], for kernels and for f64. Parameters are valid ([`Law::refuses`]); outside the
//! support the density is 0.

mod arithmetic;
mod beta;
mod binomial;
mod cauchy;
mod counts;
mod covariance;
mod dirichlet;
mod exponential;
mod fit;
mod gamma;
mod geometric;
mod half;
mod half_cauchy;
mod half_normal;
mod laplace;
mod lognormal;
mod negative_binomial;
pub(crate) mod normal;
mod poisson;
mod saddle;
mod sample;
mod student_t;
mod uniform;
mod von_mises;
mod weibull;
mod window;

pub use arithmetic::{Arithmetic, Numbers, ROUNDING, Wide};
pub(crate) use covariance::{Conditional, Covariance};
pub use dirichlet::{Dirichlet, Share};
pub use fit::Refusal;
pub(crate) use fit::{MOST_SHAPE, NO_CONVERGENCE};
pub use sample::Sample;

use crate::operators::{Binary, Unary};
use rand::Rng;
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

/// The domain of a parameter.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Constraint {
    /// Any finite number.
    Real,
    /// > 0
    Positive,
    /// In [0, 1].
    Probability,
    /// In ]0, 1].
    PositiveProbability,
    /// A whole number, ≥ 0.
    Count,
}

/// The support of a law.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Support {
    /// All reals, or an interval of them: a density.
    Reals,
    /// Reals > 0, or ≥ 0: a density.
    Positive,
    /// Reals in ]0, 1[: a density.
    UnitInterval,
    /// Whole numbers ≥ 0: probabilities.
    Counts,
}

macro_rules! laws {
    ($($(#[$about:meta])* $law:ident in $file:ident, mass by $mass:path;)+) => {
        /// A distribution of one number, under its usual name.
        #[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, Serialize, Deserialize)]
        pub enum Law {
            $($(#[$about])* $law,)+
        }

        impl Law {
            /// All of them.
            pub const ALL: &[Law] = &[$(Law::$law),+];

            /// Its name in the language.
            pub fn name(self) -> &'static str {
                match self { $(Law::$law => $file::NAME,)+ }
            }

            /// Its parameters in order: name and domain.
            pub fn parameters(self) -> &'static [(&'static str, Constraint)] {
                match self { $(Law::$law => &$file::PARAMETERS,)+ }
            }

            /// Its support.
            pub fn support(self) -> Support {
                match self { $(Law::$law => $file::SUPPORT,)+ }
            }

            /// ln of the density, or of the probability of a whole number; −∞ outside the support.
            pub fn ln_density<A: Arithmetic>(self, by: &mut A, x: A::Number, parameters: &[A::Number]) -> A::Number {
                match self { $(Law::$law => $file::ln_density(by, x, exactly(parameters)),)+ }
            }

            /// P(low < X ≤ high), low ≤ high; of laws of counts there is no formula.
            pub fn mass<A: Arithmetic>(
                self,
                by: &mut A,
                low: A::Number,
                high: A::Number,
                parameters: &[A::Number],
            ) -> Option<A::Number> {
                match self { $(Law::$law => $mass(by, low, high, exactly(parameters)),)+ }
            }

            /// P(X ≤ x) and P(X > x): each is accurate in its own tail, where the other is 1 within rounding.
            pub fn tails(self, x: f64, parameters: &[f64]) -> (f64, f64) {
                match self { $(Law::$law => $file::tails(x, exactly(parameters)),)+ }
            }

            /// The expectation; infinite where its integral is, NaN where it does not exist.
            pub fn mean(self, parameters: &[f64]) -> f64 {
                match self { $(Law::$law => $file::mean(exactly(parameters)),)+ }
            }

            /// The expectation of the squared distance from the mean; infinite, or NaN, as the expectation may be.
            pub fn variance(self, parameters: &[f64]) -> f64 {
                match self { $(Law::$law => $file::variance(exactly(parameters)),)+ }
            }

            /// The entropy in nats, of densities the differential one.
            pub fn entropy(self, parameters: &[f64]) -> f64 {
                match self { $(Law::$law => $file::entropy(exactly(parameters)),)+ }
            }

            /// The value with the largest density or probability, of counts the largest such; `None` where there is no single one.
            pub fn mode(self, parameters: &[f64]) -> Option<f64> {
                match self { $(Law::$law => $file::mode(exactly(parameters)),)+ }
            }

            /// The maximum-likelihood parameters of a sample; the known ones are the first.
            ///
            /// # Errors
            /// There is no maximum: too few distinct values, or values outside the support.
            pub fn fit(self, sample: &Sample, known: &[f64]) -> Result<Vec<f64>, Refusal> {
                if sample.is_empty() || !sample.iter().all(|(number, weight)| number.is_finite() && weight >= 0.0) {
                    return Err("needs values");
                }
                match self { $(Law::$law => $file::fit(sample, known).map(Vec::from),)+ }
            }

            /// A draw.
            pub fn draw(self, by: &mut impl Rng, parameters: &[f64]) -> f64 {
                match self { $(Law::$law => $file::draw(by, exactly(parameters)),)+ }
            }
        }
    };
}

laws! {
    /// Uniform between two bounds.
    Uniform in uniform, mass by uniform::mass;
    /// Normal.
    Normal in normal, mass by normal::mass;
    /// The logarithm is normal.
    Lognormal in lognormal, mass by lognormal::mass;
    /// Waiting time at a constant rate.
    Exponential in exponential, mass by exponential::mass;
    /// Sum of waiting times.
    Gamma in gamma, mass by gamma::mass;
    /// A proportion.
    Beta in beta, mass by beta::mass;
    /// An angle around a mean.
    VonMises in von_mises, mass by von_mises::mass;
    /// Time to failure.
    Weibull in weibull, mass by weibull::mass;
    /// Successes among trials.
    Binomial in binomial, mass by no_closed_form::<_, 2>;
    /// Number of events at a constant rate.
    Poisson in poisson, mass by no_closed_form::<_, 1>;
    /// The absolute value of a normal variable around 0.
    HalfNormal in half_normal, mass by half_normal::mass;
    /// The absolute value of a Cauchy variable around 0.
    HalfCauchy in half_cauchy, mass by half_cauchy::mass;
    /// Student's, with heavier tails than the normal law.
    StudentT in student_t, mass by student_t::mass;
    /// With tails so heavy that it has no mean.
    Cauchy in cauchy, mass by cauchy::mass;
    /// Exponential on both sides.
    Laplace in laplace, mass by laplace::mass;
    /// Failures before the r-th success.
    NegativeBinomial in negative_binomial, mass by no_closed_form::<_, 2>;
    /// Failures before the first success.
    Geometric in geometric, mass by no_closed_form::<_, 1>;
}

/// The most parameters that a law has.
const MOST_PARAMETERS: usize = 3;

/// The parameters of any law, in its order; those that it does not have are 0.
pub type Parameters = [f64; MOST_PARAMETERS];

impl Law {
    /// The law of this name.
    pub fn named(name: &str) -> Option<Law> {
        Law::ALL.iter().copied().find(|law| law.name() == name)
    }

    /// The density, or the probability of a whole number.
    pub fn density_by<A: Arithmetic>(self, by: &mut A, x: A::Number, parameters: &[A::Number]) -> A::Number {
        if self == Law::Normal {
            // Without the two logarithms and the exponential that would undo them.
            return normal::density(by, x, exactly(parameters));
        }
        let ln_density = self.ln_density(by, x, parameters);
        by.exp(ln_density)
    }

    /// A number proportional to the density between two ends of a window, at one of which or between them it is near 1.
    pub(crate) fn weight_by<A: Arithmetic>(
        self,
        by: &mut A,
        x: A::Number,
        parameters: &[A::Number],
        ends: [A::Number; 2],
    ) -> A::Number {
        let ln_weight = window::ln_weight(self, by, x, parameters, ends);
        by.exp(ln_weight)
    }

    /// The standard deviation, which has a value where the variance is too small or too large for f64.
    pub fn deviation(self, parameters: &[f64]) -> f64 {
        match (self, parameters) {
            (Law::Normal, [_, deviation]) => *deviation,
            (Law::Exponential, [rate]) => 1.0 / rate,
            (Law::Gamma, [shape, rate]) => shape.sqrt() / rate,
            (Law::Laplace, [_, scale]) => std::f64::consts::SQRT_2 * scale,
            (Law::Uniform, [low, high]) => uniform::deviation([*low, *high]),
            (Law::HalfNormal, [scale]) => scale * (1.0 - 2.0 / PI).sqrt(),
            _ => self.variance(parameters).sqrt(),
        }
    }

    /// P(X ≤ x)
    pub fn cumulative(self, x: f64, parameters: &[f64]) -> f64 {
        self.tails(x, parameters).0
    }

    /// P(low < X ≤ high), low ≤ high: a difference in the tail that contains it.
    pub fn between(self, low: f64, high: f64, parameters: &[f64]) -> f64 {
        // A real has one turn, around the mean.
        let (low, high) = match (self, parameters) {
            (Law::VonMises, [mean, _]) => (low.max(mean - PI), high.min(mean + PI)),
            _ => (low, high),
        };
        if let Some(mass) = self.mass(&mut Numbers, low, high, parameters) {
            return mass.max(0.0);
        }
        let (from, to) = (self.tails(low, parameters), self.tails(high, parameters));
        let mass = if from.0 > from.1 { from.1 - to.1 } else { to.0 - from.0 };
        mass.max(0.0)
    }

    /// The mode and the density there, at an end of the support its limit; `None` where there is no single mode.
    pub fn largest_density(self, parameters: &[f64]) -> Option<(f64, f64)> {
        let mode = self.mode(parameters)?;
        let is_unbounded = match (self, parameters) {
            (Law::Gamma | Law::Weibull, [shape, _]) => *shape < 1.0,
            (Law::Beta, [a, b]) => *a < 1.0 || *b < 1.0,
            _ => false,
        };
        let inside = match (self.support(), mode) {
            (Support::Positive | Support::UnitInterval, 0.0) => f64::MIN_POSITIVE,
            (Support::UnitInterval, 1.0) => 1.0 - 0.5 * f64::EPSILON,
            _ => mode,
        };
        Some((mode, if is_unbounded { f64::INFINITY } else { self.density(inside, parameters) }))
    }

    /// The density, or the probability of a whole number.
    pub fn density(self, x: f64, parameters: &[f64]) -> f64 {
        self.ln_density(&mut Numbers, x, parameters).exp()
    }

    /// Whether the parameters are valid. Those that `surely` satisfy their constraint are skipped.
    pub fn holds<A: Arithmetic>(
        self,
        by: &mut A,
        parameters: &[A::Number],
        surely: impl Fn(usize, Constraint) -> bool,
    ) -> A::Number {
        let mut holds = by.constant(1.0);
        for (position, (number, (_, constraint))) in parameters.iter().zip(self.parameters()).enumerate() {
            if !surely(position, *constraint) {
                let one = constraint.holds(by, *number);
                holds = by.binary(Binary::And, holds, one);
            }
        }
        match (self, parameters) {
            (Law::Uniform, [low, high]) => {
                let ordered = by.binary(Binary::Less, *low, *high);
                by.binary(Binary::And, holds, ordered)
            }
            _ => holds,
        }
    }

    /// The most likely parameters with a scale of `floor` at least, for laws whose likelihood may have no bound; else `None`.
    pub(crate) fn fit_above(self, sample: &Sample, floor: f64) -> Option<Vec<f64>> {
        match self {
            Law::StudentT => Some(student_t::fit_above(sample, floor).to_vec()),
            Law::Cauchy => Some(student_t::location_and_scale_above(sample, 1.0, floor).to_vec()),
            _ => None,
        }
    }

    /// The first invalid parameter: its position, and its domain.
    pub fn refuses(self, parameters: &[f64]) -> Option<(usize, &'static str)> {
        if self.holds(&mut Numbers, parameters, |_, _| false) != 0.0 {
            return None;
        }
        let wrong = (self.parameters().iter().zip(parameters).enumerate())
            .find_map(|(position, ((_, constraint), number))| Some((position, constraint.refuses(*number)?)));
        // Two valid bounds are in the wrong order.
        wrong.or(Some((1, "greater than the first")))
    }
}

impl Constraint {
    /// Whether it demands a probability.
    pub fn is_probability(self) -> bool {
        matches!(self, Constraint::Probability | Constraint::PositiveProbability)
    }

    /// Whether a number satisfies it.
    pub fn holds<A: Arithmetic>(self, by: &mut A, x: A::Number) -> A::Number {
        let (zero, infinity) = (by.constant(0.0), by.constant(f64::INFINITY));
        match self {
            Constraint::Real => {
                let size = by.unary(Unary::Absolute, x);
                by.binary(Binary::Less, size, infinity)
            }
            Constraint::Positive => {
                let positive = by.binary(Binary::Greater, x, zero);
                let finite = by.binary(Binary::Less, x, infinity);
                by.binary(Binary::And, positive, finite)
            }
            Constraint::Probability => {
                let one = by.constant(1.0);
                let above = by.binary(Binary::GreaterOrEqual, x, zero);
                let below = by.binary(Binary::LessOrEqual, x, one);
                by.binary(Binary::And, above, below)
            }
            Constraint::PositiveProbability => {
                let one = by.constant(1.0);
                let above = by.binary(Binary::Greater, x, zero);
                let below = by.binary(Binary::LessOrEqual, x, one);
                by.binary(Binary::And, above, below)
            }
            Constraint::Count => {
                let (count, finite) = (by.is_count(x), by.binary(Binary::Less, x, infinity));
                by.binary(Binary::And, count, finite)
            }
        }
    }

    /// The requirement on a number, if it is violated.
    pub fn refuses(self, number: f64) -> Option<&'static str> {
        let expected = match self {
            Constraint::Real => "a finite number",
            Constraint::Positive => "greater than 0",
            Constraint::Probability => "between 0 and 1",
            Constraint::PositiveProbability => "greater than 0, and 1 at most",
            Constraint::Count => "a whole number, not negative",
        };
        (self.holds(&mut Numbers, number) == 0.0).then_some(expected)
    }
}

/// The mass of an interval under a law of counts.
fn no_closed_form<A: Arithmetic, const COUNT: usize>(
    _: &mut A,
    _: A::Number,
    _: A::Number,
    _: [A::Number; COUNT],
) -> Option<A::Number> {
    None
}

/// As many parameters as the law has.
fn exactly<N: Copy, const COUNT: usize>(parameters: &[N]) -> [N; COUNT] {
    parameters.try_into().expect("internal: a law has its parameters")
}

#[cfg(test)]
mod fit_tests;
#[cfg(test)]
mod tests;

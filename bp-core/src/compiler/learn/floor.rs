//! Floors of the deviation of distributions.
//!
//! In: a distribution, its sample, and the sample of all contexts together. Out: valid parameters. Invariant: within
//! its bounds the numbers are those of maximum likelihood, so that a step of EM with constant floors does not lower the
//! likelihood.
//!
//! If all values of a context are equal, or a component of a mixture contracts to equal values, the likelihood is
//! unbounded as the deviation goes to zero. The deviation is at least a millionth of that of all values of the form,
//! each counted once; a rate of counts is at least 10⁻¹². Distributions whose width depends on their shape alone have
//! shapes of at most 10⁶ (`law/`).

use crate::law::{Law, MOST_SHAPE, NO_CONVERGENCE, Refusal, Sample};

/// The floor as a fraction of the spread of all values.
const NARROWEST: f64 = 1e-6;

/// The smallest rate of counts.
const LEAST_RATE: f64 = 1e-12;

/// The spread of the values of a distribution, in the units of the floored parameter: 0 if they are all equal, or
/// unknown.
pub(super) fn spread(law: Law, all: &Sample) -> f64 {
    if all.is_empty() {
        return 0.0;
    }
    match law {
        Law::Normal => all.deviation(),
        Law::Lognormal if all.ends().0 > 0.0 => all.map(f64::ln).deviation(),
        Law::Uniform => all.ends().1 - all.ends().0,
        Law::Exponential => all.mean_of(|x| x),
        // Their width depends on the shape alone; this only indicates that they differ.
        _ => all.ends().1 - all.ends().0,
    }
}

/// The least deviation of a normal law.
pub(super) fn least_deviation(spread: f64) -> f64 {
    NARROWEST * spread
}

/// Parameters of a distribution with the floor; and whether one of them is at it.
pub(super) fn held(law: Law, mut numbers: Vec<f64>, spread: f64) -> (Vec<f64>, bool) {
    let floor = NARROWEST * spread;
    let before = numbers.clone();
    match law {
        Law::Normal | Law::Lognormal | Law::Cauchy | Law::Laplace => numbers[1] = numbers[1].max(floor),
        Law::HalfNormal | Law::HalfCauchy => numbers[0] = numbers[0].max(floor),
        Law::StudentT => {
            numbers[0] = numbers[0].min(MOST_SHAPE);
            numbers[2] = numbers[2].max(floor);
        }
        Law::NegativeBinomial if numbers[0] > MOST_SHAPE => {
            let mean = Law::NegativeBinomial.mean(&numbers);
            (numbers[0], numbers[1]) = (MOST_SHAPE, MOST_SHAPE / (MOST_SHAPE + mean));
        }
        Law::Uniform if numbers[1] - numbers[0] < floor => {
            let middle = 0.5 * (numbers[0] + numbers[1]);
            (numbers[0], numbers[1]) = (middle - 0.5 * floor, middle + 0.5 * floor);
        }
        Law::Exponential if floor > 0.0 => numbers[0] = numbers[0].min(1.0 / floor),
        // The mean stays as it is.
        Law::Gamma if numbers[0] > MOST_SHAPE => {
            numbers[1] *= MOST_SHAPE / numbers[0];
            numbers[0] = MOST_SHAPE;
        }
        Law::Beta if numbers[0] + numbers[1] > MOST_SHAPE * (1.0 + 1e-12) => {
            let scale = MOST_SHAPE / (numbers[0] + numbers[1]);
            numbers.iter_mut().for_each(|number| *number *= scale);
        }
        Law::VonMises => numbers[1] = numbers[1].min(MOST_SHAPE),
        Law::Weibull => numbers[0] = numbers[0].min(MOST_SHAPE),
        Law::Poisson => numbers[0] = numbers[0].max(LEAST_RATE),
        _ => {}
    }
    let moved = numbers != before;
    (numbers, moved)
}

/// Why a distribution is at a bound: the floor of its width, which bounds the likelihood of equal values, or the limit of a
/// parameter, up to which the likelihood of other values rises. `None` where it is at neither.
pub(super) fn bound(law: Law, numbers: &[f64], sample: &Sample, spread: f64) -> Option<Bound> {
    let is_at = |scale: f64| scale <= NARROWEST * spread * (1.0 + 1e-12);
    let (low, high) = sample.ends();
    match law {
        Law::StudentT if is_narrowest(law, numbers) && !is_at(numbers[2]) => Some(Bound::Limit),
        Law::StudentT => is_at(numbers[2]).then_some(Bound::Floor),
        Law::Cauchy => is_at(numbers[1]).then_some(Bound::Floor),
        Law::Gamma | Law::Weibull | Law::NegativeBinomial | Law::Beta | Law::VonMises | Law::Poisson
            if low < high =>
        {
            Some(Bound::Limit)
        }
        _ => Some(Bound::Floor),
    }
}

/// A bound of the parameters of a distribution.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Bound {
    /// The floor of the width.
    Floor,
    /// The limit of a parameter.
    Limit,
}

/// Whether the shape of a distribution is at its limit.
pub(super) fn is_narrowest(law: Law, numbers: &[f64]) -> bool {
    let shape = match law {
        Law::Gamma | Law::Weibull | Law::StudentT | Law::NegativeBinomial => numbers[0],
        Law::Beta => numbers[0] + numbers[1],
        Law::VonMises => numbers[1],
        _ => 0.0,
    };
    shape >= MOST_SHAPE * (1.0 - 1e-12)
}

/// The numbers at the floor, for a sample whose values are all equal; for `student_t` and `cauchy` also where one value has
/// half of the weight or more.
///
/// # Errors
/// The distribution cannot have such values, or there is no spread for a floor.
pub(super) fn collapsed(law: Law, sample: &Sample, spread: f64, why: Refusal) -> Result<Vec<f64>, Refusal> {
    let (low, high) = sample.ends();
    let mean = sample.mean();
    let floor = NARROWEST * spread;
    if why == NO_CONVERGENCE {
        return Err(why);
    }
    match law {
        Law::Normal if floor > 0.0 => Ok(vec![mean, floor]),
        Law::StudentT | Law::Cauchy if floor > 0.0 => law.fit_above(sample, floor).ok_or(why),
        Law::Laplace if floor > 0.0 => Ok(vec![sample.median(), floor]),
        Law::HalfNormal | Law::HalfCauchy if floor > 0.0 && low >= 0.0 => Ok(vec![floor]),
        Law::NegativeBinomial if low == 0.0 && high == 0.0 => Ok(vec![1.0, 1.0]),
        Law::Lognormal if floor > 0.0 && low > 0.0 => Ok(vec![sample.map(f64::ln).mean(), floor]),
        Law::Uniform if floor > 0.0 => Ok(vec![low - 0.5 * floor, high + 0.5 * floor]),
        Law::Exponential if floor > 0.0 && low >= 0.0 => Ok(vec![1.0 / floor]),
        Law::Poisson if low >= 0.0 => Ok(vec![mean.max(LEAST_RATE)]),
        Law::Gamma if floor > 0.0 && low > 0.0 => Ok(vec![MOST_SHAPE, MOST_SHAPE / mean]),
        Law::Weibull if floor > 0.0 && low > 0.0 => Ok(vec![MOST_SHAPE, mean]),
        Law::Beta if floor > 0.0 && low > 0.0 && high < 1.0 => {
            Ok(vec![MOST_SHAPE * mean, MOST_SHAPE * (1.0 - mean)])
        }
        Law::VonMises if floor > 0.0 => {
            let (sine, cosine) = (sample.mean_of(f64::sin), sample.mean_of(f64::cos));
            let length = sine.hypot(cosine);
            // Angles without a preferred direction: I₁(κ)/I₀(κ) is about κ/2.
            let concentration = if length < 0.5 { (2.0 * length).max(LEAST_RATE) } else { MOST_SHAPE };
            Ok(vec![sine.atan2(cosine), concentration])
        }
        _ => Err(why),
    }
}

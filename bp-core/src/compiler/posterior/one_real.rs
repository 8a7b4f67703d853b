//! The entropy, the mode and draws of one real.
//!
//! In: a mixture of normal distributions. Out: its entropy in nats, its point of largest density, values drawn at random.
//! Invariant: a component without a density makes the entropy −∞ and is itself a candidate for the mode.

use super::mixture::{Component, Mixture};
use crate::distribution::exact_sum;
use crate::law::{Law, Numbers};
use crate::special::gauss_legendre;
use rand::{Rng, RngExt};
use rand_distr::{Distribution, StandardNormal};
use std::f64::consts::TAU;

/// The most distinct components of which the entropy or the mode is computed: the time grows with their square.
pub(crate) const MOST_DISTINCT: usize = 1000;

/// Where panels of a component end, in deviations from its mean; beyond, its density is below the smallest number.
const ENDS: [f64; 10] = [0.0, 1.0, 2.0, 3.0, 4.5, 6.0, 9.0, 14.0, 22.0, 39.0];

/// The share of its variance up to which a slot is determined by others.
const DETERMINED: f64 = 1e-14;

/// How often a panel is halved at most.
const MOST_HALVINGS: u32 = 40;

/// A normal distribution of one real, with its weight.
#[derive(Clone, Copy, PartialEq, Debug)]
struct Normal {
    weight: f64,
    mean: f64,
    deviation: f64,
}

impl Normal {
    fn density(&self, x: f64) -> f64 {
        self.weight * Law::Normal.density_by(&mut Numbers, x, &[self.mean, self.deviation])
    }
}

/// A point of largest probability or density.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Peak {
    /// The reals.
    pub(crate) at: Vec<f64>,
    /// How many of them are not determined by the others, or by finite variables.
    pub(crate) free: usize,
    /// The density of these, times the probability of what is finite.
    pub(crate) size: f64,
}

/// The highest of some peaks, all of several in their order: a probability exceeds any density.
pub(crate) fn highest(mut peaks: Vec<Peak>) -> Vec<Peak> {
    let least = peaks.iter().map(|own| own.free).min();
    peaks.retain(|own| Some(own.free) == least);
    let most = peaks.iter().map(|own| own.size).fold(0.0, f64::max);
    peaks.retain(|own| own.size >= most * (1.0 - 1e-12));
    peaks
}

/// A mixture of normal distributions of one real, equal components taken together.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct OneReal(Vec<Normal>);

impl Mixture {
    /// The distribution of a slot.
    pub(crate) fn of_slot(&self, place: usize) -> OneReal {
        let normal = |own: &Component| Normal {
            weight: own.weight,
            mean: own.mean[place],
            deviation: own.deviation(place),
        };
        let mut all: Vec<Normal> = self.0.iter().map(normal).filter(|own| own.weight > 0.0).collect();
        let order = |one: &Normal, other: &Normal| {
            one.mean.total_cmp(&other.mean).then(one.deviation.total_cmp(&other.deviation))
        };
        all.sort_by(order);
        all.dedup_by(|later, own| {
            let equal = order(later, own).is_eq();
            own.weight += if equal { later.weight } else { 0.0 };
            equal
        });
        OneReal(all)
    }

    /// Values of all slots drawn at random.
    pub(crate) fn draw(&self, by: &mut impl Rng) -> Vec<f64> {
        self.0[self.choose(by)].draw(by)
    }

    /// The place of a component drawn at random.
    pub(crate) fn choose(&self, by: &mut impl Rng) -> usize {
        let mut left: f64 = by.random();
        let passed = |own: &Component| {
            left -= own.weight;
            left < 0.0
        };
        let last = || self.0.iter().rposition(|own| own.weight > 0.0);
        self.0.iter().position(passed).or_else(last).expect("internal: a mixture has components")
    }
}

impl Component {
    /// Values drawn from its normal distribution: slot by slot, given those before.
    pub(crate) fn draw(&self, by: &mut impl Rng) -> Vec<f64> {
        let size = self.mean.len();
        let mut rest = self.covariance.clone();
        let mut values = self.mean.clone();
        for place in 0..size {
            let variance = rest[place * size + place];
            // A slot that earlier ones determine has its conditional mean.
            if variance <= DETERMINED * self.covariance[place * size + place] {
                continue;
            }
            let noise: f64 = StandardNormal.sample(by);
            let factors: Vec<f64> = (place..size).map(|row| rest[row * size + place] / variance).collect();
            for (row, factor) in (place..size).zip(&factors) {
                values[row] += factor * variance.sqrt() * noise;
                for (column, other) in (place..size).zip(&factors) {
                    rest[row * size + column] -= factor * other * variance;
                }
            }
        }
        values
    }
}

impl Component {
    /// The mean, and the density there of the slots that earlier ones in this order do not determine.
    pub(crate) fn peak(&self, order: &[usize]) -> Peak {
        let size = self.mean.len();
        let mut rest = self.covariance.clone();
        let (mut free, mut ln) = (0, 0.0);
        for place in order {
            let variance = rest[place * size + place];
            if variance <= DETERMINED * self.covariance[place * size + place] {
                continue;
            }
            (free, ln) = (free + 1, ln - 0.5 * (TAU * variance).ln());
            let row: Vec<f64> = (0..size).map(|column| rest[place * size + column]).collect();
            for (at, cell) in rest.iter_mut().enumerate() {
                *cell -= row[at / size] * (row[at % size] / variance);
            }
        }
        Peak { at: self.mean.clone(), free, size: self.weight * ln.exp() }
    }
}

impl Mixture {
    /// The most probable of the points that its components are, all of several.
    pub(crate) fn points(&self) -> Vec<Peak> {
        let mut all: Vec<Peak> =
            self.0.iter().map(|own| Peak { at: own.mean.clone(), free: 0, size: own.weight }).collect();
        let order = |one: &Peak, other: &Peak| {
            let pairs = one.at.iter().zip(&other.at).map(|(one, other)| one.total_cmp(other));
            pairs.fold(std::cmp::Ordering::Equal, |so_far, own| so_far.then(own))
        };
        all.sort_by(order);
        all.dedup_by(|later, own| {
            let equal = order(later, own).is_eq();
            own.size += if equal { later.size } else { 0.0 };
            equal
        });
        highest(all)
    }
}

impl OneReal {
    /// The number of distinct components.
    pub(crate) fn count(&self) -> usize {
        self.0.len()
    }

    fn density(&self, x: f64) -> f64 {
        self.0.iter().map(|own| own.density(x)).sum()
    }

    /// −∫ p ln p in nats, by panels that are halved until both halves agree with the whole.
    ///
    /// A point is the mean of a component and a distance from it: deviations may be below the rounding of the means.
    pub(crate) fn entropy(&self) -> f64 {
        if self.0.iter().any(|own| own.deviation == 0.0) {
            return f64::NEG_INFINITY;
        }
        let of = |own: &Normal| {
            let (mean, deviation) = (own.mean, own.deviation);
            ENDS.map(|end| [(mean, -end * deviation), (mean, end * deviation)])
        };
        let from = |origin: f64, (mean, distance): (f64, f64)| (mean - origin) + distance;
        let mut ends: Vec<(f64, f64)> = self.0.iter().flat_map(of).flatten().collect();
        ends.sort_by(|one, other| {
            let ([one, rest], [other, others]) = (exact_sum(one.0, one.1), exact_sum(other.0, other.1));
            one.total_cmp(&other).then(rest.total_cmp(&others))
        });
        let panels = ends.windows(2).map(|ends| (ends[0].0, [ends[0].1, from(ends[0].0, ends[1])]));
        let integral = |(origin, ends): (f64, [f64; 2])| {
            let term = |distance: f64| {
                let centred = |own: &Normal| Normal { mean: own.mean - origin, ..*own };
                let p: f64 = self.0.iter().map(|own| centred(own).density(distance)).sum();
                if p > 0.0 { -p * p.ln() } else { 0.0 }
            };
            panel(&term, ends, MOST_HALVINGS)
        };
        panels.filter(|(_, ends)| ends[0] < ends[1]).map(integral).sum()
    }

    /// The points of largest probability, or where no point has one, the point of largest density.
    pub(crate) fn modes(&self) -> Vec<Peak> {
        let atoms = self.0.iter().filter(|own| own.deviation == 0.0);
        let atoms: Vec<Peak> =
            atoms.map(|own| Peak { at: vec![own.mean], free: 0, size: own.weight }).collect();
        if !atoms.is_empty() {
            return highest(atoms);
        }
        let peak = |own: &Normal| {
            let x = self.climbed(own.mean);
            Peak { at: vec![x], free: 1, size: self.density(x) }
        };
        // Of two equal peaks the first.
        let mut peaks = highest(self.0.iter().map(peak).collect());
        peaks.truncate(1);
        peaks
    }

    /// The peak above a point: Newton's steps where the density is concave and they lead upwards, otherwise the mean of the
    /// components in proportion to their densities over their variances (which never leads downwards).
    fn climbed(&self, mut x: f64) -> f64 {
        let least = self.0.iter().map(|own| own.deviation).fold(f64::INFINITY, f64::min);
        for _ in 0..10_000 {
            let (mut sum, mut slope, mut bend, mut centre) = (0.0, 0.0, 0.0, 0.0);
            for own in &self.0 {
                let (p, precision) = (own.density(x), 1.0 / (own.deviation * own.deviation));
                let away = own.mean - x;
                slope += p * precision * away;
                bend += p * precision * (away * away * precision - 1.0);
                sum += p * precision;
                centre += p * precision * own.mean;
            }
            let newton = x - slope / bend;
            let next = match bend < 0.0 && self.density(newton) >= self.density(x) {
                true => newton,
                false => centre / sum,
            };
            if !next.is_finite() || (next - x).abs() <= 1e-15 * x.abs().max(least) {
                break;
            }
            x = next;
        }
        x
    }
}

/// ∫ f between two ends.
fn panel(f: &impl Fn(f64) -> f64, [low, high]: [f64; 2], halvings: u32) -> f64 {
    let middle = 0.5 * (low + high);
    let whole = gauss_legendre(f, low, high);
    let [one, other] = [gauss_legendre(f, low, middle), gauss_legendre(f, middle, high)];
    if halvings == 0 || (one + other - whole).abs() <= 1e-15 + 1e-14 * whole.abs() {
        return one + other;
    }
    panel(f, [low, middle], halvings - 1) + panel(f, [middle, high], halvings - 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mixture(all: &[[f64; 3]]) -> OneReal {
        let component = |[weight, mean, deviation]: &[f64; 3]| Component {
            weight: *weight,
            mean: vec![*mean],
            covariance: vec![deviation * deviation],
        };
        Mixture(all.iter().map(component).collect()).of_slot(0)
    }

    /// Integrals and roots in 40 digits (mpmath 1.3: `quad`, `findroot`).
    #[test]
    fn entropies_and_modes_of_mixtures() {
        for (all, entropy, mode) in CASES {
            let own = mixture(all);
            let found = own.entropy();
            assert!((found - entropy).abs() <= 1e-13 * entropy.abs().max(1.0), "{found}, expected {entropy}");
            let found = own.modes()[0].at[0];
            assert!((found - mode).abs() <= 1e-14 * mode.abs().max(1.0), "{found}, expected {mode}");
        }
        assert_eq!(mixture(&[[0.5, 0.0, 1.0], [0.5, 3.0, 0.0]]).entropy(), f64::NEG_INFINITY);
        let point = Peak { at: vec![3.0], free: 0, size: 0.5 };
        assert_eq!(mixture(&[[0.5, 0.0, 1.0], [0.5, 3.0, 0.0]]).modes(), [point]);
    }

    const CASES: &[(&[[f64; 3]], f64, f64)] = &[
        (&[[1.0, 2.0, 3.0]], 2.5175508218727822, 2.0),
        (&[[0.5, 0.0, 1.0], [0.5, 0.0, 1.0]], 1.4189385332046727, 0.0),
        (&[[0.7, 0.0, 1.0], [0.3, 3.0, 0.5]], 1.7591030178979685, 1.566515065274981e-07),
        (&[[0.25, -1.0, 1.0], [0.5, 1.0, 0.8], [0.25, 100.0, 0.001]], 0.41061549344644377, 100.0),
        (&[[0.5, 0.0, 1.0], [0.5, 1.9, 1.0]], 1.7330776209027543, 0.95),
        (&[[0.999, 0.0, 10.0], [0.001, 5.0, 0.01]], 3.720833331790404, 4.999995591930458),
        // Apart: the mean of their entropies, ½ (ln 1e−9 + ln 1) + ½ ln 2πe + ln 2.
        (&[[0.5, 0.0, 1.0], [0.5, 1e10, 1e-9]], -8.249547204708588, 1e10),
    ];
}

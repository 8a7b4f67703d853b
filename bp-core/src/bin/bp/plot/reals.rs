//! The panels of reals.
//!
//! In: the distribution of some variables. Out: a density for each real; of two reals alone their joint density too; of the
//! elements of a family their means and intervals on one axis. Invariant: a density is evaluated by its own law.

use super::labels::tick_between;
use super::{Density, Heat, Intervals, Panel};
use bp_core::compiler::answer::{Drawn, NamedLaw, Part, PartLaw};
use bp_core::compiler::law::Law;
use bp_core::compiler::model::Model;

/// Points of a density.
const POINTS: usize = 241;
/// Bars of a histogram of draws.
const BINS: usize = 40;
/// The least and the greatest number of cells along an axis of a joint density, and of one of draws.
const CELLS: f64 = 40.0;
const CELLS_OF_DRAWS: f64 = 16.0;
/// Elements of a family that are drawn together; fewer have a density each.
const LEAST_ELEMENTS: usize = 3;

/// The panels of the reals of a part.
pub(super) fn of(model: &Model, question: &str, part: &Part) -> Vec<Panel> {
    let places: Vec<usize> = (0..part.of.len()).filter(|place| part.of[*place].count == 0).collect();
    let own: Vec<Real> = places.iter().filter_map(|place| Real::of(model, part, *place)).collect();
    let mut panels = Vec::new();
    if let ([one, other], 2, true) = (own.as_slice(), part.of.len(), part.given.is_empty()) {
        panels.extend(joint(question, part, [one, other]));
    }
    let is_one_family = |one: &Real, other: &Real| {
        let (one, other) = (&part.of[one.place], &part.of[other.place]);
        one.variable == other.variable && one.index.is_some()
    };
    let is_alone = part.given.is_empty() && part.of.len() == 1;
    for group in own.chunk_by(is_one_family) {
        match group.len() >= LEAST_ELEMENTS {
            true => panels.push(Panel::Intervals(Intervals {
                title: question.to_owned(),
                across: model.variable_name(part.of[group[0].place].variable),
                marks: group.iter().map(|real| (real.label(), real.mean, real.interval)).collect(),
            })),
            false => panels.extend(group.iter().filter_map(|real| real.density(question, is_alone))),
        }
    }
    panels
}

/// A real of a part: where its probability lies, and its density.
struct Real {
    place: usize,
    name: String,
    mean: f64,
    /// The quantiles at 5 % and 95 %.
    interval: (f64, f64),
    /// Nearly all of its probability lies between these.
    ends: (f64, f64),
    shape: Shape,
}

/// What a density is drawn from.
enum Shape {
    /// A law, and means and deviations of its normal parts.
    Law(PartLaw, Vec<(f64, f64)>),
    /// Draws with their weights, ascending.
    Draws(Vec<(f64, f64)>),
}

impl Real {
    /// The real at a place; none without a spread.
    fn of(model: &Model, part: &Part, place: usize) -> Option<Self> {
        let law = part.marginal(&[place]).law;
        let mut narrow = Vec::new();
        let (mean, quantile): (f64, Box<dyn Fn(f64) -> f64>) = match &law {
            PartLaw::Normal { mean, covariance } => {
                let law = NamedLaw { law: Law::Normal, parameters: [mean[0], covariance[0].sqrt(), 0.0] };
                (mean[0], Box::new(move |level| law.quantile(level)))
            }
            PartLaw::Laws { laws, .. } => {
                let law = laws[0];
                (law.mean(), Box::new(move |level| law.quantile(level)))
            }
            PartLaw::NamedMixture(mixture) => {
                (mixture.mean(0), Box::new(move |level| mixture.quantile(0, level)))
            }
            PartLaw::Mixture(mixture) => {
                let deviation = |covariance: &[f64]| covariance[0].max(0.0).sqrt();
                narrow.extend(mixture.0.iter().map(|own| (own.mean[0], deviation(&own.covariance))));
                (mixture.mean(0), Box::new(move |level| mixture.quantile(0, level)))
            }
            PartLaw::Draws(..) => {
                let mut draws = drawn(&law, 0)?;
                draws.retain(|(value, weight)| value.is_finite() && *weight > 0.0);
                draws.sort_by(|one, other| one.0.total_cmp(&other.0));
                return Self::of_draws(part.of[place].name(model), place, draws);
            }
            PartLaw::Finite(_) | PartLaw::ConditionalGaussian(_) => return None,
        };
        let (ends, interval) = ((quantile(0.0005), quantile(0.9995)), (quantile(0.05), quantile(0.95)));
        drop(quantile);
        let name = part.of[place].name(model);
        Self { place, name, mean, interval, ends, shape: Shape::Law(law, narrow) }.spread()
    }

    fn of_draws(name: String, place: usize, draws: Vec<(f64, f64)>) -> Option<Self> {
        let total: f64 = draws.iter().map(|(_, weight)| weight).sum();
        let quantile = |level: f64| {
            let mut sum = 0.0;
            let found = draws.iter().find(|(_, weight)| {
                sum += weight;
                sum >= level * total
            });
            found.or(draws.last()).map(|(value, _)| *value)
        };
        let ends = (quantile(0.002)?, quantile(0.998)?);
        let interval = (quantile(0.05)?, quantile(0.95)?);
        let mean = draws.iter().map(|(value, weight)| value * weight).sum::<f64>() / total;
        Self { place, name, mean, interval, ends, shape: Shape::Draws(draws) }.spread()
    }

    fn spread(self) -> Option<Self> {
        let (low, high) = self.ends;
        (low.is_finite() && high.is_finite() && low < high).then_some(self)
    }

    /// The element of a family: what stands between the brackets.
    fn label(&self) -> String {
        let element = self.name.split_once('[').and_then(|(_, rest)| rest.strip_suffix(']'));
        element.unwrap_or(&self.name).to_owned()
    }

    /// Its density, with mean and interval.
    fn density(&self, question: &str, is_alone: bool) -> Option<Panel> {
        let (low, high) = self.ends;
        let title = if is_alone { question.to_owned() } else { format!("{question}: {}", self.name) };
        let (mut curves, mut histogram) = (Vec::new(), Vec::new());
        match &self.shape {
            Shape::Law(law, narrow) => {
                let points = points(low, high, narrow).into_iter().map(|x| (x, law.density(&[x])));
                curves.push(("density".to_owned(), points.filter(|(_, y)| y.is_finite()).collect()));
            }
            Shape::Draws(draws) => histogram = super::learning::histogram(draws, low, high, BINS),
        }
        let (interval, mean) = (Some(self.interval), Some(self.mean).filter(|mean| mean.is_finite()));
        Some(Panel::Density(Density { title, across: self.name.clone(), curves, histogram, interval, mean }))
    }

    /// Cells of an axis, about this many or up to three times as many: the middle of the first one, their distance, which is round, and
    /// their number.
    fn cells(&self, least: f64) -> (f64, f64, usize) {
        let (low, high) = self.ends;
        let widest = (high - low) / least;
        let power = 10f64.powf(widest.log10().floor());
        let step = [5.0, 2.0, 1.0].map(|digit| digit * power).into_iter().find(|step| *step <= widest);
        let step = step.unwrap_or(power);
        // Labels are left out at equal distances: the first one is a rounder number.
        let first = (low / (2.0 * step)).floor() * 2.0 * step;
        (first, step, ((high - first) / step).round() as usize + 1)
    }
}

/// The draws of a real with their weights, in their order.
fn drawn(law: &PartLaw, place: usize) -> Option<Vec<(f64, f64)>> {
    let PartLaw::Draws(draws, positions) = law else { return None };
    let Drawn::At(position) = positions[place] else { return None };
    Some((0..draws.count()).map(|draw| (draws.value(draw, position), draws.weight(draw))).collect())
}

/// The joint density of two reals; none where it is not known.
fn joint(question: &str, part: &Part, [one, other]: [&Real; 2]) -> Option<Panel> {
    let least = if matches!(part.law, PartLaw::Draws(..)) { CELLS_OF_DRAWS } else { CELLS };
    let axes = [one.cells(least), other.cells(least)];
    let [(left, width, columns), (bottom, height, rows)] = axes;
    let mut numbers = vec![0.0; columns * rows];
    if let (Some(across), Some(upwards)) = (drawn(&part.law, 0), drawn(&part.law, 1)) {
        let total: f64 = across.iter().map(|(_, weight)| weight).sum();
        for ((x, weight), (y, _)) in across.iter().zip(&upwards) {
            let (column, row) = (((x - left) / width).round(), ((y - bottom) / height).round());
            if (0.0..columns as f64).contains(&column) && (0.0..rows as f64).contains(&row) {
                numbers[row as usize * columns + column as usize] += weight / (total * width * height);
            }
        }
    } else {
        for (place, number) in numbers.iter_mut().enumerate() {
            let (column, row) = ((place % columns) as f64, (place / columns) as f64);
            *number = part.law.density(&[left + column * width, bottom + row * height]);
        }
    }
    if numbers.iter().any(|number| !number.is_finite()) {
        return None;
    }
    let labels = |(first, step, count): (f64, f64, usize)| {
        let label = tick_between(first, first + step * count as f64);
        (0..count).map(|cell| label(&(first + cell as f64 * step))).collect()
    };
    Some(Panel::Heat(Heat {
        title: question.to_owned(),
        across: (one.name.clone(), labels(axes[0])),
        upwards: (other.name.clone(), labels(axes[1])),
        measure: format!("probability density (per unit of {} and of {})", one.name, other.name),
        numbers,
    }))
}

/// Where a density is evaluated: at equal distances, and around the mean of each of its parts by parts of its deviation, so
/// that a part between two of those points is drawn too.
pub(super) fn points(low: f64, high: f64, parts: &[(f64, f64)]) -> Vec<f64> {
    let even = (0..POINTS).map(|point| low + (high - low) * point as f64 / (POINTS - 1) as f64);
    let around = |(mean, deviation): &(f64, f64)| {
        let (mean, deviation) = (*mean, *deviation);
        (-24..=24).map(move |step| mean + deviation * f64::from(step) / 6.0)
    };
    let parts = parts.iter().filter(|(_, deviation)| *deviation < (high - low) / 40.0);
    let mut all: Vec<f64> = even.chain(parts.flat_map(around)).filter(|x| (low..=high).contains(x)).collect();
    all.sort_by(f64::total_cmp);
    all.dedup();
    all
}

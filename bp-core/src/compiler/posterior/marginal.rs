//! Marginals of a part: some of its slots, its probabilities, its rows.
//!
//! In: a [`Part`]. Out: a part of fewer slots, numbers, rows. Invariant: omitted slots are summed out; slots stay in
//! their order.

use super::conditional::apart;
use super::named_law::NamedLaw;
use super::numbers::Numbers;
use super::part::{Drawn, Part, PartLaw, Slot, ordinals};
use super::{Figure, Row};
use crate::model::Model;
use crate::radix;
use std::sync::Arc;

impl Part {
    /// The distribution of the slots at some positions, ascending.
    pub fn marginal(&self, places: &[usize]) -> Self {
        let law = match &self.law {
            PartLaw::Normal { mean, covariance } => PartLaw::Normal {
                mean: places.iter().map(|place| mean[*place]).collect(),
                covariance: (places.iter())
                    .flat_map(|row| places.iter().map(|column| covariance[*row * mean.len() + *column]))
                    .collect(),
            },
            PartLaw::Laws { laws, covariance } => PartLaw::Laws {
                laws: places.iter().map(|place| laws[*place]).collect(),
                covariance: (places.iter())
                    .flat_map(|row| places.iter().map(|column| covariance[*row * laws.len() + *column]))
                    .collect(),
            },
            PartLaw::Mixture(mixture) => PartLaw::Mixture(mixture.marginal(places)),
            PartLaw::NamedMixture(mixture) => PartLaw::NamedMixture(mixture.marginal(places)),
            PartLaw::ConditionalGaussian(law) => law.marginal(&self.of, places),
            PartLaw::Draws(draws, drawn) => {
                PartLaw::Draws(Arc::clone(draws), places.iter().map(|place| drawn[*place].clone()).collect())
            }
            PartLaw::Finite(numbers) => {
                let kept: Vec<Slot> = places.iter().map(|place| self.of[*place].clone()).collect();
                let width: usize = kept.iter().map(|slot| slot.count).product();
                let mut sums = Vec::with_capacity(numbers.len() / self.width().max(1) * width);
                for context in numbers.chunks(self.width().max(1)) {
                    let mut own = vec![0.0; width];
                    for (place, p) in context.iter().enumerate() {
                        let at = ordinals(&self.of, place);
                        let at = radix::position(places.iter().map(|own| (at[*own], self.of[*own].count)));
                        own[at] += p;
                    }
                    sums.extend(own);
                }
                PartLaw::Finite(sums.into())
            }
        };
        let of = places.iter().map(|place| self.of[*place].clone()).collect();
        Part { instant: self.instant, given: self.given.clone(), of, law }
    }

    /// The probability of each combination of finite slots; `None` if a slot is real.
    pub fn probabilities(&self) -> Option<Numbers> {
        let finite = self.of.iter().all(|slot| slot.count > 0);
        match &self.law {
            PartLaw::Finite(numbers) => Some(numbers.clone()),
            PartLaw::Draws(draws, drawn) if finite => {
                let (mut sums, mut total) = (vec![0.0; self.width()], 0.0);
                for draw in 0..draws.count() {
                    let at = drawn.iter().zip(&self.of).fold(0, |sum, (drawn, slot)| match drawn {
                        Drawn::At(position) => sum * slot.count + draws.value(draw, *position) as usize,
                        Drawn::Normals(_) => sum,
                    });
                    sums[at] += draws.weight(draw);
                    total += draws.weight(draw);
                }
                sums.iter_mut().for_each(|sum| *sum /= total);
                Some(sums.into())
            }
            _ => None,
        }
    }

    /// The rows of a part, for display.
    pub fn rows(&self, model: &Model) -> Vec<Row> {
        let instant = self.instant.map(|instant| ("t".to_owned(), instant.to_string()));
        let named = |slots: &[Slot], place: usize| -> Vec<(String, String)> {
            let values = slots.iter().zip(ordinals(slots, place));
            values.map(|(slot, at)| (slot.name(model), model.value_name(slot.variable, at))).collect()
        };
        let alone = |slot: &Slot, figure: Figure| Row {
            values: instant.iter().cloned().chain([(slot.name(model), String::new())]).collect(),
            figure,
        };
        match &self.law {
            PartLaw::Finite(numbers) => {
                let width = self.width().max(1);
                let row = |(place, p): (usize, &f64)| Row {
                    values: (instant.iter().cloned())
                        .chain(named(&self.given, place / width))
                        .chain(named(&self.of, place % width))
                        .collect(),
                    figure: Figure::Probability { p: *p },
                };
                numbers.iter().enumerate().map(row).collect()
            }
            PartLaw::Normal { mean, covariance } => {
                let law = |(place, slot): (usize, &Slot)| {
                    let deviation = covariance[place * mean.len() + place].max(0.0).sqrt();
                    alone(slot, Figure::Normal { mean: mean[place], deviation })
                };
                self.of.iter().enumerate().map(law).collect()
            }
            PartLaw::Laws { laws, .. } => {
                let row = |(law, slot): (&NamedLaw, &Slot)| alone(slot, Figure::of_law(*law));
                laws.iter().zip(&self.of).map(row).collect()
            }
            PartLaw::NamedMixture(mixture) => {
                let row = |(place, slot): (usize, &Slot)| alone(slot, mixture.figure(place));
                self.of.iter().enumerate().map(row).collect()
            }
            PartLaw::Mixture(mixture) => {
                let row = |(place, slot): (usize, &Slot)| alone(slot, Figure::of_mixture(mixture, place));
                self.of.iter().enumerate().map(row).collect()
            }
            // The probabilities of the finite slots, and then the law of each real given each combination of them.
            PartLaw::ConditionalGaussian(law) => {
                let (finite, reals) = apart(&self.of);
                let mut rows = self.marginal(&finite).rows(model);
                let finite: Vec<Slot> = finite.iter().map(|place| self.of[*place].clone()).collect();
                for (at, mixture) in law.given_each(&finite) {
                    for (place, real) in reals.iter().enumerate() {
                        let figure = match mixture.0.as_slice() {
                            [one] => {
                                Figure::Normal { mean: one.mean[place], deviation: one.deviation(place) }
                            }
                            _ => Figure::of_mixture(&mixture, place),
                        };
                        let mut row = alone(&self.of[*real], figure);
                        let before = row.values.len() - 1;
                        row.values.splice(before..before, named(&finite, at));
                        rows.push(row);
                    }
                }
                rows
            }
            PartLaw::Draws(draws, drawn) => {
                let finite = |place: &usize| self.of[*place].count > 0;
                let (finite, reals): (Vec<usize>, Vec<usize>) = (0..self.of.len()).partition(finite);
                let mut rows = Vec::new();
                if !finite.is_empty() {
                    let own = self.marginal(&finite);
                    // Where no draw, or each, has the value: the deviation of a share of which nothing else is known.
                    let count = draws.effective().max(1.0);
                    let error = |p: f64| (p * (1.0 - p) / count).max(0.0).sqrt().max(least(p, count));
                    let all = own.probabilities().unwrap_or_default();
                    rows.extend(all.iter().enumerate().map(|(place, p)| Row {
                        values: instant.iter().cloned().chain(named(&own.of, place)).collect(),
                        figure: Figure::Estimated { p: *p, error: error(*p) },
                    }));
                }
                rows.extend(reals.iter().map(|place| {
                    let of = match &drawn[*place] {
                        Drawn::At(position) => draws.moments(*position),
                        Drawn::Normals(normals) => normals.moments,
                    };
                    alone(&self.of[*place], Figure::real(&of))
                }));
                rows
            }
        }
    }
}

/// The standard error of a share of 0 or 1 among so many draws: that of the mean of its distribution, uniform before them.
fn least(p: f64, count: f64) -> f64 {
    if p > 0.0 && p < 1.0 { 0.0 } else { 1.0 / (count + 2.0) }
}

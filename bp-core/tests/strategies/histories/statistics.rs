//! Statistics over time, compared with those of the enumerated distributions.
//!
//! In: a world, observations, and the enumerated probabilities. Out: pass if entropy, maximum, argmax, best,
//! expectation, variance and divergence of each instant, and the best and drawn sequences, agree. Invariant: each
//! statistic is written here from its definition.

use super::hold::{Row, near};
use super::{Kind, World};
use bp_core::compiler::answer::{Answer, Figure};
use bp_core::compiler::model::Model;
use std::collections::HashMap;

/// The enumerated distributions of a question.
pub(super) struct Enumerated<'e> {
    pub(super) context: &'e str,
    pub(super) searched: &'e [usize],
    /// P(searched | all observations), instant by instant.
    pub(super) smooth: &'e [Vec<f64>],
    /// P(searched | observations up to the instant).
    pub(super) filter: &'e [Vec<f64>],
}

fn entropy(p: &[f64]) -> f64 {
    -p.iter().filter(|p| **p > 0.0).map(|p| p * p.ln()).sum::<f64>()
}

fn number(figure: &Figure) -> f64 {
    match *figure {
        Figure::Probability { p } => p,
        Figure::Entropy { entropy, .. } => entropy,
        Figure::Expectation { expectation, .. } => expectation,
        Figure::Variance { variance, .. } => variance,
        Figure::Divergence { divergence, .. } => divergence,
        ref other => panic!("{other:?}"),
    }
}

fn numbers(answer: &Answer) -> Vec<f64> {
    answer.answer.iter().map(|row| number(&row.figure)).collect()
}

fn largest(p: &[f64]) -> f64 {
    p.iter().copied().fold(0.0, f64::max)
}

impl World {
    /// Checks the statistics of single instants.
    pub(super) fn hold_statistics(&self, model: &Model, rows: &[Row], known: &Enumerated<'_>) {
        let (context, searched) = (known.context, known.searched);
        let last = known.filter.last().unwrap();
        let ask = |words: &str| {
            let text = self.asked(words, searched);
            let answer = self.answered(model, &text, rows);
            numbers(&answer.unwrap_or_else(|error| panic!("{context}\n{text}\n{error}")))
        };
        near(context, &ask("entropy filter"), &[entropy(last)]);
        near(context, &ask("max filter"), &[largest(last)]);
        let each: Vec<f64> = known.smooth.iter().map(|p| entropy(p)).collect();
        near(context, &ask("entropy smooth"), &each);
        let likely = ask("argmax smooth");
        assert!(likely.len() >= rows.len(), "{context}");
        let most = known.smooth.iter().map(|p| largest(p)).fold(0.0, f64::max);
        assert!((largest(&likely) - most).abs() <= 1e-10, "{context}\n{likely:?}");
        let mut sorted = last.clone();
        sorted.sort_by(|one, other| other.total_cmp(one));
        sorted.retain(|p| *p > 0.0);
        sorted.truncate(3);
        near(context, &ask("best(3) filter"), &sorted);
        if let [slot] = searched
            && !self.slots[*slot].name.contains('[')
            && let Some(value) = self.value(*slot)
        {
            let moments = |p: &Vec<f64>| {
                let mean: f64 = p.iter().enumerate().map(|(at, p)| p * value(at)).sum();
                let variance = p.iter().enumerate().map(|(at, p)| p * (value(at) - mean).powi(2));
                [mean, variance.sum::<f64>()]
            };
            let each: Vec<[f64; 2]> = known.smooth.iter().map(moments).collect();
            near(context, &ask("expectation smooth"), &each.iter().map(|of| of[0]).collect::<Vec<_>>());
            near(context, &ask("variance smooth"), &each.iter().map(|of| of[1]).collect::<Vec<_>>());
        }
        let text = self.asked("divergence smooth", searched);
        let text = format!("{text} from {}", self.asked("filter", searched));
        let found =
            numbers(&self.answered(model, &text, rows).unwrap_or_else(|error| panic!("{context}\n{error}")));
        let divergence = |(p, q): (&Vec<f64>, &Vec<f64>)| {
            let terms = p.iter().zip(q).filter(|(p, _)| **p > 0.0).map(|(p, q)| p * (p / q).ln());
            terms.sum::<f64>().max(0.0)
        };
        near(context, &found, &known.smooth.iter().zip(known.filter).map(divergence).collect::<Vec<_>>());
    }

    /// The number of a value of a slot; `None` for labels.
    fn value(&self, slot: usize) -> Option<impl Fn(usize) -> f64> {
        let kind = self.slots[slot].kind;
        (kind != Kind::Labels).then_some(move |ordinal: usize| match kind {
            Kind::Range(low) => low as f64 + ordinal as f64,
            Kind::Bins => ordinal as f64 + 0.5,
            _ => ordinal as f64,
        })
    }

    /// Checks the best sequences and drawn ones; `key` reads a sequence of rows.
    pub(super) fn hold_sequences(
        &self,
        model: &Model,
        rows: &[Row],
        (context, slots): (&str, &[usize]),
        sequences: &HashMap<Vec<usize>, f64>,
        key: impl Fn(&Answer, usize) -> Vec<usize>,
    ) {
        let total: f64 = sequences.values().sum();
        let ask = |words: &str| {
            let text = self.asked(words, slots);
            let answer = self.answered(model, &text, rows);
            answer.unwrap_or_else(|error| panic!("{context}\n{text}\n{error}"))
        };
        let mut sorted: Vec<f64> = sequences.values().map(|weight| weight / total).collect();
        sorted.sort_by(|one, other| other.total_cmp(one));
        sorted.truncate(4);
        near(context, &numbers(&ask("max sequence")), &sorted[..1]);
        let best = ask("best(4) sequence");
        let expected: Vec<f64> = sorted.iter().flat_map(|p| vec![*p; rows.len()]).collect();
        near(context, &numbers(&best), &expected);
        for (number, p) in sorted.iter().enumerate() {
            let found = sequences.get(&key(&best, number * rows.len())).copied().unwrap_or(0.0) / total;
            assert!((found - p).abs() <= 1e-10, "{context}\nsequence {number}: {found}, expected {p}");
        }
        let drawn = ask("draw(20) sequence");
        assert_eq!(drawn.answer.len(), 20 * rows.len(), "{context}");
        for number in 0..20 {
            let own = key(&drawn, number * rows.len());
            assert!(sequences.get(&own).is_some_and(|weight| *weight > 0.0), "{context}\n{own:?}");
        }
    }
}

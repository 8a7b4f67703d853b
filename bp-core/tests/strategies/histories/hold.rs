//! Enumeration of histories, and the comparison of answers with it.
//!
//! In: a world, and the observations at each instant. Out: pass if filter, predict, smooth, sequence and ln P agree
//! with the sum over every history. Invariant: a history's weight is a product of the world's own tables.

use super::statistics::Enumerated;
use super::{Dice, Factor, Form, Kind, LABELS, Real, World, world};
use crate::support::{model_of, question};
use bp_core::compiler::answer::{Answer, ask_over_time};
use bp_core::compiler::error::Error;
use bp_core::compiler::exec::Inputs;
use bp_core::compiler::model::Model;
use bp_core::compiler::sample::Sampling;
use std::collections::HashMap;

/// The observations of an instant: slots, then reals; NaN if a value is missing.
pub(super) type Row = Vec<f64>;

impl World {
    fn bell(&self, real: &Real, value: f64, now: &[usize], before: &[usize]) -> f64 {
        let [mean, deviation] = real.laws[self.row(&real.parents, now, before)];
        let standard = (value - mean) / deviation;
        (-0.5 * standard * standard).exp() / (deviation * std::f64::consts::TAU.sqrt())
    }

    /// A possible history of this length, if one is found.
    fn history(&self, dice: &mut Dice, length: usize) -> Option<Vec<Row>> {
        let draw = |dice: &mut Dice, factor: &Factor, row: usize| match &factor.form {
            Form::Table(cells) => {
                let count = self.slots[factor.slot].count;
                let (mut rest, mut value) = (dice.unit(), None);
                for (ordinal, p) in cells[row * count..(row + 1) * count].iter().enumerate() {
                    if *p > 0.0 && rest >= 0.0 {
                        value = Some(ordinal);
                    }
                    rest -= p;
                }
                value
            }
            Form::Dirac(values) => values[row],
        };
        let mut before = vec![0; self.slots.len()];
        for factor in &self.start {
            before[factor.slot] = draw(dice, factor, self.row(&factor.parents, &[], &before))?;
        }
        let mut rows = Vec::new();
        for _ in 0..length {
            let mut now = vec![0; self.slots.len()];
            for factor in &self.factors {
                now[factor.slot] = draw(dice, factor, self.row(&factor.parents, &now, &before))?;
            }
            let mut row: Row = (self.slots.iter().zip(&now))
                .map(|(slot, value)| if slot.known && dice.chance(0.65) { *value as f64 } else { f64::NAN })
                .collect();
            for real in &self.reals {
                let [mean, deviation] = real.laws[self.row(&real.parents, &now, &before)];
                let value = mean + deviation * (dice.unit() * 4.0 - 2.0);
                row.push(if dice.chance(0.7) { value } else { f64::NAN });
            }
            if dice.chance(0.15) {
                row.fill(f64::NAN);
            }
            rows.push(row);
            before = now;
        }
        Some(rows)
    }

    /// Calls `visit(history, its weight)` for every possible history; the first state of a history is the one before
    /// the first instant.
    fn each_history(&self, rows: &[Row], ahead: usize, visit: &mut dyn FnMut(&[Vec<usize>], f64)) {
        let mut history = vec![vec![0; self.slots.len()]];
        self.begin(rows, ahead, 0, 1.0, &mut history, visit);
    }

    fn begin(
        &self,
        rows: &[Row],
        ahead: usize,
        number: usize,
        weight: f64,
        history: &mut Vec<Vec<usize>>,
        visit: &mut dyn FnMut(&[Vec<usize>], f64),
    ) {
        let Some(factor) = self.start.get(number) else {
            history.push(vec![0; self.slots.len()]);
            self.go_on(rows, ahead, 0, weight, history, visit);
            history.pop();
            return;
        };
        for value in 0..self.slots[factor.slot].count {
            history[0][factor.slot] = value;
            let p = self.p(factor, &[], &history[0]);
            if p > 0.0 {
                self.begin(rows, ahead, number + 1, weight * p, history, visit);
            }
        }
    }

    fn go_on(
        &self,
        rows: &[Row],
        ahead: usize,
        number: usize,
        weight: f64,
        history: &mut Vec<Vec<usize>>,
        visit: &mut dyn FnMut(&[Vec<usize>], f64),
    ) {
        let instant = history.len() - 2;
        let Some(factor) = self.factors.get(number) else {
            let (now, before) = (&history[instant + 1], &history[instant]);
            let mut weight = weight;
            if let Some(row) = rows.get(instant) {
                for (real, value) in self.reals.iter().zip(&row[self.slots.len()..]) {
                    weight *= if value.is_nan() { 1.0 } else { self.bell(real, *value, now, before) };
                }
                if let Some((slot, weights)) = &self.likelihood {
                    weight *= weights[now[*slot]];
                }
            }
            if weight == 0.0 {
                return;
            }
            if instant + 1 == rows.len() + ahead {
                visit(history, weight);
                return;
            }
            history.push(vec![0; self.slots.len()]);
            self.go_on(rows, ahead, 0, weight, history, visit);
            history.pop();
            return;
        };
        let seen = rows.get(instant).map_or(f64::NAN, |row| row[factor.slot]);
        for value in 0..self.slots[factor.slot].count {
            if !seen.is_nan() && seen != value as f64 {
                continue;
            }
            history[instant + 1][factor.slot] = value;
            let p = self.p(factor, &history[instant + 1], &history[instant]);
            if p > 0.0 {
                self.go_on(rows, ahead, number + 1, weight * p, history, visit);
            }
        }
    }

    /// A question for some slots, searched by their variables' names.
    pub(super) fn asked(&self, word: &str, searched: &[usize]) -> String {
        let mut names: Vec<&str> = Vec::new();
        for slot in searched {
            let name = self.slots[*slot].name.split('[').next().unwrap();
            if !names.contains(&name) {
                names.push(name);
            }
        }
        let mut known: Vec<String> = Vec::new();
        for slot in self.slots.iter().filter(|slot| slot.known) {
            let name = slot.name.split('[').next().unwrap().to_owned();
            if !known.contains(&name) {
                known.push(name);
            }
        }
        known.extend(self.reals.iter().map(|real| real.name.to_owned()));
        if let Some((slot, weights)) = &self.likelihood {
            known.push(format!("{} virtual {weights:?}", self.slots[*slot].name));
        }
        let bar = if known.is_empty() { "" } else { " | " };
        format!("{word} P({}{bar}{})", names.join(" "), known.join(", "))
    }

    pub(super) fn answered(&self, model: &Model, text: &str, rows: &[Row]) -> Result<Answer, Error> {
        let names: Vec<&str> = (self.slots.iter().map(|slot| slot.name.as_str()))
            .chain(self.reals.iter().map(|real| real.name))
            .collect();
        let observed = |row: &Row| {
            let cells = names.iter().zip(row).enumerate().filter(|(_, (_, value))| !value.is_nan());
            let number = |place: usize, value: f64| match self.slots.get(place).map(|slot| &slot.kind) {
                Some(Kind::Range(low)) => *low as f64 + value,
                Some(Kind::Bins) => value + 0.5,
                _ => value,
            };
            cells
                .map(|(place, (name, value))| ((*name).to_owned(), number(place, *value)))
                .collect::<Vec<_>>()
        };
        let rows: Vec<_> = rows.iter().map(observed).collect();
        let answers =
            ask_over_time(model, &question(model, text), &rows, &Inputs::new(), Sampling::default());
        answers.map(|mut answers| answers.remove(0))
    }

    fn ordinal(&self, searched: &[usize], values: &[usize]) -> usize {
        searched.iter().fold(0, |at, slot| at * self.slots[*slot].count + values[*slot])
    }
}

/// Tolerance of a probability.
const NEAR: f64 = 1e-10;

#[track_caller]
pub(super) fn near(context: &str, found: &[f64], expected: &[f64]) {
    assert_eq!(found.len(), expected.len(), "{context}\n{found:?}\n{expected:?}");
    let all = found.iter().zip(expected).all(|(p, q)| (p - q).abs() <= NEAR);
    assert!(all, "{context}\nfound {found:?}\nexpected {expected:?}");
}

fn figures(answer: &Answer) -> Vec<f64> {
    answer.answer.iter().map(|row| row.p().unwrap()).collect()
}

/// Compares one random program with the enumeration; returns whether its observations are possible.
fn hold(seed: u64) -> bool {
    let dice = &mut Dice(seed);
    let world = world(dice);
    let states: f64 = world.slots.iter().map(|slot| slot.count as f64).product();
    let length = (1 + dice.below(4)).min((12.0 / states.ln()).floor().max(1.0) as usize);
    let Some(mut rows) = world.history(dice, length) else { return false };
    if dice.chance(0.1) {
        // An observation that may be impossible.
        let (row, slot) = (dice.below(length), dice.below(world.slots.len()));
        if world.slots[slot].known {
            rows[row][slot] = dice.below(world.slots[slot].count) as f64;
        }
    }
    let model = model_of(&world.text);
    let likely = world.likelihood.as_ref().map(|(slot, _)| *slot);
    let is_free = |slot: &usize| !world.slots[*slot].known && Some(*slot) != likely;
    let free: Vec<usize> = (0..world.slots.len()).filter(is_free).collect();
    if free.is_empty() {
        return false;
    }
    let mut searched: Vec<usize> = free.iter().copied().filter(|_| dice.chance(0.6)).collect();
    if searched.is_empty() {
        searched.push(free[dice.below(free.len())]);
    }
    // A family is searched whole.
    let family: Vec<usize> =
        free.iter().copied().filter(|slot| world.slots[*slot].name.starts_with('F')).collect();
    if searched.iter().any(|slot| family.contains(slot)) {
        searched.retain(|slot| !family.contains(slot));
        searched.extend(&family);
    }
    let width: usize = searched.iter().map(|slot| world.slots[*slot].count).product();
    let carried: Vec<usize> = (0..world.slots.len()).filter(|slot| world.slots[*slot].carried).collect();
    let sequenced: Option<Vec<usize>> = carried.iter().all(is_free).then(|| {
        let beside = searched.iter().copied().filter(|slot| !carried.contains(slot));
        carried.iter().copied().chain(beside).collect()
    });
    let (mut total, mut smooth) = (0.0, vec![vec![0.0; width]; length]);
    let mut sequences: HashMap<Vec<usize>, f64> = HashMap::new();
    world.each_history(&rows, 0, &mut |history, weight| {
        total += weight;
        for (instant, now) in history[1..].iter().enumerate() {
            smooth[instant][world.ordinal(&searched, now)] += weight;
        }
        if let Some(slots) = &sequenced {
            let key = history[1..].iter().map(|now| world.ordinal(slots, now)).collect();
            *sequences.entry(key).or_default() += weight;
        }
    });
    let text = world.asked("filter", &searched);
    let context = format!("seed {seed}\n{}\n{text}\n{rows:?}", world.text);
    let filter = world.answered(&model, &text, &rows);
    if total == 0.0 {
        let error = filter.expect_err(&context).to_string();
        assert!(error.contains("probability zero"), "{context}\n{error}");
        return false;
    }
    let filter = filter.unwrap_or_else(|error| panic!("{context}\n{error}"));
    smooth.iter_mut().flatten().for_each(|p| *p /= total);
    near(&context, &figures(&filter), &smooth[length - 1]);
    let ln = filter.ln_evidence.unwrap();
    assert!((ln - total.ln()).abs() <= NEAR, "{context}\nln P = {ln}, expected {}", total.ln());
    let all = world.answered(&model, &world.asked("smooth", &searched), &rows).unwrap();
    near(&context, &figures(&all), &smooth.concat());
    assert!((all.ln_evidence.unwrap() - total.ln()).abs() <= NEAR, "{context}");
    if let Some(slots) = &sequenced {
        let best = sequences.values().copied().fold(0.0, f64::max);
        let found = world.answered(&model, &world.asked("sequence", slots), &rows).unwrap();
        assert_eq!(found.answer.len(), length, "{context}");
        let value = |found: &Answer, row: usize, column: usize| {
            let values = &found.answer[row].values;
            let skip = values.len() - slots.len();
            let (name, slot) = (&values[column + skip].1, &world.slots[slots[column]]);
            let named = |ordinal: usize| match slot.kind {
                Kind::Bool => ["false", "true"][ordinal].to_owned(),
                Kind::Labels => LABELS[ordinal].to_owned(),
                Kind::Range(low) => (low + ordinal as i64).to_string(),
                Kind::Bins => model.variables[model.variable(&slot.name).unwrap()].domain.value_name(ordinal),
            };
            (0..slot.count).find(|ordinal| named(*ordinal) == *name).unwrap()
        };
        let key = |found: &Answer, first: usize| -> Vec<usize> {
            let ordinal = |row: usize| {
                let slots = slots.iter().enumerate();
                slots.fold(0, |at, (column, slot)| at * world.slots[*slot].count + value(found, row, column))
            };
            (first..first + length).map(ordinal).collect()
        };
        let likely = sequences.get(&key(&found, 0)).copied().unwrap_or(0.0);
        assert!(likely >= best * (1.0 - 1e-9), "{context}\n{found:?}\n{likely} of {best}");
        world.hold_sequences(&model, &rows, (&context, slots), &sequences, key);
    }
    let mut filtered: Vec<Vec<f64>> = Vec::new();
    for observed in 1..=length {
        let mut own = vec![0.0; width];
        world.each_history(&rows[..observed], 0, &mut |history, weight| {
            own[world.ordinal(&searched, &history[observed])] += weight;
        });
        let total: f64 = own.iter().sum();
        filtered.push(own.iter().map(|p| p / total).collect());
    }
    let known = Enumerated { context: &context, searched: &searched, smooth: &smooth, filter: &filtered };
    world.hold_statistics(&model, &rows, &known);
    let ahead = 1 + dice.below(2);
    if (length + ahead) as f64 * states.ln() > 12.0 {
        return true;
    }
    let (mut future, mut whole) = (vec![0.0; width], 0.0);
    world.each_history(&rows, ahead, &mut |history, weight| {
        future[world.ordinal(&searched, &history[history.len() - 1])] += weight;
        whole += weight;
    });
    if whole > 0.0 {
        future.iter_mut().for_each(|p| *p /= whole);
        let asked = world.asked(&format!("predict({ahead})"), &searched);
        let predicted = world.answered(&model, &asked, &rows).unwrap();
        near(&context, &figures(&predicted), &future);
        // A predicted instant counts as an empty row does: its variables have values.
        assert!((predicted.ln_evidence.unwrap() - whole.ln()).abs() <= NEAR, "{context}");
    }
    true
}

#[test]
fn random_programs_are_the_sum_over_all_histories() {
    let possible = (0..1500).filter(|seed| hold(*seed)).count();
    assert!(possible > 1000, "only {possible} programs had observations that can be");
}

//! The matrices of a chain, from the program's own factors.
//!
//! In: a program whose carried variables are finite, and what is observed at each instant. Out: a [`Chain`] and its
//! matrices. Invariant: each matrix is the answer of a compiled exact question, P(X S Z = z | X^-1), so that all that a
//! program may say within an instant is summed by the planner; what was not observed is summed out.

use super::Instant;
use super::chain::{Chain, Matrix};
use crate::distribution::Setting;
use crate::error::Error;
use crate::exec::{Inputs, Lanes};
use crate::ids::VariableId;
use crate::lower::lower;
use crate::model::Question;
use crate::plan::{Options, OverTime, Route, plan};
use std::collections::{BTreeSet, HashMap};
use std::sync::Arc;

/// Cells of a transition table, at most.
const MOST_CELLS: f64 = 1e7;

/// A chain in the making.
pub(super) struct Finite<'s> {
    setting: &'s Setting<'s>,
    route: &'s OverTime,
    /// The slots of an outcome: carried first, then what is searched besides.
    outcome: Vec<usize>,
    compiled: HashMap<BTreeSet<VariableId>, Compiled>,
}

/// The table of one pattern of observations.
struct Compiled {
    lanes: Lanes,
    output: String,
    /// For each cell: its state before, its outcome, and the finite observations that it holds for.
    cells: Vec<(usize, usize, Vec<f64>)>,
    finite: Vec<usize>,
    reals: Vec<VariableId>,
    made: HashMap<Vec<u64>, Matrix>,
}

impl<'s> Finite<'s> {
    pub(super) fn new(setting: &'s Setting<'s>, route: &'s OverTime) -> Self {
        let mut outcome: Vec<usize> =
            route.carried.iter().flat_map(|(now, _)| setting.slots_of(*now)).collect();
        for slot in route.ask.searched.iter().flat_map(|item| setting.slots_of(item.variable)) {
            if !outcome.contains(&slot) {
                outcome.push(slot);
            }
        }
        Self { setting, route, outcome, compiled: HashMap::new() }
    }

    fn count(&self, slot: usize) -> usize {
        self.setting.count(self.setting.variable_of(slot))
    }

    /// The values that an outcome gives to some of its slots.
    pub(super) fn slots(&self, outcome: usize, slots: &[usize]) -> Vec<f64> {
        let (mut rest, mut values) = (outcome, HashMap::new());
        for slot in self.outcome.iter().rev() {
            values.insert(*slot, (rest % self.count(*slot)) as f64);
            rest /= self.count(*slot);
        }
        slots.iter().map(|slot| values[slot]).collect()
    }

    /// A belief over outcomes, summed to some of their slots; the last one fastest.
    pub(super) fn marginal(&self, slots: &[usize], belief: &[f64]) -> Vec<(Vec<f64>, f64)> {
        let joint = |values: &[f64]| {
            let digits = values.iter().zip(slots);
            digits.fold(0, |joint, (value, slot)| joint * self.count(*slot) + *value as usize)
        };
        let cells: usize = slots.iter().map(|slot| self.count(*slot)).product();
        let mut rows = vec![(Vec::new(), 0.0); cells];
        for (outcome, p) in belief.iter().enumerate() {
            let values = self.slots(outcome, slots);
            let row = &mut rows[joint(&values)];
            *row = (values, row.1 + p);
        }
        rows
    }

    fn before(&self) -> Vec<usize> {
        self.route.carried.iter().flat_map(|(_, before)| self.setting.slots_of(*before)).collect()
    }

    /// The chain: its prior is what the forms of X^-1 say before the first instant.
    pub(super) fn chain(&self) -> Result<Chain, Error> {
        let (setting, before) = (self.setting, self.before());
        let states: usize = before.iter().map(|slot| self.count(*slot)).product();
        let outcomes: f64 = self.outcome.iter().map(|slot| self.count(*slot) as f64).product();
        if outcomes * states as f64 > MOST_CELLS {
            let help = "carry fewer variables, or in fewer values".to_owned();
            let name = setting.model.name.clone();
            return Err(Error::TooLarge { name, cells: outcomes * states as f64, most: MOST_CELLS, help });
        }
        let instances: Vec<_> = (setting.ordered()?.into_iter())
            .filter(|instance| instance.left.iter().any(|slot| before.contains(slot)))
            .collect();
        let mut prior = Vec::with_capacity(states);
        let mut values = vec![f64::NAN; setting.slots()];
        for state in 0..states {
            let mut rest = state;
            for slot in before.iter().rev() {
                values[*slot] = (rest % self.count(*slot)) as f64;
                rest /= self.count(*slot);
            }
            let mut ln = 0.0;
            for instance in &instances {
                ln += setting.ln_density(instance, &values)?;
            }
            prior.push(ln.exp());
        }
        let total: f64 = prior.iter().sum();
        if total.is_nan() || total <= 0.0 {
            return Err(Error::Impossible(format!("the first instant of {}", setting.model.name).into()));
        }
        prior.iter_mut().for_each(|p| *p /= total);
        let beyond: usize = self.outcome[before.len()..].iter().map(|slot| self.count(*slot)).product();
        Ok(Chain { prior, state_of: (0..states * beyond).map(|outcome| outcome / beyond).collect() })
    }

    /// The matrix of an instant.
    pub(super) fn matrix(&mut self, instant: &Instant) -> Result<Matrix, Error> {
        let pattern: BTreeSet<VariableId> =
            instant.iter().map(|(slot, _)| self.setting.variable_of(*slot)).collect();
        if !self.compiled.contains_key(&pattern) {
            let compiled = self.compile(&pattern)?;
            self.compiled.insert(pattern.clone(), compiled);
        }
        let setting = self.setting;
        let outcomes: usize = self.outcome.iter().map(|slot| self.count(*slot)).product();
        let states: usize = self.before().iter().map(|slot| self.count(*slot)).product();
        let compiled = self.compiled.get_mut(&pattern).expect("internal: it has just been compiled");
        let mut key: Vec<u64> = instant.iter().map(|(_, value)| value.to_bits()).collect();
        key.extend(instant.iter().map(|(slot, _)| *slot as u64));
        if let Some(made) = compiled.made.get(&key) {
            return Ok(made.clone());
        }
        let value_of =
            |slot: usize| instant.iter().find(|(own, _)| *own == slot).map_or(f64::NAN, |(_, value)| *value);
        let mut inputs: Inputs<'_, f64> = setting.inputs().clone();
        if let Some(plate) = setting.model.plate {
            inputs = inputs.size(&setting.model.sets[plate.set].name, 1);
        }
        let given: Vec<(String, Vec<f64>)> = (compiled.reals.iter())
            .map(|real| (setting.model.variable_name(*real), setting.slots_of(*real).map(value_of).collect()))
            .collect();
        if let Some((name, _)) = given.iter().find(|(_, values)| values.iter().any(|value| value.is_nan())) {
            return Err(Error::input(name, "of an instant, all of its elements are observed or none"));
        }
        for (name, values) in &given {
            inputs = inputs.array(name, values);
        }
        let outputs = compiled.lanes.run(&inputs)?;
        let cells = outputs.get(&compiled.output);
        let wanted: Vec<f64> = compiled.finite.iter().map(|slot| value_of(*slot)).collect();
        let mut matrix = vec![0.0; states * outcomes];
        for (cell, (state, outcome, held)) in cells.iter().zip(&compiled.cells) {
            // A family of which one element was not observed is summed over it.
            if held.iter().zip(&wanted).all(|(held, wanted)| wanted.is_nan() || held == wanted) {
                matrix[state * outcomes + outcome] += cell;
            }
        }
        if matrix.iter().any(|cell| cell.is_nan()) {
            let reason = "its answer is not a number: a divisor or a standard deviation may be 0";
            return Err(Error::input(&compiled.output, reason));
        }
        let matrix = Arc::new(matrix);
        if compiled.reals.is_empty() {
            compiled.made.insert(key, matrix.clone());
        }
        Ok(matrix)
    }

    fn compile(&self, observed: &BTreeSet<VariableId>) -> Result<Compiled, Error> {
        let (setting, model) = (self.setting, self.setting.model);
        let ask = self.route.transition(model, observed);
        let question = Question { name: "transition".to_owned(), asks: vec![ask] };
        let mut routes = plan(model, &question, Options::default())?.routes;
        let Some(Route::Exact(exact)) = routes.pop() else {
            let reason = "the observations of an instant have no exact likelihood".to_owned();
            return Err(Error::Unplanned { question: model.ask_text(&question.asks[0]), reason });
        };
        let lowered = lower(model, &exact, "transition")?;
        let output = lowered
            .outputs
            .iter()
            .find(|output| output.ask.is_some())
            .expect("internal: one ask, one output");
        let axes: Vec<usize> =
            output.variables.iter().flat_map(|variable| setting.slots_of(*variable)).collect();
        let size: f64 = axes.iter().map(|slot| self.count(*slot) as f64).product();
        if size > MOST_CELLS {
            let help = "observe fewer variables at once, or in fewer values".to_owned();
            return Err(Error::TooLarge { name: output.name.clone(), cells: size, most: MOST_CELLS, help });
        }
        let before = self.before();
        let finite: Vec<usize> = (observed.iter())
            .filter(|variable| model.variables[**variable].domain.is_finite())
            .flat_map(|variable| setting.slots_of(*variable))
            .collect();
        let reals =
            observed.iter().copied().filter(|variable| !model.variables[*variable].domain.is_finite());
        let joint = |slots: &[usize], values: &HashMap<usize, usize>| {
            slots.iter().fold(0, |joint, slot| joint * self.count(*slot) + values[slot])
        };
        let cells = (0..size as usize).map(|cell| {
            let (mut rest, mut values) = (cell, HashMap::new());
            for slot in axes.iter().rev() {
                values.insert(*slot, rest % self.count(*slot));
                rest /= self.count(*slot);
            }
            let held = finite.iter().map(|slot| values[slot] as f64).collect();
            (joint(&before, &values), joint(&self.outcome, &values), held)
        });
        Ok(Compiled {
            output: output.name.clone(),
            cells: cells.collect(),
            reals: reals.collect(),
            finite,
            made: HashMap::new(),
            lanes: Lanes::new(lowered.kernel.clone()),
        })
    }
}

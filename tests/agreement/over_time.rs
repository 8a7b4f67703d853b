//! Questions over time, compared with the sum over all histories.
//!
//! In: a program with carried variables and families, observations at each instant, a likelihood at all of them. Out:
//! pass or fail of filter, predict, smooth and sequence. Invariant: a history is a state before the first instant and
//! an outcome at each; its weight is a product of factors, read one by one, and added as logarithms.

use crate::enumerate::{Names, is_possible, values};
use crate::program::{Domain, Program, ln_sum};
use crate::question::{near, rows};
use crate::random::{Limits, Random, program};
use crate::{accepted, question_of};
use bp_core::compiler::answer::{ask_over_time, read_instants};
use bp_core::compiler::data::read_table;
use bp_core::compiler::error::Error;
use bp_core::compiler::exec::Inputs;
use bp_core::compiler::model::Model;
use bp_core::compiler::sample::Sampling;
use std::collections::HashMap;
use std::path::Path;

/// Upper limit on the number of histories.
const MOST: usize = 20_000;

/// Upper limit on the values of the searched slots.
const MOST_OUTCOMES: usize = 64;

struct World {
    program: Program,
    /// The slots of X^-1, and those of X.
    before: Vec<usize>,
    carried: Vec<usize>,
    /// The searched slots: those of an outcome.
    searched: Vec<usize>,
    /// The observations of each instant: a slot and its value.
    instants: Vec<Vec<(usize, f64)>>,
    /// A likelihood of a slot's values, at every instant with observations.
    likelihood: Option<(usize, Vec<f64>)>,
}

/// ln of the weights of the transitions of an instant: state before, state after, values of the searched slots.
type Steps = Vec<(usize, usize, usize, f64)>;

impl World {
    /// The position of the values of some slots among all.
    fn place(&self, slots: &[usize], at: &[f64]) -> usize {
        let digits = slots.iter();
        digits.fold(0, |place, slot| {
            place * self.program.count(self.program.variable_of(*slot)) + at[*slot] as usize
        })
    }

    fn start(&self) -> Vec<f64> {
        let is_before = |one: &usize| self.program.variables[*one].previous_of.is_some();
        let variables: Vec<usize> = (0..self.program.variables.len()).filter(is_before).collect();
        let weigh = |values: Vec<usize>| {
            let mut at = vec![f64::NAN; self.program.slots()];
            self.before.iter().zip(values).for_each(|(slot, value)| at[*slot] = value as f64);
            self.program.ln_joint(&variables, &at)
        };
        values(&self.program, &self.before).into_iter().map(weigh).collect()
    }

    /// Each possible (state before, state, outcome) with the sum over all other slots.
    fn steps(&self, observed: &[(usize, f64)], likelihood: Option<&(usize, Vec<f64>)>) -> Steps {
        let program = &self.program;
        let is_before = |variable: &usize| program.variables[*variable].previous_of.is_some();
        let seen =
            |variable: &usize| observed.iter().any(|(slot, _)| program.slots_of(*variable).contains(slot));
        let real = |variable: &usize| program.variables[*variable].domain == Domain::Real;
        let all = 0..program.variables.len();
        let now: Vec<usize> =
            all.clone().filter(|one| !is_before(one) && (!real(one) || seen(one))).collect();
        let free: Vec<usize> = (all.filter(|one| !real(one)).flat_map(|one| program.slots_of(one)))
            .filter(|slot| observed.iter().all(|(own, _)| own != slot))
            .collect();
        let mut sums: HashMap<(usize, usize, usize), Vec<f64>> = HashMap::new();
        for values in values(program, &free) {
            let mut at = vec![f64::NAN; program.slots()];
            observed.iter().for_each(|(slot, value)| at[*slot] = *value);
            free.iter().zip(values).for_each(|(slot, value)| at[*slot] = value as f64);
            let weigh = |(slot, weights): &(usize, Vec<f64>)| weights[at[*slot] as usize].ln();
            let ln = program.ln_joint(&now, &at) + likelihood.map_or(0.0, weigh);
            if is_possible(ln) {
                let place = |slots: &[usize]| self.place(slots, &at);
                let key = (place(&self.before), place(&self.carried), place(&self.searched));
                sums.entry(key).or_default().push(ln);
            }
        }
        let mut steps: Steps = sums.into_iter().map(|((a, b, c), all)| (a, b, c, ln_sum(&all))).collect();
        steps.sort_by_key(|step| (step.0, step.1, step.2));
        steps
    }

    /// Calls back with every possible history: the outcome of each instant, and its weight as a share of the largest.
    /// Returns ln of the largest.
    fn histories(&self, steps: &[Steps], each: &mut dyn FnMut(&[usize], f64)) -> f64 {
        let all = |each: &mut dyn FnMut(&[usize], f64)| {
            for (state, ln) in self.start().into_iter().enumerate().filter(|(_, ln)| is_possible(*ln)) {
                follow(steps, state, ln, &mut Vec::new(), each);
            }
        };
        let mut most = f64::NEG_INFINITY;
        all(&mut |_, ln| most = most.max(ln));
        all(&mut |history, ln| each(history, (ln - most).exp()));
        most
    }

    fn names(&self, outcome: usize) -> Names {
        let values = &values(&self.program, &self.searched)[outcome];
        let name = |(slot, value): (&usize, &usize)| {
            let variable = self.program.variable_of(*slot);
            (self.program.slot_name(*slot), self.program.value(variable, *value))
        };
        self.searched.iter().zip(values).map(name).collect()
    }
}

fn follow(
    steps: &[Steps],
    state: usize,
    ln: f64,
    outcomes: &mut Vec<usize>,
    each: &mut dyn FnMut(&[usize], f64),
) {
    let Some((first, rest)) = steps.split_first() else { return each(outcomes, ln) };
    for (_, next, outcome, weight) in first.iter().filter(|step| step.0 == state) {
        outcomes.push(*outcome);
        follow(rest, *next, ln + weight, outcomes, each);
        outcomes.pop();
    }
}

fn world(random: &mut Random) -> (World, Model) {
    let carried = 1 + random.below(2);
    let limits = Limits { variables: 3, assignments: 1500, families: true, reals: 1, carried };
    let (program, model) = accepted(random, |random| program(random, limits));
    let before: Vec<usize> = (0..carried).flat_map(|one| program.slots_of(one)).collect();
    let own: Vec<usize> = (carried..2 * carried).flat_map(|one| program.slots_of(one)).collect();
    // Another slot may be searched in addition to the carried ones.
    let mut searched = own.clone();
    let mut likelihood = None;
    let others: Vec<usize> = (2 * carried..program.variables.len())
        .filter(|one| program.variables[*one].domain != Domain::Real)
        .collect();
    let mut observed: Vec<usize> = Vec::new();
    for other in others {
        match random.below(5) {
            0 => {
                let more: Vec<usize> = searched.iter().copied().chain(program.slots_of(other)).collect();
                if values(&program, &more).len() <= MOST_OUTCOMES {
                    searched = more;
                }
            }
            1 | 2 => observed.push(other),
            3 if likelihood.is_none() && program.variables[other].family.is_none() => {
                let scale = [1.0, 1e-150, 1e150][random.below(3)];
                let mut weights: Vec<f64> =
                    (0..program.count(other)).map(|_| random.below(4) as f64 * scale).collect();
                weights[random.below(program.count(other))] = 0.5 * scale;
                likelihood = Some((program.slot(other, 0), weights));
            }
            _ => {}
        }
    }
    observed
        .extend((0..program.variables.len()).filter(|one| program.variables[*one].domain == Domain::Real));
    let length = 1 + random.below(4);
    let instant = |random: &mut Random| {
        let mut instant = Vec::new();
        for variable in &observed {
            for slot in program.slots_of(*variable) {
                if random.one_in(4) {
                    continue;
                }
                let value = match program.variables[*variable].domain {
                    Domain::Real => random.below(17) as f64 / 4.0 - 1.0,
                    _ => random.below(program.count(*variable)) as f64,
                };
                instant.push((slot, value));
            }
        }
        instant
    };
    let instants = (0..length).map(|_| instant(random)).collect();
    (World { program, before, carried: own, searched, instants, likelihood }, model)
}

/// A random program over time, and all four questions to it.
pub(crate) fn asked(random: &mut Random) -> Result<(), String> {
    let (mut world, model) = world(random);
    let step = |observed: &Vec<(usize, f64)>| world.steps(observed, world.likelihood.as_ref());
    let mut steps: Vec<Steps> = world.instants.iter().map(step).collect();
    let most = |steps: &[Steps]| steps.iter().map(|steps| steps.len().max(1) as f64).product::<f64>();
    while most(&steps) > MOST as f64 && steps.len() > 1 {
        steps.pop();
        world.instants.pop();
    }
    let ahead = 1 + random.below(2);
    let free = world.steps(&[], None);
    let outcomes = values(&world.program, &world.searched).len();
    let length = steps.len();
    let mut marginals = vec![vec![0.0; outcomes]; length];
    let (mut best, mut total) = (HashMap::<Vec<usize>, f64>::new(), 0.0);
    let ln_most = world.histories(&steps, &mut |history, weight| {
        total += weight;
        history.iter().enumerate().for_each(|(instant, outcome)| marginals[instant][*outcome] += weight);
        *best.entry(history.to_vec()).or_insert(0.0) += weight;
    });
    let longer: Vec<Steps> = steps.iter().cloned().chain(std::iter::repeat_n(free, ahead)).collect();
    let (mut predicted, mut later) = (vec![0.0; outcomes], 0.0);
    let mut ln_later = None;
    if most(&longer) <= 20.0 * MOST as f64 {
        let ln_most = world.histories(&longer, &mut |history, weight| {
            later += weight;
            predicted[*history.last().unwrap()] += weight;
        });
        ln_later = Some(ln_most + later.ln());
    }
    let text = world.program.text();
    let name = |slot: &usize| world.program.slot_name(*slot);
    let variables = |slots: &[usize]| {
        let mut names: Vec<String> = (slots.iter())
            .map(|slot| world.program.variables[world.program.variable_of(*slot)].name.clone())
            .collect();
        names.dedup();
        names
    };
    let mut columns: Vec<usize> = world.instants.iter().flatten().map(|(slot, _)| *slot).collect();
    columns.sort_unstable();
    columns.dedup();
    let (searched, observed) = (variables(&world.searched).join(" "), variables(&columns));
    let likelihood = world.likelihood.as_ref().map(|(slot, weights)| {
        let weights: Vec<String> = weights.iter().map(|weight| format!("{weight:e}")).collect();
        format!("{} virtual [{}]", name(slot), weights.join(", "))
    });
    let known: Vec<String> = observed.into_iter().chain(likelihood).collect();
    let asked = match known.is_empty() {
        true => format!("P({searched})"),
        false => format!("P({searched} | {})", known.join(", ")),
    };
    // As a file, a row for each instant; a cell is empty where the slot was not observed.
    let cell = |instant: &Vec<(usize, f64)>, slot: &usize| {
        let value = instant.iter().find(|(own, _)| own == slot).map(|(_, value)| *value);
        let variable = world.program.variable_of(*slot);
        match (value, world.program.variables[variable].domain) {
            (None, _) => String::new(),
            (Some(value), Domain::Real) => value.to_string(),
            (Some(value), _) => world.program.value(variable, value as usize),
        }
    };
    let line = |cells: Vec<String>| format!("{}\n", cells.join(","));
    let mut file = line(columns.iter().map(name).collect());
    for instant in &world.instants {
        file.push_str(&line(columns.iter().map(|slot| cell(instant, slot)).collect()));
    }
    let context = || format!("{text}{file}");
    let on = |question: &str| {
        let parsed = question_of(&model, question);
        // A slot that is never observed has no column.
        let instants = match columns.is_empty() {
            true => vec![Vec::new(); world.instants.len()],
            false => read_instants(
                &model,
                &parsed,
                &read_table(Path::new("random.csv"), file.as_bytes())?,
                &Inputs::new(),
            )?,
        };
        ask_over_time(&model, &parsed, &instants, &Inputs::new(), Sampling::default())
    };
    for question in ["filter", "smooth", "sequence", &format!("predict({ahead})")] {
        let words = format!("{question} {asked}");
        let answer = match on(&words) {
            Ok(answers) if total > 0.0 => answers.into_iter().next().unwrap(),
            Err(Error::Impossible(_) | Error::Contradiction { .. }) if total == 0.0 => continue,
            // The observations may leave no possible next state.
            Err(Error::Impossible(_)) if question.starts_with("predict") && later == 0.0 => continue,
            Ok(answers) => {
                return Err(format!(
                    "{}{words}\nanswered {:?}, but it is impossible",
                    context(),
                    rows(&answers[0])
                ));
            }
            Err(error) => {
                return Err(format!("{}{words}\n{error}; ln P = {}", context(), ln_most + total.ln()));
            }
        };
        let ln = answer.ln_evidence.unwrap_or(f64::NAN);
        // A predicted instant counts as an empty row does: its variables have values.
        let ln_expected = match question.starts_with("predict") {
            true => ln_later.unwrap_or(ln),
            false => ln_most + total.ln(),
        };
        if !near(ln, ln_expected) {
            return Err(format!("{}{words}\nln P = {ln}, expected {ln_expected}", context()));
        }
        if let Some(estimate) = &answer.estimate {
            return Err(format!("{}{words}\nis estimated: {estimate:?}", context()));
        }
        let found = rows(&answer);
        let check = |wanted: Vec<(Names, f64)>| {
            for (names, p) in &wanted {
                let own = found.iter().find(|(own, _)| own == names).map(|(_, p)| *p);
                if !own.is_some_and(|own| near(own, *p)) {
                    return Err(format!("{}{words}\n{names:?}: {own:?}, expected {p}", context()));
                }
            }
            Ok(())
        };
        let at = |instant: usize, outcome: usize| {
            let mut names = world.names(outcome);
            names.insert("t".to_owned(), (instant + 1).to_string());
            names
        };
        let of = |belief: &[f64], total: f64| {
            belief
                .iter()
                .enumerate()
                .map(|(outcome, p)| (world.names(outcome), p / total))
                .collect::<Vec<_>>()
        };
        match question {
            "filter" => check(of(&marginals[length - 1], total))?,
            "smooth" => check(
                (0..length)
                    .flat_map(|instant| (0..outcomes).map(move |outcome| (instant, outcome)))
                    .map(|(instant, outcome)| (at(instant, outcome), marginals[instant][outcome] / total))
                    .collect(),
            )?,
            "sequence" => {
                let most = best.values().copied().fold(0.0, f64::max);
                let path: Vec<Option<usize>> = (0..length)
                    .map(|instant| {
                        (0..outcomes)
                            .find(|outcome| found.iter().any(|(own, _)| *own == at(instant, *outcome)))
                    })
                    .collect();
                let path: Option<Vec<usize>> = path.into_iter().collect();
                let weight = path.as_ref().and_then(|path| best.get(path)).copied();
                if found.len() != length || !weight.is_some_and(|weight| near(weight / most, 1.0)) {
                    return Err(format!("{}{words}\n{found:?} has {weight:?} of {most}", context()));
                }
            }
            _ if later > 0.0 => check(of(&predicted, later))?,
            _ => {}
        }
    }
    Ok(())
}

//! Random questions, and the comparison of answers with expected ones.
//!
//! In: a program. Out: a question as text, its meaning, and the comparison with an answer. Invariant: rows are compared
//! by the names of their values, not by their order.

use crate::enumerate::{Ask, Evidence, Expected, Known, Names, Statistic};
use crate::program::{Domain, Program};
use crate::random::Random;
use bp_core::compiler::answer::{Answer, Figure};
use bp_core::compiler::error::Error;

/// A random valid question.
pub(crate) fn question(random: &mut Random, program: &Program) -> Ask {
    let finite: Vec<usize> = (0..program.variables.len())
        .filter(|variable| program.variables[*variable].domain != Domain::Real)
        .collect();
    let single = |variable: usize| program.variables[variable].family.is_none();
    let labels = |variable: usize| matches!(program.variables[variable].domain, Domain::Labels(_));
    let first = finite[random.below(finite.len())];
    let (mut searched, mut known) = (vec![first], Known::new());
    let mut cells: usize = program.slots_of(first).map(|_| program.count(first)).product();
    let mut rows = 1;
    for variable in finite.into_iter().filter(|variable| *variable != first) {
        let count = program.count(variable);
        let size = count.pow(program.elements(variable) as u32);
        match random.below(9) {
            0 | 1 if cells * size <= 256 => {
                cells *= size;
                searched.push(variable);
            }
            2 | 3 => {
                let values = (0..program.elements(variable)).map(|_| random.below(count)).collect();
                known.push((variable, Evidence::Hard(values)));
            }
            4 if rows * size <= 32 => {
                rows *= size;
                known.push((variable, Evidence::Each));
            }
            5 if single(variable) => {
                let scale = [1.0, 1.0, 1e-150, 1e150][random.below(4)];
                let mut weights: Vec<f64> = (0..count).map(|_| random.below(4) as f64 * scale).collect();
                weights[random.below(count)] = 0.5 * scale;
                known.push((variable, Evidence::Virtual(weights)));
            }
            6 if single(variable) && random.one_in(2) => {
                let mut wanted = vec![0.0; count];
                (0..8).for_each(|_| wanted[random.below(count)] += 0.125);
                known.push((variable, Evidence::Soft(wanted)));
            }
            _ => {}
        }
    }
    for variable in 0..program.variables.len() {
        if program.variables[variable].domain == Domain::Real && !random.one_in(4) {
            known.push((variable, Evidence::Real(random.below(33) as f64 / 4.0 - 4.0)));
        }
    }
    if random.one_in(2) {
        searched.rotate_left(1);
    }
    let numeric = searched.iter().all(|variable| !labels(*variable) && single(*variable));
    let statistic = match random.below(12) {
        0 => Statistic::Maximum,
        1 => Statistic::Argmax,
        2 => Statistic::Best(1 + random.below(6)),
        3 => Statistic::Entropy,
        4 if numeric => Statistic::Expectation,
        5 if numeric => Statistic::Variance,
        6 if searched.len() == 2 && searched.iter().all(|one| single(*one)) => Statistic::Information,
        7 => Statistic::Divergence,
        _ => Statistic::Distribution,
    };
    let mut from = Known::new();
    if statistic == Statistic::Divergence {
        let fixed = |evidence: &Evidence| matches!(evidence, Evidence::Hard(_) | Evidence::Virtual(_));
        from = known.iter().filter(|(_, evidence)| fixed(evidence) && random.one_in(2)).cloned().collect();
    }
    Ask { statistic, searched, known, from }
}

/// The question as a user writes it, and the names under which values are given when it is asked.
pub(crate) fn text(program: &Program, ask: &Ask) -> (String, Vec<(String, Vec<f64>)>) {
    let mut given = Vec::new();
    let mut distribution = |known: &Known| {
        let name = |variable: &usize| program.variables[*variable].name.clone();
        let list = |numbers: &[f64]| {
            numbers.iter().map(|number| format!("{number:e}")).collect::<Vec<_>>().join(", ")
        };
        let searched: Vec<String> = ask.searched.iter().map(name).collect();
        let mut items = Vec::new();
        for (variable, evidence) in known {
            let name = name(variable);
            items.push(match evidence {
                Evidence::Each => name,
                Evidence::Hard(values) if program.variables[*variable].family.is_none() => {
                    format!("{name} = {}", program.value(*variable, values[0]))
                }
                Evidence::Hard(values) => {
                    let under = format!("given_{}", name.to_lowercase());
                    let number = |ordinal: &usize| program.number_of(*variable, *ordinal as f64);
                    let values = values.iter().map(number).collect();
                    given.push((under.clone(), values));
                    format!("{name} = {under}")
                }
                Evidence::Real(value) => format!("{name} = {value:?}"),
                Evidence::Virtual(weights) => format!("{name} virtual [{}]", list(weights)),
                Evidence::Soft(wanted) => format!("{name} soft [{}]", list(wanted)),
            });
        }
        match items.is_empty() {
            true => format!("P({})", searched.join(", ")),
            false => format!("P({} | {})", searched.join(", "), items.join(", ")),
        }
    };
    let first = distribution(&ask.known);
    let text = match &ask.statistic {
        Statistic::Distribution => first,
        Statistic::Maximum => format!("max {first}"),
        Statistic::Argmax => format!("argmax {first}"),
        Statistic::Best(count) => format!("best({count}) {first}"),
        Statistic::Entropy => format!("entropy {first}"),
        Statistic::Expectation => format!("expectation {first}"),
        Statistic::Variance => format!("variance {first}"),
        Statistic::Information => format!("information {first}"),
        Statistic::Divergence => format!("divergence {first} from {}", distribution(&ask.from)),
    };
    (text, given)
}

pub(crate) fn near(found: f64, expected: f64) -> bool {
    found == expected || (found - expected).abs() <= 1e-11 + 1e-10 * expected.abs()
}

/// Whether `argmax` treats two probabilities as equal, so that either is correct.
fn tied(one: f64, other: f64) -> bool {
    near(one, other) || (one - other).abs() <= 1.01e-9 * one.max(other)
}

fn figure(figure: &Figure) -> f64 {
    match figure {
        Figure::Probability { p } => *p,
        Figure::Entropy { entropy, .. } => *entropy,
        Figure::Expectation { expectation, error: None } => *expectation,
        Figure::Variance { variance, error: None } => *variance,
        Figure::Information { information } => *information,
        Figure::Divergence { divergence, infinite: false } => *divergence,
        Figure::Divergence { .. } => f64::INFINITY,
        other => panic!("{other:?} is no exact number"),
    }
}

pub(crate) fn rows(answer: &Answer) -> Vec<(Names, f64)> {
    answer.answer.iter().map(|row| (row.values.iter().cloned().collect(), figure(&row.figure))).collect()
}

fn ln_agrees(answer: &Answer, expected: Option<f64>) -> Result<(), String> {
    match (answer.ln_evidence, expected) {
        (Some(found), Some(expected)) if !near(found, expected) => {
            Err(format!("ln P = {found}, expected {expected}"))
        }
        _ => Ok(()),
    }
}

/// Whether an answer is the expected one; if not, the difference.
pub(crate) fn verdict(
    ask: &Ask,
    found: &Result<Vec<Answer>, Error>,
    expected: &Expected,
) -> Result<(), String> {
    let answer = match (found, expected) {
        (Err(Error::Impossible(_) | Error::Contradiction { .. }), Expected::Impossible) => return Ok(()),
        (Err(Error::Input { message, .. }), Expected::Impossible) if message.contains("soft evidence") => {
            return Ok(());
        }
        (Err(error), _) => return Err(format!("error `{error}`, expected {expected:?}")),
        (Ok(answers), _) => &answers[0],
    };
    let found = rows(answer);
    match expected {
        Expected::Impossible => Err(format!("answered {found:?}, but the evidence is impossible")),
        Expected::Rows(wanted, ln_evidence) => {
            if found.len() != wanted.len() {
                return Err(format!("{} rows, expected {}: {found:?}", found.len(), wanted.len()));
            }
            for (names, figure) in wanted {
                let row = found.iter().find(|(own, _)| own == names);
                let Some((_, own)) = row else { return Err(format!("no row {names:?}")) };
                if !near(*own, *figure) {
                    return Err(format!("{names:?}: {own}, expected {figure}"));
                }
            }
            ln_agrees(answer, *ln_evidence)
        }
        Expected::Best(contexts, ln_evidence) => {
            let mut count = 0;
            for (context, best) in contexts {
                let possible = best.iter().filter(|(_, p)| *p > 0.0).count();
                let ties = best.iter().filter(|(_, p)| tied(*p, best[0].1)).count();
                let own = found
                    .iter()
                    .filter(|(names, _)| context.iter().all(|pair| names.get(pair.0) == Some(pair.1)));
                let own: Vec<_> = own.collect();
                let wanted = match ask.statistic {
                    Statistic::Best(most) => most.min(possible)..=most.min(possible),
                    _ => 1..=ties,
                };
                if !wanted.contains(&own.len()) {
                    return Err(format!("{context:?}: {} rows, expected {wanted:?}: {own:?}", own.len()));
                }
                for (place, (names, p)) in own.iter().enumerate() {
                    let cell: Names = names
                        .iter()
                        .filter(|(name, _)| !context.contains_key(*name))
                        .map(|(name, value)| (name.clone(), value.clone()))
                        .collect();
                    let true_p = best.iter().find(|(own, _)| *own == cell).map(|(_, p)| *p);
                    let due = best[if matches!(ask.statistic, Statistic::Best(_)) { place } else { 0 }].1;
                    if !true_p.is_some_and(|true_p| near(*p, true_p)) || !tied(*p, due) {
                        return Err(format!("{names:?}: {p}, truly {true_p:?}, the best there is {due}"));
                    }
                }
                count += own.len();
            }
            if count != found.len() {
                return Err(format!("rows of contexts that are impossible: {found:?}"));
            }
            ln_agrees(answer, *ln_evidence)
        }
    }
}

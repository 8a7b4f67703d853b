//! Linear Gaussian programs, held to the conditioning of a joint normal law.
//!
//! In: random programs of reals that depend on each other linearly. Out: the verdict on means, deviations and the density
//! of the evidence. Invariant: the covariance is that of X = b + A X + noise, conditioned by solving linear equations here,
//! in 32 digits: a variance of 1e16 beside one of 0.01 leaves none of f64's.

use crate::random::Random;
use crate::twofold::Twofold;
use bp_core::answer::{Figure, ask};
use bp_core::exec::Inputs;
use bp_core::source::Source;
use bp_core::syntax;
use std::fmt::Write;

struct Linear {
    /// For each real its constant, its coefficients of those before it, and its deviation (0: a Dirac).
    reals: Vec<(f64, Vec<f64>, f64)>,
}

fn linear(random: &mut Random) -> Linear {
    let count = 2 + random.below(4);
    let reals = (0..count).map(|number| {
        let coefficient = |random: &mut Random| [0.0, 0.0, 1.0, -1.0, 0.5, 2.0][random.below(6)];
        let coefficients: Vec<f64> = (0..number).map(|_| coefficient(random)).collect();
        let sure = random.one_in(5) && coefficients.iter().any(|one| *one != 0.0);
        let deviation = if sure { 0.0 } else { [0.1, 0.5, 1.0, 2.0, 8.0, 1e4, 1e8][random.below(7)] };
        (random.below(9) as f64 - 4.0, coefficients, deviation)
    });
    Linear { reals: reals.collect() }
}

impl Linear {
    fn text(&self) -> String {
        let (mut names, mut decomposition, mut forms) = (Vec::new(), String::new(), String::new());
        for (number, (constant, coefficients, deviation)) in self.reals.iter().enumerate() {
            names.push(format!("X{number}"));
            let parents: Vec<String> =
                (0..number).filter(|one| coefficients[*one] != 0.0).map(|one| format!("X{one}")).collect();
            let head = match parents.is_empty() {
                true => format!("P(X{number})"),
                false => format!("P(X{number} | {})", parents.join(" ")),
            };
            let mut mean = format!("({constant:?})").replace("(-", "(0 - ");
            for (one, coefficient) in coefficients.iter().enumerate().filter(|(_, one)| **one != 0.0) {
                let sign = if *coefficient < 0.0 { '-' } else { '+' };
                write!(mean, " {sign} {:?} * X{one}", coefficient.abs()).unwrap();
            }
            let form = match *deviation == 0.0 {
                true => format!("dirac({mean})"),
                false => format!("normal({mean}, {deviation:?})"),
            };
            write!(decomposition, "{head} ").unwrap();
            writeln!(forms, "{head} = {form};").unwrap();
        }
        let names = names.join(", ");
        format!(
            "program Linear {{ variables {{ {names} : real; }} decomposition {{ {decomposition} }}\nforms {{ {forms} }} }}"
        )
    }

    /// Mean and covariance of all.
    fn joint(&self) -> (Vec<Twofold>, Vec<Vec<Twofold>>) {
        let count = self.reals.len();
        let (mut mean, mut covariance) =
            (vec![Twofold::ZERO; count], vec![vec![Twofold::ZERO; count]; count]);
        for (number, (constant, coefficients, deviation)) in self.reals.iter().enumerate() {
            let coefficients: Vec<Twofold> = coefficients.iter().map(|one| Twofold::from(*one)).collect();
            mean[number] = Twofold::from(*constant) + dot(&coefficients, &mean);
            for other in 0..number {
                let column: Vec<Twofold> = covariance.iter().map(|row| row[other]).collect();
                let with = dot(&coefficients, &column);
                (covariance[number][other], covariance[other][number]) = (with, with);
            }
            let deviation = Twofold::from(*deviation);
            covariance[number][number] = dot(&coefficients, &covariance[number]) + deviation * deviation;
        }
        (mean, covariance)
    }
}

/// The sum of products, as far as both go.
fn dot(one: &[Twofold], other: &[Twofold]) -> Twofold {
    one.iter().zip(other).fold(Twofold::ZERO, |sum, (x, y)| sum + *x * *y)
}

/// The solution of M x = b for each right-hand side, and the pivots, by elimination; `None` where one follows from others.
fn solve(
    mut matrix: Vec<Vec<Twofold>>,
    mut sides: Vec<Vec<Twofold>>,
) -> Option<(Vec<Vec<Twofold>>, Vec<f64>)> {
    let count = matrix.len();
    let alone: Vec<f64> = (0..count).map(|one| matrix[one][one].value()).collect();
    for pivot in 0..count {
        // A variance given the others: none is so small beside the noises that are drawn.
        if matrix[pivot][pivot].value() <= 1e-24 * alone[pivot] {
            return None;
        }
        for other in (0..count).filter(|other| *other != pivot) {
            let share = matrix[other][pivot] / matrix[pivot][pivot];
            let from = matrix[pivot].clone();
            matrix[other].iter_mut().zip(from).for_each(|(cell, from)| *cell = *cell - share * from);
            sides.iter_mut().for_each(|side| side[other] = side[other] - share * side[pivot]);
        }
    }
    for side in &mut sides {
        (0..count).for_each(|row| side[row] = side[row] / matrix[row][row]);
    }
    Some((sides, (0..count).map(|row| matrix[row][row].value()).collect()))
}

/// A random program, and one real of it asked given some others.
pub(crate) fn asked(random: &mut Random) -> Result<(), String> {
    let linear = linear(random);
    let (mean, covariance) = linear.joint();
    let searched = random.below(mean.len());
    let mut known: Vec<(usize, f64)> = Vec::new();
    for one in (0..mean.len()).filter(|one| *one != searched) {
        if random.one_in(2) {
            known.push((one, random.below(17) as f64 / 2.0 - 4.0));
        }
    }
    let among: Vec<Vec<Twofold>> = known
        .iter()
        .map(|(one, _)| known.iter().map(|(other, _)| covariance[*one][*other]).collect())
        .collect();
    let off: Vec<Twofold> = known.iter().map(|(one, value)| Twofold::from(*value) - mean[*one]).collect();
    let with: Vec<Twofold> = known.iter().map(|(one, _)| covariance[searched][*one]).collect();
    let Some((solved, pivots)) = solve(among, vec![off.clone(), with.clone()]) else {
        // One observation follows from others: it agrees or is impossible, which other tests hold.
        return Ok(());
    };
    let expected = [
        (mean[searched] + dot(&with, &solved[0])).value(),
        (covariance[searched][searched] - dot(&with, &solved[1])).value().max(0.0),
    ];
    let ln_determinant: f64 = pivots.iter().map(|pivot| pivot.ln()).sum();
    let ln = -0.5
        * (dot(&off, &solved[0]).value() + ln_determinant + known.len() as f64 * std::f64::consts::TAU.ln());
    let items: Vec<String> = known.iter().map(|(one, value)| format!("X{one} = {value:?}")).collect();
    let words = match items.is_empty() {
        true => format!("P(X{searched})"),
        false => format!("P(X{searched} | {})", items.join(", ")),
    };
    let text = linear.text();
    let told = |why: String| format!("{text}\n{words}\n{why}");
    let source = Source::new("linear", text.as_str());
    let model = syntax::compile(&source).map_err(|wrong| told(wrong.render(&source, false)))?;
    let source = Source::new("question", words.as_str());
    let question =
        syntax::parse_question(&source, &model).map_err(|wrong| told(wrong.render(&source, false)))?;
    let answers = ask(&model, &question, &Inputs::new()).map_err(|error| told(error.to_string()))?;
    let near = |found: f64, expected: f64| (found - expected).abs() <= 1e-7 + 1e-8 * expected.abs();
    match answers[0].answer[0].figure {
        Figure::Normal { mean, deviation }
            if near(mean, expected[0]) && near(deviation * deviation, expected[1]) => {}
        other => return Err(told(format!("{other:?}, expected {expected:?}"))),
    }
    match answers[0].ln_evidence {
        Some(found) if !near(found, ln) => Err(told(format!("ln P = {found}, expected {ln}"))),
        _ => Ok(()),
    }
}

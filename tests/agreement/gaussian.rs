//! Linear Gaussian programs, held to the conditioning of a joint normal law.
//!
//! In: random programs of reals that depend on each other linearly. Out: the verdict on means, deviations and the density
//! of the evidence. Invariant: the covariance is that of X = b + A X + noise, conditioned by solving linear equations here.

use crate::random::Random;
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
        let deviation = if sure { 0.0 } else { [0.5, 1.0, 2.0, 8.0][random.below(4)] };
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
    fn joint(&self) -> (Vec<f64>, Vec<Vec<f64>>) {
        let count = self.reals.len();
        let (mut mean, mut covariance) = (vec![0.0; count], vec![vec![0.0; count]; count]);
        for (number, (constant, coefficients, deviation)) in self.reals.iter().enumerate() {
            mean[number] = constant + coefficients.iter().zip(&mean).map(|(a, m)| a * m).sum::<f64>();
            let before = coefficients.iter().zip(&covariance);
            let with = |other: usize| before.clone().map(|(a, row)| a * row[other]).sum::<f64>();
            let row: Vec<f64> = (0..number).map(with).collect();
            for (other, with) in row.into_iter().enumerate() {
                (covariance[number][other], covariance[other][number]) = (with, with);
            }
            let own: f64 = (0..number).map(|one| coefficients[one] * covariance[number][one]).sum();
            covariance[number][number] = own + deviation * deviation;
        }
        (mean, covariance)
    }
}

/// The solution of M x = b for each right-hand side, and det M, by elimination with pivots.
fn solve(mut matrix: Vec<Vec<f64>>, mut sides: Vec<Vec<f64>>) -> (Vec<Vec<f64>>, f64) {
    let count = matrix.len();
    let mut determinant = 1.0;
    for pivot in 0..count {
        let row = (pivot..count)
            .max_by(|one, other| matrix[*one][pivot].abs().total_cmp(&matrix[*other][pivot].abs()))
            .unwrap();
        if row != pivot {
            matrix.swap(row, pivot);
            sides.iter_mut().for_each(|side| side.swap(row, pivot));
            determinant = -determinant;
        }
        determinant *= matrix[pivot][pivot];
        for other in (0..count).filter(|other| *other != pivot) {
            let share = matrix[other][pivot] / matrix[pivot][pivot];
            let from = matrix[pivot].clone();
            matrix[other].iter_mut().zip(from).for_each(|(cell, from)| *cell -= share * from);
            sides.iter_mut().for_each(|side| side[other] -= share * side[pivot]);
        }
    }
    for side in &mut sides {
        (0..count).for_each(|row| side[row] /= matrix[row][row]);
    }
    (sides, determinant)
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
    let among: Vec<Vec<f64>> = known
        .iter()
        .map(|(one, _)| known.iter().map(|(other, _)| covariance[*one][*other]).collect())
        .collect();
    let off: Vec<f64> = known.iter().map(|(one, value)| value - mean[*one]).collect();
    let with: Vec<f64> = known.iter().map(|(one, _)| covariance[searched][*one]).collect();
    let (solved, determinant) = solve(among, vec![off.clone(), with.clone()]);
    let alone: f64 = known.iter().map(|(one, _)| covariance[*one][*one]).product();
    if determinant.is_nan() || determinant.abs() <= 1e-9 * alone {
        // One observation follows from others: there is no density.
        return Ok(());
    }
    let dot = |one: &[f64], other: &[f64]| one.iter().zip(other).map(|(x, y)| x * y).sum::<f64>();
    let expected =
        [mean[searched] + dot(&with, &solved[0]), covariance[searched][searched] - dot(&with, &solved[1])];
    let ln =
        -0.5 * (dot(&off, &solved[0]) + determinant.ln() + known.len() as f64 * std::f64::consts::TAU.ln());
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

//! Linear Gaussian programs, compared with the conditioning of a joint normal distribution.
//!
//! In: random programs of reals that depend on each other linearly. Out: pass or fail of means, deviations and the
//! density of the evidence. Invariant: the covariance is that of X = b + A X + noise, conditioned by solving linear
//! equations here, in 32 digits: variances of 1e16 and 0.01 together would leave no digits in f64.

use crate::question_of;
use crate::random::Random;
use crate::twofold::Twofold;
use bp_core::compiler::answer::{Figure, ask};
use bp_core::compiler::error::Error;
use bp_core::compiler::exec::Inputs;
use bp_core::compiler::model::Model;
use bp_core::compiler::source::Source;
use bp_core::compiler::syntax;
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
    fn joint(&self) -> Joint {
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
        Joint { mean, covariance }
    }
}

/// The sum of products, up to the shorter length.
fn dot(one: &[Twofold], other: &[Twofold]) -> Twofold {
    one.iter().zip(other).fold(Twofold::ZERO, |sum, (x, y)| sum + *x * *y)
}

/// Mean and covariance of all.
struct Joint {
    mean: Vec<Twofold>,
    covariance: Vec<Vec<Twofold>>,
}

impl Joint {
    /// Mean and variance of one given others, and ln of the density of these: the others are eliminated one by one.
    fn given(&self, one: usize, known: &[(usize, f64)]) -> [f64; 3] {
        let all: Vec<usize> = known.iter().map(|(other, _)| *other).chain([one]).collect();
        let mut matrix: Vec<Vec<Twofold>> =
            all.iter().map(|row| all.iter().map(|column| self.covariance[*row][*column]).collect()).collect();
        let off = known.iter().map(|(other, value)| Twofold::from(*value) - self.mean[*other]);
        let mut side: Vec<Twofold> = off.chain([Twofold::ZERO]).collect();
        let mut ln = 0.0;
        for pivot in 0..known.len() {
            let (row, off) = (matrix[pivot].clone(), side[pivot]);
            let square = (off * off / row[pivot]).value();
            ln -= 0.5 * (square + row[pivot].value().ln() + std::f64::consts::TAU.ln());
            for other in pivot + 1..all.len() {
                let share = matrix[other][pivot] / row[pivot];
                matrix[other].iter_mut().zip(&row).for_each(|(cell, from)| *cell = *cell - share * *from);
                side[other] = side[other] - share * off;
            }
        }
        let last = known.len();
        [(self.mean[one] - side[last]).value(), matrix[last][last].value(), ln]
    }
}

/// The entropy ½ ln(2πe v) of the searched variables, and the density at their mean.
fn entropy(random: &mut Random, model: &Model, words: &str, variance: f64) -> Result<(), String> {
    // Smaller variances are found with fewer digits.
    if !random.one_in(3) || variance < 1e-3 {
        return Ok(());
    }
    let asked = |statistic: &str| {
        let question = question_of(model, &format!("{statistic} {words}"));
        let answer = ask(model, &question, &Inputs::new()).map_err(|error| error.to_string())?.remove(0);
        Ok::<Figure, String>(answer.answer[0].figure)
    };
    let expected = 0.5 * (std::f64::consts::TAU * std::f64::consts::E * variance).ln();
    let near = |found: f64| (found - expected).abs() <= 1e-7 * (1.0 + 1.0 / variance);
    match (asked("entropy")?, asked("argmax")?) {
        (Figure::Entropy { entropy, .. }, Figure::Density { density })
            if near(entropy) && near(0.5 - density.ln()) =>
        {
            Ok(())
        }
        other => Err(format!("{other:?}, expected an entropy of {expected}")),
    }
}

/// A random program, and a question for one of its reals given some others.
pub(crate) fn asked(random: &mut Random) -> Result<(), String> {
    let linear = linear(random);
    let joint = linear.joint();
    let count = linear.reals.len();
    let searched = random.below(count);
    // Values that are possible in the program, or arbitrary ones.
    let mut values: Vec<f64> = Vec::new();
    for (constant, coefficients, deviation) in &linear.reals {
        let mean = constant + coefficients.iter().zip(&values).map(|(a, value)| a * value).sum::<f64>();
        values.push(mean + deviation * (random.below(9) as f64 / 2.0 - 2.0));
    }
    // The rounding error of the values, and of their squares relative to the smallest noise.
    let scale = values.iter().fold(1.0, |most: f64, value| most.max(value.abs()));
    let mut known: Vec<(usize, f64)> = Vec::new();
    let (mut free, mut possible) = (known.clone(), true);
    let any = random.one_in(3);
    for one in (0..count).filter(|one| *one != searched) {
        if random.one_in(2) {
            let value = if any { random.below(17) as f64 / 2.0 - 4.0 } else { values[one] };
            known.push((one, value));
            let [mean, variance, _] = joint.given(one, &free);
            // A conditional variance this small is zero: no noise that is drawn is so small.
            match variance <= 1e-24 * joint.covariance[one][one].value() {
                true => possible &= (value - mean).abs() <= 1e-12 * scale,
                false => free.push((one, value)),
            }
        }
    }
    let [mean, variance, ln] = joint.given(searched, &free);
    let items: Vec<String> = known.iter().map(|(one, value)| format!("X{one} = {value:?}")).collect();
    let words = match items.is_empty() {
        true => format!("P(X{searched})"),
        false => format!("P(X{searched} | {})", items.join(", ")),
    };
    let text = linear.text();
    let context = |why: String| format!("{text}\n{words}\n{why}");
    let source = Source::new("linear", text.as_str());
    let model = syntax::compile(&source).map_err(|wrong| context(wrong.render(&source, false)))?;
    let source = Source::new("question", words.as_str());
    let question =
        syntax::parse_question(&source, &model).map_err(|wrong| context(wrong.render(&source, false)))?;
    let answers = match ask(&model, &question, &Inputs::new()) {
        Err(Error::Impossible(_)) if !possible => return Ok(()),
        Err(error) => return Err(context(error.to_string())),
        Ok(_) if !possible => return Err(context("answered, but expected to be impossible".to_owned())),
        Ok(answers) => answers,
    };
    let near = |found: f64, expected: f64, scale: f64| {
        (found - expected).abs() <= 1e-7 + 1e-8 * expected.abs() + 1e-14 * scale
    };
    match answers[0].answer[0].figure {
        Figure::Normal { mean: found, deviation }
            if near(found, mean, scale + 1e5 * deviation)
                && near(deviation * deviation, variance.max(0.0), 0.0) => {}
        other => return Err(context(format!("{other:?}, expected mean {mean} and variance {variance}"))),
    }
    entropy(random, &model, &words, variance).map_err(context)?;
    match answers[0].ln_evidence {
        Some(found) if !near(found, ln, 100.0 * scale) => {
            Err(context(format!("ln P = {found}, expected {ln}")))
        }
        _ => Ok(()),
    }
}

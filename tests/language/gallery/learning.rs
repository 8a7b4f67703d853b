//! Learning: from a few numbers, from a mixture, and from a network with missing cells.
//!
//! In: the learning programs, and cases drawn here from a seed. Out: pass or fail. Invariant: expected values are the
//! arithmetic in the comment, or the true parameters of the simulation, to three or four standard errors of the
//! estimate.

use super::laws::normalised;
use super::{folder, near, probabilities, program};
use bp_core::compiler::law::Law;
use bp_core::compiler::learn::{Case, Learned, Learner, Settings};
use bp_core::compiler::model::Model;
use bp_core::compiler::random::{Random, seeded};
use bp_core::compiler::source::Source;
use bp_core::compiler::syntax::compile;
use statrs::distribution::{Continuous, Normal};

/// Between 0 and 1.
pub(crate) fn chance(generator: &mut Random) -> f64 {
    Law::Uniform.draw(generator, &[0.0, 1.0])
}

/// A learner that has observed these rows; NaN is missing.
pub(crate) fn observed(model: &Model, columns: &[&str], rows: &[Vec<f64>]) -> Learner {
    let mut learner = Learner::new(model).unwrap_or_else(|error| panic!("{}: {error}", model.name));
    let ids: Vec<_> = columns.iter().map(|name| model.variable(name).unwrap()).collect();
    for row in rows {
        let seen = ids.iter().zip(row).filter(|(_, number)| !number.is_nan());
        let case = seen.fold(Case::new(model), |case, (id, number)| case.with(*id, *number));
        learner.observe(&case).unwrap();
    }
    learner
}

/// The result of learning that stops at steps with a gain below the threshold.
pub(crate) fn maximised(learner: &Learner, threshold: f64) -> Learned {
    let settings = Settings { threshold, ..Settings::default() };
    let learned = learner.learned_with(&settings, &mut |_, _| {}).unwrap();
    let course = learned.report.expectation.as_ref().expect("something is hidden");
    assert!(course.converged);
    for steps in course.trail.windows(2) {
        assert!(steps[1] >= steps[0] - 1e-9 * steps[0].abs(), "a step loses likelihood: {steps:?}");
    }
    learned
}

fn pdf(x: f64, mean: f64, deviation: f64) -> f64 {
    Normal::new(mean, deviation).unwrap().pdf(x)
}

/// A program of the gallery with some words replaced.
fn variant(name: &str, others: &[(&str, &str)]) -> Model {
    let text = std::fs::read_to_string(folder().join(format!("{name}.bp"))).unwrap();
    let text = others.iter().fold(text, |text, (written, instead)| {
        assert!(text.contains(written), "{name} does not say `{written}`");
        text.replace(written, instead)
    });
    compile(&Source::new(name, text)).unwrap()
}

/// The numbers of a parameter.
fn default(model: &Model, name: &str) -> Vec<f64> {
    model.parameters.values().find(|parameter| parameter.name == name).unwrap().default.clone()
}

#[test]
fn a_coin_that_fell_four_times() {
    // A prior count of one for each value, and four observations: (1 + 1) / (4 + 2). For a coin, Laplace's law is
    // Beta(1, 1).
    let tosses = [0.0, 1.0, 0.0, 0.0].map(|toss| vec![toss]);
    let beta = [("0..=1", "bool"), ("laplace_succession", "beta(1, 1)")];
    for model in [program("coin_learning"), variant("coin_learning", &beta)] {
        let learned = observed(&model, &["O"], &tosses).learned().unwrap();
        near(&probabilities(learned.model(), "next", &[]), &[2.0 / 3.0, 1.0 / 3.0], 1e-15);
    }
}

#[test]
fn a_normal_law_of_six_numbers() {
    let numbers = [12.0, 23.0, 57.0, -30.0, -46.0, 78.0];
    // 94 / 6; Σx² = 13 022, less 94² / 6, by 6 or by 5.
    let (mean, squares): (f64, f64) = (94.0 / 6.0, 13_022.0 - 94.0 * 94.0 / 6.0);
    for (fit, divisor, published) in
        [("unknown(normal)", 6.0, 43.8736), ("unknown(normal, unbiased)", 5.0, 48.0611)]
    {
        let model = variant("normal_learning", &[("unknown(normal)", fit)]);
        let learned = observed(&model, &["X"], &numbers.map(|number| vec![number])).learned().unwrap();
        let deviation = f64::sqrt(squares / divisor);
        assert!((mean - 15.6667).abs() < 5e-5 && (deviation - published).abs() < 5e-5, "{mean} {deviation}");
        for x in [0.0, 15.0, 78.0_f64] {
            near(
                &probabilities(learned.model(), &format!("P(X = {x})"), &[]),
                &[pdf(x, mean, deviation)],
                1e-12,
            );
        }
    }
}

/// The share of the light ones, and mean and deviation of both kinds.
const LIGHT: f64 = 0.55;
const WEIGHTS: [[f64; 2]; 2] = [[45.0, 10.0], [55.0, 15.0]];

/// Weights of both kinds.
pub(crate) fn weights(count: usize) -> Vec<Vec<f64>> {
    let mut generator = seeded(15, "weights");
    let one = |_| {
        let kind = usize::from(chance(&mut generator) >= LIGHT);
        vec![Law::Normal.draw(&mut generator, &WEIGHTS[kind])]
    };
    (0..count).map(one).collect()
}

#[test]
fn two_kinds_of_weights_are_separated() {
    let (light, laws) = (LIGHT, WEIGHTS);
    let weights = weights(1000);
    let model = program("mixture_learning");
    // The initial values in the program.
    assert_eq!(default(&model, "light"), [0.7]);
    assert_eq!((default(&model, "mu"), default(&model, "sigma")), (vec![20.0, 70.0], vec![40.0]));
    let learned = maximised(&observed(&model, &["Weight"], &weights), 1e-4);
    assert_eq!(learned.report.hidden, ["Kind"]);
    let part = |x: f64, kind: usize| [light, 1.0 - light][kind] * pdf(x, laws[kind][0], laws[kind][1]);
    let truth: f64 = weights.iter().map(|row| (part(row[0], 0) + part(row[0], 1)).ln()).sum();
    // Wilks: twice the gain over the truth follows χ² with 5 degrees of freedom, above 25.7 once in 10 000.
    let gain = learned.report.ln_likelihood - truth;
    assert!(gain >= 0.0 && 2.0 * gain < 25.7, "{gain}");
    // The laws overlap, so that a single number is estimated roughly where others compensate: each is within three of
    // its standard errors of the truth, which for the share of light ones is at least half. The likelihood bound above
    // is the sharp one.
    let score = |x: f64| {
        let (one, other) = (part(x, 0), part(x, 1));
        let standard = [0, 1].map(|kind| (x - laws[kind][0]) / laws[kind][1]);
        let share = [one / (one + other), other / (one + other)];
        let mean = |kind: usize| share[kind] * standard[kind] / laws[kind][1];
        let deviation = |kind: usize| share[kind] * (standard[kind].powi(2) - 1.0) / laws[kind][1];
        [share[0] / light - share[1] / (1.0 - light), mean(0), mean(1), deviation(0), deviation(1)]
    };
    let scores = weights.iter().map(|row| score(row[0]));
    let errors = standard_errors(scores);
    let (mu, sigma) = (default(learned.model(), "mu"), default(learned.model(), "sigma"));
    let found = [default(learned.model(), "light")[0], mu[0], mu[1], sigma[0], sigma[1]];
    for ((found, truth), error) in found.iter().zip([light, 45.0, 55.0, 10.0, 15.0]).zip(errors) {
        assert!((found - truth).abs() < 3.0 * error, "{found}, expected {truth} ± {error}");
    }
    // Each M step gives the mixture the mean and the variance of the weights.
    let [share, rest] = [found[0], 1.0 - found[0]];
    let mean = weights.iter().map(|row| row[0]).sum::<f64>() / 1000.0;
    let square = weights.iter().map(|row| row[0] * row[0]).sum::<f64>() / 1000.0;
    let squares = [0, 1].map(|kind| mu[kind] * mu[kind] + sigma[kind] * sigma[kind]);
    let moments = [share * mu[0] + rest * mu[1], share * squares[0] + rest * squares[1]];
    near(&moments, &[mean, square], 1e-9);
    // The learned program answers.
    let kinds = [found[0] * pdf(50.0, mu[0], sigma[0]), (1.0 - found[0]) * pdf(50.0, mu[1], sigma[1])];
    near(&probabilities(learned.model(), "kind", &[]), &normalised(kinds.to_vec()), 1e-12);
}

/// The deviations of estimates by maximum likelihood: the diagonal of (Σ s sᵀ)⁻¹, s the gradient of each case's ln L
/// at the truth. Gauss-Jordan.
fn standard_errors<const N: usize>(scores: impl Iterator<Item = [f64; N]>) -> [f64; N] {
    let mut information = [[0.0; N]; N];
    for score in scores {
        for (row, by) in information.iter_mut().zip(score) {
            row.iter_mut().zip(score).for_each(|(cell, other)| *cell += by * other);
        }
    }
    std::array::from_fn(|wanted| {
        let (mut matrix, mut unit) = (information, [0.0; N]);
        unit[wanted] = 1.0;
        for pivot in 0..N {
            for row in (0..N).filter(|row| *row != pivot) {
                let share = matrix[row][pivot] / matrix[pivot][pivot];
                let above = matrix[pivot];
                matrix[row].iter_mut().zip(above).for_each(|(cell, other)| *cell -= share * other);
                unit[row] -= share * unit[pivot];
            }
        }
        (unit[wanted] / matrix[wanted][wanted]).sqrt()
    })
}

/// The network of `asia.bp`: a record of Asia, Smoking, Tuberculosis, Cancer, Bronchitis, Either, XRay, Dyspnoea.
fn record(generator: &mut Random) -> Vec<f64> {
    let mut falls = |p: f64| chance(generator) < p;
    let (asia, smoking) = (falls(0.01), falls(0.5));
    let tuberculosis = falls(if asia { 0.05 } else { 0.01 });
    let cancer = falls(if smoking { 0.1 } else { 0.01 });
    let bronchitis = falls(if smoking { 0.6 } else { 0.3 });
    let either = tuberculosis || cancer;
    let picture = falls(if either { 0.98 } else { 0.05 });
    let breath = falls([[0.1, 0.8], [0.7, 0.9]][usize::from(either)][usize::from(bronchitis)]);
    let record = [asia, smoking, tuberculosis, cancer, bronchitis, either, picture, breath];
    record.map(|truth| f64::from(u8::from(truth))).to_vec()
}

const RECORD: [&str; 8] =
    ["Asia", "Smoking", "Tuberculosis", "Cancer", "Bronchitis", "Either", "XRay", "Dyspnoea"];

/// A variable, its parents with their values, and the probability that it is true.
type Entry = (usize, &'static [(usize, f64)], f64);

/// The network that the records are drawn from.
const TABLE: [Entry; 14] = [
    (0, &[], 0.01),
    (1, &[], 0.5),
    (2, &[(0, 0.0)], 0.01),
    (2, &[(0, 1.0)], 0.05),
    (3, &[(1, 0.0)], 0.01),
    (3, &[(1, 1.0)], 0.1),
    (4, &[(1, 0.0)], 0.3),
    (4, &[(1, 1.0)], 0.6),
    (6, &[(5, 0.0)], 0.05),
    (6, &[(5, 1.0)], 0.98),
    (7, &[(5, 0.0), (4, 0.0)], 0.1),
    (7, &[(5, 0.0), (4, 1.0)], 0.8),
    (7, &[(5, 1.0), (4, 0.0)], 0.7),
    (7, &[(5, 1.0), (4, 1.0)], 0.9),
];

/// Each number of the network is within four standard errors of the truth, from the records that show all of its family
/// and have its context; records with missing cells add information.
fn is_the_network(learned: &Learned, records: &[Vec<f64>]) {
    for (variable, parents, truth) in TABLE {
        let is_informative = |record: &&Vec<f64>| {
            !record[variable].is_nan() && parents.iter().all(|(parent, value)| record[*parent] == *value)
        };
        let count = records.iter().filter(is_informative).count() as f64;
        let given = parents.iter().map(|(parent, value)| format!("{} = {}", RECORD[*parent], *value == 1.0));
        let given = given.collect::<Vec<_>>().join(", ");
        let bar = if parents.is_empty() { "" } else { " | " };
        let asked = format!("P({} = true{bar}{given})", RECORD[variable]);
        let found = probabilities(learned.model(), &asked, &[])[0];
        let error = (truth * (1.0 - truth) / count).sqrt();
        assert!((found - truth).abs() < 4.0 * error, "{asked}: {found}, expected {truth} ± {error}");
    }
}

#[test]
fn a_network_is_learned_from_records_and_from_records_with_holes() {
    let text = std::fs::read_to_string(folder().join("asia.bp")).unwrap();
    let (variables, _) = text.split_once("    forms {").unwrap();
    let forms = "forms {
        P(Asia) = unknown(histogram); P(Smoking) = unknown(histogram);
        P(Tuberculosis | Asia) = unknown(histogram); P(Cancer | Smoking) = unknown(histogram);
        P(Bronchitis | Smoking) = unknown(histogram);
        P(Either | Tuberculosis Cancer) = dirac(Tuberculosis or Cancer);
        P(XRay | Either) = unknown(histogram); P(Dyspnoea | Either Bronchitis) = unknown(histogram);
    }";
    let model = compile(&Source::new("asia", format!("{variables}{forms} }}"))).unwrap();
    let mut generator = seeded(1988, "records");
    let mut records: Vec<Vec<f64>> = (0..10_000).map(|_| record(&mut generator)).collect();
    is_the_network(&observed(&model, &RECORD, &records).learned().unwrap(), &records);
    // One cell of twenty is lost, in whichever record.
    for cell in records.iter_mut().flatten() {
        if chance(&mut generator) < 0.05 {
            *cell = f64::NAN;
        }
    }
    let learned = maximised(&observed(&model, &RECORD, &records), 1e-2);
    let lost = records.iter().flatten().filter(|cell| cell.is_nan()).count();
    assert_eq!((learned.report.cells_missing, learned.report.cases), (lost, 10_000));
    is_the_network(&learned, &records);
}

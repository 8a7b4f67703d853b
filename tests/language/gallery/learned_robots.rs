//! Robots that learn from a driver: pushing, following, avoiding, and when the driver avoids.
//!
//! In: cases drawn here from the laws of `khepera_driver.bp` and `homing.bp`. Out: pass or fail. Invariant: a mean is
//! that of the cases, counted here, and the driver's to four standard errors; a likelihood is that of loops written
//! here.

use super::laws::normal;
use super::learning::{chance, maximised, observed, weights};
use super::{answers, folder, near, probabilities, program};
use bp_core::compiler::random::{Random, seeded};
use std::collections::BTreeMap;

fn speed(mean: f64, deviation: f64) -> Vec<f64> {
    normal(-10, 10, mean, deviation)
}

/// A uniformly random integer from `low` to `high`.
fn whole(generator: &mut Random, low: i32, high: i32) -> f64 {
    f64::from(low) + (chance(generator) * f64::from(high - low + 1)).floor()
}

/// A speed drawn from a law on -10..=10.
fn drawn(generator: &mut Random, law: &[f64]) -> f64 {
    let mut left = chance(generator);
    let place = law.iter().position(|p| {
        left -= p;
        left < 0.0
    });
    place.unwrap_or(law.len() - 1) as f64 - 10.0
}

/// Mean and deviation of a law on -10..=10.
fn moments(law: &[f64]) -> (f64, f64) {
    let speeds = || (-10..=10).map(f64::from).zip(law);
    let mean: f64 = speeds().map(|(v, p)| v * p).sum();
    (mean, speeds().map(|(v, p)| (v - mean).powi(2) * p).sum::<f64>().sqrt())
}

/// Mean and deviation by maximum likelihood.
fn fitted(speeds: &[f64]) -> (f64, f64) {
    let count = speeds.len() as f64;
    let mean = speeds.iter().sum::<f64>() / count;
    (mean, (speeds.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / count).sqrt())
}

/// The table of the behaviours.
fn driver(behaviour: usize, dir: f64, prox: f64) -> Vec<f64> {
    let follow = 0.25 * (18.0 - prox) * if dir > 0.0 { dir - 10.0 } else { dir + 10.0 };
    speed([dir, follow, -dir][behaviour], 18.0 - prox)
}

const BEHAVIOURS: [&str; 3] = ["khepera_pushing", "khepera_following", "khepera_avoiding"];

/// The distance of an answer's means from a driver's, in standard errors, squared: averaged over the contexts of these
/// cases.
fn misfit(rows: &[f64], behaviour: usize, contexts: &BTreeMap<(i32, i32), Vec<f64>>) -> f64 {
    let each = contexts.iter().map(|((dir, prox), speeds)| {
        let at = 21 * ((dir + 10) * 16 + prox) as usize;
        let (mean, deviation) = moments(&driver(behaviour, f64::from(*dir), f64::from(*prox)));
        ((moments(&rows[at..at + 21]).0 - mean) / deviation).powi(2) * speeds.len() as f64
    });
    each.sum::<f64>() / contexts.len() as f64
}

/// Dir, Prox and Vrot of a driver.
fn driven(behaviour: usize, count: usize) -> Vec<Vec<f64>> {
    let mut generator = seeded(4, BEHAVIOURS[behaviour]);
    let triple = |_| {
        let (dir, prox) = (whole(&mut generator, -10, 10), whole(&mut generator, 0, 15));
        vec![dir, prox, drawn(&mut generator, &driver(behaviour, dir, prox))]
    };
    (0..count).map(triple).collect()
}

fn learns_to_drive(behaviour: usize, count: usize) {
    let model = program(BEHAVIOURS[behaviour]);
    let mut contexts: BTreeMap<(i32, i32), Vec<f64>> = BTreeMap::new();
    let triples = driven(behaviour, count);
    for triple in &triples {
        contexts.entry((triple[0] as i32, triple[1] as i32)).or_default().push(triple[2]);
    }
    let learned = observed(&model, &["Dir", "Prox", "Vrot"], &triples).learned().unwrap();
    let rows = probabilities(learned.model(), "turn", &[]);
    // The law of a context's own speeds; a single value if these are all equal, and that of all contexts if there are
    // none.
    let all: Vec<f64> = triples.iter().map(|triple| triple[2]).collect();
    let expected = (-10..=10).flat_map(|dir| (0..=15).map(move |prox| (dir, prox))).flat_map(|context| {
        let (mean, deviation) = contexts.get(&context).map_or_else(|| fitted(&all), |speeds| fitted(speeds));
        match deviation > 0.0 {
            true => speed(mean, deviation),
            false => (-10..=10).map(|speed| f64::from(u8::from(f64::from(speed) == mean))).collect(),
        }
    });
    near(&rows, &expected.collect::<Vec<f64>>(), 1e-9);
    contexts.retain(|_, speeds| fitted(speeds).1 > 0.0);
    assert!(contexts.len() >= 8, "{} contexts determine a law", contexts.len());
    // The answer follows its own driver: each square is about 1, with a deviation of √2. (A law truncated at both ends
    // is fitted as if it were not, which moves means near the ends to the middle: by no more than the noise, here.)
    let misfits = [0, 1, 2].map(|other| misfit(&rows, other, &contexts));
    assert!((0..3).all(|other| other == behaviour || misfits[other] > misfits[behaviour]), "{misfits:?}");
    assert!(misfits[behaviour] < 1.0 + 4.0 * (2.0 / contexts.len() as f64).sqrt(), "{misfits:?}");
    // The robot acts.
    let act =
        answers(learned.model(), "draw(1000) P(Vrot | Dir = 5, Prox = 10)", &[]).unwrap().remove(0).answer;
    let turns: Vec<f64> = act.iter().map(|row| row.values[0].1.parse().unwrap()).collect();
    let at = 21 * (15 * 16 + 10);
    let (mean, deviation) = moments(&rows[at..at + 21]);
    assert!(
        (fitted(&turns).0 - mean).abs() < 4.0 * deviation / 1000.0_f64.sqrt(),
        "{} {mean}",
        fitted(&turns).0
    );
    assert_eq!(answers(learned.model(), "act", &[]).unwrap().remove(0).answer.len(), 1);
}

#[test]
fn a_robot_learns_to_push() {
    learns_to_drive(0, 100);
    learns_to_drive(0, 10_000);
}

#[test]
fn a_robot_learns_to_follow() {
    learns_to_drive(1, 100);
    learns_to_drive(1, 10_000);
}

#[test]
fn a_robot_learns_to_avoid() {
    learns_to_drive(2, 100);
    learns_to_drive(2, 10_000);
}

/// The likelihood of a speed while avoiding and while going to the light.
type Seen = (usize, [f64; 2]);

/// Cases of `homing.bp`: Dir, Prox, Theta and Vrot; the chosen behaviour is hidden.
fn homing(count: usize) -> (Vec<Vec<f64>>, Vec<Seen>) {
    let mut generator = seeded(10, "homing");
    let case = |_| {
        let (dir, theta) = (whole(&mut generator, -10, 10), whole(&mut generator, -10, 10));
        let prox = whole(&mut generator, 0, 15);
        let laws = [speed(-dir, 18.0 - prox), speed(theta, 2.0)];
        let choice = usize::from(chance(&mut generator) >= avoids(prox));
        let turn = drawn(&mut generator, &laws[choice]);
        let at = (turn + 10.0) as usize;
        (vec![dir, prox, theta, turn], (prox as usize, [laws[0][at], laws[1][at]]))
    };
    (0..count).map(case).unzip()
}

fn avoids(prox: f64) -> f64 {
    1.0 / (1.0 + (0.25 * (9.0 - prox)).exp())
}

/// ln P(Vrot | Dir Prox Theta) of all cases.
fn ln_likelihood(cases: &[Seen], avoid: &dyn Fn(usize) -> f64) -> f64 {
    cases.iter().map(|(prox, [away, home])| (avoid(*prox) * away + (1.0 - avoid(*prox)) * home).ln()).sum()
}

/// P(Avoid) at a nearness by its own fixed point: the mean of the responsibilities of its cases. ln L is concave, so it
/// is unique.
fn fixed_point(cases: &[Seen], prox: usize) -> f64 {
    let own: Vec<[f64; 2]> = cases.iter().filter(|case| case.0 == prox).map(|case| case.1).collect();
    let say =
        |avoid: f64| own.iter().map(move |[away, home]| avoid * away / (avoid * away + (1.0 - avoid) * home));
    (0..20_000)
        .fold(0.5, |avoid, _| if own.is_empty() { 0.5 } else { say(avoid).sum::<f64>() / own.len() as f64 })
}

#[test]
fn when_the_driver_avoids_is_learned_from_how_the_robot_turned() {
    let model = program("em_behaviour");
    let learned = |count: usize, threshold: f64| {
        let (rows, cases) = homing(count);
        let learned = maximised(&observed(&model, &["Dir", "Prox", "Theta", "Vrot"], &rows), threshold);
        assert_eq!(learned.report.hidden, ["H"]);
        let choice = probabilities(learned.model(), "choice", &[]);
        (choice.chunks(2).map(|row| row[0]).collect::<Vec<f64>>(), cases, learned.report)
    };
    // A hundred cases, as in the text: more likely than under the truth, and almost as likely as possible. Wilks: twice
    // the gain over the truth follows χ² with 16 degrees of freedom or fewer, above 46 once in 10 000.
    let (found, cases, report) = learned(100, 0.01);
    let course = report.expectation.unwrap();
    assert!(course.trail.len() > 2 && course.trail[0] + 0.01 < *course.trail.last().unwrap(), "{course:?}");
    let best: Vec<f64> = (0..16).map(|prox| fixed_point(&cases, prox)).collect();
    let reached = ln_likelihood(&cases, &|prox| found[prox]);
    let (most, truth) =
        (ln_likelihood(&cases, &|prox| best[prox]), ln_likelihood(&cases, &|prox| avoids(prox as f64)));
    assert!(
        reached >= truth && most - reached < 0.5 && 2.0 * (most - truth) < 46.0,
        "{reached} {most} {truth}"
    );
    // Many cases: the sigmoid, to four standard errors of the estimate at each nearness.
    let (found, cases, _) = learned(4000, 1e-3);
    for (prox, found) in found.iter().enumerate() {
        let avoid = avoids(prox as f64);
        let own = cases.iter().filter(|case| case.0 == prox).map(|case| case.1);
        let score = |[away, home]: [f64; 2]| (away - home) / (avoid * away + (1.0 - avoid) * home);
        let information: f64 = own.map(|seen| score(seen).powi(2)).sum();
        let error = 1.0 / information.sqrt();
        assert!(
            error < 0.06 && (found - avoid).abs() < 4.0 * error,
            "Prox {prox}: {found}, {avoid} ± {error}"
        );
    }
}

/// The name of a data file, its columns and its rows.
type DataFile = (&'static str, &'static [&'static str], Vec<Vec<f64>>);

/// The data files of the gallery's page are draws of this file and of `learning.rs`; `BLESS=1` writes them anew.
#[test]
fn data_of_the_page_are_drawn_from_the_drivers() {
    const TURNS: [&str; 3] = ["Dir", "Prox", "Vrot"];
    let weights: Vec<Vec<f64>> =
        weights(1000).iter().map(|row| vec![(row[0] * 100.0).round() / 100.0]).collect();
    let files: [DataFile; 5] = [
        ("pushing", &TURNS, driven(0, 2000)),
        ("following", &TURNS, driven(1, 2000)),
        ("avoiding", &TURNS, driven(2, 2000)),
        ("homing", &["Dir", "Prox", "Theta", "Vrot"], homing(1000).0),
        ("weights", &["Weight"], weights),
    ];
    for (name, columns, rows) in files {
        let line = |row: &Vec<f64>| row.iter().map(f64::to_string).collect::<Vec<_>>().join(",");
        let rows: Vec<String> = rows.iter().map(line).collect();
        let text = format!("{}\n{}\n", columns.join(","), rows.join("\n"));
        let path = folder().join(format!("data/{name}.csv"));
        if std::env::var_os("BLESS").is_some() {
            std::fs::write(&path, &text).unwrap();
        }
        assert!(
            std::fs::read_to_string(&path).unwrap_or_default() == text,
            "{} has other draws",
            path.display()
        );
    }
}

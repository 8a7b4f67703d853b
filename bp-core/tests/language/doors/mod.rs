//! The Rust interface: reals, draws, time, networks and learning.
//!
//! In: programs as texts, files in a folder of their own. Out: pass or fail. Invariant: expected numbers are computed
//! by hand.

use crate::door::{fails, near};
use bp_core::prelude::*;

const LINE: &str = "program Line {
    variables { X, Y, Z : real; }
    decomposition { P(X) P(Y | X) P(Z | Y) }
    forms { P(X) = normal(0, 1); P(Y | X) = normal(X, 1); P(Z | Y) = normal(Y, 1); }
}";

#[test]
fn reals_have_moments_intervals_and_densities() {
    let line = Program::parse(LINE).unwrap();
    let x = line.ask("P(X | Z = 3)").unwrap();
    // Z = X + noise of variance 2: the mean is 3 · 1 / 3, the variance 1 − 1 / 3.
    near(x.mean().unwrap(), 1.0);
    near(x.variance().unwrap(), 2.0 / 3.0);
    assert_eq!(x.mode().unwrap()["X"], x.mean().unwrap());
    let deviation = (2.0f64 / 3.0).sqrt();
    // The normal quantile at 0.975 (tables): 1.959963984540054.
    let [low, high] = x.interval(0.95).unwrap();
    near(low, 1.0 - 1.959963984540054 * deviation);
    near(high, 1.0 + 1.959963984540054 * deviation);
    near(x.p(1.0).unwrap(), 1.0 / (std::f64::consts::TAU.sqrt() * deviation));
    near(x.entropy().unwrap(), 0.5 * (std::f64::consts::TAU * std::f64::consts::E * 2.0 / 3.0).ln());
    // ln N(3; 0, 3)
    near(x.ln_evidence().unwrap(), -0.5 * (3.0 + (std::f64::consts::TAU * 3.0).ln()));
    let both = line.ask("P(X Y | Z = 3)").unwrap();
    // Cov(X, Y | Z) = 1 − 1 · 2 / 3, Var(Y | Z) = 2 − 4 / 3.
    near(both.covariance("X", "Y").unwrap(), 1.0 / 3.0);
    near(both.of("Y").unwrap().variance().unwrap(), 2.0 / 3.0);
    near(both.of("Y").unwrap().mean().unwrap(), 2.0);
    fails(x.draws(), &["it is exact"]);
    fails(x.quantile(1.5), &["between 0 and 1"]);
}

/// ln N(1; 0, 1) and ln N(2; 1, 1) are −½ − ½ ln 2π each.
#[test]
fn what_is_observed_as_a_whole_has_its_probability() {
    let normal = -0.5 - 0.5 * std::f64::consts::TAU.ln();
    let line = Program::parse(LINE).unwrap();
    let seen = evidence! { X: 1.0, Y: 2.0, Z: 3.0 };
    near(line.marginals(&seen).unwrap().ln_evidence().unwrap(), 3.0 * normal);
    near(line.most_probable(&seen).unwrap().number().unwrap(), 3.0 * normal);
    let text = "program Mixed {
        variables { K : bool; X : real; }
        decomposition { P(K) P(X | K) }
        forms { P(K) = bernoulli(0.25); P(X | K) = normal(if K { 1 } else { 0 }, 1); }
    }";
    let mixed = Program::parse(text).unwrap();
    let seen = evidence! { K: false, X: 1.0 };
    near(mixed.marginals(&seen).unwrap().ln_evidence().unwrap(), 0.75f64.ln() + normal);
    near(mixed.most_probable(&seen).unwrap().number().unwrap(), 0.75f64.ln() + normal);
}

#[test]
fn draws_have_errors_and_weights() {
    let program = Program::parse(
        "program Square {
             variables { X, Y : real; Far : bool; }
             decomposition { P(X) P(Y | X) P(Far | X) }
             forms {
                 P(X) = normal(0, 1);
                 P(Y | X) = normal(X * X, 1);
                 P(Far | X) = bernoulli(if X > 1 { 0.9 } else { 0.1 });
             }
         }",
    )
    .unwrap();
    let program = program.draws(20_000).seed(3);
    let far = program.ask("P(Far)").unwrap();
    // P(X > 1) = 0.15865525393145707 (tables): 0.1 + 0.8 · that.
    let [p, error] = far.p_and_error(true).unwrap();
    let expected = 0.1 + 0.8 * 0.15865525393145707;
    assert!((p - expected).abs() <= 5.0 * error, "{p} ± {error}");
    let y = program.ask("P(X Y)").unwrap();
    assert!(!y.strategy().is_exact() && y.estimate().unwrap().seed == 3);
    // E Y = E X² = 1, Var Y = Var X² + 1 = 3, Cov(X, Y) = E X³ = 0.
    let [mean, error] = y.of("Y").unwrap().mean_and_error().unwrap();
    assert!(error < 0.02 && (mean - 1.0).abs() <= 5.0 * error, "{mean} ± {error}");
    assert!((y.of("Y").unwrap().variance().unwrap() - 3.0).abs() < 0.2);
    assert!(y.covariance("X", "Y").unwrap().abs() < 0.15);
    let draws = y.of("X").unwrap().draws().unwrap();
    assert_eq!(draws.len(), 20_000);
    assert!((draws.iter().map(|(_, weight)| weight).sum::<f64>() - 1.0).abs() < 1e-9);
    let [low, high] = y.of("X").unwrap().interval(0.9).unwrap();
    assert!((low + 1.6449).abs() < 0.1 && (high - 1.6449).abs() < 0.1, "{low} {high}");
    fails(y.of("X").unwrap().p(0.3), &["draws of `X` have no density"]);
    // The half-sample mode of one real; two together have none.
    assert!(y.of("X").unwrap().mode().unwrap()["X"].as_f64().unwrap().abs() < 0.3);
    fails(y.mode(), &["`X` is a real", "`interval`"]);
}

const DOOR: &str = "program Door {
    variables { Open, Open^-1, Seen : bool; }
    decomposition { P(Open^-1) P(Open | Open^-1) P(Seen | Open) }
    forms {
        P(Open^-1)        = previous(Open) else bernoulli(0);
        P(Open | Open^-1) = table { false: 0.9, 0.1; true: 0.2, 0.8; };
        P(Seen | Open)    = bernoulli(if Open { 0.7 } else { 0.1 });
    }
}";

/// The weights of the door's last state after these readings, over all histories; and of each history.
fn histories(readings: &[bool]) -> Vec<(Vec<usize>, f64)> {
    let (moves, sees) = ([[0.9, 0.1], [0.2, 0.8]], [[0.9, 0.1], [0.3, 0.7]]);
    let weigh = |history: usize| {
        let states: Vec<usize> = (0..readings.len()).map(|instant| history >> instant & 1).collect();
        let mut p = 1.0;
        for (instant, seen) in readings.iter().enumerate() {
            let before = if instant == 0 { 0 } else { states[instant - 1] };
            p *= moves[before][states[instant]] * sees[states[instant]][usize::from(*seen)];
        }
        (states, p)
    };
    (0..1 << readings.len()).map(weigh).collect()
}

fn open_at(histories: &[(Vec<usize>, f64)], instant: usize) -> f64 {
    let total: f64 = histories.iter().map(|(_, p)| p).sum();
    histories.iter().filter(|(states, _)| states[instant] == 1).map(|(_, p)| p).sum::<f64>() / total
}

#[test]
fn a_filter_follows_instants_and_looks_ahead() {
    let program = Program::parse(DOOR).unwrap();
    let readings = [true, false, true, true];
    let mut door = program.filter("P(Open | Seen)").unwrap();
    for instant in 0..readings.len() {
        let open = door.step(evidence! { Seen: readings[instant] }).unwrap();
        let all = histories(&readings[..=instant]);
        near(open.p(true).unwrap(), open_at(&all, instant));
        near(door.ln_evidence(), all.iter().map(|(_, p)| p).sum::<f64>().ln());
        // Refused evidence leaves the filter where it is.
        fails(door.step(evidence! { Seem: true }), &["did you mean `Seen`?"]);
        fails(door.step(evidence! { Seen: 0.5 }), &["`0.5` is not a value of `Seen`"]);
    }
    let last = open_at(&histories(&readings), 3);
    let one = 0.8 * last + 0.1 * (1.0 - last);
    near(door.predict(1).unwrap().p(true).unwrap(), one);
    near(door.predict(2).unwrap().p(true).unwrap(), 0.8 * one + 0.1 * (1.0 - one));
    // No observation at an instant: the prediction.
    near(door.step(evidence! {}).unwrap().p(true).unwrap(), one);
    assert_eq!(door.instants(), 5);
    fails(program.filter("smooth P(Open | Seen)"), &["a filter answers one question"]);
}

#[test]
fn instants_are_smoothed_and_their_sequence_found() {
    let program = Program::parse(DOOR).unwrap();
    let readings = [true, false, true, true];
    let seen: Vec<Evidence> = readings.iter().map(|seen| evidence! { Seen: *seen }).collect();
    let smooth = program.question("smooth P(Open | Seen)").unwrap().over(&seen).unwrap();
    let all = histories(&readings);
    for instant in 0..readings.len() {
        near(smooth.at(instant + 1).unwrap().p(true).unwrap(), open_at(&all, instant));
    }
    assert_eq!(smooth.instants(), 4);
    fails(smooth.p(true), &["4 instants: choose one with `at`"]);
    fails(smooth.at(5), &["no instant 5; its instants are 1 to 4"]);
    let sequence = program.question("sequence P(Open | Seen)").unwrap().over(&seen).unwrap();
    let best = all.iter().max_by(|one, other| one.1.total_cmp(&other.1)).unwrap();
    for (instant, state) in best.0.iter().enumerate() {
        assert_eq!(sequence.at(instant + 1).unwrap().mode().unwrap()["Open"], *state == 1);
    }
    fails(program.question("filter P(Open | Seen)").unwrap().ask(), &["over time"]);
}

#[test]
fn a_kalman_filter_and_particles_take_one_instant_after_the_other() {
    let text = "program Walk {
        variables { X, X^-1, Z : real; }
        decomposition { P(X^-1) P(X | X^-1) P(Z | X) }
        forms {
            P(X^-1) = previous(X) else normal(0, 1);
            P(X | X^-1) = normal(X^-1, 1);
            P(Z | X) = normal(X, 1);
        }
    }";
    let program = Program::parse(text).unwrap();
    let mut walk = program.filter("P(X | Z)").unwrap();
    let (mut mean, mut variance) = (0.0, 1.0);
    for z in [0.5, 2.0, -1.0] {
        // The scalar filter: predict, then gain.
        let ahead = variance + 1.0;
        let gain = ahead / (ahead + 1.0);
        (mean, variance) = (mean + gain * (z - mean), (1.0 - gain) * ahead);
        let x = walk.step(evidence! { Z: z }).unwrap();
        near(x.mean().unwrap(), mean);
        near(x.variance().unwrap(), variance);
    }
    near(walk.predict(3).unwrap().variance().unwrap(), variance + 3.0);
    // A nonlinear program uses particles. All instants together are guided by their observations, a filter is not: they
    // agree within their errors.
    let bent = text.replace("normal(X^-1, 1)", "normal(X^-1 + sin(X^-1), 1)");
    let program = Program::parse(&bent).unwrap().draws(2_000).seed(5);
    let observed: Vec<Evidence> = [0.5, 2.0, -1.0].iter().map(|z| evidence! { Z: *z }).collect();
    let at_once = program.question("filter P(X | Z)").unwrap().over(&observed).unwrap();
    let mut steps = program.filter("P(X | Z)").unwrap();
    let last = observed.iter().map(|instant| steps.step(instant.clone()).unwrap()).last().unwrap();
    let ([step, error], [whole, other]) = (last.mean_and_error().unwrap(), at_once.mean_and_error().unwrap());
    assert!((step - whole).abs() < 4.0 * error.hypot(other), "{step} ± {error}, {whole} ± {other}");
    assert!((steps.ln_evidence() - at_once.ln_evidence().unwrap()).abs() < 0.1);
    assert!(!last.strategy().is_exact());
}

#[test]
fn every_variable_of_a_network_has_its_posterior() {
    let alarm = Program::open(concat!(env!("CARGO_MANIFEST_DIR"), "/../examples/door/alarm.bif")).unwrap();
    let all = alarm.marginals(&evidence! { HR: "HIGH" }).unwrap();
    // P(HR = HIGH) = 0.5 · 0.05 + 0.5 · 0.9 = 0.475.
    near(all.of("CATECHOL").unwrap().p("HIGH").unwrap(), 0.45 / 0.475);
    near(all.of("HRBP").unwrap().p("NORMAL").unwrap(), 0.4);
    near(all.of("HR").unwrap().p("HIGH").unwrap(), 1.0);
    near(all.ln_evidence().unwrap(), 0.475f64.ln());
    assert_eq!(all.strategy().name(), "join_tree");
    assert!(all.to_string().lines().all(|line| line.chars().count() <= 80));
    fails(all.p("HIGH"), &["choose one with `of`"]);
    fails(alarm.marginals(&evidence! { HR: "HIHG" }), &["`HR`", "did you mean `HIGH`?"]);
    fails(alarm.marginals(&evidence! { HER: "HIGH" }), &["`HER`"]);
    let weighed = evidence! { HR: Value::Likelihood(vec![0.0, 1.0, 3.0]) };
    // P(CATECHOL = HIGH) ∝ 0.09 + 3 · 0.9, NORMAL ∝ 0.9 + 3 · 0.05.
    let catechol = alarm.marginals(&weighed).unwrap().of("CATECHOL").unwrap().p("HIGH").unwrap();
    near(catechol, 2.79 / (2.79 + 1.05));
    // A question gives the same answer.
    near(alarm.ask("P(CATECHOL | HR = HIGH)").unwrap().p("HIGH").unwrap(), 0.45 / 0.475);
    // Reals: each variable is planned.
    let line = Program::parse(LINE).unwrap().marginals(&evidence! { Z: 3.0 }).unwrap();
    near(line.of("X").unwrap().mean().unwrap(), 1.0);
    near(line.of("Y").unwrap().mean().unwrap(), 2.0);
}

#[test]
fn a_program_learns_from_a_table_and_keeps_its_text() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("tosses.csv");
    std::fs::write(&path, "Heads,Day\nfalse,1\ntrue,2\nfalse,3\nfalse,4\n").unwrap();
    let coin = Program::parse(
        "program Coin {
             variables { Heads : bool; }
             decomposition { P(Heads) }
             forms { P(Heads) = unknown(beta(1, 1)); }  // of a coin
         }",
    )
    .unwrap();
    let learned = coin.learn(Learning::from(&path).ignore("Day")).unwrap();
    // (1 + 1) / (4 + 2)
    near(learned.ask("P(Heads)").unwrap().p(true).unwrap(), 1.0 / 3.0);
    assert_eq!(learned.report().cases, 4);
    let text = learned.text().unwrap();
    assert!(text.contains("// of a coin") && !text.contains("unknown"), "{text}");
    near(Program::parse(text).unwrap().ask("P(Heads)").unwrap().p(true).unwrap(), 1.0 / 3.0);
    fails(coin.learn(path.as_path()), &["tosses.csv", "`Day`"]);
    fails(coin.learn(folder.path().join("none.csv")), &["none.csv"]);
}

/// An observation and a likelihood of the same variable, or element, are refused by every question about evidence.
#[test]
fn a_variable_is_known_once() {
    let two = Program::parse(
        "program Two {
             variables { A : bool; Z[1..=2] : bool; }
             decomposition { P(A) prod(i) { P(Z[i] | A) } }
             forms { P(A) = bernoulli(0.5); P(Z[i] | A) = bernoulli(if A { 0.9 } else { 0.2 }); }
         }",
    )
    .unwrap();
    let weighs = || Value::Likelihood(vec![1.0, 0.0]);
    let both = evidence! { A: true, A: weighs() };
    fails(two.marginals(&both), &["`A` is known twice"]);
    fails(two.most_probable(&both), &["`A` is known twice"]);
    fails(two.joint(&["Z[1]".to_owned()], &both), &["`A` is known twice"]);
    fails(two.observations(&["Z[1]".to_owned()], &[], &both), &["`A` is known twice"]);
    fails(two.marginals(&evidence! { Z[2]: true, Z[2]: weighs() }), &["`Z[2]` is known twice"]);
    fails(two.marginals(&evidence! { Z: vec![true, false], Z[2]: weighs() }), &["`Z[2]` is known twice"]);
    fails(two.marginals(&evidence! { Z[2]: weighs(), Z: vec![true, false] }), &["`Z` is known twice"]);
    // The last value counts: P(A = true | Z[1] = true) = 0.9 / (0.9 + 0.2).
    let found = two.marginals(&evidence! { Z[1]: false, Z[1]: true }).unwrap();
    near(found.of("A").unwrap().p(true).unwrap(), 0.9 / 1.1);
}

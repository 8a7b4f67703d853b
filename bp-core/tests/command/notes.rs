//! Notes on columns that no question reads, on rows that are answered alone, and on questions about the next observation.
//!
//! In: the built binary, programs and tables made here. Out: answers, notes on stderr. The expected probabilities are enumerated
//! by hand.

use serde_json::Value;
use std::process::{Command, Output};

const MACHINE: &str = "program Machine {
    variables { Up, Up^-1, Light : bool; }
    decomposition { P(initial(Up)) P(Up | Up^-1) P(Light | Up) }
    forms {
        P(initial(Up)) = bernoulli(0.8);
        P(Up | Up^-1)  = bernoulli(if Up^-1 { 0.7 } else { 0.1 });
        P(Light | Up)  = bernoulli(if Up { 0.9 } else { 0.2 });
    }
}";

const GRASS: &str = "program Grass { variables { Rain, Wet : bool; } decomposition { P(Rain) P(Wet | Rain) }
    forms { P(Rain) = bernoulli(0.3); P(Wet | Rain) = bernoulli(if Rain { 0.9 } else { 0.1 }); } }";

fn run(files: &[(&str, &str)], arguments: &[&str]) -> Output {
    let folder = tempfile::tempdir().unwrap();
    files.iter().for_each(|(name, text)| std::fs::write(folder.path().join(name), text).unwrap());
    Command::new(env!("CARGO_BIN_EXE_bp")).current_dir(folder.path()).args(arguments).output().unwrap()
}

fn stderr(output: &Output) -> String {
    let words = String::from_utf8(output.stderr.clone()).unwrap();
    words.split_whitespace().collect::<Vec<_>>().join(" ")
}

#[test]
fn a_column_that_no_question_knows_is_noted() {
    let files = [
        ("g.bp", GRASS),
        ("m.bp", MACHINE),
        ("w.csv", "Wet\ntrue\nfalse\n"),
        ("l.csv", "Light\ntrue\nfalse\n"),
    ];
    let note = |arguments: &[&str]| {
        let output = run(&files, arguments);
        assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
        stderr(&output)
    };
    let words = note(&["ask", "g.bp", "P(Rain)", "--data", "w.csv"]);
    assert!(
        words.contains("note: the column `Wet` is not read: `P(Rain)` does not know it; what is observed stands behind the bar: `P(… | Wet)`"),
        "{words}"
    );
    assert_eq!(note(&["ask", "g.bp", "P(Rain | Wet)", "--data", "w.csv"]), "");
    assert_eq!(note(&["ask", "g.bp", "P(Rain)", "--data", "w.csv", "--ignore", "Wet"]), "");
    let words = note(&["ask", "m.bp", "filter P(Up)", "--data", "l.csv"]);
    assert!(words.contains("the column `Light` is not read: `filter P(Up)` does not know it"), "{words}");
    assert_eq!(note(&["ask", "m.bp", "filter P(Up | Light)", "--data", "l.csv"]), "");
}

/// α after true, false, true by enumeration; then one step of the transition and the light of it: 0.5053734745876358.
#[test]
fn the_next_observation_is_predicted_from_those_so_far() {
    let files = [("m.bp", MACHINE), ("l.csv", "Light\ntrue\nfalse\ntrue\n")];
    let predicted = |question: &str| -> f64 {
        let output = run(&files, &["ask", "m.bp", question, "--data", "l.csv", "--json"]);
        assert_eq!(output.status.code(), Some(0), "{question}: {}", stderr(&output));
        let answer: Value = serde_json::from_slice(&output.stdout).unwrap();
        let rows = answer["answer"].as_array().unwrap();
        let row = rows.iter().find(|row| row["values"]["Light"] == "true").unwrap();
        row["p"].as_f64().unwrap()
    };
    for question in ["predict(1) P(Light | Light)", "predict(1) P(Light = true | Light)"] {
        let p = predicted(question);
        assert!((p - 0.505_373_474_587_635_8).abs() < 1e-14, "{question}: {p}");
    }
}

/// x₀ ~ N(0, 1), xₜ = xₜ₋₁ + N(0, 1), y = x + N(0, 0.5), y = 1, 2: by the normal equations of (x₁, x₂) the variance of x₂ is
/// 0.2076 and its mean 1.8113; the next y has the variance 0.2076 + 1 + 0.25.
#[test]
fn a_real_observation_is_predicted() {
    let text = "program Walk { variables { X, X^-1, Y : real; } decomposition { P(X^-1) P(X | X^-1) P(Y | X) }
        forms { P(X^-1) = previous(X) else normal(0, 1); P(X | X^-1) = normal(X^-1, 1); P(Y | X) = normal(X, 0.5); } }";
    let files = [("w.bp", text), ("y.csv", "Y\n1\n2\n")];
    let output = run(&files, &["ask", "w.bp", "predict(1) P(Y | Y)", "--data", "y.csv", "--json"]);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let answer: Value = serde_json::from_slice(&output.stdout).unwrap();
    let row = &answer["answer"][0];
    // After y₁: variance 2 · 0.25 / 2.25 = 2/9, mean 8/9; before y₂: 11/9; after: gain 44/53.
    let (gain, before) = (44.0 / 53.0, 8.0 / 9.0);
    let (mean, variance) = (before + gain * (2.0 - before), gain * 0.25);
    assert!((row["mean"].as_f64().unwrap() - mean).abs() < 1e-12, "{row}");
    assert!((row["deviation"].as_f64().unwrap() - f64::sqrt(variance + 1.0 + 0.25)).abs() < 1e-12, "{row}");
}

#[test]
fn rows_of_a_program_over_time_that_are_answered_alone_are_noted() {
    let text = MACHINE.replace("P(initial(Up))", "P(Up^-1)").replacen(
        "P(Up^-1) = bernoulli(0.8)",
        "P(Up^-1) = previous(Up) else bernoulli(0.8)",
        1,
    );
    let files = [("m.bp", text.as_str()), ("l.csv", "Light\ntrue\nfalse\n")];
    let output = run(&files, &["ask", "m.bp", "P(Up | Light)", "--data", "l.csv"]);
    let words = stderr(&output);
    assert_eq!(output.status.code(), Some(0), "{words}");
    assert!(
        words.contains("each row is answered alone; for a series of instants write `filter P(Up | Light)` or `smooth P(Up | Light)`"),
        "{words}"
    );
}

/// One table with an identifier, for every command that reads cases.
#[test]
fn every_command_ignores_a_column() {
    let mails = "id,Rain,Wet\na,true,true\nb,false,false\nc,false,true\n";
    let unknown = GRASS.replace("bernoulli(0.3)", "unknown");
    let files = [("g.bp", GRASS), ("u.bp", unknown.as_str()), ("d.csv", mails)];
    for arguments in [
        &["ask", "g.bp", "P(Rain | Wet)", "--data", "d.csv", "--ignore", "id,Rain"][..],
        &["learn", "u.bp", "--data", "d.csv", "--ignore", "id"],
        &["batch", "g.bp", "--cases", "d.csv", "--ignore", "id,Rain"],
    ] {
        let output = run(&files, arguments);
        assert_eq!((output.status.code(), stderr(&output).as_str()), (Some(0), ""), "{arguments:?}");
    }
    let output = run(&files, &["batch", "g.bp", "--cases", "d.csv"]);
    assert!(stderr(&output).contains("column `id` names no variable"), "{}", stderr(&output));
    assert!(stderr(&output).contains("`--ignore` leaves a column out"), "{}", stderr(&output));
}

/// An answer without a picture is printed all the same.
#[test]
fn an_answer_that_cannot_be_drawn_is_printed() {
    let output = run(&[("g.bp", GRASS)], &["ask", "g.bp", "draw(3) P(Rain)", "--plot", "plot.svg"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&output.stdout).contains("draw(3) P(Rain)"));
}

/// A count over a range, whose law is normalised over it, has no conjugate prior: the refusal says what has one.
#[test]
fn counts_over_a_range_are_told_from_counts_of_reals() {
    let text = "program Change { variables { Early, Late : real; Tau : 1..=5; N[t in 1..=5] : 0..=20; }
        decomposition { P(Early) P(Late) P(Tau) prod(t in 1..=5) { P(N[t] | Early Late Tau) } }
        forms { P(Early) = gamma(2, 0.5); P(Late) = gamma(2, 0.5); P(Tau) = uniform;
                P(N[t] | Early Late Tau) = poisson(if t < Tau { Early } else { Late }); } }";
    let output = run(&[("c.bp", text)], &["explain", "c.bp", "P(Tau | N = n)"]);
    let words = String::from_utf8(output.stdout).unwrap().split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(words.contains("its rate has no conjugate prior: declare the count as `real`"), "{words}");
}

/// The mass of a distribution is not among the rows that are cut: binomial(100, 0.7) has its mode at 70.
#[test]
fn the_most_probable_row_is_named_where_it_is_not_shown() {
    let text = "program Count { variables { N : 0..=100; } decomposition { P(N) } forms { P(N) = binomial(100, 0.7); } }";
    let output = run(&[("c.bp", text)], &["ask", "c.bp", "P(N)"]);
    let words = String::from_utf8(output.stdout).unwrap();
    // 100! / (70! 30!) · 0.7⁷⁰ · 0.3³⁰ = 0.08678386…
    assert!(words.contains("most probable: N = 70 with 0.0867839"), "{words}");
    let output = run(&[("c.bp", text)], &["ask", "c.bp", "P(N)", "--all"]);
    assert!(!String::from_utf8(output.stdout).unwrap().contains("most probable"));
}

/// By enumeration of the eight paths: 0.35483438… of true, true, true, 0.34759286… of true, false, false.
#[test]
fn a_whole_sequence_is_one_line() {
    let files = [("m.bp", MACHINE), ("l.csv", "Light\ntrue\nfalse\ntrue\n")];
    let output = run(&files, &["ask", "m.bp", "best(2) sequence P(Up | Light)", "--data", "l.csv"]);
    let words = String::from_utf8(output.stdout).unwrap();
    assert!(words.contains("sequence 1: probability 0.354834\n    Up: true true true\n"), "{words}");
    assert!(words.contains("sequence 2: probability 0.347593\n    Up: true false false\n"), "{words}");
}

/// Several wrong values of one list are one mistake.
#[test]
fn a_list_of_another_domain_is_one_mistake() {
    let text = "program Words { variables { S : bool; W[1..=3] : bool; } decomposition { P(S) prod(i) { P(W[i] | S) } }
        forms { P(S) = bernoulli(0.5); P(W[i] | S) = bernoulli(if S { 0.9 } else { 0.2 }); } }";
    let output = run(&[("w.bp", text)], &["ask", "w.bp", "P(S | W = [1, 0, 1])"]);
    let words = stderr(&output);
    assert_eq!(words.matches("error:").count(), 1, "{words}");
    assert!(words.contains("`[1, 0, 1]` has values that are none of `W`"), "{words}");
    assert!(words.contains("write `W = [true, false, true]`"), "{words}");
}

/// Functions of unknowns behind a change-point are drawn from the exact posterior. The expected mean is that of the mixture that
/// `P(Early | N)` and `P(Late | N)` state in closed form.
#[test]
fn functions_of_a_mixture_of_posteriors_are_drawn_from_it() {
    let text = "program Change { parameters { n[1..=8] : real = [2, 1, 3, 2, 7, 6, 8, 5]; }
        variables { Early, Late : real; Tau : 1..=8; N[t in 1..=8] : real; }
        decomposition { P(Early) P(Late) P(Tau) prod(t in 1..=8) { P(N[t] | Early Late Tau) } }
        forms { P(Early) = gamma(2, 0.5); P(Late) = gamma(2, 0.5); P(Tau) = uniform;
                P(N[t] | Early Late Tau) = poisson(if t < Tau { Early } else { Late }); } }";
    let of = |question: &str| -> (Value, String) {
        let output = run(&[("c.bp", text)], &["ask", "c.bp", question, "--json"]);
        assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
        let answer: Value = serde_json::from_slice(&output.stdout).unwrap();
        (answer["answer"][0].clone(), answer["strategy"].to_string())
    };
    let mean = |question: &str| of(question).0["expectation"].as_f64().unwrap();
    let (row, _) = of("expectation P(Late - Early | N = n)");
    let exact = mean("expectation P(Late | N = n)") - mean("expectation P(Early | N = n)");
    let (found, error) = (row["expectation"].as_f64().unwrap(), row["error"].as_f64().unwrap());
    assert!((found - exact).abs() < 5.0 * error && error < 0.02, "{found} ± {error}, exactly {exact}");
}

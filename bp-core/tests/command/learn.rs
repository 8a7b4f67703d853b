//! The `bp learn` command.
//!
//! In: the built binary, programs and tables made here. Out: learned programs, reports, exit statuses. Invariant: a
//! file is written completely or not at all.

use serde_json::Value;
use std::path::PathBuf;
use std::process::{Command, Output, Stdio};
use std::time::Duration;

const PROGRAM: &str = "/// Which urn?
program Urns {
    variables {
        Urn  : { Left, Right };  // where it was drawn
        Ball : { Red, White };
        Size : real;
    }
    decomposition { P(Urn) P(Ball | Urn) P(Size | Ball) }
    forms {
        P(Urn) = unknown(histogram);
        P(Ball | Urn) = unknown;
        P(Size | Ball) = unknown(normal);
    }
    question urn { P(Urn | Ball = Red) }
}
";

struct Folder(tempfile::TempDir);

impl Folder {
    fn with(files: &[(&str, &str)]) -> Self {
        let folder = tempfile::tempdir().unwrap();
        files.iter().for_each(|(name, text)| std::fs::write(folder.path().join(name), text).unwrap());
        Self(folder)
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn bp(&self, arguments: &[&str]) -> Output {
        let mut command = Command::new(env!("CARGO_BIN_EXE_bp"));
        let output = command.current_dir(self.0.path()).args(arguments).output().unwrap();
        assert!(!stderr(&output).contains("panicked"), "{}", stderr(&output));
        output
    }
}

fn stderr(output: &Output) -> String {
    String::from_utf8(output.stderr.clone()).unwrap()
}

fn written(output: &Output) -> String {
    assert_eq!(output.status.code(), Some(0), "{}", stderr(output));
    String::from_utf8(output.stdout.clone()).unwrap()
}

const DATA: &str = "Ball,Urn,Size,Day\nRed,Left,1,Monday\nRed,Left,3,Monday\nWhite,Right,7,Tuesday\n\"White\",Left,9,?\n,Right,,Monday\n";

#[test]
fn a_learned_program_is_asked_as_any_other() {
    let folder = Folder::with(&[("urns.bp", PROGRAM), ("d.csv", DATA)]);
    let report = written(&folder.bp(&[
        "learn",
        "urns.bp",
        "--data",
        "d.csv",
        "--ignore",
        "Day",
        "--out",
        "learned.bp",
    ]));
    assert!(report.starts_with("5 cases; 2 cells missing; ln likelihood "), "{report}");
    assert!(
        report.contains("written to learned.bp") && report.lines().all(|line| line.chars().count() <= 80)
    );
    let learned = std::fs::read_to_string(folder.path("learned.bp")).unwrap();
    assert!(
        learned.starts_with("// Learned from d.csv: 5 cases, 2 cells missing.\n/// Which urn?\n"),
        "{learned}"
    );
    for line in [
        "Urn : { Left, Right };  // where it was drawn",
        "P(Urn) = categorical(0.6, 0.4);",
        "P(Ball | Urn) = table { Left: 0.6, 0.4; Right: 0.3333333333333333, 0.6666666666666666; };",
        "P(Size | Ball) = match Ball { Red => normal(2, 1), White => normal(8, 1) };",
    ] {
        assert!(learned.contains(line), "{line} in {learned}");
    }
    // Learning the learned program again, formatted or not: there is no `unknown` left.
    written(&folder.bp(&["fmt", "--check", "learned.bp"]));
    let answer: Value =
        serde_json::from_str(&written(&folder.bp(&["ask", "learned.bp", "urn", "--json"]))).unwrap();
    let left = answer["answer"][0]["p"].as_f64().unwrap();
    assert!((left - 0.36 / (0.36 + 0.4 / 3.0)).abs() < 1e-12, "{answer}");
    let again = folder.bp(&["learn", "learned.bp", "--data", "d.csv", "--ignore", "Day"]);
    assert_eq!(again.status.code(), Some(1));
    assert!(stderr(&again).contains("there is nothing to learn"), "{}", stderr(&again));
}

#[test]
fn without_a_file_the_learned_forms_are_printed() {
    let folder = Folder::with(&[("urns.bp", PROGRAM), ("d.csv", DATA)]);
    let printed = written(&folder.bp(&["learn", "urns.bp", "--data", "d.csv", "--ignore", "Day"]));
    // Laplace: (2 + 1) / (3 + 2) and (0 + 1) / (1 + 2); the mean and deviation of 1 and 3, and of 7 and 9.
    for line in [
        "P(Urn) = categorical(0.6, 0.4);",
        "P(Ball | Urn) = table { Left: 0.6, 0.4; Right: 0.3333333333333333, 0.6666666666666666; };",
        "P(Size | Ball) = match Ball { Red => normal(2, 1), White => normal(8, 1) };",
    ] {
        assert!(printed.contains(line), "{line} in {printed}");
    }
    let report =
        written(&folder.bp(&["learn", "urns.bp", "--data", "d.csv", "--ignore", "Day", "--out", "l.bp"]));
    assert!(!report.contains("categorical"), "{report}");
}

#[test]
fn a_report_is_json_too() {
    let folder =
        Folder::with(&[("urns.bp", PROGRAM), ("d.csv", "Ball,Size\nRed,1\nRed,2\nWhite,3\nWhite,4\n")]);
    let arguments = ["learn", "urns.bp", "--data", "d.csv", "--json", "--seed", "3", "--hidden", "Urn"];
    let report: Value = serde_json::from_str(&written(&folder.bp(&arguments))).unwrap();
    assert_eq!((&report["cases"], &report["hidden"][0]), (&Value::from(4), &Value::from("Urn")));
    assert_eq!(report["expectation"]["seed"], 3);
    assert_eq!(report["forms"][2]["form"], "P(Size | Ball)");
    assert_eq!(
        report,
        serde_json::from_str::<Value>(&written(&folder.bp(&arguments))).unwrap(),
        "a seed is a run"
    );
    // Without convergence the estimates are written, and the exit status is an error.
    let short = folder.bp(&[&arguments[..], &["--iterations", "1", "--out", "learned.bp"]].concat());
    assert_eq!(short.status.code(), Some(1));
    assert!(
        stderr(&short).contains("not converged after 1 step: raise `--iterations`"),
        "{}",
        stderr(&short)
    );
    let report: Value = serde_json::from_slice(&short.stdout).unwrap();
    assert_eq!(report["expectation"]["converged"], false);
    assert!(folder.path("learned.bp").exists());
}

#[test]
fn nearly_equal_values_are_held_at_the_largest_shape_and_their_likelihood_is_that_of_the_law_written() {
    // mpmath, 60 digits: Σ ln f(x) of five values at shape 10⁶.
    let cases = [
        ("gamma", 35.96394723335034),
        ("beta", 33.84570150330298),
        ("weibull", 70.09691672230453),
        ("von_mises", 29.944083103842008),
    ];
    for (law, expected) in cases {
        let text = format!(
            "program Near {{ variables {{ X : real; }} decomposition {{ P(X) }} forms {{ P(X) = unknown({law}); }} }}"
        );
        let data = "X\n0.3\n0.300000003\n0.300000006\n0.300000009\n0.300000012\n";
        let folder = Folder::with(&[("near.bp", &text), ("d.csv", data)]);
        let report = written(&folder.bp(&["learn", "near.bp", "--data", "d.csv", "--json"]));
        let report: Value = serde_json::from_str(&report).unwrap();
        let found = report["ln_likelihood"].as_f64().unwrap();
        assert!((found - expected).abs() < 1e-6, "{law}: {found}, expected {expected}");
        assert_eq!(report["forms"][0]["limited"], 1, "{law}");
        assert!(report.get("weight").is_none() && report.get("expectation").is_none(), "{report}");
    }
}

/// SIGINT during EM: the estimates so far are written.
#[cfg(unix)]
#[test]
fn interrupted_learning_writes_its_last_parameters() {
    let text = "program Many { variables { K : 0..=7; X : real; } decomposition { P(K) P(X | K) }
        forms { P(K) = unknown(histogram); P(X | K) = unknown(normal); } question k { P(K) } }";
    // Spread evenly: eight laws settle slowly.
    let rows = (0..20_000).map(|row| format!("{}\n", (f64::from(row) * 0.618).fract()));
    let data: String = std::iter::once("X\n".to_owned()).chain(rows).collect();
    let folder = Folder::with(&[("many.bp", text), ("d.csv", &data)]);
    let arguments = ["learn", "many.bp", "--data", "d.csv", "--hidden", "K", "--out", "l.bp"];
    // The signal may come before the handler is installed: then it is tried again, with a longer delay.
    for wait in [1000, 3000, 10_000] {
        let mut command = Command::new(env!("CARGO_BIN_EXE_bp"));
        let command = command.current_dir(folder.0.path()).args(arguments);
        let child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        std::thread::sleep(Duration::from_millis(wait));
        Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
        let output = child.wait_with_output().unwrap();
        if folder.path("l.bp").exists() {
            assert_eq!(output.status.code(), Some(1));
            let message = stderr(&output);
            assert!(
                message.contains("interrupted after ") && message.contains("written to l.bp"),
                "{message}"
            );
            written(&folder.bp(&["ask", "l.bp", "k"]));
            return;
        }
    }
    panic!("no signal found any step");
}

#[test]
fn folders_are_refused_and_a_column_may_separate_sequences() {
    let text = "program Coin { variables { F : bool; } decomposition { P(F) } forms { P(F) = unknown; } }";
    let over_time = "program Coins { variables { F, F^-1 : bool; } decomposition { P(F^-1) P(F | F^-1) }
        forms { P(F^-1) = previous(F) else uniform; P(F | F^-1) = unknown; } }";
    let data = [("coin.bp", text), ("coins.bp", over_time), ("d.csv", "Who,F\na,1\na,0\n")];
    let folder = Folder::with(&data);
    for to in ["new/", "."] {
        let learn = ["learn", "coin.bp", "--data", "d.csv", "--ignore", "Who", "--out", to];
        let message = stderr(&folder.bp(&learn));
        assert!(message.contains("it is a folder; write the name of a file in it"), "{message}");
    }
    assert!(!folder.path("new").exists());
    let message = stderr(&folder.bp(&["learn", "coins.bp", "--data", "d.csv"]));
    let expected = "`Coins` has no variable named `Who`; if it identifies sequences, add `--sequence Who`; otherwise \
                    ignore it: `--ignore Who`";
    assert!(message.contains(expected), "{message}");
}

#[test]
fn wrong_data_leave_no_file() {
    let folder = Folder::with(&[("urns.bp", PROGRAM), ("d.csv", "Ball,Urn,Size\nRed,Left,1\nBlue,Left,2\n")]);
    let wrong = folder.bp(&["learn", "urns.bp", "--data", "d.csv", "--out", "learned.bp"]);
    assert_eq!(wrong.status.code(), Some(1));
    let expected =
        "`d.csv`, row 3, column `Ball`: `Blue` is not a value of `Ball`, which is `{ Red, White }`";
    assert!(stderr(&wrong).contains(expected), "{}", stderr(&wrong));
    assert!(!folder.path("learned.bp").exists());
    let missing = folder.bp(&["learn", "urns.bp", "--data", "no.csv"]);
    assert!(stderr(&missing).contains("`no.csv`"), "{}", stderr(&missing));
    assert_eq!(folder.bp(&["learn", "urns.bp"]).status.code(), Some(2));
}

#[test]
fn columns_are_variables_or_there_is_a_word_for_them() {
    let text = "program Flu { variables { Flu, Fever : bool; } decomposition { P(Flu) P(Fever | Flu) }
        forms { P(Flu) = unknown; P(Fever | Flu) = unknown; } }";
    let table = "Flu,fever,id,n\n1,1,a,3\n0,0,b,5\n";
    let folder = Folder::with(&[("flu.bp", text), ("d.csv", table)]);
    let slip = folder.bp(&["learn", "flu.bp", "--data", "d.csv", "--ignore", "id", "--weight", "n"]);
    assert_eq!(slip.status.code(), Some(1));
    assert!(stderr(&slip).contains("did you mean `Fever`?"), "{}", stderr(&slip));
    let command = "learn flu.bp --data d.csv --ignore id --ignore fever --weight n --hidden Fever";
    let report = written(&folder.bp(&command.split(' ').collect::<Vec<_>>()));
    assert!(report.starts_with("2 cases; weight 8; "), "{report}");
    assert!(report.contains("hidden: Fever"), "{report}");
    std::fs::write(folder.path("d.csv"), "Flu,Fever,n\n1,1,1e100\n0,0,1e99\n").unwrap();
    let command = "learn flu.bp --data d.csv --weight n";
    let report = written(&folder.bp(&command.split(' ').collect::<Vec<_>>()));
    assert!(report.starts_with("2 cases; weight 1.1e100; "), "{report}");
}

#[test]
fn labels_in_quotes_and_sizes_of_data_are_learned_through_the_command() {
    let text = "program Ages over R in Rooms { variables { Age : { \"<20\", \"20+\" }; T : real; }
        decomposition { P(Age) P(T | Age) }
        forms { P(Age) = unknown(histogram); P(T | Age) = normal(warm[R, Age], spread); }
        identification { warm from diary by R; spread from diary; } question age { P(Age | T = 20) } }";
    let table = "R,Age,T\n0,<20,20\n0,<20,22\n0,20+,10\n1,20+,20\n1,20+,23\n1,<20,11\n";
    let folder = Folder::with(&[("ages.bp", text), ("d.csv", table)]);
    written(&folder.bp(&["learn", "ages.bp", "--data", "d.csv", "--out", "l.bp"]));
    let learned = std::fs::read_to_string(folder.path("l.bp")).unwrap();
    assert!(learned.contains("warm[Rooms, 0..=1] : real = [21, 10, 11, 21.5];"), "{learned}");
    let answer = folder.bp(&["ask", "l.bp", "age", "--set", "Rooms=2", "--json"]);
    let answer: Value = serde_json::from_str(&written(&answer)).unwrap();
    // Residuals ±1, 0, ±1.5, 0: s² = 6.5/6. In room 1, 20 is 1.5 from 21.5 and 9 from 11.
    let (near, far) = ((-0.5 * 1.5_f64.powi(2) * 6.0 / 6.5).exp(), (-0.5 * 81.0 * 6.0 / 6.5_f64).exp());
    let rows = answer["answer"].as_array().unwrap();
    let p = rows.iter().find(|row| row["values"]["R"] == "1" && row["values"]["Age"] == "20+");
    let p = p.unwrap_or_else(|| panic!("{answer}"))["p"].as_f64().unwrap();
    assert!((p - near / (near + far)).abs() < 1e-12, "{answer}");
    // Four numbers for two values of Age: two rooms.
    let again: Value = serde_json::from_str(&written(&folder.bp(&["ask", "l.bp", "age", "--json"]))).unwrap();
    assert_eq!(again, answer);
    let small = folder.bp(&["ask", "l.bp", "age", "--set", "Rooms=3"]);
    assert!(stderr(&small).contains("4 numbers were given, but 6 are expected"), "{}", stderr(&small));
}

const SOUNDS: &str = "program Sounds over C in Grid {
    parameters { mu[Grid, Channels], sigma : real; }
    variables { L[k in Channels] : real; }
    decomposition { prod(k in Channels) { P(L[k]) } }
    forms { P(L[k]) = normal(mu[C, k], sigma); }
    identification { mu from recordings by C; sigma from recordings; }
}
";

#[test]
fn columns_of_plates_and_sizes_are_checked() {
    let cases = [
        ("C,L[0]\n1e9,2\n0,3\n", "`mu` needs 1e9 cells (8.0 GB), but at most 1048576 are allowed"),
        (
            "L[0]\n2\n3\n",
            "there is no column `C`, the index over which `Sounds` is repeated: each row needs it",
        ),
        (
            "C,L\n0,2\n0,3\n",
            "column `L`: `L` is a family; its elements have columns of their own, such as `L[0]`; a table with a row for each element is given by `--rows`",
        ),
    ];
    for (data, expected) in cases {
        let folder = Folder::with(&[("sounds.bp", SOUNDS), ("d.csv", data)]);
        let output = folder.bp(&["learn", "sounds.bp", "--data", "d.csv"]);
        assert_eq!(output.status.code(), Some(1), "{data}");
        assert!(stderr(&output).contains(expected), "{data}: {}", stderr(&output));
    }
}

#[test]
fn a_likelihood_is_not_above_one_and_not_minus_zero() {
    let text = "program Row { variables { X : { a, b, c }; } decomposition { P(X) } forms { P(X) = unknown(histogram); } }";
    let folder = Folder::with(&[("row.bp", text), ("none.csv", "X\n"), ("d.csv", "X\na\n")]);
    let report = written(&folder.bp(&["learn", "row.bp", "--data", "d.csv", "--json"]));
    assert!(!report.contains("-0.0"), "{report}");
    let report: Value = serde_json::from_str(&report).unwrap();
    assert_eq!(report["ln_likelihood"], 0.0);
    // Nothing is learned of no cases.
    let output = folder.bp(&["learn", "row.bp", "--data", "none.csv"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(stderr(&output).contains("no rows"), "{}", stderr(&output));
}

#[test]
fn estimators_that_do_not_fit_get_the_reason() {
    let cases = [
        ("student_t, unbiased", "`unbiased` is an estimator of `normal` alone, found `student_t`"),
        ("mixture", "learn it by a hidden variable: `P(K) = unknown; P(X | K) = unknown(normal);`"),
        ("exponential", "`exponential` needs values that are not negative, and not all 0"),
    ];
    for (estimator, expected) in cases {
        let text = format!(
            "program Real {{ variables {{ X : real; }} decomposition {{ P(X) }} forms {{ P(X) = unknown({estimator}); }} }}"
        );
        let folder = Folder::with(&[("real.bp", &text), ("d.csv", "X\n0\n0\n")]);
        let output = folder.bp(&["learn", "real.bp", "--data", "d.csv"]);
        assert_eq!(output.status.code(), Some(1), "{estimator}");
        assert!(stderr(&output).contains(expected), "{estimator}: {}", stderr(&output));
    }
}

#[test]
fn a_family_over_time_is_learned_and_read_back() {
    let text = "program Z { variables { X[i in 1..=2] : bool; X[i in 1..=2]^-1 : bool; }
        decomposition { prod(i in 1..=2) { P(X[i]^-1) P(X[i] | X[i]^-1) } }
        forms { P(X[i]^-1) = previous(X) else bernoulli(0); P(X[i] | X[i]^-1) = unknown(histogram); } }";
    let data = "X[1],X[2]\ntrue,false\ntrue,true\nfalse,false\ntrue,false\n";
    let folder = Folder::with(&[("z.bp", text), ("z.csv", data)]);
    let output = folder.bp(&["learn", "z.bp", "--data", "z.csv", "--out", "l.bp"]);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    // Of both elements, from false: three times true and twice false; from true: once true and twice false.
    let learned = std::fs::read_to_string(folder.path("l.bp")).unwrap();
    for row in
        ["P(X[i] | X[i]^-1) = table {", "false: 0.4, 0.6;", "true: 0.6666666666666666, 0.3333333333333333;"]
    {
        assert!(learned.contains(row), "{learned}");
    }
    let output = folder.bp(&["check", "l.bp"]);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
}

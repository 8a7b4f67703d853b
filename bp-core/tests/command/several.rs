//! Several questions of a program: each is answered or refused by itself.
//!
//! In: the built binary, a program made here. Out: answers, errors and exit statuses. The expected number is that of the form.

use serde_json::Value;
use std::process::{Command, Output};

const TEXT: &str = "program Several {
    variables { A : bool; X, Y : real; }
    decomposition { P(A) P(X) P(Y | X) }
    forms { P(A) = bernoulli(0.25); P(X) = cauchy(0, 1); P(Y | X) = dirac(X * X); }
    question first { P(A = true) }
    question second { P(X | Y = 4) }
    question third { P(A) }
}";

fn asked(arguments: &[&str]) -> Output {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("s.bp"), TEXT).unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_bp"));
    command.current_dir(folder.path()).args(["ask", "s.bp"]).args(arguments).output().unwrap()
}

#[test]
fn a_refused_question_leaves_the_others_their_answers() {
    let output = asked(&[]);
    let (out, wrong) = (String::from_utf8(output.stdout).unwrap(), String::from_utf8(output.stderr).unwrap());
    assert_eq!(output.status.code(), Some(1), "{wrong}");
    assert!(out.contains("P(A = true)") && out.contains("0.250000") && out.contains("0.750000"), "{out}");
    assert!(wrong.contains("error: `P(X | Y = 4)`"), "{wrong}");
    let output = asked(&["--json"]);
    assert_eq!(output.status.code(), Some(1));
    let all: Value = serde_json::from_slice(&output.stdout).unwrap();
    let all = all.as_array().unwrap();
    assert_eq!(all.len(), 3, "{all:?}");
    assert_eq!(all[0]["answer"][0]["p"].as_f64(), Some(0.25));
    assert_eq!(all[2]["question"], "P(X | Y = 4)");
    assert!(all[2]["error"].as_str().unwrap().contains("P(X | Y = 4)"), "{all:?}");
    // Alone it is an error without output.
    let output = asked(&["second", "--json"]);
    assert_eq!((output.status.code(), output.stdout.len()), (Some(1), 0));
}

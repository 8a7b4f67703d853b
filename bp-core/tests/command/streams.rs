//! Stdin and stdout under the names of files, and files that are written.
//!
//! In: the built binary, `/dev/stdin`, `/dev/stdout`, files made here. Out: stdout, stderr, exit statuses, files.
//! Invariant: a file that is read is never damaged, and output for another program holds nothing else.

use std::path::Path;
use std::process::{Command, Output, Stdio};

const COIN: &str =
    "program Coin { variables { A : bool; } decomposition { P(A) } forms { P(A) = unknown(histogram); } }";

fn bp(folder: &Path, arguments: &[&str], stdin: Stdio) -> Output {
    Command::new(env!("CARGO_BIN_EXE_bp")).current_dir(folder).args(arguments).stdin(stdin).output().unwrap()
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).unwrap()
}

#[cfg(target_os = "linux")]
#[test]
fn a_file_given_as_stdin_is_not_written() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("coin.bp");
    std::fs::write(&path, COIN).unwrap();
    let file = std::fs::OpenOptions::new().read(true).write(true).open(&path).unwrap();
    let output = bp(folder.path(), &["fmt", "/dev/stdin"], file.into());
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    assert!(text(&output.stdout).starts_with("program Coin {\n"), "{}", text(&output.stdout));
    assert_eq!(std::fs::read_to_string(&path).unwrap(), COIN);
}

#[cfg(target_os = "linux")]
#[test]
fn a_learned_program_on_stdout_stands_alone() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("coin.bp"), COIN).unwrap();
    std::fs::write(folder.path().join("coin.csv"), "A\ntrue\nfalse\ntrue\ntrue\n").unwrap();
    for out in ["/dev/stdout", "-"] {
        let output =
            bp(folder.path(), &["learn", "coin.bp", "--data", "coin.csv", "--out", out], Stdio::null());
        let (page, report) = (text(&output.stdout), text(&output.stderr));
        assert!(page.contains("P(A) = bernoulli(0.75);") && page.trim_end().ends_with('}'), "{page}");
        assert!(report.contains("4 cases"), "{report}");
        assert!(!folder.path().join("-").exists());
    }
}

#[test]
fn what_convert_cannot_keep_is_said() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    let converts = |from: &str, to: &str| {
        let output = bp(folder.path(), &["convert", from, to], Stdio::null());
        (output.status.code(), text(&output.stderr))
    };
    // Potentials are observed, and a BIF file holds no observations.
    write("markov.uai", "MARKOV 2  2 2  2  1 0  2 0 1   2 3 1   4 2 1 0 5\n");
    let (code, message) = converts("markov.uai", "markov.bif");
    assert_eq!(code, Some(0), "{message}");
    assert!(message.contains("2 potentials must be observed in each question"), "{message}");
    // A program that `check` refuses is not written as one.
    write(
        "set.bp",
        "program D { parameters { k : real = 1; } variables { A : Things; B : bool; } decomposition { P(A) P(B | A) }
         forms { P(A) = uniform; P(B | A) = bernoulli(A / 10); } }",
    );
    let (code, message) = converts("set.bp", "copy.bp");
    assert!(code == Some(1) && !folder.path().join("copy.bp").exists(), "{message}");
    write(
        "family.bp",
        "program F { variables { H : bool; Z[1..=3] : 0..=2; } decomposition { P(H) prod(i) { P(Z[i] | H) } }
         forms { P(H) = bernoulli(0.5); P(Z[i] | H) = uniform; } }",
    );
    let (code, message) = converts("family.bp", "family.bif");
    assert!(code == Some(1) && message.contains("`Z` is a family"), "{message}");
    // 10¹⁴ rows of 127 numbers.
    let names: Vec<String> = (1..=14).map(|number| format!("X{number}")).collect();
    let each = |text: &str| names.iter().map(|name| text.replace('#', name)).collect::<String>();
    write(
        "wide.bp",
        &format!(
            "program W {{ variables {{ {} : 0..=9; S : 0..=126; }} decomposition {{ {} P(S | {}) }}
             forms {{ {} P(S | {}) = dirac({}); }} }}",
            names.join(", "),
            each("P(#) "),
            names.join(" "),
            each("P(#) = uniform; "),
            names.join(" "),
            names.join(" + ")
        ),
    );
    let (code, message) = converts("wide.bp", "wide.bif");
    assert!(code == Some(1) && message.contains("1.3e16 cells"), "{message}");
    assert!(message.contains("of memory are free") && message.contains("fewer parents"), "{message}");
}

#[test]
fn a_column_that_names_no_variable_is_named_with_its_file() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("coin.bp"), COIN.replace("unknown(histogram)", "bernoulli(0.5)"))
        .unwrap();
    std::fs::write(folder.path().join("cases.csv"), "a\ntrue\n").unwrap();
    let output = bp(folder.path(), &["batch", "coin.bp", "--cases", "cases.csv"], Stdio::null());
    let message = text(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{message}");
    assert!(message.contains("`cases.csv`: column `a` names no variable; did you mean `A`?"), "{message}");
}

#[test]
fn cases_without_observations_and_values_that_are_given_twice() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    write("m.uai", "BAYES\n2\n2 2\n2\n1 0\n2 0 1\n\n2\n 0.4 0.6\n\n4\n 0.2 0.8\n 0.7 0.3\n");
    // The two ways in which evidence files have a case without observations.
    for evidence in ["0\n", "1 0\n"] {
        write("m.evid", evidence);
        let output = bp(folder.path(), &["batch", "m.uai", "--cases", "m.evid"], Stdio::null());
        // P(1 = 0) = 0.4 · 0.2 + 0.6 · 0.7.
        assert_eq!(text(&output.stdout), "ln_p_evidence,0=0,0=1,1=0,1=1,error\n0,0.4,0.6,0.5,0.5,\n");
    }
    write(
        "two.bp",
        "program Two { variables { A, B : bool; } decomposition { P(A) P(B | A) }
        forms { P(A) = uniform; P(B | A) = bernoulli(if A { 0.8 } else { 0.3 }); } }",
    );
    write("two.csv", "B\ntrue\n\n");
    let asked = ["ask", "two.bp", "P(A | B)", "--data", "two.csv", "--set", "B=true"];
    let output = bp(folder.path(), &asked, Stdio::null());
    assert_eq!(output.status.code(), Some(1));
    assert!(text(&output.stderr).contains("`--set` gives `B` a value, and so does the column `B`"));
}

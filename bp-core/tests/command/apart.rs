//! Forms learned apart for each value of an index, `unknown by n`, and what is pooled without it.
//!
//! In: the built binary, programs and tables made here. Out: learned programs and their answers. The expected numbers are those
//! of Laplace's law and of sample means, by hand.

use serde_json::Value;
use std::process::{Command, Output};

const MAILS: &str = "Spam,W[1],W[2],W[3]\ntrue,true,false,false\ntrue,true,false,true\nfalse,false,true,false\nfalse,false,false,false\nfalse,false,true,true\n";

fn program(form: &str) -> String {
    format!(
        "program Mails {{ parameters {{ N : size; }} variables {{ Spam : bool; W[1..=N] : bool; }}
             decomposition {{ P(Spam) prod(n in 1..=N) {{ P(W[n] | Spam) }} }}
             forms {{ P(Spam) = unknown; P(W[n] | Spam) = {form}; }}
             question spam {{ P(Spam | W) }} }}"
    )
}

struct Folder(tempfile::TempDir);

impl Folder {
    fn with(files: &[(&str, &str)]) -> Self {
        let folder = tempfile::tempdir().unwrap();
        files.iter().for_each(|(name, text)| std::fs::write(folder.path().join(name), text).unwrap());
        Self(folder)
    }

    fn bp(&self, arguments: &[&str]) -> Output {
        let mut command = Command::new(env!("CARGO_BIN_EXE_bp"));
        command.current_dir(self.0.path()).args(arguments).output().unwrap()
    }

    fn well(&self, arguments: &[&str]) -> String {
        let output = self.bp(arguments);
        assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
        String::from_utf8(output.stdout).unwrap()
    }

    /// The probabilities of an answer.
    fn probabilities(&self, arguments: &[&str]) -> Vec<f64> {
        let answer: Value = serde_json::from_str(&self.well(&[arguments, &["--json"]].concat())).unwrap();
        let rows = answer["answer"].as_array().unwrap();
        rows.iter().map(|row| row["p"].as_f64().unwrap()).collect()
    }
}

#[track_caller]
fn close(found: f64, expected: f64) {
    assert!((found - expected).abs() < 1e-12, "{found}, expected {expected}");
}

/// Laplace: of the two mails that are spam, W[1] is in 2, W[2] in 0, W[3] in 1; of the three others in 0, 2 and 1.
#[test]
fn each_word_has_its_own_probabilities() {
    let folder = Folder::with(&[("m.bp", &program("unknown by n")), ("d.csv", MAILS)]);
    let report = folder.well(&["learn", "m.bp", "--data", "d.csv", "--out", "l.bp"]);
    assert!(!report.contains("pooled"), "{report}");
    let text = std::fs::read_to_string(folder.0.path().join("l.bp")).unwrap();
    assert!(
        text.contains("N : size = 3;") && text.contains("bernoulli(probability_of_W[n, Spam])"),
        "{text}"
    );
    for (element, spam, other) in [(1, 3.0 / 4.0, 1.0 / 5.0), (2, 1.0 / 4.0, 3.0 / 5.0), (3, 0.5, 2.0 / 5.0)]
    {
        for (value, expected) in [("true", spam), ("false", other)] {
            let question = format!("P(W[{element}] | Spam = {value})");
            close(folder.probabilities(&["ask", "l.bp", &question])[1], expected);
        }
    }
    let (spam, other) = (3.0 / 7.0 * 0.75 * 0.75 * 0.5, 4.0 / 7.0 * 0.2 * 0.4 * 0.4);
    let asked = folder.probabilities(&["ask", "l.bp", "spam", "--set", "W=1,0,1"]);
    close(asked[1], spam / (spam + other));
    // The size is that of the table with which it was learned.
    close(folder.probabilities(&["ask", "l.bp", "P(Spam)"])[1], 3.0 / 7.0);
}

/// All fifteen cells together: of six in spam three are true, of nine in other mails three.
#[test]
fn without_by_all_words_are_pooled_and_the_report_says_so() {
    let folder = Folder::with(&[("m.bp", &program("unknown")), ("d.csv", MAILS)]);
    let report = folder.well(&["learn", "m.bp", "--data", "d.csv", "--out", "l.bp"]);
    let words: Vec<&str> = report.split_whitespace().collect();
    let words = words.join(" ");
    assert!(
        words.contains(
            "one form for all 3 values of `n`: their cases are pooled; `unknown by n` learns one for each"
        ),
        "{report}"
    );
    close(folder.probabilities(&["ask", "l.bp", "P(W[2] | Spam = true)"])[1], 4.0 / 8.0);
    close(folder.probabilities(&["ask", "l.bp", "P(W[2] | Spam = false)"])[1], 4.0 / 11.0);
}

/// 1, 2, 3 and 4: mean 2.5, variance 5 / 4.
#[test]
fn components_of_a_vector_are_pooled_and_the_report_says_so() {
    let text = "program Pair { variables { X : real[2]; } decomposition { P(X) } forms { P(X) = unknown(normal); } }";
    let folder = Folder::with(&[("p.bp", text), ("d.csv", "X[0],X[1]\n1,3\n2,4\n")]);
    let report = folder.well(&["learn", "p.bp", "--data", "d.csv"]);
    let words: Vec<&str> = report.split_whitespace().collect();
    assert!(words.join(" ").contains("one form for all 2 components: their values are pooled"), "{report}");
    assert!(report.contains("normal(2.5, 1.118033988749895)"), "{report}");
}

/// A set in place of a range, values that are no truth values, and a distribution of reals: sample means and deviations.
#[test]
fn sets_labels_and_reals_have_a_form_for_each_element() {
    let text = "program Rooms { variables { K[r in Rooms] : { Low, Mid, High }; X[r in Rooms] : real; }
        decomposition { prod(r in Rooms) { P(K[r]) P(X[r]) } }
        forms { P(K[r]) = unknown(histogram) by r; P(X[r]) = unknown(normal) by r; } }";
    let data = "K[0],K[1],X[0],X[1]\nLow,High,1,10\nMid,High,3,30\nLow,High,5,20\nLow,Mid,3,40\n";
    let folder = Folder::with(&[("r.bp", text), ("d.csv", data)]);
    folder.well(&["learn", "r.bp", "--data", "d.csv", "--out", "l.bp"]);
    let kinds = folder.probabilities(&["ask", "l.bp", "P(K[0])", "--set", "Rooms=2"]);
    [0.75, 0.25, 0.0].iter().zip(kinds).for_each(|(expected, found)| close(found, *expected));
    let kinds = folder.probabilities(&["ask", "l.bp", "P(K[1])", "--set", "Rooms=2"]);
    [0.0, 0.25, 0.75].iter().zip(kinds).for_each(|(expected, found)| close(found, *expected));
    // 1, 3, 5, 3: mean 3, variance 2; 10, 30, 20, 40: mean 25, variance 125.
    let of = |question: &str| -> f64 {
        let answer: Value =
            serde_json::from_str(&folder.well(&["ask", "l.bp", question, "--json", "--set", "Rooms=2"]))
                .unwrap();
        let row = &answer["answer"][0];
        row["expectation"].as_f64().or(row["variance"].as_f64()).unwrap()
    };
    close(of("expectation P(X[0])"), 3.0);
    close(of("variance P(X[0])"), 2.0);
    close(of("expectation P(X[1])"), 25.0);
    assert!((of("variance P(X[1])") - 125.0).abs() < 1e-9);
}

/// The arms of a `match` stand in the report as in the program.
#[test]
fn what_is_learned_is_shown_where_it_stands() {
    let text = "program Two { variables { W[1..=2] : bool; } decomposition { prod(n in 1..=2) { P(W[n]) } }
        forms { P(W[n]) = match n { 1 => unknown, _ => unknown(histogram) }; } }";
    let folder = Folder::with(&[("t.bp", text), ("d.csv", "W[1],W[2]\ntrue,false\ntrue,true\n")]);
    let report = folder.well(&["learn", "t.bp", "--data", "d.csv"]);
    assert_eq!(report.matches("P(W[n]) =").count(), 1, "{report}");
    assert!(
        report.contains("match n {") && report.contains("1 => ") && report.contains("bernoulli(0.75)"),
        "{report}"
    );
}

#[test]
fn by_takes_an_index_of_the_factor() {
    let folder =
        Folder::with(&[("m.bp", &program("unknown by m")), ("b.bp", &program("bernoulli(0.5) by n"))]);
    let wrong = |file: &str| String::from_utf8(folder.bp(&["check", file]).stderr).unwrap();
    let message = wrong("m.bp");
    assert!(message.contains("`by` takes an index, and `m` is none of `P(W[n] | Spam)`"), "{message}");
    assert!(message.contains("an index here is `n`"), "{message}");
    let message = wrong("b.bp");
    assert!(message.contains("`by` belongs to `unknown`, and `bernoulli` is not learned"), "{message}");
}

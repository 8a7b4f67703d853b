//! `bp explain` and `bp ask` agree on what can be asked; the filter after each row.
//!
//! In: programs and data. Out: derivations, answers. Invariant: expected numbers are worked out by hand.

use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::Command;

fn bp(arguments: &[&str]) -> Result<String, String> {
    let root = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/.."));
    let output = Command::new(env!("CARGO_BIN_EXE_bp")).args(arguments).current_dir(root).output().unwrap();
    match output.status.success() {
        true => Ok(String::from_utf8(output.stdout).unwrap()),
        false => Err(String::from_utf8(output.stderr).unwrap()),
    }
}

fn file(folder: &tempfile::TempDir, name: &str, text: &str) -> PathBuf {
    let path = folder.path().join(name);
    std::fs::write(&path, text).unwrap();
    path
}

const WORDS: &str = "program Words {
    parameters { N : size; given_spam[1..=N] : probability; given_ham[1..=N] : probability; }
    variables { Spam : bool; W[1..=N] : bool; }
    decomposition { P(Spam) prod(i) { P(W[i] | Spam) } }
    forms {
        P(Spam) = bernoulli(0.5);
        P(W[i] | Spam) = bernoulli(if Spam { given_spam[i] } else { given_ham[i] });
    }
    question all { P(Spam | W) }
    question second { P(W[2] | W[1] = true) }
}";

#[test]
fn a_family_is_explained_with_the_size_with_which_it_is_asked() {
    let folder = tempfile::tempdir().unwrap();
    let path = file(&folder, "words.bp", WORDS);
    let path = path.to_str().unwrap();
    let refused = bp(&["explain", path, "second"]).unwrap_err();
    assert!(refused.contains("its length (1..=N) is not known"), "{refused}");
    let second = bp(&["explain", path, "second", "--set", "N=60"]).unwrap();
    assert!(second.contains("Σ_Spam P(Spam) P(W[1] = true | Spam) P(W[2] | Spam)"), "{second}");
    assert!(!second.contains("P(W[1] | W[1])"), "{second}");
    let words: Vec<&str> = (0..60).map(|at| if at % 2 == 0 { "true" } else { "false" }).collect();
    let (spam, ham) = (vec!["0.6"; 60].join(","), vec!["0.4"; 60].join(","));
    let settings = [
        "N=60".to_owned(),
        format!("W=[{}]", words.join(",")),
        format!("given_spam={spam}"),
        format!("given_ham={ham}"),
    ];
    let mut arguments = vec!["ask", path, "all", "--json"];
    settings.iter().for_each(|setting| arguments.extend(["--set", setting]));
    // As many words speak for spam as against it.
    let answer: Value = serde_json::from_str(&bp(&arguments).unwrap()).unwrap();
    assert!((answer["answer"][0]["p"].as_f64().unwrap() - 0.5).abs() < 1e-12, "{answer}");
    arguments[0] = "explain";
    arguments.remove(3);
    let explained = bp(&arguments).unwrap();
    assert!(explained.contains("P(Spam) Π_i P(W[i] = w[i] | Spam)"), "{explained}");
    let unknown = bp(&["explain", path, "all", "--set", "M=60"]).unwrap_err();
    assert!(unknown.contains("`M`"), "{unknown}");
}

#[test]
fn forms_name_the_labels_that_they_compare() {
    let folder = tempfile::tempdir().unwrap();
    let path = file(
        &folder,
        "town.bp",
        "program Town {
            variables { Season : { Dry, Wet }; Town : { Paris, Nice }; Rain : bool; }
            decomposition { P(Season) P(Town) P(Rain | Season Town) }
            forms {
                P(Season) = categorical(0.3, 0.7); P(Town) = uniform;
                P(Rain | Season Town) = bernoulli(if Season == Wet and Town == Paris { 0.6 } else { 0.1 });
            }
            question rain { P(Rain | Town = Paris) }
        }",
    );
    let explained = bp(&["explain", path.to_str().unwrap(), "rain", "--forms"]).unwrap();
    let words = explained.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(words.contains("if Season = Wet and Town = Paris { 0.6 } else { 0.1 }"), "{explained}");
    assert!(!words.contains("Season = 1") && !words.contains("Paris = 0"), "{explained}");
}

#[test]
fn the_filter_is_answered_after_each_row() {
    let ask = |question: &str| {
        let (program, data) = ("examples/course/06_door.bp", "examples/course/06_two.csv");
        bp(&["ask", program, question, "--data", data, "--each", "--json"])
    };
    let answer: Value = serde_json::from_str(&ask("now").unwrap()).unwrap();
    let rows = answer["answer"].as_array().unwrap_or_else(|| panic!("{answer}"));
    // 0.45 · 0.7 / (0.45 · 0.7 + 0.55 · 0.1), and one step more: lesson 6.
    let first = 0.315 / 0.37;
    let next: f64 = 0.1 + 0.7 * first;
    let second = next * 0.3 / (next * 0.3 + (1.0 - next) * 0.9);
    let found: Vec<f64> = rows.iter().map(|row| row["p"].as_f64().unwrap()).collect();
    for (found, expected) in found.iter().zip([1.0 - first, first, 1.0 - second, second]) {
        assert!((found - expected).abs() < 1e-12, "{found}, not {expected}");
    }
    assert_eq!((found.len(), &rows[2]["values"]["t"]), (4, &Value::from("2")), "{answer}");
    let refused = ask("soon").unwrap_err();
    assert!(refused.contains("only `filter` is answered after each row"), "{refused}");
}

#[test]
fn particles_filter_after_each_row_without_later_ones() {
    let folder = tempfile::tempdir().unwrap();
    let path = file(
        &folder,
        "walk.bp",
        "program Walk { variables { X, X^-1, Z : real; } decomposition { P(X^-1) P(X | X^-1) P(Z | X) }
         forms { P(X^-1) = previous(X) else normal(0, 1); P(X | X^-1) = normal(X^-1, 1); P(Z | X) = normal(X, 1); }
         question x { filter P(X | Z) } }",
    );
    let data = file(&folder, "z.csv", "Z\n3\n-3\n");
    let ask = |by: &str| -> Vec<f64> {
        let (path, data) = (path.to_str().unwrap(), data.to_str().unwrap());
        let text = bp(&["ask", path, "x", "--data", data, "--each", "--by", by, "--json"]).unwrap();
        let answer: Value = serde_json::from_str(&text).unwrap();
        let mean = |row: &Value| match &row["mean"] {
            Value::Array(own) => own[0].as_f64().unwrap(),
            own => own.as_f64().unwrap(),
        };
        answer["answer"].as_array().unwrap().iter().map(mean).collect()
    };
    // The variance before the first row is 2: the gain is 2/3, the mean 2, the variance 2/3. Then 5/3, 5/8: 2 − 5 · 5/8.
    let exact = ask("gaussian");
    assert!((exact[0] - 2.0).abs() < 1e-12 && (exact[1] + 9.0 / 8.0).abs() < 1e-12, "{exact:?}");
    let drawn = ask("particles");
    assert!((drawn[0] - 2.0).abs() < 0.05 && (drawn[1] + 9.0 / 8.0).abs() < 0.05, "{drawn:?}");
}

#[test]
fn a_derivation_has_no_factors_that_other_questions_derive() {
    let folder = tempfile::tempdir().unwrap();
    let path = file(
        &folder,
        "kalman.bp",
        "program Kalman {
            variables { X, X^-1, Z : real; }
            decomposition { P(X^-1) P(X | X^-1) P(Z | X) }
            forms {
                P(X^-1) = previous(X) else normal(0, 1);
                P(X | X^-1) = normal(X^-1, 1);
                P(Z | X) = normal(X, 1);
            }
            question here { filter P(X | Z) }
            question over { filter P(X > 3 | Z) }
        }",
    );
    let all = bp(&["explain", path.to_str().unwrap()]).unwrap();
    let here = bp(&["explain", path.to_str().unwrap(), "here"]).unwrap();
    assert!(here.contains("covariance of `P(X | X^-1)`"), "{here}");
    assert!(all.starts_with(&here) && all.len() > here.len(), "{all}");
}

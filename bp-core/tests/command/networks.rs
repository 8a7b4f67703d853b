//! The network commands.
//!
//! In: the built binary, a network and cases made here. Out: answers, exit statuses, messages. Invariant: expected
//! numbers are those of Lauritzen and Spiegelhalter (1988) for the chest clinic, or computed by hand.

use serde_json::Value;
use std::process::{Command, Output};

/// "Asia", from the tables of the paper.
const CLINIC: &str = "network clinic { }
variable asia { type discrete [ 2 ] { yes, no }; }
variable tub { type discrete [ 2 ] { yes, no }; }
variable smoke { type discrete [ 2 ] { yes, no }; }
variable lung { type discrete [ 2 ] { yes, no }; }
variable bronc { type discrete [ 2 ] { yes, no }; }
variable either { type discrete [ 2 ] { yes, no }; }
variable xray { type discrete [ 2 ] { yes, no }; }
variable dysp { type discrete [ 2 ] { yes, no }; }
probability ( asia ) { table 0.01, 0.99; }
probability ( tub | asia ) { (yes) 0.05, 0.95; (no) 0.01, 0.99; }
probability ( smoke ) { table 0.5, 0.5; }
probability ( lung | smoke ) { (yes) 0.1, 0.9; (no) 0.01, 0.99; }
probability ( bronc | smoke ) { (yes) 0.6, 0.4; (no) 0.3, 0.7; }
probability ( either | lung, tub ) {
  (yes, yes) 1.0, 0.0; (no, yes) 1.0, 0.0; (yes, no) 1.0, 0.0; (no, no) 0.0, 1.0;
}
probability ( xray | either ) { (yes) 0.98, 0.02; (no) 0.05, 0.95; }
probability ( dysp | bronc, either ) {
  (yes, yes) 0.9, 0.1; (no, yes) 0.7, 0.3; (yes, no) 0.8, 0.2; (no, no) 0.1, 0.9;
}
";

struct Folder(tempfile::TempDir);

impl Folder {
    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("clinic.bif"), CLINIC).unwrap();
        Self(folder)
    }

    fn bp(&self, arguments: &[&str]) -> Output {
        let mut command = Command::new(env!("CARGO_BIN_EXE_bp"));
        let output = command.current_dir(self.0.path()).args(arguments).output().unwrap();
        assert!(!stderr(&output).contains("panicked"), "{}", stderr(&output));
        output
    }

    fn json(&self, arguments: &[&str]) -> Value {
        let output = self.bp(&[arguments, &["--json"]].concat());
        assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
        serde_json::from_slice(&output.stdout).unwrap()
    }
}

fn stderr(output: &Output) -> String {
    String::from_utf8(output.stderr.clone()).unwrap()
}

fn near(found: &Value, expected: f64, to: f64) {
    let found = found.as_f64().unwrap();
    assert!((found - expected).abs() <= to, "{found}, expected {expected}");
}

#[test]
fn posteriors_are_those_of_the_chest_clinic() {
    let folder = Folder::new();
    let prior = folder.json(&["marginals", "clinic.bif"]);
    near(&prior["ln_p_evidence"], 0.0, 1e-15);
    // By hand: P(tub) = 0.01 · 0.05 + 0.99 · 0.01, P(lung) = (0.1 + 0.01) / 2, and so on.
    let either: f64 = 0.055 + 0.0104 - 0.055 * 0.0104;
    let hand = [
        ("tub", 0.0104),
        ("lung", 0.055),
        ("bronc", 0.45),
        ("either", either),
        ("xray", either * 0.93 + 0.05),
    ];
    for (name, p) in hand {
        near(&prior["posteriors"][name]["yes"], p, 1e-15);
    }
    // A visitor of Asia who is short of breath: the paper prints 0.088, 0.100, 0.811, 0.182 and 0.626.
    let seen = folder.json(&["marginals", "clinic.bif", "--evidence", r#"{"asia": "yes", "dysp": "yes"}"#]);
    let printed = [("tub", 0.088), ("lung", 0.100), ("bronc", 0.811), ("either", 0.182), ("smoke", 0.626)];
    for (name, p) in printed {
        near(&seen["posteriors"][name]["yes"], p, 6e-4);
    }
    near(&seen["posteriors"]["asia"]["yes"], 1.0, 0.0);
    // A likelihood of 3 to 1 for lung, on the prior.
    let weighed = folder.json(&["marginals", "clinic.bif", "--likelihood", r#"{"lung": [0.75, 0.25]}"#]);
    near(&weighed["posteriors"]["lung"]["yes"], 0.055 * 3.0 / (0.055 * 3.0 + 0.945), 1e-14);
    let only = folder.json(&["marginals", "clinic.bif", "--only", "lung"]);
    assert_eq!(only["posteriors"].as_object().unwrap().len(), 1);
}

#[test]
fn joint_posteriors_and_informative_observations() {
    let folder = Folder::new();
    let both = folder.json(&["joint", "clinic.bif", "--of", "smoke,lung"]);
    let cells: Vec<f64> =
        both["joint"].as_array().unwrap().iter().map(|row| row["p"].as_f64().unwrap()).collect();
    for (p, expected) in cells.iter().zip([0.05, 0.45, 0.005, 0.495]) {
        assert!((p - expected).abs() < 1e-15, "{cells:?}");
    }
    assert_eq!(both["joint"][1]["values"]["lung"], "no");
    let bits = |list: &[f64]| -list.iter().map(|p| p * p.log2()).sum::<f64>();
    let information = bits(&[0.055, 0.945]) + 1.0 - bits(&cells);
    near(&both["information_bits"], information, 1e-12);
    let next = folder.json(&["observe", "clinic.bif", "--about", "lung"]);
    near(&next["entropy_bits"], bits(&[0.055, 0.945]), 1e-12);
    let list = next["observations"].as_array().unwrap();
    assert_eq!(list[0]["variable"], "either", "the nearest informs most");
    let smoke = list.iter().find(|one| one["variable"] == "smoke").unwrap();
    near(&smoke["information_bits"], information, 1e-12);
    let asia = list.iter().find(|one| one["variable"] == "asia").unwrap();
    near(&asia["information_bits"], 0.0, 0.0);
    let text = String::from_utf8(folder.bp(&["observe", "clinic.bif", "--about", "lung"]).stdout).unwrap();
    assert!(text.lines().all(|line| line.chars().count() <= 80), "{text}");
}

#[test]
fn the_most_probable_cases_and_cost() {
    let folder = Folder::new();
    let best = folder.json(&["mpe", "clinic.bif", "--evidence", r#"{"smoke": "yes"}"#]);
    // By hand: a smoker with bronchitis and short of breath, nothing else.
    let p: f64 = 0.5 * 0.99 * 0.99 * 0.9 * 0.6 * 1.0 * 0.95 * 0.8;
    near(&best["ln_p"], p.ln(), 1e-12);
    assert_eq!(best["assignment"]["bronc"], "yes");
    std::fs::write(folder.0.path().join("cases.csv"), "smoke,either,xray\nyes,,\n,yes,no\n,no,\n").unwrap();
    let output = folder.bp(&["batch", "clinic.bif", "--cases", "cases.csv", "--only", "lung"]);
    let text = String::from_utf8(output.stdout.clone()).unwrap();
    let mut table = csv::Reader::from_reader(text.as_bytes());
    let place = table.headers().unwrap().iter().position(|head| head == "lung=yes").unwrap();
    let found: Vec<f64> = table.records().map(|row| row.unwrap()[place].parse().unwrap()).collect();
    let either: f64 = 0.055 + 0.0104 - 0.055 * 0.0104;
    for (found, expected) in found.iter().zip([0.1, 0.055 / either, 0.0]) {
        assert!((found - expected).abs() < 1e-14, "{text}");
    }
    let cost = folder.json(&["cost", "clinic.bif"]);
    assert_eq!((cost["variables"].as_u64(), cost["trees"].as_u64()), (Some(8), Some(1)));
    assert!(cost["cells"].as_f64() > Some(16.0) && cost["width"].as_u64() <= Some(4), "{cost}");
}

#[test]
fn impossible_requests_are_refused() {
    let folder = Folder::new();
    let wrong: [(&[&str], &str); 10] = [
        (
            &[
                "marginals",
                "clinic.bif",
                "--evidence",
                r#"{"lung": "yes"}"#,
                "--likelihood",
                r#"{"lung": [1, 0]}"#,
            ],
            "`lung` is known twice",
        ),
        (
            &[
                "cost",
                "clinic.bif",
                "--evidence",
                r#"{"lung": "yes"}"#,
                "--likelihood",
                r#"{"lung": [1, 0]}"#,
            ],
            "`lung` is known twice",
        ),
        (&["marginals", "clinic.bif", "--evidence", r#"{"smok": "yes"}"#], "did you mean `smoke`?"),
        (
            &["marginals", "clinic.bif", "--evidence", r#"{"smoke": "maybe"}"#],
            "`maybe` is not a value of `smoke`, which is `{ yes, no }`",
        ),
        (&["marginals", "clinic.bif", "--evidence", "smoke"], "smoke"),
        (&["marginals", "clinic.bif", "--likelihood", r#"{"smoke": [1]}"#], "must have 2 numbers, but has 1"),
        // Neither cancer nor tuberculosis, but the disjunction of both is true.
        (
            &["marginals", "clinic.bif", "--evidence", r#"{"lung": "no", "tub": "no", "either": "yes"}"#],
            "`tub`, `lung` and `either` cannot",
        ),
        (&["joint", "clinic.bif", "--of", "lung,lung"], "`lung` is named twice"),
        (
            &["observe", "clinic.bif", "--about", "lung", "--evidence", r#"{"lung": "no"}"#],
            "`lung` is observed",
        ),
        (&["cost", "absent.bif"], "absent.bif"),
    ];
    for (arguments, expected) in wrong {
        let output = folder.bp(arguments);
        assert_eq!(output.status.code(), Some(1), "{arguments:?}: {}", stderr(&output));
        assert!(stderr(&output).contains(expected), "{arguments:?}: {}", stderr(&output));
        assert!(output.stdout.is_empty(), "{arguments:?}");
    }
}

/// A family, a noisy or, parameters: parts that no network file can express.
#[test]
fn a_program_of_families_is_a_network() {
    let folder = Folder::new();
    let program = "program Alarm {
    parameters { q : real = 0.2; }
    variables { Sensor[1..=3] : bool; Alarm : bool; }
    decomposition { prod(i) { P(Sensor[i]) } P(Alarm | Sensor[1] Sensor[2] Sensor[3]) }
    forms {
        P(Sensor[i]) = bernoulli(q);
        P(Alarm | Sensor[1] Sensor[2] Sensor[3]) =
            bernoulli(if Sensor[1] or Sensor[2] or Sensor[3] { 0.9 } else { 0.1 });
    }
    question alarm { P(Alarm) }
}
";
    std::fs::write(folder.0.path().join("alarm.bp"), program).unwrap();
    let found = folder.json(&["marginals", "alarm.bp", "--evidence", r#"{"Alarm": "true"}"#]);
    let alarm: f64 = 0.9 - 0.8 * 0.8f64.powi(3);
    near(&found["ln_p_evidence"], alarm.ln(), 1e-14);
    near(&found["posteriors"]["Sensor[2]"]["true"], 0.2 * 0.9 / alarm, 1e-14);
}

/// Potentials 3, 1 and 1, 2, 3, 4: Z = 3 · (1 + 2) + 1 · (3 + 4) = 16.
#[test]
fn a_markov_network_has_its_ln_z() {
    let folder = Folder::new();
    let text = "MARKOV\n2\n2 2\n2\n1 0\n2 0 1\n\n2 3 1\n4 1 2 3 4\n";
    std::fs::write(folder.0.path().join("two.uai"), text).unwrap();
    let found = folder.json(&["marginals", "two.uai"]);
    near(&found["ln_p_evidence"], 16f64.ln(), 1e-14);
    near(&found["posteriors"]["0"]["0"], 9.0 / 16.0, 1e-14);
    assert_eq!(found["posteriors"].as_object().unwrap().len(), 2);
    let best = folder.json(&["mpe", "two.uai"]);
    near(&best["ln_p"], 6f64.ln(), 1e-14);
    assert_eq!(best["assignment"].as_object().unwrap().len(), 2);
    let asked = folder.json(&["ask", "two.uai", "P(\"0\" | \"1\" = 1)"]);
    assert!(asked.to_string().contains("0.6"), "3 · 2 of 3 · 2 + 1 · 4: {asked}");
    let explained = folder.bp(&["explain", "clinic.bif", "P(lung | dysp = yes)"]);
    assert!(String::from_utf8(explained.stdout).unwrap().contains("multiplications"));
}

const TWO: &str = "program Two {
    variables { A, B : bool; }
    decomposition { P(A) P(B | A) }
    forms { P(A) = bernoulli(0.5); P(B | A) = bernoulli(if A { 0.9 } else { 0.2 }); }
}
";

/// ln P of the most probable case is ln(0.5 · 0.9), whoever finds the case; P(B) = 0.5 · 0.9 + 0.5 · 0.2.
#[test]
fn estimates_of_groups_report_what_they_know() {
    let folder = Folder::new();
    std::fs::write(folder.0.path().join("two.bp"), TWO).unwrap();
    std::fs::write(folder.0.path().join("cases.csv"), "B\ntrue\n\n").unwrap();
    let reals = "program R { variables { X : real; } decomposition { P(X) } forms { P(X) = normal(1, 2); } }";
    std::fs::write(folder.0.path().join("reals.bp"), reals).unwrap();
    for by in [["--by", "weighting"], ["--by", "gibbs"], ["--budget", "1"]] {
        for evidence in [&[][..], &["--evidence", r#"{"B": "true"}"#]] {
            let best = folder.json(&[&["mpe", "two.bp"], &by[..], evidence].concat());
            assert_eq!(
                (&best["assignment"]["A"], &best["assignment"]["B"]),
                (&"true".into(), &"true".into())
            );
            near(&best["ln_p"], 0.45f64.ln(), 1e-14);
            assert!(best["estimate"]["particles"].as_u64() > Some(0), "{best}");
        }
        // A likelihood of 1/2 multiplies the joint probability.
        let half = [&["mpe", "two.bp", "--likelihood", r#"{"B": [0.5, 0.5]}"#], &by[..]].concat();
        near(&folder.json(&half)["ln_p"], 0.225f64.ln(), 1e-14);
        let both = folder.json(&[&["joint", "two.bp", "--of", "A,B"], &by[..]].concat());
        assert!(both.get("ln_p_evidence").is_none() && both["estimate"].is_object(), "{both}");
    }
    near(&folder.json(&["joint", "reals.bp", "--of", "X"])["ln_p_evidence"], 0.0, 0.0);
    let seen = [&["marginals", "two.bp", "--by", "gibbs", "--evidence", r#"{"B": "true"}"#][..]].concat();
    assert!(folder.json(&seen).get("ln_p_evidence").is_none(), "Gibbs sampling does not estimate it");
    let cell = |by: &str| {
        let output = folder.bp(&["batch", "two.bp", "--cases", "cases.csv", "--by", by]);
        let page = String::from_utf8(output.stdout).unwrap();
        page.lines().nth(1).unwrap().split(',').next().unwrap().to_owned()
    };
    assert_eq!(cell("gibbs"), "");
    assert!((cell("sums").parse::<f64>().unwrap() - 0.55f64.ln()).abs() < 1e-14);
}

const ZEROS: &str = "program Zeros {
    variables { X : { A, B, C }; Y : bool; }
    decomposition { P(Y) P(X | Y) }
    forms { P(Y) = bernoulli(0.5); P(X | Y) = weights(if Y { 1 } else { 0 }); }
}
";

/// Σ P(Y X) is 0.5, all of it for Y = true: P(Y = true) is 1, whoever asks.
#[test]
fn weights_that_are_all_zero_exclude_their_context() {
    let folder = Folder::new();
    std::fs::write(folder.0.path().join("zeros.bp"), ZEROS).unwrap();
    for by in ["sums", "join_tree", "weighting", "gibbs"] {
        let asked = folder.json(&["ask", "zeros.bp", "P(Y)", "--by", by]);
        near(&asked["answer"][1]["p"], 1.0, 1e-9);
        let marginals = folder.json(&["marginals", "zeros.bp", "--only", "Y", "--by", by]);
        near(&marginals["posteriors"]["Y"]["true"], 1.0, 1e-9);
        let joint = folder.json(&["joint", "zeros.bp", "--of", "Y", "--by", by]);
        near(&joint["joint"][1]["p"], 1.0, 1e-9);
        if ["sums", "join_tree"].contains(&by) {
            near(&asked["ln_evidence"], 0.5f64.ln(), 1e-14);
            near(&marginals["ln_p_evidence"], 0.5f64.ln(), 1e-14);
            near(&joint["ln_p_evidence"], 0.5f64.ln(), 1e-14);
        }
    }
}

#[test]
fn refusals_give_the_true_reason() {
    let folder = Folder::new();
    let write = |name: &str, text: &str| std::fs::write(folder.0.path().join(name), text).unwrap();
    write("two.bp", TWO);
    // x (1 − x)² at 0, 1, 2 …: 0 inside the support and outside.
    write(
        "none.bp",
        "program N { variables { X : 0..=30; } decomposition { P(X) } forms { P(X) = beta(2, 3); } }",
    );
    let line = "program L { variables { X, Y : real; } decomposition { P(X) P(Y | X) }
        forms { P(X) = normal(0, 1); P(Y | X) = normal(X, 1); } }";
    write("line.bp", line);
    let family = "program S { parameters { N : size; } variables { S[1..=N] : bool; }
        decomposition { prod(i) { P(S[i]) } } forms { P(S[i]) = bernoulli(0.3); } }";
    write("family.bp", family);
    write(
        "large.bp",
        "program A { variables { A : 0..=999999999; } decomposition { P(A) } forms { P(A) = uniform; } }",
    );
    write(
        "counts.bp",
        "program H { variables { X : { A, B }; } decomposition { P(X) } forms { P(X) = histogram(0, 0); } }",
    );
    let wrong: [(&[&str], &str); 11] = [
        (&["ask", "counts.bp", "P(X)"], "counts or weights that are all 0"),
        (&["ask", "none.bp", "P(X)"], "`P(X)` is 0 for every value"),
        (&["marginals", "none.bp"], "`P(X)` is 0 for every value"),
        (&["ask", "line.bp", "P(X | Y = 1)", "--by", "sums"], "sums need finite variables"),
        (
            &["ask", "two.bp", "information P(A, B)", "--by", "weighting"],
            "`weighting` does not answer `information P(A B)`: `information`",
        ),
        (
            &["observe", "two.bp", "--about", "A", "--by", "gibbs"],
            "`gibbs` does not answer `entropy P(A)`: the information of observations",
        ),
        (&["ask", "family.bp", "P(S)", "--set", "N=9999999999999"], "from 1 to 1099511627776"),
        (&["convert", "large.bp", "large.bif"], "at most 16777216 numbers"),
        (
            &["observe", "two.bp", "--about", "A", "--among", "A"],
            "both a target (--about) and a candidate (--among)",
        ),
        (&["marginals", "two.bp", "--evidence", "[1]"], "--evidence is not a JSON object, such as"),
        (&["ask", "family.bp", "P(S)"], "`N`"),
    ];
    for (arguments, expected) in wrong {
        let output = folder.bp(arguments);
        assert_eq!(output.status.code(), Some(1), "{arguments:?}: {}", stderr(&output));
        assert!(stderr(&output).contains(expected), "{arguments:?}: {}", stderr(&output));
    }
    // The first row has three times false.
    let all = folder.json(&["ask", "family.bp", "P(S)", "--set", "N=3"]);
    near(&all["answer"][0]["p"], 0.343, 1e-15);
    // A size that nothing reads need not be given: P(B) = 0.5 · 0.9 + 0.5 · 0.2.
    write("unused.bp", &TWO.replace("variables", "parameters { N : size; } variables"));
    for by in ["sums", "join_tree"] {
        let asked = folder.json(&["ask", "unused.bp", "P(B)", "--by", by]);
        near(&asked["answer"][1]["p"], 0.55, 1e-15);
    }
    near(&folder.json(&["marginals", "unused.bp"])["posteriors"]["B"]["true"], 0.55, 1e-15);
}

const COIN: &str = "program Coin {
    parameters { bias : probability = 0.5; N : size = 2; }
    variables { Heads : bool; G[1..=N] : bool; }
    decomposition { P(Heads) prod(i) { P(G[i] | Heads) } }
    forms { P(Heads) = bernoulli(bias); P(G[i] | Heads) = bernoulli(if Heads { 0.75 } else { 0.25 }); }
}
";

#[test]
fn parameters_and_sizes_are_set() {
    let folder = Folder::new();
    std::fs::write(folder.0.path().join("coin.bp"), COIN).unwrap();
    let seen = ["--set", "bias=0.2", "--set", "N=3", "--evidence", r#"{"G[3]": true}"#];
    let found = folder.json(&[&["marginals", "coin.bp"], &seen[..]].concat());
    // 0.2 · 0.75 against 0.8 · 0.25.
    near(&found["posteriors"]["Heads"]["true"], 0.15 / 0.35, 1e-14);
    near(&found["ln_p_evidence"], 0.35f64.ln(), 1e-14);
    let best = folder.json(&[&["mpe", "coin.bp"], &seen[..]].concat());
    assert_eq!(best["assignment"]["Heads"], "false", "{best}");
    std::fs::write(folder.0.path().join("cases.csv"), "\"G[1]\"\ntrue\n").unwrap();
    let batch =
        folder.bp(&["batch", "coin.bp", "--cases", "cases.csv", "--only", "Heads", "--set", "bias=0.2"]);
    let page = String::from_utf8(batch.stdout).unwrap();
    assert!(page.contains("Heads=true") && page.contains("0.42857142857142"), "{page}");
    let wrong = folder.bp(&["marginals", "coin.bp", "--set", "bais=0.2"]);
    assert!(stderr(&wrong).contains("did you mean `bias`?"), "{}", stderr(&wrong));
    let help = String::from_utf8(folder.bp(&["marginals", "--help"]).stdout).unwrap();
    assert!(help.contains("--set <NAME=VALUE>") && !help.contains("all finite"), "{help}");
}

//! The `bp` command: arguments, answers and exit statuses.
//!
//! In: the built binary, the programs of `tests/programs`, files made here. Out: stdout, stderr, exit statuses.
//! Invariant: errors are printed on stderr, name their subject, and are never panics.

use serde_json::Value;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

const LINE: [&str; 3] = ["--set=N=10", "--set=Rays=1", "--set=sigma=0.6"];

fn program(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/programs").join(name)
}

fn bp(arguments: &[&str]) -> Output {
    let output = Command::new(env!("CARGO_BIN_EXE_bp")).args(arguments).output().unwrap();
    assert!(!stderr(&output).contains("panicked"), "{}", stderr(&output));
    output
}

fn bp_fed(arguments: &[&str], text: &str) -> Output {
    let mut child = Command::new(env!("CARGO_BIN_EXE_bp"))
        .args(arguments)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    child.stdin.take().unwrap().write_all(text.as_bytes()).unwrap();
    child.wait_with_output().unwrap()
}

fn written(output: &Output) -> String {
    String::from_utf8(output.stdout.clone()).unwrap()
}

fn stderr(output: &Output) -> String {
    String::from_utf8(output.stderr.clone()).unwrap()
}

/// The output of a successful command.
fn well(arguments: &[&str]) -> String {
    let output = bp(arguments);
    assert_eq!(output.status.code(), Some(0), "{arguments:?}: {}", stderr(&output));
    written(&output)
}

/// The message of a command with this exit status.
fn ill(code: i32, arguments: &[&str]) -> String {
    let output = bp(arguments);
    assert_eq!(output.status.code(), Some(code), "{arguments:?}: {}{}", written(&output), stderr(&output));
    stderr(&output)
}

/// An answer of a program in `tests/programs`.
fn ask(name: &str, arguments: &[&str]) -> Value {
    let path = program(name);
    let mut all = vec!["ask", path.to_str().unwrap(), "--json"];
    all.extend(arguments);
    serde_json::from_str(&well(&all)).unwrap()
}

/// The probability of the row with these values.
fn p(answer: &Value, values: &[(&str, &str)]) -> f64 {
    let rows = answer["answer"].as_array().unwrap();
    let row = rows.iter().find(|row| values.iter().all(|(name, value)| row["values"][*name] == *value));
    row.unwrap_or_else(|| panic!("no row {values:?} in {answer}"))["p"].as_f64().unwrap()
}

#[test]
fn the_grass_is_wet_because_of_the_sprinkler() {
    let answer = ask("wet_grass.bp", &["P(Rain | Wet = true)"]);
    assert_eq!(answer["question"], "P(Rain | Wet = true)");
    assert!((answer["ln_evidence"].as_f64().unwrap() - 0.93_f64.ln()).abs() < 1e-12);
    assert!((p(&answer, &[("Rain", "true")]) - 10.0 / 31.0).abs() < 1e-12);
    let table = well(&["ask", program("wet_grass.bp").to_str().unwrap(), "P(Rain | Wet = true)"]);
    assert!(table.contains("\n  true   0.322581     ███"), "{table}");
    assert!(table.ends_with("  ln P(evidence) = -0.0725707\n"), "{table}");
}

#[test]
fn values_are_given_by_their_names() {
    let typed = ask("wet_grass.bp", &["P(Rain | Wet = true)"]);
    let given = ask("wet_grass.bp", &["P(Rain | Wet = w)", "--set", "w=true"]);
    assert_eq!(typed["answer"], given["answer"]);
    let wanted = ask("wet_grass.bp", &["P(Rain = r | Wet = w)", "--set", "w=true", "--set", "r=true"]);
    assert_eq!(wanted["answer"].as_array().unwrap().len(), 1);
    assert_eq!(p(&wanted, &[("Rain", "true")]), p(&typed, &[("Rain", "true")]));
    let slice = ask("wet_grass.bp", &["P(Rain, Sprinkler = true | Wet = true)"]);
    assert_eq!(slice["answer"].as_array().unwrap().len(), 2);
}

#[test]
fn reductions_are_made_in_each_context() {
    let answer = ask("wet_grass.bp", &["argmax P(Rain Sprinkler | Wet)"]);
    assert_eq!(answer["answer"].as_array().unwrap().len(), 2);
    assert_eq!(p(&answer, &[("Wet", "false"), ("Rain", "false"), ("Sprinkler", "false")]), 1.0);
    p(&answer, &[("Wet", "true"), ("Rain", "false"), ("Sprinkler", "true")]);
    let entropy = ask("wet_grass.bp", &["entropy P(Rain)"]);
    let expected = -(0.3 * 0.3_f64.ln() + 0.7 * 0.7_f64.ln());
    assert!((entropy["answer"][0]["entropy"].as_f64().unwrap() - expected).abs() < 1e-12);
}

#[test]
fn a_range_reading_has_the_posterior_of_the_reference() {
    let posterior = |z: &str| {
        let z = format!("--set=z={z}");
        let mut arguments = vec!["P(Z = z | O C)", z.as_str()];
        arguments.extend(LINE);
        let answer = ask("line_of_sight.bp", &arguments);
        (1..=10)
            .map(|cell| {
                let cell = cell.to_string();
                let at = |o| p(&answer, &[("O", o), ("C", &cell), ("ray", "0")]);
                at("true") / (at("true") + at("false"))
            })
            .collect::<Vec<_>>()
    };
    let agree = |found: Vec<f64>, expected: [f64; 10]| {
        let close = found.iter().zip(&expected).all(|(found, expected)| (found - expected).abs() < 6e-5);
        assert!(close, "{found:?}");
    };
    agree(posterior("3"), [0.0223, 0.3639, 0.7229, 0.5434, 0.5007, 0.5, 0.5, 0.5, 0.5, 0.5]);
    agree(posterior("6"), [0.0, 0.0, 0.0001, 0.0223, 0.3639, 0.7229, 0.5434, 0.5007, 0.5, 0.5]);
    agree(posterior("NoDetection"), [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0001, 0.0102, 0.1717]);
}

#[test]
fn one_step_of_the_map_runs_from_the_shell() {
    let uniform = 1.0 / 3.0;
    let v: Vec<f64> = [0.1, 0.2, 0.7].iter().flat_map(|p| [uniform, uniform, *p, uniform, uniform]).collect();
    let o = "previous O=0.5,0.5,0.1,0.8,0.5,0.5,0.5,0.9,0.2,0.5";
    let v = format!("previous V={}", v.iter().map(f64::to_string).collect::<Vec<_>>().join(","));
    let reading: Vec<&str> = (0..30).map(|cell| if cell / 5 % 2 == 0 { "0.2" } else { "0.8" }).collect();
    let reading = format!("Sensors[i].reading={}", reading.join(","));
    let mut arguments = vec!["--set", "Grid=5", "--set", "Velocity=-1,0,1", "--set", "Sensors=1"];
    arguments.extend(["--set", "epsilon=0.1", "--set", o, "--set", &v, "--set", &reading]);
    let answer = ask("cell.bp", &arguments);
    let rows = answer["answer"].as_array().unwrap();
    let occupied = rows.iter().filter(|row| row["values"]["C"] == "3,0,0" && row["values"]["O"] == "true");
    let occupied: f64 = occupied.map(|row| row["p"].as_f64().unwrap()).sum();
    assert!((occupied - 0.8598648882729949).abs() < 1e-12, "{occupied}");
}

#[test]
fn large_tables_show_their_first_rows() {
    let path = program("line_of_sight.bp");
    let mut arguments = vec!["ask", path.to_str().unwrap()];
    arguments.extend(LINE);
    let some = well(&arguments);
    assert!(some.ends_with("  … and 180 more rows; --all shows them\n"), "{some}");
    assert!(some.lines().all(|line| line.chars().count() <= 80), "{some}");
    arguments.push("--all");
    assert_eq!(well(&arguments).lines().count(), 2 + 1 + 220);
}

#[test]
fn a_normal_law_has_a_mean_and_a_deviation() {
    let text = "program Room { variables { T, M : real; } decomposition { P(T) P(M | T) }
        forms { P(T) = normal(20, 3); P(M | T) = normal(T, 4); } question t { P(T | M) } }";
    let output = bp_fed(&["ask", "-", "--set", "M=25"], text);
    assert!(written(&output).contains("T  21.8000 ± 2.40000"), "{}{}", written(&output), stderr(&output));
    let output = bp_fed(&["ask", "-", "--set", "M=25,26"], text);
    assert!(
        stderr(&output).contains("input `M`: 2 numbers were given, but 1 is expected"),
        "{}",
        stderr(&output)
    );
    let output = bp_fed(&["ask", "-", "P(T | M = 25)", "--json"], text);
    let answer: Value = serde_json::from_str(&written(&output)).unwrap();
    assert!((answer["answer"][0]["mean"].as_f64().unwrap() - 21.8).abs() < 1e-12);
}

#[test]
fn settings_must_be_known_and_fit() {
    let path = program("line_of_sight.bp");
    let wrong = |code, settings: &[&str]| {
        let mut arguments = vec!["ask", path.to_str().unwrap(), "P(Z = z | O C)"];
        settings.iter().for_each(|setting| arguments.extend(["--set", setting]));
        ill(code, &arguments)
    };
    let full = ["N=10", "Rays=1", "sigma=0.6"];
    let with = |last| wrong(1, &[full[0], full[1], full[2], last]);
    assert!(with("z=11").contains("`11` is not a value of `Z`, which is `{ NoDetection } or 1..=N`"));
    assert!(with("z=Nowhere").contains("input `z`: `Nowhere` is not a value of `Z`"));
    assert!(with("q=1").contains("input `q`: neither the program nor the question knows this name"));
    assert!(with("N=3").contains("input `N`: it is set twice"));
    assert!(wrong(1, &full).contains("input `z`: it was not given"));
    assert!(wrong(1, &["N=10", "Rays=1", "z=3"]).contains("input `sigma`: it was not given"));
    assert!(wrong(1, &["N=1.5"]).contains("input `N`: it is 1.5, but it must be a whole number"));
    assert!(wrong(1, &["N=1e300"]).contains("input `N`"));
    assert!(wrong(1, &["Rays=0"]).contains("input `Rays`: `0` is not a whole number of elements"));
    assert!(wrong(1, &["sigma=a"]).contains("input `sigma`: `a` is not a finite number"));
    for syntax in ["N", "N=", "=3"] {
        assert!(wrong(2, &[syntax]).contains("expected NAME=VALUE"), "{syntax}");
    }
    let two = ill(1, &["ask", path.to_str().unwrap(), "P(Z | O = v, C = v)", "--set", "v=1"]);
    assert!(two.contains("input `v`: it names values of both `O` and `C`"), "{two}");
    let cell = ill(1, &["ask", program("cell.bp").to_str().unwrap(), "--set", "epsilon=1.5"]);
    assert!(cell.contains("input `epsilon`: it is 1.5, but it must be a probability"), "{cell}");
}

#[test]
fn impossible_observations_are_reported() {
    let text = std::fs::read_to_string(program("wet_grass.bp")).unwrap();
    let dry = text.replace("dirac(Rain or Sprinkler)", "bernoulli(0)");
    let output = bp_fed(&["ask", "-", "P(Rain | Wet = true)"], &dry);
    assert_eq!(output.status.code(), Some(1));
    assert!(stderr(&output).contains("the evidence of `P(Rain | Wet = true)` has probability zero"));
    assert_eq!(written(&output), "");
}

#[test]
fn wrong_questions_are_shown_under_their_words() {
    let path = program("wet_grass.bp");
    let wrong = |question| ill(1, &["ask", path.to_str().unwrap(), question]);
    let snow = wrong("P(Snow | Wet)");
    assert!(snow.contains("unknown variable `Snow`") && snow.contains("question:1:3"), "{snow}");
    assert!(wrong("rian").contains("has no question `rian`"));
    assert!(wrong("P(Rain").contains("expected `,` or `)`"));
    wrong("");
    assert!(ill(1, &["explain", path.to_str().unwrap(), "P(Rain | Rain)"]).contains("on both sides"));
}

#[test]
fn paths_that_are_not_files() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    std::fs::write(path("empty.bp"), "").unwrap();
    std::fs::write(path("latin.bp"), b"// caf\n// \xe9\n").unwrap();
    for verb in ["check", "fmt", "ask", "explain", "draw", "emit"] {
        let missing = ill(1, &[verb, &path("missing.bp")]);
        assert!(missing.contains("missing.bp`: No such file"), "{missing}");
        assert!(ill(1, &[verb, folder.path().to_str().unwrap()]).contains("directory"));
        assert!(ill(1, &[verb, &path("latin.bp")]).contains("latin.bp`: line 2 is not UTF-8 text"));
        assert!(ill(1, &[verb, &path("empty.bp")]).contains("expected"), "{verb}");
        ill(2, &[verb]);
    }
    ill(2, &["nonsense"]);
}

#[test]
fn check_looks_at_every_file() {
    let (right, wrong) = (program("wet_grass.bp"), program("binaural.bp"));
    let output = bp(&["check", wrong.to_str().unwrap(), right.to_str().unwrap()]);
    assert_eq!(output.status.code(), Some(1));
    assert_eq!(written(&output), "ok: program WetGrass: 3 variables, 3 factors, 1 question\n");
    assert!(stderr(&output).contains("unknown name `l_max`"));
}

#[test]
fn fmt_replaces_a_file_whole_or_not_at_all() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("wet.bp");
    let file = path.to_str().unwrap();
    let text = std::fs::read_to_string(program("wet_grass.bp")).unwrap();
    std::fs::write(&path, &text).unwrap();
    let output = bp(&["fmt", "--check", file]);
    assert_eq!((output.status.code(), std::fs::read_to_string(&path).unwrap()), (Some(1), text.clone()));
    assert!(written(&output).contains("wet.bp would change"));
    well(&["fmt", file]);
    let formatted = std::fs::read_to_string(&path).unwrap();
    assert_ne!(formatted, text);
    well(&["fmt", "--check", file]);
    assert_eq!(written(&bp_fed(&["fmt", "-"], &text)), formatted);
    std::fs::write(&path, "program {").unwrap();
    ill(1, &["fmt", file]);
    assert_eq!(std::fs::read_to_string(&path).unwrap(), "program {");
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1, "nothing is left behind");
}

#[test]
fn explain_derives_step_by_step() {
    let path = program("wet_grass.bp");
    let file = path.to_str().unwrap();
    let text = well(&["explain", file, "P(Rain | Wet = true)"]);
    assert!(
        text.contains(" 1. definition\n") && text.contains("P(Rain | Wet) = P(Rain Wet) / P(Wet)"),
        "{text}"
    );
    assert!(text.contains("3 factors with 3 free parameters; a table of the joint"), "{text}");
    assert!(text.contains("computed: P(Rain | Wet = true) = (P(Rain) Σ_Sprinkler"), "{text}");
    assert!(text.lines().all(|line| line.chars().count() <= 80), "{text}");
    assert!(text.contains("\nrange: linear, its smallest product above 0 is at least 2^-512\n"), "{text}");
    let latex = well(&["explain", file, "--latex"]);
    assert!(latex.contains("\\begingroup\\raggedright") && latex.ends_with("\\endgroup\n"), "{latex}");
    assert!(latex.contains("{P(\\mathit{Rain} \\mid \\mathit{Wet})} = \\frac{"), "{latex}");
    let json: Value = serde_json::from_str(&well(&["explain", file, "rain", "--json"])).unwrap();
    assert_eq!(json["computed"].as_array().unwrap().len(), 1);
    assert_eq!(json["range"][0]["mark"], "linear", "{json}");
    assert_eq!((&json["question"], &json["free_parameters"]), (&"P(Rain | Wet)".into(), &3.0.into()));
}

#[test]
fn explain_shows_the_order_of_the_loops_in_memory() {
    let path = program("cell.bp");
    let file = path.to_str().unwrap();
    let json: serde_json::Value =
        serde_json::from_str(&well(&["explain", file, "state", "--layout", "--json"])).unwrap();
    let lines: Vec<&str> =
        json["layout"].as_array().unwrap().iter().map(|line| line.as_str().unwrap()).collect();
    for words in [
        "over Grid.depth × Grid.rows × Grid.lanes; neighbours in memory along C.lanes",
        "looks up: `Velocity from depth` (Velocity × Grid.depth × Grid.rows)",
        "writes: `P(O V | Z)` (2 × Velocity × Grid.depth × Grid.rows × Grid.lanes)",
    ] {
        assert!(lines.iter().any(|line| line.contains(words)), "{words}: {lines:#?}");
    }
    // Two neighbouring bins share an edge: there is one more edge than bins.
    let sensor = Path::new(env!("CARGO_MANIFEST_DIR")).join("../bvm/models/line_of_sight.bp");
    let words = well(&["explain", sensor.to_str().unwrap(), "reading", "--layout"]);
    assert!(words.contains("layout: ") && words.contains("and the next` ((N + 1))"), "{words}");
    assert!(words.lines().all(|line| line.chars().count() <= 80), "{words}");
    // A question in closed form has no loops.
    let words = well(&["explain", program("vestibular.bp").to_str().unwrap(), "--layout"]);
    assert!(!words.contains("layout: "), "{words}");
}

#[test]
fn every_line_of_a_derivation_is_true() {
    let text = well(&["explain", program("cell.bp").to_str().unwrap()]);
    // The plate's index is known like any other variable where a factor distributes it.
    assert!(text.contains("P(O V | Z C) = P(O V Z C) / P(Z C)\n"), "{text}");
    assert!(text.contains("1/P(Z C) · Σ_{A O⁻¹} P(A O O⁻¹ V Z C)\n"), "{text}");
    assert!(text.contains("P(O V | Z = z, C) ∝ "), "{text}");
    let path = program("line_of_sight.bp");
    let text = well(&["explain", path.to_str().unwrap(), "P(Z = z | O C)"]);
    assert!(text.contains("P(Z | O C ray) = P(Z O C | ray) / P(O C | ray)\n"), "{text}");
    assert!(text.contains("`Z` is at a given value\n"), "{text}");
    let gaze = well(&["explain", program("gaze.bp").to_str().unwrap()]);
    assert!(gaze.contains("\ncomputed: P(G | C) = P(G)\ncomputed: argmax_G P(G | C)\n"), "{gaze}");
    let text = well(&["explain", program("wet_grass.bp").to_str().unwrap(), "P(Wet | Rain virtual [1, 2])"]);
    assert!(text.contains("P(Wet | λ(Rain)) = 1/P(λ(Rain)) · "), "{text}");
}

#[test]
fn reals_are_integrated_out() {
    let text = "program A { variables { X : bool; Y : real; } decomposition { P(X) P(Y | X) }
        forms { P(X) = uniform; P(Y | X) = if X { normal(0, 1) } else { normal(1, 2) }; } question x { P(X) } }";
    let output = bp_fed(&["explain", "-"], text);
    assert!(written(&output).contains("P(X) = ∫_Y P(X Y)\n"), "{}{}", written(&output), stderr(&output));
    let output = bp_fed(&["explain", "-", "--latex"], text);
    assert!(written(&output).contains("{P(X)} = \\int_{Y} {P(X\\, Y)}"), "{}", written(&output));
}

#[test]
fn every_program_explains_its_questions() {
    for name in ["wet_grass", "cell", "gaze", "line_of_sight"] {
        let path = program(&format!("{name}.bp"));
        for form in ["--json", "--latex"] {
            well(&["explain", path.to_str().unwrap(), form]);
        }
        let text = well(&["explain", path.to_str().unwrap()]);
        assert!(text.lines().last().unwrap().len() > 4, "{text}");
        assert!(text.lines().all(|line| line.chars().count() <= 80), "{text}");
    }
}

#[test]
fn a_closed_pipe_is_no_error() {
    let path = program("line_of_sight.bp");
    let settings = ["--set=N=60", "--set=Rays=30", "--all"];
    let sigma = format!("--set=sigma={}", vec!["0.5"; 30].join(","));
    let mut child = Command::new(env!("CARGO_BIN_EXE_bp"))
        .args(["ask", path.to_str().unwrap()])
        .args(settings)
        .arg(sigma)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    drop(child.stdout.take());
    let output = child.wait_with_output().unwrap();
    assert_eq!((output.status.code(), stderr(&output)), (Some(0), String::new()));
}

#[test]
fn help_has_examples() {
    for verb in ["check", "fmt", "explain", "ask", "draw", "completions"] {
        let help = well(&[verb, "--help"]);
        assert!(help.contains("Examples:\n") && help.contains(&format!("  bp {verb} ")), "{help}");
    }
    assert!(well(&["--version"]).starts_with("bp "));
}

#[test]
fn help_is_at_most_80_columns_wide() {
    let verbs =
        "check fmt explain ask draw emit marginals mpe joint observe batch cost convert completions learn";
    for verb in std::iter::once(None).chain(verbs.split(' ').map(Some)) {
        for flag in ["-h", "--help"] {
            let arguments: Vec<&str> = verb.into_iter().chain([flag]).collect();
            let text = String::from_utf8(bp(&arguments).stdout).unwrap();
            let long = text.lines().find(|line| line.chars().count() > 80);
            assert!(text.contains("Usage:") && long.is_none(), "{arguments:?}: {long:?}");
        }
    }
}

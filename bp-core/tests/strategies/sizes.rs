//! Large programs and excessive sizes: answered, or refused with a number and a suggestion.
//!
//! In: programs made here, the built binary under a limit of memory and of stack. Out: answers that can be checked by
//! hand; exit statuses 0, 1 and 2. Invariant: no run aborts, hangs, or takes more memory than the limit.

use bp_core::compiler::answer::{Figure, ask};
use bp_core::compiler::exec::Inputs;
use bp_core::compiler::source::Source;
use bp_core::compiler::syntax::{compile, parse_question};
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

/// X0 → X1 → …, each with this form given the one before.
fn chain(count: usize, domain: &str, first: &str, form: impl Fn(usize) -> String) -> String {
    let names: Vec<String> = (0..count).map(|number| format!("X{number}")).collect();
    let factors: Vec<String> = (1..count).map(|number| format!("P(X{number} | X{})", number - 1)).collect();
    let forms: Vec<String> = (1..count)
        .map(|number| format!("P(X{number} | X{}) = {};\n", number - 1, form(number - 1)))
        .collect();
    format!(
        "program Chain {{ variables {{ {} : {domain}; }} decomposition {{ P(X0) {} }} forms {{ P(X0) = {first};\n{} }} }}",
        names.join(", "),
        factors.join(" "),
        forms.concat()
    )
}

/// Two states: true becomes true with probability 0.2, false with 0.9.
fn flips(count: usize) -> String {
    chain(count, "bool", "bernoulli(0.3)", |before| {
        format!("bernoulli(if X{before} {{ 0.2 }} else {{ 0.9 }})")
    })
}

fn file(name: &str, text: &str) -> PathBuf {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    std::fs::write(&path, text).unwrap();
    path
}

/// Runs `bp` within four gigabytes of address space, with a stack of this size in kilobytes.
fn limited(stack: usize, arguments: &[&str]) -> Output {
    let script = format!("ulimit -s {stack} 2>/dev/null; ulimit -v 4194304 2>/dev/null; exec \"$@\"");
    let mut command = match cfg!(unix) {
        true => {
            let mut command = Command::new("sh");
            command.args(["-c", &script, "sh", env!("CARGO_BIN_EXE_bp")]);
            command
        }
        false => Command::new(env!("CARGO_BIN_EXE_bp")),
    };
    let (out, err) = (tempfile::tempfile().unwrap(), tempfile::tempfile().unwrap());
    let mut child = command
        .args(arguments)
        .env("RAYON_NUM_THREADS", "2")
        .stdin(Stdio::null())
        .stdout(out.try_clone().unwrap())
        .stderr(err.try_clone().unwrap())
        .spawn()
        .unwrap();
    let start = Instant::now();
    let status = loop {
        if let Some(status) = child.try_wait().unwrap() {
            break status;
        }
        if start.elapsed() > Duration::from_secs(300) {
            child.kill().unwrap();
            panic!("{arguments:?} does not end");
        }
        std::thread::sleep(Duration::from_millis(5));
    };
    let read = |mut file: std::fs::File| {
        use std::io::{Read, Seek};
        let mut bytes = Vec::new();
        file.rewind().unwrap();
        file.read_to_end(&mut bytes).unwrap();
        bytes
    };
    Output { status, stdout: read(out), stderr: read(err) }
}

/// The output of a successful command, on a small stack.
#[track_caller]
fn well(arguments: &[&str]) -> String {
    let output = limited(512, arguments);
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(0), "{arguments:?}: {message}");
    String::from_utf8(output.stdout).unwrap()
}

/// The message of a command that refuses; it contains all of these words.
#[track_caller]
fn refused(arguments: &[&str], words: &[&str]) {
    let output = limited(8192, arguments);
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(1), "{arguments:?}: {message}");
    for word in words {
        assert!(message.contains(word), "{arguments:?}: `{word}` is not in {message}");
    }
    assert!(!message.contains("panicked"), "{message}");
}

fn json(text: &str) -> Value {
    serde_json::from_str(text).unwrap()
}

#[track_caller]
fn close(found: f64, expected: f64) {
    assert!((found - expected).abs() <= 1e-9 * expected.abs().max(1e-3), "{found} is not {expected}");
}

/// P(true) of the stationary law is 0.9 / (0.9 + 0.8); the influence of the start decays as (−0.7)ⁿ.
const STATIONARY: f64 = 0.9 / 1.7;

#[test]
fn a_chain_of_ten_thousand_through_every_door() {
    let path = file("flips.bp", &flips(10_000));
    let path = path.to_str().unwrap();
    well(&["check", path]);
    let answer = json(&well(&["ask", path, "P(X9999 | X0 = true)", "--json"]));
    close(answer["answer"][1]["p"].as_f64().unwrap(), STATIONARY);
    close(answer["ln_evidence"].as_f64().unwrap(), 0.3f64.ln());
    // A table: each context sums to one. The variables in between are known, so only the neighbours matter.
    let table = json(&well(&["ask", path, "P(X9999 X5001 | X0 X5000 = true)", "--json"]));
    let rows = table["answer"].as_array().unwrap();
    assert_eq!(rows.len(), 8);
    close(rows.iter().take(4).map(|row| row["p"].as_f64().unwrap()).sum(), 1.0);
    close(rows[1]["p"].as_f64().unwrap() + rows[3]["p"].as_f64().unwrap(), 0.2);
    let entropy = json(&well(&["ask", path, "entropy P(X9999 | X0 = true)", "--json"]));
    let h = -(STATIONARY * STATIONARY.ln() + (1.0 - STATIONARY) * (1.0 - STATIONARY).ln());
    close(entropy["answer"][0]["entropy"].as_f64().unwrap(), h);
    let text = well(&["explain", path, "P(X9999 | X0 = true)"]);
    assert!(text.len() < 20_000 && text.contains("join tree") && text.contains("more factors"), "{text}");
    for form in ["--latex", "--json"] {
        assert!(well(&["explain", path, "P(X9999 | X0)", form]).len() < 200_000, "{form}");
    }
    for arguments in [["marginals"], ["mpe"], ["cost"]] {
        well(&[arguments[0], path]);
    }
    well(&["joint", path, "--of", "X0,X9999"]);
    well(&["observe", path, "--about", "X0", "--among", "X1,X9999"]);
    refused(&["emit", path, "P(X9999 | X0)"], &["factors", "join tree"]);
}

#[test]
fn a_chain_of_a_hundred_thousand() {
    let path = file("flips_long.bp", &flips(100_000));
    let answer = json(&well(&["ask", path.to_str().unwrap(), "P(X99999 | X0 = true)", "--json"]));
    close(answer["answer"][1]["p"].as_f64().unwrap(), STATIONARY);
    let text = well(&["explain", path.to_str().unwrap(), "P(X99999 | X0 = true)"]);
    assert!(text.len() < 20_000, "{} bytes", text.len());
}

#[test]
fn chains_of_diracs() {
    // X counts from 0 to 9 and wraps around: after n steps from 3 it is (3 + n) mod 10.
    let form = |before: usize| format!("dirac(if X{before} == 9 {{ 0 }} else {{ X{before} + 1 }})");
    for count in [1_500, 10_000] {
        let path = file(&format!("counts{count}.bp"), &chain(count, "0..=9", "uniform", form));
        let (path, last) = (path.to_str().unwrap(), count - 1);
        let question = format!("P(X{last} | X0 = 3)");
        let answer = json(&well(&["ask", path, &question, "--json"]));
        for (value, row) in answer["answer"].as_array().unwrap().iter().enumerate() {
            close(row["p"].as_f64().unwrap(), f64::from(u8::from(value == (3 + last) % 10)));
        }
        let text = well(&["explain", path, &question]);
        assert!(text.len() < 200_000, "{count}: {} bytes", text.len());
    }
}

#[test]
fn a_random_walk_of_reals() {
    // Var Xₙ = n; of a bridge from 0 to 10 in n steps the middle has mean 5 and variance n / 4.
    let path =
        file("walk.bp", &chain(10_001, "real", "normal(0, 1)", |before| format!("normal(X{before}, 1)")));
    let path = path.to_str().unwrap();
    let far = json(&well(&["ask", path, "P(X10000 | X0 = 1)", "--json"]));
    close(far["answer"][0]["mean"].as_f64().unwrap(), 1.0);
    close(far["answer"][0]["deviation"].as_f64().unwrap(), 100.0);
    let bridge = json(&well(&["ask", path, "P(X5000 | X0 = 0, X10000 = 10)", "--json"]));
    close(bridge["answer"][0]["mean"].as_f64().unwrap(), 5.0);
    close(bridge["answer"][0]["deviation"].as_f64().unwrap(), 50.0);
    // N(0; 0, 1) N(10; 0, 10⁴)
    let ln = -0.5 * (2.0 * std::f64::consts::TAU.ln() + 1e4f64.ln() + 100.0 / 1e4);
    close(bridge["ln_evidence"].as_f64().unwrap(), ln);
}

#[test]
fn thousands_of_readings_agree_with_arithmetic() {
    // H has three values; each of 2 500 known readings is true with probability 0.2, 0.5 or 0.7, and 1 100 of them are.
    let count = 2500;
    let names: Vec<String> = (0..count).map(|number| format!("R{number}")).collect();
    let mut text = format!(
        "program Readings {{ variables {{ H, G : 0..=2; {} : bool; }} decomposition {{ P(H) P(G | H) ",
        names.join(", ")
    );
    text.extend(names.iter().map(|name| format!("P({name} | H) ")));
    text += "} forms { P(H) = categorical(0.5, 0.3, 0.2); P(G | H) = table { 0.6, 0.3, 0.1; 0.2, 0.5, 0.3; 0, 0.25, 0.75; };";
    text.extend(names.iter().map(|name| {
        format!("P({name} | H) = bernoulli(if H == 0 {{ 0.2 }} else if H == 1 {{ 0.5 }} else {{ 0.7 }});")
    }));
    text += "} }";
    let model = compile(&Source::new("readings", text)).unwrap();
    let known: Vec<String> =
        names.iter().enumerate().map(|(at, name)| format!("{name} = {}", at < 1100)).collect();
    let asked = Source::new("question", format!("P(G H | {})", known.join(", ")));
    let question = parse_question(&asked, &model).unwrap();
    let answer = &ask(&model, &question, &Inputs::new()).unwrap()[0];
    let ln = |h: usize| {
        let (prior, p) = ([0.5f64, 0.3, 0.2][h], [0.2f64, 0.5, 0.7][h]);
        prior.ln() + 1100.0 * p.ln() + 1400.0 * (1.0 - p).ln()
    };
    let most = (0..3).map(ln).fold(f64::MIN, f64::max);
    let total = most + (0..3).map(|h| (ln(h) - most).exp()).sum::<f64>().ln();
    let found = answer.ln_evidence.unwrap();
    assert!((found - total).abs() < 1e-9 * total.abs(), "{found} is not {total}");
    let table = [[0.6, 0.3, 0.1], [0.2, 0.5, 0.3], [0.0, 0.25, 0.75]];
    for (position, row) in answer.answer.iter().enumerate() {
        let (g, h) = (position / 3, position % 3);
        let Figure::Probability { p } = row.figure else { panic!("{row:?}") };
        let expected = (ln(h) - total).exp() * table[h][g];
        assert!((p - expected).abs() < 1e-12, "G = {g}, H = {h}: {p} is not {expected}");
    }
}

#[test]
fn a_let_is_shared() {
    // aₙ = aₙ₋₁ + aₙ₋₁, 150 times over: 2¹⁵⁰ as a tree. 2⁻¹⁵⁰ aₙ is a₀.
    let mut text = "program L { variables { X, Y : bool; } decomposition { P(X) P(Y | X) } forms { P(X) = bernoulli(0.5); P(Y | X) = ".to_owned();
    text += "let a0 = if X { 0.25 } else { 0.5 } in ";
    text.extend((1..=150).map(|n| format!("let a{n} = a{before} + a{before} in ", before = n - 1)));
    text += "bernoulli(a150 / pow(2, 150)); } question q { P(Y | X) } }";
    let path = file("let.bp", &text);
    let path = path.to_str().unwrap();
    let answer = json(&well(&["ask", path, "q", "--json"]));
    let p: Vec<f64> =
        answer["answer"].as_array().unwrap().iter().map(|row| row["p"].as_f64().unwrap()).collect();
    assert_eq!(p, [0.5, 0.5, 0.75, 0.25]);
    for arguments in [["check"], ["explain"], ["emit"], ["draw"], ["marginals"]] {
        well(&[arguments[0], path]);
    }
    well(&["convert", path, "-", "--to", "bif"]);
    // The same for the evaluation of a known number without its value: 2⁴⁰ steps as a tree. a₄₀ is 0 or 2⁴⁰.
    let mut text = "program D { variables { X, Y : bool; } decomposition { P(X) P(Y | X) } forms { P(X) = bernoulli(0.25); P(Y | X) = ".to_owned();
    text += "let a0 = if X { 1 } else { 0 } in ";
    text.extend((1..=40).map(|n| format!("let a{n} = a{before} + a{before} in ", before = n - 1)));
    text += "dirac(a40 > 0.5); } question q { P(Y) } }";
    let path = file("let_dirac.bp", &text);
    let answer = json(&well(&["ask", path.to_str().unwrap(), "q", "--json"]));
    assert_eq!(answer["answer"][1]["p"].as_f64(), Some(0.25));
}

#[test]
fn requests_too_large_are_refused_with_their_size() {
    let family = file(
        "family.bp",
        "program F { variables { H : bool; G[1..=1000000000] : bool; } decomposition { P(H) prod(j) { P(G[j] | H) } } forms { P(H) = bernoulli(0.5); P(G[j] | H) = bernoulli(0.3); } question k { P(G) } question g { P(H | G = g) } }",
    );
    let family = family.to_str().unwrap();
    refused(&["ask", family, "k"], &["1e308 cells", "fewer variables"]);
    refused(&["ask", family, "g", "--set", "g=true"], &["1000000000"]);
    for command in ["marginals", "cost", "mpe"] {
        refused(&[command, family], &["`G`", "1e9 cells", "shorter"]);
    }
    let dice = file(
        "dice.bp",
        "program D { variables { A, B : 1..=4294967296; S : 2..=12; } decomposition { P(A) P(B) P(S | A B) } forms { P(A) = uniform; P(B) = uniform; P(S | A B) = dirac(A + B); } question s { P(S | A = 4) } question a { P(A | S = 9) } }",
    );
    let dice = dice.to_str().unwrap();
    refused(&["ask", dice, "a"], &["4.3e9 cells", "34.4 GB", "memory are free"]);
    // One value of B fulfils the Dirac for each S: 5 = 4 + 1, …, 12 = 4 + 8.
    let sums = json(&well(&["ask", dice, "s", "--json"]));
    let p: Vec<f64> =
        sums["answer"].as_array().unwrap().iter().map(|row| row["p"].as_f64().unwrap()).collect();
    assert_eq!(p, [[0.0; 3].as_slice(), &[0.125; 8]].concat());
    let wide = file(
        "wide.bp",
        "program W { variables { X : 0..=1000000000000; Y : -1000000000000..=1000000000000; } decomposition { P(X) P(Y) } forms { P(X) = uniform; P(Y) = uniform; } question x { P(X) } question y { P(Y | X = 3) } }",
    );
    let wide = wide.to_str().unwrap();
    for question in ["x", "y"] {
        refused(&["ask", wide, question], &["cells"]);
        refused(&["ask", wide, question, "--table"], &["cells"]);
    }
    refused(&["marginals", wide], &["cells"]);
    let wider = file(
        "wider.bp",
        "program V { variables { X : 0..=1000000000000000; } decomposition { P(X) } forms { P(X) = uniform; } }",
    );
    refused(&["check", wider.to_str().unwrap()], &["1099511627776"]);
    for command in ["check", "draw"] {
        well(&[command, wide]);
    }
    // A joint posterior of ten thousand variables.
    let path = file("flips_joint.bp", &flips(10_000));
    let all: Vec<String> = (0..10_000).map(|number| format!("X{number}")).collect();
    let path = path.to_str().unwrap();
    refused(&["ask", path, &format!("P({})", all.join(" "))], &["cells", "fewer variables"]);
    refused(&["joint", path, "--of", &all.join(",")], &["fewer"]);
}

#[test]
fn numbers_at_run_time_end_in_an_answer_or_an_error() {
    let text = "program N { parameters { N : size = 3; p : probability = 0.3; s : real = 1; } variables { A : 1..=N; B : bool; G[1..=N] : bool; X : real; } decomposition { P(A) P(B | A) prod(i) { P(G[i] | B) } P(X | B) } forms { P(A) = uniform; P(B | A) = bernoulli(p); P(G[i] | B) = bernoulli(if B { p } else { 0.5 }); P(X | B) = normal(if B { 1 } else { 0 }, s); } question a { P(A | B = true) } question g { P(B | G = g) } question x { P(B | X = x) } question m { P(X) } }";
    let path = file("numbers.bp", text);
    let path = path.to_str().unwrap();
    for number in [
        "NaN",
        "inf",
        "-inf",
        "-1",
        "0",
        "1e308",
        "-1e308",
        "1e-320",
        "1000000000000",
        "9223372036854775807",
        "18446744073709551616",
        "0.5",
        "true",
        "",
    ] {
        for name in ["N", "p", "s", "g", "x"] {
            for question in ["a", "g", "x"] {
                let setting = format!("--set={name}={number}");
                let mut arguments = vec!["ask", path, question, "--json", &setting];
                let own = format!("--set={question}=1");
                if question != name && question != "a" {
                    arguments.push(&own);
                }
                let output = limited(8192, &arguments);
                let (message, written) =
                    (String::from_utf8_lossy(&output.stderr), String::from_utf8_lossy(&output.stdout));
                assert!(matches!(output.status.code(), Some(0..=2)), "{arguments:?}: {message}");
                assert!(!message.contains("panicked"), "{arguments:?}: {message}");
                assert!(!written.contains("null") || written.contains("\"ln_evidence\":null"), "{written}");
            }
        }
    }
    for particles in ["0", "-1", "1000000000000", "NaN"] {
        assert_eq!(limited(8192, &["ask", path, "m", "--particles", particles]).status.code(), Some(2));
    }
}

#[test]
fn paths_that_are_not_files_are_refused() {
    let folder = env!("CARGO_TARGET_TMPDIR");
    for path in [folder, "/nonexistent/x.bp", "/dev/null", ""] {
        for command in ["check", "ask", "marginals", "fmt"] {
            let code = limited(8192, &[command, path]).status.code();
            assert!(matches!(code, Some(1 | 2)), "{command} {path}: {code:?}");
        }
    }
}

/// SIGINT during draws: the answer from the draws that were made.
#[cfg(unix)]
#[test]
fn an_interrupted_estimate_has_a_warning() {
    let text = "program I { variables { X, Y : real; } decomposition { P(X) P(Y | X) } forms { P(X) = normal(0, 1); P(Y | X) = normal(exp(X), 1); } }";
    let path = file("interrupted.bp", text);
    // The signal may come before the first draw, or before the handler is installed: then it is tried again, with a
    // longer delay.
    for wait in [300, 1000, 3000, 10_000] {
        let child = Command::new(env!("CARGO_BIN_EXE_bp"))
            .args(["ask", path.to_str().unwrap(), "P(X | Y = 1)", "--particles", "20000000", "--json"])
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        std::thread::sleep(Duration::from_millis(wait));
        Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
        let output = child.wait_with_output().unwrap();
        if !output.stdout.is_empty() {
            let answer = json(&String::from_utf8(output.stdout).unwrap());
            let warning = answer["estimate"]["warning"].as_str().unwrap_or("nothing");
            if output.status.code() == Some(0) {
                panic!("20 000 000 draws were made within {wait} ms");
            }
            assert_eq!(output.status.code(), Some(1));
            assert!(warning.contains("interrupted") && warning.contains("20000000"), "{warning}");
            return;
        }
    }
    panic!("no signal found any draw");
}

//! Many cases in one command: rows and sequences without an answer, families as columns, sizes given by arrays.
//!
//! In: the built binary, programs and tables. Out: answers, messages, exit statuses. Invariant: expected numbers are
//! computed by hand, in comments.

use serde_json::Value;
use std::process::{Command, Output, Stdio};

const FAMILY: &str = "program Fire {
    variables { Fire : bool; Alarm[i in 1..=2] : bool; }
    decomposition { P(Fire) prod(i) { P(Alarm[i] | Fire) } }
    forms { P(Fire) = bernoulli(0.1); P(Alarm[i] | Fire) = bernoulli(if Fire { 0.9 } else { 0.2 }); }
}
";

const ZEROS: &str = "program Zeros {
    variables { B, C : bool; K : 0..=2; }
    decomposition { P(B) P(C | B) P(K) }
    forms { P(B) = bernoulli(0.5); P(C | B) = table { false: 1, 0; true: 1, 0; }; P(K) = categorical(0.25, 0.75, 0); }
}
";

const UMBRELLA: &str = "program Umbrella {
    variables { R, R^-1, Z : bool; }
    decomposition { P(R^-1) P(R | R^-1) P(Z | R) }
    forms {
        P(R^-1) = bernoulli(0.5);
        P(R | R^-1) = dirac(R^-1);
        P(Z | R) = bernoulli(if R { 0.5 } else { 0 });
    }
}
";

pub(crate) struct Folder(tempfile::TempDir);

impl Folder {
    pub(crate) fn with(files: &[(&str, &str)]) -> Self {
        let folder = Self(tempfile::tempdir().unwrap());
        files.iter().for_each(|(name, text)| std::fs::write(folder.0.path().join(name), text).unwrap());
        folder
    }

    fn bp(&self, arguments: &[&str]) -> Output {
        let mut command = Command::new(env!("CARGO_BIN_EXE_bp"));
        let output =
            command.current_dir(self.0.path()).args(arguments).stdin(Stdio::null()).output().unwrap();
        assert!(!stderr(&output).contains("panicked"), "{}", stderr(&output));
        output
    }

    /// The output and the messages of a command that ends with this status.
    pub(crate) fn ends(&self, status: i32, arguments: &[&str]) -> (String, String) {
        let output = self.bp(arguments);
        assert_eq!(output.status.code(), Some(status), "{arguments:?}: {}", stderr(&output));
        (String::from_utf8_lossy(&output.stdout).into_owned(), stderr(&output))
    }

    /// The JSON of a command that ends with this status.
    pub(crate) fn json(&self, status: i32, arguments: &[&str]) -> Value {
        serde_json::from_str(&self.ends(status, arguments).0).unwrap()
    }
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// P(the searched variable is true) of an answer.
fn p_true(answer: &Value) -> f64 {
    answer["answer"][1]["p"].as_f64().unwrap_or_else(|| panic!("{answer}"))
}

fn near(found: f64, expected: f64) {
    assert!((found - expected).abs() < 1e-12, "{found}, expected {expected}");
}

#[test]
fn columns_fill_families() {
    let table = "Alarm[2],Alarm[1]\nfalse,true\n1,NA\n,\nTRUE,T\n";
    let folder = Folder::with(&[("f.bp", FAMILY), ("t.csv", table)]);
    for question in ["P(Fire | Alarm)", "P(Fire | Alarm = alarm)"] {
        let answers = folder.json(0, &["ask", "f.bp", question, "--data", "t.csv", "--json"]);
        // 0.1 · 0.9 · 0.1 against 0.9 · 0.2 · 0.8; 0.1 · 0.9 against 0.9 · 0.2; 0.1; 0.1 · 0.81 against 0.9 · 0.04.
        let expected = [0.009 / 0.153, 1.0 / 3.0, 0.1, 0.081 / 0.117];
        for (row, expected) in expected.into_iter().enumerate() {
            near(p_true(&answers["cases"][row]), expected);
        }
        let ln = answers["cases"][1]["ln_evidence"].as_f64().unwrap();
        near(ln, 0.27f64.ln());
    }
    // By sums too, whose families are written out where an element is missing.
    let by = folder.json(0, &["ask", "f.bp", "P(Fire | Alarm)", "--data", "t.csv", "--by", "sums", "--json"]);
    near(p_true(&by["cases"][1]), 1.0 / 3.0);
    let missing = Folder::with(&[("f.bp", FAMILY), ("t.csv", "Alarm[1]\n1\n")]);
    let (_, message) = missing.ends(1, &["ask", "f.bp", "P(Fire | Alarm)", "--data", "t.csv"]);
    assert!(message.contains("there is no column `Alarm[2]`"), "{message}");
    let set = FAMILY.replace("[i in 1..=2]", "[i in Rooms]").replace("prod(i)", "prod(i in Rooms)");
    let rooms = Folder::with(&[("f.bp", &set), ("t.csv", "Alarm[0],Alarm[1]\n1,0\n")]);
    let answers = rooms.json(0, &["ask", "f.bp", "P(Fire | Alarm)", "--data", "t.csv", "--json"]);
    near(p_true(&answers["cases"][0]), 0.009 / 0.153);
    let (page, _) = rooms.ends(0, &["batch", "f.bp", "--cases", "t.csv", "--only", "Fire"]);
    assert!(page.lines().nth(1).unwrap().contains(",0.058823529411764"), "{page}");
}

#[test]
fn a_case_without_an_answer_leaves_the_others_theirs() {
    let folder = Folder::with(&[("z.bp", ZEROS), ("t.csv", "C,K\ntrue,0\nfalse,2\nfalse,1\n")]);
    let ask = ["ask", "z.bp", "P(B | C K)", "--data", "t.csv"];
    let (page, message) = folder.ends(1, &ask);
    assert!(
        page.contains("row 2\n\n  no answer: the evidence of `P(B | C = true, K = 0)` has probability zero"),
        "{page}"
    );
    assert!(page.contains("row 3\n\n  no answer") && page.contains("`P(K)` is 0 for `K = 2`"), "{page}");
    assert!(page.contains("row 4\nP(B | C = false, K = 1)") && page.contains("0.500000"), "{page}");
    assert!(message.starts_with("error: 2 of 3 rows have no answer:\n  row 2: the evidence of"), "{message}");
    let answers = folder.json(1, &[&ask[..], &["--json"]].concat());
    assert_eq!(answers["cases"][0]["row"], 2);
    assert!(answers["cases"][1]["error"].as_str().unwrap().contains("`P(K)` is 0 for `K = 2`"), "{answers}");
    near(p_true(&answers["cases"][2]), 0.5);
    let (page, message) = folder.ends(1, &["batch", "z.bp", "--cases", "t.csv", "--only", "B"]);
    assert!(page.lines().nth(3).unwrap().ends_with(",0.5,0.5,"), "{page}");
    assert!(message.contains("2 of 3 cases have no answer; their rows give the reasons"), "{message}");
    // An error of the table itself is an error of all cases.
    let wrong = Folder::with(&[("z.bp", ZEROS), ("t.csv", "C,K\nfalse,1\nfalse,7\n")]);
    let (page, message) = wrong.ends(1, &ask);
    assert!(page.is_empty() && message.contains("row 3, column `K`: `7` is not a value"), "{page}{message}");
}

#[test]
fn a_sequence_without_an_answer_leaves_the_others_theirs() {
    let rows = "who,Z\na,false\nb,true\nb,false\nc,\n";
    let table = "who,Z\na,false\nb,true\nb,false\n";
    // Z is true only if R is, and R keeps its value: in b R is certain; in a its odds are ¼ to ½.
    let sure = UMBRELLA.replace("bernoulli(0.5);\n        P(R |", "bernoulli(0);\n        P(R |");
    let folder = Folder::with(&[("u.bp", UMBRELLA), ("s.bp", &sure), ("r.csv", rows), ("t.csv", table)]);
    let ask = ["ask", "u.bp", "filter P(R | Z)", "--data", "r.csv", "--sequence", "who", "--json"];
    let answers = folder.json(0, &ask);
    near(p_true(&answers["sequences"][0]["answers"]), 1.0 / 3.0);
    near(p_true(&answers["sequences"][1]["answers"]), 1.0);
    near(p_true(&answers["sequences"][2]["answers"]), 0.5);
    let ask = ["ask", "s.bp", "filter P(R | Z)", "--data", "t.csv", "--sequence", "who"];
    let (page, message) = folder.ends(1, &ask);
    assert!(page.contains("who b\n\n  no answer: the evidence of `filter P(R | Z), instant 1`"), "{page}");
    assert!(page.contains("who a\nfilter P(R | Z)"), "{page}");
    assert!(message.contains("1 of 2 sequences have no answer:\n  who b: "), "{message}");
    let answers = folder.json(1, &[&ask[..], &["--json"]].concat());
    near(p_true(&answers["sequences"][0]["answers"]), 0.0);
    assert!(
        answers["sequences"][1]["error"].as_str().unwrap().contains("`Z = true` is impossible"),
        "{answers}"
    );
}

#[test]
fn evidence_that_no_draw_met_is_rare_or_impossible() {
    let folder = Folder::with(&[("z.bp", ZEROS)]);
    for by in ["weighting", "gibbs"] {
        let (_, message) = folder.ends(1, &["ask", "z.bp", "P(B | C = true)", "--by", by]);
        assert!(message.contains("has probability zero") && message.contains("`P(C | B)`"), "{message}");
        let (_, message) = folder.ends(1, &["ask", "z.bp", "P(B | K = 2)", "--by", by]);
        assert!(message.contains("`P(K)` is 0 for `K = 2`"), "{message}");
    }
    // P(all 40) = 10⁻⁸⁰ · ½, but no draw of 100 has D: rare, not impossible.
    let rare = "program Rare { variables { D : bool; X, Y : real; } decomposition { P(D) P(X | D) P(Y | X) }
        forms { P(D) = bernoulli(1e-9); P(X | D) = if D { uniform(10, 11) } else { uniform(0, 1) };
                P(Y | X) = uniform(X, X + 1); } }";
    let folder = Folder::with(&[("r.bp", rare)]);
    let (_, message) = folder.ends(1, &["ask", "r.bp", "P(D | Y = 10.5)", "--particles", "100"]);
    assert!(
        message.contains("none of 100 draws met the evidence of `P(D | Y = 10.5)`: it is rare or"),
        "{message}"
    );
    assert!(!message.contains("probability zero") && message.contains("--particles"), "{message}");
}

#[test]
fn no_entropy_is_below_zero() {
    let folder = Folder::with(&[("z.bp", ZEROS)]);
    let minus = [
        "-0.0",
        "bits\":-",
        "\"C\":-",
        "entropy\":-",
        "information\":-",
        "divergence\":-",
        "expectation\":-",
    ];
    let no_minus = |page: &str| minus.iter().for_each(|minus| assert!(!page.contains(minus), "{page}"));
    no_minus(&folder.ends(0, &["observe", "z.bp", "--about", "B", "--json"]).0);
    no_minus(&folder.ends(0, &["observe", "z.bp", "--about", "K", "--json"]).0);
    no_minus(&folder.ends(0, &["joint", "z.bp", "--of", "C", "--json"]).0);
    no_minus(&folder.ends(0, &["joint", "z.bp", "--of", "B,C", "--json"]).0);
    for question in [
        "entropy P(C | B)",
        "information P(B C)",
        "divergence P(B) from P(B | C = false)",
        "expectation P(C)",
    ] {
        no_minus(&folder.ends(0, &["ask", "z.bp", question, "--json"]).0);
    }
}

#[test]
fn arrays_give_sizes() {
    let program = "program Rooms {
        variables { Hot : bool; Alarm[i in Rooms] : bool; }
        decomposition { P(Hot) prod(i in Rooms) { P(Alarm[i] | Hot) } }
        forms { P(Hot) = bernoulli(0.1); P(Alarm[i] | Hot) = bernoulli(if Hot { hit[i] } else { 0.2 }); }
        question hot { P(Hot | Alarm = alarm) }
    }";
    let folder = Folder::with(&[("r.bp", program)]);
    // 0.1 · 0.9 · (1 − 0.6) against 0.9 · 0.2 · 0.8.
    let answer =
        folder.json(0, &["ask", "r.bp", "hot", "--set", "hit=0.9,0.6", "--set", "alarm=1,0", "--json"]);
    near(p_true(&answer), 0.036 / 0.18);
    // The values of a family also determine its size: 0.1 · 0.9 · 0.1 against 0.9 · 0.2 · 0.8.
    let set = FAMILY.replace("[i in 1..=2]", "[i in Rooms]").replace("prod(i)", "prod(i in Rooms)");
    let folder = Folder::with(&[("f.bp", &set)]);
    let answer = folder.json(0, &["ask", "f.bp", "P(Fire | Alarm = a)", "--set", "a=1,0", "--json"]);
    near(p_true(&answer), 0.009 / 0.153);
}

#[test]
fn a_match_of_many_arms_is_linear() {
    let arms: Vec<String> =
        (0..20_000).map(|k| format!("l{k} => {}", if k % 4 == 3 { 0.9 } else { 0.1 })).collect();
    let labels: Vec<String> = (0..20_001).map(|k| format!("l{k}")).collect();
    let program = format!(
        "program Many {{ parameters {{ rest : probability = 0.5; }} variables {{ K : {{ {} }}; B : bool; }}
         decomposition {{ P(K) P(B | K) }}
         forms {{ P(K) = uniform; P(B | K) = bernoulli(match K {{ {}, _ => rest }}); }} }}",
        labels.join(", "),
        arms.join(", ")
    );
    let folder = Folder::with(&[("m.bp", &program)]);
    let begun = std::time::Instant::now();
    let answer = folder.json(0, &["ask", "m.bp", "P(B)", "--json"]);
    // A quarter of 20 000 at 0.9, the others at 0.1, one at 0.5.
    near(p_true(&answer), (5000.0 * 0.9 + 15_000.0 * 0.1 + 0.5) / 20_001.0);
    let answer = folder.json(0, &["ask", "m.bp", "P(B | K = l20000)", "--json"]);
    near(p_true(&answer), 0.5);
    assert!(begun.elapsed().as_secs() < 60, "{:?}", begun.elapsed());
}

#[test]
fn integers_are_values_by_every_strategy() {
    let program = "program Integers { variables { K : 2..=4; B : bool; } decomposition { P(K) P(B | K) }
        forms { P(K) = categorical(0.2, 0.3, 0.5); P(B | K) = table { 2: 0.9, 0.1; 3: 0.6, 0.4; 4: 0.2, 0.8; }; } }";
    let folder = Folder::with(&[("k.bp", program)]);
    for by in ["sums", "join_tree"] {
        // The ordinals 0, 1, 2 are the values 2, 3, 4.
        for (value, expected) in [("2", 0.1), ("3", 0.4), ("4", 0.8)] {
            let question = format!("P(B | K = {value})");
            let answer = folder.json(0, &["ask", "k.bp", &question, "--by", by, "--json"]);
            near(p_true(&answer), expected);
        }
        let answer = folder.json(0, &["ask", "k.bp", "P(K | B = true)", "--by", by, "--json"]);
        // 0.2 · 0.1 + 0.3 · 0.4 + 0.5 · 0.8 = 0.54.
        near(p_true(&answer), 0.12 / 0.54);
    }
}

#[test]
fn the_first_of_a_known_family() {
    let known = "program First {
        variables { C : 1..=3; G[i in 1..=3] : bool; Z : 1..=4; }
        decomposition { P(C) prod(i) { P(G[i] | C) } P(Z | G C) }
        forms { P(C) = uniform; P(G[i] | C) = bernoulli(if i == C { 0.9 } else { 0.2 }); P(Z | G C) = FORM; }
    }";
    let first = known.replace("FORM", "dirac(first(G))");
    let with = known.replace("FORM", "dirac(first(G with O at C))").replace("P(Z | G C)", "P(Z | G C O)");
    let with = with.replace("{ C :", "{ O : bool; C :").replace("{ P(C) prod", "{ P(O) P(C) prod");
    let with = with.replace("forms {", "forms { P(O) = bernoulli(0.5);");
    // The same with a length that is given.
    let long = first
        .replace("parameters", "")
        .replace("program First {", "program First { parameters { N : size; }");
    let long = long.replace("G[i in 1..=3]", "G[i in 1..=N]");
    let folder = Folder::with(&[("f.bp", &first), ("w.bp", &with), ("n.bp", &long)]);
    for (family, expected) in [("false,true,true", 2), ("true,false,true", 1), ("false,false,false", 4)] {
        let family = format!("g={family}");
        for file in ["f.bp", "n.bp"] {
            let ask = ["ask", file, "argmax P(Z | C = 3, G = g)", "--set", &family, "--json"];
            let answer = folder.json(0, &ask);
            assert_eq!(
                answer["answer"][0]["values"]["Z"],
                expected.to_string(),
                "{file}, {family}: {answer}"
            );
        }
    }
    // Without its element C: of (t, f, t) at C = 1 the third is first, at C = 2 the first.
    for (cell, expected) in [(1, "3"), (2, "1")] {
        let question = format!("argmax P(Z | C = {cell}, O = false, G = g)");
        let answer = folder.json(0, &["ask", "w.bp", &question, "--set", "g=true,false,true", "--json"]);
        assert_eq!(answer["answer"][0]["values"]["Z"], expected, "{answer}");
    }
    // P(C = 2 | G = f, t, f, Z = 2) = 0.8 · 0.9 · 0.8 over that and twice 0.1 · 0.2 · 0.8.
    let ask = ["ask", "f.bp", "P(C | G = g, Z = 2)", "--set", "g=false,true,false", "--json"];
    near(folder.json(0, &ask)["answer"][1]["p"].as_f64().unwrap(), 0.576 / (0.576 + 0.032));
}

#[test]
fn messages_name_the_question_and_the_reason() {
    let far = "program Far { variables { X, Y : real; B : bool; } decomposition { P(X) P(Y | X) P(B | X) }
        forms { P(X) = normal(0, 1); P(Y | X) = normal(X, 1); P(B | X) = bernoulli(if X > 0 { 0.9 } else { 0.1 }); } }";
    let walk = UMBRELLA.replace("Z : bool", "Z, H : bool").replace("P(Z | R) }", "P(Z | R) P(H | R) }");
    let walk = walk.replace("P(Z | R) = ", "P(H | R) = bernoulli(0.5); P(Z | R) = ");
    let folder = Folder::with(&[
        ("z.bp", ZEROS),
        ("u.bp", &walk),
        ("f.bp", far),
        ("t.csv", "Z\ntrue\n"),
        ("i.csv", "Z\n1\n"),
    ]);
    let fails = |arguments: &[&str], words: &[&str]| {
        let (_, message) = folder.ends(1, arguments);
        words.iter().for_each(|words| assert!(message.contains(words), "{arguments:?}: {message}"));
    };
    // Each side of a divergence is printed as it was typed.
    let question = "divergence filter P(R | Z) from filter P(R | Z virtual [0, 0.5])";
    let (_, message) = folder.ends(0, &["ask", "u.bp", question, "--data", "t.csv"]);
    assert!(message.is_empty(), "{message}");
    let sure = walk.replace("bernoulli(if R { 0.5 } else { 0 })", "bernoulli(0)");
    std::fs::write(folder.0.path().join("s.bp"), sure).unwrap();
    let (_, message) = folder.ends(1, &["ask", "s.bp", question, "--data", "t.csv"]);
    assert!(
        message.contains("the evidence of `filter P(R | Z), instant 1`") && !message.contains("virtual"),
        "{message}"
    );
    fails(
        &["ask", "u.bp", "draw(2) sequence P(H | Z)", "--data", "t.csv"],
        &["`draw(2) sequence` is of all that is carried", "search `R` too"],
    );
    fails(
        &["ask", "z.bp", "divergence P(B | C virtual [1, 2]) from P(B)", "--by", "weighting"],
        &["`weighting` answers by draws"],
    );
    fails(&["ask", "f.bp", "P(X | Y = 1)", "--table"], &["`gaussian` answers with a normal law"]);
    fails(&["ask", "z.bp", "P(B | C virtual [0, 1])"], &["`C virtual [0, 1]` is impossible; see `P(C | B)`"]);
    fails(
        &["ask", "z.bp", "P(K | B = true, C = true)"],
        &["`P(C | B)` is 0 for `C = true` where `B = true`"],
    );
    let family = FAMILY.replace("0.2", "0");
    let folder = Folder::with(&[("f.bp", &family)]);
    let (_, message) =
        folder.ends(1, &["ask", "f.bp", "P(Alarm | Fire = false, Alarm = a)", "--set", "a=0,1"]);
    assert!(message.contains("asks what it knows"), "{message}");
    // A family that is named whole stands for its elements.
    let whole = folder.json(0, &["joint", "f.bp", "--of", "Alarm", "--json"]);
    assert_eq!(whole, folder.json(0, &["joint", "f.bp", "--of", "Alarm[1],Alarm[2]", "--json"]));
    let sure = family.replace("bernoulli(0.1)", "bernoulli(0)");
    let folder = Folder::with(&[("f.bp", &sure)]);
    let (_, message) = folder.ends(1, &["ask", "f.bp", "P(Fire | Alarm = a)", "--set", "a=0,1"]);
    assert!(message.contains("has probability zero"), "{message}");
}

#[test]
fn batches_of_programs_with_reals() {
    let normal = "program Sum { variables { X, Y : real; } decomposition { P(X) P(Y | X) }
        forms { P(X) = normal(0, 1); P(Y | X) = normal(X, 1); } }";
    let switch = "program Switch { variables { S : bool; X : real; } decomposition { P(S) P(X | S) }
        forms { P(S) = bernoulli(0.25); P(X | S) = normal(if S { 2 } else { 0 }, 1); } }";
    let folder = Folder::with(&[
        ("n.bp", normal),
        ("s.bp", switch),
        ("y.csv", "Y\n2\nNA\n"),
        ("s.csv", "S\ntrue\nNA\n"),
    ]);
    // X | Y = 2 is N(1, √½); ln p(Y = 2) = −1 − ½ ln 4π.
    let page = folder.ends(0, &["batch", "n.bp", "--cases", "y.csv", "--only", "X"]).0;
    let lines: Vec<&str> = page.lines().collect();
    assert_eq!(lines[0], "ln_p_evidence,X.mean,X.deviation,error");
    let numbers =
        |line: &str| -> Vec<f64> { line.split(',').take(3).map(|cell| cell.parse().unwrap()).collect() };
    let found = numbers(lines[1]);
    near(found[0], -1.0 - 0.5 * (4.0 * std::f64::consts::PI).ln());
    near(found[1], 1.0);
    near(found[2], 0.5f64.sqrt());
    assert_eq!(numbers(lines[2]), [0.0, 0.0, 1.0]);
    // X | S = true is N(2, 1); without S the mean is ½ and the variance 1 + 4 · ¼ · ¾.
    let page = folder.ends(0, &["batch", "s.bp", "--cases", "s.csv", "--only", "X"]).0;
    let lines: Vec<&str> = page.lines().collect();
    near(numbers(lines[1])[1], 2.0);
    near(numbers(lines[2])[1], 0.5);
    near(numbers(lines[2])[2], 1.75f64.sqrt());
}

//! The `bp` command: data files, evidence and written files.
//!
//! In: the built binary, and files as pandas, R, spreadsheets and people write them. Out: answers, messages, exit
//! statuses. Invariant: every command reads the same file as the same table; expected numbers are computed by hand.

use serde_json::Value;
use std::path::Path;
use std::process::{Command, Output};

const PROGRAM: &str = "program Pandas {
    variables { A : 0..=2; B : bool; C : { low, high }; }
    decomposition { P(A) P(B | A) P(C | B) }
    forms {
        P(A) = categorical(0.2, 0.3, 0.5);
        P(B | A) = table { 0: 0.5, 0.5; 1: 0.9, 0.1; 2: 0.2, 0.8; };
        P(C | B) = table { false: 0.25, 0.75; true: 0.5, 0.5; };
    }
}
";

const UNKNOWN: &str = "program Pandas {
    variables { A : 0..=2; B : bool; C : { low, high }; }
    decomposition { P(A) P(B | A) P(C | B) }
    forms { P(A) = unknown(histogram); P(B | A) = unknown(histogram); P(C | B) = unknown(histogram); }
}
";

const KALMAN: &str = "program K {
    variables { X, X^-1, Z : real; }
    decomposition { P(X^-1) P(X | X^-1) P(Z | X) }
    forms {
        P(X^-1) = previous(X) else normal(0, 1);
        P(X | X^-1) = normal(X^-1, 1);
        P(Z | X) = normal(X, 1);
    }
}
";

pub(super) struct Folder(tempfile::TempDir);

impl Folder {
    pub(super) fn with(files: &[(&str, &[u8])]) -> Self {
        let folder = Self(tempfile::tempdir().unwrap());
        files.iter().for_each(|(name, bytes)| folder.write(name, bytes));
        folder
    }

    fn path(&self) -> &Path {
        self.0.path()
    }

    pub(super) fn write(&self, name: &str, bytes: impl AsRef<[u8]>) {
        std::fs::write(self.path().join(name), bytes).unwrap();
    }

    pub(super) fn read(&self, name: &str) -> String {
        std::fs::read_to_string(self.path().join(name)).unwrap()
    }

    fn bp(&self, arguments: &[&str]) -> Output {
        let mut command = Command::new(env!("CARGO_BIN_EXE_bp"));
        let output = command.current_dir(self.path()).args(arguments).output().unwrap();
        assert!(!stderr(&output).contains("panicked"), "{}", stderr(&output));
        output
    }

    /// The output of a successful command.
    pub(super) fn well(&self, arguments: &[&str]) -> String {
        let output = self.bp(arguments);
        assert_eq!(output.status.code(), Some(0), "{arguments:?}: {}", stderr(&output));
        String::from_utf8(output.stdout).unwrap()
    }

    /// The message of a command with exit status 1.
    pub(super) fn ill(&self, arguments: &[&str]) -> String {
        let output = self.bp(arguments);
        assert_eq!(output.status.code(), Some(1), "{arguments:?}: {}", stderr(&output));
        stderr(&output)
    }
}

fn stderr(output: &Output) -> String {
    String::from_utf8(output.stderr.clone()).unwrap()
}

const COMMANDS: [&[&str]; 3] = [
    &["ask", "p.bp", "P(A | B C)", "--json", "--data"],
    &["batch", "p.bp", "--cases"],
    &["learn", "unknown.bp", "--json", "--data"],
];

#[test]
fn every_command_reads_every_writing_of_a_table() {
    let folder = Folder::with(&[("p.bp", PROGRAM.as_bytes()), ("unknown.bp", UNKNOWN.as_bytes())]);
    let plain = "A,B,C\n1,true,low\n,false,high\n2,,low\n";
    folder.write("plain.csv", plain);
    let expected: Vec<String> =
        COMMANDS.iter().map(|command| folder.well(&[*command, &["plain.csv"]].concat())).collect();
    // P(A | B = true, C = low) is as P(A) P(B = true | A): 0.1, 0.03, 0.4.
    let answer: Value = serde_json::from_str(&expected[0]).unwrap();
    let first = &answer["cases"][0]["answer"];
    for (row, p) in [0.1, 0.03, 0.4].into_iter().enumerate() {
        assert!((first[row]["p"].as_f64().unwrap() - p / 0.53).abs() < 1e-14, "{first}");
    }
    let latest: [&[u8]; 9] = [
        b"A,B,C\n1.0,True,low\nNaN,False,high\n2.0,NaN,low\n",
        b"\"A\",\"B\",\"C\"\n\"1\",\"TRUE\",\"low\"\nNA,\"FALSE\",\"high\"\n2,NA,\"low\"\n",
        b"\xef\xbb\xbfA,B,C\r\n1,TRUE,low\r\n?,FALSE,high\r\n2,,low\r\n",
        b"A;B;C\n1,0;1;low\n;0;high\n2;;low\n",
        b"A\tB\tC\n1\t1.0\tlow\n\t0.0\thigh\n2\t\tlow\n",
        b"A, B, C\n1, true, low\n, false, high\n2, , low\n",
        b",A,B,C\n0,1.0,True,low\n1,,False,high\n2,2.0,,low\n",
        b"\n\nA,B,C\n1,true,low\n\n,false,high\n\n2,nan,low\n\n",
        b"C,B,A\nlow,T,1\nhigh,F,NULL\nlow,None,2\n",
    ];
    for writing in latest {
        folder.write("other.csv", writing);
        for (command, expected) in COMMANDS.iter().zip(&expected) {
            let found = folder.well(&[*command, &["other.csv"]].concat());
            assert_eq!(found, *expected, "{command:?} {}", String::from_utf8_lossy(writing));
        }
    }
    folder.write("bar.csv", plain.replace(',', "|"));
    let table = folder.well(&[COMMANDS[0], &["bar.csv", "--separator", "|"]].concat());
    assert_eq!(table, expected[0]);
    folder.write("semicolon.csv", "A;B;C\n1;true;low\n");
    let noted = stderr(&folder.bp(&[COMMANDS[0], &["semicolon.csv"]].concat()));
    assert_eq!(noted, "semicolon.csv: note: its columns are separated by semicolons\n");
}

#[test]
fn every_command_refuses_the_same_files_in_the_same_words() {
    let folder = Folder::with(&[("p.bp", PROGRAM.as_bytes()), ("unknown.bp", UNKNOWN.as_bytes())]);
    let wrong: [(&[u8], &str); 9] = [
        (b"A,A,B,C\n1,2,true,low\n", "`d.csv`: row 1 names the column `A` twice"),
        (b"A,B,C\n1,true,low\n2,false\n", "`d.csv`: row 3 has 2 cells, but there are 3 columns"),
        (
            b"A,B,C\n1,true,low\n2,false,\"high\n",
            "`d.csv`: row 3 opens a quotation mark that is never closed",
        ),
        (
            b"A,B,C\n1,maybe,low\n",
            "`d.csv`, row 2, column `B`: `maybe` is not a value of `B`, which is `bool`",
        ),
        (b"A,B,C\n\n1,true,hihg\n", "`d.csv`, row 3, column `C`: `hihg` is not a value of `C`"),
        (b"\xff\xfeA\0,\0B\0\n\0", "`d.csv`: UTF-16 text; save it as UTF-8"),
        (b"A,B,C\n1,true,\xe4\n", "`d.csv`: row 2 is not UTF-8 text"),
        (b"", "`d.csv`: row 1 must name the columns, but the file is empty"),
        (b"A,B,C\n1,true,low\0\n", "`d.csv`: row 2 contains a zero byte"),
    ];
    for (bytes, expected) in wrong {
        folder.write("d.csv", bytes);
        for command in COMMANDS {
            let found = folder.ill(&[command, &["d.csv"]].concat());
            assert!(found.contains(expected), "{command:?}: {found}");
        }
    }
    folder.write("d.csv", "a,b,c\n1,true,low\n");
    for command in &COMMANDS[..2] {
        let found = folder.ill(&[*command, &["d.csv"]].concat());
        assert!(found.contains("did you mean"), "{command:?}: {found}");
    }
    let endless = folder.ill(&[COMMANDS[0], &["/dev/zero"]].concat());
    assert!(endless.contains("it holds more than 256 MiB"), "{endless}");
}

#[test]
fn missing_is_one_thing_over_time() {
    let folder = Folder::with(&[("k.bp", KALMAN.as_bytes())]);
    let filter = |bytes: &str| {
        folder.write("d.csv", bytes);
        let ignore: &[&str] = if bytes.contains('w') { &["--ignore", "w"] } else { &[] };
        folder.well(&[&["ask", "k.bp", "filter P(X | Z)", "--data", "d.csv", "--json"], ignore].concat())
    };
    let named = filter("Z,w\n1,1\nNA,1\n?,1\n,1\n");
    // Before the first row the variance is 1 + 1; with the reading 2/3, and each instant adds 1.
    let answer: Value = serde_json::from_str(&named).unwrap();
    let figure = |name: &str| answer["answer"][0][name].as_f64().unwrap();
    assert!((figure("mean") - 2.0 / 3.0).abs() < 1e-14, "{answer}");
    assert!((figure("deviation").powi(2) - 11.0 / 3.0).abs() < 1e-13, "{answer}");
    assert_eq!(filter("Z\n1\n\n\n\n"), named);
    assert_eq!(filter("Z\r\n1\r\nNaN\r\n\"\"\r\nnull"), named);
    assert_eq!(filter("Z;w\n1,0;1\n;1\n;1\n;1\n"), named);
    let wrong = folder.path().join("d.csv");
    std::fs::write(wrong, "Z\n1\n\ninf\n").unwrap();
    let found = folder.ill(&["ask", "k.bp", "filter P(X | Z)", "--data", "d.csv"]);
    assert!(found.contains("`d.csv`, row 4, column `Z`: `inf` is not a value of `Z`"), "{found}");
}

const UAI: &str = "BAYES\n2\n2 2\n2\n1 0\n2 0 1\n\n2\n 0.25 0.75\n\n4\n 0.5 0.5\n 0.2 0.8\n";

#[test]
fn sequences_are_answered_apart_and_columns_have_names() {
    let folder = Folder::with(&[
        ("k.bp", KALMAN.as_bytes()),
        ("two.csv", b"town,Z\na,1\nb,3\n"),
        ("typo.csv", b"z\n1\n"),
    ]);
    // The state has variance 2 before the reading, so the mean is ⅔ of the reading.
    fn on<'a>(more: &[&'a str]) -> Vec<&'a str> {
        [&["ask", "k.bp", "filter P(X | Z)", "--data", "two.csv"], more].concat()
    }
    let answer: Value = serde_json::from_str(&folder.well(&on(&["--sequence", "town", "--json"]))).unwrap();
    for (number, (name, mean)) in [("a", 2.0 / 3.0), ("b", 2.0)].into_iter().enumerate() {
        let one = &answer["sequences"][number];
        assert_eq!(one["sequence"], name);
        let found = one["answers"]["answer"][0]["mean"].as_f64().unwrap();
        assert!((found - mean).abs() < 1e-12, "{answer}");
    }
    let text = folder.well(&on(&["--sequence", "town"]));
    assert!(text.starts_with("town a\n") && text.contains("\ntown b\n"), "{text}");
    // As one sequence: from N(⅔, ⅔) the second reading is weighed by (⅔ + 1) / (⅔ + 2) = ⅝, ⅔ + ⅝ · 7/3 = 17/8.
    let answer: Value = serde_json::from_str(&folder.well(&on(&["--ignore", "town", "--json"]))).unwrap();
    let found = answer["answer"][0]["mean"].as_f64().unwrap();
    assert!((found - 17.0 / 8.0).abs() < 1e-12, "{answer}");

    let wrong = folder.ill(&on(&[]));
    assert!(
        wrong.contains("column `town` is not a variable of `K`") && wrong.contains("--ignore town"),
        "{wrong}"
    );
    let wrong = folder.ill(&["ask", "k.bp", "filter P(X | Z)", "--data", "typo.csv"]);
    assert!(wrong.contains("column `z`") && wrong.contains("did you mean `Z`?"), "{wrong}");
    let wrong = folder.ill(&[
        "ask",
        "k.bp",
        "filter P(X | Z = z)",
        "--data",
        "two.csv",
        "--ignore",
        "town",
        "--set",
        "z=1",
    ]);
    assert!(wrong.contains("`z`") && wrong.contains("each instant has its own value"), "{wrong}");
    let wrong = folder.ill(&["ask", "k.bp", "filter P(X | Z)"]);
    assert!(wrong.contains("it is asked over time: give the observations"), "{wrong}");
}

#[test]
fn evidence_is_json_or_uai_and_names_nothing_twice() {
    let folder = Folder::with(&[("x.uai", UAI.as_bytes()), ("x.uai.evid", b"1\n1 1 0\n")]);
    // P(0 | 1 = 0): 0.125 to 0.15.
    let expected = 0.125 / 0.275;
    for arguments in [
        &["marginals", "x.uai", "--evidence", "x.uai.evid", "--json"][..],
        &["marginals", "x.uai", "x.uai.evid", "--json"],
        &["marginals", "x.uai", "--evidence", r#"{"1": 0}"#, "--json"],
        &["marginals", "x.uai", "--evidence", r#"{"1": 0.0, "0": null}"#, "--json"],
        &["marginals", "x.uai", "--evidence", r#"{"1": "0", "0": "NA"}"#, "--json"],
    ] {
        let answer: Value = serde_json::from_str(&folder.well(arguments)).unwrap();
        let p = answer["posteriors"]["0"]["0"].as_f64().unwrap();
        assert!((p - expected).abs() < 1e-15, "{arguments:?}: {answer}");
    }
    folder.write("two.evid", "2\n1 1 0\n1 0 1\n");
    let table = folder.well(&["batch", "x.uai", "--cases", "two.evid", "--only", "0"]);
    let row: Vec<&str> = table.lines().nth(1).unwrap().split(',').collect();
    assert!((row[1].parse::<f64>().unwrap() - expected).abs() < 1e-15, "{table}");
    assert_eq!(table.lines().count(), 3);
    for (evidence, expected) in [
        (r#"{"1": 0, "1": 1}"#, "`1` occurs twice"),
        (r#"{"1": 2}"#, "`2` is not a value of `1`, which is `0..=1`"),
        ("two.evid", "`two.evid` holds 2 cases"),
        ("x.uai", "`x.uai` is neither a JSON object"),
    ] {
        let found = folder.ill(&["marginals", "x.uai", "--evidence", evidence]);
        assert!(found.contains(expected), "{found}");
    }
    folder.write("twice.evid", "1\n2 1 0 1 1\n");
    assert!(folder.ill(&["mpe", "x.uai", "twice.evid"]).contains("variable 1 is known twice"));
    let hint = folder.ill(&["ask", "x.uai", "P(0 | 1 = 0)"]);
    assert!(hint.contains("is written in quotes: `\""), "{hint}");
    folder.well(&["ask", "x.uai", "P(\"0\" | \"1\" = 0)"]);
}

#[cfg(unix)]
#[test]
fn devices_and_links_are_written_through() {
    let folder =
        Folder::with(&[("p.bp", PROGRAM.as_bytes()), ("d.csv", b"B,C\ntrue,low\n"), ("old.csv", b"old")]);
    let batch = |out: &str| folder.bp(&["batch", "p.bp", "--cases", "d.csv", "--out", out]);
    let expected = folder.well(&["batch", "p.bp", "--cases", "d.csv"]);
    std::os::unix::fs::symlink("old.csv", folder.path().join("link.csv")).unwrap();
    assert!(batch("link.csv").status.success());
    assert_eq!(
        (folder.read("old.csv"), folder.path().join("link.csv").is_symlink()),
        (expected.clone(), true)
    );
    let printed = batch("/dev/stdout");
    assert_eq!(String::from_utf8(printed.stdout).unwrap(), expected);
    assert!(batch("/dev/null").status.success() && !Path::new("/dev/null").is_file());
    let made = Command::new("mkfifo").arg(folder.path().join("pipe")).status().unwrap();
    assert!(made.success());
    let mut reader = Command::new("cat")
        .arg(folder.path().join("pipe"))
        .stdout(std::process::Stdio::piped())
        .spawn()
        .unwrap();
    assert!(batch("pipe").status.success());
    let mut text = String::new();
    std::io::Read::read_to_string(reader.stdout.as_mut().unwrap(), &mut text).unwrap();
    reader.wait().unwrap();
    assert_eq!(text, expected);
    assert!(!folder.path().join("pipe").is_file(), "the pipe was replaced");
    let entries = std::fs::read_dir(folder.path()).unwrap().count();
    assert_eq!(entries, 5, "p.bp, d.csv, old.csv, link.csv, pipe, and nothing else");
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_is_an_error() {
    let folder = Folder::with(&[("p.bp", PROGRAM.as_bytes()), ("d.csv", b"B,C\ntrue,low\n")]);
    let full = folder.ill(&["batch", "p.bp", "--cases", "d.csv", "--out", "/dev/full"]);
    assert!(full.contains("`/dev/full`: No space left on device"), "{full}");
    let stdout = std::fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
    let output = Command::new(env!("CARGO_BIN_EXE_bp"))
        .current_dir(folder.path())
        .args(["batch", "p.bp", "--cases", "d.csv"])
        .stdout(stdout)
        .output()
        .unwrap();
    assert_eq!(output.status.code(), Some(1));
    assert!(stderr(&output).contains("stdout cannot be written"), "{}", stderr(&output));
}

#[test]
fn a_row_without_an_element_of_a_slice_is_answered_without_it() {
    let program = "program Line { variables { T : real; W[1..=2] : real; } decomposition { P(T) prod(i) { P(W[i] | T) } }
        forms { P(T) = normal(0, 1); P(W[i] | T) = normal(T, 1); } }";
    let rows = "\"W[1]\",\"W[2]\"\n1,0.5\n2,NA\n1,1\n";
    let folder = Folder::with(&[("line.bp", program.as_bytes()), ("rows.csv", rows.as_bytes())]);
    for question in ["expectation P(T | W[1..=2])", "expectation P(T | W[1], W[2])"] {
        let output = folder.bp(&["ask", "line.bp", question, "--data", "rows.csv"]);
        let text = String::from_utf8(output.stdout.clone()).unwrap();
        assert_eq!(output.status.code(), Some(0), "{question}: {}", String::from_utf8_lossy(&output.stderr));
        // The sum of the observations, divided by one more than their number: 1.5 / 3, 2 / 2, 2 / 3.
        for expected in ["0.5", "1", "0.666667"] {
            assert!(
                text.split_whitespace()
                    .any(|word| word.trim_end_matches('0').trim_end_matches('.') == expected),
                "{question}: {text}"
            );
        }
    }
}

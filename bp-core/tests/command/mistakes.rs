//! Golden mistakes: the messages for wrong questions and wrong data.
//!
//! In: the transcripts of `tests/mistakes`: a program, then commands (`$ bp ask program.bp 'P(X)'`), each with the lines that it
//! prints; `data: A,B | 1,2` before a command is its file `data.csv`, with `|` between lines. Out: the same lines. With `BLESS=1` in
//! the environment the lines are written instead. Invariant: every command fails, and prints nothing but its error.

use std::path::Path;
use std::process::Command;

/// How many mistakes there are at least.
const MISTAKES: usize = 40;

/// The words of a command line, in which single quotes keep blanks.
fn words(line: &str) -> Vec<String> {
    let mut words = vec![String::new()];
    let mut quoted = false;
    for character in line.chars() {
        match character {
            '\'' => quoted = !quoted,
            ' ' if !quoted => words.push(String::new()),
            other => words.last_mut().unwrap().push(other),
        }
    }
    words
}

/// The standard error of a command, run beside these files.
fn printed(program: &str, data: &str, line: &str) -> String {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("program.bp"), program).unwrap();
    std::fs::write(folder.path().join("data.csv"), data.replace(" | ", "\n") + "\n").unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_bp"));
    let output = command.current_dir(folder.path()).args(&words(line)[1..]).output().unwrap();
    assert_eq!(output.status.code(), Some(1), "{line}: {output:?}");
    assert!(output.stdout.is_empty(), "{line}: {output:?}");
    let text = String::from_utf8(output.stderr).unwrap();
    text.lines().map(|line| line.trim_end().to_owned() + "\n").collect()
}

/// The transcript as the commands print now, and how many there are.
fn again(written: &str) -> (String, usize) {
    let begins = written.find("\ndata: ").into_iter().chain(written.find("\n$ bp ")).min().unwrap() + 1;
    let (program, rest) = written.split_at(begins);
    let (mut page, mut data, mut count) = (program.to_owned(), "", 0);
    for line in rest.lines() {
        if let Some(cells) = line.strip_prefix("data: ") {
            data = cells;
            page.push_str(&format!("{line}\n"));
        } else if let Some(command) = line.strip_prefix("$ ") {
            page.push_str(&format!("{line}\n{}\n", printed(program, data, command)));
            (data, count) = ("", count + 1);
        }
    }
    (page, count)
}

#[test]
fn mistakes_get_their_messages() {
    let bless = std::env::var_os("BLESS").is_some_and(|value| value == "1");
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/mistakes");
    let (mut different, mut count) = (Vec::new(), 0);
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let written = std::fs::read_to_string(&path).unwrap();
        let (page, own) = again(&written);
        count += own;
        if bless {
            std::fs::write(&path, &page).unwrap();
        } else if page != written {
            different.push(format!("{} now reads\n{page}", path.display()));
        }
    }
    assert!(count >= MISTAKES, "only {count} mistakes");
    assert!(different.is_empty(), "BLESS=1 accepts these pages:\n{}", different.join("\n"));
}

//! The page of `bvm`: each command with its options, and its errors.
//!
//! In: the help of every command, and the error types of the source. Out: `docs/reference/bvm.md`, which must list each of them; `BLESS=1` writes it anew.
//! Invariant: the page and the commands have one source.

use super::help::{choices, commands, escaped, help};
use super::kinds::kinds;
use std::fmt::Write;
use std::path::Path;

const HEAD: &str = "# Options and errors of `bvm`

Each command with its arguments and options. `bvm COMMAND --help` has examples. Every command has `--help`. A command ends with the
exit status 1 if data are wrong, and with 2 if the command line is.
";

/// Where the error types are.
const ERRORS: [(&str, &str); 6] = [
    ("Commands and runs", "error.rs"),
    ("Grids", "grid/configuration.rs"),
    ("Vision", "vision/error.rs"),
    ("Hearing", "audition/error.rs"),
    ("Balance", "vestibular/error.rs"),
    ("Pictures", "report/mod.rs"),
];

fn section(text: &mut String, command: &[&str], words: &str) {
    let shown = help(env!("CARGO_BIN_EXE_bvm"), command);
    let own = commands(&shown);
    write!(text, "\n## bvm {}\n\n{}.\n", command.join(" "), escaped(words)).unwrap();
    if own.is_empty() {
        text.push_str("\n| option | what it does |\n|---|---|\n");
        for choice in choices(&shown) {
            writeln!(
                text,
                "| `{}` | {} |",
                choice.typed.replace('|', "\\|"),
                escaped(&choice.words).replace('|', "\\|")
            )
            .unwrap();
        }
    }
    for (name, words) in own {
        section(text, &[command, &[name.as_str()]].concat(), &words);
    }
}

#[test]
fn every_option_of_every_command_stands_on_the_page() {
    let mut found = HEAD.to_owned();
    for (name, words) in commands(&help(env!("CARGO_BIN_EXE_bvm"), &[])) {
        section(&mut found, &[&name], &words);
    }
    found.push_str("\n## Errors\n\nThe messages about wrong data. `…` stands for a name or a number.\n");
    for (part, file) in ERRORS {
        write!(found, "\n### {part}\n\n").unwrap();
        // A kind without a text of its own has that of another part.
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
        for (_, when, words) in kinds(&root.join(file)).iter().filter(|(_, _, words)| !words.is_empty()) {
            writeln!(found, "- {}\n  - {}", escaped(when), escaped(words)).unwrap();
        }
    }
    assert!(found.matches("| `--").count() > 40, "{}", found.matches("| `--").count());
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/reference/bvm.md");
    if std::env::var_os("BLESS").is_some() {
        std::fs::write(&path, &found).unwrap();
    }
    let there = std::fs::read_to_string(&path).unwrap_or_default();
    assert!(there == found, "docs/reference/bvm.md is not that of `bvm --help`; BLESS=1 writes it anew");
}

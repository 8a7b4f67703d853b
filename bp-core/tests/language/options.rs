//! The page of options: each option of `bp`, with the commands that have it.
//!
//! In: the help of every command. Out: `docs/reference/options.md`, which must list each of them; `BLESS=1` writes it anew.
//! Invariant: the page and the commands have one source.

use crate::help::{Choice, choices, commands, escaped, help};
use crate::pages::root;
use std::collections::BTreeMap;
use std::fmt::Write;

const HEAD: &str = "# Options of `bp`

Each option, with the commands that have it. `bp COMMAND --help` lists those of one command, with examples; `bp reference --plot`
prints an entry of this page. Every command has `--help`. The options of `bvm` are on [a page of their own](bvm.md).

| command | what it does |
|---|---|
";

fn page() -> String {
    let program = env!("CARGO_BIN_EXE_bp");
    let (mut text, mut options) = (HEAD.to_owned(), BTreeMap::<String, Vec<(String, Choice)>>::new());
    for (command, words) in commands(&help(program, &[])) {
        writeln!(text, "| `bp {command}` | {} |", escaped(&words)).unwrap();
        for choice in choices(&help(program, &[&command])) {
            if choice.name.starts_with("--") {
                options.entry(choice.name.clone()).or_default().push((command.clone(), choice));
            }
        }
    }
    for (name, all) in options {
        let used: Vec<String> = all.iter().map(|(command, _)| format!("`bp {command}`")).collect();
        write!(text, "\n### {name}\n\n`{}`: an option of {}.\n\n", all[0].1.typed, used.join(", ")).unwrap();
        // Commands that say the same share a line.
        let mut meanings: Vec<(String, Vec<String>)> = Vec::new();
        for (command, choice) in &all {
            match meanings.iter_mut().find(|(words, _)| *words == choice.words) {
                Some((_, commands)) => commands.push(format!("**{command}**")),
                None => meanings.push((choice.words.clone(), vec![format!("**{command}**")])),
            }
        }
        for (words, commands) in meanings {
            writeln!(text, "- {}: {}", commands.join(", "), escaped(&words)).unwrap();
        }
    }
    text
}

#[test]
fn every_option_of_every_command_stands_on_the_page() {
    let (found, path) = (page(), root().join("docs/reference/options.md"));
    assert!(found.matches("\n### --").count() > 40, "{}", found.matches("\n### --").count());
    if std::env::var_os("BLESS").is_some() {
        std::fs::write(&path, &found).unwrap();
    }
    let there = std::fs::read_to_string(&path).unwrap_or_default();
    assert!(there == found, "docs/reference/options.md is not that of `bp --help`; BLESS=1 writes it anew");
}

//! The page of messages: each diagnostic of programs and network files, with the line that causes it, and each kind of error.
//!
//! In: the golden messages `tests/errors/*.txt`, the source of the parser, the checker and the readers of networks, and the kinds
//! of `Error`. Out: `docs/reference/messages.md`, which must list each of them; `BLESS=1` writes it anew. Invariant: the page and
//! the code have one source; a message without an example is listed as the code has it.

use super::kinds::{HOLE, kinds, literals, template};
use super::pages::root;
use bp_core::compiler::reference::{about, entries};
use std::collections::BTreeSet;
use std::fmt::Write;
use std::path::{Path, PathBuf};

const HEAD: &str = "# Messages

What the language says about a wrong program: each message, the line that caused it in a test, the help that came with it, and the
entry of the reference that explains it. The messages are grouped by the mistakes of the test programs in `tests/errors`; after them
stand [the messages without an example](#messages-without-an-example) and [the errors of data and
questions](#errors-of-data-and-questions).
";

/// A diagnostic: its message, its first line of source, its help.
fn diagnostics(page: &str) -> Vec<(String, String, String)> {
    let mut found: Vec<(String, String, String)> = Vec::new();
    for line in page.lines() {
        if let Some(message) = line.strip_prefix("error: ") {
            found.push((message.to_owned(), String::new(), String::new()));
            continue;
        }
        let Some((_, source, help)) = found.last_mut() else { continue };
        if let Some((_, words)) = line.split_once("│ Help: ") {
            *help = words.trim().to_owned();
        } else if let Some((number, text)) = line.split_once('│')
            && number.trim().parse::<usize>().is_ok()
            && source.is_empty()
        {
            *source = text.trim().to_owned();
        }
    }
    found
}

fn page() -> String {
    let folder = root().join("tests/errors");
    let mut paths: Vec<_> = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    paths.retain(|path| path.extension().is_some_and(|extension| extension == "txt"));
    paths.sort();
    let (mut text, mut seen) = (HEAD.to_owned(), BTreeSet::new());
    for path in paths {
        let title = path.file_stem().unwrap().to_string_lossy().replace('_', " ");
        let all = diagnostics(&std::fs::read_to_string(&path).unwrap());
        let new: Vec<_> = all.into_iter().filter(|(message, _, _)| seen.insert(message.clone())).collect();
        if new.is_empty() {
            continue;
        }
        writeln!(text, "\n## {title}\n").unwrap();
        for (message, source, help) in new {
            let code = |text: &str| match text.contains('`') {
                true => format!("`` {text} ``"),
                false => format!("`{text}`"),
            };
            // Pieces of source in a message are no markup.
            write!(text, "- {}", message.replace("](", "]\u{200b}(")).unwrap();
            if !source.is_empty() {
                write!(text, "\n  - at {}", code(&source)).unwrap();
            }
            if !help.is_empty() {
                write!(text, "\n  - help: {}", help.replace("](", "]\u{200b}(")).unwrap();
            }
            text.push_str(&see(&message));
            text.push('\n');
        }
    }
    let examples: Vec<String> = seen.into_iter().collect();
    let others: BTreeSet<String> = (templates().into_iter())
        .filter(|template| !examples.iter().any(|example| matches(template, example)))
        .collect();
    text.push_str(
        "\n## Messages without an example\n\n`…` stands for a name, a number or a piece of the program.\n\n",
    );
    for template in others {
        let shown = template.replace("](", "]\u{200b}(").replace(HOLE, "…");
        writeln!(text, "- {shown}{}", see(&template.replace(HOLE, "…"))).unwrap();
    }
    text.push_str(
        "\n## Errors of data and questions\n\nThe kinds of `bp_core::Error`, with their texts.\n\n",
    );
    for (kind, when, words) in kinds(&root().join("bp-core/src/compiler/error.rs")) {
        writeln!(text, "- **{kind}**: {when}\n  - {}", words.replace("](", "]\u{200b}(")).unwrap();
    }
    text
}

/// A line that links to the entry about a message, if there is one.
fn see(message: &str) -> String {
    let Some(name) = about(message) else { return String::new() };
    let page = |kind: &str| if kind == "words" { "structure".to_owned() } else { kind.to_owned() };
    let entry =
        entries().into_iter().find(|entry| entry.kind != "options" && entry.names.contains(&name.as_str()));
    match entry {
        Some(entry) => {
            let anchor = entry.names.join("-").replace(' ', "-");
            format!("\n  - see [{name}]({}.md#{anchor})", page(entry.kind))
        }
        None => format!("\n  - see [{name}]({}.md)", page(&name)),
    }
}

/// Whether a message has the form of a template.
fn matches(template: &str, message: &str) -> bool {
    let pieces: Vec<&str> = template.split(HOLE).collect();
    let mut rest = message;
    for (place, piece) in pieces.iter().enumerate() {
        match rest.find(piece) {
            Some(at) if place > 0 || at == 0 => rest = &rest[at + piece.len()..],
            _ => return false,
        }
    }
    rest.is_empty() || pieces.last().is_some_and(|last| last.is_empty())
}

/// Rust files below a folder.
fn sources(folder: &Path, found: &mut Vec<PathBuf>) {
    for path in std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()) {
        match path.is_dir() {
            true => sources(&path, found),
            false => found.push(path),
        }
    }
}

/// The commas of a call outside its inner brackets, as far as it is given; `None` after its end.
fn commas(arguments: &str) -> Option<usize> {
    let (mut depth, mut count) = (0, 0);
    for character in arguments.chars() {
        if depth < 0 {
            return None;
        }
        match character {
            '(' | '[' | '{' => depth += 1,
            ')' | ']' | '}' => depth -= 1,
            ',' if depth == 0 => count += 1,
            _ => {}
        }
    }
    (depth >= 0).then_some(count)
}

/// The templates of all messages that the parser, the checker and the readers of networks build.
fn templates() -> Vec<String> {
    let mut paths = Vec::new();
    for folder in ["syntax/check", "syntax/parse", "io"] {
        sources(&root().join("bp-core/src/compiler").join(folder), &mut paths);
    }
    let mut found = Vec::new();
    for path in paths {
        let text = std::fs::read_to_string(path).unwrap();
        let code = text.split("#[cfg(test)]").next().unwrap_or("");
        // A call that builds a diagnostic, or the message that is given to it.
        for (marker, most) in
            [("Diagnostic::new(", 1), ("complain(", 1), ("complain_and_help(", 1), ("let message =", 9)]
        {
            for (at, _) in code.match_indices(marker) {
                let statement = code[at + marker.len()..].split(";\n").next().unwrap_or("");
                // The message is the second argument of a call; a text further behind is a help.
                let before = statement.split('"').next().unwrap_or("");
                if marker.ends_with('(') && commas(before) != Some(1) {
                    continue;
                }
                let messages = literals(statement)
                    .into_iter()
                    .filter(|literal| literal.trim().contains(' ') && !literal.starts_with([' ', ';']));
                found.extend(messages.take(most).map(|literal| template(&literal)));
            }
        }
    }
    assert!(found.len() > 150, "{} messages in the source", found.len());
    found
}

#[test]
fn every_message_of_the_tests_stands_on_the_page() {
    let (found, path) = (page(), root().join("docs/reference/messages.md"));
    assert!(found.matches("\n- ").count() > 150, "{}", found.matches("\n- ").count());
    if std::env::var_os("BLESS").is_some() {
        std::fs::write(&path, &found).unwrap();
    }
    let there = std::fs::read_to_string(&path).unwrap_or_default();
    assert!(there == found, "docs/reference/messages.md is not that of tests/errors; BLESS=1 writes it anew");
}

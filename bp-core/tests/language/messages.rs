//! The page of messages: each diagnostic of the language with the line that causes it.
//!
//! In: the golden messages `tests/errors/*.txt`. Out: `docs/reference/messages.md`, which must list each of them;
//! `BLESS=1` writes it anew. Invariant: the page and the tests of messages have one source.

use super::pages::root;
use std::collections::BTreeSet;
use std::fmt::Write;

const HEAD: &str = "# Messages

What the language says about a wrong program: each message, the line that caused it in a test, and the help that came with it. The
messages are grouped by the mistakes of the test programs in `tests/errors`.
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
            text.push('\n');
        }
    }
    text
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

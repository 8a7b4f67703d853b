//! The commands of the gallery's page: `docs/gallery.md` shows the output of `bp`.
//!
//! In: the page. Out: pass or fail; with `BLESS=1` the page is rewritten, for review. Invariant: each block begins with
//! a command, followed by its whole output. Commands run one after the other in a folder that holds only the
//! examples: a later command may read the files of an earlier one.

use std::path::Path;
use std::process::Command;

/// The words of a command; quotes hold words together.
fn words(line: &str) -> Vec<String> {
    let (mut words, mut quoted) = (vec![String::new()], false);
    for character in line.chars() {
        match character {
            '\'' => quoted = !quoted,
            ' ' if !quoted => words.push(String::new()),
            other => words.last_mut().unwrap().push(other),
        }
    }
    words
}

/// A folder with the programs of the gallery and their data.
fn with_examples(root: &Path) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    for part in ["examples", "examples/data"] {
        std::fs::create_dir(folder.path().join(part)).unwrap();
        for entry in std::fs::read_dir(root.join(part)).unwrap().map(|entry| entry.unwrap()) {
            if entry.path().is_file() {
                std::fs::copy(entry.path(), folder.path().join(part).join(entry.file_name())).unwrap();
            }
        }
    }
    folder
}

#[test]
fn the_page_shows_the_output_of_bp() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let path = root.join("docs/gallery.md");
    let page = std::fs::read_to_string(&path).unwrap();
    let folder = with_examples(&root);
    let (mut shown, mut inside, mut commands) = (String::new(), false, 0);
    for line in page.lines() {
        if let Some(command) = line.strip_prefix("$ bp ") {
            let run = Command::new(env!("CARGO_BIN_EXE_bp"))
                .args(words(command))
                .current_dir(folder.path())
                .output();
            let run = run.unwrap();
            assert!(run.status.success(), "{line}\n{}", String::from_utf8_lossy(&run.stderr));
            let output = String::from_utf8(run.stdout).unwrap();
            let output: Vec<&str> = output.lines().map(str::trim_end).collect();
            shown.push_str(&format!("{line}\n{}\n", output.join("\n").trim_end()));
            (inside, commands) = (true, commands + 1);
        } else if !inside || line == "```" {
            shown.push_str(&format!("{line}\n"));
            inside = false;
        }
    }
    assert!(commands >= 30, "only {commands} commands on the page");
    if std::env::var_os("BLESS").is_some() {
        std::fs::write(&path, &shown).unwrap();
    }
    let now = std::fs::read_to_string(&path).unwrap();
    let differs = shown.lines().zip(now.lines()).find(|(one, other)| one != other);
    assert!(shown == now, "docs/gallery.md is not the output of `bp`: {differs:?}; see with BLESS=1");
}

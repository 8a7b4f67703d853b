//! The commands of the gallery's page: `docs/gallery.md` shows what `bp` says.
//!
//! In: the page. Out: nothing where all is well; with `BLESS=1` the page is written anew, to be looked at. Invariant: each
//! block begins with a command, and what follows is its whole output.

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

#[test]
fn the_page_shows_what_bp_says() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let path = root.join("docs/gallery.md");
    let page = std::fs::read_to_string(&path).unwrap();
    let (mut said, mut inside, mut commands) = (String::new(), false, 0);
    for line in page.lines() {
        if let Some(command) = line.strip_prefix("$ bp ") {
            let run = Command::new(env!("CARGO_BIN_EXE_bp")).args(words(command)).current_dir(&root).output();
            let run = run.unwrap();
            assert!(run.status.success(), "{line}\n{}", String::from_utf8_lossy(&run.stderr));
            let output = String::from_utf8(run.stdout).unwrap();
            let output: Vec<&str> = output.lines().map(str::trim_end).collect();
            said.push_str(&format!("{line}\n{}\n", output.join("\n").trim_end()));
            (inside, commands) = (true, commands + 1);
        } else if !inside || line == "```" {
            said.push_str(&format!("{line}\n"));
            inside = false;
        }
    }
    assert!(commands >= 30, "only {commands} commands on the page");
    if std::env::var_os("BLESS").is_some() {
        std::fs::write(&path, &said).unwrap();
    }
    let now = std::fs::read_to_string(&path).unwrap();
    let differs = said.lines().zip(now.lines()).find(|(one, other)| one != other);
    assert!(said == now, "docs/gallery.md is not what `bp` says: {differs:?}; see with BLESS=1");
}

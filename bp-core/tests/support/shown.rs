//! Pages that show commands with their output.
//!
//! In: the text of a page, a command, and a folder with the files that it reads. Out: the page as the command prints it now.
//! Invariant: a block begins with `$ COMMAND …` and shows its whole output, or with `… | head -N` its first lines; other blocks
//! are left alone. Commands run one after the other: a later one may read the files of an earlier one.

use std::path::Path;
use std::process::Command;

/// A command whose output pages show.
pub(crate) struct Shown<'s> {
    /// Its name on the pages: `bp`.
    pub(crate) name: &'s str,
    /// The program.
    pub(crate) program: &'s str,
    /// Where it runs.
    pub(crate) folder: &'s Path,
}

/// The words of a command; quotes hold words together.
pub(crate) fn words(line: &str) -> Vec<String> {
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

impl Shown<'_> {
    /// What a command prints.
    pub(crate) fn run(&self, command: &str) -> String {
        let run = Command::new(self.program).args(words(command)).current_dir(self.folder).output().unwrap();
        assert!(run.status.success(), "{command}\n{}", String::from_utf8_lossy(&run.stderr));
        String::from_utf8(run.stdout).unwrap()
    }

    /// The page with the outputs of its commands, and how many commands it has.
    pub(crate) fn rerun(&self, page: &str) -> (String, usize) {
        let (mut shown, mut inside, mut commands) = (String::new(), false, 0);
        let prompt = format!("$ {} ", self.name);
        for line in page.lines() {
            if let Some(command) = line.strip_prefix(&prompt) {
                let (command, most) = match command.split_once(" | head -") {
                    Some((command, lines)) => (command, lines.parse().unwrap()),
                    None => (command, usize::MAX),
                };
                let output = self.run(command);
                let output: Vec<&str> = output.lines().map(str::trim_end).take(most).collect();
                shown.push_str(&format!("{line}\n{}\n", output.join("\n").trim_end()));
                (inside, commands) = (true, commands + 1);
            } else if !inside || line == "```" {
                shown.push_str(&format!("{line}\n"));
                inside = false;
            }
        }
        (shown, commands)
    }

    /// Compares a page with the output of its commands; `BLESS=1` writes it anew. The number of commands.
    #[track_caller]
    pub(crate) fn check(&self, path: &Path) -> usize {
        let page = std::fs::read_to_string(path).unwrap();
        let (shown, commands) = self.rerun(&page);
        if std::env::var_os("BLESS").is_some() {
            std::fs::write(path, &shown).unwrap();
        }
        let now = std::fs::read_to_string(path).unwrap();
        let differs = shown.lines().zip(now.lines()).find(|(one, other)| one != other);
        let (page, name) = (path.display(), self.name);
        assert!(shown == now, "{page} is not the output of `{name}`: {differs:?}; see with BLESS=1");
        commands
    }
}

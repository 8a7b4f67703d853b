//! The options of a command, from its own help.
//!
//! In: the text of `COMMAND --help`. Out: its commands, and the options of each. Invariant: `--help` and `--version`, which every
//! command has, are left out.

use std::process::Command;

/// An option, or an argument without a name.
pub(crate) struct Choice {
    /// `--plot`, or `FILE`.
    pub(crate) name: String,
    /// As it is typed: `--plot <FILE>`.
    pub(crate) typed: String,
    /// What it does.
    pub(crate) words: String,
}

/// The help of a program or of one of its commands, in long lines.
pub(crate) fn help(program: &str, command: &[&str]) -> String {
    let output = Command::new(program).args(command).arg("--help").output().unwrap();
    assert!(output.status.success(), "{command:?}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

/// The lines of a part of a help, such as `Options:`.
fn part<'h>(help: &'h str, title: &str) -> impl Iterator<Item = &'h str> {
    let lines = help.lines().skip_while(move |line| *line != title).skip(1);
    lines.take_while(|line| line.is_empty() || line.starts_with(' '))
}

/// The commands of a program, each with what it does.
pub(crate) fn commands(help: &str) -> Vec<(String, String)> {
    let mut found: Vec<(String, String)> = Vec::new();
    for line in part(help, "Commands:") {
        match (line.strip_prefix("  ").filter(|rest| !rest.starts_with(' ')), found.last_mut()) {
            (Some(rest), _) if !rest.is_empty() => {
                let (name, words) = rest.split_once(' ').unwrap_or((rest, ""));
                found.push((name.to_owned(), words.trim().to_owned()));
            }
            (_, Some((_, words))) if !line.trim().is_empty() => words.push_str(&format!(" {}", line.trim())),
            _ => {}
        }
    }
    found.retain(|(name, _)| name != "help");
    found
}

/// The arguments and the options of a command.
pub(crate) fn choices(help: &str) -> Vec<Choice> {
    let mut found: Vec<Choice> = Vec::new();
    for line in part(help, "Arguments:").chain(part(help, "Options:")) {
        let text = line.trim();
        let begins = line.starts_with("  ") && !line.starts_with("           ") && !text.is_empty();
        let remark =
            text.starts_with("[default") || text.starts_with("[possible") || text.starts_with("[alias");
        if begins && !remark && text.starts_with(['-', '<', '[']) {
            let (typed, words) = text.split_once("  ").unwrap_or((text, ""));
            let typed = typed.rsplit_once(", ").map_or(typed, |(_, long)| long).to_owned();
            let name = typed.split([' ', '[']).find(|word| !word.is_empty()).unwrap_or("");
            let name = name.trim_matches(['<', '>', '[', ']', '.', '=']).to_owned();
            found.push(Choice { name, typed, words: words.trim().to_owned() });
        } else if let (Some(choice), false) = (found.last_mut(), text.is_empty()) {
            let blank = if choice.words.is_empty() { "" } else { " " };
            choice.words.push_str(&format!("{blank}{text}"));
        }
    }
    found.retain(|choice| !["--help", "--version"].contains(&choice.name.as_str()));
    found
}

/// Text of a help as Markdown: `<` and `|` are no markup.
pub(crate) fn escaped(text: &str) -> String {
    let pieces: Vec<String> = (text.split('`').enumerate())
        .map(|(place, piece)| match place % 2 {
            0 => piece.replace('<', "\\<").replace('*', "\\*"),
            _ => piece.to_owned(),
        })
        .collect();
    pieces.join("`")
}

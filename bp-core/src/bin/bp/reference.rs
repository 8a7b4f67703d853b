//! `bp reference`: an entry of the reference.
//!
//! In: a name. Out: its entry, as text. Invariant: the text is that of the pages under `docs/reference`.

use crate::failure::Failure;
use crate::wrap;
use bp_core::compiler::reference::{self, Entry, kinds};
use std::io::Write;

/// Explain a domain, form, function, question or word of the language, or an option.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  bp reference                (all names)
  bp reference poisson
  bp reference --plot
  bp reference forms          (each form in a line)

`bp help` describes the commands.")]
pub(crate) struct Arguments {
    /// A name such as `poisson` or `--plot`, or a kind: `domains`, `forms`, `functions`, `questions`, `words`, `options`.
    #[arg(allow_hyphen_values = true)]
    name: Option<String>,
}

pub(crate) fn run(arguments: &Arguments, out: &mut impl Write) -> Result<(), Failure> {
    let all = reference::entries();
    let Some(name) = &arguments.name else {
        for kind in kinds() {
            let names: Vec<_> = of(&all, kind).flat_map(|entry| entry.names.iter().copied()).collect();
            write!(out, "{}", wrap::wrapped(&format!("{kind}: "), &names.join(", "), 4))?;
        }
        writeln!(out, "\n`bp reference NAME` prints an entry.")?;
        return Ok(());
    };
    if kinds().any(|kind| kind == name) {
        for entry in of(&all, name) {
            write!(out, "{}", wrap::wrapped("", &plain(entry.summary()), 4))?;
        }
        return Ok(());
    }
    let found = reference::meant(name);
    if found.is_empty() {
        return Err(Failure::Words(reference::unknown(name)));
    }
    for (position, entry) in found.iter().enumerate() {
        if position > 0 {
            writeln!(out)?;
        }
        write(entry, out)?;
    }
    Ok(())
}

fn of<'e>(all: &'e [Entry], kind: &str) -> impl Iterator<Item = &'e Entry> {
    all.iter().filter(move |entry| entry.kind == kind)
}

fn write(entry: &Entry, out: &mut impl Write) -> std::io::Result<()> {
    writeln!(out, "{} ({})\n", entry.names.join(", "), entry.kind)?;
    let mut program = false;
    for line in entry.text.lines() {
        if line.starts_with("```") {
            program = !program;
        } else if program {
            writeln!(out, "    {line}")?;
        } else {
            let hang = if line.starts_with("- ") { 2 } else { 0 };
            write!(out, "{}", wrap::wrapped("", &plain(line), hang))?;
        }
    }
    Ok(())
}

/// Markdown without emphasis, escapes and the targets of links.
fn plain(line: &str) -> String {
    let (mut shown, mut rest) = (String::new(), line);
    while let Some((before, after)) = rest.split_once("](") {
        shown.push_str(&before.replacen('[', "", usize::from(before.contains('['))));
        rest = after.split_once(')').map_or("", |(_, rest)| rest);
    }
    shown.push_str(rest);
    shown.replace("**", "").replace("\\<", "<").replace("\\*", "*")
}

//! `bp new`: a first program, with data and Rust code that run at once.
//!
//! In: a name. Out: a folder of this name with `NAME.bp`, `NAME.csv`, `src/main.rs` and `Cargo.toml`. Invariant: nothing
//! that exists is changed; an illegal name writes nothing.

use crate::failure::Failure;
use bp_core::compiler::error::Error;
use bp_core::compiler::files;
use std::io::Write;
use std::path::{Path, PathBuf};

/// Write a commented program, a small data file and Rust code that run at once.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  bp new lawn
  bp ask lawn/lawn.bp rain
  bp learn lawn/lawn.bp --data lawn/lawn.csv
  cd lawn && cargo run

The name becomes that of the folder, the program and the package: letters,
digits and underscores, a letter first. A folder that exists is refused.")]
pub(crate) struct Arguments {
    /// The name.
    name: String,
    /// The checkout of bp-core for Cargo.toml; by default that from which this command was built.
    #[arg(long, value_name = "FOLDER")]
    library: Option<PathBuf>,
}

const PROGRAM: &str = include_str!("new/program.bp");
const DATA: &str = include_str!("new/data.csv");
const CODE: &str = include_str!("new/main.rs.txt");
const PACKAGE: &str = include_str!("new/package.toml.txt");

/// Words that are no name of a package.
const RESERVED: [&str; 12] = [
    "test",
    "core",
    "std",
    "alloc",
    "proc_macro",
    "self",
    "super",
    "crate",
    "build",
    "deps",
    "examples",
    "incremental",
];

pub(crate) fn run(arguments: &Arguments, out: &mut impl Write) -> Result<(), Failure> {
    let name = &arguments.name;
    if let Some(why) = illegal(name) {
        return Err(Failure::Words(format!("`{name}` cannot be the name: {why}")));
    }
    let folder = Path::new(name);
    if folder.symlink_metadata().is_ok() {
        return Err(Failure::Words(format!("`{name}` exists; nothing was written")));
    }
    let library = arguments.library.clone().unwrap_or_else(|| PathBuf::from(env!("CARGO_MANIFEST_DIR")));
    let title = title(name);
    let filled = |text: &str| {
        text.replace("TITLE", &title).replace("NAME", name).replace("LIBRARY", &library.display().to_string())
    };
    let written = [
        (folder.join(format!("{name}.bp")), filled(PROGRAM)),
        (folder.join(format!("{name}.csv")), DATA.to_owned()),
        (folder.join("src").join("main.rs"), filled(CODE)),
        (folder.join("Cargo.toml"), filled(PACKAGE)),
    ];
    let source = folder.join("src");
    std::fs::create_dir_all(&source).map_err(|error| Error::file(&source, error))?;
    for (path, text) in &written {
        files::write(path, text.as_bytes()).map_err(|error| Error::file(path, error))?;
        writeln!(out, "{}", path.display())?;
    }
    writeln!(out, "\nTry:\n  bp ask {name}/{name}.bp rain\n  bp print {name}/{name}.bp")?;
    writeln!(out, "  bp learn {name}/{name}.bp --data {name}/{name}.csv\n  cd {name} && cargo run")?;
    Ok(())
}

/// Why a name is illegal.
fn illegal(name: &str) -> Option<String> {
    let first = name.chars().next();
    let other = name.chars().find(|letter| !letter.is_ascii_alphanumeric() && *letter != '_');
    match (first, other) {
        (None, _) => Some("it is empty".to_owned()),
        (_, Some(letter)) => {
            Some(format!("it has `{}`; use letters, digits and underscores", letter.escape_default()))
        }
        (Some(first), _) if !first.is_ascii_alphabetic() => Some("it must begin with a letter".to_owned()),
        _ if name.len() > 64 => Some("it is longer than 64 letters".to_owned()),
        _ if RESERVED.contains(&name) || bp_core::compiler::spelling::RESERVED.contains(&name) => {
            Some("it is a word of Cargo or of the language".to_owned())
        }
        _ => None,
    }
}

/// The name of the program: `wet_lawn` becomes `WetLawn`.
fn title(name: &str) -> String {
    let part = |part: &str| {
        let mut letters = part.chars();
        letters
            .next()
            .map_or_else(String::new, |first| first.to_ascii_uppercase().to_string() + letters.as_str())
    };
    name.split('_').map(part).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names() {
        assert!(["lawn", "wet_lawn", "A1"].iter().all(|name| illegal(name).is_none()));
        let wrong = ["", "1st", "_x", "a-b", "a/b", "..", "été", "test", "table", "a b"];
        assert!(wrong.iter().all(|name| illegal(name).is_some()));
        assert_eq!((title("wet_lawn"), title("lawn")), ("WetLawn".to_owned(), "Lawn".to_owned()));
    }
}

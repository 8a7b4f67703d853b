//! The doors to the compiler, and the name that each has for what a message advises.
//!
//! In: the door of this process, once. Out: an `Advice` in the words of that door. Invariant: a name that differs between doors
//! stands in the table below, and nowhere else in the compiler.

use std::fmt::{self, Display, Formatter};
use std::sync::atomic::{AtomicU8, Ordering::Relaxed};

/// How a user reaches the compiler.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Door {
    /// By the crate.
    Rust,
    /// By the commands.
    Command,
    /// By the Python package.
    Python,
}

static DOOR: AtomicU8 = AtomicU8::new(Door::Rust as u8);

/// Sets the door of this process; it is that of Rust by default.
pub fn enter(door: Door) {
    DOOR.store(door as u8, Relaxed);
}

/// What a message advises.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Advice<'a> {
    /// The number of draws or particles.
    Draws,
    /// A strategy.
    By(&'a str),
    /// A column to leave out.
    Ignore(&'a str),
    /// Any columns to leave out.
    IgnoreAny,
    /// A variable without a column.
    Hidden(&'a str),
    /// The column that identifies sequences.
    Sequence(&'a str),
    /// The observations of the instants.
    Instants,
    /// Tables of rows.
    Rows,
    /// A table whose rows are the elements of a set: the set, and the file.
    RowsOf(&'a str, &'a str),
    /// A question about tables of rows.
    AskRows,
    /// The posteriors of missing cells.
    Missing,
    /// The size of a set, or a parameter.
    Set,
    /// The numbers of a table alone, as a sentence.
    NumbersAlone,
    /// The offers of the strategies.
    Explain,
}

impl Display for Advice<'_> {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        const RUST: u8 = Door::Rust as u8;
        const COMMAND: u8 = Door::Command as u8;
        match (self, DOOR.load(Relaxed)) {
            (Advice::Draws, COMMAND) => write!(f, "--particles"),
            (Advice::Draws, _) => write!(f, "draws(n)"),
            (Advice::By(strategy), COMMAND) => write!(f, "--by {strategy}"),
            (Advice::By(strategy), _) => write!(f, "by({strategy:?})"),
            (Advice::Ignore(column), COMMAND) => write!(f, "--ignore {}", of_shell(column)),
            (Advice::Ignore(column), RUST) => write!(f, "ignore({column:?})"),
            (Advice::Ignore(column), _) => write!(f, "ignore=[{column:?}]"),
            (Advice::IgnoreAny, COMMAND) => write!(f, "--ignore"),
            (Advice::IgnoreAny, _) => write!(f, "ignore"),
            (Advice::Hidden(name), COMMAND) => write!(f, "--hidden {}", of_shell(name)),
            (Advice::Hidden(name), RUST) => write!(f, "hidden({name:?})"),
            (Advice::Hidden(name), _) => write!(f, "hidden=[{name:?}]"),
            (Advice::Sequence(column), COMMAND) => write!(f, "--sequence {}", of_shell(column)),
            (Advice::Sequence(column), RUST) => write!(f, "sequence({column:?})"),
            (Advice::Sequence(column), _) => write!(f, "sequence={column:?}"),
            (Advice::Instants, COMMAND) => write!(f, "--data FILE"),
            (Advice::Instants, RUST) => write!(f, "question(…)?.over(&instants)"),
            (Advice::Instants, _) => write!(f, "question(…).over(instants)"),
            (Advice::Rows, COMMAND) => write!(f, "--rows"),
            (Advice::Rows, _) => write!(f, "rows"),
            (Advice::RowsOf(set, file), COMMAND) => write!(f, "--rows {set}={file}"),
            (Advice::RowsOf(set, _), RUST) => write!(f, "Rows::from(path).of({set:?})"),
            (Advice::RowsOf(set, _), _) => write!(f, "rows(table, of=[{set:?}])"),
            (Advice::AskRows, COMMAND) => write!(f, "bp ask FILE 'P(…)' --rows data.csv"),
            (Advice::AskRows, RUST) => write!(f, "program.rows(\"data.csv\")?.ask(\"P(…)\")"),
            (Advice::AskRows, _) => write!(f, "program.rows(table).ask(\"P(…)\")"),
            (Advice::Missing, COMMAND) => write!(f, "--fill FILE"),
            (Advice::Missing, _) => write!(f, "missing()"),
            (Advice::Set, COMMAND) => write!(f, "--set"),
            (Advice::Set, RUST) => write!(f, "with"),
            (Advice::Set, _) => write!(f, "with_"),
            (Advice::NumbersAlone, COMMAND) => write!(f, "`--table` writes the numbers alone"),
            (Advice::NumbersAlone, RUST) => write!(f, "`CompiledQuestion::tables` has the numbers alone"),
            (Advice::NumbersAlone, _) => write!(f, "ask `P(…)` about one variable after the other"),
            (Advice::Explain, COMMAND) => write!(f, "bp explain"),
            (Advice::Explain, RUST) => write!(f, "plan::plan"),
            (Advice::Explain, _) => write!(f, "explain(question)"),
        }
    }
}

/// A name as an argument of a shell.
fn of_shell(name: &str) -> String {
    let plain = |letter: char| letter.is_alphanumeric() || "_-.^".contains(letter);
    if name.chars().all(plain) { name.to_owned() } else { format!("'{}'", name.replace('\'', "'\\''")) }
}

//! Tables of data on the command line: `--data`, `--cases`, `--separator`.
//!
//! In: a path, and optionally the separator. Out: a table. Invariant: decisions of the reader are reported on stderr.

use crate::failure::Failure;
use crate::program::warn;
use bp_core::compiler::answer::OtherColumns;
use bp_core::compiler::data::{self, Records};
use bp_core::compiler::model::{Model, Question};
use std::collections::BTreeSet;
use std::path::Path;

/// The separator option.
#[derive(clap::Args)]
pub(crate) struct Separator {
    /// Column separator: `comma`, `semicolon`, `tab`, or any single character;
    /// by default detected from the first rows.
    #[arg(long, value_name = "SEPARATOR", value_parser = separator)]
    separator: Option<u8>,
}

fn separator(text: &str) -> Result<u8, String> {
    match text.as_bytes() {
        b"comma" => Ok(b','),
        b"semicolon" => Ok(b';'),
        b"tab" | b"\\t" => Ok(b'\t'),
        [one] if one.is_ascii() && !one.is_ascii_alphanumeric() && !b"\"\n\r".contains(one) => Ok(*one),
        _ => Err("expected `comma`, `semicolon`, `tab`, or one character such as `|`".to_owned()),
    }
}

/// Notes the columns that are variables of the program and that no question knows, so that their values change no answer.
pub(crate) fn note_unread(model: &Model, questions: &[Question], table: &Records, others: &OtherColumns) {
    let base = |name: &str| name.split('[').next().unwrap_or(name).trim().to_owned();
    let (mut known, mut searched, mut texts) = (BTreeSet::new(), BTreeSet::new(), Vec::new());
    for question in questions {
        let (model, question) = model.posed(question);
        for ask in &question.asks {
            let all = ask.known.iter().chain(ask.statistic.from()).map(|known| known.variable);
            // A predicate is known by its value, not by a column.
            known.extend(all.map(|variable| base(&model.variable_name(variable))));
            searched.extend(ask.searched.iter().map(|item| base(&model.variable_name(item.variable))));
            texts.push(model.ask_text(ask));
        }
    }
    let names: BTreeSet<String> = model.variables.ids().map(|id| model.variable_name(id)).collect();
    let plate = model.plate_index().map(|id| model.variable_name(id));
    let is_other = |column: &&String| {
        others.ignore.contains(column)
            || others.sequence.as_ref() == Some(column)
            || plate.as_ref() == Some(column)
    };
    let own: Vec<&String> =
        table.columns.iter().filter(|column| !is_other(column) && names.contains(&base(column))).collect();
    let is_read = |column: &&&String| known.contains(&base(column));
    let reads = own.iter().any(|column| is_read(&column));
    // What is searched may stand beside what is known, to be compared with the answers.
    let is_wanted = |column: &&&String| !(reads && searched.contains(&base(column)));
    let unread: Vec<&&String> = own.iter().filter(|column| !is_read(column)).filter(is_wanted).collect();
    let [first, rest @ ..] = unread.as_slice() else { return };
    let (which, it) = match rest {
        [] => (format!("the column `{first}` is not read"), "it"),
        _ => (format!("{} columns, such as `{first}`, are not read", unread.len()), "them"),
    };
    let of = match texts.as_slice() {
        [one] => format!("`{one}` does not know {it}"),
        _ => format!("no question knows {it}"),
    };
    warn(&format!(
        "{}: note: {which}: {of}; what is observed stands behind the bar: `P(… | {first})`",
        table.path.display()
    ));
}

/// Reads a table.
pub(crate) fn open(path: &Path, separator: &Separator) -> Result<Records, Failure> {
    let table = data::open(path, separator.separator)?;
    for note in &table.notes {
        warn(&format!("{}: note: {note}", path.display()));
    }
    Ok(table)
}

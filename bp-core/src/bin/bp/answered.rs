//! Output of answers: one or several, of rows, of sequences.
//!
//! In: answers or errors. Out: tables with bars, or JSON. Invariant: all answers are written before the error that
//! names the first row or sequence without one.

use crate::cases::Answered;
use crate::failure::Failure;
use bp_core::compiler::answer::Answer;
use bp_core::compiler::error::Error;
use serde::Serialize;
use std::io::Write;

/// Serialises a single item as itself, several as a list.
#[derive(Serialize)]
#[serde(untagged)]
pub(crate) enum OneOrSeveral<'t, T> {
    One(&'t T),
    Several(&'t [T]),
}

pub(crate) fn one_or_several<T>(all: &[T]) -> OneOrSeveral<'_, T> {
    match all {
        [one] => OneOrSeveral::One(one),
        several => OneOrSeveral::Several(several),
    }
}

pub(crate) fn write_json(value: &impl Serialize, out: &mut impl Write) -> Result<(), Failure> {
    serde_json::to_writer(&mut *out, value).map_err(std::io::Error::from)?;
    Ok(writeln!(out)?)
}

/// Questions without an answer beside others that have one.
#[derive(Default)]
pub(crate) struct Refused(Vec<(String, Error)>);

impl Refused {
    /// A question and its error; an error that another question has too is added once.
    pub(crate) fn add(&mut self, question: String, error: Error) {
        if self.0.iter().all(|(_, known)| known.to_string() != error.to_string()) {
            self.0.push((question, error));
        }
    }

    /// The result of a command that has written the other answers: these errors, then its own failure.
    pub(crate) fn after(self, written: Result<(), Failure>) -> Result<(), Failure> {
        let own = self.0.into_iter().map(|(_, error)| Failure::from(error));
        let mut failures: Vec<Failure> = own.chain(written.err()).collect();
        let Some(last) = failures.pop() else { return Ok(()) };
        for failure in failures {
            let _ = failure.report();
        }
        Err(last)
    }
}

/// Writes answers, and questions with their errors.
pub(crate) fn write_answers_json(
    answers: &[Answer],
    refused: &Refused,
    out: &mut impl Write,
) -> Result<(), Failure> {
    #[derive(Serialize)]
    #[serde(untagged)]
    enum Entry<'t> {
        Answer(&'t Answer),
        Refused { question: &'t str, error: String },
    }
    // A question alone without an answer writes nothing.
    if answers.is_empty() && !refused.0.is_empty() {
        return Ok(());
    }
    let refused =
        refused.0.iter().map(|(question, error)| Entry::Refused { question, error: error.to_string() });
    let all: Vec<Entry<'_>> = answers.iter().map(Entry::Answer).chain(refused).collect();
    write_json(&one_or_several(&all), out)
}

pub(crate) fn write_answers(answers: &[Answer], all: bool, out: &mut impl Write) -> Result<(), Failure> {
    for (position, answer) in answers.iter().enumerate() {
        if position > 0 {
            writeln!(out)?;
        }
        match all {
            true => write!(out, "{answer:#}")?,
            false => write!(out, "{}", answer.table(all, "--all shows them"))?,
        }
    }
    Ok(())
}

/// Writes the answers of each sequence, under its name; without a name, the answers alone.
pub(crate) fn write_sequences(
    sequences: &[(String, Answered)],
    column: Option<&str>,
    (json, all): (bool, bool),
    out: &mut impl Write,
) -> Result<(), Failure> {
    let Some(column) = column else {
        let answers = sequences.first().and_then(|(_, answers)| answers.as_deref().ok()).unwrap_or_default();
        return match json {
            true => write_json(&one_or_several(answers), out),
            false => write_answers(answers, all, out),
        };
    };
    if json {
        #[derive(Serialize)]
        struct Sequences<'t> {
            sequences: Vec<One<'t>>,
        }
        let all = sequences.iter().map(|(name, answers)| One::of(None, Some(name), answers));
        write_json(&Sequences { sequences: all.collect() }, out)?;
    } else {
        for (position, (name, answers)) in sequences.iter().enumerate() {
            write_one(&format!("{column} {name}"), position, answers, all, out)?;
        }
    }
    all_answered(sequences.iter().map(|(name, answers)| (format!("{column} {name}"), answers)), "sequence")
}

/// Writes the answers of each row, under its row number.
pub(crate) fn write_cases(
    cases: &[(usize, Answered)],
    (json, all): (bool, bool),
    out: &mut impl Write,
) -> Result<(), Failure> {
    if json {
        #[derive(Serialize)]
        #[serde(untagged)]
        enum Case<'t> {
            Answered(OneOrSeveral<'t, Answer>),
            Not(One<'t>),
        }
        #[derive(Serialize)]
        struct Cases<'t> {
            cases: Vec<Case<'t>>,
        }
        let all = cases.iter().map(|(row, answers)| match answers {
            Ok(own) => Case::Answered(one_or_several(own)),
            Err(_) => Case::Not(One::of(Some(*row), None, answers)),
        });
        write_json(&Cases { cases: all.collect() }, out)?;
    } else {
        for (position, (row, answers)) in cases.iter().enumerate() {
            write_one(&format!("row {row}"), position, answers, all, out)?;
        }
    }
    all_answered(cases.iter().map(|(row, answers)| (format!("row {row}"), answers)), "row")
}

/// A row or a sequence, with its answers or its error.
#[derive(Serialize)]
struct One<'t> {
    #[serde(skip_serializing_if = "Option::is_none")]
    row: Option<usize>,
    #[serde(skip_serializing_if = "Option::is_none")]
    sequence: Option<&'t str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    answers: Option<OneOrSeveral<'t, Answer>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    error: Option<String>,
}

impl<'t> One<'t> {
    fn of(row: Option<usize>, sequence: Option<&'t str>, answers: &'t Answered) -> Self {
        let error = answers.as_ref().err().map(Error::to_string);
        let answers = answers.as_ref().ok().map(|answers| one_or_several(answers));
        Self { row, sequence, answers, error }
    }
}

/// Writes the answers of a row or a sequence under its name, or its error.
fn write_one(
    name: &str,
    position: usize,
    answers: &Answered,
    all: bool,
    out: &mut impl Write,
) -> Result<(), Failure> {
    let blank = if position > 0 { "\n" } else { "" };
    writeln!(out, "{blank}{name}")?;
    match answers {
        Ok(answers) => write_answers(answers, all, out),
        Err(error) => Ok(writeln!(out, "\n  no answer: {error}")?),
    }
}

/// An error that names the first row or sequence without an answer, if there is any; it follows the output.
fn all_answered<'t>(all: impl Iterator<Item = (String, &'t Answered)>, what: &str) -> Result<(), Failure> {
    const FEW: usize = 5;
    let (mut count, mut wrong) = (0, Vec::new());
    for (name, answers) in all {
        count += 1;
        wrong.extend(answers.as_ref().err().map(|error| format!("{name}: {error}")));
    }
    if wrong.is_empty() {
        return Ok(());
    }
    let more = wrong.len().saturating_sub(FEW);
    let more = if more > 0 { format!("\n  and {more} more") } else { String::new() };
    let s = if count == 1 { "" } else { "s" };
    let message = format!(
        "{} of {count} {what}{s} have no answer:\n  {}{more}",
        wrong.len(),
        wrong[..wrong.len().min(FEW)].join("\n  ")
    );
    Err(Failure::Words(message))
}

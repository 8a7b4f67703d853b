//! The work of one request: compile a program, or answer a question.
//!
//! In: on stdin the kind of the work in a line, then JSON. Out: JSON on stdout, and an exit status. Invariant: the process
//! ends after [`LIMIT`], whatever the program is.

use crate::failure::Failure;
use crate::page::{Content, Given, answers, content};
use bp_core::compiler::answer::link;
use bp_core::compiler::diagnostic::{Diagnostic, Diagnostics};
use bp_core::compiler::error::Error;
use bp_core::compiler::model::{Model, Question};
use bp_core::compiler::source::Source;
use bp_core::compiler::syntax::compile;
use serde::Deserialize;
use serde_json::{Value, json};
use std::io::{Read, Write};
use std::time::Duration;

/// The time that a request may take.
pub(super) const LIMIT: Duration = Duration::from_secs(10);

/// The exit status after that time.
pub(super) const TOO_LONG: i32 = 3;

/// The exit status for a request that cannot be read.
pub(super) const NOT_UNDERSTOOD: i32 = 4;

/// A request: the text of a program, and of a question its place and what the reader has set.
#[derive(Deserialize)]
struct Asked {
    text: String,
    #[serde(default)]
    question: usize,
    #[serde(flatten)]
    given: Given,
}

pub(super) fn run() -> Result<(), Failure> {
    std::thread::spawn(|| {
        std::thread::sleep(LIMIT);
        std::process::exit(TOO_LONG);
    });
    let mut request = String::new();
    let read = std::io::stdin().read_to_string(&mut request).is_ok();
    let (kind, body) = request.split_once('\n').filter(|_| read).unwrap_or_default();
    let Ok(asked) = serde_json::from_str::<Asked>(body) else { std::process::exit(NOT_UNDERSTOOD) };
    let found = match kind {
        "compile" => compiled(asked.text),
        _ => answered(&asked),
    };
    write!(std::io::stdout(), "{found}").map_err(Failure::Output)
}

/// The last program of a text, and its questions.
fn read(source: &Source) -> Result<(Model, Vec<Question>), Diagnostics> {
    let model = compile(source)?;
    let whole = |error: Error| Diagnostics(vec![Diagnostic::new(Default::default(), error.to_string())]);
    let model = link(&model).map_err(whole)?.into_owned();
    let questions = model.questions.values().cloned().collect();
    Ok((model, questions))
}

fn compiled(text: String) -> Value {
    let source = Source::new("program.bp", text);
    let found = read(&source).map_err(|wrong| Failure::Wrong(wrong, source.clone()));
    match found.and_then(|(model, questions)| content(&model, &source, &questions, false)) {
        Ok(Content { program, interactive }) => {
            json!({ "mistakes": [], "program": program, "code": interactive.code.module() })
        }
        Err(Failure::Wrong(wrong, _)) => {
            let mistakes: Vec<Value> = wrong.iter().map(|one| mistake(&source, one)).collect();
            json!({ "mistakes": mistakes, "program": null, "code": "" })
        }
        Err(other) => {
            let words = match other {
                Failure::Data(error) => error.to_string(),
                Failure::Words(words) => words,
                _ => "the program cannot be shown".to_owned(),
            };
            let whole = Diagnostic::new(Default::default(), words);
            json!({ "mistakes": [mistake(&source, &whole)], "program": null, "code": "" })
        }
    }
}

/// A mistake, with its place in units of UTF-16, in which a browser counts.
fn mistake(source: &Source, one: &Diagnostic) -> Value {
    let units = |offset: usize| {
        let offset = source.text.floor_char_boundary(offset.min(source.text.len()));
        source.text[..offset].encode_utf16().count()
    };
    let help = one.help.as_ref().map_or_else(String::new, |help| format!("\nhelp: {help}"));
    json!({
        "start": units(one.span.start),
        "end": units(one.span.end),
        "line": source.line_and_column(one.span.start).0,
        "message": format!("{}{help}", one.message),
    })
}

fn answered(asked: &Asked) -> Value {
    let source = Source::new("program.bp", asked.text.as_str());
    match read(&source) {
        Ok((model, questions)) => match questions.get(asked.question) {
            Some(question) => {
                let (model, question) = model.posed(question);
                answers(&model, &question, Some(&asked.given))
            }
            None => json!([{ "text": "", "error": "there is no such question" }]),
        },
        Err(_) => json!([{ "text": "", "error": "the program has mistakes" }]),
    }
}

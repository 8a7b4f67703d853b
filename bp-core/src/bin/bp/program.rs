//! Files and questions, read.
//!
//! In: a path (`-` for stdin), a question as typed. Out: a text, a model, questions. Invariant: what is wrong is told
//! under the text that it is wrong in.

use crate::failure::Failure;
use bp_core::answer::link;
use bp_core::error::Error;
use bp_core::model::{Model, Question};
use bp_core::source::Source;
use bp_core::syntax::{compile, parse_question};
use std::io::{ErrorKind, Read};
use std::path::Path;

/// Reads a text.
pub(crate) fn read(path: &Path) -> Result<Source, Failure> {
    let fail = |source| Failure::Data(Error::file(path, source));
    let bytes = match is_stdin(path) {
        true => {
            let mut bytes = Vec::new();
            std::io::stdin().lock().read_to_end(&mut bytes).map_err(fail)?;
            bytes
        }
        false => std::fs::read(path).map_err(fail)?,
    };
    let name = if is_stdin(path) { "stdin".to_owned() } else { path.display().to_string() };
    let text = String::from_utf8(bytes).map_err(|error| {
        let valid = &error.as_bytes()[..error.utf8_error().valid_up_to()];
        let line = valid.iter().filter(|byte| **byte == b'\n').count() + 1;
        fail(std::io::Error::new(ErrorKind::InvalidData, format!("line {line} is not UTF-8 text")))
    })?;
    Ok(Source::new(name, text))
}

/// Whether a path stands for stdin.
pub(crate) fn is_stdin(path: &Path) -> bool {
    path.as_os_str() == "-"
}

/// Reads a program.
pub(crate) fn model(path: &Path) -> Result<Model, Failure> {
    let source = read(path)?;
    compile(&source).map_err(|wrong| Failure::Wrong(wrong, source))
}

/// Reads a program, and asks its subroutines.
pub(crate) fn linked(path: &Path) -> Result<Model, Failure> {
    Ok(link(&model(path)?)?.into_owned())
}

/// The question that was typed, or else all that the program declares.
pub(crate) fn questions(model: &Model, typed: Option<&str>) -> Result<Vec<Question>, Failure> {
    if let Some(text) = typed {
        let source = Source::new("question", text);
        return match parse_question(&source, model) {
            Ok(question) => Ok(vec![question]),
            Err(wrong) => Err(Failure::Wrong(wrong, source)),
        };
    }
    let declared: Vec<Question> = model.questions.values().cloned().collect();
    match declared.is_empty() {
        false => Ok(declared),
        true => Err(Failure::Words(format!(
            "program `{}` declares no question; type one behind the file, such as 'P({})'",
            model.name,
            model.variables.ids().next().map_or_else(|| "X".to_owned(), |id| model.variable_name(id)),
        ))),
    }
}

//! Files and questions, read.
//!
//! In: a path (`-` for stdin), a question as typed. Out: a text, a model, questions. Invariant: what is wrong is told
//! under the text that it is wrong in.

use crate::failure::Failure;
use bp_core::answer::link;
use bp_core::error::Error;
use bp_core::files;
use bp_core::io::{self, Format, Network};
use bp_core::model::{Model, Question};
use bp_core::source::Source;
use bp_core::syntax::parse_question;
use std::io::{ErrorKind, Write};
use std::path::Path;

/// Reads a text.
pub(crate) fn read(path: &Path) -> Result<Source, Failure> {
    let (name, bytes) = bytes(path)?;
    let text = String::from_utf8(bytes).map_err(|error| {
        let valid = &error.as_bytes()[..error.utf8_error().valid_up_to()];
        let line = valid.iter().filter(|byte| **byte == b'\n').count() + 1;
        let told = std::io::Error::new(ErrorKind::InvalidData, format!("line {line} is not UTF-8 text"));
        Failure::Data(Error::file(path, told))
    })?;
    Ok(Source::new(name, text))
}

/// What messages call a file, and what it holds.
fn bytes(path: &Path) -> Result<(String, Vec<u8>), Failure> {
    let fail = |source| Failure::Data(Error::file(path, source));
    let (name, bytes) = match is_stdin(path) {
        false => (path.display().to_string(), files::read(path).map_err(fail)?),
        true => ("stdin".to_owned(), files::bounded(std::io::stdin().lock()).map_err(fail)?),
    };
    match files::is_utf16(&bytes) {
        false => Ok((name, bytes)),
        true => Err(fail(std::io::Error::new(ErrorKind::InvalidData, "UTF-16 text; save it as UTF-8"))),
    }
}

/// Whether a path stands for stdin.
pub(crate) fn is_stdin(path: &Path) -> bool {
    path.as_os_str() == "-"
}

/// Reads a program, or a network of any format, by the end of its name. What was mended is told on stderr.
pub(crate) fn model(path: &Path) -> Result<Model, Failure> {
    Ok(network(path, format_of(path)?)?.model)
}

/// The format of a file by its name: a program where the name has no known ending.
pub(crate) fn format_of(path: &Path) -> Result<Format, Failure> {
    match Format::refused(path) {
        Some(reason) => Err(Failure::Words(format!("`{}` {reason}", path.display()))),
        None => Ok(Format::of(path).unwrap_or(Format::Program)),
    }
}

/// Reads a network of this format. What was mended is told on stderr.
pub(crate) fn network(path: &Path, format: Format) -> Result<Network, Failure> {
    let source = match format {
        Format::Program => read(path)?,
        _ => read_any(path)?,
    };
    match io::read(&source, format) {
        Ok(network) => {
            for warning in &network.warnings {
                warn(&warning.line(&source));
            }
            Ok(network)
        }
        Err(wrong) => Err(Failure::Wrong(wrong, source)),
    }
}

/// A program with its text; the text of a network is that of the program that it is.
pub(crate) fn with_source(path: &Path) -> Result<(Network, Source), Failure> {
    match format_of(path)? {
        Format::Program => {
            let source = read(path)?;
            match io::read(&source, Format::Program) {
                Ok(network) => Ok((network, source)),
                Err(wrong) => Err(Failure::Wrong(wrong, source)),
            }
        }
        other => {
            let network = network(path, other)?;
            let text = io::shown(&network.model)?;
            Ok((network, Source::new(path.display().to_string(), text)))
        }
    }
}

/// Reads a text that need not be UTF-8: older tools write Latin-1.
fn read_any(path: &Path) -> Result<Source, Failure> {
    let (name, bytes) = bytes(path)?;
    let text = String::from_utf8(bytes).unwrap_or_else(|error| {
        warn(&format!("{name}: warning: not UTF-8; it was read as Latin-1"));
        error.as_bytes().iter().copied().map(char::from).collect()
    });
    Ok(Source::new(name, text))
}

/// Tells a line on stderr.
pub(crate) fn warn(line: &str) {
    // Where stderr is closed there is nobody to be told.
    let _ = writeln!(std::io::stderr(), "{line}");
}

/// Reads a program or a network, and asks its subroutines.
pub(crate) fn linked(path: &Path) -> Result<Network, Failure> {
    let network = network(path, format_of(path)?)?;
    Ok(Network { model: link(&network.model)?.into_owned(), ..network })
}

/// The question that was typed, or else all that the program declares; with what is always known.
pub(crate) fn questions(network: &Network, typed: Option<&str>) -> Result<Vec<Question>, Failure> {
    let model = &network.model;
    if let Some(text) = typed {
        let source = Source::new("question", text);
        return match parse_question(&source, model) {
            Ok(mut question) => {
                question.asks.iter_mut().for_each(|ask| ask.known.extend_from_slice(&network.known));
                Ok(vec![question])
            }
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

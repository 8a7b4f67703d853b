//! Reads files and questions.
//!
//! In: a path (`-` for stdin), a question as typed. Out: a text, a model, questions. Invariant: errors are reported
//! with their source text.

use crate::failure::Failure;
use bp_core::compiler::answer::link;
use bp_core::compiler::data::PlateData;
use bp_core::compiler::io::{self, Format, Network};
use bp_core::compiler::model::{Model, Question};
use bp_core::compiler::source::Source;
use bp_core::compiler::syntax::parse_question;
use std::io::Write;
use std::path::Path;

/// Reads a text.
pub(crate) fn read(path: &Path) -> Result<Source, Failure> {
    Ok(io::text(path)?)
}

/// Whether a path means stdin.
pub(crate) fn is_stdin(path: &Path) -> bool {
    path.as_os_str() == "-"
}

/// Reads a program, or a network of any format, by its extension. Corrections are reported on stderr.
pub(crate) fn model(path: &Path) -> Result<Model, Failure> {
    Ok(network(path, format_of(path)?)?.model)
}

/// The format of a file by its extension: a program if the extension is unknown.
pub(crate) fn format_of(path: &Path) -> Result<Format, Failure> {
    Ok(io::format_of(path)?)
}

/// Reads a network of this format. Corrections are reported on stderr.
pub(crate) fn network(path: &Path, format: Format) -> Result<Network, Failure> {
    let opened = io::open_as(path, format)?;
    opened.warnings.iter().for_each(|warning| warn(warning));
    Ok(opened.network)
}

/// A program with its text; for a network the text of the equivalent program.
pub(crate) fn with_source(path: &Path) -> Result<(Network, Source), Failure> {
    match format_of(path)? {
        Format::Program => {
            let opened = io::open_as(path, Format::Program)?;
            Ok((opened.network, opened.source))
        }
        other => {
            let network = network(path, other)?;
            let text = io::shown(&network.model)?;
            Ok((network, Source::new(path.display().to_string(), text)))
        }
    }
}

/// Prints a line on stderr.
pub(crate) fn warn(line: &str) {
    // If stderr is closed, the line is lost.
    let _ = writeln!(std::io::stderr(), "{line}");
}

/// Reads a program or a network, and asks its subroutines.
pub(crate) fn linked(path: &Path) -> Result<Network, Failure> {
    let network = network(path, format_of(path)?)?;
    Ok(Network { model: link(&network.model)?.into_owned(), ..network })
}

/// The question that was typed, or else all declared ones; with the evidence that always holds. Their derived variables
/// are added to the program.
pub(crate) fn questions(network: &mut Network, typed: Option<&str>) -> Result<Vec<Question>, Failure> {
    questions_of_rows(network, typed, &PlateData::default())
}

/// The same, where rows of tables are elements: their observations are known.
pub(crate) fn questions_of_rows(
    network: &mut Network,
    typed: Option<&str>,
    rows: &PlateData,
) -> Result<Vec<Question>, Failure> {
    let asked = asked_of_rows(network, typed, rows)?;
    Ok(asked.iter().map(|question| network.model.pose(question)).collect())
}

/// The same, as they are written: each can be posed in a program of its own.
pub(crate) fn asked_of_rows(
    network: &Network,
    typed: Option<&str>,
    rows: &PlateData,
) -> Result<Vec<Question>, Failure> {
    let asked = asked(network, typed)?.into_iter();
    Ok(asked.map(|question| rows.known_in(&network.model, &question)).collect::<Result<_, _>>()?)
}

/// The question that was typed, or the declared ones, as they are written; a page can show a program without questions.
pub(crate) fn shown(network: &Network, typed: Option<&str>) -> Result<Vec<Question>, Failure> {
    match typed {
        None if network.model.questions.is_empty() => Ok(Vec::new()),
        typed => asked(network, typed),
    }
}

fn asked(network: &Network, typed: Option<&str>) -> Result<Vec<Question>, Failure> {
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

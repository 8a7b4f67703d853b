//! Files of other tools: network formats.
//!
//! In: a [`Source`]. Out: a [`Network`]: a [`Model`] and warnings about corrections; or diagnostics. And the reverse: a
//! model of finite variables as the text of a format. Invariant: no bytes cause a panic; numbers are read and written
//! as f64 without loss.

pub mod bif;
pub mod hugin;
pub mod program;
pub mod uai;
pub mod xmlbif;

mod draft;
mod finite;
mod format;
mod lexer;
mod open;
mod warning;

pub use format::Format;
pub use open::{Opened, format_of, open, open_as, text};
pub use warning::Warning;

use crate::diagnostic::Diagnostics;
use crate::error::Error;
use crate::model::{Known, Model};
use crate::source::Source;

/// The content of a file.
#[derive(Clone, PartialEq, Debug)]
pub struct Network {
    /// Its variables and distributions.
    pub model: Model,
    /// Evidence that always holds: the potentials of a Markov network, which are variables of the model, are true.
    pub known: Vec<Known>,
    /// ln of the factor by which the product of its tables was divided to make each a distribution: 0, except for a
    /// Markov network, whose ln Z is this plus ln P(known).
    pub ln_scale: f64,
    /// Corrections made while reading.
    pub warnings: Vec<Warning>,
}

/// Reads a network.
///
/// # Errors
/// Every mistake, or the first one that stops reading.
pub fn read(source: &Source, format: Format) -> Result<Network, Diagnostics> {
    let bare = |(model, warnings)| Network { model, known: Vec::new(), ln_scale: 0.0, warnings };
    match format {
        Format::Program => crate::syntax::compile(source).map(|model| bare((model, Vec::new()))),
        Format::Bif => bif::read(source).map(bare),
        Format::Xmlbif => xmlbif::read(source).map(bare),
        Format::Hugin => hugin::read(source).map(bare),
        Format::Uai => uai::read(source),
    }
}

/// Writes a network.
///
/// # Errors
/// A variable that is not finite, a form without a table, a name that the format cannot hold, a context without any
/// possible value in a format whose rows are distributions.
pub fn write(network: &Network, format: Format) -> Result<String, Error> {
    let model = &network.model;
    let nodes = finite::nodes(model)?;
    if let (Some(row), true) = (finite::zero_row(&nodes), format != Format::Uai) {
        let reason = format!(
            "the probabilities of {row} are all 0, since its form leaves the values of the variable; this format holds \
             distributions only, UAI holds such a row too"
        );
        return Err(Error::Unwritable { name: model.name.clone(), reason });
    }
    match format {
        Format::Program => program::write(model, &nodes),
        Format::Bif => bif::write(model, &nodes),
        Format::Xmlbif => xmlbif::write(model, &nodes),
        Format::Hugin => hugin::write(model, &nodes),
        Format::Uai => uai::write(model, &nodes, &network.known),
    }
}

/// The text of a network as a program, for display: also with rows of zeros, which a program cannot have.
///
/// # Errors
/// See [`write()`].
pub fn shown(model: &Model) -> Result<String, Error> {
    program::write(model, &finite::nodes(model)?)
}

/// Warnings about the parts of a network that a format cannot express.
///
/// # Errors
/// See [`write()`].
pub fn lost(network: &Network, format: Format) -> Result<Vec<String>, Error> {
    let nodes = finite::nodes(&network.model)?;
    let row = finite::zero_row(&nodes).filter(|_| format == Format::Uai);
    let row = row.map(|row| {
        format!(
            "the probabilities of {row} are all 0: a tool that expects distributions may divide by their sum"
        )
    });
    let rounded = finite::lost(&nodes).map(|lost| {
        format!(
            "the probability of {lost}; numbers below 2.2e-308, as this one, are rounded, most of them to 0: the file is \
             impossible where the program is only improbable"
        )
    });
    let observed = network.known.first().filter(|_| format != Format::Uai).map(|first| {
        format!(
            "the file has no evidence: its {} potentials must be observed in each question, `{} = true` and so on; without that \
             it is another distribution",
            network.known.len(),
            network.model.variable_name(first.variable)
        )
    });
    Ok(row.into_iter().chain(rounded).chain(observed).collect())
}

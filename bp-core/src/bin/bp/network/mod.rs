//! Networks from the shell: what the commands that ask one have in common.
//!
//! In: a file, and evidence as JSON. Out: a network by names, and its evidence. Invariant: a wrong name or value is told
//! before anything is computed.

pub(crate) mod batch;
pub(crate) mod joint;
pub(crate) mod marginals;
pub(crate) mod mpe;
pub(crate) mod observe;
pub(crate) mod size;

use crate::failure::Failure;
use crate::program;
use bp_core::io::Format;
use bp_core::tree::{Evidence, Named};
use serde_json::{Map, Value};
use std::path::{Path, PathBuf};

/// A network, and what is known of it.
#[derive(clap::Args)]
pub(crate) struct Asked {
    /// A network (.bif, .xml, .uai, .net) or a program (.bp) whose variables are all finite.
    #[arg(value_name = "NETWORK")]
    file: PathBuf,
    /// What is known: '{"smoke": "yes"}', or a file that holds such a thing.
    #[arg(long, value_name = "JSON")]
    evidence: Option<String>,
    /// Likelihoods (virtual evidence): '{"xray": [0.8, 0.2]}', in the order of the values.
    #[arg(long, value_name = "JSON")]
    likelihood: Option<String>,
}

impl Asked {
    pub(crate) fn read(&self) -> Result<(Named, Evidence), Failure> {
        let named = network(&self.file)?;
        let values: Vec<(String, String)> = (object("--evidence", self.evidence.as_deref())?.into_iter())
            .map(|(name, value)| Ok((value_text(&name, &value)?, name)))
            .map(|pair: Result<_, Failure>| pair.map(|(value, name)| (name, value)))
            .collect::<Result<_, _>>()?;
        let mut likelihoods: Vec<(String, Vec<f64>)> = Vec::new();
        for (name, value) in object("--likelihood", self.likelihood.as_deref())? {
            let numbers =
                value.as_array().and_then(|list| list.iter().map(Value::as_f64).collect::<Option<_>>());
            let numbers = numbers.ok_or_else(|| {
                Failure::Words(format!(
                    "--likelihood: `{name}` needs a list of numbers, such as [0.8, 0.2], found {value}"
                ))
            })?;
            likelihoods.push((name, numbers));
        }
        let evidence = named.evidence(
            values.iter().map(|(name, value)| (name.as_str(), value.as_str())),
            likelihoods.iter().map(|(name, weights)| (name.as_str(), weights.as_slice())),
        )?;
        Ok((named, evidence))
    }
}

/// Reads a network.
pub(crate) fn network(path: &Path) -> Result<Named, Failure> {
    let read = program::network(path, Format::of(path).unwrap_or(Format::Program))?;
    let mut named = Named::new(read.model, &read.known)?;
    named.ln_scale = read.ln_scale;
    Ok(named)
}

/// Variables by name, each once, none of them observed.
pub(crate) fn free(named: &Named, evidence: &Evidence, names: &[String]) -> Result<Vec<usize>, Failure> {
    let mut found = Vec::with_capacity(names.len());
    for name in names {
        let variable = named.number_of(name)?;
        if found.contains(&variable) {
            return Err(Failure::Words(format!("`{name}` is named twice")));
        }
        if evidence.hard.iter().any(|(known, _)| *known == variable) {
            return Err(Failure::Words(format!("`{name}` is observed: nothing about it is uncertain")));
        }
        found.push(variable);
    }
    Ok(found)
}

/// A JSON object, written on the command line or in a file.
fn object(option: &str, written: Option<&str>) -> Result<Map<String, Value>, Failure> {
    let Some(written) = written else { return Ok(Map::new()) };
    let text = match written.trim_start().starts_with('{') {
        true => written.to_owned(),
        false => program::read(Path::new(written))?.text,
    };
    serde_json::from_str(&text).map_err(|error| {
        Failure::Words(format!("{option} is not a JSON object such as {{\"smoke\": \"yes\"}}: {error}"))
    })
}

/// The name of a value: text, a number or a truth value.
fn value_text(name: &str, value: &Value) -> Result<String, Failure> {
    match value {
        Value::String(text) => Ok(text.clone()),
        Value::Number(number) => Ok(number.to_string()),
        Value::Bool(truth) => Ok(truth.to_string()),
        other => {
            Err(Failure::Words(format!("--evidence: `{name}` needs the name of a value, found {other}")))
        }
    }
}

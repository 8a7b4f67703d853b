//! The common parts of the network commands.
//!
//! In: a file, and evidence in JSON or UAI format. Out: a network by names, and its evidence. Invariant: a wrong name
//! or value is reported before anything is computed.

pub(crate) mod batch;
pub(crate) mod joint;
pub(crate) mod marginals;
pub(crate) mod mpe;
pub(crate) mod observe;
pub(crate) mod size;

use crate::ask::setting;
use crate::failure::Failure;
use crate::program;
use bp_core::compiler::answer::Answer;
use bp_core::compiler::data::Values;
use bp_core::compiler::io::{Network, uai};
use bp_core::compiler::model::{self, Known};
use bp_core::compiler::source::Source;
use bp_core::compiler::strategies::join_tree::{Named, NetworkEvidence};
use bp_core::program::settings::{Settings, names};
use bp_core::program::{self as program_door, Program};
use serde::de::{Deserialize, Deserializer, Error as _, MapAccess, Visitor};
use serde_json::{Value, json};
use std::collections::HashSet;
use std::path::{Path, PathBuf};

/// A network and its evidence.
#[derive(clap::Args)]
pub(crate) struct Asked {
    /// A network (.bif, .xml, .uai, .net) or a program (.bp).
    #[arg(value_name = "NETWORK")]
    file: PathBuf,
    /// Evidence: a JSON or UAI (.evid) file.
    #[arg(value_name = "EVIDENCE", conflicts_with = "evidence")]
    evidence_file: Option<PathBuf>,
    /// Evidence as JSON, '{"smoke": "yes"}', or a JSON or UAI file.
    #[arg(long, value_name = "JSON")]
    evidence: Option<String>,
    /// Virtual evidence, one likelihood for each value in order: '{"xray": [0.8, 0.2]}'.
    #[arg(long, value_name = "JSON")]
    likelihood: Option<String>,
    /// Set a parameter, or the size of a set, of a program; may be repeated.
    #[arg(long = "set", value_name = "NAME=VALUE", value_parser = setting, allow_hyphen_values = true)]
    settings: Vec<String>,
}

/// Evidence by names, as written.
pub(crate) struct Written {
    values: Vec<(String, String)>,
    /// A value for each element of a family, or for each component of a vector.
    lists: Vec<(String, Vec<Option<String>>)>,
    likelihoods: Vec<(String, Vec<f64>)>,
}

impl Asked {
    /// A network and its evidence, by number.
    pub(crate) fn read(&self) -> Result<(Named, NetworkEvidence), Failure> {
        let (named, network) = network(&self.file, &self.settings)?;
        let written = self.written(&network)?;
        if let Some((name, _)) = written.lists.first() {
            let message = format!("--evidence: `{name}` needs the name of a value, found a list");
            return Err(Failure::Words(message));
        }
        let evidence = named.evidence(
            written.values.iter().map(|(name, value)| (name.as_str(), value.as_str())),
            written.likelihoods.iter().map(|(name, weights)| (name.as_str(), weights.as_slice())),
        )?;
        Ok((named, evidence))
    }

    /// A program or a network, and its evidence, for the planner.
    pub(crate) fn program(&self) -> Result<(Program, program_door::Evidence), Failure> {
        let network = crate::program::linked(&self.file)?;
        let written = self.written(&network)?;
        let mut evidence = program_door::Evidence::new();
        for (name, value) in written.values {
            let plain = name.split('[').next().unwrap_or(&name).trim();
            let variable = network.model.variable(&name).or_else(|| network.model.variable(plain));
            let read = variable.map(|id| Values::new(&network.model, id, &|_| None).read(&value));
            // `NA` and its synonyms mark a value that is not observed.
            if !matches!(read, Some(Ok(None))) {
                evidence.set(name, value);
            }
        }
        for (name, values) in written.lists {
            // A `null` is not observed, as an empty cell.
            let values = values.into_iter().map(|value| match value {
                Some(value) => program_door::Value::Label(value),
                None => program_door::Value::Real(f64::NAN),
            });
            evidence.set(name, program_door::Value::List(values.collect()));
        }
        written.likelihoods.into_iter().for_each(|(name, weights)| {
            evidence.set(name, program_door::Value::Likelihood(weights));
        });
        let settings = Settings::read(&network.model, &self.settings, &names(&network.model))?;
        Ok((Program::of_network(network)?.with_all(settings), evidence))
    }

    fn written(&self, network: &Network) -> Result<Written, Failure> {
        let mut likelihoods: Vec<(String, Vec<f64>)> = Vec::new();
        if let Some(written) = &self.likelihood {
            let source = written_or_read(written)?;
            for (name, value) in object("--likelihood", &source)? {
                let numbers =
                    value.as_array().and_then(|list| list.iter().map(Value::as_f64).collect::<Option<_>>());
                let numbers = numbers.ok_or_else(|| {
                    Failure::Words(format!(
                        "--likelihood: `{name}` needs a list of numbers, such as [0.8, 0.2], found {value}"
                    ))
                })?;
                likelihoods.push((name, numbers));
            }
        }
        let source = match (&self.evidence_file, &self.evidence) {
            (Some(path), _) => Some(program::read(path)?),
            (None, Some(written)) => Some(written_or_read(written)?),
            (None, None) => None,
        };
        let (mut values, mut lists) = (Vec::new(), Vec::new());
        match source {
            Some(source) if source.text.trim_start().starts_with('{') => {
                for (name, value) in object("--evidence", &source)? {
                    if let Value::Array(all) = &value {
                        let all =
                            all.iter().map(|one| value_text(&name, one)).collect::<Result<_, Failure>>()?;
                        lists.push((name, all));
                        continue;
                    }
                    values.extend(value_text(&name, &value)?.map(|value| (name, value)));
                }
            }
            // A text that begins with a number is read as UAI, others as JSON.
            Some(source) if source.text.trim_start().starts_with(|first: char| first.is_ascii_digit()) => {
                let mut cases = uai_cases(&source, network)?;
                if cases.len() > 1 {
                    return Err(Failure::Words(format!(
                        "`{}` holds {} cases; ask for one, or answer all with `bp batch --cases`",
                        source.name,
                        cases.len()
                    )));
                }
                values = named_values(network, &cases.pop().unwrap_or_default())?;
            }
            Some(source) => drop(object("--evidence", &source)?),
            None => {}
        }
        Ok(Written { values, lists, likelihoods })
    }
}

/// The names of the variables and values of a case.
fn named_values(network: &Network, case: &[Known]) -> Result<Vec<(String, String)>, Failure> {
    let one = |known: &Known| {
        let (name, ordinal) = observed(network, known)?;
        Ok((name, network.model.value_name(known.variable, ordinal)))
    };
    case.iter().map(one).collect()
}

/// The name of a variable that an evidence file observes, and the ordinal of its value.
fn observed(network: &Network, known: &Known) -> Result<(String, usize), Failure> {
    let name = network.model.variable_name(known.variable);
    if network.known.iter().any(|always| always.variable == known.variable) {
        return Err(Failure::Words(format!("`{name}` is a potential, which is not observed")));
    }
    let model::Finding::Hard(model::Value::Ordinal(ordinal)) = known.evidence else {
        return Err(Failure::Words(format!("`{name}` is observed without a value")));
    };
    Ok((name, ordinal))
}

/// The evidence of a UAI evidence file, case by case.
pub(crate) fn uai_cases(source: &Source, network: &Network) -> Result<Vec<Vec<Known>>, Failure> {
    uai::evidence(source, &network.model).map_err(|wrong| Failure::Wrong(wrong, source.clone()))
}

/// Reads a network, by names and as a network. Its settings and its fields determine the sizes of its sets.
fn network(path: &Path, settings: &[String]) -> Result<(Named, Network), Failure> {
    let read = program::network(path, program::format_of(path)?)?;
    let settings =
        Settings::read(&read.model, settings, &names(&read.model))?.with_inferred_sizes(&read.model);
    let mut named = Named::with(read.model.clone(), &read.known, &settings.inputs())?;
    named.ln_scale = read.ln_scale;
    Ok((named, read))
}

/// Refuses a name that stands twice, or is observed.
pub(crate) fn free(evidence: &program_door::Evidence, names: &[String]) -> Result<(), Failure> {
    for (place, name) in names.iter().enumerate() {
        if names[..place].contains(name) {
            return Err(Failure::Words(format!("`{name}` is named twice")));
        }
        let mut own = evidence.iter().filter(|(known, _)| *known == name);
        if own.any(|(_, value)| !matches!(value, program_door::Value::Likelihood(_))) {
            return Err(Failure::Words(format!("`{name}` is observed: nothing about it is uncertain")));
        }
    }
    Ok(())
}

/// A number in JSON, which has none that is infinite.
fn number(number: f64) -> Value {
    match (number.is_finite(), number > 0.0) {
        (true, _) => json!(number),
        (false, true) => json!("infinite"),
        (false, false) => json!("-infinite"),
    }
}

/// Adds ln P(evidence) to a JSON object, where it is known, and the number of draws of an estimate.
fn certainty(object: &mut Value, answer: &Answer) {
    if let Some(ln_evidence) = answer.ln_evidence {
        object["ln_p_evidence"] = json!(ln_evidence);
    }
    if let Some(estimate) = &answer.estimate {
        object["estimate"] = json!(estimate);
    }
}

/// The name of an option's text in messages.
const COMMAND_LINE: &str = "the command line";

/// The text on the command line, or in a file.
fn written_or_read(written: &str) -> Result<Source, Failure> {
    if written.trim_start().starts_with(['{', '[', '"']) {
        return Ok(Source::new(COMMAND_LINE, written));
    }
    let path = Path::new(written);
    match written.split_once('=') {
        Some((name, value)) if !path.exists() => {
            let value = serde_json::from_str(value).unwrap_or_else(|_| Value::from(value));
            let object = serde_json::json!({ name: value });
            Err(Failure::Words(format!("`{written}` is neither JSON nor a file: write '{object}'")))
        }
        _ => program::read(path),
    }
}

/// The members of a JSON object, in their order. A duplicate name is an error.
struct Members(Vec<(String, Value)>);

impl<'de> Deserialize<'de> for Members {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        struct Reader;
        impl<'de> Visitor<'de> for Reader {
            type Value = Members;

            fn expecting(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                out.write_str("an object")
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Members, A::Error> {
                let (mut members, mut names) = (Vec::new(), HashSet::new());
                while let Some((name, value)) = map.next_entry::<String, Value>()? {
                    if !names.insert(name.clone()) {
                        return Err(A::Error::custom(format!("`{name}` occurs twice")));
                    }
                    members.push((name, value));
                }
                Ok(Members(members))
            }
        }
        from.deserialize_map(Reader)
    }
}

/// The members of a JSON object.
fn object(option: &str, source: &Source) -> Result<Vec<(String, Value)>, Failure> {
    let read: Result<Members, _> = serde_json::from_str(&source.text);
    read.map(|members| members.0).map_err(|error| {
        let what = match source.name.as_str() {
            COMMAND_LINE => format!("{option} is not a JSON object"),
            name => format!("`{name}` is neither a JSON object nor UAI evidence"),
        };
        Failure::Words(format!("{what}, such as {{\"smoke\": \"yes\"}}: {error}"))
    })
}

/// The name of a value: text, a number or a boolean; `None` for `null`, which is not observed.
fn value_text(name: &str, value: &Value) -> Result<Option<String>, Failure> {
    match value {
        Value::String(text) => Ok(Some(text.clone())),
        Value::Number(number) => Ok(Some(number.to_string())),
        Value::Bool(truth) => Ok(Some(truth.to_string())),
        Value::Null => Ok(None),
        other => Err(unreadable(name, other)),
    }
}

fn unreadable(name: &str, value: &Value) -> Failure {
    Failure::Words(format!("--evidence: `{name}` needs the name of a value, found {value}"))
}

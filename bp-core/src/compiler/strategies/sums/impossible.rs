//! The observation that makes the evidence impossible.
//!
//! In: an ask whose evidence has probability zero, and its inputs. Out: an error that names the first observation, in
//! the order of the question, that the earlier ones exclude, and the factor responsible. Invariant: the observations
//! before it have a positive probability, however small.

use crate::distribution::Setting;
use crate::equation::{self, Options};
use crate::error::{Error, Impossible};
use crate::exec::{Inputs, Lanes};
use crate::kernel::OutputKey;
use crate::lower::lower_guarded;
use crate::model::{Ask, Finding, Form, Known, Model, Question, Statistic, Value};
use crate::sample::Observations;
use crate::spelling::{exact, list};

/// Upper limit on the products summed to explain the error.
const MOST_PRODUCTS: f64 = 1e8;

/// The error; where no single observation is responsible, it names the question alone.
pub(crate) fn error(model: &Model, ask: &Ask, inputs: &Inputs<'_, f64>) -> Error {
    let reason = reason(model, ask, inputs);
    Error::Impossible(Impossible { question: model.ask_text(ask), reason })
}

/// Refines the error of draws that met no evidence: where exact sums exist, they decide whether the evidence is
/// possible.
pub(crate) fn judged(error: Error, model: &Model, ask: &Ask, inputs: &Inputs<'_, f64>) -> Error {
    match is_possible(model, ask, &ask.known, inputs) {
        Some(false) => self::error(model, ask, inputs),
        _ => error,
    }
}

fn reason(model: &Model, ask: &Ask, inputs: &Inputs<'_, f64>) -> Option<String> {
    let is_hard = |known: &&Known| matches!(known.evidence, Finding::Hard(_));
    let observed_alone = Ask { known: ask.known.iter().filter(is_hard).cloned().collect(), ..ask.clone() };
    if let Ok(setting) = Setting::new(model, inputs)
        && let Ok(observations) = Observations::of(&setting, &observed_alone)
        && let Some(reason) = setting.zero_factor(&observations.values)
    {
        return Some(reason);
    }
    if ask.known.is_empty() {
        return Some("no values of its variables are possible together".to_owned());
    }
    let (mut possible, mut impossible) = (0, ask.known.len());
    while possible + 1 < impossible {
        let middle = (possible + impossible) / 2;
        match is_possible(model, ask, &ask.known[..middle], inputs)? {
            true => possible = middle,
            false => impossible = middle,
        }
    }
    let (before, known) = (&ask.known[..possible], ask.known.get(possible)?);
    let factor = &model.factors[model.factor_of(known.variable)?];
    // A uniform distribution excludes no value: what depends on the variable does.
    let see = match factor.form {
        Form::Uniform => String::new(),
        _ => format!("; see `{}`", model.head(factor)),
    };
    let given = match before.is_empty() {
        true => String::new(),
        false => format!(" given {}", names(model, before, inputs)),
    };
    Some(format!("`{}` is impossible{given}{see}", observed(model, known, inputs)))
}

/// Whether these observations have a positive probability; `None` where that has no exact answer.
fn is_possible(model: &Model, ask: &Ask, known: &[Known], inputs: &Inputs<'_, f64>) -> Option<bool> {
    let searched = ask.searched.clone();
    let ask = Ask { statistic: Statistic::Distribution, when: ask.when, searched, known: known.to_vec() };
    let question = Question { name: "evidence".to_owned(), asks: vec![ask], derived: Vec::new() };
    let options = Options { ln_evidence: true, ..Options::default() };
    let exact = equation::exact(model, question.asks, options).ok()?;
    if exact.cost > MOST_PRODUCTS {
        return None;
    }
    let lanes = Lanes::new(lower_guarded(model, &exact, &question.name).ok()?.kernel);
    let outputs = lanes.run_guarded(inputs, false).ok()?.outputs;
    Some(outputs.get(OutputKey::LnEvidence)[0] > f64::NEG_INFINITY)
}

/// An observation, with the value that was given.
fn observed(model: &Model, known: &Known, inputs: &Inputs<'_, f64>) -> String {
    let name = model.spelled(known.variable);
    let domain = &model.variables[known.variable].domain;
    match &known.evidence {
        Finding::Hard(Value::Ordinal(ordinal)) => format!("{name} = {}", domain.value_spelled(*ordinal)),
        Finding::Hard(Value::Real(number)) => format!("{name} = {}", exact(*number)),
        Finding::Hard(Value::Vector(numbers)) => model.components_text(known.variable, numbers),
        Finding::Hard(Value::Given(given)) => match inputs.find(given) {
            Some([number]) => match domain.ordinal_among(*number, None).filter(|_| domain.is_finite()) {
                Some(ordinal) => format!("{name} = {}", domain.value_spelled(ordinal)),
                None => format!("{name} = {}", exact(*number)),
            },
            _ => format!("{name} = {given}"),
        },
        Finding::Virtual(weights) => format!("{name} virtual {}", list(weights)),
        Finding::Each | Finding::Soft(_) => name.to_string(),
    }
}

/// The names of the earlier observations; only the last few where there are many.
fn names(model: &Model, known: &[Known], inputs: &Inputs<'_, f64>) -> String {
    const FEW: usize = 4;
    let shown: Vec<String> =
        known.iter().take(FEW).map(|known| format!("`{}`", observed(model, known, inputs))).collect();
    match known.len().checked_sub(FEW) {
        None | Some(0) => shown.join(", "),
        Some(more) => format!("{} and {more} more", shown.join(", ")),
    }
}

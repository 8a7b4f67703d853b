//! Answers in closed form, where all is linear and Gaussian.
//!
//! In: a closed form and the host's inputs. Out: [`Answer`]s: a mean and a deviation for each searched variable, or one
//! of its moments. Invariant: each parameter and each observation is one number.

use super::{Answer, Figure, Row};
use crate::error::Error;
use crate::exec::{Filter, Inputs};
use crate::model::{Evidence, Model, Reduction, Value};
use crate::plan::Gaussian;

pub(super) fn answers(
    model: &Model,
    gaussian: &Gaussian,
    inputs: &Inputs<'_, f64>,
) -> Result<Vec<Answer>, Error> {
    let given = |name: &str| match inputs.find(name) {
        None => Ok(None),
        Some([number]) => Ok(Some(*number)),
        Some(several) => {
            let count = several.len();
            Err(Error::input(name, format!("{count} numbers were given, but 1 is expected")))
        }
    };
    let mut parameters: Vec<(&str, f64)> = Vec::new();
    for parameter in model.parameters.values() {
        if let Some(number) = given(&parameter.name)? {
            parameters.push((&parameter.name, number));
        }
    }
    let mut observations = Vec::new();
    for known in &gaussian.asks[0].known {
        let name = model.variable_name(known.variable);
        let value = match &known.evidence {
            Evidence::Hard(Value::Real(number)) => *number,
            Evidence::Hard(Value::Given(given_as)) => {
                given(given_as)?.ok_or_else(|| Error::input(given_as, "it was not given"))?
            }
            _ => given(&name)?.ok_or_else(|| Error::input(&name, "it was not given"))?,
        };
        observations.push((name, value));
    }
    let observations: Vec<(&str, f64)> =
        observations.iter().map(|(name, value)| (name.as_str(), *value)).collect();
    let belief = Filter::new(model, gaussian, &parameters)?.step(&observations)?;
    Ok((gaussian.asks.iter())
        .map(|ask| Answer {
            question: model.ask_text(ask),
            ln_evidence: (!observations.is_empty()).then_some(belief.ln_evidence),
            estimate: None,
            answer: (ask.searched.iter())
                .map(|searched| model.variable_name(searched.variable))
                .map(|name| {
                    let mean = belief.mean_of(&name).unwrap_or(f64::NAN);
                    let deviation = belief.deviation_of(&name).unwrap_or(f64::NAN);
                    let figure = match ask.reduction {
                        Reduction::Expectation => Figure::Expectation { expectation: mean, error: None },
                        Reduction::Variance => Figure::Variance { variance: deviation.powi(2), error: None },
                        _ => Figure::Normal { mean, deviation },
                    };
                    Row { values: vec![(name, String::new())], figure }
                })
                .collect(),
        })
        .collect())
}

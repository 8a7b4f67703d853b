//! Questions and factors that draws do not estimate.
//!
//! In: an ask or a factor. Out: the reason why no draws answer it, if there is one. Invariant: reasons depend on the program
//! and the question alone.

use crate::distribution::{Distribution, Setting};
use crate::error::Error;
use crate::ids::ExpressionId;
use crate::model::{Ask, Expression, Factor, Finding, Form, Model, Searched, Statistic};

/// The reason why an ask is not estimated.
pub(super) fn refused_ask(model: &Model, ask: &Ask) -> Option<String> {
    if let Some(why) = not_of_draws(model, ask) {
        return Some(why);
    }
    for searched in &ask.searched {
        let name = model.variable_name(searched.variable);
        if searched.at.is_some() && !model.variables[searched.variable].domain.is_finite() {
            return Some(format!(
                "draws do not give the density of `{name}` at one value: ask for `P({name} | …)`"
            ));
        }
    }
    for known in &ask.known {
        let name = model.variable_name(known.variable);
        let variable = &model.variables[known.variable];
        match &known.evidence {
            Finding::Soft(_) => {
                return Some(format!("soft evidence on `{name}` is mixed from exact answers only"));
            }
            Finding::Each if variable.domain.is_finite() && Some(known.variable) != model.plate_index() => {
                return Some(format!("a table over `{name}` is not estimated: give its value, `{name} = …`"));
            }
            _ => {}
        }
    }
    None
}

/// Refuses the variance of a distribution that has no finite one, which a number from draws would not show.
///
/// # Errors
/// The ask is the variance of a real that has such a distribution, without parents and evidence.
pub(super) fn check_variance(setting: &Setting<'_>, ask: &Ask) -> Result<(), Error> {
    let model = setting.model;
    let ([item], [], Statistic::Variance) = (ask.searched.as_slice(), ask.known.as_slice(), &ask.statistic)
    else {
        return Ok(());
    };
    let Some(factor) = model.factor_of(item.variable).filter(|id| model.factors[*id].right.is_empty()) else {
        return Ok(());
    };
    let values = vec![f64::NAN; setting.slots()];
    for instance in setting.instances(factor)? {
        if let Distribution::Law(law, parameters) = setting.distribution(&instance, &values)?
            && !law.variance(&parameters[..law.parameters().len()]).is_finite()
        {
            let (name, form) = (model.variable_name(item.variable), &model.factors[factor].form);
            let form = model.form_text(&model.factors[factor], form);
            let reason = format!("`{name}` has no finite variance: its distribution is `{form}`");
            return Err(Error::Unplanned { question: model.ask_text(ask), reason });
        }
    }
    Ok(())
}

/// Why a statistic is not estimated by draws.
fn not_of_draws(model: &Model, ask: &Ask) -> Option<String> {
    let word = ask.statistic.word();
    let is_real = |item: &&Searched| !model.variables[item.variable].domain.is_finite();
    match &ask.statistic {
        Statistic::Distribution
        | Statistic::Expectation
        | Statistic::Variance
        | Statistic::Draw(_)
        | Statistic::Quantile(_)
        | Statistic::Interval(_) => return None,
        Statistic::Argmax { nearest: None } | Statistic::Maximum => {
            let real = ask.searched.iter().find(is_real)?;
            let name = model.variable_name(real.variable);
            let alone = ask.searched.len() == 1 && model.components(real.variable) == 1;
            match ask.statistic {
                Statistic::Argmax { .. } if alone && model.variables[real.variable].family.is_none() => {
                    return None;
                }
                Statistic::Argmax { .. } => {
                    return Some(format!(
                        "of draws the mode of one real is estimated: ask for `argmax P({name} | …)`"
                    ));
                }
                _ => {
                    return Some(format!(
                        "draws of `{name}` have no density: ask for `argmax`, or for `P(…)`"
                    ));
                }
            }
        }
        Statistic::Entropy | Statistic::Best(_) => {
            let real = ask.searched.iter().find(is_real)?;
            let name = model.variable_name(real.variable);
            return Some(format!(
                "`{word}` is estimated of finite variables: divide `{name}` into bins by a variable `bins(…)`, or ask for `P(…)`"
            ));
        }
        _ => {}
    }
    Some(format!("`{word}` is not estimated by draws: ask for `P(…)`"))
}

/// The reason why a factor has no numbers of its own.
pub(crate) fn refused_factor(model: &Model, factor: &Factor) -> Option<String> {
    fn of_form(model: &Model, form: &Form) -> Option<&'static str> {
        let mut found = match form {
            // A subroutine has a table; any other asked program is bound by the host.
            Form::Ask { path, .. } if model.subroutine(path).is_none() => Some("asks another program"),
            Form::Unknown(_) => Some("is to be learned from data first"),
            Form::Previous { at: Some(_), .. } => Some("reads a cell of the previous step"),
            _ => None,
        };
        form.each_part(&mut |part| found = found.or_else(|| of_form(model, part)));
        found
    }
    let mut found = of_form(model, &factor.form);
    factor.form.each_expression(&mut |id| found = found.or_else(|| refused_expression(model, id)));
    found.map(|reason| format!("`{}` {reason}", model.head(factor)))
}

fn refused_expression(model: &Model, id: ExpressionId) -> Option<&'static str> {
    let reads = |id: ExpressionId| {
        matches!(
            &model.expressions[id],
            Expression::Foreign { .. }
                | Expression::GradientNorm { .. }
                | Expression::Frontier { .. }
                | Expression::Innermost { .. }
        )
    };
    model.nodes_below(id).into_iter().any(reads).then_some("reads a field of another program")
}

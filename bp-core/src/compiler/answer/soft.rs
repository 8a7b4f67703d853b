//! Soft evidence: replaces the marginal of a variable (Jeffrey's rule).
//!
//! In: the table P(S X … | K) and a probability for each value of each variable X with soft evidence. Out: the table
//! P′(S | K). Invariant: P′(X) = q after its own replacement, and P′(S | X) = P(S | X); later evidence may change the
//! marginal of earlier evidence, since replacements do not commute.
//!
//! P′(S X) = P(S X) q(X) / P(X) (Jeffrey, *The Logic of Decision*, 1965).

use crate::error::Error;
use crate::exec::scalar::{Extended, Scalar};
use crate::ids::VariableId;
use crate::model::{Ask, Finding, Known, Model, Searched, Statistic};
use crate::posterior::{Answer, Column, Part, PartLaw, Slot, Table, refused_of_reals};
use crate::spelling::exact;

/// The reals of an ask, from those of its part, which has the softly known variables too.
///
/// # Errors
/// As [`applied`]; a statistic without a closed form.
pub(super) fn of_reals(model: &Model, ask: &Ask, part: &Answer, seed: u64) -> Result<Answer, Error> {
    let strategy = part.strategy;
    let question = model.ask_text(ask);
    let refused = |reason: String| Error::Unplanned { question: question.clone(), reason };
    let whole = ask.statistic == Statistic::Distribution;
    let finite = ask.searched.iter().any(|item| model.variables[item.variable].domain.is_finite());
    if finite && !whole {
        let word = ask.statistic.word();
        return Err(refused(format!("`{word}` of finite variables and reals together is not computed")));
    }
    let slots =
        |item: &Searched| part.parts[0].of.iter().filter(|slot| slot.variable == item.variable).count();
    if let Some(why) = refused_of_reals(&ask.statistic, ask.searched.iter().map(slots).sum()) {
        return Err(refused(why));
    }
    let part = &part.parts[0];
    let PartLaw::ConditionalGaussian(law) = &part.law else {
        return Err(refused(format!(
            "`{}` answers without a distribution of all variables",
            strategy.name()
        )));
    };
    let mut law = law.clone();
    let finite: Vec<&Slot> = part.of.iter().filter(|slot| slot.count > 0).collect();
    for known in &ask.known {
        let Finding::Soft(weights) = &known.evidence else { continue };
        let column = finite.iter().position(|slot| slot.variable == known.variable);
        let column = column.expect("internal: what is known softly is searched");
        let mut believed = vec![0.0; weights.len()];
        for (values, component) in law.values.iter().zip(&law.mixture.0) {
            believed[values[column]] += component.weight;
        }
        if let Some(value) = (0..weights.len()).find(|at| weights[*at] > 0.0 && believed[*at] == 0.0) {
            return Err(value_excluded(model, ask, known.variable, (value, weights[value])));
        }
        for (values, component) in law.values.iter().zip(&mut law.mixture.0) {
            let value = values[column];
            component.weight *= if believed[value] > 0.0 { weights[value] / believed[value] } else { 0.0 };
        }
    }
    let asked = |place: &usize| ask.searched.iter().any(|item| item.variable == part.of[*place].variable);
    let places: Vec<usize> = (0..part.of.len()).filter(asked).collect();
    let whole = Part { law: PartLaw::ConditionalGaussian(law), ..part.clone() };
    let part = whole.marginal(&places);
    Ok(Answer {
        question,
        // Soft evidence is not an event, so it has no probability.
        ln_evidence: None,
        estimate: None,
        answer: part.rows_of(model, ask, seed)?.into(),
        strategy,
        when: ask.when,
        parts: vec![part],
    })
}

/// The error that a value is impossible whose soft evidence is above 0.
fn value_excluded(model: &Model, ask: &Ask, variable: VariableId, (value, q): (usize, f64)) -> Error {
    let (value, q) = (model.value_name(variable, value), exact(q));
    let message = format!(
        "soft evidence gives `{value}` the probability {q}, but it is impossible given the other evidence of `{}`",
        model.ask_text(ask)
    );
    Error::input(model.variable_name(variable), message)
}

/// The table of an ask, from that of its part.
///
/// # Errors
/// Soft evidence gives a positive probability to a value that the other evidence excludes.
pub(super) fn applied(model: &Model, ask: &Ask, known: &[Known], mut table: Table) -> Result<Table, Error> {
    let softly: Vec<_> = (known.iter())
        .filter_map(|known| match &known.evidence {
            Finding::Soft(weights) => Some((known.variable, weights)),
            _ => None,
        })
        .collect();
    if softly.is_empty() {
        return Ok(table);
    }
    let width = table.width();
    let columns: Vec<usize> = (softly.iter())
        .map(|(id, _)| table.left.iter().position(|column| column.variable == Some(*id)))
        .map(|position| position.expect("internal: a softly known variable is searched"))
        .collect();
    let ordinals: Vec<Vec<usize>> = (0..width).map(|at| Column::ordinals(&table.left, at)).collect();
    let mut all = table.extended();
    for numbers in all.chunks_mut(width) {
        if numbers.iter().all(|p| *p == Extended::ZERO) {
            continue;
        }
        for ((id, weights), column) in softly.iter().zip(&columns) {
            let mut believed = vec![Extended::ZERO; weights.len()];
            for (p, ordinals) in numbers.iter().zip(&ordinals) {
                let sum = &mut believed[ordinals[*column]];
                *sum = *sum + *p;
            }
            let excluded =
                (0..weights.len()).find(|value| weights[*value] > 0.0 && believed[*value] == Extended::ZERO);
            if let Some(value) = excluded {
                // In a table with contexts, only this context is impossible.
                if !table.right.is_empty() {
                    numbers.fill(Extended::ZERO);
                    break;
                }
                return Err(value_excluded(model, ask, *id, (value, weights[value])));
            }
            for (p, ordinals) in numbers.iter_mut().zip(&ordinals) {
                let value = ordinals[*column];
                if believed[value] > Extended::ZERO {
                    *p = *p * (Extended::from_f64(weights[value]) / believed[value]);
                }
            }
        }
    }
    // The variables with soft evidence are the last columns, so a context's remaining table is the sum over runs of
    // them.
    let run: usize = columns.iter().map(|column| table.left[*column].values.len()).product();
    let all: Vec<Extended> = all.chunks(run).map(|run| run.iter().copied().sum()).collect();
    table.numbers = all.iter().map(|p| p.to_f64()).collect();
    table.extended = Some(all);
    table.left.truncate(table.left.len() - softly.len());
    Ok(table)
}

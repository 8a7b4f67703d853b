//! Validation of questions.
//!
//! In: a question, declared or asked later. Out: its faults. Invariant: a variable is searched or known, not both, and
//! once; every value lies in its domain; the statistic is defined for the distribution.

use super::{Fault, Place, fault, fault_with_help};
use crate::ids::{QuestionId, VariableId};
use crate::model::{
    Ask, Bound, Domain, Finding, IndexSpace, Known, Model, Question, Range, Searched, Statistic, Value, When,
};
use std::collections::HashSet;

/// Tolerance of the sum of soft evidence.
const SUM_TOLERANCE: f64 = 1e-9;

pub(in crate::compiler::model) fn question_faults(
    model: &Model,
    question: &Question,
    id: Option<QuestionId>,
) -> Vec<Fault> {
    let mut faults = Vec::new();
    for (number, ask) in question.asks.iter().enumerate() {
        let place = Place::Ask(id, number);
        if ask.searched.is_empty() {
            faults.push(fault(place, "this question searches nothing"));
        }
        let mut seen = HashSet::new();
        for searched in &ask.searched {
            let name = model.variable_name(searched.variable);
            if !seen.insert(searched.variable) {
                faults.push(fault(place, format!("`{name}` is searched twice")));
            }
            faults
                .extend(searched.at.as_ref().and_then(|at| value_fault(model, place, searched.variable, at)));
        }
        faults.extend(known_faults(model, place, &seen, &ask.known));
        faults.extend(known_faults(model, place, &seen, ask.statistic.from()));
        faults.extend(statistic_fault(model, place, ask));
    }
    faults
}

fn known_faults(model: &Model, place: Place, searched: &HashSet<VariableId>, known: &[Known]) -> Vec<Fault> {
    let mut faults = Vec::new();
    let mut once = HashSet::new();
    for known in known {
        let name = model.variable_name(known.variable);
        // A likelihood multiplies the joint distribution: the variable is not known by it.
        let is_known = !matches!(known.evidence, Finding::Virtual(_));
        if is_known && searched.contains(&known.variable) {
            let message = format!("this question asks what it knows: `{name}` is on both sides");
            faults.push(fault(place, message));
        }
        if !once.insert(known.variable) {
            faults.push(fault(place, format!("`{name}` is known twice")));
        }
        match &known.evidence {
            Finding::Hard(value) => faults.extend(value_fault(model, place, known.variable, value)),
            Finding::Each => {}
            Finding::Virtual(_) | Finding::Soft(_) if is_whole(model, known.variable) => {
                faults.push(whole_fault(model, place, known));
            }
            Finding::Virtual(weights) => {
                let each = format!("virtual evidence gives each value of `{name}` a likelihood");
                faults.extend(count_fault(model, place, known.variable, &each, weights));
                faults.extend(likelihood_fault(place, &name, weights));
            }
            Finding::Soft(weights) => {
                let each = format!("soft evidence gives each value of `{name}` a probability");
                let count = count_fault(model, place, known.variable, &each, weights);
                faults.extend(count.or_else(|| soft_fault(place, &name, weights)));
            }
        }
    }
    faults
}

/// Whether a variable is a whole family; each element of a slice has the same likelihoods.
fn is_whole(model: &Model, variable: VariableId) -> bool {
    let declared = &model.variables[variable];
    declared.family.is_some() && declared.derived.is_none()
}

/// Uncertain evidence on a whole family.
fn whole_fault(model: &Model, place: Place, known: &Known) -> Fault {
    let name = model.variable_name(known.variable);
    let over = model.variables[known.variable].family.map(|family| family.over);
    let (kind, indices) = match (&known.evidence, over) {
        (Finding::Virtual(_), Some(IndexSpace::Range(Range { low, high: Bound { size: None, offset } }))) => {
            ("virtual", format!("{low}..={offset}"))
        }
        (Finding::Virtual(_), over) => ("virtual", over.map_or(0, |over| over.first()).to_string()),
        (_, over) => ("soft", over.map_or(0, |over| over.first()).to_string()),
    };
    let weights = match &known.evidence {
        Finding::Virtual(weights) | Finding::Soft(weights) => weights.as_slice(),
        _ => &[],
    };
    let weights: Vec<String> = weights.iter().map(f64::to_string).collect();
    fault_with_help(
        place,
        format!("`{name}` is a family: {kind} evidence is given to its elements"),
        format!("write `{name}[{indices}] {kind} [{}]`", weights.join(", ")),
    )
}

/// The number of entries is not the number of values.
fn count_fault(
    model: &Model,
    place: Place,
    variable: VariableId,
    each: &str,
    weights: &[f64],
) -> Option<Fault> {
    let declared = &model.variables[variable];
    let count = declared.domain.count();
    if count == Some(weights.len()) {
        return None;
    }
    let message = match (count, declared.domain.is_finite()) {
        (Some(count), _) => format!("{each}: expected {count}, found {}", weights.len()),
        (None, true) => {
            format!("{each}: expected a number of values that is known here, found {}", weights.len())
        }
        (None, false) => format!("{each}, but it is `{}`", model.domain_text(&declared.domain)),
    };
    Some(fault(place, message))
}

fn likelihood_fault(place: Place, name: &str, weights: &[f64]) -> Option<Fault> {
    if let Some(bad) = weights.iter().find(|weight| !weight.is_finite() || **weight < 0.0) {
        return Some(fault(place, format!("a likelihood is a number ≥ 0, but this is {bad}")));
    }
    let zero = weights.iter().all(|weight| *weight == 0.0);
    zero.then(|| fault(place, format!("the likelihoods of `{name}` are all zero")))
}

fn soft_fault(place: Place, name: &str, weights: &[f64]) -> Option<Fault> {
    if let Some(bad) = weights.iter().find(|weight| !(0.0..=1.0).contains(*weight)) {
        return Some(fault(place, format!("a probability is between 0 and 1, but this is {bad}")));
    }
    // Without the last digits, which come from rounding.
    let total = (weights.iter().sum::<f64>() * 1e12).round() / 1e12;
    ((total - 1.0).abs() > SUM_TOLERANCE).then(|| {
        let written: Vec<_> = weights.iter().map(f64::to_string).collect();
        fault_with_help(
            place,
            format!("soft evidence is the posterior of `{name}`: it must sum to 1, but this sums to {total}"),
            format!(
                "likelihoods need not sum to 1: they are written `{name} virtual [{}]`",
                written.join(", ")
            ),
        )
    })
}

/// Statistics that are not defined for a distribution.
fn statistic_fault(model: &Model, place: Place, ask: &Ask) -> Option<Fault> {
    let levels = match &ask.statistic {
        Statistic::Quantile(levels) => levels.as_slice(),
        Statistic::Interval(level) => std::slice::from_ref(level),
        _ => &[],
    };
    if let Some(level) = levels.iter().find(|level| !(**level > 0.0 && **level < 1.0)) {
        let word = ask.statistic.word();
        let message = format!("`{word}` takes probabilities above 0 and below 1, but {level} is not");
        let help = match *level >= 2.0 && *level < 100.0 {
            true => format!("{level} % is `{}`", level / 100.0),
            false => "the least and the largest value have no probability of their own".to_owned(),
        };
        return Some(fault_with_help(place, message, help));
    }
    let words = [ask.statistic.word(), ask.when.word()];
    if let Some(word) = words.iter().find(|word| word.contains("(0)")) {
        let help = format!("write `{} P(…)`, or more", word.replace('0', "1"));
        return Some(fault_with_help(place, format!("`{word}` asks for nothing"), help));
    }
    if ask.when.is_over_time() && !model.variables.values().any(|it| it.previous_of.is_some()) {
        let message = format!(
            "`{}` is asked over time, but no variable of `{}` has a previous instant",
            ask.when.word(),
            model.name
        );
        return Some(fault_with_help(place, message, "declare one, such as `X, X^-1 : bool`"));
    }
    if let Some(fault) = when_fault(place, ask) {
        return Some(fault);
    }
    let word = ask.words();
    let word = word.trim_end();
    let slices = matches!(
        ask.statistic,
        Statistic::Distribution | Statistic::Maximum | Statistic::Argmax { .. } | Statistic::Best(_)
    );
    // The entropy of a slice is the sum over that slice.
    let wanted = ask.searched.iter().find(|searched| searched.at.is_some());
    if let (Some(wanted), false) = (wanted, slices || ask.statistic == Statistic::Entropy) {
        let name = model.variable_name(wanted.variable);
        let message = format!("`{word}` needs a whole distribution, but `{name}` has a given value");
        return Some(fault_with_help(place, message, "move it behind the bar, if it is known"));
    }
    if let Some(fault) = part_fault(model, place, ask) {
        return Some(fault);
    }
    match ask.statistic {
        Statistic::Expectation | Statistic::Variance | Statistic::Quantile(_) | Statistic::Interval(_) => {
            let ordered = ask.statistic.levels().is_some();
            let without = |id: &VariableId| !is_number(model, *id) || is_circle(model, *id);
            let variable = ask.searched.iter().map(|searched| searched.variable).find(without)?;
            let (name, word) = (model.variable_name(variable), ask.statistic.word());
            let what = word.split('(').next().unwrap_or(&word);
            let message = match model.variables[variable].family {
                Some(_) => format!("`{name}` is a family: it has no one {what}"),
                None => {
                    let text = model.domain_text(&model.variables[variable].domain);
                    let why = match (is_circle(model, variable), ordered) {
                        (true, true) => "whose values have no first",
                        (true, false) => "whose numbers depend on where it is cut",
                        (false, _) => "which are not numbers",
                    };
                    format!("`{name}` is `{text}`, {why}: it has no {what}")
                }
            };
            Some(fault_with_help(
                place,
                message,
                format!("ask for `P({name} | …)`, or `argmax P({name} | …)`"),
            ))
        }
        Statistic::Information if ask.searched.len() != 2 => {
            let found = match ask.searched.len() {
                1 => "1 is".to_owned(),
                several => format!("{several} are"),
            };
            let message = format!("`information` is between two searched variables, but {found} searched");
            Some(fault_with_help(place, message, "write `information P(X, Y | …)`"))
        }
        _ => None,
    }
}

/// A value of one variable together with the whole distribution of a real: a law of the real is that over all values.
fn part_fault(model: &Model, place: Place, ask: &Ask) -> Option<Fault> {
    let wanted = ask.searched.iter().find(|item| item.at.is_some())?;
    let is_real = |item: &&Searched| item.at.is_none() && !model.variables[item.variable].domain.is_finite();
    let real = ask.searched.iter().find(is_real)?;
    let of = |item: &Searched, known: Vec<Known>| {
        let searched = vec![item.clone()];
        model.ask_text(&Ask { statistic: Statistic::Distribution, when: ask.when, searched, known })
    };
    let evidence = Finding::Hard(wanted.at.clone()?);
    let given = ask.known.iter().cloned().chain([Known { variable: wanted.variable, evidence }]);
    let (alone, rest) = (of(wanted, ask.known.clone()), of(real, given.collect()));
    let message = format!(
        "`{}` asks for one value of `{}` and for the whole distribution of the real `{}`",
        model.ask_text(ask),
        model.variable_name(wanted.variable),
        model.variable_name(real.variable)
    );
    Some(fault_with_help(place, message, format!("ask for `{alone}`, and for `{rest}`")))
}

/// A statistic that is not defined for its instants.
fn when_fault(place: Place, ask: &Ask) -> Option<Fault> {
    let (statistic, when) = (ask.statistic.word(), ask.when.word());
    match (ask.when, &ask.statistic) {
        (When::Sequence, Statistic::Argmax { nearest: Some(_) }) => {
            let message = "`nearest` breaks the ties of one instant, but a sequence covers all";
            Some(fault_with_help(place, message, "leave it out, or ask for `argmax smooth P(…) nearest …`"))
        }
        (
            When::Sequence,
            Statistic::Argmax { .. } | Statistic::Maximum | Statistic::Best(_) | Statistic::Draw(_),
        ) => None,
        (When::Sequence, _) => {
            let message = format!("`{statistic}` is defined for one instant, but a sequence covers all");
            Some(fault_with_help(place, message, format!("write `{statistic} smooth P(…)`")))
        }
        (_, Statistic::Divergence { when: second, .. }) => {
            let now = |when: &When| !when.is_over_time();
            let fits = match (ask.when, *second) {
                (_, When::Sequence) => false,
                (When::Smooth, second) => matches!(second, When::Smooth | When::Filter),
                (first, When::Smooth) => first == When::Filter,
                (first, second) => now(&first) == now(&second),
            };
            let message = match second {
                When::Now => {
                    format!("the first distribution is asked over time (`{when}`), the second is not")
                }
                second => format!(
                    "`{}` is not compared with {}",
                    second.word(),
                    match ask.when {
                        When::Now => "a distribution of one instant alone".to_owned(),
                        _ => format!("`{when}`"),
                    }
                ),
            };
            (!fits).then(|| {
                let help = "over time `filter` and `predict` can be compared, and `smooth` with `filter`";
                fault_with_help(place, message, help)
            })
        }
        _ => None,
    }
}

/// Whether the values of a variable are numbers, or vectors or families of reals: labels and the elements of sets are not.
fn is_number(model: &Model, variable: VariableId) -> bool {
    let variable = &model.variables[variable];
    let numbers = match &variable.domain {
        Domain::Finite { labels, .. } => labels.is_empty(),
        Domain::Set(_) => false,
        _ => true,
    };
    numbers && (variable.family.is_none() || !variable.domain.is_finite())
}

/// Whether the values of a variable lie on a circle.
fn is_circle(model: &Model, variable: VariableId) -> bool {
    model.variables[variable].domain.bins().is_some_and(|bins| bins.is_circle())
}

fn value_fault(model: &Model, place: Place, variable: VariableId, value: &Value) -> Option<Fault> {
    let name = model.variable_name(variable);
    let domain = &model.variables[variable].domain;
    let text = model.domain_text(domain);
    match value {
        Value::Ordinal(ordinal) => {
            let out = domain.count().is_some_and(|count| *ordinal >= count) || !domain.is_finite();
            out.then(|| {
                fault(place, format!("`{name}` is `{text}`, which has no value of ordinal {ordinal}"))
            })
        }
        Value::Real(number) => (*domain != Domain::Real)
            .then(|| fault(place, format!("`{name}` is `{text}`, but its value is {number}"))),
        Value::Vector(numbers) => (*domain != Domain::Vector(numbers.len()))
            .then(|| fault(place, format!("`{name}` is `{text}`, but {} numbers are given", numbers.len()))),
        Value::Given(_) => None,
    }
}

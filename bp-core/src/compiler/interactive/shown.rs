//! How answers are read from the results of functions.
//!
//! In: an ask, the places of its distributions, and their kernels. Out: a [`Shown`], which the page's `answer.js`
//! follows. Invariant: columns and their order are those of [`Table`].

use crate::error::Error;
use crate::ids::{AxisId, VariableId};
use crate::kernel::OutputKey;
use crate::lower::{Lowered, Output};
use crate::model::{Ask, Finding, Form, IndexSpace, Known, Model, Searched, Statistic, Value, When};
use crate::posterior::{Column, Table};
use serde::Serialize;

/// The most numbers of one answer of a page.
const MOST_NUMBERS: usize = 1 << 20;

/// An answer.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct Shown {
    /// The ask, as a user would type it.
    pub text: String,
    /// The statistic.
    pub statistic: NamedStatistic,
    /// The distributions that it is made of: one, or the two of a divergence.
    pub sources: Vec<Source>,
    /// The values of searched variables that the question names: a column of the first distribution, and a value's place.
    pub wanted: Vec<(usize, usize)>,
    /// The names and the values of searched variables that have no column, because the question names their value.
    pub bound: Vec<(String, String)>,
    /// The values of searched reals, at which a density is asked.
    pub at: Vec<f64>,
    /// Whether its numbers are densities.
    pub is_density: bool,
}

/// A statistic, by its word in the language: `""` is the distribution itself.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct NamedStatistic {
    /// The word.
    pub word: &'static str,
    /// The number of values of `best`, or of the reals of the first part of `information`.
    pub count: usize,
    /// The levels of `quantile` and of the ends of `interval`.
    pub levels: Vec<f64>,
    /// The probability of an `interval`.
    pub level: f64,
}

/// A distribution in the results of a run.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct Source {
    /// The place of the run among those of the question.
    pub run: usize,
    /// The place of the array among its answers.
    pub output: usize,
    /// Whether it is a normal law, given by its moments: means, then covariances, row by row up to the diagonal.
    pub is_law: bool,
    /// The known variables with a context for each value.
    pub right: Vec<Axis>,
    /// The searched ones.
    pub left: Vec<Axis>,
    /// The place in the array of each number of the table; empty where it is the same.
    pub order: Vec<usize>,
    /// The variables with soft evidence, which are the last ones of the table, in the order in which it is applied.
    pub soft: Vec<Soft>,
}

/// Soft evidence on a variable.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct Soft {
    /// The name of the variable.
    pub name: String,
    /// Its place among the variables with soft evidence.
    pub column: usize,
    /// The probability of each of its values.
    pub weights: Vec<f64>,
}

/// A variable of a distribution.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct Axis {
    /// Its name.
    pub name: String,
    /// The names of its values.
    pub values: Vec<String>,
    /// Their numbers, as in an expression.
    pub numbers: Vec<f64>,
    /// The edges, where values are intervals.
    pub edges: Vec<f64>,
}

/// Whether a page can read an ask; `observed`: it has columns for observations over time.
pub(super) fn is_read(model: &Model, ask: &Ask, observed: bool) -> Result<(), Error> {
    let refused =
        |reason: &str| Err(Error::Unplanned { question: model.ask_text(ask), reason: reason.to_owned() });
    let is_plain = matches!(ask.statistic, Statistic::Distribution | Statistic::Argmax { nearest: None });
    match &ask.statistic {
        _ if ask.when.is_over_time() && !observed => {
            refused("it is asked over time, and its observations have no columns here")
        }
        Statistic::Draw(_) => refused("it draws at random"),
        Statistic::Argmax { nearest: Some(_) } => refused("a field breaks its ties"),
        Statistic::Divergence { when, .. } if ask.when.is_every_instant() || when.is_every_instant() => {
            refused("it compares the distributions of all instants")
        }
        _ if ask.when == When::Sequence && !is_plain => {
            refused("of `sequence` it computes the most likely one")
        }
        _ => Ok(()),
    }
}

/// How an ask is read.
pub(super) fn shown(model: &Model, ask: &Ask, mut sources: Vec<Source>) -> Result<Shown, Error> {
    let refused =
        |reason: &str| Err(Error::Unplanned { question: model.ask_text(ask), reason: reason.to_owned() });
    let is_divergence = matches!(ask.statistic, Statistic::Divergence { .. });
    if is_divergence && sources.iter().any(|source| !source.right.is_empty()) {
        return refused("it compares two tables");
    }
    let all = [&ask.known[..], ask.statistic.from()];
    for (source, known) in sources.iter_mut().zip(all) {
        soften(model, source, known);
    }
    let (mut wanted, mut bound, mut at) = (Vec::new(), Vec::new(), Vec::new());
    for item in &ask.searched {
        let name = model.variable_name(item.variable);
        match &item.at {
            Some(Value::Ordinal(ordinal)) => {
                match sources[0].left.iter().position(|axis| axis.name == name) {
                    Some(column) => wanted.push((column, *ordinal)),
                    None => bound.push((name, model.value_name(item.variable, *ordinal))),
                }
            }
            Some(Value::Real(number)) => at.push(*number),
            Some(Value::Vector(numbers)) => at.extend(numbers),
            Some(Value::Given(_)) if sources[0].is_law => {
                return refused("the value at which its density is asked is given with the question");
            }
            Some(Value::Given(_)) | None => {}
        }
    }
    let has_density = |item: &Searched| {
        let form = || model.factor_of(item.variable).map(|id| &model.factors[id].form);
        item.at.is_some()
            && !model.variables[item.variable].domain.is_finite()
            && form().is_some_and(Form::has_density)
    };
    let is_density = ask.searched.iter().any(has_density);
    let statistic = NamedStatistic {
        word: match ask.statistic {
            _ if ask.when == When::Sequence => "sequence",
            Statistic::Distribution => "",
            Statistic::Maximum => "max",
            Statistic::Argmax { .. } => "argmax",
            Statistic::Best(_) => "best",
            Statistic::Draw(_) => "draw",
            Statistic::Entropy => "entropy",
            Statistic::Expectation => "expectation",
            Statistic::Variance => "variance",
            Statistic::Quantile(_) => "quantile",
            Statistic::Interval(_) => "interval",
            Statistic::Information => "information",
            Statistic::Divergence { .. } => "divergence",
        },
        count: match ask.statistic {
            Statistic::Best(count) => count,
            _ => first_part(model, ask, &sources[0]),
        },
        levels: ask.statistic.levels().unwrap_or_default(),
        level: if let Statistic::Interval(level) = ask.statistic { level } else { 0.0 },
    };
    let text = model.ask_text(&without_values(ask));
    Ok(Shown { text, statistic, sources, wanted, bound, at, is_density })
}

/// The number of columns of the first searched variable.
fn first_part(model: &Model, ask: &Ask, source: &Source) -> usize {
    let name = ask.searched.first().map(|item| model.variable_name(item.variable)).unwrap_or_default();
    let is_own = |axis: &&Axis| axis.name == name || axis.name.starts_with(&format!("{name}["));
    source.left.iter().take_while(is_own).count()
}

/// Takes the variables with soft evidence, which are the last ones, from the columns.
fn soften(model: &Model, source: &mut Source, known: &[Known]) {
    let softly = known.iter().filter_map(|known| match &known.evidence {
        Finding::Soft(weights) => Some((model.variable_name(known.variable), weights.clone())),
        _ => None,
    });
    let softly: Vec<(String, Vec<f64>)> = softly.collect();
    let own = source.left.split_off(source.left.len().saturating_sub(softly.len()));
    let place = |name: &String| own.iter().position(|axis| axis.name == *name);
    source.soft = softly
        .into_iter()
        .filter_map(|(name, weights)| Some(Soft { column: place(&name)?, name, weights }))
        .collect();
}

/// The ask without the names of the values that controls give.
fn without_values(ask: &Ask) -> Ask {
    let mut ask = ask.clone();
    let clear = |known: &mut Known| {
        if let Finding::Hard(Value::Given(_)) = known.evidence {
            known.evidence = Finding::Each;
        }
    };
    ask.known.iter_mut().for_each(clear);
    if let Statistic::Divergence { from, .. } = &mut ask.statistic {
        from.iter_mut().for_each(clear);
    }
    ask
}

/// The distribution of an ask in the results of a run: that of one of its tables.
pub(super) fn of_table(model: &Model, run: usize, lowered: &Lowered, table: usize) -> Result<Source, Error> {
    let Lowered { kernel, outputs } = lowered;
    let mut asked = outputs.iter().filter(|output| output.ask.is_some());
    let output: &Output = asked.nth(table).expect("internal: every ask has an output");
    let ask = output.ask.as_ref().expect("internal: it was selected");
    let asks = kernel.outputs().filter(|(_, key)| matches!(key, OutputKey::Ask(_)));
    let found = asks.enumerate().find(|(_, (_, key))| *key == output.key);
    let (number, (buffer, _)) = found.expect("internal: the output exists");
    let extent = |axis: &AxisId| {
        kernel.axes[*axis].extent.known().expect("internal: sizes are known where code is written")
    };
    let extents: Vec<usize> = kernel.buffers[buffer].axes.iter().map(extent).collect();
    let count: usize = extents.iter().product();
    let text = model.ask_text(ask);
    if count > MOST_NUMBERS {
        let help = "give values to more of its variables".to_owned();
        return Err(Error::TooLarge { name: text, cells: count as f64, most: MOST_NUMBERS as f64, help });
    }
    // The table of the places of cells shows where each of its numbers comes from.
    let cells = (0..count).map(|cell| cell as f64).collect();
    let table = Table::read(model, (ask, text), &output.variables, cells, None, &extents);
    let order: Vec<usize> = table.numbers.iter().map(|place| *place as usize).collect();
    let order = if order.is_sorted() { Vec::new() } else { order };
    let axes = |columns: &[Column]| columns.iter().map(|column| axis(model, column)).collect();
    let (right, left) = (axes(&table.right), axes(&table.left));
    Ok(Source { run, output: number, is_law: false, right, left, order, soft: Vec::new() })
}

/// The normal law of some variables, each with its elements, if it is a family, and its components.
pub(super) fn of_law(model: &Model, run: usize, searched: &[(VariableId, Option<usize>, usize)]) -> Source {
    let names = searched.iter().flat_map(|(id, elements, components)| {
        let count = elements.unwrap_or(1) * components;
        let low = match model.variables[*id].family.map(|family| family.over) {
            Some(IndexSpace::Range(range)) => range.low,
            _ => 0,
        };
        let name = move |place: usize| match elements.is_none() && *components == 1 {
            true => model.variable_name(*id),
            false => model.element_name(*id, place as i64 + low),
        };
        (0..count).map(name)
    });
    let axis = |name| Axis { name, values: Vec::new(), numbers: Vec::new(), edges: Vec::new() };
    let left = names.map(axis).collect();
    Source { run, output: 0, is_law: true, right: Vec::new(), left, order: Vec::new(), soft: Vec::new() }
}

fn axis(model: &Model, column: &Column) -> Axis {
    let domain = column.variable.map(|id| &model.variables[id].domain);
    let numbers = (0..column.values.len()).map(|ordinal| domain.map_or(0.0, |domain| domain.number(ordinal)));
    let edges = domain.and_then(|domain| domain.bins()).filter(|bins| bins.points().is_none());
    Axis {
        name: column.name.clone(),
        values: column.values.clone(),
        numbers: numbers.collect(),
        edges: edges.map_or_else(Vec::new, |bins| bins.edges().to_vec()),
    }
}

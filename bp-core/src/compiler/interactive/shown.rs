//! How answers are read from the results of functions.
//!
//! In: an ask, the places of its distributions, and their kernels. Out: a [`Shown`], which the page's `answer.js`
//! follows. Invariant: columns and their order are those of [`Table`].

use crate::error::Error;
use crate::ids::AxisId;
use crate::kernel::OutputKey;
use crate::lower::{Lowered, Output};
use crate::model::{Ask, Finding, Known, Model, Statistic, Value};
use crate::plan::Place;
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
}

/// A statistic, by its word in the language: `""` is the distribution itself.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct NamedStatistic {
    /// The word.
    pub word: &'static str,
    /// The number of values of `best`.
    pub count: usize,
    /// The levels of `quantile` and of the ends of `interval`.
    pub levels: Vec<f64>,
    /// The probability of an `interval`.
    pub level: f64,
}

/// A distribution in the results of a function.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct Source {
    /// The place of the function among those of the question.
    pub function: usize,
    /// The place of the array among its answers.
    pub output: usize,
    /// The known variables with a context for each value.
    pub right: Vec<Axis>,
    /// The searched ones.
    pub left: Vec<Axis>,
    /// The place in the array of each number of the table; empty where it is the same.
    pub order: Vec<usize>,
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

/// Whether a page can read an ask.
pub(super) fn is_read(model: &Model, ask: &Ask) -> Result<(), Error> {
    let refused =
        |reason: &str| Err(Error::Unplanned { question: model.ask_text(ask), reason: reason.to_owned() });
    let known = ask.known.iter().chain(ask.statistic.from());
    match &ask.statistic {
        _ if ask.when.is_over_time() => refused("it is asked over time, of a table of observations"),
        Statistic::Draw(_) => refused("it draws at random"),
        Statistic::Argmax { nearest: Some(_) } => refused("a field breaks its ties"),
        _ if known.into_iter().any(|known| matches!(known.evidence, Finding::Soft(_))) => {
            refused("soft evidence replaces a distribution after it is computed")
        }
        _ => Ok(()),
    }
}

/// How an ask is read.
pub(super) fn shown(
    model: &Model,
    ask: &Ask,
    places: &[Place],
    parts: &[(Lowered, Vec<usize>)],
) -> Result<Shown, Error> {
    let sources: Vec<Source> =
        places.iter().map(|place| source(model, *place, parts)).collect::<Result<_, _>>()?;
    if matches!(ask.statistic, Statistic::Divergence { .. })
        && sources.iter().any(|source| !source.right.is_empty())
    {
        let reason = "it compares two tables".to_owned();
        return Err(Error::Unplanned { question: model.ask_text(ask), reason });
    }
    let (mut wanted, mut bound) = (Vec::new(), Vec::new());
    for item in &ask.searched {
        let Some(Value::Ordinal(ordinal)) = item.at else { continue };
        let name = model.variable_name(item.variable);
        match sources[0].left.iter().position(|axis| axis.name == name) {
            Some(column) => wanted.push((column, ordinal)),
            None => bound.push((name, model.value_name(item.variable, ordinal))),
        }
    }
    let statistic = NamedStatistic {
        word: match ask.statistic {
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
        count: if let Statistic::Best(count) = ask.statistic { count } else { 0 },
        levels: ask.statistic.levels().unwrap_or_default(),
        level: if let Statistic::Interval(level) = ask.statistic { level } else { 0.0 },
    };
    Ok(Shown { text: model.ask_text(&without_values(ask)), statistic, sources, wanted, bound })
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

fn source(model: &Model, place: Place, parts: &[(Lowered, Vec<usize>)]) -> Result<Source, Error> {
    let (Lowered { kernel, outputs }, tables) = &parts[place.route];
    let mut asked = outputs.iter().filter(|output| output.ask.is_some());
    let output: &Output = asked.nth(tables[place.ask]).expect("internal: every ask has an output");
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
    Ok(Source {
        function: place.route,
        output: number,
        right: axes(&table.right),
        left: axes(&table.left),
        order,
    })
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

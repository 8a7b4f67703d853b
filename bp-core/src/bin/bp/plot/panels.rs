//! The panels of an answer.
//!
//! In: an answer. Out: bars for a finite variable, a heat map for two, panels of reals, lines over instants. Invariant: the
//! numbers are those of the answer.

use super::{Bars, Course, Curve, Heat, MOST_LINES, Panel, reals, stairs};
use bp_core::compiler::answer::{Answer, Figure, Row};
use bp_core::compiler::model::Model;
use std::collections::BTreeMap;

/// Bars of a panel, and values of an axis of a heat map.
const MOST_BARS: usize = 40;
const MOST_CELLS: usize = 200;

pub(super) fn of(model: &Model, answer: &Answer) -> Vec<Panel> {
    // `filter` has the last instant alone: a distribution as any other.
    if answer.when.is_over_time()
        && answer.answer.iter().any(|row| row.values.iter().any(|(name, _)| name == "t"))
    {
        return if stairs::are_values(answer) { stairs::of(model, answer) } else { courses(answer) };
    }
    let mut panels = Vec::new();
    for rows in answer.answer.chunk_by(alike) {
        panels.extend(finite(&answer.question, rows));
    }
    panels.extend(answer.parts.iter().flat_map(|part| reals::of(model, &answer.question, part)));
    panels
}

/// Whether rows have the same columns and the same kind of number.
fn alike(one: &Row, other: &Row) -> bool {
    let names = |row: &Row| row.values.iter().map(|(name, _)| name.clone()).collect::<Vec<_>>();
    std::mem::discriminant(&one.figure) == std::mem::discriminant(&other.figure) && names(one) == names(other)
}

/// The number of a row with its error, and what it measures.
fn measured(figure: &Figure) -> Option<(f64, f64, &'static str)> {
    match *figure {
        Figure::Probability { p } => Some((p, 0.0, "probability")),
        Figure::Estimated { p, error } => Some((p, error, "probability")),
        Figure::Expectation { expectation, error } => {
            Some((expectation, error.unwrap_or(0.0), "expectation"))
        }
        Figure::Variance { variance, error } => Some((variance, error.unwrap_or(0.0), "variance")),
        Figure::Entropy { entropy, error } => Some((entropy, error.unwrap_or(0.0), "entropy (nats)")),
        Figure::Information { information } => Some((information, 0.0, "mutual information (nats)")),
        Figure::Divergence { divergence, .. } => Some((divergence, 0.0, "divergence (nats)")),
        _ => None,
    }
    .filter(|(number, _, _)| number.is_finite())
}

/// Bars, or a heat map of two columns.
fn finite(question: &str, rows: &[Row]) -> Option<Panel> {
    let numbers: Option<Vec<_>> = rows.iter().map(|row| measured(&row.figure)).collect();
    let numbers = numbers?;
    let measure = numbers.first()?.2.to_owned();
    let names: Vec<&str> = rows[0].values.iter().map(|(name, _)| name.as_str()).collect();
    let values = |column: usize| {
        let mut seen: Vec<String> = Vec::new();
        for row in rows {
            if !seen.contains(&row.values[column].1) {
                seen.push(row.values[column].1.clone());
            }
        }
        seen
    };
    if let [across, upwards] = names.as_slice() {
        let (columns, lines) = (values(0), values(1));
        let is_grid = columns.len() * lines.len() == rows.len() && columns.len() > 1 && lines.len() > 1;
        if is_grid && columns.len().max(lines.len()) <= MOST_CELLS {
            let mut cells = vec![0.0; rows.len()];
            for (row, (number, _, _)) in rows.iter().zip(&numbers) {
                let x = columns.iter().position(|one| *one == row.values[0].1)?;
                let y = lines.iter().position(|one| *one == row.values[1].1)?;
                cells[y * columns.len() + x] = *number;
            }
            return Some(Panel::Heat(Heat {
                title: question.to_owned(),
                across: ((*across).to_owned(), columns),
                upwards: ((*upwards).to_owned(), lines),
                measure,
                numbers: cells,
            }));
        }
    }
    if let Some(contexts) = of_contexts(question, rows, &names) {
        return Some(contexts);
    }
    let label = |row: &Row| {
        let words: Vec<&str> = row.values.iter().map(|(_, value)| value.as_str()).collect();
        words.join(", ")
    };
    let mut bars: Vec<(String, f64, f64)> =
        (rows.iter().zip(&numbers)).map(|(row, (number, error, _))| (label(row), *number, *error)).collect();
    let mut across = names.join(", ");
    if bars.len() > MOST_BARS && names.len() > 1 {
        bars.sort_by(|one, other| other.1.total_cmp(&one.1));
        across = format!("{across}: the {MOST_BARS} largest of {}", bars.len());
        bars.truncate(MOST_BARS);
    }
    Some(Panel::Bars(Bars { title: question.to_owned(), across, upwards: measure, bars }))
}

/// A heat map of several distributions, one for each context: a column for each context, a row for each value.
fn of_contexts(question: &str, rows: &[Row], names: &[&str]) -> Option<Panel> {
    let numbers: Vec<f64> = rows.iter().map(|row| row.p()).collect::<Option<_>>()?;
    let different = |column: usize| {
        let mut seen: Vec<&str> = rows.iter().map(|row| row.values[column].1.as_str()).collect();
        seen.sort_unstable();
        seen.dedup();
        seen.len()
    };
    // What is searched stands last, and its probabilities sum to one in each context that is possible.
    let is_whole = |part: &[f64]| {
        let total: f64 = part.iter().sum();
        total == 0.0 || (total - 1.0).abs() < 1e-9
    };
    let mut block = 1;
    for first in (1..names.len()).rev() {
        block *= different(first);
        if block > 1 && rows.len().is_multiple_of(block) && numbers.chunks(block).all(is_whole) {
            let contexts = rows.len() / block;
            if names.len() < 3 || contexts < 2 || contexts.max(block) > MOST_CELLS {
                return None;
            }
            let label = |row: &Row, columns: std::ops::Range<usize>| {
                row.values[columns].iter().map(|(_, value)| value.as_str()).collect::<Vec<_>>().join(", ")
            };
            let across = rows.iter().step_by(block).map(|row| label(row, 0..first)).collect();
            let upwards = rows[..block].iter().map(|row| label(row, first..names.len())).collect();
            let cells = (0..block).flat_map(|value| numbers[value..].iter().step_by(block).copied());
            return Some(Panel::Heat(Heat {
                title: question.to_owned(),
                across: (names[..first].join(", "), across),
                upwards: (names[first..].join(", "), upwards),
                measure: "probability".to_owned(),
                numbers: cells.collect(),
            }));
        }
    }
    None
}

/// Probabilities of many values over instants, as a heat map; none of few, which are lines.
fn over_instants(answer: &Answer, lines: &[Curve]) -> Option<Panel> {
    let first = lines.first()?;
    let name = first.name.split_once(" = ")?.0;
    let values =
        lines.iter().map(|line| line.name.strip_prefix(name)?.strip_prefix(" = ").map(str::to_owned));
    let values: Vec<String> = values.collect::<Option<_>>()?;
    let is_whole = lines.iter().all(|line| line.points.len() == first.points.len());
    if lines.len() <= super::canvas::COLOURS.len() || !is_whole || first.points.len() < 2 {
        return None;
    }
    let instants = first.points.iter().map(|(t, _)| t.to_string()).collect();
    Some(Panel::Heat(Heat {
        title: answer.question.clone(),
        across: ("instant t".to_owned(), instants),
        upwards: (name.to_owned(), values),
        measure: "probability".to_owned(),
        numbers: lines.iter().flat_map(|line| line.points.iter().map(|(_, p)| *p)).collect(),
    }))
}

/// Lines over instants: the probability of each value, or means with bands.
fn courses(answer: &Answer) -> Vec<Panel> {
    let mut lines: BTreeMap<String, Curve> = BTreeMap::new();
    let mut order: Vec<String> = Vec::new();
    let (mut measure, mut probabilities) = (String::new(), false);
    for row in &answer.answer {
        let Some(t) =
            row.values.iter().find(|(name, _)| name == "t").and_then(|(_, t)| t.parse::<f64>().ok())
        else {
            continue;
        };
        let words: Vec<String> = (row.values.iter())
            .filter(|(name, _)| name != "t")
            .map(|(name, value)| if value.is_empty() { name.clone() } else { format!("{name} = {value}") })
            .collect();
        let name = words.join(", ");
        let (y, band) = match row.figure {
            Figure::Normal { mean, deviation } => {
                (mean, Some((mean - BAND * deviation, mean + BAND * deviation)))
            }
            Figure::Real { mean, quantiles, .. } => (mean[0], Some((quantiles[0][0], quantiles[2][0]))),
            Figure::Mixture { mean, quantiles, .. } | Figure::Law { mean, quantiles, .. } => {
                (mean, Some((quantiles[0], quantiles[2])))
            }
            ref other => match measured(other) {
                Some((number, _, words)) => {
                    measure = words.to_owned();
                    probabilities |= words == "probability";
                    (number, None)
                }
                None => continue,
            },
        };
        if !lines.contains_key(&name) {
            order.push(name.clone());
        }
        let curve =
            lines.entry(name.clone()).or_insert_with(|| Curve { name, points: Vec::new(), band: Vec::new() });
        curve.points.push((t, y));
        curve.band.extend(band.map(|(low, high)| (t, low, high)));
    }
    // Of two values the second one says all.
    if probabilities && order.len() == 2 && order[0].ends_with("= false") {
        order.remove(0);
    }
    if probabilities {
        let all: Vec<Curve> = order.iter().filter_map(|name| lines.get(name).cloned()).collect();
        if let Some(map) = over_instants(answer, &all) {
            return vec![map];
        }
    }
    order.truncate(MOST_LINES);
    let lines: Vec<Curve> = order.iter().filter_map(|name| lines.remove(name)).collect();
    if lines.is_empty() {
        return Vec::new();
    }
    let banded = lines.iter().any(|line| !line.band.is_empty());
    let upwards = match (banded, measure.is_empty()) {
        (true, _) => "mean, with 5 % to 95 %".to_owned(),
        (_, false) => measure,
        _ => String::new(),
    };
    let range = probabilities.then_some((0.0, 1.0));
    vec![Panel::Course(Course {
        title: answer.question.clone(),
        across: "instant t".to_owned(),
        upwards,
        lines,
        range,
    })]
}

/// The 95 % quantile of the standard normal distribution.
const BAND: f64 = 1.644_853_626_951_472_2;

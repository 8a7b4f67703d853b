//! The panels of learning: the course of the likelihood, and the learned densities over the data.
//!
//! In: a report, the learned program, the data. Out: panels. Invariant: a histogram has the weight of the cases of its
//! context only, and its area is one.

use super::contexts::laws;
use super::reals::points;
use super::{Course, Curve, Density, Panel};
use bp_core::compiler::answer::{Figure, NamedLaw};
use bp_core::compiler::data::Records;
use bp_core::compiler::learn::Learned;
use bp_core::compiler::model::{Model, VariableUse};
use bp_core::compiler::source::Source;
use bp_core::compiler::syntax::{check, graft, parse};
use bp_core::program::Program;
use std::collections::HashMap;

/// Bars of a histogram.
const BINS: usize = 30;
/// Densities in one panel, panels of densities.
const MOST_CURVES: usize = 6;
const MOST_PANELS: usize = 8;

/// Bars of equal width: edges, and the weight in each over its width and the total.
pub(super) fn histogram(numbers: &[(f64, f64)], low: f64, high: f64, bins: usize) -> Vec<(f64, f64, f64)> {
    let width = (high - low) / bins as f64;
    let mut weights = vec![0.0; bins];
    let mut total = 0.0;
    for (number, weight) in numbers {
        total += weight;
        let bin = ((number - low) / width).floor();
        if bin >= 0.0 && *number <= high {
            weights[(bin as usize).min(bins - 1)] += weight;
        }
    }
    let bar = |(bin, weight): (usize, &f64)| {
        let left = low + width * bin as f64;
        (left, left + width, weight / (total.max(f64::MIN_POSITIVE) * width))
    };
    weights.iter().enumerate().map(bar).collect()
}

/// The author's program with what was learned as numbers.
fn program(source: &Source, learned: &Learned) -> Option<Model> {
    let forms = parse(&Source::new("learned", learned.text())).ok()?;
    let mut file = parse(source).ok()?;
    graft(&mut file, forms.programs.first()?);
    check(&file).ok()?.pop()
}

/// The panels of a report.
pub(super) fn learning(source: &Source, learned: &Learned, data: Option<&Records>) -> Vec<Panel> {
    let mut panels = Vec::new();
    if let Some(course) = &learned.report.expectation
        && course.trail.len() > 1
    {
        let points = course.trail.iter().enumerate().map(|(step, value)| (step as f64, *value));
        let line =
            Curve { name: "ln likelihood + ln prior".to_owned(), points: points.collect(), band: Vec::new() };
        panels.push(Panel::Course(Course {
            title: format!("Learning curve: {} cases, seed {}", learned.report.cases, course.seed),
            across: "step of expectation maximisation".to_owned(),
            upwards: "ln likelihood + ln prior (nats)".to_owned(),
            lines: vec![line],
            range: None,
        }));
    }
    let Some((data, model)) = data.zip(program(source, learned)) else { return panels };
    let model = &model;
    for (_, factor) in model.factors.iter() {
        let [left] = factor.left.as_slice() else { continue };
        let laws = laws(model, &factor.form);
        let name = model.variable_name(left.variable);
        let numbers = column(data, &name);
        if laws.is_empty() || numbers.len() < 2 || panels.len() > MOST_PANELS {
            continue;
        }
        let ends = numbers.iter().map(|(number, _)| *number);
        let (low, high) =
            (ends.clone().fold(f64::INFINITY, f64::min), ends.fold(f64::NEG_INFINITY, f64::max));
        if low >= high {
            continue;
        }
        let margin = 0.08 * (high - low);
        let (low, high) = (low - margin, high + margin);
        let shares = shares(model, &factor.right);
        let share =
            |label: &String| shares.as_ref().map_or(1.0, |all| all.get(label).copied().unwrap_or(1.0));
        let curve = |(label, law): &(String, NamedLaw)| {
            let points = points(low, high, &[(law.mean(), law.variance().sqrt())]).into_iter();
            let points = points.map(|x| (x, share(label) * law.density(x)));
            (label.clone(), points.filter(|(_, y)| y.is_finite()).collect())
        };
        let head = model.head(factor);
        let head = match (&shares, factor.right.as_slice()) {
            (Some(_), [right]) => format!("P({}) {head}", model.variable_name(right.variable)),
            _ => head,
        };
        panels.push(Panel::Density(Density {
            title: format!("{head} and the data"),
            across: name,
            curves: laws.iter().take(MOST_CURVES).map(curve).collect(),
            histogram: histogram(&numbers, low, high, BINS),
            interval: None,
            mean: None,
        }));
    }
    panels
}

/// The probability of each value of the only variable on which a form depends, by `K = value`: the histogram has the data of all
/// its values together.
fn shares(model: &Model, right: &[VariableUse]) -> Option<HashMap<String, f64>> {
    let [right] = right else { return None };
    let name = model.spelled(right.variable);
    let is_alone = right.element.is_none() && model.variables[right.variable].domain.is_finite();
    let answers = is_alone.then(|| Program::from(model.clone()).ask(&format!("P({name})")))?.ok()?;
    let rows = answers.answer().answer.iter().map(|row| match (&row.figure, row.values.as_slice()) {
        (Figure::Probability { p }, [(of, value)]) => Some((format!("{of} = {value}"), *p)),
        _ => None,
    });
    rows.collect()
}

/// The numbers of a column, each with the weight 1; other cells are left out.
fn column(data: &Records, name: &str) -> Vec<(f64, f64)> {
    let Some(column) = data.column(name) else { return Vec::new() };
    let cell = |row: usize| {
        let text = data.text(row, column).trim();
        let text = if data.has_decimal_commas() { text.replace(',', ".") } else { text.to_owned() };
        text.parse::<f64>().ok().filter(|number| number.is_finite())
    };
    (0..data.len()).filter_map(cell).map(|number| (number, 1.0)).collect()
}

//! Plots of answers and of learning, as PNG or SVG.
//!
//! In: answers, or a report. Out: a picture of panels, one for each answer. Invariant: a picture is written completely or
//! not at all; it needs no installed font (DejaVu Sans is included); every panel has a title and named axes.

mod canvas;
mod contexts;
mod heat;
mod intervals;
mod labels;
mod learning;
mod panels;
mod reals;
mod stairs;

use crate::failure::Failure;
use crate::wrap::columns;
use crate::{output, program};
use bp_core::compiler::answer::Answer;
use bp_core::compiler::data::Records;
use bp_core::compiler::error::Error;
use bp_core::compiler::files;
use bp_core::compiler::learn::Learned;
use bp_core::compiler::model::Model;
use bp_core::compiler::source::Source;
use std::io::Write;
use std::path::Path;

/// A panel.
pub(crate) enum Panel {
    /// A bar for each value.
    Bars(Bars),
    /// A density of a real.
    Density(Density),
    /// Numbers over instants or steps.
    Course(Course),
    /// Values over instants.
    Stairs(Stairs),
    /// A number for each pair of values.
    Heat(Heat),
    /// Means and intervals of the elements of a family.
    Intervals(Intervals),
}

/// A bar for each value, with its standard error, if it is estimated.
pub(crate) struct Bars {
    pub(crate) title: String,
    pub(crate) across: String,
    pub(crate) upwards: String,
    pub(crate) bars: Vec<(String, f64, f64)>,
}

/// A density, with an interval and its mean; bars of draws or data behind it.
pub(crate) struct Density {
    pub(crate) title: String,
    pub(crate) across: String,
    pub(crate) curves: Vec<(String, Vec<(f64, f64)>)>,
    /// Edges and heights.
    pub(crate) histogram: Vec<(f64, f64, f64)>,
    pub(crate) interval: Option<(f64, f64)>,
    pub(crate) mean: Option<f64>,
}

/// A line: its name, its points, and a band around them.
#[derive(Clone)]
pub(crate) struct Curve {
    pub(crate) name: String,
    pub(crate) points: Vec<(f64, f64)>,
    pub(crate) band: Vec<(f64, f64, f64)>,
}

/// Lines over instants or steps.
pub(crate) struct Course {
    pub(crate) title: String,
    pub(crate) across: String,
    pub(crate) upwards: String,
    pub(crate) lines: Vec<Curve>,
    /// The range of the vertical axis, if it is known.
    pub(crate) range: Option<(f64, f64)>,
}

/// Values of a finite variable over instants, each line a sequence of their places.
pub(crate) struct Stairs {
    pub(crate) title: String,
    /// The variable and the names of its values.
    pub(crate) upwards: (String, Vec<String>),
    pub(crate) lines: Vec<Curve>,
}

/// A number for each pair of values, row by row from the bottom.
pub(crate) struct Heat {
    pub(crate) title: String,
    pub(crate) across: (String, Vec<String>),
    pub(crate) upwards: (String, Vec<String>),
    pub(crate) measure: String,
    pub(crate) numbers: Vec<f64>,
}

/// The mean of each element of a family with its quantiles at 5 % and 95 %, by its label.
pub(crate) struct Intervals {
    pub(crate) title: String,
    pub(crate) across: String,
    pub(crate) marks: Vec<(String, f64, (f64, f64))>,
}

impl Panel {
    /// The names and values in its text.
    fn words(&self) -> Vec<&String> {
        match self {
            Panel::Bars(bars) => [&bars.title, &bars.across]
                .into_iter()
                .chain(bars.bars.iter().map(|(label, _, _)| label))
                .collect(),
            Panel::Density(density) => {
                let names = density.curves.iter().map(|(name, _)| name);
                [&density.title, &density.across].into_iter().chain(names).collect()
            }
            Panel::Course(course) => {
                [&course.title].into_iter().chain(course.lines.iter().map(|line| &line.name)).collect()
            }
            Panel::Stairs(stairs) => {
                [&stairs.title, &stairs.upwards.0].into_iter().chain(&stairs.upwards.1).collect()
            }
            Panel::Intervals(panel) => {
                let labels = panel.marks.iter().map(|(label, _, _)| label);
                [&panel.title, &panel.across].into_iter().chain(labels).collect()
            }
            Panel::Heat(heat) => {
                let values = heat.across.1.iter().chain(&heat.upwards.1);
                [&heat.title, &heat.across.0, &heat.upwards.0].into_iter().chain(values).collect()
            }
        }
    }
}

/// Whether a text has letters of Chinese, Japanese or Korean, which are wide.
fn has_wide(text: &str) -> bool {
    columns(text) > text.chars().count()
}

/// Writes a picture of answers.
pub(crate) fn answers(
    model: &Model,
    answers: &[Answer],
    path: &Path,
    out: &mut impl Write,
) -> Result<(), Failure> {
    let drawn: Vec<Panel> = answers.iter().flat_map(|answer| panels::of(model, answer)).collect();
    write(&drawn, path, out)
}

/// Writes a picture of what was learned; none of tables that took one step.
pub(crate) fn learned(
    source: &Source,
    learned: &Learned,
    data: Option<&Records>,
    path: &Path,
    out: &mut impl Write,
) -> Result<(), Failure> {
    let panels = learning::learning(source, learned, data);
    if panels.is_empty() {
        // What was learned is printed all the same.
        eprintln!("note: no picture: tables alone were learned, in one step");
        return Ok(());
    }
    write(&panels, path, out)
}

/// Whether a picture is written as SVG, and not as PNG: by the extension of its path. Any other path is an error.
fn is_svg(path: &Path) -> Result<bool, Failure> {
    let extension = path.extension().map(|extension| extension.to_string_lossy().to_lowercase());
    match extension.as_deref() {
        Some("svg") => Ok(true),
        Some("png") => Ok(false),
        _ => {
            let path = path.display();
            Err(Failure::Words(format!(
                "a plot is written as PNG or SVG: name it `….png` or `….svg`, not `{path}`"
            )))
        }
    }
}

/// Refuses a path to which no picture can be written, before the work that it would show.
pub(crate) fn check_path(path: &Path) -> Result<(), Failure> {
    is_svg(path)?;
    files::check_name(path).map_err(|error| Error::file(path, error).into())
}

/// Writes a picture of panels.
fn write(panels: &[Panel], path: &Path, out: &mut impl Write) -> Result<(), Failure> {
    if panels.is_empty() {
        return Err(Failure::Words(
            "there is nothing to plot: no distribution, no course over time, no learned density".to_owned(),
        ));
    }
    if panels.len() > MOST_PANELS {
        let count = panels.len();
        return Err(Failure::Words(format!(
            "a picture of {count} panels: ask fewer questions ({MOST_PANELS} at most)"
        )));
    }
    let drawn = if is_svg(path)? { canvas::svg(panels) } else { canvas::png(panels) };
    // In SVG the reader's fonts are used.
    if let (false, Some(word)) =
        (is_svg(path)?, panels.iter().flat_map(Panel::words).find(|word| has_wide(word)))
    {
        program::warn(&format!(
            "warning: the font of PNG plots has no letters for `{word}`, and shows boxes: write SVG"
        ));
    }
    let bytes = drawn.map_err(|error| Failure::Words(format!("the plot cannot be drawn: {error}")))?;
    output::write(Some(path), &bytes, out)
}

const MOST_PANELS: usize = 24;

/// Lines of a panel.
const MOST_LINES: usize = 10;

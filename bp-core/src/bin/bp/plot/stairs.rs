//! Sequences of values over instants, as stairs.
//!
//! In: the rows of a most likely or drawn sequence. Out: for each finite variable a panel with its values on the vertical axis, and
//! a stair for each sequence; for each real lines. Invariant: a value holds from half an instant before to half an instant after.

use super::canvas::{Area, COLOURS, Drawn, GRID, Pen, key_line};
use super::labels::{abridged, at_whole, of_places, shortened};
use super::{Course, Curve, MOST_LINES, Panel, Stairs};
use bp_core::compiler::answer::{Answer, Figure, Row};
use bp_core::compiler::model::{Model, When};
use plotters::prelude::*;

/// Labels of values beside the vertical axis.
const MOST_LABELS: usize = 18;

/// Whether each row of an answer over time has the values of an instant, and not a probability that is drawn.
pub(super) fn are_values(answer: &Answer) -> bool {
    let is_named = |row: &Row| {
        matches!(row.figure, Figure::Mode { .. } | Figure::Draw { .. } | Figure::Probability { .. })
    };
    (answer.when == When::Sequence || answer.question.starts_with("argmax"))
        && answer.answer.iter().all(|row| is_named(row) && row.values.len() > 1)
}

/// The panels of sequences, one for each variable.
pub(super) fn of(model: &Model, answer: &Answer) -> Vec<Panel> {
    let Some(part) = answer.parts.first() else { return Vec::new() };
    let panel = |slot: &bp_core::compiler::answer::Slot| {
        let name = slot.name(model);
        let values: Vec<String> =
            (0..slot.count).map(|ordinal| model.value_name(slot.variable, ordinal)).collect();
        let height = |value: &String| match slot.count {
            0 => value.replace('−', "-").parse::<f64>().ok(),
            _ => values.iter().position(|one| one == value).map(|ordinal| ordinal as f64),
        };
        let mut lines: Vec<Curve> = Vec::new();
        for row in &answer.answer {
            let of =
                |wanted: &str| row.values.iter().find(|(name, _)| name == wanted).map(|(_, value)| value);
            let point = of("t").and_then(|t| t.parse::<f64>().ok()).zip(of(&name).and_then(height));
            let label = match (&row.figure, of("sequence")) {
                (Figure::Draw { draw }, _) => format!("draw {draw}"),
                (_, Some(number)) => format!("sequence {number}"),
                _ => name.clone(),
            };
            let Some(point) = point else { continue };
            match lines.iter_mut().find(|line| line.name == label) {
                Some(line) => line.points.push(point),
                None => lines.push(Curve { name: label, points: vec![point], band: Vec::new() }),
            }
        }
        lines.truncate(MOST_LINES);
        let (title, across) = (answer.question.clone(), "instant t".to_owned());
        match slot.count {
            _ if lines.is_empty() => None,
            0 => Some(Panel::Course(Course { title, across, upwards: name, lines, range: None })),
            _ => Some(Panel::Stairs(Stairs { title, upwards: (name, values), lines })),
        }
    };
    part.of.iter().filter_map(panel).collect()
}

impl Pen {
    pub(super) fn stairs<B: DrawingBackend>(&self, area: &Area<'_, B>, panel: &Stairs) -> Drawn<B> {
        let unit = self.fine;
        let instants = || panel.lines.iter().flat_map(|line| line.points.iter().map(|(t, _)| *t));
        let (first, last) = (instants().fold(f64::INFINITY, f64::min), instants().fold(0.0, f64::max));
        let (name, values) = &panel.upwards;
        let each = values.len() / MOST_LABELS + 1;
        let short: Vec<String> = values.iter().map(|value| abridged(value, 12)).collect();
        let height = of_places(&short, each);
        let mut chart = self
            .builder(area, &panel.title)
            .build_cartesian_2d(first - 0.5..last + 0.5, -0.5..values.len() as f64 - 0.5)?;
        chart
            .configure_mesh()
            .light_line_style(WHITE)
            .bold_line_style(GRID)
            .y_labels((values.len() * 2).max(2))
            .x_label_formatter(&at_whole)
            .y_label_formatter(&height)
            .x_desc("instant t")
            .y_desc(name.as_str())
            .label_style(self.text(13))
            .axis_desc_style(self.text(14))
            .draw()?;
        let count = panel.lines.len() as f64;
        for (number, line) in panel.lines.iter().enumerate() {
            let colour = COLOURS[number % COLOURS.len()];
            // Sequences with the same value stand one above the other.
            let above = 0.07 * (number as f64 - (count - 1.0) / 2.0);
            let corners = line
                .points
                .iter()
                .flat_map(|(t, value)| [(t - 0.5, value + above), (t + 0.5, value + above)]);
            let drawn = chart.draw_series(LineSeries::new(corners, colour.stroke_width(2 * unit)))?;
            if panel.lines.len() > 1 {
                drawn.label(shortened(&line.name, 40)).legend(move |at| key_line(at, unit, colour));
            }
        }
        if panel.lines.len() == 1 {
            return Ok(());
        }
        self.legend(&mut chart, SeriesLabelPosition::UpperRight)
    }
}

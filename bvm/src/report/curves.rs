//! The entropy of the map over time, one curve per gaze strategy.
//!
//! In: named series of map entropies, one value per step (any unit: each is divided by its first value), with
//! or without a band around them. Out: a line plot. Invariant: every curve starts at 1.

use super::colour::{CURVES, FAINT};
use super::frame::{Frame, ticks};
use super::picture::{Canvas, Drawn};
use super::text::{TEXT, Text};
use super::{Picture, ReportError, expect_length};
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, VPos};

/// One curve.
#[derive(Clone, Debug, PartialEq)]
pub struct Series {
    /// Its name in the legend.
    pub name: String,
    /// Entropy of the map after each step, from step 0.
    pub values: Vec<f64>,
    /// Lower and upper bounds, as long as `values` and in the same unit.
    pub band: Option<(Vec<f64>, Vec<f64>)>,
}

/// The curves together, normalised by their first values: 1000 x 600 pixels.
///
/// # Errors
/// [`ReportError`] names a series whose band has another length, that is empty, not finite, or starts at
/// zero.
pub fn entropy_curves(title: &str, series: &[Series]) -> Result<Picture, ReportError> {
    let curves = series.iter().map(normalised).collect::<Result<Vec<_>, _>>()?;
    let everything = || {
        curves.iter().flat_map(|curve| {
            let bounds = curve.band.iter().flat_map(|(low, high)| low.iter().chain(high));
            curve.values.iter().chain(bounds).copied()
        })
    };
    let lowest = everything().fold(1.0, f64::min);
    let highest = everything().fold(1.0, f64::max);
    let room = 0.06 * (highest - lowest).max(0.05);
    let steps = curves.iter().map(|curve| curve.values.len()).max().unwrap_or(2).max(2) - 1;
    let frame = Frame {
        pixels: [190, 110, 1940, 1050],
        across: [0.0, steps as f64],
        upwards: [(lowest - room).max(0.0), highest + room],
    };
    Ok(Picture::draw(1000, 600, |canvas| {
        for value in ticks(frame.upwards) {
            let (left, right) = (frame.pixel(0.0, value), frame.pixel(steps as f64, value));
            canvas.draw(&PathElement::new([left, right], FAINT.stroke_width(2)))?;
        }
        for (curve, colour) in curves.iter().zip(CURVES.iter().cycle()) {
            draw_curve(canvas, &frame, curve, *colour)?;
        }
        let whole: Vec<f64> = ticks(frame.across).into_iter().filter(|tick| tick.fract() == 0.0).collect();
        let names = ["step", "map entropy H(t) / H(0)"];
        frame.axes(canvas, names, &whole, &ticks(frame.upwards), "")?;
        frame.title(canvas, title)?;
        legend(canvas, &frame, &curves.iter().map(|curve| curve.name.as_str()).collect::<Vec<_>>(), false)
    }))
}

/// A series divided by its first value.
fn normalised(series: &Series) -> Result<Series, ReportError> {
    let refuse = |why| ReportError::Values { what: series.name.clone(), why };
    let first = *series.values.first().ok_or_else(|| refuse("there are no values"))?;
    if let Some((low, high)) = &series.band {
        expect_length(&format!("lower bound of {}", series.name), low.len(), series.values.len())?;
        expect_length(&format!("upper bound of {}", series.name), high.len(), series.values.len())?;
    }
    let bounds = series.band.iter().flat_map(|(low, high)| low.iter().chain(high));
    if !series.values.iter().chain(bounds).all(|value| value.is_finite()) {
        return Err(refuse("a value is not finite"));
    }
    if first <= 0.0 {
        return Err(refuse("its first value is not above zero"));
    }
    let divided = |values: &[f64]| values.iter().map(|value| value / first).collect::<Vec<_>>();
    Ok(Series {
        name: series.name.clone(),
        values: divided(&series.values),
        band: series.band.as_ref().map(|(low, high)| (divided(low), divided(high))),
    })
}

/// One curve over its band.
fn draw_curve(canvas: &Canvas, frame: &Frame, curve: &Series, colour: RGBColor) -> Drawn {
    let points = |values: &[f64]| -> Vec<(i32, i32)> {
        values.iter().enumerate().map(|(step, &value)| frame.pixel(step as f64, value)).collect()
    };
    if let Some((low, high)) = &curve.band {
        let outline: Vec<_> = points(low).into_iter().chain(points(high).into_iter().rev()).collect();
        canvas.draw(&Polygon::new(outline, colour.mix(0.16).filled()))?;
    }
    canvas.draw(&PathElement::new(points(&curve.values), colour.stroke_width(5)))
}

/// The legend, on white: in the upper right corner for falling curves, or `below` for rising ones.
pub(super) fn legend(canvas: &Canvas, frame: &Frame, names: &[&str], below: bool) -> Drawn {
    if names.is_empty() {
        return Ok(());
    }
    let [_, top, right, bottom] = frame.pixels;
    let top = if below { bottom - 72 - 44 * names.len() as i32 } else { top };
    let text = Text::new(TEXT, HPos::Left, VPos::Center);
    let widest = names.iter().map(|name| text.width(canvas, name)).max().unwrap_or(0);
    let left = right - widest - 160;
    let corners = [(left, top + 24), (right - 24, top + 48 + 44 * names.len() as i32)];
    canvas.draw(&Rectangle::new(corners, WHITE.mix(0.9).filled()))?;
    canvas.draw(&Rectangle::new(corners, FAINT.stroke_width(2)))?;
    for (row, (name, colour)) in names.iter().zip(CURVES.iter().cycle()).enumerate() {
        let y = top + 58 + 44 * row as i32;
        canvas.draw(&PathElement::new([(left + 24, y), (left + 84, y)], colour.stroke_width(6)))?;
        text.write(canvas, name, (left + 104, y))?;
    }
    Ok(())
}

//! A table of numbers as colours.
//!
//! In: values in rows from the bottom to the top, the limits of both axes. Out: the table in a frame, with a colour bar.
//! Invariant: NaN is drawn as "no data".

use super::colour::ColourMap;
use super::frame::{Frame, ticks};
use super::{Picture, ReportError, expect_length};

/// What is drawn.
#[derive(Clone, Debug)]
pub struct Heat<'a> {
    /// The title.
    pub title: &'a str,
    /// The names of the axes, with their units.
    pub names: [&'a str; 2],
    /// The left and the right edge.
    pub across: [f64; 2],
    /// The lower and the upper edge.
    pub upwards: [f64; 2],
    /// The number of columns.
    pub columns: usize,
    /// Row by row, the lowest first.
    pub values: &'a [f64],
    /// The name of the quantity, with its unit.
    pub quantity: &'a str,
    /// Ticks of the axes; round numbers if there are none.
    pub ticks: [&'a [f64]; 2],
}

/// The picture: 1120 x 580 pixels.
///
/// # Errors
/// Values that make no rows.
pub fn heat(what: &Heat) -> Result<Picture, ReportError> {
    let rows = what.values.len() / what.columns.max(1);
    expect_length(what.quantity, what.values.len(), (rows * what.columns).max(1))?;
    let finite = || what.values.iter().copied().filter(|value| value.is_finite());
    let (low, high) = (finite().fold(0.0, f64::min), finite().fold(0.0, f64::max));
    let limits = [low, if high > low { high } else { low + 1.0 }];
    let frame = Frame { pixels: [200, 100, 1960, 980], across: what.across, upwards: what.upwards };
    let cell = |share: f64, count: usize| ((share * count as f64) as usize).min(count - 1);
    let place = |values: Vec<f64>, [first, last]: [f64; 2], count: usize| -> Vec<usize> {
        values.iter().map(|value| cell((value - first) / (last - first), count)).collect()
    };
    let columns = place(frame.columns(), what.across, what.columns);
    let lines = place(frame.rows(), what.upwards, rows);
    let [across, upwards] = [0, 1].map(|axis| match what.ticks[axis] {
        [] => ticks([what.across, what.upwards][axis]),
        own => own.to_vec(),
    });
    Ok(Picture::draw(1120, 580, |canvas| {
        frame.paint(canvas, |x, y| {
            ColourMap::Sequential.on_scale(what.values[lines[y] * what.columns + columns[x]], limits)
        })?;
        frame.axes(canvas, what.names, &across, &upwards, "")?;
        frame.title(canvas, what.title)?;
        frame.colour_bar(canvas, ColourMap::Sequential, limits, what.quantity)
    }))
}

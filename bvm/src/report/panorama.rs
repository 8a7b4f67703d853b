//! The whole sphere around the head, unrolled.
//!
//! In: one value for each direction, `[elevation_cells][azimuth_cells]`, and the way that the gaze went. Out: a picture with
//! azimuth from left to right, elevation upwards, one degree as long as the other, and a colour bar. Invariant: a
//! direction to the right of the head is right of the middle; NaN is drawn as "no data".

use super::colour::{ColourMap, GAZE};
use super::frame::{Frame, TEXT, style};
use super::picture::{Canvas, Drawn};
use super::{Picture, ReportError, expect_length};
use crate::grid::Grid;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, VPos};

/// What to draw on the sphere.
#[derive(Clone, Debug)]
pub struct Panorama<'a> {
    /// Above the picture.
    pub title: &'a str,
    /// What the values are, with their unit.
    pub quantity: &'a str,
    /// One value for each direction, `[elevation_cells][azimuth_cells]`.
    pub values: &'a [f64],
    /// How values become colours.
    pub colours: ColourMap,
    /// The values at the two ends of the colour bar; by default the smallest and the largest.
    pub limits: Option<[f64; 2]>,
    /// Where the gaze was, `(azimuth, elevation)` in radians, the last one being where it is; may be empty.
    pub gaze_path: &'a [(f64, f64)],
}

/// The panorama, 1240 x 690 pixels: 3 pixels for a degree.
///
/// # Errors
/// [`ReportError`] names the quantity when there is not one value per direction, or nothing to scale the colours by.
pub fn panorama(grid: &Grid, what: &Panorama) -> Result<Picture, ReportError> {
    expect_length(what.quantity, what.values.len(), grid.directions())?;
    let limits = what.limits.unwrap_or_else(|| {
        let finite = || what.values.iter().copied().filter(|value| value.is_finite());
        let (low, high) =
            (finite().fold(f64::INFINITY, f64::min), finite().fold(f64::NEG_INFINITY, f64::max));
        if low > high { [0.0, 1.0] } else { [low, high.max(low + 1e-9)] }
    });
    if !(limits.iter().all(|limit| limit.is_finite()) && limits[0] != limits[1]) {
        let why = "its two limits are equal or not finite";
        return Err(ReportError::Values { what: what.quantity.to_string(), why });
    }
    let frame =
        Frame { pixels: [170, 100, 170 + 2160, 100 + 1080], across: [-180.0, 180.0], upwards: [-90.0, 90.0] };
    Ok(Picture::draw(1290, 660, |canvas| {
        frame.paint(canvas, |azimuth, elevation| {
            let direction = grid.direction_of(azimuth.to_radians(), elevation.to_radians());
            let value = direction.map_or(f64::NAN, |direction| what.values[grid.direction_index(direction)]);
            what.colours.on_scale(value, limits)
        })?;
        draw_path(canvas, &frame, what.gaze_path)?;
        let (across, upwards) =
            ([-180.0, -135.0, -90.0, -45.0, 0.0, 45.0, 90.0, 135.0, 180.0], [-90.0, -45.0, 0.0, 45.0, 90.0]);
        frame.axes(canvas, ["azimuth (positive to the right)", "elevation"], &across, &upwards, "°")?;
        frame.title(canvas, what.title)?;
        frame.colour_bar(canvas, what.colours, limits, what.quantity)
    }))
}

/// The way of the gaze: thin lines between dots that grow redder with time, a few numbered, and a cross at the last.
fn draw_path(canvas: &Canvas, frame: &Frame, path: &[(f64, f64)]) -> Drawn {
    let degrees: Vec<_> = path
        .iter()
        .map(|(azimuth, elevation)| (crate::grid::wrap_angle(*azimuth).to_degrees(), elevation.to_degrees()))
        .collect();
    for pair in degrees.windows(2) {
        for (from, to) in shortest(pair[0], pair[1]) {
            let ends = [frame.pixel(from.0, from.1), frame.pixel(to.0, to.1)];
            canvas.draw(&PathElement::new(ends, BLACK.mix(0.55).stroke_width(6)))?;
            canvas.draw(&PathElement::new(ends, WHITE.mix(0.9).stroke_width(2)))?;
        }
    }
    let last = degrees.len().saturating_sub(1);
    let every = (last / 10).max(1);
    let number = style(TEXT - 4, HPos::Left, VPos::Bottom);
    for (step, &(azimuth, elevation)) in degrees.iter().enumerate() {
        let (x, y) = frame.pixel(azimuth, elevation);
        let share = step as f64 / last.max(1) as f64;
        let mixed = |from: u8, to: u8| (f64::from(from) * (1.0 - share) + f64::from(to) * share) as u8;
        let colour = RGBColor(mixed(255, GAZE.0), mixed(240, GAZE.1), mixed(200, GAZE.2));
        canvas.draw(&Circle::new((x, y), 11, BLACK.mix(0.8).filled()))?;
        canvas.draw(&Circle::new((x, y), 8, colour.filled()))?;
        if step % every == 0 && step != last {
            let text = step.to_string();
            for (dx, dy) in [(-2, 0), (2, 0), (0, -2), (0, 2)] {
                canvas.draw_text(&text, &number.clone().color(&BLACK), (x + 12 + dx, y - 6 + dy))?;
            }
            canvas.draw_text(&text, &number.clone().color(&WHITE), (x + 12, y - 6))?;
        }
    }
    if let Some(&(azimuth, elevation)) = degrees.last() {
        let (x, y) = frame.pixel(azimuth, elevation);
        for (colour, width) in [(WHITE, 12), (GAZE, 6)] {
            canvas.draw(&Circle::new((x, y), 26, colour.stroke_width(width)))?;
            for (dx, dy) in [(0, 1), (0, -1), (1, 0), (-1, 0)] {
                let arm = [(x + 16 * dx, y + 16 * dy), (x + 44 * dx, y + 44 * dy)];
                canvas.draw(&PathElement::new(arm, colour.stroke_width(width)))?;
            }
        }
    }
    Ok(())
}

/// A point of the panorama in degrees: azimuth, elevation.
type Degrees = (f64, f64);

/// The straight way between two points of the panorama, in two pieces where going round the back is shorter.
fn shortest(from: Degrees, to: Degrees) -> Vec<(Degrees, Degrees)> {
    let gap = to.0 - from.0;
    if gap.abs() <= 180.0 {
        return vec![(from, to)];
    }
    let side = gap.signum();
    let way = 360.0 - gap.abs();
    let share = if way > 0.0 { (180.0 - from.0.abs()) / way } else { 0.0 };
    let height = from.1 + share * (to.1 - from.1);
    vec![(from, (-180.0 * side, height)), ((180.0 * side, height), to)]
}

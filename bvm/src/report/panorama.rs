//! The whole sphere around the head, unrolled.
//!
//! In: one value for each direction, `[elevation_cells][azimuth_cells]`, and the path of the gaze. Out: a panorama seen
//! from the head: azimuth decreases from left to right, elevation increases upwards, with equal scales, and a colour
//! bar. Invariant: positive azimuths (to the left of the head) are left of the middle; NaN is drawn as "no data".

use super::colour::{ColourMap, GAZE, NO_DATA};
use super::frame::{Frame, swatches, ticks};
use super::picture::{Canvas, Drawn, OVERSAMPLING};
use super::text::{TEXT, Text};
use super::{Picture, ReportError, expect_length};
use crate::grid::{Direction, Grid};
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, VPos};

/// A part of the sphere, in degrees: `[left, right]` and `[bottom, top]`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Window {
    /// From the left, the larger azimuth, to the right; between 180 and -180.
    pub azimuth_degrees: [f64; 2],
    /// Between -90 and 90.
    pub elevation_degrees: [f64; 2],
}

impl Default for Window {
    /// The whole sphere.
    fn default() -> Window {
        Window { azimuth_degrees: [180.0, -180.0], elevation_degrees: [-90.0, 90.0] }
    }
}

impl Window {
    /// Whether the window has an area and lies on the sphere.
    fn is_usable(&self) -> bool {
        let inside = |[low, high]: [f64; 2], end: f64| low >= -end && high <= end && high - low >= 1.0;
        let [left, right] = self.azimuth_degrees;
        inside([right, left], 180.0) && inside(self.elevation_degrees, 90.0)
    }

    /// The frame on the canvas: as large as fits in 2160 x 1080, one degree as long across as upwards.
    fn frame(&self) -> Frame {
        let (across, upwards) = (self.azimuth_degrees, self.elevation_degrees);
        let scale = (2160.0 / (across[0] - across[1])).min(1080.0 / (upwards[1] - upwards[0]));
        let length = |[first, last]: [f64; 2]| ((last - first).abs() * scale).round() as i32;
        Frame { pixels: [180, 100, 180 + length(across), 100 + length(upwards)], across, upwards }
    }
}

/// The content of a panorama.
#[derive(Clone, Debug)]
pub struct Panorama<'a> {
    /// The title.
    pub title: &'a str,
    /// The name of the quantity, with its unit.
    pub quantity: &'a str,
    /// One value for each direction, `[elevation_cells][azimuth_cells]`.
    pub values: &'a [f64],
    /// The colour map.
    pub colours: ColourMap,
    /// The values at the two ends of the colour bar (in either order); by default the smallest and the
    /// largest.
    pub limits: Option<[f64; 2]>,
    /// Which part of the sphere to show.
    pub window: Window,
    /// The gazes, `(azimuth, elevation)` in radians, the last one being the current one; may be empty.
    pub gaze_path: &'a [(f64, f64)],
}

/// The panorama; the whole sphere makes 1300 x 660 pixels, 3 for each degree, and 28 more rows with a gaze.
///
/// # Errors
/// [`ReportError`] names the quantity when there is not one value per direction, nothing to scale the
/// colours by, or nothing in the window.
pub fn panorama(grid: &Grid, what: &Panorama) -> Result<Picture, ReportError> {
    expect_length(what.quantity, what.values.len(), grid.directions())?;
    let limits = what.limits.unwrap_or_else(|| {
        let finite = || what.values.iter().copied().filter(|value| value.is_finite());
        let (low, high) =
            (finite().fold(f64::INFINITY, f64::min), finite().fold(f64::NEG_INFINITY, f64::max));
        if low > high { [0.0, 1.0] } else { [low, high.max(low + 1e-9 * (1.0 + low.abs()))] }
    });
    let refuse = |why| Err(ReportError::Values { what: what.quantity.to_string(), why });
    if !limits.iter().all(|limit| limit.is_finite()) || limits[0] == limits[1] {
        return refuse("its two limits are equal or not finite");
    }
    if !what.window.is_usable() {
        return refuse("its window is empty or not on the sphere");
    }
    let frame = what.window.frame();
    let [_, _, right, bottom] = frame.pixels;
    let below = if what.gaze_path.is_empty() { 140 } else { 196 };
    let size = ((right + 260) as u32 / OVERSAMPLING, (bottom + below) as u32 / OVERSAMPLING);
    // A column of pixels is of one azimuth, a row of one elevation.
    let azimuth = |degrees: f64| Some(grid.direction_of(degrees.to_radians(), 0.0)?.azimuth);
    let elevation = |degrees: f64| Some(grid.direction_of(0.0, degrees.to_radians())?.elevation);
    let columns: Vec<Option<usize>> = frame.columns().into_iter().map(azimuth).collect();
    let rows: Vec<Option<usize>> = frame.rows().into_iter().map(elevation).collect();
    let colours: Vec<RGBColor> =
        what.values.iter().map(|value| what.colours.on_scale(*value, limits)).collect();
    Ok(Picture::draw(size.0, size.1, |canvas| {
        frame.paint(canvas, |x, y| match (columns[x], rows[y]) {
            (Some(azimuth), Some(elevation)) => {
                colours[grid.direction_index(Direction { elevation, azimuth })]
            }
            _ => NO_DATA,
        })?;
        draw_path(canvas, &frame, what.gaze_path)?;
        path_legend(canvas, (frame.pixels[0], bottom + 150), what.gaze_path.len())?;
        let names = ["azimuth (positive to the left)", "elevation"];
        frame.axes(canvas, names, &degree_ticks(frame.across), &degree_ticks(frame.upwards), "°")?;
        frame.title(canvas, what.title)?;
        if what.values.iter().any(|value| value.is_nan()) {
            swatches(canvas, (right + 44, bottom + 84), &[(NO_DATA, "nothing")])?;
        }
        frame.colour_bar(canvas, what.colours, limits, what.quantity)
    }))
}

/// Multiples of 45 degrees on a side of half a turn or more, else round numbers.
fn degree_ticks(limits: [f64; 2]) -> Vec<f64> {
    let (low, high) = (limits[0].min(limits[1]), limits[0].max(limits[1]));
    if high - low < 180.0 {
        return ticks(limits);
    }
    let eighths = (-4..=4).map(|i| f64::from(i) * 45.0);
    eighths.filter(|tick| (low..=high).contains(tick)).collect()
}

/// The path of the gaze: thin lines that fade with age between dots that become redder with time, a few numbered, and a
/// cross at the last; parts outside the frame are omitted.
fn draw_path(canvas: &Canvas, frame: &Frame, path: &[(f64, f64)]) -> Drawn {
    let inside = |(x, y): (f64, f64)| {
        (frame.across[1]..=frame.across[0]).contains(&x) && (frame.upwards[0]..=frame.upwards[1]).contains(&y)
    };
    let degrees: Vec<_> = path
        .iter()
        .map(|(azimuth, elevation)| (crate::frame::wrap_angle(*azimuth).to_degrees(), elevation.to_degrees()))
        .collect();
    for (step, pair) in degrees.windows(2).enumerate() {
        let age = (degrees.len() - 2 - step) as f64;
        let strength = (1.0 - age / 24.0).max(0.18);
        let pieces = shortest(pair[0], pair[1]);
        for (from, to) in pieces.into_iter().filter(|&(from, to)| inside(from) && inside(to)) {
            let ends = [frame.pixel(from.0, from.1), frame.pixel(to.0, to.1)];
            canvas.draw(&PathElement::new(ends, BLACK.mix(0.55 * strength).stroke_width(6)))?;
            canvas.draw(&PathElement::new(ends, WHITE.mix(0.95 * strength).stroke_width(3)))?;
        }
    }
    let last = degrees.len().saturating_sub(1);
    let every = (last / 10).max(1);
    let number = Text::new(TEXT - 4, HPos::Left, VPos::Bottom).bold();
    for (step, &(azimuth, elevation)) in degrees.iter().enumerate().filter(|(_, place)| inside(**place)) {
        let (x, y) = frame.pixel(azimuth, elevation);
        dot(canvas, (x, y), step as f64 / last.max(1) as f64)?;
        if step % every == 0 && step != last {
            let text = step.to_string();
            let room = number.width(canvas, &text) + 20;
            let (left, below) = (x + room > frame.pixels[2], y - 40 < frame.pixels[1]);
            let at = (if left { x - room } else { x + 14 }, if below { y + 34 } else { y - 10 });
            for (dx, dy) in [(-2, -2), (2, -2), (-2, 2), (2, 2), (0, 3), (0, -3), (3, 0), (-3, 0)] {
                number.coloured(BLACK).write(canvas, &text, (at.0 + dx, at.1 + dy))?;
            }
            number.coloured(WHITE).write(canvas, &text, at)?;
        }
    }
    if let Some(&(azimuth, elevation)) = degrees.last().filter(|place| inside(**place)) {
        cross(canvas, frame.pixel(azimuth, elevation), 1)?;
    }
    Ok(())
}

/// The colour of a past gaze: pale for the first and red for the last.
fn dot(canvas: &Canvas, place: (i32, i32), share: f64) -> Drawn {
    let mixed = |from: u8, to: u8| (f64::from(from) * (1.0 - share) + f64::from(to) * share) as u8;
    let colour = RGBColor(mixed(255, GAZE.0), mixed(240, GAZE.1), mixed(200, GAZE.2));
    canvas.draw(&Circle::new(place, 11, BLACK.mix(0.8).filled()))?;
    canvas.draw(&Circle::new(place, 8, colour.filled()))
}

/// The gaze, with lengths divided by a number.
fn cross(canvas: &Canvas, (x, y): (i32, i32), smaller: i32) -> Drawn {
    for (colour, width) in [(WHITE, 12), (GAZE, 6)] {
        let line = colour.stroke_width(width / smaller as u32);
        canvas.draw(&Circle::new((x, y), 26 / smaller, line))?;
        for (dx, dy) in [(0, 1), (0, -1), (1, 0), (-1, 0)] {
            let [from, to] = [16, 44].map(|length| (x + length * dx / smaller, y + length * dy / smaller));
            canvas.draw(&PathElement::new([from, to], line))?;
        }
    }
    Ok(())
}

/// The legend of the cross and the dots.
fn path_legend(canvas: &Canvas, (x, y): (i32, i32), gazes: usize) -> Drawn {
    let text = Text::new(TEXT, HPos::Left, VPos::Center);
    if gazes == 0 {
        return Ok(());
    }
    cross(canvas, (x + 22, y), 2)?;
    if gazes == 1 {
        return text.write(canvas, "gaze", (x + 60, y));
    }
    let name = "last gaze";
    text.write(canvas, name, (x + 60, y))?;
    let x = x + 60 + text.width(canvas, name) + 60;
    for place in 0..5 {
        dot(canvas, (x + 28 * place, y), 0.25 * f64::from(place))?;
    }
    text.write(canvas, "gazes from the first to the last, some numbered", (x + 140, y))
}

/// A point of the panorama in degrees: azimuth, elevation.
type Degrees = (f64, f64);

/// The straight line between two points of the panorama, in two pieces if it is shorter around the back.
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

//! The map from above, next to the true room.
//!
//! In: an occupancy per cell, `[cells_rho][elevation_cells][azimuth_cells]`, the heading, and the true occupancy. Out:
//! two plans of the same slice around the horizon at the same scale, in metres, seen from above: x (ahead) upwards, y
//! to the left. Invariant: both plans use the same reduction, [`strongest`].

use super::colour::{ColourMap, GAZE, INK, NO_DATA};
use super::frame::{Frame, swatches, ticks};
use super::picture::{Canvas, Drawn};
use super::text::{TEXT, Text};
use super::{Picture, ReportError, slice_around_horizon, strongest};
use crate::frame::{angles, unit_vector};
use crate::grid::Grid;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, VPos};

/// The content of a top view, in the frame of the map: for a map fixed in the world, `heading` is the yaw.
#[derive(Clone, Copy)]
pub struct TopView<'a> {
    /// Occupancy of every cell, `[cells_rho][elevation_cells][azimuth_cells]`.
    pub occupancy: &'a [f32],
    /// The true occupancy at `[x, y, z]` (metres; ahead, left, up): 0 empty, 1 solid, 1/2 not visible. Without it, only
    /// the map is drawn.
    pub truth: Option<&'a (dyn Fn([f64; 3]) -> f64 + Sync)>,
    /// The heading, an azimuth in radians, positive to the left.
    pub heading: f64,
    /// Opening of the field of view in radians, drawn as two lines; 0 for none.
    pub field: f64,
    /// Half the height of the slice around the horizon, in radians.
    pub band: f64,
}

const SIDE: i32 = 1080;

/// The plan or the two plans, 660 x 704 pixels each.
///
/// # Errors
/// [`ReportError::Length`] unless there is one occupancy per cell.
pub fn top_view(grid: &Grid, what: &TopView) -> Result<Picture, ReportError> {
    let slice = slice_around_horizon(grid, what.occupancy, what.band)?;
    let columns = grid.azimuth_cells();
    let degrees = what.band.to_degrees().round();
    let map = plan(grid, what, &format!("map (elevation ±{degrees}°)"), |[x, y], rho_m| {
        let (azimuth, _) = angles([x, y, 0.0]);
        let cell = grid.rho_of(rho_m).zip(grid.direction_of(azimuth, 0.0));
        cell.map_or(f64::NAN, |(rho, direction)| slice[rho * columns + direction.azimuth])
    });
    let Some(truth) = what.truth else {
        return Ok(map);
    };
    let elevations = [-1.0, -0.5, 0.0, 0.5, 1.0].map(|share: f64| (share * what.band).sin_cos());
    let truth = plan(grid, what, "truth", |[x, y], rho_m| {
        strongest(elevations.map(|(sine, cosine)| truth([x * cosine, y * cosine, rho_m * sine])))
    });
    Ok(Picture::side_by_side(&[map, truth]))
}

/// One plan: `value` gives an occupancy for a place (x ahead, y to the left) and its distance, metres.
fn plan(grid: &Grid, what: &TopView, title: &str, value: impl Fn([f64; 2], f64) -> f64 + Sync) -> Picture {
    let (gap, reach) = (grid.configuration().rho_min_m, grid.configuration().rho_max_m);
    let side = [-1.04 * reach, 1.04 * reach];
    let frame =
        Frame { pixels: [190, 100, 190 + SIDE, 100 + SIDE], across: [side[1], side[0]], upwards: side };
    let (columns, rows) = (frame.columns(), frame.rows());
    Picture::draw(660, 704, |canvas| {
        frame.paint(canvas, |column, row| {
            let (x, y) = (rows[row], columns[column]);
            let rho_m = (x * x + y * y).sqrt();
            let inside = rho_m >= gap && rho_m <= reach;
            let occupancy = if inside { value([x, y], rho_m) } else { f64::NAN };
            ColourMap::Occupancy.on_scale(occupancy, [0.0, 1.0])
        })?;
        for radius in [gap, reach] {
            circle(canvas, &frame, radius)?;
        }
        head(canvas, &frame, what, reach)?;
        let metres = ticks(side);
        frame.axes(canvas, ["y, to the left (m)", "x, ahead (m)"], &metres, &metres, "")?;
        frame.title(canvas, title)?;
        let named = [(0.0, "empty"), (0.5, "unknown, not visible"), (1.0, "occupied")];
        let named = named.map(|(value, name)| (ColourMap::Occupancy.on_scale(value, [0.0, 1.0]), name));
        let [left, _, _, bottom] = frame.pixels;
        swatches(canvas, (left, bottom + 134), &named)?;
        head_legend(canvas, what, (left, bottom + 182))
    })
}

/// The pixel of a place at the height of the head.
fn place(frame: &Frame, azimuth: f64, rho_m: f64) -> (i32, i32) {
    let [x, y, _] = unit_vector(azimuth, 0.0).map(|component| component * rho_m);
    frame.pixel(y, x)
}

/// A thin circle around the head.
fn circle(canvas: &Canvas, frame: &Frame, radius: f64) -> Drawn {
    let points: Vec<_> = (0..=180)
        .map(|i| f64::from(i) * std::f64::consts::TAU / 180.0)
        .map(|angle| place(frame, angle, radius))
        .collect();
    canvas.draw(&PathElement::new(points, INK.mix(0.5).stroke_width(2)))
}

/// The head as an arrowhead that points along the heading, and the sides of its field of view.
fn head(canvas: &Canvas, frame: &Frame, what: &TopView, reach: f64) -> Drawn {
    if what.field > 0.0 {
        for side in [-0.5, 0.5] {
            let azimuth = what.heading + side * what.field;
            let ends = [place(frame, azimuth, 0.05 * reach), place(frame, azimuth, reach)];
            canvas.draw(&PathElement::new(ends, GAZE.mix(0.75).stroke_width(3)))?;
        }
    }
    arrowhead(canvas, |turn, length| place(frame, what.heading + turn, 0.055 * reach * length))
}

/// The arrowhead; `corner` is the pixel at an angle to the heading and a distance from the centre, in units of its
/// size.
fn arrowhead(canvas: &Canvas, corner: impl Fn(f64, f64) -> (i32, i32)) -> Drawn {
    let arrow = [(0.0, 1.5), (2.5, 1.0), (std::f64::consts::PI, 0.45), (-2.5, 1.0)]
        .map(|(turn, length)| corner(turn, length));
    canvas.draw(&Polygon::new(arrow.to_vec(), GAZE.filled()))?;
    canvas.draw(&PathElement::new([arrow, arrow].concat()[..5].to_vec(), NO_DATA.stroke_width(2)))
}

/// The legend of the arrowhead and the two lines.
fn head_legend(canvas: &Canvas, what: &TopView, (x, y): (i32, i32)) -> Drawn {
    let text = Text::new(TEXT, HPos::Left, VPos::Center);
    arrowhead(canvas, |turn, length| {
        let (sine, cosine) = turn.sin_cos();
        (x + 14 - (16.0 * length * sine).round() as i32, y + 4 - (16.0 * length * cosine).round() as i32)
    })?;
    let name = "the head and its heading";
    text.write(canvas, name, (x + 42, y))?;
    if what.field <= 0.0 {
        return Ok(());
    }
    let x = x + 42 + text.width(canvas, name) + 48;
    canvas.draw(&PathElement::new([(x, y), (x + 60, y)], GAZE.mix(0.75).stroke_width(3)))?;
    text.write(canvas, "sides of its field of view", (x + 74, y))
}

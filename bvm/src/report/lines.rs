//! Curves of any quantity.
//!
//! In: named curves of (across, upwards). Out: a line plot with a legend, in the corner on the right that the curves
//! leave free. Invariant: values that are not finite are omitted.

use super::Picture;
use super::colour::{CURVES, FAINT};
use super::curves::legend;
use super::frame::{Frame, ticks};
use plotters::prelude::*;

/// One curve.
#[derive(Clone, Debug, PartialEq)]
pub struct Line {
    /// Its name in the legend.
    pub name: String,
    /// Its points, from left to right.
    pub points: Vec<(f64, f64)>,
}

/// The curves together, within `limits` (first and last value, across and upwards): 1000 x 600 pixels.
pub fn lines(title: &str, names: [&str; 2], limits: [[f64; 2]; 2], curves: &[Line]) -> Picture {
    let frame = Frame { pixels: [190, 110, 1940, 1050], across: limits[0], upwards: limits[1] };
    Picture::draw(1000, 600, |canvas| {
        for value in ticks(frame.upwards) {
            let (left, right) = (frame.pixel(limits[0][0], value), frame.pixel(limits[0][1], value));
            canvas.draw(&PathElement::new([left, right], FAINT.stroke_width(2)))?;
        }
        for (curve, colour) in curves.iter().zip(CURVES.iter().cycle()) {
            let within = |&(across, upwards): &(f64, f64)| {
                let upwards = upwards.clamp(limits[1][0].min(limits[1][1]), limits[1][1].max(limits[1][0]));
                (across.is_finite() && upwards.is_finite()).then(|| frame.pixel(across, upwards))
            };
            let points: Vec<(i32, i32)> = curve.points.iter().filter_map(within).collect();
            canvas.draw(&PathElement::new(points, colour.stroke_width(5)))?;
        }
        frame.axes(canvas, names, &ticks(frame.across), &ticks(frame.upwards), "")?;
        frame.title(canvas, title)?;
        let [bottom, top] = limits[1];
        let share = |value: f64| (value - bottom) / (top - bottom);
        let at_the_end = curves.iter().filter_map(|curve| curve.points.last()).map(|point| share(point.1));
        let below = at_the_end.fold(0.0, f64::max) > 0.6;
        let names: Vec<&str> = curves.iter().map(|curve| curve.name.as_str()).collect();
        legend(canvas, &frame, &names, below)
    })
}

//! Curves with bands.
//!
//! In: named curves, each point with a lower and an upper bound. Out: a line plot with a legend. Invariant: the bounds
//! of the axes hold all points and bands; values that are not finite are omitted.

use super::Picture;
use super::colour::{CURVES, FAINT};
use super::curves::legend;
use super::frame::{Frame, ticks};
use plotters::prelude::*;

/// One curve.
#[derive(Clone, Debug, PartialEq)]
pub struct Band {
    /// Its name in the legend.
    pub name: String,
    /// Across, upwards, lower bound, upper bound; from left to right.
    pub points: Vec<[f64; 4]>,
}

/// The curves together: 1000 x 600 pixels. `names` are those of the axes.
pub fn bands(title: &str, names: [&str; 2], curves: &[Band]) -> Picture {
    let all =
        || curves.iter().flat_map(|curve| &curve.points).filter(|point| point.iter().all(|x| x.is_finite()));
    let bounds = |low: usize, high: usize| {
        let least = all().map(|point| point[low]).fold(f64::INFINITY, f64::min);
        let most = all().map(|point| point[high]).fold(f64::NEG_INFINITY, f64::max);
        if least <= most { [least, most] } else { [0.0, 1.0] }
    };
    let ([first, last], [low, high], [least, most]) = (bounds(0, 0), bounds(2, 3), bounds(1, 1));
    let (low, high) = (low.min(least), high.max(most));
    let room = 0.05 * (high - low).max(1e-9);
    let frame = Frame {
        pixels: [210, 110, 1940, 1050],
        across: [first, last.max(first + 1e-9)],
        upwards: [low - room, high + room],
    };
    Picture::draw(1000, 600, |canvas| {
        for value in ticks(frame.upwards) {
            let (left, right) = (frame.pixel(frame.across[0], value), frame.pixel(frame.across[1], value));
            canvas.draw(&PathElement::new([left, right], FAINT.stroke_width(2)))?;
        }
        for (curve, colour) in curves.iter().zip(CURVES.iter().cycle()) {
            let points: Vec<_> =
                curve.points.iter().filter(|point| point.iter().all(|x| x.is_finite())).collect();
            let line = |value: usize| points.iter().map(move |point| frame.pixel(point[0], point[value]));
            let outline: Vec<_> = line(2).chain(line(3).rev()).collect();
            canvas.draw(&Polygon::new(outline, colour.mix(0.13).filled()))?;
        }
        for (curve, colour) in curves.iter().zip(CURVES.iter().cycle()) {
            let points = curve.points.iter().filter(|point| point.iter().all(|x| x.is_finite()));
            let line: Vec<_> = points.map(|point| frame.pixel(point[0], point[1])).collect();
            // One element a segment: the corners of a path would reach far beyond its points where it turns sharply.
            for pair in line.windows(2) {
                canvas.draw(&PathElement::new(pair, colour.stroke_width(5)))?;
            }
        }
        frame.axes(canvas, names, &ticks(frame.across), &ticks(frame.upwards), "")?;
        frame.title(canvas, title)?;
        let names: Vec<&str> = curves.iter().map(|curve| curve.name.as_str()).collect();
        legend(canvas, &frame, &names, false)
    })
}

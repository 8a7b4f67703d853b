//! What the cameras saw.
//!
//! In: the two pictures of a pair and the disparities of the left one. Out: the three side by side, each with its title; the
//! disparities with a colour bar in pixels. Invariant: pixels without a disparity are drawn as "no estimate".

use super::Picture;
use super::colour::{ColourMap, NO_DATA};
use super::frame::{Frame, swatches, ticks};
use super::picture::{Canvas, Drawn};
use crate::vision::{DisparityMap, GreyImage};
use plotters::prelude::*;

/// The longest side of a picture on the canvas.
const WIDE: f64 = 960.0;

/// The pictures of the left and the right camera, and the disparities.
pub fn cameras(pair: &[GreyImage; 2], found: &DisparityMap) -> Picture {
    let [left, right] = pair;
    let grey = |image: &GreyImage, at: usize| [image.pixels()[at] as u8; 3];
    let largest = found.disparity.iter().copied().filter(|value| value.is_finite()).fold(1.0, f32::max);
    let limits = [0.0, f64::from(largest)];
    let colour = |at: usize| {
        let value = f64::from(found.disparity[at]);
        let RGBColor(red, green, blue) =
            if value.is_finite() { ColourMap::Sequential.on_scale(value, limits) } else { NO_DATA };
        [red, green, blue]
    };
    let (width, height) = (found.width, found.height);
    let size = [width, height];
    Picture::side_by_side(&[
        panel("Left camera", size, &|at| grey(left, at), None),
        panel("Right camera", size, &|at| grey(right, at), None),
        panel("Disparity of the left picture", size, &colour, Some(limits)),
    ])
}

fn panel(
    title: &str,
    [width, height]: [usize; 2],
    pixel: &(dyn Fn(usize) -> [u8; 3] + Sync),
    bar: Option<[f64; 2]>,
) -> Picture {
    let tall = (WIDE * height as f64 / width as f64).round() as i32;
    let frame = Frame {
        pixels: [150, 90, 150 + WIDE as i32, 90 + tall],
        across: [0.0, width as f64],
        upwards: [height as f64, 0.0],
    };
    let right = if bar.is_some() { 270 } else { 40 };
    let (wide, high) = ((frame.pixels[2] + right) as u32 / 2, (frame.pixels[3] + 190) as u32 / 2);
    let pixels = |coordinates: Vec<f64>, count: usize| -> Vec<usize> {
        coordinates.into_iter().map(|at| (at.max(0.0) as usize).min(count - 1)).collect()
    };
    let (columns, rows) = (pixels(frame.columns(), width), pixels(frame.rows(), height));
    Picture::draw(wide, high, |canvas: &Canvas| -> Drawn {
        frame.paint(canvas, |x, y| {
            let (x, y) = (columns[x], rows[y]);
            let [red, green, blue] = pixel(y * width + x);
            RGBColor(red, green, blue)
        })?;
        frame.axes(
            canvas,
            ["column (pixels)", "row (pixels)"],
            &ticks(frame.across),
            &ticks(frame.upwards),
            "",
        )?;
        frame.title(canvas, title)?;
        match bar {
            None => Ok(()),
            Some(limits) => {
                swatches(canvas, (frame.pixels[0], frame.pixels[3] + 140), &[(NO_DATA, "no estimate")])?;
                frame.colour_bar(canvas, ColourMap::Sequential, limits, "disparity (pixels)")
            }
        }
    })
}

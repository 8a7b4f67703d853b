//! A rectangle with axes and its coordinate system.
//!
//! In: the position of the rectangle on the canvas, the limits and ticks of its axes. Out: pixels for coordinates, and
//! the drawn axes, titles and colour bars. Lengths are canvas pixels (twice those of the finished picture). Invariant:
//! the first coordinate is horizontal, the second vertical; either may decrease.

use super::colour::{ColourMap, INK};
use super::picture::{Canvas, Drawn};
use super::text::{TEXT, TITLE, Text};
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, VPos};
use rayon::prelude::*;

const TICK: i32 = 10;

/// The rectangle and the limits of its axes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Frame {
    /// Left, top, right and bottom pixel.
    pub(super) pixels: [i32; 4],
    /// First and last value from left to right; the first may be the larger one.
    pub(super) across: [f64; 2],
    /// First and last value from bottom to top.
    pub(super) upwards: [f64; 2],
}

impl Frame {
    /// The pixel of a pair of coordinates.
    pub(super) fn pixel(&self, across: f64, upwards: f64) -> (i32, i32) {
        let [left, top, right, bottom] = self.pixels.map(f64::from);
        let share = |value: f64, [first, last]: [f64; 2]| (value - first) / (last - first);
        let x = left + share(across, self.across) * (right - left);
        let y = bottom + share(upwards, self.upwards) * (top - bottom);
        (x.round() as i32, y.round() as i32)
    }

    /// The horizontal coordinates of the middles of the pixels inside, from the left.
    pub(super) fn columns(&self) -> Vec<f64> {
        let ([left, _, right, _], [first, last]) = (self.pixels, self.across);
        let share = |x: i32| (f64::from(x) + 0.5) / f64::from(right - left);
        (0..right - left).map(|x| first + share(x) * (last - first)).collect()
    }

    /// The vertical coordinates of the middles of the pixels inside, from the top.
    pub(super) fn rows(&self) -> Vec<f64> {
        let ([_, top, _, bottom], [first, last]) = (self.pixels, self.upwards);
        let share = |y: i32| (f64::from(bottom - top) - f64::from(y) - 0.5) / f64::from(bottom - top);
        (0..bottom - top).map(|y| first + share(y) * (last - first)).collect()
    }

    /// Every pixel inside, coloured by its column and row, from the upper left; rows are shared among threads.
    pub(super) fn paint(&self, canvas: &Canvas, colour: impl Fn(usize, usize) -> RGBColor + Sync) -> Drawn {
        let [left, top, right, bottom] = self.pixels;
        let (width, height) = ((right - left) as usize, (bottom - top) as usize);
        let mut painted = vec![0; 3 * width * height];
        painted.par_chunks_exact_mut(3 * width).enumerate().for_each(|(y, row)| {
            for (x, pixel) in row.chunks_exact_mut(3).enumerate() {
                let RGBColor(red, green, blue) = colour(x, y);
                pixel.copy_from_slice(&[red, green, blue]);
            }
        });
        let size = (width as u32, height as u32);
        let painted = BitMapElement::with_owned_buffer((left, top), size, painted);
        canvas.draw(&painted.expect("internal: three bytes a pixel"))
    }

    /// Border, ticks, their labels, and the names of the two axes.
    pub(super) fn axes(
        &self,
        canvas: &Canvas,
        names: [&str; 2],
        across: &[f64],
        upwards: &[f64],
        unit: &str,
    ) -> Drawn {
        let [left, top, right, bottom] = self.pixels;
        let line = INK.stroke_width(2);
        canvas.draw(&Rectangle::new([(left - 1, top - 1), (right, bottom)], line))?;
        let below = Text::new(TEXT, HPos::Center, VPos::Top);
        for (&value, label) in across.iter().zip(labels(across, unit)) {
            let (x, _) = self.pixel(value, 0.0);
            canvas.draw(&PathElement::new([(x, bottom), (x, bottom + TICK)], line))?;
            below.write(canvas, &label, (x, bottom + TICK + 10))?;
        }
        let beside = Text::new(TEXT, HPos::Right, VPos::Center);
        let mut widest = 0;
        for (&value, label) in upwards.iter().zip(labels(upwards, unit)) {
            let (_, y) = self.pixel(0.0, value);
            canvas.draw(&PathElement::new([(left - TICK, y), (left, y)], line))?;
            beside.write(canvas, &label, (left - TICK - 8, y))?;
            widest = widest.max(beside.width(canvas, &label));
        }
        below.write(canvas, names[0], ((left + right) / 2, bottom + TICK + 60))?;
        let name = Text::new(TEXT, HPos::Center, VPos::Bottom).turned();
        name.write(canvas, names[1], (left - TICK - 8 - widest - 26, (top + bottom) / 2))
    }

    /// A title above, in bold, at the left edge.
    pub(super) fn title(&self, canvas: &Canvas, text: &str) -> Drawn {
        let [left, top, ..] = self.pixels;
        Text::new(TITLE, HPos::Left, VPos::Bottom).bold().write(canvas, text, (left, top - 30))
    }

    /// A colour bar to the right of the frame, with a few ticks and the name of the quantity.
    pub(super) fn colour_bar(&self, canvas: &Canvas, map: ColourMap, limits: [f64; 2], name: &str) -> Drawn {
        let [_, top, right, bottom] = self.pixels;
        let bar =
            Frame { pixels: [right + 44, top, right + 84, bottom], across: [0.0, 1.0], upwards: limits };
        let values = bar.rows();
        bar.paint(canvas, |_, y| map.on_scale(values[y], limits))?;
        let line = INK.stroke_width(2);
        canvas.draw(&Rectangle::new([(right + 43, top - 1), (right + 84, bottom)], line))?;
        let beside = Text::new(TEXT, HPos::Left, VPos::Center);
        let values = ticks(limits);
        let mut widest = 0;
        for (&value, label) in values.iter().zip(labels(&values, "")) {
            let (_, y) = bar.pixel(0.0, value);
            canvas.draw(&PathElement::new([(right + 84, y), (right + 84 + TICK, y)], line))?;
            beside.write(canvas, &label, (right + 84 + TICK + 8, y))?;
            widest = widest.max(beside.width(canvas, &label));
        }
        let turned = Text::new(TEXT, HPos::Center, VPos::Top).turned();
        turned.write(canvas, name, (right + 84 + TICK + 8 + widest + 22, (top + bottom) / 2))
    }
}

/// A row of coloured squares with their names, from left to right, the first square's left middle at a pixel.
pub(super) fn swatches(canvas: &Canvas, (mut x, y): (i32, i32), names: &[(RGBColor, &str)]) -> Drawn {
    let text = Text::new(TEXT, HPos::Left, VPos::Center);
    for (colour, name) in names {
        let corners = [(x, y - 14), (x + 28, y + 14)];
        canvas.draw(&Rectangle::new(corners, colour.filled()))?;
        canvas.draw(&Rectangle::new(corners, INK.stroke_width(2)))?;
        text.write(canvas, name, (x + 42, y))?;
        x += 42 + text.width(canvas, name) + 48;
    }
    Ok(())
}

/// Five to eleven round values within limits (in either order).
pub(super) fn ticks(limits: [f64; 2]) -> Vec<f64> {
    let (low, high) = (limits[0].min(limits[1]), limits[0].max(limits[1]));
    let coarsest = (high - low) / 4.5;
    if !(coarsest.is_finite() && coarsest > 0.0) {
        return vec![low];
    }
    let power = 10_f64.powf(coarsest.log10().floor());
    let round = [5.0, 2.0].into_iter().find(|round| round * power <= coarsest).unwrap_or(1.0);
    let step = round * power;
    let (first, last) = ((low / step - 1e-9).ceil() as i64, (high / step + 1e-9).floor() as i64);
    (first..=last).map(|i| i as f64 * step).collect()
}

/// The labels of ticks: all with the same number of decimals, as few as distinguish them, a proper minus sign, and the
/// unit.
fn labels(values: &[f64], unit: &str) -> Vec<String> {
    let exact = |decimals: i32| {
        let scale = 10_f64.powi(decimals);
        values
            .iter()
            .all(|value| ((value * scale).round() / scale - value).abs() < 1e-9 * (1.0 + value.abs()))
    };
    let decimals = (0..6).find(|&decimals| exact(decimals)).unwrap_or(6) as usize;
    values.iter().map(|value| format!("{:.decimals$}{unit}", value + 0.0).replace('-', "\u{2212}")).collect()
}

//! A rectangle with axes, into which a picture maps its own coordinates.
//!
//! In: where the rectangle is on the canvas, what its sides mean, where the ticks are. Out: pixels for coordinates, and
//! the drawn axes, titles and colour bars. Lengths are canvas pixels (twice those of the finished picture).
//! Invariant: the first coordinate grows to the right, the second upwards.

use super::colour::{ColourMap, INK};
use super::picture::{Canvas, Drawn, FONT};
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

/// Size of the text of ticks and legends.
pub(super) const TEXT: i32 = 26;
/// Size of the text of titles.
pub(super) const TITLE: i32 = 34;
const TICK: i32 = 10;

/// Where text goes: which of its points is put at the given pixel.
pub(super) fn style(size: i32, horizontal: HPos, vertical: VPos) -> TextStyle<'static> {
    TextStyle::from((FONT, size).into_font()).color(&INK).pos(Pos::new(horizontal, vertical))
}

/// The rectangle and what its sides mean.
#[derive(Clone, Copy, Debug)]
pub(super) struct Frame {
    /// Left, top, right and bottom pixel.
    pub(super) pixels: [i32; 4],
    /// First and last value from left to right.
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

    /// The coordinates of the middle of a pixel.
    pub(super) fn coordinates(&self, x: i32, y: i32) -> (f64, f64) {
        let [left, top, right, bottom] = self.pixels.map(f64::from);
        let along = |share: f64, [first, last]: [f64; 2]| first + share * (last - first);
        (
            along((f64::from(x) + 0.5 - left) / (right - left), self.across),
            along((bottom - f64::from(y) - 0.5) / (bottom - top), self.upwards),
        )
    }

    /// Every pixel inside, coloured by its coordinates.
    pub(super) fn paint(&self, canvas: &Canvas, colour: impl Fn(f64, f64) -> RGBColor) -> Drawn {
        let [left, top, right, bottom] = self.pixels;
        for y in top..bottom {
            for x in left..right {
                let (across, upwards) = self.coordinates(x, y);
                canvas.draw_pixel((x, y), &colour(across, upwards))?;
            }
        }
        Ok(())
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
        let below = style(TEXT, HPos::Center, VPos::Top);
        for &value in across {
            let (x, _) = self.pixel(value, 0.0);
            canvas.draw(&PathElement::new([(x, bottom), (x, bottom + TICK)], line))?;
            canvas.draw_text(&label(value, unit), &below, (x, bottom + TICK + 6))?;
        }
        let beside = style(TEXT, HPos::Right, VPos::Center);
        for &value in upwards {
            let (_, y) = self.pixel(0.0, value);
            canvas.draw(&PathElement::new([(left - TICK, y), (left, y)], line))?;
            canvas.draw_text(&label(value, unit), &beside, (left - TICK - 8, y))?;
        }
        canvas.draw_text(names[0], &below, ((left + right) / 2, bottom + TICK + 46))?;
        let turned = TextStyle::from((FONT, TEXT).into_font().transform(FontTransform::Rotate270))
            .color(&INK)
            .pos(Pos::new(HPos::Center, VPos::Top));
        canvas.draw_text(names[1], &turned, (left - TICK - 120, (top + bottom) / 2))
    }

    /// A title above, in bold, at the left edge.
    pub(super) fn title(&self, canvas: &Canvas, text: &str) -> Drawn {
        let [left, top, ..] = self.pixels;
        let bold = TextStyle::from((FONT, TITLE).into_font().style(FontStyle::Bold))
            .color(&INK)
            .pos(Pos::new(HPos::Left, VPos::Bottom));
        canvas.draw_text(text, &bold, (left, top - 22))
    }

    /// A colour bar to the right of the frame, with a few ticks and the name of what it measures.
    pub(super) fn colour_bar(&self, canvas: &Canvas, map: ColourMap, limits: [f64; 2], name: &str) -> Drawn {
        let [_, top, right, bottom] = self.pixels;
        let bar =
            Frame { pixels: [right + 40, top, right + 80, bottom], across: [0.0, 1.0], upwards: limits };
        bar.paint(canvas, |_, value| map.on_scale(value, limits))?;
        let line = INK.stroke_width(2);
        canvas.draw(&Rectangle::new([(right + 39, top - 1), (right + 80, bottom)], line))?;
        let text = style(TEXT, HPos::Left, VPos::Center);
        for value in ticks(limits) {
            let (_, y) = bar.pixel(0.0, value);
            canvas.draw(&PathElement::new([(right + 80, y), (right + 80 + TICK, y)], line))?;
            canvas.draw_text(&label(value, ""), &text, (right + 80 + TICK + 8, y))?;
        }
        let turned = TextStyle::from((FONT, TEXT).into_font().transform(FontTransform::Rotate270))
            .color(&INK)
            .pos(Pos::new(HPos::Center, VPos::Top));
        canvas.draw_text(name, &turned, (right + 80 + TICK + 90, (top + bottom) / 2))
    }
}

/// Four to ten round values within limits (in either order).
pub(super) fn ticks(limits: [f64; 2]) -> Vec<f64> {
    let (low, high) = (limits[0].min(limits[1]), limits[0].max(limits[1]));
    let rough = (high - low) / 5.0;
    if !(rough.is_finite() && rough > 0.0) {
        return vec![low];
    }
    let power = 10_f64.powf(rough.log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0]
        .into_iter()
        .map(|round| round * power)
        .find(|&step| step >= rough * 0.999)
        .unwrap_or(10.0 * power);
    let (first, last) = ((low / step - 1e-9).ceil() as i64, (high / step + 1e-9).floor() as i64);
    (first..=last).map(|i| i as f64 * step).collect()
}

/// A tick's text: no trailing zeros, a proper minus sign, and the unit.
fn label(value: f64, unit: &str) -> String {
    let rounded = (value * 1e4).round() / 1e4;
    format!("{}{unit}", if rounded == 0.0 { 0.0 } else { rounded }).replace('-', "\u{2212}")
}

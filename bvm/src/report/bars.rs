//! Bars in groups.
//!
//! In: named series with a value for each group. Out: bars on a logarithmic axis, each with its value above. Invariant: values that
//! are not positive and finite have no bar.

use super::Picture;
use super::colour::{CURVES, FAINT, INK};
use super::frame::{Frame, swatches};
use super::text::{TEXT, Text};
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, VPos};

/// The bars of one colour.
#[derive(Clone, Debug, PartialEq)]
pub struct Bars {
    /// Their name in the legend.
    pub name: String,
    /// One value for each group.
    pub values: Vec<f64>,
}

/// The part of a group that its bars take.
const FILLED: f64 = 0.84;

/// The bars together: 1000 x 480 pixels. `quantity` is the name of the vertical axis.
pub fn bars(title: &str, quantity: &str, groups: &[&str], series: &[Bars]) -> Picture {
    let all = || series.iter().flat_map(|bars| &bars.values).copied().filter(|value| is_shown(*value));
    let least = all().fold(f64::INFINITY, f64::min).min(1e300);
    let most = all().fold(0.0, f64::max).max(least);
    // Room for the values and the legend above the tallest bar.
    let (low, high) = ((0.5 * least).log10(), (4.0 * most).log10());
    let frame =
        Frame { pixels: [210, 110, 1960, 860], across: [0.0, groups.len() as f64], upwards: [low, high] };
    let ticks: Vec<f64> = (low.floor() as i32..=high.ceil() as i32)
        .flat_map(|power| [1.0, 2.0, 5.0].map(|digit| digit * 10f64.powi(power)))
        .filter(|tick| (low..=high).contains(&tick.log10()))
        .collect();
    Picture::draw(1000, 480, |canvas| {
        let beside = Text::new(TEXT, HPos::Right, VPos::Center);
        for tick in &ticks {
            let ends = [frame.pixel(0.0, tick.log10()), frame.pixel(groups.len() as f64, tick.log10())];
            canvas.draw(&PathElement::new(ends, FAINT.stroke_width(2)))?;
            beside.write(canvas, &short(*tick), (ends[0].0 - 18, ends[0].1))?;
        }
        let above = Text::new(TEXT, HPos::Center, VPos::Bottom);
        let width = FILLED / series.len().max(1) as f64;
        for (at, (bars, colour)) in series.iter().zip(CURVES.iter().cycle()).enumerate() {
            for (group, value) in bars.values.iter().enumerate().filter(|(_, value)| is_shown(**value)) {
                let left = group as f64 + 0.5 * (1.0 - FILLED) + width * at as f64;
                let (from, to) = (frame.pixel(left, value.log10()), frame.pixel(left + 0.92 * width, low));
                canvas.draw(&Rectangle::new([from, to], colour.filled()))?;
                above.write(canvas, &short(*value), ((from.0 + to.0) / 2, from.1 - 6))?;
            }
        }
        frame.axes(canvas, ["", ""], &[], &[], "")?;
        let [left, top, _, bottom] = frame.pixels;
        Text::new(TEXT, HPos::Center, VPos::Bottom).turned().write(
            canvas,
            quantity,
            (left - 110, (top + bottom) / 2),
        )?;
        let below = Text::new(TEXT, HPos::Center, VPos::Top);
        for (group, name) in groups.iter().enumerate() {
            let (x, y) = frame.pixel(group as f64 + 0.5, low);
            below.write(canvas, name, (x, y + 20))?;
        }
        canvas.draw(&PathElement::new(
            [frame.pixel(0.0, low), frame.pixel(groups.len() as f64, low)],
            INK.stroke_width(2),
        ))?;
        frame.title(canvas, title)?;
        let names: Vec<(RGBColor, &str)> =
            CURVES.iter().copied().cycle().zip(series.iter().map(|bars| bars.name.as_str())).collect();
        swatches(canvas, (frame.pixels[0] + 40, frame.pixels[1] + 44), &names)
    })
}

fn is_shown(value: f64) -> bool {
    value.is_finite() && value > 0.0
}

/// Two digits.
fn short(value: f64) -> String {
    match value {
        value if value >= 9.95 => format!("{value:.0}"),
        value if value >= 0.995 => format!("{value:.1}"),
        value => format!("{value:.2}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn taller_values_have_taller_bars() {
        let series = [
            Bars { name: "a".to_owned(), values: vec![1.0, f64::NAN] },
            Bars { name: "b".to_owned(), values: vec![10.0, -1.0] },
        ];
        let picture = bars("t", "q", &["one", "two"], &series);
        let (width, _) = picture.size();
        let count = |colour: RGBColor, from: u32, to: u32| {
            let pixels = picture.pixels().chunks_exact(3).enumerate();
            let inside = pixels.filter(|(at, _)| (from..to).contains(&(*at as u32 % width)));
            inside.filter(|(_, pixel)| **pixel == [colour.0, colour.1, colour.2]).count()
        };
        // The right half has the group without bars; the legend is on the left.
        assert!(count(CURVES[1], 0, width / 2) > 2 * count(CURVES[0], 0, width / 2));
        assert_eq!(count(CURVES[0], width / 2 + 60, width) + count(CURVES[1], width / 2 + 60, width), 0);
        assert_eq!([0.41, 0.997, 3.25, 25.4].map(short), ["0.41", "1.0", "3.2", "25"]);
    }
}

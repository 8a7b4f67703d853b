//! Heat maps, with the colour bar that measures them.
//!
//! In: a number for each pair of values. Out: coloured cells. Invariant: the lightest colour is the least number or 0, the
//! darkest the greatest.

use super::Heat;
use super::canvas::{Area, Drawn, Pen};
use super::labels::{abridged, fitted, of_places, tick_between};
use plotters::prelude::*;

impl Pen {
    pub(super) fn heat<B: DrawingBackend>(&self, area: &Area<'_, B>, panel: &Heat) -> Drawn<B> {
        let (wide, _) = area.dim_in_pixel();
        let (map, key) = area.split_horizontally(wide - 130 * self.fine);
        let (columns, rows) = (panel.across.1.len(), panel.upwards.1.len());
        let highest = panel.numbers.iter().copied().fold(0.0, f64::max);
        let lowest = panel.numbers.iter().copied().fold(0.0, f64::min);
        let span = if highest > lowest { highest - lowest } else { 1.0 };
        let mut chart = self
            .builder(&map, &panel.title)
            .build_cartesian_2d(-0.5..columns as f64 - 0.5, -0.5..rows as f64 - 0.5)?;
        // Those of the rows stand one above the other, so that each has the same room.
        let short: Vec<String> = panel.upwards.1.iter().map(|label| abridged(label, 12)).collect();
        let (labels, each) = fitted(&panel.across.1, 70);
        let (across, upwards) = (of_places(&labels, each), of_places(&short, rows / 18 + 1));
        chart
            .configure_mesh()
            .disable_mesh()
            .x_labels((columns * 2).max(2))
            .y_labels((rows * 2).max(2))
            .x_label_formatter(&across)
            .y_label_formatter(&upwards)
            .x_desc(panel.across.0.as_str())
            .y_desc(panel.upwards.0.as_str())
            .label_style(self.text(13))
            .axis_desc_style(self.text(14))
            .draw()?;
        chart.draw_series(panel.numbers.iter().enumerate().map(|(place, number)| {
            let (x, y) = ((place % columns) as f64, (place / columns) as f64);
            let colour = shade((number - lowest) / span);
            Rectangle::new([(x - 0.5, y - 0.5), (x + 0.5, y + 0.5)], colour.filled())
        }))?;
        let mut bar = ChartBuilder::on(&key)
            .margin_top(52 * self.fine)
            .margin_bottom(66 * self.fine)
            .margin_right(10 * self.fine)
            .margin_left(6 * self.fine)
            .right_y_label_area_size(70 * self.fine)
            .build_cartesian_2d(0.0..1.0, lowest..lowest + span)?
            .set_secondary_coord(0.0..1.0, lowest..lowest + span);
        bar.configure_secondary_axes()
            .y_desc(panel.measure.as_str())
            .y_label_formatter(&tick_between(lowest, lowest + span))
            .label_style(self.text(13))
            .axis_desc_style(self.text(14))
            .draw()?;
        const STEPS: usize = 100;
        bar.draw_series((0..STEPS).map(|step| {
            let at = |step: usize| lowest + span * step as f64 / STEPS as f64;
            let colour = shade((step as f64 + 0.5) / STEPS as f64);
            Rectangle::new([(0.0, at(step)), (1.0, at(step + 1))], colour.filled())
        }))?;
        Ok(())
    }
}

/// White to dark blue, for a part between 0 and 1.
fn shade(part: f64) -> RGBColor {
    let part = part.clamp(0.0, 1.0);
    let stops = [(255.0, 255.0, 255.0), (158.0, 198.0, 224.0), (49.0, 118.0, 178.0), (8.0, 38.0, 92.0)];
    let place = part * 3.0;
    let at = (place.floor() as usize).min(2);
    let (a, b, rest) = (stops[at], stops[at + 1], place - at as f64);
    let mixed = |a: f64, b: f64| (a + (b - a) * rest).round() as u8;
    RGBColor(mixed(a.0, b.0), mixed(a.1, b.1), mixed(a.2, b.2))
}

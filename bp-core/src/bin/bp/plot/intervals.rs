//! Means and intervals of the elements of a family, on one axis.
//!
//! In: a mean and an interval for each element. Out: a point on a line for each. Invariant: all elements are drawn.

use super::Intervals;
use super::canvas::{Area, COLOURS, Drawn, GRID, Pen, key_line, range};
use super::labels::{fitted, of_places, tick_between};
use plotters::prelude::*;

impl Pen {
    pub(super) fn intervals<B: DrawingBackend>(&self, area: &Area<'_, B>, panel: &Intervals) -> Drawn<B> {
        let unit = self.fine;
        let count = panel.marks.len();
        let numbers = panel.marks.iter().flat_map(|(_, mean, (low, high))| [*mean, *low, *high]);
        let (low, high) = range(numbers, false);
        // The legend stands above the intervals.
        let high = high + 0.2 * (high - low);
        let labels: Vec<String> = panel.marks.iter().map(|(label, _, _)| label.clone()).collect();
        let (labels, each) = fitted(&labels, 95);
        let mut chart =
            self.builder(area, &panel.title).build_cartesian_2d(-0.5..count as f64 - 0.5, low..high)?;
        chart
            .configure_mesh()
            .disable_x_mesh()
            .light_line_style(WHITE)
            .bold_line_style(GRID)
            .x_labels((count * 2).max(2))
            .x_label_formatter(&of_places(&labels, each))
            .y_label_formatter(&tick_between(low, high))
            .x_desc(format!("element of {}", panel.across))
            .y_desc(panel.across.as_str())
            .label_style(self.text(13))
            .axis_desc_style(self.text(14))
            .draw()?;
        let lines = panel.marks.iter().enumerate().map(|(at, (_, _, (from, to)))| {
            let x = at as f64;
            PathElement::new([(x, *from), (x, *to)], COLOURS[0].stroke_width(2 * unit))
        });
        chart.draw_series(lines)?.label("90 %: 5 % to 95 %").legend(move |at| key_line(at, unit, COLOURS[0]));
        let means = panel.marks.iter().enumerate().filter(|(_, (_, mean, _))| mean.is_finite());
        chart
            .draw_series(means.map(|(at, (_, mean, _))| {
                Circle::new((at as f64, *mean), 4 * unit as i32, COLOURS[1].filled())
            }))?
            .label("mean")
            .legend(move |(x, y)| {
                Circle::new((x + 9 * unit as i32, y), 4 * unit as i32, COLOURS[1].filled())
            });
        self.legend(&mut chart, SeriesLabelPosition::UpperRight)
    }
}

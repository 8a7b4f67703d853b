//! Panels drawn with plotters.
//!
//! In: panels. Out: the bytes of a PNG or an SVG. Invariant: text is in the included font, or in SVG in any sans-serif
//! one; colours differ in lightness too, so that they can be distinguished in grey.

use super::labels::{at_whole, fitted, of_places, shortened, tick, tick_between};
use super::{Bars, Course, Density, Panel};
use plotters::coord::Shift;
use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;
use plotters::style::register_font;
use std::io::Cursor;
use std::sync::OnceLock;

pub(super) type Area<'b, B> = DrawingArea<B, Shift>;
/// Two axes with numbers.
type Chart<'b, B> = ChartContext<'b, B, Cartesian2d<RangedCoordf64, RangedCoordf64>>;
pub(super) type Drawn<B> = Result<(), DrawingAreaErrorKind<<B as DrawingBackend>::ErrorType>>;

const FONT: &str = "sans-serif";
const SIZE: (u32, u32) = (900, 430);
/// The room beside the cells of a heat map, for labels and colour bar, and above and below them.
const BESIDE_MAP: u32 = 236;
const ABOVE_MAP: u32 = 104;
/// A PNG has this many pixels for each unit.
const FINE: u32 = 2;
pub(super) const COLOURS: [RGBColor; 6] = [
    RGBColor(33, 87, 145),
    RGBColor(214, 108, 28),
    RGBColor(46, 139, 106),
    RGBColor(145, 62, 122),
    RGBColor(150, 120, 20),
    RGBColor(90, 90, 90),
];
/// The bars of draws inside an interval.
const INSIDE: RGBColor = RGBColor(128, 158, 190);
const INK: RGBColor = RGBColor(40, 40, 40);
pub(super) const GRID: RGBColor = RGBColor(225, 225, 225);

/// The panels as SVG.
pub(super) fn svg(panels: &[Panel]) -> Result<Vec<u8>, String> {
    // The width of text is measured in it.
    include_font();
    let mut text = String::new();
    {
        let (width, height, _) = size(panels);
        let root = SVGBackend::with_string(&mut text, (width, height)).into_drawing_area();
        draw(&root, panels, 1).and_then(|()| root.present()).map_err(|error| error.to_string())?;
    }
    Ok(text.into_bytes())
}

/// The panels as PNG.
pub(super) fn png(panels: &[Panel]) -> Result<Vec<u8>, String> {
    include_font();
    let (width, height, _) = size(panels);
    let (width, height) = (width * FINE, height * FINE);
    let mut pixels = vec![255; 3 * width as usize * height as usize];
    {
        let root = BitMapBackend::with_buffer(&mut pixels, (width, height)).into_drawing_area();
        draw(&root, panels, FINE).and_then(|()| root.present()).map_err(|error| error.to_string())?;
    }
    let mut bytes = Cursor::new(Vec::new());
    let mut encoder = png::Encoder::new(&mut bytes, width, height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    let mut writer = encoder.write_header().map_err(|error| error.to_string())?;
    writer.write_image_data(&pixels).map_err(|error| error.to_string())?;
    writer.finish().map_err(|error| error.to_string())?;
    Ok(bytes.into_inner())
}

/// Width and height of all panels, and where each row of them ends.
fn size(panels: &[Panel]) -> (u32, u32, Vec<u32>) {
    let columns = if panels.len() > 3 { 2 } else { 1 };
    let ends = panels.chunks(columns).scan(0, |end, row| {
        *end += row.iter().map(high).max().unwrap_or(SIZE.1);
        Some(*end)
    });
    let ends: Vec<u32> = ends.collect();
    (SIZE.0 * columns as u32, ends.last().copied().unwrap_or(SIZE.1), ends)
}

/// The height of a panel: a heat map has square cells, where that is not too high.
fn high(panel: &Panel) -> u32 {
    match panel {
        Panel::Heat(heat) => {
            let (across, upwards) = (heat.across.1.len().max(1), heat.upwards.1.len());
            let cells = f64::from(SIZE.0 - BESIDE_MAP) * upwards as f64 / across as f64;
            (cells as u32 + ABOVE_MAP).clamp(SIZE.1, SIZE.0)
        }
        _ => SIZE.1,
    }
}

/// Registers the included font, once.
fn include_font() {
    static INCLUDED: OnceLock<()> = OnceLock::new();
    INCLUDED.get_or_init(|| {
        for (style, bytes) in
            [(FontStyle::Normal, dejavu::sans::regular()), (FontStyle::Bold, dejavu::sans::bold())]
        {
            assert!(register_font(FONT, style, bytes).is_ok(), "internal: the included font is not a font");
        }
    });
}

fn draw<B: DrawingBackend>(root: &Area<'_, B>, panels: &[Panel], fine: u32) -> Drawn<B> {
    root.fill(&WHITE)?;
    let (width, _, ends) = size(panels);
    let across: Vec<u32> = (1..width / SIZE.0).map(|column| column * SIZE.0 * fine).collect();
    let areas = root.split_by_breakpoints(across, ends.iter().map(|end| end * fine).collect::<Vec<_>>());
    for (panel, area) in panels.iter().zip(&areas) {
        let pen = Pen { fine };
        match panel {
            Panel::Bars(bars) => pen.bars(area, bars)?,
            Panel::Density(density) => pen.density(area, density)?,
            Panel::Course(course) => pen.course(area, course)?,
            Panel::Stairs(stairs) => pen.stairs(area, stairs)?,
            Panel::Heat(heat) => pen.heat(area, heat)?,
            Panel::Intervals(intervals) => pen.intervals(area, intervals)?,
        }
    }
    Ok(())
}

/// The sizes of text and lines.
pub(super) struct Pen {
    /// Pixels for each unit.
    pub(super) fine: u32,
}

/// The range of some numbers, with a margin; a single number has one around it.
pub(super) fn range(numbers: impl Iterator<Item = f64>, zero: bool) -> (f64, f64) {
    let start = if zero { (0.0, 0.0) } else { (f64::INFINITY, f64::NEG_INFINITY) };
    let (low, high) = numbers
        .filter(|number| number.is_finite())
        .fold(start, |(low, high), number| (low.min(number), high.max(number)));
    if low > high {
        return (0.0, 1.0);
    }
    let margin = if high > low { 0.06 * (high - low) } else { 0.5 * high.abs().max(1e-9) };
    let below = if zero && low >= 0.0 { 0.0 } else { low - margin };
    (below, high + margin)
}

impl Pen {
    pub(super) fn text(&self, size: u32) -> TextStyle<'static> {
        (FONT, size * self.fine).into_font().color(&INK)
    }

    pub(super) fn builder<'a, 'b, B: DrawingBackend>(
        &self,
        area: &'a Area<'b, B>,
        title: &str,
    ) -> ChartBuilder<'a, 'b, B> {
        let mut builder = ChartBuilder::on(area);
        builder
            .caption(shortened(title, 84), self.text(18))
            .margin(14 * self.fine)
            .x_label_area_size(52 * self.fine)
            .y_label_area_size(78 * self.fine);
        builder
    }

    /// The names of what is drawn.
    pub(super) fn legend<'b, B: DrawingBackend + 'b>(
        &self,
        chart: &mut Chart<'b, B>,
        position: SeriesLabelPosition,
    ) -> Drawn<B> {
        chart
            .configure_series_labels()
            .background_style(WHITE.mix(0.85))
            .border_style(GRID)
            .label_font(self.text(13))
            .legend_area_size(24 * self.fine)
            .position(position)
            .draw()
    }

    fn bars<B: DrawingBackend>(&self, area: &Area<'_, B>, panel: &Bars) -> Drawn<B> {
        let count = panel.bars.len();
        let (low, high) = range(
            panel.bars.iter().flat_map(|(_, number, error)| [number - error, number + error, *number]),
            true,
        );
        let mut chart =
            self.builder(area, &panel.title).build_cartesian_2d(-0.5..count as f64 - 0.5, low..high)?;
        let labels: Vec<String> = panel.bars.iter().map(|(label, _, _)| label.clone()).collect();
        let (labels, each) = fitted(&labels, 95);
        chart
            .configure_mesh()
            .disable_x_mesh()
            .light_line_style(WHITE)
            .bold_line_style(GRID)
            .x_labels((count * 2).max(2))
            .x_label_formatter(&of_places(&labels, each))
            .y_label_formatter(&tick_between(low, high))
            .x_desc(shortened(&panel.across, 90))
            .y_desc(panel.upwards.as_str())
            .label_style(self.text(13))
            .axis_desc_style(self.text(14))
            .draw()?;
        chart.draw_series(panel.bars.iter().enumerate().map(|(at, (_, number, _))| {
            let x = at as f64;
            Rectangle::new([(x - 0.38, 0.0), (x + 0.38, *number)], COLOURS[0].filled())
        }))?;
        for (at, (_, number, error)) in panel.bars.iter().enumerate() {
            if *error > 0.0 {
                let x = at as f64;
                let line = [(x, number - error), (x, number + error)];
                chart.draw_series([PathElement::new(line, INK.stroke_width(2 * self.fine))])?;
            }
        }
        // The numbers, where there is room for them.
        if count <= 12 {
            let style = self.text(13).pos(plotters::style::text_anchor::Pos::new(
                plotters::style::text_anchor::HPos::Center,
                plotters::style::text_anchor::VPos::Bottom,
            ));
            chart.draw_series(panel.bars.iter().enumerate().map(|(at, (_, number, error))| {
                Text::new(tick(number), (at as f64, number.max(0.0) + error), style.clone())
            }))?;
        }
        Ok(())
    }

    fn density<B: DrawingBackend>(&self, area: &Area<'_, B>, panel: &Density) -> Drawn<B> {
        let unit = self.fine;
        let points = || panel.curves.iter().flat_map(|(_, points)| points.iter().copied());
        let ends = panel.histogram.iter().flat_map(|(left, right, _)| [*left, *right]);
        let (left, right) = range(points().map(|(x, _)| x).chain(ends), false);
        let heights = panel.histogram.iter().map(|(_, _, height)| *height);
        // An infinite density at an end does not flatten the rest.
        let mut all: Vec<f64> = points().map(|(_, y)| y).collect();
        all.sort_by(f64::total_cmp);
        let cap = all.get(all.len() * 99 / 100).copied().unwrap_or(0.0) * 1.6;
        let (_, high) = range(points().map(|(_, y)| y.min(cap)).chain(heights), true);
        let across = tick_between(left, right);
        let mut chart = self.builder(area, &panel.title).build_cartesian_2d(left..right, 0.0..high)?;
        chart
            .configure_mesh()
            .light_line_style(WHITE)
            .bold_line_style(GRID)
            .x_label_formatter(&across)
            .y_label_formatter(&tick_between(0.0, high))
            .x_desc(panel.across.as_str())
            .y_desc(format!("probability density (per unit of {})", shortened(&panel.across, 20)))
            .label_style(self.text(13))
            .axis_desc_style(self.text(14))
            .draw()?;
        if !panel.histogram.is_empty() {
            let bars = panel.histogram.iter();
            let name = if panel.curves.is_empty() { "draws" } else { "data" };
            let is_inside = |middle: f64| {
                panel.curves.is_empty()
                    && panel.interval.is_some_and(|(from, to)| (from..=to).contains(&middle))
            };
            chart
                .draw_series(bars.map(|(from, to, height)| {
                    let plain = RGBColor(185, 200, 216).filled();
                    let inside = is_inside(0.5 * (from + to));
                    Rectangle::new(
                        [(*from, 0.0), (*to, *height)],
                        if inside { INSIDE.filled() } else { plain },
                    )
                }))?
                .label(name)
                .legend(move |at| key_box(at, unit, RGBColor(185, 200, 216).filled()));
        }
        let is_drawn = panel.curves.is_empty();
        if let Some((from, to)) = panel.interval {
            for (_, points) in &panel.curves {
                let inside = points.iter().filter(|(x, _)| (from..=to).contains(x)).copied();
                chart.draw_series(AreaSeries::new(inside, 0.0, COLOURS[0].mix(0.18)))?;
            }
            let ends =
                [from, to].map(|x| PathElement::new([(x, 0.0), (x, high)], COLOURS[0].stroke_width(unit)));
            chart.draw_series(ends)?.label(format!("90 %: {} to {}", across(&from), across(&to))).legend(
                move |at| {
                    key_box(at, unit, if is_drawn { INSIDE.filled() } else { COLOURS[0].mix(0.3).filled() })
                },
            );
        }
        for (number, (name, points)) in panel.curves.iter().enumerate() {
            let colour = COLOURS[number % COLOURS.len()];
            let drawn = points.iter().map(|(x, y)| (*x, y.min(high)));
            chart
                .draw_series(LineSeries::new(drawn, colour.stroke_width(2 * self.fine)))?
                .label(shortened(name, 40))
                .legend(move |at| key_line(at, unit, colour));
        }
        if let Some(mean) = panel.mean.filter(|mean| (left..=right).contains(mean)) {
            let line = PathElement::new([(mean, 0.0), (mean, high)], COLOURS[1].stroke_width(2 * self.fine));
            chart
                .draw_series([line])?
                .label(format!("mean {}", across(&mean)))
                .legend(move |at| key_line(at, unit, COLOURS[1]));
        }
        self.legend(&mut chart, SeriesLabelPosition::UpperRight)
    }

    fn course<B: DrawingBackend>(&self, area: &Area<'_, B>, panel: &Course) -> Drawn<B> {
        let unit = self.fine;
        let points = || panel.lines.iter().flat_map(|line| line.points.iter());
        let (left, right) = {
            let (low, high) = points()
                .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), (x, _)| (low.min(*x), high.max(*x)));
            if low < high { (low, high) } else { (low - 0.5, high + 0.5) }
        };
        let bands =
            panel.lines.iter().flat_map(|line| line.band.iter().flat_map(|(_, low, high)| [*low, *high]));
        let (low, high) = panel.range.unwrap_or_else(|| range(points().map(|(_, y)| *y).chain(bands), false));
        let mut chart = self.builder(area, &panel.title).build_cartesian_2d(left..right, low..high)?;
        chart
            .configure_mesh()
            .light_line_style(WHITE)
            .bold_line_style(GRID)
            .x_label_formatter(&at_whole)
            .y_label_formatter(&tick_between(low, high))
            .x_desc(panel.across.as_str())
            .y_desc(panel.upwards.as_str())
            .label_style(self.text(13))
            .axis_desc_style(self.text(14))
            .draw()?;
        for (number, line) in panel.lines.iter().enumerate() {
            let colour = COLOURS[number % COLOURS.len()];
            if !line.band.is_empty() {
                let upper = line.band.iter().map(|(x, _, high)| (*x, *high));
                let lower = line.band.iter().rev().map(|(x, low, _)| (*x, *low));
                chart.draw_series([Polygon::new(upper.chain(lower).collect::<Vec<_>>(), colour.mix(0.2))])?;
            }
            chart
                .draw_series(LineSeries::new(
                    line.points.iter().copied(),
                    colour.stroke_width(2 * self.fine),
                ))?
                .label(shortened(&line.name, 40))
                .legend(move |at| key_line(at, unit, colour));
            if line.points.len() <= 40 {
                let dot = |point: &(f64, f64)| Circle::new(*point, 3 * self.fine, colour.filled());
                chart.draw_series(line.points.iter().map(dot))?;
            }
        }
        // On the right, where there are fewer points.
        let last = || points().filter(|(x, _)| *x > left + 0.7 * (right - left));
        let upper = last().filter(|(_, y)| *y > 0.5 * (low + high)).count();
        let position = match 2 * upper > last().count() {
            true => SeriesLabelPosition::LowerRight,
            false => SeriesLabelPosition::UpperRight,
        };
        self.legend(&mut chart, position)
    }
}

/// The sign of a line in a legend.
pub(super) fn key_line((x, y): (i32, i32), unit: u32, colour: RGBColor) -> PathElement<(i32, i32)> {
    PathElement::new([(x, y), (x + 18 * unit as i32, y)], colour.stroke_width(2 * unit))
}

/// The sign of an area in a legend.
fn key_box((x, y): (i32, i32), unit: u32, style: ShapeStyle) -> Rectangle<(i32, i32)> {
    let half = 5 * unit as i32;
    Rectangle::new([(x + half, y - half), (x + 3 * half, y + half)], style)
}

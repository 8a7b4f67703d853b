//! Pictures of the gallery: heat maps and curves, side by side.
//!
//! In: numbers, and the names of the axes. Out: a PNG in `target/gallery`. Invariant: in a heat map the first
//! coordinate grows to the right and the second upwards; each panel has its own scale, from 0 or the least to the
//! largest.
#![allow(dead_code)] // each example draws one kind

use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::{FontStyle, register_font};
use std::error::Error;
use std::fs::File;
use std::path::{Path, PathBuf};

const INK: RGBColor = RGBColor(34, 40, 49);
const STOPS: [[f64; 3]; 5] =
    [[42., 14., 78.], [40., 88., 146.], [36., 156., 134.], [128., 202., 88.], [250., 232., 70.]];

/// Dark violet through teal to yellow.
fn colour(share: f64) -> RGBColor {
    let place = share.clamp(0.0, 1.0) * (STOPS.len() - 1) as f64;
    let stop = (place as usize).min(STOPS.len() - 2);
    let [red, green, blue] = [0, 1, 2].map(|channel| {
        let (from, to) = (STOPS[stop][channel], STOPS[stop + 1][channel]);
        (from + (to - from) * (place - stop as f64)) as u8
    });
    RGBColor(red, green, blue)
}

type Canvas<'c> = DrawingArea<BitMapBackend<'c>, Shift>;

/// Draws a picture of so many pixels, and writes it.
fn picture(
    name: &str,
    (width, height): (u32, u32),
    draw: impl FnOnce(&Canvas<'_>) -> Result<(), Box<dyn Error>>,
) -> Result<PathBuf, Box<dyn Error>> {
    let target = std::env::var_os("CARGO_TARGET_DIR").map_or_else(|| "target".into(), PathBuf::from);
    let folder = Path::new(&target).join("gallery");
    std::fs::create_dir_all(&folder)?;
    register_font("sans-serif", FontStyle::Normal, dejavu::sans::regular()).map_err(|_| "no font")?;
    let mut pixels = vec![255; 3 * width as usize * height as usize];
    {
        let all = BitMapBackend::with_buffer(&mut pixels, (width, height)).into_drawing_area();
        draw(&all)?;
        all.present()?;
    }
    let path = folder.join(format!("{name}.png"));
    let mut encoder = png::Encoder::new(File::create(&path)?, width, height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.write_header()?.write_image_data(&pixels)?;
    Ok(path)
}

/// One panel: its title, and a number for each [x][y].
pub(crate) type Panel<'p> = (&'p str, Vec<f64>);

/// Heat maps over the integers of two ranges, `across` and `upwards` with their names.
pub(crate) fn heat_maps(
    name: &str,
    panels: &[Panel<'_>],
    across: (&str, i32, i32),
    upwards: (&str, i32, i32),
) -> Result<PathBuf, Box<dyn Error>> {
    picture(name, (360 * panels.len() as u32, 380), |all| {
        let rows = (upwards.2 - upwards.1 + 1) as usize;
        for (area, (title, values)) in all.split_evenly((1, panels.len())).iter().zip(panels) {
            let mut chart = ChartBuilder::on(area)
                .caption(title, ("sans-serif", 17, &INK))
                .margin(10)
                .set_label_area_size(LabelAreaPosition::Left, 48)
                .set_label_area_size(LabelAreaPosition::Bottom, 40)
                .build_cartesian_2d(across.1..across.2 + 1, upwards.1..upwards.2 + 1)?;
            let (least, most) =
                values.iter().fold((0.0, f64::MIN), |(low, high): (f64, f64), v| (low.min(*v), high.max(*v)));
            let cells = values.iter().enumerate().map(|(place, value)| {
                let (x, y) = (across.1 + (place / rows) as i32, upwards.1 + (place % rows) as i32);
                Rectangle::new([(x, y), (x + 1, y + 1)], colour((value - least) / (most - least)).filled())
            });
            chart.draw_series(cells)?;
            let mut mesh = chart.configure_mesh();
            mesh.disable_mesh().x_desc(across.0).y_desc(upwards.0).label_style(("sans-serif", 13, &INK));
            mesh.x_labels(5).y_labels(5).axis_desc_style(("sans-serif", 15, &INK)).draw()?;
        }
        Ok(())
    })
}

/// Curves over one range, each in its panel, with a line at the true value, if it is known.
pub(crate) fn curves(
    name: &str,
    panels: &[Panel<'_>],
    across: (&str, f64, f64),
    upwards: &str,
    truth: Option<f64>,
) -> Result<PathBuf, Box<dyn Error>> {
    picture(name, (420 * panels.len() as u32, 320), |all| {
        for (area, (title, values)) in all.split_evenly((1, panels.len())).iter().zip(panels) {
            let most = values.iter().copied().fold(0.0, f64::max) * 1.08;
            let mut chart = ChartBuilder::on(area)
                .caption(title, ("sans-serif", 17, &INK))
                .margin(10)
                .set_label_area_size(LabelAreaPosition::Left, 62)
                .set_label_area_size(LabelAreaPosition::Bottom, 40)
                .build_cartesian_2d(across.1..across.2, 0.0..most)?;
            let step = (across.2 - across.1) / (values.len() - 1) as f64;
            let points =
                values.iter().enumerate().map(|(place, value)| (across.1 + step * place as f64, *value));
            chart
                .draw_series(AreaSeries::new(points, 0.0, colour(0.4).mix(0.3)).border_style(colour(0.25)))?;
            let level = truth.map(|level| vec![(across.1, level), (across.2, level)]);
            chart.draw_series(level.map(|ends| PathElement::new(ends, INK)))?;
            let mut mesh = chart.configure_mesh();
            mesh.disable_mesh().x_desc(across.0).y_desc(upwards).label_style(("sans-serif", 13, &INK));
            mesh.x_label_formatter(&|x| format!("{x:.0}"))
                .x_labels(7)
                .y_labels(5)
                .axis_desc_style(("sans-serif", 15, &INK))
                .draw()?;
        }
        Ok(())
    })
}

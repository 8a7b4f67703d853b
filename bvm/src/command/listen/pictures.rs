//! The pictures of `bvm listen`.
//!
//! In: looks, one after the other. Out: `panorama.png` (the posterior of the direction in the last look), `distance.png`
//! (of the distance), `course.png` (of the azimuth over all looks) and `correlogram.png` (of the whole recording).
//! Invariant: each has title, units and scale.

use bvm::audition::{Cues, Listening, centres_hz};
use bvm::error::Error;
use bvm::report::{Bars, Heat, bars, heat};
use std::path::{Path, PathBuf};

/// Rows and columns of the panorama, two degrees each.
const PANORAMA: [usize; 2] = [90, 180];
/// Rows of the course: six degrees of azimuth each.
const AZIMUTHS: usize = 60;
/// Angles that are written at axes, degrees.
const CIRCLE_DEG: [f64; 9] = [180.0, 135.0, 90.0, 45.0, 0.0, -45.0, -90.0, -135.0, -180.0];
const HEIGHTS_DEG: [f64; 5] = [-90.0, -45.0, 0.0, 45.0, 90.0];

/// What is drawn at the end.
#[derive(Default)]
pub(super) struct Pictures {
    end_s: f64,
    panorama: Vec<f64>,
    of_distance: Vec<f64>,
    /// For each look the probability of each row of azimuths, from the right to the left.
    course: Vec<Vec<f64>>,
    cues: Option<Cues>,
    last_s: [f64; 2],
}

impl Pictures {
    /// A part of the recording.
    pub(super) fn hear(&mut self, cues: &Cues) {
        match &mut self.cues {
            Some(all) => all.add(cues),
            None => self.cues = Some(cues.clone()),
        }
    }

    /// A look; `listening` has its posterior, unless it is flat.
    pub(super) fn look(&mut self, [start_s, end_s]: [f64; 2], listening: Option<&Listening>) {
        let [rows, columns] = PANORAMA;
        (self.end_s, self.last_s) = (end_s, [start_s, end_s]);
        (self.panorama, self.of_distance) = match listening {
            Some(listening) => listening.pictured(PANORAMA),
            None => (vec![0.0; rows * columns], Vec::new()),
        };
        let mut azimuths = vec![0.0; AZIMUTHS];
        for (row, values) in self.panorama.chunks(columns).enumerate() {
            let elevation = ((row as f64 + 0.5) * 180.0 / rows as f64 - 90.0).to_radians();
            let square = elevation.cos() * (180.0 / rows as f64) * (360.0 / columns as f64);
            for (column, value) in values.iter().enumerate() {
                azimuths[AZIMUTHS - 1 - column * AZIMUTHS / columns] += value * square;
            }
        }
        self.course.push(azimuths);
    }

    /// Writes the pictures into a folder.
    pub(super) fn write(&self, folder: &Path, distances_m: &[f64]) -> Result<Vec<PathBuf>, Error> {
        std::fs::create_dir_all(folder)
            .map_err(|source| Error::Folder { path: folder.to_owned(), source })?;
        let [start_s, end_s] = self.last_s;
        let look = format!("{start_s:.2} to {end_s:.2} s");
        let panorama = heat(&Heat {
            title: &format!("Posterior of the direction of the sound, {look}"),
            names: ["azimuth in degrees (positive to the left)", "elevation in degrees"],
            across: [180.0, -180.0],
            upwards: [-90.0, 90.0],
            columns: PANORAMA[1],
            values: &self.panorama,
            quantity: "probability per square degree",
            ticks: [&CIRCLE_DEG, &HEIGHTS_DEG],
        })?;
        let columns = self.course.len().max(1);
        let by_rows: Vec<f64> = (0..AZIMUTHS)
            .flat_map(|row| self.course.iter().map(move |look| look.get(row).copied().unwrap_or(0.0)))
            .collect();
        let course = heat(&Heat {
            title: "Posterior of the azimuth of the sound over time",
            names: ["time in s", "azimuth in degrees (positive to the left)"],
            across: [0.0, self.end_s.max(1e-9)],
            upwards: [-180.0, 180.0],
            columns,
            values: &by_rows,
            quantity: "probability per 6 degrees",
            ticks: [&[], &CIRCLE_DEG],
        })?;
        let mut written = Vec::new();
        let mut write = |name: &str, picture: bvm::report::Picture| -> Result<(), Error> {
            let path = folder.join(name);
            picture.write(&path)?;
            written.push(path);
            Ok(())
        };
        write("panorama.png", panorama)?;
        write("course.png", course)?;
        if !self.of_distance.is_empty() {
            let names: Vec<String> = distances_m.iter().map(|distance| format!("{distance} m")).collect();
            let groups: Vec<&str> = names.iter().map(String::as_str).collect();
            let series = [Bars { name: look, values: self.of_distance.clone() }];
            write(
                "distance.png",
                bars("Posterior of the distance of the sound", "probability", &groups, &series),
            )?;
        }
        if let Some(cues) = &self.cues {
            let (bands, longest_s) = cues.correlogram();
            let lags = bands.iter().map(Vec::len).max().unwrap_or(0);
            if lags > 0 {
                let values: Vec<f64> = (bands.iter())
                    .flat_map(|band| (0..lags).map(|lag| band.get(lag).copied().unwrap_or(f64::NAN)))
                    .collect();
                let centres = centres_hz();
                let title = format!(
                    "Correlogram: {} bands from {:.0} Hz to {:.0} kHz, equally spaced by ERB",
                    centres.len(),
                    centres[0],
                    1e-3 * centres[centres.len() - 1]
                );
                let edge = 1e3 * longest_s;
                write(
                    "correlogram.png",
                    heat(&Heat {
                        title: &title,
                        names: ["time difference in ms (positive: the left ear leads)", "band"],
                        across: [-edge, edge],
                        upwards: [0.5, bands.len() as f64 + 0.5],
                        columns: lags,
                        values: &values,
                        quantity: "mean normalised cross-correlation",
                        ticks: [&[], &[]],
                    })?,
                )?;
            }
        }
        Ok(written)
    }
}

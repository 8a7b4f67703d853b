//! The account of a run: what each sense gave, what failed, what moves, what cannot be seen.
//!
//! In: the looks of a run, its map. Out: [`Account`], a part of `run.json`, and lines of text. Invariant: a fault that a
//! sense reported is in it.

use super::tracks::Track;
use super::{Ended, Look, Unseeable};
use serde::Serialize;

/// The account.
#[derive(Clone, Debug, Serialize)]
pub struct Account {
    /// The scene.
    pub scene: String,
    /// Its description.
    pub title: String,
    /// The senses.
    pub senses: Vec<String>,
    /// Why the run ended.
    pub ended: Ended,
    /// Looks that were made before it was resumed; 0 for a run in one piece.
    pub resumed_after: usize,
    /// What failed: look, sense, reason.
    pub faults: Vec<Failure>,
    /// What moves, at the end.
    pub tracks: Vec<Track>,
    /// What cannot be seen from here.
    pub unseeable: Unseeable,
    /// What was heard: the bearing of each look that had one.
    pub heard: Vec<Heard>,
    /// Of each sense: readings, information and time, summed over the looks.
    pub totals: Vec<Total>,
    /// Mean times of a look, ms.
    pub mean_ms: MeanTimes,
    /// All looks.
    pub looks: Vec<Look>,
}

/// A failure of a sense.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Failure {
    /// The look, from 1.
    pub look: usize,
    /// The sense.
    pub sense: String,
    /// The reason.
    pub reason: String,
}

/// A bearing at a look.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Heard {
    /// The look, from 1.
    pub look: usize,
    /// The most probable source.
    #[serde(flatten)]
    pub bearing: super::Bearing,
}

/// The sums of a sense.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Total {
    /// The sense.
    pub sense: String,
    /// Looks at which it gave something.
    pub looks: usize,
    /// Readings.
    pub readings: usize,
    /// Σ KL, nats.
    pub information: f64,
}

/// Mean times of a look, ms.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MeanTimes {
    /// Of each sense, by name.
    pub senses: Vec<(String, f64)>,
    /// Prediction and estimation of the map.
    pub estimate: f64,
    /// The choice of the gaze.
    pub gaze: f64,
    /// The simulation of the turn.
    pub turn: f64,
}

/// Every failure of some looks.
pub fn failures(looks: &[Look]) -> Vec<Failure> {
    let of = |look: &Look| {
        let number = look.number;
        let failed = look.senses.iter().filter_map(move |one| {
            let (sense, reason) = (one.sense.clone(), one.fault.clone()?);
            Some(Failure { look: number, sense, reason })
        });
        failed.collect::<Vec<_>>()
    };
    looks.iter().flat_map(of).collect()
}

/// The most probable bearing of each look that has one.
pub fn heard(looks: &[Look]) -> Vec<Heard> {
    let of = |look: &Look| {
        let first = look.senses.iter().flat_map(|one| &one.found).next()?;
        Some(Heard { look: look.number, bearing: *first })
    };
    looks.iter().filter_map(of).collect()
}

/// The sums of each sense.
pub fn totals(looks: &[Look]) -> Vec<Total> {
    let Some(first) = looks.first() else { return Vec::new() };
    let total = |(at, name): (usize, String)| {
        let own = || looks.iter().filter_map(move |look| look.senses.get(at));
        Total {
            sense: name,
            looks: own().filter(|one| one.readings > 0 && one.fault.is_none()).count(),
            readings: own().map(|one| one.readings).sum(),
            information: own().map(|one| one.information).sum(),
        }
    };
    first.senses.iter().map(|one| one.sense.clone()).enumerate().map(total).collect()
}

/// Mean times.
pub fn mean_ms(looks: &[Look]) -> MeanTimes {
    let mean = |of: &dyn Fn(&Look) -> f64| looks.iter().map(of).sum::<f64>() / looks.len().max(1) as f64;
    let names = looks.first().map_or(Vec::new(), |look| look.senses.clone());
    let sense =
        |(at, name): (usize, String)| (name, mean(&|look| look.senses.get(at).map_or(0.0, |one| one.ms)));
    MeanTimes {
        senses: names.into_iter().map(|one| one.sense).enumerate().map(sense).collect(),
        estimate: mean(&|look| look.stages_ms.estimate),
        gaze: mean(&|look| look.stages_ms.gaze),
        turn: mean(&|look| look.stages_ms.turn),
    }
}

impl Account {
    /// A few lines, under 80 columns.
    pub fn text(&self) -> String {
        let mut text = format!("scene         {}: {}\n", self.scene, self.title);
        let ended = match self.ended {
            Ended::Steps => String::from("all looks were made"),
            Ended::NothingLeft => String::from("nothing is left to see"),
            Ended::Interrupted => String::from("interrupted; `--resume` goes on"),
        };
        text += &format!("looks         {}: {ended}\n", self.looks.len());
        for Total { sense, looks, readings, information } in &self.totals {
            text += &format!("{sense:<14}{readings} readings at {looks} looks");
            text +=
                &if *information > 0.0 { format!(", {information:.0} nats\n") } else { String::from("\n") };
        }
        if let Some(Heard { look, bearing }) = self.heard.last() {
            text += &format!(
                "heard last    azimuth {:.0}°, elevation {:.0}°, {:.1} m (P = {:.2}, look {look})\n",
                bearing.azimuth_deg, bearing.elevation_deg, bearing.distance_m, bearing.probability
            );
        }
        for track in &self.tracks {
            text += &format!("moves         {}\n", track.text());
        }
        for Failure { look, sense, reason } in self.faults.iter().take(5) {
            text += &format!("fault         look {look}, {sense}: {reason}\n");
        }
        if self.faults.len() > 5 {
            text += &format!("fault         and {} more: see run.json\n", self.faults.len() - 5);
        }
        let Unseeable { beyond_the_neck, without_reading, hidden_cells, cells } = self.unseeable;
        text + &format!(
            "not seen      {:.1} % of the sphere beyond the neck, {:.1} % without a reading,\n              {:.0} % of the cells behind surfaces",
            100.0 * beyond_the_neck,
            100.0 * without_reading,
            100.0 * hidden_cells as f64 / cells as f64
        )
    }
}

//! The active head: the loop of Fig. 8, once, whatever feeds it.
//!
//! In: [`Sense`]s, a [`Neck`], and a [`Policy`]. Out: for each [`Head::look`] a [`Look`], and the map. Invariant: every look
//! has the same order: sense, predict and estimate, choose, turn, feel the turn. What a sense does not give is not used,
//! and is reported.
//!
//! ```text
//!  world, pictures, sounds, samples ──▶ senses ──▶ likelihoods ──▶ map ──▶ policy ──▶ gaze ──▶ neck ─┐
//!            ▲                             ▲                                                          │
//!            │                         attitude ◀── balance ◀─────────── inertial samples ────────────┤
//!            └────────────────────────────────────────────────────────────────────────────────────────┘
//! ```

pub mod account;
pub mod checkpoint;
mod coverage;
pub mod depth;
mod frames;
mod look;
mod policy;
pub mod real;
mod run;
mod sense;
mod stage;
pub mod tracks;

pub use account::Account;
pub use coverage::{Coverage, Unseeable};
pub use frames::{Attitude, Extrinsics, Transform};
pub use look::{Contribution, Look, Stages};
pub use policy::{Gaze, Policy};
pub use run::{Ended, run};
pub use sense::{Bearing, Evidence, Sense, Sensed, View};
pub use stage::{Neck, Shared, Stage, Turned};

use crate::error::Error;
use crate::frame::wrap_angle;
use crate::map::Map;
use std::time::Instant;

/// A head.
pub struct Head {
    map: Map,
    senses: Vec<Box<dyn Sense>>,
    balance: Box<dyn Sense>,
    neck: Box<dyn Neck>,
    attitude: Attitude,
    gaze: Gaze,
    looks: usize,
    coverage: Coverage,
    /// Time of the last look, s.
    looked_s: Option<f64>,
}

impl Head {
    /// A head that looks ahead, with an empty map. `balance` gives the attitude, the other senses likelihoods of cells.
    pub fn new(map: Map, senses: Vec<Box<dyn Sense>>, balance: Box<dyn Sense>, neck: Box<dyn Neck>) -> Self {
        let coverage = Coverage::of(map.grid(), neck.as_ref());
        let (attitude, gaze) = (Attitude::default(), Gaze::at(0.0, 0.0));
        Self { map, senses, balance, neck, attitude, gaze, looks: 0, coverage, looked_s: None }
    }

    /// One look.
    ///
    /// # Errors
    /// Those of the senses, the map and the policy. Wrong data of a sense are no errors: see [`Contribution::fault`].
    pub fn look(&mut self, policy: &mut dyn Policy) -> Result<Look, Error> {
        let time_s = self.time_passes()?;
        let truth = self.neck.truth();
        let mut contributions = Vec::new();
        let mut likelihoods = Vec::new();
        for sense in &mut self.senses {
            let begun = Instant::now();
            let sensed = sense.likelihood(&self.map, &self.attitude)?;
            let ms = (milliseconds(begun) - sensed.simulated_ms).max(0.0);
            self.coverage.add(&sensed.view);
            let likelihood = match sensed.evidence {
                Evidence::Cells(likelihood) => Some(likelihood),
                Evidence::Nothing | Evidence::Attitude(_) => None,
            };
            let information =
                likelihood.as_ref().map_or(0.0, |own| look::information(self.map.occupancy(), own));
            contributions.push(Contribution {
                sense: sense.name().to_owned(),
                readings: sensed.readings,
                information,
                fault: sensed.fault,
                found: sensed.found,
                ms,
                simulated_ms: sensed.simulated_ms,
            });
            if let Some(likelihood) = &likelihood {
                policy.sensed(sense.name(), likelihood);
            }
            likelihoods.extend(likelihood);
        }
        let begun = Instant::now();
        self.map.observe(&likelihoods.iter().collect::<Vec<_>>())?;
        let estimate_ms = milliseconds(begun);
        self.looks += 1;
        let begun = Instant::now();
        let heading = self.attitude.heading();
        policy.covered(&self.coverage);
        let chosen = policy.choose(&self.map, &heading)?;
        let gaze_ms = milliseconds(begun);
        let (attitude, gaze) = (self.attitude, Gaze { azimuth: wrap_angle(self.gaze.azimuth), ..self.gaze });
        let (turned, turn_ms, felt) = self.turn(chosen)?;
        policy.turned(&turned.gaze);
        contributions.push(felt);
        Ok(Look {
            number: self.looks,
            time_s,
            gaze,
            attitude,
            truth,
            senses: contributions,
            entropy: look::sum(self.map.entropy()),
            occupancy_entropy: look::sum(self.map.occupancy_entropy()),
            open_directions: self.coverage.open(&self.map),
            next: turned.gaze,
            turn_s: turned.seconds,
            travel_rad: turned.travel_rad,
            stages_ms: Stages { estimate: estimate_ms, gaze: gaze_ms, turn: turn_ms },
        })
    }

    /// The time of a look that begins now; the map knows how long ago the last one was.
    fn time_passes(&mut self) -> Result<f64, Error> {
        let time_s = self.neck.time_s();
        if let Some(before) = self.looked_s.replace(time_s) {
            self.map.after(time_s - before)?;
        }
        Ok(time_s)
    }

    /// Turns the head, and balance feels it.
    fn turn(&mut self, gaze: Gaze) -> Result<(Turned, f64, Contribution), Error> {
        let attitude = self.attitude;
        let begun = Instant::now();
        let turned = self.neck.turn(gaze, &attitude)?;
        let turn_ms = milliseconds(begun);
        let begun = Instant::now();
        let felt = self.balance.likelihood(&self.map, &attitude)?;
        if let Evidence::Attitude(felt) = felt.evidence {
            self.attitude = felt;
        }
        self.gaze = turned.gaze;
        let felt = Contribution {
            sense: self.balance.name().to_owned(),
            readings: felt.readings,
            information: 0.0,
            fault: felt.fault,
            found: Vec::new(),
            ms: milliseconds(begun),
            simulated_ms: 0.0,
        };
        Ok((turned, turn_ms, felt))
    }

    /// Repeats a look of an earlier run without the map: the senses pass over what they read then, the policy counts the
    /// look, the head turns as it did, and balance feels it. Afterwards [`Head::restore`] gives the map back.
    ///
    /// # Errors
    /// Those of the senses and the policy.
    pub fn repeat(&mut self, look: &Look, policy: &mut dyn Policy) -> Result<(), Error> {
        self.time_passes()?;
        for sense in &mut self.senses {
            sense.skip(&self.attitude)?;
        }
        self.looks += 1;
        policy.choose(&self.map, &self.attitude.heading())?;
        let (turned, ..) = self.turn(look.next)?;
        policy.turned(&turned.gaze);
        Ok(())
    }

    /// Replaces the map, what was in view and what the senses remember by those of an earlier run.
    pub fn restore(&mut self, map: Map, coverage: Coverage, memories: &[Vec<f32>]) {
        (self.map, self.coverage) = (map, coverage);
        self.senses.iter_mut().zip(memories).for_each(|(sense, memory)| sense.remember(memory));
    }

    /// What the senses remember.
    pub fn memories(&self) -> Vec<Vec<f32>> {
        self.senses.iter().map(|sense| sense.memory()).collect()
    }

    /// The map.
    pub fn map(&self) -> &Map {
        &self.map
    }

    /// The map, given away.
    pub fn into_map(self) -> Map {
        self.map
    }

    /// The estimated attitude of the head.
    pub fn attitude(&self) -> Attitude {
        self.attitude
    }

    /// What was in view, and what is left.
    pub fn coverage(&self) -> &Coverage {
        &self.coverage
    }

    /// Time of the world, s.
    pub fn time_s(&self) -> f64 {
        self.neck.time_s()
    }
}

fn milliseconds(since: Instant) -> f64 {
    since.elapsed().as_secs_f64() * 1e3
}

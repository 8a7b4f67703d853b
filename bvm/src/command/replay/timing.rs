//! The clocks of a replay: frames, inertial readings and places have their own rates and stamps.
//!
//! In: the stamp of each frame. Out: what the map does before it, and counts of what was late or missing. Invariant: the map's
//! instants follow the stamps; a frame without a recent inertial reading keeps the last orientation, and one without a place
//! keeps the last place; each is counted.

use bvm::error::Error;
use bvm::grid::Grid;
use bvm::map::clock::{Clock, Due};
use bvm::map::translation::Travel;
use bvm::recording::{Poses, Posture, Recording};
use nalgebra::{Matrix3, Rotation3, Vector3};
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::Path;

/// The clocks.
pub(super) struct Timing {
    clock: Clock,
    places: Option<Places>,
    counts: Counts,
}

/// Where the body was.
struct Places {
    poses: Poses,
    /// From the axes of the body at the first frame to those of the map.
    to_map: Matrix3<f64>,
    last: Option<[f64; 3]>,
    travel: Travel,
    /// How far the map has followed, m.
    followed: Vector3<f64>,
}

/// What the map does before a frame is fused.
pub(super) struct Now {
    /// Instants to predict, that of the frame included.
    pub(super) instants: i64,
    /// Age of the last inertial reading, s.
    pub(super) age: f64,
    /// A move that the map follows, m.
    pub(super) moved: Option<[f64; 3]>,
    /// The place of the map, m; none without a place of the body.
    pub(super) place: Option<[f64; 3]>,
}

/// What was late or missing.
#[derive(Clone, Default, Serialize)]
pub(super) struct Counts {
    /// The map's period: the usual time between frames.
    period_ms: f64,
    /// Instants without a frame: the map predicts them.
    missing_frames: i64,
    /// Frames of an instant that another frame had: not used.
    surplus_frames: u64,
    /// Pictures of the left camera without one of the right: not used.
    unpaired_frames: usize,
    /// Frames without a recent inertial reading: the orientation is held, its deviation grows.
    frames_without_orientation: u64,
    /// Inertial rows with each event.
    inertial_events: BTreeMap<&'static str, u64>,
    /// Frames without a place: the map stays; none where no places are given.
    frames_without_place: Option<u64>,
}

impl Timing {
    /// Before the first frame; the posture is that at the first frame.
    ///
    /// # Errors
    /// A file of poses that cannot be used.
    pub(super) fn of(recording: &Recording, poses: Option<&Path>, posture: &Posture) -> Result<Self, Error> {
        let frames = recording.frames.iter().map(|frame| frame.0);
        let period = Clock::period_of(frames).unwrap_or(1);
        let read = |path| -> Result<Places, Error> {
            Ok(Places {
                poses: Poses::read(path, recording.frames[0].0)?,
                to_map: posture.to_map(&Rotation3::identity()),
                last: None,
                travel: Travel::default(),
                followed: Vector3::zeros(),
            })
        };
        let counts = Counts {
            period_ms: period as f64 * 1e-6,
            unpaired_frames: recording.unpaired,
            frames_without_place: poses.map(|_| 0),
            ..Counts::default()
        };
        Ok(Self { clock: Clock::new(period), places: poses.map(read).transpose()?, counts })
    }

    /// A frame of this stamp, ns: turns the posture on to it; `None`: the frame is not used.
    pub(super) fn frame(&mut self, time: i64, posture: &mut Posture, grid: &Grid) -> Option<Now> {
        let Due::After(instants) = self.clock.tick(time) else {
            self.counts.surplus_frames += 1;
            return None;
        };
        self.counts.missing_frames += instants - 1;
        let age = posture.turn_to(time);
        self.counts.frames_without_orientation += u64::from(Posture::is_late(age));
        let found = self.places.as_mut().map(|places| places.go(time, grid));
        if let Some((count, None)) = self.counts.frames_without_place.as_mut().zip(found.map(|it| it.1)) {
            *count += 1;
        }
        let (moved, place) = found.unwrap_or_default();
        Some(Now { instants, age, moved, place })
    }

    /// What was late or missing.
    pub(super) fn counts(&self, posture: &Posture) -> Counts {
        Counts { inertial_events: posture.events().clone(), ..self.counts.clone() }
    }
}

impl Places {
    /// The move to follow at a time, and the place of the map then, if the body has one.
    fn go(&mut self, time: i64, grid: &Grid) -> (Option<[f64; 3]>, Option<[f64; 3]>) {
        let Some(place) = self.poses.at(time) else { return (None, None) };
        let last = self.last.replace(place).unwrap_or(place);
        let step = self.to_map * (Vector3::from(place) - Vector3::from(last));
        let moved = self.travel.go(grid, step.into());
        self.followed += moved.map_or(Vector3::zeros(), Vector3::from);
        (moved, Some(self.followed.into()))
    }
}

impl Counts {
    /// For people.
    pub(super) fn lines(&self) -> Vec<String> {
        let mut lines = vec![format!(
            "clock     {:.1} ms an instant; frames missing: {}, surplus: {}, without partner: {}",
            self.period_ms, self.missing_frames, self.surplus_frames, self.unpaired_frames
        )];
        let events: Vec<String> =
            self.inertial_events.iter().map(|(name, count)| format!("{name}: {count} rows")).collect();
        let events = if events.is_empty() { "complete".to_owned() } else { events.join(", ") };
        lines.push(format!(
            "inertial  {events}; frames without a recent reading: {}",
            self.frames_without_orientation
        ));
        if let Some(count) = self.frames_without_place {
            lines.push(format!("places    frames without one: {count}"));
        }
        lines
    }
}

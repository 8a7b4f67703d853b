//! Scenes: worlds described in files.
//!
//! In: the name of a built-in scene, or a TOML file (`bvm/scenes/*.toml` are examples of every key; docs/head.md lists
//! them). Out: a [`Scene`], and for each random seed its [`World`]. Invariant: a scene that was read is possible: nothing
//! touches the head, sources and paths are inside the room, and every number is finite; a mistake is refused with its
//! line and column.

mod check;
mod file;
mod parts;
mod robot;
#[cfg(test)]
mod tests;

pub use parts::{Cameras, Fault, FaultKind, Imu, Jitter, Neck, Organ};

use super::{Motion, World, seeded};
use crate::error::Error;
use crate::input;
use rand::RngExt;
use std::path::{Path, PathBuf};

/// The scene that is not a file: the room of [`World::embedded`], whose walls differ from seed to seed too.
pub const DEFAULT: &str = "furnished";

/// The built-in scene files.
const BUILT_IN: [(&str, &str); 11] = [
    ("empty", include_str!("../../../scenes/empty.toml")),
    ("office", include_str!("../../../scenes/office.toml")),
    ("corridor", include_str!("../../../scenes/corridor.toml")),
    ("speaker_behind", include_str!("../../../scenes/speaker_behind.toml")),
    ("two_speakers", include_str!("../../../scenes/two_speakers.toml")),
    ("passer_by", include_str!("../../../scenes/passer_by.toml")),
    ("door", include_str!("../../../scenes/door.toml")),
    ("hands", include_str!("../../../scenes/hands.toml")),
    ("glass_and_black", include_str!("../../../scenes/glass_and_black.toml")),
    ("fog", include_str!("../../../scenes/fog.toml")),
    ("box", include_str!("../../../scenes/box.toml")),
];

/// A mistake in a scene file.
#[derive(Debug, thiserror::Error)]
#[error("`{}` line {line}, column {column}: {reason}", path.display())]
pub struct SceneError {
    /// The file.
    pub path: PathBuf,
    /// Its line, from 1.
    pub line: usize,
    /// The column in characters, from 1.
    pub column: usize,
    /// What was found and what was expected.
    pub reason: String,
}

/// A scene.
#[derive(Clone, Debug, PartialEq)]
pub struct Scene {
    /// Its name.
    pub name: String,
    /// One sentence.
    pub title: String,
    /// The world before the seed moves anything; `None`: [`World::embedded`].
    world: Option<World>,
    /// What the seed changes.
    jitter: Jitter,
    /// The pair of cameras.
    pub cameras: Cameras,
    /// The neck.
    pub neck: Neck,
    /// The inertial sensor.
    pub imu: Imu,
    /// What fails, and when.
    pub faults: Vec<Fault>,
}

impl Scene {
    /// The names of the built-in scenes, the default first.
    pub fn names() -> impl Iterator<Item = &'static str> {
        std::iter::once(DEFAULT).chain(BUILT_IN.iter().map(|(name, _)| *name))
    }

    /// The default scene.
    pub fn furnished() -> Scene {
        Scene {
            name: DEFAULT.to_owned(),
            title: String::from("A furnished room with a person who walks and a loudspeaker"),
            world: None,
            jitter: Jitter::default(),
            cameras: Cameras::default(),
            neck: Neck::default(),
            imu: Imu::default(),
            faults: Vec::new(),
        }
    }

    /// A built-in scene by its name, or a scene file by its path.
    ///
    /// # Errors
    /// A name that is neither; a file that cannot be read or has a mistake.
    pub fn find(name_or_path: &str) -> Result<Scene, Error> {
        if name_or_path == DEFAULT {
            return Ok(Scene::furnished());
        }
        if let Some((name, text)) = BUILT_IN.iter().find(|(name, _)| *name == name_or_path) {
            return Ok(Scene::parse(text, Path::new(&format!("{name}.toml")))?);
        }
        let path = Path::new(name_or_path);
        let is_file = path.extension().is_some() || path.components().count() > 1 || path.exists();
        if !is_file {
            let names: Vec<&str> = Scene::names().collect();
            return Err(Error::Scene(format!(
                "there is no scene `{name_or_path}`: expected {}, or the path of a scene file",
                names.join(", ")
            )));
        }
        Ok(Scene::parse(&input::text(path, input::MOST_OF_CALIBRATION)?, path)?)
    }

    /// The scene of a text; `path` gives its name, and is named in errors.
    ///
    /// # Errors
    /// The first mistake, with its line and column.
    pub fn parse(text: &str, path: &Path) -> Result<Scene, SceneError> {
        check::scene(text, path)
    }

    /// The world of a seed: furniture displaced by up to its `jitter_m`, and walkers somewhere on their way.
    pub fn world(&self, seed: u64) -> World {
        let Some(mut world) = self.world.clone() else { return World::embedded(seed) };
        let mut random = seeded(seed, "scene");
        for (thing, reach) in world.things.iter_mut().zip(&self.jitter.things) {
            let [x, y] = reach.map(|reach| reach * random.random_range(-1.0..=1.0));
            thing.shape = thing.shape.moved(x, y);
        }
        for (body, is_free) in world.bodies.iter_mut().zip(&self.jitter.phases) {
            let phase = random.random_range(0.0..1.0);
            if let (Motion::Walk { phase: own, .. }, true) = (&mut body.motion, is_free) {
                *own = phase;
            }
        }
        world
    }
}

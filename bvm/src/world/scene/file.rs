//! The keys of a scene file, as written.
//!
//! In: TOML. Out: values with their places in the text. Invariant: an unknown key is refused.

use serde::Deserialize;
use toml::Spanned;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct SceneFile {
    pub(super) title: String,
    pub(super) room: Room,
    #[serde(default)]
    pub(super) things: Vec<Spanned<Solid>>,
    #[serde(default)]
    pub(super) bodies: Vec<Spanned<Solid>>,
    #[serde(default)]
    pub(super) sounds: Vec<Spanned<SoundFile>>,
    #[serde(default)]
    pub(super) fog: Vec<FogFile>,
    #[serde(default)]
    pub(super) cameras: CamerasFile,
    #[serde(default)]
    pub(super) neck: NeckFile,
    #[serde(default)]
    pub(super) imu: ImuFile,
    #[serde(default)]
    pub(super) faults: Vec<FaultFile>,
}

type Point = Spanned<[f64; 3]>;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Room {
    pub(super) min: Point,
    pub(super) max: Point,
    pub(super) surface: Option<Spanned<SurfaceFile>>,
}

#[derive(Deserialize)]
#[serde(untagged, expecting = "expected the name of a surface, or { albedo, contrast, transparent }")]
pub(super) enum SurfaceFile {
    Name(String),
    Numbers(SurfaceNumbers),
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct SurfaceNumbers {
    pub(super) albedo: f64,
    pub(super) contrast: f64,
    #[serde(default)]
    pub(super) transparent: bool,
}

/// A thing, or a body.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Solid {
    pub(super) name: Spanned<String>,
    pub(super) block: Option<Spanned<Block>>,
    pub(super) ball: Option<Spanned<Ball>>,
    pub(super) cylinder: Option<Spanned<Cylinder>>,
    pub(super) surface: Option<Spanned<SurfaceFile>>,
    pub(super) jitter_m: Option<Spanned<[f64; 2]>>,
    pub(super) walk: Option<Walk>,
    pub(super) path: Option<Spanned<Vec<[f64; 3]>>>,
    pub(super) swing: Option<Swing>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Block {
    pub(super) min: [f64; 3],
    pub(super) max: [f64; 3],
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Ball {
    pub(super) centre: [f64; 3],
    pub(super) radius: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Cylinder {
    #[serde(default)]
    pub(super) axis: [f64; 2],
    pub(super) radius: f64,
    pub(super) height: [f64; 2],
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Walk {
    pub(super) ends: Spanned<[[f64; 2]; 2]>,
    pub(super) period_s: Spanned<f64>,
    pub(super) phase: Option<Spanned<f64>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Swing {
    pub(super) hinge: Spanned<[f64; 2]>,
    pub(super) degrees: Spanned<[f64; 2]>,
    pub(super) start_s: Spanned<f64>,
    pub(super) takes_s: Spanned<f64>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct SoundFile {
    pub(super) name: Spanned<String>,
    pub(super) at: Option<Point>,
    pub(super) carried_by: Option<Spanned<String>>,
    pub(super) height: Option<Spanned<f64>>,
    pub(super) plays: Spanned<String>,
    pub(super) level_db: Option<Spanned<f64>>,
    pub(super) from_s: Option<Spanned<f64>>,
    pub(super) until_s: Option<Spanned<f64>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct FogFile {
    pub(super) min: Point,
    pub(super) max: Point,
    pub(super) visibility_m: Spanned<f64>,
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct CamerasFile {
    pub(super) size_px: Option<Spanned<[usize; 2]>>,
    pub(super) field_degrees: Option<Spanned<f64>>,
    pub(super) baseline_m: Option<Spanned<f64>>,
    pub(super) ahead_m: Option<Spanned<f64>>,
    pub(super) noise: Option<Spanned<f64>>,
    pub(super) gain: Option<Spanned<f64>>,
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct NeckFile {
    pub(super) yaw_degrees: Option<Spanned<[f64; 2]>>,
    pub(super) pitch_degrees: Option<Spanned<[f64; 2]>>,
    pub(super) speed_degrees_s: Option<Spanned<f64>>,
    pub(super) acceleration_degrees_s2: Option<Spanned<f64>>,
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ImuFile {
    pub(super) rate_hz: Option<Spanned<f64>>,
    pub(super) gyroscope_bias: Option<Spanned<[f64; 3]>>,
    pub(super) accelerometer_bias: Option<Spanned<[f64; 3]>>,
    pub(super) gyroscope_sigma: Option<Spanned<f64>>,
    pub(super) accelerometer_sigma: Option<Spanned<f64>>,
    pub(super) lag_s: Option<Spanned<f64>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct FaultFile {
    pub(super) organ: Spanned<String>,
    pub(super) kind: Option<Spanned<String>>,
    pub(super) looks: Spanned<[usize; 2]>,
}

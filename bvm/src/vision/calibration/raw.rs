//! Raw cameras: removal of distortion, and rectification of a pair.
//!
//! In: two EuRoC `sensor.yaml` files (pinhole, radial–tangential) or the folder that holds them. Out: a [`RawPair`],
//! which converts pictures to those of two ideal parallel cameras, and their [`Calibration`].
//!
//! ```text
//! x = X/Z, y = Y/Z, r² = x² + y²                  (Brown 1966; the order k1 k2 p1 p2 k3 k4 k5 k6)
//! x' = x q + 2 p1 x y + p2 (r² + 2 x²)                                  u = fu x' + cu
//! y' = y q + p1 (r² + 2 y²) + 2 p2 x y                                  v = fv y' + cv
//! q  = (1 + k1 r² + k2 r⁴ + k3 r⁶) / (1 + k4 r² + k5 r⁴ + k6 r⁶)
//! ```
//!
//! EuRoC has four coefficients; a fifth is k3, and eight include k4 k5 k6, in the order of OpenCV.
//!
//! The two ideal cameras have the same orientation: X along the baseline; Z perpendicular to the baseline, as near as
//! possible to the mean of the two optical axes (Fusiello, Trucco and Verri 2000). Each ideal pixel is interpolated
//! bilinearly at the point where the real camera saw its ray; the points are computed with the first picture of a camera.
//! Invariant: ideal pixels that the real camera did not see are marked.

use super::lookup::Lookup;
use super::{Calibration, checked};
use crate::input;
use crate::vision::{GreyImage, VisionError};
use nalgebra::{Matrix3, Matrix4, Rotation3, Vector3};
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

/// Number of disparities to search, since no file gives a bound.
pub const RAW_DISPARITIES: usize = 96;

/// The key of the distortion coefficients, and the supported numbers of coefficients.
const DISTORTION: &str = "distortion_coefficients";
const COUNTS: &str = "4 (k1 k2 p1 p2), 5 (and k3) or 8 (and k4 k5 k6)";

/// A camera as its file describes it.
#[derive(Clone, Debug)]
struct Camera {
    path: PathBuf,
    width: usize,
    height: usize,
    /// fu, fv, cu, cv in pixels.
    intrinsics: [f64; 4],
    /// k1, k2, p1, p2, k3, k4, k5, k6; 0 for those missing in the file.
    distortion: [f64; 8],
    /// From the camera's frame to the body's.
    pose: Matrix4<f64>,
}

/// A pair of cameras before rectification.
#[derive(Clone, Debug)]
pub struct RawPair {
    cameras: [Camera; 2],
    /// From the ideal cameras' frame to each camera's.
    turns: [Rotation3<f64>; 2],
    calibration: Calibration,
    /// Where each camera saw the pixels of its ideal one, once it is known.
    lookups: [OnceLock<Lookup>; 2],
}

/// A picture of an ideal camera.
#[derive(Clone, Debug)]
pub struct Rectified {
    /// The picture; black where the real camera saw nothing.
    pub image: GreyImage,
    /// Whether the real camera saw each pixel.
    pub seen: Vec<bool>,
}

impl RawPair {
    /// The pair at a path, if there is one: a folder that contains `cam0` and `cam1`, or the left camera's file, with
    /// the right one's in the same folder.
    ///
    /// # Errors
    /// A file that cannot be read, or with a key that is missing or impossible.
    pub fn find(path: &Path) -> Result<Option<Self>, VisionError> {
        let beside = |path: &Path, camera: &str| {
            let places = [path.join(camera).join("sensor.yaml"), path.join(format!("{camera}_sensor.yaml"))];
            places.into_iter().find(|place| place.is_file())
        };
        let files = if path.is_dir() {
            match (beside(path, "cam0"), beside(path, "cam1")) {
                (Some(left), Some(right)) => [left, right],
                _ => {
                    let reason = "a folder is a EuRoC recording, but `cam0/sensor.yaml` and `cam1/sensor.yaml` are missing; \
                                  other calibrations are files"
                        .to_string();
                    return Err(VisionError::File { path: path.to_path_buf(), reason });
                }
            }
        } else if path.extension().is_some_and(|extension| extension == "yaml" || extension == "yml") {
            let text = path.to_string_lossy();
            let Some(at) = text.rfind("cam0") else {
                let reason = "a `sensor.yaml` of the left camera has `cam0` in its path".to_string();
                return Err(VisionError::File { path: path.to_path_buf(), reason });
            };
            [path.to_path_buf(), PathBuf::from(format!("{}cam1{}", &text[..at], &text[at + 4..]))]
        } else {
            return Ok(None);
        };
        let [left, right] = files.map(|file| Camera::read(&file));
        Self::new([left?, right?]).map(Some)
    }

    fn new(cameras: [Camera; 2]) -> Result<Self, VisionError> {
        let [left, right] = &cameras;
        let axes = |camera: &Camera| camera.pose.fixed_view::<3, 3>(0, 0).into_owned();
        let place = |camera: &Camera| camera.pose.fixed_view::<3, 1>(0, 3).into_owned();
        let across = place(right) - place(left);
        let ahead: Vector3<f64> = axes(left).column(2) + axes(right).column(2);
        let x = across.normalize();
        let z = (ahead - x * x.dot(&ahead)).normalize();
        let ideal = Matrix3::from_columns(&[x, z.cross(&x), z]);
        if !ideal.iter().all(|value| value.is_finite()) || x.dot(&axes(left).column(0)) < 0.5 {
            let reason = "the right camera is not to the right of the left one".to_string();
            return Err(VisionError::CalibrationKey { path: right.path.clone(), key: "T_BS".into(), reason });
        }
        let turn = |camera: &Camera| Rotation3::from_matrix(&(axes(camera).transpose() * ideal));
        let mean = |of: fn(&Camera) -> f64| (of(left) + of(right)) / 2.0;
        let focal = mean(|camera| (camera.intrinsics[0] + camera.intrinsics[1]) / 2.0);
        let centre = [mean(|camera| camera.intrinsics[2]), mean(|camera| camera.intrinsics[3])];
        let numbers = [focal, centre[0], centre[1], across.norm(), 0.0];
        let calibration = checked(&left.path, numbers, RAW_DISPARITIES.min(left.width.max(2) - 1))?;
        let turns = [turn(left), turn(right)];
        Ok(Self { cameras, turns, calibration, lookups: Default::default() })
    }

    /// The calibration of the ideal pair.
    pub fn calibration(&self) -> &Calibration {
        &self.calibration
    }

    /// From the ideal cameras' frame (right, down, ahead) to the body's.
    pub fn to_body(&self) -> Rotation3<f64> {
        let axes = self.cameras[0].pose.fixed_view::<3, 3>(0, 0).into_owned();
        Rotation3::from_matrix(&axes) * self.turns[0]
    }

    /// The pictures of the ideal cameras, left and right.
    ///
    /// # Errors
    /// A picture of another size than its camera makes.
    pub fn rectify(&self, left: &GreyImage, right: &GreyImage) -> Result<[Rectified; 2], VisionError> {
        Ok([self.rectified(0, left)?, self.rectified(1, right)?])
    }

    fn rectified(&self, which: usize, image: &GreyImage) -> Result<Rectified, VisionError> {
        let camera = &self.cameras[which];
        if (image.width(), image.height()) != (camera.width, camera.height) {
            let reason = format!(
                "is {}x{}, but the image is {}x{}",
                camera.width,
                camera.height,
                image.width(),
                image.height()
            );
            let (path, key) = (camera.path.clone(), "resolution".to_string());
            return Err(VisionError::CalibrationKey { path, key, reason });
        }
        let lookup = self.lookups[which].get_or_init(|| {
            Lookup::of(camera.width, camera.height, |at| {
                let ray = self.calibration.ray((at % camera.width) as f64, (at / camera.width) as f64);
                let turned = self.turns[which] * Vector3::from(ray);
                (turned.z > 0.0).then(|| camera.pixel(turned.x / turned.z, turned.y / turned.z))
            })
        });
        let image = GreyImage::new(camera.width, camera.height, lookup.apply(image.pixels()))?;
        Ok(Rectified { image, seen: lookup.seen.clone() })
    }
}

impl Camera {
    fn read(path: &Path) -> Result<Self, VisionError> {
        Self::parse(&input::text(path, input::MOST_OF_CALIBRATION)?, path)
    }

    fn parse(text: &str, path: &Path) -> Result<Self, VisionError> {
        let wrong = |key: &str, reason: String| VisionError::CalibrationKey {
            path: path.to_path_buf(),
            key: key.to_string(),
            reason,
        };
        let list = |key: &str| -> Result<Vec<f64>, VisionError> {
            // `key: [a, b, …]`, possibly over several lines.
            let after = text.match_indices(key).map(|(at, _)| &text[at + key.len()..]);
            let list = after.filter_map(|after| after.trim_start().strip_prefix(':')).next();
            let list = list.ok_or_else(|| wrong(key, "missing".into()))?.trim_start();
            let inside =
                list.strip_prefix('[').and_then(|list| list.split_once(']')).map(|(inside, _)| inside);
            let inside = inside.ok_or_else(|| wrong(key, "is not a list in brackets".into()))?;
            let parsed: Result<Vec<f64>, _> = inside.split(',').map(|word| word.trim().parse()).collect();
            let found = parsed.map_err(|_| wrong(key, "contains an entry that is not a number".into()))?;
            match found.iter().find(|value: &&f64| !value.is_finite()) {
                Some(value) => Err(wrong(key, format!("contains {value}, expected finite numbers"))),
                None => Ok(found),
            }
        };
        let numbers = |key: &str, count: usize| match list(key)? {
            found if found.len() == count => Ok(found),
            found => Err(wrong(key, format!("has {} numbers, expected {count}", found.len()))),
        };
        let mut distortion = [0.0; 8];
        let found = list(DISTORTION)?;
        match found.len() {
            4 | 5 | 8 => distortion[..found.len()].copy_from_slice(&found),
            count @ (12 | 14) => {
                let reason = format!(
                    "has {count} numbers, with thin prisms or a tilt, which are not supported: undistort the \
                     pictures first, or calibrate with {COUNTS}"
                );
                return Err(wrong(DISTORTION, reason));
            }
            count => return Err(wrong(DISTORTION, format!("has {count} numbers, expected {COUNTS}"))),
        }
        for (key, expected) in [("camera_model", "pinhole"), ("distortion_model", "radial-tangential")] {
            let line =
                text.lines().find_map(|line| line.trim().strip_prefix(key)?.trim_start().strip_prefix(':'));
            let found = line.map(|value| value.split('#').next().unwrap_or("").trim());
            match found {
                Some(found) if found == expected => {}
                Some(found) => return Err(wrong(key, format!("is `{found}`, expected `{expected}`"))),
                None => return Err(wrong(key, "missing".into())),
            }
        }
        let (intrinsics, resolution) = (numbers("intrinsics", 4)?, numbers("resolution", 2)?);
        if resolution.iter().any(|&size| size < 1.0 || size.fract() != 0.0 || size > 1e5) {
            return Err(wrong("resolution", format!("is {resolution:?}, expected two whole numbers")));
        }
        Ok(Self {
            path: path.to_path_buf(),
            width: resolution[0] as usize,
            height: resolution[1] as usize,
            intrinsics: std::array::from_fn(|at| intrinsics[at]),
            distortion,
            pose: Matrix4::from_row_slice(&numbers("data", 16)?),
        })
    }

    /// The pixel at which the camera sees the ray of slopes X/Z, Y/Z.
    fn pixel(&self, x: f64, y: f64) -> [f64; 2] {
        let [k1, k2, p1, p2, k3, k4, k5, k6] = self.distortion;
        let [fu, fv, cu, cv] = self.intrinsics;
        let square = x * x + y * y;
        let series = |a: f64, b: f64, c: f64| 1.0 + square * (a + square * (b + square * c));
        let radial = series(k1, k2, k3) / series(k4, k5, k6);
        let across = x * radial + 2.0 * p1 * x * y + p2 * (square + 2.0 * x * x);
        let down = y * radial + p1 * (square + 2.0 * y * y) + 2.0 * p2 * x * y;
        [fu * across + cu, fv * down + cv]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn yaml(shift: f64, k1: f64) -> String {
        format!(
            "T_BS:\n  data: [1.0, 0.0, 0.0, {shift},\n 0.0, 1.0, 0.0, 0.0,\n 0.0, 0.0, 1.0, 0.0,\n 0.0, 0.0, 0.0, 1.0]\n\
             resolution: [9, 7]\ncamera_model: pinhole\nintrinsics: [10.0, 10.0, 4.0, 3.0] #fu\n\
             distortion_model: radial-tangential\ndistortion_coefficients: [{k1}, 0.0, 0.0, 0.0]\n"
        )
    }

    fn pair(k1: f64) -> RawPair {
        let camera = |shift| Camera::parse(&yaml(shift, k1), Path::new("cam0.yaml")).unwrap();
        RawPair::new([camera(0.0), camera(0.2)]).unwrap()
    }

    #[test]
    fn a_pair_that_is_ideal_stays_as_it_is() {
        let pair = pair(0.0);
        assert!((pair.calibration().depth_times_disparity() - 2.0).abs() < 1e-12);
        let image = GreyImage::new(9, 7, (0..63).map(|value| value as f32).collect()).unwrap();
        let [left, right] = pair.rectify(&image, &image).unwrap();
        for found in [left, right] {
            let far = found
                .image
                .pixels()
                .iter()
                .zip(image.pixels())
                .map(|(a, b)| (a - b).abs())
                .fold(0.0, f32::max);
            assert!(far < 1e-4 && found.seen.iter().filter(|seen| **seen).count() >= 9 * 7 - 30, "{far}");
        }
    }

    #[test]
    fn distortion_by_hand() {
        // Slope 1/2 with k1 = −0.4: 1/2 · (1 − 0.4 / 4) = 0.45, so 4.5 px from the centre.
        let camera = Camera::parse(&yaml(0.0, -0.4), Path::new("cam0.yaml")).unwrap();
        let [x, y] = camera.pixel(0.5, 0.0);
        assert!((x - 8.5).abs() < 1e-12 && (y - 3.0).abs() < 1e-12);
    }

    #[test]
    fn further_coefficients_by_hand() {
        let with = |more: &str| {
            let text =
                yaml(0.0, -0.4).replace("[-0.4, 0.0, 0.0, 0.0]", &format!("[-0.4, 0.0, 0.0, 0.0{more}]"));
            Camera::parse(&text, Path::new("cam0.yaml"))
        };
        // Slope 1/2, r² = 1/4: k3 = 6.4 adds 6.4 / 64 = 0.1, so 1/2 · (0.9 + 0.1) = 0.5, 5 px from the centre.
        let [x, y] = with(", 6.4").unwrap().pixel(0.5, 0.0);
        assert!((x - 9.0).abs() < 1e-12 && (y - 3.0).abs() < 1e-12);
        // k4 = 1, k5 = 4, k6 = 0 divide by 1 + 1/4 + 4/16 = 1.5.
        let [x, _] = with(", 6.4, 1.0, 4.0, 0.0").unwrap().pixel(0.5, 0.0);
        assert!((x - (4.0 + 5.0 / 1.5)).abs() < 1e-12);
        for (more, expected) in [
            (", 0.0, 0.0", "has 6 numbers, expected 4 (k1 k2 p1 p2), 5 (and k3) or 8 (and k4 k5 k6)"),
            (
                ", 0, 0, 0, 0, 0, 0, 0, 0",
                "has 12 numbers, with thin prisms or a tilt, which are not supported",
            ),
            (", nan", "contains NaN, expected finite numbers"),
        ] {
            let message = with(more).unwrap_err().to_string();
            assert!(message.contains("`distortion_coefficients`") && message.contains(expected), "{message}");
        }
    }

    #[test]
    fn cameras_turned_towards_each_other_are_turned_back() {
        // The right camera is turned by 0.1 rad to the left about the vertical: a far point that the left one sees
        // ahead must be in the same place of both ideal pictures.
        let mut cameras = pair(0.0).cameras;
        let turned = Rotation3::from_axis_angle(&Vector3::y_axis(), -0.1);
        cameras[1].pose.fixed_view_mut::<3, 3>(0, 0).copy_from(turned.matrix());
        let pair = RawPair::new(cameras).unwrap();
        let far = Vector3::new(0.03, 0.02, 1.0);
        for (camera, turn) in pair.cameras.iter().zip(&pair.turns) {
            let axes = camera.pose.fixed_view::<3, 3>(0, 0).into_owned();
            // Ideal frame, then the camera's, then the body's: the same whatever the camera.
            assert!((axes * (turn * far) - pair.to_body() * far).norm() < 1e-12);
        }
        // The optical axes have equal weight: the ideal pair points half way between them, perpendicular to the
        // baseline.
        assert!((pair.to_body() * Vector3::z() - Vector3::z()).norm() < 1e-12);
    }

    #[test]
    fn faults_name_the_key() {
        for (good, bad, expected) in [
            ("pinhole", "omni", "`camera_model`: is `omni`, expected `pinhole`"),
            ("intrinsics", "intrinsic", "`intrinsics`: missing"),
            ("[9, 7]", "[9]", "`resolution`: has 1 numbers, expected 2"),
            ("10.0, 4.0", "ten, 4.0", "`intrinsics`: contains an entry that is not a number"),
        ] {
            let text = yaml(0.0, 0.0).replace(good, bad);
            let message = Camera::parse(&text, Path::new("cam0.yaml")).unwrap_err().to_string();
            assert!(message.contains(expected) && message.contains("cam0.yaml"), "{message}");
        }
        let left = Camera::parse(&yaml(0.0, 0.0), Path::new("cam0.yaml")).unwrap();
        let mut swapped = left.clone();
        swapped.pose[(0, 3)] = -0.2;
        assert!(RawPair::new([left, swapped]).unwrap_err().to_string().contains("not to the right"));
    }
}

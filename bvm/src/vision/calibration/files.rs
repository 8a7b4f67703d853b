//! Calibration files in the formats of Middlebury and KITTI (`calib.txt`).
//!
//! In: the text. Out: a [`Calibration`], or the error in the text. The format is detected from the content.
//!
//! ```text
//! Middlebury   cam0=[f 0 cx; 0 f cy; 0 0 1]   cam1=[…]   doffs=…   baseline=… (mm)   ndisp=…
//! KITTI        P0: twelve numbers, row by row …  P3: …       f·B / 1 = P_left[3] − P_right[3] (m)
//! ```
//!
//! A KITTI file does not bound the disparity: [`KITTI_DISPARITIES`] are searched. Its cameras 0 and 1 are grey, 2 and 3
//! in colour; the folder of the left image (`image_0`, `image_00`) determines which pair is used; otherwise the colour
//! cameras, if the file has them. `doffs` must agree with the two cameras, and `width`, `height` and KITTI's `S_rect`
//! with the pictures. Invariant: a file gives either a checked calibration or an error with the file and the key.

use super::{Calibration, checked};
use crate::vision::VisionError;
use std::collections::HashMap;
use std::path::Path;

/// Number of disparities to search if the file gives no bound.
pub const KITTI_DISPARITIES: usize = 128;

/// Tolerance between redundant numbers of a file, pixels: they are written with three decimals.
const TOLERANCE_PX: f64 = 0.05;

fn wrong(path: &Path, key: &str, reason: impl Into<String>) -> VisionError {
    VisionError::CalibrationKey { path: path.to_path_buf(), key: key.to_string(), reason: reason.into() }
}

/// Whether this is a Middlebury calibration.
pub(super) fn is_middlebury(text: &str) -> bool {
    text.lines().any(|line| line.trim_start().starts_with("cam0"))
}

/// Whether this is a KITTI calibration.
pub(super) fn is_kitti(text: &str) -> bool {
    text.lines()
        .any(|line| ["P0:", "P2:", "P_rect_00:", "P_rect_02:"].iter().any(|key| line.starts_with(key)))
}

/// Numbers separated by blanks, brackets, commas and semicolons.
fn numbers(path: &Path, key: &str, text: &str) -> Result<Vec<f64>, VisionError> {
    let is_between = |character: char| character.is_whitespace() || "[];,".contains(character);
    let number = |word: &str| match word.parse::<f64>() {
        Ok(value) if value.is_finite() => Ok(value),
        _ => Err(wrong(path, key, format!("`{word}` is not a finite number"))),
    };
    text.split(is_between).filter(|word| !word.is_empty()).map(number).collect()
}

/// A file of lines `key <separator> value`.
fn lines(text: &str, separator: char) -> HashMap<&str, &str> {
    text.lines()
        .filter_map(|line| line.split_once(separator))
        .map(|(key, value)| (key.trim(), value))
        .collect()
}

/// The calibration of a Middlebury pair.
pub(super) fn middlebury(text: &str, path: &Path) -> Result<Calibration, VisionError> {
    let lines = lines(text, '=');
    let several = |key: &str, count: usize| {
        let text = lines.get(key).ok_or_else(|| wrong(path, key, "missing"))?;
        let found = numbers(path, key, text)?;
        if found.len() == count {
            return Ok(found);
        }
        Err(wrong(path, key, format!("has {} numbers, expected {count}", found.len())))
    };
    let (left, right) = (several("cam0", 9)?, several("cam1", 9)?);
    // Both cameras belong to one rectified pair.
    for (at, name) in [(0, "focal length"), (5, "cy")] {
        if (left[at] - right[at]).abs() > TOLERANCE_PX {
            let reason = format!(
                "{name} is {}, but {} in `cam0`: the two cameras of a rectified pair have the same",
                right[at], left[at]
            );
            return Err(wrong(path, "cam1", reason));
        }
    }
    let offset = right[2] - left[2];
    let doffs = if lines.contains_key("doffs") { several("doffs", 1)?[0] } else { offset };
    if (doffs - offset).abs() > TOLERANCE_PX {
        let reason = format!(
            "is {doffs}, but cx of `cam1` minus cx of `cam0` is {offset:.3}; every range depends on it: \
             correct the one that is wrong, or leave `doffs` out"
        );
        return Err(wrong(path, "doffs", reason));
    }
    let most = several("ndisp", 1)?[0];
    if most.fract() != 0.0 || !(1.0..=1e6).contains(&most) {
        return Err(wrong(path, "ndisp", format!("is {most}, expected a whole number of at least 1")));
    }
    let baseline_m = several("baseline", 1)?[0] / 1000.0;
    let calibration = checked(path, [left[0], left[2], left[5], baseline_m, doffs], most as usize)?;
    let side = |key: &str| match lines.contains_key(key) {
        true => size(path, key, several(key, 1)?[0]).map(Some),
        false => Ok(None),
    };
    let picture_px = side("width")?.zip(side("height")?).map(|(width, height)| [width, height]);
    Ok(Calibration { picture_px, ..calibration })
}

/// A number of pixels along a side of a picture.
fn size(path: &Path, key: &str, value: f64) -> Result<usize, VisionError> {
    if value.fract() != 0.0 || !(1.0..=1e6).contains(&value) {
        return Err(wrong(path, key, format!("is {value}, expected a whole number of at least 1")));
    }
    Ok(value as usize)
}

/// The calibration of a KITTI pair, the left image of which lies at `left`.
pub(super) fn kitti(text: &str, path: &Path, left: Option<&Path>) -> Result<Calibration, VisionError> {
    let lines = lines(text, ':');
    let key = |camera: usize| {
        [format!("P{camera}"), format!("P_rect_0{camera}")]
            .into_iter()
            .find(|key| lines.contains_key(key.as_str()))
    };
    let grey = left.is_some_and(|left| left.iter().any(|part| part == "image_0" || part == "image_00"));
    let first = if (grey || key(2).is_none()) && key(0).is_some() { 0 } else { 2 };
    let projection = |camera: usize| {
        let name = key(camera).ok_or_else(|| wrong(path, &format!("P{camera}"), "missing"))?;
        let found = numbers(path, &name, lines[name.as_str()])?;
        if found.len() == 12 {
            return Ok(found);
        }
        Err(wrong(path, &name, format!("has {} numbers, expected 12", found.len())))
    };
    let (left, right) = (projection(first)?, projection(first + 1)?);
    let baseline_m = (left[3] - right[3]) / left[0];
    let numbers_of = [left[0], left[2], left[6], baseline_m, right[2] - left[2]];
    let calibration = checked(path, numbers_of, KITTI_DISPARITIES)?;
    let key = format!("S_rect_0{first}");
    let picture_px =
        match lines.get(key.as_str()).map(|text| numbers(path, &key, text)).transpose()?.as_deref() {
            None => None,
            Some([width, height]) => Some([size(path, &key, *width)?, size(path, &key, *height)?]),
            Some(other) => return Err(wrong(path, &key, format!("has {} numbers, expected 2", other.len()))),
        };
    Ok(Calibration { picture_px, ..calibration })
}

#[cfg(test)]
mod tests {
    use super::*;

    const MIDDLEBURY: &str = "cam0=[3979.911 0 1244.772; 0 3979.911 1019.507; 0 0 1]\n\
        cam1=[3979.911 0 1369.115; 0 3979.911 1019.507; 0 0 1]\ndoffs=124.343\nbaseline=193.001\nwidth=2964\n\
        height=1988\nndisp=280\nisint=0\nvmin=31\nvmax=257\n";
    const KITTI: &str = "P0: 100 0 50 0 0 100 40 0 0 0 1 0\nP1: 100 0 50 -50 0 100 40 0 0 0 1 0\n\
        P2: 100 0 50 5 0 100 40 0 0 0 1 0\nP3: 100 0 50 -55 0 100 40 0 0 0 1 0\n";

    fn read(text: &str, left: &str) -> Result<Calibration, VisionError> {
        Calibration::parse(text, Path::new("calib.txt"), Some(Path::new(left)))
    }

    #[test]
    fn middlebury_s_own_formula() {
        // Z = baseline · f / (d + doffs), in millimetres: of the data set's page.
        let rig = read(MIDDLEBURY, "im0.png").unwrap();
        let expected = 0.193001 * 3979.911 / (100.0 + 124.343);
        assert!((rig.depth_m(100.0).unwrap() - expected).abs() < 1e-12);
        assert_eq!(rig.max_disparity_px(), 280);
        assert_eq!(rig.direction(1244.772, 1019.507), (0.0, 0.0));
    }

    #[test]
    fn a_calibration_is_held_to_the_size_of_the_pictures() {
        let refused = |rig: &Calibration, width, height| {
            rig.check_pictures(Path::new("calib.txt"), width, height).unwrap_err().to_string()
        };
        let rig = read(MIDDLEBURY, "im0.png").unwrap();
        assert!(rig.check_pictures(Path::new(""), 2964, 1988).is_ok());
        let quarter = refused(&rig, 741, 497);
        assert!(
            quarter.contains("`width`: the file is for 2964x1988, but the pictures are 741x497"),
            "{quarter}"
        );
        assert!(quarter.contains("scale its pixels by 0.2500"), "{quarter}");
        let other = refused(&rig, 2964, 2000);
        assert!(
            other.contains("`height`") && other.contains("use the calibration of these pictures"),
            "{other}"
        );
        // A file without a size matches any picture that is wider than its largest disparity; KITTI files may have one.
        let silent = MIDDLEBURY.replace("width=2964\nheight=1988\n", "");
        assert!(read(&silent, "").unwrap().check_pictures(Path::new(""), 641, 481).is_ok());
        assert!(refused(&read(&silent, "").unwrap(), 5, 5).contains("5"));
        let kitti = format!("S_rect_02: 1.242e+03 3.75e+02\n{KITTI}");
        let rig = read(&kitti, "image_2/0.png").unwrap();
        assert!(rig.check_pictures(Path::new(""), 1242, 375).is_ok());
        assert!(refused(&rig, 1241, 376).contains("1242x375"));
        assert!(read(&kitti, "image_0/0.png").unwrap().check_pictures(Path::new(""), 641, 481).is_ok());
    }

    #[test]
    fn kitti_s_baselines_are_those_of_its_cameras() {
        // Grey: 50 px·m apart, so 0.5 m at f = 100; colour: 60 px·m.
        assert_eq!(read(KITTI, "data/image_0/000000_10.png").unwrap().depth_m(25.0), Some(2.0));
        assert_eq!(read(KITTI, "data/image_2/000000_10.png").unwrap().depth_m(25.0), Some(2.4));
        assert_eq!(read(&KITTI[..KITTI.find("P2").unwrap()], "x.png").unwrap().depth_m(25.0), Some(2.0));
    }

    #[test]
    fn faults_name_the_key() {
        for (good, bad, expected) in [
            ("cam1=", "cam2=", "`cam1`: missing"),
            ("ndisp=280", "ndisp=2.5", "`ndisp`: is 2.5"),
            ("baseline=193.001", "baseline=-1", "`baseline_m`"),
            ("baseline=193.001", "baseline=wide", "`baseline`: `wide` is not a finite number"),
            ("0 0 1]\ncam1", "0 1]\ncam1", "`cam0`: has 8 numbers, expected 9"),
            // 1369.115 − 1244.772 = 124.343.
            ("doffs=124.343", "doffs=40", "`doffs`: is 40, but cx of `cam1` minus cx of `cam0` is 124.343"),
            ("doffs=124.343", "doffs=0", "`doffs`: is 0, but"),
            ("width=2964", "width=wide", "`width`: `wide` is not a finite number"),
            ("height=1988", "height=0.5", "`height`: is 0.5, expected a whole number"),
            ("cam1=[3979.911", "cam1=[3900", "`cam1`: focal length is 3900, but 3979.911 in `cam0`"),
        ] {
            let message = read(&MIDDLEBURY.replace(good, bad), "").unwrap_err().to_string();
            assert!(message.contains(expected) && message.contains("calib.txt"), "{message}");
        }
        let message = read(&KITTI.replace("P3: 100 0", "P3: 100"), "").unwrap_err().to_string();
        assert!(message.contains("`P3`: has 11 numbers, expected 12"), "{message}");
    }
}

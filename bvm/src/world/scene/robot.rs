//! Checks of the head of a scene and of its faults.
//!
//! In: the keys as written. Out: numbers within their bounds. Invariant: a key that is absent has its default.

use super::check::{Mistake, finite, within};
use super::file;
use super::parts::{Cameras, Fault, FaultKind, Imu, Neck, Organ};
use toml::Spanned;

pub(super) fn cameras(file: &file::CamerasFile) -> Result<Cameras, Mistake> {
    let own = Cameras::default();
    let size_px = file.size_px.as_ref().map_or(own.size_px, |size| *size.get_ref());
    if let Some(given) = &file.size_px
        && (!(64..=1920).contains(&size_px[0]) || !(48..=1440).contains(&size_px[1]))
    {
        return Err((given.span(), format!("found {size_px:?}, expected 64 to 1920 by 48 to 1440 pixels")));
    }
    Ok(Cameras {
        size_px,
        field_degrees: within(file.field_degrees.as_ref(), own.field_degrees, 20.0..=120.0)?,
        baseline_m: within(file.baseline_m.as_ref(), own.baseline_m, 0.01..=0.25)?,
        ahead_m: within(file.ahead_m.as_ref(), own.ahead_m, 0.0..=0.12)?,
        noise: within(file.noise.as_ref(), own.noise, 0.0..=100.0)?,
        gain: within(file.gain.as_ref(), own.gain, 0.25..=4.0)?,
    })
}

fn limits(value: Option<&Spanned<[f64; 2]>>, default: [f64; 2], most: f64) -> Result<[f64; 2], Mistake> {
    let Some(value) = value else { return Ok(default) };
    let [low, high] = *value.get_ref();
    finite(value, &[low, high])?;
    if !(-most..=0.0).contains(&low) || !(0.0..=most).contains(&high) {
        let reason =
            format!("found [{low}, {high}], expected -{most} to 0 and 0 to {most}: the head starts at 0");
        return Err((value.span(), reason));
    }
    Ok([low, high])
}

pub(super) fn neck(file: &file::NeckFile) -> Result<Neck, Mistake> {
    let own = Neck::default();
    let (speed, acceleration) = (own.speed_degrees_s, own.acceleration_degrees_s2);
    Ok(Neck {
        yaw_degrees: limits(file.yaw_degrees.as_ref(), own.yaw_degrees, 360.0)?,
        pitch_degrees: limits(file.pitch_degrees.as_ref(), own.pitch_degrees, 80.0)?,
        speed_degrees_s: within(file.speed_degrees_s.as_ref(), speed, 1.0..=2000.0)?,
        acceleration_degrees_s2: within(file.acceleration_degrees_s2.as_ref(), acceleration, 10.0..=1e5)?,
    })
}

pub(super) fn imu(file: &file::ImuFile) -> Result<Imu, Mistake> {
    let own = Imu::default();
    let vector = |value: Option<&Spanned<[f64; 3]>>, default: [f64; 3], most: f64| {
        let Some(value) = value else { return Ok(default) };
        finite(value, value.get_ref())?;
        match value.get_ref().iter().find(|part| part.abs() > most) {
            Some(part) => Err((value.span(), format!("found {part}, expected at most {most}"))),
            None => Ok(*value.get_ref()),
        }
    };
    Ok(Imu {
        rate_hz: within(file.rate_hz.as_ref(), own.rate_hz, 20.0..=2000.0)?,
        gyroscope_bias: vector(file.gyroscope_bias.as_ref(), own.gyroscope_bias, 0.5)?,
        accelerometer_bias: vector(file.accelerometer_bias.as_ref(), own.accelerometer_bias, 2.0)?,
        gyroscope_sigma: within(file.gyroscope_sigma.as_ref(), own.gyroscope_sigma, 0.0..=1.0)?,
        accelerometer_sigma: within(file.accelerometer_sigma.as_ref(), own.accelerometer_sigma, 0.0..=10.0)?,
        lag_s: within(file.lag_s.as_ref(), own.lag_s, 0.0..=0.1)?,
    })
}

pub(super) fn fault(file: &file::FaultFile) -> Result<Fault, Mistake> {
    let organs = [
        ("left camera", Organ::LeftCamera),
        ("right camera", Organ::RightCamera),
        ("left ear", Organ::LeftEar),
        ("right ear", Organ::RightEar),
        ("imu", Organ::Imu),
    ];
    let organ = organs.iter().find(|(name, _)| name == file.organ.get_ref()).ok_or_else(|| {
        let known = organs.map(|(name, _)| name).join(", ");
        (file.organ.span(), format!("there is no organ `{}`: expected {known}", file.organ.get_ref()))
    })?;
    let kind = match file.kind.as_ref().map(|kind| (kind, kind.get_ref().as_str())) {
        None | Some((_, "lost")) => FaultKind::Lost,
        Some((_, "frozen")) => FaultKind::Frozen,
        Some((kind, other)) => {
            return Err((kind.span(), format!("found `{other}`, expected lost or frozen")));
        }
    };
    let looks = *file.looks.get_ref();
    if looks[0] == 0 || looks[0] > looks[1] {
        let reason = format!("found {looks:?}, expected the first and the last look, counted from 1");
        return Err((file.looks.span(), reason));
    }
    Ok(Fault { organ: organ.1, kind, looks })
}

//! SOFA files (AES69) of head-related impulse responses.
//!
//! In: a file of free-field responses of two ears. Out: directions, distances and responses in the frame of the crate,
//! with the delays of `Data.Delay` in them and the left ear first. Invariant: the ears, units, view and rate
//! that the file gives are used or refused, never assumed; the data decide whether its azimuths are true
//! (`Calibration::of`).
//!
//! HDF5 is parsed by the crate `sofar`, of which only the raw fields are used.

use super::error::AuditionError;
use super::head::{Measured, Responses};
use crate::frame::{Spherical, wrap_angle};
use crate::input;
use sofar::hdf::{DataFormat, DataObject, ParsedHdf, parse_with_children};
use std::path::Path;

/// The most bytes of a file: 256 MiB.
const MOST_BYTES: u64 = input::MOST_BYTES;
/// Conventions that have one response for each ear and direction in the free field.
const CONVENTIONS: [&str; 2] = ["SimpleFreeFieldHRIR", "GeneralFIR"];

/// Reads a file.
///
/// # Errors
/// A file that cannot be read, is no SOFA file, or whose conventions, dimensions, units or values cannot be used.
pub fn read(path: &Path) -> Result<(Responses, Vec<u8>), AuditionError> {
    let bytes = input::bytes(path, MOST_BYTES).map_err(|error| AuditionError::Input(Box::new(error)))?;
    let responses =
        decode(&bytes).map_err(|reason| AuditionError::File { path: path.to_path_buf(), reason })?;
    Ok((responses, bytes))
}

/// A variable of the file.
struct Field {
    values: Vec<f64>,
    sizes: Vec<usize>,
    object: DataObject,
}

impl Field {
    fn read(file: &ParsedHdf<'_>, name: &str) -> Result<Option<Field>, String> {
        let object = match file.get_child(name) {
            None => return Ok(None),
            Some(Err(_)) => return Err(format!("`{name}` cannot be read: is the file damaged or cut off?")),
            Some(Ok(object)) => object,
        };
        let sizes: Vec<usize> = object.ds.dimension_size.iter().map(|size| *size as usize).collect();
        let values = numbers(&object).ok_or_else(|| format!("`{name}` has no numbers that are read"))?;
        if values.len() != sizes.iter().product::<usize>() {
            return Err(format!("`{name}` has {} values for the sizes {sizes:?}", values.len()));
        }
        if let Some(at) = values.iter().position(|value| !value.is_finite()) {
            return Err(format!("`{name}` has a value that is not a finite number, at place {at}"));
        }
        Ok(Some(Field { values, sizes, object }))
    }

    fn needed(file: &ParsedHdf<'_>, name: &str) -> Result<Field, String> {
        Field::read(file, name)?.ok_or_else(|| format!("`{name}` is missing"))
    }

    /// An attribute, in lower case.
    fn attribute(&self, name: &str) -> Option<String> {
        let found = self.object.parsed_attributes.iter().find(|one| one.name == name)?;
        found.value.as_ref().map(|value| value.trim_end_matches('\0').trim().to_lowercase())
    }

    /// Positions `[x, y, z]` in metres, one for each row of three.
    fn positions(&self, name: &str) -> Result<Vec<[f64; 3]>, String> {
        let kind = self.attribute("Type").unwrap_or_else(|| "cartesian".to_owned());
        let units = self.attribute("Units").unwrap_or_default();
        // R × C × I has one value more on its last axis; E and R may have several there.
        let rows = match self.sizes.as_slice() {
            [_, 3] | [_, 3, 1] => self.values.chunks_exact(3).map(|row| [row[0], row[1], row[2]]),
            sizes => return Err(format!("`{name}` has the sizes {sizes:?}: expected rows of 3")),
        };
        match kind.as_str() {
            "cartesian" => Ok(rows.collect()),
            "spherical" => {
                let scale = if units.contains("rad") { 1.0 } else { std::f64::consts::PI / 180.0 };
                if !units.is_empty() && !units.contains("rad") && !units.contains("deg") {
                    return Err(format!("`{name}` has the units `{units}`: expected degrees or radians"));
                }
                let point = |[azimuth, elevation, rho_m]: [f64; 3]| {
                    Spherical { rho_m, azimuth: azimuth * scale, elevation: elevation * scale }.to_cartesian()
                };
                Ok(rows.map(point).collect())
            }
            other => Err(format!("`{name}` has the type `{other}`: expected `spherical` or `cartesian`")),
        }
    }
}

/// The numbers of a variable, which are little-endian floats or integers of four or eight bytes.
fn numbers(object: &DataObject) -> Option<Vec<f64>> {
    let is_float = matches!(object.dt.data_fmt, Some(DataFormat::Float { .. }));
    let is_big_endian = object.dt.class_bit_field & 1 == 1;
    let chunks = |width| object.data.chunks_exact(width);
    match (is_float, object.dt.size, is_big_endian) {
        (true, 8, false) => chunks(8).map(|one| Some(f64::from_le_bytes(one.try_into().ok()?))).collect(),
        (true, 4, false) => {
            chunks(4).map(|one| Some(f64::from(f32::from_le_bytes(one.try_into().ok()?)))).collect()
        }
        (false, 4, false) => {
            chunks(4).map(|one| Some(f64::from(i32::from_le_bytes(one.try_into().ok()?)))).collect()
        }
        _ => None,
    }
}

fn decode(bytes: &[u8]) -> Result<Responses, String> {
    if !bytes.starts_with(b"\x89HDF\r\n\x1a\n") {
        return Err("not a SOFA file: it does not begin as HDF5 does".to_owned());
    }
    // The end of the file, by the superblock of version 0, 2 or 3; the parser asserts it.
    let at = if bytes.get(8).is_some_and(|version| *version >= 2) { 28 } else { 40 };
    let end = bytes.get(at..at + 8).and_then(|end| end.try_into().ok()).map(u64::from_le_bytes);
    if end != Some(bytes.len() as u64) {
        return Err("the file is cut off, or damaged: its length is not that of its header".to_owned());
    }
    let file = parse_with_children(bytes).map_err(|_| {
        "not read as HDF5: is the file damaged or cut off, or another version of HDF5?".to_owned()
    })?;
    let attribute = |name: &str| {
        let found = file.root.parsed_attributes.iter().find(|one| one.name == name);
        found.and_then(|one| one.value.as_ref()).map(|value| value.trim_end_matches('\0').to_owned())
    };
    let conventions = attribute("SOFAConventions").ok_or("the attribute `SOFAConventions` is missing")?;
    if !CONVENTIONS.contains(&conventions.as_str()) {
        return Err(format!("the convention is `{conventions}`: expected {}", CONVENTIONS.join(" or ")));
    }
    let responses = Field::needed(&file, "Data.IR")?;
    let [count, ears, taps] = match responses.sizes.as_slice() {
        [count, ears, taps] if *count > 0 && *taps > 0 => [*count, *ears, *taps],
        sizes => {
            return Err(format!("`Data.IR` has the sizes {sizes:?}: expected measurements, ears, samples"));
        }
    };
    if ears != 2 {
        return Err(format!("`Data.IR` has {ears} receivers: expected the two ears"));
    }
    let rate_hz = match Field::needed(&file, "Data.SamplingRate")?.values.as_slice() {
        [rate, ..] if (8_000.0..=192_000.0).contains(rate) => *rate,
        values => return Err(format!("`Data.SamplingRate` is {values:?}: expected 8000 to 192000 Hz")),
    };
    let right_first =
        right_ear_first(&Field::needed(&file, "ReceiverPosition")?.positions("ReceiverPosition")?)?;
    let turned = match Field::read(&file, "ListenerView")? {
        Some(view) => view_azimuth(&view.positions("ListenerView")?)?,
        None => 0.0,
    };
    let sources = Field::needed(&file, "SourcePosition")?.positions("SourcePosition")?;
    if sources.len() != count {
        return Err(format!("`SourcePosition` has {} rows for {count} measurements", sources.len()));
    }
    let delays = Field::read(&file, "Data.Delay")?;
    let delay = |measurement: usize, ear: usize| -> Result<f64, String> {
        let Some(delays) = &delays else { return Ok(0.0) };
        match delays.sizes.as_slice() {
            [1, 2] => Ok(delays.values[ear]),
            [rows, 2] if *rows == count => Ok(delays.values[2 * measurement + ear]),
            sizes => Err(format!("`Data.Delay` has the sizes {sizes:?}: expected 1 or {count} rows of 2")),
        }
    };
    let mut measured = Vec::with_capacity(count);
    for (index, source) in sources.iter().enumerate() {
        let from_head = Spherical::from_cartesian(*source);
        if from_head.rho_m <= 0.0 {
            return Err(format!("`SourcePosition` of measurement {index} is the centre of the head"));
        }
        let at = |ear: usize| &responses.values[(2 * index + ear) * taps..][..taps];
        let both = [delay(index, 0)?, delay(index, 1)?];
        // Only the difference between the ears matters.
        let least = both[0].min(both[1]);
        let shifted = |ear: usize| delayed(at(ear), both[ear] - least);
        let ears = if right_first { [shifted(1), shifted(0)] } else { [shifted(0), shifted(1)] };
        let place = Spherical { azimuth: wrap_angle(from_head.azimuth - turned), ..from_head };
        measured.push(Measured { place, ears });
    }
    Ok(Responses { rate_hz, measured })
}

/// Whether the first receiver is the right ear: the one with y < 0.
fn right_ear_first(receivers: &[[f64; 3]]) -> Result<bool, String> {
    match receivers {
        [[_, first, _], [_, second, _]] if *first > *second => Ok(false),
        [[_, first, _], [_, second, _]] if *first < *second => Ok(true),
        _ => Err("`ReceiverPosition` does not say which ear is the left one: expected two positions with different y"
            .to_owned()),
    }
}

/// The azimuth of a level view, radians.
fn view_azimuth(views: &[[f64; 3]]) -> Result<f64, String> {
    let mut azimuths = views.iter().map(|[x, y, z]| (y.atan2(*x), *z, x.hypot(*y)));
    let Some((azimuth, z, ground)) = azimuths.next() else { return Ok(0.0) };
    if azimuths.any(|(other, ..)| (other - azimuth).abs() > 1e-9) {
        return Err("`ListenerView` changes between measurements, which is not read".to_owned());
    }
    if ground == 0.0 || z.abs() > 1e-6 * ground {
        return Err("`ListenerView` is not level: a nodding head is not read".to_owned());
    }
    Ok(azimuth)
}

/// A response after a delay in samples, which need not be whole.
fn delayed(response: &[f64], delay: f64) -> Vec<f64> {
    if delay == 0.0 {
        return response.to_vec();
    }
    super::head::resampled(response, 1.0, delay, response.len() + delay.ceil() as usize + 16)
}

//! Mistakes in a recording, in words.
//!
//! In: what the data show (the period of the rows, the size of |a|, k of da/dt = −k ω × a). Out: a sentence that names the factor and
//! the option that mends it. Invariant: no sentence where all is as it should be.

use super::columns::{ACCELERATIONS, RATES, TIMES};

/// k is negative.
pub(super) fn clockwise(k: f64) -> String {
    format!(
        "k = {k:.4} in da/dt = -k w x a, expected 1: the gyroscope counts clockwise, or an axis is mirrored (left-handed); for the \
         former --gyroscope-axes=-x,-y,-z, for a mirrored y --accelerometer-axes=x,-y,z"
    )
}

/// The rate of no gyroscope, rad/s: 4500 °/s.
const FASTEST: f64 = 80.0;

/// The largest rate, rad/s, and its row, are not those of a gyroscope.
pub(super) fn of_rate((rate, row): (f64, u64)) -> Option<String> {
    if rate <= FASTEST {
        return None;
    }
    let unit = RATES[1..=2].iter().find(|unit| rate * unit.size <= FASTEST);
    Some(match unit {
        Some(unit) => format!(
            "row {row}: a rate of {rate:.0} rad/s is beyond any gyroscope; in {} it is {:.1} rad/s, a factor of {}: --rate-unit {}",
            unit.name,
            rate * unit.size,
            plain(unit.size),
            unit.name
        ),
        None => format!(
            "row {row}: a rate of {rate:e} is beyond any gyroscope in any unit: the reading is broken"
        ),
    })
}

/// The median period is not that of an inertial sensor.
pub(super) fn of_period(period: f64) -> String {
    let usual = 1e-4..=0.2;
    let unit = TIMES[1..].iter().find(|unit| usual.contains(&(period * unit.size)));
    match unit {
        Some(unit) => format!(
            "the rows are {period:.4} s apart; in {} that is a factor of {:e} and {:.1} Hz: --time-unit {}",
            unit.name,
            unit.size,
            1.0 / (period * unit.size),
            unit.name
        ),
        None => {
            let unit = TIMES.iter().find(|unit| usual.contains(&(period / unit.size)));
            let hint = unit.map_or(String::new(), |unit| format!(" (a factor of {:e} too short)", unit.size));
            format!(
                "the rows are {period:e} s apart{hint}: not the period of an inertial sensor; --time-unit s, ms, us or ns"
            )
        }
    }
}

/// The median of |a| is not that of gravity.
pub(super) fn of_size(size: f64, stated: bool) -> Option<String> {
    let standard = ACCELERATIONS[1].size;
    let near = |unit_size: f64| (size * unit_size / standard - 1.0).abs() < 0.3;
    if near(1.0) {
        return None;
    }
    let said = if stated { "by the stated unit" } else { "m/s2" };
    if near(1.0 / standard) {
        return Some(format!(
            "the median of |a| is {size:.1} {said}, expected 9.81; the numbers were in m/s2 already, a factor of {standard}: \
             --acceleration-unit m/s2"
        ));
    }
    let unit = ACCELERATIONS.iter().find(|unit| near(unit.size));
    Some(match unit {
        Some(unit) => format!(
            "the median of |a| is {size:.4} {said}, expected 9.81; in {} it is {:.2} m/s2, a factor of {}: \
             --acceleration-unit {}",
            unit.name,
            size * unit.size,
            unit.size,
            unit.name
        ),
        None => format!(
            "the median of |a| is {size:.4} {said}, expected 9.81, and no unit makes it so; the accelerometer may be \
             without gravity, or mostly in free fall: --acceleration-unit m/s2, g or mg"
        ),
    })
}

/// k is not 1.
pub(super) fn of_scale(scale: f64, period: Option<f64>) -> Option<String> {
    if (0.8..=1.25).contains(&scale) {
        return None;
    }
    let near = |size: f64| (scale / size - 1.0).abs() < 0.25;
    let k = format!("k = {} in da/dt = -k w x a, expected 1", plain(scale));
    if near(1e-3) && period.is_some_and(|period| (4e-5..=0.2).contains(&(1e-3 * period))) {
        return Some(format!(
            "{k}: the stamps are in ms, a factor of 1e-3: --time-unit ms (or rates in mrad/s: --rate-unit mrad/s)"
        ));
    }
    if let Some(unit) = RATES[1..].iter().find(|unit| near(unit.size)) {
        let factor = plain(unit.size);
        return Some(format!(
            "{k}: the rates are in {}, a factor of {factor}: --rate-unit {}",
            unit.name, unit.name
        ));
    }
    if near(1.0 / RATES[1].size) {
        return Some(format!("{k}: the rates were in rad/s already, a factor of 57.3: --rate-unit rad/s"));
    }
    // Linear accelerations that go with the rotation, as of an arm that swings, move k too.
    None
}

/// A number without an exponent, where that can be read.
fn plain(number: f64) -> String {
    if number.abs() >= 1e-3 { format!("{number:.5}") } else { format!("{number:.4e}") }
}

/// The axes of a matrix, as the option writes them.
pub(super) fn axes_of(matrix: &[[f64; 3]; 3]) -> String {
    let axis = |row: &[f64; 3]| {
        let at = row.iter().position(|cell| *cell != 0.0).unwrap_or(0);
        format!("{}{}", if row[at] < 0.0 { "-" } else { "" }, ["x", "y", "z"][at])
    };
    matrix.iter().map(axis).collect::<Vec<_>>().join(",")
}

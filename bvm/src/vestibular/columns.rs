//! The columns of a recording of an inertial sensor, by its header.
//!
//! In: the names of the columns, and units that the user gives. Out: the place and the unit of the stamp, of three rates and of
//! three accelerations. Invariant: columns go by their names, never by their order; what is not known (magnetometers,
//! temperatures) is not used.

use std::f64::consts::PI;

/// Standard gravity, m/s²: the unit g.
const G: f64 = 9.80665;

/// A unit and its size in SI units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Unit {
    /// Its name, as options and messages write it.
    pub name: &'static str,
    /// Its size: s, rad/s or m/s².
    pub size: f64,
}

/// Units of stamps.
pub const TIMES: [Unit; 4] = [unit("s", 1.0), unit("ms", 1e-3), unit("us", 1e-6), unit("ns", 1e-9)];
/// Units of rates.
pub const RATES: [Unit; 4] =
    [unit("rad/s", 1.0), unit("deg/s", PI / 180.0), unit("mdps", PI / 180e3), unit("mrad/s", 1e-3)];
/// Units of accelerations.
pub const ACCELERATIONS: [Unit; 5] =
    [unit("m/s2", 1.0), unit("g", G), unit("mg", 1e-3 * G), unit("mm/s2", 1e-3), unit("ft/s2", 0.3048)];

const fn unit(name: &'static str, size: f64) -> Unit {
    Unit { name, size }
}

/// Spellings of units, without blanks, signs of multiplication and powers, in lower case.
const SPELLINGS: [(&str, &str); 42] = [
    ("s", "s"),
    ("sec", "s"),
    ("seconds", "s"),
    ("ms", "ms"),
    ("msec", "ms"),
    ("millis", "ms"),
    ("us", "us"),
    ("µs", "us"),
    ("μs", "us"),
    ("usec", "us"),
    ("ns", "ns"),
    ("nsec", "ns"),
    ("nanos", "ns"),
    ("rad/s", "rad/s"),
    ("rads-1", "rad/s"),
    ("rads", "rad/s"),
    ("rad/sec", "rad/s"),
    ("radps", "rad/s"),
    ("mrad/s", "mrad/s"),
    ("deg/s", "deg/s"),
    ("degs-1", "deg/s"),
    ("degs", "deg/s"),
    ("deg/sec", "deg/s"),
    ("°/s", "deg/s"),
    ("dps", "deg/s"),
    ("degps", "deg/s"),
    ("mdps", "mdps"),
    ("mdeg/s", "mdps"),
    ("m°/s", "mdps"),
    ("m/s2", "m/s2"),
    ("m/s²", "m/s2"),
    ("m/s/s", "m/s2"),
    ("ms-2", "m/s2"),
    ("ms2", "m/s2"),
    ("mps2", "m/s2"),
    ("mss", "m/s2"),
    ("g", "g"),
    ("gn", "g"),
    ("g0", "g"),
    ("mg", "mg"),
    ("milli-g", "mg"),
    ("mm/s2", "mm/s2"),
];

/// A unit of a list by one of its spellings.
pub fn unit_of(text: &str, units: &[Unit]) -> Option<Unit> {
    let plain: String = text.to_lowercase().chars().filter(|letter| !" *·^{}_".contains(*letter)).collect();
    let (_, name) = SPELLINGS.iter().find(|(spelling, _)| *spelling == plain)?;
    units.iter().find(|unit| unit.name == *name).copied()
}

/// A column: its place, and its unit where the header states one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Column {
    /// From 0.
    pub place: usize,
    /// As the header states it.
    pub unit: Option<Unit>,
}

/// Where the numbers of a row are.
#[derive(Clone, Debug, PartialEq)]
pub struct Columns {
    /// The stamp.
    pub time: Column,
    /// Rates about x, y, z.
    pub rate: [Column; 3],
    /// Accelerations along x, y, z.
    pub acceleration: [Column; 3],
    /// How many columns there are.
    pub count: usize,
}

/// What a column is.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Kind {
    Time,
    Rate(usize),
    Acceleration(usize),
}

impl Columns {
    /// The columns of a header.
    ///
    /// # Errors
    /// A column that is missing or stands there twice; a unit that is not known.
    pub fn of(names: &[String]) -> Result<Self, String> {
        let mut found: Vec<(Kind, Column)> = Vec::new();
        for (place, name) in names.iter().enumerate() {
            let Some((kind, unit)) = classify(name)? else { continue };
            if let Some((_, other)) = found.iter().find(|(own, _)| *own == kind) {
                let other = &names[other.place];
                return Err(format!("the columns `{other}` and `{name}` are the same quantity"));
            }
            found.push((kind, Column { place, unit }));
        }
        let find = |kind: Kind, expected: &str| {
            let column = found.iter().find(|(own, _)| *own == kind).map(|(_, column)| *column);
            let names = names.join("`, `");
            column.ok_or_else(|| {
                format!(
                    "there is no column `{expected}`; found `{names}`; expected t_s, gx, gy, gz, ax, ay, az, the header of \
                     EuRoC, or --columns"
                )
            })
        };
        let [gx, gy, gz] = ["gx", "gy", "gz"];
        let rate = [find(Kind::Rate(0), gx)?, find(Kind::Rate(1), gy)?, find(Kind::Rate(2), gz)?];
        let axis = |axis, name| find(Kind::Acceleration(axis), name);
        let acceleration = [axis(0, "ax")?, axis(1, "ay")?, axis(2, "az")?];
        let columns = Self { time: find(Kind::Time, "t_s")?, rate, acceleration, count: names.len() };
        for three in [&columns.rate, &columns.acceleration] {
            if three.iter().any(|column| column.unit != three[0].unit) {
                let [a, b, c] = three.map(|column| &names[column.place]);
                return Err(format!("`{a}`, `{b}` and `{c}` state different units"));
            }
        }
        Ok(columns)
    }
}

/// The quantity of a column, and its unit where the name states one.
fn classify(name: &str) -> Result<Option<(Kind, Option<Unit>)>, String> {
    let name = name.trim().trim_start_matches(['#', '\u{feff}']).trim();
    let (base, stated) = match name.find(['[', '(']) {
        Some(at) => {
            let unit = name[at + 1..].trim_end_matches([']', ')']).trim();
            (name[..at].trim().to_lowercase(), Some(unit.to_owned()))
        }
        None => (name.to_lowercase(), None),
    };
    // A unit may be the last part of the name: gx_dps, acc_x_m_s2.
    let parts: Vec<&str> =
        base.split(['_', '.', ' ', '/', '-', ':']).filter(|part| !part.is_empty()).collect();
    let split = |count: usize| (parts[..parts.len() - count].concat(), parts[parts.len() - count..].concat());
    let candidates =
        (1..parts.len()).filter(|count| *count <= 2).map(split).chain([(parts.concat(), String::new())]);
    for (plain, suffix) in candidates {
        let Some((kind, units)) = quantity(&plain) else { continue };
        let named = unit_of(&suffix, units);
        if !suffix.is_empty() && named.is_none() {
            continue;
        }
        let unit = match &stated {
            Some(text) => Some(unit_of(text, units).ok_or_else(|| {
                let names: Vec<&str> = units.iter().map(|unit| unit.name).collect();
                format!("column `{name}`: the unit `{text}` is not known; expected {}", names.join(", "))
            })?),
            None => named,
        };
        return Ok(Some((kind, unit)));
    }
    Ok(None)
}

/// The quantity of a name without separators, in lower case.
fn quantity(plain: &str) -> Option<(Kind, &'static [Unit])> {
    let times = ["t", "time", "timestamp", "stamp", "ts", "timestamps", "times", "sec", "seconds"];
    if times.contains(&plain) || plain.starts_with("timestamp") {
        return Some((Kind::Time, &TIMES));
    }
    let (stem, axis) = plain.split_at_checked(plain.len().checked_sub(1)?)?;
    let axis = ["x", "y", "z"].iter().position(|own| *own == axis)?;
    if stem.contains("mag") || stem.contains("bias") {
        return None;
    }
    let is = |exact: &[&str], inside: &[&str]| {
        exact.contains(&stem) || inside.iter().any(|part| stem.contains(part))
    };
    if is(
        &["g", "w", "rate", "omega"],
        &["gyr", "angularvel", "angularrate", "angvel", "rotationrate", "wrs"],
    ) {
        return Some((Kind::Rate(axis), &RATES));
    }
    if is(&["a", "f", "force"], &["acc", "ars", "specificforce"]) {
        return Some((Kind::Acceleration(axis), &ACCELERATIONS));
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(header: &str) -> Result<Columns, String> {
        Columns::of(&header.split(',').map(str::to_owned).collect::<Vec<_>>())
    }

    #[test]
    fn headers_of_several_devices() {
        let plain = of("t_s,gx,gy,gz,ax,ay,az").unwrap();
        assert_eq!(plain.time, Column { place: 0, unit: Some(TIMES[0]) });
        assert_eq!((plain.rate[1].place, plain.rate[1].unit, plain.acceleration[2].place), (2, None, 6));
        let swapped = of("time,ax,ay,az,gx,gy,gz").unwrap();
        assert_eq!((swapped.time.unit, swapped.rate[0].place, swapped.acceleration[0].place), (None, 4, 1));
        let euroc = of("#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1],w_RS_S_z [rad s^-1],\
                        a_RS_S_x [m s^-2],a_RS_S_y [m s^-2],a_RS_S_z [m s^-2]")
        .unwrap();
        assert_eq!(euroc.time.unit, Some(TIMES[3]));
        assert_eq!((euroc.rate[2].place, euroc.rate[2].unit), (3, Some(RATES[0])));
        assert_eq!((euroc.acceleration[0].place, euroc.acceleration[0].unit), (4, Some(ACCELERATIONS[0])));
        let phone = of("Time (ms),Gyro_X (°/s),Gyro_Y (°/s),Gyro_Z (°/s),Mag_X (uT),Mag_Y (uT),Mag_Z (uT),\
                        Accel_X (g),Accel_Y (g),Accel_Z (g),Temperature (C)")
        .unwrap();
        assert_eq!((phone.time.unit, phone.rate[0].unit), (Some(TIMES[1]), Some(RATES[1])));
        assert_eq!((phone.acceleration[2].place, phone.acceleration[2].unit), (9, Some(ACCELERATIONS[1])));
        let suffixes =
            of("timestamp_us,gyr_x_dps,gyr_y_dps,gyr_z_dps,acc_x_m_s2,acc_y_m_s2,acc_z_m_s2").unwrap();
        assert_eq!((suffixes.time.unit, suffixes.rate[0].unit), (Some(TIMES[2]), Some(RATES[1])));
        assert_eq!(suffixes.acceleration[0].unit, Some(ACCELERATIONS[0]));
        let ros = of("field.header.stamp,angular_velocity.x,angular_velocity.y,angular_velocity.z,\
                      linear_acceleration.x,linear_acceleration.y,linear_acceleration.z");
        assert!(ros.unwrap_err().contains("no column `t_s`"), "a stamp has to be named as one");
    }

    #[test]
    fn faults_are_named() {
        for (header, expected) in [
            ("t,gx,gy,ax,ay,az", "no column `gz`"),
            ("t,gx,gy,gz,gyro_x,ax,ay,az", "`gx` and `gyro_x` are the same quantity"),
            ("t,gx [furlong],gy,gz,ax,ay,az", "the unit `furlong` is not known; expected rad/s"),
            ("t,gx [deg/s],gy,gz,ax,ay,az", "state different units"),
        ] {
            let message = of(header).unwrap_err();
            assert!(message.contains(expected), "{message}");
        }
    }
}

//! Reading of the rows of an inertial sensor.
//!
//! In: CSV (EuRoC's, or any with a header), separated by commas, semicolons, tabs or blanks. Out: one [`Row`] after the other,
//! in SI units. Invariant: one line is in memory at a time; each fault is an error that names file, row and column, or a
//! reading that is missing.

use super::columns::{ACCELERATIONS, Columns, RATES, TIMES, Unit};
use super::error::BalanceError;
use super::rotation::Vector;
use std::io::{BufRead, Read};
use std::path::{Path, PathBuf};

/// The most bytes of a line.
const MOST_OF_LINE: u64 = 1 << 16;

/// Axes of a sensor in those of the head: the place of each, and its sign.
pub type Axes = [(usize, f64); 3];

/// What the user says about a file, in place of its header.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Format {
    /// Names of the columns, of a file without a header.
    pub columns: Option<Vec<String>>,
    /// Unit of the stamps.
    pub time: Option<Unit>,
    /// Unit of the rates.
    pub rate: Option<Unit>,
    /// Unit of the accelerations.
    pub acceleration: Option<Unit>,
    /// Whether the accelerometer reports gravity (downwards at rest) in place of the specific force.
    pub reports_gravity: bool,
    /// Axes of the gyroscope.
    pub rate_axes: Option<Axes>,
    /// Axes of the accelerometer.
    pub acceleration_axes: Option<Axes>,
}

/// A row.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Row {
    /// Its number in the file, from 1.
    pub number: u64,
    /// Its stamp, ns.
    pub time: i64,
    /// rad/s; `None` if it is missing.
    pub rate: Option<Vector>,
    /// Specific force, m/s²; `None` if it is missing.
    pub force: Option<Vector>,
}

/// The units of a file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Units {
    /// Of stamps, rates, accelerations.
    pub units: [Unit; 3],
    /// Whether the header or the user stated each.
    pub stated: [bool; 3],
}

/// A file that is read row by row.
pub struct Reader<R> {
    path: PathBuf,
    lines: R,
    number: u64,
    separator: Option<char>,
    columns: Columns,
    units: Units,
    format: Format,
    /// A first row that is no header.
    first: Option<String>,
    /// The first stamp, as it is written, and the rows since then.
    begun: Option<(f64, u64)>,
}

impl Reader<std::io::BufReader<std::fs::File>> {
    /// Opens a file.
    ///
    /// # Errors
    /// A file that cannot be read, or has no header that fits.
    pub fn open(path: &Path, format: Format) -> Result<Self, BalanceError> {
        let failed = |source| BalanceError::Read { path: path.to_path_buf(), source };
        let file = std::fs::File::open(path).map_err(failed)?;
        if file.metadata().map_err(failed)?.is_dir() {
            return Err(BalanceError::File { path: path.to_path_buf(), reason: "is a folder".to_owned() });
        }
        Reader::new(path, std::io::BufReader::with_capacity(1 << 16, file), format)
    }
}

impl<R: BufRead> Reader<R> {
    /// Reads the header.
    ///
    /// # Errors
    /// As [`Reader::open`].
    pub fn new(path: &Path, lines: R, format: Format) -> Result<Self, BalanceError> {
        let columns = Columns {
            time: super::columns::Column { place: 0, unit: None },
            rate: [super::columns::Column { place: 0, unit: None }; 3],
            acceleration: [super::columns::Column { place: 0, unit: None }; 3],
            count: 0,
        };
        let units = Units { units: [TIMES[0], RATES[0], ACCELERATIONS[0]], stated: [false; 3] };
        let path = path.to_path_buf();
        let mut reader = Self {
            path,
            lines,
            number: 0,
            separator: None,
            columns,
            units,
            format,
            first: None,
            begun: None,
        };
        let Some(line) = reader.line()? else { return Err(reader.refusal("the file is empty".to_owned())) };
        let line = line.trim_start_matches('\u{feff}').to_owned();
        reader.separator = [',', ';', '\t'].into_iter().find(|separator| line.contains(*separator));
        let cells: Vec<String> = split(&line, reader.separator).map(str::to_owned).collect();
        let is_number = |cell: &String| cell.parse::<f64>().is_ok();
        let names = match (&reader.format.columns, cells.iter().filter(|cell| is_number(cell)).count() > 3) {
            (Some(names), numeric) => {
                if numeric {
                    reader.first = Some(line.clone());
                }
                names.clone()
            }
            (None, false) => cells.clone(),
            (None, true) => {
                return Err(reader.refusal(
                    "row 1 has numbers: there is no header, and the order of the columns cannot be known; add the header \
                     t_s,gx,gy,gz,ax,ay,az, or name the columns: --columns t_s,ax,ay,az,gx,gy,gz"
                        .to_owned(),
                ));
            }
        };
        if reader.first.is_some() && names.len() != cells.len() {
            let (found, expected) = (cells.len(), names.len());
            return Err(reader.refusal(format!("row 1 has {found} cells, but --columns names {expected}")));
        }
        reader.columns = Columns::of(&names).map_err(|reason| reader.refusal(reason))?;
        let (columns, format) = (&reader.columns, &reader.format);
        let stated = [
            format.time.or(columns.time.unit),
            format.rate.or(columns.rate[0].unit),
            format.acceleration.or(columns.acceleration[0].unit),
        ];
        let units = [0, 1, 2].map(|at| stated[at].unwrap_or(reader.units.units[at]));
        reader.units = Units { units, stated: stated.map(|unit| unit.is_some()) };
        Ok(reader)
    }

    /// The units that are used.
    pub fn units(&self) -> Units {
        self.units
    }

    /// The file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// An error of this file.
    pub fn refusal(&self, reason: String) -> BalanceError {
        BalanceError::File { path: self.path.clone(), reason }
    }

    /// The next row; `None` at the end.
    ///
    /// # Errors
    /// A row with another number of cells, a cell that is no number, a stamp that is missing.
    pub fn next_row(&mut self) -> Result<Option<Row>, BalanceError> {
        let line = match self.first.take() {
            Some(line) => line,
            None => match self.line()? {
                Some(line) => line,
                None => return Ok(None),
            },
        };
        let row = self.row(&line).map_err(|reason| self.refusal(format!("row {}: {reason}", self.number)))?;
        let stamp =
            split(&line, self.separator).nth(self.columns.time.place).and_then(|cell| cell.parse().ok());
        self.begun = self.begun.map(|(first, rows)| (first, rows + 1)).or(stamp.map(|stamp| (stamp, 1)));
        Ok(Some(row))
    }

    /// The mean time between rows until a stamp, in the units in which it is written.
    fn period(&self, stamp: &str) -> Option<f64> {
        let (first, rows) = self.begun?;
        Some((stamp.parse::<f64>().ok()? - first) / rows as f64)
    }

    fn row(&self, line: &str) -> Result<Row, String> {
        let cells: Vec<&str> = split(line, self.separator).collect();
        if cells.len() != self.columns.count {
            return Err(format!("{} cells, expected {}", cells.len(), self.columns.count));
        }
        let [time, rate, acceleration] = self.units.units;
        let stamp = cells[self.columns.time.place];
        let time = nanoseconds(stamp, time).ok_or_else(|| not_a_stamp(stamp, time, self.period(stamp)))?;
        let three = |columns: &[super::columns::Column; 3], size: f64, axes: Option<Axes>| {
            let mut values = [0.0; 3];
            for (value, column) in values.iter_mut().zip(columns) {
                let cell = cells[column.place];
                *value = match cell.to_lowercase().as_str() {
                    "" | "nan" | "-nan" | "na" | "null" | "none" | "?" | "inf" | "-inf" => f64::NAN,
                    _ => cell
                        .parse()
                        .map_err(|_| format!("column {}: `{cell}` is not a number", column.place + 1))?,
                };
            }
            if !values.iter().all(|value| value.is_finite()) {
                return Ok(None);
            }
            let axes = axes.unwrap_or([(0, 1.0), (1, 1.0), (2, 1.0)]);
            Ok::<_, String>(Some(axes.map(|(place, sign)| sign * size * values[place])))
        };
        let force = three(
            &self.columns.acceleration,
            if self.format.reports_gravity { -acceleration.size } else { acceleration.size },
            self.format.acceleration_axes,
        )?;
        let rate = three(&self.columns.rate, rate.size, self.format.rate_axes)?;
        Ok(Row { number: self.number, time, rate, force })
    }

    /// The next line that is neither blank nor a comment after the header.
    fn line(&mut self) -> Result<Option<String>, BalanceError> {
        loop {
            let mut bytes = Vec::new();
            let read = self.lines.by_ref().take(MOST_OF_LINE).read_until(b'\n', &mut bytes);
            let length = read.map_err(|source| BalanceError::Read { path: self.path.clone(), source })?;
            if length == 0 {
                return Ok(None);
            }
            self.number += 1;
            let at = self.number;
            if length as u64 == MOST_OF_LINE {
                return Err(self.refusal(format!("row {at}: a line of more than {MOST_OF_LINE} bytes")));
            }
            let text = String::from_utf8(bytes)
                .map_err(|_| self.refusal(format!("row {at}: is no text (UTF-8)")))?;
            let text = text.trim();
            if !text.is_empty() && (at == 1 || !text.starts_with('#')) {
                return Ok(Some(text.to_owned()));
            }
        }
    }
}

fn split(line: &str, separator: Option<char>) -> impl Iterator<Item = &str> {
    let (by, blanks) = match separator {
        Some(separator) => (Some(line.split(separator)), None),
        None => (None, Some(line.split_whitespace())),
    };
    let cells = by.into_iter().flatten().chain(blanks.into_iter().flatten());
    cells.map(|cell| cell.trim().trim_matches('"').trim())
}

/// A stamp in ns, without the rounding of floating point where it is written as a decimal number.
fn nanoseconds(text: &str, unit: Unit) -> Option<i64> {
    let exponent = (unit.size.log10().round() as i32 + 9) as usize;
    let (negative, digits) = match text.strip_prefix('-') {
        Some(digits) => (true, digits),
        None => (false, text),
    };
    let (whole, fraction) = digits.split_once('.').unwrap_or((digits, ""));
    let only_digits = |part: &str| part.bytes().all(|byte| byte.is_ascii_digit());
    if whole.is_empty() && fraction.is_empty() {
        return None;
    }
    if !only_digits(whole) || !only_digits(fraction) {
        // 1.4e9, as some programs print
        let value = text.parse::<f64>().ok()? * unit.size * 1e9;
        return (value.abs() < 9e18).then_some(value.round() as i64);
    }
    let mut value: i64 = 0;
    let places = fraction.bytes().chain(std::iter::repeat(b'0')).take(exponent);
    for digit in whole.bytes().chain(places) {
        value = value.checked_mul(10)?.checked_add(i64::from(digit - b'0'))?;
    }
    Some(if negative { -value } else { value })
}

/// Why a stamp is refused: a number that is too large for its unit suits another one, by the time between rows where that is known.
fn not_a_stamp(text: &str, unit: Unit, period: Option<f64>) -> String {
    let number = text.parse::<f64>().ok().filter(|number| number.is_finite());
    let usual = |unit: &Unit| period.is_some_and(|period| (1e-4..=0.2).contains(&(period * unit.size)));
    let suits = |number: f64| {
        let in_time = |unit: &Unit| number.abs() * unit.size < 9e9;
        TIMES.into_iter().find(usual).filter(in_time).or(TIMES.into_iter().find(in_time))
    };
    match number.and_then(suits) {
        Some(other) if other.size < unit.size => format!(
            "`{text}` is beyond all stamps in {}; in {} it is a time of our days, a factor of {:e}: --time-unit {}",
            unit.name,
            other.name,
            other.size / unit.size,
            other.name
        ),
        _ => format!("`{text}` is not a stamp in {}", unit.name),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rows(text: &str, format: Format) -> Result<Vec<Row>, BalanceError> {
        let mut reader = Reader::new(Path::new("imu.csv"), text.as_bytes(), format)?;
        let mut rows = Vec::new();
        while let Some(row) = reader.next_row()? {
            rows.push(row);
        }
        Ok(rows)
    }

    #[test]
    fn units_and_stamps_by_the_header() {
        let text = "t_ms;gx [deg/s];gy [deg/s];gz [deg/s];ax [g];ay [g];az [g]\r\n\r\n1403636579743.555584;180;0;0;0;0;1\r\n";
        let found = rows(text, Format::default()).unwrap();
        // 1403636579743.555584 ms; 180 °/s is π rad/s; 1 g is 9.80665 m/s².
        assert_eq!((found[0].number, found[0].time), (3, 1_403_636_579_743_555_584));
        assert!((found[0].rate.unwrap()[0] - std::f64::consts::PI).abs() < 1e-15);
        assert_eq!(found[0].force, Some([0.0, 0.0, 9.80665]));
    }

    #[test]
    fn what_the_user_says_counts() {
        let turned = Format {
            columns: Some(["t", "ax", "ay", "az", "gx", "gy", "gz"].map(str::to_owned).to_vec()),
            rate: Some(RATES[1]),
            time: Some(TIMES[1]),
            reports_gravity: true,
            rate_axes: Some([(1, 1.0), (0, -1.0), (2, 1.0)]),
            ..Format::default()
        };
        let found = rows("10,0,0,-9.8,90,180,0\n20,nan,0,-9.8,90,180,\n", turned).unwrap();
        assert_eq!((found[0].time, found[1].time), (10_000_000, 20_000_000));
        let [x, y, _] = found[0].rate.unwrap();
        assert!((x - std::f64::consts::PI).abs() < 1e-15 && (y + std::f64::consts::FRAC_PI_2).abs() < 1e-15);
        assert_eq!(found[0].force.unwrap()[2], 9.8);
        assert_eq!((found[1].rate, found[1].force), (None, None), "missing");
    }

    #[test]
    fn stamps_are_exact() {
        assert_eq!(nanoseconds("1403636579.743555584", TIMES[0]), Some(1_403_636_579_743_555_584));
        assert_eq!(nanoseconds("-0.5", TIMES[0]), Some(-500_000_000));
        assert_eq!(nanoseconds("1.5e3", TIMES[1]), Some(1_500_000_000));
        assert_eq!(nanoseconds("1403636579743555584", TIMES[3]), Some(1_403_636_579_743_555_584));
        for wrong in ["", ".", "-", "x", "nan", "1403636579743555584000"] {
            assert_eq!(nanoseconds(wrong, TIMES[0]), None, "{wrong}");
        }
    }

    #[test]
    fn stamps_in_ns_from_zero_are_named_by_their_period() {
        // 100 Hz in ns, read as s: 10 ms are 10⁷ s, and 923 rows are more than i64 holds in ns.
        let rows_of = |count: u64| (0..count).map(|row| format!("{},0,0,0,0,0,1\n", 10_000_000 * row));
        let text = format!("t,gx,gy,gz,ax,ay,az\n{}", rows_of(1000).collect::<String>());
        let message = rows(&text, Format::default()).unwrap_err().to_string();
        assert!(message.contains("row 925") && message.contains("--time-unit ns"), "{message}");
    }

    #[test]
    fn faults_name_file_and_row() {
        for (text, expected) in [
            ("", "`imu.csv`: the file is empty"),
            ("0,0,0,0,0,0,9.8\n", "there is no header"),
            ("t,gx,gy,gz,ax,ay,az\n0,0,0\n", "row 2: 3 cells, expected 7"),
            ("t,gx,gy,gz,ax,ay,az\n0,0,0,0,0,0,1\nx,0,0,0,0,0,1\n", "row 3: `x` is not a stamp in s"),
            (
                "t,gx,gy,gz,ax,ay,az\n1403636579743555584,0,0,0,0,0,1\n",
                "row 2: `1403636579743555584` is beyond all stamps in s; in ns it is a time of our days, a factor of 1e-9",
            ),
            ("t,gx,gy,gz,ax,ay,az\n0,0,0,0,0,y,1\n", "row 2: column 6: `y` is not a number"),
        ] {
            let message = rows(text, Format::default()).unwrap_err().to_string();
            assert!(message.contains(expected), "{message}");
        }
    }
}

//! The estimates of a recording, as a table.
//!
//! In: instants. Out: CSV, a row for each row of the recording: estimates, then their deviations, then what happened. Invariant: a
//! file appears whole or not at all; a pipe or a device is written as it goes.

use super::error::BalanceError;
use super::stream::Instant;
use atomic_write_file::AtomicWriteFile;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

/// The columns of estimates; each has a column `sd_…`.
const ESTIMATES: [&str; 13] =
    ["qw", "qx", "qy", "qz", "wx", "wy", "wz", "grav_x", "grav_y", "grav_z", "acc_x", "acc_y", "acc_z"];

/// The name of the last column, which states the convention.
const EVENT: &str = "event [q: w first; sensor to world; z up]";

/// Where the table goes.
enum Target {
    Whole(BufWriter<AtomicWriteFile>),
    Direct(BufWriter<File>),
}

/// A table that is being written.
pub struct Table {
    path: PathBuf,
    target: Target,
    line: String,
}

impl Table {
    /// Begins a table.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn create(path: &Path) -> Result<Self, BalanceError> {
        let failed = |source| BalanceError::Write { path: path.to_path_buf(), source };
        let is_special = std::fs::metadata(path).is_ok_and(|data| !data.is_file());
        let target = if is_special {
            Target::Direct(BufWriter::new(File::options().write(true).open(path).map_err(failed)?))
        } else {
            Target::Whole(BufWriter::new(AtomicWriteFile::open(path).map_err(failed)?))
        };
        let mut table = Self { path: path.to_path_buf(), target, line: String::new() };
        let deviations = ESTIMATES.map(|name| format!("sd_{name}"));
        table.line = format!("t_s,{},{},sd_heading,{EVENT}\n", ESTIMATES.join(","), deviations.join(","));
        table.flush()?;
        Ok(table)
    }

    /// Writes a row.
    ///
    /// # Errors
    /// As [`Table::create`].
    pub fn write(&mut self, instant: &Instant) -> Result<(), BalanceError> {
        use std::fmt::Write as _;
        let it = &instant.estimate;
        self.line.clear();
        self.line.push_str(&seconds(instant.time));
        let values = it.orientation.iter().chain(&it.rate).chain(&it.gravity).chain(&it.acceleration);
        let deviations =
            it.sd_orientation.iter().chain(&it.sd_rate).chain(&it.sd_gravity).chain(&it.sd_acceleration);
        for value in values {
            let _ = write!(self.line, ",{value:.9}");
        }
        for value in deviations.chain([&it.sd_heading]) {
            let _ = write!(self.line, ",{value:.4e}");
        }
        let _ = writeln!(self.line, ",{}", instant.events.names().join(" "));
        self.flush()
    }

    /// Puts the whole table in its place.
    ///
    /// # Errors
    /// As [`Table::create`].
    pub fn finish(self) -> Result<(), BalanceError> {
        let path = self.path;
        let done = match self.target {
            Target::Direct(mut file) => file.flush(),
            Target::Whole(file) => file
                .into_inner()
                .map_err(std::io::IntoInnerError::into_error)
                .and_then(AtomicWriteFile::commit),
        };
        done.map_err(|source| BalanceError::Write { path, source })
    }

    fn flush(&mut self) -> Result<(), BalanceError> {
        let written = match &mut self.target {
            Target::Whole(file) => file.write_all(self.line.as_bytes()),
            Target::Direct(file) => file.write_all(self.line.as_bytes()),
        };
        written.map_err(|source| BalanceError::Write { path: self.path.clone(), source })
    }
}

/// A stamp in s, with all its digits.
fn seconds(time: i64) -> String {
    let size = time.unsigned_abs();
    let sign = if time < 0 { "-" } else { "" };
    let text = format!("{sign}{}.{:09}", size / 1_000_000_000, size % 1_000_000_000);
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

#[cfg(test)]
mod tests {
    use super::seconds;

    #[test]
    fn stamps_keep_their_digits() {
        assert_eq!(seconds(1_403_636_579_743_555_584), "1403636579.743555584");
        assert_eq!(
            (seconds(-500_000_000), seconds(0), seconds(2_000_000_000)),
            ("-0.5".into(), "0".into(), "2".into())
        );
    }
}

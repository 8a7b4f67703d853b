//! Places of the body over time, measured from outside: EuRoC's ground truth, or a tracker.
//!
//! In: a CSV file whose rows begin with the time in ns, the position in m and the orientation (w first, body to world). Out: the
//! position over time, in the axes that the body
//! had at a given time. Invariant: times increase, each number is finite, and
//! a place is interpolated only between rows that are close.

use crate::error::Error;
use crate::input;
use crate::vestibular::rotation;
use crate::vision::VisionError;
use std::path::Path;

/// Rows that are further apart, ns, do not say where the body was between them.
const CLOSE_NS: i64 = 500_000_000;

/// The poses of a file.
#[derive(Clone, Debug)]
pub struct Poses {
    /// Time, ns, and position, m.
    places: Vec<(i64, [f64; 3])>,
}

impl Poses {
    /// Reads a file; positions are given in the axes that the body had at the time `begin`, ns.
    ///
    /// # Errors
    /// A file that cannot be read; a row of fewer than eight numbers, or with one that is not finite; times that do not increase; an
    /// orientation that is no rotation; no rows.
    pub fn read(path: &Path, begin: i64) -> Result<Self, Error> {
        let text = input::text(path, input::MOST_BYTES)?;
        let wrong = |reason| VisionError::File { path: path.to_path_buf(), reason };
        Ok(Self { places: places(&text, begin).map_err(wrong)? })
    }

    /// The position at a time, m; `None` before the first row, after the last one, and where rows are missing.
    pub fn at(&self, time: i64) -> Option<[f64; 3]> {
        let next = self.places.partition_point(|place| place.0 < time);
        let (after, to) = *self.places.get(next)?;
        if after == time {
            return Some(to);
        }
        let (before, from) = *self.places.get(next.checked_sub(1)?)?;
        let step = after - before;
        let part = (time - before) as f64 / step as f64;
        (step <= CLOSE_NS).then(|| std::array::from_fn(|axis| from[axis] + part * (to[axis] - from[axis])))
    }
}

fn places(text: &str, begin: i64) -> Result<Vec<(i64, [f64; 3])>, String> {
    let (mut places, mut orientations): (Vec<(i64, [f64; 3])>, Vec<_>) = (Vec::new(), Vec::new());
    let rows = text.lines().enumerate();
    for (row, line) in rows.filter(|(_, line)| !line.trim().is_empty() && !line.starts_with('#')) {
        let row = row + 1;
        let cells: Vec<&str> = line.split(',').map(str::trim).collect();
        if cells.len() < 8 {
            return Err(format!(
                "row {row}: {} cells, expected time, position and orientation: 8",
                cells.len()
            ));
        }
        let time = cells[0].parse().map_err(|_| format!("row {row}: `{}` is not a time in ns", cells[0]))?;
        let mut numbers = [0.0; 7];
        for (number, cell) in numbers.iter_mut().zip(&cells[1..]) {
            let finite = cell.parse().ok().filter(|number: &f64| number.is_finite());
            *number = finite.ok_or_else(|| format!("row {row}: `{cell}` is not a finite number"))?;
        }
        let [x, y, z, quaternion @ ..] = numbers;
        let length = quaternion.iter().map(|part| part * part).sum::<f64>().sqrt();
        if !(0.9..1.1).contains(&length) {
            return Err(format!("row {row}: the quaternion has length {length:.3}, expected 1"));
        }
        if places.last().is_some_and(|last| last.0 >= time) {
            return Err(format!("row {row}: time {time} is not after the previous one"));
        }
        places.push((time, [x, y, z]));
        orientations.push(rotation::normalised(quaternion));
    }
    let last = places.len().checked_sub(1).ok_or("no rows of numbers")?;
    let begins = places.partition_point(|place| place.0 < begin).min(last);
    let to_body = rotation::transposed(&rotation::matrix(orientations[begins]));
    Ok(places.into_iter().map(|(time, place)| (time, rotation::apply(&to_body, place))).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_between_close_rows() {
        // The body is turned by 90° to the left: its x axis is the world's y.
        let h = std::f64::consts::FRAC_1_SQRT_2;
        let text = format!("#t\n0,1,2,3,{h},0,0,{h}\n100000000,1,3,3,1,0,0,0,9\n900000000,1,3,4,1,0,0,0\n");
        let poses = Poses { places: places(&text, 0).unwrap() };
        let near = |time, expected: [f64; 3]| {
            let (found, first) = (poses.at(time).unwrap(), poses.at(0).unwrap());
            (0..3).for_each(|axis| {
                let moved = found[axis] - first[axis];
                assert!((moved - expected[axis]).abs() < 1e-12, "{time}: {found:?}");
            });
        };
        near(25_000_000, [0.25, 0.0, 0.0]);
        near(900_000_000, [1.0, 0.0, 1.0]);
        assert_eq!((poses.at(-1), poses.at(500_000_000), poses.at(900_000_001)), (None, None, None));
    }

    #[test]
    fn faults_name_the_row() {
        for (text, expected) in [
            ("#t\n", "no rows"),
            ("1,0,0,0,1,0,0\n", "row 1: 7 cells"),
            ("1,0,0,0,1,0,0,0\n2,0,inf,0,1,0,0,0\n", "row 2: `inf` is not a finite number"),
            ("1,0,0,0,2,0,0,0\n", "row 1: the quaternion has length 2.000"),
            ("2,0,0,0,1,0,0,0\n2,0,0,0,1,0,0,0\n", "row 2: time 2 is not after"),
        ] {
            let message = places(text, 0).unwrap_err();
            assert!(message.contains(expected), "{message}");
        }
    }
}

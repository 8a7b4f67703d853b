//! Portable float maps (PFM).
//!
//! In: rows of numbers from the top. Out: a PFM file: `Pf`, width and height, −1 (least significant byte first), then
//! the rows from the bottom; and back. Lines of the header may end in CRLF. Infinity means no value. Invariant: a file
//! is written completely or not at all; nothing is allocated before the file has been checked against its declared
//! size. Reference: P. Debevec's PFM, as the Middlebury stereo pages use it.

use super::VisionError;
use super::image::check_size;
use super::netpbm::data_start;
use crate::input;
use crate::report::write_atomically;
use std::path::Path;

/// A field of numbers, row by row from the top.
#[derive(Clone, Debug, PartialEq)]
pub struct Field {
    /// Width, pixels.
    pub width: usize,
    /// Values; infinity where there is none.
    pub values: Vec<f32>,
}

/// Writes a field.
///
/// # Errors
/// A file that cannot be written.
pub fn write(path: &Path, width: usize, values: &[f32]) -> Result<(), crate::error::Error> {
    let mut bytes = format!("Pf\n{width} {}\n-1.0\n", values.len() / width.max(1)).into_bytes();
    bytes.reserve(4 * values.len());
    for value in values.chunks_exact(width.max(1)).rev().flatten() {
        bytes.extend_from_slice(&value.to_le_bytes());
    }
    Ok(write_atomically(path, &bytes)?)
}

/// Reads a field.
///
/// # Errors
/// A file that cannot be read, is longer than 256 MiB, or is not a PFM with one channel.
pub fn read(path: &Path) -> Result<Field, VisionError> {
    let bytes = input::bytes(path, input::MOST_BYTES)?;
    decode(&bytes).map_err(|reason| VisionError::File { path: path.to_path_buf(), reason })
}

fn decode(bytes: &[u8]) -> Result<Field, String> {
    let mut at = 0;
    let mut word = |what: &str| {
        let start = at + bytes[at..].iter().take_while(|byte| byte.is_ascii_whitespace()).count();
        let length = bytes[start..].iter().take_while(|byte| !byte.is_ascii_whitespace()).take(40).count();
        at = start + length;
        let word = std::str::from_utf8(&bytes[start..at]).unwrap_or("");
        if word.is_empty() { Err(format!("the PFM has no {what}")) } else { Ok(word) }
    };
    let magic = word("magic word")?;
    if magic != "Pf" {
        return Err(format!("begins with `{magic}`, expected `Pf`, a PFM of one channel"));
    }
    let mut number =
        |what: &str| word(what)?.parse::<f64>().map_err(|_| format!("the PFM's {what} is not a number"));
    let (width, height, scale) = (number("width")?, number("height")?, number("scale")?);
    let (width, height) = (width.max(0.0) as usize, height.max(0.0) as usize);
    check_size(width, height)?;
    let needed = 4 * width * height;
    let start = data_start(bytes, at, needed);
    let data = start.and_then(|start| bytes.get(start..start + needed));
    let data = data.ok_or_else(|| format!("the PFM is truncated: {width}x{height} needs {needed} bytes"))?;
    let value =
        |four: &[u8; 4]| if scale < 0.0 { f32::from_le_bytes(*four) } else { f32::from_be_bytes(*four) };
    let values: Vec<f32> = data.as_chunks().0.iter().map(value).collect();
    Ok(Field { width, values: values.chunks_exact(width).rev().flatten().copied().collect() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_by_hand() {
        // Two rows of one: the lower one comes first.
        let bytes =
            [b"Pf\n1 2\n-1.0\n".as_slice(), &1.5f32.to_le_bytes(), &f32::INFINITY.to_le_bytes()].concat();
        let field = Field { width: 1, values: vec![f32::INFINITY, 1.5] };
        assert_eq!(decode(&bytes).unwrap(), field);
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("d.pfm");
        write(&path, 1, &field.values).unwrap();
        assert_eq!(std::fs::read(&path).unwrap(), bytes);
        assert_eq!(read(&path).unwrap(), field);
        let other = [b"Pf\n1 1\n1.0\n".as_slice(), &2.5f32.to_be_bytes()].concat();
        assert_eq!(decode(&other).unwrap().values, [2.5]);
    }

    #[test]
    fn lines_of_the_header_may_end_in_crlf() {
        let values = [1.5f32, -2.25];
        let data: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
        for header in ["Pf\r\n2 1\r\n-1.0\r\n", "Pf\n2 1\n-1.0\r\n", "Pf 2 1 -1.0\r\n", "Pf\r2 1\r-1.0\r"] {
            let bytes = [header.as_bytes(), &data].concat();
            assert_eq!(decode(&bytes).unwrap().values, values, "{header:?}");
            if header.starts_with("Pf\r\n") {
                // One byte short: the data must not be read as other numbers.
                let message = decode(&bytes[..bytes.len() - 1]).unwrap_err();
                assert!(message.contains("truncated"), "{message}");
            }
        }
        // A lone CR ends the header; the data begin with LF: 0x0a = 10, the least byte of a small number.
        let number = f32::from_le_bytes([0x0a, 0, 0, 0x3f]);
        let bytes = [b"Pf 1 1 -1.0\r".as_slice(), &number.to_le_bytes()].concat();
        assert_eq!(decode(&bytes).unwrap().values, [number]);
    }

    #[test]
    fn broken_files_are_refused_with_the_reason() {
        for (bytes, expected) in [
            (b"".as_slice(), "no magic word"),
            (b"PF\n1 1\n-1\n", "expected `Pf`"),
            (b"Pf\nwide 1\n-1\n", "width is not a number"),
            (b"Pf\n0 1\n-1\n", "0x1"),
            (b"Pf\n2 2\n-1\n1234", "truncated: 2x2 needs 16 bytes"),
        ] {
            let message = decode(bytes).unwrap_err();
            assert!(message.contains(expected), "{message}");
        }
    }
}

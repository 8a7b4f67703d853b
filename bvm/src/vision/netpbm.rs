//! Binary PGM (P5) and PPM (P6) images.
//!
//! In: the bytes of a file. Out: a [`GreyImage`], or an error in the bytes. Header: magic, width, height, largest value
//! (1..=65535), separated by white space and `#` comments, then one white space (or CRLF) and the samples (two bytes
//! each, most significant first, when the largest value exceeds 255). Invariant: nothing is allocated before the file
//! has been checked against its declared size. Reference: the `pgm` and `ppm` pages of the Netpbm documentation.

use super::image::{GreyImage, check_size, grey};

/// Decodes the first image of a binary PGM or PPM file.
pub(crate) fn decode(bytes: &[u8]) -> Result<GreyImage, String> {
    let (name, channels) = if bytes.starts_with(b"P6") { ("PPM", 3) } else { ("PGM", 1) };
    let mut at = 2;
    let width = number(bytes, &mut at, name, "width")?;
    let height = number(bytes, &mut at, name, "height")?;
    let largest = number(bytes, &mut at, name, "largest value")?;
    check_size(width, height)?;
    if !(1..=65_535).contains(&largest) {
        return Err(format!("the largest value of the {name} is {largest}, expected 1..=65535"));
    }
    let sample_bytes = if largest > 255 { 2 } else { 1 };
    let needed = width * height * channels * sample_bytes;
    at = data_start(bytes, at, needed)
        .ok_or_else(|| format!("the header of the {name} does not end in white space"))?;
    let found = bytes.len() - at;
    let Some(data) = bytes.get(at..at + needed) else {
        return Err(format!("the {name} is truncated: {width}x{height} needs {needed} bytes, found {found}"));
    };
    let scale = 255.0 / largest as f32;
    let whole = |at: usize| match sample_bytes {
        1 => u16::from(data[at]),
        _ => u16::from_be_bytes([data[2 * at], data[2 * at + 1]]),
    };
    grey(width, height, channels, |at| f32::from(whole(at)) * scale)
}

/// The offset of the data after a header that ends at `at`: one white space later, or two bytes later with CRLF line
/// endings. CRLF is distinguished from a CR before data that begin with LF by the other lines of the header, or by the
/// `needed` bytes of data. `None` without white space there.
pub(super) fn data_start(bytes: &[u8], at: usize, needed: usize) -> Option<usize> {
    let crlf = bytes.get(at..)?.starts_with(b"\r\n");
    let ends_lines = || bytes[..at].windows(2).any(|pair| pair == b"\r\n");
    if crlf && (ends_lines() || bytes.len() >= at + 2 + needed) {
        return Some(at + 2);
    }
    bytes.get(at)?.is_ascii_whitespace().then_some(at + 1)
}

/// The next decimal number of the header; `at` moves past it.
fn number(bytes: &[u8], at: &mut usize, name: &str, what: &str) -> Result<usize, String> {
    loop {
        match bytes.get(*at) {
            Some(b'#') => *at += bytes[*at..].iter().take_while(|&&byte| byte != b'\n').count(),
            Some(byte) if byte.is_ascii_whitespace() => *at += 1,
            _ => break,
        }
    }
    let digits: Vec<u8> = bytes[*at..].iter().copied().take_while(u8::is_ascii_digit).take(20).collect();
    *at += digits.len();
    std::str::from_utf8(&digits)
        .ok()
        .and_then(|text| text.parse().ok())
        .ok_or_else(|| format!("the header of the {name} has no {what}"))
}

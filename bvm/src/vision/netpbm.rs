//! Binary PGM (P5) and PPM (P6) images.
//!
//! In: the bytes of a file. Out: a [`GreyImage`], or what is wrong with the bytes. Header: magic, width,
//! height, largest value (1..=65535), separated by white space and `#` comments, then one white space and the
//! samples (two bytes each, most significant first, when the largest value exceeds 255).
//! Invariant: nothing is allocated before the announced size has been found in the file.
//! Reference: the `pgm` and `ppm` pages of the Netpbm documentation.

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
    match bytes.get(at) {
        Some(byte) if byte.is_ascii_whitespace() => at += 1,
        _ => return Err(format!("the header of the {name} does not end in white space")),
    }
    let sample_bytes = if largest > 255 { 2 } else { 1 };
    let needed = width * height * channels * sample_bytes;
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

/// The next decimal number of the header; `at` moves behind it.
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

//! Grey images, the input of the matcher.
//!
//! In: PNG (any depth and colour type) or binary PGM/PPM files. Out: [`GreyImage`], intensities in 0..=255,
//! row by row from the top left; colour becomes luma (ITU-R BT.601: 0.299 R + 0.587 G + 0.114 B), 16-bit
//! values are scaled by 1/257, transparency is ignored. Also writes RGB pictures.
//! Invariant: `pixels.len() == width * height > 0` and every pixel is finite and within 0..=255; sizes are
//! checked before anything of that size is allocated.

use std::io::Cursor;
use std::path::Path;

use super::error::VisionError;
use super::netpbm;
use crate::input;

/// Limit of the number of pixels that an image file may declare (2^25, about 33 million).
pub const MAX_PIXELS: usize = 1 << 25;

/// An image of intensities.
#[derive(Debug, Clone, PartialEq)]
pub struct GreyImage {
    width: usize,
    height: usize,
    pixels: Vec<f32>,
}

impl GreyImage {
    /// Checks sizes and values: `pixels` holds `width * height` intensities in 0..=255, row by row.
    pub fn new(width: usize, height: usize, pixels: Vec<f32>) -> Result<Self, VisionError> {
        let wrong = |reason: String| Err(VisionError::Pixels { reason });
        if let Err(reason) = check_size(width, height) {
            return wrong(reason);
        }
        if pixels.len() != width * height {
            return wrong(format!(
                "{width}x{height} needs {} pixels, found {}",
                width * height,
                pixels.len()
            ));
        }
        if let Some(at) = pixels.iter().position(|value| !(0.0..=255.0).contains(value)) {
            let (x, y, value) = (at % width, at / width, pixels[at]);
            return wrong(format!("pixel ({x}, {y}) is {value}, expected 0..=255"));
        }
        Ok(Self { width, height, pixels })
    }

    /// Width, pixels.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Height, pixels.
    pub fn height(&self) -> usize {
        self.height
    }

    /// Intensities 0..=255, row by row from the top left.
    pub fn pixels(&self) -> &[f32] {
        &self.pixels
    }
}

/// Reads a PNG, PGM (P5) or PPM (P6) file; the content decides, not the name.
pub fn read(path: &Path) -> Result<GreyImage, VisionError> {
    let wrong = |reason: String| VisionError::File { path: path.to_path_buf(), reason };
    decode(&input::bytes(path, input::MOST_BYTES)?).map_err(wrong)
}

/// Decodes the bytes of an image file, or returns the error.
pub(crate) fn decode(bytes: &[u8]) -> Result<GreyImage, String> {
    match bytes {
        [] => Err("the file is empty, expected an image".into()),
        [0x89, b'P', b'N', b'G', ..] => decode_png(bytes),
        [b'P', b'5' | b'6', ..] => netpbm::decode(bytes),
        _ => Err("not an image: expected PNG, or binary PGM (P5) or PPM (P6)".into()),
    }
}

/// Refuses sizes of zero and sizes beyond [`MAX_PIXELS`].
pub(crate) fn check_size(width: usize, height: usize) -> Result<(), String> {
    match width.checked_mul(height) {
        Some(0) => Err(format!("the image is {width}x{height}, expected at least one pixel")),
        Some(count) if count <= MAX_PIXELS => Ok(()),
        _ => Err(format!("the image is {width}x{height}, expected at most {MAX_PIXELS} pixels")),
    }
}

/// The luma of one colour, in the unit of its parts.
fn luma(red: f32, green: f32, blue: f32) -> f32 {
    0.299 * red + 0.587 * green + 0.114 * blue
}

fn decode_png(bytes: &[u8]) -> Result<GreyImage, String> {
    let wrong = |error: png::DecodingError| match &error {
        png::DecodingError::IoError(source) if source.kind() == std::io::ErrorKind::UnexpectedEof => {
            "the PNG is truncated".to_string()
        }
        _ => format!("broken PNG: {error}"),
    };
    let mut decoder = png::Decoder::new(Cursor::new(bytes));
    decoder.set_transformations(png::Transformations::EXPAND);
    let header = decoder.read_header_info().map_err(wrong)?;
    let (width, height) = (header.width as usize, header.height as usize);
    check_size(width, height)?;
    let mut reader = decoder.read_info().map_err(wrong)?;
    let size = reader.output_buffer_size().ok_or("the PNG does not fit in memory")?;
    let mut data = vec![0; size];
    let frame = reader.next_frame(&mut data).map_err(wrong)?;
    let channels = frame.color_type.samples();
    let wide = frame.bit_depth == png::BitDepth::Sixteen;
    if data.len() < width * height * channels * if wide { 2 } else { 1 } {
        return Err("the PNG contains fewer pixels than it declares".into());
    }
    if wide {
        let sample = |at: usize| f32::from(u16::from_be_bytes([data[2 * at], data[2 * at + 1]])) / 257.0;
        grey(width, height, channels, sample)
    } else {
        grey(width, height, channels, |at| f32::from(data[at]))
    }
}

/// Makes an image of samples in 0..=255, found by their index; each pixel has `channels` of them (1: grey,
/// 2: grey and alpha, 3: RGB, 4: RGB and alpha).
pub(crate) fn grey(
    width: usize,
    height: usize,
    channels: usize,
    sample: impl Fn(usize) -> f32,
) -> Result<GreyImage, String> {
    let pixel = |at: usize| {
        let first = at * channels;
        let value = if channels < 3 {
            sample(first)
        } else {
            luma(sample(first), sample(first + 1), sample(first + 2))
        };
        value.clamp(0.0, 255.0)
    };
    let pixels = (0..width * height).map(pixel).collect();
    GreyImage::new(width, height, pixels).map_err(|error| error.to_string())
}

/// Writes an 8-bit RGB PNG: `rgb` holds `width * height` colours, row by row. The file appears whole or not
/// at all.
pub fn write_png_rgb(path: &Path, width: usize, height: usize, rgb: &[u8]) -> Result<(), VisionError> {
    if let Err(reason) = check_size(width, height) {
        return Err(VisionError::Pixels { reason });
    }
    if rgb.len() != 3 * width * height {
        let reason =
            format!("{width}x{height} in RGB needs {} bytes, found {}", 3 * width * height, rgb.len());
        return Err(VisionError::Pixels { reason });
    }
    let failed = |source| VisionError::Write { path: path.to_path_buf(), source };
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width as u32, height as u32);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder
        .write_header()
        .and_then(|mut writer| writer.write_image_data(rgb).and_then(|()| writer.finish()))
        .map_err(|error| failed(std::io::Error::other(error)))?;
    bp_core::compiler::files::write(path, &bytes).map_err(failed)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// A PNG of the type and depth given.
    fn png_of(width: u32, height: u32, color: png::ColorType, depth: png::BitDepth, data: &[u8]) -> Vec<u8> {
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, width, height);
        encoder.set_color(color);
        encoder.set_depth(depth);
        if color == png::ColorType::Indexed {
            encoder.set_palette(vec![0, 0, 0, 255, 0, 0]);
        }
        let mut writer = encoder.write_header().unwrap();
        writer.write_image_data(data).unwrap();
        writer.finish().unwrap();
        bytes
    }

    fn close(found: &GreyImage, expected: &[f32]) {
        assert_eq!(found.pixels().len(), expected.len());
        for (found, expected) in found.pixels().iter().zip(expected) {
            assert!((found - expected).abs() < 1e-3, "{found} is not {expected}");
        }
    }

    #[test]
    fn every_kind_of_png_becomes_grey() {
        use png::{BitDepth::*, ColorType::*};
        let red = 0.299 * 255.0;
        let cases: [(_, _, &[u8], [f32; 2]); 7] = [
            (Grayscale, Eight, &[7, 200], [7.0, 200.0]),
            (Grayscale, Sixteen, &[0xff, 0xff, 0x01, 0x01], [255.0, 1.0]),
            (Grayscale, One, &[0b0100_0000], [0.0, 255.0]),
            (GrayscaleAlpha, Eight, &[7, 0, 200, 255], [7.0, 200.0]),
            (Rgb, Eight, &[255, 0, 0, 10, 10, 10], [red, 10.0]),
            (Rgba, Eight, &[255, 0, 0, 9, 10, 10, 10, 0], [red, 10.0]),
            (Indexed, Eight, &[1, 0], [red, 0.0]),
        ];
        for (color, depth, data, expected) in cases {
            let image = decode(&png_of(2, 1, color, depth, data)).unwrap();
            assert_eq!((image.width(), image.height()), (2, 1));
            close(&image, &expected);
        }
    }

    #[test]
    fn netpbm_by_hand() {
        close(&decode(b"P5 2 1 255\n\x07\xc8").unwrap(), &[7.0, 200.0]);
        close(&decode(b"P5\n# a note\n2 1\n# and one\n100\n\x64\x32").unwrap(), &[255.0, 127.5]);
        // Lines of the header that end in CRLF; and a CR before data that begin with LF.
        close(&decode(b"P5\r\n2 1\r\n255\r\n\x07\xc8").unwrap(), &[7.0, 200.0]);
        close(&decode(b"P5\n2 1\n255\r\n\x07\xc8").unwrap(), &[7.0, 200.0]);
        close(&decode(b"P5 2 1 255\r\n\xc8").unwrap(), &[10.0, 200.0]);
        close(&decode(b"P5 1 2 65535\n\xff\xff\x01\x01").unwrap(), &[255.0, 1.0]);
        close(&decode(b"P6 1 1 255\n\x00\xff\x00").unwrap(), &[0.587 * 255.0]);
    }

    #[test]
    fn broken_bytes_are_refused_with_the_reason() {
        let whole = png_of(2, 2, png::ColorType::Grayscale, png::BitDepth::Eight, &[1, 2, 3, 4]);
        let mut zero = whole.clone();
        zero[16..20].fill(0);
        let huge = b"P5 4000000 4000000 255\n";
        let cases: [(&[u8], &str); 13] = [
            (b"", "empty"),
            (b"GIF89a", "expected PNG"),
            (&whole[..8], "truncated"),
            (&whole[..whole.len() - 16], "truncated"),
            (&zero, "PNG"),
            (b"P5 2 2 255\n\x01\x02", "truncated: 2x2 needs 4 bytes, found 2"),
            (b"P5\r\n2 2\r\n255\r\n\x01\x02\x03", "truncated: 2x2 needs 4 bytes, found 3"),
            (b"P5 0 2 255\n", "0x2"),
            (b"P5 2", "no height"),
            (b"P5 -2 2 255\n", "no width"),
            (b"P5 2 2 70000\n", "70000, expected 1..=65535"),
            (huge, "4000000x4000000, expected at most"),
            (b"P5 99999999999999999999 1 255\n", "no width"),
        ];
        for (bytes, expected) in cases {
            let message = decode(bytes).unwrap_err();
            assert!(message.contains(expected), "{message}");
        }
        // A PNG that declares 2^31 - 1 by 2^31 - 1 pixels is refused before allocation.
        let mut absurd = png_of(1, 1, png::ColorType::Grayscale, png::BitDepth::Eight, &[0]);
        absurd[16..24].copy_from_slice(&[0x7f, 0xff, 0xff, 0xff, 0x7f, 0xff, 0xff, 0xff]);
        assert!(decode(&absurd).is_err());
    }

    #[test]
    fn pixels_are_checked() {
        for (width, height, pixels) in [
            (0, 1, vec![]),
            (2, 1, vec![1.0]),
            (1, 1, vec![f32::NAN]),
            (1, 1, vec![256.0]),
            (1, 1, vec![-1.0]),
        ] {
            assert!(GreyImage::new(width, height, pixels).is_err());
        }
        assert!(GreyImage::new(usize::MAX, 2, vec![]).is_err());
    }

    #[test]
    fn pictures_are_written_whole_or_not_at_all() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("red.png");
        write_png_rgb(&path, 1, 2, &[255, 0, 0, 20, 20, 20]).unwrap();
        close(&read(&path).unwrap(), &[0.299 * 255.0, 20.0]);
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
        assert!(write_png_rgb(&path, 1, 2, &[255]).is_err());
        let nowhere = folder.path().join("missing").join("red.png");
        let message = write_png_rgb(&nowhere, 1, 1, &[0; 3]).unwrap_err().to_string();
        assert!(message.contains("red.png"), "{message}");
    }

    #[test]
    fn files_are_named_in_errors() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("left.png");
        assert!(read(&path).unwrap_err().to_string().contains("left.png"));
        std::fs::write(&path, b"").unwrap();
        let message = read(&path).unwrap_err().to_string();
        assert!(message.contains("left.png") && message.contains("empty"), "{message}");
        assert!(read(folder.path()).is_err());
    }

    fn samples() -> [Vec<u8>; 3] {
        let ramp: Vec<u8> = (0..120).collect();
        [
            png_of(10, 4, png::ColorType::Rgb, png::BitDepth::Eight, &ramp),
            [b"P6 10 4 255\n".as_slice(), &ramp].concat(),
            [b"P5 10 6 65535\n".as_slice(), &ramp].concat(),
        ]
    }

    proptest! {
        #[test]
        fn damaged_files_never_panic(
            which in 0..3usize, keep in 0..200usize, places in prop::collection::vec((0..200usize, any::<u8>()), 0..6),
        ) {
            let mut bytes = samples()[which].clone();
            for (at, value) in places {
                let length = bytes.len();
                bytes[at % length] = value;
            }
            bytes.truncate(keep.max(1));
            if let Ok(image) = decode(&bytes) {
                prop_assert_eq!(image.pixels().len(), image.width() * image.height());
            }
        }

        #[test]
        fn any_bytes_are_answered(magic in 0..4usize, tail in prop::collection::vec(any::<u8>(), 0..80)) {
            let head: [&[u8]; 4] = [b"", b"P5 ", b"P6 ", &[0x89, b'P', b'N', b'G', 13, 10, 26, 10]];
            let _ = decode(&[head[magic], tail.as_slice()].concat());
        }
    }
}

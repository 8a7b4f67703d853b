//! Grey images: the only kind of picture that the matcher sees.
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

/// The most pixels that an image file may announce (2^25, about 33 million).
pub const MAX_PIXELS: usize = 1 << 25;

/// The longest image file that is read, bytes.
const MAX_FILE_BYTES: u64 = 1 << 29;

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
            return wrong(format!("{width}x{height} needs {} pixels, found {}", width * height, pixels.len()));
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
    let failed = |source| VisionError::Read { path: path.to_path_buf(), source };
    let wrong = |reason: String| VisionError::ImageFile { path: path.to_path_buf(), reason };
    let length = std::fs::metadata(path).map_err(failed)?.len();
    if length > MAX_FILE_BYTES {
        return Err(wrong(format!("{length} bytes long, expected at most {MAX_FILE_BYTES}")));
    }
    decode(&std::fs::read(path).map_err(failed)?).map_err(wrong)
}

/// Decodes the bytes of an image file; the error says what is wrong with them.
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
pub(crate) fn luma(red: f32, green: f32, blue: f32) -> f32 {
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
    let samples: Vec<f32> = match frame.bit_depth {
        png::BitDepth::Sixteen => {
            data.chunks_exact(2).map(|pair| f32::from(u16::from_be_bytes([pair[0], pair[1]])) / 257.0).collect()
        }
        _ => data.iter().map(|&byte| f32::from(byte)).collect(),
    };
    if samples.len() < width * height * channels {
        return Err("the PNG holds fewer pixels than it announces".into());
    }
    grey(width, height, channels, &samples)
}

/// Makes one intensity of each group of `channels` samples in 0..=255 (1: grey, 2: grey and alpha, 3: RGB,
/// 4: RGB and alpha).
pub(crate) fn grey(
    width: usize,
    height: usize,
    channels: usize,
    samples: &[f32],
) -> Result<GreyImage, String> {
    let one = |sample: &[f32]| match sample {
        [red, green, blue, ..] => luma(*red, *green, *blue).clamp(0.0, 255.0),
        [grey, ..] => *grey,
        [] => 0.0,
    };
    let pixels = samples.chunks_exact(channels).take(width * height).map(one).collect();
    GreyImage::new(width, height, pixels).map_err(|error| error.to_string())
}

/// Writes an 8-bit RGB PNG: `rgb` holds `width * height` colours, row by row. The file appears whole or not
/// at all.
pub fn write_png_rgb(path: &Path, width: usize, height: usize, rgb: &[u8]) -> Result<(), VisionError> {
    if let Err(reason) = check_size(width, height) {
        return Err(VisionError::Pixels { reason });
    }
    if rgb.len() != 3 * width * height {
        let reason = format!("{width}x{height} in RGB needs {} bytes, found {}", 3 * width * height, rgb.len());
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
    let mut beside = path.as_os_str().to_owned();
    beside.push(".part");
    std::fs::write(&beside, &bytes).and_then(|()| std::fs::rename(&beside, path)).map_err(|source| {
        // The part is ours and useless now; that it may not exist is no further fault.
        let _ = std::fs::remove_file(&beside);
        failed(source)
    })
}

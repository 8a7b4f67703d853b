//! A picture in memory, and its PNG file.
//!
//! In: a drawing (plotters, at twice the size, averaged down for smooth lines) or two pictures. Out: pixels, or a PNG
//! file written completely or not at all. Invariant: `pixels.len() = 3 * width * height`; text needs no
//! installed font (DejaVu Sans is included).

use super::ReportError;
use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::register_font;
use std::io::{Cursor, Error};
use std::path::Path;
use std::sync::OnceLock;

pub(super) type Canvas<'a> = DrawingArea<BitMapBackend<'a>, Shift>;
pub(super) type Drawn =
    Result<(), DrawingAreaErrorKind<<BitMapBackend<'static> as DrawingBackend>::ErrorType>>;
/// The name of the included font in plotters.
pub(super) const FONT: &str = "sans-serif";
/// Drawings are made this many times larger, then averaged.
pub(super) const OVERSAMPLING: u32 = 2;

/// An RGB picture, 8 bits a channel, row after row from the top.
#[derive(Clone, PartialEq, Eq)]
pub struct Picture {
    width: u32,
    height: u32,
    pixels: Vec<u8>,
}

impl Picture {
    /// Draws on white. The canvas that `drawing` gets is [`OVERSAMPLING`] times as wide and as high.
    pub(super) fn draw(width: u32, height: u32, drawing: impl FnOnce(&Canvas) -> Drawn) -> Picture {
        carry_font();
        let (wide, high) = (width * OVERSAMPLING, height * OVERSAMPLING);
        let mut fine = vec![255; (3 * wide * high) as usize];
        {
            let canvas = BitMapBackend::with_buffer(&mut fine, (wide, high)).into_drawing_area();
            // Drawing into memory with an included font cannot fail for lack of a file, a device or a glyph.
            if let Err(error) = drawing(&canvas).and_then(|()| canvas.present()) {
                panic!("internal: drawing into memory failed: {error}");
            }
        }
        let across = OVERSAMPLING as usize;
        let mut pixels = Vec::with_capacity((3 * width * height) as usize);
        for rows in fine.chunks_exact(3 * wide as usize * across) {
            let mut sums = vec![0u32; 3 * width as usize];
            for row in rows.chunks_exact(3 * wide as usize) {
                for (sums, block) in sums.chunks_exact_mut(3).zip(row.chunks_exact(3 * across)) {
                    for pixel in block.chunks_exact(3) {
                        sums.iter_mut().zip(pixel).for_each(|(sum, channel)| *sum += u32::from(*channel));
                    }
                }
            }
            pixels.extend(sums.iter().map(|sum| (sum / (OVERSAMPLING * OVERSAMPLING)) as u8));
        }
        Picture { width, height, pixels }
    }

    /// Width and height in pixels.
    pub fn size(&self) -> (u32, u32) {
        (self.width, self.height)
    }

    /// Red, green and blue of every pixel, row after row from the top.
    pub fn pixels(&self) -> &[u8] {
        &self.pixels
    }

    /// Several pictures from left to right, on white, aligned at the top.
    pub fn side_by_side(pictures: &[Picture]) -> Picture {
        let width = pictures.iter().map(|picture| picture.width).sum();
        let height = pictures.iter().map(|picture| picture.height).max().unwrap_or(0);
        let mut all = Picture { width, height, pixels: vec![255; (3 * width * height) as usize] };
        let mut left = 0;
        for picture in pictures {
            all.paste(picture, left, 0);
            left += picture.width;
        }
        all
    }

    /// Several pictures from top to bottom, on white, aligned at the left.
    pub fn stacked(pictures: &[Picture]) -> Picture {
        let width = pictures.iter().map(|picture| picture.width).max().unwrap_or(0);
        let height = pictures.iter().map(|picture| picture.height).sum();
        let mut all = Picture { width, height, pixels: vec![255; (3 * width * height) as usize] };
        let mut top = 0;
        for picture in pictures {
            all.paste(picture, 0, top);
            top += picture.height;
        }
        all
    }

    fn paste(&mut self, other: &Picture, left: u32, top: u32) {
        let row = 3 * other.width as usize;
        for y in 0..other.height {
            let to = 3 * ((top + y) * self.width + left) as usize;
            let from = y as usize * row;
            self.pixels[to..to + row].copy_from_slice(&other.pixels[from..from + row]);
        }
    }

    /// Writes the picture as PNG, completely or not at all.
    ///
    /// # Errors
    /// [`ReportError::Write`] names `path`.
    pub fn write(&self, path: &Path) -> Result<(), ReportError> {
        let bytes = self
            .png()
            .map_err(|error| ReportError::Write { path: path.to_path_buf(), source: Error::other(error) })?;
        write_atomically(path, &bytes)
    }

    fn png(&self) -> Result<Vec<u8>, png::EncodingError> {
        let mut bytes = Cursor::new(Vec::new());
        let mut encoder = png::Encoder::new(&mut bytes, self.width, self.height);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        let mut writer = encoder.write_header()?;
        writer.write_image_data(&self.pixels)?;
        writer.finish()?;
        Ok(bytes.into_inner())
    }
}

/// Writes a file, as [`bp_core::compiler::files::write`] does: completely or not at all.
///
/// # Errors
/// [`ReportError::Write`] names `path`.
pub fn write_atomically(path: &Path, bytes: &[u8]) -> Result<(), ReportError> {
    bp_core::compiler::files::write(path, bytes)
        .map_err(|source| ReportError::Write { path: path.to_path_buf(), source })
}

/// Registers the included font with plotters, once.
fn carry_font() {
    static CARRIED: OnceLock<()> = OnceLock::new();
    CARRIED.get_or_init(|| {
        for (style, bytes) in
            [(FontStyle::Normal, dejavu::sans::regular()), (FontStyle::Bold, dejavu::sans::bold())]
        {
            assert!(register_font(FONT, style, bytes).is_ok(), "internal: the included font is not a font");
        }
    });
}

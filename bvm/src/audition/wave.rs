//! WAV files.
//!
//! In: RIFF, RIFX or RF64 with PCM of 8 to 32 bits (in containers of whole bytes) or floats of 32 or 64 bits. Out: frames
//! in [-1, 1], block by block, with memory that does not depend on the length. Invariant: every sample is finite; what is
//! no sound of this kind is refused by its name.
//!
//! Lengths in headers are limits, not promises: writers into pipes leave 0 or 0xFFFFFFFF there, and interrupted ones a
//! length that was never reached. So the samples end where the data chunk or the file ends.

use super::error::AuditionError;
use std::fs::File;
use std::io::{BufReader, ErrorKind, Read};
use std::path::{Path, PathBuf};

/// The lowest and the highest sampling rate, Hz.
const RATES_HZ: [u32; 2] = [8_000, 192_000];

/// How a sample is written.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Coding {
    /// Unsigned, 128 is zero.
    Byte,
    /// Signed, left-justified in its container.
    Integer,
    Float,
}

/// A file that is being read.
#[derive(Debug)]
pub struct WaveReader {
    path: PathBuf,
    file: BufReader<File>,
    rate_hz: f64,
    channels: usize,
    coding: Coding,
    /// Bytes of a sample.
    width: usize,
    big_endian: bool,
    /// Bytes of the data chunk that have not been read, if its length is known.
    left: Option<u64>,
    frames: u64,
}

impl WaveReader {
    /// Reads the header.
    ///
    /// # Errors
    /// A file that cannot be read, or is not a WAV file of one of the kinds above.
    pub fn open(path: &Path) -> Result<WaveReader, AuditionError> {
        let file =
            File::open(path).map_err(|source| AuditionError::Read { path: path.to_path_buf(), source })?;
        let mut reader = WaveReader {
            path: path.to_path_buf(),
            file: BufReader::new(file),
            rate_hz: 0.0,
            channels: 0,
            coding: Coding::Byte,
            width: 0,
            big_endian: false,
            left: None,
            frames: 0,
        };
        reader.header()?;
        Ok(reader)
    }

    /// The sampling rate, Hz.
    pub fn rate_hz(&self) -> f64 {
        self.rate_hz
    }

    /// The number of channels.
    pub fn channels(&self) -> usize {
        self.channels
    }

    /// The next frames, at most `most`, as one list of samples for each channel; empty at the end. An incomplete last
    /// frame is dropped.
    ///
    /// # Errors
    /// A file that cannot be read; a sample that is not finite.
    pub fn read(&mut self, most: usize) -> Result<Vec<Vec<f64>>, AuditionError> {
        let frame = self.width * self.channels;
        let wanted = (most * frame) as u64;
        let mut bytes = vec![0; self.left.map_or(wanted, |left| left.min(wanted)) as usize];
        let got = self.fill(&mut bytes)?;
        if let Some(left) = &mut self.left {
            *left = if got < bytes.len() { 0 } else { *left - got as u64 };
        }
        let mut out = vec![Vec::with_capacity(got / frame); self.channels];
        for frame in bytes[..got].chunks_exact(frame) {
            for (channel, sample) in frame.chunks_exact(self.width).enumerate() {
                let value = self.decode(sample);
                if !value.is_finite() {
                    let at_s = self.frames as f64 / self.rate_hz;
                    return Err(self.refuse(format!(
                        "the sample at {at_s:.4} s of channel {} is not a finite number",
                        channel + 1
                    )));
                }
                out[channel].push(value);
            }
            self.frames += 1;
        }
        Ok(out)
    }

    fn decode(&self, bytes: &[u8]) -> f64 {
        // Eight bytes, the most significant last.
        let mut wide = [0; 8];
        for (place, byte) in bytes.iter().enumerate() {
            let from_the_top = if self.big_endian { place } else { bytes.len() - 1 - place };
            wide[7 - from_the_top] = *byte;
        }
        match (self.coding, self.width) {
            (Coding::Byte, _) => (f64::from(wide[7]) - 128.0) / 128.0,
            (Coding::Integer, _) => i64::from_le_bytes(wide) as f64 / 2f64.powi(63),
            (Coding::Float, 4) => f64::from(f32::from_le_bytes([wide[4], wide[5], wide[6], wide[7]])),
            (Coding::Float, _) => f64::from_le_bytes(wide),
        }
    }

    fn header(&mut self) -> Result<(), AuditionError> {
        let mut magic = [0; 12];
        let got = self.fill(&mut magic)?;
        self.big_endian = magic.starts_with(b"RIFX");
        let is_wave = [b"RIFF".as_slice(), b"RIFX", b"RF64", b"BW64"].contains(&&magic[..4]);
        if got < 12 || !is_wave || &magic[8..] != b"WAVE" {
            return Err(self.refuse(format!("not a WAV file{}", kind_of(&magic[..got]))));
        }
        let mut long = None;
        let mut has_format = false;
        loop {
            let mut head = [0; 8];
            if self.fill(&mut head)? < 8 {
                let missing = if has_format { "data" } else { "format" };
                return Err(self.refuse(format!("the file ends before its {missing} chunk")));
            }
            let length = self.number(&head[4..]);
            match &head[..4] {
                b"data" if has_format => {
                    self.left = match (length, long) {
                        (0xFFFF_FFFF, Some(long)) => Some(long),
                        (0 | 0xFFFF_FFFF, _) => None,
                        (length, _) => Some(u64::from(length)),
                    };
                    return Ok(());
                }
                b"data" => return Err(self.refuse("the data chunk is before the format chunk".to_owned())),
                b"ds64" => {
                    let body = self.chunk(length)?;
                    long = body.get(8..16).and_then(|bytes| bytes.try_into().ok()).map(u64::from_le_bytes);
                }
                b"fmt " => {
                    let body = self.chunk(length)?;
                    self.format(&body)?;
                    has_format = true;
                }
                _ => self.skip(length)?,
            }
        }
    }

    fn format(&mut self, body: &[u8]) -> Result<(), AuditionError> {
        if body.len() < 16 {
            return Err(self.refuse("the format chunk is shorter than 16 bytes".to_owned()));
        }
        let short = |at: usize| self.number(&body[at..at + 2]);
        let (mut tag, channels, block, bits) = (short(0), short(2), short(12), short(14));
        let rate = self.number(&body[4..8]);
        if tag == 0xFFFE {
            tag = if body.len() >= 26 { short(24) } else { 0 };
        }
        let width = block.checked_div(channels).unwrap_or(0);
        let coding = match (tag, width) {
            (1, 1) => Coding::Byte,
            (1, 2..=4) => Coding::Integer,
            (3, 4 | 8) => Coding::Float,
            (1 | 3, _) => {
                return Err(self.refuse(format!(
                    "{channels} channels of {bits} bits in blocks of {block} bytes are not read"
                )));
            }
            _ => {
                let name = match tag {
                    2 | 0x11 => " (ADPCM)",
                    6 => " (A-law)",
                    7 => " (µ-law)",
                    0x50 | 0x55 => " (MPEG)",
                    _ => "",
                };
                return Err(
                    self.refuse(format!("coding {tag:#06x}{name} is not read: expected PCM or float"))
                );
            }
        };
        if block != width * channels {
            return Err(self.refuse(format!("blocks of {block} bytes do not hold {channels} channels")));
        }
        if !(RATES_HZ[0]..=RATES_HZ[1]).contains(&rate) {
            return Err(self.refuse(format!(
                "the sampling rate is {rate} Hz: expected {} to {} Hz",
                RATES_HZ[0], RATES_HZ[1]
            )));
        }
        self.coding = coding;
        self.channels = channels as usize;
        self.width = width as usize;
        self.rate_hz = f64::from(rate);
        Ok(())
    }

    /// A number of two or four bytes.
    fn number(&self, bytes: &[u8]) -> u32 {
        let add = |sum: u32, byte: &u8| sum << 8 | u32::from(*byte);
        if self.big_endian { bytes.iter().fold(0, add) } else { bytes.iter().rev().fold(0, add) }
    }

    /// The body of a small chunk, without its pad byte.
    fn chunk(&mut self, length: u32) -> Result<Vec<u8>, AuditionError> {
        if length > 4096 {
            return Err(self.refuse(format!("a header chunk of {length} bytes is not read")));
        }
        let mut body = vec![0; length.next_multiple_of(2) as usize];
        let got = self.fill(&mut body)?;
        body.truncate(got.min(length as usize));
        Ok(body)
    }

    fn skip(&mut self, length: u32) -> Result<(), AuditionError> {
        let most = u64::from(length) + u64::from(length % 2);
        let skipped = std::io::copy(&mut (&mut self.file).take(most), &mut std::io::sink());
        skipped.map(drop).map_err(|source| AuditionError::Read { path: self.path.clone(), source })
    }

    /// Reads until the buffer is full or the file ends.
    fn fill(&mut self, buffer: &mut [u8]) -> Result<usize, AuditionError> {
        let mut got = 0;
        while got < buffer.len() {
            match self.file.read(&mut buffer[got..]) {
                Ok(0) => break,
                Ok(more) => got += more,
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(source) => return Err(AuditionError::Read { path: self.path.clone(), source }),
            }
        }
        Ok(got)
    }

    fn refuse(&self, reason: String) -> AuditionError {
        AuditionError::File { path: self.path.clone(), reason }
    }
}

/// The name of another kind of file, by its first bytes.
fn kind_of(magic: &[u8]) -> &'static str {
    match magic {
        [b'f', b'L', b'a', b'C', ..] => ": it is FLAC",
        [b'O', b'g', b'g', b'S', ..] => ": it is Ogg",
        [b'F', b'O', b'R', b'M', ..] => ": it is AIFF",
        [b'c', b'a', b'f', b'f', ..] => ": it is CAF",
        [b'I', b'D', b'3', ..] | [0xFF, 0xE0..=0xFF, ..] => ": it is MPEG audio",
        [] => ": it is empty",
        _ => "",
    }
}

/// A WAV file of 32-bit floats, as bytes. All channels have one length; the file is shorter than 4 GiB.
pub fn encode(rate_hz: u32, channels: &[Vec<f64>]) -> Vec<u8> {
    let frames = channels.first().map_or(0, Vec::len);
    let count = channels.len() as u32;
    let length = frames as u32 * 4 * count;
    let mut bytes = Vec::with_capacity(58 + length as usize);
    bytes.extend_from_slice(b"RIFF");
    bytes.extend_from_slice(&(50 + length).to_le_bytes());
    bytes.extend_from_slice(b"WAVEfmt ");
    bytes.extend_from_slice(&18_u32.to_le_bytes());
    bytes.extend_from_slice(&3_u16.to_le_bytes());
    bytes.extend_from_slice(&(count as u16).to_le_bytes());
    bytes.extend_from_slice(&rate_hz.to_le_bytes());
    bytes.extend_from_slice(&(rate_hz * 4 * count).to_le_bytes());
    bytes.extend_from_slice(&(4 * count as u16).to_le_bytes());
    bytes.extend_from_slice(&32_u16.to_le_bytes());
    bytes.extend_from_slice(&0_u16.to_le_bytes());
    bytes.extend_from_slice(b"fact");
    bytes.extend_from_slice(&4_u32.to_le_bytes());
    bytes.extend_from_slice(&(frames as u32).to_le_bytes());
    bytes.extend_from_slice(b"data");
    bytes.extend_from_slice(&length.to_le_bytes());
    for frame in 0..frames {
        for channel in channels {
            bytes.extend_from_slice(&(channel[frame] as f32).to_le_bytes());
        }
    }
    bytes
}

//! Networks in the formats of other programs: read, written, converted, refused.
//!
//! In: network files. Out: models, files of other formats, and diagnostics.

mod broken;
mod convert;
mod dialects;
mod formats;
mod published;

//! The formats of network files.
//!
//! In: the end of a file's name, or what a user calls a format. Out: a [`Format`]. Invariant: every ending belongs to one
//! format at most.

use std::path::Path;

/// A format of network files.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Format {
    /// A Bayesian Program.
    Program,
    /// The Bayesian Interchange Format.
    Bif,
    /// The same in XML.
    Xmlbif,
    /// The format of the UAI competitions: no names.
    Uai,
    /// Hugin NET.
    Hugin,
}

impl Format {
    /// All of them.
    pub const ALL: [Format; 5] = [Format::Program, Format::Bif, Format::Xmlbif, Format::Uai, Format::Hugin];

    /// How a file of this format ends; the first is also its name.
    pub fn endings(self) -> &'static [&'static str] {
        match self {
            Format::Program => &["bp"],
            Format::Bif => &["bif"],
            Format::Xmlbif => &["xmlbif", "xml", "bifxml"],
            Format::Uai => &["uai"],
            Format::Hugin => &["net", "hugin"],
        }
    }

    /// The format of this name.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|format| format.endings().iter().any(|end| end.eq_ignore_ascii_case(name)))
    }

    /// The format of a file, by its name.
    pub fn of(path: &Path) -> Option<Self> {
        Self::named(&path.extension()?.to_string_lossy())
    }
}

//! The formats of network files.
//!
//! In: the extension of a file, or the name of a format. Out: a [`Format`]. Invariant: an extension belongs to one
//! format.

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

    /// The extensions of this format; the first is also its name.
    pub fn endings(self) -> &'static [&'static str] {
        match self {
            Format::Program => &["bp"],
            Format::Bif => &["bif"],
            Format::Xmlbif => &["xmlbif", "xml", "bifxml", "xbif"],
            Format::Uai => &["uai"],
            Format::Hugin => &["net", "hugin"],
        }
    }

    /// The format of this name.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|format| format.endings().iter().any(|end| end.eq_ignore_ascii_case(name)))
    }

    /// The format of a file by its name, with or without `.gz`.
    pub fn of(path: &Path) -> Option<Self> {
        Self::named(&ending(path)?)
    }

    /// Whether a name has the extension of a compressed file.
    pub fn is_packed(path: &Path) -> bool {
        path.extension().is_some_and(|end| end.eq_ignore_ascii_case("gz"))
    }

    /// The reason why a file of another tool cannot be read, and the alternative; `None` for other names.
    pub fn refused(path: &Path) -> Option<String> {
        let end = ending(path)?.to_ascii_lowercase();
        let (_, what, help) = FOREIGN.iter().find(|(ends, ..)| ends.contains(&end.as_str()))?;
        Some(format!("is {what}, which is not read: {help}"))
    }
}

/// Unsupported formats of other tools: extensions, name, alternative.
const FOREIGN: [(&[&str], &str, &str); 6] = [
    (&["xdsl", "dsl"], "a network of GeNIe or SMILE", "in GeNIe, save it as Hugin NET (`.net`)"),
    (
        &["dne", "dnet", "neta"],
        "a network of Netica",
        "save it as `.dne` in Netica, open that in GeNIe, and save it as Hugin NET (`.net`)",
    ),
    (&["dsc"], "a network of MSBN", "open it in GeNIe, and save it as Hugin NET (`.net`)"),
    (
        &["oobn", "hkb"],
        "an object-oriented or compiled network of Hugin",
        "in Hugin, save the network as `.net`",
    ),
    (
        &["pgmx", "elv"],
        "a network of OpenMarkov or Elvira",
        "convert it to `.bif`, as pgmpy's readers and its `BIFWriter` do",
    ),
    (&["rds", "rda", "rdata"], "a file of R", "write it from bnlearn with `write.bif` or `write.net`"),
];

/// The extension of a file, without `.gz`.
fn ending(path: &Path) -> Option<String> {
    let stem = path.file_stem().filter(|_| Format::is_packed(path));
    let end = stem.map_or(path, Path::new).extension()?;
    Some(end.to_string_lossy().into_owned())
}

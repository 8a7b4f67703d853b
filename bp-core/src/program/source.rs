//! The source of a table: a file that is not yet read, or records.

use crate::data::{self, Records};
use crate::error::Error;
use std::borrow::Cow;
use std::path::{Path, PathBuf};

#[derive(Clone, Debug)]
pub(super) enum TableSource {
    File(PathBuf),
    Records(Box<Records>),
}

impl TableSource {
    pub(super) fn file(path: &Path) -> Self {
        Self::File(path.to_owned())
    }

    pub(super) fn records(records: Records) -> Self {
        Self::Records(Box::new(records))
    }

    /// Reads it.
    ///
    /// # Errors
    /// See [`data::open`].
    pub(super) fn read(&self) -> Result<Cow<'_, Records>, Error> {
        match self {
            Self::File(path) => data::open(path, None).map(Cow::Owned),
            Self::Records(records) => Ok(Cow::Borrowed(records)),
        }
    }
}

//! What several values share, for serde: each is stored with its own copy.
//!
//! In: an [`Arc`], as a field with `#[serde(with = "shared")]`. Out: what it holds, and back. Invariant: equal after reading.

use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::sync::Arc;

pub(crate) fn serialize<T: Serialize, S: Serializer>(all: &Arc<T>, serializer: S) -> Result<S::Ok, S::Error> {
    all.as_ref().serialize(serializer)
}

pub(crate) fn deserialize<'d, T: Deserialize<'d>, D: Deserializer<'d>>(
    deserializer: D,
) -> Result<Arc<T>, D::Error> {
    T::deserialize(deserializer).map(Arc::new)
}

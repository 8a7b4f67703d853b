//! Large buffers of bytes.
//!
//! In: a length. Out: so many zeros. New memory comes from the system page by page, at the first touch; for a
//! buffer as large as all candidates of a pair that costs as much as what is computed into it. Linux is asked for large
//! pages; where it has none, nothing else changes. Invariant: all bytes are zero.

use memmap2::MmapMut;

/// Zeros.
pub(super) enum Bytes {
    Mapped(MmapMut),
    Heap(Vec<u8>),
}

impl Bytes {
    pub(super) fn zeros(length: usize) -> Self {
        let Ok(map) = MmapMut::map_anon(length.max(1)) else { return Self::Heap(vec![0; length]) };
        // It is an advice: a system that does not take it is as right.
        #[cfg(target_os = "linux")]
        let _ = map.advise(memmap2::Advice::HugePage);
        Self::Mapped(map)
    }
}

impl std::ops::Deref for Bytes {
    type Target = [u8];

    fn deref(&self) -> &[u8] {
        match self {
            Self::Mapped(map) => map,
            Self::Heap(bytes) => bytes,
        }
    }
}

impl std::ops::DerefMut for Bytes {
    fn deref_mut(&mut self) -> &mut [u8] {
        match self {
            Self::Mapped(map) => map,
            Self::Heap(bytes) => bytes,
        }
    }
}

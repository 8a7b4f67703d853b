//! Large buffers of bytes.
//!
//! In: a length. Out: that many zeros. New memory is mapped page by page at the first access; for a buffer of all
//! candidates of a pair that costs as much as the computation. Linux is asked for large pages; without them nothing
//! else changes. Invariant: all bytes are zero.

use memmap2::MmapMut;

/// Zeros.
pub(super) enum Bytes {
    Mapped(MmapMut),
    Heap(Vec<u8>),
}

impl Bytes {
    pub(super) fn zeros(length: usize) -> Self {
        let Ok(map) = MmapMut::map_anon(length.max(1)) else { return Self::Heap(vec![0; length]) };
        // The call is only a hint; ignoring it is correct.
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

//! The parts of a look.
//!
//! In: the cues of a tenth of a second each, one after the other. Out: at most forty parts. Invariant: memory does not grow
//! with the length of the look: parts become longer, two by two.

use super::binaural::Cues;

/// Length of the shortest part, s.
pub const PART_S: f64 = 0.1;
/// Most parts.
const MOST: usize = 40;

/// The cues of each part of a look.
#[derive(Clone, Debug, Default)]
pub struct Parts {
    parts: Vec<Cues>,
    /// How many tenths of a second a part has, and how many the last one has so far.
    length: usize,
    filled: usize,
}

impl Parts {
    /// Adds the cues of the next tenth of a second.
    pub fn push(&mut self, cues: &Cues) {
        self.length = self.length.max(1);
        match self.parts.last_mut().filter(|_| self.filled < self.length) {
            Some(last) => last.add(cues),
            None => {
                self.parts.push(cues.clone());
                self.filled = 0;
            }
        }
        self.filled += 1;
        if self.parts.len() == MOST && self.filled == self.length {
            self.parts = (self.parts.chunks(2))
                .map(|pair| {
                    let mut both = pair[0].clone();
                    pair[1..].iter().for_each(|other| both.add(other));
                    both
                })
                .collect();
            self.length *= 2;
            self.filled = self.length;
        }
    }

    /// The parts.
    pub fn all(&self) -> &[Cues] {
        &self.parts
    }
}

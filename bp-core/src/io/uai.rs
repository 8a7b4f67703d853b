//! The format of the UAI inference competitions: Bayesian and Markov networks without names, and evidence files.
//!
//! In: a text, or a model. Out: a model, or a text. Invariant: variables and values are their indices, from 0.
//!
//! `BAYES` or `MARKOV`; how many variables, and how many values each has; how many tables, and of each its size and its
//! variables, the last one fastest (in `BAYES` the one that it distributes); then each table's length and numbers.
//!
//! A potential φ of a Markov network becomes a variable `potential i`, true with probability φ / max φ, that is always
//! known to be true beside uniform variables: P(x | potentials) = Π φ(x) / Z, which is what the network says (virtual
//! evidence: Pearl, *Probabilistic Reasoning in Intelligent Systems*, 1988, section 2.2.2).
//! ln Z = ln P(potentials) + Σ ln max φ + Σ ln |X|.

mod evidence;
mod read;
mod write;

pub use evidence::{evidence, evidence_text};
pub use read::read;
pub(super) use write::write;

//! The format of the UAI inference competitions: Bayesian and Markov networks without names, and evidence files.
//!
//! In: a text, or a model. Out: a model, or a text. Invariant: variables and values are their indices, from 0.
//!
//! `BAYES` or `MARKOV`; the number of variables, and of the values of each; the number of tables, and for each its size
//! and its variables, the last one fastest (in `BAYES` the one that it distributes); then each table's length and
//! numbers.
//!
//! A potential φ of a Markov network becomes a variable `potential i`, true with probability φ / max φ, that is always
//! known to be true, with uniform variables: P(x | potentials) = Π φ(x) / Z, the distribution of the network (virtual
//! evidence: Pearl, *Probabilistic Reasoning in Intelligent Systems*, 1988, section 2.2.2). ln Z = ln P(potentials) + Σ
//! ln max φ + Σ ln |X|.

mod evidence;
mod read;
mod write;

pub use evidence::{evidence, evidence_text};
pub use read::read;
pub(super) use write::write;

//! XMLBIF: the Bayesian Interchange Format in XML, versions 0.2 and 0.3.
//!
//! In: a text, or a model. Out: a model, or a text. Invariant: written text reads back the same.
//!
//! `<VARIABLE><NAME>X</NAME><OUTCOME>a</OUTCOME>…</VARIABLE>
//! <DEFINITION><FOR>X</FOR><GIVEN>Y</GIVEN><TABLE>…</TABLE></DEFINITION>`: X changes fastest, the first GIVEN slowest
//! (Cozman, *The Interchange Format for Bayesian Networks*, 1998). Version 0.2 uses VALUE and PROBABILITY.

mod read;
mod write;

pub use read::read;
pub(super) use write::write;

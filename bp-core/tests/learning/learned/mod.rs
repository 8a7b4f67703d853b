//! Learning over plates and families, from columns of every kind, of names in quotes.
//!
//! In: programs and tables written here. Out: learned programs. Invariant: as in `learning.rs`: expected numbers are hand
//! arithmetic.

mod climbs;
mod columns;
mod maxima;
mod plates;
mod quoted;

//! Learning over plates and families, from columns of every kind, of names in quotes.
//!
//! In: programs and tables written here. Out: learned programs. Invariant: expected numbers are computed by hand.

mod bounds;
mod climbs;
mod columns;
mod maxima;
mod plates;
mod quoted;

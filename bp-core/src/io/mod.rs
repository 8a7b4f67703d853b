//! Files of data.
//!
//! In: a path. Out: tables. Invariant: what is wrong with a file is told with its name, row and column.

mod csv;

pub use csv::{Table, read_table};

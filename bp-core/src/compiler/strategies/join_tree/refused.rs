//! Numbers that a form refuses, in contexts that the evidence may exclude.
//!
//! In: the contexts of a network's tables in which a form refused a number, and the known values. Out: the first of
//! these errors whose context the values leave possible. Invariant: only known values exclude a context; zeros of
//! likelihoods and of other tables do not.

use crate::error::Error;

/// Upper limit on the contexts kept; one more is an error immediately.
pub(super) const MOST: usize = 1 << 16;

/// A context of a table in which a form refused a number.
#[derive(Clone, PartialEq, Debug)]
pub struct Refused {
    /// The table.
    pub table: usize,
    /// The values of its parents: (variable, value).
    pub at: Vec<(usize, usize)>,
    /// The factor and its form, the context and the fault, as in [`Error::Number`].
    pub words: [String; 3],
}

impl Refused {
    /// Succeeds where the known values exclude every context; `usize::MAX` marks an unknown value.
    pub(super) fn check(all: &[Refused], values: &[usize]) -> Result<(), Error> {
        let agrees = |(variable, value): &(usize, usize)| {
            values[*variable] == usize::MAX || values[*variable] == *value
        };
        match all.iter().find(|refused| refused.at.iter().all(agrees)) {
            None => Ok(()),
            Some(refused) => {
                let [form, context, message] = refused.words.clone();
                Err(Error::Number { form, context, message })
            }
        }
    }
}

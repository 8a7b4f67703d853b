//! Linking: a program's subroutines are asked, and their answers kept beside it.
//!
//! In: a model. Out: the same, each of its subroutines with its table. Invariant: the answer is the same as if the other
//! program's decomposition stood in this one; a subroutine may have subroutines.

use super::ask;
use crate::error::Error;
use crate::exec::Inputs;
use crate::model::Model;
use std::borrow::Cow;

/// The model with the answers of its subroutines.
///
/// # Errors
/// A subroutine that cannot be answered.
pub fn link(model: &Model) -> Result<Cow<'_, Model>, Error> {
    if model.subroutines.iter().all(|subroutine| !subroutine.table.is_empty()) {
        return Ok(Cow::Borrowed(model));
    }
    let mut linked = model.clone();
    for subroutine in &mut linked.subroutines {
        let question = subroutine.program.question(&subroutine.question);
        let question = question.expect("internal: a subroutine is a question of its program").clone();
        let answers = ask(&subroutine.program, &question, &Inputs::new())
            .map_err(|error| Error::Subroutine { path: subroutine.path.clone(), error: Box::new(error) })?;
        subroutine.table = answers[0].answer.iter().filter_map(super::Row::p).collect();
    }
    Ok(Cow::Owned(linked))
}

//! Linking: subroutines are answered, and their tables stored with the program.
//!
//! In: a model. Out: the same model with a table for each of its subroutines. Invariant: the answer equals that of the
//! program with the other program's decomposition inserted; a subroutine may have subroutines.

use super::ask;
use crate::error::Error;
use crate::exec::Inputs;
use crate::ids::VariableId;
use crate::model::{Form, Model, Question};
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
        let answers = ask(&from_factors(&subroutine.program, &question), &question, &Inputs::new())
            .map_err(|error| Error::Subroutine { path: subroutine.path.clone(), error: Box::new(error) })?;
        subroutine.table = answers[0].answer.iter().filter_map(super::Row::p).collect();
    }
    Ok(Cow::Owned(linked))
}

/// The program with uniform laws for the variables that its question knows, where their own laws have no parents: P(S |
/// K) is unchanged, and is read from the other factors where P(K) is 0. The calling program may give such a K.
fn from_factors(program: &Model, question: &Question) -> Model {
    let mut program = program.clone();
    let known: Vec<VariableId> =
        question.asks.iter().flat_map(|ask| &ask.known).map(|known| known.variable).collect();
    for id in program.factors.ids().collect::<Vec<_>>() {
        let factor = &program.factors[id];
        let uses = factor.left.iter().chain(&factor.right);
        let alone = factor.products.is_empty() && uses.clone().all(|use_| known.contains(&use_.variable));
        if alone && factor.left.iter().all(|use_| program.variables[use_.variable].domain.is_finite()) {
            program.factors[id].form = Form::Uniform;
        }
    }
    program
}

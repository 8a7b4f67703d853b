//! Linking: a program's subroutines are asked, and their answers kept beside it.
//!
//! In: a model. Out: the same, each of its subroutines with its table. Invariant: the answer is the same as if the other
//! program's decomposition stood in this one; a subroutine may have subroutines.

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

/// The program with uniform laws for what its question knows, where these laws depend on nothing else: P(S | K) is the same,
/// and is read from the other factors where P(K) is 0. Another program may well give that K.
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

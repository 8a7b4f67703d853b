//! A question that is answered in closed form.
//!
//! In: a question of a linear Gaussian program. Out: a module whose function makes the filter. Invariant: the filter is
//! planned from the program's own model when it is made.

use super::text::Text;
use crate::model::Question;

/// A question that is answered in closed form: a function that makes its filter.
pub(super) fn emit_filter(question: &Question, number: usize, name: &str, equation: &str, text: &mut Text) {
    text.documented(&[equation.to_owned()]);
    text.open(format!("pub mod {name}"));
    text.line("use ::std::prelude::v1::*;");
    text.line("/// The filter that answers, at rest.\n///\n/// # Errors\n/// A parameter that is missing, or has a value that it cannot have.");
    text.open(
        "pub fn filter(parameters: &[(&str, f64)]) -> Result<::bp_core::exec::Filter, ::bp_core::error::Error>",
    );
    text.line("let model = super::model();");
    text.line(format!(
        "let question = model.question({:?}).expect(\"internal: it was there\");",
        question.name
    ));
    text.line("let plan = ::bp_core::plan::plan(&model, question, ::bp_core::plan::Options::default())?;");
    text.open(format!("match &plan.routes[{number}]"));
    text.line(
        "::bp_core::plan::Route::Gaussian(plan) => ::bp_core::exec::Filter::new(&model, plan, parameters),",
    );
    text.line("_ => ::core::unreachable!(\"internal: it was linear and Gaussian\"),");
    text.close();
    text.close();
    text.close();
}

//! Questions answered in closed form.
//!
//! In: a question of a linear Gaussian program. Out: a builder that takes the parameters and returns the filter.
//! Invariant: the filter is planned from the program's own model at run time.

use super::names::{Names, snake};
use super::text::Text;
use super::value::constant;
use crate::model::{Model, Question};

/// Writes a question in closed form: a builder of its filter.
pub(super) fn emit_filter(
    model: &Model,
    question: &Question,
    number: usize,
    (name, equation): (&str, &str),
    text: &mut Text,
) {
    text.documented(&[equation.to_owned()]);
    text.line(format!("pub fn {name}() -> {name}::Question {{ ::core::default::Default::default() }}"));
    text.documented(&[equation.to_owned()]);
    text.open(format!("pub mod {name}"));
    text.line("use ::std::prelude::v1::*;");
    text.line(
        "/// The question, with the parameters that it has been given.\n#[derive(Clone, Debug, Default)]",
    );
    text.line("pub struct Question { parameters: Vec<(&'static str, f64)> }");
    text.open("impl Question");
    let mut names = Names::default();
    names.unique("filter");
    for parameter in model.parameters.values().filter(|parameter| parameter.over.is_empty()) {
        let default = parameter.default_number().map(|default| format!("By default {}.", constant(default)));
        let documentation = std::iter::once(format!("The parameter `{}`.", parameter.name));
        text.documented(&documentation.chain(default).collect::<Vec<_>>());
        text.open(format!("pub fn {}(mut self, value: f64) -> Self", names.unique(&snake(&parameter.name))));
        // Inserted first, so that the last of several settings takes effect.
        text.line(format!("self.parameters.insert(0, ({:?}, value));", parameter.name));
        text.line("self");
        text.close();
    }
    text.line("/// The filter that answers, at rest.\n///\n/// # Errors\n/// A parameter that is missing, or has a value outside its range.");
    text.open(
        "pub fn filter(&self) -> Result<::bp_core::compiler::strategies::gaussian::Filter, ::bp_core::compiler::error::Error>",
    );
    text.line("let model = super::model();");
    text.line(format!(
        "let question = model.question({:?}).expect(\"internal: it was there\");",
        question.name
    ));
    text.line("let plan = ::bp_core::compiler::plan::plan(&model, question, ::bp_core::compiler::plan::Options::default())?;");
    text.open(format!("match &plan.routes[{number}]"));
    text.line(
        "::bp_core::compiler::plan::Route::Gaussian(plan) => ::bp_core::compiler::strategies::gaussian::Filter::new(&model, plan, &self.parameters),",
    );
    text.line("_ => ::core::unreachable!(\"internal: it was linear and Gaussian\"),");
    text.close();
    text.close();
    text.close();
    text.close();
}

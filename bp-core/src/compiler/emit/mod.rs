//! Emits programs as Rust text.
//!
//! In: a checked model and its source text. Out: the body of a Rust module: the text, the model, and a compiled
//! function for each question. Invariant: emitted code needs only `std`, slices and [`crate::exec::compiled`]; it has
//! the same schedule as the lanes.

mod again;
mod best;
mod blocks;
mod cells;
mod cellwise;
mod documentation;
mod door;
mod filter;
mod fused;
mod given;
mod hoist;
mod instant;
mod interface;
pub mod javascript;
mod load;
mod moments;
mod names;
mod naming;
mod nest;
mod print;
mod question;
mod reading;
mod series;
mod step;
mod straight;
mod suspects;
mod text;
mod uniform;
mod value;
mod values;
pub mod wgsl;
mod write;

use crate::error::Error;
use crate::lower::lower_printed;
use crate::model::{Ask, Model, Question, Statistic};
use crate::plan;
use crate::source::Source;
use names::Names;
use text::Text;
use values::Enums;

pub use names::snake;

/// The emitted module of a program.
pub struct Emitted {
    /// The body of the module: the text, the model, and a module for each question.
    pub text: String,
    /// The questions that are not compiled, each with the reason, which their modules report to callers.
    pub refused: Vec<(String, Error)>,
}

/// The body of the module of a program. `unlinked` is the reason why its subroutines have no answer, if there is one.
pub fn emit_rust(model: &Model, source: &Source, unlinked: Option<&Error>) -> Emitted {
    let mut posed = model.clone();
    let questions: Vec<Question> = model.questions.values().map(|question| posed.pose(question)).collect();
    let model = &posed;
    let mut text = Text::default();
    let name = text::in_a_comment(&model.name);
    text.line(format!("/// The text of the program `{name}`."));
    text.line(format!("pub const SOURCE: &::core::primitive::str = {:?};", source.text));
    text.open("/// The model of the program.\npub fn model() -> ::bp_core::compiler::model::Model");
    text.line(format!("let source = ::bp_core::compiler::source::Source::new({:?}, SOURCE);", model.name));
    text.line(
        "::bp_core::compiler::syntax::compile(&source).expect(\"internal: it was checked when it was compiled\")",
    );
    text.close();
    let mut constants = Names::default();
    for parameter in model.parameters.values() {
        if let Some(default) = parameter.default_number() {
            let name = constants.unique(&format!("DEFAULT_{}", names::snake(&parameter.name).to_uppercase()));
            text.documented(&[format!("The default of the parameter `{}`.", parameter.name)]);
            text.line(format!("pub const {name}: ::core::primitive::f64 = {};", value::constant(default)));
        }
    }
    let mut modules = Names::default();
    // The name is reserved for the function that returns the model.
    modules.unique("model");
    // Names from the program come before those of additional parts.
    let named: Vec<(String, &Question)> = (questions.iter())
        .map(|question| (modules.unique(&module_name(model, question)), question))
        .collect();
    let enums = Enums::write(model, &mut modules, &mut text);
    let mut refused = Vec::new();
    for (name, question) in named {
        if let Err(error) = emit_question(model, question, &name, (&mut modules, &enums), &mut text) {
            let reason = match unlinked {
                Some(unlinked) => format!("{error} ({unlinked})"),
                None => error.to_string(),
            };
            question::emit_refused(model, question, &name, &reason, &mut text);
            refused.push((question.name.clone(), error));
        }
    }
    Emitted { text: text.finish(), refused }
}

/// The name of a question's module: its own; for an unnamed question, its statistic and variables.
fn module_name(model: &Model, question: &Question) -> String {
    let is_name = |letter: char| letter.is_alphanumeric() || letter == '_';
    match question.asks.first() {
        Some(ask) if !question.name.chars().all(is_name) => {
            names::snake(&format!("{}{}", ask.words(), reading::searched_by(model, ask)))
        }
        _ => names::snake(&question.name),
    }
}

fn emit_question(
    model: &Model,
    asked: &Question,
    name: &str,
    (modules, enums): (&mut Names, &Enums),
    text: &mut Text,
) -> Result<(), Error> {
    let plan = plan::plan_for_code(model, asked)?;
    let made_by_the_host = |ask: &&Ask| {
        let emitted = matches!(
            ask.statistic,
            Statistic::Distribution | Statistic::Maximum | Statistic::Argmax { .. } | Statistic::Entropy
        );
        !(emitted || ask.when.is_over_time()) || plan::parts(model, ask) != [(*ask).clone()]
    };
    if let Some(ask) = asked.asks.iter().find(made_by_the_host) {
        let reason = "emitted code answers `P(…)`, `max`, `argmax` and `entropy` of questions without `soft`; \
            `answer::ask` answers this one";
        return Err(Error::Unplanned { question: model.ask_text(ask), reason: reason.to_owned() });
    }
    let mut parts: Vec<Text> = Vec::new();
    for (number, route) in plan.routes.iter().enumerate() {
        let name = match number {
            0 => name.to_owned(),
            _ => modules.unique(&format!("{}_{}", name.trim_end_matches('_'), number + 1)),
        };
        let equation = &plan.equations(model, plan::Notation::Unicode)[number];
        let mut part = Text::default();
        if let Some(reason) = route.offered().not_printed(model) {
            return Err(Error::Unplanned { question: model.ask_text(&route.offered().asks()[0]), reason });
        }
        if let plan::Route::OverTime(route) = route {
            let place = (name.as_str(), asked.name.as_str(), number);
            match route.ask().when.is_every_instant() {
                true => series::emit((model, enums), route, place, equation, &mut part)?,
                false => step::emit((model, enums), route, place, equation, &mut part)?,
            }
            parts.push(part);
            continue;
        }
        match route.exact() {
            Some(exact) => {
                let lowered = lower_printed(model, exact, &asked.name)?;
                let is_linear = model.plate.is_some() || exact.mark(model) == plan::Mark::Linear;
                let place = (name.as_str(), asked.name.as_str(), number);
                question::emit((model, enums), &lowered, place, (is_linear, equation), &mut part);
            }
            None => {
                let other = |ask: &&Ask| ask.statistic != Statistic::Distribution || uses_derived(model, ask);
                if let Some(ask) = route.offered().asks().iter().find(other) {
                    let reason = "emitted code makes the filter of a linear Gaussian program, and no statistic of its \
                        answer; `answer::ask` answers this one";
                    let question = model.ask_text(ask);
                    return Err(Error::Unplanned { question, reason: reason.to_owned() });
                }
                filter::emit_filter(model, asked, number, (&name, equation), &mut part);
            }
        }
        parts.push(part);
    }
    // All parts of a question, or none.
    parts.into_iter().for_each(|part| text.line(part.finish()));
    Ok(())
}

/// Whether an ask uses a variable that its question derives from the program.
fn uses_derived(model: &Model, ask: &Ask) -> bool {
    let searched = ask.searched.iter().map(|item| item.variable);
    let mut all = searched.chain(ask.known.iter().map(|known| known.variable));
    all.any(|variable| model.variables[variable].derived.is_some())
}

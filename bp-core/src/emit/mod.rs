//! Emitting: programs as Rust text.
//!
//! In: a checked model and the text that it came from. Out: the body of a Rust module: the text, the model, and a
//! compiled function for each question. Invariant: what is emitted needs only `std`, slices and
//! [`crate::exec::compiled`]; it reads the same schedule as the lanes.

mod fused;
mod given;
mod load;
mod names;
mod nest;
mod question;
mod text;
mod value;
pub mod wgsl;
mod write;

use crate::error::Error;
use crate::lower::lower;
use crate::model::{Ask, Model, Question, Reduction};
use crate::plan::{self, Options, Route};
use crate::source::Source;
use names::Taken;
use text::Text;

pub use names::snake;

/// The body of the module of a program.
///
/// # Errors
/// The questions that have no exact answer, each with the reason, and names that Rust could not tell apart; what
/// concerns no question bears the name of the program.
pub fn emit_rust(model: &Model, source: &Source) -> Result<String, Vec<(String, Error)>> {
    let mut text = Text::default();
    text.line(format!("/// The program's text.\npub const SOURCE: &str = {:?};", source.text));
    text.open("/// The program's meaning.\npub fn model() -> ::bp_core::model::Model");
    text.line(format!("let source = ::bp_core::source::Source::new({:?}, SOURCE);", model.name));
    text.line(
        "::bp_core::syntax::compile(&source).expect(\"internal: it was checked when it was compiled\")",
    );
    text.close();
    let mut wrong = Vec::new();
    let (mut constants, mut modules) = (Taken::default(), Taken::default());
    for parameter in model.parameters.values() {
        if let Some(default) = parameter.default_number() {
            if let Err(error) = constants.take(names::snake(&parameter.name), &parameter.name) {
                wrong.push((model.name.clone(), error));
            }
            let name = names::snake(&parameter.name).to_uppercase();
            text.line(format!("/// What `{}` is where nothing else is said.", parameter.name));
            text.line(format!("pub const DEFAULT_{name}: f64 = {default:?};"));
        }
    }
    for question in model.questions.values() {
        if let Err(error) = emit_question(model, question, &mut modules, &mut text) {
            wrong.push((question.name.clone(), error));
        }
    }
    if wrong.is_empty() { Ok(text.finish()) } else { Err(wrong) }
}

fn emit_question(model: &Model, asked: &Question, modules: &mut Taken, text: &mut Text) -> Result<(), Error> {
    let plan = plan::plan(model, asked, Options::default())?;
    let made_by_the_host = |ask: &&Ask| {
        let emitted = matches!(
            ask.reduction,
            Reduction::Probability | Reduction::Maximum | Reduction::Argmax { .. } | Reduction::Entropy
        );
        !(emitted || ask.reduction.is_over_time()) || plan::parts(model, ask) != [(*ask).clone()]
    };
    if let Some(ask) = asked.asks.iter().find(made_by_the_host) {
        let reason = "emitted code answers `P(…)`, `max`, `argmax` and `entropy` of what is known without `soft`; \
            `answer::ask` answers this one";
        return Err(Error::Unplanned { question: model.ask_text(ask), reason: reason.to_owned() });
    }
    for (number, route) in plan.routes.iter().enumerate() {
        let mut name = names::snake(&asked.name);
        if number > 0 {
            name = format!("{name}_{}", number + 1);
        }
        modules.take(name.clone(), &asked.name)?;
        let equation = &plan.equations(model, plan::Notation::Unicode)[number];
        match route {
            Route::Exact(exact) => question::emit(&lower(model, exact, &asked.name)?, &name, equation, text)?,
            Route::Gaussian(_) => question::emit_filter(asked, number, &name, equation, text),
            Route::OverTime(over_time) => {
                let reason =
                    "over time it is answered by `answer::ask_over_time`, not by emitted code".to_owned();
                return Err(Error::Unplanned { question: model.ask_text(&over_time.ask), reason });
            }
            Route::Sampled(sampled) => {
                let reason =
                    format!("{}; draws are made by `answer::ask`, not by emitted code", sampled.reason);
                return Err(Error::Unplanned { question: model.ask_text(&sampled.asks[0]), reason });
            }
        }
    }
    Ok(())
}

//! The page of a program on which a reader moves evidence and parameters.
//!
//! In: a program, its text, its questions. Out: what the page shows, as JSON and JavaScript; a self-contained HTML page.
//! Invariant: text from a program is data of the page, never markup or code; the page needs no network.

mod answers;

use crate::failure::Failure;
use crate::html;
use crate::program;
#[cfg(feature = "serve")]
pub(crate) use answers::Given;
pub(crate) use answers::answers;
use bp_core::compiler::answer::link;
use bp_core::compiler::interactive::{Interactive, interactive};
use bp_core::compiler::model::{Model, Question};
use bp_core::compiler::plan::{Notation, Options, plan};
use bp_core::compiler::print::{sections, sheets};
use bp_core::compiler::source::Source;
use bp_core::compiler::syntax::parse;
use serde_json::{Value, json};
use std::path::Path;

const PAGE: &str = include_str!("../../../../web/page.html");
const STYLE: &str = include_str!("../../../../web/page.css");
const FUNCTIONS: &str = include_str!("../../../../web/functions.js");
const ANSWER: &str = include_str!("../../../../web/answer.js");
const LAWS: &str = include_str!("../../../../web/laws.js");
const SERIES: &str = include_str!("../../../../web/series.js");
const INSTANTS: &str = include_str!("../../../../web/instants.js");
const SCRIPT: &str = include_str!("../../../../web/page.js");
#[cfg(feature = "serve")]
const EDITOR: &str = include_str!("../../../../web/editor.html");
#[cfg(feature = "serve")]
const EDITOR_SCRIPT: &str = include_str!("../../../../web/editor.js");

/// What the page of a program shows.
pub(crate) struct Content {
    /// Everything but the code.
    pub(crate) program: Value,
    pub(crate) interactive: Interactive,
}

/// The content of a program's page; with `fixed`, questions without a function have their answers to the values that the
/// program gives.
pub(crate) fn content(
    model: &Model,
    source: &Source,
    questions: &[Question],
    fixed: bool,
) -> Result<Content, Failure> {
    let file = parse(source).map_err(|wrong| Failure::Wrong(wrong, source.clone()))?;
    let interactive = interactive(model, questions);
    let mut shown = Vec::new();
    for (moving, question) in interactive.questions.iter().zip(questions) {
        let (model, question) = model.posed(question);
        let mut own = serde_json::to_value(moving).map_err(|error| Failure::Words(error.to_string()))?;
        own["derivation"] = json!(derivation(&model, &question));
        own["fixed"] = match fixed && moving.refused.is_some() {
            true => answers(&model, &question, None),
            false => Value::Null,
        };
        shown.push(own);
    }
    let program = json!({
        "name": model.name,
        "documentation": model.documentation.trim(),
        "file": stem(source),
        "text": source.text,
        "figure": sections(&sheets(&file, Notation::MathMl)),
        "questions": shown,
    });
    Ok(Content { program, interactive })
}

/// The name of a program's file, without its ending.
fn stem(source: &Source) -> String {
    let stem = Path::new(&source.name).file_stem().map(|stem| stem.to_string_lossy().into_owned());
    stem.filter(|stem| stem != "-").unwrap_or_else(|| "program".to_owned())
}

/// The derivation of a question, or the reason why it has none.
fn derivation(model: &Model, question: &Question) -> String {
    let mut written = Vec::new();
    let done = plan(model, question, Options::default()).map(|plan| {
        html::steps(model, &plan, false, &mut written)
            .and_then(|()| html::computed(model, &plan, &mut written))
    });
    match done {
        // Writing to memory cannot fail.
        Ok(_) => String::from_utf8_lossy(&written).into_owned(),
        Err(error) => format!("<p>{}</p>", bp_core::compiler::xml::escaped(&error.to_string())),
    }
}

/// The page of a program that a file holds, with its declared questions or one that was typed.
pub(crate) fn exported(file: &Path, typed: Option<&str>) -> Result<String, Failure> {
    let (mut network, source) = program::with_source(file)?;
    network.model = link(&network.model)?.into_owned();
    let questions = program::shown(&network, typed)?;
    let Content { program, interactive } = content(&network.model, &source, &questions, true)?;
    // The functions are in a scope of their own, since a question may have the name of a function of the page.
    let (code, names) = (&interactive.code.text, interactive.code.names.join(", "));
    let functions = format!("(() => {{\n{code}\nreturn {{ {names} }};\n}})()");
    let start = format!("show(JSON.parse(byId(\"data\").textContent), {functions}, null);");
    let script = [FUNCTIONS, ANSWER, LAWS, SERIES, INSTANTS, SCRIPT, &start].join("\n");
    Ok(assembled(&network.model.name, ("", ""), &program, &script))
}

/// The page with an editor, whose questions are compiled by the server that sends it; `nonce` allows its script to run.
#[cfg(feature = "serve")]
pub(crate) fn with_editor(source: &Source, nonce: &str) -> String {
    let script = [FUNCTIONS, ANSWER, LAWS, SERIES, INSTANTS, SCRIPT, EDITOR_SCRIPT].join("\n");
    assembled(
        "Bayesian Program",
        (EDITOR, nonce),
        &json!({ "text": source.text, "file": stem(source) }),
        &script,
    )
}

/// A page of its parts.
fn assembled(title: &str, (editor, nonce): (&str, &str), data: &Value, script: &str) -> String {
    // Neither data nor code may end their element.
    let data = data.to_string().replace('<', "\\u003c");
    let script = script.replace("</", "<\\/");
    let title = bp_core::compiler::xml::escaped(title);
    let parts = [
        ("@TITLE@", title.as_str()),
        ("@STYLE@", STYLE),
        ("@EDITOR@", editor),
        ("@DATA@", &data),
        ("@NONCE@", nonce),
        ("@SCRIPT@", &script),
    ];
    let mut page = String::new();
    let mut rest = PAGE;
    // Each place is filled once, so that text of a program is not searched for places.
    while let Some((before, after)) = rest.split_once('@') {
        page.push_str(before);
        let part = parts.iter().find_map(|(place, part)| Some((after.strip_prefix(&place[1..])?, part)));
        let (after, part) = part.expect("internal: the page has no other `@`");
        page.push_str(part);
        rest = after;
    }
    page + rest
}

//! Suspect cells of emitted code: they are computed again, or their error is reported.
//!
//! In: the interface of a question, and its place in the program. Out: the function `again`. Invariant: it is called only where
//! a total is too small or a number is NaN; the runtime plans the same question and computes it with separate exponents.

use super::interface::Interface;
use super::text::Text;
use crate::ids::BufferId;
use crate::kernel::OutputKey;
use crate::lower::Phase;

/// The place of a question in its program.
pub(super) struct Asked<'q> {
    pub(super) question: &'q str,
    pub(super) route: usize,
    /// Of a question over time: the instant, and whether its kernel computes a normal law.
    pub(super) instant: Option<(Phase, bool)>,
}

/// The function for suspect cells.
pub(super) fn again(
    interface: &Interface<'_>,
    generics: &str,
    Asked { question, route, instant }: &Asked<'_>,
    (alone, is_linear): (bool, bool),
    text: &mut Text,
) {
    const ANSWER: &str = "::bp_core::compiler::answer";
    text.line("#[cold]\n#[inline(never)]\n#[allow(clippy::all, unused)]");
    let contexts = if alone { ", contexts: usize" } else { "" };
    text.open(format!(
        "fn again<T: Scalar>(inputs: &Inputs{generics}, outputs: &mut Outputs<T>, suspects: usize{contexts}) -> Result<Report, ::bp_core::compiler::error::Error>"
    ));
    text.line(format!("let asked = {ANSWER}::Asked {{ question: {question:?}, route: {route} }};"));
    let named = |text: &mut Text| {
        text.line("let named = ::bp_core::compiler::exec::Inputs::<f64>::new();");
        interface.named(text);
    };
    let outputs: Vec<(OutputKey, BufferId)> = interface.kernel.outputs().map(|(id, key)| (key, id)).collect();
    let mut fields: Vec<&str> = outputs.iter().map(|(_, id)| interface.output(*id)).collect();
    fields.dedup();
    let all: Vec<String> = fields.iter().map(|field| format!("&outputs.{field}[..]")).collect();
    let all = all.join(", ");
    match (alone, instant) {
        (true, Some((_, true))) => {
            named(text);
            text.line(format!("Err({ANSWER}::no_law(&super::model(), asked, &named))"));
        }
        (true, _) => {
            if is_linear {
                text.open(format!("if suspects < contexts && !has_nan(&[{all}])"));
                text.line("return Ok(Report { impossible: suspects });");
                text.close();
            }
            named(text);
            let call = match instant {
                Some((phase, _)) => {
                    format!(
                        "again_at(&super::model(), (asked, ::bp_core::compiler::lower::Phase::{phase:?}), &named"
                    )
                }
                None => "again(&super::model(), asked, &named".to_owned(),
            };
            text.line(format!("let (found, report) = {ANSWER}::{call}, (suspects, contexts))?;"));
            for (key, id) in outputs {
                let field = interface.output(id);
                text.line(format!("put(&found, OutputKey::{key:?}, &mut outputs.{field}[..]);"));
            }
            text.line("Ok(report)");
        }
        (false, _) => {
            text.open(format!("if has_nan(&[{all}])"));
            named(text);
            let refused = if instant.is_some() { "refused_at" } else { "refused" };
            text.open(format!("if let Some(error) = {ANSWER}::{refused}(&super::model(), asked, &named)"));
            text.line("return Err(error);");
            text.close();
            for field in fields {
                text.line(format!("without_nan(&mut outputs.{field}[..]);"));
            }
            text.close();
            text.line("Ok(Report { impossible: suspects })");
        }
    }
    text.close();
}

//! Suggests quotation marks around a name.
//!
//! In: the errors of a question, its text, the model. Out: the same errors, with a help where the text contains a name
//! of a variable or a value that needs quotation marks, such as `0` or `<5`, without them. Invariant: nothing else
//! changes.

use crate::diagnostic::Diagnostics;
use crate::model::{Domain, Model};
use crate::spelling::quoted;

/// Adds the help to the first error.
pub(super) fn suggested(mut wrong: Diagnostics, text: &str, model: &Model) -> Diagnostics {
    let variables = model.variables.values().map(|variable| (variable.name.as_str(), false));
    let labels = model.variables.values().flat_map(|variable| match &variable.domain {
        Domain::Finite { labels, .. } => labels.as_slice(),
        _ => &[],
    });
    let names = variables.chain(labels.map(|label| (label.as_str(), true)));
    // The longest match: `12` is a part of `12+`.
    let found = names.filter(|(name, is_value)| stands_bare(text, name, *is_value));
    if let (Some((name, is_value)), Some(first)) =
        (found.max_by_key(|(name, _)| name.len()), wrong.0.first_mut())
    {
        let what = if is_value { "value" } else { "variable" };
        first.help = Some(format!("the {what} `{name}` is written in quotes: `{}`", quoted(name)));
    }
    wrong
}

/// Whether a name that needs quotation marks occurs in a text without them: a value after `=`, a variable elsewhere.
fn stands_bare(text: &str, name: &str, is_value: bool) -> bool {
    if name.is_empty() || quoted(name) == name {
        return false;
    }
    let is_part = |letter: char| letter.is_alphanumeric() || "_.\"".contains(letter);
    text.match_indices(name).any(|(at, _)| {
        let (before, after) = (&text[..at], &text[at + name.len()..]);
        let whole = !before.ends_with(is_part) && !after.starts_with(is_part);
        let in_quotes = before.matches('"').count() % 2 == 1;
        whole && !in_quotes && before.trim_end().ends_with('=') == is_value
    })
}

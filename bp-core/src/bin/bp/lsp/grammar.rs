//! The TextMate grammar of the language, with which most editors colour a text.
//!
//! In: the words of the highlighter. Out: JSON. Invariant: the words are those that pages of HTML highlight.

use crate::highlight::{KEYWORDS, TYPES};
use serde_json::{Value, json};

/// The grammar.
pub(super) fn grammar() -> Value {
    let words = |words: &[&str]| format!("\\b(?:{})\\b", words.join("|"));
    let one = |name: &str, pattern: &str| json!({ "name": name, "match": pattern });
    json!({
        "$schema": "https://raw.githubusercontent.com/martinring/tmlanguage/master/tmlanguage.json",
        "name": "Bayesian Program",
        "scopeName": "source.bp",
        "fileTypes": ["bp"],
        "patterns": [
            one("comment.line.documentation.bp", "///.*$"),
            one("comment.line.double-slash.bp", "//.*$"),
            json!({ "name": "comment.block.bp", "begin": "/\\*", "end": "\\*/" }),
            json!({
                "name": "string.quoted.double.bp",
                "begin": "\"",
                "end": "\"",
                "patterns": [one("constant.character.escape.bp", "\\\\.")],
            }),
            one("support.function.probability.bp", "\\bP(?=\\()"),
            one("keyword.control.bp", &words(&KEYWORDS)),
            one("storage.type.bp", &words(&TYPES)),
            one("constant.language.bp", "\\b(?:true|false)\\b"),
            one("constant.numeric.bp", "\\b\\d[\\d_]*(?:\\.\\d[\\d_]*)?(?:[eE][+-]?\\d+)?\\b"),
            one("entity.name.function.bp", "\\b[a-z_]\\w*(?=\\s*[({])"),
            one("keyword.operator.bp", "\\.\\.=|==|!=|<=|>=|=>|[-+*/<>=|^]"),
        ],
    })
}

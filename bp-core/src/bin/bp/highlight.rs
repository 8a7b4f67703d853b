//! Syntax highlighting of a program as HTML.
//!
//! In: text. Out: the same text, escaped, with comments, keywords, names of forms and numbers in `span`s. Invariant:
//! without the marks, the text is unchanged; it need not parse.

use bp_core::compiler::xml::escaped;

/// Words of the language.
pub(crate) const KEYWORDS: [&str; 34] = [
    "program",
    "over",
    "in",
    "parameters",
    "variables",
    "decomposition",
    "forms",
    "identification",
    "question",
    "from",
    "by",
    "prod",
    "except",
    "let",
    "if",
    "else",
    "match",
    "and",
    "or",
    "not",
    "first",
    "with",
    "at",
    "argmax",
    "max",
    "best",
    "draw",
    "entropy",
    "nearest",
    "virtual",
    "soft",
    "filter",
    "smooth",
    "predict",
];

/// Words for domains and kinds of parameters.
pub(crate) const TYPES: [&str; 7] = ["bool", "real", "probability", "integer", "size", "bins", "circle"];

/// The text with `span`s.
pub(crate) fn highlighted(text: &str) -> String {
    let mut html = String::with_capacity(text.len() * 2);
    let mut rest = text;
    while let Some(first) = rest.chars().next() {
        let is_part = |character: char| character.is_alphanumeric() || character == '_';
        let (length, class) = if rest.starts_with("//") {
            (rest.find('\n').unwrap_or(rest.len()), "comment")
        } else if rest.starts_with("/*") {
            (rest.find("*/").map_or(rest.len(), |end| end + 2), "comment")
        } else if first.is_ascii_digit() {
            let end = |character: char| !(is_part(character) || character == '.');
            let length = rest.find(end).unwrap_or(rest.len());
            // `1..=6` is two numbers.
            (rest[..length].find("..").unwrap_or(length), "number")
        } else if is_part(first) {
            let length = rest.find(|character| !is_part(character)).unwrap_or(rest.len());
            let word = &rest[..length];
            let called = rest[length..].trim_start().starts_with(['(', '{']);
            let class = match word {
                "P" => "p",
                _ if KEYWORDS.contains(&word) => "keyword",
                _ if TYPES.contains(&word) => "type",
                "true" | "false" => "number",
                "uniform" | "table" => "form",
                _ if called && word.starts_with(char::is_lowercase) => "form",
                _ => "",
            };
            (length, class)
        } else {
            (first.len_utf8(), "")
        };
        let (piece, after) = rest.split_at(length);
        match class {
            "" => html.push_str(&escaped(piece)),
            class => html.push_str(&format!("<span class=\"{class}\">{}</span>", escaped(piece))),
        }
        rest = after;
    }
    html
}

#[cfg(test)]
mod tests {
    use super::highlighted;

    #[test]
    fn words_are_marked_and_nothing_is_lost() {
        let text = "// a <b> & c\nprogram A { variables { X : 1..=6; } forms { P(X) = uniform; } } é \u{1}";
        let html = highlighted(text);
        assert!(html.starts_with("<span class=\"comment\">// a &lt;b&gt; &amp; c</span>\n"), "{html}");
        assert!(html.contains("<span class=\"number\">1</span>..=<span class=\"number\">6</span>"), "{html}");
        let mut bare = html;
        while let (Some(open), Some(close)) = (bare.find('<'), bare.find('>')) {
            bare.replace_range(open..=close, "");
        }
        assert_eq!(bare, bp_core::compiler::xml::escaped(text));
    }
}

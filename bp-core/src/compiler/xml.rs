//! Escaping of text for SVG, MathML and HTML.
//!
//! In: any text. Out: text for an element or for an attribute in double quotes, which is read back unchanged.
//! Invariant: characters not allowed in XML 1.0 become the replacement character; nothing else is lost.

/// A text without markup.
pub fn escaped(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for character in text.chars() {
        match character {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '"' => escaped.push_str("&quot;"),
            '\'' => escaped.push_str("&#39;"),
            '\n' | '\t' => escaped.push(character),
            '\u{fffe}' | '\u{ffff}' => escaped.push('\u{fffd}'),
            _ if character.is_control() => escaped.push('\u{fffd}'),
            _ => escaped.push(character),
        }
    }
    escaped
}

#[cfg(test)]
mod tests {
    use super::escaped;

    #[test]
    fn markup_becomes_text() {
        assert_eq!(escaped("a<b & \"c\" > 'd'"), "a&lt;b &amp; &quot;c&quot; &gt; &#39;d&#39;");
        assert_eq!(escaped("</script>\u{0}\u{1b}\n"), "&lt;/script&gt;\u{fffd}\u{fffd}\n");
        assert_eq!(escaped("ρ ∈ ℝ"), "ρ ∈ ℝ");
    }
}

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

/// Markup in pieces: split at the blanks outside elements, where a line may be broken.
pub fn pieces(markup: &str) -> Vec<String> {
    let (mut pieces, mut piece, mut depth) = (Vec::new(), String::new(), 0);
    let mut rest = markup;
    while let Some(character) = rest.chars().next() {
        let length = match character {
            '<' => rest.find('>').map_or(rest.len(), |end| end + 1),
            _ => character.len_utf8(),
        };
        let (token, after) = rest.split_at(length);
        match token {
            " " if depth == 0 => pieces.push(std::mem::take(&mut piece)),
            _ => piece.push_str(token),
        }
        if token.starts_with("</") {
            depth -= 1;
        } else if token.starts_with('<') && !token.ends_with("/>") {
            depth += 1;
        }
        rest = after;
    }
    pieces.push(piece);
    pieces.retain(|piece| !piece.is_empty());
    pieces
}

#[cfg(test)]
mod tests {
    use super::{escaped, pieces};

    #[test]
    fn a_line_breaks_at_blanks_outside_elements_only() {
        let line = pieces("<mi>P</mi><mo>=</mo> <mrow><mi>a</mi> <mtext>b c</mtext></mrow> <mi>d</mi>");
        let expected = ["<mi>P</mi><mo>=</mo>", "<mrow><mi>a</mi> <mtext>b c</mtext></mrow>", "<mi>d</mi>"];
        assert_eq!(line, expected);
    }

    #[test]
    fn markup_becomes_text() {
        assert_eq!(escaped("a<b & \"c\" > 'd'"), "a&lt;b &amp; &quot;c&quot; &gt; &#39;d&#39;");
        assert_eq!(escaped("</script>\u{0}\u{1b}\n"), "&lt;/script&gt;\u{fffd}\u{fffd}\n");
        assert_eq!(escaped("ρ ∈ ℝ"), "ρ ∈ ℝ");
    }
}

//! Converts tokens back to text.
//!
//! In: the tokens of a program. Out: its text, with a table from bytes to tokens. Invariant: the text has the same
//! tokens as the program; if the compiler provides positions, it has the same lines and blanks too, and lacks only
//! comments.

use crate::quoted::unquote;
use bp_core::compiler::source;
use proc_macro2::{Delimiter, Group, Spacing, Span, TokenStream, TokenTree};
use std::ops::Range;

/// A text with the tokens that it consists of.
pub(crate) struct Written {
    /// The text.
    pub(crate) text: String,
    /// The bytes of each token, in order.
    table: Vec<(Range<usize>, Span)>,
    /// The kind of the last token.
    last: Last,
}

#[derive(Clone, Copy, PartialEq)]
enum Last {
    Nothing,
    /// A name or a literal.
    Word,
    /// Punctuation, alone or joined to the next character.
    Sign(Spacing),
    Bracket,
    /// A comment, which must end its line.
    Comment,
}

impl Written {
    /// Writes tokens back.
    pub(crate) fn of(tokens: TokenStream) -> Self {
        let mut written = Self { text: String::new(), table: Vec::new(), last: Last::Nothing };
        written.stream(tokens);
        written
    }

    /// The first and the last token that a span of the text touches; for an empty span, the token that follows it.
    pub(crate) fn span(&self, span: source::Span) -> (Span, Span) {
        let mut touched =
            self.table.iter().filter(|(bytes, _)| bytes.start < span.end && span.start < bytes.end);
        if let Some((_, first)) = touched.next() {
            return (*first, touched.next_back().map_or(*first, |(_, last)| *last));
        }
        let next = self.table.iter().find(|(bytes, _)| bytes.start >= span.start).or(self.table.last());
        let near = next.map_or_else(Span::call_site, |(_, span)| *span);
        (near, near)
    }

    fn stream(&mut self, tokens: TokenStream) {
        let tokens: Vec<TokenTree> = tokens.into_iter().collect();
        let mut rest = tokens.as_slice();
        while let Some((token, after)) = rest.split_first() {
            if let Some((opening, words, after)) = comment(rest) {
                self.comment(opening, &words, token.span());
                rest = after;
                continue;
            }
            match token {
                TokenTree::Group(group) => self.group(group),
                TokenTree::Punct(sign) => {
                    self.word(&sign.as_char().to_string(), sign.span(), Last::Sign(sign.spacing()));
                }
                word => self.word(&word.to_string(), word.span(), Last::Word),
            }
            rest = after;
        }
    }

    fn group(&mut self, group: &Group) {
        let (open, close) = match group.delimiter() {
            Delimiter::Parenthesis => ("(", ")"),
            Delimiter::Brace => ("{", "}"),
            Delimiter::Bracket => ("[", "]"),
            // An expression passed on by another macro stays one expression.
            Delimiter::None if has_operator(group.stream()) => ("(", ")"),
            Delimiter::None => return self.stream(group.stream()),
        };
        self.word(open, group.span_open(), Last::Bracket);
        self.stream(group.stream());
        self.word(close, group.span_close(), Last::Bracket);
    }

    fn word(&mut self, word: &str, span: Span, kind: Last) {
        self.gap(span, kind);
        let start = self.text.len();
        self.text.push_str(word);
        self.table.push((start..self.text.len(), span));
        self.last = kind;
    }

    fn comment(&mut self, opening: &str, words: &str, span: Span) {
        self.gap(span, Last::Comment);
        let lines: Vec<String> = words.lines().map(|line| format!("{opening}{line}")).collect();
        let text = if lines.is_empty() { opening.to_owned() } else { lines.join("\n") };
        let start = self.text.len();
        self.text.push_str(&text);
        self.table.push((start..self.text.len(), span));
        self.last = Last::Comment;
    }

    /// The whitespace between the last token and the next one.
    fn gap(&mut self, span: Span, next: Last) {
        let Some((_, last)) = self.table.last() else { return };
        let is_sign = matches!(next, Last::Sign(_));
        if self.last == Last::Sign(Spacing::Joint) {
            return;
        }
        let (from, until, to) = (last.start(), last.end(), span.start());
        // Meaningless positions are all equal.
        let known = from != until;
        let apart = (self.last == Last::Word && next == Last::Word)
            || (is_sign && matches!(self.last, Last::Sign(_)));
        if known && to.line > until.line {
            self.text.push('\n');
            self.text.push_str(&" ".repeat(to.column));
        } else if self.last == Last::Comment || next == Last::Comment {
            self.text.push('\n');
        } else if apart || !known || until != to {
            let blanks =
                if known && to.line == until.line { to.column.saturating_sub(until.column) } else { 1 };
            self.text.push_str(&" ".repeat(blanks.clamp(1, 80)));
        }
    }
}

/// `#[doc = "…"]`, into which the compiler converts `/// …`, or `#![doc = "…"]`: its opening sign, its text, and the
/// tokens after it.
fn comment(tokens: &[TokenTree]) -> Option<(&'static str, String, &[TokenTree])> {
    let is =
        |token: &TokenTree, sign: char| matches!(token, TokenTree::Punct(punct) if punct.as_char() == sign);
    let (opening, group, after) = match tokens {
        [hash, TokenTree::Group(group), after @ ..] if is(hash, '#') => ("///", group, after),
        [hash, bang, TokenTree::Group(group), after @ ..] if is(hash, '#') && is(bang, '!') => {
            ("//!", group, after)
        }
        _ => return None,
    };
    let inside: Vec<TokenTree> = group.stream().into_iter().collect();
    match inside.as_slice() {
        [TokenTree::Ident(doc), equal, TokenTree::Literal(words)] if doc == "doc" && is(equal, '=') => {
            Some((opening, unquote(&words.to_string())?, after))
        }
        _ => None,
    }
}

/// True for an expression that its context could split.
fn has_operator(tokens: TokenStream) -> bool {
    tokens.into_iter().any(|token| match token {
        TokenTree::Punct(sign) if sign.as_char() == '=' => sign.spacing() == Spacing::Joint,
        TokenTree::Punct(sign) => "+-*/<>!".contains(sign.as_char()),
        _ => false,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use bp_core::compiler::source::Source;
    use bp_core::compiler::syntax::parse;

    /// The text of the tokens of a text.
    fn back(text: &str) -> Written {
        Written::of(text.parse().unwrap_or_else(|error| panic!("{error}: {text}")))
    }

    /// The same tokens without positions, as from a macro that builds tokens.
    fn without_places(tokens: TokenStream) -> TokenStream {
        let moved = tokens.into_iter().map(|token| {
            let mut token = match token {
                TokenTree::Group(group) => {
                    Group::new(group.delimiter(), without_places(group.stream())).into()
                }
                other => other,
            };
            token.set_span(Span::call_site());
            token
        });
        moved.collect()
    }

    /// The text without comments other than documentation; tokens do not contain them.
    fn uncommented(text: &str) -> String {
        let lines = text.lines().map(|line| match line.find("// ") {
            Some(start) if !line.trim_start().starts_with("///") => line[..start].trim_end(),
            _ => line.trim_end(),
        });
        lines.collect::<Vec<_>>().join("\n")
    }

    #[test]
    fn programs_come_back_as_they_were_written() {
        let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../tests/programs");
        let mut count = 0;
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            let text = uncommented(&std::fs::read_to_string(&path).unwrap());
            let tree = parse(&Source::new("file", &text)).unwrap();
            let with_places = back(&text).text;
            assert_eq!(with_places, text, "{}", path.display());
            assert_eq!(parse(&Source::new("tokens", with_places)).unwrap(), tree);
            let without = Written::of(without_places(text.parse().unwrap())).text;
            let again = parse(&Source::new("tokens", &without));
            assert_eq!(
                again.unwrap_or_else(|wrong| panic!("{wrong}\n{without}")),
                tree,
                "{}",
                path.display()
            );
            count += 1;
        }
        assert!(count >= 6, "programs are missing from {folder}");
    }

    #[test]
    fn signs_stay_together_and_words_apart() {
        let text =
            "a..=b a == b a != b a <= b a >= b a => b O^-1 { No } or 1..=N -0.5 1. 1e-3 1_000 'a P(Z[i] | V)";
        assert_eq!(back(text).text, text);
        let bare = Written::of(without_places(text.parse().unwrap())).text;
        let expected = "a ..= b a == b a != b a <= b a >= b a => b O ^- 1 { No } or 1 ..= N - 0.5 1. 1e-3 1_000 'a P ( Z [ i ] | V )";
        assert_eq!(bare, expected);
    }

    #[test]
    fn names_in_quotes_come_back() {
        let text = "P(\"Asy/Patch\" | \"two words\") { \"<5\", \"say \\\"so\\\"\" }";
        assert_eq!(back(text).text, text);
    }

    #[test]
    fn documentation_comes_back_as_lines() {
        let text = "/// \"quoted\" \\ \u{3c1}\n/// two\nprogram A { ///\n}";
        assert_eq!(back(text).text, "/// \"quoted\" \\ \u{3c1}\n/// two\nprogram A {\n///\n}");
        assert_eq!(back("/** one\n two */ program").text, "/// one\n/// two \nprogram");
        assert_eq!(back("#[doc = \"one\"] program").text, "///one\nprogram");
        assert_eq!(back("#[doc] # 3").text, "#[doc] # 3");
    }

    #[test]
    fn expressions_passed_by_macros_stay_whole() {
        let inside = |text: &str| {
            let group = Group::new(Delimiter::None, text.parse().unwrap());
            Written::of(TokenTree::from(group).into()).text
        };
        assert_eq!(inside("a + 1"), "( a + 1 )");
        assert_eq!(inside("1..=N"), "1..=N");
        assert_eq!(inside("normal(0, 1)"), "normal(0, 1)");
    }

    #[test]
    fn every_place_has_tokens() {
        let written = back("program A { variables }");
        let columns = |start, end| {
            let (first, last) = written.span(source::Span::new(start, end));
            (first.start().column, last.end().column)
        };
        assert_eq!(columns(8, 9), (8, 9));
        assert_eq!(columns(8, 14), (8, 21));
        assert_eq!(columns(7, 7), (8, 9));
        assert_eq!(columns(99, 99), (22, 23));
    }
}

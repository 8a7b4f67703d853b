//! The lexer of BIF, Hugin NET and UAI: words, quoted strings and punctuation.
//!
//! In: a text, and the signs of its format. Out: [`Token`]s with their spans. Invariant: blanks, byte order marks and
//! comments are skipped; every token moves the position forward, so reading terminates.
//!
//! Comments: `// …`, `/* … */` and `# …`, `% …`, which only begin where a token would: `Asy//Patch` and `12%` are
//! words. `#` and `%` also begin labels (`#1`): they are comments at the start of a line, after `;` or `}`, or before a
//! blank, and `%` always in some formats.

use crate::diagnostic::Diagnostic;
use crate::source::Span;

/// The lexical rules of a format.
pub(super) struct Dialect {
    /// Characters that are tokens of their own.
    pub(super) signs: &'static [u8],
    /// Whether `%` always begins a comment.
    pub(super) percent: bool,
    /// Whether `\"` in a string is a quotation mark.
    pub(super) escapes: bool,
}

/// One token.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Token<'s> {
    /// Characters up to the next blank or sign.
    Word(&'s str),
    /// The characters between two `"`.
    Quoted(&'s str),
    /// A sign of the format.
    Sign(u8),
    /// The end of the text.
    End,
}

/// A text being read.
#[derive(Clone)]
pub(super) struct Lexer<'s> {
    text: &'s str,
    dialect: &'static Dialect,
    /// The position of the next token.
    at: usize,
    /// Whether `#` and `%` always begin a comment here.
    fresh: bool,
    peeked: Option<(Token<'s>, Span)>,
}

impl<'s> Lexer<'s> {
    pub(super) fn new(text: &'s str, dialect: &'static Dialect) -> Self {
        let at = if text.starts_with('\u{feff}') { '\u{feff}'.len_utf8() } else { 0 };
        Self { text, dialect, at, fresh: true, peeked: None }
    }

    /// The next token, without consuming it.
    pub(super) fn peek(&mut self) -> Result<(Token<'s>, Span), Diagnostic> {
        if let Some(peeked) = self.peeked {
            return Ok(peeked);
        }
        let token = self.token()?;
        self.peeked = Some(token);
        Ok(token)
    }

    /// The next token.
    pub(super) fn next(&mut self) -> Result<(Token<'s>, Span), Diagnostic> {
        match self.peeked.take() {
            Some(peeked) => Ok(peeked),
            None => self.token(),
        }
    }

    /// Consumes a sign, if it is next.
    pub(super) fn takes(&mut self, sign: u8) -> Result<bool, Diagnostic> {
        let here = self.peek()?.0 == Token::Sign(sign);
        if here {
            self.peeked = None;
        }
        Ok(here)
    }

    /// Consumes a required sign.
    pub(super) fn sign(&mut self, sign: u8, after: &str) -> Result<Span, Diagnostic> {
        match self.next()? {
            (Token::Sign(found), span) if found == sign => Ok(span),
            (found, span) => Err(unexpected(span, found, &format!("`{}` after {after}", char::from(sign)))),
        }
    }

    /// Consumes a name, quoted or not.
    pub(super) fn name(&mut self, what: &str) -> Result<(&'s str, Span), Diagnostic> {
        match self.next()? {
            (Token::Word(name) | Token::Quoted(name), span) => Ok((name, span)),
            (found, span) => Err(unexpected(span, found, what)),
        }
    }

    /// Skips the rest of a property: up to `;`, or without it to the end of the line, or up to the `}` that closes its
    /// block.
    pub(super) fn skip_property(&mut self) {
        let start = self.peeked.take().map_or(self.at, |(_, span)| span.start);
        let bytes = self.text.as_bytes();
        // An unclosed quotation mark is an ordinary character.
        let end = property_end(bytes, start, true).or_else(|| property_end(bytes, start, false));
        let end = end.unwrap_or(bytes.len());
        self.at = end + usize::from(matches!(bytes.get(end), Some(b';' | b'\n')));
        self.fresh = true;
    }

    fn token(&mut self) -> Result<(Token<'s>, Span), Diagnostic> {
        self.blanks()?;
        let (bytes, start) = (self.text.as_bytes(), self.at);
        let Some(first) = bytes.get(start).copied() else {
            return Ok((Token::End, Span::new(start, start)));
        };
        self.fresh = matches!(first, b';' | b'}');
        if self.dialect.signs.contains(&first) {
            self.at += 1;
            return Ok((Token::Sign(first), Span::new(start, start + 1)));
        }
        if first == b'"' {
            let Some(length) = closing(&bytes[start + 1..], self.dialect.escapes) else {
                return Err(Diagnostic::new(Span::new(start, start + 1), "this `\"` is never closed"));
            };
            self.at = start + length + 2;
            let inner = &self.text[start + 1..start + 1 + length];
            return Ok((Token::Quoted(inner), Span::new(start, self.at)));
        }
        let ends =
            |byte: &u8| byte.is_ascii_whitespace() || *byte == b'"' || self.dialect.signs.contains(byte);
        let length = bytes[start..].iter().position(ends).unwrap_or(bytes.len() - start);
        self.at = start + length;
        Ok((Token::Word(&self.text[start..self.at]), Span::new(start, self.at)))
    }

    /// Moves to the next token.
    fn blanks(&mut self) -> Result<(), Diagnostic> {
        let bytes = self.text.as_bytes();
        loop {
            let rest = &bytes[self.at..];
            match rest {
                [b'\n', ..] => {
                    self.fresh = true;
                    self.at += 1;
                }
                [byte, ..] if byte.is_ascii_whitespace() || *byte == 0x0b => self.at += 1,
                [b'/', b'/', ..] => self.skip_line(),
                [b'/', b'*', ..] => {
                    let Some(end) = rest.windows(2).skip(2).position(|pair| pair == b"*/") else {
                        let span = Span::new(self.at, self.at + 2);
                        return Err(Diagnostic::new(span, "this `/*` is never closed"));
                    };
                    self.at += end + 4;
                }
                [b'#' | b'%', after @ ..]
                    if self.fresh
                        || (self.dialect.percent && rest[0] == b'%')
                        || after.first().is_none_or(|byte| byte.is_ascii_whitespace()) =>
                {
                    self.skip_line();
                }
                _ => return Ok(()),
            }
        }
    }

    fn skip_line(&mut self) {
        let rest = &self.text.as_bytes()[self.at..];
        self.at += rest.iter().position(|byte| *byte == b'\n').unwrap_or(rest.len());
    }
}

/// The end of a property; `None` if a quotation mark is never closed.
fn property_end(bytes: &[u8], start: usize, quotes: bool) -> Option<usize> {
    let (mut quoted, mut depth) = (false, 0usize);
    for (at, byte) in bytes.iter().enumerate().skip(start) {
        match byte {
            b'"' if quotes => quoted = !quoted,
            _ if quoted => {}
            b';' | b'\n' => return Some(at),
            b'{' => depth += 1,
            b'}' if depth == 0 => return Some(at),
            b'}' => depth -= 1,
            _ => {}
        }
    }
    (!quoted).then_some(bytes.len())
}

/// Distance to the closing `"`; with escapes, those after a `\` are ignored.
fn closing(bytes: &[u8], escapes: bool) -> Option<usize> {
    let mut escaped = false;
    bytes.iter().position(|byte| {
        let closes = *byte == b'"' && !escaped;
        escaped = escapes && *byte == b'\\' && !escaped;
        closes
    })
}

/// The token that was found instead of the expected one.
pub(super) fn unexpected(span: Span, found: Token<'_>, expected: &str) -> Diagnostic {
    let found = match found {
        Token::Word(word) | Token::Quoted(word) => format!("`{}`", shortened(word)),
        Token::Sign(sign) => format!("`{}`", char::from(sign)),
        Token::End => "the end of the file".to_owned(),
    };
    Diagnostic::new(span, format!("expected {expected}, found {found}"))
}

/// A word of a message: never longer than a line.
pub(super) fn shortened(word: &str) -> String {
    match word.char_indices().nth(40) {
        Some((end, _)) => format!("{}…", &word[..end]),
        None => word.to_owned(),
    }
}

/// A number, as Rust reads it: `1e-3`, `.5` and `1.` are numbers, `nan` and `inf` are not.
pub(super) fn number(word: &str) -> Option<f64> {
    let first = *word.as_bytes().first()?;
    let begins = first.is_ascii_digit() || matches!(first, b'.' | b'-' | b'+');
    if !begins {
        return None;
    }
    word.parse().ok().filter(|number: &f64| number.is_finite())
}

/// A probability at a span.
pub(super) fn probability(word: &str, span: Span) -> Result<f64, Diagnostic> {
    let read = number(word).ok_or_else(|| unexpected(span, Token::Word(word), "a probability"))?;
    // Above one by rounding; its row is divided by its sum.
    match (0.0..=1.01).contains(&read) {
        true => Ok(read),
        false => {
            let message = format!("a probability lies between 0 and 1, but this is {}", shortened(word));
            Err(Diagnostic::new(span, message))
        }
    }
}

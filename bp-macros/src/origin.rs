//! The origin of a program's text, which determines where errors are reported.
//!
//! In: the tokens of the invocation. Out: the text as a [`Source`], and the mapping from its bytes to tokens.
//! Invariant: every position of the text maps to tokens: its own if it was written inline, the path if it is in a file.

use crate::errors;
use crate::quoted::unquote;
use crate::tokens::Written;
use bp_core::compiler::diagnostic::Diagnostics;
use bp_core::compiler::source::{self, Source};
use proc_macro2::{Delimiter, Span, TokenStream, TokenTree};
use std::io::ErrorKind;
use std::path::Path;

/// The origin of a source.
pub(crate) enum Origin {
    /// Written between the brackets of the macro.
    Here(Written),
    /// Read from a file: its full path, and the span of the literal that names it.
    File { path: String, literal: Span },
}

impl Origin {
    /// The first and the last token of a span of the text.
    pub(crate) fn span(&self, span: source::Span) -> (Span, Span) {
        match self {
            Origin::Here(written) => written.span(span),
            Origin::File { literal, .. } => (*literal, *literal),
        }
    }

    /// The path of the file, if there is one.
    pub(crate) fn path(&self) -> Option<&str> {
        match self {
            Origin::Here(_) => None,
            Origin::File { path, .. } => Some(path),
        }
    }

    /// One `compile_error!` for each error.
    pub(crate) fn errors(&self, wrong: &Diagnostics, source: &Source) -> TokenStream {
        let errors = wrong.iter().map(|diagnostic| {
            let message = match self {
                Origin::Here(written) => errors::in_words(diagnostic, source, written),
                Origin::File { .. } => errors::with_its_lines(diagnostic, source),
            };
            errors::compile_error(&message, self.span(diagnostic.span))
        });
        errors.collect()
    }
}

/// The text in the invocation, or in the file that it names.
pub(crate) fn open(input: TokenStream, root: &Path) -> Result<(Source, Origin), TokenStream> {
    let mut tokens = input.clone().into_iter();
    let Some(first) = tokens.next() else {
        let here = Span::call_site();
        let message = "expected a program, `program Name { … }`, or the path of a file, `\"models/name.bp\"`";
        return Err(errors::compile_error(message, (here, here)));
    };
    let Some((path, literal)) = path(&first) else {
        let written = Written::of(input);
        return Ok((Source::new("bayesian_program!", &written.text), Origin::Here(written)));
    };
    let rest: Vec<TokenTree> = tokens.collect();
    if let (Some(start), Some(end)) = (rest.first(), rest.last()) {
        return Err(errors::compile_error(
            "nothing may follow the path of a program",
            (start.span(), end.span()),
        ));
    }
    read(&path, root, literal).map_err(|message| errors::compile_error(&message, (literal, literal)))
}

/// The text of a string literal, also of one that another macro passed on.
fn path(token: &TokenTree) -> Option<(String, Span)> {
    match token {
        TokenTree::Literal(literal) => Some((unquote(&literal.to_string())?, literal.span())),
        TokenTree::Group(group) if group.delimiter() == Delimiter::None => {
            let inside: Vec<TokenTree> = group.stream().into_iter().collect();
            let [only] = inside.as_slice() else { return None };
            path(only)
        }
        _ => None,
    }
}

fn read(path: &str, root: &Path, literal: Span) -> Result<(Source, Origin), String> {
    let whole = root.join(path);
    let bytes = std::fs::read(&whole).map_err(|error| match error.kind() {
        ErrorKind::NotFound => {
            format!("there is no file `{path}`\nhelp: paths start at the folder of the package's Cargo.toml")
        }
        _ => format!("cannot read `{path}`: {error}"),
    })?;
    let text = String::from_utf8(bytes).map_err(|error| {
        format!("`{path}` is not UTF-8 text: byte {} begins no character", error.utf8_error().valid_up_to())
    })?;
    let whole =
        whole.to_str().ok_or_else(|| format!("the folder of `{path}` has a name that is not UTF-8"))?;
    Ok((Source::new(path, text), Origin::File { path: whole.to_owned(), literal }))
}

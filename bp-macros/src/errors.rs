//! Diagnostics as `compile_error!`s.
//!
//! In: a diagnostic and its tokens. Out: a macro invocation with which the compiler reports it there. Invariant: the
//! first line is the diagnostic's own message.

use crate::tokens::Written;
use bp_core::compiler::diagnostic::{Diagnostic, Diagnostics};
use bp_core::compiler::source::Source;
use proc_macro2::{Delimiter, Group, Literal, Span, TokenStream, TokenTree};
use quote::quote_spanned;

/// An error under everything from the first to the last token.
///
/// The compiler underlines an invocation from the start of its path to the end of its brackets, so these two carry the
/// two places.
pub(crate) fn compile_error(message: &str, (first, last): (Span, Span)) -> TokenStream {
    let mut text = Literal::string(message);
    text.set_span(last);
    let mut brackets = Group::new(Delimiter::Brace, TokenTree::from(text).into());
    brackets.set_span(last);
    let mut error = quote_spanned! { first => ::core::compile_error! };
    error.extend([TokenTree::from(brackets)]);
    error
}

/// The message with its labels, which quote the text and its line, and the help.
pub(crate) fn in_words(diagnostic: &Diagnostic, source: &Source, written: &Written) -> String {
    let mut text = diagnostic.message.clone();
    for (span, remark) in &diagnostic.labels {
        text.push_str(&format!("\nnote: {remark}"));
        if *span != diagnostic.span {
            let words: Vec<&str> = source.slice(*span).split_whitespace().collect();
            let line = written.span(*span).0.start().line;
            text.push_str(&format!(": `{}` on line {line}", words.join(" ")));
        }
    }
    if let Some(help) = &diagnostic.help {
        text.push_str(&format!("\nhelp: {help}"));
    }
    text
}

/// The message with the source lines of the file.
pub(crate) fn with_its_lines(diagnostic: &Diagnostic, source: &Source) -> String {
    let shown = Diagnostics::from(diagnostic.clone()).render(source, false);
    // The compiler writes `error:` itself.
    shown.strip_prefix("error: ").unwrap_or(&shown).trim_end().to_owned()
}

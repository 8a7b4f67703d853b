//! The stages of one invocation: tokens, text, tree, model, Rust.
//!
//! In: the tokens between the brackets, and the folder where paths start. Out: the module, or the errors. Invariant:
//! the module's name has the span of the program's name, and the module causes no lint in the surrounding code.

use crate::origin::{self, Origin};
use bp_core::compiler::answer::link;
use bp_core::compiler::emit::{emit_rust, snake};
use bp_core::compiler::syntax::ast::Program;
use bp_core::compiler::syntax::{check, parse};
use proc_macro2::{Ident, TokenStream};
use quote::quote;
use std::borrow::Cow;
use std::path::Path;

/// The output of the macro: the module, or `compile_error!`s.
pub(crate) fn expand(input: TokenStream, root: &Path) -> Result<TokenStream, TokenStream> {
    let (source, origin) = origin::open(input, root)?;
    let mut file = parse(&source).map_err(|wrong| origin.errors(&wrong, &source))?;
    let mut models = check(&file).map_err(|wrong| origin.errors(&wrong, &source))?;
    // The last program is asked; the earlier ones are its subroutines.
    let (program, model) =
        file.programs.pop().zip(models.pop()).expect("internal: the grammar promises a program");
    // A question that cannot be compiled is omitted; the others are kept.
    let (model, unlinked) = match link(&model) {
        Ok(linked) => (linked, None),
        Err(error) => (Cow::Borrowed(&model), Some(error)),
    };
    let body = emit_rust(&model, &source, unlinked.as_ref()).text;
    let body = body.parse().expect("internal: the emitted text is Rust");
    Ok(module(&program, &origin, body))
}

fn module(program: &Program, origin: &Origin, body: TokenStream) -> TokenStream {
    let name = Ident::new(&snake(&program.name.text), origin.span(program.name.span()).0);
    let written = program.comments.documentation();
    let called = format!("The Bayesian Program `{}`.", program.name.text);
    let documentation = if written.is_empty() { called } else { written };
    // The module includes the file, so that the compiler recompiles when it changes.
    let file = origin.path().map(|path| quote! { const _: &[u8] = ::core::include_bytes!(#path); });
    quote! {
        #[doc = #documentation]
        #[allow(missing_docs, unused, nonstandard_style, unreachable_pub)]
        #[allow(clippy::all, clippy::pedantic, clippy::nursery, rustdoc::all)]
        pub mod #name {
            #file
            #body
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bp_core::compiler::source::Source;
    use bp_core::compiler::syntax::compile;

    fn expanded(input: &str) -> String {
        let root = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/.."));
        let (Ok(tokens) | Err(tokens)) = expand(input.parse().unwrap(), root);
        tokens.to_string()
    }

    #[test]
    fn a_file_is_read_again_when_it_changes() {
        let file = expanded("\"tests/programs/wet_grass.bp\"");
        assert!(file.contains("include_bytes"), "{file}");
        assert!(file.contains("Is it the rain or the sprinkler?"), "{file}");
        assert!(!file.contains("compile_error"), "{file}");
    }

    #[test]
    fn wrong_input_is_one_error() {
        let cases = [
            ("", "expected a program"),
            ("\"a.bp\", 3", "nothing may follow the path"),
            ("\"no/such.bp\"", "there is no file `no/such.bp`"),
            ("\"tests\"", "cannot read `tests`"),
            ("3", "expected `program`, found `3`"),
        ];
        for (input, message) in cases {
            let text = expanded(input);
            assert_eq!(text.matches("compile_error").count(), 1, "{text}");
            assert!(text.contains(message), "{text}");
        }
    }

    #[test]
    fn both_entry_points_give_the_diagnostics_of_the_text() {
        let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../tests/errors");
        let mut count = 0;
        for entry in std::fs::read_dir(folder).unwrap() {
            let name = entry.unwrap().file_name().into_string().unwrap();
            let text = std::fs::read_to_string(Path::new(folder).join(&name)).unwrap();
            // Not every wrong text is a sequence of Rust tokens, and an empty invocation is a different error.
            let (true, Ok(here)) = (name.ends_with(".bp"), text.parse::<TokenStream>()) else { continue };
            if here.is_empty() {
                continue;
            }
            let Err(wrong) = compile(&Source::new(&name, &text)) else { continue };
            let (file, tokens) = (expanded(&format!("\"tests/errors/{name}\"")), expanded(&text));
            for expansion in [&file, &tokens] {
                assert_eq!(expansion.matches("compile_error").count(), wrong.0.len(), "{name}: {expansion}");
                for diagnostic in wrong.iter() {
                    let message = format!("{:?}", diagnostic.message);
                    assert!(expansion.contains(message.trim_matches('"')), "{name}: {expansion}");
                }
            }
            assert!(file.contains(&format!("tests/errors/{name}:")), "{file}");
            count += 1;
        }
        assert!(count >= 30, "programs are missing from {folder}");
    }
}

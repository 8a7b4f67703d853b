//! The whole way of one invocation: tokens, text, tree, model, Rust.
//!
//! In: the tokens between the brackets, and the folder where paths start. Out: the module, or the errors. Invariant: the
//! module's name carries the place of the program's name, and the module sets off no lint of the code around it.

use crate::errors;
use crate::origin::{self, Origin};
use bp_core::model::Model;
use bp_core::source::Source;
use bp_core::syntax::{ast::Program, check, parse};
use proc_macro2::{Ident, Span, TokenStream};
use quote::quote;
use std::path::Path;

/// What the macro writes: the module on success, `compile_error!`s otherwise.
pub(crate) fn expand(input: TokenStream, root: &Path) -> Result<TokenStream, TokenStream> {
    let (source, origin) = origin::open(input, root)?;
    let program = parse(&source).map_err(|wrong| origin.errors(&wrong, &source))?;
    let model = check(&program).map_err(|wrong| origin.errors(&wrong, &source))?;
    let name = origin.span(program.name.span());
    let body = emit(&model, &source).map_err(|wrong| errors::compile_error(&wrong, name))?;
    let body = body.parse().expect("internal: the emitted text is Rust");
    Ok(module(&program, &origin, body))
}

/// The text of the module's body.
fn emit(_model: &Model, source: &Source) -> Result<String, String> {
    Ok(format!(
        "/// The program as it was written.\n\
         pub const SOURCE: &str = {text:?};\n\
         /// What the program means.\n\
         pub fn model() -> ::bp_core::model::Model {{\n\
             let source = ::bp_core::source::Source::new({name:?}, SOURCE);\n\
             ::bp_core::syntax::compile(&source).expect(\"internal: checked when it was compiled\")\n\
         }}",
        text = source.text,
        name = source.name,
    ))
}

fn module(program: &Program, origin: &Origin, body: TokenStream) -> TokenStream {
    let name = module_name(&program.name.text, origin.span(program.name.span()).0);
    let said = program.comments.documentation();
    let called = format!("The Bayesian Program `{}`.", program.name.text);
    let documentation = if said.is_empty() { called } else { said };
    // The compiler looks at the file again when it changes, because the module reads it.
    let file = origin.path().map(|path| quote! { const _: &[u8] = ::core::include_bytes!(#path); });
    quote! {
        #[doc = #documentation]
        #[allow(missing_docs, unused, nonstandard_style, unreachable_pub)]
        #[allow(clippy::all, clippy::pedantic, clippy::nursery)]
        pub mod #name {
            #file
            #body
        }
    }
}

/// `WetGrass` as a module: `wet_grass`, written raw so that `Loop` may be one too.
fn module_name(program: &str, span: Span) -> Ident {
    let snake = snake_case(program);
    // The three words that no name may be, raw or not.
    if ["self", "super", "crate"].contains(&snake.as_str()) {
        return Ident::new(&format!("{snake}_"), span);
    }
    Ident::new_raw(&snake, span)
}

fn snake_case(name: &str) -> String {
    let letters: Vec<char> = name.chars().collect();
    let mut snake = String::new();
    for (place, letter) in letters.iter().enumerate() {
        let starts_a_word = letter.is_uppercase() && place > 0 && {
            let before = letters[place - 1];
            let ends_capitals = letters.get(place + 1).is_some_and(|after| after.is_lowercase());
            before.is_lowercase() || before.is_numeric() || (before.is_uppercase() && ends_capitals)
        };
        if starts_a_word {
            snake.push('_');
        }
        snake.extend(letter.to_lowercase());
    }
    snake
}

#[cfg(test)]
mod tests {
    use super::*;

    fn expanded(input: &str) -> String {
        let root = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/.."));
        let (Ok(tokens) | Err(tokens)) = expand(input.parse().unwrap(), root);
        tokens.to_string()
    }

    #[test]
    fn names_of_modules() {
        let cases = [
            ("WetGrass", "wet_grass"),
            ("Cell", "cell"),
            ("HTTPServer", "http_server"),
            ("Cell2Door", "cell2_door"),
            ("line_of_sight", "line_of_sight"),
            ("BVM", "bvm"),
        ];
        for (name, snake) in cases {
            assert_eq!(snake_case(name), snake);
        }
        assert_eq!(module_name("Self", Span::call_site()).to_string(), "self_");
        assert_eq!(module_name("Loop", Span::call_site()).to_string(), "r#loop");
    }

    #[test]
    fn a_file_and_its_tokens_expand_to_the_same_model() {
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
    fn a_wrong_file_is_shown_by_line_and_column() {
        let text = expanded("\"tests/errors/unknown_names.bp\"");
        assert_eq!(text.matches("compile_error").count(), 6, "{text}");
        assert!(text.contains("tests/errors/unknown_names.bp:9:30"), "{text}");
    }
}

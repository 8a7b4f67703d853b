//! The reference page of the language against the language.
//!
//! In: the forms and functions that messages list, and `docs/language.md`. Out: pass if each has a row of a table there.
//! Invariant: nothing that can be written is missing from the page.

use bp_core::compiler::source::Source;
use bp_core::compiler::syntax::compile;

/// The names that a message lists after these words.
fn listed(form: &str, words: &str) -> Vec<String> {
    let text = format!(
        "program One {{ variables {{ X : bool; }} decomposition {{ P(X) }} forms {{ P(X) = {form}; }} }}"
    );
    let source = Source::new("one.bp".to_owned(), text);
    let page = compile(&source).unwrap_err().render(&source, false);
    let list = page.split_once(words).unwrap_or_else(|| panic!("{page}")).1.lines().next().unwrap();
    list.split('`').skip(1).step_by(2).map(str::to_owned).collect()
}

#[test]
fn every_form_and_every_function_has_a_row() {
    let page = include_str!("../../docs/language.md");
    // The cells of all first columns.
    let cells: Vec<&str> =
        page.lines().filter_map(|line| line.strip_prefix("| ")?.split(" | ").next()).collect();
    let has_row = |name: &str| {
        let spelled = |cell: &&str| {
            cell.split('`').skip(1).step_by(2).any(|code| {
                code.strip_prefix(name).is_some_and(|rest| rest.is_empty() || rest.starts_with(['(', ' ']))
            })
        };
        cells.iter().any(spelled)
    };
    let forms = listed("nothing_of_the_kind(1)", "known forms are");
    let functions = listed("bernoulli(nothing_of_the_kind(1))", "the functions are");
    assert!(forms.len() > 30 && functions.len() > 20, "{forms:?} {functions:?}");
    let missing: Vec<&String> = forms.iter().chain(&functions).filter(|name| !has_row(name)).collect();
    assert!(missing.is_empty(), "{missing:?}");
}

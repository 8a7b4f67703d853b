//! Names and labels that need quotes: the learned text gives the same answers.
//!
//! In: random programs with names and labels of any letters. Out: pass if the written text parses, and every answer has
//! the same bits. Invariant: seeded.

use crate::support::learning::{answer, learned, program, written};
use crate::support::model_of;
use bp_core::compiler::spelling::quoted;
use proptest::prelude::*;

/// Names as data have them, and some that are words of the language.
fn name() -> impl Strategy<Value = String> {
    prop_oneof![
        "[<>=+ a-zA-Z0-9_./%äßσ²]{1,8}",
        proptest::sample::select(vec![
            "<20", "20-30", "5", "1e3", "true", "if", "P", "_", "a\"b", "a\\b", "x, y", "hidden", "-1",
        ])
        .prop_map(str::to_owned),
    ]
    .prop_filter("blanks around", |name| name.trim() == name && !name.is_empty())
}

fn cell(text: &str) -> String {
    format!("\"{}\"", text.replace('"', "\"\""))
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 48, failure_persistence: None, rng_seed: proptest::test_runner::RngSeed::Fixed(14), ..ProptestConfig::default() })]

    #[test]
    fn learned_programs_parse_and_answer_the_same(
        names in proptest::collection::hash_set(name(), 4),
        labels in proptest::collection::hash_set(name(), 3),
        rows in proptest::collection::vec((0usize..3, any::<bool>(), -5.0..5.0_f64, 0usize..3), 6..20),
        way in prop_oneof![Just("unknown"), Just("unknown(histogram)"), Just("unknown(dirichlet(0.3))")],
    ) {
        let names: Vec<String> = names.into_iter().collect();
        let labels: Vec<String> = labels.into_iter().collect();
        // A set is not drawn if the language would confuse one of its labels with another name of the same variable.
        let missing = |label: &String| bp_core::compiler::data::is_missing(label);
        prop_assume!(!labels.iter().any(missing));
        let own: Vec<_> = names.iter().map(|name| quoted(name)).collect();
        let [a, b, x, c] = [&own[0], &own[1], &own[2], &own[3]];
        let domain: Vec<_> = labels.iter().map(|label| quoted(label)).collect();
        let domain = domain.join(", ");
        let text = program(
            &format!("{a} : {{ {domain} }}; {b} : bool; {x} : real; {c} : {{ {domain} }};"),
            &format!("P({a}) P({b} | {a}) P({x} | {a} {b}) P({c} | {b} {a})"),
            &format!(
                "P({a}) = unknown; P({b} | {a}) = {way}; P({x} | {a} {b}) = unknown(normal); P({c} | {b} {a}) = {way};"
            ),
        );
        let mut table = names.iter().map(|name| cell(name)).collect::<Vec<_>>().join(",");
        for (a, b, x, c) in rows {
            table.push_str(&format!("\n{},{b},{x},{}", cell(&labels[a]), cell(&labels[c])));
        }
        let learned = learned(&text, &table);
        let model = model_of(&written(&text, &learned));
        for asked in [
            format!("P({a} | {b} = true)"),
            format!("P({c} | {b} = false)"),
            format!("P({b} | {a})"),
            format!("P({a} | {x} = 0.5, {b} = true)"),
        ] {
            prop_assert_eq!(answer(learned.model(), &asked), answer(&model, &asked), "{}", asked);
        }
    }
}

#[test]
fn numbers_are_written_as_they_are() {
    // Tenths, and numbers of many sizes, which a decimal of few digits would not be.
    let text = program(
        "K : { \"<20\", \"20+\" }; X : real;",
        "P(K) P(X | K)",
        "P(K) = unknown(histogram); P(X | K) = unknown;",
    );
    let rows = "K,X\n<20,1e-9\n<20,3.3e-9\n<20,0\n20+,1e17\n20+,-7e16\n20+,1\n20+,2\n";
    let learned = learned(&text, rows);
    let words = written(&text, &learned);
    let model = model_of(&words);
    for asked in ["P(X = 1e-9 | K = \"<20\")", "P(X = 1e16 | K = \"20+\")", "P(K)"] {
        assert_eq!(answer(learned.model(), asked), answer(&model, asked), "{words}");
    }
}

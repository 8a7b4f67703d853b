//! Network formats: what is written reads back, dialects are understood, broken files get a place and a reason.
//!
//! In: networks made at random, and small files of every dialect. Out: equal networks, or messages. Invariant: numbers
//! come back to the last bit; whatever the bytes, an answer comes back.

use bp_core::answer;
use bp_core::exec::Inputs;
use bp_core::ids::{Id, VariableId};
use bp_core::io::{self, Format, Network, uai};
use bp_core::model::{
    Ask, Domain, Evidence, Factor, Form, Known, Model, ModelBuilder, Question, Reduction, Searched, Value,
};
use bp_core::source::Source;
use proptest::prelude::*;

/// A network as what it says: names, values, and for each variable its parents and numbers.
type Said = Vec<(String, Vec<String>, Vec<usize>, Vec<f64>)>;

fn said(model: &Model) -> Said {
    let distributions = model.distributions();
    (model.variables.iter())
        .map(|(id, variable)| {
            let factor = &model.factors[distributions[id.position()].unwrap()];
            let constant = |id| model.constant(id).unwrap();
            let numbers = match &factor.form {
                Form::Constants(numbers) => numbers.clone(),
                Form::Table(rows) => rows.iter().flatten().map(|entry| constant(*entry)).collect(),
                Form::Categorical(row) => row.iter().map(|entry| constant(*entry)).collect(),
                other => panic!("{}", other.name()),
            };
            let states = (0..variable.domain.count().unwrap()).map(|value| variable.domain.value_name(value));
            let parents = factor.right.iter().map(|use_| use_.variable.position()).collect();
            (variable.name.clone(), states.collect(), parents, numbers)
        })
        .collect()
}

fn read(format: Format, text: &str) -> Network {
    let source = Source::new("network", text);
    io::read(&source, format).unwrap_or_else(|wrong| panic!("{}\n{text}", wrong.render(&source, false)))
}

const STATES: [&[&str]; 10] = [
    &["<5", "5-12", "12+"],
    &[">=7.5", "<7.5"],
    &["true", "false"],
    &["false", "true"],
    &["0", "1", "2"],
    &["-1", "0"],
    &["0", "2", "5"],
    &["two words", "a,b", "c;d", "(e)", "#1", "%"],
    &["only"],
    &["été", "&amp;", "//x", "a\\"],
];

const NAMES: [&str; 12] =
    ["Asy/Patch", "two words", "a-b", "P", "_", "Äpfel", "0", "node", "x|y", "<b>", "//", "plain"];

/// A network at random: which names and values, which of the variables before it each depends on, and weights.
fn networks() -> impl Strategy<Value = Model> {
    let node = (0..STATES.len(), prop::collection::vec(any::<bool>(), NAMES.len()), any::<u64>());
    (Just(NAMES.to_vec()).prop_shuffle(), prop::collection::vec(node, 1..6)).prop_map(|(names, nodes)| {
        let mut model = ModelBuilder::new("two words");
        let mut made: Vec<(VariableId, usize)> = Vec::new();
        for (name, (states, parents, seed)) in names.iter().zip(nodes) {
            let id = model.variable(name, Domain::labels(STATES[states].iter().copied()));
            let parents: Vec<(VariableId, usize)> = made
                .iter()
                .zip(&parents)
                .filter(|(_, takes)| **takes)
                .map(|(parent, _)| *parent)
                .take(3)
                .collect();
            let rows: usize = parents.iter().map(|(_, count)| count).product();
            let mut state = seed;
            let mut weight = || {
                // Knuth's linear congruential generator, and a zero now and then.
                state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
                if state >> 62 == 0 { 0.0 } else { (state >> 11) as f64 }
            };
            let mut numbers = Vec::new();
            for _ in 0..rows {
                let row: Vec<f64> = STATES[states].iter().map(|_| weight() + 1e-3).collect();
                let sum: f64 = row.iter().sum();
                numbers.extend(row.iter().map(|weight| weight / sum));
            }
            model.push_factor(Factor {
                left: vec![id.into()],
                right: parents.iter().map(|(parent, _)| (*parent).into()).collect(),
                form: Form::Constants(numbers),
                products: Vec::new(),
            });
            made.push((id, STATES[states].len()));
        }
        model.build().unwrap()
    })
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(64) })]

    #[test]
    fn what_is_written_reads_back(model in networks()) {
        let network = Network { model, known: Vec::new(), warnings: Vec::new() };
        for format in Format::ALL {
            let text = io::write(&network, format).unwrap();
            let back = read(format, &text);
            prop_assert_eq!(&back.warnings, &[]);
            let mut expected = said(&network.model);
            if format == Format::Uai {
                // UAI has indices for names.
                for (position, (name, states, ..)) in expected.iter_mut().enumerate() {
                    *name = position.to_string();
                    *states = (0..states.len()).map(|state| state.to_string()).collect();
                }
            } else {
                prop_assert_eq!(&back.model.name, &network.model.name, "{:?}", format);
            }
            prop_assert_eq!(said(&back.model), expected, "{:?}\n{}", format, text);
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(4000) })]

    #[test]
    fn any_text_gets_an_answer(text in "\\PC{0,120}") {
        answered(&text);
    }

    #[test]
    fn words_of_the_formats_get_an_answer(words in prop::collection::vec(prop::sample::select(WORDS.to_vec()), 0..60)) {
        answered(&words.join(" "));
    }

    #[test]
    fn a_mutated_file_gets_an_answer(
        which in 0..5usize, at in any::<prop::sample::Index>(), length in 0..9usize, with in "[\\PC\n]{0,4}",
    ) {
        let texts = [ASIA_LIKE, XML, NET, UAI, MARKOV];
        let mut letters: Vec<char> = texts[which].chars().collect();
        let start = at.index(letters.len());
        let end = (start + length).min(letters.len());
        letters.splice(start..end, with.chars());
        answered(&letters.into_iter().collect::<String>());
    }
}

const WORDS: [&str; 40] = [
    "network",
    "variable",
    "probability",
    "type",
    "discrete",
    "table",
    "default",
    "property",
    "net",
    "node",
    "potential",
    "states",
    "data",
    "=",
    "{",
    "}",
    "(",
    ")",
    "[",
    "]",
    ";",
    ",",
    "|",
    "\"",
    "a",
    "b",
    "0.5",
    "1",
    "2",
    "-1",
    "1e999",
    "BAYES",
    "MARKOV",
    "4294967296",
    "<BIF>",
    "<NETWORK>",
    "</NETWORK>",
    "//",
    "/*",
    "%",
];

/// Reads a text as every format, and shows what is wrong with it.
fn answered(text: &str) {
    let source = Source::new("any", text);
    for format in Format::ALL {
        match io::read(&source, format) {
            Ok(network) => {
                network.warnings.iter().for_each(|warning| assert!(!warning.line(&source).is_empty()))
            }
            Err(wrong) => assert!(!wrong.render(&source, false).is_empty()),
        }
    }
    if let Err(wrong) = uai::evidence(&source, &read(Format::Uai, UAI).model) {
        wrong.render(&source, false);
    }
}

const ASIA_LIKE: &str = "\u{feff}// made by hand\r
network \"Chest clinic\" { property author \"J. Doe; others\"; }\r
# a comment\r
variable smoke { //2 values\r
\ttype discrete[2] { yes, no };\r
\tproperty position = (10, 20)\r
}\r
variable \"x ray\" { type discrete [ 3 ] { \"<5\" \"Asy/Patch\" >=7.5 }; }\r
probability ( \"x ray\" | smoke ) { /* rows\r
in any order */\r
  (no) .2 .3 .5;\r
  (yes) 1e-1, 2.e-1, 0.7\r
}\r
probability ( smoke ) { table 0.6, 0.3999; }\r
";

const XML: &str = r#"<?xml version="1.0"?>
<!DOCTYPE BIF [ <!ELEMENT BIF (NETWORK)*> ]>
<BIF VERSION="0.3"><NETWORK><NAME>n</NAME>
<VARIABLE TYPE="nature"><NAME>a</NAME><OUTCOME>&lt;5</OUTCOME><OUTCOME> x </OUTCOME><PROPERTY>p = (1,2)</PROPERTY></VARIABLE>
<VARIABLE TYPE="nature"><NAME>b</NAME><OUTCOME>0</OUTCOME><OUTCOME>1</OUTCOME></VARIABLE>
<DEFINITION><FOR>b</FOR><GIVEN>a</GIVEN><TABLE>0.1 0.9 <!-- second row --> .25 .75</TABLE></DEFINITION>
<DEFINITION><FOR>a</FOR><TABLE>0.5 0.5</TABLE></DEFINITION>
</NETWORK></BIF>"#;

const NET: &str = r#"net { node_size = (80 40); name = "n"; }
% a comment
node a { label = "say \"a\""; states = ("<5" "x"); position = (1 2); }
discrete node b { states = ("0" "1") }
potential (b | a) { data = ((0.1 0.9) %row
 (.25 .75)); }
potential (a) { data = (0.5 0.5); }
"#;

const UAI: &str = "BAYES\n2\n2 2\n2\n1 0\n2 0 1\n\n2\n 0.5 0.5\n\n4\n 0.1 0.9\n .25 .75\n";

const MARKOV: &str = "MARKOV\n2\n2 3\n2\n1 0\n2 0 1\n2 1 3\n6 1 2 0 4 5 10\n";

#[test]
fn bif_as_it_circulates_is_read() {
    let source = Source::new("clinic.bif", ASIA_LIKE);
    let network =
        io::read(&source, Format::Bif).unwrap_or_else(|wrong| panic!("{}", wrong.render(&source, false)));
    assert_eq!(network.model.name, "Chest clinic");
    let sum = 0.6 + 0.3999;
    let expected: Said = vec![
        ("smoke".into(), vec!["yes".into(), "no".into()], vec![], vec![0.6 / sum, 0.3999 / sum]),
        (
            "x ray".into(),
            vec!["<5".into(), "Asy/Patch".into(), ">=7.5".into()],
            vec![0],
            vec![0.1, 0.2, 0.7, 0.2, 0.3, 0.5],
        ),
    ];
    for (found, expected) in said(&network.model).iter().zip(&expected) {
        assert_eq!((&found.0, &found.1, &found.2), (&expected.0, &expected.1, &expected.2));
        for (found, expected) in found.3.iter().zip(&expected.3) {
            assert!((found - expected).abs() < 1e-15, "{found} {expected}");
        }
    }
    let told: Vec<String> = network.warnings.iter().map(|warning| warning.line(&source)).collect();
    assert_eq!(
        told,
        [
            "clinic.bif:14:25: warning: 1 row was divided by their sums; the farthest from 1 is 0.9999, of `smoke`"
        ]
    );
}

#[test]
fn a_conditional_table_of_bif_lists_the_child_slowest_unless_only_the_other_way_sums_to_one() {
    let text = |table: &str| {
        format!(
            "variable a {{ type discrete [2] {{ t, f }}; }} variable b {{ type discrete [2] {{ t, f }}; }}
            probability (a) {{ table 0.5, 0.5; }} probability (b | a) {{ table {table}; }}"
        )
    };
    // Cozman's dog problem: P(light-on | family-out) = 0.6, P(light-on | not family-out) = 0.05.
    let slowest = read(Format::Bif, &text("0.6 0.05 0.4 0.95"));
    assert_eq!(
        (said(&slowest.model)[1].3.as_slice(), slowest.warnings.len()),
        (&[0.6, 0.4, 0.05, 0.95][..], 0)
    );
    let fastest = read(Format::Bif, &text("0.6 0.4 0.05 0.95"));
    assert_eq!(
        (said(&fastest.model)[1].3.as_slice(), fastest.warnings.len()),
        (&[0.6, 0.4, 0.05, 0.95][..], 1)
    );
}

#[test]
fn defaults_and_late_variables_of_bif_are_read() {
    let text = "probability (b | a) { (x) 0.1, 0.9; default 0.5, 0.5; }
        variable a { type discrete { x, y, z } } variable b { type discrete [2] { 1, 2 } }
        probability (a) { default 0.2, 0.3, 0.5; }";
    assert_eq!(said(&read(Format::Bif, text).model)[1].3, [0.1, 0.9, 0.5, 0.5, 0.5, 0.5]);
}

#[test]
fn xmlbif_hugin_and_uai_say_the_same() {
    let [xml, net, uai] = [(Format::Xmlbif, XML), (Format::Hugin, NET), (Format::Uai, UAI)]
        .map(|(format, text)| read(format, text));
    let named: Said = vec![
        ("a".into(), vec!["<5".into(), "x".into()], vec![], vec![0.5, 0.5]),
        ("b".into(), vec!["0".into(), "1".into()], vec![0], vec![0.1, 0.9, 0.25, 0.75]),
    ];
    assert_eq!(said(&xml.model), named);
    assert_eq!(said(&net.model), named);
    let numbers = |said: Said| said.into_iter().map(|node| (node.2, node.3)).collect::<Vec<_>>();
    assert_eq!(numbers(said(&uai.model)), numbers(named));
    assert_eq!(uai.model.variables[VariableId::new(1)].name, "1");
}

#[test]
fn a_markov_network_answers_with_its_potentials_known() {
    let network = read(Format::Uai, MARKOV);
    let ask = Ask {
        reduction: Reduction::Probability,
        searched: vec![Searched { variable: VariableId::new(0), at: None }],
        known: network.known.clone(),
    };
    let question = Question { name: String::new(), asks: vec![ask] };
    let answers = answer::ask(&network.model, &question, &Inputs::new()).unwrap();
    // P(0) ∝ 1 · (1 + 2 + 0) and 3 · (4 + 5 + 10): 3 / 60 and 57 / 60. Z = 60.
    let p: Vec<f64> = answers[0].answer.iter().filter_map(|row| row.p()).collect();
    assert!((p[0] - 0.05).abs() < 1e-15 && (p[1] - 0.95).abs() < 1e-15, "{p:?}");
    let ln_z = answers[0].ln_evidence.unwrap() + (3.0f64 * 10.0 * 2.0 * 3.0).ln();
    assert!((ln_z - 60f64.ln()).abs() < 1e-12, "{ln_z}");
    let again = read(Format::Uai, &io::write(&network, Format::Uai).unwrap());
    assert_eq!((said(&again.model), again.known), (said(&network.model), network.known));
}

#[test]
fn evidence_files_of_both_ages_are_read() {
    let model = read(Format::Uai, UAI).model;
    let cases =
        |text: &str| uai::evidence(&Source::new("e", text), &model).map_err(|wrong| wrong.to_string());
    let known = |variable, value| Known {
        variable: VariableId::new(variable),
        evidence: Evidence::Hard(Value::Ordinal(value)),
    };
    assert_eq!(cases(""), Ok(vec![]));
    assert_eq!(cases("0"), Ok(vec![vec![]]));
    assert_eq!(cases("1 0 1"), Ok(vec![vec![known(0, 1)]]));
    let two = vec![vec![known(0, 1), known(1, 0)], vec![known(1, 1)]];
    assert_eq!(cases("2\n2 0 1 1 0\n1 1 1\n"), Ok(two.clone()));
    assert_eq!(cases(&uai::evidence_text(&two)), Ok(two));
    for (text, message) in [
        ("1 2 0", "unknown variable 2: there are 2"),
        ("1 0 2", "variable 0 has 2 values, and 2 is none of them"),
        ("1 5 0 0", "5 variables are announced, but the file holds fewer"),
        ("3 0", "3 cases are announced, but 1 are there"),
        ("1 x", "expected a whole number, found `x`"),
    ] {
        assert_eq!(cases(text), Err(message.to_owned()), "{text}");
    }
}

#[test]
fn a_program_of_any_finite_form_becomes_a_network() {
    let text = "program Forms {
        variables { Rain, Wet : bool; Dice : 1..=3; Near : 1..=3; }
        decomposition { P(Rain) P(Wet | Rain Dice) P(Dice) P(Near | Dice Rain) }
        forms {
            P(Rain) = bernoulli(0.2);
            P(Dice) = uniform;
            P(Wet | Rain Dice) = if Rain { bernoulli(0.9) } else { bernoulli(Dice / 10) };
            P(Near | Dice Rain) = dirac(4 - Dice);
        }
    }";
    let network = read(Format::Program, text);
    let back = read(Format::Bif, &io::write(&network, Format::Bif).unwrap());
    let third = 1.0 / 3.0;
    let expected = [
        vec![0.8, 0.2],
        vec![0.9, 0.1, 0.8, 0.2, 0.7, 0.3, 0.1, 0.9, 0.1, 0.9, 0.1, 0.9],
        vec![third; 3],
        [[0., 0., 1.], [0., 0., 1.], [0., 1., 0.], [0., 1., 0.], [1., 0., 0.], [1., 0., 0.]].concat(),
    ];
    for (found, expected) in said(&back.model).iter().zip(&expected) {
        assert_eq!(found.3.len(), expected.len());
        let far = found.3.iter().zip(expected).any(|(found, expected)| (found - expected).abs() > 1e-15);
        assert!(!far, "{}: {:?}", found.0, found.3);
    }
}

#[test]
fn what_a_format_cannot_hold_is_refused() {
    let mut model = ModelBuilder::new("a");
    let odd = model.variable("say \"a\"", Domain::labels(["x", " y"]));
    model.factor([odd], [], Form::Uniform);
    let network = Network { model: model.build().unwrap(), known: Vec::new(), warnings: Vec::new() };
    for (format, holds) in Format::ALL.into_iter().zip([true, false, false, true, true]) {
        assert_eq!(io::write(&network, format).is_ok(), holds, "{format:?}");
    }
    let real = "program R { variables { X : real; } decomposition { P(X) } forms { P(X) = normal(0, 1); } }";
    let refused = io::write(&read(Format::Program, real), Format::Bif).unwrap_err().to_string();
    assert!(refused.contains("`X` is `real`"), "{refused}");
}

/// A variable with two values and one with three, and what follows.
fn bif(rest: &str) -> String {
    format!(
        "variable a {{ type discrete [2] {{ x, y }}; }}\nvariable b {{ type discrete [3] {{ x, y, z }}; }}\n{rest}"
    )
}

#[test]
fn broken_files_get_a_line_a_column_and_a_reason() {
    let whole = "probability (a) { table 0.5, 0.5; }\n";
    let cases: [(Format, String, (usize, usize), &str); 30] = [
        (Format::Bif, String::new(), (1, 1), "this file declares no variable"),
        (
            Format::Bif,
            "graph {".into(),
            (1, 1),
            "expected `network`, `variable` or `probability`, found `graph`",
        ),
        (
            Format::Bif,
            "variable a {\n type discrete [3] { x, y };\n}".into(),
            (2, 2),
            "variable `a` is said to have 3 values, but 2 are named",
        ),
        (
            Format::Bif,
            "variable a { type discrete [2] { x, x }; }".into(),
            (1, 10),
            "two values of `a` are called `x`",
        ),
        (
            Format::Bif,
            "variable a { type real; }".into(),
            (1, 19),
            "expected `discrete`: a network has finite variables, found `real`",
        ),
        (
            Format::Bif,
            "variable a {\n type discrete [2] { x, ".into(),
            (2, 25),
            "expected the name of a value, `,` or `}`, found the end of the file",
        ),
        (
            Format::Bif,
            bif("variable a { type discrete [1] { x }; }"),
            (3, 10),
            "variable `a` is declared twice",
        ),
        (Format::Bif, bif(whole), (2, 10), "variable `b` has no distribution"),
        (Format::Bif, bif("probability (c | a) { }"), (3, 14), "unknown variable `c`"),
        (Format::Bif, bif("probability (a | a) { }"), (3, 13), "`a` stands twice here"),
        (
            Format::Bif,
            bif("probability (a) { table 0.5; }"),
            (3, 19),
            "expected 2 probabilities here, found 1",
        ),
        (
            Format::Bif,
            bif("probability (a) { table 0.5, -0.5; }"),
            (3, 30),
            "a probability lies between 0 and 1, but this is -0.5",
        ),
        (
            Format::Bif,
            bif("probability (a) { table 0.5, nan; }"),
            (3, 30),
            "expected a probability, found `nan`",
        ),
        (
            Format::Bif,
            bif("probability (a) { table 0.5, 0.6; }"),
            (3, 19),
            "the probabilities of `a` sum to 1.1, more than 1 % away from 1",
        ),
        (Format::Bif, bif("probability (b | a) { (x) 0.1, 0.2, 0.7; }"), (3, 13), "`b` has no row for a = y"),
        (
            Format::Bif,
            bif("probability (b | a) { (w) 0.1, 0.2, 0.7; }"),
            (3, 24),
            "`w` is not a value of `a`",
        ),
        (
            Format::Bif,
            bif("probability (b | a) { (x, y) 0.1, 0.2, 0.7; }"),
            (3, 23),
            "this row names 2 values, but there are 1 parents",
        ),
        (
            Format::Bif,
            bif("probability (b | a) { (x) 0.1, 0.2, 0.7;\n(x) 1, 0, 0; }"),
            (4, 1),
            "the row of a = x is written twice",
        ),
        (
            Format::Bif,
            bif("probability (a) { table 0.5, 0.5; }\nprobability (a) { table 0.5, 0.5; }"),
            (4, 13),
            "variable `a` has two distributions",
        ),
        (
            Format::Bif,
            bif("probability (a | b) { default 0.5, 0.5; }\nprobability (b | a) { default 0, 0, 1; }"),
            (3, 13),
            "the decomposition has a cycle: a ← b ← a",
        ),
        (Format::Bif, bif("/* open"), (3, 1), "this `/*` is never closed"),
        (
            Format::Xmlbif,
            "<BIF><NETWORK></BIF>".into(),
            (1, 15),
            "this is not XML: expected 'NETWORK' tag, not 'BIF'",
        ),
        (Format::Xmlbif, "<html></html>".into(), (1, 1), "expected `<BIF>` with a `<NETWORK>` in it"),
        (Format::Xmlbif, XML.replace("0.1 0.9", "0.1 x"), (6, 52), "expected a probability, found `x`"),
        (
            Format::Xmlbif,
            XML.replace("<GIVEN>a</GIVEN>", ""),
            (6, 25),
            "expected 2 probabilities (1 rows of 2), found 4",
        ),
        (
            Format::Hugin,
            NET.replace("(b | a)", "(b a)"),
            (5, 11),
            "expected one node before the `|`: a potential of several is no conditional distribution",
        ),
        (Format::Hugin, NET.replace("potential (a)", "potential (c)"), (7, 12), "unknown node `c`"),
        (Format::Uai, "GRAPH".into(), (1, 1), "expected `BAYES` or `MARKOV`, found `GRAPH`"),
        (Format::Uai, UAI.replace("2 0 1", "2 0 7"), (6, 5), "unknown variable 7: they are 0 to 1"),
        (
            Format::Uai,
            UAI[..UAI.len() - 5].into(),
            (13, 5),
            "expected a probability, found the end of the file",
        ),
    ];
    let mut different = Vec::new();
    for (format, text, place, message) in &cases {
        let source = Source::new("broken", text);
        let wrong = io::read(&source, *format).expect_err(text);
        let first = wrong.iter().next().unwrap();
        let found = source.line_and_column(first.span.start);
        if (&found, first.message.as_str()) != (place, *message) {
            different.push(format!("{found:?} {}\n   expected {place:?} {message}", first.message));
        }
        assert!(wrong.render(&source, false).contains("broken:"), "{}", wrong.render(&source, false));
    }
    assert!(different.is_empty(), "{}", different.join("\n"));
}

#[test]
fn a_mistake_on_an_endless_line_is_shown_with_what_is_around_it() {
    let text = format!("{}0.5 -3 {}", bif("probability (a) { table "), "0.1 ".repeat(1000));
    let source = Source::new("long.bif", text);
    let page = io::read(&source, Format::Bif).unwrap_err().render(&source, false);
    assert!(page.contains("long.bif:3:29") && page.contains("-3 0.1 0.1"), "{page}");
    assert!(page.lines().all(|line| line.chars().count() < 120), "{page}");
}

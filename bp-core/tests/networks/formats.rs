//! Network formats: round trips, and dialects.
//!
//! In: networks made at random, and small files of every dialect. Out: equal networks. Invariant: numbers are read back
//! exactly.

use crate::dialects::{ASIA_LIKE, MARKOV, NET, UAI, XML, read};
use bp_core::compiler::answer;
use bp_core::compiler::exec::Inputs;
use bp_core::compiler::ids::{Id, VariableId};
use bp_core::compiler::io::{self, Format, Network, uai};
use bp_core::compiler::model::{
    Ask, Domain, Factor, Finding, Form, Known, Model, ModelBuilder, Question, Searched, Statistic, Value,
    When,
};
use bp_core::compiler::source::Source;
use proptest::prelude::*;

/// The content of a network: names, values, and for each variable its parents and numbers.
type Contents = Vec<(String, Vec<String>, Vec<usize>, Vec<f64>)>;

fn contents(model: &Model) -> Contents {
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

/// A random network: names and values, the earlier variables on which each depends, and weights.
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
    fn written_networks_read_back(model in networks()) {
        let network = Network { model, known: Vec::new(), ln_scale: 0.0, warnings: Vec::new() };
        for format in Format::ALL {
            let text = io::write(&network, format).unwrap();
            let back = read(format, &text);
            prop_assert_eq!(&back.warnings, &[]);
            let mut expected = contents(&network.model);
            if format == Format::Uai {
                // UAI has indices for names.
                for (position, (name, states, ..)) in expected.iter_mut().enumerate() {
                    *name = position.to_string();
                    *states = (0..states.len()).map(|state| state.to_string()).collect();
                }
            } else {
                prop_assert_eq!(&back.model.name, &network.model.name, "{:?}", format);
            }
            prop_assert_eq!(contents(&back.model), expected, "{:?}\n{}", format, text);
        }
    }

    #[test]
    fn known_tables_answer_as_written_ones(model in networks()) {
        let network = Network { model, known: Vec::new(), ln_scale: 0.0, warnings: Vec::new() };
        let written = read(Format::Program, &io::write(&network, Format::Program).unwrap()).model;
        let ids: Vec<VariableId> = network.model.variables.ids().collect();
        let (first, last) = (ids[0], ids[ids.len() - 1]);
        let known = |evidence| if first == last { vec![] } else { vec![Known { variable: last, evidence }] };
        for known in [known(Finding::Each), known(Finding::Hard(Value::Ordinal(0)))] {
            let searched = vec![Searched { variable: first, at: None }];
            let ask = Ask { statistic: Statistic::Distribution, when: When::Now, searched, known };
            let question = Question { name: String::new(), asks: vec![ask], derived: Vec::new() };
            let [one, other] = [&network.model, &written]
                .map(|model| answer::ask(model, &question, &Inputs::new()).unwrap().remove(0).answer);
            let numbers = |rows: &[answer::Row]| rows.iter().filter_map(answer::Row::p).collect::<Vec<_>>();
            prop_assert_eq!(one.len(), other.len());
            for (one, other) in numbers(&one).iter().zip(numbers(&other)) {
                prop_assert!((one - other).abs() < 1e-12, "{} {}", one, other);
            }
        }
    }
}

#[test]
fn bif_as_it_circulates_is_read() {
    let source = Source::new("clinic.bif", ASIA_LIKE);
    let network =
        io::read(&source, Format::Bif).unwrap_or_else(|wrong| panic!("{}", wrong.render(&source, false)));
    assert_eq!(network.model.name, "Chest clinic");
    let sum = 0.6 + 0.3999;
    let expected: Contents = vec![
        ("smoke".into(), vec!["yes".into(), "no".into()], vec![], vec![0.6 / sum, 0.3999 / sum]),
        (
            "x ray".into(),
            vec!["<5".into(), "Asy/Patch".into(), ">=7.5".into()],
            vec![0],
            vec![0.1, 0.2, 0.7, 0.2, 0.3, 0.5],
        ),
    ];
    for (found, expected) in contents(&network.model).iter().zip(&expected) {
        assert_eq!((&found.0, &found.1, &found.2), (&expected.0, &expected.1, &expected.2));
        for (found, expected) in found.3.iter().zip(&expected.3) {
            assert!((found - expected).abs() < 1e-15, "{found} {expected}");
        }
    }
    let warnings: Vec<String> = network.warnings.iter().map(|warning| warning.line(&source)).collect();
    assert_eq!(
        warnings,
        [
            "clinic.bif:14:25: warning: 1 row was divided by its sum; the farthest from 1 is 0.9999, of `smoke`"
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
        (contents(&slowest.model)[1].3.as_slice(), slowest.warnings.len()),
        (&[0.6, 0.4, 0.05, 0.95][..], 0)
    );
    let fastest = read(Format::Bif, &text("0.6 0.4 0.05 0.95"));
    assert_eq!(
        (contents(&fastest.model)[1].3.as_slice(), fastest.warnings.len()),
        (&[0.6, 0.4, 0.05, 0.95][..], 1)
    );
}

#[test]
fn defaults_and_late_variables_of_bif_are_read() {
    let text = "probability (b | a) { (x) 0.1, 0.9; default 0.5, 0.5; }
        variable a { type discrete { x, y, z } } variable b { type discrete [2] { 1, 2 } }
        probability (a) { default 0.2, 0.3, 0.5; }";
    assert_eq!(contents(&read(Format::Bif, text).model)[1].3, [0.1, 0.9, 0.5, 0.5, 0.5, 0.5]);
}

#[test]
fn xmlbif_hugin_and_uai_contain_the_same() {
    let [xml, net, uai] = [(Format::Xmlbif, XML), (Format::Hugin, NET), (Format::Uai, UAI)]
        .map(|(format, text)| read(format, text));
    let named: Contents = vec![
        ("a".into(), vec!["<5".into(), "x".into()], vec![], vec![0.5, 0.5]),
        ("b".into(), vec!["0".into(), "1".into()], vec![0], vec![0.1, 0.9, 0.25, 0.75]),
    ];
    assert_eq!(contents(&xml.model), named);
    assert_eq!(contents(&net.model), named);
    let numbers = |contents: Contents| contents.into_iter().map(|node| (node.2, node.3)).collect::<Vec<_>>();
    assert_eq!(numbers(contents(&uai.model)), numbers(named));
    assert_eq!(uai.model.variables[VariableId::new(1)].name, "1");
}

#[test]
fn a_markov_network_answers_with_its_potentials_known() {
    let network = read(Format::Uai, MARKOV);
    let ask = Ask {
        statistic: Statistic::Distribution,
        when: When::Now,
        searched: vec![Searched { variable: VariableId::new(0), at: None }],
        known: network.known.clone(),
    };
    let question = Question { name: String::new(), asks: vec![ask], derived: Vec::new() };
    let answers = answer::ask(&network.model, &question, &Inputs::new()).unwrap();
    // P(0) ∝ 1 · (1 + 2 + 0) and 3 · (4 + 5 + 10): 3 / 60 and 57 / 60. Z = 60.
    let p: Vec<f64> = answers[0].answer.iter().filter_map(|row| row.p()).collect();
    assert!((p[0] - 0.05).abs() < 1e-15 && (p[1] - 0.95).abs() < 1e-15, "{p:?}");
    let ln_z = answers[0].ln_evidence.unwrap() + (3.0f64 * 10.0 * 2.0 * 3.0).ln();
    assert!((ln_z - 60f64.ln()).abs() < 1e-12, "{ln_z}");
    let again = read(Format::Uai, &io::write(&network, Format::Uai).unwrap());
    assert_eq!((contents(&again.model), again.known), (contents(&network.model), network.known));
}

#[test]
fn evidence_files_of_both_ages_are_read() {
    let model = read(Format::Uai, UAI).model;
    let cases =
        |text: &str| uai::evidence(&Source::new("e", text), &model).map_err(|wrong| wrong.to_string());
    let known = |variable, value| Known {
        variable: VariableId::new(variable),
        evidence: Finding::Hard(Value::Ordinal(value)),
    };
    assert_eq!(cases(""), Ok(vec![]));
    assert_eq!(cases("0"), Ok(vec![vec![]]));
    assert_eq!(cases("1 0 1"), Ok(vec![vec![known(0, 1)]]));
    let two = vec![vec![known(0, 1), known(1, 0)], vec![known(1, 1)]];
    assert_eq!(cases("2\n2 0 1 1 0\n1 1 1\n"), Ok(two.clone()));
    assert_eq!(cases(&uai::evidence_text(&two)), Ok(two));
    for (text, message) in [
        ("1 2 0", "unknown variable 2: there are 2"),
        ("1 0 2", "variable 0 has 2 values, and 2 is not one of them"),
        ("1 5 0 0", "5 variables are declared, but there are fewer"),
        ("3 0", "3 cases are declared, but there are 1"),
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
    for (found, expected) in contents(&back.model).iter().zip(&expected) {
        assert_eq!(found.3.len(), expected.len());
        let far = found.3.iter().zip(expected).any(|(found, expected)| (found - expected).abs() > 1e-15);
        assert!(!far, "{}: {:?}", found.0, found.3);
    }
}

#[test]
fn models_that_a_format_cannot_hold_are_refused() {
    let mut model = ModelBuilder::new("a");
    let odd = model.variable("say \"a\"", Domain::labels(["x", " y"]));
    model.factor([odd], [], Form::Uniform);
    let network =
        Network { model: model.build().unwrap(), known: Vec::new(), ln_scale: 0.0, warnings: Vec::new() };
    for (format, holds) in Format::ALL.into_iter().zip([true, false, false, true, true]) {
        assert_eq!(io::write(&network, format).is_ok(), holds, "{format:?}");
    }
    let real = "program R { variables { X : real; } decomposition { P(X) } forms { P(X) = normal(0, 1); } }";
    let refused = io::write(&read(Format::Program, real), Format::Bif).unwrap_err().to_string();
    assert!(refused.contains("`X` is `real`"), "{refused}");
}

#[test]
fn a_property_without_its_semicolon_ends_with_its_block() {
    let text = "network n { property author = me }
variable a { property position = (1, 2) type discrete [2] { x, y }; property shape {round} }
variable b { type discrete [2] { x, y }; property label = \"a } b\" } probability (a) { table 0.25, 0.75; }
probability (b) { property how = guessed } probability (c) { table 1.0; }";
    let with = |end: &str| {
        text.replace("(1, 2) type", "(1, 2);\n type")
            .replace("probability (b) { property how = guessed } ", end)
    };
    let whole = with("probability (b) { table 0.5, 0.5; property how = guessed } ");
    let model = read(Format::Bif, &whole.replace(" probability (c) { table 1.0; }", "")).model;
    assert_eq!(contents(&model)[1].3, [0.5, 0.5]);
    // A missing part is reported at its position.
    let source = Source::new("n.bif", with("probability (b) { property how = guessed } "));
    let wrong = io::read(&source, Format::Bif).unwrap_err();
    assert!(wrong.to_string().contains("`b` has no `table`"), "{wrong}");
}

#[test]
fn values_without_names_are_refused_at_their_place() {
    let text = XML.replacen("</OUTCOME>", "</OUTCOME><OUTCOME></OUTCOME>", 1);
    let source = Source::new("a.xmlbif", text.as_str());
    let wrong = io::read(&source, Format::Xmlbif).unwrap_err();
    assert_eq!(wrong.0[0].message, "this value has no name");
    let place = text.find("<OUTCOME></OUTCOME>").unwrap();
    assert!((place..place + 19).contains(&wrong.0[0].span.start), "{wrong}");
    let source = Source::new(
        "a.bif",
        "variable a { type discrete [2] { x, \"\" }; } probability (a) { table 0.5, 0.5; }",
    );
    let wrong = io::read(&source, Format::Bif).unwrap_err();
    assert_eq!(wrong.0[0].message, "value 2 of variable `a` has no name");
}

#[test]
fn hugin_tables_beside_models_and_intervals() {
    let noisy = r#"net { }
node A { subtype = boolean; states = ("false" "true"); }
node C { subtype = boolean; states = ("false" "true"); }
potential (A) { model_nodes = (); model_data = ( Distribution (0.7, 0.3) ); }
potential (C | A) { model_nodes = (); model_data = ( NoisyOR (A, 0.2) ); data = (( 1 0 ) ( 0.4 0.6 )); }"#;
    let model = read(Format::Hugin, noisy).model;
    assert_eq!(
        (contents(&model)[0].3.as_slice(), contents(&model)[1].3.as_slice()),
        (&[0.7, 0.3][..], &[1.0, 0.0, 0.4, 0.6][..])
    );
    let intervals = r#"net { }
node Size { subtype = interval; states = ("" "" ""); state_values = (-infinity 0 10 infinity); }
node Count { subtype = number; states = ("" ""); state_values = (2 5); }
node Fail { states = ("no" "yes"); }
potential (Size) { data = (0.25 0.5 0.25); }
potential (Count | Fail) { model_nodes = (); model_data = ( Distribution (0.5, 0.5) ); }
potential (Fail | Size) {
    model_nodes = (Size);
    model_data = ( Distribution (0.9, 0.1), Distribution (0.5, 0.5), Distribution(0.2, 0.8) );
}"#;
    let all = contents(&read(Format::Hugin, intervals).model);
    assert_eq!(all[0].1, ["-inf..0", "0..10", "10..inf"]);
    assert_eq!(all[1].1, ["2", "5"]);
    assert_eq!(all[1].3, [0.5, 0.5, 0.5, 0.5]);
    assert_eq!(all[2].3, [0.9, 0.1, 0.5, 0.5, 0.2, 0.8]);
    let source = Source::new("a.net", noisy.replace("data = (( 1 0 ) ( 0.4 0.6 ));", ""));
    let wrong = io::read(&source, Format::Hugin).unwrap_err();
    let expected = "the potential of `C` has no table, only expressions: `NoisyOR (A, 0.2)` is not read";
    assert_eq!(wrong.0[0].message, expected);
}

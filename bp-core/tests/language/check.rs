//! The checker: models of programs.
//!
//! In: the programs of `tests/programs`, and questions as users type them. Out: facts about their models. Invariant:
//! every program there checks, except one with a missing parameter, which is an error.

use bp_core::compiler::model::{Expression, Finding, Form, IndexSpace, Model, SetKind, Value};
use bp_core::compiler::source::Source;
use bp_core::compiler::syntax::{compile, parse_question};

fn source(name: &str) -> Source {
    let path = format!("{}/../tests/programs/{name}.bp", env!("CARGO_MANIFEST_DIR"));
    Source::new(name, std::fs::read_to_string(path).unwrap())
}

fn model_of(source: &Source) -> Model {
    compile(source).unwrap_or_else(|wrong| panic!("{}", wrong.render(source, false)))
}

#[test]
fn the_sprinkler_is_three_variables_three_factors_and_a_question() {
    let model = model_of(&source("wet_grass"));
    assert_eq!(model.documentation, "Is it the rain or the sprinkler?");
    assert_eq!((model.variables.len(), model.factors.len(), model.questions.len()), (3, 3, 1));
    assert!(model.parameters.is_empty());
}

#[test]
fn a_cell_learns_that_its_sets_are_a_grid_and_its_displacements() {
    let model = model_of(&source("cell"));
    let kind = |name: &str| model.sets.values().find(|set| set.name == name).unwrap().kind;
    let grid = model.sets.find(|set| set.name == "Grid").unwrap();
    assert_eq!((kind("Grid"), kind("Velocity")), (SetKind::Grid, SetKind::Displacements(grid)));
    assert_eq!((kind("Sensors"), kind("Reading")), (SetKind::Plain, SetKind::Plain));
    let reading = model.factors.values().last().unwrap();
    assert_eq!(reading.products.len(), 1);
    let names: Vec<_> = reading.right.iter().map(|use_| model.variable_name(use_.variable)).collect();
    assert_eq!(names, ["V", "O", "C"]);
    let Form::Ask { path, given } = &reading.form else { panic!("{:?}", reading.form) };
    assert_eq!((path.as_str(), given.len()), ("Sensors[i].reading", 3));
}

#[test]
fn a_line_of_sight_has_an_implicit_field_over_its_rays() {
    let model = model_of(&source("line_of_sight"));
    let sigma = model.parameters.values().find(|parameter| parameter.name == "sigma").unwrap();
    let rays = model.sets.find(|set| set.name == "Rays").unwrap();
    assert_eq!(sigma.over, [IndexSpace::Set(rays)]);
    assert!(model.expressions.values().any(|node| matches!(node, Expression::First { with: Some(_), .. })));
}

#[test]
fn vestibular_and_gaze_check_as_printed() {
    let vestibular = model_of(&source("vestibular"));
    assert!(vestibular.variable("C^-1").is_some() && vestibular.variable("G^-1").is_some());
    let gaze = model_of(&source("gaze"));
    assert!(gaze.expressions.values().any(|node| matches!(node, Expression::Frontier { .. })));
    assert!(gaze.expressions.values().any(|node| matches!(node, Expression::GradientNorm { .. })));
    // The map's own program has the gap around the head too; printing preserves it.
    let whole = std::fs::read_to_string("../bvm/models/gaze.bp").unwrap();
    let whole = model_of(&Source::new("gaze", whole));
    let has = |of: fn(&Expression) -> bool| whole.expressions.values().any(of);
    assert!(has(|node| matches!(node, Expression::Innermost { .. })));
    assert!(has(|node| matches!(node, Expression::GradientNorm { before: Some(_), .. })));
}

#[test]
fn binaural_lacks_one_parameter_and_nothing_else() {
    let written = source("binaural");
    let wrong = compile(&written).unwrap_err();
    assert!(
        wrong.iter().all(|one| one.message == "unknown name `l_max`"),
        "{}",
        wrong.render(&written, false)
    );
    let mended = Source::new("mended", written.text.replace("tau_max : real", "tau_max, l_max : real"));
    let model = model_of(&mended);
    assert_eq!(model.identifications[0].parameters.len(), 4);
    let grid = model.sets.find(|set| set.name == "Grid").unwrap();
    let channels = model.sets.find(|set| set.name == "Channels").unwrap();
    let mu = model.parameters.values().find(|parameter| parameter.name == "mu_l").unwrap();
    assert_eq!(mu.over, [IndexSpace::Set(grid), IndexSpace::Set(channels)]);
}

#[test]
fn rows_with_keys_may_come_in_any_order() {
    let program = |rows: &str| {
        let text = format!(
            "program A {{ variables {{ X : {{ low, high }}; Y : 1..=2; Z : bool; }} decomposition {{ P(X) P(Y) P(Z | X Y) }}
             forms {{ P(X) = uniform; P(Y) = uniform; P(Z | Y X) = table {{ {rows} }}; }} }}"
        );
        let text = text.replace("P(Z | Y X)", "P(Z | X Y)");
        let model = model_of(&Source::new("rows", text));
        let Form::Table(rows) = &model.factors.values().last().unwrap().form else { panic!() };
        let row = |row: &Vec<_>| row.iter().map(|id| model.constant(*id).unwrap()).collect::<Vec<_>>();
        rows.iter().map(row).collect::<Vec<_>>()
    };
    assert_eq!(
        program("high, 2: 0, 1; low, 1: 0.1, 0.9; high, 1: 0.3, 0.7; low, 2: 0.2, 0.8;"),
        program("0.1, 0.9; 0.2, 0.8; 0.3, 0.7; 0, 1")
    );
}

#[test]
fn a_match_becomes_a_chain_and_needs_no_wildcard_when_it_covers() {
    let text = "program A { variables { X : { low, high }; Y : -2..=2; Z : real; }
        decomposition { P(X) P(Y) P(Z | X Y) }
        forms { P(X) = categorical(0.25, 0.75); P(Y) = uniform;
        P(Z | X Y) = match X { low => normal(Y, 1), high => match Y { -2..=0 => normal(0, 1), _ => uniform(-1, 1) } }; }
        question q { P(X | Z = z, Y = -1); argmax P(Y); entropy P(X Y); P(X = low | Y virtual [1, 1, 2, 0, 0]) } }";
    let model = model_of(&Source::new("match", text));
    assert!(matches!(model.factors.values().last().unwrap().form, Form::If { .. }));
    let asks = &model.questions.values().next().unwrap().asks;
    assert_eq!(asks[0].known[0].evidence, Finding::Hard(Value::Given("z".to_owned())));
    assert_eq!(asks[0].known[1].evidence, Finding::Hard(Value::Ordinal(1)));
    assert_eq!(asks[3].searched[0].at, Some(Value::Ordinal(0)));
}

#[test]
fn questions_are_read_as_users_type_them() {
    let model = model_of(&source("wet_grass"));
    let typed = |text: &str| parse_question(&Source::new("question", text), &model);
    let question = typed("P(Rain | Wet = true)").unwrap();
    assert_eq!(question.asks[0].known[0].evidence, Finding::Hard(Value::Ordinal(1)));
    assert_eq!(typed(" rain ").unwrap().name, "rain");
    let message = |text: &str| typed(text).unwrap_err().0[0].message.clone();
    assert_eq!(message("rian"), "`WetGrass` has no question `rian`");
    assert_eq!(message("P(Rain | Wet = 3)"), "`3` is not a value of `Wet`, which is `bool`");
    assert_eq!(message("P(| Wet)"), "this question searches nothing");
    assert_eq!(message("P(Rain | Rain)"), "this question asks what it knows: `Rain` is on both sides");
    assert_eq!(message("P(Rain"), "expected `,` or `)`, found the end of the text");
}

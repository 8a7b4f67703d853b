//! The Rust interface: programs opened, asked, filtered and learned.
//!
//! In: programs as texts. Out: pass or fail. Invariant: expected numbers are computed by hand in the comments.

use bp_core::prelude::*;

const GRASS: &str = "program Grass {
    parameters { rate : probability = 0.3; }
    variables { Rain, Sprinkler, Wet : bool; }
    decomposition { P(Rain) P(Sprinkler | Rain) P(Wet | Rain Sprinkler) }
    forms {
        P(Rain)             = bernoulli(rate);
        P(Sprinkler | Rain) = bernoulli(if Rain { 0.1 } else { 0.9 });
        P(Wet | Rain Sprinkler) = dirac(Rain or Sprinkler);
    }
    question rain { P(Rain | Wet) }
    question both { P(Rain | Wet = true); P(Sprinkler | Wet = true) }
}";

#[track_caller]
pub(crate) fn near(found: f64, expected: f64) {
    let off = (found - expected).abs() / expected.abs().max(1.0);
    assert!(off < 1e-12, "{found}, expected {expected}");
}

#[track_caller]
pub(crate) fn fails<T: std::fmt::Debug>(result: Result<T, bp_core::Error>, parts: &[&str]) {
    let message = result.expect_err("an error").to_string();
    for part in parts {
        assert!(message.contains(part), "{message}\ndoes not have: {part}");
    }
}

fn grass() -> Program {
    Program::parse(GRASS).unwrap()
}

#[test]
fn a_value_is_looked_up_in_the_answer() {
    let rain = grass().ask("P(Rain | Wet = true)").unwrap();
    // P(Wet) = 0.3 + 0.7 · 0.9 = 0.93.
    near(rain.p(true).unwrap(), 0.3 / 0.93);
    near(rain.p(false).unwrap(), 0.63 / 0.93);
    near(rain.ln_evidence().unwrap(), 0.93f64.ln());
    let (p, q) = (0.3f64 / 0.93, 0.63f64 / 0.93);
    near(rain.entropy().unwrap(), -(p * p.ln() + q * q.ln()));
    assert_eq!(rain.mode().unwrap(), evidence! { Rain: false });
    near(rain.mean().unwrap(), p);
    near(rain.variance().unwrap(), p * q);
    assert!(rain.strategy().is_exact() && rain.warning().is_none() && rain.estimate().is_none());
    assert_eq!(rain.question(), "P(Rain | Wet = true)");
    let all = rain.values().unwrap();
    assert_eq!(all.len(), 2);
    assert_eq!(all[1].0["Rain"], true);
    near(all[1].1, p);
}

#[test]
fn an_answer_prints_as_its_table_and_serialises_as_the_command_writes_it() {
    let rain = grass().ask("P(Rain | Wet = true)").unwrap();
    let expected = "P(Rain | Wet = true)

  Rain   probability
  false  0.677419     ████████████████████████████████████████
  true   0.322581     ███████████████████

  ln P(evidence) = -0.0725707
";
    assert_eq!(rain.to_string(), expected);
    let json = serde_json::to_value(&rain).unwrap();
    assert_eq!(json["question"], "P(Rain | Wet = true)");
    assert_eq!(json["answer"][1]["values"]["Rain"], "true");
    near(json["answer"][1]["p"].as_f64().unwrap(), 0.3 / 0.93);
}

#[test]
fn a_parameter_is_given_by_name() {
    let grass = grass().with("rate", 0.2).unwrap();
    // 0.2 / (0.2 + 0.8 · 0.9)
    near(grass.ask("P(Rain | Wet = true)").unwrap().p(true).unwrap(), 0.2 / 0.92);
    fails(grass.clone().with("raet", 0.5), &["`raet`", "did you mean `rate`?"]);
    fails(grass.clone().with("rate", 1.5), &["`rate`", "1.5", "a probability, between 0 and 1"]);
    fails(grass.with("rate", true), &["`rate`", "`true` is not a finite number"]);
}

#[test]
fn a_question_is_compiled_once_and_given_values() {
    let grass = grass();
    let asked = grass.question("P(Rain | Wet = wet, Sprinkler = sprinkler)").unwrap();
    let dry = asked.given("wet", true).unwrap().given("sprinkler", false).unwrap();
    // Wet without a sprinkler implies rain.
    near(dry.ask().unwrap().p(true).unwrap(), 1.0);
    // With a sprinkler it is wet anyway: 0.3 · 0.1 / (0.3 · 0.1 + 0.7 · 0.9).
    let wet = asked.given("wet", true).unwrap().given("sprinkler", true).unwrap();
    near(wet.ask().unwrap().p(true).unwrap(), 0.03 / 0.66);
    // A parameter, too.
    near(wet.given("rate", 0.5).unwrap().ask().unwrap().p(true).unwrap(), 0.05 / 0.5);
    fails(asked.given("wte", true), &["`wte`", "did you mean `wet`?"]);
    fails(asked.given("wet", 1), &["`wet`", "`1` is not a value of `Wet`", "write `true` or `false`"]);
    fails(asked.given("wet", true).unwrap().ask(), &["sprinkler"]);
    fails(grass.ask("P(Rain | Wet = false, Sprinkler = true)"), &["probability zero"]);
}

#[test]
fn a_known_variable_without_a_value_is_a_context() {
    let table = grass().ask("rain").unwrap();
    near(table.given("Wet", true).unwrap().p(true).unwrap(), 0.3 / 0.93);
    // Dry grass: it does not rain.
    near(table.given("Wet", false).unwrap().p(true).unwrap(), 0.0);
    fails(table.p(true), &["`P(Rain | Wet)`", "a context for each value of `Wet`", "`given`"]);
    fails(table.given("Rain", true), &["`Rain` is not open in it", "`Wet`"]);
    // Given to the question it is evidence, of which the probability is known.
    let asked = grass().question("rain").unwrap().given("Wet", true).unwrap().ask().unwrap();
    near(asked.p(true).unwrap(), 0.3 / 0.93);
    near(asked.ln_evidence().unwrap(), 0.93f64.ln());
}

#[test]
fn several_variables_are_a_tuple_and_one_of_them_is_chosen() {
    let both = grass().ask("P(Rain Sprinkler | Wet = true)").unwrap();
    // 0.3 · 0.1, 0.3 · 0.9 and 0.7 · 0.9, over 0.93.
    near(both.p((true, true)).unwrap(), 0.03 / 0.93);
    near(both.p((true, false)).unwrap(), 0.27 / 0.93);
    near(both.p([false, true]).unwrap(), 0.63 / 0.93);
    near(both.of("Sprinkler").unwrap().p(true).unwrap(), 0.66 / 0.93);
    near(both.of("Rain").unwrap().p(true).unwrap(), 0.3 / 0.93);
    assert_eq!(both.mode().unwrap(), evidence! { Rain: false, Sprinkler: true });
    // E(Rain Sprinkler) − E Rain · E Sprinkler
    let expected = 0.03 / 0.93 - 0.3 / 0.93 * (0.66 / 0.93);
    near(both.covariance("Rain", "Sprinkler").unwrap(), expected);
    near(both.covariance("Sprinkler", "Rain").unwrap(), expected);
    fails(both.p(true), &["found 1 values", "`Rain` and `Sprinkler`: give 2"]);
    fails(both.of("Rian"), &["did you mean `Rain`?"]);
    fails(both.of("Wet"), &["does not contain `Wet`, but `Rain` and `Sprinkler`"]);
    fails(both.mean(), &["choose one with `of`"]);
    fails(grass().ask("both"), &["asks several questions", "`ask_all`"]);
    assert_eq!(grass().ask_all("both").unwrap().len(), 2);
}

#[test]
fn a_number_that_is_made_of_a_distribution_is_read_as_one() {
    let grass = grass();
    let (p, q) = (0.3f64 / 0.93, 0.63f64 / 0.93);
    near(grass.ask("entropy P(Rain | Wet = true)").unwrap().number().unwrap(), -(p * p.ln() + q * q.ln()));
    near(grass.ask("max P(Rain | Wet = true)").unwrap().number().unwrap(), q);
    near(grass.ask("P(Rain = true | Wet = true)").unwrap().number().unwrap(), p);
    assert_eq!(grass.ask("argmax P(Rain | Wet = true)").unwrap().mode().unwrap()["Rain"], false);
    fails(grass.ask("P(Rain)").unwrap().number(), &["not one number", "`p`"]);
    fails(grass.ask("P(Rain)").unwrap().p("wet"), &["`wet` is not a value of `Rain`"]);
}

#[test]
fn labels_integers_bins_and_elements_of_families_are_values() {
    let program = Program::parse(
        "program Values {
             variables {
                 Sky : { clear, cloudy, \"light rain\" };
                 Die : 1..=6;
                 Size : bins(0, 10, 5);
                 Light[1..=3] : bool;
             }
             decomposition { P(Sky) P(Die) P(Size) prod(i in 1..=3) { P(Light[i]) } }
             forms {
                 P(Sky) = categorical(0.5, 0.3, 0.2);
                 P(Die) = uniform;
                 P(Size) = categorical(0.1, 0.2, 0.4, 0.2, 0.1);
                 P(Light[i]) = bernoulli(i / 4);
             }
         }",
    )
    .unwrap();
    let sky = program.ask("P(Sky)").unwrap();
    near(sky.p("light rain").unwrap(), 0.2);
    assert_eq!(sky.mode().unwrap()["Sky"], "clear");
    fails(sky.p("claer"), &["`claer` is not a value of `Sky`", "did you mean `clear`?"]);
    fails(sky.mean(), &["labels, not numbers"]);
    let die = program.ask("P(Die)").unwrap();
    near(die.p(6).unwrap(), 1.0 / 6.0);
    near(die.mean().unwrap(), 3.5);
    near(die.variance().unwrap(), 35.0 / 12.0);
    assert_eq!(die.interval(0.6).unwrap(), [2.0, 5.0]);
    fails(die.p(7), &["`7` is not a value of `Die`, which is `1..=6`"]);
    let size = program.ask("P(Size)").unwrap();
    // The third bin holds 4 to 6, and its centre is 5.
    near(size.p(4.5).unwrap(), 0.4);
    assert_eq!(size.mode().unwrap()["Size"], 5.0);
    near(size.mean().unwrap(), 5.0);
    let lights = program.ask("P(Light)").unwrap();
    near(lights.p([true, true, false]).unwrap(), 0.25 * 0.5 * 0.25);
    near(lights.of("Light[3]").unwrap().p(true).unwrap(), 0.75);
    fails(lights.of("Light[4]"), &["`Light[1]`, `Light[2]` and `Light[3]`"]);
}

#[test]
fn a_model_that_was_built_is_a_program() {
    use bp_core::compiler::model::{Domain, Form, ModelBuilder};
    use bp_core::compiler::operators::Binary;
    let mut model = ModelBuilder::new("TwoDice");
    let first = model.variable("First", Domain::integers(1, 6));
    let second = model.variable("Second", Domain::integers(1, 6));
    let sum = model.variable("Sum", Domain::integers(2, 12));
    model.factor([first], [], Form::Uniform);
    model.factor([second], [], Form::Uniform);
    let (x, y) = (model.value(first), model.value(second));
    let both = model.binary(Binary::Add, x, y);
    model.factor([sum], [first, second], Form::Dirac(both));
    let program = Program::from(model.build().unwrap());
    // A sum of 9 is 3 + 6, 4 + 5, 5 + 4 or 6 + 3.
    let first = program.ask("P(First | Sum = 9)").unwrap();
    near(first.p(4).unwrap(), 0.25);
    near(first.p(2).unwrap(), 0.0);
}

#[test]
fn an_error_shows_the_line_and_the_way_out() {
    let wrong = GRASS.replace("bernoulli(rate)", "bernoulli(raet)");
    let error = Program::parse(&wrong).unwrap_err();
    let text = error.to_string();
    for part in ["`raet`", "P(Rain)             = bernoulli(raet);", "program:6:", "did you mean `rate`?"] {
        assert!(text.contains(part), "{text}\ndoes not have: {part}");
    }
    assert!(!text.starts_with("error"), "{text}");
    assert_eq!(format!("{error:?}"), text);
    let (source, diagnostics) = error.diagnostics().unwrap();
    assert_eq!(source.slice(diagnostics[0].span), "raet");
    let error = grass().ask("P(Rian | Wet = true)").unwrap_err();
    assert!(error.to_string().contains("did you mean `Rain`?"), "{error}");
    fails(Program::open("no/such.bp"), &["`no/such.bp`"]);
}

/// Reals with a common mean, and a threshold of each.
const SCHOOLS: &str = "program Schools {
    variables { Mu : real; Y[1..=3] : real; K[1..=3] : bool; }
    decomposition { P(Mu) prod(i) { P(Y[i] | Mu) } prod(i) { P(K[i] | Y[i]) } }
    forms {
        P(Mu) = normal(0, 1);
        P(Y[i] | Mu) = normal(Mu, 1);
        P(K[i] | Y[i]) = bernoulli(probit(Y[i]));
    }
}";

#[test]
fn elements_of_families_of_reals_are_known_in_every_group_of_questions() {
    let schools = Program::parse(
        "program Schools {
            variables { Mu : real; Y[1..=3] : real; }
            decomposition { P(Mu) prod(i) { P(Y[i] | Mu) } }
            forms { P(Mu) = normal(0, 1); P(Y[i] | Mu) = normal(Mu, 1); }
        }",
    )
    .unwrap();
    // Given Y[1] = 2: Mu is N(1, 1/2), another Y is N(1, 3/2), with covariance 1/2.
    let known = evidence! { "Y[1]": 2.0 };
    let all = schools.marginals(&known).unwrap();
    for (name, mean, variance) in [("Mu", 1.0, 0.5), ("Y[2]", 1.0, 1.5), ("Y[3]", 1.0, 1.5)] {
        near(all.of(name).unwrap().mean().unwrap(), mean);
        near(all.of(name).unwrap().variance().unwrap(), variance);
    }
    // ln N(2; 0, variance 2).
    let ln = -1.0 - 0.5 * (4.0 * std::f64::consts::PI).ln();
    near(all.ln_evidence().unwrap(), ln);
    let both = schools.joint(&["Mu".into(), "Y[2]".into()], &known).unwrap();
    near(both.of("Y[2]").unwrap().variance().unwrap(), 1.5);
    // The density of the most probable values: Mu, Y[2] and Y[3] are 1, as (2π)^(−3/2) times the root of the precision.
    let mode = schools.most_probable(&known).unwrap();
    near(mode.mode().unwrap()["Mu"].as_f64().unwrap(), 1.0);
    let whole = schools.marginals(&evidence! { Y: [2.0, 1.0, 0.0] }).unwrap();
    near(whole.of("Mu").unwrap().mean().unwrap(), 0.75);
    let only = schools.marginals_of(&["Y[3]".into()], &known).unwrap();
    near(only.mean().unwrap(), 1.0);
    fails(schools.marginals(&evidence! { Y: [2.0, 1.0] }), &["2 values were given, but 3 are expected"]);
    fails(schools.marginals(&evidence! { Y: [2.0, 1.0, 0.0], "Y[1]": 1.0 }), &["`Y[1]` is known twice"]);
    let batch = schools.batch(Cases::new().column("Y[1]", ["2", ""]).only(["Mu"])).unwrap();
    assert_eq!(batch.columns, ["ln_p_evidence", "Mu.mean", "Mu.deviation"]);
    near(batch.rows[0].as_ref().unwrap()[1], 1.0);
    near(batch.rows[1].as_ref().unwrap()[1], 0.0);
}

#[test]
fn a_finite_element_is_known_beside_hidden_reals() {
    let schools = Program::parse(SCHOOLS).unwrap();
    let found = schools.marginals(&evidence! { "K[1]": true }).unwrap();
    // Y[1] is N(0, 2), and Φ(Y[1]) weighs it: E[Y[1]] = 2/√3 · φ(0)/½, half of it in Mu.
    let expected = 2.0 / 3f64.sqrt() * 2.0 / std::f64::consts::TAU.sqrt() / 2.0;
    let mu = found.of("Mu").unwrap();
    assert!((mu.mean().unwrap() - expected).abs() < 0.02, "{}", mu.mean().unwrap());
    // By symmetry.
    assert!((found.ln_evidence().unwrap() - 0.5f64.ln()).abs() < 0.02);
}

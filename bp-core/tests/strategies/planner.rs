//! The planner's choice of a strategy, and its answers to groups of questions.
//!
//! In: programs whose answers follow by hand. Out: offers, answers. Invariant: the cheapest exact offer is accepted; an
//! answer that exceeds the budget is estimated, with a notice.

use bp_core::compiler::answer::ask;
use bp_core::compiler::exec::Inputs;
use bp_core::compiler::model::{Domain, Form, Model, ModelBuilder, Question};
use bp_core::compiler::plan::{Offer, Options, Strategy, plan};
use bp_core::compiler::source::Source;
use bp_core::compiler::syntax::parse_question;
use bp_core::prelude::*;

/// A chain of variables, each as the one before with probability `stays`, else any of the others alike.
fn chain(length: usize, values: usize, stays: f64) -> Model {
    let mut model = ModelBuilder::new("Chain");
    let domain = || Domain::integers(0, values as i64 - 1);
    let ids: Vec<_> = (0..length).map(|number| model.variable(&format!("X{number}"), domain())).collect();
    model.factor([ids[0]], [], Form::Constants(vec![1.0 / values as f64; values]));
    let other = (1.0 - stays) / (values - 1) as f64;
    let cells = (0..values * values).map(|cell| if cell / values == cell % values { stays } else { other });
    let cells: Vec<f64> = cells.collect();
    for pair in ids.windows(2) {
        model.factor([pair[1]], [pair[0]], Form::Constants(cells.clone()));
    }
    model.build().expect("a chain")
}

/// Asks of one question.
fn question(model: &Model, texts: &[&str]) -> Question {
    let parse = |text: &&str| parse_question(&Source::new("question", *text), model).unwrap();
    let mut all: Vec<Question> = texts.iter().map(parse).collect();
    let rest: Vec<_> = all.drain(1..).flat_map(|one| one.asks).collect();
    let mut one = all.remove(0);
    one.asks.extend(rest);
    one
}

fn offers(model: &Model, texts: &[&str], options: Options) -> Vec<Offer> {
    let question = question(model, texts);
    let mut all = plan(model, &question, Options { all_offers: true, ..options }).unwrap().offers;
    assert_eq!(all.len(), 1, "one group");
    all.remove(0)
}

fn taken(offers: &[Offer]) -> &Offer {
    offers.iter().find(|offer| offer.taken).expect("one is taken")
}

fn of(offers: &[Offer], strategy: Strategy) -> &Offer {
    offers.iter().find(|offer| offer.strategy == strategy).expect("it has an offer")
}

/// P(X_k = X_0) = 1/n + (1 - 1/n) λ^k with λ = (n s − 1) / (n − 1).
fn same(length: usize, values: f64, stays: f64) -> f64 {
    let lambda = (values * stays - 1.0) / (values - 1.0);
    1.0 / values + (1.0 - 1.0 / values) * lambda.powi(length as i32)
}

#[test]
fn the_cheapest_exact_offer_is_taken() {
    // Few factors of few values: 4 + 4 products and 2 rows, where making a tree takes more.
    let small = offers(&chain(3, 2, 0.75), &["P(X2)"], Options::default());
    assert_eq!(taken(&small).strategy, Strategy::Sums);
    assert!(of(&small, Strategy::JoinTree).products > of(&small, Strategy::Sums).products, "{small:?}");
    assert!(taken(&small).choice.as_deref().unwrap().contains("fewest products"), "{small:?}");
    // Two ends of a chain of 64 values: loops make their joint distribution, 64³ products for each variable between.
    let wide = chain(6, 64, 0.5);
    let two = offers(&wide, &["P(X0)", "P(X5)"], Options::default());
    assert!(of(&two, Strategy::Sums).products >= Some(4.0 * 64f64.powi(3)), "{two:?}");
    assert_eq!(taken(&two).strategy, Strategy::JoinTree, "{two:?}");
    let asked = question(&wide, &["P(X0 | X2 = 7)", "P(X5 | X2 = 7)"]);
    let answers = ask(&wide, &asked, &Inputs::new()).unwrap();
    for (answer, apart) in answers.iter().zip([2, 3]) {
        let expected = same(apart, 64.0, 0.5);
        assert!((answer.answer[7].p().unwrap() - expected).abs() < 1e-14, "{answer}");
    }
}

#[test]
fn a_thousand_nodes_take_the_join_tree() {
    let model = chain(1000, 2, 0.875);
    let all = offers(&model, &["P(X990 | X999 = 1)"], Options::default());
    assert_eq!(taken(&all).strategy, Strategy::JoinTree, "{all:?}");
    let answer = Program::from(model).ask("P(X990 | X999 = 1)").unwrap();
    assert_eq!(answer.strategy(), Strategy::JoinTree);
    assert!((answer.p(1).unwrap() - same(9, 2.0, 0.875)).abs() < 1e-14);
}

#[test]
fn questions_over_the_budget_are_estimated_with_a_notice() {
    let program = Program::from(chain(4, 8, 0.5));
    let exact = program.ask("P(X3 | X0 = 2)").unwrap();
    assert!((exact.p(2).unwrap() - same(3, 8.0, 0.5)).abs() < 1e-14 && exact.estimate().is_none());
    let answer = program.clone().budget(10).draws(40_000).ask("P(X3 | X0 = 2)").unwrap();
    assert_eq!(answer.strategy(), Strategy::Weighting);
    assert!((answer.p(2).unwrap() - same(3, 8.0, 0.5)).abs() < 0.02, "{answer}");
    assert!(answer.warning().unwrap().contains("more than the budget of 10"), "{answer}");
    // A budget that suffices changes nothing.
    assert!(program.clone().budget(1_000_000).ask("P(X3 | X0 = 2)").unwrap().estimate().is_none());
    // A question that cannot be estimated is answered exactly.
    let information = program.budget(10).ask("information P(X3, X2 | X0 = 2)").unwrap();
    let entropy = |p: f64| -p * p.ln() - (1.0 - p) * ((1.0 - p) / 7.0).ln();
    let expected = entropy(same(3, 8.0, 0.5)) - entropy(same(1, 8.0, 0.5));
    assert!((information.number().unwrap() - expected).abs() < 1e-13, "{information}");
}

const WALK: &str = "program Walk {
    variables { X, Y : real; }
    decomposition { P(X) P(Y | X) }
    forms { P(X) = normal(0, 1); P(Y | X) = normal(X, 1); }
}";

#[test]
fn reals_have_a_joint_law_a_mode_and_informations() {
    let walk = Program::parse(WALK).unwrap();
    let names = |names: &[&str]| names.iter().map(|name| (*name).to_owned()).collect::<Vec<String>>();
    let near = |one: f64, other: f64| assert!((one - other).abs() < 1e-14, "{one} {other}");
    let two_pi = 2.0 * std::f64::consts::PI;
    // cov(X, Y) = [1 1; 1 2], of determinant 1: H = ½ ln (2πe)².
    let both = walk.joint(&names(&["X", "Y"]), &Evidence::new()).unwrap();
    near(both.covariance("X", "Y").unwrap(), 1.0);
    near(both.of("Y").unwrap().deviation().unwrap(), 2f64.sqrt());
    near(both.entropy().unwrap(), two_pi.ln() + 1.0);
    // Given Y = 1: X = ½, and N(½; 0, 1) N(1; ½, 1) = e^(−¼) / 2π.
    let seen = Evidence::new().with("Y", 1.0);
    let mode = walk.most_probable(&seen).unwrap();
    near(mode.number().unwrap(), -0.25 - two_pi.ln());
    let [(x, half), (y, one)] = mode.answer().answer[0].values.as_slice() else { panic!("{mode}") };
    assert_eq!((x.as_str(), y.as_str(), one.as_str()), ("X", "Y", "1"));
    near(half.parse().unwrap(), 0.5);
    // I(X; Y) = H(Y) − H(Y | X) = ½ ln 2.
    let (entropy, found) = walk.observations(&names(&["X"]), &[], &Evidence::new()).unwrap();
    near(entropy, 0.5 * (two_pi.ln() + 1.0));
    assert_eq!((found.len(), found[0].variable.as_str()), (1, "Y"));
    near(found[0].information, 0.5 * 2f64.ln());
    near(found[0].entropy, 0.5 * ((2.0 * two_pi).ln() + 1.0));
}

#[test]
fn strategies_agree_on_questions_asked_together() {
    let program = Program::from(chain(4, 3, 0.5));
    let of = ["X3".to_owned(), "X0".to_owned()];
    let seen = Evidence::new().with("X1", 2);
    let (tree, sums) = (program.clone(), program.by("sums").unwrap());
    let (one, other) = (tree.joint(&of, &seen).unwrap(), sums.joint(&of, &seen).unwrap());
    assert_eq!((one.strategy(), other.strategy()), (Strategy::JoinTree, Strategy::Sums));
    for (three, zero) in (0..9).map(|cell| (cell / 3, cell % 3)) {
        // Given X1 both are independent; X0 is as X1 with probability ½.
        let same_or = |p: f64, is: bool| if is { p } else { (1.0 - p) / 2.0 };
        let expected = same_or(same(2, 3.0, 0.5), three == 2) * same_or(0.5, zero == 2);
        for found in [&one, &other] {
            assert!((found.p((three, zero)).unwrap() - expected).abs() < 1e-15, "{found}");
        }
    }
    // All stay at 2: ⅓ · ½³.
    for asked in [&tree, &sums] {
        let mode = asked.most_probable(&seen).unwrap();
        assert!((mode.number().unwrap() - (1.0f64 / 24.0).ln()).abs() < 1e-14, "{mode}");
        assert!(mode.answer().answer[0].values.iter().all(|(_, value)| value == "2"), "{mode}");
        let all = ["X0", "X2", "X3"].into_iter().fold(seen.clone(), |all, name| all.with(name, 2));
        assert!((tree.most_probable(&all).unwrap().number().unwrap() - (1.0f64 / 24.0).ln()).abs() < 1e-14);
        let (entropy, found) = asked.observations(&of[..1], &[], &seen).unwrap();
        let p = same(2, 3.0, 0.5);
        let h = |p: f64| -p * p.ln() - (1.0 - p) * ((1.0 - p) / 2.0).ln();
        assert!((entropy - h(p)).abs() < 1e-14, "{entropy}");
        // X3 given X2 stays with probability ½; X0 has no information beside X1.
        assert_eq!((found[0].variable.as_str(), found[1].variable.as_str()), ("X2", "X0"));
        assert!((found[0].information - (h(p) - h(0.5))).abs() < 1e-14 && found[1].information < 1e-15);
    }
}

#[test]
fn a_tree_of_elements_where_loops_take_all_of_them_together() {
    let program = Program::parse(
        "program Ends {
            variables { X[1..=40] : bool; Y : bool; }
            decomposition { prod(i in 1..=40) { P(X[i]) } P(Y | X) }
            forms { P(X[i]) = bernoulli(0.5); P(Y | X) = bernoulli(if X[1] and X[40] { 0.99 } else { 0 }); }
        }",
    )
    .unwrap();
    let found = program.ask("P(Y)").unwrap();
    // ¼ · 0.99; loops would take 2⁴¹ products.
    assert_eq!(found.strategy(), Strategy::JoinTree);
    assert!((found.p(true).unwrap() - 0.2475).abs() < 1e-15);
}

#[test]
fn marginals_that_are_exact_are_not_drawn_because_of_another() {
    // Beta(2, 3) after 7 of 10 is beta(9, 6): mean 9/15. `cos` has no closed form.
    let text = |extra: &str| {
        format!(
            "program Coin {{
                variables {{ T : real; H[1..=4] : bool; N : 0..=10; Y : bool; }}
                decomposition {{ P(T) prod(i in 1..=4) {{ P(H[i] | T) }} P(N | T) P(Y{extra}) }}
                forms {{
                    P(T) = beta(2, 3); P(H[i] | T) = bernoulli(T); P(N | T) = binomial(10, T);
                    P(Y{extra}) = bernoulli({});
                }}
            }}",
            if extra.is_empty() { "0.25" } else { "cos(T)" }
        )
    };
    for (extra, is_exact) in [("", true), (" | T", false)] {
        let program = Program::parse(&text(extra)).unwrap();
        let found = program.marginals(&evidence! { N: 7 }).unwrap();
        assert_eq!(found.estimate().is_none(), is_exact, "{extra}");
        for element in 1..=4 {
            let own = found.of(&format!("H[{element}]")).unwrap();
            assert!((own.p(true).unwrap() - 0.6).abs() < 1e-14);
        }
    }
}

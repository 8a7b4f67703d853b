//! Learning from fully observed cases.
//!
//! In: programs with `unknown` forms or parameters to identify, cases counted by hand. Out: learned programs, asked.
//! Invariant: expected numbers are computed by hand, or closed forms of the book.

use crate::support::learning::{answer, both, case, learned, near, program, seen, written};
use crate::support::model_of;
use bp_core::compiler::data::read_table;
use bp_core::compiler::error::Error;
use bp_core::compiler::law::Law;
use bp_core::compiler::learn::{Case, Columns, Learner};
use std::path::Path;

const WORDS: [&str; 5] = ["Fortune", "Next", "Programming", "Money", "You"];

#[test]
fn words_of_mails_are_counted_by_laplace() {
    let factors: String = WORDS.iter().map(|word| format!(" P({word} | Spam)")).collect();
    let forms: String = WORDS.iter().map(|word| format!(" P({word} | Spam) = unknown;")).collect();
    let text = program(
        &format!("Spam, {} : bool;", WORDS.join(", ")),
        &format!("P(Spam){factors}"),
        &format!("P(Spam) = unknown(histogram);{forms}"),
    );
    let model = model_of(&text);
    let mut learner = Learner::new(&model).unwrap();
    for (spam, mails, counts) in [("false", 250, [0, 125, 250, 0, 125]), ("true", 750, [375, 0, 0, 750, 375])]
    {
        for mail in 0..mails {
            let mut it = case(&model, &[("Spam", spam)]);
            for (word, count) in WORDS.iter().zip(counts) {
                it = it.with(model.variable(word).unwrap(), f64::from(u8::from(mail < count)));
            }
            learner.observe(&it).unwrap();
        }
    }
    let learned = learner.learned().unwrap();
    near(&both(&text, &learned, "P(Spam)"), &[0.25, 0.75], 1e-15);
    let expected = [
        [1.0 / 252.0, 126.0 / 252.0, 251.0 / 252.0, 1.0 / 252.0, 126.0 / 252.0],
        [376.0 / 752.0, 1.0 / 752.0, 1.0 / 752.0, 751.0 / 752.0, 376.0 / 752.0],
    ];
    for (spam, row) in [false, true].into_iter().zip(expected) {
        for (word, expected) in WORDS.iter().zip(row) {
            near(&both(&text, &learned, &format!("P({word} = true | Spam = {spam})")), &[expected], 1e-15);
        }
    }
    let none = WORDS.map(|word| format!("{word} = false")).join(", ");
    near(&answer(learned.model(), &format!("P(Spam = true | {none})")), &[0.502649], 5e-7);
    let form = &learned.report.forms[1];
    assert_eq!((form.parameters, form.contexts, form.empty), (2, 2, 0));
    let ln = 250.0 * 251.0_f64.ln() - 250.0 * 252.0_f64.ln() + 375.0 * 0.5_f64.ln() * 2.0;
    assert!((form.ln_likelihood - ln).abs() < 1e-9, "{} {ln}", form.ln_likelihood);
}

#[test]
fn rows_are_counted_with_the_prior_that_is_asked_for() {
    // Cases of X given Y = false: a, a, b; given Y = true none.
    let table = "X,Y\na,false\na,false\nb,false\n";
    for (way, expected, empty) in [
        ("", [0.5, 1.0 / 3.0, 1.0 / 6.0], [1.0 / 3.0; 3]),
        ("(laplace_succession)", [0.5, 1.0 / 3.0, 1.0 / 6.0], [1.0 / 3.0; 3]),
        ("(histogram)", [2.0 / 3.0, 1.0 / 3.0, 0.0], [1.0 / 3.0; 3]),
        ("(dirichlet(2))", [4.0 / 9.0, 3.0 / 9.0, 2.0 / 9.0], [1.0 / 3.0; 3]),
    ] {
        let forms = format!("P(Y) = unknown; P(X | Y) = unknown{way};");
        let text = program("X : { a, b, c }; Y : bool;", "P(Y) P(X | Y)", &forms);
        let learned = learned(&text, table);
        near(&both(&text, &learned, "P(X | Y = false)"), &expected, 1e-15);
        near(&both(&text, &learned, "P(X | Y = true)"), &empty, 1e-15);
        assert_eq!(learned.report.forms[1].empty, 1, "{way}");
    }
    let text = program("O : bool;", "P(O)", "P(O) = unknown(beta(1, 1));");
    near(&both(&text, &learned(&text, "O\n0\n1\n0\n0\n"), "P(O = true)"), &[1.0 / 3.0], 1e-15);
    let text = program("O : bool;", "P(O)", "P(O) = unknown(beta(3, 2));");
    near(&both(&text, &learned(&text, "O\n0\n1\n0\n0\n"), "P(O = true)"), &[4.0 / 9.0], 1e-15);
    let text = program("A, B : bool;", "P(A B)", "P(A B) = unknown(histogram);");
    let found = both(&text, &learned(&text, "A,B\n0,0\n0,1\n1,1\n1,1\n"), "P(A B)");
    near(&found, &[0.25, 0.25, 0.0, 0.5], 1e-15);
}

#[test]
fn a_normal_law_is_the_one_of_the_book() {
    let table = "X\n12\n23\n57\n-30\n-46\n78\n";
    for (way, deviation) in
        [("unknown", 43.8736), ("unknown(normal)", 43.8736), ("unknown(normal, unbiased)", 48.0611)]
    {
        let text = program("X : real;", "P(X)", &format!("P(X) = {way};"));
        let learned = learned(&text, table);
        let words = written(&text, &learned);
        let inside = words.split("normal(").nth(1).unwrap().split(')').next().unwrap();
        let numbers: Vec<f64> = inside.split(", ").map(|number| number.parse().unwrap()).collect();
        near(&numbers, &[15.6667, deviation], 5e-5);
        both(&text, &learned, "P(X = 10)");
    }
}

#[test]
fn conjugate_priors_give_the_posterior_mean() {
    let mean = |variables: &str, way: &str, values: &[&str]| {
        let text = program(variables, "P(X)", &format!("P(X) = unknown({way});"));
        let learned = learned(&text, &format!("X\n{}\n", values.join("\n")));
        let words = written(&text, &learned);
        let inside = words.split("P(X) = ").nth(1).unwrap().split(['(', ')', ',']).nth(1).unwrap().to_owned();
        (inside.parse::<f64>().unwrap(), words)
    };
    near(&[mean("X : 0..=20;", "poisson, gamma(2, 1)", &["3", "4", "2"]).0], &[11.0 / 4.0], 1e-15);
    near(&[mean("X : real;", "exponential, gamma(2, 1)", &["0.5", "1.5"]).0], &[4.0 / 3.0], 1e-15);
    // Precisions 1/100 before and 2/4 from the data: (0/100 + 6/4) / 0.51.
    near(&[mean("X : real;", "normal(2), normal(0, 10)", &["2", "4"]).0], &[1.5 / 0.51], 1e-14);
    let (trials, words) = mean("X : 0..=10;", "binomial(10), beta(1, 1)", &["3", "4"]);
    assert!(trials == 10.0 && words.contains(&format!("binomial(10, {})", 8.0 / 22.0)), "{words}");
}

/// Numeric right-hand variables of every kind, with a distribution for each combination.
const SHAPES: [(&str, [&str; 3]); 6] = [
    ("bool", ["false", "true", "true"]),
    ("{ Near, Far, Away }", ["Far", "Near", "Away"]),
    ("-3..=12", ["-3", "12", "0"]),
    ("{ None } or 2..=20", ["None", "2", "20"]),
    ("bins(-1, 1, 8)", ["-0.9", "0.1", "1"]),
    ("bins[0, 0.5, 2, 10]", ["0.2", "1", "7"]),
];

#[test]
fn a_law_has_its_own_numbers_for_each_value_on_the_right() {
    for (domain, values) in SHAPES {
        for law in ["normal", "gamma"] {
            let text = program(
                &format!("K : {domain}; B : bool; X : real;"),
                "P(K) P(B) P(X | K B)",
                &format!("P(K) = uniform; P(B) = bernoulli(0.5); P(X | K B) = unknown({law});"),
            );
            let (first, second) = (values[0], values[1]);
            let table = format!(
                "K,B,X\n{first},0,1\n{first},0,3\n{second},0,5\n{second},0,9\n{second},0,7\n{first},1,2\n{first},1,8\n"
            );
            let learned = learned(&text, &table);
            let density = |k: &str, b: &str, x: f64| {
                both(&text, &learned, &format!("P(X = {x} | K = {k}, B = {b})"))[0]
            };
            if law == "normal" {
                near(&[density(first, "false", 1.5)], &[Law::Normal.density(1.5, &[2.0, 1.0])], 1e-13);
                let sd = (8.0_f64 / 3.0).sqrt();
                near(&[density(second, "false", 6.0)], &[Law::Normal.density(6.0, &[7.0, sd])], 1e-13);
            }
            // A context without cases has the law of all cases: mean 5.
            let all = [1.0, 3.0, 5.0, 9.0, 7.0, 2.0, 8.0].into_iter().collect();
            let pooled = Law::named(law).unwrap();
            let expected = pooled.density(4.0, &pooled.fit(&all, &[]).unwrap());
            near(
                &[density(values[2], if domain == "bool" { "true" } else { "false" }, 4.0)],
                &[expected],
                1e-13,
            );
        }
    }
}

#[test]
fn a_regression_is_least_squares() {
    let text = program(
        "X : -5..=5; Y : real;",
        "P(X) P(Y | X)",
        "P(X) = uniform; P(Y | X) = unknown(linear_regression);",
    );
    let learned = learned(&text, "X,Y\n0,1\n1,4\n2,6\n3,5\n");
    let found = both(&text, &learned, "P(Y = 2 | X = 1)");
    near(&found, &[Law::Normal.density(2.0, &[3.3, 1.05_f64.sqrt()])], 1e-13);
    assert_eq!(learned.report.forms[0].parameters, 3);
}

#[test]
fn forms_that_are_not_unknown_stay_unchanged() {
    let text = "// About turning.
program Turning {
    parameters { beta : real = 0.25; }
    variables {
        H : { Avoid, Approach };  // what is done
        Prox : 0..=15;
        Vrot : -10..=10;
    }
    decomposition { P(Prox) P(H | Prox) P(Vrot | H Prox) }
    forms {
        P(Prox) = uniform;
        // To be learned.
        P(H | Prox) = unknown;
        P(Vrot | H Prox) = match H { Avoid => normal(0, 18 - Prox), Approach => unknown(normal) };
    }
    question turn { P(Vrot | Prox = 3) }
}
";
    let learned = learned(text, "H,Prox,Vrot\nApproach,3,2\nApproach,3,4\nAvoid,3,-7\n");
    let words = written(text, &learned);
    for kept in [
        "// About turning.",
        "// what is done",
        "// To be learned.",
        "Avoid => normal(0, 18 - Prox),",
        "beta : real = 0.25;",
    ] {
        assert!(words.contains(kept), "{kept} in {words}");
    }
    assert!(!words.contains("unknown"), "{words}");
    near(&both(text, &learned, "P(H | Prox = 3)"), &[0.4, 0.6], 1e-15);
    let narrow = both(text, &learned, "P(Vrot | H = Approach, Prox = 3)");
    let weight = |x: i32| (-0.5 * f64::from(x - 3).powi(2)).exp();
    let total: f64 = (-10..=10).map(weight).sum();
    near(&narrow, &(-10..=10).map(|x| weight(x) / total).collect::<Vec<_>>(), 1e-13);
}

#[test]
fn shared_deviations_and_known_means_have_their_own_equations() {
    let text = |sigma: &str, form: &str| {
        format!(
            "program Shared {{ parameters {{ mu[0..=1], {sigma} : real; }} variables {{ K : bool; X : real; }}
             decomposition {{ P(K) P(X | K) }} forms {{ P(K) = bernoulli(0.5); P(X | K) = {form}; }}
             identification {{ mu, sigma from d; }} }}"
        )
    };
    let table = "K,X\n0,1\n0,3\n1,10\n1,16\n";
    // Residuals ±1 and ±3: σ² = 20/4.
    let text = text("sigma", "normal(mu[K], sigma)");
    let learned = learned(&text, table);
    near(
        &both(&text, &learned, "P(X = 2 | K = true)"),
        &[Law::Normal.density(2.0, &[13.0, 5.0_f64.sqrt()])],
        1e-14,
    );
    let known = program("X : real;", "P(X)", "P(X) = normal(2, sigma);")
        .replace("forms", "identification { sigma from d; } forms");
    let learned = seen(&known, "X\n1\n5\n").learned().unwrap();
    near(&both(&known, &learned, "P(X = 0)"), &[Law::Normal.density(0.0, &[2.0, 5.0_f64.sqrt()])], 1e-14);
}

#[test]
fn probabilities_may_be_parameters() {
    let text = "program Row { parameters { p, q : probability; } variables { X : { a, b, c }; B : bool; }
        decomposition { P(X) P(B | X) } forms { P(X) = categorical(p, q, 1 - p - q); P(B | X) = bernoulli(r[X]); }
        identification { p, q, r from d; } }";
    let learned = learned(text, "X,B\na,1\na,0\nb,1\nc,1\n");
    near(&both(text, &learned, "P(X)"), &[0.5, 0.25, 0.25], 1e-15);
    near(&both(text, &learned, "P(B = true | X = a)"), &[0.5], 1e-15);
    let words = written(text, &learned);
    assert!(words.contains("r[0..=2] : real = [0.5, 1, 1];"), "{words}");
}

#[test]
fn laws_are_learned_of_values_of_any_size() {
    // mpmath at 50 digits: mean and root of the mean squared distance; of Weibull's law the root of
    // Σ xᵏ ln x / Σ xᵏ − 1/k = (ln x₁ + ln x₂) / 2, and c = ((x₁ᵏ + x₂ᵏ) / 2)^(1/k).
    for (law, table, expected) in [
        ("normal", "X\n1e154\n1e155\n-1e155\n", [3.333_333_333_333_333e153, 8.178_562_764_256_865e154]),
        ("normal", "X\n1e-170\n3e-170\n", [2e-170, 1e-170]),
        ("normal", "X\n-1.7e308\n1.7e308\n", [0.0, 1.7e308]),
        ("normal", "X\n1\n1.00000000000001\n", [1.000_000_000_000_005, 4.996_003_610_813_204_5e-15]),
        ("weibull", "X\n1e-300\n1e300\n", [0.001_736_712_711_737_100_5, 2.483_197_323_259_131e148]),
    ] {
        let text = program("X : real;", "P(X)", &format!("P(X) = unknown({law});"));
        let learned = learned(&text, table);
        let found: Vec<f64> = learned.model().parameters.values().map(|it| it.default[0]).collect();
        for (found, expected) in found.iter().zip(expected) {
            assert!((found - expected).abs() <= 1e-12 * expected.abs(), "{law} {table}: {found}");
        }
        assert!(learned.report.ln_likelihood.is_finite(), "{law} {table}");
        if law == "weibull" {
            near(&[learned.report.ln_likelihood], &[-15.898_364_566_154_769], 1e-10);
        }
    }
}

#[test]
fn angles_have_their_mean_on_the_circle() {
    for way in ["normal", "von_mises"] {
        let text = program("X : circle(0, 360, 72);", "P(X)", &format!("P(X) = unknown({way});"));
        let learned = learned(&text, "X\n350\n10\n340\n20\n359\n1\n");
        let found = both(&text, &learned, "P(X)");
        near(&[found[0]], &[found[71]], 1e-9);
        assert!(found[0] > 5.0 * found[18], "{found:?}");
    }
}

#[test]
fn wrong_data_are_reported_with_their_place() {
    let text = program("X : 1..=6; C : { red, green };", "P(X) P(C)", "P(X) = unknown; P(C) = unknown;");
    let refusal = |table: &str| {
        let mut learner = Learner::new(&model_of(&text)).unwrap();
        match read_table(Path::new("d.csv"), table.as_bytes())
            .and_then(|table| learner.observe_table(&table, &Columns::default()))
        {
            Err(error) => error.to_string(),
            Ok(()) => panic!("{table}"),
        }
    };
    assert_eq!(
        refusal("X,C\n1,red\n7,red\n"),
        "`d.csv`, row 3, column `X`: `7` is not a value of `X`, which is `1..=6`"
    );
    assert_eq!(
        refusal("C,X\nblue,2\n"),
        "`d.csv`, row 2, column `C`: `blue` is not a value of `C`, which is `{ red, green }`"
    );
    assert!(refusal("X,C\n1\n").contains("row 2"));
    assert!(refusal("X,X\n1,1\n").contains("`X` twice"));
    assert_eq!(
        refusal("A,X,C\n1,1,red\n"),
        "input `d.csv`: `Learning` has no variable named `A`; ignore the column: `ignore(\"A\")`"
    );
    assert!(refusal("").contains("row 1 must name the columns"));
    let model = model_of(&text);
    let six = model.variable("X").unwrap();
    let mut learner = Learner::new(&model).unwrap();
    assert!(matches!(learner.observe(&Case::new(&model).with(six, 2.5)), Err(Error::Input { .. })));
}

#[test]
fn programs_that_cannot_be_learned_are_refused() {
    let refused = |text: &str, table: &str| {
        let learner = Learner::new(&model_of(text)).and_then(|mut learner| {
            let hidden = if table.contains('X') { vec![] } else { vec!["X".to_owned()] };
            let columns = Columns { hidden, ..Columns::default() };
            learner.observe_table(&read_table(Path::new("d.csv"), table.as_bytes())?, &columns)?;
            learner.learned()
        });
        learner.map(|_| ()).unwrap_err().to_string()
    };
    let known = program("X : bool;", "P(X)", "P(X) = bernoulli(0.5);");
    assert!(refused(&known, "X\n1\n").contains("there is nothing to learn"));
    let real = program("X, Y : real;", "P(X) P(Y | X)", "P(X) = unknown; P(Y | X) = unknown;");
    assert!(refused(&real, "X\n1\n").contains("learn `unknown(linear_regression)`"));
    let same = program("X : real;", "P(X)", "P(X) = unknown(gamma);");
    assert!(
        refused(&same, "X\n2\n2\n").contains("`gamma` needs values that differ; its values lie in [2; 2]")
    );
    assert!(refused(&same, "X\n-2\n3\n").contains("`gamma` needs values greater than 0"));
    let unbiased = program(
        "K : bool; X : real;",
        "P(K) P(X | K)",
        "P(K) = unknown; P(X | K) = unknown(normal, unbiased);",
    );
    let why = refused(&unbiased, "K,X\n0,1\n0,2\n1,3\n");
    assert!(
        why.contains("P(X | K)") && why.contains("K = true") && why.contains("more than one case"),
        "{why}"
    );
    assert!(refused(&unbiased, "K,X\n0,1\n").contains("more than one case"));
    let hidden = program(
        "K : bool; X, Y : real;",
        "P(K) P(X | K) P(Y | X)",
        "P(K) = unknown; P(X | K) = unknown; P(Y | X) = normal(X, 1);",
    );
    assert!(refused(&hidden, "K,Y\n1,2\n0,3\n").contains("missing in some cases"));
}

/// 10¹⁷ of `true` beside one `false`: 1 − P(true) rounds to 0.
#[test]
fn a_small_probability_of_false_is_written() {
    let text = program("K : bool;", "P(K)", "P(K) = unknown(histogram);");
    let mut learner = Learner::new(&model_of(&text)).unwrap();
    let table = read_table(Path::new("data.csv"), "K,w\ntrue,1e17\nfalse,1\n".as_bytes()).unwrap();
    let columns = Columns { weight: Some("w".to_owned()), ..Columns::default() };
    learner.observe_table(&table, &columns).unwrap();
    let learned = learner.learned().unwrap();
    near(&both(&text, &learned, "P(K = false)"), &[1e-17], 1e-30);
}

/// A uniform distribution whose ends cut their bins has the shares of the cases: 1, 4 and 1 of six.
#[test]
fn a_uniform_distribution_over_bins() {
    use bp_core::prelude::*;
    let text = "program Even { variables { X : bins(0, 10, 10); } decomposition { P(X) } forms { P(X) = unknown(uniform); } }";
    let program = Program::parse(text).unwrap();
    let shares = |values: &[f64]| {
        let learned = program.learn(Learning::new().column("X", values.iter().copied())).unwrap();
        let found = learned.program().ask("P(X)").unwrap();
        found.answer().answer.iter().map(|row| row.p().unwrap()).collect::<Vec<f64>>()
    };
    for (values, expected) in [
        (&[3.0, 4.0, 5.5][..], [1.0 / 3.0, 1.0 / 3.0, 1.0 / 3.0]),
        (&[3.0, 4.0, 4.5, 4.2, 4.9, 5.0], [1.0 / 6.0, 2.0 / 3.0, 1.0 / 6.0]),
        (&[4.0, 4.0], [0.0, 1.0, 0.0]),
    ] {
        near(&shares(values)[3..6], &expected, 1e-12);
    }
    // The last bin has both of its edges.
    near(&shares(&[9.0, 10.0])[9..], &[1.0], 1e-12);
}

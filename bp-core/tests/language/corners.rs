//! Regression tests: chains of Diracs, sizes known at run time, tables of several variables.
//!
//! In: small programs. Out: their answers. Invariant: expected values are computed by hand in each test.

use crate::support::{model_of, question};
use bp_core::compiler::answer::ask;
use bp_core::compiler::exec::Inputs;
use bp_core::compiler::source::Source;
use bp_core::compiler::syntax::compile;

fn answers(text: &str, asked: &str, inputs: &Inputs<'_, f64>) -> Result<Vec<f64>, String> {
    let model = model_of(text);
    let answers = ask(&model, &question(&model, asked), inputs).map_err(|error| error.to_string())?;
    Ok(answers[0].answer.iter().map(|row| row.p().unwrap()).collect())
}

#[track_caller]
fn near(found: Result<Vec<f64>, String>, expected: &[f64]) {
    let found = found.unwrap();
    assert_eq!(found.len(), expected.len(), "{found:?}");
    let close = found.iter().zip(expected).all(|(p, q)| (p - q).abs() <= 1e-12);
    assert!(close, "{found:?}, expected {expected:?}");
}

#[test]
fn the_index_of_a_plate_has_no_value_in_a_question() {
    let text = "program Plate over C in Grid { variables { O : bool; } decomposition { P(O) } forms { P(O) = bernoulli(0.5); } }";
    let source = Source::new("question", "P(O | C = 3)");
    let wrong = bp_core::compiler::syntax::parse_question(&source, &model_of(text)).unwrap_err();
    assert!(
        wrong.render(&source, false).contains("`C` is the plate's index"),
        "{}",
        wrong.render(&source, false)
    );
}

#[test]
fn each_branch_has_the_table_that_stands_in_it() {
    // Both tables have more numbers than are written out as choices, so each is an array.
    let text = "program Branches {
        variables { A : bool; B : 0..=4; C : bool; }
        decomposition { P(A) P(B) P(C | A B) }
        forms {
            P(A) = bernoulli(0.25);  P(B) = uniform;
            P(C | A B) = if A {
                table { 0.0, 1; 0.0, 1; 0.0, 1; 0.0, 1; 0.0, 1; 0.1, 0.9; 0.2, 0.8; 0.3, 0.7; 0.4, 0.6; 0.5, 0.5; }
            } else {
                table { 0.9, 0.1; 0.8, 0.2; 0.7, 0.3; 0.6, 0.4; 0.5, 0.5; 0.0, 1; 0.0, 1; 0.0, 1; 0.0, 1; 0.0, 1; }
            };
        }
    }";
    // ¼ · (0.1 + 0.2 + 0.3 + 0.4 + 0.5) / 5 + ¾ · (0.9 + 0.8 + 0.7 + 0.6 + 0.5) / 5
    near(answers(text, "P(C)", &Inputs::new()), &[0.25 * 0.3 + 0.75 * 0.7, 0.25 * 0.7 + 0.75 * 0.3]);
    near(answers(text, "P(C = false | A = true, B = 3)", &Inputs::new()), &[0.4]);
}

#[test]
fn a_long_chain_of_diracs_takes_no_time() {
    // X_k = X_{k−1} + 1 modulo 4, so X_29 = X_0 + 29 = X_0 + 1.
    let variables: String = (0..30).map(|k| format!("X{k} : 0..=3;")).collect();
    let factors: String = (1..30).map(|k| format!("P(X{k} | X{}) ", k - 1)).collect();
    let form = |k: usize| {
        let before = format!("X{}", k - 1);
        format!("P(X{k} | {before}) = dirac(if {before} > 2 {{ 3 - {before} }} else {{ {before} + 1 }});")
    };
    let forms: String = (1..30).map(form).collect();
    let text = format!(
        "program Chain {{ variables {{ {variables} }} decomposition {{ P(X0) {factors} }} forms {{ P(X0) = uniform; {forms} }} }}"
    );
    near(answers(&text, "P(X0 | X29 = 2)", &Inputs::new()), &[0.0, 1.0, 0.0, 0.0]);
}

#[test]
fn a_dirac_on_a_domain_of_named_size() {
    let text = "program Sized { parameters { n : size; } variables { A : 1..=n; B : bool; S : 2..=n; }
        decomposition { P(A) P(B | A) P(S | A) }
        forms { P(A) = uniform; P(B | A) = bernoulli(1 / A); P(S | A) = dirac(A + 1); } }";
    // A = n has no S: the rest is renormalised. 1 : ½ for B.
    let inputs = || Inputs::new().size("n", 3);
    near(answers(text, "P(A)", &inputs()), &[0.5, 0.5, 0.0]);
    near(answers(text, "P(A | B = true)", &inputs()), &[2.0 / 3.0, 1.0 / 3.0, 0.0]);
    let error = answers(text, "P(A | S = s)", &inputs().number("s", 9.0)).unwrap_err();
    assert!(error.contains("`s`") && error.contains("2..=n"), "{error}");
}

#[test]
fn a_parameter_read_at_a_dirac_outside_its_domain() {
    let text =
        "program Read { parameters { mu[1..=3] : probability; } variables { A : 1..=2; B : bool; S : 1..=3; }
        decomposition { P(A) P(S | A) P(B | S) }
        forms { P(A) = uniform; P(S | A) = dirac(3 * A); P(B | S) = bernoulli(mu[S]); } }";
    let inputs = || Inputs::new().array("mu", &[0.1, 0.2, 0.3]);
    near(answers(text, "P(B)", &inputs()), &[0.7, 0.3]);
    near(answers(text, "P(B | A)", &inputs()), &[0.7, 0.3, 0.0, 0.0]);
    assert!(answers(text, "P(B | A = 2)", &inputs()).unwrap_err().contains("probability zero"));
}

#[test]
fn a_family_that_is_used_through_a_dirac_too_is_not_scanned() {
    let text =
        "program Twice { variables { C : 1..=4; O : bool; G[1..=4 except C] : bool; K : 1..=5; Z, W : bool; }
        decomposition { P(C) P(O) prod(j) { P(G[j] | C) } P(K | G O C) P(Z | K) P(W | G O C) }
        forms { P(C) = uniform; P(O) = uniform; P(G[j] | C) = bernoulli(0.25);
                P(K | G O C) = let k = first(G with O at C) in dirac(k); P(Z | K) = bernoulli(0.1 * K);
                P(W | G O C) = let k = first(G with O at C) in bernoulli(0.15 * k); } }";
    // First is 1, 3, 4 or none with ¼, 3/16, 9/64, 27/64; Σ w (.1 k) (.15 k), and so on.
    let weights = [(1.0, 0.25), (3.0, 0.1875), (4.0, 0.140625), (5.0, 0.421875)];
    let sum = |z: fn(f64) -> f64, w: fn(f64) -> f64| {
        weights.iter().map(|(k, p)| p * z(0.1 * k) * w(0.15 * k)).sum()
    };
    let expected: [f64; 4] =
        [sum(|p| 1.0 - p, |p| 1.0 - p), sum(|p| 1.0 - p, |p| p), sum(|p| p, |p| 1.0 - p), sum(|p| p, |p| p)];
    near(answers(text, "P(Z W | C = 2, O = false)", &Inputs::new()), &expected);
}

#[test]
fn a_table_of_two_variables_has_rows_that_sum_to_one() {
    let text = |rows: &str| {
        format!(
            "program Two {{ variables {{ A, B : bool; C : 1..=2; }} decomposition {{ P(C) P(A B | C) }}
             forms {{ P(C) = uniform; P(A B | C) = table {{ {rows} }}; }} }}"
        )
    };
    let good = text("0.1, 0.2, 0.3, 0.4; 0.25, 0.25, 0.5, 0;");
    near(answers(&good, "P(A B | C = 1)", &Inputs::new()), &[0.1, 0.2, 0.3, 0.4]);
    // B true: .2 + .25 with A false, .4 + 0 with A true.
    near(answers(&good, "P(A | B = true)", &Inputs::new()), &[0.45 / 0.85, 0.4 / 0.85]);
    for bad in ["0.1, 0.9; 0.5, 0.5;", "0.1, 0.9, 0.5, 0.5; 0.25, 0.25, 0.25, 0.25;"] {
        assert!(compile(&Source::new("bad", text(bad))).is_err(), "{bad}");
    }
}

#[test]
fn a_deviation_of_zero_is_an_error() {
    let text = "program Sharp { parameters { s : real; } variables { A : bool; X : real; } decomposition { P(A) P(X | A) }
        forms { P(A) = uniform; P(X | A) = normal(if A { 1 } else { 0 }, s); } }";
    let error = answers(text, "P(A | X = 1)", &Inputs::new().number("s", 0.0)).unwrap_err();
    assert!(error.contains("normal(if A { 1 } else { 0 }, s)`, where A = false"), "{error}");
    assert!(error.contains("the standard deviation is 0, but it must be greater than 0"), "{error}");
}

#[test]
fn families_of_unknown_length_need_values_or_a_size() {
    let text = "program Sensors { variables { A : bool; Z[i in S] : bool; } decomposition { P(A) prod(i) { P(Z[i] | A) } }
        forms { P(A) = uniform; P(Z[i] | A) = bernoulli(if A { 0.1 } else { 0.4 }); } }";
    let two = || Inputs::new().size("S", 2);
    // .1 · .9 against .4 · .6
    near(answers(text, "P(A | Z = z)", &two().array("z", &[1.0, 0.0])), &[0.24 / 0.33, 0.09 / 0.33]);
    near(answers(text, "P(A)", &two()), &[0.5, 0.5]);
    for asked in ["P(A | Z)", "P(Z)"] {
        assert!(answers(text, asked, &two()).unwrap_err().contains("not known"), "{asked}");
    }
    assert!(answers(text, "P(A | Z = z)", &two().array("z", &[1.0, 4.0])).unwrap_err().contains("`z`"));
}

#[test]
fn a_size_that_is_not_given_is_its_default() {
    let text = "program Sized { parameters { n : size = 3; } variables { A : 1..=n; B : bool; }
        decomposition { P(A) P(B | A) }
        forms { P(A) = uniform; P(B | A) = bernoulli(1 / A); } }";
    // 1 : 1/2 : 1/3 = 6 : 3 : 2.
    near(answers(text, "P(A | B = true)", &Inputs::new()), &[6.0 / 11.0, 3.0 / 11.0, 2.0 / 11.0]);
    near(answers(text, "P(A | B = true)", &Inputs::new().size("n", 2)), &[2.0 / 3.0, 1.0 / 3.0]);
}

#[test]
fn before_the_first_instant_the_form_after_else_holds() {
    let model = model_of(
        "program First { variables { X, X^-1 : bool; } decomposition { P(X^-1) P(X | X^-1) }
         forms { P(X^-1) = previous(X) else bernoulli(0.25); P(X | X^-1) = bernoulli(if X^-1 { 0.8 } else { 0.4 }); } }",
    );
    let p = |inputs: &Inputs<'_, f64>| {
        ask(&model, &question(&model, "P(X = true)"), inputs).unwrap()[0].answer[0].p().unwrap()
    };
    assert!((p(&Inputs::new()) - (0.25 * 0.8 + 0.75 * 0.4)).abs() < 1e-15);
    let kept = [0.5, 0.5];
    assert!((p(&Inputs::new().array("previous X", &kept)) - 0.6).abs() < 1e-15);
}

#[test]
fn a_table_that_is_the_asked_distribution() {
    // More than eight numbers: an array of the kernel. (Regression: it was taken for the answer of the same name.)
    let text = "program Asked { variables { A : 0..=4; B : bool; } decomposition { P(A) P(B | A) }
        forms { P(A) = uniform;
            P(B | A) = table { 0: 0.9, 0.1; 1: 0.8, 0.2; 2: 0.7, 0.3; 3: 0.6, 0.4; 4: 0.5, 0.5; }; } }";
    near(answers(text, "P(B | A)", &Inputs::new()), &[0.9, 0.1, 0.8, 0.2, 0.7, 0.3, 0.6, 0.4, 0.5, 0.5]);
}

#[test]
fn weights_over_a_set_are_normalised_as_over_a_range() {
    let text = |domain: &str, weight: &str| {
        format!(
            "program Weighed {{ parameters {{ w[Things] : real; }} variables {{ B : bool; V : {domain}; U : Things; }}
             decomposition {{ P(B) P(V | B) P(U | B) }}
             forms {{ P(B) = uniform; P(V | B) = weights({weight}); P(U | B) = weights(if B {{ w[U] }} else {{ 2 * w[U] + 1 }}); }} }}"
        )
    };
    let weights = [1.0, 2.0, 3.0, 4.0];
    let inputs = || Inputs::new().size("Things", 4).number("v", 1.0).number("u", 3.0).array("w", &weights);
    for domain in ["Things", "0..=3"] {
        // All four values have equal probability for each B: v is uninformative, and ln P(V = v) = -ln 4.
        let text = text(domain, "if B { 1 } else { 3 }");
        near(answers(&text, "P(B | V = v)", &inputs()), &[0.5, 0.5]);
        near(answers(&text, "P(B)", &inputs()), &[0.5, 0.5]);
        near(answers(&text, "P(V | B = true)", &inputs()), &[0.25; 4]);
        let model = model_of(&text);
        let answer = ask(&model, &question(&model, "P(B | V = v)"), &inputs()).unwrap().remove(0);
        assert!((answer.ln_evidence.unwrap() + 4f64.ln()).abs() < 1e-12, "{answer:?}");
        // P(U = 3 | B) is 4/10 where B is true, 9/24 where it is false.
        let (with, without) = (4.0 / 10.0, 9.0 / 24.0);
        near(
            answers(&text, "P(B | U = u)", &inputs()),
            &[without / (with + without), with / (with + without)],
        );
    }
}

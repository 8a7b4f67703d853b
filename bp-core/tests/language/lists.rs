//! Lists as evidence, and the numbers of vectors and families.
//!
//! In: a linear Gaussian program. Out: means. Invariant: expected values are computed by hand.

use crate::support::agrees;
use bp_core::prelude::*;

/// N(0, 1) and three numbers of deviation 1: of 1, 2, 3 the mean is 6/4; of the first two 3/3.
#[test]
fn lists_give_elements_their_values() {
    let three = Program::parse(
        "program Three {
            parameters { seen[1..=3] : real = [1, 2, 3]; }
            variables { Mu : real; Y[1..=3] : real; V : real[2]; }
            decomposition { P(Mu) prod(i) { P(Y[i] | Mu) } P(V | Mu) }
            forms { P(Mu) = normal(0, 1); P(Y[i] | Mu) = normal(Mu, 1); P(V | Mu) = normal([Mu, 2 * Mu], 1); }
            question declared { P(Mu | Y = [1, 2, 3]) }
        }",
    )
    .unwrap();
    for (question, expected) in [
        ("P(Mu | Y = [1, 2, 3])", 1.5),
        ("declared", 1.5),
        ("P(Mu | Y = seen)", 1.5),
        ("P(Mu | Y[1..=2] = [1, 2])", 1.0),
        // Precision 1 + 1 + 4, and 1 + 2 · 3 of it.
        ("P(Mu | V = [1, 3])", 7.0 / 6.0),
        ("expectation P(Y | Mu = -2)", -2.0),
    ] {
        let answer = three.ask(question).unwrap_or_else(|error| panic!("{question}: {error}"));
        let found = match question.starts_with("expectation") {
            true => answer.of("Y[2]").unwrap().mean().unwrap(),
            false => answer.mean().unwrap(),
        };
        agrees(found, expected, question);
    }
    let of_v = three.ask("expectation P(V | Mu = 3)").unwrap();
    agrees(of_v.of("V[1]").unwrap().mean().unwrap(), 6.0, "V");
    let error = three.ask("P(Mu | Y = [1, 2])").unwrap_err().to_string();
    assert!(error.contains("`Y` has 3 elements, but 2 values are given"), "{error}");
}

/// The votes 2 and 1 beside one imagined vote each: 3 of 5.
#[test]
fn a_list_is_the_value_of_a_vector_that_has_a_law_as_a_whole() {
    let ballots = Program::parse(
        "program Ballots {
            variables { Share, Votes : real[2]; Next : { Red, Green }; }
            decomposition { P(Share) P(Votes | Share) P(Next | Share) }
            forms {
                P(Share) = dirichlet(1, 1);
                P(Votes | Share) = multinomial(3, Share);
                P(Next | Share) = categorical(Share);
            }
        }",
    )
    .unwrap();
    let next = ballots.ask("P(Next | Votes = [2, 1])").unwrap();
    agrees(next.p("Red").unwrap(), 0.6, "Red");
    // Each of the four results of three votes has the same probability under a uniform share.
    agrees(next.ln_evidence().unwrap(), 0.25f64.ln(), "ln P");
    assert_eq!(next.question(), "P(Next | Votes = [2, 1])");
    let error = ballots.ask("P(Next | Votes = [2, 1, 0])").unwrap_err().to_string();
    assert!(error.contains("`Votes` has 2 components, but 3 values are given"), "{error}");
}

/// The odds of A by V = [1, 0] are N(1; 1, 1) / N(1; 0, 1) = exp(½), beside 1 : 1 of the prior.
#[test]
fn a_list_of_components_leaves_finite_variables_exact() {
    let seen = Program::parse(
        "program Seen {
            variables { A : bool; V : real[2]; }
            decomposition { P(A) P(V | A) }
            forms { P(A) = bernoulli(0.5); P(V | A) = normal([if A { 1 } else { 0 }, 0], 1); }
        }",
    )
    .unwrap();
    let found = seen.ask("P(A | V = [1, 0])").unwrap();
    assert!(found.strategy().is_exact());
    agrees(found.p(true).unwrap(), 1.0 / (1.0 + (-0.5f64).exp()), "A");
}

/// A parameter has its declared shape: m[1, 2] is the second number of the second row, whatever is repeated over the plate.
#[test]
fn rows_of_a_parameter_are_those_of_its_declaration() {
    let over = |plate: &str, index: &str| {
        let first = if plate.is_empty() { "1..=2" } else { "Cells" };
        let (c, k) = if plate.is_empty() { ("C : 1..=2;", "P(C)") } else { ("", "") };
        let form = if plate.is_empty() { "P(C) = uniform;" } else { "" };
        let right = if plate.is_empty() { "K C" } else { "K" };
        Program::parse(&format!(
            "program Fields {plate} {{ parameters {{ m[{first}, 1..=3] : real; }} variables {{ K : 1..=3; O : bool; {c} }}
             decomposition {{ P(K) {k} P(O | {right}) }}
             forms {{ P(K) = uniform; {form} P(O | {right}) = bernoulli(m[{index}, K]); }} }}"
        ))
        .unwrap_or_else(|error| panic!("{error}"))
    };
    let (rows, columns) = ("[[0.1, 0.2, 0.3], [0.4, 0.5, 0.6]]", "[[0.1, 0.4], [0.2, 0.5], [0.3, 0.6]]");
    let plain = over("", "C");
    assert!(plain.clone().with("m", columns).is_err());
    let plain = plain.with("m", rows).unwrap();
    for (c, expected) in [(1, 0.2), (2, 0.5)] {
        let found = plain.ask(&format!("P(O = true | K = 2, C = {c})")).unwrap().number().unwrap();
        assert!((found - expected).abs() < 1e-15, "{found}");
    }
    let cells = over("over c in Cells", "c").with("Cells", 2).unwrap();
    assert!(cells.clone().with("m", columns).is_err());
    for given in [rows, "0.1, 0.2, 0.3, 0.4, 0.5, 0.6"] {
        let found = cells.clone().with("m", given).unwrap().ask("P(O = true | K = 2)").unwrap();
        let found: Vec<f64> = found.answer().answer.iter().map(|row| row.figure.number().unwrap()).collect();
        assert!((found[0] - 0.2).abs() < 1e-15 && (found[1] - 0.5).abs() < 1e-15, "{given}: {found:?}");
    }
    let wrong = Program::parse(
        "program Shape { parameters { m[1..=2, 1..=3] : real = [[0.1, 0.4], [0.2, 0.5], [0.3, 0.6]]; } variables { O : bool; }
         decomposition { P(O) } forms { P(O) = bernoulli(m[1, 2]); } }",
    );
    assert!(wrong.unwrap_err().to_string().contains("2 rows of 3"));
}

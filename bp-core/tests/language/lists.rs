//! Lists as evidence, and the numbers of vectors and families.
//!
//! In: a linear Gaussian program. Out: means. Invariant: expected values are computed by hand.

use bp_core::prelude::*;

fn close(found: f64, expected: f64, question: &str) {
    assert!((found - expected).abs() <= 1e-12 * expected.abs().max(1e-3), "{question}: {found} ≠ {expected}");
}

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
        close(found, expected, question);
    }
    let of_v = three.ask("expectation P(V | Mu = 3)").unwrap();
    close(of_v.of("V[1]").unwrap().mean().unwrap(), 6.0, "V");
    let error = three.ask("P(Mu | Y = [1, 2])").unwrap_err().to_string();
    assert!(error.contains("`Y` has 3 elements, but 2 values are given"), "{error}");
}

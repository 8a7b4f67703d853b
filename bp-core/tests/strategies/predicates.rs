//! Predicates that closed forms answer: of a component of proportions, of a precision, of what the evidence determines.
//!
//! In: programs as texts. Out: probabilities. Invariant: expected values are exact, computed by hand in the comments.

use crate::support::close;
use bp_core::prelude::*;

fn program(text: &str) -> Program {
    Program::parse(text).unwrap_or_else(|error| panic!("{error}"))
}

/// One component of a dirichlet(3, 2) posterior is beta(3, 2): P(Share > ½) = 11/16.
#[test]
fn a_component_of_proportions_has_a_beta_distribution() {
    let ballots = program(
        "program Ballots {
            variables { Share, Votes : real[2]; }
            decomposition { P(Share) P(Votes | Share) }
            forms { P(Share) = dirichlet(1, 1); P(Votes | Share) = multinomial(3, Share); }
        }",
    );
    let red = ballots.ask("P(Share[0] | Votes = [2, 1])").unwrap();
    assert!(red.to_string().contains("beta(3, 2)"), "{red}");
    close(red.mean().unwrap(), 0.6);
    close(ballots.ask("expectation P(Share[1] | Votes = [2, 1])").unwrap().number().unwrap(), 0.4);
    let most = ballots.ask("P(Share[0] > 0.5 | Votes = [2, 1])").unwrap();
    assert!(most.strategy().is_exact());
    close(most.p(true).unwrap(), 11.0 / 16.0);
    // Two components of one vector depend on each other: no single law decides.
    assert!(!ballots.ask("P(Share[0] > 2 * Share[1] | Votes = [2, 1])").unwrap().strategy().is_exact());
}

/// The precision is gamma(2 + 4/2, 1 + 10/2) given 1, 2, 3, 4: P(Tau > 1) = e⁻⁶ (1 + 6 + 6²/2 + 6³/6).
#[test]
fn a_predicate_of_a_precision_is_answered_by_its_law() {
    let normal = program(
        "program Normal {
            variables { Tau, Mu : real; Y[1..=4] : real; }
            decomposition { P(Tau) P(Mu | Tau) prod(i) { P(Y[i] | Mu Tau) } }
            forms {
                P(Tau) = gamma(2, 1);
                P(Mu | Tau) = normal(0, 1 / sqrt(Tau));
                P(Y[i] | Mu Tau) = normal(Mu, 1 / sqrt(Tau));
            }
        }",
    );
    for (question, expected) in [
        ("P(Tau > 1 | Y = [1, 2, 3, 4])", 61.0 * (-6.0f64).exp()),
        ("P(2 * Tau <= 2 | Y = [1, 2, 3, 4])", 1.0 - 61.0 * (-6.0f64).exp()),
    ] {
        let found = normal.ask(question).unwrap();
        assert!(found.strategy().is_exact(), "{question}");
        close(found.p(true).unwrap(), expected);
    }
}

/// What the evidence determines is decided, whatever its rounding.
#[test]
fn a_predicate_of_a_determined_number_is_decided() {
    let program = program(
        "program Two {
            variables { A, B : real; }
            decomposition { P(A) P(B) }
            forms { P(A) = normal(0, 2); P(B) = normal(1, 3); }
        }",
    );
    for (question, expected) in [
        ("P(A + B > 5 | A + B = 5)", 0.0),
        ("P(A + B >= 5 | A + B = 5)", 1.0),
        ("P(A > B | A - B == 0)", 0.0),
        ("P(A >= B | A - B == 0)", 1.0),
        ("P(A + 2*B > 4 | A + 2*B = 4)", 0.0),
        ("P(A + 0.1*B > 0.3 | A + 0.1*B = 0.3)", 0.0),
        ("P(3*A - 1 > 3*B - 1 | A == B)", 0.0),
        ("P(A > B | A = 2, B = 2)", 0.0),
        ("P(A + B > 4.9 | A + B = 5)", 1.0),
    ] {
        let found = program.ask(question).unwrap_or_else(|error| panic!("{question}: {error}"));
        assert_eq!(found.p(true).unwrap(), expected, "{question}");
    }
    let difference = program.ask("P(A - B | A - B == 0)").unwrap();
    assert_eq!((difference.mean().unwrap(), difference.variance().unwrap()), (0.0, 0.0));
}

/// A number that finite variables determine is compared as an observation is: 3 · 0.1 is 0.3.
#[test]
fn a_predicate_of_a_computed_number_allows_for_its_rounding() {
    let program = program(
        "program Tenths {
            variables { K : 1..=9; Y, Z : real; }
            decomposition { P(K) P(Y | K) P(Z | Y) }
            forms { P(K) = uniform; P(Y | K) = dirac(K * 0.1); P(Z | Y) = normal(Y, 1); }
        }",
    );
    for (question, expected) in [
        ("P(Y == 0.3)", 1.0),
        ("P(Y > 0.3)", 6.0),
        ("P(Y >= 0.3)", 7.0),
        ("P(Y < 0.3)", 2.0),
        ("P(Y <= 0.3 or Y > 0.7)", 5.0),
        ("P(not (Y != 0.6))", 1.0),
    ] {
        let found = program.ask(question).unwrap_or_else(|error| panic!("{question}: {error}"));
        close(found.p(true).unwrap(), expected / 9.0);
        for strategy in ["sums", "mixture"] {
            let found = program.clone().by(strategy).unwrap().ask(question);
            let found = found.unwrap_or_else(|error| panic!("{question}: {error}"));
            close(found.number().or_else(|_| found.p(true)).unwrap(), expected / 9.0);
        }
    }
    for question in ["P(K | Y = 0.3)", "P(K | Y == 0.3)", "P(K | 0.3 == Y)", "P(K | Y <= 0.3, Y >= 0.3)"] {
        let found = program.ask(question).unwrap_or_else(|error| panic!("{question}: {error}"));
        assert_eq!(found.p(3).unwrap(), 1.0, "{question}");
    }
}

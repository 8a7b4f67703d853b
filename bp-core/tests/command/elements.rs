//! Tables over time whose columns are elements of families.
//!
//! In: the built binary, programs and tables. Out: answers. Invariant: expected numbers are computed by hand, in comments.

use super::cases::Folder;

#[test]
fn a_table_over_time_has_the_size_of_a_set() {
    let walk = "program Walk {
        variables { T, T^-1 : real; S[i in Sensors] : real; }
        decomposition { P(T^-1) P(T | T^-1) prod(i in Sensors) { P(S[i] | T) } }
        forms { P(T^-1) = normal(0, 1); P(T | T^-1) = normal(T^-1, 1); P(S[i] | T) = normal(T, 1); }
    }
    ";
    let folder =
        Folder::with(&[("walk.bp", walk), ("t.csv", "S[0],S[1]\n1,1\n"), ("half.csv", "S[0],S[1]\n,1\n")]);
    let mean = |question: &str, table: &str| {
        let found = folder.json(0, &["ask", "walk.bp", question, "--data", table, "--json"]);
        let row = &found["answer"][0];
        (row["mean"].as_f64().unwrap(), row["deviation"].as_f64().unwrap())
    };
    // T is N(0, 2) before: precision 1/2 + 2, mean 2 / (5/2).
    let (found, deviation) = mean("filter P(T | S)", "t.csv");
    assert!((found - 0.8).abs() < 1e-12 && (deviation - 0.4f64.sqrt()).abs() < 1e-12, "{found} {deviation}");
    // One of them: precision 1/2 + 1, mean 1 / (3/2).
    for question in ["filter P(T | S)", "smooth P(T | S)"] {
        let (found, deviation) = mean(question, "half.csv");
        let expected = 2.0f64 / 3.0;
        assert!(
            (found - expected).abs() < 1e-12 && (deviation - expected.sqrt()).abs() < 1e-12,
            "{question}"
        );
    }
    // A sequence has no value that is fixed.
    let (_, message) = folder.ends(1, &["ask", "walk.bp", "sequence P(T = 1 | S)", "--data", "t.csv"]);
    assert!(message.contains("search `T`, without a value"), "{message}");
}

#[test]
fn elements_of_real_families_are_known_over_time() {
    let state = "program State {
        variables { X, X^-1 : bool; R[k in 0..=1] : real; }
        decomposition { P(X^-1) P(X | X^-1) prod(k) { P(R[k] | X) } }
        forms {
            P(X^-1) = bernoulli(0.5); P(X | X^-1) = dirac(X^-1);
            P(R[k] | X) = normal(if X { 1 + k } else { 0 }, 1);
        }
    }
    ";
    let folder = Folder::with(&[("state.bp", state), ("r.csv", "R[0],R[1]\n1,3\n")]);
    let p = |question: &str| {
        let found = folder.json(0, &["ask", "state.bp", question, "--data", "r.csv", "--json"]);
        assert_eq!(found["question"], question);
        found["answer"][1]["p"].as_f64().unwrap()
    };
    // The odds of X are exp(R − ½) by R[0] = 1, and exp(2 R − 2) by R[1] = 3.
    let share = |ln_odds: f64| 1.0 / (1.0 + (-ln_odds).exp());
    for (question, ln_odds) in [
        ("filter P(X | R[0])", 0.5),
        ("smooth P(X | R[1])", 4.0),
        ("filter P(X | R[0] R[1])", 4.5),
        ("filter P(X | R[0..=1])", 4.5),
    ] {
        assert!((p(question) - share(ln_odds)).abs() < 1e-12, "{question}");
    }
}

/// Components of a vector have columns of their own. The numbers are those of a Kalman filter in two dimensions, computed apart.
#[test]
fn components_of_vectors_are_known_over_time() {
    let program =
        "program V { variables { X, X^-1, Z : real[2]; } decomposition { P(initial(X)) P(X | X^-1) P(Z | X) }
         forms { P(initial(X)) = normal([1, -1], [[2, 1], [1, 1]]);
                 P(X | X^-1) = normal([X^-1[0] + 0.5 * X^-1[1], 0.9 * X^-1[1]], [[0.3, 0.3], [0.3, 0.3]]);
                 P(Z | X) = normal(X, [[1, 0.4], [0.4, 0.5]]); } }";
    let table = "Z[0],Z[1]\n1,\n2,0.5\n,\n,1\n3,2\n";
    let folder = Folder::with(&[("v.bp", program), ("v.csv", table)]);
    let answer = folder.json(0, &["ask", "v.bp", "filter P(X[0] | Z[0] Z[1])", "--data", "v.csv", "--json"]);
    let mean = answer["answer"][0]["mean"].as_f64().unwrap();
    assert!((mean - 2.93414).abs() < 1e-5, "{answer}");
    assert!((answer["ln_evidence"].as_f64().unwrap() + 9.57637).abs() < 1e-5, "{answer}");
}

//! Numbers that a reader of a page types, in a browser.
//!
//! In: a program, its exported page. Out: what the page shows, compared with sums by hand. Invariant: as of `serve`.

use crate::serve::{browsed, exported};
use serde_json::{Value, json};

/// Two normal variables; a chain of truth values that is led by virtual evidence.
const TEXT: &str = "program Typed {
    parameters { noise : real = 0.5; gap : real = 1; hit : probability = 0.75; }
    variables { X, Y : real; S, S^-1, L : bool; }
    decomposition { P(X) P(Y | X) P(S^-1) P(S | S^-1) P(L | S) }
    forms {
        P(X) = normal(0, gap + 2);
        P(Y | X) = normal(X, noise);
        P(S^-1) = previous(S) else bernoulli(0.5);
        P(S | S^-1) = bernoulli(if S^-1 { 0.5 } else { 0.5 });
        P(L | S) = bernoulli(if S { hit } else { 0.25 });
    }
    question one { P(X | Y = 1) }
    question both { P(X Y) }
    question led { filter P(S | L virtual [0.2, 0.8]) }
}";

/// Questions of which one derives a variable, and one has no table.
const APART: &str = "program Apart {
    variables { X, X^-1, Z, R : real; A, K : bool; }
    decomposition { P(X^-1) P(X | X^-1) P(Z | X) P(A) P(K | A) P(R | A) }
    forms {
        P(X^-1) = previous(X) else normal(0, 1);
        P(X | X^-1) = normal(X^-1, 1);
        P(Z | X) = normal(X, 1);
        P(A) = bernoulli(0.5);
        P(K | A) = bernoulli(if A { 0.8 } else { 0.2 });
        P(R | A) = normal(if A { 1 } else { -1 }, 1);
    }
    question here { filter P(X | Z) }
    question over { filter P(X > 3 | Z) }
    question soon { predict(1) P(Z | Z) }
    question mixed { P(Z | R, K) }
}";

#[test]
fn each_question_of_a_page_is_posed_alone() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("apart.bp");
    std::fs::write(&file, APART).unwrap();
    let page = std::fs::read_to_string(exported(&file, &[], folder.path())).unwrap();
    let (_, rest) = page.split_once("id=\"data\">").unwrap();
    let data: Value = serde_json::from_str(rest.split_once("</script>").unwrap().0).unwrap();
    let derivation = |place: usize| data["questions"][place]["derivation"].as_str().unwrap();
    // The variables that other questions derive are `X > 3`, and the observation that is predicted.
    assert!(!derivation(0).contains("X &gt; 3") && !derivation(0).contains("P(Z | Z)"), "{}", derivation(0));
    assert!(derivation(0).contains("P(X | X^-1)") && derivation(1).contains("X &gt; 3"), "{}", derivation(1));
    // What it shows is answered, although the page computes no mixtures.
    let fixed = &data["questions"][3]["fixed"][0];
    assert_eq!(fixed["error"], Value::Null, "{fixed}");
    assert_eq!(fixed["text"], "P(Z | R = 0, K)");
}

fn number(cell: &Value) -> f64 {
    cell.as_str().unwrap().split(' ').next().unwrap().parse().unwrap()
}

#[test]
fn a_typed_number_is_used_or_refused_with_its_range() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("typed.bp");
    std::fs::write(&file, TEXT).unwrap();
    let page = exported(&file, &[], folder.path());
    let Some(found) = browsed("typed.cjs", &format!("file://{}", page.display()), &[]) else { return };
    assert_eq!(found["errors"], json!([]));
    // The mean of X is y 9/(9 + ¼).
    let mean = |of: &Value| number(&of["cells"][1]);
    assert!((mean(&found["first"]) - 9.0 / 9.25).abs() < 1e-6, "{found}");
    assert!((mean(&found["far"]) - 450.0 / 9.25).abs() < 1e-4, "{found}");
    let slider = |of: &Value| [0, 1, 2].map(|at| of["slider"][at].as_f64().unwrap());
    assert_eq!(slider(&found["far"]), [0.1, 50.0, 50.0], "the slider reaches the number");
    // A step is a two-hundredth of the range from 0.1 to 3.
    let step = 2.9 / 200.0;
    assert!((found["left"]["box"].as_f64().unwrap() - (50.0 - step)).abs() < 1e-9, "{found}");
    assert!((mean(&found["left"]) - (50.0 - step) * 9.0 / 9.25).abs() < 1e-4, "{found}");
    assert_eq!(
        found["beyond"]["error"],
        "the answer is beyond the range of numbers: a density or a weight overflows"
    );
    assert_eq!(slider(&found["again"]), [0.1, 1.0, 3.0], "the first range");
    assert_eq!(
        found["noise"]["message"],
        "`noise` is -1, but it must be greater than 0; the answer is that of 0.5."
    );
    assert!((mean(&found["noise"]) - 9.0 / 9.25).abs() < 1e-6, "{found}");
    assert_eq!(found["gap"]["error"], "a number of a form is outside its range, with `gap` = -3.00000");
    // The variances 9 and 9¼, the covariance 9.
    assert_eq!(found["both"]["heads"], json!(["mean ± deviation", "covariance with X", "with Y"]));
    assert_eq!(
        found["both"]["cells"],
        json!(["X", "0 ± 3.00000", "9.00000", "9.00000", "Y", "0 ± 3.04138", "9.00000", "9.25000"])
    );
    // Each instant alone: P(S = true) ∝ ¾·0.8 + ¼·0.2 = 0.65, of false ¼·0.8 + ¾·0.2 = 0.35; ln P = 5 ln ½.
    assert_eq!(
        (&found["rows"], &found["over"]["cells"]),
        (&json!(4), &json!(["false", "0.350000", "true", "0.650000"]))
    );
    assert_eq!(
        found["hit"]["message"],
        "`hit` is 1.5, but it must be a probability, between 0 and 1; the answer is that of 0.75."
    );
}

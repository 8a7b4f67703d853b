//! What is carried from instant to instant: only what the question depends on.
//!
//! In: a program with a finite state, and a real that has nothing to do with it. Out: filters and smoothers. Invariant: expected
//! values are the forward and backward recursions, written here.

use bp_core::prelude::*;

#[test]
fn an_irrelevant_real_leaves_the_chain_exact() {
    let program = Program::parse(
        "program Beside {
            variables { S, S^-1 : { a, b }; Z : bool; R, R^-1, G : real; }
            decomposition { P(S^-1) P(S | S^-1) P(Z | S) P(R^-1) P(R | R^-1) P(G | R) }
            forms {
                P(S^-1) = previous(S) else uniform;
                P(S | S^-1) = categorical(if S^-1 == a { 0.9 } else { 0.2 }, if S^-1 == a { 0.1 } else { 0.8 });
                P(Z | S) = bernoulli(if S == a { 0.8 } else { 0.3 });
                P(R^-1) = previous(R) else normal(0, 1); P(R | R^-1) = normal(R^-1, 1); P(G | R) = gamma(1 + R * R, 1);
            }
        }",
    )
    .unwrap();
    let moves = [[0.9, 0.1], [0.2, 0.8]];
    let (mut alpha, mut ln) = ([0.5, 0.5], 0.0);
    let mut seen = Vec::new();
    for z in [true, false, true] {
        let of = |state: usize| {
            let from = alpha[0] * moves[0][state] + alpha[1] * moves[1][state];
            let p = [0.8, 0.3][state];
            from * if z { p } else { 1.0 - p }
        };
        let next = [of(0), of(1)];
        let total = next[0] + next[1];
        (alpha, ln) = ([next[0] / total, next[1] / total], ln + f64::ln(total));
        seen.push(evidence! { Z: z });
    }
    let found = program.question("filter P(S | Z)").unwrap().over(&seen).unwrap();
    assert!(found.estimate().is_none(), "{found}");
    assert!((found.p("a").unwrap() - alpha[0]).abs() < 1e-14, "{found}");
    assert!((found.ln_evidence().unwrap() - ln).abs() < 1e-14, "{found}");
    // What depends on the real is still drawn.
    assert!(program.question("filter P(S, R | Z)").unwrap().over(&seen).unwrap().estimate().is_some());
}

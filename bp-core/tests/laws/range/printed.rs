//! Emitted code, which sums logarithms where `ask` uses separate exponents.
//!
//! In: the kernels of emitted Rust and shaders. Out: answers, compared with logarithms by hand. Invariant: the
//! tolerance of f32 is that of its logarithms.

use super::{near, odds};
use crate::support::{model_of, question};
use bp_core::compiler::exec::scalar::Scalar;
use bp_core::compiler::exec::{Inputs, Lanes};
use bp_core::compiler::lower::lower;
use bp_core::compiler::plan::{Options, Route, plan};

/// The outputs of a question by the kernel of emitted code, in its own precision.
fn printed<T: Scalar>(text: &str, asked: &str, inputs: &Inputs<'_, T>) -> Vec<f64> {
    let model = model_of(text);
    let question = question(&model, asked);
    let plan = plan(&model, &question, Options::default()).unwrap();
    let Route::Exact(exact) = &plan.routes[0] else { panic!("no loops") };
    let kernel = lower(&model, exact, "printed").unwrap().kernel;
    let outputs = Lanes::new(kernel).run(inputs).unwrap();
    outputs.arrays[0].1.iter().map(|cell| cell.to_f64()).collect()
}

#[test]
fn printed_code_has_no_second_run() {
    // Printed Rust and WGSL sum logarithms, in f32 and in f64.
    let text = "program Heard over C in Cells {
        parameters { mu[Cells, Channels] : real; }
        variables { S : bool; L[k in Channels] : real; }
        decomposition { P(S) prod(k in Channels) { P(L[k] | S) } }
        forms {
            P(S) = bernoulli(0.25);
            P(L[k] | S) = if S { normal(mu[C, k], 0.01) } else { uniform(-4, 4) };
        }
    }";
    let channels = 60;
    // At the first cell z = 0, at the second z = 3.5 in each channel, at the third z = 300.
    let (z, heard) = ([0.0, 3.5, 300.0], vec![0.5; channels]);
    let mu: Vec<f64> = (0..channels).flat_map(|_| z.map(|z| 0.5 - 0.01 * z)).collect();
    let ln = |z: f64| channels as f64 * (-0.5 * z * z - (0.01f64).ln() - 0.5 * std::f64::consts::TAU.ln());
    let expected = z.map(|z| odds(ln(z) + 0.25f64.ln(), -(channels as f64) * 8f64.ln() + 0.75f64.ln())[0]);
    let given = Inputs::new().size("Cells", 3).size("Channels", channels).array("mu", &mu).array("l", &heard);
    let found = printed::<f64>(text, "P(S | L = l)", &given);
    for (found, expected) in found[3..].iter().zip(expected) {
        assert!((found - expected).abs() < 1e-9, "{found} {expected}");
    }
    let (mu, heard): (Vec<f32>, Vec<f32>) =
        (mu.iter().map(|x| *x as f32).collect(), heard.iter().map(|x| *x as f32).collect());
    let given = Inputs::new().size("Cells", 3).size("Channels", channels).array("mu", &mu).array("l", &heard);
    let found = printed::<f32>(text, "P(S | L = l)", &given);
    for (found, expected) in found[3..].iter().zip(expected) {
        // ln of each is about 300 in 2⁻²⁴: 1e-4 of the odds.
        assert!((found - expected).abs() < 1e-3, "{found} {expected}");
    }
    // A hidden class between the searched variable and a hundred reals: sums of logarithms throughout.
    let text = "program Hidden {
        variables { C : bool; H : 0..=9; X[1..=100] : real; }
        decomposition { P(C) P(H | C) prod(j) { P(X[j] | H) } }
        forms {
            P(C) = uniform; P(H | C) = weights(if C { 1 } else { H + 1 });
            P(X[j] | H) = normal(H, 1);
        }
    }";
    let readings = [50.0; 100];
    let found = printed::<f64>(text, "P(C | X = x)", &Inputs::new().array("x", &readings));
    // H = 9 is e^(100 · 41.5) times likelier than H = 8: 10 of 55 against 1 of 10.
    near(&found, &[(10.0 / 55.0) / (10.0 / 55.0 + 0.1), 0.1 / (10.0 / 55.0 + 0.1)], 1e-9);
    let short = text.replace("0..=9", "0..=2").replace("H + 1", "2 * H + 1");
    let found = printed::<f64>(&short, "P(C | X = x)", &Inputs::new().array("x", &readings));
    near(&found, &[(5.0 / 9.0) / (5.0 / 9.0 + 1.0 / 3.0), (1.0 / 3.0) / (5.0 / 9.0 + 1.0 / 3.0)], 1e-9);
    // Guarded: four factors of 1e-100, and 10⁵ tosses.
    let text = "program Tiny {
        variables { A, B, C, D, E : bool; } decomposition { P(A) P(B | A) P(C | A) P(D | A) P(E | A) }
        forms {
            P(A) = bernoulli(0.25); P(B | A) = bernoulli(if A { 1e-100 } else { 3e-100 });
            P(C | A) = bernoulli(if A { 4e-100 } else { 1e-100 });
            P(D | A) = bernoulli(if A { 1e-100 } else { 2e-100 });
            P(E | A) = bernoulli(if A { 5e-100 } else { 1e-100 });
        }
    }";
    let found = printed::<f64>(text, "P(A | B = true, C = true, D = true, E = true)", &Inputs::new());
    near(&found, &[9.0 / 19.0, 10.0 / 19.0], 1e-11);
    let none =
        printed::<f64>(&text.replace("1e-100", "0"), "P(A | B = true, D = true, E = true)", &Inputs::new());
    near(&none, &[0.0, 0.0], 0.0);
}

/// P(A = true | V = true) / P(A = false | V = true) = 0.5 / 0.25, whatever the scale of the likelihoods.
#[test]
fn likelihoods_of_any_scale() {
    let text = "program Scale {
        variables { A, V, W, X : bool; }
        decomposition { P(A) P(V | A) P(W | V) P(X | W) }
        forms {
            P(A) = uniform;
            P(V | A) = table { 0.75, 0.25; 0.5, 0.5; };
            P(W | V) = table { 0.5, 0.5; 0.25, 0.75; };
            P(X | W) = table { 0.5, 0.5; 0.125, 0.875; };
        }
    }";
    for scale in ["1e-150", "1e150"] {
        let asked = format!(
            "P(A | V virtual [0, {scale}], W virtual [{scale}, {scale}], X virtual [{scale}, {scale}])"
        );
        near(&printed::<f64>(text, &asked, &Inputs::new()), &[1.0 / 3.0, 2.0 / 3.0], 1e-11);
        near(&printed::<f32>(text, &asked, &Inputs::new()), &[1.0 / 3.0, 2.0 / 3.0], 1e-3);
    }
}

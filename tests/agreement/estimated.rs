//! Estimates, compared with quadrature.
//!
//! In: random programs with a hidden real between finite variables. Out: pass or fail of estimates by weighting and by
//! Gibbs sampling. Invariant: the real is integrated by Simpson's rule; an estimate may be off by six of its standard
//! errors.

use crate::random::Random;
use bp_core::compiler::answer::{Figure, compile_by};
use bp_core::compiler::exec::Inputs;
use bp_core::compiler::plan::Strategy;
use bp_core::compiler::sample::Sampling;
use bp_core::compiler::source::Source;
use bp_core::compiler::syntax;

/// ∫ N(x; m, s) f(x) dx by Simpson's rule over ± 10 s.
fn integral(mean: f64, deviation: f64, f: impl Fn(f64) -> f64) -> f64 {
    const PARTS: usize = 2000;
    let step = 20.0 / PARTS as f64;
    let at = |part: usize| {
        let z = -10.0 + part as f64 * step;
        let weight = if part == 0 || part == PARTS { 1.0 } else { [2.0, 4.0][part % 2] };
        weight * (-0.5 * z * z).exp() * f(mean + deviation * z)
    };
    (0..=PARTS).map(at).sum::<f64>() * step / 3.0 / std::f64::consts::TAU.sqrt()
}

/// X depends on K, and each of some readings on X.
pub(crate) fn asked(random: &mut Random) -> Result<(), String> {
    let count = 2 + random.below(3);
    let prior = [[0.5, 0.5, 0.0, 0.0], [0.25, 0.5, 0.25, 0.0], [0.125, 0.375, 0.25, 0.25]][count - 2];
    let (scale, slope, deviation) = (
        [0.5, 1.0, 2.0][random.below(3)],
        [1.0, -0.5, 2.0][random.below(3)],
        [0.5, 1.0, 2.0][random.below(3)],
    );
    let seen: Vec<bool> = (0..1 + random.below(3)).map(|_| random.one_in(2)).collect();
    let names: Vec<String> = (0..seen.len()).map(|one| format!("B{one}")).collect();
    let each = |with: &dyn Fn(&String) -> String| names.iter().map(with).collect::<Vec<_>>().join(" ");
    let text = format!(
        "program Hidden {{ variables {{ K : 0..={}; X : real; {} : bool; }}
         decomposition {{ P(K) P(X | K) {} }}
         forms {{ P(K) = categorical({}); P(X | K) = normal({scale:?} * K - 1, {deviation:?}); {} }} }}",
        count - 1,
        names.join(", "),
        each(&|name| format!("P({name} | X)")),
        prior[..count].iter().map(|p| format!("{p:?}")).collect::<Vec<_>>().join(", "),
        each(&|name| format!("P({name} | X) = bernoulli(1 / (1 + exp(0 - ({slope:?}) * X)));"))
            .replace("(-", "(0 - "),
    );
    let likelihood = |x: f64| {
        let p = 1.0 / (1.0 + (-slope * x).exp());
        seen.iter().map(|seen| if *seen { p } else { 1.0 - p }).product::<f64>()
    };
    let joint: Vec<f64> =
        (0..count).map(|k| prior[k] * integral(scale * k as f64 - 1.0, deviation, likelihood)).collect();
    let total: f64 = joint.iter().sum();
    let known: Vec<String> = names.iter().zip(&seen).map(|(name, seen)| format!("{name} = {seen}")).collect();
    let words = format!("P(K | {})", known.join(", "));
    let context = |why: String| format!("{text}\n{words}\n{why}");
    let source = Source::new("hidden", text.as_str());
    let model = syntax::compile(&source).map_err(|wrong| context(wrong.render(&source, false)))?;
    let source = Source::new("question", words.as_str());
    let question =
        syntax::parse_question(&source, &model).map_err(|wrong| context(wrong.render(&source, false)))?;
    for method in [Strategy::Weighting, Strategy::Gibbs] {
        let compiled =
            compile_by(&model, &question, Some(method)).map_err(|error| context(error.to_string()))?;
        let sampling = Sampling { particles: 8000, seed: 1 + random.below(1000) as u64 };
        let answers = compiled
            .ask_with(&Inputs::new(), sampling)
            .map_err(|error| context(format!("{method:?}: {error}")))?;
        for (k, row) in answers[0].answer.iter().enumerate() {
            let expected = joint[k] / total;
            let fits = match row.figure {
                Figure::Estimated { p, error } => (p - expected).abs() <= 6.0 * error + 1e-3,
                Figure::Probability { p } => (p - expected).abs() < 1e-9,
                _ => false,
            };
            if !fits {
                return Err(context(format!("{method:?}: K = {k}: {:?}, expected {expected}", row.figure)));
            }
        }
    }
    Ok(())
}

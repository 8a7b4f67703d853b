//! The functions of kernels that WGSL lacks.
//!
//! In: the text of a shader. Out: the functions that it uses, directly or through other functions. Invariant: as close
//! to the interpreter as f32 allows.
//!
//! Φ: the Chebyshev fit of Press et al., *Numerical Recipes*, 2nd ed., section 6.2. ln Γ: Lanczos' series with the
//! coefficients of the same book, section 6.1. ln I₀: Abramowitz and Stegun 9.8.1 and 9.8.2.

use crate::emit::text::words;

const FUNCTIONS: [(&str, &str); 7] = [
    (
        "turned",
        "fn turned(at: i32, extent: i32, wraps: f32) -> i32 {
    return select(at, ((at % extent) + extent) % extent, wraps != 0.0);
}",
    ),
    (
        "power",
        "fn power(x: f32, y: f32) -> f32 {
    let odd = abs(y) - 2.0 * floor(abs(y) / 2.0) == 1.0;
    let size = select(pow(abs(x), y), select(0.0, infinity(), y < 0.0), x == 0.0);
    return select(select(size, -size, x < 0.0 && odd), 1.0, y == 0.0);
}",
    ),
    (
        "normal_cumulative",
        "fn normal_cumulative(x: f32) -> f32 {
    let z = abs(x) * 0.70710678;
    let t = 1.0 / (1.0 + 0.5 * z);
    let tail = 0.5 * t * exp(-z * z - 1.2655122 + t * (1.0000237 + t * (0.37409196 + t * (0.09678418 + t * (-0.18628806
        + t * (0.27886807 + t * (-1.135204 + t * (1.4885159 + t * (-0.82215223 + t * 0.17087277)))))))));
    return select(1.0 - tail, tail, x < 0.0);
}",
    ),
    (
        "entropy_term",
        "fn entropy_term(x: f32) -> f32 {
    return select(-x * log(select(x, 1.0, x <= 0.0)), 0.0, x <= 0.0 || x >= 1.0);
}",
    ),
    (
        "ln_gamma",
        "fn ln_gamma(x: f32) -> f32 {
    if x <= 0.0 { return infinity(); }
    let series = 1.0 + 76.180092 / (x + 1.0) - 86.505320 / (x + 2.0) + 24.014098 / (x + 3.0)
        - 1.2317396 / (x + 4.0) + 0.0012086510 / (x + 5.0) - 0.0000053952394 / (x + 6.0);
    return (x + 0.5) * log(x + 5.5) - (x + 5.5) + log(2.5066283 * series / x);
}",
    ),
    (
        "ln_bessel",
        "fn ln_bessel(signed: f32) -> f32 {
    let x = abs(signed);
    if x < 3.75 {
        let t = (x / 3.75) * (x / 3.75);
        return log(1.0 + t * (3.5156229 + t * (3.0899424 + t * (1.2067492 + t * (0.2659732
            + t * (0.0360768 + t * 0.0045813))))));
    }
    let t = 3.75 / x;
    return x - 0.5 * log(x) + log(0.39894228 + t * (0.01328592 + t * (0.00225319 + t * (-0.00157565 + t * (0.00916281
        + t * (-0.02057706 + t * (0.02635537 + t * (-0.01647633 + t * 0.00392377))))))));
}",
    ),
    // WGSL constants must be finite, so the bits of ∞ are read from the buffer.
    ("infinity", "// shape[0] holds its bits.\nfn infinity() -> f32 {\n    return bitcast<f32>(shape[0]);\n}"),
];

/// The functions that a text uses.
pub(super) fn needed(text: &str) -> String {
    let mut needed = String::new();
    for (name, function) in FUNCTIONS {
        if words(text).any(|word| word == name) || words(&needed).any(|word| word == name) {
            needed.push_str(function);
            needed.push('\n');
        }
    }
    needed
}

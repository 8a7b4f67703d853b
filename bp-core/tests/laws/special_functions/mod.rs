//! Special functions and laws against 50 digits.
//!
//! In: constants of mpmath 1.3 (Python), computed with 50 to 80 digits at the f64 given here, printed to 20. Out: pass
//! if the relative error is within the bound of the test. Invariant: no constant comes from a crate that the code uses.
//!
//! Φ(x) = erfc(−x/√2)/2; ln Γ = loggamma; ln I₀ = log(besseli(0, x)); P and Q = gammainc(a, 0, x) and gammainc(a, x, inf),
//! regularized; Iₓ(a, b) = xᵃ (1−x)ᵇ / (a B(a, b)) Σ Π (a+b+j) x / (a+1+j), which has positive terms only; von Mises by
//! quad over 200 intervals; binomial by sums of its probabilities; masses as differences in the tail where they lie.

use bp_core::compiler::answer::ask;
use bp_core::compiler::exec::Inputs;
use bp_core::compiler::exec::scalar::Scalar;
use bp_core::compiler::law::Law;
use bp_core::compiler::special::{beta, gamma, ln_bessel, ln_gamma, normal_cumulative};

use functions::{BETA, EXP, GAMMA, LN, LN_BESSEL, LN_GAMMA, MASSES, NORMAL};
use laws::LAWS;

mod functions;
mod intervals;
mod laws;
mod tails;

/// The relative errors of several numbers; the largest must be within a bound.
#[derive(Default)]
struct Errors(Vec<(f64, String)>);

impl Errors {
    fn add(&mut self, what: String, found: f64, exact: &str) {
        let exact: f64 = exact.parse().unwrap();
        let error = if found == exact { 0.0 } else { ((found - exact) / exact).abs() };
        // Below 2⁻¹⁰²² an f64 has fewer digits.
        let subnormal = exact.abs() < f64::MIN_POSITIVE && (found - exact).abs() <= 1e-323;
        let error = if subnormal { 0.0 } else { error };
        self.0.push((
            if error.is_nan() { f64::INFINITY } else { error },
            format!("{what}: {found:e}, not {exact:e}"),
        ));
    }

    #[track_caller]
    fn within(self, bound: f64) {
        let beyond: Vec<_> = self.0.into_iter().filter(|(error, _)| *error > bound).collect();
        assert!(beyond.is_empty(), "{beyond:#?}");
    }
}

#[test]
fn functions_of_one_number() {
    for (name, table, function, bound) in [
        ("Φ", NORMAL, normal_cumulative as fn(f64) -> f64, 5e-16),
        ("ln Γ", LN_GAMMA, ln_gamma, 3e-16),
        ("ln I₀", LN_BESSEL, ln_bessel, 5e-16),
        // Lanes and emitted code have their own exponential and logarithm.
        ("Φ in lanes", NORMAL, Scalar::normal_cumulative, 5e-16),
        ("ln Γ in lanes", LN_GAMMA, Scalar::ln_gamma, 3e-16),
        ("ln I₀ in lanes", LN_BESSEL, Scalar::ln_bessel, 5e-16),
        ("exp in lanes", EXP, Scalar::exponential, 3e-16),
        ("ln in lanes", LN, Scalar::natural_logarithm, 3e-16),
    ] {
        let mut errors = Errors::default();
        table.iter().for_each(|(x, exact)| errors.add(format!("{name} {x:e}"), function(*x), exact));
        errors.within(bound);
    }
}

#[test]
fn incomplete_gamma_and_beta_functions() {
    let mut errors = Errors::default();
    for (a, x, lower, upper) in GAMMA {
        let found = gamma(*a, *x);
        errors.add(format!("P({a}, {x})"), found.0, lower);
        errors.add(format!("Q({a}, {x})"), found.1, upper);
    }
    for (a, b, x, lower, upper) in BETA {
        let found = beta(*a, *b, *x, 1.0 - x);
        errors.add(format!("I_{x}({a}, {b})"), found.0, lower);
        errors.add(format!("1 - I_{x}({a}, {b})"), found.1, upper);
    }
    errors.within(2e-13);
}

#[test]
fn densities_and_tails_of_laws() {
    let mut errors = Errors::default();
    for (law, parameters, x, density, lower, upper) in LAWS.iter().chain(tails::LAWS) {
        let name = format!("{}({parameters:?}) at {x:e}", law.name());
        let (below, above) = law.tails(*x, parameters);
        errors.add(format!("{name}, density"), law.density(*x, parameters), density);
        errors.add(format!("{name}, P(X <= x)"), below, lower);
        errors.add(format!("{name}, P(X > x)"), above, upper);
    }
    errors.within(2e-13);
}

#[test]
fn densities_at_large_parameters() {
    let mut errors = Errors::default();
    for (law, parameters, x, density) in intervals::DENSITIES {
        let name = format!("{}({parameters:?}) at {x:e}", law.name());
        errors.add(name, law.density(*x, parameters), density);
    }
    errors.within(2e-13);
}

/// A change of x by its rounding error changes these by √(a + b) of it.
#[test]
fn tails_of_strong_beta_laws() {
    for (parameters, x, lower, upper) in intervals::STRONG {
        let mut errors = Errors::default();
        let (below, above) = Law::Beta.tails(*x, parameters);
        errors.add(format!("P(X <= {x:e}) under beta({parameters:?})"), below, lower);
        errors.add(format!("P(X > {x:e}) under beta({parameters:?})"), above, upper);
        errors.within(2e-13 + (parameters[0] + parameters[1]).sqrt() * f64::EPSILON);
    }
    // By symmetry, whatever the size.
    for a in [1e200, 1e308, f64::MAX] {
        assert_eq!(Law::Beta.tails(0.5, &[a, a]), (0.5, 0.5), "{a}");
        assert_eq!(Law::Beta.tails(0.5f64.next_up(), &[a, a]).1, 0.0, "{a}");
    }
}

#[test]
fn masses_of_intervals_do_not_cancel_in_a_tail() {
    let mut errors = Errors::default();
    for (law, parameters, low, high, mass) in MASSES.iter().chain(tails::MASSES).chain(intervals::MASSES) {
        let name = format!("{}({parameters:?}) in [{low:e}, {high:e}]", law.name());
        errors.add(name, law.between(*low, *high, parameters), mass);
    }
    errors.within(2e-13);
}

#[test]
fn bins_and_truncated_laws_far_in_a_tail() {
    let mut errors = Errors::default();
    let mut asked = |domain: &str, form: &str, text: &str, exact: &[&str]| {
        let model = crate::support::model_of(&format!(
            "program Tail {{ variables {{ X : {domain}; }} decomposition {{ P(X) }} forms {{ P(X) = {form}; }} }}"
        ));
        let answer = ask(&model, &crate::support::question(&model, text), &Inputs::new()).unwrap().remove(0);
        assert_eq!(answer.answer.len(), exact.len());
        for (row, exact) in answer.answer.iter().zip(exact) {
            errors.add(format!("{form} over {domain}"), row.figure.number().unwrap(), exact);
        }
    };
    asked(
        "bins(8, 12, 4)",
        "normal(0, 1)",
        "P(X)",
        &[
            "0.99981858293546797897",
            "0.00018140481585606269699",
            "1.2248368828627437306e-8",
            "3.0712970880726272243e-13",
        ],
    );
    asked(
        "bins(-20, -12, 4)",
        "normal(0, 1)",
        "P(X)",
        &[
            "5.4832800469601432773e-40",
            "3.5962953733691864612e-25",
            "4.3870618038913182229e-12",
            "0.9999999999956129382",
        ],
    );
    asked(
        "bins(0, 10, 10)",
        "gamma(0.01, 1)",
        "P(X)",
        &[
            "0.99778380809893098482",
            "0.0017195701596363846562",
            "0.00036369319622064100226",
            "0.000094362670257284224358",
            "0.000026855172090310801065",
            "8.0618762339226445552e-6",
            "2.5060557022971851259e-6",
            "7.9842558814262201165e-7",
            "2.5907856142137899959e-7",
            "8.5266778610666222995e-8",
        ],
    );
    asked(
        "bins(0, 1, 10)",
        "beta(0.5, 0.5)",
        "P(X)",
        &[
            "0.20483276469913345754",
            "0.090334470601733099647",
            "0.073842884264678837137",
            "0.066895663585479688492",
            "0.064094216848974934854",
            "0.064094216848974935583",
            "0.066895663585479690983",
            "0.073842884264678842753",
            "0.090334470601733114371",
            "0.20483276469913339864",
        ],
    );
    asked(
        "bins(-10, 10, 4)",
        "student_t(3, 0.37, 0.0001)",
        "P(X)",
        &[
            "6.1318304137078530078e-15",
            "2.1761728230288166987e-11",
            "0.99999999997822226506",
            "9.8748822233998586553e-15",
        ],
    );
    asked(
        "bins(-1000, 1000, 4)",
        "student_t(0.5, 0, 1)",
        "P(X)",
        &[
            "0.0042876916458490040535",
            "0.49571230835415099595",
            "0.49571230835415099595",
            "0.0042876916458490040535",
        ],
    );
    asked(
        "bins(1000, 10000, 4)",
        "student_t(3, 0, 1)",
        "P(X)",
        &[
            "0.97184111695793397724",
            "0.023143331707073488237",
            "0.0038660980143645669788",
            "0.0011494533206279675465",
        ],
    );
    asked(
        "bins(1000, 1008, 4)",
        "gamma(2, 1)",
        "P(X)",
        &[
            "0.86468670491377551809",
            "0.11725650469023331277",
            "0.015900595108085696369",
            "0.0021561952879054727629",
        ],
    );
    asked(
        "bins(0, 7, 4)",
        "von_mises(3, 2)",
        "P(X)",
        &[
            "0.066861578755611752667",
            "0.66329218960278029254",
            "0.24837700597302615172",
            "0.021469225668581803066",
        ],
    );
    asked("real", "truncated(normal(0, 1), 1, 1.0000000001)", "P(X = 1)", &["9999999173.0963584688"]);
    asked("real", "truncated(normal(0, 1), 8, 9)", "P(X = 8.5)", &["0.13129350841351980803"]);
    asked("real", "truncated(normal(0, 1), 30, 31)", "P(X = 30.25)", &["0.016099862025689026251"]);
    asked("real", "truncated(exponential(2.5), 100, 101)", "P(X = 100.5)", &["0.78031407164790216596"]);
    errors.within(2e-13);
}

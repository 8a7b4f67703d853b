//! The functions of pages: node computes special functions with the stated accuracy.
//!
//! In: arguments of functions of `web/functions.js`. Out: pass or fail. Invariant: expected values are from mpmath. Without node
//! the test says that it was skipped.

use crate::node;
use serde_json::{Value, json};
use std::path::Path;

pub(crate) fn number(value: &Value) -> f64 {
    match value {
        Value::String(word) => word.replace("Infinity", "inf").parse().unwrap(),
        value => value.as_f64().unwrap_or(f64::NEG_INFINITY),
    }
}

pub(crate) fn is_near(found: f64, expected: f64) -> bool {
    found == expected
        || found.is_nan() && expected.is_nan()
        || (found - expected).abs() <= 1e-12 * expected.abs().max(1e-3)
}

/// The text of a file of the page.
pub(crate) fn web(name: &str) -> String {
    std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("web").join(name)).unwrap()
}

#[test]
fn quantiles_of_normal_laws_have_the_stated_accuracy() {
    if !node::is_there() {
        return println!("skipped: there is no program `node`");
    }
    // Of mpmath 1.3, with 50 digits at the f64 given here.
    let cases = [
        (1e-300, -37.047_096_299_361_2),
        (1e-10, -6.361_340_902_404_056),
        (0.05, -1.644_853_626_951_472_7),
        (0.25, -0.674_489_750_196_081_7),
        (0.5, 0.0),
        (0.975, 1.959_963_984_540_053_9),
    ];
    let reader = r#"
        const standardQuantile = new Function(`${text}; return standardQuantile;`)();
        console.log(JSON.stringify(cases.map(standardQuantile)));
    "#;
    let text = ["functions.js", "answer.js", "laws.js"].map(web).concat();
    let levels: Vec<f64> = cases.iter().map(|(level, _)| *level).collect();
    let found = node::run(reader, &json!({ "text": text, "cases": levels }));
    for ((level, exact), found) in cases.iter().zip(&found) {
        let error = (number(found) - exact).abs() / exact.abs().max(1.0);
        assert!(error <= 4e-15, "at {level}: {found}, not {exact}: {error:e}");
    }
}

#[test]
fn probabilities_of_intervals_have_the_stated_accuracy() {
    if !node::is_there() {
        return println!("skipped: there is no program `node`");
    }
    // By hand where there is a closed form; else of mpmath 1.3, with 50 digits at the f64 given here.
    let cases: [(&str, &[f64], f64); 12] = [
        ("gammaMass", &[-1.0, 2.0, 2.0, 1.0], 1.0 - 3.0 * (-2.0_f64).exp()),
        ("gammaMass", &[1.0, 3.0, 1.0, 0.5], (-0.5_f64).exp() - (-1.5_f64).exp()),
        ("gammaMass", &[30.0, 40.0, 2.5, 1.0], 1.215_373_059_467_155_6e-11),
        ("betaMass", &[0.0, 0.5, 2.0, 3.0], 11.0 / 16.0),
        ("betaMass", &[0.9, 2.0, 2.5, 0.5], 0.510_410_255_435_572_4),
        ("studentMass", &[-1.0, 1.0, 1.0, 0.0, 1.0], 0.5),
        ("studentMass", &[5.0, 1e300, 2.0, 1.0, 2.0], 0.5 - 1.0 / 6.0_f64.sqrt()),
        ("studentMass", &[10.0, 12.0, 3.5, 0.0, 1.0], 0.000_248_470_851_378_268),
        ("misesMass", &[0.5, 1.0, 0.7, 3.0], 0.316_451_540_113_645_6),
        ("misesMass", &[2.0, 3.0, 0.0, 20.0], 5.033_748_306_256_47e-14),
        ("misesMass", &[0.0, 4.0 * std::f64::consts::PI, 1.0, 3.0], 2.0),
        ("gammaMass", &[3.0, 2.0, 1.0, 1.0], 0.0),
    ];
    let reader = r#"
        const functions = new Function(`${text}; return { gammaMass, betaMass, studentMass, misesMass };`)();
        console.log(JSON.stringify(cases.map(([name, operands]) => functions[name](...operands))));
    "#;
    let text = ["functions.js", "masses.js"].map(web).concat();
    let asked: Vec<Value> = cases.iter().map(|(name, operands, _)| json!([name, operands])).collect();
    let found = node::run(reader, &json!({ "text": text, "cases": asked }));
    for ((name, operands, exact), found) in cases.iter().zip(&found) {
        let error = (number(found) - exact).abs() / exact.max(f64::MIN_POSITIVE);
        assert!(error <= 5e-15, "{name}({operands:?}) is {found}, not {exact}: {error:e}");
    }
}

#[test]
fn special_functions_have_the_stated_accuracy() {
    if !node::is_there() {
        return println!("skipped: there is no program `node`");
    }
    // Of mpmath 1.3, with 50 digits at the f64 given here; more of them are in `tests/laws/special_functions`.
    let cases: [(&str, f64, f64, f64); 18] = [
        ("normalCumulative", -38.0, 2.885_428_35e-316, 2e-8),
        ("normalCumulative", -20.0, 2.753_624_118_606_233_7e-89, 2e-15),
        ("normalCumulative", -5.0, 2.866_515_718_791_939e-7, 2e-15),
        ("normalCumulative", -1.401_398_031_134_661_4, 0.080_547_540_358_298_7, 2e-15),
        ("normalCumulative", -0.5, 0.308_537_538_725_986_9, 2e-15),
        ("normalCumulative", 1.5, 0.933_192_798_731_141_9, 2e-15),
        ("normalCumulative", 8.0, 0.999_999_999_999_999_4, 2e-15),
        ("lnGamma", 1e-8, 18.420_680_738_180_21, 5e-16),
        ("lnGamma", 0.5, 0.572_364_942_924_700_1, 5e-16),
        ("lnGamma", 1.000_001, -5.772_148_423_874_147e-7, 5e-16),
        ("lnGamma", 1.461_632_144_968_362_2, -0.121_486_290_535_849_61, 5e-16),
        ("lnGamma", 1.999_999, -4.227_840_125_965_854e-7, 5e-16),
        ("lnGamma", 5.5, 3.957_813_967_618_716_5, 5e-16),
        ("lnGamma", 12_345.6, 103_959.185_066_168_46, 5e-16),
        ("lnBessel", 1e-6, 2.499_999_999_999_843_4e-13, 5e-16),
        ("lnBessel", 3.0, 1.585_307_621_813_421, 5e-16),
        ("lnBessel", 30.0, 27.384_701_433_171_937, 5e-16),
        ("lnBessel", 10_000.0, 9_994.475_903_781_433, 5e-16),
    ];
    let reader = r#"
        const names = "{ normalCumulative, lnGamma, lnBessel }";
        const functions = new Function(`${text}; return ${names};`)();
        console.log(JSON.stringify(cases.map(([name, x]) => functions[name](x))));
    "#;
    let text = web("functions.js");
    let asked: Vec<Value> = cases.iter().map(|(name, x, ..)| json!([name, x])).collect();
    let found = node::run(reader, &json!({ "text": text, "cases": asked }));
    for ((name, x, exact, bound), found) in cases.iter().zip(&found) {
        let error = ((number(found) - exact) / exact).abs();
        assert!(error <= *bound, "{name}({x}) is {found}, not {exact}: {error:e}");
    }
}

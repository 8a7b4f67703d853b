//! Posteriors of models with real data, against those of another engine.
//!
//! In: programs in `tests/posteriors`, and the data and posteriors of posteriordb (Magnusson et al.) in a folder that may be
//! absent. Out: the mean of every parameter, within four combined standard errors; the deviation within a tenth. The references are
//! summaries of 10 000 thinned draws of ten long chains.

use bp_core::prelude::*;
use std::path::Path;

const FOLDER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../shared/data/posteriors");
const PROGRAMS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/posteriors");

/// The data of a posterior.
struct Data(serde_json::Value);

impl Data {
    fn number(&self, name: &str) -> f64 {
        self.0[name].as_f64().unwrap_or_else(|| panic!("{name}"))
    }

    fn column(&self, name: &str) -> Vec<f64> {
        let numbers = self.0[name].as_array().unwrap_or_else(|| panic!("{name}"));
        numbers.iter().map(|number| number.as_f64().unwrap()).collect()
    }

    /// Columns of the same names.
    fn rows(&self, names: &[&str]) -> Rows {
        names.iter().fold(Rows::new(), |rows, name| rows.column(name, self.column(name)))
    }
}

/// Asks a program the question `posterior`, and compares each parameter of the reference, which `slot` names in the program.
#[track_caller]
fn agrees(
    file: &str,
    reference: &str,
    draws: usize,
    slot: impl Fn(&str) -> String,
    given: impl Fn(Program, &Data) -> Program,
) {
    let path = format!("{FOLDER}/{reference}.json");
    if !Path::new(&path).is_file() {
        println!("skipped: no file {path}");
        return;
    }
    let reference: serde_json::Value = serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap();
    let program = Program::open(format!("{PROGRAMS}/{file}.bp")).unwrap_or_else(|error| panic!("{error}"));
    let program = given(program, &Data(reference["data"].clone())).draws(draws);
    let posterior = program.ask("posterior").unwrap_or_else(|error| panic!("{error}"));
    println!("{file}: {:?}", posterior.estimate());
    assert_eq!(posterior.warning(), None);
    for (name, expected) in reference["reference"].as_object().unwrap() {
        let own = posterior.of(&slot(name)).unwrap_or_else(|error| panic!("{name}: {error}"));
        let [mean, error] = own.mean_and_error().unwrap();
        let of = |what: &str| expected[what].as_f64().unwrap();
        let combined = (of("sd").powi(2) / of("draws") + error * error).sqrt();
        let distance = (mean - of("mean")) / combined;
        assert!(distance.abs() < 4.0, "{file}: {name} is {mean} ± {error}, expected {}", of("mean"));
        let deviation = own.deviation().unwrap() / of("sd");
        assert!(
            (deviation - 1.0).abs() < 0.1,
            "{file}: the deviation of {name} is {deviation} of the expected one"
        );
    }
}

/// `beta[1]` is `Beta[1]`.
fn capital(name: &str) -> String {
    name[..1].to_uppercase() + &name[1..]
}

/// `mu[1]` is the first component of `Mu`.
fn component(name: &str) -> String {
    match name.strip_prefix("mu[") {
        Some(rest) => format!("Mu[{}]", rest.trim_end_matches(']').parse::<usize>().unwrap() - 1),
        None => capital(name),
    }
}

#[test]
fn test_scores_of_children() {
    let rows = |program: Program, data: &Data| {
        program.rows(data.rows(&["mom_iq"]).column("Score", data.column("kid_score"))).unwrap()
    };
    agrees("kidscore_momiq", "kidiq-kidscore_momiq", 4000, capital, rows);
    let rows = |program: Program, data: &Data| {
        program.rows(data.rows(&["mom_hs", "mom_iq"]).column("Score", data.column("kid_score"))).unwrap()
    };
    agrees("kidscore_momhsiq", "kidiq-kidscore_momhsiq", 4000, capital, rows);
}

#[test]
fn earnings_and_bushes() {
    let logarithms = |numbers: Vec<f64>| numbers.into_iter().map(f64::ln).collect::<Vec<f64>>();
    let rows = |program: Program, data: &Data| {
        program.rows(data.rows(&["height"]).column("LogEarn", logarithms(data.column("earn")))).unwrap()
    };
    agrees("logearn_height", "earnings-logearn_height", 4000, capital, rows);
    let rows = |program: Program, data: &Data| {
        let rows = data.rows(&["diam1", "diam2", "canopy_height"]);
        program.rows(rows.column("LogWeight", logarithms(data.column("weight")))).unwrap()
    };
    agrees("logmesquite_logvolume", "mesquite-logmesquite_logvolume", 4000, capital, rows);
}

#[test]
fn summers_and_five_covariates() {
    let given = |mut program: Program, data: &Data| {
        for name in ["pmualpha", "psalpha", "pmubeta", "psbeta"] {
            program = program.with(name, data.number(name)).unwrap();
        }
        program.rows(data.rows(&["x"]).column("Y", data.column("y"))).unwrap()
    };
    agrees("kilpisjarvi", "kilpisjarvi_mod-kilpisjarvi", 4000, capital, given);
    let given = |program: Program, data: &Data| {
        let cell = |row: &serde_json::Value, at: usize| row[at].as_f64().unwrap();
        let column = |at: usize| {
            data.0["X"].as_array().unwrap().iter().map(move |row| cell(row, at)).collect::<Vec<_>>()
        };
        let rows = (0..5).fold(Rows::new(), |rows, at| rows.column(&format!("x{}", at + 1), column(at)));
        program.rows(rows.column("Y", data.column("y"))).unwrap()
    };
    agrees("blr", "sblrc-blr", 4000, capital, given);
}

#[test]
fn an_autoregression() {
    let given = |program: Program, data: &Data| {
        let y = data.column("y");
        let lag = |lag: usize| y[5 - lag..y.len() - lag].to_vec();
        let rows = (1..=5).fold(Rows::new(), |rows, at| rows.column(&format!("y{at}"), lag(at)));
        program.rows(rows.column("Y", lag(0))).unwrap()
    };
    agrees("ark", "arK-arK", 4000, capital, given);
}

#[test]
fn eight_schools() {
    let given = |program: Program, data: &Data| {
        program.rows(data.rows(&["sigma"]).column("Y", data.column("y"))).unwrap()
    };
    let slot = |name: &str| match name.strip_prefix("theta[") {
        Some(rest) => format!("Theta[{}]", rest.trim_end_matches(']').parse::<usize>().unwrap() - 1),
        None => capital(name),
    };
    agrees("eight_schools", "eight_schools-eight_schools_noncentered", 4000, slot, given);
}

#[test]
fn a_mixture_of_two_normal_distributions() {
    let given =
        |program: Program, data: &Data| program.rows(Rows::new().column("Y", data.column("y"))).unwrap();
    agrees("low_dim_gauss_mix", "low_dim_gauss_mix-low_dim_gauss_mix", 1000, component, given);
}

/// Y alone, under the length of its range.
fn sequence(program: Program, data: &Data) -> Program {
    program.rows(Rows::new().column("Y", data.column("y"))).unwrap()
}

#[test]
fn moving_averages() {
    agrees("arma", "arma-arma11", 2000, capital, sequence);
}

#[test]
fn a_variance_that_moves() {
    let slot = |name: &str| match name {
        "alpha1" => "Share[0]".to_owned(),
        "beta1" => "Share[1]".to_owned(),
        other => capital(other),
    };
    let given = |program: Program, data: &Data| {
        sequence(program.with("sigma1", data.number("sigma1")).unwrap(), data)
    };
    agrees("garch", "garch-garch11", 5000, slot, given);
}

#[test]
fn a_hidden_markov_chain() {
    let slot = |name: &str| match name.split_once('[') {
        Some(("mu", rest)) => format!("Mu{}", rest.trim_end_matches(']')),
        Some((of, rest)) => {
            let place: usize = rest.trim_end_matches(']').parse().unwrap();
            format!("{}[{}]", capital(of), place - 1)
        }
        None => capital(name),
    };
    agrees("hmm", "hmm_example-hmm_example", 2000, slot, sequence);
}

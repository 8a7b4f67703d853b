//! The classic networks: all posteriors.
//!
//! In: the networks and the answers of another engine, in a folder that may be absent. Out: every posterior, ln
//! P(evidence) and the most probable assignment, to 1e-10.

use bp_core::compiler::io::bif;
use bp_core::compiler::source::Source;
use bp_core::compiler::strategies::join_tree::{Marginals, Named, NetworkEvidence, most_probable};
use std::path::Path;

const FOLDER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../shared/data/networks");

const NETWORKS: [&str; 16] = [
    "asia",
    "cancer",
    "earthquake",
    "sachs",
    "survey",
    "alarm",
    "child",
    "insurance",
    "water",
    "barley",
    "hailfinder",
    "hepar2",
    "win95pts",
    "andes",
    "link",
    "munin2",
];

/// Posteriors, ln P(evidence) and ln P of the most probable assignment of another engine, in full precision.
#[test]
fn the_classic_networks_are_answered_as_by_another_engine() {
    let folder = format!("{FOLDER}/reference");
    if !Path::new(&folder).is_dir() {
        println!("skipped: no folder {folder}");
        return;
    }
    let mut compared = 0;
    for name in NETWORKS {
        let source = Source::new(name, std::fs::read_to_string(format!("{FOLDER}/{name}.bif")).unwrap());
        let (model, _) =
            bif::read(&source).unwrap_or_else(|wrong| panic!("{}", wrong.render(&source, false)));
        let named = Named::new(model, &[]).unwrap();
        let text = std::fs::read_to_string(format!("{folder}/{name}.json")).unwrap();
        let reference: serde_json::Value = serde_json::from_str(&text).unwrap();
        for case in reference["cases"].as_array().unwrap() {
            let what = format!("{name} {}", case["id"]);
            let mut evidence = NetworkEvidence::default();
            for (variable, value) in case["hard_evidence"].as_object().unwrap() {
                let value = value["index"].as_u64().unwrap() as usize;
                evidence.hard.push((named.number_of(variable).unwrap(), value));
            }
            for (variable, weights) in case["likelihood"].as_object().unwrap() {
                evidence.likelihoods.push((named.number_of(variable).unwrap(), numbers(weights)));
            }
            let given: Vec<usize> = evidence.hard.iter().map(|(variable, _)| *variable).collect();
            let weighed: Vec<usize> = evidence.likelihoods.iter().map(|(variable, _)| *variable).collect();
            let marginals = Marginals::new(&named.network, &given, &weighed, &named.shown()).unwrap();
            let mut session = marginals.session();
            session.ask(&evidence).unwrap();
            let expected = case["log_p_evidence"].as_f64().unwrap();
            let found = session.ln_evidence();
            assert!((found - expected).abs() < 1e-10, "{what}: ln P {found}, expected {expected}");
            for (variable, posterior) in case["posteriors"].as_object().unwrap() {
                let found = session.posterior(named.number_of(variable).unwrap(), &evidence);
                for (p, q) in found.iter().zip(numbers(posterior)) {
                    assert!((p - q).abs() < 1e-10, "{what}: {variable} {found:?}, expected {posterior}");
                    compared += 1;
                }
            }
            if let Some(expected) = case["mpe"]["log_joint"].as_f64() {
                let (_, found) = most_probable(&named.network, &evidence).unwrap();
                assert!((found - expected).abs() < 1e-9, "{what}: MPE {found}, expected {expected}");
            }
        }
    }
    assert!(compared > 10_000, "only {compared} numbers compared");
}

fn numbers(list: &serde_json::Value) -> Vec<f64> {
    list.as_array().unwrap().iter().map(|number| number.as_f64().unwrap()).collect()
}

//! Join trees with cells of very different magnitudes.
//!
//! In: networks of tiny numbers. Out: marginals, ln P and most probable values, compared with logarithms by hand.
//! Invariant: observed variables are sliced or weighted.

use super::{near, odds};
use bp_core::compiler::strategies::join_tree::{
    FactorTable, Marginals, Network, NetworkEvidence, most_probable,
};
use rand::rngs::Xoshiro256PlusPlus;
use rand::{RngExt, SeedableRng};

#[test]
fn join_trees_of_tiny_cells() {
    // 2n binary features of a class: n with odds 10⁻ᵏ to 1 for `true`, n with the reverse; one more has odds 3 to 1.
    let mut random = Xoshiro256PlusPlus::seed_from_u64(7);
    for (pairs, digits) in [(2usize, 200.0), (2, 300.0), (150, 3.0), (400, 30.0)] {
        let features: Vec<[f64; 2]> = (0..2 * pairs)
            .map(|at| if at < pairs { [10f64.powf(-digits), 1.0] } else { [1.0, 10f64.powf(-digits)] })
            .chain([[0.25, 0.75]])
            .collect();
        let scale: Vec<f64> = features.iter().map(|_| random.random::<f64>()).collect();
        let table = |(at, [no, yes]): (usize, &[f64; 2])| FactorTable {
            variables: vec![0, at + 1],
            values: [no, yes].into_iter().flat_map(|p| [1.0 - p * scale[at], p * scale[at]]).collect(),
        };
        let mut network = Network {
            cardinalities: vec![2; features.len() + 1],
            tables: vec![FactorTable { variables: vec![0], values: vec![0.5, 0.5] }],
            table_of: (0..=features.len()).map(Some).collect(),
            ..Network::default()
        };
        network.tables.extend(features.iter().enumerate().map(table));
        let all: Vec<usize> = (1..=features.len()).collect();
        let observed =
            NetworkEvidence { hard: all.iter().map(|one| (*one, 1)).collect(), likelihoods: Vec::new() };
        // ln of both sums, by logarithms.
        let ln = |class: usize| -> f64 {
            features.iter().zip(&scale).map(|(p, scale)| p[class].ln() + scale.ln()).sum()
        };
        let expected = odds(ln(0), ln(1));
        let ln_evidence = ln(0).max(ln(1)) + (1.0 + (-(ln(0) - ln(1)).abs()).exp()).ln() - 2f64.ln();
        for (given, weighed) in [(all.as_slice(), [].as_slice()), (&[], &all)] {
            let plan = Marginals::new(&network, given, weighed, &[0]).unwrap();
            let mut session = plan.session();
            session.ask(&observed).unwrap();
            near(session.marginal(0), &expected, 1e-9);
            near(&[session.ln_evidence()], &[ln_evidence], 1e-12);
        }
        let (values, ln_best) = most_probable(&network, &observed).unwrap();
        assert_eq!(values[0], 1);
        near(&[ln_best], &[ln(1) - 2f64.ln()], 1e-12);
    }
}

#[test]
fn likelihoods_of_trees_are_of_any_size() {
    let network = Network {
        cardinalities: vec![2, 2],
        tables: vec![
            FactorTable { variables: vec![0], values: vec![0.6, 0.4] },
            FactorTable { variables: vec![0, 1], values: vec![0.8, 0.2, 0.1, 0.9] },
        ],
        table_of: vec![Some(0), Some(1)],
        ..Network::default()
    };
    let likelihoods = vec![
        (0, vec![1e-300, 1.0]),
        (0, vec![1e-300, 1e-320]),
        (1, vec![2e-300, 1e-300]),
        (1, vec![1e-200, 1e-200]),
        (0, vec![1.0, 1e-280]),
    ];
    let plan = Marginals::new(&network, &[], &[0, 1], &[0, 1]).unwrap();
    let mut session = plan.session();
    session.ask(&NetworkEvidence { hard: Vec::new(), likelihoods }).unwrap();
    // 0: 0.6 · 10⁻⁶⁰⁰ (0.8 · 2 + 0.2), 1: 0.4 · 10⁻⁶⁰⁰ (0.1 · 2 + 0.9), and 10⁻⁵⁰⁰ for both; 10⁻³²⁰ has four digits.
    near(session.marginal(0), &[1.08 / 1.52, 0.44 / 1.52], 1e-3);
    near(&[session.ln_evidence()], &[1.52f64.ln() - 1100.0 * std::f64::consts::LN_10], 1e-6);
}

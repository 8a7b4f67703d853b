//! Join trees, compared with enumeration, on small random networks.
//!
//! In: seeded networks with evidence of every kind. Out: marginals, ln P(evidence), most probable assignments. Invariant:
//! expected values are sums and maxima over all assignments, written here.

use bp_core::compiler::error::Error;
use bp_core::compiler::strategies::join_tree::{
    FactorTable, Marginals, Network, NetworkEvidence, Tree, joint, most_probable, observations,
};
use rand::rngs::Xoshiro256PlusPlus;
use rand::{Rng, RngExt, SeedableRng};

/// A network of up to nine variables with up to four values and three parents; some entries are 0.
fn network(random: &mut impl Rng) -> Network {
    let count = random.random_range(1..=9usize);
    let cardinalities: Vec<usize> = (0..count).map(|_| random.random_range(1..=4)).collect();
    let mut network = Network { cardinalities, ..Network::default() };
    for variable in 0..count {
        let parents = (0..variable).filter(|_| random.random_bool(0.4)).take(3);
        let variables: Vec<usize> = parents.chain([variable]).collect();
        let width = network.cardinalities[variable];
        let rows: usize =
            variables[..variables.len() - 1].iter().map(|one| network.cardinalities[*one]).product();
        let mut values = Vec::new();
        for _ in 0..rows {
            let row: Vec<f64> = (0..width)
                .map(|_| if random.random_bool(0.15) { 0.0 } else { random.random::<f64>() })
                .collect();
            let total: f64 = row.iter().sum();
            values
                .extend(row.iter().map(|entry| if total > 0.0 { entry / total } else { 1.0 / width as f64 }));
        }
        network.table_of.push(Some(variable));
        network.tables.push(FactorTable { variables, values });
    }
    network
}

fn evidence(network: &Network, random: &mut impl Rng) -> NetworkEvidence {
    let mut evidence = NetworkEvidence::default();
    for (variable, count) in network.cardinalities.iter().enumerate() {
        match random.random_range(0..6) {
            0 => evidence.hard.push((variable, random.random_range(0..*count))),
            1 => evidence
                .likelihoods
                .push((variable, (0..*count).map(|_| random.random::<f64>() * 3.0).collect())),
            _ => {}
        }
    }
    evidence
}

/// Every assignment with the product of all tables and of the evidence.
fn enumerate(network: &Network, evidence: &NetworkEvidence) -> Vec<(Vec<usize>, f64)> {
    let mut all = vec![Vec::new()];
    for count in &network.cardinalities {
        all = all
            .iter()
            .flat_map(|values: &Vec<usize>| {
                (0..*count).map(move |value| [values.as_slice(), &[value]].concat())
            })
            .collect();
    }
    let weigh = |values: &Vec<usize>| {
        let entry = |table: &FactorTable| {
            let place = table
                .variables
                .iter()
                .fold(0, |place, one| place * network.cardinalities[*one] + values[*one]);
            table.values[place]
        };
        let tables: f64 = network.tables.iter().map(entry).product();
        let agrees = evidence.hard.iter().all(|(one, value)| values[*one] == *value);
        let weights: f64 = evidence.likelihoods.iter().map(|(one, weights)| weights[values[*one]]).product();
        if agrees { tables * weights } else { 0.0 }
    };
    all.into_iter()
        .map(|values| {
            let p = weigh(&values);
            (values, p)
        })
        .collect()
}

fn near(found: f64, expected: f64, what: &str) {
    assert!(
        (found - expected).abs() <= 1e-12 * expected.abs().max(1.0),
        "{what}: {found}, expected {expected}"
    );
}

#[test]
fn marginals_and_the_most_probable_are_those_of_enumeration() {
    let (mut possible, mut impossible) = (0, 0);
    for seed in 0..400 {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
        let network = network(&mut random);
        let evidence = evidence(&network, &mut random);
        let all = enumerate(&network, &evidence);
        let total: f64 = all.iter().map(|(_, p)| p).sum();
        let given: Vec<usize> = evidence.hard.iter().map(|(one, _)| *one).collect();
        let weighed: Vec<usize> = evidence.likelihoods.iter().map(|(one, _)| *one).collect();
        let every: Vec<usize> = (0..network.cardinalities.len()).collect();
        // With sliced variables, with likelihoods of 0 and 1, and by groups of ancestors.
        let marginals = Marginals::new(&network, &given, &weighed, &every).unwrap();
        for given in [given.as_slice(), &[]] {
            let tree = Tree::new(&network, given, &every, &every).unwrap();
            let mut session = tree.session();
            let found = session.ask(&evidence);
            if total == 0.0 {
                assert!(matches!(found, Err(Error::Contradiction { .. })), "seed {seed}: {found:?}");
                assert!(matches!(marginals.session().ask(&evidence), Err(Error::Contradiction { .. })));
                assert!(matches!(most_probable(&network, &evidence), Err(Error::Contradiction { .. })));
                impossible += 1;
                continue;
            }
            found.unwrap();
            possible += 1;
            near(session.ln_evidence(), total.ln(), &format!("seed {seed}, ln P"));
            let mut grouped = marginals.session();
            grouped.ask(&evidence).unwrap();
            near(grouped.ln_evidence(), total.ln(), &format!("seed {seed}, ln P by groups"));
            for (variable, count) in network.cardinalities.iter().enumerate() {
                for value in 0..*count {
                    let p: f64 = all
                        .iter()
                        .filter(|(values, _)| values[variable] == value)
                        .map(|(_, p)| p / total)
                        .sum();
                    if !given.contains(&variable) {
                        near(
                            session.marginal(variable)[value],
                            p,
                            &format!("seed {seed}, {variable} = {value}"),
                        );
                    }
                    if let Some(found) = grouped.marginal(variable).get(value) {
                        near(*found, p, &format!("seed {seed}, {variable} = {value} by groups"));
                    }
                }
            }
            let best = all.iter().map(|(_, p)| *p).fold(0.0, f64::max);
            let (values, ln_joint) = most_probable(&network, &evidence).unwrap();
            near(ln_joint, best.ln(), &format!("seed {seed}, the most probable"));
            let own = all.iter().find(|(other, _)| *other == values).map(|(_, p)| p.ln());
            near(own.unwrap(), best.ln(), &format!("seed {seed}, the assignment"));
        }
    }
    assert!(possible > 400 && impossible > 20, "{possible} {impossible}");
}

#[test]
fn asking_again_forgets_earlier_evidence() {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(5);
    let network = network(&mut random);
    let every: Vec<usize> = (0..network.cardinalities.len()).collect();
    let tree = Tree::new(&network, &[], &every, &every).unwrap();
    let (mut kept, mut fresh) = (tree.session(), tree.session());
    kept.ask(&NetworkEvidence::default()).unwrap();
    for variable in 0..network.cardinalities.len() {
        // An impossible question leaves no trace in the session.
        let _ = kept.ask(&NetworkEvidence {
            hard: vec![(variable, network.cardinalities[variable] - 1)],
            ..NetworkEvidence::default()
        });
    }
    kept.ask(&NetworkEvidence::default()).unwrap();
    fresh.ask(&NetworkEvidence::default()).unwrap();
    (0..network.cardinalities.len()).for_each(|one| assert_eq!(kept.marginal(one), fresh.marginal(one)));
}

/// A chain of 2 000 variables whose evidence has a probability far below the smallest number.
#[test]
fn improbable_evidence_does_not_underflow() {
    let count = 2000;
    let mut network = Network { cardinalities: vec![2; 2 * count], ..Network::default() };
    for variable in 0..2 * count {
        let (variables, values) = match variable {
            0 => (vec![0], vec![0.5, 0.5]),
            hidden if hidden < count => (vec![hidden - 1, hidden], vec![0.9, 0.1, 0.1, 0.9]),
            seen => (vec![seen - count, seen], vec![1.0 - 1e-3, 1e-3, 1.0 - 2e-3, 2e-3]),
        };
        network.table_of.push(Some(variable));
        network.tables.push(FactorTable { variables, values });
    }
    let hard: Vec<(usize, usize)> = (count..2 * count).map(|seen| (seen, 1)).collect();
    // By hand: the forward recursion, divided by its sum at each step.
    let (mut forward, mut ln) = ([0.5, 0.5], 0.0);
    for step in 0..count {
        let moved = match step {
            0 => forward,
            _ => [0.9 * forward[0] + 0.1 * forward[1], 0.1 * forward[0] + 0.9 * forward[1]],
        };
        let seen = [moved[0] * 1e-3, moved[1] * 2e-3];
        let total: f64 = seen[0] + seen[1];
        ln += total.ln();
        forward = [seen[0] / total, seen[1] / total];
    }
    let given: Vec<usize> = hard.iter().map(|(one, _)| *one).collect();
    let evidence = NetworkEvidence { hard, ..NetworkEvidence::default() };
    let all: Vec<usize> = (0..2 * count).collect();
    for given in [given.as_slice(), &[]] {
        let tree = Tree::new(&network, given, &all, &all).unwrap();
        let mut session = tree.session();
        session.ask(&evidence).unwrap();
        assert!(ln < -12_000.0);
        near(session.ln_evidence(), ln, "ln P");
        near(session.marginal(count - 1)[1], forward[1], "the last");
    }
}

#[test]
fn threads_change_nothing() {
    // Large enough that subtrees are computed in parallel.
    let mut random = Xoshiro256PlusPlus::seed_from_u64(1);
    let count = 40;
    let mut network = Network { cardinalities: vec![4; count], ..Network::default() };
    for variable in 0..count {
        let parents: Vec<usize> =
            (variable.saturating_sub(6)..variable).filter(|_| random.random_bool(0.7)).collect();
        let variables = [parents.as_slice(), &[variable]].concat();
        let rows = 4usize.pow(parents.len() as u32);
        let row = |random: &mut Xoshiro256PlusPlus| {
            let row: [f64; 4] = std::array::from_fn(|_| random.random());
            row.map(|entry| entry / row.iter().sum::<f64>())
        };
        let values = (0..rows).flat_map(|_| row(&mut random)).collect();
        network.table_of.push(Some(variable));
        network.tables.push(FactorTable { variables, values });
    }
    let every: Vec<usize> = (0..count).collect();
    let tree = Tree::new(&network, &[], &[20], &every).unwrap();
    assert!(tree.cost().cells > 1e5, "{:?}", tree.cost());
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let mut session = tree.session();
            session.ask(&NetworkEvidence { hard: vec![(20, 1)], ..NetworkEvidence::default() }).unwrap();
            let all: Vec<f64> = (0..count).flat_map(|one| session.marginal(one).to_vec()).collect();
            (session.ln_evidence(), all)
        })
    };
    let one = run(1);
    assert_eq!(one, run(2));
    assert_eq!(one, run(8));
}

#[test]
fn joint_posteriors_and_informations_are_those_of_enumeration() {
    let mut compared = 0;
    for seed in 0..120 {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(1000 + seed);
        let network = network(&mut random);
        let evidence = evidence(&network, &mut random);
        let all = enumerate(&network, &evidence);
        let total: f64 = all.iter().map(|(_, p)| p).sum();
        let free: Vec<usize> = (0..network.cardinalities.len())
            .filter(|one| !evidence.hard.iter().any(|(known, _)| known == one))
            .collect();
        if total == 0.0 || free.len() < 3 {
            continue;
        }
        let (targets, extents) = (&free[..2], [free[0], free[1]].map(|one| network.cardinalities[one]));
        // P(a, b, x | e) by summation.
        let count = |with: &dyn Fn(&[usize]) -> bool| {
            all.iter().filter(|(values, _)| with(values)).map(|(_, p)| p / total).sum::<f64>()
        };
        let found = joint(&network, &evidence, targets).unwrap();
        near(found.ln_evidence, total.ln(), "ln P");
        for (row, p) in found.probabilities.iter().enumerate() {
            let expected = count(&|values| {
                values[targets[0]] == row / extents[1] && values[targets[1]] == row % extents[1]
            });
            near(*p, expected, &format!("seed {seed}, row {row}"));
        }
        for observed in observations(&network, &evidence, targets, &free).unwrap().1 {
            let x = observed.variable;
            let mut information = 0.0;
            for row in 0..extents[0] * extents[1] {
                let target = |values: &[usize]| {
                    values[targets[0]] == row / extents[1] && values[targets[1]] == row % extents[1]
                };
                for value in 0..network.cardinalities[x] {
                    let both = count(&|values| target(values) && values[x] == value);
                    if both > 0.0 {
                        let apart = count(&|values| target(values)) * count(&|values| values[x] == value);
                        information += both * (both / apart).log2();
                    }
                }
            }
            near(observed.information, information, &format!("seed {seed}, information of {x}"));
            compared += 1;
        }
    }
    assert!(compared > 150, "{compared}");
}

#[test]
fn unforeseen_evidence_is_refused() {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(5);
    let network = network(&mut random);
    let plan = Marginals::new(&network, &[], &[], &[0]).unwrap();
    let evidence = NetworkEvidence { hard: vec![(0, 0)], ..NetworkEvidence::default() };
    let error = plan.session().ask(&evidence).unwrap_err().to_string();
    assert!(error.contains("neither an observed nor a weighted variable"), "{error}");
    assert!(joint(&network, &evidence, &[0]).is_err() && joint(&network, &evidence, &[]).is_err());
}

/// A plan keeps its buffers.
#[test]
fn asking_again_allocates_nothing() {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(9);
    let network = network(&mut random);
    let every: Vec<usize> = (0..network.cardinalities.len()).collect();
    let plan = Marginals::new(&network, &[0], &every, &every).unwrap();
    let mut session = plan.session();
    let cases: Vec<NetworkEvidence> = (0..network.cardinalities[0])
        .map(|value| NetworkEvidence { hard: vec![(0, value)], likelihoods: Vec::new() })
        .collect();
    // The counter itself is tested.
    assert!(allocation_counter::measure(|| drop(std::hint::black_box(vec![1u8; 100]))).count_total == 1);
    let mut sum = 0.0;
    let counted = allocation_counter::measure(|| {
        for case in cases.iter().cycle().take(1000) {
            session.ask(case).unwrap();
            sum += session.marginal(network.cardinalities.len() - 1)[0] + session.ln_evidence();
        }
    });
    assert_eq!(counted.count_total, 0, "allocations in 1000 asks");
    assert!(sum.is_finite());
}

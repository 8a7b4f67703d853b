//! The densities of forms, and spaces and ties.
//!
//! In: one-factor programs. Out: their densities. Invariant: expected values are those of `statrs`, of libm's erfc, or
//! computed by hand.

use crate::support::{model_of, question};
use bp_core::compiler::answer::{argmax, ask};
use bp_core::compiler::distribution::Setting;
use bp_core::compiler::exec::Inputs;
use bp_core::compiler::space::{Edge, Space};
use bp_core::compiler::strategies::join_tree::Network;
use statrs::distribution::{Continuous, Normal, Uniform};

/// A program of one variable.
fn density(domain: &str, form: &str, text: &str, inputs: &Inputs<'_, f64>) -> Vec<f64> {
    let model = model_of(&format!(
        "program One {{ parameters {{ a : real = 0; b : real = 1; p : probability = 0.25; }} variables {{ E : bool; X : {domain}; }}
         decomposition {{ P(E) P(X | E) }} forms {{ P(E) = bernoulli(0.5); P(X | E) = {form}; }} }}"
    ));
    let answers =
        ask(&model, &question(&model, text), inputs).unwrap_or_else(|error| panic!("{form}: {error}"));
    answers[0].answer.iter().map(|row| row.figure.number().unwrap()).collect()
}

#[track_caller]
fn near(found: &[f64], expected: &[f64]) {
    assert_eq!(found.len(), expected.len(), "{found:?}");
    for (p, q) in found.iter().zip(expected) {
        assert!((p - q).abs() <= 1e-12 * q.abs().max(1.0), "{found:?}, expected {expected:?}");
    }
}

#[test]
fn densities_of_reals() {
    for (mean, deviation) in [(0.0, 1.0), (-3.5, 0.2), (100.0, 40.0)] {
        let law = Normal::new(mean, deviation).unwrap();
        for x in [mean, mean - 0.7 * deviation, mean + 5.0 * deviation] {
            let inputs = Inputs::new().number("a", mean).number("b", deviation).number("x", x);
            near(&density("real", "normal(a, b)", "P(X = x)", &inputs), &[law.pdf(x)]);
        }
    }
    let law = Uniform::new(-2.0, 3.0).unwrap();
    for x in [-2.5, -2.0, 0.0, 3.0, 3.5] {
        near(&density("real", "uniform(-2, 3)", "P(X = x)", &Inputs::new().number("x", x)), &[law.pdf(x)]);
    }
}

#[test]
fn a_normal_law_over_integers_is_renormalised() {
    for (mean, deviation) in [(0.0, 1.0), (2.3, 0.4), (-9.0, 3.0)] {
        let law = Normal::new(mean, deviation).unwrap();
        let total: f64 = (-3..=4).map(|x| law.pdf(f64::from(x))).sum();
        let expected: Vec<f64> = (-3..=4).map(|x| law.pdf(f64::from(x)) / total).collect();
        let inputs = Inputs::new().number("a", mean).number("b", deviation);
        near(&density("-3..=4", "normal(a, b)", "P(X)", &inputs), &expected);
    }
    // So far away that every density underflows: the nearest value has probability 1.
    let far = Inputs::new().number("a", 1000.0).number("b", 0.1);
    near(&density("1..=3", "normal(a, b)", "P(X)", &far), &[0.0, 0.0, 1.0]);
    let below = Inputs::new().number("a", -1000.0).number("b", 0.1);
    near(&density("1..=3", "normal(a, b)", "P(X)", &below), &[1.0, 0.0, 0.0]);
}

#[test]
fn bins_of_a_normal_law_share_all_of_it() {
    for (mean, deviation) in [(0.5, 0.6), (2.5, 0.3), (4.5, 2.0), (-3.0, 1.0), (5.4, 1.0)] {
        let below = |x: f64| 0.5 * libm::erfc((mean - x) / (deviation * std::f64::consts::SQRT_2));
        let mut expected = vec![1.0 - below(5.0), below(1.0)];
        expected.extend((2..=5).map(|j| below(f64::from(j)) - below(f64::from(j - 1))));
        let inputs = Inputs::new().number("a", mean).number("b", deviation);
        let found = density("{ Nothing } or 1..=5", "normal_bins(a, b)", "P(X)", &inputs);
        near(&found, &expected);
        near(&[found.iter().sum()], &[1.0]);
    }
    // A mean beyond the far side of the last bin means "nothing".
    let beyond = Inputs::new().number("a", 5.5).number("b", 3.0);
    let found = density("{ Nothing } or 1..=5", "normal_bins(a, b)", "P(X)", &beyond);
    near(&found, &[1.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
}

#[test]
fn bins_far_above_the_mean_keep_their_digits() {
    // Φ(−(j − 3)) − Φ(−(j − 2)) for j = 8, 12, 30, by mpmath in 50 digits.
    let expected =
        [(8, 2.856_649_842_341_562e-7), (12, 1.128_512_207_423_599e-19), (30, 7.389_481_006_876_894e-161)];
    let inputs = Inputs::new().number("a", 2.0).number("b", 1.0);
    let found = density("{ Nothing } or 1..=40", "normal_bins(a, b)", "P(X)", &inputs);
    let model = model_of(
        "program One { variables { X : { Nothing } or 1..=40; } decomposition { P(X) } forms { P(X) = normal_bins(2, 1); } }",
    );
    let nothing = Inputs::new();
    let network = Network::of(&Setting::new(&model, &nothing).unwrap()).unwrap();
    for numbers in [&found, &network.tables[0].values] {
        for (bin, p) in expected {
            assert!((numbers[bin] - p).abs() < 1e-13 * p, "{bin}: {}", numbers[bin]);
        }
    }
}

#[test]
fn weights_of_any_size_are_shared() {
    // Relative to each other: ⅙, ⅓ and ½, whether their sum overflows or each is below the least normal number.
    for unit in ["1.7e308", "4e-320"] {
        let text = format!(
            "program One {{ variables {{ X : 1..=3; Y : bool; }} decomposition {{ P(X) P(Y | X) }}
             forms {{ P(X) = weights(X / 3 * {unit}); P(Y | X) = bernoulli(0.5); }} }}"
        );
        let model = model_of(&text);
        let nothing = Inputs::new();
        let network = Network::of(&Setting::new(&model, &nothing).unwrap()).unwrap();
        let asked = ask(&model, &question(&model, "P(X | Y = true)"), &nothing).unwrap();
        let asked: Vec<f64> = asked[0].answer.iter().map(|row| row.p().unwrap()).collect();
        for numbers in [&asked, &network.tables[0].values] {
            for (p, q) in numbers.iter().zip([1.0 / 6.0, 1.0 / 3.0, 0.5]) {
                assert!((p - q).abs() < 1e-3, "{unit}: {numbers:?}");
            }
        }
    }
}

#[test]
fn probabilities_of_finite_values() {
    let nothing = Inputs::new();
    near(&density("bool", "bernoulli(p)", "P(X)", &nothing), &[0.75, 0.25]);
    near(&density("bool", "bernoulli(if E { p } else { 1 })", "P(X | E)", &nothing), &[0.0, 1.0, 0.75, 0.25]);
    near(&density("1..=3", "categorical(p, 0.5, 0.25)", "P(X)", &nothing), &[0.25, 0.5, 0.25]);
    near(&density("{ a1, a2, a3, a4 }", "uniform", "P(X)", &nothing), &[0.25; 4]);
    near(&density("0..=2", "dirac(if E { 2 } else { 0 })", "P(X)", &nothing), &[0.5, 0.0, 0.5]);
}

#[test]
fn values_and_parameters_outside_their_domains_are_errors() {
    let model = model_of(
        "program Two { parameters { p : probability; } variables { A : 1..=3; B : bool; } decomposition { P(A) P(B | A) }
         forms { P(A) = uniform; P(B | A) = bernoulli(p); } question q { P(B | A = a) } }",
    );
    let asked = |p: f64, a: f64| {
        ask(&model, model.question("q").unwrap(), &Inputs::new().number("p", p).number("a", a))
            .map_err(|e| e.to_string())
    };
    assert!(asked(0.25, 2.0).is_ok());
    for (p, a, name) in
        [(1.5, 2.0, "`p`"), (f64::NAN, 1.0, "`p`"), (0.5, 4.0, "`a`"), (0.5, 0.0, "`a`"), (0.5, 1.5, "`a`")]
    {
        let error = asked(p, a).unwrap_err();
        assert!(error.contains(name), "{error}");
    }
}

#[test]
fn ties_are_broken_by_the_nearest_and_then_by_the_first() {
    assert_eq!(argmax(&[0.1, 0.5, 0.5, 0.2], None), [1, 2]);
    assert_eq!(argmax(&[0.1, 0.5, 0.5, 0.2], Some(&[0.0, 3.0, 2.0, 1.0])), [2]);
    assert_eq!(argmax(&[0.5, 0.5, 0.5], Some(&[1.0, 0.5, 0.5])), [1]);
    assert_eq!(argmax(&[0.3, 0.3 * (1.0 - 1e-12), 0.3 * (1.0 - 1e-6)], None), [0, 1]);
    assert_eq!(argmax(&[0.0, 0.0], None), [0usize; 0]);
    assert_eq!(argmax::<f64>(&[], Some(&[])), [0usize; 0]);
    // In f32 the numbers next to each other tie, and those 1e-4 away do not.
    assert_eq!(argmax(&[0.3f32, 0.3 - 3e-8, 0.29997], None), [0, 1]);
    assert_eq!(argmax(&[f64::NAN, 0.25, 0.5], None), [2]);
}

#[test]
fn antecedents_are_where_the_content_was() {
    let extents = [3usize, 4, 6];
    let displacements: Vec<[i32; 3]> =
        (-1..=1).flat_map(|d| (-2..=2).flat_map(move |r| (-3..=3).map(move |l| [d, r, l]))).collect();
    for (pole, circle) in [(false, false), (false, true), (true, true)] {
        let edges = [
            Edge::Open,
            if pole { Edge::Pole } else { Edge::Open },
            if circle { Edge::Circle } else { Edge::Open },
        ];
        let space = Space::new(extents, edges).unwrap();
        assert_eq!((space.cells(), space.wraps()), (72, circle));
        let moves = space.antecedents(&displacements);
        assert_eq!(moves.displacements, displacements.len());
        for (v, [depth, row, lane]) in displacements.iter().enumerate() {
            for (d, r) in (0..3).flat_map(|d| (0..4).map(move |r| (d, r))) {
                let position = (v * 3 + d as usize) * 4 + r as usize;
                let found = (moves.depth[position], moves.row[position]);
                let (from_d, from_r) = (d - depth, r - row);
                let crossed = pole && !(0..4).contains(&from_r);
                let from_r = if crossed && from_r < 0 {
                    -1 - from_r
                } else if crossed {
                    7 - from_r
                } else {
                    from_r
                };
                let inside = (0..3).contains(&from_d) && (0..4).contains(&from_r);
                assert_eq!(found, if inside { (from_d, from_r) } else { (-1, -1) }, "{d} {r} by {v}");
                if inside {
                    let turn = -lane + if crossed { 3 } else { 0 };
                    assert_eq!(moves.turn[position], turn, "{d} {r} by {v}");
                }
            }
        }
    }
}

#[test]
fn going_there_and_back_leads_home() {
    let space = Space::new([1, 4, 6], [Edge::Open, Edge::Pole, Edge::Circle]).unwrap();
    let there = space.antecedents(&[[0, 2, 1]]);
    // Over a pole, rows are reversed and lanes are not: the way back has the same sign along the rows.
    for (row, lane) in (0..4).flat_map(|row| (0..6).map(move |lane| (row, lane))) {
        let (from, turn) = (there.row[row as usize], there.turn[row as usize]);
        let crossed = row - 2 < 0;
        let back = space.antecedents(&[[0, if crossed { 2 } else { -2 }, -1]]);
        let (home, again) = (back.row[from as usize], back.turn[from as usize]);
        assert_eq!((home, (lane + turn + again).rem_euclid(6)), (row, lane));
    }
}

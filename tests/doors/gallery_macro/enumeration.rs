//! The macro's programs, compared with enumeration.
//!
//! In: programs of the gallery, whose factors are repeated here as functions of values. Out: pass or fail. Invariant:
//! the expected numbers are sums of products over all combinations of values, and share no code with the library.

use super::programs::*;

/// A joint distribution: the number of values of each variable, and the product of its factors at their positions.
struct Joint<'j> {
    counts: &'j [usize],
    p: &'j dyn Fn(&[usize]) -> f64,
}

impl Joint<'_> {
    /// P(searched | each, fixed), by the values of `each` and then of `searched`, the last one fastest; zeros where the
    /// condition is impossible.
    fn table(&self, searched: &[usize], each: &[usize], fixed: &[(usize, usize)]) -> Vec<f64> {
        let cells = |of: &[usize]| of.iter().map(|variable| self.counts[*variable]).product::<usize>();
        let width = cells(searched);
        let mut table = vec![0.0; cells(each) * width];
        let mut at = vec![0; self.counts.len()];
        fixed.iter().for_each(|(variable, value)| at[*variable] = *value);
        let open: Vec<usize> =
            (0..at.len()).filter(|variable| fixed.iter().all(|(known, _)| known != variable)).collect();
        loop {
            let place = each.iter().chain(searched).fold(0, |place, v| place * self.counts[*v] + at[*v]);
            table[place] += (self.p)(&at);
            let Some(turned) = open.iter().rev().find(|v| at[**v] + 1 < self.counts[**v]) else { break };
            at[*turned] += 1;
            open.iter().rev().take_while(|v| *v != turned).for_each(|v| at[*v] = 0);
        }
        for row in table.chunks_mut(width) {
            let total: f64 = row.iter().sum();
            row.iter_mut().for_each(|p| *p = if total > 0.0 { *p / total } else { 0.0 });
        }
        table
    }
}

fn near(what: &str, found: &[f64], expected: &[f64]) {
    assert_eq!(found.len(), expected.len(), "{what}");
    for (cell, (p, q)) in found.iter().zip(expected).enumerate() {
        assert!((p - q).abs() <= 1e-12, "{what}[{cell}]: {p}, not {q}");
    }
}

/// A question's answer.
macro_rules! answered {
    ($program:ident, $question:ident $(, $field:ident = $value:expr)*) => {{
        $program::$question()$(.$field($value))*.ask().unwrap()
    }};
}

/// The probability of a boolean at a position.
fn coin(p: f64, value: usize) -> f64 {
    if value == 1 { p } else { 1.0 - p }
}

/// 1 where the condition holds, else 0.
fn sure(holds: bool) -> f64 {
    f64::from(u8::from(holds))
}

/// A normal density at one of the integers from `low` to `high`, as a share of that at all of them.
fn bell(x: i64, mean: f64, deviation: f64, low: i64, high: i64) -> f64 {
    let density = |x: i64| (-(x as f64 - mean).powi(2) / (2.0 * deviation * deviation)).exp();
    density(x) / (low..=high).map(density).sum::<f64>()
}

#[test]
fn networks() {
    // Asia, Smoking, Tuberculosis, Cancer, Bronchitis, Either, XRay, Dyspnoea.
    let p = |v: &[usize]| {
        let dyspnoea = [[0.1, 0.8], [0.7, 0.9]][v[5]][v[4]];
        coin(0.01, v[0])
            * coin(0.5, v[1])
            * coin([0.01, 0.05][v[0]], v[2])
            * coin([0.01, 0.1][v[1]], v[3])
            * coin([0.3, 0.6][v[1]], v[4])
            * sure(v[5] == v[2].max(v[3]))
            * coin([0.05, 0.98][v[5]], v[6])
            * coin(dyspnoea, v[7])
    };
    let joint = Joint { counts: &[2; 8], p: &p };
    let before = answered!(asia, before);
    let found = [
        before.distribution_tuberculosis(),
        before.distribution_cancer(),
        before.distribution_bronchitis(),
        before.distribution_either(),
        before.distribution_xray(),
    ];
    for (found, variable) in found.into_iter().chain([before.distribution_dyspnoea()]).zip(2..) {
        near("asia", found, &joint.table(&[variable], &[], &[]));
    }
    let after = answered!(asia, after);
    near("asia, after", after.distribution_tuberculosis(), &joint.table(&[2], &[], &[(0, 1), (7, 1)]));
    near("asia, after", after.distribution_cancer(), &joint.table(&[3], &[], &[(0, 1), (7, 1)]));

    // Location, Rain, Sprinkler, GrassWet, Roof.
    let p = |v: &[usize]| {
        coin(0.5, v[0])
            * coin([0.3, 0.1][v[0]], v[1])
            * coin([0.9, 0.1][v[1]], v[2])
            * sure(v[3] == v[1].max(v[2]))
            * sure(v[4] == v[1])
    };
    let joint = Joint { counts: &[2; 5], p: &p };
    near("sprinkler", answered!(sprinkler, rain).distribution(), &joint.table(&[1], &[0], &[(3, 1)]));
    near("sprinkler", answered!(sprinkler, wet).distribution(), &joint.table(&[3], &[0], &[]));
    near(
        "sprinkler",
        answered!(sprinkler, where_).distribution(),
        &joint.table(&[0], &[], &[(3, 1), (4, 0)]),
    );

    // Four layers of four; each depends on its own column and the next one of the layer above.
    let p = |v: &[usize]| {
        let layer = |layer: usize, column: usize| match layer {
            0 => coin(0.1, v[column]),
            layer => {
                let above = 4 * (layer - 1);
                let any = v[above + column] + v[above + (column + 1) % 4] > 0;
                coin(if any { 0.9 } else { 0.1 }, v[4 * layer + column])
            }
        };
        (0..16).map(|node| layer(node / 4, node % 4)).product()
    };
    let joint = Joint { counts: &[2; 16], p: &p };
    for number in 0..16usize {
        let bits = [0, 1, 2, 3].map(|bit| number >> bit & 1);
        let [a1, a2, a3, a4] = bits.map(|bit| bit == 1);
        let known =
            |first: usize| bits.iter().enumerate().map(|(at, bit)| (first + at, *bit)).collect::<Vec<_>>();
        let effect = answered!(layered_network, effect, a1 = a1, a2 = a2, a3 = a3, a4 = a4);
        near("layers", effect.distribution(), &joint.table(&[12], &[], &known(0)));
        let cause = answered!(layered_network, cause, d1 = a1, d2 = a2, d3 = a3, d4 = a4);
        near("layers", cause.distribution(), &joint.table(&[0], &[], &known(12)));
    }
}

#[test]
fn words_and_dice() {
    let p = |v: &[usize]| coin(0.4, v[0]) * coin([0.1, 0.95][v[0]], v[1]);
    let joint = Joint { counts: &[2, 2], p: &p };
    near("umbrella", answered!(rain_umbrella, rain).distribution(), &joint.table(&[0], &[], &[(1, 1)])[1..]);

    // (n + 1) / (N + 2) of messages with the word, among 250 others and 750 of spam.
    let words = [[0.0, 375.0], [125.0, 0.0], [250.0, 0.0], [0.0, 750.0], [125.0, 375.0]];
    let p = |v: &[usize]| {
        let word = |word: usize| coin((words[word][v[0]] + 1.0) / ([252.0, 752.0][v[0]]), v[word + 1]);
        coin(0.75, v[0]) * (0..5).map(word).product::<f64>()
    };
    let joint = Joint { counts: &[2; 6], p: &p };
    near("spam", answered!(spam, spam).distribution(), &joint.table(&[0], &[1, 2, 3, 4, 5], &[]));
    let known = [(1, 0), (2, 0), (3, 0), (4, 1), (5, 0)];
    near("spam", answered!(spam, money).distribution(), &joint.table(&[0], &[], &known)[1..]);

    // O1, O2, O3 from 1, S2 from 2, S3 from 3; S1 is O1.
    let p = |v: &[usize]| sure(v[3] == v[0] + v[1]) * sure(v[4] == v[3] + v[2]) / 216.0;
    let joint = Joint { counts: &[6, 6, 6, 11, 16], p: &p };
    near("dice", answered!(sum_of_dice, sum).distribution(), &joint.table(&[4], &[], &[(0, 3)]));
    near("dice", answered!(sum_of_dice, last).distribution(), &joint.table(&[2], &[], &[(4, 11)]));

    // Prior, A from 1, B from 1, Coherent.
    let flat = 1.0 / 255.0;
    let bells: Vec<f64> = (1..=255).map(|b| bell(b, 32.0, 30.0, 1, 255)).collect();
    let p = |v: &[usize]| {
        let log = (usize::BITS - 1 - (v[2] + 1).leading_zeros()) as usize;
        let b = if v[0] == 0 { flat } else { bells[v[2]] };
        0.5 * b / 7.0 * sure((v[3] == 1) == (v[1] + 1 == log))
    };
    let joint = Joint { counts: &[2, 7, 255, 2], p: &p };
    near("code", answered!(log_coding, code).distribution(), &joint.table(&[1], &[], &[(3, 1), (0, 0)]));
    near(
        "code",
        answered!(log_coding, code_of_bell).distribution(),
        &joint.table(&[1], &[], &[(3, 1), (0, 1)]),
    );
    near(
        "code",
        answered!(log_coding, number).distribution(),
        &joint.table(&[2], &[], &[(1, 1), (3, 1), (0, 0)]),
    );
}

#[test]
fn robots() {
    let p = |v: &[usize]| {
        let (mean, deviation) = [(6.0, 4.0), (20.0, 6.0)][v[0]];
        [0.4, 0.6][v[0]] * bell(v[1] as i64, mean, deviation, 0, 30)
    };
    let joint = Joint { counts: &[2, 31], p: &p };
    near("category", answered!(categorisation, category).distribution(), &joint.table(&[0], &[1], &[]));
    near("category", answered!(categorisation, distance).distribution(), &joint.table(&[1], &[], &[(0, 0)]));

    let (means, deviations) =
        ([-10.0, -8.0, -5.0, -1.0, 1.0, 5.0, 8.0, 10.0], [1.0, 1.5, 2.0, 2.0, 2.0, 2.0, 1.5, 1.0]);
    let p = |v: &[usize]| bell(v[1] as i64 - 10, means[v[0]], deviations[v[0]], -10, 10) / 8.0;
    let joint = Joint { counts: &[8, 21], p: &p };
    near("light", answered!(phototaxy, turn).distribution(), &joint.table(&[1], &[0], &[]));
    near("light", answered!(phototaxy, seen).distribution(), &joint.table(&[0], &[], &[(1, 15)]));

    // H, Dir, Prox, Theta, Vrot: uniform factors are omitted from the product.
    let (alpha, beta) = (7.0, 0.5);
    let mut bells = vec![vec![0.0; 21]; 2 * 21 * 21];
    for (place, bells) in bells.iter_mut().enumerate() {
        let (h, first, second) = (place / 441, (place / 21 % 21) as f64, (place % 21) as f64);
        // Avoid: by Dir and Prox, of 0..=15; phototaxy: by Theta.
        let (mean, deviation) = if h == 0 { (10.0 - first, 18.0 - second) } else { (first - 10.0, 2.0) };
        for (vrot, p) in bells.iter_mut().enumerate() {
            *p = if deviation > 0.0 { bell(vrot as i64 - 10, mean, deviation, -10, 10) } else { 0.0 };
        }
    }
    let p = |v: &[usize]| {
        let avoid = 1.0 / (1.0 + (beta * (alpha - v[2] as f64)).exp());
        match v[0] {
            0 => avoid * bells[v[1] * 21 + v[2]][v[4]],
            _ => (1.0 - avoid) * bells[441 + v[3] * 21][v[4]],
        }
    };
    let joint = Joint { counts: &[2, 21, 16, 21, 21], p: &p };
    let choice = answered!(homing, choice, alpha = alpha, beta = beta);
    near("homing", choice.distribution(), &joint.table(&[0], &[2], &[]));
    let turn = answered!(homing, turn, alpha = alpha, beta = beta);
    near("homing", turn.distribution(), &joint.table(&[4], &[1, 2, 3], &[]));
    let behaviour = answered!(homing, behaviour, alpha = alpha, beta = beta);
    near("homing", behaviour.distribution(), &joint.table(&[0], &[], &[(4, 4), (1, 16), (2, 12), (3, 18)]));

    // H, with both objects at 270°.
    let p = |v: &[usize]| {
        let repels = |b: f64| 1.0 - (-(b - v[0] as f64).powi(2) / (2.0 * 70.0 * 70.0)).exp();
        let all: f64 = (0..360).map(|b| repels(f64::from(b))).sum();
        repels(270.0) / all * bell(270, v[0] as f64, 40.0, 0, 359)
    };
    let belief = Joint { counts: &[360], p: &p }.table(&[0], &[], &[]);
    near("heading", answered!(inverse_programming, belief).distribution(), &belief);
    let heading = answered!(inverse_programming, heading);
    let best = (0..360).fold(0, |best, h| if belief[h] > belief[best] { h } else { best });
    assert_eq!(heading.argmax(), Some(best as i64));
    near("heading", &[heading.max()], &[belief[best]]);
}

#[test]
fn a_water_unit() {
    // The uniform variables, and those computed from them: S, and O where it is within 0..=10.
    let mut weights = vec![0.0; 11usize.pow(5)];
    let mut filters = [0.0; 11];
    let at =
        |i0: i64, i1: i64, s: i64, c: i64, o: i64| ((((i0 * 11 + i1) * 11 + s) * 11 + c) * 11 + o) as usize;
    for place in 0..11i64.pow(5) {
        let [i0, i1, f, c, h] = [0, 1, 2, 3, 4].map(|digit| place / 11i64.pow(digit) % 11);
        let (alpha, optimum) = ((i0 + i1 + f + c - h).div_euclid(3), (i0 + i1 + 10).div_euclid(3));
        let o = if alpha <= optimum { alpha.max(0) } else { 2 * optimum - alpha };
        let s = (i0 + f).div_euclid(2);
        if (0..=10).contains(&o) {
            weights[at(i0, i1, s, c, o)] += 1.0;
            if [i0, i1, s, c, o] == [5, 5, 5, 5, 3] {
                filters[f as usize] += 1.0;
            }
        }
    }
    let shares = |weights: &mut [f64]| {
        let total: f64 = weights.iter().sum();
        weights.iter_mut().for_each(|p| *p = if total > 0.0 { *p / total } else { 0.0 });
    };
    let controls: Vec<f64> = (0..11).map(|c| weights[at(2, 8, 5, c, 6)]).collect();
    weights.chunks_mut(11).for_each(shares);
    shares(&mut filters);
    let output = water_unit::output().ask().unwrap();
    near("water", output.distribution(), &weights);
    let impossible = weights.chunks(11).filter(|row| row.iter().all(|p| *p == 0.0)).count();
    assert_eq!(output.report().impossible, impossible);
    near("filter", answered!(water_unit, filter).distribution(), &filters);
    let best = (0..11).fold(0, |best, c| if controls[c] > controls[best] { c } else { best });
    let control = answered!(water_unit, control);
    assert_eq!(control.argmax(), Some(best as i64));
    near("control", &[control.max()], &[controls[best] / controls.iter().sum::<f64>()]);
}

//! Series of finite states: each instant given all observations, and the most likely states together.
//!
//! In: start, transition and sensor as tables. Out: posteriors and the largest probability of a history, by enumeration.

use super::near;
use bp_macros::bayesian_program;

bayesian_program! {
    program Walk {
        parameters { s : real = 0.7; stay : probability = 0.6; }
        variables { X, X^-1 : 1..=3; Up, Up^-1, Z : bool; Y : real; }
        decomposition { P(initial(X)) P(X | X^-1 Up) P(Up^-1) P(Up | Up^-1) P(Y | X) P(Z | Up X) }
        forms {
            P(initial(X)) = categorical(0.5, 0, 0.5);
            P(Up^-1) = bernoulli(1);
            P(Up | Up^-1) = bernoulli(if Up^-1 { stay } else { 1 - stay });
            P(X | X^-1 Up) = if Up {
                table { 1, true: 0.2, 0.8, 0; 2, true: 0, 0.2, 0.8; 3, true: 0, 0, 1; 1, false: 1, 0, 0; 2, false: 1, 0, 0; 3, false: 1, 0, 0; }
            } else {
                table { 1, true: 1, 0, 0; 2, true: 1, 0, 0; 3, true: 1, 0, 0; 1, false: 1, 0, 0; 2, false: 0.7, 0.3, 0; 3, false: 0, 0.7, 0.3; }
            };
            P(Y | X) = normal(X, s);
            P(Z | Up X) = bernoulli(if Up and X > 1 { 0.9 } else { 0.2 });
        }
        question each { smooth P(X, Up | Y Z) }
        question up { smooth P(Up | Y Z) }
        question best { sequence P(X Up | Y Z) }
    }
}

bayesian_program! {
    program Rows over line in Lines {
        variables { X, X^-1 : 0..=2; Z : bool; }
        decomposition { P(X^-1) P(X | X^-1) P(Z | X) }
        forms {
            P(X^-1) = categorical(0.5, 0.5, 0);
            P(X | X^-1) = table { 0: 0.75, 0.25, 0; 1: 0, 0.75, 0.25; 2: 0.25, 0, 0.75; };
            P(Z | X) = table { 0: 0.75, 0.25; 1: 0.5, 0.5; 2: 0, 1; };
        }
        question each { smooth P(X | Z) }
        question best { sequence P(X | Z) }
    }
}

/// All histories: for each instant the posterior of the state, ln P(observations), and the largest weight of a history.
struct Histories<'h> {
    instants: usize,
    states: usize,
    start: &'h dyn Fn(usize) -> f64,
    step: &'h dyn Fn(usize, usize) -> f64,
    seen: &'h dyn Fn(usize, usize) -> f64,
}

impl Histories<'_> {
    fn weight(&self, history: &[usize]) -> f64 {
        let moves: f64 = history.windows(2).map(|pair| (self.step)(pair[0], pair[1])).product();
        let seen: f64 = history.iter().enumerate().map(|(instant, x)| (self.seen)(instant, *x)).product();
        (self.start)(history[0]) * moves * seen
    }

    fn posteriors(&self) -> (Vec<Vec<f64>>, f64, f64) {
        let mut all = vec![vec![0.0; self.states]; self.instants];
        let (mut total, mut most) = (0.0, 0.0f64);
        for number in 0..self.states.pow(self.instants as u32) {
            let history: Vec<usize> = (0..self.instants)
                .map(|instant| number / self.states.pow(instant as u32) % self.states)
                .collect();
            let weight = self.weight(&history);
            history.iter().zip(&mut all).for_each(|(x, own)| own[*x] += weight);
            total += weight;
            most = most.max(weight);
        }
        all.iter_mut().flatten().for_each(|weight| *weight /= total);
        (all, total.ln(), most)
    }
}

const Y: [Option<f64>; 6] = [Some(1.2), Some(2.4), None, Some(2.9), Some(0.8), None];
const Z: [Option<bool>; 6] = [None, Some(true), Some(true), Some(false), None, Some(true)];

#[test]
fn a_walk_is_smoothed_and_its_most_likely_states_are_found() {
    let (s, stay) = (0.9, 0.7);
    // States: x − 1 and up, up fastest.
    let ups = [[stay, 1.0 - stay], [1.0 - stay, stay]];
    let rows = |up: usize| match up {
        1 => [[0.2, 0.8, 0.0], [0.0, 0.2, 0.8], [0.0, 0.0, 1.0]],
        _ => [[1.0, 0.0, 0.0], [0.7, 0.3, 0.0], [0.0, 0.7, 0.3]],
    };
    let step = |before: usize, now: usize| ups[before % 2][now % 2] * rows(now % 2)[before / 2][now / 2];
    // Before the first instant it goes up.
    let start = |now: usize| [0.5, 0.0, 0.5][now / 2] * ups[1][now % 2];
    let seen = |instant: usize, now: usize| {
        let y = Y[instant].map_or(1.0, |y| {
            let z = (y - (now / 2) as f64 - 1.0) / s;
            (-0.5 * z * z).exp() / (s * std::f64::consts::TAU.sqrt())
        });
        let p = if now % 2 == 1 && now / 2 > 0 { 0.9 } else { 0.2 };
        y * Z[instant].map_or(1.0, |z| if z { p } else { 1.0 - p })
    };
    let histories = Histories { instants: 6, states: 6, start: &start, step: &step, seen: &seen };
    let (expected, ln, most) = histories.posteriors();
    let (mut instants, mut ups_alone, mut for_best, mut narrow) =
        (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for instant in 0..6 {
        let (mut one, mut two, mut three) =
            (walk::each().s(s).stay(stay), walk::up().s(s).stay(stay), walk::best().s(s).stay(stay));
        let mut four = walk::each::Question::<f32>::new().s(s).stay(stay);
        if let Some(y) = Y[instant] {
            (one, two, three, four) = (one.y(y), two.y(y), three.y(y), four.y(y));
        }
        if let Some(z) = Z[instant] {
            (one, two, three, four) = (one.z(z), two.z(z), three.z(z), four.z(z));
        }
        instants.push(one);
        ups_alone.push(two);
        for_best.push(three);
        narrow.push(four);
    }
    let (mut each, mut up) = (walk::each::Series::new(), walk::up::Series::new());
    let mut single = walk::each::Series::new();
    let mut best = walk::best::Series::new();
    each.run(&instants).unwrap();
    up.run(&ups_alone).unwrap();
    single.run(&narrow).unwrap();
    best.run(&for_best).unwrap();
    near("ln P", each.ln_evidence(), ln, 1e-12);
    assert_eq!((each.instants(), best.instants()), (6, 6));
    let mut found = Vec::new();
    for (instant, p) in expected.iter().enumerate() {
        for x in 0..3 {
            for is_up in [false, true] {
                let p = p[2 * x + usize::from(is_up)];
                near("smoothed", each.at(instant).p(x as i64 + 1, is_up), p, 1e-12);
                near("smoothed, f32", f64::from(single.at(instant).p(x as i64 + 1, is_up)), p, 1e-5);
            }
        }
        near("up", up.at(instant).p(true), p[1] + p[3] + p[5], 1e-12);
        found.push(2 * (best.x(instant) as usize - 1) + usize::from(best.up(instant)));
    }
    near("the best", histories.weight(&found), most, 1e-12);
    // A shorter series, in the same memory.
    let counted = allocation_counter::measure(|| {
        each.run(&instants[..4]).unwrap();
        best.run(&for_best[..4]).unwrap();
    });
    assert_eq!((each.instants(), best.instants(), counted.count_total), (4, 4, 0));
    let short = Histories { instants: 4, ..histories };
    near("ln P", each.ln_evidence(), short.posteriors().1, 1e-12);
    each.run(&[]).unwrap();
    assert_eq!((each.instants(), each.ln_evidence()), (0, 0.0));
}

#[test]
fn a_plate_has_a_series_for_each_element() {
    const LINES: usize = 66;
    let reading = |instant: usize, line: usize| (instant * 7 + line * 3) % 5 < 2;
    let readings: Vec<Vec<f64>> = (0..5)
        .map(|instant| (0..LINES).map(|line| f64::from(u8::from(reading(instant, line)))).collect())
        .collect();
    let each: Vec<_> = readings.iter().map(|z| rows::each().lines(LINES).z(z)).collect();
    let best: Vec<_> = readings.iter().map(|z| rows::best().lines(LINES).z(z)).collect();
    let (mut smoothed, mut likely) = (rows::each::Series::new(), rows::best::Series::new());
    smoothed.run(&each).unwrap();
    likely.run(&best).unwrap();
    let table = [[0.75, 0.25, 0.0], [0.0, 0.75, 0.25], [0.25, 0.0, 0.75]];
    for line in 0..LINES {
        let seen = |instant: usize, x: usize| {
            if reading(instant, line) { [0.25, 0.5, 1.0][x] } else { [0.75, 0.5, 0.0][x] }
        };
        let start = |x: usize| 0.5 * table[0][x] + 0.5 * table[1][x];
        let step = |before: usize, now: usize| table[before][now];
        let histories = Histories { instants: 5, states: 3, start: &start, step: &step, seen: &seen };
        let (expected, ln, most) = histories.posteriors();
        near("ln P", smoothed.ln_evidence()[line], ln, 1e-12);
        let mut found = Vec::new();
        for (instant, p) in expected.iter().enumerate() {
            (0..3).for_each(|x| near("line", smoothed.at(instant).p(x as i64)[line], p[x], 1e-12));
            found.push(likely.x(instant, line) as usize);
        }
        near("the best", histories.weight(&found), most, 1e-12);
    }
}

bayesian_program!("../bvm/models/scanline.bp");

#[test]
fn a_line_of_a_picture_is_smoothed() {
    const M: usize = 2;
    let contrasts = [0, 120, 7, 200];
    let costs: [[f64; 3]; 4] = [[3.0, 40.0, 90.0], [60.0, 4.0, 30.0], [50.0, 2.0, 8.0], [20.0, 70.0, 6.0]];
    let (largest, beta, hidden, slant, jump, edge, half) = (157.0, 0.111f64, 0.017, 0.03, 0.01, 0.5, 20.0);
    let jumps = |instant: usize| {
        let contrast = contrasts[instant] as f64;
        jump + (edge - jump) * contrast / (contrast + half)
    };
    // Given no jump: from each disparity, normalised.
    let continues = |before: usize, now: usize| {
        let weight = |now: usize| match now.abs_diff(before) {
            0 => 1.0 - slant - if now == 0 || now == M { 0.0 } else { slant },
            1 => slant,
            _ => 0.0,
        };
        weight(now) / (0..=M).map(weight).sum::<f64>()
    };
    let moves = |instant: usize, before: usize, now: usize| {
        jumps(instant) / (M as f64 + 1.0) + (1.0 - jumps(instant)) * continues(before, now)
    };
    let seen = |instant: usize, now: usize| {
        let uniform = 1.0 / largest;
        let exponential = beta * (-beta * costs[instant][now]).exp();
        let others = uniform * uniform;
        (hidden * uniform + (1.0 - hidden) * exponential) * others / 256.0
    };
    let mut expected = vec![vec![0.0; M + 1]; 4];
    for number in 0..(M + 1).pow(5) {
        let at = |instant: usize| number / (M + 1).pow(instant as u32) % (M + 1);
        // The state before the first instant is uniform.
        let mut weight = 1.0 / (M as f64 + 1.0);
        for instant in 0..4 {
            weight *= moves(instant, at(instant), at(instant + 1)) * seen(instant, at(instant + 1));
        }
        (0..4).for_each(|instant| expected[instant][at(instant + 1)] += weight);
    }
    let total: f64 = expected[0].iter().sum();
    let instants: Vec<_> = (0..4)
        .map(|instant| scanline::disparity().m(M).contrast(contrasts[instant]).cost(&costs[instant]))
        .collect();
    let mut series = scanline::disparity::Series::new();
    series.run(&instants).unwrap();
    near("ln P", series.ln_evidence(), total.ln(), 1e-12);
    for (instant, weights) in expected.iter().enumerate() {
        for (d, weight) in weights.iter().enumerate() {
            near("disparity", series.at(instant).p(d as i64), weight / total, 1e-12);
        }
    }
}

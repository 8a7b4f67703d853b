//! Questions over time, compiled, beside loops written by hand: `cargo bench -p bp-macros --bench over_time`.
//!
//! In: a hidden Markov model of 50 states over 10⁵ instants, an orientation filter. Out: the least time of each, and their ratio.
//! Invariant: both compute the same numbers, and alternate, so that disturbances affect both.

use bp_macros::bayesian_program;
use std::hint::black_box;
use std::time::Instant;

bayesian_program! {
    program Hmm {
        variables { X, X^-1, Z : 0..=49; }
        decomposition { P(X^-1) P(X | X^-1) P(Z | X) }
        forms {
            P(X^-1) = uniform;
            P(X | X^-1) = weights(1 / (1 + (X - X^-1) * (X - X^-1)));
            P(Z | X) = weights(0.05 + (if abs(Z - X) < 4 { 1 } else { 0 }));
        }
        question filtered { filter P(X | Z) }
        question smoothed { smooth P(X | Z) }
        question likely { sequence P(X | Z) }
    }
}

bayesian_program! {
    program Attitude {
        parameters { dt : real = 0.01; }
        variables { W, W^-1, B, B^-1, G, G^-1, V, F : real[3]; }
        decomposition {
            P(W^-1) P(W | W^-1) P(B^-1) P(B | B^-1) P(V | W B) P(G^-1) P(G | G^-1 W) P(F | G)
        }
        forms {
            P(W^-1) = normal(0, 1);
            P(W | W^-1) = normal(0, 3);
            P(B^-1) = normal(0, 0.1);
            P(B | B^-1) = normal(B^-1, 0.0001);
            P(V | W B) = normal(W + B, 0.01);
            P(G^-1) = normal([0, 0, 9.81], 0.5);
            P(G | G^-1 W) = dirac(rotate(G^-1, -W * dt));
            P(F | G) = normal(G, 0.5);
        }
        question gravity { filter P(G B | V F) }
    }
}

const STATES: usize = 50;
const INSTANTS: usize = 100_000;

type Table = Vec<[f64; STATES]>;

/// Transitions from each state, transitions to each state, and the sensor by reading.
fn tables() -> [Table; 3] {
    let table = |weight: &dyn Fn(f64, f64) -> f64| -> Table {
        let row = |from: usize| {
            let row: [f64; STATES] = std::array::from_fn(|to| weight(from as f64, to as f64));
            let total: f64 = row.iter().sum();
            row.map(|weight| weight / total)
        };
        (0..STATES).map(row).collect()
    };
    let turned =
        |table: &Table| (0..STATES).map(|row| std::array::from_fn(|column| table[column][row])).collect();
    let moves = table(&|from, to| 1.0 / (1.0 + (to - from) * (to - from)));
    let sees = table(&|x, z| 0.05 + if (z - x).abs() < 4.0 { 1.0 } else { 0.0 });
    [moves.clone(), turned(&moves), turned(&sees)]
}

/// One forward step, by sums or by maxima.
#[inline(always)]
fn forward(
    before: &[f64; STATES],
    moves: &Table,
    sees: &[f64; STATES],
    fold: impl Fn(f64, f64) -> f64,
) -> ([f64; STATES], f64) {
    let mut now = [0.0; STATES];
    for (p, row) in before.iter().zip(moves) {
        for (now, step) in now.iter_mut().zip(row) {
            *now = fold(*now, p * step);
        }
    }
    let mut total = 0.0;
    for (now, sees) in now.iter_mut().zip(sees) {
        *now *= sees;
        total += *now;
    }
    now.iter_mut().for_each(|now| *now /= total);
    (now, total)
}

fn hand_filter(z: &[usize], [moves, _, sees]: &[Table; 3]) -> ([f64; STATES], f64) {
    let (mut state, mut ln) = ([1.0 / STATES as f64; STATES], 0.0);
    for z in z {
        let (now, total) = forward(&state, moves, &sees[*z], |sum, more| sum + more);
        state = now;
        ln += f64::ln(total);
    }
    (state, ln)
}

fn hand_smooth(z: &[usize], [moves, back, sees]: &[Table; 3], out: &mut Vec<[f64; STATES]>) -> f64 {
    out.clear();
    let (mut state, mut ln) = ([1.0 / STATES as f64; STATES], 0.0);
    for z in z {
        let (now, total) = forward(&state, moves, &sees[*z], |sum, more| sum + more);
        state = now;
        ln += f64::ln(total);
        out.push(now);
    }
    let mut later = [1.0; STATES];
    for (z, own) in z.iter().zip(out).rev() {
        let mut total = 0.0;
        for (own, later) in own.iter_mut().zip(&later) {
            *own *= later;
            total += *own;
        }
        own.iter_mut().for_each(|own| *own /= total);
        let mut message = [0.0; STATES];
        let mut total = 0.0;
        for (x, row) in back.iter().enumerate() {
            let weight = later[x] * sees[*z][x];
            for (message, step) in message.iter_mut().zip(row) {
                *message += weight * step;
            }
        }
        message.iter().for_each(|message| total += message);
        later = message.map(|message| message / total);
    }
    ln
}

fn hand_sequence(z: &[usize], [moves, back, sees]: &[Table; 3], out: &mut Vec<[f64; STATES]>) -> Vec<usize> {
    out.clear();
    let (mut state, _) = forward(&[1.0 / STATES as f64; STATES], moves, &sees[z[0]], |sum, more| sum + more);
    out.push(state);
    for z in &z[1..] {
        (state, _) = forward(&state, moves, &sees[*z], f64::max);
        out.push(state);
    }
    let largest = |weights: &[f64; STATES]| {
        (1..STATES).fold(0, |best, x| if weights[x] > weights[best] { x } else { best })
    };
    let mut found = vec![largest(&state)];
    for own in out[..z.len() - 1].iter().rev() {
        let row = &back[found[found.len() - 1]];
        let weights = std::array::from_fn(|x| own[x] * row[x]);
        found.push(largest(&weights));
    }
    found.reverse();
    found
}

/// The least times of two tasks, in turns.
fn race(name: &str, runs: usize, units: f64, mut tasks: [&mut dyn FnMut(); 2]) {
    let mut least = [f64::INFINITY; 2];
    for _ in 0..runs {
        for (task, least) in tasks.iter_mut().zip(&mut least) {
            let start = Instant::now();
            task();
            *least = least.min(start.elapsed().as_secs_f64());
        }
    }
    let [hand, emitted] = least.map(|seconds| seconds / units * 1e9);
    if hand < 1.0 {
        println!("{name:<34} {emitted:>9.0} ns emitted");
        return;
    }
    println!("{name:<34} {hand:>9.0} ns by hand {emitted:>9.0} ns emitted, ratio {:.2}", emitted / hand);
}

fn main() {
    let tables = tables();
    let z: Vec<usize> =
        (0..INSTANTS).map(|t| (25.0 + 20.0 * (t as f64 / 40.0).sin()) as usize + t % 3).collect();
    let numbers: Vec<i64> = z.iter().map(|z| *z as i64).collect();
    let units = INSTANTS as f64;
    let (mut by_hand, mut ln) = ([0.0; STATES], 0.0);
    let mut state = hmm::filtered::State::<f64>::new();
    race(
        "filter, 50 states, an instant",
        7,
        units,
        [&mut || (by_hand, ln) = hand_filter(black_box(&z), &tables), &mut || {
            state = hmm::filtered::State::new();
            for z in black_box(&numbers) {
                hmm::filtered().z(*z).step(&mut state).expect("it is possible");
            }
        }],
    );
    assert!((state.ln_evidence() - ln).abs() < 1e-6 * ln.abs() && (state.p(25) - by_hand[25]).abs() < 1e-9);
    let mut narrow = hmm::filtered::State::<f32>::new();
    race(
        "the same in f32",
        3,
        units,
        [&mut || (by_hand, ln) = hand_filter(black_box(&z), &tables), &mut || {
            for z in black_box(&numbers) {
                hmm::filtered::Question::<f32>::new().z(*z).step(&mut narrow).expect("it is possible");
            }
        }],
    );
    let (mut all, mut series) = (Vec::new(), hmm::smoothed::Series::<f64>::new());
    let instants: Vec<_> = numbers.iter().map(|z| hmm::smoothed().z(*z)).collect();
    race(
        "smooth, an instant",
        5,
        units,
        [&mut || ln = hand_smooth(black_box(&z), &tables, &mut all), &mut || {
            series.run(black_box(&instants)).expect("it is possible");
        }],
    );
    for instant in [0, 500, INSTANTS - 1] {
        (0..STATES).for_each(|x| {
            assert!((series.at(instant).p(x as i64) - all[instant][x]).abs() < 1e-9);
        });
    }
    let (mut found, mut likely) = (Vec::new(), hmm::likely::Series::<f64>::new());
    let instants: Vec<_> = numbers.iter().map(|z| hmm::likely().z(*z)).collect();
    race(
        "most likely sequence, an instant",
        5,
        units,
        [&mut || found = hand_sequence(black_box(&z), &tables, &mut all), &mut || {
            likely.run(black_box(&instants)).expect("it is possible");
        }],
    );
    let apart = (0..INSTANTS).filter(|t| likely.x(*t) as usize != found[*t]).count();
    println!("instants at which the two sequences differ (equal probabilities): {apart}");
    let mut attitude = attitude::gravity::State::<f64>::new();
    race(
        "rate, bias, orientation: a sample",
        7,
        20_000.0,
        [&mut || (), &mut || {
            for t in 0..20_000 {
                let turn = f64::from(t) * 0.01;
                let v = [0.3 * turn.cos(), 0.1, 0.05];
                let f = [0.2 * turn.sin(), 0.1, 9.8];
                attitude::gravity().v(&v).f(&f).step(&mut attitude).expect("it is possible");
            }
        }],
    );
    assert!(attitude.mean_g()[2].is_finite());
}

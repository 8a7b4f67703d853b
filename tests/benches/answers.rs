//! Answers over time, learning and draws, beside loops written by hand: `cargo bench --bench answers`.
//!
//! In: programs as text, and data of a fixed generator. Out: the time of each answer, and of the loop. Invariant: both
//! give the same numbers, or numbers that agree within the error of the draws, which is asserted before they are timed.

use bp_core::prelude::*;
use criterion::Criterion;
use std::fmt::Write;
use std::hint::black_box;
use std::io::sink;

/// Numbers in [0, 1): a linear congruential generator (Knuth's MMIX), of which the high bits are taken.
struct Dice(u64);

impl Dice {
    fn throw(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    fn choose(&mut self, weights: &[f64]) -> usize {
        let mut rest = self.throw() * weights.iter().sum::<f64>();
        let beyond = |weight: &f64| {
            rest -= weight;
            rest < 0.0
        };
        weights.iter().position(beyond).unwrap_or(weights.len() - 1)
    }

    /// The polar form of a normal number (Box and Muller 1958).
    fn normal(&mut self) -> f64 {
        let radius = (-2.0 * (1.0 - self.throw()).ln()).sqrt();
        radius * (std::f64::consts::TAU * self.throw()).cos()
    }

    fn row(&mut self, count: usize) -> Vec<f64> {
        let weights: Vec<f64> = (0..count).map(|_| self.throw().powi(3) + 1e-3).collect();
        let total: f64 = weights.iter().sum();
        weights.iter().map(|weight| weight / total).collect()
    }
}

fn table(columns: &[&str], rows: usize, cell: impl Fn(usize, usize) -> String) -> Records {
    let names = columns.iter().map(|name| (*name).to_owned()).collect();
    Records::of_columns("data", names, (1, rows), |row, column, text| text.push_str(&cell(row, column)))
        .unwrap()
}

fn near(found: f64, expected: f64, within: f64) {
    assert!((found - expected).abs() <= within, "{found}, expected {expected}");
}

/// 50 states, 10⁵ instants.
fn smooth(criterion: &mut Criterion) {
    const STATES: usize = 50;
    const SYMBOLS: usize = 10;
    const INSTANTS: usize = 100_000;
    let mut dice = Dice(1);
    let moves: Vec<Vec<f64>> = (0..STATES).map(|_| dice.row(STATES)).collect();
    let shows: Vec<Vec<f64>> = (0..STATES).map(|_| dice.row(SYMBOLS)).collect();
    let written = |rows: &[Vec<f64>]| {
        rows.iter().enumerate().fold(String::new(), |mut text, (state, row)| {
            let row: Vec<String> = row.iter().map(f64::to_string).collect();
            write!(text, "{state}: {}; ", row.join(", ")).unwrap();
            text
        })
    };
    let program = Program::parse(&format!(
        "program Hmm {{
             variables {{ X, X^-1 : 0..=49; Z : 0..=9; }}
             decomposition {{ P(X^-1) P(X | X^-1) P(Z | X) }}
             forms {{ P(X^-1) = previous(X) else uniform;
                      P(X | X^-1) = table {{ {} }}; P(Z | X) = table {{ {} }}; }}
         }}",
        written(&moves),
        written(&shows)
    ))
    .unwrap();
    let mut state = 0;
    let seen: Vec<usize> = (0..INSTANTS)
        .map(|_| {
            state = dice.choose(&moves[state]);
            dice.choose(&shows[state])
        })
        .collect();
    let table = table(&["Z"], INSTANTS, |row, _| seen[row].to_string());
    let question = program.question("smooth P(X | Z)").unwrap();
    // Forward and backward messages, scaled; the posteriors in the place of the forward ones.
    let by_hand = || {
        let mut all = vec![0.0; INSTANTS * STATES];
        let mut last = vec![1.0 / STATES as f64; STATES];
        for (instant, own) in all.chunks_exact_mut(STATES).enumerate() {
            for (p, row) in last.iter().zip(&moves) {
                own.iter_mut().zip(row).for_each(|(own, q)| *own += p * q);
            }
            own.iter_mut().zip(&shows).for_each(|(own, row)| *own *= row[seen[instant]]);
            let total: f64 = own.iter().sum();
            own.iter_mut().for_each(|own| *own /= total);
            last.copy_from_slice(own);
        }
        let mut back = vec![1.0; STATES];
        for (instant, own) in all.chunks_exact_mut(STATES).enumerate().rev() {
            own.iter_mut().zip(&back).for_each(|(own, back)| *own *= back);
            let total: f64 = own.iter().sum();
            own.iter_mut().for_each(|own| *own /= total);
            let ahead: Vec<f64> =
                back.iter().zip(&shows).map(|(back, row)| back * row[seen[instant]]).collect();
            for (back, row) in back.iter_mut().zip(&moves) {
                *back = row.iter().zip(&ahead).map(|(q, ahead)| q * ahead).sum();
            }
            let total: f64 = back.iter().sum();
            back.iter_mut().for_each(|back| *back /= total);
        }
        all
    };
    let (found, expected) = (question.over_records(&table).unwrap(), by_hand());
    for instant in [0, 1, INSTANTS / 2, INSTANTS - 1] {
        let posterior = found.at(instant + 1).unwrap();
        for state in 0..STATES {
            near(posterior.p(state as i64).unwrap(), expected[instant * STATES + state], 1e-12);
        }
    }
    criterion.bench_function("smooth, 50 states x 10^5 instants, by hand", |bench| bench.iter(by_hand));
    criterion.bench_function("smooth, 50 states x 10^5 instants", |bench| {
        bench.iter(|| question.over_records(black_box(&table)).unwrap());
    });
    criterion.bench_function("the same, and its JSON", |bench| {
        bench.iter(|| serde_json::to_writer(sink(), &question.over_records(&table).unwrap()).unwrap());
    });
}

/// Three components, two reals, 10⁵ rows.
fn mixture(criterion: &mut Criterion) {
    const ROWS: usize = 100_000;
    const STEPS: usize = 10;
    let mut dice = Dice(2);
    let rows: Vec<[f64; 2]> = (0..ROWS)
        .map(|_| {
            let kind = dice.choose(&[0.5, 0.3, 0.2]);
            let [mean, deviation] = [[0.0, 3.0, 6.0][kind], [1.0, 0.7, 1.3][kind]];
            [mean + deviation * dice.normal(), -mean + dice.normal()]
        })
        .collect();
    let table = table(&["X", "Y"], ROWS, |row, column| rows[row][column].to_string());
    let program = Program::parse(
        "program Mixture {
             variables { K : 0..=2; X, Y : real; }
             decomposition { P(K) P(X | K) P(Y | K) }
             forms { P(K) = unknown(histogram); P(X | K) = unknown(normal); P(Y | K) = unknown(normal); }
         }",
    )
    .unwrap();
    let learning = Learning::of_records(table).hidden("K").iterations(STEPS);
    // E and M steps from components that are spread over the values of X.
    let by_hand = || {
        let mut parts = [
            [1.0 / 3.0, 0.0, 1.0, 0.0, 1.0],
            [1.0 / 3.0, 3.0, 1.0, -3.0, 1.0],
            [1.0 / 3.0, 6.0, 1.0, -6.0, 1.0],
        ];
        let mut ln = 0.0;
        for _ in 0..STEPS {
            let mut sums = [[0.0; 5]; 3];
            ln = 0.0;
            for [x, y] in &rows {
                let density = parts.map(|[weight, mx, sx, my, sy]| {
                    let square = ((x - mx) / sx).powi(2) + ((y - my) / sy).powi(2);
                    weight * (-0.5 * square).exp() / (std::f64::consts::TAU * sx * sy)
                });
                let total: f64 = density.iter().sum();
                ln += total.ln();
                for (sums, density) in sums.iter_mut().zip(density) {
                    let share = density / total;
                    let terms = [1.0, *x, x * x, *y, y * y];
                    sums.iter_mut().zip(terms).for_each(|(sum, term)| *sum += share * term);
                }
            }
            parts = sums.map(|[n, x, xx, y, yy]| {
                let (x, y) = (x / n, y / n);
                [n / ROWS as f64, x, (xx / n - x * x).sqrt(), y, (yy / n - y * y).sqrt()]
            });
        }
        (parts, ln)
    };
    // The reported ln likelihood is that of the learned numbers.
    let learned = program.learn(learning.clone()).unwrap();
    let part = |kind: i64| -> [f64; 5] {
        let asked = |name: &str| learned.ask(&format!("P({name} | K = {kind})")).unwrap();
        let (x, y) = (asked("X"), asked("Y"));
        let weight = learned.ask("P(K)").unwrap().p(kind).unwrap();
        [weight, x.mean().unwrap(), x.deviation().unwrap(), y.mean().unwrap(), y.deviation().unwrap()]
    };
    let parts = [0, 1, 2].map(part);
    let ln = |[x, y]: &[f64; 2]| {
        let density = parts.iter().map(|[weight, mx, sx, my, sy]| {
            let square = ((x - mx) / sx).powi(2) + ((y - my) / sy).powi(2);
            weight * (-0.5 * square).exp() / (std::f64::consts::TAU * sx * sy)
        });
        density.sum::<f64>().ln()
    };
    near(learned.report().ln_likelihood, rows.iter().map(ln).sum(), 1e-6 * ROWS as f64);
    criterion.bench_function("mixture, 10^5 rows, 10 steps, by hand", |bench| bench.iter(by_hand));
    criterion.bench_function("mixture, 10^5 rows, 10 steps", |bench| {
        bench.iter(|| program.learn(black_box(learning.clone())).unwrap());
    });
}

/// A class and ten features, 10⁶ rows.
fn counts(criterion: &mut Criterion) {
    const ROWS: usize = 1_000_000;
    const NAMES: [&str; 11] = ["C", "F0", "F1", "F2", "F3", "F4", "F5", "F6", "F7", "F8", "F9"];
    let mut dice = Dice(3);
    let rows: Vec<[u8; 11]> = (0..ROWS)
        .map(|_| {
            let class = (3.0 * dice.throw()) as u8;
            let mut row = [class; 11];
            let value = |feature: &mut u8| {
                *feature = ((4.0 * dice.throw()) as u8 + class * (dice.throw() < 0.3) as u8) % 4
            };
            row[1..].iter_mut().for_each(value);
            row
        })
        .collect();
    let table = table(&NAMES, ROWS, |row, column| rows[row][column].to_string());
    let features: String = NAMES[1..].iter().map(|name| format!("{name} : 0..=3; ")).collect();
    let factors: String = NAMES[1..].iter().map(|name| format!("P({name} | C) ")).collect();
    let forms: String = NAMES[1..].iter().map(|name| format!("P({name} | C) = unknown; ")).collect();
    let program = Program::parse(&format!(
        "program Bayes {{ variables {{ C : 0..=2; {features} }} decomposition {{ P(C) {factors} }}
         forms {{ P(C) = unknown; {forms} }} }}"
    ))
    .unwrap();
    let by_hand = || {
        let mut counts = [[[0u32; 4]; 3]; 11];
        for row in &rows {
            for (counts, value) in counts.iter_mut().zip(row) {
                counts[row[0] as usize][*value as usize] += 1;
            }
        }
        counts
    };
    let learning = Learning::of_records(table);
    let (learned, expected) = (program.learn(learning.clone()).unwrap(), by_hand());
    for (class, own) in expected[5].iter().enumerate() {
        let found = learned.ask(&format!("P(F4 | C = {class})")).unwrap();
        for (value, count) in own.iter().enumerate() {
            // `unknown` counts each value once more.
            let p = f64::from(count + 1) / f64::from(own.iter().sum::<u32>() + 4);
            near(found.p(value as i64).unwrap(), p, 1e-12);
        }
    }
    criterion
        .bench_function("counts, 10^6 rows x 11 columns, of arrays, by hand", |bench| bench.iter(by_hand));
    criterion.bench_function("counts, 10^6 rows x 11 columns, of text", |bench| {
        bench.iter(|| program.learn(black_box(learning.clone())).unwrap());
    });
}

/// 10⁴ particles, 1000 instants.
fn particles(criterion: &mut Criterion) {
    const INSTANTS: usize = 1000;
    const PARTICLES: usize = 10_000;
    let mut dice = Dice(4);
    let mut state: f64 = 0.0;
    let seen: Vec<f64> = (0..INSTANTS)
        .map(|_| {
            state = 0.9 * state.sin() + 0.5 * dice.normal();
            state + 0.7 * dice.normal()
        })
        .collect();
    let table = table(&["Z"], INSTANTS, |row, _| seen[row].to_string());
    let program = Program::parse(
        "program Bent {
             variables { X, X^-1, Z : real; }
             decomposition { P(X^-1) P(X | X^-1) P(Z | X) }
             forms { P(X^-1) = previous(X) else normal(0, 1); P(X | X^-1) = normal(0.9 * sin(X^-1), 0.5);
                     P(Z | X) = normal(X, 0.7); }
         }",
    )
    .unwrap()
    .draws(PARTICLES)
    .by("particles")
    .unwrap();
    let question = program.question("filter P(X | Z)").unwrap();
    // Systematic resampling at every instant at which fewer than half of the particles are effective.
    let by_hand = || {
        let mut dice = Dice(5);
        let mut all: Vec<f64> = (0..PARTICLES).map(|_| dice.normal()).collect();
        let mut weights = vec![1.0 / PARTICLES as f64; PARTICLES];
        let mut chosen = vec![0.0; PARTICLES];
        for z in &seen {
            for (x, weight) in all.iter_mut().zip(&mut weights) {
                *x = 0.9 * x.sin() + 0.5 * dice.normal();
                *weight *= (-0.5 * ((z - *x) / 0.7).powi(2)).exp();
            }
            let total: f64 = weights.iter().sum();
            weights.iter_mut().for_each(|weight| *weight /= total);
            if 1.0 / weights.iter().map(|weight| weight * weight).sum::<f64>() < 0.5 * PARTICLES as f64 {
                let (start, mut sum, mut from) = (dice.throw(), weights[0], 0);
                for (number, chosen) in chosen.iter_mut().enumerate() {
                    while sum < (number as f64 + start) / PARTICLES as f64 && from + 1 < PARTICLES {
                        from += 1;
                        sum += weights[from];
                    }
                    *chosen = all[from];
                }
                std::mem::swap(&mut all, &mut chosen);
                weights.fill(1.0 / PARTICLES as f64);
            }
        }
        all.iter().zip(&weights).map(|(x, weight)| x * weight).sum::<f64>()
    };
    let found = question.over_records(&table).unwrap().mean_and_error().unwrap();
    near(found[0], by_hand(), 8.0 * found[1] + 0.02);
    criterion.bench_function("particles, 10^4 x 1000 instants, by hand", |bench| bench.iter(by_hand));
    criterion.bench_function("particles, 10^4 x 1000 instants", |bench| {
        bench.iter(|| question.over_records(black_box(&table)).unwrap());
    });
}

fn main() {
    let mut criterion = Criterion::default().sample_size(10).configure_from_args();
    smooth(&mut criterion);
    mixture(&mut criterion);
    counts(&mut criterion);
    particles(&mut criterion);
    criterion.final_summary();
}

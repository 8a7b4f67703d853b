//! Hearing: P(S | cues) of all cells, and the front end on one second of sound.
//!
//! In: made-up calibrations, noise. Out: times. Invariant: kernel and loop agree before they are timed.

use crate::cell::numbers;
use crate::clock::{Task, Work, race_on, table};
use bp_core::compiler::exec::scalar::Scalar;
use bvm::audition::{BANDS, BinauralUnit, independent};
use bvm::programs::binaural;
use std::hint::black_box;

/// Cells of the map, and bands whose levels are compared.
const CELLS: usize = 324_000;
const CHANNELS: usize = 4;
const RATE_HZ: f64 = 44_100.0;

/// P(S = 1 | τ, ΔL) of each cell by hand: `mu_tau[cell]`, `mu_l[channel][cell]`; one exponential for each cell.
struct BySums<'a> {
    mu_tau: &'a [f32],
    mu_l: &'a [f32],
    tau: f32,
    l: [f32; CHANNELS],
    made: &'a mut [f32],
}

impl pulp::NullaryFnOnce for BySums<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let (rate, sigma_tau, sigma_l) =
            (0.5 * binaural::DEFAULT_RATE, binaural::DEFAULT_SIGMA_TAU, binaural::DEFAULT_SIGMA_L);
        let ln_normal = |sigma: f64| -(sigma * (2.0 * std::f64::consts::PI).sqrt()).ln();
        let channels = CHANNELS as f64;
        let ln_sounding = rate.ln() + ln_normal(sigma_tau) + channels * ln_normal(sigma_l);
        let ln_silent = (1.0 - rate).ln()
            - (2.0 * binaural::DEFAULT_TAU_MAX).ln()
            - channels * (2.0 * binaural::DEFAULT_L_MAX).ln();
        let offset = (ln_silent - ln_sounding) as f32;
        let (of_tau, of_l) = ((0.5 / (sigma_tau * sigma_tau)) as f32, (0.5 / (sigma_l * sigma_l)) as f32);
        let cells = self.made.len();
        for (cell, made) in self.made.iter_mut().enumerate() {
            let away = self.tau - self.mu_tau[cell];
            let mut exponent = offset + of_tau * away * away;
            for (channel, l) in self.l.iter().enumerate() {
                let away = l - self.mu_l[channel * cells + cell];
                exponent += of_l * away * away;
            }
            *made = 1.0 / (1.0 + exponent.exponential());
        }
    }
}

/// Prints the tables.
pub(crate) fn run(seconds: f64) {
    source(seconds);
    front_end(seconds);
}

fn source(seconds: f64) {
    let scaled = |values: Vec<f32>, size: f32| values.iter().map(|x| size * (x - 0.5)).collect::<Vec<f32>>();
    let mu_tau = scaled(numbers(CELLS, 0.0), 1.4e-3);
    let mu_l: Vec<f32> =
        (0..CHANNELS).flat_map(|channel| scaled(numbers(CELLS, channel as f32 + 1.0), 30.0)).collect();
    let (tau, l) = (3e-4_f32, [5.0_f32, 6.0, 8.0, 10.0]);
    let heard = [tau];
    let inputs =
        binaural::source().grid(CELLS).channels(CHANNELS).mu_tau(&mu_tau).mu_l(&mu_l).tau(&heard).l(&l);
    let mut emitted = binaural::source::Answer::<f32>::default();
    inputs.run_into(&mut emitted).expect("it fits");
    let mut made = vec![0.0_f32; CELLS];
    pulp::Arch::new().dispatch(BySums { mu_tau: &mu_tau, mu_l: &mu_l, tau, l, made: &mut made });
    for (x, y) in made.iter().zip(emitted.p(true)) {
        assert!((x - y).abs() < 1e-5 + 1e-4 * x, "the source by hand: {x} is not {y}");
    }
    let mut tasks: Vec<Task<'_>> = vec![
        (
            "by hand",
            Box::new(|| {
                let made = black_box(&mut made);
                pulp::Arch::new().dispatch(BySums { mu_tau: &mu_tau, mu_l: &mu_l, tau, l, made });
            }),
        ),
        (
            "emitted Rust",
            Box::new(|| {
                inputs.run_into(black_box(&mut emitted)).expect("fits");
            }),
        ),
    ];
    let work = Work {
        title: "source of a sound: P(S | cues) of 324 000 cells",
        bytes: 4 * CELLS * (CHANNELS + 2),
        unit: ("ms", 1e3),
    };
    table(&work, 2.0 * seconds, &mut tasks);
}

/// One second of noise at both ears through the cochlear and the binaural unit: 32 bands, one thread.
fn front_end(seconds: f64) {
    let noise = |from: f32| -> Vec<f64> {
        numbers(RATE_HZ as usize, from).iter().map(|x| 0.2 * (f64::from(*x) - 0.5)).collect()
    };
    let (left, right, independent) = (noise(0.0), noise(0.0), independent());
    let mut tasks: Vec<Task<'_>> = vec![(
        "front end",
        Box::new(move || {
            let cues = BinauralUnit::new(RATE_HZ, &independent).hear(black_box(&left), black_box(&right));
            black_box(cues.bands());
        }),
    )];
    let times = race_on(1, 2.0 * seconds, &mut tasks);
    println!(
        "hearing: {BANDS} bands at 44.1 kHz, one thread: real-time factor {:.4} (least), {:.4} (median)",
        times[0].least, times[0].median
    );
}

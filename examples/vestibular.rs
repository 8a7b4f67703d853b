//! The perceived duration of a rotation in the dark: canals have a time constant of 4 s, but the estimate decays with
//! 16.49 s.
//!
//! The program is linear and Gaussian, so its answer is a Kalman filter. τ = τ_c √(1 + σ_Ω² / σ_V²) = 4 √17 s
//! (Laurens and Droulez 2007; Laurens and Angelaki 2017, who give 16.5 s).

use bp_macros::bayesian_program;

bayesian_program!("bvm/models/vestibular.bp");

const DT: f64 = 0.01;
const TAU_C: f64 = 4.0;

fn main() {
    let mut filter = vestibular::rotation().filter().expect("every parameter has a default");
    filter.settle().expect("the gains converge");
    let (mut canal, mut before, mut estimates) = (0.0, 0.0, Vec::new());
    for _ in 0..=6000 {
        // The head turns at 1 rad/s from the first instant on; the canal is a high-pass filter of the velocity.
        canal = (1.0 - DT / TAU_C) * canal + TAU_C / (TAU_C + DT) * (1.0 - before);
        before = 1.0;
        let belief = filter.step(&[("V", canal)]).expect("a finite reading");
        estimates.push(belief.mean_of("Omega").expect("it is searched"));
    }
    for second in [0, 1, 10, 30, 60] {
        println!("{second:2} s: {:.4} rad/s", estimates[100 * second]);
    }
    let fall = 20.0 / (estimates[4000] / estimates[6000]).ln();
    println!("from 40 to 60 s its time constant is {fall:.2} s");
    assert!((fall - TAU_C * 17f64.sqrt()).abs() < 0.05);
}

//! What one range reading says of each cell on its line of sight: 2^9 hidden states, summed by a scan.
//!
//! Ten cells, a reading in cell 3 with a deviation of 0.6 cells. Nearer cells are probably empty, the cell itself
//! occupied; behind it the reading says nothing: ½. Yguel, Aycard and Laugier (2008); Ferreira et al. (2008), Fig. 6.

use bp_macros::bayesian_program;

bayesian_program!("bvm/models/line_of_sight.bp");
use line_of_sight::reading::{Inputs, Outputs, run};

const CELLS: usize = 10;

fn main() {
    // sigma_min / (lambda · rho · ln b) is the deviation in cells.
    let inputs =
        Inputs { rays: 1, n: CELLS, z: &[3.0], sigma_min: 0.6, lambda: &[1.0], rho: &[1.0], ln_b: 1.0 };
    let mut answer = Outputs::default();
    run(&inputs, &mut answer).expect("one ray");
    // P(Z = 3 | O C) by [O][C]; with P(O) = ½ the posterior is the ratio.
    let (empty, occupied) = answer.p_z.split_at(CELLS);
    let posterior: Vec<f64> = empty.iter().zip(occupied).map(|(p, q)| q / (p + q)).collect();
    for (cell, p) in posterior.iter().enumerate() {
        println!("cell {:2}  P(O | Z = 3) = {p:.4}  {}", cell + 1, "█".repeat((40.0 * p) as usize));
    }
    let expected = [0.0223, 0.3639, 0.7229, 0.5434, 0.5007, 0.5, 0.5, 0.5, 0.5, 0.5];
    assert!(posterior.iter().zip(expected).all(|(p, q)| (p - q).abs() < 1e-4), "{posterior:?}");
}

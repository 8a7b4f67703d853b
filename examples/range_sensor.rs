//! The posterior of each cell on a line of sight, given one range reading: 2^9 hidden states, summed by a scan.
//!
//! Ten cells, a reading in cell 3 with a deviation of 0.6 cells. Nearer cells are probably empty, the cell itself is
//! probably occupied, and the cells behind it stay at ½. Yguel, Aycard and Laugier (2008); Ferreira et al. (2008), Fig.
//! 6.

use bp_core::prelude::Error;
use bp_macros::bayesian_program;

bayesian_program!("bvm/models/line_of_sight.bp");

const CELLS: usize = 10;

fn main() -> Result<(), Error> {
    // sigma_min / (lambda · rho · ln b) is the deviation in cells.
    let question = line_of_sight::reading().rays(1).n(CELLS).sigma_min(0.6).ln_b(1.0);
    let answer = question.z(&[3.0]).lambda(&[1.0]).rho(&[1.0]).ask()?;
    // With P(O) = ½ the posterior P(O | Z = 3) of a cell is the ratio of P(Z = 3 | O C).
    let likelihood = |occupied: bool, cell: i64| -> f64 { answer.p(occupied, cell)[0] };
    let posterior: Vec<f64> = (1..=CELLS as i64)
        .map(|cell| likelihood(true, cell) / (likelihood(false, cell) + likelihood(true, cell)))
        .collect();
    for (cell, p) in posterior.iter().enumerate() {
        println!("cell {:2}  P(O | Z = 3) = {p:.4}  {}", cell + 1, "█".repeat((40.0 * p) as usize));
    }
    let expected = [0.0223, 0.3639, 0.7229, 0.5434, 0.5007, 0.5, 0.5, 0.5, 0.5, 0.5];
    assert!(posterior.iter().zip(expected).all(|(p, q)| (p - q).abs() < 1e-4), "{posterior:?}");
    Ok(())
}

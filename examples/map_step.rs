//! One step of the map that can be checked by hand: five cells in a row, three velocities.
//!
//! Content moves by −1, 0 or +1 cells at constant velocity; then each cell is observed, P(z | empty) = 0.2 and
//! P(z | occupied) = 0.8. Ferreira, Pinho and Dias (2008), Fig. 4 and 5.

use bp_core::prelude::{Edge, Error, Space};
use bp_macros::bayesian_program;

bayesian_program!("bvm/models/cell.bp");

fn main() -> Result<(), Error> {
    let space = Space::new([5, 1, 1], [Edge::Open; 3]).expect("five cells");
    let velocities = space.antecedents(&[[-1, 0, 0], [0, 0, 0], [1, 0, 0]]);
    let occupied = [0.5, 0.5, 0.9, 0.2, 0.5];
    let previous_o: Vec<f64> = occupied.iter().map(|p| 1.0 - p).chain(occupied).collect();
    // Indexed by [velocity][cell]: uniform except in cell 2, which probably moves by +1.
    let mut previous_v = [1.0 / 3.0; 15];
    (previous_v[2], previous_v[7], previous_v[12]) = (0.1, 0.2, 0.7);
    let likelihood = [[0.2; 5], [0.8; 5]].concat();
    let state = cell::observe(&space, &velocities)
        .sensors(1)
        .epsilon(0.1)
        .motion(&[1.0 / 3.0; 3])
        .previous_o(&previous_o)
        .previous_v(&previous_v)
        .sensors_i_reading(&likelihood)
        .ask()?;
    // Over a grid an answer contains all cells.
    let (occupied, entropy) = (state.p_o(true), state.entropy_o_v());
    for (cell, (p, h)) in occupied.iter().zip(entropy).enumerate() {
        println!("cell {cell}: P(O) = {p:.6}, H(O V) = {h:.6} nats");
    }
    // Cell 3: the content of cell 2 has probably moved here.
    assert!((occupied[3] - 0.8598648882729949).abs() < 1e-12);
    assert!((entropy[3] - 1.2526545790440644).abs() < 1e-12);
    assert!((entropy[2] - 1.5426503226262418).abs() < 1e-12);
    Ok(())
}

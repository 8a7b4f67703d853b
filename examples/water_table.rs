//! A water treatment unit as one table: P(O | I0 I1 S C), 161 051 numbers in one call of compiled code.
//!
//! An output that would be negative cannot be: its cases are dropped and the rest is renormalised. A context that cannot
//! be has a row of zeros. Chapter 3 of Bessière et al. (2013).

use bp_macros::bayesian_program;

bayesian_program!("examples/water_unit.bp");
use water_unit::output::{Inputs, Outputs, run};

fn main() {
    let (mut table, start) = (Outputs::<f64>::default(), std::time::Instant::now());
    run(&Inputs {}, &mut table).expect("it needs no input");
    println!("161 051 numbers in {:.1} ms", start.elapsed().as_secs_f64() * 1e3);

    // By [I0][I1][S][C][O]: what is searched is fastest.
    let contexts = 11 * 11 * 11 * 11;
    let row = |context: [usize; 4]| -> [f64; 11] {
        let place = context.iter().fold(0, |place, value| 11 * place + value);
        std::array::from_fn(|o| table.p_o[11 * place + o])
    };
    for context in [[1, 0, 5, 10], [0, 1, 5, 10], [5, 5, 5, 5], [0, 5, 9, 5]] {
        println!("I0 I1 S C = {context:?}: {:.4?}", row(context));
    }
    assert_eq!(table.p_o.len(), 161_051);
    assert!((row([1, 0, 5, 10])[0] - 2.0 / 7.0).abs() < 1e-12 && (row([0, 1, 5, 10])[0] - 0.3).abs() < 1e-12);
    let impossible = (0..contexts).filter(|place| (0..11).all(|o| table.p_o[11 * place + o] == 0.0));
    assert_eq!(impossible.count(), 6655);
}

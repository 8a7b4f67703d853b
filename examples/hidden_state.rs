//! A filter as a loop: the answer of one instant is the `previous` of the next.
//!
//! A door opens and closes, and a sensor detects whether it is open. After three readings the filter must equal the sum
//! over all 2³ histories of the door.

use bp_core::prelude::Error;
use bp_macros::bayesian_program;

bayesian_program! {
    program Door {
        variables { Open, Open^-1, Seen : bool; }
        decomposition { P(Open^-1) P(Open | Open^-1) P(Seen | Open) }
        forms {
            P(Open^-1)        = previous(Open);
            P(Open | Open^-1) = table { false: 0.9, 0.1; true: 0.2, 0.8; };
            P(Seen | Open)    = bernoulli(if Open { 0.7 } else { 0.1 });
        }
        question open { P(Open | Seen = seen) }
    }
}

const MOVES: [[f64; 2]; 2] = [[0.9, 0.1], [0.2, 0.8]];
const SEES: [[f64; 2]; 2] = [[0.9, 0.1], [0.3, 0.7]];
const READINGS: [bool; 3] = [true, false, true];

/// P(door after three readings), over every history: the state before the first step, and after each.
fn by_hand() -> f64 {
    let mut weight = [0.0; 2];
    for history in 0..16usize {
        let state = |instant: usize| history >> instant & 1;
        let mut p = 0.5;
        for (step, seen) in READINGS.into_iter().enumerate() {
            p *= MOVES[state(step)][state(step + 1)] * SEES[state(step + 1)][usize::from(seen)];
        }
        weight[state(3)] += p;
    }
    weight[1] / (weight[0] + weight[1])
}

fn main() -> Result<(), Error> {
    let (mut before, mut now) = (door::open::Answer::default(), door::open::Answer::default());
    *now.distribution_mut() = vec![0.5, 0.5];
    for seen in READINGS {
        std::mem::swap(&mut before, &mut now);
        door::open().previous_open(before.distribution()).seen(seen).run_into(&mut now)?;
        println!("seen {seen}: P(Open) = {:.6}", now.p(true));
    }
    assert!((now.p(true) - by_hand()).abs() < 1e-12, "{} by hand", by_hand());
    Ok(())
}

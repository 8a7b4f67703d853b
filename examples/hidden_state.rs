//! A filter is a loop: the answer of one instant is the `previous` of the next.
//!
//! A door opens and closes unseen; a sensor sees it open or not. After three readings the filter must say what the sum
//! over all 2³ histories of the door says.

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
const READINGS: [usize; 3] = [1, 0, 1];

/// P(door after three readings), over every history: the state before the first step, and after each.
fn by_hand() -> f64 {
    let mut weight = [0.0; 2];
    for history in 0..16usize {
        let state = |instant: usize| history >> instant & 1;
        let mut p = 0.5;
        for (step, seen) in READINGS.into_iter().enumerate() {
            p *= MOVES[state(step)][state(step + 1)] * SEES[state(step + 1)][seen];
        }
        weight[state(3)] += p;
    }
    weight[1] / (weight[0] + weight[1])
}

fn main() {
    let (mut belief, mut answer) = (vec![0.5, 0.5], door::open::Outputs::default());
    for seen in READINGS {
        let inputs = door::open::Inputs { previous_open: &belief, seen: seen as f64 };
        door::open::run(&inputs, &mut answer).expect("two numbers and a reading");
        std::mem::swap(&mut belief, &mut answer.p_open);
        println!("seen {seen}: P(Open) = {:.6}", belief[1]);
    }
    assert!((belief[1] - by_hand()).abs() < 1e-12, "{} by hand", by_hand());
}

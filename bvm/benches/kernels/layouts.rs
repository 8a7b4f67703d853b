//! Layouts of the state of the map that no kernel has yet, by hand, and the time of the streams alone.
//!
//! In: the inputs of the step, and its answer. Out: a table. Invariant: P(O = 1) of each layout is compared with the answer
//! before it is timed; the likelihood of a cell is one number, L(1)/(L(0) + L(1)), because only the ratio of the two matters.

use crate::clock::{Task, Work, table};
use crate::hand::Cells;
use crate::hand_rows::{Compact, SEVEN, Stored, Streams};
use std::hint::black_box;

/// The inputs of a compact layout, and room for its answer.
struct Numbers<S> {
    occupied: Vec<S>,
    velocity: Vec<S>,
    likelihood: Vec<S>,
    made: Vec<S>,
}

impl<S: Stored> Numbers<S> {
    fn of(cells: &Cells<'_>) -> Self {
        let plane = cells.occupancy.len() / 2;
        let stored = |numbers: &[f32]| numbers.iter().map(|number| S::nearest(*number)).collect::<Vec<S>>();
        let (empty, full) = cells.likelihood.split_at(plane);
        let shares: Vec<f32> = empty.iter().zip(full).map(|(empty, full)| full / (empty + full)).collect();
        Self {
            occupied: stored(&cells.occupancy[plane..]),
            velocity: stored(cells.velocity),
            likelihood: stored(&shares),
            made: vec![S::default(); (1 + SEVEN) * plane],
        }
    }

    fn step(&mut self, cells: &Cells<'_>) {
        let mut planes = self.made.chunks_exact_mut(self.occupied.len());
        let made = std::array::from_fn(|_| planes.next().expect("internal: a plane for each number"));
        pulp::Arch::new().dispatch(Compact {
            extents: cells.extents,
            moves: cells.moves,
            epsilon: cells.epsilon,
            motion: cells.motion,
            occupied: &self.occupied,
            velocity: &self.velocity,
            likelihood: &self.likelihood,
            made,
        });
    }

    /// The largest difference from P(O = 1).
    fn error(&self, expected: &[f32]) -> f32 {
        let apart = |(made, expected): (&S, &f32)| (made.number() - expected).abs();
        self.made.iter().zip(expected).map(apart).fold(0.0, f32::max)
    }
}

/// Prints the table; `expected` is P(O = 1) of the step.
pub(crate) fn run(cells: &Cells<'_>, expected: &[f32], seconds: f64) {
    let plane = expected.len();
    let (mut single, mut short) = (Numbers::<f32>::of(cells), Numbers::<u16>::of(cells));
    single.step(cells);
    short.step(cells);
    let (error, error_short) = (single.error(expected), short.error(expected));
    assert!(error < 2e-5 && error_short < 1e-3, "{error} {error_short}");
    println!("  P(O = 1) of a step differs by at most {error:.1e} in f32, by {error_short:.1e} in 16 bits");
    let (read, mut made) = (vec![0.5f32; 11 * plane], vec![0.0f32; 9 * plane]);
    let mut tasks: Vec<Task<'_>> = vec![
        (
            "streams of nine planes",
            Box::new(|| {
                let mut planes = made.chunks_exact_mut(plane);
                let made = std::array::from_fn(|_| planes.next().expect("internal: nine planes"));
                let read = std::array::from_fn(|number| &black_box(&read)[number * plane..][..plane]);
                pulp::Arch::new().dispatch(Streams { read, made });
            }),
        ),
        ("compact, f32", Box::new(|| black_box(&mut single).step(cells))),
        ("compact, 16 bits", Box::new(|| black_box(&mut short).step(cells))),
    ];
    let bytes = 4 * (2 * (1 + SEVEN) + 1) * plane;
    let title = "layouts by hand, one thread: P(O = 1), P(V), one likelihood; bytes of f32";
    table(&Work { title, bytes, unit: ("ms", 1e3) }, 2.0 * seconds, &mut tasks);
}

//! The back ends: one list of programs, run by the interpreter and the lanes, in both precisions and with any number of
//! threads.
//!
//! In: kernels of the test programs, inputs of many sizes. Out: their outputs by each back end. Invariant: f64 lanes
//! agree with the interpreter to 1e-12, f32 lanes to 1e-5, and threads change no bit.

use crate::support::random::{Random, Tape};
use crate::support::{model_of, program};
use bp_core::compiler::exec::{Inputs, Lanes, Outputs, interpret, scalar::Scalar};
use bp_core::compiler::kernel::Kernel;
use bp_core::compiler::lower::lower;
use bp_core::compiler::plan::{Options, Route, plan};
use bp_core::compiler::space::{Edge, Moves, Space};

/// Numbers by name, in f64; converted to either precision.
#[derive(Default)]
struct Given {
    sizes: Vec<(String, usize)>,
    arrays: Vec<(String, Vec<f64>)>,
    grid: Option<(Space, Moves)>,
}

impl Given {
    fn size(mut self, name: &str, count: usize) -> Self {
        self.sizes.push((name.to_owned(), count));
        self
    }

    fn array(mut self, name: &str, values: Vec<f64>) -> Self {
        self.arrays.push((name.to_owned(), values));
        self
    }

    fn inputs<T: Scalar>(&self) -> Inputs<'_, T> {
        let mut inputs = Inputs::new();
        if let Some((space, moves)) = &self.grid {
            inputs = inputs.grid("Grid", space).displacements("Velocity", moves);
        }
        for (name, count) in &self.sizes {
            inputs = inputs.size(name, *count);
        }
        for (name, values) in &self.arrays {
            let values: Vec<T> = values.iter().map(|value| T::from_f64(*value)).collect();
            inputs = inputs.array(name, Box::leak(values.into_boxed_slice()));
        }
        inputs
    }
}

fn kernels(text: &str, question: &str, options: Options) -> Vec<Kernel> {
    let model = model_of(text);
    let plan = plan(&model, model.question(question).unwrap(), options).unwrap();
    let lowered = plan.routes.iter().map(|route| match route {
        Route::Exact(exact) => lower(&model, exact, question).unwrap().kernel,
        Route::Gaussian(_) => panic!("`{question}` has a closed form"),
        _ => panic!("`{question}` is not one kernel"),
    });
    lowered.collect()
}

fn on_threads<T: Scalar>(threads: usize, lanes: &Lanes, inputs: &Inputs<'_, T>) -> Outputs<T> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    pool.install(|| lanes.run(inputs).unwrap())
}

fn bits<T: Scalar>(outputs: &Outputs<T>) -> Vec<u64> {
    outputs.arrays.iter().flat_map(|(_, cells)| cells.iter().map(|cell| cell.to_f64().to_bits())).collect()
}

fn agree<T: Scalar>(what: &str, truth: &Outputs<f64>, found: &Outputs<T>, tolerance: f64) {
    assert_eq!(truth.arrays.len(), found.arrays.len());
    for ((name, truth), (other, found)) in truth.arrays.iter().zip(&found.arrays) {
        assert_eq!((name, truth.len()), (other, found.len()));
        for (cell, (p, q)) in truth.iter().zip(found).enumerate() {
            let q = q.to_f64();
            let close = *p == q
                || (p - q).abs() <= tolerance * p.abs().max(if tolerance > 1e-9 { 1.0 } else { 1e-3 });
            assert!(close, "{what}, {name:?}[{cell}]: {q}, expected {p}");
        }
    }
}

fn everywhere(what: &str, kernel: &Kernel, given: &Given) -> Outputs<f64> {
    let truth = interpret(kernel, &given.inputs()).unwrap_or_else(|error| panic!("{what}: {error}"));
    let lanes = Lanes::new(kernel.clone());
    let (double, single) = (given.inputs::<f64>(), given.inputs::<f32>());
    let (first, first_single) = (on_threads(1, &lanes, &double), on_threads(1, &lanes, &single));
    agree(what, &truth, &first, 1e-12);
    agree(what, &truth, &first_single, 1e-5);
    for threads in [2, 8] {
        assert_eq!(
            bits(&first),
            bits(&on_threads(threads, &lanes, &double)),
            "{what} with {threads} threads"
        );
        assert_eq!(
            bits(&first_single),
            bits(&on_threads(threads, &lanes, &single)),
            "{what} with {threads} threads"
        );
    }
    truth
}

/// Repeatable numbers in ]0, 1[.
fn noise(count: usize, mut seed: u64) -> Vec<f64> {
    let next = |_| {
        seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        ((seed >> 11) as f64 + 0.5) / (1u64 << 53) as f64
    };
    (0..count).map(next).collect()
}

#[test]
fn programs_without_a_plate() {
    let given = Given::default();
    for question in
        ["P(Rain | Wet)", "P(Rain Sprinkler Wet)", "entropy P(Rain | Wet)", "P(Rain = true | Wet = true)"]
    {
        let text = program("wet_grass").replace("P(Rain | Wet) }", &format!("{question} }}"));
        for ln_evidence in [false, true] {
            let options = Options { ln_evidence, ..Options::default() };
            kernels(&text, "rain", options).iter().for_each(|kernel| {
                everywhere(question, kernel, &given);
            });
        }
    }
}

/// Tables too large to be unrolled: rows and lanes of results, lanes of folds, computed indices.
#[test]
fn large_programs_without_a_plate() {
    let text = |asked: &str| {
        format!(
            "program Sums {{
                variables {{ A : 0..=70; B : 0..=40; Odd : bool; S : 0..=110; }}
                decomposition {{ P(A) P(B) P(Odd | A) P(S | A B) }}
                forms {{
                    P(A) = binomial(70, 0.3);
                    P(B) = weights(1 + B * B);
                    P(Odd | A) = dirac(mod(A, 2) == 1);
                    P(S | A B) = dirac(A + B);
                }}
                question q {{ {asked} }}
            }}"
        )
    };
    for asked in
        ["P(S)", "P(A | S)", "P(A B | S = 60)", "P(Odd | S)", "P(B | Odd = true)", "entropy P(A B | Odd)"]
    {
        for kernel in kernels(&text(asked), "q", Options::default()) {
            everywhere(asked, &kernel, &Given::default());
        }
    }
}

/// `Beyond` is never equal to `X[10]`: a sum over all `X`, too long to be unrolled, adds only zeros.
#[test]
fn a_loop_of_zeros() {
    let text = |asked: &str| {
        format!(
            "program Zeros {{
                variables {{ X[1..=10] : 0..=1; Beyond : 5..=6; A : 0..=20; }}
                decomposition {{ prod(i in 1..=10) {{ P(X[i]) }} P(Beyond | X) P(A | X Beyond) }}
                forms {{
                    P(X[i]) = uniform;
                    P(Beyond | X) = dirac(X[10]);
                    P(A | X Beyond) = binomial(20, if X[1] == 1 {{ 0.5 }} else {{ 0.25 }});
                }}
                question q {{ {asked} }}
            }}"
        )
    };
    for asked in ["P(A)", "max P(A)"] {
        for kernel in kernels(&text(asked), "q", Options::default()) {
            let truth = everywhere(asked, &kernel, &Given::default());
            assert!(truth.arrays[0].1.iter().all(|p| *p == 0.0), "{asked}: {truth:?}");
        }
    }
}

/// Y is uninformative about V if K is known; but it must be possible, and its density is e^−10⁶.
#[test]
fn a_density_below_all_numbers_is_possible() {
    let text = "program Far {
        variables { K, V : bool; Y : real; }
        decomposition { P(K) P(V | K) P(Y | K) }
        forms {
            P(K) = uniform;
            P(V | K) = table { 0.75, 0.25; 0.5, 0.5; };
            P(Y | K) = if K { normal(2, 0.0625) } else { exponential(5000) };
        }
        question q { P(V | K, Y = 90) }
    }";
    for kernel in kernels(text, "q", Options::default()) {
        let truth = everywhere("far", &kernel, &Given::default());
        assert_eq!(truth.arrays[0].1, [0.75, 0.25, 0.5, 0.5]);
    }
}

/// Lines of sight so long that their loops are not unrolled.
#[test]
fn long_rays() {
    let (rays, n) = (130, 40);
    let given = Given::default()
        .size("N", n)
        .size("Rays", rays)
        .array("sigma_min", vec![1.0])
        .array("sigma", noise(rays, 3).iter().map(|x| 0.3 + x).collect())
        .array("z", (0..rays).map(|ray| (ray % (n + 1)) as f64).collect());
    for question in ["P(Z | O C) }", "P(O | C, Z = z) }"] {
        let text = program("line_of_sight").replace("P(Z | O C) }", question);
        for kernel in kernels(&text, "reading", Options::default()) {
            everywhere(question, &kernel, &given);
        }
    }
}

#[test]
fn random_programs() {
    let mut tried = 0;
    for seed in 0..120 {
        let bytes: Vec<u8> = noise(160, seed).iter().map(|x| (x * 256.0) as u8).collect();
        let mut tape = Tape::new(&bytes);
        let made = Random::program(&mut tape);
        let ask = made.ask(&mut tape, true, true);
        let text = format!("{} question q {{ {ask} }} }}", made.text().trim_end_matches('}'));
        if bp_core::compiler::syntax::compile(&bp_core::compiler::source::Source::new("random", text.clone()))
            .is_ok()
        {
            tried += 1;
            for kernel in kernels(&text, "q", Options::default()) {
                everywhere(&text, &kernel, &Given::default());
            }
        }
    }
    assert!(tried > 40, "{tried}");
}

#[test]
fn rays_of_odd_numbers() {
    for rays in [1, 2, 127, 128, 129, 360, 9001] {
        for n in if rays > 1000 { 2..=2 } else { 7..=8 } {
            let given = Given::default()
                .size("N", n)
                .size("Rays", rays)
                .array("sigma_min", vec![1.0])
                .array("sigma", noise(rays, 3).iter().map(|x| 0.3 + x).collect());
            for kernel in kernels(&program("line_of_sight"), "reading", Options::default()) {
                everywhere(&format!("{rays} rays of {n}"), &kernel, &given);
            }
        }
    }
}

#[test]
fn one_reading_for_all_rays_or_one_for_each() {
    let text = program("line_of_sight").replace("P(Z | O C) }", "P(O | C, Z = z) }");
    let (rays, n) = (129, 6);
    let kernel = &kernels(&text, "reading", Options::default())[0];
    let given = |z: Vec<f64>| {
        Given::default()
            .size("N", n)
            .size("Rays", rays)
            .array("sigma_min", vec![1.0])
            .array("sigma", vec![0.6; rays])
            .array("z", z)
    };
    let one = everywhere("broadcast", kernel, &given(vec![3.0]));
    let all = everywhere("full", kernel, &given(vec![3.0; rays]));
    assert_eq!(one, all);
    let mixed = everywhere("mixed", kernel, &given((0..rays).map(|ray| (ray % (n + 1)) as f64).collect()));
    // \[c\]\[o\]\[ray\]: ray 3 has the common reading of all rays before.
    for row in 0..2 * n {
        assert_eq!(mixed.arrays[0].1[row * rays + 3], one.arrays[0].1[row * rays]);
    }
}

fn cell(extents: [usize; 3], edges: [Edge; 3], sensors: usize) -> Given {
    let space = Space::new(extents, edges).unwrap();
    let moves = [[0, 0, 0], [1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]];
    let (n, cells) = (moves.len(), space.cells());
    let occupied = noise(cells, 5);
    let mut velocity = noise(n * cells, 6);
    for cell in 0..cells {
        let total: f64 = (0..n).map(|v| velocity[v * cells + cell]).sum();
        (0..n).for_each(|v| velocity[v * cells + cell] /= total);
    }
    let given = Given { grid: Some((space.clone(), space.antecedents(&moves))), ..Given::default() };
    given
        .size("Sensors", sensors)
        .array("epsilon", vec![0.05])
        .array("previous O", occupied.iter().map(|p| 1.0 - p).chain(occupied.iter().copied()).collect())
        .array("previous V", velocity)
        .array("Sensors[i].reading", noise(sensors * n * 2 * cells, 8))
}

#[test]
fn cells_of_odd_grids() {
    let asks = "question all { P(O V | Z); P(O | Z); P(V | Z); entropy P(O V | Z) }";
    let text = program("cell").replace("question state { P(O V | Z) }", asks);
    let (pole, open) = ([Edge::Open, Edge::Pole, Edge::Circle], [Edge::Open; 3]);
    let grids = [
        ([1, 1, 1], open, 1),
        ([3, 1, 127], open, 2),
        ([2, 2, 128], pole, 1),
        ([1, 5, 129], [Edge::Open, Edge::Open, Edge::Circle], 1),
        ([2, 9, 360], pole, 2),
        ([1, 40, 6], pole, 3),
    ];
    for options in [Options::default(), Options { ln_evidence: true, ..Options::default() }] {
        for kernel in kernels(&text, "all", options) {
            for (extents, edges, sensors) in grids {
                everywhere(&format!("{extents:?}"), &kernel, &cell(extents, edges, sensors));
            }
        }
    }
}

#[test]
fn sounds_and_gazes() {
    let text = program("binaural")
        .replace("tau_max : real;", "tau_max, l_max : real;")
        .replace("question reading { P(Tau L | O) }", "question reading { P(Tau = tau | O) }");
    for (cells, channels) in [(127, 1), (516, 3), (4097, 1)] {
        let given = Given::default()
            .size("Grid", cells)
            .size("Channels", channels)
            .array("rate", vec![0.1])
            .array("tau_max", vec![2.0])
            .array("l_max", vec![3.0])
            .array("mu_tau", noise(cells, 1))
            .array("sigma_tau", noise(cells, 2).iter().map(|x| 0.5 + x).collect())
            .array("mu_l", noise(channels * cells, 3))
            .array("sigma_l", noise(channels * cells, 4).iter().map(|x| 0.5 + x).collect())
            .array("Tau", vec![0.3])
            .array("tau", noise(cells, 9))
            .array("L", noise(channels, 10));
        for question in ["source", "reading"] {
            for kernel in kernels(&text, question, Options::default()) {
                everywhere(question, &kernel, &given);
            }
        }
    }
    for extents in [[4, 3, 128], [5, 2, 130]] {
        let space = Space::new(extents, [Edge::Open, Edge::Pole, Edge::Circle]).unwrap();
        let cells = space.cells();
        let given =
            Given { grid: Some((space.clone(), space.antecedents(&[[0, 0, 0]]))), ..Given::default() }
                .array("map.P(O | C)", noise(cells, 11))
                .array("map.H", noise(cells, 12));
        for kernel in kernels(&program("gaze"), "look", Options::default()) {
            everywhere("gaze", &kernel, &given);
        }
    }
}

#[test]
fn numbers_of_a_field_over_the_plate_stand_in_the_order_of_its_indices() {
    // For four cells and three channels, as `bp learn` writes them: the last index fastest, wherever the plate is.
    let list = |count: usize, seed: u64| {
        let numbers: Vec<String> = noise(count, seed).iter().map(f64::to_string).collect();
        numbers.join(", ")
    };
    let text = format!(
        "program Field over C in Grid {{
            parameters {{ mu[Grid, Channels] : real = [{}]; nu[Channels, Grid] : real = [{}]; }}
            variables {{ S : bool; L[k in Channels] : real; }}
            decomposition {{ P(S) prod(k in Channels) {{ P(L[k] | S) }} }}
            forms {{ P(S) = uniform; P(L[k] | S) = normal(if S {{ mu[C, k] }} else {{ nu[k, C] }}, 1); }}
            question source {{ P(S | L = l) }}
        }}",
        list(12, 1),
        list(12, 2)
    );
    let given = Given::default().size("Grid", 4).size("Channels", 3).array("l", noise(3, 3));
    for kernel in kernels(&text, "source", Options::default()) {
        everywhere("a field over the plate", &kernel, &given);
        let inputs = Inputs::new().size("Grid", 4).size("Channels", 3);
        let l = noise(3, 3);
        let inputs = inputs.array("l", &l);
        let found = interpret(&kernel, &inputs).unwrap();
        let (mu, nu) = (noise(12, 1), noise(12, 2));
        let ln =
            |means: &dyn Fn(usize) -> f64| -> f64 { (0..3).map(|k| -0.5 * (l[k] - means(k)).powi(2)).sum() };
        let cells: Vec<f64> = (0..4)
            .map(|c| {
                let (yes, no) = (ln(&|k| mu[3 * c + k]).exp(), ln(&|k| nu[4 * k + c]).exp());
                yes / (yes + no)
            })
            .collect();
        let (_, answer) = &found.arrays[0];
        for (cell, expected) in cells.iter().enumerate() {
            assert!((answer[4 + cell] - expected).abs() < 1e-12, "{cell}: {answer:?} {expected}");
        }
        let wrong = Inputs::new().size("Grid", 5).size("Channels", 3).array("l", &l);
        assert!(interpret(&kernel, &wrong).is_err());
    }
}

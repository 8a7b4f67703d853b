//! Time of the gallery's answers: `cargo bench --bench gallery`.
//!
//! In: programs of `examples/`. Out: seconds for each answer. Invariant: a repeated question does not allocate, which
//! is asserted before it is timed.

use bp_core::compiler::answer::ask;
use bp_core::compiler::exec::Inputs;
use bp_core::compiler::source::Source;
use bp_core::compiler::syntax::{compile, parse_question};
use bp_macros::bayesian_program;
use criterion::Criterion;
use std::hint::black_box;

bayesian_program!("examples/water_unit.bp");
bayesian_program!("examples/boat.bp");
bayesian_program!("examples/boat_relaxed.bp");
bayesian_program!("examples/layered_network.bp");

fn water_unit_table(criterion: &mut Criterion) {
    let mut table = water_unit::output::Answer::<f64>::default();
    criterion.bench_function("water unit, 161 051 numbers, emitted", |bench| {
        bench.iter(|| water_unit::output().run_into(black_box(&mut table)).unwrap());
    });
    let model = water_unit::model();
    let question = model.question("output").expect("it is declared");
    criterion.bench_function("water unit, 161 051 named rows, from text", |bench| {
        bench.iter(|| ask(&model, question, &Inputs::new()).unwrap());
    });
}

fn boat_places(criterion: &mut Criterion) {
    let degrees = 1f64.to_degrees();
    let (mut three, mut six) =
        (boat::bearings::Answer::<f64>::default(), boat::all::Answer::<f64>::default());
    criterion.bench_function("boat, 101 x 101 places, three bearings", |bench| {
        bench.iter(|| boat::bearings().degrees(degrees).run_into(black_box(&mut three)).unwrap());
    });
    criterion.bench_function("boat, 101 x 101 places, all six readings", |bench| {
        bench.iter(|| boat::all().degrees(degrees).run_into(black_box(&mut six)).unwrap());
    });
    let mut along = boat_relaxed::along::Answer::<f64>::default();
    criterion.bench_function("boat, 101 places, distances summed out", |bench| {
        let inputs = boat_relaxed::along().degrees(degrees);
        bench.iter(|| inputs.run_into(black_box(&mut along)).unwrap());
    });
}

fn asked_again(criterion: &mut Criterion) {
    let mut answer = layered_network::effect::Answer::<f64>::default();
    let mut again = |number: usize| {
        let [a1, a2, a3, a4] = [0, 1, 2, 3].map(|bit| number >> bit & 1 == 1);
        let inputs = layered_network::effect().a1(a1).a2(a2).a3(a3).a4(a4);
        inputs.run_into(black_box(&mut answer)).unwrap();
    };
    again(0);
    let counted = allocation_counter::measure(|| (0..100_000).for_each(&mut again));
    assert_eq!(counted.count_total, 0, "allocations in 10^5 asks");
    criterion.bench_function("layers, compiled once, asked again", |bench| {
        let mut number = 0;
        bench.iter(|| {
            number += 1;
            again(number);
        });
    });
    let source = Source::new("layered_network", layered_network::SOURCE);
    criterion.bench_function("layers, from text to answer", |bench| {
        bench.iter(|| {
            let model = compile(&source).unwrap();
            let typed = Source::new("question", "P(D1 | A1 = true, A2 = false, A3 = true, A4 = false)");
            ask(&model, &parse_question(&typed, &model).unwrap(), &Inputs::new()).unwrap()
        });
    });
}

fn main() {
    let mut criterion = Criterion::default().sample_size(10).configure_from_args();
    water_unit_table(&mut criterion);
    boat_places(&mut criterion);
    asked_again(&mut criterion);
    criterion.final_summary();
}

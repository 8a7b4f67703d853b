//! Sharing between the asks of a question.
//!
//! In: the `observe` question of the cell: P(O), P(V) and two entropies, all of which know Z. Out: the nests of its
//! kernel. Invariant: each sum is computed once, whatever the number of asks that need it.

use bp_core::compiler::kernel::{Kernel, Reduce, Role};
use bp_core::compiler::lower::lower;
use bp_core::compiler::model::Model;
use bp_core::compiler::plan::{Options, plan};
use bp_core::compiler::source::Source;
use bp_core::compiler::syntax::compile;

fn observe() -> Kernel {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../bvm/models/cell.bp");
    let model: Model = compile(&Source::new(path, std::fs::read_to_string(path).unwrap())).unwrap();
    let plan = plan(&model, model.question("observe").unwrap(), Options::default()).unwrap();
    let [route] = plan.routes.as_slice() else { panic!("the asks share a pass") };
    assert_eq!(plan.places.iter().map(|places| places[0].ask).collect::<Vec<_>>(), [0, 1, 2, 3]);
    lower(&model, route.exact().expect("all is finite"), "observe").unwrap().kernel
}

#[test]
fn four_asks_make_one_total_and_each_marginal_once() {
    let kernel = observe();
    let sums = |word: &str| {
        let is_sum = |reduce: &Reduce| matches!(reduce, Reduce::Fold(..));
        let made =
            |name: &str| name == word || name.strip_prefix(word).is_some_and(|rest| rest.starts_with(' '));
        kernel
            .nests
            .iter()
            .filter(|nest| is_sum(&nest.reduce) && made(&kernel.buffers[nest.out].name))
            .count()
    };
    // P(O) is asked itself and for its entropy: two marginals, of O and of V. All four asks have the same total; the other
    // one is that of the weights of the motions.
    assert_eq!((sums("total"), sums("marginal")), (2, 2), "{:?}", names(&kernel));
    // No two nests are equal.
    for (place, nest) in kernel.nests.iter().enumerate() {
        let own = &kernel.buffers[nest.out];
        let same = kernel.nests[..place].iter().find(|other| {
            let buffer = &kernel.buffers[other.out];
            buffer.role == Role::Scratch
                && own.role == Role::Scratch
                && buffer.axes == own.axes
                && (&other.reduce, other.value) == (&nest.reduce, nest.value)
        });
        assert!(same.is_none(), "`{}` is computed twice", own.name);
    }
}

fn names(kernel: &Kernel) -> Vec<&str> {
    kernel.nests.iter().map(|nest| kernel.buffers[nest.out].name.as_str()).collect()
}

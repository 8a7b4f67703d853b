//! Random programs: every strategy, compared with enumeration.
//!
//! In: seeds. Out: for each a program, questions to it, and the answers of the strategies. Invariant: expected values
//! share no code with the library: they are sums over all assignments, and over all histories, from types of this test.
//!
//! The environment variable `PROGRAMS` sets the number of programs, `FIRST_SEED` the first seed.

mod back_ends;
mod enumerate;
mod estimated;
mod gaussian;
mod join_tree;
mod over_time;
mod program;
mod question;
mod random;
mod twofold;

use bp_core::compiler::answer::compile;
use bp_core::compiler::exec::Inputs;
use bp_core::compiler::model::Model;
use bp_core::compiler::source::Source;
use bp_core::compiler::syntax::{self, parse_question};
use program::{Domain, Program};
use random::{Limits, Random};
use rayon::prelude::*;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// The number of programs of a kind: a share of `PROGRAMS`, 2400 by default.
fn programs(share: f64) -> u64 {
    let all = std::env::var("PROGRAMS").map_or(2400.0, |count| count.parse().expect("PROGRAMS is a number"));
    (all * share).ceil() as u64
}

/// The first random program that the checker accepts, and its model; the checker refuses a Dirac that never has a
/// solution.
fn accepted(random: &mut Random, mut draw: impl FnMut(&mut Random) -> Program) -> (Program, Model) {
    loop {
        let program = draw(random);
        let text = program.text();
        let source = Source::new("random", text.as_str());
        match syntax::compile(&source) {
            Ok(model) => return (program, model),
            Err(wrong) => {
                let wrong = wrong.render(&source, false);
                assert!(wrong.contains("has no solution"), "{text}\n{wrong}");
            }
        }
    }
}

fn question_of(model: &Model, text: &str) -> bp_core::compiler::model::Question {
    let source = Source::new("question", text);
    parse_question(&source, model).unwrap_or_else(|wrong| panic!("{}", wrong.render(&source, false)))
}

/// Runs seeds in parallel; reports the failures with the smallest seeds.
fn all(count: u64, salt: u64, check: impl Fn(&mut Random) -> Result<(), String> + Sync) {
    let first = std::env::var("FIRST_SEED").map_or(0, |seed| seed.parse().expect("FIRST_SEED is a number"));
    let fails: Vec<String> = (first..first + count)
        .into_par_iter()
        .filter_map(|seed| {
            let verdict = catch_unwind(AssertUnwindSafe(|| check(&mut Random(seed ^ salt << 40))));
            let verdict = verdict.unwrap_or_else(|_| Err("panicked".to_owned()));
            verdict.err().map(|why| format!("seed {seed}: {why}"))
        })
        .collect();
    // The shortest messages first.
    let mut first: Vec<&str> = fails.iter().map(String::as_str).collect();
    first.sort_by_key(|why| why.len());
    first.truncate(4);
    assert!(fails.is_empty(), "{} of {count} programs:\n{}", fails.len(), first.join("\n\n"));
}

fn asked(random: &mut Random, limits: Limits) -> Result<(), String> {
    let (program, model) = accepted(random, |random| random::program(random, limits));
    let (text, joint) = (program.text(), enumerate::enumerate(&program));
    for _ in 0..4 {
        let ask = question::question(random, &program);
        let (words, given) = question::text(&program, &ask);
        let expected = enumerate::answer(&program, &joint, &ask);
        let question = question_of(&model, &words);
        let inputs = given.iter().fold(Inputs::new(), |inputs, (name, values)| inputs.array(name, values));
        let found = compile(&model, &question).and_then(|compiled| compiled.ask(&inputs));
        let context = |why: String| format!("{text}{words}\n{why}");
        question::verdict(&ask, &found, &expected).map_err(context)?;
        if random.one_in(3) {
            back_ends::verdict(&model, (&ask, &question), &given, random.one_in(4)).map_err(context)?;
        }
        if program.variables.iter().all(|variable| variable.domain != Domain::Real) {
            join_tree::verdict(&program, &model, &joint, &ask).map_err(context)?;
        }
    }
    Ok(())
}

#[test]
fn finite_programs_are_answered_as_by_enumeration() {
    let limits = Limits { variables: 8, assignments: 3000, families: true, reals: 0, carried: 0 };
    all(programs(0.5), 1, |random| asked(random, limits));
}

#[test]
fn observed_reals_are_weighed_as_by_enumeration() {
    let limits = Limits { variables: 5, assignments: 500, families: true, reals: 3, carried: 0 };
    all(programs(0.2), 2, |random| asked(random, limits));
}

#[test]
fn programs_over_time_are_answered_as_by_all_histories() {
    all(programs(0.3), 3, over_time::asked);
}

#[test]
fn linear_gaussian_programs_are_answered_as_by_conditioning() {
    all(programs(0.2), 4, gaussian::asked);
}

#[test]
fn estimates_are_within_their_errors_of_quadrature() {
    all(programs(0.02), 5, estimated::asked);
}

//! Random discrete programs, compared with enumeration.
//!
//! In: tapes from a seeded generator. Out: plan, lower and interpreter against the enumeration of the joint
//! distribution. Invariant: 1e-12, with and without evidence, for every rule of the planner and without each.

use crate::support::random::{Random, Tape};
use crate::support::{Table, brute, interpreted, without};
use bp_core::compiler::model::{Model, Question};
use bp_core::compiler::plan::Options;
use bp_core::compiler::source::Source;
use bp_core::compiler::syntax::compile;
use proptest::collection::vec;
use proptest::prelude::any;
use proptest::test_runner::{Config, RngAlgorithm, TestCaseError, TestError, TestRng, TestRunner};
use std::collections::BTreeMap;

const TOLERANCE: f64 = 1e-12;

fn runner(cases: u32) -> TestRunner {
    let config =
        Config { cases, failure_persistence: None, max_global_rejects: 100_000, ..Config::default() };
    TestRunner::new_with_rng(config, TestRng::deterministic_rng(RngAlgorithm::ChaCha))
}

/// A program and a question to it; `None` where the checker refuses them.
fn written(bytes: &[u8], asks: usize, each: bool) -> Option<(String, Model, Question)> {
    let mut tape = Tape::new(bytes);
    let program = Random::program(&mut tape);
    let asks: Vec<String> = (0..1 + tape.below(asks)).map(|_| program.ask(&mut tape, each, true)).collect();
    let text = format!("{} question q {{ {} }} }}", program.text().trim_end_matches('}'), asks.join("; "));
    let model = compile(&Source::new("random", text.clone())).ok()?;
    let question = model.question("q")?.clone();
    Some((text, model, question))
}

fn same(context: &str, found: &Table, expected: &Table) -> Result<(), TestCaseError> {
    let expected: BTreeMap<_, _> = expected.iter().cloned().collect();
    if found.len() != expected.len() {
        return Err(TestCaseError::fail(format!(
            "{context}: {} rows, expected {}",
            found.len(),
            expected.len()
        )));
    }
    for (values, p) in found {
        let Some(q) = expected.get(values) else {
            return Err(TestCaseError::fail(format!("{context}: no row {values:?} is expected")));
        };
        if p.is_nan() || (p - q).abs() > TOLERANCE {
            return Err(TestCaseError::fail(format!("{context}: {p} at {values:?}, expected {q}")));
        }
    }
    Ok(())
}

fn compare(text: &str, model: &Model, question: &Question, ln_evidence: bool) -> Result<(), TestCaseError> {
    let all = brute::enumerate(model);
    for (rule, rewrites) in without() {
        for (ask, table, ln) in
            interpreted(model, question, Options { rewrites, ln_evidence, ..Options::default() })
        {
            let (expected, mass) = brute::answer(model, &all, &ask);
            let context = format!("without {rule}: {}\n{text}", model.ask_text(&ask));
            same(&context, &table, &expected)?;
            if let Some(ln) = ln {
                let close =
                    if mass > 0.0 { (ln - mass.ln()).abs() <= TOLERANCE } else { ln == f64::NEG_INFINITY };
                if !close {
                    return Err(TestCaseError::fail(format!("{context}: ln {ln}, expected {}", mass.ln())));
                }
            }
        }
    }
    Ok(())
}

fn law(cases: u32, asks: usize, each: bool, ln_evidence: bool) {
    let outcome = runner(cases).run(&vec(any::<u8>(), 0..160), |bytes| {
        let Some((text, model, question)) = written(&bytes, asks, each) else {
            return Err(TestCaseError::reject("the checker refuses it"));
        };
        compare(&text, &model, &question, ln_evidence)
    });
    match outcome {
        Ok(()) => {}
        Err(TestError::Fail(reason, _)) => panic!("{reason}"),
        Err(TestError::Abort(reason)) => panic!("{reason}"),
    }
}

#[test]
fn answers_are_those_of_brute_force() {
    law(700, 1, false, false);
}

#[test]
fn tables_are_those_of_brute_force() {
    law(700, 1, true, false);
}

#[test]
fn so_is_the_probability_of_the_evidence() {
    law(400, 1, false, true);
}

#[test]
fn several_asks_share_a_pass_and_change_nothing() {
    law(400, 3, true, false);
}

#[test]
fn most_random_programs_are_accepted() {
    let accepted = std::cell::Cell::new(0);
    let count = |bytes: Vec<u8>| {
        accepted.set(accepted.get() + u32::from(written(&bytes, 1, true).is_some()));
        Ok(())
    };
    runner(300).run(&vec(any::<u8>(), 0..160), count).unwrap();
    assert!(accepted.get() > 150, "{} of 300", accepted.get());
}

//! Forms of many parents: sums, choices and noisy or are split into functions of few variables.
//!
//! In: programs made here. Out: answers in time linear in the parents. Invariant: expected numbers are convolutions, products
//! and enumerations computed here.

use bp_core::prelude::*;

fn close(found: f64, expected: f64, name: &str) {
    let scale = expected.abs().max(1e-300);
    assert!((found - expected).abs() < 1e-12 * scale, "{name}: {found}, expected {expected}");
}

fn names(count: usize) -> Vec<String> {
    (1..=count).map(|number| format!("C{number}")).collect()
}

/// A program of independent parents and one child.
fn program(parents: &[String], domain: &str, form: impl Fn(usize) -> String, child: [&str; 3]) -> Program {
    let factors: Vec<String> = parents.iter().map(|name| format!("P({name})")).collect();
    let forms: Vec<String> =
        (parents.iter().enumerate()).map(|(at, name)| format!("P({name}) = {};", form(at))).collect();
    let [name, values, of_child] = child;
    Program::parse(&format!(
        "program Many {{ variables {{ {} : {domain}; {name} : {values}; }}
         decomposition {{ {} P({name} | {}) }} forms {{ {} P({name} | {}) = {of_child}; }} }}",
        parents.join(", "),
        factors.join(" "),
        parents.join(" "),
        forms.join(" "),
        parents.join(" ")
    ))
    .unwrap()
}

#[test]
fn the_sum_of_forty_dice() {
    let dice = names(40);
    let sum = format!("dirac({})", dice.join(" + "));
    let program = program(&dice, "1..=6", |_| "uniform".to_owned(), ["S", "40..=240", &sum]);
    // The distribution of the sum of n dice, by convolution.
    let convolved = |count: usize| {
        (0..count).fold(vec![1.0], |before: Vec<f64>, _| {
            let mut after = vec![0.0; before.len() + 6];
            for (sum, p) in before.iter().enumerate() {
                (1..=6).for_each(|face| after[sum + face] += p / 6.0);
            }
            after
        })
    };
    let (all, other) = (convolved(40), convolved(39));
    let found = program.ask("P(S)").unwrap();
    for sum in [40, 100, 140, 240] {
        close(found.p(sum).unwrap(), all[sum as usize], "the sum");
    }
    let first = program.ask("P(C1 | S = 152)").unwrap();
    for face in 1..=6 {
        close(first.p(face).unwrap(), other[152 - face as usize] / 6.0 / all[152], "a die");
    }
    close(first.ln_evidence().unwrap(), all[152].ln(), "ln P");
    let marginals = program.marginals(&evidence! { S: 240 }).unwrap();
    assert_eq!(marginals.of("C37").unwrap().p(6).unwrap(), 1.0);
    assert!(marginals.of("C1 + C2").is_err(), "parts are not answers");
    let batch = program.batch(Cases::new().column("S", [240])).unwrap();
    assert_eq!(batch.columns.len(), 1 + 40 * 6 + 201);
    assert_eq!(batch.rows[0].as_ref().unwrap()[6], 1.0, "a six");
}

#[test]
fn one_of_two_dozen_faults() {
    let causes = names(24);
    let p = |at: usize| 0.001 * (at + 1) as f64;
    let none: f64 = (0..24).map(|at| 1.0 - p(at)).product();
    let or = format!("dirac({})", causes.join(" or "));
    let by_or = program(&causes, "bool", |at| format!("bernoulli({})", p(at)), ["X", "bool", &or]);
    let max = format!("dirac(max({}))", causes.join(", "));
    let of_numbers = |at: usize| format!("categorical({}, {})", 1.0 - p(at), p(at));
    let by_max = program(&causes, "0..=1", of_numbers, ["X", "0..=1", &max]);
    for (found, value) in [
        (by_or.ask("P(C5 | X = true)").unwrap(), Value::from(true)),
        (by_max.ask("P(C5 | X = 1)").unwrap(), Value::from(1)),
    ] {
        close(found.p(value).unwrap(), p(4) / (1.0 - none), "a cause");
        close(found.ln_evidence().unwrap(), (1.0 - none).ln(), "ln P");
    }
}

#[test]
fn a_noisy_or_and_a_noisy_and_of_many() {
    let causes = names(24);
    let (p, q, leak) = (|at: usize| 0.02 * (at + 1) as f64, |at: usize| 0.9 - 0.03 * at as f64, 0.01);
    let pairs: Vec<String> = (0..causes.len()).map(|at| q(at).to_string()).collect();
    let or = format!("noisy_or({}, {leak})", pairs.join(", "));
    let program_of =
        |form: &str| program(&causes, "bool", |at| format!("bernoulli({})", p(at)), ["X", "bool", form]);
    // P(X = false | C) = (1 − leak) Π (1 − q)^C, and the causes are independent.
    let factor = |at: usize| 1.0 - p(at) * q(at);
    let no_effect: f64 = (1.0 - leak) * (0..24).map(factor).product::<f64>();
    let program = program_of(&or);
    close(program.ask("P(X)").unwrap().p(false).unwrap(), no_effect, "noisy or");
    let without = no_effect / factor(6) * (1.0 - q(6));
    let cause = program.ask("P(C7 | X = true)").unwrap();
    close(cause.p(true).unwrap(), p(6) * (1.0 - without) / (1.0 - no_effect), "a cause");
    let by_tree = program.marginals(&evidence! { X: false }).unwrap();
    close(by_tree.of("C7").unwrap().p(true).unwrap(), p(6) * without / no_effect, "by a join tree");
    // P(X = true | C) = (1 − leak) Π (1 − q)^(1 − C).
    let and = format!("noisy_and({}, {leak})", pairs.join(", "));
    let effect: f64 = (1.0 - leak) * (0..24).map(|at| 1.0 - (1.0 - p(at)) * q(at)).product::<f64>();
    close(program_of(&and).ask("P(X)").unwrap().p(true).unwrap(), effect, "noisy and");
}

#[test]
fn what_is_split_is_what_is_enumerated() {
    // 17 causes have 2¹⁷ combinations, which are gone through here.
    let causes = names(17);
    let p = |at: usize| 0.03 + 0.05 * at as f64;
    let (q, leak) = (|at: usize| 0.8 - 0.04 * at as f64, 0.125);
    let pairs: Vec<String> = (0..causes.len()).map(|at| q(at).to_string()).collect();
    let weighted: Vec<String> =
        causes.iter().enumerate().map(|(at, name)| format!("{} * {name}", at % 3 + 1)).collect();
    let noisy = program(
        &causes,
        "bool",
        |at| format!("bernoulli({})", p(at)),
        ["X", "bool", &format!("noisy_or({}, {leak})", pairs.join(", "))],
    );
    let many = program(
        &causes,
        "0..=1",
        |at| format!("categorical({}, {})", 1.0 - p(at), p(at)),
        ["X", "bool", &format!("dirac({} > 17)", weighted.join(" + "))],
    );
    let (mut effect, mut with, mut above, mut above_with) = (0.0, 0.0, 0.0, 0.0);
    let (mut best, mut most) = (0, 0.0);
    for all in 0..1u32 << 17 {
        let is = |at: usize| all >> at & 1 == 1;
        let prior: f64 = (0..17).map(|at| if is(at) { p(at) } else { 1.0 - p(at) }).product();
        let quiet: f64 = (0..17).filter(|at| is(*at)).map(|at| 1.0 - q(at)).product();
        let joint = prior * (1.0 - (1.0 - leak) * quiet);
        effect += joint;
        with += if is(2) { joint } else { 0.0 };
        if joint > most {
            (best, most) = (all, joint);
        }
        let sum: usize = (0..17).filter(|at| is(*at)).map(|at| at % 3 + 1).sum();
        let joint = if sum > 17 { prior } else { 0.0 };
        above += joint;
        above_with += if is(2) { joint } else { 0.0 };
    }
    let (yes, one) = (Value::from(true), Value::from(1));
    for (program, value, total, third) in [(&noisy, yes, effect, with), (&many, one, above, above_with)] {
        let found = program.ask("P(C3 | X = true)").unwrap();
        assert!((found.p(value).unwrap() - third / total).abs() < 1e-12);
        assert!((found.ln_evidence().unwrap() - total.ln()).abs() < 1e-12);
    }
    // The most probable values of all causes together are a maximum, not a sum over the parts.
    let mode = noisy.most_probable(&evidence! { X: true }).unwrap();
    let mode = mode.mode().unwrap();
    for (at, name) in causes.iter().enumerate() {
        assert_eq!(mode[name.as_str()], Value::from(best >> at & 1 == 1), "{name}");
    }
}

//! Subroutines: a question to another program as a form.
//!
//! In: files of several programs. Out: answers. Invariant: the answer equals that of the same program without
//! subroutines.

use crate::support::{all_close, model_of, question};
use bp_core::compiler::answer::ask;
use bp_core::compiler::exec::Inputs;

fn p(text: &str, asked: &str) -> Vec<f64> {
    let model = model_of(text);
    let answers =
        ask(&model, &question(&model, asked), &Inputs::new()).unwrap_or_else(|error| panic!("{error}"));
    answers[0].answer.iter().map(|row| row.p().unwrap()).collect()
}

const TOWNS: &str = "
    program Paris { variables { Rain : bool; } decomposition { P(Rain) } forms { P(Rain) = bernoulli(0.3); } question rain { P(Rain) } }
    program Nice { variables { Rain : bool; } decomposition { P(Rain) } forms { P(Rain) = bernoulli(0.1); } question rain { P(Rain) } }
    program Garden {
        variables { Town : { InParis, InNice }; Rain, Sprinkler, Wet : bool; }
        decomposition { P(Town) P(Rain | Town) P(Sprinkler | Rain) P(Wet | Rain Sprinkler) }
        forms {
            P(Town) = uniform;
            P(Rain | Town) = if Town == InParis { ask(Paris.rain) } else { ask(Nice.rain) };
            P(Sprinkler | Rain) = bernoulli(if Rain { 0.1 } else { 0.9 });
            P(Wet | Rain Sprinkler) = dirac(Rain or Sprinkler);
        }
    }";

#[test]
fn a_subroutine_is_chosen_by_a_variable() {
    // .3/(.3 + .7·.9) and .1/(.1 + .9·.9)
    all_close(&p(TOWNS, "P(Rain = true | Wet = true, Town = InParis)"), &[0.3 / 0.93]);
    all_close(&p(TOWNS, "P(Rain = true | Wet = true, Town = InNice)"), &[0.1 / 0.91]);
    all_close(&p(TOWNS, "P(Wet = true | Town)"), &[0.93, 0.91]);
    let without =
        TOWNS.replace("ask(Paris.rain)", "bernoulli(0.3)").replace("ask(Nice.rain)", "bernoulli(0.1)");
    for asked in
        ["P(Town | Wet = true)", "P(Rain, Town | Wet = true, Sprinkler = false)", "P(Wet | Rain, Town)"]
    {
        all_close(&p(TOWNS, asked), &p(&without, asked));
    }
}

#[test]
fn a_subroutine_receives_the_known_variables_of_its_question() {
    let unit = "
        program Unit {
            variables { I, F, O : 0..=3; } decomposition { P(I) P(F) P(O | I F) }
            forms { P(I) = uniform; P(F) = categorical(0.1, 0.2, 0.3, 0.4); P(O | I F) = dirac(floor((I + F) / 2)); }
            question output { P(O | I) }
        }";
    let chain = "
        program Chain {
            variables { I, M, O : 0..=3; } decomposition { P(I) P(M | I) P(O | M) }
            forms { P(I) = uniform; P(M | I) = ask(Unit.output); P(O | M) = ask(Unit.output | M); }
        }";
    // P(M | I = 1) = (.1, .5, .4, 0), and P(O | M) = (.3, .7, 0, 0), (.1, .5, .4, 0), (0, .3, .7, 0) for M = 0, 1, 2.
    all_close(&p(&format!("{unit}{chain}"), "P(O | I = 1)"), &[0.08, 0.44, 0.48, 0.0]);
}

#[test]
fn a_context_that_a_subroutine_excludes_is_read_from_its_factors() {
    // In Sub K is always false; in the calling program it is not.
    let text = "program Sub { variables { K, S : bool; } decomposition { P(K) P(S | K) }
            forms { P(K) = bernoulli(0); P(S | K) = bernoulli(if K { 0.9 } else { 0.2 }); } question s { P(S | K) } }
        program Main { variables { K, S : bool; } decomposition { P(K) P(S | K) }
            forms { P(K) = bernoulli(0.5); P(S | K) = ask(Sub.s); } }";
    all_close(&p(text, "P(S)"), &[0.45, 0.55]);
    all_close(&p(text, "P(K | S = true)"), &[0.1 / 0.55, 0.45 / 0.55]);
    // The same as a transition and as an observation over time: shut with certainty, then observed.
    let text = "program Sub { variables { K, S : bool; } decomposition { P(K) P(S | K) }
            forms { P(K) = bernoulli(0); P(S | K) = bernoulli(if K { 0.9 } else { 0.2 }); } question s { P(S | K) } }
        program Main { variables { X, X^-1, Z : bool; } decomposition { P(X^-1) P(X | X^-1) P(Z | X) }
            forms { P(X^-1) = previous(X) else bernoulli(1); P(X | X^-1) = ask(Sub.s | X^-1); P(Z | X) = ask(Sub.s | X); } }";
    let model = model_of(text);
    let rows = vec![vec![("Z".to_owned(), 1.0)]];
    let asked = question(&model, "filter P(X | Z)");
    let sampling = bp_core::compiler::sample::Sampling::default();
    let answers =
        bp_core::compiler::answer::ask_over_time(&model, &asked, &rows, &Inputs::new(), sampling).unwrap();
    let found: Vec<f64> = answers[0].answer.iter().map(|row| row.p().unwrap()).collect();
    // 0.1 · 0.2 and 0.9 · 0.9.
    all_close(&found, &[0.02 / 0.83, 0.81 / 0.83]);
}

#[test]
fn a_context_without_an_answer_is_impossible_also_where_it_is_not_asked() {
    let sub = "program Sub { variables { X, Y : 0..=2; } decomposition { P(X) P(Y | X) }
        forms { P(X) = uniform; P(Y | X) = dirac(X + 1); } question y { P(Y | X) } }";
    let main = "program Main { variables { A, B : 0..=2; } decomposition { P(A) P(B | A) }
        forms { P(A) = uniform; P(B | A) = ask(Sub.y | A); } }";
    // Of A = 2 there is no Y.
    all_close(&p(&format!("{sub}{main}"), "P(A)"), &[0.5, 0.5, 0.0]);
}

//! Names: any that the checker accepts, whatever they mean in Rust.

use bp_core::compiler::source::Source;
use bp_core::compiler::syntax::compile;
use bp_macros::bayesian_program;

// The keywords of every edition, and words of the prelude and of the emitted code itself.
bayesian_program! {
    program crate {
        parameters { self : probability = 0.25; Self : probability = 0.5; T : real = 1; number : real = 1; }
        variables { super, async, gen, dyn, union, Vec, Some, inputs, outputs, l, e0, m1 : bool; }
        decomposition {
            P(super) P(async) P(gen) P(dyn) P(union) P(Vec) P(Some) P(inputs) P(outputs) P(l) P(e0)
            P(m1 | super async gen dyn union Vec Some inputs outputs l e0)
        }
        forms {
            P(super) = bernoulli(self); P(async) = bernoulli(Self); P(gen) = uniform; P(dyn) = uniform; P(union) = uniform;
            P(Vec) = uniform; P(Some) = uniform; P(inputs) = uniform; P(outputs) = uniform; P(l) = uniform; P(e0) = uniform;
            P(m1 | super async gen dyn union Vec Some inputs outputs l e0) = bernoulli(if super { number * T / 2 } else { 0 });
        }
        question run { P(super | m1 = crate) }
        question Inputs { P(async gen dyn union | Vec = fn, Some = type, inputs = where, outputs = move) }
        question Outputs { P(super l e0 | m1 = t) }
        question f64 { P(super | async gen = unsafe) }
        question Option { argmax P(super | Vec = try) }
        question model { P(super) }
        question SOURCE { P(async) }
        question Self { P(gen) }
        question usize { P(dyn) }
    }
}

// Unicode: names that are different identifiers in Rust, names that are not identifiers, and names that become equal.
bayesian_program! {
    program "Straße ① → ½" {
        parameters {
            "rate²" : probability = 0.25; rate2 : probability = 0.5; RATE2 : probability = 0.75;
            ß : probability = 0.125; ss : probability = 0.375; "two words" : probability = 0.5;
        }
        variables { "m²", m2, "½", "①", "→", "\"q\"\\", "line\nend", 温度, Größe : bool; }
        decomposition {
            P("m²") P(m2) P("½" | "m²") P("①" | m2) P("→") P("\"q\"\\") P("line\nend") P(温度) P(Größe | 温度)
        }
        forms {
            P("m²") = bernoulli("rate²"); P(m2) = bernoulli(rate2); P("½" | "m²") = bernoulli(RATE2);
            P("①" | m2) = bernoulli(if m2 { ß } else { ss }); P("→") = bernoulli("two words");
            P("\"q\"\\") = uniform; P("line\nend") = uniform; P(温度) = uniform;
            P(Größe | 温度) = bernoulli(if 温度 { 0.9 } else { 0.3 });
        }
        question "m²" { P("m²") }
        question m2 { P(m2 "m²" | "½" = true) }
        question M2 { P("→" "\"q\"\\" | "line\nend" = true) }
        question "→" { P("①") }
        question "←" { P(温度 | Größe = groß) }
    }
}

/// Code without a prelude.
mod bare {
    #![no_implicit_prelude]

    ::bp_macros::bayesian_program! {
        program Bare over c in Cells {
            parameters { N : size; loud[Cells] : probability; rate : probability = 0.25; }
            variables { S : 0..=2; K : 1..=N; A : circle(0, 360, 4); H : bool; }
            decomposition { P(S) P(K | S) P(A | S) P(H | S) }
            forms {
                P(S) = categorical(0.5, 0.25, 0.25);
                P(K | S) = weights(K + S);
                P(A | S) = von_mises(90 * S, 2);
                P(H | S) = bernoulli(if S == 0 { rate } else { loud[c] });
            }
            question all { P(S | H = h, K = k, A = a); entropy P(S | H = h, K = k, A = a) }
            question best { argmax P(S | H = h) }
            question drawn { draw(3) P(S) }
        }
    }
    ::bp_macros::bayesian_program! {
        program Large {
            variables { X : 0..=40; Y : 0..=31; Z : bool; }
            decomposition { P(X) P(Y | X) P(Z | X Y) }
            forms { P(X) = uniform; P(Y | X) = weights(1 + X + Y); P(Z | X Y) = bernoulli(1 / (1 + X + Y)); }
            question all { P(X Y) }
            question some { P(X | Y = y, Z = z) }
        }
    }
    ::bp_macros::bayesian_program! {
        program Line {
            variables { X, Y : real; }
            decomposition { P(X) P(Y | X) }
            forms { P(X) = normal(0, 1); P(Y | X) = normal(X, 1); }
            question x { P(X | Y) }
        }
    }

    #[test]
    fn emitted_code_needs_no_prelude() {
        let all = ::core::result::Result::unwrap(large::all().ask());
        let total: f64 = ::core::iter::Iterator::sum(all.distribution().iter());
        ::core::assert!((total - 1.0).abs() < 1e-12);
        ::core::assert!(line::x().filter().is_ok());
        ::core::assert_eq!(bare::model().name, "Bare");
    }
}

#[test]
fn keywords_and_words_of_the_prelude_are_names() {
    assert_eq!((crate_::DEFAULT_SELF_, crate_::DEFAULT_SELF_2), (0.25, 0.5));
    let answer = crate_::run().crate_(true).ask().unwrap();
    assert_eq!((answer.p(false), answer.p(true)), (0.0, 1.0));
    assert_eq!(crate_::self_().ask().unwrap().p(true), 0.5);
    assert_eq!(crate_::usize().ask().unwrap().p(true), 0.5);
    // The function `model` returns the program: the question of that name gets a number.
    assert_eq!(crate_::model_2().ask().unwrap().p(true), 0.25);
}

#[test]
fn names_that_are_one_in_rust_get_a_number_and_others_are_spelled() {
    use straße_1_1_2 as units;
    assert_eq!((units::DEFAULT_RATE2, units::DEFAULT_RATE2_2, units::DEFAULT_RATE2_3), (0.25, 0.5, 0.75));
    assert_eq!((units::DEFAULT_SS, units::DEFAULT_SS_2, units::DEFAULT_TWO_WORDS), (0.125, 0.375, 0.5));
    let answer = units::m2().rate2(0.25).ask().unwrap();
    assert_eq!((answer.p(false), answer.p(true)), (0.75, 0.25));
    let text = compile(&Source::new("units", units::SOURCE)).unwrap();
    assert_eq!(text, units::model());
}

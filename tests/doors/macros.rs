//! The macro `bayesian_program!`: its output, and its error messages.
//!
//! In: programs written here and in files, and the wrong ones of `tests/macros`. Out: models equal to those of the
//! text, and the compiler's messages, stored next to each wrong program. Invariant: an error is reported at its own
//! tokens; the module causes no lint in the surrounding code.
#![deny(warnings, missing_docs, unused, unreachable_pub, clippy::all, clippy::pedantic)]

use bp_core::compiler::source::Source;
use bp_core::compiler::syntax::compile;
use bp_macros::bayesian_program;
use std::path::Path;

bayesian_program! {
    /// Is it the "rain" or the sprinkler?
    program WetGrass {
        variables { Rain, Sprinkler, Wet : bool; }
        decomposition { P(Rain) P(Sprinkler | Rain) P(Wet | Rain Sprinkler) } // a comment
        forms {
            P(Rain)             = bernoulli(0.3);
            P(Sprinkler | Rain) = bernoulli(if Rain { 0.1 } else { 0.9 });
            P(Wet | Rain Sprinkler) = dirac(Rain or Sprinkler);
        }
        question rain { P(Rain | Wet) }
    }
}

mod files {
    //! Programs in files, through the macro.
    use bp_macros::bayesian_program;

    bayesian_program!("bvm/models/binaural.bp");
    bayesian_program!("bvm/models/vestibular.bp");
    bayesian_program!("tests/programs/cell.bp");
    bayesian_program!("tests/programs/gaze.bp");
    bayesian_program!("tests/programs/line_of_sight.bp");
    bayesian_program!("tests/programs/wet_grass.bp");
}

macro_rules! coin {
    ($name:ident, $rate:expr) => {
        bayesian_program! {
            program $name {
                variables { Heads, Again : bool; }
                decomposition { P(Heads) P(Again | Heads) }
                forms { P(Heads) = bernoulli(2 * $rate); P(Again | Heads) = uniform; }
                question heads { P(Heads | Again) }
            }
        }
    };
}

coin!(Loop, 0.125 + 0.125);

#[test]
fn the_text_is_as_it_was_written() {
    let written = wet_grass::SOURCE;
    assert!(written.starts_with(
        "/// Is it the \"rain\" or the sprinkler?\n    program WetGrass {\n        variables {"
    ));
    assert!(written.contains("P(Rain)             = bernoulli(0.3);"), "{written}");
    assert_eq!(compile(&Source::new("written", written)).unwrap(), wet_grass::model());
}

#[test]
fn a_question_is_a_function() {
    let answer = wet_grass::rain().ask().unwrap();
    // P(Rain | Wet): it is wet when it rains, and without rain when the sprinkler runs.
    let wet = 0.3 / (0.3 + 0.7 * 0.9);
    assert!((answer.p(true, true) - wet).abs() < 1e-12, "{answer:?}");
    assert!(answer.p(true, false).abs() < f64::MIN_POSITIVE);
}

#[test]
fn a_program_may_stand_in_a_function() {
    bayesian_program! {
        program Die {
            variables { Face : 1..=6; Low : bool; }
            decomposition { P(Face) P(Low | Face) }
            forms { P(Face) = uniform; P(Low | Face) = dirac(Face <= 3); }
            question low { P(Low) }
        }
    }
    assert_eq!(die::model().name, "Die");
}

#[test]
fn tokens_passed_by_other_macros_stay_together() {
    let text = "program Loop {
        variables { Heads, Again : bool; }
        decomposition { P(Heads) P(Again | Heads) }
        forms { P(Heads) = bernoulli(2 * (0.125 + 0.125)); P(Again | Heads) = uniform; }
        question heads { P(Heads | Again) }
    }";
    assert_eq!(compile(&Source::new("text", text)).unwrap(), loop_::model());
}

#[test]
fn files_and_text_mean_the_same() {
    let models = [
        ("bvm/models/binaural.bp", files::binaural::model()),
        ("bvm/models/vestibular.bp", files::vestibular::model()),
        ("tests/programs/cell.bp", files::cell::model()),
        ("tests/programs/gaze.bp", files::gaze::model()),
        ("tests/programs/line_of_sight.bp", files::line_of_sight::model()),
        ("tests/programs/wet_grass.bp", files::wet_grass::model()),
    ];
    for (path, model) in models {
        let text = std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join(path)).unwrap();
        assert_eq!(compile(&Source::new(path, text)).unwrap(), model, "{path}");
    }
}

#[test]
fn mistakes_are_reported_in_their_places() {
    // The wrong programs are compiled as a package of their own in this folder, where their paths start too. With
    // `TRYBUILD=overwrite` the compiler's messages are stored anew.
    let package =
        Path::new(env!("CARGO_TARGET_TMPDIR")).join("../tests/trybuild").join(env!("CARGO_PKG_NAME"));
    std::fs::create_dir_all(&package).unwrap();
    for file in ["wrong.bp", "not_utf8.bp"] {
        std::fs::copy(Path::new("tests/macros").join(file), package.join(file)).unwrap();
    }
    trybuild::TestCases::new().compile_fail("tests/macros/*.rs");
}

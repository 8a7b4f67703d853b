//! The Bayesian Programs of the map, compiled with the crate.
//!
//! In: the files of `models/`, which contain all probabilities of the map. Out: a module for each. Invariant: no other
//! file of this crate contains a probability of the map.

use bp_macros::bayesian_program;

bayesian_program!("models/cell.bp");
bayesian_program!("models/cell_joint.bp");
bayesian_program!("models/change.bp");
bayesian_program!("models/line_of_sight.bp");
bayesian_program!("models/range_code.bp");
bayesian_program!("models/population_code.bp");
bayesian_program!("models/missing.bp");
bayesian_program!("models/binaural.bp");
bayesian_program!("models/ear.bp");
bayesian_program!("models/listening.bp");
bayesian_program!("models/voices.bp");
bayesian_program!("models/voice.bp");
bayesian_program!("models/sounding.bp");
bayesian_program!("models/stereo_error.bp");
bayesian_program!("models/vestibular.bp");
bayesian_program!("models/inertial.bp");
bayesian_program!("models/rest.bp");
bayesian_program!("models/self_motion.bp");
bayesian_program!("models/tilt_translation.bp");
bayesian_program!("models/gaze.bp");
bayesian_program!("models/paper.bp");
bayesian_program!("models/inhibited.bp");
bayesian_program!("models/readable.bp");
bayesian_program!("models/entropy_in_view.bp");
bayesian_program!("models/information_gain.bp");
bayesian_program!("models/attention.bp");
bayesian_program!("models/null.bp");
bayesian_program!("models/random.bp");
bayesian_program!("models/sweep.bp");
bayesian_program!("models/view.bp");

/// `models/scanline.bp`. No code is emitted for its question, which is over time: it is compiled at run time.
pub mod scanline {
    use bp_core::compiler::model::Model;
    use bp_core::compiler::source::Source;

    /// The program's text.
    pub const SOURCE: &str = include_str!("../models/scanline.bp");

    /// The program's model.
    pub fn model() -> Model {
        let source = Source::new("Scanline", SOURCE);
        bp_core::compiler::syntax::compile(&source).expect("internal: a test compiles it")
    }
}

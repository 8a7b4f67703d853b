//! The derivation of a linear-Gaussian answer: the joint normal law, its step in time, its conditioning.
//!
//! In: the variables carried and observed. Out: lines with equations in Unicode, LaTeX and MathML. Invariant: the equations are
//! those that the strategy computes.

use crate::equation::{CLOSE, OPEN};
use crate::ids::VariableId;
use crate::model::Model;

/// The lines that derive the posterior, with their equations in the three notations.
pub(super) fn lines(
    model: &Model,
    carried: &[(VariableId, VariableId)],
    observed: &[VariableId],
) -> Vec<(String, String, [String; 3])> {
    let names = |ids: &mut dyn Iterator<Item = VariableId>| {
        ids.map(|id| model.variable_name(id)).collect::<Vec<_>>().join(" ")
    };
    let observed = names(&mut observed.iter().copied());
    let mut lines = vec![(
        "linear and Gaussian".to_owned(),
        "every form is normal or a Dirac, with a mean that is linear in its parents: the joint law is normal"
            .to_owned(),
        [
            "∫ N(x; m, Σ) over the free variables, given the observed ones".to_owned(),
            "\\int \\mathcal{N}(x; m, \\Sigma)".to_owned(),
            format!("<mo>∫</mo>{}", mathml_normal("<mi>m</mi>", "<mi>Σ</mi>")),
        ],
    )];
    if !carried.is_empty() {
        let carried = names(&mut carried.iter().map(|(_, previous)| *previous));
        lines.push((
            "prediction".to_owned(),
            format!("`{carried}` has the distribution of the previous instant; each factor extends it"),
            [
                "N(x; A m⁻¹ + a, A Σ⁻¹ Aᵀ + Q)".to_owned(),
                "\\mathcal{N}(x;\\, A m^{-1} + a,\\, A \\Sigma^{-1} A^{\\top} + Q)".to_owned(),
                mathml_normal(
                    &format!("<mi>A</mi>{}<mo>+</mo><mi>a</mi>", before("m")),
                    &format!(
                        "<mi>A</mi>{}<msup><mi>A</mi><mo>⊤</mo></msup><mo>+</mo><mi>Q</mi>",
                        before("Σ")
                    ),
                ),
            ],
        ));
    }
    lines.push((
        "conditioning".to_owned(),
        format!("`{observed}` is observed as z = H x: K is the gain"),
        [
            "N(x; m + K (z − H m), Σ − K H Σ), K = Σ Hᵀ (H Σ Hᵀ)⁻¹".to_owned(),
            "\\mathcal{N}(x;\\, m + K(z - Hm),\\, \\Sigma - K H \\Sigma),\\quad K = \\Sigma H^{\\top} (H \\Sigma \
             H^{\\top})^{-1}"
                .to_owned(),
            format!("{}<mo separator=\"true\">,</mo> {GAIN}", mathml_normal(
                &format!(
                    "<mi>m</mi><mo>+</mo><mi>K</mi>{OPEN}<mi>z</mi><mo>−</mo><mi>H</mi><mi>m</mi>{CLOSE}"
                ),
                "<mi>Σ</mi><mo>−</mo><mi>K</mi><mi>H</mi><mi>Σ</mi>",
            )),
        ],
    ));
    lines
}

/// The gain in MathML.
const GAIN: &str = "<mi>K</mi><mo>=</mo><mi>Σ</mi><msup><mi>H</mi><mo>⊤</mo></msup><msup><mrow><mo>(</mo><mi>H</mi><mi>Σ</mi>\
    <msup><mi>H</mi><mo>⊤</mo></msup><mo>)</mo></mrow><mrow><mo>−</mo><mn>1</mn></mrow></msup>";

/// N(x; mean, covariance) in MathML.
fn mathml_normal(mean: &str, covariance: &str) -> String {
    let comma = "<mo separator=\"true\">,</mo>";
    format!(
        "<mrow><mi>𝒩</mi>{OPEN}<mi>x</mi><mo separator=\"true\">;</mo>{mean}{comma}{covariance}{CLOSE}</mrow>"
    )
}

/// A letter of the previous instant in MathML.
fn before(letter: &str) -> String {
    format!("<msup><mi>{letter}</mi><mrow><mo>−</mo><mn>1</mn></mrow></msup>")
}

//! The derivation of an answer over time, in the program's own names.
//!
//! In: a route. Out: its lines: the messages forward and backward and their product, or the Kalman filter with its gain,
//! or the steps of the particles. Invariant: the equations are those that the strategy computes, up to its scales.
//!
//! Rabiner, *Proc. IEEE* 77, 1989: α, β and their product; Viterbi's maxima. Rauch, Tung and Striebel, *AIAA J.* 3, 1965:
//! the smoother of a Kalman filter.

use super::offer::{By, OverTime};
use super::parts::Instant;
use crate::equation::{Line, Notation};
use crate::ids::VariableId;
use crate::model::{Model, Statistic, When};

impl OverTime {
    /// The computation of each instant, as lines.
    pub(crate) fn derivation(&self, model: &Model, notation: Notation) -> Vec<Line> {
        let instant = Instant {
            model,
            notation,
            now: self.carried.iter().map(|(now, _)| *now).collect(),
            before: self.carried.iter().map(|(_, before)| *before).collect(),
            observed: self.observed(model).into_iter().collect(),
            searched: self.ask().searched.iter().map(|item| item.variable).collect(),
        };
        match &self.by {
            By::Chain => self.chain(&instant),
            By::Gaussian(_) => self.kalman(&instant, false),
            By::Extended => self.kalman(&instant, true),
            By::Particles { reason, linear, guided } => self.particles(&instant, reason, linear, *guided),
        }
    }

    /// Messages of finite states.
    fn chain(&self, at: &Instant<'_>) -> Vec<Line> {
        let notation = at.notation;
        let first = |(now, before): (&VariableId, &VariableId)| {
            let starts =
                at.model.factor_of(*now).is_some_and(|factor| at.model.factors[factor].form.is_initial());
            match starts {
                true => format!("`P(initial({}))`", at.model.variable_name(*now)),
                false => format!("`P({})`", at.model.variable_name(*before)),
            }
        };
        let start: Vec<String> = at.now.iter().zip(&at.before).map(first).collect();
        let reason = format!(
            "{} is carried and finite: each instant is a sum over its previous value; at the first, {} has its form",
            at.plain(&at.now),
            start.join(", ")
        );
        let (alpha, alpha_before) = (at.message("α", &at.now), at.message("α", &at.before));
        let belief = notation.relation(&alpha, "=", &at.given_past(&at.now, &at.observed));
        let (hidden, factors) = at.factors(&at.now, true);
        let body = at.times(&at.sum(&hidden), &[factors, alpha_before.clone()]);
        let mut lines = vec![line("forward", reason, notation.equation(&belief, "∝", &body))];
        let others: Vec<VariableId> = at
            .searched
            .iter()
            .copied()
            .filter(|id| !at.now.contains(id) && !at.before.contains(id))
            .collect();
        let whole: Vec<VariableId> = at.now.iter().chain(&others).copied().collect();
        match self.ask().when {
            When::Smooth => {
                let (mut summed, factors) = at.factors(&at.now, true);
                summed.retain(|id| !at.before.contains(id));
                summed.splice(0..0, at.now.iter().copied());
                let beta_before = at.message("β", &at.before);
                let body = at.times(&at.sum(&summed), &[factors, at.message("β", &at.now)]);
                let reason = "from the last instant, where β = 1: how probable the later observations are, given an \
                              instant's values";
                lines.push(line("backward", reason, notation.equation(&beta_before, "∝", &body)));
                let all = at.given(&at.now, "all observations");
                let body = at.times("", &[alpha, at.message("β", &at.now)]);
                lines.push(line(
                    "product",
                    "both messages at the same instant",
                    notation.equation(&all, "∝", &body),
                ));
                if !others.is_empty() {
                    let (mut summed, factors) = at.factors(&whole, true);
                    summed.extend(at.now.iter().filter(|id| !at.searched.contains(id)));
                    let all = at.given(&at.searched, "all observations");
                    let body = at.times(&at.sum(&summed), &[factors, alpha_before, at.message("β", &at.now)]);
                    lines.push(line("read-out", "of an instant", notation.equation(&all, "∝", &body)));
                }
            }
            When::Sequence if matches!(self.ask().statistic, Statistic::Draw(_)) => {
                let (_, factors) = at.factors(&at.now, true);
                let body = at.times("", &[factors, alpha_before]);
                let drawn = notation.equation(&at.list(&at.before), "∼", &body);
                lines.push(line(
                    "drawn sequence",
                    "the last instant from α, then backward, each instant given the one after it",
                    drawn,
                ));
            }
            When::Sequence => {
                let (hidden, factors) = at.factors(&whole, true);
                let (maximised, summed): (Vec<_>, Vec<_>) =
                    hidden.into_iter().partition(|id| at.before.contains(id));
                let parts = [factors, at.message("δ", &at.before)];
                let sum = at.sum(&summed);
                let over = notation.names(at.model, &maximised);
                let best = format!("{}{sum}", notation.extremum("max", &over));
                let delta = at.message("δ", &at.now);
                lines.push(line(
                    "most likely sequence",
                    "sums over the past become maxima",
                    notation.equation(&delta, "=", &at.times(&best, &parts)),
                ));
                let back = format!("{}{sum}", notation.extremum("argmax", &over));
                lines.push(line(
                    "traced back",
                    "from the largest δ of the last instant, each instant given the one after it",
                    notation.equation(&at.list(&at.before), "=", &at.times(&back, &parts)),
                ));
            }
            When::Predict(steps) => {
                let (hidden, factors) = at.factors(&whole, false);
                let (left, words) = match others.is_empty() {
                    true => (at.message("α", &at.now), format!("{steps} times, without observations")),
                    false => {
                        (at.given_past(&whole, &[]), format!("{steps} instants ahead, without observations"))
                    }
                };
                let body = at.times(&at.sum(&hidden), &[factors, alpha_before]);
                let sign = if others.is_empty() { "←" } else { "=" };
                lines.push(line("prediction", words, notation.equation(&left, sign, &body)));
            }
            _ if !others.is_empty() => {
                let (mut summed, factors) = at.factors(&whole, true);
                summed.extend(at.now.iter().filter(|id| !at.searched.contains(id)));
                let body = at.times(&at.sum(&summed), &[factors, alpha_before]);
                let left = at.given_past(&at.searched, &at.observed);
                lines.push(line("read-out", "of an instant", notation.equation(&left, "∝", &body)));
            }
            _ => {}
        }
        lines
    }

    /// The filter of means and covariances, with its gain.
    fn kalman(&self, at: &Instant<'_>, linearised: bool) -> Vec<Line> {
        let notation = at.notation;
        let carried = at.plain(&at.now);
        let (rule, reason) = match linearised {
            false => (
                "Kalman filter",
                format!("{carried} is carried, linear and Gaussian: mean m and covariance S are carried"),
            ),
            true => (
                "extended Kalman filter",
                format!(
                    "approximate: mean m and covariance S of {carried} are carried by the tangents of the means, taken at \
                     the estimate of each instant"
                ),
            ),
        };
        let normal = |of: &str, unicode: &str, latex: &str| match notation {
            Notation::Latex => format!("\\mathcal{{N}}({of};\\, {latex})"),
            Notation::Unicode => format!("N({of}; {unicode})"),
            Notation::MathMl => format!(
                "<mi>𝒩</mi><mo>(</mo>{of}<mo separator=\"true\">;</mo>{}<mo>)</mo>",
                notation.text(unicode, "")
            ),
        };
        let (now, before) = (at.list(&at.now), at.list(&at.before));
        let carried_law = normal(&before, "m, S", "m, S");
        let transition = at.heads(|id| at.now.contains(&id) || !at.observed.contains(&id));
        let sensors = at.heads(|id| at.observed.contains(&id));
        let mut lines =
            vec![line(rule, reason, notation.equation(&at.given_past(&at.before, &[]), "=", &carried_law))];
        let predicted =
            notation.equation(&at.given_past(&at.now, &[]), "=", &normal(&now, "m⁻, S⁻", "m^{-}, S^{-}"));
        let moved = notation.text(
            ", m⁻ = A m + a, S⁻ = A S Aᵀ + Q",
            ",\\quad m^{-} = A m + a,\\quad S^{-} = A S A^{\\top} + Q",
        );
        lines.push(line(
            "prediction",
            format!("A, a and Q are the slopes, the offset and the covariance of {transition}"),
            format!("{predicted}{moved}"),
        ));
        if !at.observed.is_empty() {
            lines.push(line(
                "gain",
                format!("H, h and R are the slopes, the offset and the covariance of {sensors}"),
                notation
                    .text("K = S⁻ Hᵀ (H S⁻ Hᵀ + R)⁻¹", "K = S^{-} H^{\\top} (H S^{-} H^{\\top} + R)^{-1}"),
            ));
            let law = normal(
                &now,
                "m⁻ + K (z − H m⁻ − h), S⁻ − K H S⁻",
                "m^{-} + K (z - H m^{-} - h), S^{-} - K H S^{-}",
            );
            let left = at.given_past(&at.now, &at.observed);
            let reason = format!("z is what is observed of {}", at.plain(&at.observed));
            lines.push(line("correction", reason, notation.equation(&left, "=", &law)));
        }
        let gain = notation.text("G = S Aᵀ (S⁻₊)⁻¹", "G = S A^{\\top} (S^{-}_{+})^{-1}");
        match self.ask().when {
            When::Smooth | When::Sequence => {
                let law = normal(
                    &now,
                    "m + G (m̂₊ − m⁻₊), S + G (Ŝ₊ − S⁻₊) Gᵀ",
                    "m + G (\\hat{m}_{+} - m^{-}_{+}), S + G (\\hat{S}_{+} - S^{-}_{+}) G^{\\top}",
                );
                let all = at.given(&at.now, "all observations");
                let comma = notation.choose(", ", ",\\quad ", "<mo separator=\"true\">,</mo> ");
                lines.push(line(
                    "backward",
                    "a plus marks the next instant, a hat what is smoothed; from the last instant, where it is what is filtered",
                    format!("{}{comma}{gain}", notation.equation(&all, "=", &law)),
                ));
                if self.ask().when == When::Sequence {
                    let reason = "the most probable sequence of a normal law is that of its means";
                    let best = notation.equation(&now, "=", &notation.text("m̂", "\\hat{m}"));
                    lines.push(line("most likely sequence", reason, best));
                }
            }
            When::Predict(steps) => {
                let moved = notation.text(
                    "m ← A m + a, S ← A S Aᵀ + Q",
                    "m \\leftarrow A m + a,\\quad S \\leftarrow A S A^{\\top} + Q",
                );
                lines.push(line("prediction ahead", format!("{steps} times, without observations"), moved));
            }
            _ => {}
        }
        lines
    }

    /// The steps of a particle filter.
    fn particles(&self, at: &Instant<'_>, why: &str, linear: &[VariableId], guided: bool) -> Vec<Line> {
        let notation = at.notation;
        let mut joint = notation.names(at.model, &at.now);
        joint.extend(notation.names(at.model, &at.observed));
        let moved = notation.distribution(&joint, &notation.names(at.model, &at.before));
        let before = at.given_past(&at.before, &[]);
        let integral = notation.integral(&notation.names(at.model, &at.before));
        let body = at.times(&integral, &[moved, before]);
        let reason = format!("{why}: draws follow the program and are weighted by the observations");
        let belief = at.given_past(&at.now, &at.observed);
        let mut lines = vec![line("particle filter", reason, notation.equation(&belief, "∝", &body))];
        let drawn = at.heads_of(|id| !at.observed.contains(&id));
        let weighed = at.heads_of(|id| at.observed.contains(&id));
        if !drawn.is_empty() {
            let draws = notation.text("draw ~ ", "\\text{draw} \\sim ");
            lines.push(line(
                "draws",
                "of each particle, parents first",
                format!("{draws}{}", at.times("", &drawn)),
            ));
        }
        if !weighed.is_empty() {
            let sign = notation.text("wₙ ← wₙ ", "w_n \\leftarrow w_n\\, ");
            let reason = "the observations weight each particle";
            lines.push(line("weights", reason, format!("{sign}{}", at.times("", &weighed))));
        }
        if guided && self.ask().when.is_over_time() {
            let reason = "where all observations are given together, draws are proposed by the program linearised along its \
                          most probable path, and weighted by the program over the proposal; where unguided draws find \
                          observations more probable, they answer";
            let equation = notation
                .text("wₙ ← wₙ p(x z | x⁻¹) / q(x)", "w_n \\leftarrow w_n\\, p(x z \\mid x^{-1}) / q(x)");
            lines.push(line("guided proposal", reason, equation));
        }
        let resampled =
            "particles are resampled (systematically) when their effective number is less than half";
        let equation = notation.text("1 / Σₙ wₙ² < N / 2", "1 / \\sum_n w_n^2 < N / 2");
        lines.push(line("resampling", resampled, equation));
        if !linear.is_empty() {
            let reason = format!(
                "given the others, {} is linear and Gaussian: not sampled, carried as a normal distribution by each particle",
                at.plain(linear)
            );
            let law = match notation {
                Notation::Unicode => format!("N({}; mₙ, Σₙ)", at.list(linear)),
                Notation::Latex => format!("\\mathcal{{N}}({};\\, m_n, \\Sigma_n)", at.list(linear)),
                Notation::MathMl => format!(
                    "<mi>𝒩</mi><mo>(</mo>{}<mo separator=\"true\">;</mo>{}<mo>)</mo>",
                    at.list(linear),
                    notation.text("mₙ, Σₙ", "")
                ),
            };
            lines.push(line("Rao-Blackwell", reason, law));
        }
        let last = match self.ask().when {
            When::Smooth => Some((
                "backward simulation",
                "each path goes back from particle to particle; where the transition has no density, to its ancestors",
                notation.text("xₜ ~ Wₜ p(xₜ₊₁ | xₜ)", "x_t \\sim W_t\\, p(x_{t+1} \\mid x_t)"),
            )),
            When::Sequence => Some((
                "most probable path",
                "of the paths of the particles the one with the largest density together with the observations",
                notation.text("maxₙ p(x₁ … x_T z)", "\\max_n p(x_1 \\ldots x_T z)"),
            )),
            When::Predict(_) => Some((
                "prediction",
                "instants follow without observations",
                at.times("", &at.heads_of(|id| !at.observed.contains(&id))),
            )),
            _ => None,
        };
        lines.extend(last.map(|(rule, reason, equation)| line(rule, reason, equation)));
        lines
    }
}

fn line(rule: &str, reason: impl Into<String>, equation: String) -> Line {
    (rule.to_owned(), reason.into(), equation)
}

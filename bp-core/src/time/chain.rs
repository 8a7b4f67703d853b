//! Chains of finite hidden states: filtered, predicted, smoothed, and the most likely sequence.
//!
//! In: a prior over states, and for each instant a [`Matrix`]: P(outcome, observation | state before), where an outcome
//! is what is asked at an instant, and says the state. Out: distributions over outcomes. Invariant: each instant is
//! scaled, so that no length underflows.
//!
//! αₜ(j) = Σᵢ aₜ₋₁(i) Mₜ(i, j),  aₜ = αₜ summed to states, scaled by cₜ = Σⱼ αₜ(j);  ln P(observations) = Σ ln cₜ.
//! βₜ₋₁(i) = Σⱼ Mₜ(i, j) βₜ(state j);  γₜ(j) ∝ Σᵢ aₜ₋₁(i) Mₜ(i, j) βₜ(state j)   (Baum et al. 1970; Rabiner 1989).
//! Most likely: δₜ(j) = max over outcomes before of δₜ₋₁ + ln Mₜ (Viterbi 1967); what was before the first is summed.

use std::sync::Arc;

/// P(outcome, observation | state before), a row for each state.
pub type Matrix = Arc<Vec<f64>>;

/// A chain.
#[derive(Clone, PartialEq, Debug)]
pub struct Chain {
    /// What is believed of the states before the first instant.
    pub prior: Vec<f64>,
    /// The state that each outcome says.
    pub state_of: Vec<usize>,
}

/// Beliefs of all instants, and ln P(observations).
#[derive(Clone, PartialEq, Debug)]
pub struct Course {
    /// For each instant, a probability for each outcome.
    pub beliefs: Vec<Vec<f64>>,
    /// ln P(observations)
    pub ln_evidence: f64,
}

impl Chain {
    fn outcomes(&self) -> usize {
        self.state_of.len()
    }

    /// Σᵢ a(i) M(i, j)
    fn step(&self, states: &[f64], matrix: &[f64]) -> Vec<f64> {
        let mut outcomes = vec![0.0; self.outcomes()];
        for (state, row) in
            states.iter().zip(matrix.chunks(self.outcomes())).filter(|(state, _)| **state > 0.0)
        {
            outcomes.iter_mut().zip(row).for_each(|(outcome, cell)| *outcome += state * cell);
        }
        outcomes
    }

    /// Outcomes, summed to states.
    fn states(&self, outcomes: &[f64]) -> Vec<f64> {
        let mut states = vec![0.0; self.prior.len()];
        outcomes.iter().zip(&self.state_of).for_each(|(outcome, state)| states[*state] += outcome);
        states
    }

    /// Σⱼ M(i, j) β(state j), up to a factor.
    fn back(&self, matrix: &[f64], beta: &[f64]) -> Vec<f64> {
        let row = |row: &[f64]| row.iter().zip(&self.state_of).map(|(cell, state)| cell * beta[*state]).sum();
        let before: Vec<f64> = matrix.chunks(self.outcomes()).map(row).collect();
        let most = before.iter().copied().fold(0.0, f64::max);
        before.iter().map(|value| if most > 0.0 { value / most } else { 0.0 }).collect()
    }

    /// What is believed at each instant, given what was observed up to it; `Err` is the instant whose observation is
    /// impossible.
    pub fn filter(&self, matrices: &[Matrix]) -> Result<Course, usize> {
        let (mut states, mut beliefs, mut ln_evidence) = (self.prior.clone(), Vec::new(), 0.0);
        for (instant, matrix) in matrices.iter().enumerate() {
            let mut outcomes = self.step(&states, matrix);
            let scale: f64 = outcomes.iter().sum();
            if !(scale > 0.0 && scale.is_finite()) {
                return Err(instant);
            }
            outcomes.iter_mut().for_each(|outcome| *outcome /= scale);
            ln_evidence += scale.ln();
            states = self.states(&outcomes);
            beliefs.push(outcomes);
        }
        Ok(Course { beliefs, ln_evidence })
    }

    /// What is believed at each instant, given all that was observed.
    pub fn smooth(&self, matrices: &[Matrix]) -> Result<Course, usize> {
        let mut course = self.filter(matrices)?;
        let mut beta = vec![1.0; self.prior.len()];
        for (instant, matrix) in matrices.iter().enumerate().rev() {
            let smoothed: Vec<f64> = course.beliefs[instant]
                .iter()
                .zip(&self.state_of)
                .map(|(p, state)| p * beta[*state])
                .collect();
            let total: f64 = smoothed.iter().sum();
            course.beliefs[instant] = smoothed.into_iter().map(|p| p / total).collect();
            beta = self.back(matrix, &beta);
        }
        Ok(course)
    }

    /// The most likely outcomes of all instants together.
    pub fn most_likely(&self, matrices: &[Matrix]) -> Result<Vec<usize>, usize> {
        let Some(first) = matrices.first() else { return Ok(Vec::new()) };
        let mut scores: Vec<f64> = self.step(&self.prior, first).into_iter().map(f64::ln).collect();
        let mut before: Vec<Vec<usize>> = Vec::new();
        for (instant, matrix) in matrices.iter().enumerate().skip(1) {
            // Of the outcomes that say one state, only the best can be on the way.
            let mut best: Vec<Option<usize>> = vec![None; self.prior.len()];
            for (outcome, state) in self.state_of.iter().enumerate() {
                if scores[outcome] > best[*state].map_or(f64::NEG_INFINITY, |best| scores[best]) {
                    best[*state] = Some(outcome);
                }
            }
            let mut next = vec![f64::NEG_INFINITY; self.outcomes()];
            let mut from = vec![0; self.outcomes()];
            for (way, row) in best.iter().zip(matrix.chunks(self.outcomes())) {
                let Some(way) = way else { continue };
                for (outcome, cell) in row.iter().enumerate() {
                    let score = scores[*way] + cell.ln();
                    if score > next[outcome] {
                        (next[outcome], from[outcome]) = (score, *way);
                    }
                }
            }
            if next.iter().all(|score| *score == f64::NEG_INFINITY) {
                return Err(instant);
            }
            scores = next;
            before.push(from);
        }
        let better =
            |best: usize, outcome: usize| if scores[outcome] > scores[best] { outcome } else { best };
        let last = (0..self.outcomes()).fold(0, better);
        if scores[last] == f64::NEG_INFINITY {
            return Err(0);
        }
        let mut sequence = vec![last];
        for from in before.iter().rev() {
            sequence.push(from[sequence[sequence.len() - 1]]);
        }
        sequence.reverse();
        Ok(sequence)
    }
}

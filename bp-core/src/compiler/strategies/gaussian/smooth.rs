//! Smoothing and prediction: beliefs about earlier instants given later observations, and about future instants.
//!
//! In: a filter, and the observations of each instant. Out: a [`Belief`] for each. Invariant: no matrix is inverted, so
//! carried laws may be singular (a Dirac has no noise of its own) or vague.
//!
//! The carried variables are c = m + R u with as many noises u as they need, and the whole instant is J = m + A u + B
//! e. Later observations constrain u only: its law is that of additional variables of the next instant, u = ū + U w.
//! Then J = m + A ū + A U w + B e: the square-root form of Rauch, Tung and Striebel (1965).

use super::law::NormalLaw;
use super::{Belief, Filter};
use crate::error::{Error, Impossible};

impl Filter {
    /// The belief of each instant, given the observations up to it; variables that an instant does not name are not
    /// observed.
    ///
    /// # Errors
    /// An observation that is not finite, or that the others exclude.
    pub fn filtered(&mut self, instants: &[Vec<(&str, f64)>]) -> Result<Vec<Belief>, Error> {
        let step = |(number, observed): (usize, &Vec<(&str, f64)>)| {
            let (law, ln_evidence) = self.advance(self.predict(), observed).map_err(at(number))?;
            self.law = law.select(self.carried.iter().copied()).reduced();
            Ok(self.belief(&law.select(self.searched()), ln_evidence))
        };
        instants.iter().enumerate().map(step).collect()
    }

    /// The belief `steps` instants ahead without observations. The filter itself is unchanged.
    pub fn predicted(&self, steps: usize) -> Result<Belief, Error> {
        let mut ahead = self.clone();
        for _ in 1..steps {
            ahead.law = ahead.predict().select(self.carried.iter().copied()).reduced();
        }
        Ok(ahead.belief(&ahead.predict().select(self.searched()), 0.0))
    }

    /// The belief of each instant, given all observations.
    ///
    /// # Errors
    /// As [`Filter::filtered`].
    pub fn smoothed(&mut self, instants: &[Vec<(&str, f64)>]) -> Result<Vec<Belief>, Error> {
        // For each instant, the law of the searched variables and of the noises carried from the previous instant.
        let mut steps = Vec::with_capacity(instants.len());
        for (number, observed) in instants.iter().enumerate() {
            let mut law = self.predict();
            let noises = law.len()..law.len() + self.law.noises();
            (0..self.law.noises()).for_each(|noise| law.extend_by_noise(noise));
            let (mut law, ln_evidence) = self.advance(law, observed).map_err(at(number))?;
            let on = law.concentrate(self.carried.clone());
            self.law = law.select(self.carried.iter().copied());
            self.law.keep_noises(on);
            let law = law.select(self.searched().chain(noises));
            steps.push((law, ln_evidence));
        }
        let mut later: Option<NormalLaw> = None;
        let mut beliefs = Vec::with_capacity(steps.len());
        for (mut law, ln_evidence) in steps.into_iter().rev() {
            if let Some(later) = &later {
                law.replace_noises(later);
            }
            let searched = self.searched.len();
            beliefs.push(self.belief(&law.select(0..searched), ln_evidence));
            later = Some(law.select(searched..law.len()).reduced());
        }
        beliefs.reverse();
        Ok(beliefs)
    }
}

/// Adds the number of the instant to an error.
fn at(number: usize) -> impl Fn(Error) -> Error {
    move |error| match error {
        Error::Impossible(Impossible { question, reason }) => {
            Error::Impossible(Impossible { question: format!("{question}, instant {}", number + 1), reason })
        }
        error => error,
    }
}

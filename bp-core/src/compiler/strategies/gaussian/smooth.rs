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
use crate::strategies::over_time::Instant;

/// What comes before each instant: a filter may be given its equations.
pub(super) type Prepare<'p> = &'p mut dyn FnMut(&mut Filter, &Instant) -> Result<(), Error>;

impl Filter {
    /// The belief of each instant, given the observations up to it; slots that an instant does not name are not
    /// observed.
    ///
    /// # Errors
    /// An observation that is not finite, or that the others exclude.
    pub(crate) fn filtered(&mut self, instants: &[Instant]) -> Result<Vec<Belief>, Error> {
        self.filtered_by(instants, &mut |_, _| Ok(()))
    }

    /// As [`Filter::filtered`]; `prepare` comes before each instant.
    pub(super) fn filtered_by(
        &mut self,
        instants: &[Instant],
        prepare: Prepare<'_>,
    ) -> Result<Vec<Belief>, Error> {
        let step = |(number, observed): (usize, &Instant)| {
            prepare(self, observed).map_err(at(number))?;
            let (law, ln_evidence) = self.advance(self.predict(), observed).map_err(at(number))?;
            let belief = self.belief(&law.select(self.searched()), ln_evidence);
            self.keep(law.select(self.carried()).reduced());
            Ok(belief)
        };
        instants.iter().enumerate().map(step).collect()
    }

    /// The belief `steps` instants ahead without observations. The filter itself is unchanged.
    pub(crate) fn predicted(&self, steps: usize) -> Belief {
        let mut ahead = self.clone();
        for _ in 1..steps {
            ahead.keep(ahead.predict().select(ahead.carried()).reduced());
        }
        ahead.belief(&ahead.predict().select(ahead.searched()), 0.0)
    }

    /// The belief of each instant, given all observations.
    ///
    /// # Errors
    /// As [`Filter::filtered`].
    pub(crate) fn smoothed(&mut self, instants: &[Instant]) -> Result<Vec<Belief>, Error> {
        self.smoothed_by(instants, &mut |_, _| Ok(()))
    }

    /// As [`Filter::smoothed`]; `prepare` comes before each instant.
    pub(super) fn smoothed_by(
        &mut self,
        instants: &[Instant],
        prepare: Prepare<'_>,
    ) -> Result<Vec<Belief>, Error> {
        // For each instant, the law of the searched variables and of the noises carried from the previous instant.
        let mut steps = Vec::with_capacity(instants.len());
        for (number, observed) in instants.iter().enumerate() {
            prepare(self, observed).map_err(at(number))?;
            let mut law = self.predict();
            let noises = law.len()..law.len() + self.law.noises();
            (0..self.law.noises()).for_each(|noise| law.extend_by_noise(noise));
            let (mut law, ln_evidence) = self.advance(law, observed).map_err(at(number))?;
            let on = law.concentrate(self.carried());
            let mut kept = law.select(self.carried());
            kept.keep_noises(on);
            steps.push((law.select(self.searched().into_iter().chain(noises)), ln_evidence));
            self.keep(kept);
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

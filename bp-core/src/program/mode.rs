//! The most probable values of an answer, and the values that it lists.
//!
//! In: a [`Posterior`]. Out: values by name. Invariant: a value is that of its variable: a boolean, a number or a label.

use super::value::of_text;
use super::{Evidence, Posterior};
use crate::answer::{Drawn, PartLaw, Row};
use crate::error::Error;

impl Posterior {
    /// The most probable values of all its variables together, the first of several; for a normal distribution its
    /// mean, for another one of one real its largest density; for draws of one real their half-sample mode.
    ///
    /// # Errors
    /// As [`Posterior::p`]; nothing is possible in this context.
    pub fn mode(&self) -> Result<Evidence, Error> {
        if let ([], [row]) = (self.answer().parts.as_slice(), self.answer().answer.as_slice())
            && !row.values.is_empty()
        {
            let values = row.values.iter();
            return Ok(values
                .map(|(name, text)| (name.clone(), of_text(self.model(), name, text)))
                .collect());
        }
        let part = self.one()?;
        if let (PartLaw::Laws { laws, .. }, [slot]) = (&part.law, part.of.as_slice()) {
            let none =
                || self.lookup(format!("`{}` has its largest density at more than one value", laws[0]));
            return Ok([(slot.name(self.model()), laws[0].mode().ok_or_else(none)?)].into_iter().collect());
        }
        if let (PartLaw::Mixture(mixture), [slot]) = (&part.law, part.of.as_slice()) {
            return Ok([(slot.name(self.model()), mixture.of_slot(0).modes()[0].at[0])]
                .into_iter()
                .collect());
        }
        if let PartLaw::Normal { mean, .. } = &part.law {
            return Ok(part
                .of
                .iter()
                .zip(mean)
                .map(|(slot, mean)| (slot.name(self.model()), *mean))
                .collect());
        }
        if let (PartLaw::Draws(draws, drawn), [slot]) = (&part.law, part.of.as_slice())
            && let (Drawn::At(position), 0) = (&drawn[0], slot.count)
        {
            return Ok([(slot.name(self.model()), draws.mode(*position))].into_iter().collect());
        }
        let numbers = self.finite(part)?;
        let best = numbers.iter().enumerate().fold(
            (0, 0.0),
            |best, (place, p)| {
                if *p > best.1 { (place, *p) } else { best }
            },
        );
        match best {
            (_, p) if p > 0.0 => Ok(self.assignment(&part.of, best.0)),
            _ => Err(self.lookup("every value has probability 0 in this context".to_owned())),
        }
    }

    /// The values of each row of a question for `draw(n)`, `best(n)` or `argmax`, in its order.
    ///
    /// # Errors
    /// The question asks for something else.
    pub fn listed(&self) -> Result<Vec<Evidence>, Error> {
        let rows = &self.answer().answer;
        let are_named =
            |row: &Row| !row.values.is_empty() && row.values.iter().all(|(_, text)| !text.is_empty());
        if rows.is_empty() || !rows.iter().all(are_named) {
            return Err(
                self.lookup("it lists no values: ask for `draw(10) P(…)` or `best(3) P(…)`".to_owned())
            );
        }
        let named = |(name, text): &(String, String)| (name.clone(), of_text(self.model(), name, text));
        Ok(rows.iter().map(|row| row.values.iter().map(named).collect()).collect())
    }
}

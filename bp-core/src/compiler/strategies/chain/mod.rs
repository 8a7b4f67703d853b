//! Chains of finite hidden states: forward and backward messages, and the most likely sequence.
//!
//! In: the `Factors` of a program, and the observations of each instant. Out: messages, which determine the
//! distribution of any slots of any instant; the most likely values of all instants. Invariant: a message is a product
//! of potentials that sums to one; it is zero only where the program assigns probability zero.
//!
//! With φₜ the product of the factors of instant t, other hidden slots summed out, and π that of the factors of X^-1:
//! α₁(X) = Σ_X⁻¹ π φ₁ / c₁,  αₜ(X) = Σ_X⁻¹ αₜ₋₁(X⁻¹) φₜ / cₜ,  cₜ the normalising constant;  ln P(z) = Σ ln cₜ;
//! βₜ₋₁(X⁻¹) ∝ Σ_X φₜ βₜ(X);  P(X⁻¹ X S | z) ∝ αₜ₋₁(X⁻¹) φₜ βₜ(X)   (Baum et al. 1970; Rabiner 1989).
//! Most likely: δₜ(X) is α with maxima in place of sums (Viterbi 1967); the state before the first instant is summed
//! out.

mod factors;
mod far;
mod finite;
mod offer;
mod sequences;

pub(crate) use finite::{answer, chain};
pub(crate) use offer::{Engine, is_dirac, refusal};

use crate::distribution::Setting;
use crate::error::Error;
use crate::error::Impossible;
use crate::ids::VariableId;
use crate::potential::{Orders, Product, Trace};
use crate::strategies::over_time::{Instant, Weighed};
use factors::Factors;

/// A chain of instants.
pub(crate) struct Chain<'s> {
    factors: Factors<'s>,
    /// The question, for error messages.
    asked: String,
    searched: Vec<usize>,
    /// The likelihoods of each instant, besides those of the question.
    weighed: Vec<Vec<Weighed>>,
}

/// The forward messages.
pub(crate) struct Forward {
    /// φ of each instant.
    products: Vec<Product>,
    /// α after each instant, over the slots of X.
    messages: Vec<Product>,
    /// ln P(observations)
    pub(crate) ln_evidence: f64,
}

/// One forward step.
pub(crate) struct Step {
    /// φ of the instant.
    pub(crate) product: Product,
    /// α after it, which sums to one.
    pub(crate) message: Product,
    /// ln P(the observations of this instant), given the past.
    pub(crate) ln_total: f64,
}

/// All factors of an instant with the messages from both sides: the distribution of its slots up to a constant.
pub(crate) struct Joint<'c> {
    product: Product,
    counts: &'c [usize],
    orders: &'c mut Orders,
}

impl Joint<'_> {
    /// The distribution of some slots, the last one fastest; `Err` holds the number of cells where there would be too
    /// many.
    pub(crate) fn distribution(&mut self, slots: &[usize]) -> Result<Vec<f64>, f64> {
        self.product.clone().distribution(slots, self.counts, self.orders)
    }
}

impl<'s> Chain<'s> {
    /// A chain that carries (X, X^-1) and searches some slots. `likelihoods` apply at each instant with observations.
    /// `asked` is the question as error messages name it.
    ///
    /// # Errors
    /// A program whose instants have no finite tables.
    pub(crate) fn new(
        setting: &Setting<'s>,
        carried: &[(VariableId, VariableId)],
        searched: Vec<usize>,
        likelihoods: Vec<(usize, Vec<f64>)>,
        asked: String,
    ) -> Result<Self, Error> {
        let factors = Factors::new(setting, carried, searched.iter().copied(), likelihoods)?;
        Ok(Self { factors, asked, searched, weighed: Vec::new() })
    }

    /// Likelihoods that apply from now on, besides those of the question: those of one instant.
    pub(crate) fn weigh(&mut self, weighed: &[Weighed]) {
        self.factors.weighed = weighed.to_vec();
    }

    /// The number of values of a slot.
    pub(crate) fn count(&self, slot: usize) -> usize {
        self.factors.counts[slot]
    }

    fn small<T>(&self, made: Result<T, f64>) -> Result<T, Error> {
        made.map_err(|cells| self.factors.too_large(cells))
    }

    /// Computes the forward messages of the observations, and of `ahead` further instants without observations.
    ///
    /// # Errors
    /// Observations that are impossible; tables that are too large; numbers outside the range that a form accepts.
    pub(crate) fn forward(&mut self, instants: &[Instant], ahead: usize) -> Result<Forward, Error> {
        let mut forward = Forward { products: Vec::new(), messages: Vec::new(), ln_evidence: 0.0 };
        let nothing = Instant::new();
        for number in 0..instants.len() + ahead {
            let given = number < instants.len();
            let instant = instants.get(number).unwrap_or(&nothing);
            self.factors.weighed = self.weighed.get(number).cloned().unwrap_or_default();
            let step = self.step(forward.messages.last(), instant, number, given)?;
            // A later instant adds ln of the probability that it has values at all: 0, but for a sum outside its range.
            forward.ln_evidence += step.ln_total;
            forward.products.push(step.product);
            forward.messages.push(step.message);
        }
        Ok(forward)
    }

    /// Computes the forward message of one more instant. `number` counts from 0; `given`: apply the likelihoods of the
    /// question.
    ///
    /// # Errors
    /// As [`Chain::forward`].
    pub(crate) fn step(
        &mut self,
        last: Option<&Product>,
        instant: &Instant,
        number: usize,
        given: bool,
    ) -> Result<Step, Error> {
        let product = self.factors.product(instant, number == 0, given)?;
        let message = self.message(last, &product)?;
        let Factors { counts, orders, .. } = &mut self.factors;
        let total = message.ln_total(counts, orders);
        let ln_total = self.small(total)?;
        if ln_total == f64::NEG_INFINITY {
            return Err(self.impossible(last, instant, number));
        }
        Ok(Step { product, message: scaled(message, ln_total), ln_total })
    }

    /// The error that an instant has probability zero, with the first observation that excludes it.
    fn impossible(&mut self, last: Option<&Product>, instant: &Instant, number: usize) -> Error {
        let heads: Vec<String> =
            self.factors.now.clone().into_iter().map(|slot| self.factors.named(slot, 0.0).1).collect();
        let mut reason =
            format!("no value of the carried variables is possible there; see `{}`", heads.join("`, `"));
        for count in 0..=instant.len() {
            let some = instant[..count].to_vec();
            let product = self.factors.product(&some, number == 0, true);
            let Ok(message) = product.and_then(|product| self.message(last, &product)) else { continue };
            let Factors { counts, orders, .. } = &mut self.factors;
            if message.ln_total(counts, orders) == Ok(f64::NEG_INFINITY) {
                if let Some((slot, value)) = some.last() {
                    let (observed, head) = self.factors.named(*slot, *value);
                    reason = format!(
                        "`{observed}` is impossible there, given the earlier instants: `{head}` is 0"
                    );
                }
                break;
            }
        }
        let question = format!("{}, instant {}", self.asked, number + 1);
        Error::Impossible(Impossible { question, reason: Some(reason) })
    }

    /// Sums out all slots except those of X.
    fn message(&mut self, last: Option<&Product>, product: &Product) -> Result<Product, Error> {
        let all = self.entered(last).times(product);
        let Factors { counts, orders, now, .. } = &mut self.factors;
        let message = all.summed(|slot| now.contains(&slot), counts, orders);
        self.small(message)
    }

    /// The message that an instant leaves, renamed for the next instant: X becomes X^-1.
    fn entered(&self, last: Option<&Product>) -> Product {
        let (now, before) = (&self.factors.now, &self.factors.before);
        last.map(|last| last.renamed(|slot| renamed(slot, now, before))).unwrap_or_default()
    }

    /// Calls `visit` with the joint distribution of an instant, given the observations up to it.
    pub(crate) fn at<T>(
        &mut self,
        forward: &Forward,
        number: usize,
        visit: impl FnOnce(&mut Joint<'_>) -> Result<T, f64>,
    ) -> Result<T, Error> {
        let before = number.checked_sub(1).map(|before| &forward.messages[before]);
        self.after(before, &forward.products[number], visit)
    }

    /// The same for an instant with this product, after this message.
    pub(crate) fn after<T>(
        &mut self,
        before: Option<&Product>,
        product: &Product,
        visit: impl FnOnce(&mut Joint<'_>) -> Result<T, f64>,
    ) -> Result<T, Error> {
        let product = self.entered(before).times(product);
        let Factors { counts, orders, .. } = &mut self.factors;
        let visited = visit(&mut Joint { product, counts, orders });
        self.small(visited)
    }

    /// Calls `visit(instant, joint distribution)` for each instant, the last first, given all observations.
    pub(crate) fn backward(
        &mut self,
        forward: &Forward,
        mut visit: impl FnMut(usize, &mut Joint<'_>) -> Result<(), f64>,
    ) -> Result<(), Error> {
        let mut back = Product::default();
        for number in (0..forward.products.len()).rev() {
            let after = forward.products[number].clone().times(&back);
            let before = number.checked_sub(1).map(|before| &forward.messages[before]);
            let product = self.entered(before).times(&after);
            let Factors { counts, orders, now, before, .. } = &mut self.factors;
            let visited = visit(number, &mut Joint { product, counts, orders });
            if number > 0 {
                let summed = after.summed(|slot| before.contains(&slot), counts, orders);
                back = match summed {
                    Ok(summed) => summed.unscaled().0.renamed(|slot| renamed(slot, before, now)),
                    Err(cells) => return Err(self.factors.too_large(cells)),
                };
            }
            self.small(visited)?;
        }
        Ok(())
    }

    /// The most likely joint values of the searched slots at all instants; the searched slots include all of X.
    ///
    /// # Errors
    /// See [`Chain::forward`].
    pub(crate) fn most_likely(&mut self, forward: &Forward) -> Result<Vec<Vec<usize>>, Error> {
        let (mut last, mut traces): (Option<Product>, Vec<Vec<Trace>>) = (None, Vec::new());
        for (number, product) in forward.products.iter().enumerate() {
            let mut all = self.entered(last.as_ref()).times(product);
            let Factors { counts, orders, now, before, .. } = &mut self.factors;
            if number == 0 {
                let (before, searched) = (&*before, &self.searched);
                let summed =
                    all.summed(|slot| !before.contains(&slot) || searched.contains(&slot), counts, orders);
                all = match summed {
                    Ok(summed) => summed,
                    Err(cells) => return Err(self.factors.too_large(cells)),
                };
            }
            let best = all.maximised(|slot| now.contains(&slot), counts, orders);
            let (best, trace) = self.small(best)?;
            traces.push(trace);
            last = Some(best.unscaled().0);
        }
        let Factors { counts, orders, now, before, .. } = &mut self.factors;
        let best = last.unwrap_or_default().maximised(|_| false, counts, orders);
        let (_, end) = match best {
            Ok(best) => best,
            Err(cells) => return Err(self.factors.too_large(cells)),
        };
        let mut values = vec![0; counts.len()];
        end.iter().rev().for_each(|trace| trace.follow(&mut values, counts));
        let mut sequence = Vec::with_capacity(traces.len());
        for trace in traces.iter().rev() {
            trace.iter().rev().for_each(|trace| trace.follow(&mut values, counts));
            sequence.push(self.searched.iter().map(|slot| values[*slot]).collect());
            now.iter().zip(before.iter()).for_each(|(now, before)| values[*now] = values[*before]);
        }
        sequence.reverse();
        Ok(sequence)
    }
}

/// The slot at the same position of another list.
fn renamed(slot: usize, from: &[usize], to: &[usize]) -> usize {
    from.iter().position(|own| *own == slot).map_or(slot, |position| to[position])
}

/// The message divided by its total.
fn scaled(message: Product, ln_total: f64) -> Product {
    let (mut message, ln_factor) = message.unscaled();
    message.ln_constant = ln_factor - ln_total;
    message
}

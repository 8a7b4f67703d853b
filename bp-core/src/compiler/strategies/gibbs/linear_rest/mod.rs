//! What is linear and Gaussian given the drawn variables, and so is integrated out instead of drawn.
//!
//! In: the instances of linear normal and Dirac forms, and the values of the drawn variables. Out: ln of the density of everything
//! that these instances distribute and that has a value, and draws of what has none. Invariant: in the assignments that it reads,
//! integrated slots are 0.
//!
//! Equations whose coefficients do not depend on drawn variables are made once; of those that share a deviation, n equations of the
//! same k unknowns are condensed to k and a sum of squares, whatever the deviation is: a regression costs the same for any number
//! of rows.

mod build;

use super::elimination::{Elimination, Equation, HALF_LN_TAU};
use crate::distribution::{Instance, LinearMean, Setting};
use crate::error::Error;
use crate::ids::ExpressionId;
use crate::random::Random;
use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet, HashMap};

/// Σ coefficient · unknown + constant.
#[derive(Clone, PartialEq, Debug, Default)]
struct Linear {
    terms: Vec<(usize, f64)>,
    constant: f64,
}

impl Linear {
    fn is_finite(&self) -> bool {
        self.constant.is_finite() && self.terms.iter().all(|(_, coefficient)| coefficient.is_finite())
    }
}

/// What an integrated slot is.
#[derive(Clone, Copy, PartialEq, Debug)]
enum Place {
    Unknown(usize),
    /// A Dirac determines it from unknowns.
    Determined(usize),
}

/// A slot that a Dirac determines.
#[derive(Debug)]
struct Determined {
    instance: Instance,
    /// Its value, where its coefficients do not depend on drawn variables.
    value: Option<Linear>,
    /// The unknowns on which it may depend.
    support: BTreeSet<usize>,
}

/// The deviation of an equation.
#[derive(Clone, Copy, PartialEq, Debug)]
enum Deviation {
    Known(f64),
    /// That of a [`Shared`] expression.
    Shared(usize),
    /// It is computed with the mean.
    Own,
}

/// A deviation that depends on drawn variables, the same in several equations.
#[derive(Debug)]
struct Shared {
    instance: Instance,
    expression: ExpressionId,
    /// How many equations were condensed away, and the sum of the squares of their values.
    equations: usize,
    squares: f64,
}

/// The equation of an instance.
#[derive(Debug)]
struct Row {
    instance: Instance,
    /// The unknown on its left-hand side; none where this has a value.
    unknown: Option<usize>,
    /// Σ coefficient · unknown = −constant; `None` where this depends on drawn variables.
    known: Option<Linear>,
    /// The mean of a normal form.
    mean: Option<ExpressionId>,
    /// The drawn slots on which its mean depends, if they are finite: for each of their values it is computed once.
    inputs: Option<Vec<usize>>,
    deviation: Deviation,
}

/// The equations that a chain has computed, for each row by the values of its inputs.
#[derive(Clone, Debug, Default)]
pub(super) struct Equations {
    rows: Vec<HashMap<Vec<u64>, Linear>>,
    count: usize,
}

/// More equations than these are forgotten.
const MOST_EQUATIONS: usize = 1 << 20;

/// The linear equations of the integrated slots.
#[derive(Debug)]
pub(super) struct LinearRest<'s> {
    setting: &'s Setting<'s>,
    /// Which slots are integrated out.
    linear: Vec<bool>,
    places: HashMap<usize, Place>,
    /// The slot of each unknown.
    unknowns: Vec<usize>,
    determined: Vec<Determined>,
    rows: Vec<Row>,
    shared: Vec<Shared>,
    elimination: Elimination,
    ln_constant: f64,
}

impl LinearRest<'_> {
    /// The unknowns on which these slots depend.
    fn support(&self, slots: BTreeSet<usize>) -> BTreeSet<usize> {
        let mut support = BTreeSet::new();
        for slot in slots {
            match self.places.get(&slot) {
                Some(Place::Unknown(unknown)) => support.extend([*unknown]),
                Some(Place::Determined(at)) => support.extend(&self.determined[*at].support),
                None => {}
            }
        }
        support
    }

    /// A linear form of slots as one of unknowns.
    fn in_unknowns<'l>(
        &self,
        terms: &[(usize, f64)],
        constant: f64,
        determined: &dyn Fn(usize) -> Option<&'l Linear>,
    ) -> Linear {
        let mut sum: BTreeMap<usize, f64> = BTreeMap::new();
        let mut constant = constant;
        for (slot, factor) in terms {
            match self.places.get(slot) {
                Some(Place::Unknown(unknown)) => *sum.entry(*unknown).or_default() += factor,
                Some(Place::Determined(at)) => {
                    let value = determined(*at).expect("internal: a Dirac is computed before it is read");
                    constant += factor * value.constant;
                    for (unknown, coefficient) in &value.terms {
                        *sum.entry(*unknown).or_default() += factor * coefficient;
                    }
                }
                None => {}
            }
        }
        let terms = sum.into_iter().filter(|(_, coefficient)| *coefficient != 0.0).collect();
        Linear { terms, constant }
    }

    /// Calls `with` with the elimination of all unknowns at these values of the drawn variables, and ln of the density; with
    /// `None` where the density is 0.
    fn solved<T>(
        &self,
        values: &[f64],
        computed: &mut Equations,
        with: impl FnOnce(Option<&super::elimination::Triangle>, f64) -> Result<T, Error>,
    ) -> Result<T, Error> {
        let setting = self.setting;
        let mut forms: Vec<Cow<'_, Linear>> = Vec::with_capacity(self.determined.len());
        let mean = |instance: &Instance, forms: &[Cow<'_, Linear>]| -> Result<(Linear, f64), Error> {
            let LinearMean { terms, constant, deviation } =
                setting.linear_mean_at_zero(instance, values, &self.linear)?;
            Ok((self.in_unknowns(&terms, constant, &|at| forms.get(at).map(|form| form.as_ref())), deviation))
        };
        for determined in &self.determined {
            let form = match &determined.value {
                Some(value) => Cow::Borrowed(value),
                None => Cow::Owned(mean(&determined.instance, &forms)?.0),
            };
            forms.push(form);
        }
        let mut ln = self.ln_constant;
        let mut deviations = Vec::with_capacity(self.shared.len());
        for shared in &self.shared {
            let deviation = setting.expression(shared.expression, &shared.instance, values);
            if !(deviation > 0.0 && deviation.is_finite()) {
                // The error of the form.
                setting.distribution(&shared.instance, values)?;
                return with(None, f64::NEG_INFINITY);
            }
            ln -= shared.equations as f64 * (deviation.ln() + HALF_LN_TAU);
            ln -= 0.5 * shared.squares / deviation / deviation;
            deviations.push(deviation);
        }
        if computed.rows.len() != self.rows.len() || computed.count > MOST_EQUATIONS {
            *computed = Equations { rows: vec![HashMap::new(); self.rows.len()], count: 0 };
        }
        // With each row that varies its form and deviation, if they are not found among the computed equations.
        let mut own: Vec<(Option<Vec<u64>>, Linear, f64)> = Vec::with_capacity(self.rows.len());
        for (number, row) in self.rows.iter().enumerate() {
            let key = row.inputs.as_ref().filter(|_| row.known.is_none() && row.deviation != Deviation::Own);
            let key =
                key.map(|inputs| inputs.iter().map(|slot| values[*slot].to_bits()).collect::<Vec<u64>>());
            let is_computed = key.as_ref().is_some_and(|key| computed.rows[number].contains_key(key));
            if row.known.is_some() || is_computed {
                own.push((key, Linear::default(), f64::NAN));
                continue;
            }
            let (form, deviation) = match row.mean.filter(|_| row.deviation != Deviation::Own) {
                Some(mean) => {
                    let (terms, constant) = setting.linear_form(mean, &row.instance, values, &self.linear);
                    let form =
                        self.in_unknowns(&terms, constant, &|at| forms.get(at).map(|form| form.as_ref()));
                    if !form.is_finite() {
                        // The error of the form.
                        setting.distribution(&row.instance, values)?;
                        return with(None, f64::NEG_INFINITY);
                    }
                    (form, f64::NAN)
                }
                None => mean(&row.instance, &forms)?,
            };
            if deviation == 0.0 {
                let why = "is determined by the other components of its vector";
                return Err(super::sites::stuck(setting, row.instance.left[0], why));
            }
            let form = equation(form, row.unknown, values[row.instance.left[0]]);
            match &key {
                Some(key) => {
                    computed.rows[number].insert(key.clone(), form);
                    computed.count += 1;
                    own.push((Some(key.clone()), Linear::default(), deviation));
                }
                None => own.push((None, form, deviation)),
            }
        }
        let equations =
            self.rows.iter().zip(&own).zip(&computed.rows).map(|((row, (key, form, own)), computed)| {
                let form = match (&row.known, key) {
                    (Some(known), _) => known,
                    (None, Some(key)) => &computed[key],
                    (None, None) => form,
                };
                let deviation = match row.deviation {
                    Deviation::Known(known) => known,
                    Deviation::Shared(at) => deviations[at],
                    Deviation::Own => *own,
                };
                Equation { terms: &form.terms, value: -form.constant, deviation }
            });
        let equations: Vec<Equation<'_>> = equations.collect();
        let Some(triangle) = self.elimination.triangle(&equations) else { return Err(self.improper()) };
        ln += triangle.ln_integral;
        with(Some(&triangle), ln)
    }

    /// ln of the density of all that has a value, at these values of the drawn variables.
    ///
    /// # Errors
    /// A number outside the range that a form accepts; flat variables that the observations do not determine.
    pub(super) fn ln_density(&self, values: &[f64], computed: &mut Equations) -> Result<f64, Error> {
        self.solved(values, computed, |_, ln| Ok(if ln.is_nan() { f64::NEG_INFINITY } else { ln }))
    }

    /// Draws what is integrated out, given the drawn variables; what Diracs determine is then to be computed.
    ///
    /// # Errors
    /// As [`LinearRest::ln_density`].
    pub(super) fn draw(
        &self,
        values: &mut [f64],
        computed: &mut Equations,
        random: &mut Random,
    ) -> Result<(), Error> {
        let drawn = self.solved(values, computed, |triangle, _| {
            Ok(triangle.map(|triangle| self.elimination.draw(triangle, random)).unwrap_or_default())
        })?;
        self.unknowns.iter().zip(drawn).for_each(|(slot, value)| values[*slot] = value);
        Ok(())
    }

    /// The instances of its Diracs, parents first.
    pub(super) fn determined(&self) -> impl Iterator<Item = &Instance> {
        self.determined.iter().map(|it| &it.instance)
    }

    /// Takes back what was drawn.
    pub(super) fn withdraw(&self, values: &mut [f64]) {
        let determined = self.determined.iter().map(|it| it.instance.left[0]);
        self.unknowns.iter().copied().chain(determined).for_each(|slot| values[slot] = 0.0);
    }

    fn improper(&self) -> Error {
        let names: Vec<String> =
            self.unknowns.iter().take(8).map(|slot| self.setting.slot_name(*slot)).collect();
        let reason = format!(
            "the posterior is improper: the observations do not determine all `flat` variables among `{}`; observe more, or give \
             a proper form such as `normal(0, 100)`",
            names.join("`, `")
        );
        Error::Unplanned { question: self.setting.model.name.clone(), reason }
    }
}

/// The equation of a left-hand side with this mean, as a form that is 0 up to noise.
fn equation(mean: Linear, unknown: Option<usize>, value: f64) -> Linear {
    let mut form = mean;
    match unknown {
        Some(unknown) => {
            form.terms.iter_mut().for_each(|(_, coefficient)| *coefficient = -*coefficient);
            form.terms.push((unknown, 1.0));
            form.constant = -form.constant;
        }
        None => form.constant -= value,
    }
    form
}

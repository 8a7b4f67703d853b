//! The rows of a statistic of named laws and of mixtures of normal distributions.
//!
//! In: a [`Part`], and a statistic of its distribution. Out: rows. Invariant: each number is exact to rounding; of several reals
//! together there are moments, quantiles, draws, and of independent laws the entropy.

use super::conditional::{ConditionalGaussian, apart};
use super::one_real::{MOST_DISTINCT, OneReal, Peak};
use super::part::{Part, PartLaw, Slot};
use super::quantile::figures;
use super::{Figure, Row};
use crate::error::Error;
use crate::ids::{FactorId, VariableId};
use crate::model::{Ask, Model, Searched, Statistic};
use crate::random::{Random, seeded};
use crate::spelling::exact;

/// The most values that are drawn at once.
const MOST_DRAWS: f64 = 1e7;

/// Refuses more drawn values than are shown, before they are drawn.
pub(crate) fn check_draws(question: impl FnOnce() -> String, cells: f64) -> Result<(), Error> {
    match cells > MOST_DRAWS {
        true => {
            let help = "draw fewer values".to_owned();
            Err(Error::TooLarge { name: question(), cells, most: MOST_DRAWS, help })
        }
        false => Ok(()),
    }
}

/// Why a statistic of reals is not computed of their mixture, or of their named laws; `reals` is their number.
pub(crate) fn refused_of_reals(statistic: &Statistic, reals: usize) -> Option<String> {
    let word = statistic.word();
    match statistic {
        Statistic::Distribution | Statistic::Expectation | Statistic::Variance | Statistic::Draw(_) => None,
        _ if statistic.levels().is_some() => None,
        Statistic::Entropy | Statistic::Maximum | Statistic::Argmax { .. } if reals == 1 => None,
        Statistic::Entropy | Statistic::Maximum | Statistic::Argmax { .. } => {
            Some(format!("`{word}` of several reals together is not computed: ask for each real alone"))
        }
        Statistic::Best(_) => {
            Some(format!("reals have no list of values to order: `{word}` needs finite variables"))
        }
        _ => Some(format!("`{word}` of these distributions is not computed")),
    }
}

/// The figure of a peak: a probability where all reals are determined.
fn of_peak(peak: &Peak) -> Figure {
    match peak.free {
        0 => Figure::Probability { p: peak.size },
        _ => Figure::Density { density: peak.size },
    }
}

/// Of several largest values the statistic `max` gives the first.
fn first_or_all(statistic: &Statistic, mut rows: Vec<Row>) -> Vec<Row> {
    if *statistic == Statistic::Maximum {
        rows.truncate(1);
    }
    rows
}

/// The position of a variable's factor among all, parents first.
fn parents_first(model: &Model, variable: VariableId) -> Option<usize> {
    let all: Vec<FactorId> = model.factors.ids().collect();
    let own = model.factor_of(variable);
    model.parents_first(&all).iter().position(|id| Some(*id) == own)
}

/// Why the density at the values of a question is not computed: all variables are searched at a value, or none is.
pub(crate) fn refused_values(model: &Model, ask: &Ask) -> Option<String> {
    let is_at = |item: &&Searched| item.at.is_some();
    let at = ask.searched.iter().find(is_at)?;
    let name = model.variable_name(at.variable);
    if ask.statistic != Statistic::Distribution {
        let word = ask.statistic.word();
        return Some(format!(
            "`{word}` of `{name}` at one value is not computed: ask for `{word} P({name} | …)`"
        ));
    }
    let is_real = |id: &VariableId| !model.variables[*id].domain.is_finite();
    let searched = || ask.searched.iter().map(|item| item.variable);
    let reals = || searched().chain(ask.known.iter().map(|known| known.variable));
    let is_determined = |id: &VariableId| {
        is_real(id) && model.factor_of(*id).is_some_and(|factor| model.factors[factor].form.has_point())
    };
    let determined = ask.searched.iter().filter(is_at).map(|item| item.variable).find(is_determined);
    // What finite variables determine is a point whatever else is known.
    let is_met =
        |id: &VariableId| !model.is_determined(*id, &|_| false) || searched().filter(is_real).count() > 1;
    if let Some(determined) = determined.filter(|id| reals().filter(is_real).count() > 1 && is_met(id)) {
        let name = model.variable_name(determined);
        return Some(format!("`{name}` is determined by other variables: ask for `P({name} == …)`"));
    }
    let open = ask.searched.iter().find(|item| !is_at(item))?;
    let open = model.variable_name(open.variable);
    Some(format!(
        "`{name}` is searched at one value beside all values of `{open}`: ask for `P({open} | {name} = …)`, or give `{open}` a value too"
    ))
}

impl Part {
    /// The rows of a statistic; of a statistic that has no meaning for the part, those of the part.
    ///
    /// # Errors
    /// More draws than memory holds; a mixture of very many distinct components; a law without a single mode.
    pub(crate) fn rows_of(&self, model: &Model, ask: &Ask, seed: u64) -> Result<Vec<Row>, Error> {
        let too_large = |cells: f64, most: f64, help: &str| Error::TooLarge {
            name: model.ask_text(ask),
            cells,
            most,
            help: help.to_owned(),
        };
        let at = |values: &[f64], figure| Row {
            values: self
                .of
                .iter()
                .map(|slot| slot.name(model))
                .zip(values.iter().map(|x| exact(*x)))
                .collect(),
            figure,
        };
        let one = || -> Result<Option<OneReal>, Error> {
            let PartLaw::Mixture(mixture) = &self.law else { return Ok(None) };
            let own = mixture.of_slot(0);
            match own.count() > MOST_DISTINCT {
                true => Err(too_large(
                    own.count() as f64,
                    MOST_DISTINCT as f64,
                    "ask for its moments or quantiles",
                )),
                false => Ok(Some(own)),
            }
        };
        let draws = |count: usize, draw: &dyn Fn(&mut Random) -> Vec<f64>| -> Result<Vec<Row>, Error> {
            check_draws(|| model.ask_text(ask), count as f64 * self.of.len() as f64)?;
            let mut random = seeded(seed, &model.ask_text(ask));
            Ok((1..=count).map(|number| at(&draw(&mut random), Figure::Draw { draw: number })).collect())
        };
        let alone = self.of.len() == 1;
        // Finite values and reals, in the order of the slots.
        let together = |(finite, reals): (Vec<usize>, Vec<f64>), figure| {
            let (mut finite, mut reals) = (finite.into_iter(), reals.into_iter());
            let value = |slot: &Slot| match slot.count {
                0 => exact(reals.next().unwrap_or(f64::NAN)),
                _ => model.value_name(slot.variable, finite.next().unwrap_or(0)),
            };
            let values = self.of.iter().map(|slot| slot.name(model)).zip(self.of.iter().map(value));
            Row { values: values.collect(), figure }
        };
        match (&self.law, &ask.statistic) {
            (PartLaw::ConditionalGaussian(law), Statistic::Draw(count)) => {
                check_draws(|| model.ask_text(ask), *count as f64 * self.of.len() as f64)?;
                let mut random = seeded(seed, &model.ask_text(ask));
                Ok((1..=*count).map(|draw| together(law.draw(&mut random), Figure::Draw { draw })).collect())
            }
            (PartLaw::ConditionalGaussian(law), Statistic::Entropy) => {
                let entropy = law.entropy(&self.of);
                Ok(vec![Row { values: Vec::new(), figure: Figure::Entropy { entropy, error: None } }])
            }
            (PartLaw::ConditionalGaussian(law), Statistic::Maximum | Statistic::Argmax { .. }) => {
                let places = apart(&self.of).1;
                let depth = |place: &usize| parents_first(model, self.of[places[*place]].variable);
                let mut order: Vec<usize> = (0..places.len()).collect();
                order.sort_by_key(depth);
                let row =
                    |(finite, peak): (Vec<usize>, Peak)| together((finite, peak.at.clone()), of_peak(&peak));
                Ok(first_or_all(&ask.statistic, law.modes(&self.of, &order).into_iter().map(row).collect()))
            }
            (
                PartLaw::Mixture(mixture),
                Statistic::Entropy | Statistic::Maximum | Statistic::Argmax { .. },
            ) if !alone => {
                let values = vec![Vec::new(); mixture.0.len()];
                let law = ConditionalGaussian { values, mixture: mixture.clone() };
                Self { law: PartLaw::ConditionalGaussian(law), ..self.clone() }.rows_of(model, ask, seed)
            }
            (PartLaw::Mixture(mixture), Statistic::Draw(count)) => {
                draws(*count, &|random| mixture.draw(random))
            }
            (PartLaw::NamedMixture(mixture), Statistic::Draw(count)) => {
                draws(*count, &|random| mixture.draw(random))
            }
            (PartLaw::Laws { laws, .. }, Statistic::Draw(count)) => {
                draws(*count, &|random| laws.iter().map(|law| law.draw(random)).collect())
            }
            (PartLaw::Mixture(_) | PartLaw::NamedMixture(_) | PartLaw::Laws { .. }, Statistic::Entropy)
                if alone =>
            {
                one()?;
                let entropy = self.entropy_of_one_real().unwrap_or(f64::NAN);
                Ok(vec![Row { values: Vec::new(), figure: Figure::Entropy { entropy, error: None } }])
            }
            (PartLaw::Mixture(_), Statistic::Maximum | Statistic::Argmax { .. }) if alone => {
                let peaks = one()?.map_or_else(Vec::new, |own| own.modes());
                let rows = peaks.iter().map(|peak| at(&peak.at, of_peak(peak))).collect();
                Ok(first_or_all(&ask.statistic, rows))
            }
            (PartLaw::Laws { laws, .. }, Statistic::Maximum | Statistic::Argmax { .. }) if alone => {
                match laws[0].largest_density() {
                    Some((x, density)) => Ok(vec![at(&[x], Figure::Density { density })]),
                    None => {
                        let reason = format!("`{}` has its largest density at more than one value", laws[0]);
                        Err(Error::Unplanned { question: model.ask_text(ask), reason })
                    }
                }
            }
            _ => Ok(self.moments_or_rows(model, &ask.statistic)),
        }
    }

    /// The row of the density, or the probability, at one value of each slot, with probabilities of the finite ones; named laws are
    /// independent.
    pub(crate) fn row_at(&self, model: &Model, values: &[f64]) -> Row {
        let (finite, reals) = apart(&self.of);
        let figure = match &self.law {
            PartLaw::ConditionalGaussian(law) => {
                let ordinals: Vec<usize> = finite.iter().map(|place| values[*place] as usize).collect();
                let reals: Vec<f64> = reals.iter().map(|place| values[*place]).collect();
                law.figure(&ordinals, &reals)
            }
            PartLaw::Mixture(mixture) => mixture.figure(values),
            PartLaw::Laws { laws, .. } => {
                Figure::Density { density: laws.iter().zip(values).map(|(law, x)| law.density(*x)).product() }
            }
            PartLaw::NamedMixture(mixture) => Figure::Density { density: mixture.density_at(values) },
            law => Figure::Density { density: law.density(values) },
        };
        let value = |(slot, value): (&Slot, &f64)| match slot.count {
            0 => exact(*value),
            _ => model.value_name(slot.variable, *value as usize),
        };
        let names = self.of.iter().map(|slot| slot.name(model));
        let values = names.zip(self.of.iter().zip(values).map(value)).collect();
        Row { values, figure }
    }

    /// The entropy of one real with a named law or a mixture, in nats.
    pub(crate) fn entropy_of_one_real(&self) -> Option<f64> {
        match (&self.law, self.of.len()) {
            (PartLaw::Laws { laws, .. }, 1) => Some(laws[0].entropy()),
            (PartLaw::Mixture(mixture), 1) => Some(mixture.of_slot(0).entropy()),
            (PartLaw::NamedMixture(mixture), 1) => Some(mixture.entropy(0)),
            _ => None,
        }
    }

    /// The expectation, the variance or quantiles of each slot; of any other statistic, the rows of the part.
    fn moments_or_rows(&self, model: &Model, statistic: &Statistic) -> Vec<Row> {
        let [mean, variance]: [&dyn Fn(usize) -> f64; 2] = match &self.law {
            PartLaw::Mixture(of) => [&|place| of.mean(place), &|place| of.covariance(place, place)],
            PartLaw::NamedMixture(of) => [&|place| of.mean(place), &|place| of.covariance(place, place)],
            PartLaw::Laws { laws, .. } => [&|place| laws[place].mean(), &|place| laws[place].variance()],
            _ => return self.rows(model),
        };
        let quantile = |place: usize, level: f64| match &self.law {
            PartLaw::Mixture(of) => of.quantile(place, level),
            PartLaw::NamedMixture(of) => of.quantile(place, level),
            PartLaw::Laws { laws, .. } => laws[place].quantile(level),
            _ => f64::NAN,
        };
        let mut rows = Vec::new();
        for (place, slot) in self.of.iter().enumerate() {
            let quantiles =
                |levels: &[f64]| levels.iter().map(|level| (quantile(place, *level), None)).collect();
            let own = figures(statistic, quantiles).or_else(|| {
                Some(vec![match statistic {
                    Statistic::Expectation => Figure::Expectation { expectation: mean(place), error: None },
                    Statistic::Variance => Figure::Variance { variance: variance(place), error: None },
                    _ => return None,
                }])
            });
            let Some(own) = own else { return self.rows(model) };
            let row = |figure| Row { values: vec![(slot.name(model), String::new())], figure };
            rows.extend(own.into_iter().map(row));
        }
        rows
    }
}

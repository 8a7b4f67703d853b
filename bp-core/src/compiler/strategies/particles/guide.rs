//! The guide of particles: the program linearised along its most probable path, and what it expects of later observations.
//!
//! In: a program whose hidden reals have normal or Dirac forms, and the observations of all instants. Out: the joint
//! law of each instant given the state before it and its observations, and the residuals of the later ones. Invariant: a guide changes no
//! expectation: particles are weighted by the program's own densities over those of the guide. In a linear program all weights are
//! equal.
//!
//! ψₜ(x) ≈ p(zₜ₊₁ … z_T given x) is kept as rows a x + c, each a standard normal residual: with the noises e of an instant and its
//! residuals stacked, a QR decomposition sums out e (Paige and Saunders 1977). Twisted particle filters: Whiteley and Lee, *Annals
//! of Statistics* 42:115-141, 2014; Guarniero, Johansen and Lee, *JASA* 112:1636-1647, 2017. The path is found by Gauss–Newton
//! steps: the iterated Kalman smoother (Bell, *SIAM Journal on Optimization* 4:626-636, 1994).

use super::lead::Lead;
use crate::analysis::relevant_variables;
use crate::distribution::{Instance, LinearMean, Setting};
use crate::error::Error;
use crate::ids::Id;
use crate::model::{Ask, Model};
use crate::sample::Observations;
use crate::strategies::gaussian::{SlotLaw, is_normal};
use crate::strategies::over_time::Instant;
use nalgebra::DMatrix;
use std::collections::HashMap;

/// How many paths are tried.
const MOST_PATHS: usize = 12;

/// The relative change of the path at which it stays.
const STAYS: f64 = 1e-6;

/// The equation of a slot of an instant, and its value where it is observed.
#[derive(Clone, Debug)]
struct Equation {
    slot: usize,
    mean: LinearMean,
    seen: Option<f64>,
}

/// A residual that is standard normal: Σ factor · slot + constant.
#[derive(Clone, Debug, Default)]
pub(super) struct Residual {
    pub(super) terms: Vec<(usize, f64)>,
    pub(super) constant: f64,
}

/// One instant of the guide; the first is X^-1 before the first instant.
#[derive(Clone, Debug, Default)]
pub(super) struct Step {
    equations: Vec<Equation>,
    /// The residuals of later observations, in the slots of this instant.
    pub(super) ahead: Vec<Residual>,
}

/// The guide of all instants.
#[derive(Clone, Debug)]
pub(crate) struct Guide {
    pub(super) steps: Vec<Step>,
    /// The most probable path.
    path: Vec<Vec<f64>>,
    /// The steps as functions of the state of a particle.
    pub(super) leads: Vec<Lead>,
}

/// Whether particles can be guided: every hidden variable is real, and normal or a Dirac.
pub(super) fn applies(model: &Model, ask: &Ask) -> bool {
    let known = |id| ask.known.iter().any(|known| known.variable == id);
    relevant_variables(model, std::slice::from_ref(ask)).into_iter().all(|id| {
        let normal = || model.factor_of(id).is_none_or(|factor| is_normal(&model.factors[factor].form));
        Some(id) == model.plate_index() || known(id) || (!model.variables[id].domain.is_finite() && normal())
    })
}

/// The parts of a program from which its guide is made.
pub(super) struct Parts<'p, 's> {
    pub(super) first: &'p Setting<'s>,
    pub(super) later: &'p Setting<'s>,
    /// The instances of X^-1 before the first instant, and those of an instant.
    pub(super) before: &'p [Instance],
    pub(super) now: &'p [Instance],
    /// (slot of X, slot of X^-1)
    pub(super) carried: &'p [(usize, usize)],
    /// The variables that matter.
    pub(super) relevant: Vec<bool>,
}

impl Guide {
    /// The guide of some observations; `None` where the program cannot be linearised along a path.
    pub(super) fn of(parts: &Parts<'_, '_>, instants: &[Instant]) -> Option<Self> {
        let mut path = parts.prior_path(instants).ok()??;
        let mut best = None;
        for _ in 0..MOST_PATHS {
            let guide = parts.guide(instants, &path)?;
            let next = parts.path(instants, &guide)?;
            let size = |value: &f64| 1.0 + value.abs();
            let change = path.iter().flatten().zip(next.iter().flatten());
            let change =
                change.filter(|(old, _)| !old.is_nan()).map(|(old, new)| (old - new).abs() / size(old));
            let change = change.fold(0.0, f64::max);
            path = next;
            best = Some(guide);
            if change <= STAYS {
                break;
            }
        }
        best
    }

    /// The joint law of the slots of an instant, given a particle before it, the observations and what is expected of later ones.
    pub(super) fn law(&self, step: usize, values: &[f64], law: &SlotLaw) -> SlotLaw {
        let mut law = law.clone();
        let Step { equations, ahead } = &self.steps[step];
        for Equation { slot, mean, seen } in equations {
            let (terms, constant) = split(&mean.terms, mean.constant, values, &law);
            law.extend(*slot, &terms, constant, mean.deviation);
            if let Some(value) = seen {
                law.observe(*slot, *value);
            }
        }
        for residual in ahead {
            law.extend(usize::MAX, &residual.terms, residual.constant, 1.0);
            law.observe(usize::MAX, 0.0);
        }
        law
    }

    /// The slots that are proposed at an instant: those with noise that are not observed.
    pub(super) fn proposed(&self, step: usize) -> impl Iterator<Item = usize> {
        let hidden = |it: &&Equation| it.seen.is_none() && it.mean.deviation > 0.0;
        self.steps[step].equations.iter().filter(hidden).map(|it| it.slot)
    }

    /// The value of a slot on the path.
    pub(super) fn on_path(&self, step: usize, slot: usize) -> f64 {
        self.path[step][slot]
    }
}

/// The terms of slots that a law has; the others have values.
fn split(
    terms: &[(usize, f64)],
    mut constant: f64,
    values: &[f64],
    law: &SlotLaw,
) -> (Vec<(usize, f64)>, f64) {
    let mut own = Vec::with_capacity(terms.len());
    for (slot, factor) in terms {
        match law.has(*slot) {
            true => own.push((*slot, *factor)),
            false => constant += factor * values[*slot],
        }
    }
    (own, constant)
}

impl Parts<'_, '_> {
    fn instances(&self, step: usize) -> impl Iterator<Item = &Instance> {
        let all = if step == 0 { self.before } else { self.now };
        all.iter().filter(|it| self.relevant[self.later.variable_of(it.left[0]).position()])
    }

    fn setting(&self, step: usize) -> &Setting<'_> {
        if step <= 1 { self.first } else { self.later }
    }

    /// The values before an instant of a path: X^-1 and what is observed.
    fn entered(&self, step: usize, before: Option<&Vec<f64>>, seen: &Instant) -> Vec<f64> {
        let mut values = Observations::none(self.setting(step)).values;
        if let Some(before) = before {
            for (now, previous) in self.carried {
                values[*previous] = before[if step == 1 { *previous } else { *now }];
            }
        }
        seen.iter().for_each(|(slot, value)| values[*slot] = *value);
        values
    }

    /// Each instant at its means given the instant before it and its own observations.
    fn prior_path(&self, instants: &[Instant]) -> Result<Option<Vec<Vec<f64>>>, Error> {
        let mut path: Vec<Vec<f64>> = Vec::with_capacity(instants.len() + 1);
        let nothing = Instant::new();
        for step in 0..=instants.len() {
            let seen = step.checked_sub(1).map_or(&nothing, |number| &instants[number]);
            let mut values = self.entered(step, path.last(), seen);
            // Forward at the means, then at the means given the observations.
            let Some(equations) = self.tangents(step, seen, &mut values, true)? else { return Ok(None) };
            let steps = vec![Step { equations, ahead: Vec::new() }];
            let alone = Guide { steps, path: Vec::new(), leads: Vec::new() };
            self.decode(&alone, 0, &mut values);
            path.push(values);
        }
        Ok(Some(path))
    }

    /// The tangents of an instant at some values; `forward`: values that are not observed become the means.
    fn tangents(
        &self,
        step: usize,
        seen: &Instant,
        values: &mut [f64],
        forward: bool,
    ) -> Result<Option<Vec<Equation>>, Error> {
        let seen: HashMap<usize, f64> = seen.iter().copied().collect();
        let setting = self.setting(step);
        let mut equations = Vec::new();
        for instance in self.instances(step) {
            let slot = instance.left[0];
            let seen = seen.get(&slot).copied();
            let Some(mean) = setting.tangent(instance, values)? else {
                // An observation of another form does not guide; it is a number where others depend on it.
                let Some(value) = seen.filter(|_| instance.left.len() == 1) else { return Ok(None) };
                let mean = LinearMean { constant: value, ..LinearMean::default() };
                equations.push(Equation { slot, mean, seen: None });
                continue;
            };
            if forward && seen.is_none() {
                values[slot] = mean.at(values);
            }
            if seen.is_some() && mean.deviation == 0.0 {
                return Ok(None);
            }
            equations.push(Equation { slot, mean, seen });
        }
        Ok(Some(equations))
    }

    /// The guide along a path.
    fn guide(&self, instants: &[Instant], path: &[Vec<f64>]) -> Option<Guide> {
        let nothing = Instant::new();
        let mut steps = vec![Step::default(); instants.len() + 1];
        for (step, values) in path.iter().enumerate() {
            let seen = step.checked_sub(1).map_or(&nothing, |number| &instants[number]);
            steps[step].equations = self.tangents(step, seen, &mut values.clone(), false).ok()??;
        }
        for step in (1..steps.len()).rev() {
            let residuals = self.look_back(&steps[step])?;
            // The slots of X^-1 are those of X of the instant before.
            let renamed = |(slot, factor): (usize, f64)| {
                let (now, before) = self.carried.iter().find(|(_, before)| *before == slot)?;
                Some((if step == 1 { *before } else { *now }, factor))
            };
            let renamed =
                |it: Residual| Residual { terms: it.terms.into_iter().filter_map(renamed).collect(), ..it };
            steps[step - 1].ahead = residuals.into_iter().map(renamed).collect();
        }
        Some(Guide { steps, path: path.to_vec(), leads: Vec::new() })
    }

    /// The residuals of an instant and of the later ones, in the slots of X^-1.
    fn look_back(&self, step: &Step) -> Option<Vec<Residual>> {
        let hidden = |it: &&Equation| it.seen.is_none() && it.mean.deviation > 0.0;
        let noises = step.equations.iter().filter(hidden).count();
        let before: HashMap<usize, usize> =
            self.carried.iter().enumerate().map(|(place, (_, before))| (*before, noises + place)).collect();
        let width = noises + self.carried.len() + 1;
        // Each slot as a row of noises, slots of X^-1, and a constant.
        let mut rows: HashMap<usize, Vec<f64>> = HashMap::new();
        for (slot, column) in &before {
            let mut row = vec![0.0; width];
            row[*column] = 1.0;
            rows.insert(*slot, row);
        }
        let affine = |terms: &[(usize, f64)], constant: f64, rows: &HashMap<usize, Vec<f64>>| {
            let mut sum = vec![0.0; width];
            sum[width - 1] = constant;
            for (slot, factor) in terms {
                let row = rows.get(slot)?;
                sum.iter_mut().zip(row).for_each(|(cell, own)| *cell += factor * own);
            }
            Some(sum)
        };
        let mut stacked: Vec<Vec<f64>> = Vec::new();
        let mut noise = 0;
        for Equation { slot, mean, seen } in &step.equations {
            let mut row = affine(&mean.terms, mean.constant, &rows)?;
            if let Some(value) = seen {
                let mut residual = row.clone();
                residual[width - 1] -= value;
                residual.iter_mut().for_each(|cell| *cell /= mean.deviation);
                stacked.push(residual);
                row = vec![0.0; width];
                row[width - 1] = *value;
            } else if mean.deviation > 0.0 {
                row[noise] += mean.deviation;
                let mut own = vec![0.0; width];
                own[noise] = 1.0;
                stacked.push(own);
                noise += 1;
            }
            rows.insert(*slot, row);
        }
        for residual in &step.ahead {
            stacked.push(affine(&residual.terms, residual.constant, &rows)?);
        }
        if stacked.is_empty() {
            return Some(Vec::new());
        }
        let matrix = DMatrix::from_fn(stacked.len(), width, |row, column| stacked[row][column]);
        let triangle = matrix.qr().r();
        let mut found = Vec::new();
        for row in noises..triangle.nrows().min(width - 1) {
            let own = self
                .carried
                .iter()
                .map(|(_, before_slot)| (*before_slot, triangle[(row, before[before_slot])]));
            let terms: Vec<(usize, f64)> = own.filter(|(_, factor)| *factor != 0.0).collect();
            let constant = triangle[(row, width - 1)];
            if !constant.is_finite() || terms.iter().any(|(_, factor)| !factor.is_finite()) {
                return None;
            }
            if !terms.is_empty() {
                found.push(Residual { terms, constant });
            }
        }
        Some(found)
    }

    /// The most probable path of a guide.
    fn path(&self, instants: &[Instant], guide: &Guide) -> Option<Vec<Vec<f64>>> {
        let nothing = Instant::new();
        let mut path: Vec<Vec<f64>> = Vec::with_capacity(instants.len() + 1);
        for step in 0..=instants.len() {
            let seen = step.checked_sub(1).map_or(&nothing, |number| &instants[number]);
            let mut values = self.entered(step, path.last(), seen);
            self.decode(guide, step, &mut values);
            if guide.steps[step].equations.iter().any(|it| !values[it.slot].is_finite()) {
                return None;
            }
            path.push(values);
        }
        Some(path)
    }

    /// Puts the slots of an instant at their means, given the instant before.
    fn decode(&self, guide: &Guide, step: usize, values: &mut [f64]) {
        let law = guide.law(step, values, &SlotLaw::new(true));
        for Equation { slot, seen, .. } in &guide.steps[step].equations {
            if let (None, Some([mean, _])) = (seen, law.of(*slot)) {
                values[*slot] = mean;
            }
        }
    }
}

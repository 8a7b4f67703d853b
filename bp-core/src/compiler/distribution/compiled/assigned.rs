//! Values of reals that are computed from others, compiled: those that Diracs give, and standardised ones, x = m + s z.
//!
//! In: instances of a factor, and which slots are fixed. Out: [`Assigned`]: the values of their left-hand sides, or of some of them,
//! and the derivatives by what they are computed from. Invariant: instances that are computed together do not read each other.

use super::{NotCompiled, Recording};
use crate::distribution::tape::{Cells, Node, Seed, Tape};
use crate::distribution::{Instance, Setting};
use crate::ids::ExpressionId;
use crate::law::{Arithmetic, Law};
use crate::model::{Domain, Environment, Form};
use crate::operators::Binary;

/// The compiled values of left-hand sides.
#[derive(Clone, Debug)]
pub(crate) struct Assigned {
    tape: Tape,
    value: Node,
    /// The slot that each instance gives its value.
    left: Vec<usize>,
    standard: Option<Standard>,
}

/// What belongs to a standardised value.
#[derive(Clone, Debug)]
struct Standard {
    /// Its centre and its scale, and ln of the density of z with whether the numbers of the form are valid.
    centre: Node,
    scale: Node,
    wanted: [Node; 2],
    /// Whether the value is exp(m + s z).
    is_exponential: bool,
}

/// The law of z where x = m + s z, or x = exp(m + s z), has a law.
fn standard_law(law: Law) -> Option<Law> {
    match law {
        Law::Normal | Law::Cauchy | Law::Laplace | Law::StudentT => Some(law),
        Law::Lognormal => Some(Law::Normal),
        _ => None,
    }
}

/// The scale of a form that can be standardised.
pub(crate) fn scale_of(form: &Form) -> Option<ExpressionId> {
    match form {
        Form::Law { law, arguments } => standard_law(*law).and_then(|_| arguments.last().copied()),
        _ => None,
    }
}

impl Assigned {
    /// The values of instances of one factor and one component; `fixed` gives the values of slots that never change. `None` where
    /// the form is not compiled, or the left-hand side is not one real.
    pub(crate) fn new(
        setting: &Setting<'_>,
        instances: &[&Instance],
        fixed: &dyn Fn(usize) -> Option<f64>,
    ) -> Option<Self> {
        let left = left(setting, instances)?;
        let mut recording = Recording::new(setting, instances, fixed)?;
        let value = recording.point(setting.form_at(instances[0])).ok()?;
        let mut tape = recording.tape;
        let value = tape.finish(&[value])[0];
        Some(Self { tape, value, left, standard: None })
    }

    /// The same of forms with a centre and a scale: the left-hand side of each instance is computed from z in the slot that `of` gives.
    pub(crate) fn standardised(
        setting: &Setting<'_>,
        instances: &[&Instance],
        fixed: &dyn Fn(usize) -> Option<f64>,
        of: &dyn Fn(usize) -> usize,
    ) -> Option<Self> {
        let left = left(setting, instances)?;
        let mut recording = Recording::new(setting, instances, fixed)?;
        let Form::Law { law, arguments } = setting.form_at(instances[0]) else { return None };
        let standard = standard_law(*law)?;
        let arguments: Vec<Node> =
            arguments.iter().map(|id| recording.operand(*id)).collect::<Result<_, _>>().ok()?;
        let [shape @ .., centre, scale] = arguments.as_slice() else { return None };
        let tape = &mut recording.tape;
        let z = tape.slots(left.iter().map(|slot| of(*slot)).collect());
        let (zero, one) = (tape.constant(0.0), tape.constant(1.0));
        let parameters: Vec<Node> = shape.iter().copied().chain([zero, one]).collect();
        let ln = standard.ln_density(tape, z, &parameters);
        let mut holds = tape.greater(*scale, zero);
        for shape in shape {
            let positive = tape.greater(*shape, zero);
            holds = tape.binary(Binary::And, holds, positive);
        }
        let away = tape.multiply(*scale, z);
        let mut value = tape.add(*centre, away);
        let is_exponential = *law == Law::Lognormal;
        if is_exponential {
            value = tape.exp(value);
        }
        let places = tape.finish(&[value, *centre, *scale, ln, holds]);
        let standard =
            Standard { centre: places[1], scale: places[2], wanted: [places[3], places[4]], is_exponential };
        Some(Self { tape: recording.tape, value: places[0], left, standard: Some(standard) })
    }

    /// z of the left-hand sides of some instances at their values, in the slots that `of` gives.
    pub(crate) fn standardise(
        &self,
        rows: &[u32],
        values: &mut [f64],
        cells: &mut Cells,
        of: &dyn Fn(usize) -> usize,
    ) {
        let Some(standard) = &self.standard else { return };
        let (mut centres, mut scales) = (Vec::new(), Vec::new());
        self.tape.numbers(standard.centre, rows, values, &mut cells.numbers, &mut centres);
        self.tape.numbers(standard.scale, rows, values, &mut cells.numbers, &mut scales);
        for ((row, centre), scale) in rows.iter().zip(centres).zip(scales) {
            let slot = self.left[*row as usize];
            let value = if standard.is_exponential { values[slot].ln() } else { values[slot] };
            values[of(slot)] = (value - centre) / scale;
        }
    }

    /// Σ ln of the densities of z of some instances, 0 for Diracs, with its derivatives by all slots added to `slopes`; `None` where a
    /// number is not valid.
    pub(crate) fn ln(
        &self,
        rows: &[u32],
        values: &[f64],
        cells: &mut Cells,
        slopes: &mut [f64],
    ) -> Option<f64> {
        let Some(standard) = &self.standard else { return Some(0.0) };
        let (ln, holds) = self.tape.slopes(standard.wanted, rows, values, Seed::One, cells, slopes);
        (holds && !ln.is_nan()).then_some(ln)
    }

    /// Gives the left-hand sides of some instances their values; whether these are finite. `found` is memory.
    pub(crate) fn put(
        &self,
        rows: &[u32],
        values: &mut [f64],
        cells: &mut Cells,
        found: &mut Vec<f64>,
    ) -> bool {
        self.tape.numbers(self.value, rows, values, &mut cells.numbers, found);
        rows.iter().zip(&*found).for_each(|(row, value)| values[self.left[*row as usize]] = *value);
        found.iter().all(|value| value.is_finite())
    }

    /// Adds to `slopes` the derivatives by what the values of some instances are computed from, given those by the values.
    pub(crate) fn slopes(&self, rows: &[u32], values: &[f64], cells: &mut Cells, slopes: &mut [f64]) {
        self.tape.slopes([self.value; 2], rows, values, Seed::Slots(&self.left), cells, slopes);
    }
}

/// The left-hand sides of instances, if each is one real.
fn left(setting: &Setting<'_>, instances: &[&Instance]) -> Option<Vec<usize>> {
    let slot = |instance: &&Instance| instance.left.first().copied().filter(|_| instance.left.len() == 1);
    let left = instances.iter().map(slot).collect::<Option<Vec<usize>>>()?;
    let domain = &setting.model.variables[setting.variable_of(*left.first()?)].domain;
    matches!(domain, Domain::Real | Domain::Vector(_)).then_some(left)
}

impl Recording<'_, '_> {
    /// The value of a Dirac.
    fn point(&mut self, form: &Form) -> Result<Node, NotCompiled> {
        match form {
            Form::Dirac(value) => self.operand(*value),
            Form::If { condition, then, otherwise } => {
                let condition = self.scalar(*condition)?;
                let (then, otherwise) = (self.point(then)?, self.point(otherwise)?);
                Ok(self.tape.select(condition, then, otherwise))
            }
            _ => Err(NotCompiled),
        }
    }
}

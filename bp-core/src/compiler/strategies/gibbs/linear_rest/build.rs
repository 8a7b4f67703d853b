//! The equations of what is integrated out.
//!
//! In: instances of linear normal and Dirac forms. Out: a [`LinearRest`]. Invariant: what does not depend on drawn variables is
//! computed here, once.

use super::super::elimination::{Elimination, HALF_LN_TAU, condense};
use super::super::signature::signature;
use super::{Determined, Deviation, Linear, LinearRest, Place, Row, Shared, equation};
use crate::distribution::{Instance, Setting};
use crate::error::Error;
use crate::ids::ExpressionId;
use crate::model::Form;
use std::collections::{BTreeMap, BTreeSet, HashMap};

impl<'s> LinearRest<'s> {
    /// The equations of these instances, parents first. `linear` are the slots that are integrated out, `drawn` those that are
    /// neither that nor observed; `values` the observations.
    ///
    /// # Errors
    /// A number outside the range that a form accepts.
    pub(in super::super) fn new(
        setting: &'s Setting<'s>,
        instances: &[Instance],
        linear: Vec<bool>,
        drawn: &[bool],
        values: &[f64],
    ) -> Result<Self, Error> {
        let values = values.iter().zip(&linear).map(|(value, linear)| if *linear { 0.0 } else { *value });
        let values: Vec<f64> = values.collect();
        let mut rest = Self {
            setting,
            linear,
            places: HashMap::new(),
            unknowns: Vec::new(),
            determined: Vec::new(),
            rows: Vec::new(),
            shared: Vec::new(),
            elimination: Elimination::new(0, &[], false),
            ln_constant: 0.0,
        };
        let mut signatures = HashMap::new();
        let mut flat = false;
        for instance in instances {
            flat |= rest.add(instance, drawn, &values, &mut signatures)?;
        }
        rest.condense();
        let support = |row: &Row| match &row.known {
            Some(known) => known.terms.iter().map(|(unknown, _)| *unknown).collect(),
            None => {
                let mut support = rest.support(setting.reads(&row.instance));
                support.extend(row.unknown);
                support.into_iter().collect::<Vec<usize>>()
            }
        };
        let supports: Vec<Vec<usize>> = rest.rows.iter().map(support).collect();
        rest.elimination = Elimination::new(rest.unknowns.len(), &supports, flat);
        Ok(rest)
    }

    /// Adds an instance; returns whether it is flat.
    fn add(
        &mut self,
        instance: &Instance,
        drawn: &[bool],
        values: &[f64],
        signatures: &mut HashMap<(ExpressionId, Vec<u64>), usize>,
    ) -> Result<bool, Error> {
        let setting = self.setting;
        let slot = instance.left[0];
        let form = setting.form_at(instance);
        let new_unknown = |rest: &mut Self| {
            rest.places.insert(slot, Place::Unknown(rest.unknowns.len()));
            rest.unknowns.push(slot);
            rest.unknowns.len() - 1
        };
        if matches!(form, Form::Flat) {
            new_unknown(self);
            return Ok(true);
        }
        let normal = form.as_normal();
        let mean = normal.map(|(mean, _)| mean).or(match form {
            Form::Dirac(value) => Some(*value),
            _ => None,
        });
        let reads = match mean {
            Some(mean) => setting.slots_read(mean, &instance.indices),
            None => setting.reads(instance),
        };
        let varies = |slot: &usize| {
            let place = self.places.get(slot);
            drawn[*slot]
                || matches!(place, Some(Place::Determined(at)) if self.determined[*at].value.is_none())
        };
        let varies = reads.iter().any(varies) || drawn[slot];
        let known = match mean.filter(|_| !varies) {
            Some(mean) => {
                let (terms, constant) = setting.linear_form(mean, instance, values, &self.linear);
                Some(self.in_unknowns(&terms, constant, &|at| self.determined[at].value.as_ref()))
            }
            None => None,
        };
        // What is not a number is refused when it is computed with its form.
        let known = known.filter(Linear::is_finite);
        if self.linear[slot] && matches!(form, Form::Dirac(_)) {
            let support = self.support(reads);
            self.places.insert(slot, Place::Determined(self.determined.len()));
            self.determined.push(Determined { instance: instance.clone(), value: known, support });
            return Ok(false);
        }
        let unknown = self.linear[slot].then(|| new_unknown(self));
        let inputs = self.inputs(&reads, drawn).filter(|_| varies && !drawn[slot]);
        let deviation = match normal {
            Some((_, deviation)) => {
                let read = setting.slots_read(deviation, &instance.indices);
                if known.is_none() && !varies {
                    Deviation::Own
                } else if read.iter().any(|slot| drawn[*slot]) {
                    let key = (deviation, signature(setting, deviation, instance, &|slot| slot as u64));
                    let shared = &mut self.shared;
                    let new = || {
                        let instance = instance.clone();
                        shared.push(Shared { instance, expression: deviation, equations: 0, squares: 0.0 });
                        shared.len() - 1
                    };
                    Deviation::Shared(*signatures.entry(key).or_insert_with(new))
                } else if varies {
                    match setting.expression(deviation, instance, values) {
                        known if known > 0.0 && known.is_finite() => Deviation::Known(known),
                        _ => Deviation::Own,
                    }
                } else {
                    Deviation::Known(setting.linear_mean_at_zero(instance, values, &self.linear)?.deviation)
                }
            }
            None => Deviation::Own,
        };
        let known = known.map(|known| equation(known, unknown, values[slot]));
        self.rows.push(Row { instance: instance.clone(), unknown, known, mean, inputs, deviation });
        Ok(false)
    }

    /// The drawn slots among these, if all are finite and read directly.
    fn inputs(&self, reads: &BTreeSet<usize>, drawn: &[bool]) -> Option<Vec<usize>> {
        let model = self.setting.model;
        let direct = |slot: &&usize| !matches!(self.places.get(slot), Some(Place::Determined(_)));
        let is_finite = |slot: &&usize| model.variables[self.setting.variable_of(**slot)].domain.is_finite();
        let inputs: Vec<usize> = reads.iter().copied().filter(|slot| drawn[*slot]).collect();
        (reads.iter().all(|slot| direct(&slot)) && inputs.iter().all(|slot| is_finite(&slot)))
            .then_some(inputs)
    }

    /// Replaces equations of the same unknowns and the same deviation by as few as say the same.
    fn condense(&mut self) {
        let mut alike: BTreeMap<(Option<usize>, Vec<usize>), Vec<Row>> = BTreeMap::new();
        let mut others = Vec::new();
        for mut row in std::mem::take(&mut self.rows) {
            let shared = match (&mut row.known, row.unknown, row.deviation) {
                (Some(known), None, Deviation::Known(deviation)) => {
                    known.terms.iter_mut().for_each(|(_, coefficient)| *coefficient /= deviation);
                    known.constant /= deviation;
                    self.ln_constant -= deviation.ln();
                    row.deviation = Deviation::Known(1.0);
                    None
                }
                (Some(_), None, Deviation::Shared(shared)) => Some(shared),
                _ => {
                    others.push(row);
                    continue;
                }
            };
            let support =
                row.known.iter().flat_map(|known| &known.terms).map(|(unknown, _)| *unknown).collect();
            alike.entry((shared, support)).or_default().push(row);
        }
        for ((shared, support), rows) in alike {
            let width = support.len() + 1;
            if rows.len() <= width {
                others.extend(rows);
                continue;
            }
            let known = rows.iter().filter_map(|row| row.known.as_ref());
            let cells = |known: &Linear| {
                let terms = known.terms.iter().map(|(_, coefficient)| *coefficient);
                terms.chain([-known.constant]).collect::<Vec<f64>>()
            };
            let mut cells: Vec<f64> = known.flat_map(cells).collect();
            let squares = condense(&mut cells, width);
            let fewer = rows.len() - cells.len() / width;
            match shared {
                Some(shared) => {
                    self.shared[shared].equations += fewer;
                    self.shared[shared].squares += squares;
                }
                None => self.ln_constant -= fewer as f64 * HALF_LN_TAU + 0.5 * squares,
            }
            for (mut row, cells) in rows.into_iter().zip(cells.chunks_exact(width)) {
                let terms = support.iter().copied().zip(cells.iter().copied());
                let terms = terms.filter(|(_, coefficient)| *coefficient != 0.0).collect();
                row.known = Some(Linear { terms, constant: -cells[width - 1] });
                others.push(row);
            }
        }
        self.rows = others;
    }
}

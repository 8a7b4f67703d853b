//! Terms of a plan, as values of a kernel.
//!
//! In: a term. Out: a value. Invariant: a sum of a handful of products without inner sums is unrolled; any other
//! becomes a nest of its own, over the axes on which it depends.

use super::{Lowering, Meaning};
use crate::equation::{Binding, Term};
use crate::error::Error;
use crate::ids::{AxisId, TermId, ValueId, VariableId};
use crate::kernel::{Fold, Index, Reduce};
use crate::law::Constraint;
use crate::operators::{Binary, Unary};

/// The longest sum that is unrolled.
const WRITTEN_OUT: usize = 4;

/// A pending step of the lowering of a term.
enum Task {
    /// Lower it.
    Term(TermId),
    /// Multiply the last two values.
    Multiply,
    /// Replace the last value by 0 where this variable is outside its domain.
    Guard(VariableId),
    /// Sum the last value over these axes of these loop variables.
    Sum(Vec<VariableId>, Vec<AxisId>),
    /// Read the last value at the solved value of this variable, whose loop has this axis.
    At(VariableId, AxisId),
}

/// The last value, and the one before it.
fn two(values: &mut Vec<ValueId>) -> (ValueId, ValueId) {
    let last = values.pop().expect("internal: there are two values");
    (last, values.pop().expect("internal: there are two values"))
}

impl Lowering<'_> {
    /// The value of a term. Sums may nest as deeply as a chain is long, so pending steps are kept in a list, not on the
    /// stack.
    pub(super) fn term(&mut self, id: TermId) -> Result<ValueId, Error> {
        let (mut tasks, mut values) = (vec![Task::Term(id)], Vec::new());
        while let Some(task) = tasks.pop() {
            match task {
                Task::Term(id) => self.begin(id, &mut tasks, &mut values)?,
                Task::Multiply => {
                    let (factor, product) = two(&mut values);
                    values.push(self.builder.binary(Binary::Multiply, product, factor));
                }
                Task::At(variable, axis) => {
                    self.stop(variable);
                    let value = values.pop().expect("internal: a term has a value");
                    values.push(self.read_at(variable, axis, value)?);
                }
                Task::Guard(variable) => {
                    let product = values.pop().expect("internal: a product is guarded");
                    let zero = self.builder.constant(0.0);
                    let (inside, holds) = self.inside(variable)?;
                    let product = self.builder.select(inside, product, zero);
                    values.push(self.only_if(holds, product));
                }
                Task::Sum(variables, axes) => {
                    variables.iter().for_each(|variable| self.stop(*variable));
                    let value = values.pop().expect("internal: a sum has a body");
                    values.push(self.fold_over("sum", Fold::Sum, &axes, value));
                }
            }
        }
        Ok(values.pop().expect("internal: a term has a value"))
    }

    /// Pushes the value of a term, or the steps that compute it.
    fn begin(&mut self, id: TermId, tasks: &mut Vec<Task>, values: &mut Vec<ValueId>) -> Result<(), Error> {
        let value = match self.exact.terms[id].clone() {
            Term::Joint => return Err(self.unplanned("its joint distribution is not decomposed")),
            Term::Factor(factor) => self.factor(factor)?,
            Term::Likelihood(variable, weights) => self.likelihood(variable, &weights)?,
            Term::Inside(variable) => {
                let (inside, holds) = self.inside(variable)?;
                self.only_if(holds, inside)
            }
            Term::Possible(factor) => {
                // NaN stays NaN. A density may underflow: code that is not run again computes its logarithm.
                let is_density = self.is_density(&self.model.factors[factor]);
                let (asked, least, otherwise) = match is_density && !self.runs_anew {
                    true => {
                        let ln = self.ln_factor(factor)?;
                        (ln, f64::NEG_INFINITY, self.builder.unary(Unary::Exponential, ln))
                    }
                    false => {
                        let value = self.factor(factor)?;
                        (value, 0.0, value)
                    }
                };
                let (one, least) = (self.builder.constant(1.0), self.builder.constant(least));
                let possible = self.builder.binary(Binary::Greater, asked, least);
                self.builder.select(possible, one, otherwise)
            }
            Term::Product(factors) => {
                // A product with an indicator that is 0 is 0, even where its other factors are undefined.
                let guard = |id: &TermId| match self.exact.terms[*id] {
                    Term::Inside(variable) => Some(variable),
                    _ => None,
                };
                tasks.extend(factors.iter().rev().filter_map(guard).map(Task::Guard));
                let others = factors.iter().rev().filter(|id| guard(id).is_none());
                tasks.extend(others.flat_map(|factor| [Task::Multiply, Task::Term(*factor)]));
                self.builder.constant(1.0)
            }
            Term::Sum(over, body) => match over.as_slice() {
                [one] if self.is_short(*one, body) => self.written_out(*one, body)?,
                several => {
                    let mut axes: Vec<AxisId> = Vec::new();
                    for variable in several {
                        axes.extend(self.run_through(*variable));
                    }
                    tasks.extend([Task::Sum(over, axes), Task::Term(body)]);
                    return Ok(());
                }
            },
            Term::FirstScan(scan) => self.first_scan(&scan)?,
            Term::At(variable, body) => {
                let axis = self.run_through(variable)[0];
                tasks.extend([Task::At(variable, axis), Task::Term(body)]);
                return Ok(());
            }
            Term::Normalise(_, body) => {
                tasks.push(Task::Term(body));
                return Ok(());
            }
        };
        values.push(value);
        Ok(())
    }

    /// A value that depends on the axis of a variable, at the value of the variable that fulfils a Dirac.
    fn read_at(&mut self, variable: VariableId, axis: AxisId, value: ValueId) -> Result<ValueId, Error> {
        let axes = self.axes_but(value, &[]);
        let zero = self.builder.constant(0.0);
        if !axes.contains(&axis) {
            let (inside, _) = self.inside(variable)?;
            return Ok(self.builder.select(inside, value, zero));
        }
        let name = self.name("values");
        let table = self.builder.made(&name, &axes, Reduce::None, value);
        let Meaning::Ordinal(ordinal) = self.meaning(variable, None)? else {
            return Err(self.unplanned("a Dirac is solved for a finite variable"));
        };
        let index = |own: &AxisId| if *own == axis { Index::At(ordinal) } else { Index::Axis(*own) };
        let indices = axes.iter().map(index).collect();
        Ok(self.builder.load_or(table, indices, zero))
    }

    /// The likelihood at the value of a variable with virtual evidence.
    pub(super) fn likelihood(&mut self, variable: VariableId, weights: &[f64]) -> Result<ValueId, Error> {
        let Meaning::Ordinal(ordinal) = self.meaning(variable, None)? else {
            return Err(self.unplanned("virtual evidence is on a finite variable"));
        };
        let mut chosen = self.builder.constant(*weights.last().expect("internal: checked evidence"));
        for (position, weight) in weights.iter().enumerate().rev().skip(1) {
            let (position, weight) = (self.builder.constant(position as f64), self.builder.constant(*weight));
            let here = self.builder.binary(Binary::Equal, ordinal, position);
            chosen = self.builder.select(here, weight, chosen);
        }
        Ok(chosen)
    }

    pub(super) fn is_short(&self, variable: VariableId, body: TermId) -> bool {
        let declared = &self.model.variables[variable];
        declared.family.is_none()
            && declared.domain.count().is_some_and(|count| count <= WRITTEN_OUT)
            && !self.has_sum(body)
    }

    fn has_sum(&self, id: TermId) -> bool {
        let mut rest = vec![id];
        while let Some(id) = rest.pop() {
            match &self.exact.terms[id] {
                Term::Sum(..) | Term::At(..) | Term::FirstScan(_) => return true,
                Term::Product(factors) => rest.extend(factors),
                Term::Normalise(_, body) => rest.push(*body),
                _ => {}
            }
        }
        false
    }

    fn written_out(&mut self, variable: VariableId, body: TermId) -> Result<ValueId, Error> {
        let mut sum = self.builder.constant(0.0);
        for term in self.each_value(variable, |lowering| lowering.term(body))? {
            sum = self.builder.binary(Binary::Add, sum, term);
        }
        Ok(sum)
    }

    /// The entry at each value of a variable.
    pub(super) fn each_value(
        &mut self,
        variable: VariableId,
        mut term: impl FnMut(&mut Self) -> Result<ValueId, Error>,
    ) -> Result<Vec<ValueId>, Error> {
        let count = self.model.variables[variable].domain.count().expect("internal: a short sum has a count");
        let mut terms = Vec::with_capacity(count);
        for ordinal in 0..count {
            let value = self.builder.constant(ordinal as f64);
            self.run(variable, Meaning::Ordinal(value));
            terms.push(term(self)?);
        }
        self.stop(variable);
        Ok(terms)
    }

    /// Whether the value bound to a variable lies in its domain, and whether it is a finite number.
    pub(super) fn inside(&mut self, variable: VariableId) -> Result<(ValueId, ValueId), Error> {
        let holds = match self.exact.bindings.get(&variable) {
            Some(Binding::Expression(expression)) => self.keeps(*expression, Constraint::Real)?,
            _ => self.builder.constant(1.0),
        };
        let Meaning::Ordinal(ordinal) = self.meaning(variable, None)? else {
            return Ok((self.builder.constant(1.0), holds));
        };
        let extent = self.extent(&self.model.variables[variable].domain);
        let (zero, count) = (self.builder.constant(0.0), self.count_of(extent));
        let above = self.builder.binary(Binary::GreaterOrEqual, ordinal, zero);
        let below = self.builder.binary(Binary::Less, ordinal, count);
        let whole = self.builder.unary(Unary::Floor, ordinal);
        let whole = self.builder.binary(Binary::Equal, ordinal, whole);
        let inside = self.builder.binary(Binary::And, above, below);
        Ok((self.builder.binary(Binary::And, inside, whole), holds))
    }
}

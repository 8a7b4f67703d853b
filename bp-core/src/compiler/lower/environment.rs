//! The meanings of variables while loops are built.
//!
//! In: a variable. Out: its [`Meaning`]: a loop variable, evidence, or the expression of a Dirac. Invariant: only
//! variables that are looped over or bound are looked up.

use super::{Lowering, Meaning};
use crate::equation::{Binding, Solution};
use crate::error::Error;
use crate::forms::dirac;
use crate::ids::{AxisId, BufferId, ExpressionId, SetId, ValueId, VariableId};
use crate::kernel::{Coordinate, Displacements, Extent, Fold, Index, InputKey, Role, SizeKey};
use crate::model::{Domain, Expression, SetKind, Value};
use crate::operators::{Binary, Unary};

impl Lowering<'_> {
    /// The number of values of an extent; one known only at run time is a sum of ones, computed once.
    pub(super) fn count_of(&mut self, extent: Extent) -> ValueId {
        let Some(size) = extent.size else {
            return self.builder.constant(extent.known().unwrap_or(0) as f64);
        };
        if let Some(count) = self.counts.get(&extent) {
            return *count;
        }
        let name = format!("number of values of {}", self.size_name(size));
        let axis = self.builder.axis(&name, extent);
        let one = self.builder.constant(1.0);
        let count = self.builder.fold(&name, &[], Fold::Sum, &[axis], one);
        self.counts.insert(extent, count);
        count
    }

    /// The meaning of a variable, or of an element of a family.
    pub(super) fn meaning(
        &mut self,
        variable: VariableId,
        element: Option<ValueId>,
    ) -> Result<Meaning, Error> {
        if let Some(meaning) = self.running.get(&variable).cloned() {
            return match (meaning, element) {
                (Meaning::Family(elements), Some(element)) => self.element(&elements, element),
                (meaning, _) => Ok(meaning),
            };
        }
        let name = self.model.variable_name(variable);
        match self.exact.bindings.get(&variable).cloned() {
            Some(Binding::Value(Value::Ordinal(ordinal))) => {
                Ok(Meaning::Ordinal(self.builder.constant(ordinal as f64)))
            }
            Some(Binding::Value(Value::Real(number))) => Ok(Meaning::Real(self.builder.constant(number))),
            Some(Binding::Value(Value::Vector(numbers))) => {
                let at = element.and_then(|element| self.builder.as_constant(element));
                match at.and_then(|at| numbers.get(at as usize)) {
                    Some(number) => Ok(Meaning::Real(self.builder.constant(*number))),
                    None => Err(self.unplanned(format!("`{name}` is a vector"))),
                }
            }
            Some(Binding::Value(Value::Given(given))) => Ok(self.given(variable, &given, element)),
            Some(Binding::Expression(expression)) => {
                if let (Some(meaning), None) = (self.determined.get(&variable), self.first) {
                    return Ok(meaning.clone());
                }
                if self.first.is_none() {
                    self.determine_below(expression)?;
                }
                let number = self.expression(expression)?;
                let number = self.whole_where_needed(variable, expression, number);
                let meaning = self.meaning_of(variable, number);
                if self.first.is_none() {
                    self.determined.insert(variable, meaning.clone());
                }
                Ok(meaning)
            }
            Some(Binding::Antecedent { cell, displacement }) => self.antecedent(cell, displacement),
            Some(Binding::Solved(solution)) => self.solved(variable, &solution),
            None => Err(self.unplanned(format!("`{name}` is needed, but it has no value"))),
        }
    }

    /// The number of a Dirac of a range, whole up to rounding; as it is where it is whole by construction.
    pub(super) fn whole_where_needed(
        &mut self,
        variable: VariableId,
        value: ExpressionId,
        number: ValueId,
    ) -> ValueId {
        let is_range = matches!(self.model.variables[variable].domain, Domain::Finite { range: Some(_), .. });
        match is_range && !self.model.is_whole(value) {
            true => dirac::whole(&mut self.builder, number),
            false => number,
        }
    }

    /// The value of a variable that fulfils a Dirac.
    fn solved(&mut self, variable: VariableId, solution: &Solution) -> Result<Meaning, Error> {
        let Meaning::Ordinal(of) = self.meaning(solution.of, None)? else {
            return Err(self.unplanned("a Dirac is solved for a finite variable"));
        };
        let base = self.builder.constant(self.model.variables[solution.of].domain.base() as f64);
        let mut number = self.builder.binary(Binary::Add, of, base);
        for (negated, operand) in &solution.rest {
            let operand = self.expression(*operand)?;
            let operator = if *negated { Binary::Add } else { Binary::Subtract };
            number = self.builder.binary(operator, number, operand);
        }
        if solution.negated {
            number = self.builder.unary(Unary::Negate, number);
        }
        Ok(self.meaning_of(variable, number))
    }

    /// Lowers the Diracs below an expression, dependencies first, with a list instead of recursion: chains may be long.
    fn determine_below(&mut self, root: ExpressionId) -> Result<(), Error> {
        let mut waiting: Vec<VariableId> = self.undetermined(root);
        while let Some(variable) = waiting.last().copied() {
            let Some(Binding::Expression(value)) = self.exact.bindings.get(&variable) else {
                let name = self.model.variable_name(variable);
                return Err(self.unplanned(format!("`{name}` is needed, but no Dirac determines it")));
            };
            let open =
                if self.determined.contains_key(&variable) { Vec::new() } else { self.undetermined(*value) };
            if !open.is_empty() {
                waiting.extend(open);
                continue;
            }
            waiting.pop();
            self.meaning(variable, None)?;
        }
        Ok(())
    }

    /// The variables in an expression that a Dirac binds and that are not lowered yet.
    fn undetermined(&self, root: ExpressionId) -> Vec<VariableId> {
        let variable = |id: ExpressionId| match &self.model.expressions[id] {
            Expression::Variable(use_) => Some(use_.variable),
            _ => None,
        };
        let is_open = |variable: &VariableId| {
            matches!(self.exact.bindings.get(variable), Some(Binding::Expression(_)))
                && !self.determined.contains_key(variable)
                && !self.running.contains_key(variable)
        };
        self.model.nodes_below(root).into_iter().filter_map(variable).filter(is_open).collect()
    }

    /// The element of a family at a computed index: a chain of choices.
    fn element(&mut self, elements: &[Meaning], index: ValueId) -> Result<Meaning, Error> {
        if let Some(constant) = self.builder.as_constant(index) {
            return (elements.get(constant as usize).cloned())
                .ok_or_else(|| self.unplanned(format!("a family has no element {constant}")));
        }
        let mut chosen: Option<ValueId> = None;
        for (position, element) in elements.iter().enumerate().rev() {
            let Meaning::Ordinal(value) = element else {
                return Err(self.unplanned("an element of a family of reals is chosen by a variable"));
            };
            chosen = Some(match chosen {
                None => *value,
                Some(otherwise) => {
                    let position = self.builder.constant(position as f64);
                    let here = self.builder.binary(Binary::Equal, index, position);
                    self.builder.select(here, *value, otherwise)
                }
            });
        }
        Ok(Meaning::Ordinal(chosen.expect("internal: a family has elements")))
    }

    /// A value given with the question: one for each element of the plate, or one for all.
    fn given(&mut self, variable: VariableId, name: &str, element: Option<ValueId>) -> Meaning {
        let mut axes: Vec<AxisId> = Vec::new();
        let mut indices: Vec<Index> = Vec::new();
        if let Some(family) = self.model.variables[variable].family {
            let known = self.builder.so_far().input(&InputKey::Value(variable, name.to_owned()));
            axes = self.input_axes(known, &mut |lowering| lowering.index_axes(name, &family.over));
            indices = match element {
                Some(element) => vec![self.builder.at(element)],
                None => axes.iter().map(|axis| Index::Axis(*axis)).collect(),
            };
        }
        indices.extend(self.plate.iter().map(|axis| Index::Axis(*axis)));
        axes.extend(&self.plate);
        let buffer = self.given_buffer(variable, name, &axes);
        let value = self.builder.load(buffer, indices);
        match self.model.variables[variable].domain {
            Domain::Real => Meaning::Real(value),
            _ => Meaning::Ordinal(value),
        }
    }

    /// The axes of an input except the plate's, reused if the input exists already.
    pub(super) fn input_axes(
        &mut self,
        known: Option<BufferId>,
        new: &mut dyn FnMut(&mut Self) -> Vec<AxisId>,
    ) -> Vec<AxisId> {
        match known {
            Some(buffer) => {
                let axes = self.builder.so_far().buffers[buffer].axes.clone();
                axes.into_iter().filter(|axis| !self.plate.contains(axis)).collect()
            }
            None => new(self),
        }
    }

    /// The cell from which the content of `cell` came by `displacement`.
    fn antecedent(&mut self, cell: VariableId, displacement: VariableId) -> Result<Meaning, Error> {
        let (Meaning::Cell(indices), Meaning::Ordinal(moved)) =
            (self.meaning(cell, None)?, self.meaning(displacement, None)?)
        else {
            return Err(self.unplanned("only a cell of a grid can be displaced"));
        };
        let set = match self.model.variables[displacement].domain {
            Domain::Set(set) => set,
            _ => return Err(self.unplanned("a displacement is an element of a set of displacements")),
        };
        let grid = self.grid_of(cell)?;
        self.displaced(grid, Displacements::Of(set), &indices, moved).map(Meaning::Cell)
    }

    /// The grid whose cells a variable ranges over.
    pub(super) fn grid_of(&self, cell: VariableId) -> Result<SetId, Error> {
        match self.model.variables[cell].domain {
            Domain::Set(set) if self.model.sets[set].kind == SetKind::Grid => Ok(set),
            _ => Err(self.unplanned(format!("`{}` is not a cell of a grid", self.model.variable_name(cell)))),
        }
    }

    /// Reads the tables of displacements.
    pub(super) fn displaced(
        &mut self,
        grid: SetId,
        by: Displacements,
        cell: &[Index; 3],
        moved: ValueId,
    ) -> Result<[Index; 3], Error> {
        let [Index::Axis(depth), Index::Axis(row), Index::Axis(lane)] = *cell else {
            return Err(self.unplanned("a cell that was displaced is displaced again"));
        };
        let (name, extent) = match by {
            Displacements::Of(set) => (self.model.sets[set].name.clone(), Extent::sized(SizeKey::Set(set))),
            Displacements::Steps(grid) => {
                (format!("{} step", self.model.sets[grid].name), Extent::constant(3))
            }
        };
        let is_known = |role: &Role| matches!(role, Role::Positions(known, _) if *known == by);
        let known = self.builder.so_far().buffers.find(|buffer| is_known(&buffer.role));
        let displacement =
            self.input_axes(known, &mut |lowering| vec![lowering.builder.axis(&name, extent)])[0];
        let axes = [displacement, depth, row];
        let [from_depth, from_row, by] = Coordinate::ALL.map(|coordinate| {
            let (name, role) =
                (format!("{name} from {}", coordinate.name()), Role::Positions(by, coordinate));
            let buffer = self.builder.buffer(&name, role, &axes);
            let indices = vec![self.builder.at(moved), Index::Axis(depth), Index::Axis(row)];
            self.builder.load(buffer, indices)
        });
        let wraps = self.input(InputKey::Wraps(grid), None, &[]);
        let wraps = self.builder.load(wraps, Vec::new());
        Ok([Index::At(from_depth), Index::At(from_row), Index::Turned { axis: lane, by, wraps }])
    }

    /// The number of a variable's value in an expression.
    pub(super) fn number_of(&mut self, variable: VariableId, meaning: &Meaning) -> Result<ValueId, Error> {
        match meaning {
            Meaning::Real(value) => Ok(*value),
            Meaning::Ordinal(ordinal) => Ok(self.number_at(variable, *ordinal)),
            Meaning::Cell(_) | Meaning::Family(_) => {
                let name = self.model.variable_name(variable);
                Err(self.unplanned(format!("`{name}` is used as a number, but it is not one")))
            }
        }
    }

    /// The number in an expression of the value with this ordinal.
    pub(super) fn number_at(&mut self, variable: VariableId, ordinal: ValueId) -> ValueId {
        let domain = &self.model.variables[variable].domain;
        if let Domain::Bins(bins) = domain {
            return self.centre(bins, ordinal);
        }
        let base = self.builder.constant(domain.base() as f64);
        self.builder.binary(Binary::Add, ordinal, base)
    }

    /// The value of a variable with this number in an expression.
    pub(super) fn meaning_of(&mut self, variable: VariableId, number: ValueId) -> Meaning {
        let domain = &self.model.variables[variable].domain;
        match domain {
            Domain::Real | Domain::Vector(_) => Meaning::Real(number),
            Domain::Bins(bins) => Meaning::Ordinal(self.bin_holding(bins, number)),
            _ => {
                let base = self.builder.constant(domain.base() as f64);
                Meaning::Ordinal(self.builder.binary(Binary::Subtract, number, base))
            }
        }
    }
}

//! Expressions of a model, as values of a kernel.
//!
//! In: a node of the model's expressions. Out: a node of the kernel's. Invariant: numbers keep their meaning: a value
//! of a finite domain enters as `ordinal + base`.

use super::{Lowering, Meaning};
use crate::door::Advice;
use crate::error::Error;
use crate::ids::{ExpressionId, ParameterId, ValueId, VariableId};
use crate::kernel::{Displacements, Fold, Index, InputKey, KernelBuilder, Reduce, Role};
use crate::model::{Environment, Expression, IndexSpace, Parameter, SetKind, VariableUse};
use crate::operators::{Binary, Unary};

impl Environment for Lowering<'_> {
    type By = KernelBuilder;
    type Stop = Error;

    fn by(&mut self) -> &mut KernelBuilder {
        &mut self.builder
    }

    fn operand(&mut self, id: ExpressionId) -> Result<ValueId, Error> {
        self.node(id)
    }

    fn parameter(&mut self, parameter: ParameterId, indices: &[ExpressionId]) -> Result<ValueId, Error> {
        let model = self.model;
        let Parameter { name, over, default, .. } = &model.parameters[parameter];
        // Numbers that come with the program are in the order of the indices.
        let is_table = default.len() > 1;
        let mut axes = Vec::new();
        let (mut places, mut plate_places) = (Vec::new(), Vec::new());
        let mut inside = true;
        for (index, space) in indices.iter().zip(over) {
            let place = self.place(*index, space)?;
            inside &= !place.iter().any(|place| matches!(place, Index::At(_)))
                || self.model.is_index_of(*index, space);
            let on_plate = matches!(space, IndexSpace::Set(set)
                if self.model.plate.is_some_and(|plate| plate.set == *set));
            if on_plate && !is_table { plate_places.extend(place) } else { places.extend(place) }
        }
        let key = InputKey::Parameter(parameter);
        let known = self.builder.so_far().input(&key);
        if known.is_none() {
            for space in over.iter() {
                axes.extend(self.index_axes(name, space));
            }
            // In inputs the plate's axes come last, whatever the order of the indices.
            if !is_table {
                axes.sort_by_key(|axis| self.plate.contains(axis));
            }
        }
        places.extend(plate_places);
        let role = match default.as_slice() {
            [_, _, ..] => Role::Table { key: Some(key), numbers: default.clone() },
            _ => Role::Input { key, default: default.first().copied(), broadcast: false },
        };
        let buffer = self.builder.buffer(name, role, &axes);
        let kernel = self.builder.so_far();
        let extent = |axis| &kernel.axes[axis].extent;
        inside &= places.iter().zip(&kernel.buffers[buffer].axes).all(|(place, axis)| match place {
            Index::Axis(own) => extent(*own) == extent(*axis),
            Index::At(_) => true,
            Index::Turned { .. } => false,
        });
        // A parameter has no number outside its range: where an index or an antecedent lies there, the form refuses it.
        match inside {
            true => Ok(self.builder.load(buffer, places)),
            false => {
                let none = self.builder.constant(f64::NAN);
                Ok(self.builder.load_or(buffer, places, none))
            }
        }
    }

    fn variable(&mut self, use_: &VariableUse) -> Result<ValueId, Error> {
        let meaning = self.use_meaning(use_)?;
        self.number_of(use_.variable, &meaning)
    }

    fn index(&mut self, depth: usize) -> Result<ValueId, Error> {
        Ok(self.products[depth])
    }

    fn first(
        &mut self,
        family: VariableId,
        with: Option<(ExpressionId, ExpressionId)>,
    ) -> Result<ValueId, Error> {
        match self.first {
            Some(first) => Ok(first),
            None => self.first_of(family, with),
        }
    }

    fn other(&mut self, expression: &Expression) -> Result<ValueId, Error> {
        match expression {
            Expression::Foreign { path, at } => self.foreign(path, *at),
            Expression::GradientNorm { field, at, before } => self.gradient_norm(*field, *at, *before),
            Expression::Frontier { condition, at } => self.frontier(*condition, *at),
            Expression::Innermost { at } => self.innermost(*at),
            Expression::Vector(name, _) => {
                Err(self.unplanned(format!(
                    "`{name}` works on vectors, which sums over finite variables do not take: write its components, such as \
                     `sqrt(pow(X, 2) + pow(Y, 2))`, or take `{}`",
                    Advice::By("weighting")
                )))
            }
            _ => Err(self.unplanned("sums over finite variables do not take this expression")),
        }
    }
}

impl Lowering<'_> {
    /// The value of an expression. A shared `let` is lowered once; a work list lowers operands first, so that depth
    /// does not use the stack.
    pub(super) fn expression(&mut self, id: ExpressionId) -> Result<ValueId, Error> {
        self.sharing(|lowering| lowering.shared(id))
    }

    /// Does work in which each expression is lowered once.
    pub(super) fn sharing<T>(&mut self, work: impl FnOnce(&mut Self) -> T) -> T {
        let outer = self.lowered.is_none();
        self.lowered.get_or_insert_default();
        let done = work(self);
        if outer {
            self.lowered = None;
        }
        done
    }

    fn shared(&mut self, root: ExpressionId) -> Result<ValueId, Error> {
        let mut waiting = vec![root];
        while let Some(id) = waiting.last().copied() {
            self.look_up(id)?;
            let known = |id: &ExpressionId| self.lowered.as_ref().is_some_and(|known| known.contains_key(id));
            let mut open = Vec::new();
            if !known(&id) {
                let model = self.model;
                if let Expression::Unary(..) | Expression::Binary(..) | Expression::If { .. } =
                    &model.expressions[id]
                {
                    model.expressions[id].each_operand(&mut |operand| open.push(operand));
                    open.retain(|operand| !known(operand));
                }
                if open.is_empty() {
                    let value = self.node(id)?;
                    self.lowered.get_or_insert_default().insert(id, value);
                }
            }
            match open.is_empty() {
                true => drop(waiting.pop()),
                false => waiting.extend(open.into_iter().rev()),
            }
        }
        self.node(root)
    }

    /// Lowers a long `match` to a lookup in an array.
    fn look_up(&mut self, id: ExpressionId) -> Result<(), Error> {
        let known = self.lowered.as_ref().is_some_and(|known| known.contains_key(&id));
        if known {
            return Ok(());
        }
        let Some(arms) = self.arms(id) else { return Ok(()) };
        let otherwise = self.expression(arms.rest)?;
        if let Some(value) = self.chain(&arms, otherwise, |_| false)? {
            self.lowered.get_or_insert_default().insert(id, value);
        }
        Ok(())
    }

    /// The value of one node; operands of arithmetic are lowered already.
    fn node(&mut self, id: ExpressionId) -> Result<ValueId, Error> {
        if let Some(known) = self.lowered.as_ref().and_then(|known| known.get(&id)) {
            return Ok(*known);
        }
        let model = self.model;
        self.value(&model.expressions[id])
    }

    /// One index of a parameter, as the indices of its axes.
    fn place(&mut self, index: ExpressionId, space: &IndexSpace) -> Result<Vec<Index>, Error> {
        if let (Expression::Variable(use_), IndexSpace::Set(_)) = (&self.model.expressions[index], space) {
            return match self.meaning(use_.variable, None)? {
                Meaning::Cell(cell) => Ok(cell.to_vec()),
                Meaning::Ordinal(ordinal) => Ok(vec![self.builder.at(ordinal)]),
                _ => Err(self.unplanned("a parameter is indexed by something that is not in its set")),
            };
        }
        let number = self.expression(index)?;
        let ordinal = match space {
            IndexSpace::Set(_) => number,
            IndexSpace::Range(range) => {
                let low = self.builder.constant(range.low as f64);
                self.builder.binary(Binary::Subtract, number, low)
            }
        };
        Ok(vec![self.builder.at(ordinal)])
    }

    /// The position of a family's element, from 0.
    pub(super) fn element_ordinal(
        &mut self,
        family: VariableId,
        element: ExpressionId,
    ) -> Result<ValueId, Error> {
        let number = self.expression(element)?;
        match self.model.variables[family].family.map(|family| family.over) {
            Some(IndexSpace::Range(range)) => {
                let low = self.builder.constant(range.low as f64);
                Ok(self.builder.binary(Binary::Subtract, number, low))
            }
            _ => Ok(number),
        }
    }

    /// `first(G with O at C)` of a family of known length: a chain of choices, from the last element back.
    fn first_of(
        &mut self,
        family: VariableId,
        with: Option<(ExpressionId, ExpressionId)>,
    ) -> Result<ValueId, Error> {
        let over = self.model.variables[family].family.map(|family| family.over);
        let Some(IndexSpace::Range(range)) = over else {
            return Err(self.unplanned("`first` needs a family along a range"));
        };
        let elements = match self.running.get(&family) {
            Some(Meaning::Family(elements)) => elements.clone(),
            // Known elements are read, one after the other.
            _ => match self.bounded(range.high, 1 - range.low).known() {
                Some(count) => (0..count)
                    .map(|position| {
                        let position = self.builder.constant(position as f64);
                        self.meaning(family, Some(position))
                    })
                    .collect::<Result<_, _>>()?,
                None => return self.first_of_known(family, &range, with),
            },
        };
        let with = match with {
            Some((value, at)) => Some((self.expression(value)?, self.expression(at)?)),
            None => None,
        };
        let mut first = self.builder.constant((range.low + elements.len() as i64) as f64);
        for (position, element) in elements.iter().enumerate().rev() {
            let Meaning::Ordinal(mut value) = *element else {
                return Err(self.unplanned("`first` needs a family of booleans"));
            };
            let index = self.builder.constant((range.low + position as i64) as f64);
            if let Some((replaced, at)) = with {
                let here = self.builder.binary(Binary::Equal, at, index);
                value = self.builder.select(here, replaced, value);
            }
            first = self.builder.select(value, index, first);
        }
        Ok(first)
    }

    /// The same for a known family whose length is given at run time: the elements before the first true one are those
    /// up to which no element is true.
    fn first_of_known(
        &mut self,
        family: VariableId,
        range: &crate::model::Range,
        with: Option<(ExpressionId, ExpressionId)>,
    ) -> Result<ValueId, Error> {
        let name = self.name("k");
        let extent = self.bounded(range.high, 1 - range.low);
        let axis = self.builder.axis(&name, extent);
        let running = self.builder.running(axis);
        let Meaning::Ordinal(mut value) = self.meaning(family, Some(running))? else {
            return Err(self.unplanned("`first` needs a family of booleans"));
        };
        let low = self.builder.constant(range.low as f64);
        if let Some((replaced, at)) = with {
            let (replaced, at) = (self.expression(replaced)?, self.expression(at)?);
            let index = self.builder.binary(Binary::Add, running, low);
            let here = self.builder.binary(Binary::Equal, at, index);
            value = self.builder.select(here, replaced, value);
        }
        let clear = self.builder.unary(Unary::Not, value);
        let (zero, one) = (self.builder.constant(0.0), self.builder.constant(1.0));
        let scan = Reduce::Scan { axis, backward: false, keep: clear, initial: one };
        let before = self.along("none before", axis, scan, zero);
        let none = self.builder.binary(Binary::Multiply, before, clear);
        let count = self.fold_over("elements before the first", Fold::Sum, &[axis], none);
        Ok(self.builder.binary(Binary::Add, count, low))
    }

    /// The answer of another program at a cell, or one number.
    fn foreign(&mut self, path: &str, at: Option<ExpressionId>) -> Result<ValueId, Error> {
        let cell = at.map(|at| self.cell(at)).transpose()?;
        let axes = if cell.is_some() { self.plate.clone() } else { Vec::new() };
        let buffer = self.input(InputKey::Answer(path.to_owned()), None, &axes);
        Ok(self.builder.load(buffer, cell.map_or_else(Vec::new, |cell| cell.to_vec())))
    }

    /// A cell of the plate's grid.
    fn cell(&mut self, at: ExpressionId) -> Result<[Index; 3], Error> {
        let Expression::Variable(use_) = self.model.expressions[at].clone() else {
            return Err(self.unplanned("a field is read at a cell, which must be a variable"));
        };
        let plate = self.model.plate.filter(|plate| self.model.sets[plate.set].kind == SetKind::Grid);
        match (self.meaning(use_.variable, None)?, plate) {
            (Meaning::Cell(cell), Some(_)) => Ok(cell),
            _ => Err(self.unplanned("a field is read at a cell of the grid that the program runs over")),
        }
    }

    /// ‖∇H‖ by backward differences of one cell (paper, Eq. 6). At the start of a line the difference is 0, unless the
    /// field is known there: `gap` before the first cell of a line.
    fn gradient_norm(
        &mut self,
        field: ExpressionId,
        at: ExpressionId,
        gap: Option<ExpressionId>,
    ) -> Result<ValueId, Error> {
        let Expression::Foreign { path, .. } = self.model.expressions[field].clone() else {
            return Err(self.unplanned("a gradient is taken of another program's field"));
        };
        let cell = self.cell(at)?;
        let here = self.foreign(&path, Some(at))?;
        let buffer = self.builder.so_far().input(&InputKey::Answer(path));
        let buffer = buffer.expect("internal: the field has just been read");
        let grid = self.model.plate.expect("internal: a cell has a grid").set;
        let gap = gap.map(|gap| self.expression(gap)).transpose()?;
        let mut squares = self.builder.constant(0.0);
        for number in 0..3 {
            let axis = self.builder.constant(f64::from(number));
            let before = self.displaced(grid, Displacements::Steps(grid), &cell, axis)?;
            let outside = gap.filter(|_| number == 0).unwrap_or(here);
            let before = self.builder.load_or(buffer, before.to_vec(), outside);
            let difference = self.builder.binary(Binary::Subtract, here, before);
            let square = self.builder.binary(Binary::Multiply, difference, difference);
            squares = self.builder.binary(Binary::Add, squares, square);
        }
        Ok(self.builder.unary(Unary::SquareRoot, squares))
    }

    /// Whether a cell is the last, walking outwards, before the condition first fails: it holds up to this cell, and
    /// fails at the next.
    fn frontier(&mut self, condition: ExpressionId, at: ExpressionId) -> Result<ValueId, Error> {
        let [Index::Axis(depth), row, lane] = self.cell(at)? else {
            return Err(self.unplanned("a frontier is looked for along the plate's grid"));
        };
        let holds = self.expression(condition)?;
        let axes = self.plate.clone();
        let name = self.name("holds");
        let buffer = self.builder.made(&name, &axes, Reduce::None, holds);
        let holds = self.builder.load(buffer, axes.iter().map(|axis| Index::Axis(*axis)).collect());
        let zero = self.builder.constant(0.0);
        let one = self.builder.constant(1.0);
        let scan = Reduce::Scan { axis: depth, backward: false, keep: holds, initial: one };
        let name_nearer = self.name("all nearer hold");
        let nearer = self.builder.compute(&name_nearer, &axes, scan, zero);
        let running = self.builder.running(depth);
        let next = self.builder.binary(Binary::Add, running, one);
        let further = self.builder.load_or(buffer, vec![Index::At(next), row, lane], zero);
        let ends = self.builder.unary(Unary::Not, further);
        let reached = self.builder.binary(Binary::And, holds, nearer);
        Ok(self.builder.binary(Binary::And, reached, ends))
    }

    /// Whether a cell is the first, walking outwards.
    fn innermost(&mut self, at: ExpressionId) -> Result<ValueId, Error> {
        let [Index::Axis(depth), ..] = self.cell(at)? else {
            return Err(self.unplanned("the innermost cell is looked for along the plate's grid"));
        };
        let (running, zero) = (self.builder.running(depth), self.builder.constant(0.0));
        Ok(self.builder.binary(Binary::Equal, running, zero))
    }

    /// A sum over axes, as a nest over all others that the value depends on.
    pub(super) fn fold_over(
        &mut self,
        what: &str,
        fold: Fold,
        over: &[crate::ids::AxisId],
        value: ValueId,
    ) -> ValueId {
        let axes = self.axes_but(value, over);
        let name = self.name(what);
        self.builder.fold(&name, &axes, fold, over, value)
    }
}

//! The builder of kernels, which shares and simplifies nodes.
//!
//! In: calls from lowering. Out: a [`Kernel`]. Invariant: equal expressions have equal ids, and an operator with only
//! constant operands has a value outside the range of f64.

use super::{
    Axis, Buffer, Check, Extent, Fold, Index, InputKey, Kernel, Nest, Node, Reduce, Role, Size, Values,
};
use crate::ids::{Arena, AxisId, BufferId, SetId, ValueId};
use crate::operators::{Binary, Mass, OPERANDS, Unary};
use std::collections::HashMap;

/// A kernel under construction.
#[derive(Clone, Debug, Default)]
pub struct KernelBuilder {
    kernel: Kernel,
    known: HashMap<Node, ValueId>,
}

impl KernelBuilder {
    /// An empty kernel of this name.
    pub fn new(name: &str) -> Self {
        Self { kernel: Kernel { name: name.to_owned(), ..Kernel::default() }, known: HashMap::new() }
    }

    /// Copies the arrays and axes of a kernel, for a rewrite of its nodes.
    pub(super) fn without_nodes(kernel: &Kernel) -> Self {
        let kernel = Kernel { nodes: Arena::default(), nests: Vec::new(), ..kernel.clone() };
        Self { kernel, known: HashMap::new() }
    }

    /// A node, simplified.
    pub(super) fn made_again(&mut self, node: Node) -> ValueId {
        match node {
            Node::Unary(operator, operand) => self.unary(operator, operand),
            Node::Binary(operator, left, right) => self.binary(operator, left, right),
            Node::Select(condition, then, otherwise) => self.select(condition, then, otherwise),
            Node::Mass(law, operands) => self.mass(law, operands),
            other => self.node(other),
        }
    }

    /// The kernel so far.
    pub fn so_far(&self) -> &Kernel {
        &self.kernel
    }

    /// A loop.
    pub fn axis(&mut self, name: &str, extent: Extent) -> AxisId {
        self.kernel.axes.push(Axis { name: name.to_owned(), extent })
    }

    /// Sets the names of the sizes of extents, and of the sets whose grids and displacements are read.
    pub fn named(&mut self, sizes: Vec<Size>, sets: Vec<(SetId, String)>) {
        (self.kernel.sizes, self.kernel.sets) = (sizes, sets);
    }

    /// Sets the axes along which cells are independent.
    pub fn parallel(&mut self, axes: &[AxisId]) {
        self.kernel.parallel = axes.to_vec();
    }

    /// An array; repeated calls for an input return the same one.
    pub fn buffer(&mut self, name: &str, role: Role, axes: &[AxisId]) -> BufferId {
        let known = match (&role, role.input()) {
            (_, Some(key)) => self.kernel.input(key),
            (Role::Positions(..), _) => self.kernel.buffers.find(|buffer| buffer.role == role),
            _ => None,
        };
        known.unwrap_or_else(|| {
            let name = name.to_owned();
            self.kernel.buffers.push(Buffer { name, role, axes: axes.to_vec(), values: None })
        })
    }

    /// An input that holds values of a variable.
    pub fn given(&mut self, name: &str, key: InputKey, values: Values, axes: &[AxisId]) -> BufferId {
        let buffer = self.buffer(name, Role::Input { key, default: None, broadcast: true }, axes);
        self.kernel.buffers[buffer].values = Some(values);
        buffer
    }

    /// Marks the buffer of a load as checked.
    pub fn check(&mut self, value: ValueId, check: Check) {
        if let Node::Load { buffer, .. } = self.kernel.nodes[value] {
            self.kernel.checks.push((buffer, check));
        }
    }

    /// Marks a buffer as checked.
    pub fn check_buffer(&mut self, buffer: BufferId, check: Check) {
        self.kernel.checks.push((buffer, check));
    }

    /// Adds a nest.
    pub fn nest(&mut self, out: BufferId, reduce: Reduce, value: ValueId) {
        self.kernel.nests.push(Nest { out, reduce, value });
    }

    /// A nest into a scratch buffer over `axes`, shared by repeated calls; returns the element at the current indices.
    pub fn compute(&mut self, name: &str, axes: &[AxisId], reduce: Reduce, value: ValueId) -> ValueId {
        let out = self.made(name, axes, reduce, value);
        self.load(out, axes.iter().map(|axis| Index::Axis(*axis)).collect())
    }

    /// The buffer of such a nest.
    pub fn made(&mut self, name: &str, axes: &[AxisId], reduce: Reduce, value: ValueId) -> BufferId {
        let is_same = |nest: &&Nest| {
            let buffer = &self.kernel.buffers[nest.out];
            buffer.role == Role::Scratch
                && buffer.axes == axes
                && (&nest.reduce, nest.value) == (&reduce, value)
        };
        if let Some(nest) = self.kernel.nests.iter().find(is_same) {
            return nest.out;
        }
        let out = self.buffer(name, Role::Scratch, axes);
        self.nest(out, reduce, value);
        out
    }

    fn node(&mut self, node: Node) -> ValueId {
        if let Some(id) = self.known.get(&node) {
            return *id;
        }
        let id = self.kernel.nodes.push(node.clone());
        self.known.insert(node, id);
        id
    }

    /// A number.
    pub fn constant(&mut self, number: f64) -> ValueId {
        self.node(Node::Constant(number.to_bits()))
    }

    /// The number of a constant value.
    pub fn as_constant(&self, id: ValueId) -> Option<f64> {
        match self.kernel.nodes[id] {
            Node::Constant(bits) => Some(f64::from_bits(bits)),
            _ => None,
        }
    }

    /// The current index of an axis.
    pub fn running(&mut self, axis: AxisId) -> ValueId {
        self.node(Node::Axis(axis))
    }

    /// An element with indices in range.
    pub fn load(&mut self, buffer: BufferId, indices: Vec<Index>) -> ValueId {
        self.node(Node::Load { buffer, indices, otherwise: None })
    }

    /// An element, or `otherwise` if an index is out of range.
    pub fn load_or(&mut self, buffer: BufferId, indices: Vec<Index>, otherwise: ValueId) -> ValueId {
        self.node(Node::Load { buffer, indices, otherwise: Some(otherwise) })
    }

    /// An index with a value; the axis itself if the value is its current index.
    pub fn at(&self, value: ValueId) -> Index {
        match self.kernel.nodes[value] {
            Node::Axis(axis) => Index::Axis(axis),
            _ => Index::At(value),
        }
    }

    /// An operator on one value.
    pub fn unary(&mut self, operator: Unary, operand: ValueId) -> ValueId {
        match self.as_constant(operand).and_then(|number| operator.folded(number)) {
            Some(value) => self.constant(value),
            None => self.node(Node::Unary(operator, operand)),
        }
    }

    /// An operator on two values.
    pub fn binary(&mut self, operator: Binary, left: ValueId, right: ValueId) -> ValueId {
        let (x, y) = (self.as_constant(left), self.as_constant(right));
        if let Some(value) = x.zip(y).and_then(|(x, y)| operator.folded(x, y)) {
            return self.constant(value);
        }
        match (operator, x, y) {
            (Binary::Add, Some(0.0), _) | (Binary::Multiply | Binary::And, Some(1.0), _) => right,
            (Binary::Add | Binary::Subtract, _, Some(0.0))
            | (Binary::Multiply | Binary::Divide | Binary::And, _, Some(1.0)) => left,
            (Binary::Or, Some(0.0), _) => right,
            (Binary::Or, _, Some(0.0)) => left,
            (Binary::And, Some(0.0), _) | (Binary::And, _, Some(0.0)) => self.constant(0.0),
            (Binary::Equal, ..) if left == right => self.constant(1.0),
            _ => self.node(Node::Binary(operator, left, right)),
        }
    }

    /// The product of several values.
    pub fn product(&mut self, values: impl IntoIterator<Item = ValueId>) -> ValueId {
        let mut product = self.constant(1.0);
        for value in values {
            product = self.binary(Binary::Multiply, product, value);
        }
        product
    }

    /// `then` where the condition is not 0, else `otherwise`.
    pub fn select(&mut self, condition: ValueId, then: ValueId, otherwise: ValueId) -> ValueId {
        match self.as_constant(condition) {
            Some(0.0) => otherwise,
            Some(_) => then,
            None if then == otherwise => then,
            None => self.node(Node::Select(condition, then, otherwise)),
        }
    }

    /// The probability of an interval.
    pub fn mass(&mut self, law: Mass, operands: [ValueId; OPERANDS]) -> ValueId {
        let numbers = operands.map(|operand| self.as_constant(operand));
        let known = numbers.iter().all(Option::is_some).then(|| numbers.map(Option::unwrap_or_default));
        match known.and_then(|numbers| law.folded(numbers)) {
            Some(value) => self.constant(value),
            None => self.node(Node::Mass(law, operands)),
        }
    }

    /// `total`, or 1 where it is 0, so that dividing zeros by it leaves zeros: an impossible context. NaN stays NaN.
    pub fn or_one(&mut self, total: ValueId) -> ValueId {
        let (zero, one) = (self.constant(0.0), self.constant(1.0));
        let nothing = self.binary(Binary::Equal, total, zero);
        self.select(nothing, one, total)
    }

    /// A fold over axes into a new scratch buffer over `axes`.
    pub fn fold(
        &mut self,
        name: &str,
        axes: &[AxisId],
        fold: Fold,
        over: &[AxisId],
        value: ValueId,
    ) -> ValueId {
        self.compute(name, axes, Reduce::Fold(fold, over.to_vec()), value)
    }

    /// The constant difference between a value and a base value, found through chains of additions and subtractions.
    pub fn more_than(&self, base: ValueId, value: ValueId) -> Option<f64> {
        match self.kernel.nodes[value] {
            _ if value == base => Some(0.0),
            Node::Binary(Binary::Add, left, right) => {
                Some(self.more_than(base, left)? + self.as_constant(right)?)
            }
            Node::Binary(Binary::Subtract, left, right) => {
                Some(self.more_than(base, left)? - self.as_constant(right)?)
            }
            _ => None,
        }
    }

    /// The kernel.
    pub fn build(self) -> Kernel {
        self.kernel
    }
}

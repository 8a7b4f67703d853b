//! Traversal of expressions without recursion along their depth or repetition of shared nodes.
//!
//! In: the root of an expression. Out: its nodes, or a computed value for each of them. Invariant: each node is visited
//! once, after its operands: in the arena a node refers to earlier nodes only, so the order of the ids is such an
//! order.

use super::{Expression, Model};
use crate::ids::ExpressionId;

impl Expression {
    /// Visits the nodes that this one refers to, in the order in which they are written.
    pub fn each_operand(&self, visit: &mut impl FnMut(ExpressionId)) {
        match self {
            Expression::Number(_) | Expression::Index(_) => {}
            Expression::Parameter { indices, .. } | Expression::Vector(_, indices) => {
                indices.iter().for_each(|index| visit(*index));
            }
            Expression::Variable(use_) => use_.element.into_iter().for_each(visit),
            Expression::Unary(_, operand) => visit(*operand),
            Expression::Binary(_, left, right) => [*left, *right].into_iter().for_each(visit),
            Expression::If { condition, then, otherwise } => {
                [*condition, *then, *otherwise].into_iter().for_each(visit);
            }
            Expression::First { with, .. } => {
                with.iter().flat_map(|(value, at)| [*value, *at]).for_each(visit);
            }
            Expression::Foreign { at, .. } => at.iter().copied().for_each(visit),
            Expression::GradientNorm { field, at, before } => {
                [*field, *at].into_iter().chain(*before).for_each(visit);
            }
            Expression::Innermost { at } => visit(*at),
            Expression::Frontier { condition, at } => [*condition, *at].into_iter().for_each(visit),
        }
    }
}

/// A value for each node of an expression.
#[derive(Clone, Debug)]
pub struct Folded<T> {
    /// Ascending; the root is the last.
    values: Vec<(ExpressionId, T)>,
}

impl<T> Folded<T> {
    /// The value of a node.
    ///
    /// # Panics
    /// If the node is not part of the expression, or comes after the node that uses it.
    pub fn of(&self, id: ExpressionId) -> &T {
        let position = self.values.binary_search_by_key(&id, |(node, _)| *node);
        &self.values[position.expect("internal: an operand comes before its expression")].1
    }

    /// The value of the root.
    pub fn root(mut self) -> T {
        self.values.pop().expect("internal: an expression has a root").1
    }
}

impl Model {
    /// The nodes of an expression, each once, operands before their users.
    pub fn nodes_below(&self, root: ExpressionId) -> Vec<ExpressionId> {
        let mut found = vec![root];
        let mut next = 0;
        // Few nodes are searched; for many, visited nodes are marked.
        let mut met: Option<Vec<u64>> = None;
        while let Some(id) = found.get(next).copied() {
            next += 1;
            if met.is_none() && found.len() > FEW {
                let mut marks = vec![0; root_words(root)];
                for id in &found {
                    mark(&mut marks, *id);
                }
                met = Some(marks);
            }
            self.expressions[id].each_operand(&mut |operand| {
                let new = match &mut met {
                    Some(marks) => mark(marks, operand),
                    None => !found.contains(&operand),
                };
                if new {
                    found.push(operand);
                }
            });
        }
        found.sort_unstable();
        found
    }

    /// Computes a value for each node from those of its operands.
    pub fn fold<T>(&self, root: ExpressionId, mut of: impl FnMut(&Expression, &Folded<T>) -> T) -> Folded<T> {
        let nodes = self.nodes_below(root);
        let mut folded = Folded { values: Vec::with_capacity(nodes.len()) };
        for id in nodes {
            let value = of(&self.expressions[id], &folded);
            folded.values.push((id, value));
        }
        folded
    }
}

/// Number of nodes up to which a list is searched faster than marks are made.
const FEW: usize = 16;

/// Words of marks for a root and everything before it.
fn root_words(root: ExpressionId) -> usize {
    use crate::ids::Id;
    root.position() / 64 + 1
}

/// Marks a node; returns whether it is new.
fn mark(marks: &mut [u64], id: ExpressionId) -> bool {
    use crate::ids::Id;
    let (word, bit) = (id.position() / 64, 1 << (id.position() % 64));
    let new = marks[word] & bit == 0;
    marks[word] |= bit;
    new
}

#[cfg(test)]
mod tests {
    use crate::model::ModelBuilder;
    use crate::operators::Binary;

    /// x₀ = 1, xₙ = xₙ₋₁ + xₙ₋₁: as a tree it would have 2ⁿ⁺¹ − 1 nodes.
    #[test]
    fn shared_nodes_are_visited_once() {
        let mut builder = ModelBuilder::new("Doubled");
        let mut last = builder.number(1.0);
        for _ in 0..1000 {
            last = builder.binary(Binary::Add, last, last);
        }
        let model = builder.so_far();
        assert_eq!(model.nodes_below(last).len(), 1001);
        assert_eq!(model.constant(last), Some(2f64.powi(1000)));
    }

    /// 0 + 1 + 1 + …, a hundred thousand nodes deep, on a stack of 256 KiB.
    #[test]
    fn depth_takes_no_stack() {
        let walk = || {
            let mut builder = ModelBuilder::new("Deep");
            let (mut sum, one) = (builder.number(0.0), builder.number(1.0));
            for _ in 0..100_000 {
                sum = builder.binary(Binary::Add, sum, one);
            }
            assert_eq!(builder.so_far().constant(sum), Some(1e5));
            assert!(builder.so_far().expression_text(sum, &[]).len() < 5000);
        };
        std::thread::Builder::new().stack_size(256 << 10).spawn(walk).unwrap().join().unwrap();
    }
}

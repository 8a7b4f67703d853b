//! Bounds of expressions that are whole numbers.
//!
//! In: an expression. Out: its least and its greatest possible value, or `None` where it may be no whole number. Invariant: no
//! value lies outside; where operands share variables the bounds may be wider than the values.

use super::{Domain, Expression, Folded, IndexSpace, Model};
use crate::ids::ExpressionId;
use crate::operators::{Binary, Unary};

/// Beyond this size f64 does not hold every whole number.
const LARGEST: f64 = 9_007_199_254_740_992.0;

impl Domain {
    /// The numbers of the first and the last value, where the values are all whole numbers between them.
    pub(crate) fn whole_bounds(&self) -> Option<[f64; 2]> {
        let count = match self {
            Domain::Boolean => 2,
            Domain::Finite { labels, range } if labels.is_empty() || range.is_none() => self.count()?,
            _ => return None,
        };
        Some([self.number(0), self.number(count.checked_sub(1)?)])
    }
}

impl Model {
    /// The least and the greatest value of an expression that is a whole number by construction.
    pub(crate) fn whole_bounds(&self, root: ExpressionId) -> Option<[f64; 2]> {
        const TRUTH: Option<[f64; 2]> = Some([0.0, 1.0]);
        let of = |expression: &Expression, below: &Folded<Option<[f64; 2]>>| {
            let found = match expression {
                Expression::Number(number) => (number.fract() == 0.0).then_some([*number; 2]),
                Expression::Variable(use_) => self.variables[use_.variable].domain.whole_bounds(),
                Expression::Unary(Unary::Not, _) => TRUTH,
                Expression::Unary(operator, x) => {
                    let [low, high] = (*below.of(*x))?;
                    match operator {
                        Unary::Negate => Some([-high, -low]),
                        Unary::Floor | Unary::Ceiling | Unary::Round => Some([low, high]),
                        Unary::Absolute => {
                            let least =
                                if low <= 0.0 && high >= 0.0 { 0.0 } else { low.abs().min(high.abs()) };
                            Some([least, low.abs().max(high.abs())])
                        }
                        _ => None,
                    }
                }
                Expression::Binary(operator, x, y) => match operator {
                    Binary::Equal
                    | Binary::NotEqual
                    | Binary::Less
                    | Binary::LessOrEqual
                    | Binary::Greater
                    | Binary::GreaterOrEqual
                    | Binary::And
                    | Binary::Or => TRUTH,
                    _ => {
                        let ([a, b], [c, d]) = ((*below.of(*x))?, (*below.of(*y))?);
                        match operator {
                            Binary::Add => Some([a + c, b + d]),
                            Binary::Subtract => Some([a - d, b - c]),
                            Binary::Minimum => Some([a.min(c), b.min(d)]),
                            Binary::Maximum => Some([a.max(c), b.max(d)]),
                            Binary::Multiply => {
                                let all = [a * c, a * d, b * c, b * d];
                                Some([
                                    all.into_iter().fold(all[0], f64::min),
                                    all.into_iter().fold(all[0], f64::max),
                                ])
                            }
                            Binary::Remainder if c == d && c > 0.0 => Some([0.0, c - 1.0]),
                            _ => None,
                        }
                    }
                },
                Expression::If { then, otherwise, .. } => {
                    let ([a, b], [c, d]) = ((*below.of(*then))?, (*below.of(*otherwise))?);
                    Some([a.min(c), b.max(d)])
                }
                _ => None,
            };
            found.filter(|[low, high]| low.abs() < LARGEST && high.abs() < LARGEST)
        };
        self.fold(root, of).root()
    }

    /// Whether an expression is a whole number by construction, whatever its size.
    pub(crate) fn is_whole(&self, root: ExpressionId) -> bool {
        let of = |expression: &Expression, below: &Folded<bool>| match expression {
            Expression::Number(number) => number.fract() == 0.0,
            Expression::Variable(use_) => {
                let domain = &self.variables[use_.variable].domain;
                domain.is_finite() && domain.bins().is_none()
            }
            Expression::Index(_) | Expression::First { .. } => true,
            Expression::Unary(operator, x) => match operator {
                Unary::Not | Unary::Floor | Unary::Ceiling | Unary::Round => true,
                Unary::Negate | Unary::Absolute => *below.of(*x),
                _ => false,
            },
            Expression::Binary(operator, x, y) => match operator {
                Binary::Divide | Binary::Power | Binary::ArcTangent => false,
                Binary::Add
                | Binary::Subtract
                | Binary::Multiply
                | Binary::Minimum
                | Binary::Maximum
                | Binary::Remainder => *below.of(*x) && *below.of(*y),
                _ => true,
            },
            Expression::If { then, otherwise, .. } => *below.of(*then) && *below.of(*otherwise),
            _ => false,
        };
        self.fold(root, of).root()
    }

    /// Whether an index lies in the range of a parameter whatever the values of the variables.
    pub(crate) fn is_index_of(&self, index: ExpressionId, space: &IndexSpace) -> bool {
        match (&self.expressions[index], space) {
            (Expression::Variable(_), IndexSpace::Set(_)) => true,
            (Expression::Variable(use_), IndexSpace::Range(range))
                if matches!(&self.variables[use_.variable].domain,
                    Domain::Finite { labels, range: Some(own) } if labels.is_empty() && own == range) =>
            {
                true
            }
            (_, IndexSpace::Range(range)) if range.high.size.is_none() => {
                let within =
                    |[low, high]: [f64; 2]| range.low as f64 <= low && high <= range.high.offset as f64;
                self.whole_bounds(index).is_some_and(within)
            }
            _ => false,
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::model::{Domain, ModelBuilder};
    use crate::operators::{Binary, Unary};

    #[test]
    fn bounds_hold_every_value_and_are_reached() {
        let mut model = ModelBuilder::new("Bounds");
        let a = model.variable("A", Domain::integers(-3, 5));
        let b = model.variable("B", Domain::integers(2, 4));
        let (a, b) = (model.value(a), model.value(b));
        let values: Vec<(f64, f64)> =
            (-3..=5).flat_map(|a| (2..=4).map(move |b| (f64::from(a), f64::from(b)))).collect();
        let six = model.number(6.0);
        let binary =
            [Binary::Add, Binary::Subtract, Binary::Multiply, Binary::Minimum, Binary::Maximum, Binary::Less];
        for operator in binary {
            let root = model.binary(operator, a, b);
            let all = values.iter().map(|(a, b)| operator.apply(*a, *b));
            let expected = [all.clone().fold(f64::MAX, f64::min), all.fold(f64::MIN, f64::max)];
            assert_eq!(model.so_far().whole_bounds(root), Some(expected), "{operator:?}");
        }
        let size = model.unary(Unary::Absolute, a);
        assert_eq!(model.so_far().whole_bounds(size), Some([0.0, 5.0]));
        let rest = model.binary(Binary::Remainder, a, six);
        assert_eq!(model.so_far().whole_bounds(rest), Some([0.0, 5.0]));
        let half = model.binary(Binary::Divide, a, six);
        assert_eq!(model.so_far().whole_bounds(half), None);
    }
}

//! Values of a kernel with their slopes: forward differentiation of expressions, symbolically.
//!
//! In: operators on values, each with its slopes in some slots. Out: values and slopes. Invariant: a slope that is 0 by
//! construction is absent, and one that is constant is a constant, so that the tangent of a linear mean has the numbers of the
//! program. A step (a comparison, `floor`) has slope 0; `abs`, `min` and `max` have that of the branch taken.
//!
//! (f ∘ x)′ = f′(x) x′ (Wengert, *Communications of the ACM* 7:463-464, 1964). Draws and text take the same derivatives of
//! numbers (`distribution/dual.rs`).

use crate::ids::ValueId;
use crate::kernel::KernelBuilder;
use crate::law::Arithmetic;
use crate::operators::{Binary, Mass, OPERANDS, Unary};
use std::collections::BTreeMap;
use std::f64::consts::{LN_2, TAU};

/// Slopes by slot.
pub(super) type Slopes = BTreeMap<usize, ValueId>;

/// A value and its slopes.
#[derive(Clone, Debug)]
pub(super) struct Tangent {
    pub(super) value: ValueId,
    pub(super) slopes: Slopes,
}

/// The number of a [`Tangent`] in its [`Tangents`].
pub(super) type Place = usize;

/// The arithmetic, and all of its numbers so far.
#[derive(Default)]
pub(super) struct Tangents {
    pub(super) builder: KernelBuilder,
    numbers: Vec<Tangent>,
    /// An operator whose derivative is no value of a kernel.
    pub(super) without_slope: Option<String>,
}

impl Tangents {
    pub(super) fn of(&self, place: Place) -> &Tangent {
        &self.numbers[place]
    }

    pub(super) fn value(&self, place: Place) -> ValueId {
        self.numbers[place].value
    }

    pub(super) fn put(&mut self, value: ValueId, slopes: Slopes) -> Place {
        self.numbers.push(Tangent { value, slopes });
        self.numbers.len() - 1
    }

    /// A value that depends on no slot.
    pub(super) fn fixed(&mut self, value: ValueId) -> Place {
        self.put(value, Slopes::new())
    }

    /// A value of functions of some numbers, each with its derivative in it; `None`: 0.
    pub(super) fn chained(&mut self, value: ValueId, parts: &[(Place, Option<ValueId>)]) -> Place {
        let mut slopes = Slopes::new();
        for (place, factor) in parts {
            let Some(factor) = *factor else { continue };
            for (slot, slope) in self.numbers[*place].slopes.clone() {
                let own = self.builder.binary(Binary::Multiply, factor, slope);
                let own = match slopes.get(&slot) {
                    Some(sum) => self.builder.binary(Binary::Add, *sum, own),
                    None => own,
                };
                slopes.insert(slot, own);
            }
        }
        slopes.retain(|_, slope| self.builder.as_constant(*slope) != Some(0.0));
        self.put(value, slopes)
    }

    fn has_slope(&self, place: Place) -> bool {
        !self.numbers[place].slopes.is_empty()
    }

    fn number(&mut self, number: f64) -> ValueId {
        self.builder.constant(number)
    }

    fn one(&mut self, operator: Unary, x: ValueId) -> ValueId {
        self.builder.unary(operator, x)
    }

    fn two(&mut self, operator: Binary, x: ValueId, y: ValueId) -> ValueId {
        self.builder.binary(operator, x, y)
    }

    /// x / y, or 0 where y is 0: the derivative of a length at 0.
    fn over(&mut self, x: ValueId, y: ValueId) -> ValueId {
        let zero = self.number(0.0);
        let nothing = self.two(Binary::Equal, y, zero);
        let ratio = self.two(Binary::Divide, x, y);
        self.builder.select(nothing, zero, ratio)
    }

    /// The derivative of an operator at x, where it has this value.
    fn derivative(&mut self, operator: Unary, x: ValueId, value: ValueId) -> Option<ValueId> {
        let [zero, half, one, minus] = [0.0, 0.5, 1.0, -1.0].map(|number| self.builder.constant(number));
        Some(match operator {
            Unary::Negate | Unary::Not => minus,
            Unary::Absolute => {
                let below = self.two(Binary::Less, x, zero);
                self.builder.select(below, minus, one)
            }
            Unary::Exponential => value,
            Unary::NaturalLogarithm => self.two(Binary::Divide, one, x),
            Unary::SquareRoot => self.over(half, value),
            Unary::Floor | Unary::Ceiling | Unary::Round => return None,
            Unary::Sine => self.one(Unary::Cosine, x),
            Unary::Cosine => {
                let sine = self.one(Unary::Sine, x);
                self.one(Unary::Negate, sine)
            }
            Unary::BinaryLogarithm => {
                let scale = self.number(1.0 / LN_2);
                self.two(Binary::Divide, scale, x)
            }
            Unary::NormalCumulative => {
                let (scale, minus_half) = (self.number(1.0 / TAU.sqrt()), self.number(-0.5));
                let square = self.two(Binary::Multiply, x, x);
                let exponent = self.two(Binary::Multiply, minus_half, square);
                let density = self.one(Unary::Exponential, exponent);
                self.two(Binary::Multiply, scale, density)
            }
            Unary::EntropyTerm => {
                let ln = self.one(Unary::NaturalLogarithm, x);
                self.two(Binary::Subtract, minus, ln)
            }
            Unary::LnGamma | Unary::LnBessel => {
                self.without_slope.get_or_insert_with(|| format!("{operator:?}"));
                return None;
            }
        })
    }

    /// The derivatives of an operator in its operands, where they are needed.
    fn derivatives(
        &mut self,
        operator: Binary,
        [x, y]: [ValueId; 2],
        value: ValueId,
        [by_x, by_y]: [bool; 2],
    ) -> [Option<ValueId>; 2] {
        let (one, minus) = (self.number(1.0), self.number(-1.0));
        match operator {
            Binary::Add => [Some(one), Some(one)],
            Binary::Subtract => [Some(one), Some(minus)],
            Binary::Multiply => [Some(y), Some(x)],
            Binary::Divide => {
                let by_first = self.two(Binary::Divide, one, y);
                let by_second = by_y.then(|| {
                    let ratio = self.two(Binary::Divide, value, y);
                    self.one(Unary::Negate, ratio)
                });
                [Some(by_first), by_second]
            }
            Binary::Minimum | Binary::Maximum => {
                let first = self.two(Binary::Equal, value, x);
                let second = self.one(Unary::Not, first);
                [Some(first), Some(second)]
            }
            Binary::Power => {
                let by_base = by_x.then(|| {
                    let less = self.two(Binary::Subtract, y, one);
                    let power = self.two(Binary::Power, x, less);
                    self.two(Binary::Multiply, y, power)
                });
                let by_exponent = by_y.then(|| {
                    let ln = self.one(Unary::NaturalLogarithm, x);
                    self.two(Binary::Multiply, value, ln)
                });
                [by_base, by_exponent]
            }
            Binary::Remainder => {
                let by_divisor = by_y.then(|| {
                    let whole = self.two(Binary::Subtract, value, x);
                    self.two(Binary::Divide, whole, y)
                });
                [Some(one), by_divisor]
            }
            // The angle of the point (y, x): its first operand is the ordinate.
            Binary::ArcTangent => {
                let (xx, yy) = (self.two(Binary::Multiply, x, x), self.two(Binary::Multiply, y, y));
                let square = self.two(Binary::Add, xx, yy);
                let by_first = self.two(Binary::Divide, y, square);
                let by_second = by_y.then(|| {
                    let part = self.two(Binary::Divide, x, square);
                    self.one(Unary::Negate, part)
                });
                [Some(by_first), by_second]
            }
            _ => [None, None],
        }
    }
}

impl Arithmetic for Tangents {
    type Number = Place;

    fn constant(&mut self, number: f64) -> Place {
        let value = self.builder.constant(number);
        self.fixed(value)
    }

    fn known(&self, x: Place) -> Option<f64> {
        self.builder.as_constant(self.value(x))
    }

    fn unary(&mut self, operator: Unary, x: Place) -> Place {
        let at = self.value(x);
        let value = self.one(operator, at);
        if !self.has_slope(x) {
            return self.fixed(value);
        }
        let slope = self.derivative(operator, at, value);
        self.chained(value, &[(x, slope)])
    }

    fn binary(&mut self, operator: Binary, x: Place, y: Place) -> Place {
        let at = [self.value(x), self.value(y)];
        let value = self.two(operator, at[0], at[1]);
        let needed = [self.has_slope(x), self.has_slope(y)];
        if needed == [false; 2] {
            return self.fixed(value);
        }
        let [by_x, by_y] = self.derivatives(operator, at, value, needed);
        self.chained(value, &[(x, by_x), (y, by_y)])
    }

    fn select(&mut self, condition: Place, then: Place, otherwise: Place) -> Place {
        let condition = self.value(condition);
        let value = self.builder.select(condition, self.value(then), self.value(otherwise));
        let [then, otherwise] = [then, otherwise].map(|place| self.numbers[place].slopes.clone());
        let zero = self.number(0.0);
        let slots: Vec<usize> = then.keys().chain(otherwise.keys()).copied().collect();
        let mut slopes = Slopes::new();
        for slot in slots {
            let of = |slopes: &Slopes| slopes.get(&slot).copied().unwrap_or(zero);
            slopes.insert(slot, self.builder.select(condition, of(&then), of(&otherwise)));
        }
        self.put(value, slopes)
    }

    fn mass(&mut self, law: Mass, operands: [Place; OPERANDS]) -> Place {
        if operands.iter().any(|operand| self.has_slope(*operand)) {
            self.without_slope.get_or_insert_with(|| format!("an interval of `{}`", law.name()));
        }
        let operands = operands.map(|operand| self.value(operand));
        let value = self.builder.mass(law, operands);
        self.fixed(value)
    }
}

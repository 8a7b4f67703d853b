//! Distinct cases with their weights.
//!
//! In: cases, each the bits of a number for each slot, or [`MISSING`]. Out: the distinct cases, each with the sum of its
//! weights. Invariant: their order is that of the bits, slot by slot, and does not depend on the order in which cases
//! came.
//!
//! The values of finite slots are the digits of words of 64 bits, as many as fit; a real, and a number in a bin, has a
//! word of its own.

use super::program::Program;
use crate::model::Domain;

/// A case: the bits of the number in each slot, or [`MISSING`].
pub(super) type Key = Box<[u64]>;

/// A bit pattern that is not the number of any case.
pub(super) const MISSING: u64 = u64::MAX;

/// Number of cases above which equal ones are merged.
const FEW: usize = 1 << 16;

/// Distinct cases.
#[derive(Clone, Debug)]
pub(super) struct DistinctCases {
    slots: Vec<Place>,
    /// Number of words of a case.
    width: usize,
    words: Vec<u64>,
    weights: Vec<f64>,
    /// The number of cases above which equal ones are merged.
    most: usize,
}

/// The place of a slot in the words of a case.
#[derive(Clone, Debug)]
struct Place {
    word: usize,
    /// `None`: the word holds the bits.
    digit: Option<Digit>,
}

/// A digit of a word: the rank of a whole number in the order of the bits. Numbers from 0 come before negative ones,
/// those nearest to 0 first.
#[derive(Clone, Debug)]
struct Digit {
    scale: u64,
    /// Number of ranks; the last one is that of a missing value.
    radix: u64,
    /// The smallest number of at least 0, and the count of these.
    low: i64,
    positive: u64,
}

impl Digit {
    fn of(base: i64, count: usize) -> Self {
        let negative = base.min(0).unsigned_abs();
        let positive = (count as u64).saturating_sub(negative);
        Self { scale: 1, radix: positive + negative + 1, low: base.max(0), positive }
    }

    fn rank(&self, bits: u64) -> u64 {
        let number = f64::from_bits(bits) as i64;
        match bits {
            MISSING => self.radix - 1,
            _ if number >= 0 => (number - self.low) as u64,
            _ => self.positive + number.unsigned_abs() - 1,
        }
    }

    fn bits(&self, rank: u64) -> u64 {
        let number = match rank {
            rank if rank + 1 == self.radix => return MISSING,
            rank if rank < self.positive => rank as i64 + self.low,
            rank => -((rank - self.positive) as i64) - 1,
        };
        (number as f64).to_bits()
    }
}

impl DistinctCases {
    pub(super) fn new(program: &Program) -> Self {
        let digit = |slot: &super::program::Slot| {
            let domain = &program.model.variables[slot.variable].domain;
            let count = slot.count.filter(|_| !matches!(domain, Domain::Bins(_)))?;
            Some(Digit::of(domain.base(), count))
        };
        let (mut slots, mut width, mut product): (Vec<Place>, usize, Option<u64>) = (Vec::new(), 0, None);
        for digit in program.slots.iter().map(digit) {
            // The product of the radices of the word that is being filled.
            let larger = digit.as_ref().and_then(|digit| product?.checked_mul(digit.radix));
            if larger.is_none() {
                width += 1;
            }
            product = larger.or(digit.as_ref().map(|digit| digit.radix));
            slots.push(Place { word: width - 1, digit });
        }
        // The first slot of a word is its most significant digit.
        let (mut word, mut scale) = (usize::MAX, 1);
        for place in slots.iter_mut().rev() {
            let Some(digit) = &mut place.digit else { continue };
            if place.word != word {
                (word, scale) = (place.word, 1);
            }
            digit.scale = scale;
            scale = scale.saturating_mul(digit.radix);
        }
        Self { slots, width, words: Vec::new(), weights: Vec::new(), most: FEW }
    }

    /// Adds a case: the bits of the number in each slot, which is a value of it.
    pub(super) fn add(&mut self, key: &[u64], weight: f64) {
        if self.weights.len() >= self.most {
            self.merge();
        }
        let begin = self.words.len();
        self.words.resize(begin + self.width, 0);
        let words = &mut self.words[begin..];
        for (place, bits) in self.slots.iter().zip(key) {
            match &place.digit {
                Some(digit) => words[place.word] += digit.scale * digit.rank(*bits),
                None => words[place.word] = *bits,
            }
        }
        self.weights.push(weight);
    }

    /// Adds the cases of another list of the same program.
    pub(super) fn append(&mut self, mut other: Self) {
        self.words.append(&mut other.words);
        self.weights.append(&mut other.weights);
        self.merge();
    }

    /// Sorts the cases, and merges equal ones.
    pub(super) fn merge(&mut self) {
        let case = |at: usize| &self.words[at * self.width..(at + 1) * self.width];
        let mut order: Vec<usize> = (0..self.weights.len()).collect();
        order.sort_by(|one, other| case(*one).cmp(case(*other)));
        let (mut words, mut weights): (Vec<u64>, Vec<f64>) = Default::default();
        for at in order {
            let is_known = !weights.is_empty() && words[words.len() - self.width..] == *case(at);
            match weights.last_mut().filter(|_| is_known) {
                Some(weight) => *weight += self.weights[at],
                None => {
                    words.extend(case(at));
                    weights.push(self.weights[at]);
                }
            }
        }
        (self.words, self.weights) = (words, weights);
        self.most = FEW.max(2 * self.weights.len());
    }

    /// Whether there are none.
    pub(super) fn is_empty(&self) -> bool {
        self.weights.is_empty()
    }

    /// Number of cases, distinct ones once they are merged.
    pub(super) fn len(&self) -> usize {
        self.weights.len()
    }

    pub(super) fn weight(&self, case: usize) -> f64 {
        self.weights[case]
    }

    /// The sum of all weights.
    pub(super) fn total(&self) -> f64 {
        self.weights.iter().sum()
    }

    /// The bits of the number of a case in each slot.
    pub(super) fn bits(&self, case: usize) -> impl Iterator<Item = u64> {
        let words = &self.words[case * self.width..(case + 1) * self.width];
        self.slots.iter().map(move |place| match &place.digit {
            Some(digit) => digit.bits(words[place.word] / digit.scale % digit.radix),
            None => words[place.word],
        })
    }
}

#[cfg(test)]
mod tests {
    use super::{DistinctCases, MISSING, Program};
    use crate::exec::Inputs;
    use crate::source::Source;
    use rand::rngs::Xoshiro256PlusPlus;
    use rand::{RngExt, SeedableRng};
    use std::collections::BTreeMap;

    /// Cases are those of an ordered map from the bits of all slots to weights.
    #[test]
    fn cases_are_those_of_an_ordered_map() {
        let wide = (0..12).map(|at| format!("W{at} : 0..=40;")).collect::<String>();
        let uniform = (0..12).map(|at| format!("P(W{at}) = uniform;")).collect::<String>();
        let factors = (0..12).map(|at| format!("P(W{at})")).collect::<String>();
        let text = format!(
            "program Many {{ variables {{ A : -3..=2; R : real; B : bool; N : -9..=-7; S : bins(0, 1, 4); {wide} }}
             decomposition {{ P(A) P(R) P(B) P(N) P(S) {factors} }}
             forms {{ P(A) = unknown; P(R) = normal(0, 1); P(B) = uniform; P(N) = uniform; P(S) = uniform; {uniform} }} }}"
        );
        let model = crate::syntax::compile(&Source::new("many", text)).unwrap();
        let program = Program::new(&model, &Inputs::new()).unwrap();
        let mut found = DistinctCases::new(&program);
        let mut expected: BTreeMap<Vec<u64>, f64> = BTreeMap::new();
        let mut by = Xoshiro256PlusPlus::seed_from_u64(3);
        for _ in 0..4000 {
            let same = f64::from(by.random_range(0..=1));
            let key: Vec<u64> = (program.slots.iter())
                .map(|slot| {
                    let number = match slot.name.as_str() {
                        "A" => f64::from(by.random_range(-3..=2)),
                        "R" => f64::from(by.random_range(-2..=1)) / 2.0 + 0.1,
                        "B" => f64::from(by.random_range(0..=1)),
                        "N" => f64::from(by.random_range(-9..=-7)),
                        "S" => f64::from(by.random_range(0..=3)) / 4.0,
                        _ => 40.0 * same,
                    };
                    if by.random_range(0..20) == 0 { MISSING } else { number.to_bits() }
                })
                .collect();
            let weight = f64::from(by.random_range(1..=3));
            found.add(&key, weight);
            *expected.entry(key).or_default() += weight;
        }
        let total: f64 = expected.values().sum();
        let mut both = DistinctCases::new(&program);
        both.append(found.clone());
        found.merge();
        assert!(found.len() < 4000 && found.len() == expected.len());
        assert_eq!(found.total(), total);
        for cases in [found, both] {
            let all = (0..cases.len()).map(|case| (cases.bits(case).collect::<Vec<_>>(), cases.weight(case)));
            assert!(all.eq(expected.clone()));
        }
    }
}

//! Random programs.
//!
//! In: a seed. Out: a [`Program`] of tables with zeros, Diracs that may leave their domain, weights, deviations, families,
//! reals; now or over time. Invariant: the same seed gives the same program; its assignments can be enumerated.

use crate::program::{Domain, Factor, Form, Number, OWN, Program, Truth, Variable};

/// SplitMix64 (Steele, Lea and Flood 2014).
pub(crate) struct Random(pub(crate) u64);

impl Random {
    pub(crate) fn below(&mut self, bound: usize) -> usize {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut mixed = (self.0 ^ self.0 >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        mixed = (mixed ^ mixed >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((mixed ^ mixed >> 31) % bound.max(1) as u64) as usize
    }

    pub(crate) fn one_in(&mut self, count: usize) -> bool {
        self.below(count) == 0
    }
}

/// The limits of a program.
#[derive(Clone, Copy)]
pub(crate) struct Limits {
    pub(crate) variables: usize,
    /// Assignments of all finite variables.
    pub(crate) assignments: usize,
    pub(crate) families: bool,
    pub(crate) reals: usize,
    /// Variables that have a value at the previous instant.
    pub(crate) carried: usize,
}

/// Limit of the states of carried families.
const MOST_STATES: usize = 16;

fn domain(random: &mut Random) -> Domain {
    match random.below(5) {
        0 | 1 => Domain::Boolean,
        2 => Domain::Labels(1 + random.below(3)),
        _ => Domain::Range(random.below(4) as i64 - 2, 1 + random.below(4)),
    }
}

/// A random program.
pub(crate) fn program(random: &mut Random, limits: Limits) -> Program {
    let mut program = Program::default();
    let mut assignments = 1;
    let name = |number: usize| format!("V{number}");
    // Variables of the previous instant come first, since they do not depend on this instant.
    let add = |program: &mut Program, random: &mut Random, variable: Variable| {
        program.variables.push(variable);
        let left = program.variables.len() - 1;
        let before = program.variables[left].previous_of.is_some();
        let may = |one: &usize| {
            let parent = &program.variables[*one];
            parent.domain != Domain::Real && (!before || parent.previous_of.is_some())
        };
        let mut right: Vec<usize> = (0..left).filter(may).filter(|_| random.one_in(2)).collect();
        while right.len() > 3 {
            right.remove(random.below(right.len()));
        }
        // A carried variable depends on its own past.
        let own = (0..left).find(|one| program.variables[*one].previous_of == Some(left));
        right.extend(own.filter(|own| !right.contains(own)));
        let form = form(random, program, left, &right, 2);
        program.factors.push(Factor { left, right, form });
    };
    let mut carried: Vec<Variable> = Vec::new();
    for number in 0..limits.carried {
        let (domain, previous_of) = (domain(random), Some(limits.carried + number));
        let mut variable = Variable { name: name(number), domain, family: None, previous_of };
        let family = (limits.families && random.one_in(3)).then(|| 1 + random.below(3));
        let states: usize = carried.iter().map(size).product();
        if states * size(&Variable { family, ..variable.clone() }) <= MOST_STATES {
            variable.family = family;
        }
        carried.push(variable);
    }
    let now = |variable: &Variable| Variable { previous_of: None, ..variable.clone() };
    for variable in carried.clone().into_iter().chain(carried.iter().map(now)) {
        assignments *= size(&variable);
        add(&mut program, random, variable);
    }
    let more = 1 + random.below(limits.variables);
    for number in limits.carried..limits.carried + more {
        let family = (limits.families && random.one_in(5)).then(|| 1 + random.below(3));
        let variable = Variable { name: name(number), domain: domain(random), family, previous_of: None };
        if assignments * size(&variable) > limits.assignments {
            break;
        }
        assignments *= size(&variable);
        add(&mut program, random, variable);
    }
    for number in 0..random.below(limits.reals + 1) {
        let variable =
            Variable { name: format!("Y{number}"), domain: Domain::Real, family: None, previous_of: None };
        add(&mut program, random, variable);
    }
    program
}

fn size(variable: &Variable) -> usize {
    let count = match variable.domain {
        Domain::Boolean => 2,
        Domain::Labels(count) | Domain::Range(_, count) => count,
        Domain::Real => 1,
    };
    count.pow(variable.family.unwrap_or(1) as u32)
}

fn form(random: &mut Random, program: &Program, left: usize, right: &[usize], depth: usize) -> Form {
    let domain = program.variables[left].domain;
    // For a family as long as that on the left, the element with the same index is chosen more often.
    let family = program.variables[left].family;
    let own = |one: usize| (program.variables[one].family == family && family.is_some()).then_some(OWN);
    let scope: Vec<(usize, usize)> = right
        .iter()
        .flat_map(|one| {
            (0..program.elements(*one)).chain(own(*one)).chain(own(*one)).map(|element| (*one, element))
        })
        .collect();
    if depth > 0 && !scope.is_empty() && random.one_in(4) {
        let condition = truth(random, program, &scope, 1);
        // A table counts rows by the whole right-hand side, so it may be in a branch as well.
        let then = form(random, program, left, right, depth - 1);
        let otherwise = form(random, program, left, right, depth - 1);
        return Form::If(condition, Box::new(then), Box::new(otherwise));
    }
    if domain == Domain::Real {
        return match random.below(4) {
            0 => Form::Exponential([0.5, 1.0, 2.0][random.below(3)]),
            _ => Form::Normal(integer(random, program, &scope, 2), [0.25, 0.5, 1.5, 3.0][random.below(4)]),
        };
    }
    let rows: usize = right.iter().map(|one| program.count(*one)).product();
    let plain = right.iter().all(|one| program.variables[*one].family.is_none());
    match random.below(7) {
        0 | 1 if plain && rows <= 64 => {
            Form::Table((0..rows).map(|_| row(random, program.count(left))).collect())
        }
        2 if domain == Domain::Boolean => Form::DiracTruth(truth(random, program, &scope, 1)),
        2 | 3 if matches!(domain, Domain::Range(..)) => Form::Dirac(integer(random, program, &scope, 2)),
        4 if matches!(domain, Domain::Range(..)) => {
            Form::Normal(integer(random, program, &scope, 1), [0.5, 1.0, 2.5][random.below(3)])
        }
        5 if program.variables[left].family.is_none() => {
            let mut all = scope.clone();
            all.push((left, 0));
            let number = integer(random, program, &all, 2);
            // At least one value has a positive weight.
            match domain {
                Domain::Range(low, count) if random.one_in(2) => {
                    let sure = Number::Constant(low as f64 + random.below(count) as f64);
                    let is = Truth::Compare("==", Number::Of(left, 0), sure);
                    let least = [Number::Constant(0.5), Number::Constant(0.0)].map(Box::new);
                    let [more, none] = least;
                    let least = Number::If(Box::new(is), more, none);
                    Form::Weights(Number::Binary("max", Box::new(least), Box::new(number)))
                }
                _ => {
                    let half = Box::new(Number::Constant(0.5));
                    Form::Weights(Number::Binary("max", half, Box::new(number)))
                }
            }
        }
        _ if domain == Domain::Boolean => {
            let mut p = || Number::Constant([0.0, 0.125, 0.25, 0.5, 0.75, 1.0][random.below(6)]);
            let (then, otherwise) = (Box::new(p()), Box::new(p()));
            match scope.is_empty() {
                true => Form::Bernoulli(*then),
                false => {
                    let condition = Box::new(truth(random, program, &scope, 1));
                    Form::Bernoulli(Number::If(condition, then, otherwise))
                }
            }
        }
        _ => Form::Uniform,
    }
}

/// Sixteenths that sum to one, some of them 0.
fn row(random: &mut Random, count: usize) -> Vec<u32> {
    let mut row = vec![0; count];
    let sure = random.one_in(4);
    let only = random.below(count);
    for _ in 0..16 {
        let place = if sure { only } else { random.below(count) };
        row[place] += 1;
    }
    row
}

/// An element of a right-hand variable, of one kind.
fn chosen(
    random: &mut Random,
    program: &Program,
    scope: &[(usize, usize)],
    is: fn(&Domain) -> bool,
) -> Option<(usize, usize)> {
    let fit: Vec<_> = scope.iter().filter(|(one, _)| is(&program.variables[*one].domain)).collect();
    (!fit.is_empty()).then(|| *fit[random.below(fit.len())])
}

fn integer(random: &mut Random, program: &Program, scope: &[(usize, usize)], depth: usize) -> Number {
    let range = chosen(random, program, scope, |domain| matches!(domain, Domain::Range(..)));
    match (random.below(6), range) {
        (0..=2, Some((variable, element))) => Number::Of(variable, element),
        (3 | 4, _) if depth > 0 => {
            let operator = ["+", "-", "*", "min", "max"][random.below(5)];
            let one = integer(random, program, scope, depth - 1);
            let other = integer(random, program, scope, depth - 1);
            Number::Binary(operator, Box::new(one), Box::new(other))
        }
        (5, _) if depth > 0 && !scope.is_empty() => {
            let condition = truth(random, program, scope, 0);
            let then = integer(random, program, scope, depth - 1);
            let otherwise = integer(random, program, scope, depth - 1);
            Number::If(Box::new(condition), Box::new(then), Box::new(otherwise))
        }
        _ => Number::Constant(random.below(4) as f64 - 1.0),
    }
}

fn truth(random: &mut Random, program: &Program, scope: &[(usize, usize)], depth: usize) -> Truth {
    let boolean = chosen(random, program, scope, |domain| *domain == Domain::Boolean);
    let label = chosen(random, program, scope, |domain| matches!(domain, Domain::Labels(_)));
    match random.below(6) {
        0 | 1 if boolean.is_some() => boolean.map(|(one, element)| Truth::Is(one, element)).unwrap(),
        2 if label.is_some() => {
            let (one, element) = label.unwrap();
            Truth::Label(one, element, random.below(program.count(one)))
        }
        3 if depth > 0 => Truth::Not(Box::new(truth(random, program, scope, depth - 1))),
        4 if depth > 0 => {
            let one = Box::new(truth(random, program, scope, depth - 1));
            let other = Box::new(truth(random, program, scope, depth - 1));
            if random.one_in(2) { Truth::Both(one, other) } else { Truth::Either(one, other) }
        }
        _ => {
            let operator = ["<", "<=", "=="][random.below(3)];
            Truth::Compare(
                operator,
                integer(random, program, scope, depth),
                integer(random, program, scope, depth),
            )
        }
    }
}

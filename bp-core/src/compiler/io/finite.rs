//! Evaluates a model as a network: finite variables, each with one table given its parents.
//!
//! In: a [`Model`]. Out: a [`Node`] for each variable, in their order. Invariant: tables are row-major, the parents in
//! their order, the variable itself fastest. A form with expressions is evaluated in each context; several left-hand
//! variables become P(A | R) P(B | A R).

use crate::answer::link;
use crate::distribution::Setting;
use crate::error::Error;
use crate::exec::Inputs;
use crate::exec::scalar::{Extended, Scalar};
use crate::ids::{FactorId, Id};
use crate::model::{Factor, Form, Model, VariableUse};
use crate::radix;
use crate::spelling::number;
use std::borrow::Cow;

/// A variable of a network.
pub(super) struct Node<'m> {
    pub(super) name: &'m str,
    pub(super) states: Vec<String>,
    pub(super) parents: Vec<usize>,
    pub(super) numbers: Cow<'m, [f64]>,
    /// The first cell whose probability f64 rounds to 0 or to fewer digits, and that probability.
    lost: Option<(usize, Extended)>,
}

/// Limit of the numbers of an evaluated table.
const MOST_NUMBERS: usize = 1 << 24;

/// The variables of a model with their tables.
pub(super) fn nodes(model: &Model) -> Result<Vec<Node<'_>>, Error> {
    let refuse = |reason: String| Error::Unwritable { name: model.name.clone(), reason };
    if model.plate.is_some() || !model.identifications.is_empty() {
        return Err(refuse("it is repeated over a set, or learned from data".to_owned()));
    }
    let mut nodes = Vec::with_capacity(model.variables.len());
    for (id, variable) in model.variables.iter() {
        let count = variable.domain.count().filter(|count| *count <= MOST_NUMBERS);
        let (Some(count), None, None) = (count, &variable.family, variable.previous_of) else {
            let name = model.variable_name(id);
            let text = model.domain_text(&variable.domain);
            if variable.domain.count().is_some_and(|count| count > MOST_NUMBERS) {
                return Err(refuse(format!(
                    "`{name}` is `{text}`: a table of a network file can have at most {MOST_NUMBERS} numbers"
                )));
            }
            if variable.family.is_some() {
                return Err(refuse(format!(
                    "`{name}` is a family: a network file has single variables only"
                )));
            }
            return Err(refuse(format!(
                "`{name}` is `{text}`: a network file can only contain finite variables of one instant"
            )));
        };
        let states = (0..count).map(|ordinal| variable.domain.value_name(ordinal)).collect();
        nodes.push(Node {
            name: &variable.name,
            states,
            parents: Vec::new(),
            numbers: Cow::Borrowed(&[]),
            lost: None,
        });
    }
    let linked = link(model)?;
    let inputs = Inputs::new();
    let mut setting = None;
    for (id, factor) in model.factors.iter() {
        if !factor.products.is_empty()
            || factor.left.iter().chain(&factor.right).any(|use_| use_.element.is_some())
        {
            return Err(refuse(format!("`{}` is indexed", model.head(factor))));
        }
        for (position, left) in factor.left.iter().enumerate() {
            let uses: Vec<VariableUse> =
                factor.right.iter().chain(&factor.left[..position]).cloned().collect();
            let parents: Vec<usize> = uses.iter().map(|use_| use_.variable.position()).collect();
            let entries = nodes[left.variable.position()].states.len();
            let states = |parent: &usize| nodes[*parent].states.len();
            let cells = parents
                .iter()
                .try_fold(entries, |cells, parent| cells.checked_mul(states(parent)))
                .filter(|cells| *cells <= MOST_NUMBERS)
                .ok_or_else(|| Error::TooLarge {
                    name: model.head(factor),
                    cells: parents.iter().map(|parent| states(parent) as f64).product::<f64>() * entries as f64,
                    most: MOST_NUMBERS as f64,
                    help: "a network file holds each table whole: ask the program itself, or give the variable fewer parents"
                        .to_owned(),
                })?;
            let (numbers, lost) = match known(model, factor) {
                Some(numbers) => (numbers, None),
                None => {
                    let setting = match &mut setting {
                        Some(setting) => setting,
                        none => none.insert(Setting::new(&linked, &inputs)?),
                    };
                    let exact = worked_out(setting, id, position, (cells, entries))?;
                    let is_lost = |p: &Extended| *p > Extended::ZERO && p.to_f64() < f64::MIN_POSITIVE;
                    let lost = exact.iter().position(is_lost).map(|cell| (cell, exact[cell]));
                    (exact.iter().map(|p| p.to_f64()).collect(), lost)
                }
            };
            let node = &mut nodes[left.variable.position()];
            (node.parents, node.numbers, node.lost) = (parents, numbers, lost);
        }
    }
    Ok(nodes)
}

impl Node<'_> {
    /// The first row of zeros.
    pub(super) fn zero_row(&self) -> Option<usize> {
        let mut rows = self.numbers.chunks_exact(self.states.len().max(1));
        rows.position(|row| row.iter().all(|number| *number == 0.0))
    }
}

/// The first row of zeros: "`Y` at X = 1".
pub(super) fn zero_row(nodes: &[Node<'_>]) -> Option<String> {
    let (node, row) = nodes.iter().find_map(|node| Some((node, node.zero_row()?)))?;
    Some(format!("`{}`{}", node.name, context(nodes, node, row)))
}

/// The first probability that f64 does not hold: "`Y = 40` at X = 1 is e^-812.5".
pub(super) fn lost(nodes: &[Node<'_>]) -> Option<String> {
    let (node, (cell, probability)) = nodes.iter().find_map(|node| Some((node, node.lost?)))?;
    let (row, value) = (cell / node.states.len(), &node.states[cell % node.states.len()]);
    let ln = number(probability.natural_logarithm().to_f64());
    Some(format!("`{} = {value}`{} is e^{ln}", node.name, context(nodes, node, row)))
}

/// The values of the parents in a row, " at X = 1, Z = true"; nothing without parents.
fn context(nodes: &[Node<'_>], node: &Node<'_>, row: usize) -> String {
    let parents = || node.parents.iter().map(|parent| &nodes[*parent]);
    let ordinals = radix::in_order(row, parents().map(|parent| parent.states.len()));
    let context: Vec<String> = (parents().zip(ordinals))
        .map(|(parent, state)| format!("{} = {}", parent.name, parent.states[state]))
        .collect();
    if context.is_empty() { String::new() } else { format!(" at {}", context.join(", ")) }
}

/// The table of a factor that consists of numbers.
fn known<'m>(model: &'m Model, factor: &'m Factor) -> Option<Cow<'m, [f64]>> {
    let [left] = factor.left.as_slice() else { return None };
    let constants = |entries: &mut dyn Iterator<Item = &crate::ids::ExpressionId>| {
        entries.map(|entry| model.constant(*entry)).collect::<Option<Vec<f64>>>()
    };
    match &factor.form {
        Form::Constants(numbers) => Some(Cow::Borrowed(numbers)),
        Form::Table(rows) => constants(&mut rows.iter().flatten()).map(Cow::Owned),
        Form::Categorical(entries) if factor.right.is_empty() => {
            constants(&mut entries.iter()).map(Cow::Owned)
        }
        Form::Uniform => {
            let cells = |use_: &VariableUse| model.variables[use_.variable].domain.count();
            let rows: usize = factor.right.iter().map(cells).product::<Option<usize>>()?;
            let count = cells(left)?;
            Some(Cow::Owned(vec![1.0 / count as f64; rows * count]))
        }
        _ => None,
    }
}

/// The evaluated table of one variable of a factor, given the earlier left-hand variables: the factor's numbers in each
/// context, summed over the later ones.
fn worked_out(
    setting: &Setting<'_>,
    id: FactorId,
    position: usize,
    (cells, entries): (usize, usize),
) -> Result<Vec<Extended>, Error> {
    let factor = &setting.model.factors[id];
    let instances = setting.instances(id)?;
    let [instance] = instances.as_slice() else {
        let message = "it is a factor of each element of a family: it has no single table";
        return Err(Error::input(setting.model.head(factor), message));
    };
    let count = |use_: &VariableUse| setting.count(use_.variable);
    let slots: Vec<usize> = factor.right.iter().map(|use_| setting.slots_of(use_.variable).start).collect();
    let counts: Vec<usize> = factor.right.iter().map(count).collect();
    let behind: usize = factor.left[position + 1..].iter().map(count).product();
    let (mut values, mut numbers) = (vec![0.0; setting.slots()], Vec::<Extended>::with_capacity(cells));
    for row in 0..counts.iter().product::<usize>() {
        for (slot, ordinal) in slots.iter().zip(radix::in_order(row, counts.iter().copied())) {
            values[*slot] = ordinal as f64;
        }
        let joint = setting.distribution(instance, &values)?.extended();
        let joint = joint.expect("internal: a finite variable's form");
        numbers.extend(joint.chunks(behind).map(|run| run.iter().copied().sum::<Extended>()));
    }
    for row in numbers.chunks_exact_mut(entries) {
        let total: Extended = row.iter().copied().sum();
        if total > Extended::ZERO {
            row.iter_mut().for_each(|number| *number = *number / total);
        } else if position > 0 {
            // After an impossible value any distribution will do. But a row of the first variable is a whole context,
            // which is then impossible.
            row.fill(Extended::from_f64(1.0 / entries as f64));
        }
    }
    Ok(numbers)
}

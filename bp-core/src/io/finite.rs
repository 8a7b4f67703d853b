//! A model as the network formats see it: finite variables, each with one table given its parents.
//!
//! In: a [`Model`]. Out: a [`Node`] for each variable, in their order. Invariant: tables are row-major, the parents in
//! their order, the variable itself fastest. A form that is not made of numbers is asked: P(variable | parents), with
//! its parents alike; several variables on a left side become P(A | R) P(B | A R).

use crate::answer;
use crate::error::Error;
use crate::exec::Inputs;
use crate::ids::{Id, VariableId};
use crate::model::{
    Ask, Evidence, Factor, Form, Known, Model, Question, Searched, Statistic, VariableUse, When,
};
use std::borrow::Cow;

/// A variable of a network.
pub(super) struct Node<'m> {
    pub(super) name: &'m str,
    pub(super) states: Vec<String>,
    pub(super) parents: Vec<usize>,
    pub(super) numbers: Cow<'m, [f64]>,
}

/// The most numbers that a table is worked out for.
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
            return Err(refuse(format!(
                "`{name}` is `{text}`: a file holds single finite variables of one instant"
            )));
        };
        let states = (0..count).map(|ordinal| variable.domain.value_name(ordinal)).collect();
        nodes.push(Node { name: &variable.name, states, parents: Vec::new(), numbers: Cow::Borrowed(&[]) });
    }
    let mut asker = None;
    for factor in model.factors.values() {
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
            let cells = parents
                .iter()
                .try_fold(entries, |cells, parent| cells.checked_mul(nodes[*parent].states.len()))
                .filter(|cells| *cells <= MOST_NUMBERS)
                .ok_or_else(|| refuse(format!("the table of `{}` is too large", model.head(factor))))?;
            let numbers = match known(model, factor) {
                Some(numbers) => numbers,
                None => {
                    let asker = asker.get_or_insert_with(|| model.clone());
                    Cow::Owned(asked(asker, model, factor, &uses, left.variable, (cells, entries))?)
                }
            };
            let node = &mut nodes[left.variable.position()];
            (node.parents, node.numbers) = (parents, numbers);
        }
    }
    Ok(nodes)
}

impl Node<'_> {
    /// The first row that is zero everywhere.
    pub(super) fn zero_row(&self) -> Option<usize> {
        let mut rows = self.numbers.chunks_exact(self.states.len().max(1));
        rows.position(|row| row.iter().all(|number| *number == 0.0))
    }
}

/// The first row that is zero everywhere: "`Y` at X = 1".
pub(super) fn zero_row(nodes: &[Node<'_>]) -> Option<String> {
    let (node, mut row) = nodes.iter().find_map(|node| Some((node, node.zero_row()?)))?;
    let mut context = Vec::new();
    for parent in node.parents.iter().rev().map(|parent| &nodes[*parent]) {
        context.push(format!("{} = {}", parent.name, parent.states[row % parent.states.len()]));
        row /= parent.states.len();
    }
    context.reverse();
    if context.is_empty() {
        return Some(format!("`{}`", node.name));
    }
    Some(format!("`{}` at {}", node.name, context.join(", ")))
}

/// The table of a factor that is made of numbers.
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

/// The table of a factor that has to be worked out: in a model that holds it and nothing else.
fn asked(
    asker: &mut Model,
    model: &Model,
    factor: &Factor,
    right: &[VariableUse],
    left: VariableId,
    (cells, entries): (usize, usize),
) -> Result<Vec<f64>, Error> {
    asker.questions = Default::default();
    asker.factors = Default::default();
    asker.factors.push(factor.clone());
    for parent in &factor.right {
        asker.factors.push(Factor {
            left: vec![parent.clone()],
            right: Vec::new(),
            form: Form::Uniform,
            products: Vec::new(),
        });
    }
    let ask = Ask {
        statistic: Statistic::Distribution,
        when: When::Now,
        searched: vec![Searched { variable: left, at: None }],
        known: right.iter().map(|use_| Known { variable: use_.variable, evidence: Evidence::Each }).collect(),
    };
    let question = Question { name: "table".to_owned(), asks: vec![ask] };
    let answers = answer::ask(asker, &question, &Inputs::new())?;
    let mut numbers = vec![0.0; cells];
    for row in answers.first().map_or(&[][..], |answer| &answer.answer) {
        let ordinal = |variable: VariableId| {
            let name = model.variable_name(variable);
            let value = row.values.iter().find(|(known, _)| *known == name)?;
            model.variables[variable].domain.ordinal_of(&value.1)
        };
        let place = (right.iter().map(|use_| use_.variable).chain([left])).try_fold(0, |place, variable| {
            Some(place * model.variables[variable].domain.count()? + ordinal(variable)?)
        });
        if let (Some(place), Some(p)) = (place.filter(|place| *place < cells), row.p()) {
            numbers[place] = p;
        }
    }
    // What follows from something impossible is not told by the model; any law would do. But a row of the first variable
    // is a whole context: it is impossible.
    if factor.left.first().is_some_and(|first| first.variable != left) {
        for row in numbers.chunks_exact_mut(entries).filter(|row| row.iter().all(|p| *p == 0.0)) {
            row.fill(1.0 / entries as f64);
        }
    }
    Ok(numbers)
}

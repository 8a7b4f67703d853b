//! Pictures of the network of a program.
//!
//! In: a model, and optionally a question. Out: a [`Graph`], which prints as SVG or as text for Graphviz. Invariant: a
//! node for each variable of the decomposition, and an edge for each pair of a variable and one that it is distributed
//! given, once.
//!
//! An ellipse is a variable; a diamond is a variable with a Dirac form; a dashed outline marks the previous instant; a
//! shaded node is known, a double outline marks a searched variable. A box with a name and bars is a variable with its
//! [`Marginal`]. A rounded box is repeated for each value of its index. If a factor distributes several variables jointly, each is drawn as a parent of those after it: P(X Y) = P(X)
//! P(Y | X).
//!
//! No available crate (layout-rs, rust-sugiyama) draws boxes around repeated nodes and routes long edges around others,
//! so the layered layout of Sugiyama, Tagawa and Toda (1981) is implemented here.

mod dot;
mod layout;
mod order;
mod picture;
mod svg;

use crate::ids::{Id, VariableId};
use crate::model::{Family, Finding, Form, IndexSpace, Model, Question};
use std::collections::BTreeSet;

/// The role of a variable in a question.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Mark {
    /// Hidden, or there is no question.
    None,
    /// It is searched.
    Searched,
    /// It is known.
    Known,
}

/// A variable.
#[derive(Clone, PartialEq, Debug)]
pub struct Node {
    /// Its name.
    pub name: String,
    /// The index of a family.
    pub index: Option<String>,
    /// Whether it is of the previous instant.
    pub previous: bool,
    /// Whether its form is a Dirac.
    pub deterministic: bool,
    /// Its role in the question.
    pub mark: Mark,
    /// The box that contains it.
    pub plate: Option<usize>,
    /// Its distribution, which is drawn inside it.
    pub marginal: Option<Marginal>,
}

/// A distribution that is drawn inside a node.
#[derive(Clone, PartialEq, Debug)]
pub enum Marginal {
    /// Values with their probabilities, as bars.
    Bars(Vec<(String, f64)>),
    /// A line of text, such as an observed value, or the mean and the deviation of a real.
    Line(String),
}

/// A network.
#[derive(Clone, PartialEq, Debug)]
pub struct Graph {
    /// The name of the program.
    pub name: String,
    /// The plate of the whole program.
    pub over: Option<String>,
    /// Variables.
    pub nodes: Vec<Node>,
    /// From parent to child, by position.
    pub edges: Vec<(usize, usize)>,
    /// The range of each box.
    pub plates: Vec<String>,
}

/// The network of a program; with a question, searched and known variables are marked.
pub fn graph(model: &Model, question: Option<&Question>) -> Graph {
    let uses = |left: bool| {
        model.factors.values().flat_map(move |factor| if left { &factor.left } else { &factor.right })
    };
    let drawn: BTreeSet<VariableId> = uses(true).chain(uses(false)).map(|use_| use_.variable).collect();
    let ids: Vec<VariableId> = drawn.into_iter().collect();
    let position = |id: VariableId| ids.binary_search(&id).expect("internal: every used variable is drawn");
    let mut repeated: Vec<Family> = Vec::new();
    let mut nodes = Vec::with_capacity(ids.len());
    let distributions = model.distributions();
    for id in &ids {
        let variable = &model.variables[*id];
        let plate = variable.family.map(|family| {
            repeated.iter().position(|known| *known == family).unwrap_or_else(|| {
                repeated.push(family);
                repeated.len() - 1
            })
        });
        let form = distributions[id.position()].map(|factor| &model.factors[factor].form);
        nodes.push(Node {
            name: variable.name.clone(),
            index: variable.family.map(|family| index_of(model, &family)),
            previous: variable.previous_of.is_some(),
            deterministic: matches!(form, Some(Form::Dirac(_))),
            mark: question.map_or(Mark::None, |question| mark(model, question, *id)),
            plate,
            marginal: None,
        });
    }
    let mut edges = BTreeSet::new();
    for factor in model.factors.values() {
        for (place, child) in factor.left.iter().enumerate() {
            for parent in factor.right.iter().chain(&factor.left[..place]) {
                if parent.variable != child.variable {
                    edges.insert((position(parent.variable), position(child.variable)));
                }
            }
        }
    }
    let label = |family: &Family| {
        let except = family.except.map(|id| format!(", except {}", model.variable_name(id)));
        format!("{} in {}{}", index_of(model, family), space(model, &family.over), except.unwrap_or_default())
    };
    Graph {
        name: model.name.clone(),
        over: model
            .plate
            .map(|plate| format!("{} in {}", model.variable_name(plate.index), model.sets[plate.set].name)),
        nodes,
        edges: edges.into_iter().collect(),
        plates: repeated.iter().map(label).collect(),
    }
}

/// The name of the index under which a factor distributes a family.
fn index_of(model: &Model, family: &Family) -> String {
    let products = model.factors.values().flat_map(|factor| &factor.products);
    let named = products.clone().find(|(_, over)| *over == family.over).or_else(|| products.clone().next());
    named.map_or_else(|| "i".to_owned(), |(name, _)| name.clone())
}

fn space(model: &Model, over: &IndexSpace) -> String {
    match over {
        IndexSpace::Set(set) => model.sets[*set].name.clone(),
        IndexSpace::Range(range) => {
            model.domain_text(&crate::model::Domain::Finite { labels: Vec::new(), range: Some(*range) })
        }
    }
}

fn mark(model: &Model, question: &Question, id: VariableId) -> Mark {
    // The index of a plate is known in every question.
    if Some(id) == model.plate_index() {
        return Mark::Known;
    }
    let searched = question.asks.iter().flat_map(|ask| &ask.searched).any(|item| item.variable == id);
    let known = question.asks.iter().flat_map(|ask| &ask.known);
    let known = known.filter(|known| known.variable == id).any(|known| match known.evidence {
        Finding::Hard(_) | Finding::Each => true,
        // A variable with only a likelihood may be searched too.
        _ => !searched,
    });
    match (known, searched) {
        (true, _) => Mark::Known,
        (false, true) => Mark::Searched,
        (false, false) => Mark::None,
    }
}

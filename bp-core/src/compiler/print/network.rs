//! The network of an unfinished program.
//!
//! In: the tree of a program. Out: a [`Graph`] of the variables and factors that there are. Invariant: names that are
//! not declared are drawn too.

use super::factors;
use crate::draw::{Graph, Mark, Node};
use crate::syntax::ast::{Declared, Occurrence, Program, SectionKind};
use std::collections::BTreeSet;

pub(super) fn of_tree(program: &Program) -> Graph {
    let mut nodes: Vec<Node> = Vec::new();
    let mut at = |name: &str, previous: bool, index: Option<String>| {
        let known = nodes.iter().position(|node| node.name == name && node.previous == previous);
        known.unwrap_or_else(|| {
            nodes.push(Node {
                name: name.to_owned(),
                index,
                previous,
                deterministic: false,
                mark: Mark::None,
                plate: None,
                marginal: None,
            });
            nodes.len() - 1
        })
    };
    for section in &program.sections {
        if let SectionKind::Variables(declarations) = &section.kind {
            for Declared { name, family, before, .. } in declarations.iter().flat_map(|one| &one.variables) {
                let index = family.as_ref().and_then(|family| family.index.as_ref());
                at(&name.text, *before, index.map(|index| index.text.clone()));
            }
        }
    }
    let mut edges = BTreeSet::new();
    for factor in factors(program) {
        let mut each = |uses: &[Occurrence]| -> Vec<usize> {
            uses.iter().map(|one| at(&one.name.text, one.before, None)).collect()
        };
        let (left, right) = (each(&factor.left), each(&factor.right));
        for (place, child) in left.iter().enumerate() {
            let parents = right.iter().chain(&left[..place]);
            edges.extend(parents.filter(|parent| *parent != child).map(|parent| (*parent, *child)));
        }
    }
    Graph {
        name: program.name.text.clone(),
        over: program.plate.as_ref().map(|plate| format!("{} in {}", plate.index, plate.set)),
        nodes,
        edges: edges.into_iter().collect(),
        plates: Vec::new(),
    }
}

//! One tree, or several small ones: what answers all the marginals that are wanted, at least cost.
//!
//! In: a network, which variables are observed and which are wanted. Out: [`Marginals`]: trees that together answer them.
//! Invariant: each tree holds the ancestors of what it answers and of all evidence; the others are barren for it, and sum
//! to one.
//!
//! The whole network as one tree costs Σ cells once. A target with its ancestors alone is often far smaller, but there are
//! many targets: targets are taken from the leaves up, each group answers all that it holds, and a group takes in the next
//! target where one tree for both costs less than two.

use super::compile::{Outline, Tree};
use super::cost::Cost;
use super::evidence::Evidence;
use super::network::Network;
use super::propagate::Session;
use crate::error::Error;

/// Trees that together answer what is wanted.
#[derive(Clone, Debug)]
pub struct Marginals {
    trees: Vec<Tree>,
    /// For each variable the tree that answers it.
    home: Vec<usize>,
    cardinalities: Vec<usize>,
}

/// Below this many cells one tree is good enough, and nothing else is looked for.
const SMALL: f64 = 1e6;

impl Marginals {
    /// Plans for some wanted variables. `given` are those whose values will be given; `weighed` those that may get a
    /// likelihood.
    ///
    /// # Errors
    /// There is no room for it.
    pub fn new(
        network: &Network,
        given: &[usize],
        weighed: &[usize],
        wanted: &[usize],
    ) -> Result<Self, Error> {
        let (outlines, mut home) = outlines(network, given, weighed, wanted);
        let costs = outlines.iter().map(|(outline, _)| outline.cost);
        costs.fold(Cost::of(0.0, 0), Cost::and).fits()?;
        let mut trees = Vec::new();
        for (outline, wanted) in outlines {
            wanted.iter().for_each(|one| home[*one] = trees.len());
            trees.push(Tree::from_outline(network, outline, wanted));
        }
        Ok(Self { trees, home, cardinalities: network.cardinalities.clone() })
    }

    /// What the trees would take together, and how many there would be; nothing is made.
    pub fn plan(network: &Network, given: &[usize], weighed: &[usize], wanted: &[usize]) -> (Cost, usize) {
        let (outlines, _) = outlines(network, given, weighed, wanted);
        let costs = outlines.iter().map(|(outline, _)| outline.cost);
        (costs.fold(Cost::of(0.0, 0), Cost::and), outlines.len())
    }

    /// What the trees take together; the width is that of the widest.
    pub fn cost(&self) -> Cost {
        self.trees.iter().map(Tree::cost).fold(Cost::of(0.0, 0), Cost::and)
    }

    /// How many trees there are.
    pub fn trees(&self) -> usize {
        self.trees.len()
    }

    /// Working memory for asking.
    pub fn session(&self) -> MarginalsSession<'_> {
        MarginalsSession { plan: self, sessions: self.trees.iter().map(Tree::session).collect() }
    }
}

/// The working memory of one asker of [`Marginals`].
#[derive(Clone, Debug)]
pub struct MarginalsSession<'t> {
    plan: &'t Marginals,
    sessions: Vec<Session<'t>>,
}

impl MarginalsSession<'_> {
    /// Computes what is wanted, given the evidence.
    ///
    /// # Errors
    /// As for [`Session::ask`].
    pub fn ask(&mut self, evidence: &Evidence) -> Result<(), Error> {
        self.sessions.iter_mut().try_for_each(|session| session.ask(evidence))
    }

    /// The marginal of a wanted variable; of a given one nothing.
    pub fn marginal(&self, variable: usize) -> &[f64] {
        self.sessions.get(self.plan.home[variable]).map_or(&[], |session| session.marginal(variable))
    }

    /// The posterior of a wanted variable; of a given one its value, for sure.
    pub fn posterior(&self, variable: usize, evidence: &Evidence) -> Vec<f64> {
        let marginal = self.marginal(variable);
        if !marginal.is_empty() {
            return marginal.to_vec();
        }
        let value = evidence.hard.iter().find(|(one, _)| *one == variable).map(|(_, value)| *value);
        let count = self.plan.cardinalities[variable];
        (0..count).map(|other| f64::from(u8::from(Some(other) == value))).collect()
    }

    /// ln P(evidence)
    pub fn ln_evidence(&self) -> f64 {
        self.sessions.first().map_or(0.0, Session::ln_evidence)
    }
}

/// The trees that are to be made, each with what it answers; and room for where each variable will be answered.
fn outlines(
    network: &Network,
    given: &[usize],
    weighed: &[usize],
    wanted: &[usize],
) -> (Vec<(Outline, Vec<usize>)>, Vec<usize>) {
    let count = network.cardinalities.len();
    let mut is_given = vec![false; count];
    given.iter().for_each(|one| is_given[*one] = true);
    let evidence: Vec<usize> = given.iter().chain(weighed).copied().collect();
    let mut all = vec![false; count];
    include(network, wanted.iter().chain(&evidence).copied(), &mut all);
    let whole = Outline::of(network, is_given.clone(), all.clone());
    let groups = groups(network, &is_given, &evidence, wanted, &whole.cost);
    let found = groups.unwrap_or_else(|| vec![(whole, wanted.to_vec())]);
    (found, vec![usize::MAX; count])
}

/// Adds variables and their ancestors.
fn include(network: &Network, variables: impl Iterator<Item = usize>, included: &mut [bool]) {
    let mut rest: Vec<usize> = variables.collect();
    while let Some(one) = rest.pop() {
        if !std::mem::replace(&mut included[one], true) {
            rest.extend(network.parents(one));
        }
    }
}

/// Groups of targets that cost less than the whole; `None` where none are found, or looking would cost more than it saves.
fn groups(
    network: &Network,
    given: &[bool],
    evidence: &[usize],
    wanted: &[usize],
    whole: &Cost,
) -> Option<Vec<(Outline, Vec<usize>)>> {
    let count = network.cardinalities.len();
    let mut is_parent = vec![false; count];
    (0..count).for_each(|one| network.parents(one).for_each(|parent| is_parent[parent] = true));
    let leaves = is_parent.iter().filter(|parent| !**parent).count();
    if whole.cells < SMALL || whole.cells < 20.0 * (leaves * count) as f64 || network.table_of.contains(&None)
    {
        return None;
    }
    let outline = |included: Vec<bool>| Outline::of(network, given.to_vec(), included);
    let closure = |one: usize| {
        let mut included = vec![false; count];
        include(network, evidence.iter().copied().chain([one]), &mut included);
        included
    };
    let mut open: Vec<bool> = vec![false; count];
    wanted.iter().filter(|one| !given[**one]).for_each(|one| open[*one] = true);
    let (mut found, mut total): (Vec<(Outline, Vec<bool>)>, f64) = (Vec::new(), 0.0);
    let mut covered = vec![false; count];
    for target in children_first(network).into_iter() {
        if !open[target] || covered[target] {
            continue;
        }
        let included = closure(target);
        let alone = outline(included.clone());
        let merged = found.last().map(|(_, last)| {
            let both: Vec<bool> = last.iter().zip(&included).map(|(one, other)| *one || *other).collect();
            (outline(both.clone()), both)
        });
        included.iter().enumerate().filter(|(_, inside)| **inside).for_each(|(one, _)| covered[one] = true);
        match merged {
            Some((together, both))
                if together.cost.cells
                    <= found.last().map_or(0.0, |(last, _)| last.cost.cells) + alone.cost.cells =>
            {
                total += together.cost.cells - found.last().map_or(0.0, |(last, _)| last.cost.cells);
                found.pop();
                found.push((together, both));
            }
            _ => {
                total += alone.cost.cells;
                found.push((alone, included));
            }
        }
        // Half the cells, or it is not worth the trouble.
        if total > 0.5 * whole.cells {
            return None;
        }
    }
    let mut answered = vec![false; count];
    let groups = found.into_iter().map(|(outline, included)| {
        let own: Vec<usize> = (0..count)
            .filter(|one| open[*one] && included[*one] && !std::mem::replace(&mut answered[*one], true))
            .collect();
        (outline, own)
    });
    Some(groups.collect())
}

/// The variables, each before its parents.
fn children_first(network: &Network) -> Vec<usize> {
    let count = network.cardinalities.len();
    let mut children = vec![0usize; count];
    (0..count).for_each(|one| network.parents(one).for_each(|parent| children[parent] += 1));
    let mut ready: Vec<usize> = (0..count).filter(|one| children[*one] == 0).collect();
    let mut order = Vec::with_capacity(count);
    while let Some(one) = ready.pop() {
        order.push(one);
        for parent in network.parents(one) {
            children[parent] -= 1;
            if children[parent] == 0 {
                ready.push(parent);
            }
        }
    }
    order
}

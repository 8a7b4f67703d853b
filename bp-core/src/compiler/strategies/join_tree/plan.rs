//! The choice between one tree and several small ones: the cheapest way to all wanted marginals.
//!
//! In: a network, the observed and the wanted variables. Out: [`Marginals`]: trees that together answer them.
//! Invariant: each tree holds the ancestors of its targets and of all evidence; other variables are barren for it and
//! sum to one.
//!
//! The whole network as one tree costs Σ cells once. A target with its ancestors alone is often far smaller, but there
//! are many targets: they are taken from the leaves up, each group answers all the targets that it holds, and a group
//! takes in the next target where one tree for both costs less than two.

use super::compile::{Outline, Purpose, Tree};
use super::cost::Cost;
use super::evidence::NetworkEvidence;
use super::network::{FactorTable, Network};
use super::problem::Problem;
use super::session::Session;
use crate::analysis::reached;
use crate::elimination::Effort;
use crate::error::Error;

/// Trees that together answer the wanted marginals.
#[derive(Clone, Debug)]
pub struct Marginals {
    trees: Vec<Tree>,
    /// For each variable the tree that answers it.
    home: Vec<usize>,
    cardinalities: Vec<usize>,
}

impl Marginals {
    /// A plan for some wanted variables. `given` variables have a value in each question; `weighed` ones may get a
    /// value or a likelihood.
    ///
    /// # Errors
    /// Too little memory.
    pub fn new(
        network: &Network,
        given: &[usize],
        weighed: &[usize],
        wanted: &[usize],
    ) -> Result<Self, Error> {
        let outlines = Question::new(network, given, weighed, wanted).outlines();
        outlines.iter().map(|(outline, _)| outline.cost).fold(Cost::default(), Cost::and).fits()?;
        let is_given = flags(network, given);
        let mut home = vec![usize::MAX; network.cardinalities.len()];
        let mut trees = Vec::with_capacity(outlines.len());
        for (outline, wanted) in outlines {
            wanted.iter().for_each(|one| home[*one] = trees.len());
            trees.push(Tree::from_outline(network, &is_given, outline, &wanted, Purpose::Sum));
        }
        Ok(Self { trees, home, cardinalities: network.cardinalities.clone() })
    }

    /// The total cost of the trees, and their number, without making them.
    pub fn plan(network: &Network, given: &[usize], weighed: &[usize], wanted: &[usize]) -> (Cost, usize) {
        let outlines = Question::new(network, given, weighed, wanted).outlines();
        (outlines.iter().map(|(outline, _)| outline.cost).fold(Cost::default(), Cost::and), outlines.len())
    }

    /// The total cost of the trees; the width is that of the widest.
    pub fn cost(&self) -> Cost {
        self.trees.iter().map(Tree::cost).fold(Cost::default(), Cost::and)
    }

    /// The number of trees.
    pub fn trees(&self) -> usize {
        self.trees.len()
    }

    /// Working memory for questions.
    pub fn session(&self) -> MarginalsSession<'_> {
        MarginalsSession { plan: self, sessions: self.trees.iter().map(Tree::session).collect() }
    }
}

/// The working memory of one session of [`Marginals`].
#[derive(Clone, Debug)]
pub struct MarginalsSession<'t> {
    plan: &'t Marginals,
    sessions: Vec<Session<'t>>,
}

impl MarginalsSession<'_> {
    /// Computes the wanted marginals given the evidence.
    ///
    /// # Errors
    /// As for [`Session::ask`].
    pub fn ask(&mut self, evidence: &NetworkEvidence) -> Result<(), Error> {
        self.sessions.iter_mut().try_for_each(|session| session.ask(evidence))
    }

    /// The marginal of a wanted variable; empty for a given one.
    pub fn marginal(&self, variable: usize) -> &[f64] {
        self.sessions.get(self.plan.home[variable]).map_or(&[], |session| session.marginal(variable))
    }

    /// The posterior of a wanted variable; for a given one, probability 1 at its value.
    pub fn posterior(&self, variable: usize, evidence: &NetworkEvidence) -> Vec<f64> {
        let marginal = self.marginal(variable);
        if !marginal.is_empty() {
            return marginal.to_vec();
        }
        let known = self.sessions.first().map(|session| session.known.values[variable]);
        let in_case = || evidence.hard.iter().find(|(one, _)| *one == variable).map(|(_, value)| *value);
        let value = known.or_else(in_case);
        let count = self.plan.cardinalities[variable];
        (0..count).map(|other| f64::from(u8::from(Some(other) == value))).collect()
    }

    /// ln P(evidence)
    pub fn ln_evidence(&self) -> f64 {
        self.sessions.first().map_or(0.0, Session::ln_evidence)
    }
}

fn flags(network: &Network, which: &[usize]) -> Vec<bool> {
    let mut flags = vec![false; network.cardinalities.len()];
    which.iter().for_each(|one| flags[*one] = true);
    flags
}

/// For each table with a row that is zero everywhere, a variable that it distributes: such a variable is not barren,
/// since an impossible context shifts probability to the others.
fn improper(network: &Network) -> Vec<usize> {
    let mut left = vec![Vec::new(); network.tables.len()];
    for (variable, table) in network.table_of.iter().enumerate() {
        table.iter().for_each(|table| left[*table].push(variable));
    }
    let is_improper = |(table, left): &(&FactorTable, &Vec<usize>)| {
        let entries: usize = left.iter().map(|variable| network.cardinalities[*variable]).product();
        !left.is_empty() && table.values.chunks(entries.max(1)).any(|row| row.iter().all(|p| *p == 0.0))
    };
    let tables = network.tables.iter().zip(&left).filter(is_improper);
    tables.filter_map(|(_, left)| left.first().copied()).collect()
}

/// Upper limit on the cells for which groups are sought.
const MOST: f64 = 1e12;

/// The known and the wanted variables.
struct Question<'n> {
    network: &'n Network,
    given: Vec<bool>,
    weighed: Vec<bool>,
    /// Given or weighed.
    known: Vec<usize>,
    wanted: &'n [usize],
    /// For each table that is not a distribution, a variable that it distributes.
    improper: Vec<usize>,
}

impl<'n> Question<'n> {
    fn new(network: &'n Network, given: &[usize], weighed: &[usize], wanted: &'n [usize]) -> Self {
        let known = given.iter().chain(weighed).copied().collect();
        let improper = improper(network);
        Self {
            network,
            given: flags(network, given),
            weighed: flags(network, weighed),
            known,
            wanted,
            improper,
        }
    }

    /// The trees to make, each with the variables that it answers.
    fn outlines(&self) -> Vec<(Outline, Vec<usize>)> {
        let all = self.ancestors(self.wanted.iter().chain(&self.known).copied());
        let groups = self.groups(self.cells(all.as_deref()));
        groups.unwrap_or_else(|| vec![(self.outline(all.as_deref()), self.wanted.to_vec())])
    }

    /// A quick estimate of the cells of a tree.
    fn cells(&self, part: Option<&[usize]>) -> f64 {
        Problem::of(self.network, &self.given, part).triangulated(Effort::Glance).cells
    }

    fn outline(&self, part: Option<&[usize]>) -> Outline {
        Outline::of(Problem::of(self.network, &self.given, part), &self.weighed, Effort::Search)
    }

    /// Some variables and their ancestors, ascending; `None` where this may be incomplete because a table does not
    /// distribute any variable.
    fn ancestors(&self, variables: impl Iterator<Item = usize>) -> Option<Vec<usize>> {
        let network = self.network;
        if network.table_of.iter().flatten().count() < network.tables.len() {
            return None;
        }
        let from = variables.chain(self.improper.iter().copied());
        let found = reached(network.cardinalities.len(), from, |one, rest| rest.extend(network.parents(one)));
        Some((0..found.len()).filter(|one| found[*one]).collect())
    }

    /// Groups of targets that cost less than the whole; `None` where there are none, or where the search would cost
    /// more than it saves.
    fn groups(&self, whole: f64) -> Option<Vec<(Outline, Vec<usize>)>> {
        let (network, count) = (self.network, self.network.cardinalities.len());
        let mut is_parent = vec![false; count];
        (0..count).for_each(|one| network.parents(one).for_each(|parent| is_parent[parent] = true));
        let leaves = is_parent.iter().filter(|parent| !**parent).count();
        // One estimate takes some hundred nanoseconds for each variable; a cell about one, up and down together.
        if whole < 300.0 * (leaves * count) as f64 {
            return None;
        }
        let mut open = vec![false; count];
        self.wanted.iter().filter(|one| !self.given[**one]).for_each(|one| open[*one] = true);
        let mut found: Vec<(Vec<usize>, f64)> = Vec::new();
        let (mut covered, mut total) = (vec![false; count], 0.0);
        for target in children_first(network) {
            if !open[target] || covered[target] {
                continue;
            }
            let part = self.ancestors(self.known.iter().copied().chain([target]))?;
            part.iter().for_each(|one| covered[*one] = true);
            let alone = self.cells(Some(&part));
            let merged = found.last().map(|(last, before)| {
                let both = self.ancestors(last.iter().chain(&part).copied()).unwrap_or_default();
                let together = self.cells(Some(&both));
                (both, together, *before)
            });
            match merged {
                Some((both, together, before)) if together <= before + alone => {
                    total += together - before;
                    found.pop();
                    found.push((both, together));
                }
                _ => {
                    total += alone;
                    found.push((part, alone));
                }
            }
            // Groups must halve the number of cells, and stay within a feasible size.
            if total > 0.5 * whole || total > MOST {
                return None;
            }
        }
        // Where no marginal is wanted, one tree gives P(evidence).
        if found.is_empty() {
            return None;
        }
        let mut answered = vec![false; count];
        let groups = found.into_iter().map(|(part, _)| {
            let new = part.iter().copied();
            let own = new.filter(|one| open[*one] && !std::mem::replace(&mut answered[*one], true)).collect();
            (self.outline(Some(&part)), own)
        });
        Some(groups.collect())
    }
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

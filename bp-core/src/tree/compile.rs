//! The junction tree of a network, ready to be asked.
//!
//! In: a network, and the variables whose values will be given each time. Out: a [`Tree`]: for each clique its blocks,
//! the tables and messages that it multiplies, and where its own message goes. Invariant: what does not depend on the
//! evidence is computed here; asking allocates nothing that a [`Session`](super::Session) does not keep.

use super::network::Network;
use super::stride::{Blocks, Reach};
use super::triangulate::{Cliques, Graph};

/// A table of the network within a clique, at the given values.
#[derive(Clone, Debug)]
pub(super) struct Source {
    pub(super) table: usize,
    pub(super) reach: Reach,
    /// The given variables in the table: (variable, stride).
    pub(super) given: Vec<(usize, usize)>,
}

/// A clique.
#[derive(Clone, Debug)]
pub(super) struct Clique {
    pub(super) variables: Vec<usize>,
    pub(super) blocks: Blocks,
    /// The tables that are multiplied here; none that is part of `fixed`.
    pub(super) sources: Vec<Source>,
    /// The product of the tables without given variables, where it is worth keeping.
    pub(super) fixed: Option<Vec<f64>>,
    /// The cliques whose messages come in, and where these lie.
    pub(super) children: Vec<(usize, Reach)>,
    /// The clique that gets the message, and where its cells lie.
    pub(super) parent: Option<(usize, Reach)>,
    /// Cells of the message to the parent; 1 for a root.
    pub(super) message: usize,
    /// Variables whose marginals are read off here: (variable, where).
    pub(super) marginals: Vec<(usize, Reach)>,
    /// Variables on which likelihoods may come: (variable, where).
    pub(super) likelihoods: Vec<(usize, Reach)>,
}

/// A junction tree that can be asked again and again.
#[derive(Clone, Debug)]
pub struct Tree {
    pub(super) network: Network,
    pub(super) cliques: Vec<Clique>,
    /// The tables whose variables are all given: (table, (variable, stride)).
    pub(super) known: Vec<(usize, Vec<(usize, usize)>)>,
    pub(super) given: Vec<bool>,
    /// The variables that have a marginal here.
    pub(super) answered: Vec<usize>,
    /// Where each clique's cells, and its message, begin.
    pub(super) offsets: Vec<(usize, usize)>,
    /// Where each variable's marginal begins.
    pub(super) places: Vec<usize>,
}

/// Products of tables are kept where a clique has at most this many cells.
const KEPT: usize = 1 << 16;

/// What a tree would take, before it is made.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Cost {
    /// Cells of all cliques.
    pub cells: f64,
    /// Variables of the largest clique.
    pub width: usize,
    /// Bytes of working memory.
    pub bytes: f64,
}

/// Cliques that have been found, for those who want to know the cost first.
pub(super) struct Outline {
    cliques: Cliques,
    given: Vec<bool>,
    included: Vec<bool>,
    pub(super) cost: Cost,
}

impl Outline {
    /// The cliques of the variables that are included and not given. The others are left out with their tables: they
    /// must be barren.
    pub(super) fn of(network: &Network, given: Vec<bool>, included: Vec<bool>) -> Self {
        let tables = (network.tables.iter()).filter(|table| table.variables.iter().all(|one| included[*one]));
        let left_out: Vec<bool> =
            given.iter().zip(&included).map(|(given, included)| *given || !included).collect();
        let graph =
            Graph::of(&network.cardinalities, tables.map(|table| table.variables.as_slice()), &left_out);
        let cliques = graph.triangulate(&left_out);
        let width = cliques.members.iter().map(Vec::len).max().unwrap_or(0);
        let cost = Cost { cells: cliques.cells, width, bytes: 8.0 * cliques.cells * 1.3 };
        Self { cliques, given, included, cost }
    }
}

impl Tree {
    /// The junction tree of a network in which the values of some variables are given each time.
    pub fn new(network: &Network, given: &[usize]) -> Self {
        let count = network.cardinalities.len();
        let mut is_given = vec![false; count];
        given.iter().for_each(|variable| is_given[*variable] = true);
        let outline = Outline::of(network, is_given, vec![true; count]);
        Self::from_outline(network, outline, (0..count).collect())
    }

    /// What the tree takes.
    pub fn cost(&self) -> Cost {
        let cells: usize = self.cliques.iter().map(|clique| clique.blocks.cells()).sum();
        let width = self.cliques.iter().map(|clique| clique.variables.len()).max().unwrap_or(0);
        Cost { cells: cells as f64, width, bytes: 8.0 * cells as f64 * 1.3 }
    }

    pub(super) fn from_outline(network: &Network, outline: Outline, wanted: Vec<usize>) -> Self {
        let Outline { cliques: Cliques { members, parent, .. }, given, included, .. } = outline;
        let extent = |one: &usize| network.cardinalities[*one];
        let cells = |variables: &[usize]| variables.iter().map(extent).product::<usize>();
        // What a clique shares with its parent comes last, so that its message is summed along its rows.
        let shared: Vec<Vec<usize>> = (members.iter().zip(&parent))
            .map(|(own, parent)| {
                let above = parent.map(|parent| &members[parent][..]).unwrap_or_default();
                own.iter().filter(|one| above.binary_search(one).is_ok()).map(|one| *one as usize).collect()
            })
            .collect();
        let mut cliques: Vec<Clique> = (members.iter().zip(&shared))
            .map(|(own, shared)| {
                let rest = own.iter().map(|one| *one as usize).filter(|one| !shared.contains(one));
                let variables: Vec<usize> = rest.chain(shared.iter().copied()).collect();
                let blocks = Blocks::of(variables.iter().map(extent).collect());
                Clique {
                    variables,
                    blocks,
                    sources: Vec::new(),
                    fixed: None,
                    children: Vec::new(),
                    parent: None,
                    message: cells(shared),
                    marginals: Vec::new(),
                    likelihoods: Vec::new(),
                }
            })
            .collect();
        for number in 0..cliques.len() {
            let Some(above) = parent[number] else { continue };
            let own = reach(&cliques[number], &shared[number], network);
            cliques[number].parent = Some((above, own));
            let theirs = reach(&cliques[above], &shared[number], network);
            cliques[above].children.push((number, theirs));
        }
        // For each variable the cliques that have it, smallest first.
        let mut having: Vec<Vec<usize>> = vec![Vec::new(); network.cardinalities.len()];
        for (number, clique) in cliques.iter().enumerate() {
            clique.variables.iter().for_each(|variable| having[*variable].push(number));
        }
        having.iter_mut().for_each(|list| list.sort_by_key(|number| cliques[*number].blocks.cells()));
        let mut known = Vec::new();
        for (number, table) in network.tables.iter().enumerate() {
            if !table.variables.iter().all(|one| included[*one]) {
                continue;
            }
            let strides = strides(&table.variables, network);
            let free: Vec<usize> = table.variables.iter().copied().filter(|one| !given[*one]).collect();
            let pairs = table.variables.iter().copied().zip(strides.iter().copied());
            let fixed: Vec<(usize, usize)> = pairs.clone().filter(|(one, _)| given[*one]).collect();
            // The table is multiplied in the smallest clique that has its rarest variable and all others.
            let rarest = free.iter().min_by_key(|one| having[**one].len());
            let Some(rarest) = rarest else {
                known.push((number, fixed));
                continue;
            };
            let fits = |clique: &&usize| free.iter().all(|one| cliques[**clique].variables.contains(one));
            let home =
                having[*rarest].iter().find(fits).copied().expect("internal: a table lies in a clique");
            let along: Vec<usize> = (cliques[home].variables.iter())
                .map(|one| pairs.clone().find(|(other, _)| other == one).map_or(0, |(_, stride)| stride))
                .collect();
            let reach = cliques[home].blocks.reach(&along);
            cliques[home].sources.push(Source { table: number, reach, given: fixed });
        }
        let mut places = vec![0; network.cardinalities.len() + 1];
        for variable in 0..network.cardinalities.len() {
            places[variable + 1] = places[variable] + network.cardinalities[variable];
        }
        let mut answered = Vec::new();
        for variable in wanted.into_iter().filter(|one| !given[*one] && included[*one]) {
            answered.push(variable);
            let Some(home) = having[variable].first().copied() else { continue };
            let along = reach(&cliques[home], &[variable], network);
            cliques[home].marginals.push((variable, along));
        }
        for (variable, homes) in having.iter().enumerate() {
            if let Some(home) = homes.first().copied() {
                let along = reach(&cliques[home], &[variable], network);
                cliques[home].likelihoods.push((variable, along));
            }
        }
        let (mut offsets, mut cell, mut message) = (Vec::new(), 0, 0);
        for clique in &mut cliques {
            offsets.push((cell, message));
            cell += clique.blocks.cells();
            message += clique.message;
            clique.keep_fixed(network);
        }
        offsets.push((cell, message));
        Self { network: network.clone(), cliques, known, given, answered, offsets, places }
    }
}

impl Clique {
    /// Multiplies once what does not depend on what is given.
    fn keep_fixed(&mut self, network: &Network) {
        if self.blocks.cells() > KEPT || !self.sources.iter().any(|source| source.given.is_empty()) {
            return;
        }
        let mut fixed = vec![1.0; self.blocks.cells()];
        let (constant, others): (Vec<Source>, Vec<Source>) =
            std::mem::take(&mut self.sources).into_iter().partition(|source| source.given.is_empty());
        for (number, block) in fixed.chunks_exact_mut(self.blocks.width).enumerate() {
            for source in &constant {
                source.reach.multiply(block, number, &network.tables[source.table].values, 0);
            }
        }
        self.sources = others;
        self.fixed = Some(fixed);
    }
}

/// Where a clique's cells lie in a table over some of its variables, in this order.
fn reach(clique: &Clique, variables: &[usize], network: &Network) -> Reach {
    let strides = strides(variables, network);
    let along: Vec<usize> = (clique.variables.iter())
        .map(|one| variables.iter().position(|other| other == one).map_or(0, |place| strides[place]))
        .collect();
    clique.blocks.reach(&along)
}

/// How far apart the values of each variable are in a table over them.
fn strides(variables: &[usize], network: &Network) -> Vec<usize> {
    let (mut strides, mut stride) = (vec![0; variables.len()], 1);
    for (place, variable) in variables.iter().enumerate().rev() {
        strides[place] = stride;
        stride *= network.cardinalities[*variable];
    }
    strides
}

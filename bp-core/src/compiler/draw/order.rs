//! Layers and the order in each: parents above children, few crossings.
//!
//! In: a graph. Out: [`Layers`] of vertices, which are the nodes, and a bend wherever an edge passes a layer.
//! Invariant: every edge between vertices leads from one layer to the next; the vertices of a box are adjacent, and any
//! two boxes have the same order in every layer.
//!
//! Layers by longest paths; order by barycentres, down and up in turn (Sugiyama, Tagawa and Toda, IEEE Transactions on
//! Systems, Man, and Cybernetics 11:109–125, 1981). The order with the fewest crossings is kept.

use super::Graph;

/// Number of sweeps.
const SWEEPS: usize = 24;

/// A graph in layers.
pub(super) struct Layers {
    /// The layer of each vertex; nodes first, then bends.
    pub(super) layer_of: Vec<usize>,
    /// The box of each vertex.
    pub(super) plate_of: Vec<Option<usize>>,
    /// The vertices of each layer, from left to right.
    pub(super) layers: Vec<Vec<usize>>,
    /// For each edge of the graph, the vertices that it passes, ends included.
    pub(super) routes: Vec<Vec<usize>>,
    /// The key by which units (boxes, and vertices in none) are ordered: the same in all layers.
    keys: Vec<f64>,
    plates: usize,
    neighbours: Vec<Vec<usize>>,
}

/// The layer of each node: below all its parents; a node without parents is just above its first child.
pub(super) fn layers_of(graph: &Graph) -> Vec<usize> {
    let count = graph.nodes.len();
    let (mut children, mut waiting) = (vec![Vec::new(); count], vec![0usize; count]);
    for (parent, child) in &graph.edges {
        children[*parent].push(*child);
        waiting[*child] += 1;
    }
    let mut layer_of = vec![0usize; count];
    let roots: Vec<usize> = (0..count).filter(|node| waiting[*node] == 0).collect();
    let mut ready = roots.clone();
    while let Some(node) = ready.pop() {
        for child in &children[node] {
            layer_of[*child] = layer_of[*child].max(layer_of[node] + 1);
            waiting[*child] -= 1;
            if waiting[*child] == 0 {
                ready.push(*child);
            }
        }
    }
    for root in roots {
        let first = children[root].iter().map(|child| layer_of[*child]).min();
        layer_of[root] = first.map_or(0, |first| first.saturating_sub(1));
    }
    layer_of
}

/// The graph in layers, in an order with few crossings.
pub(super) fn layered(graph: &Graph) -> Layers {
    let mut layer_of = layers_of(graph);
    let mut plate_of: Vec<Option<usize>> = graph.nodes.iter().map(|node| node.plate).collect();
    let mut routes = Vec::with_capacity(graph.edges.len());
    for (parent, child) in &graph.edges {
        let mut route = vec![*parent];
        for layer in layer_of[*parent] + 1..layer_of[*child] {
            route.push(layer_of.len());
            layer_of.push(layer);
            // An edge inside a box stays inside it.
            let own = plate_of[*parent].filter(|plate| plate_of[*child] == Some(*plate));
            plate_of.push(own);
        }
        route.push(*child);
        routes.push(route);
    }
    let mut layers = vec![Vec::new(); layer_of.iter().max().map_or(0, |last| last + 1)];
    layer_of.iter().enumerate().for_each(|(vertex, layer)| layers[*layer].push(vertex));
    let mut neighbours = vec![Vec::new(); layer_of.len()];
    for (upper, lower) in routes.iter().flat_map(|route| route.windows(2)).map(|pair| (pair[0], pair[1])) {
        neighbours[upper].push(lower);
        neighbours[lower].push(upper);
    }
    let plates = graph.plates.len();
    let keys = vec![0.0; plates + layer_of.len()];
    let mut found = Layers { layer_of, plate_of, layers, routes, keys, plates, neighbours };
    found.untangle();
    found
}

impl Layers {
    /// The unit of a vertex: its box, or else itself.
    fn unit(&self, vertex: usize) -> usize {
        self.plate_of[vertex].unwrap_or(self.plates + vertex)
    }

    fn untangle(&mut self) {
        let mut best = (self.crossings(), self.layers.clone(), self.keys.clone());
        self.sort(&vec![0.0; self.layer_of.len()]);
        for sweep in 0..SWEEPS {
            let down = sweep % 2 == 0;
            let wanted = self.barycentres(down);
            self.sort(&wanted);
            self.swap();
            let crossings = self.crossings();
            if sweep == 0 || crossings < best.0 {
                best = (crossings, self.layers.clone(), self.keys.clone());
            }
        }
        (_, self.layers, self.keys) = best;
    }

    /// The desired position of each vertex: the mean of its neighbours above or below.
    fn barycentres(&self, down: bool) -> Vec<f64> {
        let mut place = vec![0.0; self.layer_of.len()];
        for layer in &self.layers {
            let half = (layer.len() as f64 - 1.0) / 2.0;
            layer.iter().enumerate().for_each(|(at, vertex)| place[*vertex] = at as f64 - half);
        }
        let order: Vec<usize> =
            if down { (0..self.layers.len()).collect() } else { (0..self.layers.len()).rev().collect() };
        for layer in order {
            let mut wanted: Vec<(usize, f64)> = Vec::new();
            for vertex in &self.layers[layer] {
                let beyond = |other: &&usize| (self.layer_of[**other] < layer) == down;
                let near: Vec<f64> =
                    self.neighbours[*vertex].iter().filter(beyond).map(|other| place[*other]).collect();
                let mean = near.iter().sum::<f64>() / near.len() as f64;
                wanted.push((*vertex, if near.is_empty() { place[*vertex] } else { mean }));
            }
            wanted.iter().for_each(|(vertex, at)| place[*vertex] = *at);
        }
        place
    }

    /// Orders each layer by these positions; boxes by the mean of their content.
    fn sort(&mut self, wanted: &[f64]) {
        let mut members = vec![0.0f64; self.keys.len()];
        self.keys.iter_mut().for_each(|key| *key = 0.0);
        for (vertex, at) in wanted.iter().enumerate() {
            let unit = self.unit(vertex);
            self.keys[unit] += at;
            members[unit] += 1.0;
        }
        self.keys.iter_mut().zip(&members).for_each(|(key, count)| *key /= count.max(1.0));
        // Ranks instead of means, so that they are distinct and any two can be swapped.
        let mut units: Vec<usize> = (0..self.keys.len()).collect();
        units.sort_by(|one, other| self.keys[*one].total_cmp(&self.keys[*other]).then(one.cmp(other)));
        units.iter().enumerate().for_each(|(rank, unit)| self.keys[*unit] = rank as f64);
        let mut layers = std::mem::take(&mut self.layers);
        for layer in &mut layers {
            layer.sort_by(|one, other| {
                let (a, b) = (self.unit(*one), self.unit(*other));
                (self.keys[a].total_cmp(&self.keys[b]))
                    .then(a.cmp(&b))
                    .then(wanted[*one].total_cmp(&wanted[*other]))
                    .then(one.cmp(other))
            });
        }
        self.layers = layers;
    }

    /// Swaps neighbours that are in no box while this reduces the crossings of their edges.
    fn swap(&mut self) {
        let mut place = vec![0; self.layer_of.len()];
        for layer in &self.layers {
            layer.iter().enumerate().for_each(|(at, vertex)| place[*vertex] = at);
        }
        for layer in (0..self.layers.len()).chain((0..self.layers.len()).rev()) {
            for at in 1..self.layers[layer].len() {
                let (left, right) = (self.layers[layer][at - 1], self.layers[layer][at]);
                if self.plate_of[left].is_some() || self.plate_of[right].is_some() {
                    continue;
                }
                let crossed = |left: usize, right: usize| {
                    let pairs = self.neighbours[left]
                        .iter()
                        .flat_map(|one| self.neighbours[right].iter().map(move |other| (*one, *other)));
                    let same = pairs.filter(|(one, other)| self.layer_of[*one] == self.layer_of[*other]);
                    same.filter(|(one, other)| place[*one] > place[*other]).count()
                };
                if crossed(right, left) < crossed(left, right) {
                    self.layers[layer].swap(at - 1, at);
                    self.keys.swap(self.plates + left, self.plates + right);
                    place.swap(left, right);
                }
            }
        }
    }

    /// The number of crossings of edges.
    pub(super) fn crossings(&self) -> usize {
        let mut place = vec![0; self.layer_of.len()];
        for layer in &self.layers {
            layer.iter().enumerate().for_each(|(at, vertex)| place[*vertex] = at);
        }
        let mut between = vec![Vec::new(); self.layers.len()];
        for pair in self.routes.iter().flat_map(|route| route.windows(2)) {
            between[self.layer_of[pair[0]]].push((place[pair[0]], place[pair[1]]));
        }
        let crossed = |edges: &Vec<(usize, usize)>| {
            let crosses = |one: &(usize, usize), other: &(usize, usize)| {
                (one.0 < other.0 && one.1 > other.1) || (one.0 > other.0 && one.1 < other.1)
            };
            let pairs = (edges.iter().enumerate())
                .map(|(at, one)| edges[at + 1..].iter().filter(|other| crosses(one, other)).count());
            pairs.sum::<usize>()
        };
        between.iter().map(crossed).sum()
    }

    /// Whether a unit is left of another, in all layers of both.
    pub(super) fn is_left(&self, one: usize, other: usize) -> bool {
        let (a, b) = (self.unit(one), self.unit(other));
        self.keys[a].total_cmp(&self.keys[b]).then(a.cmp(&b)).is_lt()
    }
}

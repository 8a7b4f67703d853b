//! Coordinates of nodes, bends and boxes.
//!
//! In: a graph. Out: a [`Layout`] in pixels, y downwards. Invariant: no two nodes overlap, nor a box and a node that is
//! not in it, nor two boxes.
//!
//! Vertices keep the order of their layers. The order and the gaps are constraints x_b − x_a ≥ d; all hold at the start
//! (everything as far left as possible), and are kept while each vertex moves towards its neighbours.

use super::order::{Layers, layered};
use super::{Graph, Marginal, Node};

/// Half the height of an ellipse.
pub(super) const HALF_HEIGHT: f64 = 19.0;
/// Gap between the nodes of two layers.
const BETWEEN: f64 = 54.0;
/// The height of the name of a node with a distribution, and of a line below it.
pub(super) const NAME: f64 = 26.0;
pub(super) const LINE: f64 = 16.0;
/// The width of a bar, and of the probability after it.
pub(super) const BAR: f64 = 56.0;
pub(super) const NUMBER: f64 = 40.0;
/// The gap between the edge of a node with a distribution and its text.
pub(super) const PADDING: f64 = 9.0;
/// The width of a letter of a value.
const SMALL: f64 = 6.4;
/// Gap between neighbours.
const GAP: f64 = 26.0;
/// Gap between the content of a box and its edge; below there is room for the label.
const INSIDE: f64 = 13.0;
const LABEL: f64 = 18.0;
/// Gap between a node and a line that passes it.
const ROOM: f64 = 7.0;
/// Margin.
const MARGIN: f64 = 12.0;
/// Number of iterations of the vertex positions.
const SWEEPS: usize = 60;
/// The width of a letter.
const LETTER: f64 = 7.6;

/// A rectangle.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Rectangle {
    pub(super) left: f64,
    pub(super) top: f64,
    pub(super) right: f64,
    pub(super) bottom: f64,
}

/// The coordinates of a network.
pub(super) struct Layout {
    /// The centre of each node.
    pub(super) centres: Vec<(f64, f64)>,
    /// Half the width of each node.
    pub(super) half_widths: Vec<f64>,
    /// Half the height of each node.
    pub(super) half_heights: Vec<f64>,
    /// The points through which each edge bends, ends left out, each with half the height of its layer.
    pub(super) bends: Vec<Vec<(f64, f64, f64)>>,
    /// The boxes.
    pub(super) plates: Vec<Rectangle>,
    /// The box around the whole program.
    pub(super) over: Option<Rectangle>,
    pub(super) width: f64,
    pub(super) height: f64,
}

/// Half the width of a node.
fn half_width(node: &Node) -> f64 {
    // A word in capitals is wider; one or two of them are within the padding.
    let capitals = node.name.chars().filter(|letter| letter.is_uppercase()).count().saturating_sub(2);
    let letters = node.name.chars().count() as f64 + 0.35 * capitals as f64;
    let small = node.index.as_ref().map_or(0.0, |index| index.chars().count() as f64 * 0.75)
        + if node.previous { 1.5 } else { 0.0 };
    let text = (letters + small) * LETTER / 2.0;
    let inside = match &node.marginal {
        None => 0.0,
        Some(Marginal::Line(line)) => line.chars().count() as f64 * SMALL,
        Some(Marginal::Bars(bars)) => {
            let longest = bars.iter().map(|(value, _)| value.chars().count()).max().unwrap_or(0);
            longest as f64 * SMALL + 5.0 + BAR + NUMBER
        }
    };
    if node.marginal.is_some() {
        return (inside / 2.0).max(text) + PADDING;
    }
    // Text in a diamond has less room.
    if node.deterministic { (text * 1.35 + 16.0).max(30.0) } else { (text + 13.0).max(25.0) }
}

/// Half the height of a node.
fn half_height(node: &Node) -> f64 {
    match &node.marginal {
        None => HALF_HEIGHT,
        Some(Marginal::Line(_)) => (NAME + LINE + PADDING) / 2.0,
        Some(Marginal::Bars(bars)) => (NAME + LINE * bars.len() as f64 + PADDING) / 2.0,
    }
}

/// Computes the layout of a graph.
pub(super) fn place(graph: &Graph) -> Layout {
    let layers = layered(graph);
    let mut half_widths: Vec<f64> = graph.nodes.iter().map(half_width).collect();
    half_widths.resize(layers.layer_of.len(), 2.0);
    let mut half_heights: Vec<f64> = graph.nodes.iter().map(half_height).collect();
    half_heights.resize(layers.layer_of.len(), HALF_HEIGHT);
    let x = columns(&layers, &half_widths, &graph.plates);
    // The middle of each layer, and half its height.
    let mut middles: Vec<(f64, f64)> = vec![(0.0, HALF_HEIGHT); layers.layers.len()];
    for (vertex, layer) in layers.layer_of.iter().enumerate() {
        middles[*layer].1 = middles[*layer].1.max(half_heights[vertex]);
    }
    for layer in 1..middles.len() {
        let above = middles[layer - 1];
        middles[layer].0 = above.0 + above.1 + BETWEEN + middles[layer].1;
    }
    let y = |vertex: usize| middles[layers.layer_of[vertex]].0;
    let mut plates: Vec<Rectangle> = vec![EMPTY; graph.plates.len()];
    for (vertex, plate) in layers.plate_of.iter().enumerate() {
        if let Some(plate) = plate {
            let half = half_widths[vertex] + INSIDE;
            plates[*plate].cover((x[vertex], y(vertex)), half, half_heights[vertex]);
        }
    }
    for (plate, label) in plates.iter_mut().zip(&graph.plates) {
        // A label that is wider than the box widens it; the gaps allow for it.
        let missing = label_width(label) - (plate.right - plate.left);
        plate.left -= missing.max(0.0) / 2.0;
        plate.right += missing.max(0.0) / 2.0;
        plate.bottom += LABEL;
    }
    let mut all = EMPTY;
    (0..graph.nodes.len())
        .for_each(|node| all.cover((x[node], y(node)), half_widths[node], half_heights[node]));
    (graph.nodes.len()..x.len()).for_each(|bend| all.cover((x[bend], y(bend)), 2.0, 0.0));
    plates.iter().for_each(|plate| all.join(plate));
    if graph.nodes.is_empty() {
        all = Rectangle { left: 0.0, top: 0.0, right: 60.0, bottom: 20.0 };
    }
    let over = graph.over.as_ref().map(|label| {
        let mut around = Rectangle {
            left: all.left - INSIDE,
            top: all.top - INSIDE,
            right: all.right + INSIDE,
            bottom: all.bottom + INSIDE + LABEL,
        };
        around.right = around.right.max(around.left + label_width(label));
        around
    });
    let whole = over.unwrap_or(all);
    let (dx, dy) = (MARGIN - whole.left, MARGIN - whole.top);
    let moved = |one: Rectangle| Rectangle {
        left: one.left + dx,
        top: one.top + dy,
        right: one.right + dx,
        bottom: one.bottom + dy,
    };
    let point = |vertex: usize| (x[vertex] + dx, y(vertex) + dy);
    let bend = |bend: &usize| (point(*bend).0, point(*bend).1, middles[layers.layer_of[*bend]].1);
    let bends = |route: &Vec<usize>| route[1..route.len() - 1].iter().map(bend).collect();
    Layout {
        centres: (0..graph.nodes.len()).map(point).collect(),
        half_widths: half_widths[..graph.nodes.len()].to_vec(),
        half_heights: half_heights[..graph.nodes.len()].to_vec(),
        bends: layers.routes.iter().map(bends).collect(),
        plates: plates.into_iter().map(moved).collect(),
        over: over.map(moved),
        width: whole.right - whole.left + 2.0 * MARGIN,
        height: whole.bottom - whole.top + 2.0 * MARGIN,
    }
}

impl Layout {
    /// Whether a straight line between two nodes avoids all others, and the boxes of others.
    pub(super) fn is_clear(&self, nodes: &[Node], from: usize, to: usize) -> bool {
        let meets = |node: usize| {
            // In units in which the node with its margin is the unit circle.
            let (a, b) = (self.half_widths[node] + ROOM, self.half_heights[node] + ROOM);
            let relative = |end: usize| {
                let (centre, end) = (self.centres[node], self.centres[end]);
                ((end.0 - centre.0) / a, (end.1 - centre.1) / b)
            };
            let (start, end) = (relative(from), relative(to));
            let (dx, dy) = (end.0 - start.0, end.1 - start.1);
            let part = -(start.0 * dx + start.1 * dy) / (dx * dx + dy * dy).max(1e-9);
            let part = part.clamp(0.0, 1.0);
            (start.0 + part * dx).hypot(start.1 + part * dy) < 1.0
        };
        let (start, end) = (self.centres[from], self.centres[to]);
        // Boxes are much larger than a step.
        let steps = (0..=32).map(|step| f64::from(step) / 32.0);
        let enters = |plate: usize| {
            let around = &self.plates[plate];
            steps.clone().any(|part| {
                let (x, y) = (start.0 + part * (end.0 - start.0), start.1 + part * (end.1 - start.1));
                around.left < x && x < around.right && around.top < y && y < around.bottom
            })
        };
        let foreign = |plate: &usize| [from, to].iter().all(|node| nodes[*node].plate != Some(*plate));
        !(0..self.centres.len()).any(|node| node != from && node != to && meets(node))
            && !(0..self.plates.len()).filter(foreign).any(enters)
    }
}

/// The width that a label takes in a box.
fn label_width(label: &str) -> f64 {
    label.chars().count() as f64 * 6.4 + 16.0
}

const EMPTY: Rectangle = Rectangle {
    left: f64::INFINITY,
    top: f64::INFINITY,
    right: f64::NEG_INFINITY,
    bottom: f64::NEG_INFINITY,
};

impl Rectangle {
    /// Grows until it holds a node.
    fn cover(&mut self, (x, y): (f64, f64), half_width: f64, half_height: f64) {
        let half = if half_width > 2.0 { half_height + 4.0 } else { 0.0 };
        self.join(&Rectangle {
            left: x - half_width,
            top: y - half,
            right: x + half_width,
            bottom: y + half,
        });
    }

    fn join(&mut self, other: &Rectangle) {
        self.left = self.left.min(other.left);
        self.top = self.top.min(other.top);
        self.right = self.right.max(other.right);
        self.bottom = self.bottom.max(other.bottom);
    }
}

/// x of each vertex.
fn columns(layers: &Layers, half_widths: &[f64], plates: &[String]) -> Vec<f64> {
    let apart = differences(layers, half_widths, plates);
    let count = half_widths.len();
    let (mut before, mut after) = (vec![Vec::new(); count], vec![Vec::new(); count]);
    for (left, right, distance) in apart {
        before[right].push((left, distance));
        after[left].push((right, distance));
    }
    // Constraints lead from left to right: in this order, everything left of a vertex comes before it.
    let mut order: Vec<usize> = (0..count).collect();
    let rank = |vertex: &usize| layers.layers[layers.layer_of[*vertex]].iter().position(|v| v == vertex);
    order.sort_by(|one, other| match (layers.is_left(*one, *other), layers.is_left(*other, *one)) {
        (true, _) => std::cmp::Ordering::Less,
        (_, true) => std::cmp::Ordering::Greater,
        _ => rank(one).cmp(&rank(other)).then(one.cmp(other)),
    });
    let mut x = vec![0.0f64; count];
    for vertex in &order {
        x[*vertex] = before[*vertex].iter().map(|(left, far)| x[*left] + far).fold(0.0, f64::max);
    }
    let mut near = vec![Vec::new(); count];
    for pair in layers.routes.iter().flat_map(|route| route.windows(2)) {
        near[pair[0]].push(pair[1]);
        near[pair[1]].push(pair[0]);
    }
    for sweep in 0..SWEEPS {
        let mut move_one = |vertex: usize| {
            let wanted = near[vertex].iter().map(|other| x[*other]).sum::<f64>() / near[vertex].len() as f64;
            let low =
                before[vertex].iter().map(|(left, far)| x[*left] + far).fold(f64::NEG_INFINITY, f64::max);
            let high = after[vertex].iter().map(|(right, far)| x[*right] - far).fold(f64::INFINITY, f64::min);
            if !wanted.is_nan() && low <= high {
                x[vertex] = wanted.clamp(low, high);
            }
        };
        match sweep % 2 {
            0 => order.iter().rev().for_each(|vertex| move_one(*vertex)),
            _ => order.iter().for_each(|vertex| move_one(*vertex)),
        }
    }
    x
}

/// (left, right, distance): constraints on the order and the gaps.
fn differences(layers: &Layers, half_widths: &[f64], plates: &[String]) -> Vec<(usize, usize, f64)> {
    let mut apart = Vec::new();
    for layer in &layers.layers {
        for pair in layer.windows(2) {
            apart.push((pair[0], pair[1], half_widths[pair[0]] + half_widths[pair[1]] + GAP));
        }
    }
    let span = |plate: usize| {
        let own = (layers.layer_of.iter().zip(&layers.plate_of)).filter(|(_, of)| **of == Some(plate));
        let (first, last) = (own.clone().map(|(layer, _)| *layer).min(), own.map(|(layer, _)| *layer).max());
        first.unwrap_or(0)..=last.unwrap_or(0)
    };
    let spans: Vec<_> = (0..plates.len()).map(span).collect();
    for (plate, label) in plates.iter().enumerate() {
        let members: Vec<usize> =
            (0..half_widths.len()).filter(|vertex| layers.plate_of[*vertex] == Some(plate)).collect();
        // The neighbours of the box: vertices in its layers, and whole boxes that reach into them.
        let beside = |vertex: &usize| match layers.plate_of[*vertex] {
            Some(other) if other == plate => false,
            Some(other) => {
                spans[other].start() <= spans[plate].end() && spans[plate].start() <= spans[other].end()
            }
            None => spans[plate].contains(&layers.layer_of[*vertex]),
        };
        for other in (0..half_widths.len()).filter(beside) {
            // Two boxes have two edges between them, and two labels.
            let other_label = layers.plate_of[other].map_or(0.0, |plate| label_width(&plates[plate]));
            let beyond = half_widths[other].max(other_label / 2.0 - INSIDE);
            let edges = if layers.plate_of[other].is_some() { 2.0 } else { 1.0 };
            for member in &members {
                let own = half_widths[*member].max(label_width(label) / 2.0 - INSIDE);
                let distance = beyond + own + GAP + edges * INSIDE;
                match layers.is_left(other, *member) {
                    true => apart.push((other, *member, distance)),
                    false => apart.push((*member, other, distance)),
                }
            }
        }
    }
    apart
}

#[cfg(test)]
mod tests;

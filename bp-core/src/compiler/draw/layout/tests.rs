//! Tests of layouts, by hand and at random: nothing overlaps.
//!
//! In: graphs. Out: none. Invariant: random graphs are seeded.

use super::super::order::{layered, layers_of};
use super::super::{Graph, Marginal, Mark, Node};
use super::*;

fn graph(nodes: usize, edges: &[(usize, usize)], plates: &[&[usize]]) -> Graph {
    let node = |position: usize| Node {
        name: "X".repeat(1 + position % 7),
        index: None,
        previous: position % 5 == 4,
        deterministic: position % 4 == 3,
        mark: Mark::None,
        plate: plates.iter().position(|plate| plate.contains(&position)),
        marginal: (position % 6 == 5)
            .then(|| Marginal::Bars(vec![("a value".to_owned(), 0.5); 1 + position % 4])),
    };
    Graph {
        name: "Test".to_owned(),
        over: None,
        nodes: (0..nodes).map(node).collect(),
        edges: edges.to_vec(),
        plates: plates.iter().map(|_| "i in S".to_owned()).collect(),
    }
}

/// A number below `bound`, from a congruential generator (Knuth's MMIX).
fn random(state: &mut u64, bound: usize) -> usize {
    *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
    (*state >> 33) as usize % bound
}

#[track_caller]
fn well_placed(graph: &Graph) {
    let layout = place(graph);
    let halves = layout.half_widths.iter().zip(&layout.half_heights);
    let boxes: Vec<Rectangle> = (layout.centres.iter().zip(halves))
        .map(|((x, y), (half, half_height))| Rectangle {
            left: x - half,
            top: y - half_height,
            right: x + half,
            bottom: y + half_height,
        })
        .collect();
    let overlap = |one: &Rectangle, other: &Rectangle| {
        one.left < other.right && other.left < one.right && one.top < other.bottom && other.top < one.bottom
    };
    for (at, one) in boxes.iter().enumerate() {
        assert!(!boxes[at + 1..].iter().any(|other| overlap(one, other)), "two nodes overlap");
        assert!(one.left >= 0.0 && one.right <= layout.width && one.bottom <= layout.height);
        for (plate, around) in layout.plates.iter().enumerate() {
            let inside = graph.nodes[at].plate == Some(plate);
            assert_eq!(overlap(one, around), inside, "node {at} and box {plate}");
        }
    }
    for (at, one) in layout.plates.iter().enumerate() {
        assert!(!layout.plates[at + 1..].iter().any(|other| overlap(one, other)), "two boxes overlap");
    }
    for (from, to) in &graph.edges {
        let (above, below) = (boxes[*from].bottom, boxes[*to].top);
        assert!(above < below, "a parent stands above its child");
    }
    assert_eq!(layout.bends.len(), graph.edges.len());
}

#[test]
fn layers_are_longest_paths() {
    // 0 → 1 → 2 → 3, 0 → 3, and 4 → 3: 4 has no parent and is just above its child.
    let graph = graph(5, &[(0, 1), (1, 2), (2, 3), (0, 3), (4, 3)], &[]);
    assert_eq!(layers_of(&graph), [0, 1, 2, 3, 2]);
    // The edge 0 → 3 passes two layers; every piece of an edge leads to the next layer.
    let layers = layered(&graph);
    assert_eq!(layers.routes[3].len(), 4);
    let pieces = layers.routes.iter().flat_map(|route| route.windows(2));
    assert!(pieces.clone().all(|pair| layers.layer_of[pair[1]] == layers.layer_of[pair[0]] + 1));
    assert_eq!(pieces.count(), 1 + 1 + 1 + 3 + 1);
    well_placed(&graph);
}

#[test]
fn edges_that_need_not_cross_do_not() {
    // 0 → 5, 1 → 4, 2 → 3: three crossings as numbered, none as drawn; a square of all edges keeps its one.
    let untangled = layered(&graph(6, &[(0, 5), (1, 4), (2, 3)], &[]));
    assert_eq!(untangled.crossings(), 0);
    let square = layered(&graph(4, &[(0, 2), (0, 3), (1, 2), (1, 3)], &[]));
    assert_eq!(square.crossings(), 1);
}

#[test]
fn boxes_hold_their_own() {
    well_placed(&graph(6, &[(0, 1), (0, 2), (1, 3), (2, 3), (3, 4), (0, 5)], &[&[1, 3], &[5]]));
    well_placed(&graph(0, &[], &[]));
    well_placed(&graph(3, &[], &[]));
}

#[test]
fn random_networks_are_well_placed() {
    let mut state = 2008;
    for _ in 0..150 {
        let nodes = 2 + random(&mut state, 14);
        let mut edges = Vec::new();
        for child in 1..nodes {
            for parent in 0..child {
                if random(&mut state, 4) == 0 {
                    edges.push((parent, child));
                }
            }
        }
        let chosen: Vec<usize> = (0..nodes).map(|_| random(&mut state, 5)).collect();
        let plates: Vec<Vec<usize>> = (0..2)
            .map(|plate| (0..nodes).filter(|node| chosen[*node] == plate).collect::<Vec<_>>())
            .filter(|plate| !plate.is_empty())
            .collect();
        let plates: Vec<&[usize]> = plates.iter().map(Vec::as_slice).collect();
        well_placed(&graph(nodes, &edges, &plates));
    }
}

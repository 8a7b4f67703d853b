//! The map as an octree of OctoMap (Hornung et al. 2013).
//!
//! In: a map. Out: a `.bt` file (occupied, free or unknown) or an `.ot` file (log-odds of occupancy). A voxel has the
//! state of the cell of the map that contains its centre, (k + ½) times the resolution along each axis; one that is
//! unknown in the map is not in the tree. Free voxels are in it: without them OctoMap takes free space for unknown.
//! Invariant: eight children with the same state are one node.

use crate::frame::Spherical;
use crate::map::{Map, OCCUPIED};
use crate::report::{ReportError, write_atomically};
use std::path::Path;

/// The resolution that the commands use, m: about the depth of the innermost cells.
pub const RESOLUTION_M: f64 = 0.1;

/// The number of levels of OctoMap's trees.
const DEPTH: u32 = 16;

/// A cell whose P(O = 1) is within this margin of one half is unknown.
const MARGIN: f32 = OCCUPIED - 0.5;

/// OctoMap's bounds of a probability in a map.
const BOUNDS: [f32; 2] = [0.1192, 0.971];

/// A node.
#[derive(Clone, Debug, PartialEq)]
enum Node {
    Unknown,
    /// Log-odds.
    Leaf(f32),
    Inner(Box<[Node; 8]>),
}

/// A tree.
#[derive(Clone, Debug)]
pub struct Octree {
    root: Node,
    resolution_m: f64,
}

impl Octree {
    /// The octree of a map.
    pub fn of(map: &Map, resolution_m: f64) -> Self {
        let builder = Builder { map, resolution_m, reach_m: map.grid().configuration().rho_max_m };
        // The tree's middle is the head; the corner of lowest coordinates is 2¹⁵ voxels away along each axis.
        let lowest = -(1i64 << (DEPTH - 1));
        Self { root: builder.node([lowest; 3], DEPTH), resolution_m }
    }

    /// The number of nodes, with inner ones.
    pub fn nodes(&self) -> usize {
        count(&self.root)
    }

    /// Writes the states: free, occupied, or unknown.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn write_bt(&self, path: &Path) -> Result<(), ReportError> {
        let states = self.root.of_states();
        let mut bytes = self.header("Octomap OcTree binary file", count(&states));
        write_states(&states, &mut bytes);
        write_atomically(path, &bytes)
    }

    /// Writes the log-odds of occupancy.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn write_ot(&self, path: &Path) -> Result<(), ReportError> {
        let mut bytes = self.header("Octomap OcTree file", self.nodes());
        write_log_odds(&self.root, &mut bytes);
        write_atomically(path, &bytes)
    }

    fn header(&self, first: &str, nodes: usize) -> Vec<u8> {
        // The readers need the first line as it is.
        format!(
            "# {first}\n# {}\nid OcTree\nsize {nodes}\nres {}\ndata\n",
            crate::frame::DESCRIPTION,
            self.resolution_m
        )
        .into_bytes()
    }
}

struct Builder<'a> {
    map: &'a Map,
    resolution_m: f64,
    reach_m: f64,
}

impl Builder<'_> {
    /// The node with its lowest voxel at `from`, 2^levels voxels wide.
    fn node(&self, from: [i64; 3], levels: u32) -> Node {
        if levels == 0 {
            return self.voxel(from);
        }
        let side = 1i64 << levels;
        // The nearest point of the cube to the head; the middle of the tree is 0.
        let nearest = from.map(|low| (low.max(-low - side).max(0)) as f64 * self.resolution_m);
        if nearest.iter().map(|part| part * part).sum::<f64>() > self.reach_m * self.reach_m {
            return Node::Unknown;
        }
        let half = side / 2;
        let child = |index: i64| {
            let corner = [0, 1, 2].map(|axis| from[axis] + half * ((index >> axis) & 1));
            self.node(corner, levels - 1)
        };
        Node::joined([0, 1, 2, 3, 4, 5, 6, 7].map(child))
    }

    fn voxel(&self, key: [i64; 3]) -> Node {
        let centre = key.map(|k| (k as f64 + 0.5) * self.resolution_m);
        let Spherical { rho_m, azimuth, elevation } = Spherical::from_cartesian(centre);
        let grid = self.map.grid();
        let cell = grid.rho_of(rho_m).zip(grid.direction_of(azimuth, elevation));
        let Some((rho, direction)) = cell else { return Node::Unknown };
        match self.map.occupancy()[grid.index(direction.at(rho))] {
            p if (p - 0.5).abs() < MARGIN => Node::Unknown,
            p => {
                let p = p.clamp(BOUNDS[0], BOUNDS[1]);
                Node::Leaf((p / (1.0 - p)).ln())
            }
        }
    }
}

impl Node {
    /// The node with these children: one leaf if they are equal leaves, unknown if they are all unknown.
    fn joined(children: [Node; 8]) -> Node {
        match &children[0] {
            Node::Inner(_) => Node::Inner(Box::new(children)),
            first if children.iter().all(|child| child == first) => first.clone(),
            _ => Node::Inner(Box::new(children)),
        }
    }

    /// The same with two states only.
    fn of_states(&self) -> Node {
        match self {
            Node::Unknown => Node::Unknown,
            Node::Leaf(odds) => Node::Leaf(if *odds > 0.0 { 1.0 } else { -1.0 }),
            Node::Inner(children) => Node::joined(std::array::from_fn(|at| children[at].of_states())),
        }
    }

    /// The largest log-odds of its leaves, which is OctoMap's value of an inner node.
    fn most(&self) -> f32 {
        match self {
            Node::Unknown => f32::NEG_INFINITY,
            Node::Leaf(odds) => *odds,
            Node::Inner(children) => children.iter().map(Node::most).fold(f32::NEG_INFINITY, f32::max),
        }
    }
}

fn count(node: &Node) -> usize {
    match node {
        Node::Unknown => 0,
        Node::Leaf(_) => 1,
        Node::Inner(children) => 1 + children.iter().map(count).sum::<usize>(),
    }
}

/// Two bits for each child, the first child in the lowest: 0 unknown, 1 free, 2 occupied, 3 with children; then the
/// children that have children.
fn write_states(node: &Node, bytes: &mut Vec<u8>) {
    let Node::Inner(children) = node else {
        // A tree of one state, or none, has a root without children.
        return bytes.extend([0, 0]);
    };
    let code = |child: &Node| match child {
        Node::Unknown => 0u16,
        Node::Leaf(odds) => {
            if *odds > 0.0 {
                2
            } else {
                1
            }
        }
        Node::Inner(_) => 3,
    };
    let codes = children.iter().enumerate().fold(0, |codes, (at, child)| codes | code(child) << (2 * at));
    bytes.extend(codes.to_le_bytes());
    children
        .iter()
        .filter(|child| matches!(child, Node::Inner(_)))
        .for_each(|child| write_states(child, bytes));
}

/// The log-odds of a node and one bit for each child that exists; then the children.
fn write_log_odds(node: &Node, bytes: &mut Vec<u8>) {
    if let Node::Unknown = node {
        return;
    }
    bytes.extend(node.most().to_le_bytes());
    let Node::Inner(children) = node else { return bytes.push(0) };
    let exists = |child: &Node| u8::from(*child != Node::Unknown);
    bytes.push(children.iter().enumerate().fold(0, |bits, (at, child)| bits | exists(child) << at));
    children.iter().for_each(|child| write_log_odds(child, bytes));
}

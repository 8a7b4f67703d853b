//! A network as a `picture` of LaTeX, which needs no package.
//!
//! In: a graph. Out: a `picture` environment. Invariant: it is as large as its layout, one unit to a pixel; names are
//! escaped; curves are quadratic Bézier curves, which every LaTeX draws.

use super::layout::{Layout, place};
use super::{Graph, Node};
use crate::latex;
use std::fmt::Write;

/// Points in a dashed outline.
const DASHES: usize = 9;

impl Graph {
    /// Width and height of the picture, in its units.
    pub fn picture_size(&self) -> (f64, f64) {
        let layout = place(self);
        (layout.width.ceil(), layout.height.ceil())
    }

    /// The network as a `picture` environment, whose unit is `\unitlength`.
    pub fn picture(&self) -> String {
        let layout = place(self);
        let (width, height) = (layout.width.ceil(), layout.height.ceil());
        let mut drawn = Drawn { height, text: format!("\\begin{{picture}}({width},{height})\n") };
        let boxes = layout.plates.iter().zip(&self.plates).chain(layout.over.iter().zip(&self.over));
        for (around, label) in boxes {
            drawn.rectangle((around.left, around.top), (around.right, around.bottom));
            let label = format!("\\scriptsize {}", latex::escaped(label));
            drawn.put((around.right - 6.0, around.bottom - 6.0), &format!("\\makebox(0,0)[br]{{{label}}}"));
        }
        for (position, (from, to)) in self.edges.iter().enumerate() {
            let bends =
                if layout.is_clear(&self.nodes, *from, *to) { &[][..] } else { &layout.bends[position] };
            let bends: Vec<(f64, f64)> = bends.iter().map(|(x, y, _)| (*x, *y)).collect();
            self.arrow(&mut drawn, &layout, *from, *to, &bends);
        }
        for (position, node) in self.nodes.iter().enumerate() {
            drawn.node(
                node,
                layout.centres[position],
                (layout.half_widths[position], layout.half_heights[position]),
            );
        }
        drawn.text.push_str("\\end{picture}");
        drawn.text
    }

    fn arrow(&self, drawn: &mut Drawn, layout: &Layout, from: usize, to: usize, bends: &[(f64, f64)]) {
        let border = |node: usize, towards: (f64, f64)| {
            let centre = layout.centres[node];
            let (dx, dy) = (towards.0 - centre.0, towards.1 - centre.1);
            let (x, y) = (dx / layout.half_widths[node], dy / layout.half_heights[node]);
            let distance = match self.nodes[node].deterministic {
                true => x.abs() + y.abs(),
                false => x.hypot(y),
            };
            let part = 1.0 / distance.max(1e-9);
            (centre.0 + dx * part, centre.1 + dy * part)
        };
        let mut points = vec![border(from, bends.first().copied().unwrap_or(layout.centres[to]))];
        points.extend_from_slice(bends);
        points.push(border(to, bends.last().copied().unwrap_or(layout.centres[from])));
        points.windows(2).for_each(|pair| drawn.line(pair[0], pair[1], None));
        let (before, tip) = (points[points.len() - 2], points[points.len() - 1]);
        let length = (tip.0 - before.0).hypot(tip.1 - before.1).max(1e-9);
        let (ux, uy) = ((tip.0 - before.0) / length, (tip.1 - before.1) / length);
        for side in [-3.0, -1.5, 0.0, 1.5, 3.0] {
            drawn.line(tip, (tip.0 - 9.0 * ux - side * uy, tip.1 - 9.0 * uy + side * ux), None);
        }
    }
}

struct Drawn {
    height: f64,
    text: String,
}

impl Drawn {
    /// A point of the layout, whose y runs downwards.
    fn at(&self, (x, y): (f64, f64)) -> String {
        format!("({x:.1},{:.1})", self.height - y)
    }

    fn put(&mut self, at: (f64, f64), what: &str) {
        // Writing to a string cannot fail.
        let _ = writeln!(self.text, "\\put{}{{{what}}}", self.at(at));
    }

    fn curve(&mut self, from: (f64, f64), over: (f64, f64), to: (f64, f64), points: Option<usize>) {
        let points = points.map_or_else(String::new, |points| format!("[{points}]"));
        let _ = writeln!(self.text, "\\qbezier{points}{}{}{}", self.at(from), self.at(over), self.at(to));
    }

    fn line(&mut self, from: (f64, f64), to: (f64, f64), points: Option<usize>) {
        self.curve(from, ((from.0 + to.0) / 2.0, (from.1 + to.1) / 2.0), to, points);
    }

    fn rectangle(&mut self, (left, top): (f64, f64), (right, bottom): (f64, f64)) {
        let corners = [(left, top), (right, top), (right, bottom), (left, bottom), (left, top)];
        corners.windows(2).for_each(|pair| self.line(pair[0], pair[1], None));
    }

    fn node(&mut self, node: &Node, (x, y): (f64, f64), (a, b): (f64, f64)) {
        let points = node.previous.then_some(DASHES);
        match node.deterministic {
            true => {
                let corners = [(x - a, y), (x, y - b), (x + a, y), (x, y + b), (x - a, y)];
                corners.windows(2).for_each(|pair| self.line(pair[0], pair[1], points));
            }
            false => {
                // Eight arcs: the tangents of neighbouring points meet at the control point.
                let step = std::f64::consts::FRAC_PI_4;
                let on = |angle: f64, grow: f64| (x + a * grow * angle.cos(), y + b * grow * angle.sin());
                for arc in 0..8 {
                    let angle = f64::from(arc) * step;
                    let middle = on(angle + step / 2.0, 1.0 / (step / 2.0).cos());
                    self.curve(
                        on(angle, 1.0),
                        middle,
                        on(angle + step, 1.0),
                        points.map(|points| points / 2),
                    );
                }
            }
        }
        let name = latex::name(&node.name);
        let previous = if node.previous { "^{-1}" } else { "" };
        let index =
            node.index.as_ref().map_or_else(String::new, |index| format!("_{{{}}}", latex::name(index)));
        let name = if name.contains("_{") { format!("{{{name}}}") } else { name };
        self.put((x, y), &format!("\\makebox(0,0){{${name}{previous}{index}$}}"));
    }
}

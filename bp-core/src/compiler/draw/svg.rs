//! A network as SVG.
//!
//! In: a graph. Out: one self-contained `svg` element that can be embedded in an HTML page. Invariant: it is
//! well-formed XML; names are text, never markup; each edge is one path with one arrowhead.

use super::layout::{BAR, LINE, Layout, NAME, NUMBER, PADDING, Rectangle, place};
use super::{Graph, Marginal, Mark, Node};
use crate::xml::escaped;
use std::fmt::Write;

const INK: &str = "#222222";
const SHADE: &str = "#d5dce4";
const TONE: &str = "#4c78a8";
const FONT: &str = "STIX Two Text, Latin Modern Roman, Cambria, Georgia, Times New Roman, serif";

impl Graph {
    /// The network, drawn.
    pub fn svg(&self) -> String {
        let layout = place(self);
        let mut svg = String::new();
        let (width, height) = (layout.width.ceil(), layout.height.ceil());
        // Writing to a string cannot fail.
        let _ = writeln!(
            svg,
            "<svg xmlns=\"http://www.w3.org/2000/svg\" role=\"img\" width=\"{width}\" height=\"{height}\" \
             viewBox=\"0 0 {width} {height}\" font-family=\"{FONT}\" font-size=\"15\" fill=\"{INK}\">"
        );
        let _ = writeln!(svg, "<title>{}</title>", escaped(&format!("The network of {}", self.name)));
        if let (Some(over), Some(label)) = (&layout.over, &self.over) {
            plate(&mut svg, over, label);
        }
        layout.plates.iter().zip(&self.plates).for_each(|(around, label)| plate(&mut svg, around, label));
        for (position, (from, to)) in self.edges.iter().enumerate() {
            let bends =
                if layout.is_clear(&self.nodes, *from, *to) { &[][..] } else { &layout.bends[position] };
            self.edge(&mut svg, &layout, *from, *to, bends);
        }
        for (position, one) in self.nodes.iter().enumerate() {
            let half = (layout.half_widths[position], layout.half_heights[position]);
            match &one.marginal {
                None => node(&mut svg, one, layout.centres[position], half),
                Some(marginal) => distribution(&mut svg, one, marginal, layout.centres[position], half),
            }
        }
        svg.push_str("</svg>\n");
        svg
    }

    fn edge(&self, svg: &mut String, layout: &Layout, from: usize, to: usize, bends: &[(f64, f64, f64)]) {
        let border = |node: usize, towards: (f64, f64)| {
            let searched = self.nodes[node].mark == Mark::Searched;
            let (grow, centre) = (if searched { 3.0 } else { 0.0 }, layout.centres[node]);
            let (a, b) = (layout.half_widths[node] + grow, layout.half_heights[node] + grow);
            let (dx, dy) = (towards.0 - centre.0, towards.1 - centre.1);
            let distance = match (&self.nodes[node].marginal, self.nodes[node].deterministic) {
                (Some(_), _) => (dx.abs() / a).max(dy.abs() / b),
                (None, true) => dx.abs() / a + dy.abs() / b,
                (None, false) => ((dx / a).powi(2) + (dy / b).powi(2)).sqrt(),
            };
            let part = 1.0 / distance.max(1e-9);
            (centre.0 + dx * part, centre.1 + dy * part)
        };
        // An edge passes through a layer vertically, over the height of the nodes.
        let above = |bend: &(f64, f64, f64)| (bend.0, bend.1 - bend.2);
        let below = |bend: &(f64, f64, f64)| (bend.0, bend.1 + bend.2);
        let start = border(from, bends.first().map_or(layout.centres[to], above));
        let before = bends.last().map_or(start, below);
        let tip = border(to, bends.last().map_or(layout.centres[from], below));
        let length = ((tip.0 - before.0).powi(2) + (tip.1 - before.1).powi(2)).sqrt().max(1e-9);
        let (ux, uy) = ((tip.0 - before.0) / length, (tip.1 - before.1) / length);
        let end = (tip.0 - 8.0 * ux, tip.1 - 8.0 * uy);
        let mut path = format!("M{:.1} {:.1}", start.0, start.1);
        let mut at = start;
        for (position, bend) in bends.iter().enumerate() {
            let (high, low) = (above(bend), below(bend));
            let reach = 0.45 * (high.1 - at.1);
            // The first piece leaves straight for the bend, the others upright.
            let leave = if position == 0 {
                (at.0 + 0.4 * (high.0 - at.0), at.1 + reach)
            } else {
                (at.0, at.1 + reach)
            };
            let _ = write!(
                path,
                " C{:.1} {:.1} {:.1} {:.1} {:.1} {:.1} L{:.1} {:.1}",
                leave.0,
                leave.1,
                high.0,
                high.1 - reach,
                high.0,
                high.1,
                low.0,
                low.1
            );
            at = low;
        }
        match bends.is_empty() {
            true => {
                let _ = write!(path, " L{:.1} {:.1}", end.0, end.1);
            }
            false => {
                let reach = 0.45 * (end.1 - at.1);
                let (x, y) = (end.0 - reach * ux / uy.max(0.2), end.1 - reach);
                let _ =
                    write!(path, " C{:.1} {:.1} {x:.1} {y:.1} {:.1} {:.1}", at.0, at.1 + reach, end.0, end.1);
            }
        }
        let _ = writeln!(
            svg,
            "<path d=\"{path}\" fill=\"none\" stroke=\"{INK}\" stroke-width=\"1.2\"/>\
             <polygon points=\"{:.1},{:.1} {:.1},{:.1} {:.1},{:.1}\"/>",
            tip.0,
            tip.1,
            tip.0 - 10.0 * ux - 3.6 * uy,
            tip.1 - 10.0 * uy + 3.6 * ux,
            tip.0 - 10.0 * ux + 3.6 * uy,
            tip.1 - 10.0 * uy - 3.6 * ux,
        );
    }
}

/// A rounded box with its label at the lower right.
fn plate(svg: &mut String, around: &Rectangle, label: &str) {
    let Rectangle { left, top, right, bottom } = around;
    let _ = writeln!(
        svg,
        "<rect x=\"{left:.1}\" y=\"{top:.1}\" width=\"{:.1}\" height=\"{:.1}\" rx=\"9\" fill=\"none\" \
         stroke=\"#8a94a0\"/><text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\" font-size=\"12\" \
         fill=\"#5c6670\">{}</text>",
        right - left,
        bottom - top,
        right - 8.0,
        bottom - 6.0,
        escaped(label)
    );
}

fn node(svg: &mut String, node: &Node, (x, y): (f64, f64), (half_width, half_height): (f64, f64)) {
    let fill = if node.mark == Mark::Known { SHADE } else { "#ffffff" };
    let dash = if node.previous { " stroke-dasharray=\"4 3\"" } else { "" };
    let mut outline = |grow: f64, fill: &str| {
        let (a, b) = (half_width + grow, half_height + grow);
        let style = format!("fill=\"{fill}\" stroke=\"{INK}\" stroke-width=\"1.2\"{dash}");
        let _ = match node.deterministic {
            true => {
                let (left, right, top, bottom) = (x - a, x + a, y - b, y + b);
                write!(
                    svg,
                    "<path class=\"node\" d=\"M{left:.1} {y:.1} L{x:.1} {top:.1} L{right:.1} {y:.1} \
                     L{x:.1} {bottom:.1} Z\" {style}/>"
                )
            }
            false => write!(
                svg,
                "<ellipse class=\"node\" cx=\"{x:.1}\" cy=\"{y:.1}\" rx=\"{a:.1}\" ry=\"{b:.1}\" {style}/>"
            ),
        };
    };
    if node.mark == Mark::Searched {
        outline(3.0, "#ffffff");
    }
    outline(0.0, fill);
    name(svg, node, (x, y + 5.0));
}

/// The name of a node, centred.
fn name(svg: &mut String, node: &Node, (x, y): (f64, f64)) {
    let small =
        |shift: &str, text: &str| format!("<tspan dy=\"{shift}\" font-size=\"11\">{}</tspan>", escaped(text));
    let previous = if node.previous { small("-6", "−1") } else { String::new() };
    // Below the line, for any superscript.
    let shift = if node.previous { "10" } else { "4" };
    let index = node.index.as_ref().map_or_else(String::new, |index| small(shift, index));
    let _ = writeln!(
        svg,
        "<text x=\"{x:.1}\" y=\"{:.1}\" text-anchor=\"middle\" font-style=\"italic\">{}{previous}{index}</text>",
        y,
        escaped(&node.name)
    );
}

/// A node with its distribution inside: the name, then a bar for each value, or a line.
fn distribution(
    svg: &mut String,
    node: &Node,
    marginal: &Marginal,
    (x, y): (f64, f64),
    (half_width, half_height): (f64, f64),
) {
    let (left, top) = (x - half_width, y - half_height);
    let fill = if node.mark == Mark::Known { SHADE } else { "#ffffff" };
    let dash = if node.previous { " stroke-dasharray=\"4 3\"" } else { "" };
    let mut outline = |grow: f64| {
        let _ = write!(
            svg,
            "<rect class=\"node\" x=\"{:.1}\" y=\"{:.1}\" width=\"{:.1}\" height=\"{:.1}\" rx=\"6\" fill=\"{fill}\" \
             stroke=\"{INK}\" stroke-width=\"1.2\"{dash}/>",
            left - grow,
            top - grow,
            2.0 * (half_width + grow),
            2.0 * (half_height + grow)
        );
    };
    if node.mark == Mark::Searched {
        outline(3.0);
    }
    outline(0.0);
    name(svg, node, (x, top + 18.0));
    let text = |svg: &mut String, x: f64, y: f64, anchor: &str, text: &str| {
        let _ = writeln!(
            svg,
            "<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\" font-size=\"12\">{}</text>",
            escaped(text)
        );
    };
    let bars = match marginal {
        Marginal::Line(line) => return text(svg, x, top + NAME + 11.0, "middle", line),
        Marginal::Bars(bars) => bars,
    };
    let right = x + half_width - PADDING;
    for (line, (value, p)) in bars.iter().enumerate() {
        let base = top + NAME + LINE * line as f64;
        let begin = right - NUMBER - BAR;
        text(svg, begin - 5.0, base + 11.0, "end", value);
        let _ = write!(
            svg,
            "<rect x=\"{begin:.1}\" y=\"{:.1}\" width=\"{BAR}\" height=\"10\" fill=\"#eef1f4\"/>\
             <rect class=\"bar\" x=\"{begin:.1}\" y=\"{:.1}\" width=\"{:.2}\" height=\"10\" fill=\"{TONE}\"/>",
            base + 2.0,
            base + 2.0,
            BAR * p.clamp(0.0, 1.0)
        );
        text(svg, right, base + 11.0, "end", &format!("{:.1}%", 100.0 * p));
    }
}

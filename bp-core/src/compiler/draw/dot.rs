//! A network for Graphviz.
//!
//! In: a graph. Out: text in the DOT language. Invariant: names are quoted.

use super::{Graph, Mark, Node};
use std::fmt::Write;

impl Graph {
    /// The network in DOT.
    pub fn dot(&self) -> String {
        let mut dot = format!("digraph {} {{\n", quoted(&self.name));
        // Writing to a string cannot fail.
        let _ = writeln!(dot, "  node [shape=ellipse, style=filled, fillcolor=white];");
        let mut indent = 1;
        if let Some(over) = &self.over {
            let _ = writeln!(dot, "  subgraph cluster_program {{\n    label={};", quoted(over));
            indent = 2;
        }
        let blanks = "  ".repeat(indent);
        for (position, node) in self.nodes.iter().enumerate().filter(|(_, node)| node.plate.is_none()) {
            let _ = writeln!(dot, "{blanks}{}", described(position, node));
        }
        for (plate, label) in self.plates.iter().enumerate() {
            let _ = writeln!(dot, "{blanks}subgraph cluster_{plate} {{\n{blanks}  label={};", quoted(label));
            let own = self.nodes.iter().enumerate().filter(|(_, node)| node.plate == Some(plate));
            for (position, node) in own {
                let _ = writeln!(dot, "{blanks}  {}", described(position, node));
            }
            let _ = writeln!(dot, "{blanks}}}");
        }
        if self.over.is_some() {
            dot.push_str("  }\n");
        }
        for (from, to) in &self.edges {
            let _ = writeln!(dot, "  n{from} -> n{to};");
        }
        dot.push_str("}\n");
        dot
    }
}

fn described(position: usize, node: &Node) -> String {
    let index = node.index.as_ref().map_or_else(String::new, |index| format!("[{index}]"));
    let name = format!("{}{}{index}", node.name, if node.previous { "^-1" } else { "" });
    let mut described = format!("n{position} [label={}", quoted(&name));
    if node.deterministic {
        described.push_str(", shape=diamond");
    }
    if node.previous {
        described.push_str(", style=\"filled,dashed\"");
    }
    match node.mark {
        Mark::None => {}
        Mark::Known => described.push_str(", fillcolor=lightgrey"),
        Mark::Searched => described.push_str(", peripheries=2"),
    }
    described + "];"
}

fn quoted(text: &str) -> String {
    format!("\"{}\"", text.replace('\\', "\\\\").replace('"', "\\\"").replace('\n', " "))
}

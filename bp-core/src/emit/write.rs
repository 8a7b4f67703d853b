//! Fused nests as text: one loop over lanes, its arrays as arguments of a function of its own.
//!
//! In: an item of nests that share a loop. Out: its text. Invariant: `u`, `t`, `r` and `x` mean what they mean in
//! [`super::nest`], with the values of the axes that are written out after them; `v` is one lane of what is made,
//! `w` where it is kept. Arguments do not overlap, and the compiler knows it: so the loop becomes SIMD.

use super::fused::{Fused, choices, values, written_out};
use super::names::local;
use super::nest::Nests;
use super::text::Text;
use crate::ids::{AxisId, BufferId, Id, ValueId};
use crate::kernel::{Fold, Node};
use std::collections::{BTreeSet, HashMap};

type Choice = HashMap<AxisId, usize>;

/// The text of one item, in parts.
#[derive(Default)]
struct Parts {
    outside: Vec<String>,
    inside: Vec<String>,
    lanes: Vec<String>,
    named: BTreeSet<String>,
    /// Name and type.
    arguments: Vec<(String, &'static str)>,
    /// For each buffer that is kept: the suffix and the plane of each copy.
    kept: Vec<(BufferId, Vec<(String, String)>)>,
}

impl Parts {
    fn argument(&mut self, name: String, kind: &'static str) {
        if !self.arguments.iter().any(|(known, _)| *known == name) {
            self.arguments.push((name, kind));
        }
    }
}

impl Nests<'_> {
    /// Writes an item; gives the names of the copies of lanes that it may need.
    pub(super) fn fused(&mut self, fused: &Fused<'_>, shared: &[BufferId], text: &mut Text) {
        let mut parts = Parts::default();
        for loops in &fused.nests {
            let short = written_out(self.kernel, loops);
            let nest = &self.kernel.nests[loops.nest];
            let stored = self.is_stored(fused, nest.out, shared);
            let needed = values(self.kernel, loops);
            needed.iter().for_each(|value| self.depth[value.position()] = 0);
            let mut made: Vec<String> = Vec::new();
            for choice in choices(self.kernel, &short) {
                needed.iter().for_each(|value| self.put(fused, *value, &choice, &mut parts));
                let root = self.lane_text(&self.operand(nest.value, 0), &choice, &mut parts);
                let suffix = self.suffix(self.kernel.buffers[nest.out].axes.iter().copied(), &choice);
                let name = format!("{}{suffix}", local("v", nest.out));
                match (nest.reduce.fold(), made.contains(&suffix)) {
                    (Some(fold), true) => {
                        parts.lanes.push(format!("let {name}: T = {};", folded(fold, &name, &root)))
                    }
                    _ => {
                        parts.lanes.push(format!("let {name}: T = {root};"));
                        if stored {
                            self.keep(nest.out, &suffix, &choice, &mut parts);
                        }
                        made.push(suffix);
                    }
                }
            }
            if !stored {
                continue;
            }
            let over = fused.axis.filter(|axis| loops.inner.contains(axis));
            for suffix in made {
                let (name, place) = (local("v", nest.out), local("w", nest.out));
                let value = match (over, nest.reduce.fold()) {
                    (Some(_), Some(fold)) => {
                        folded(fold, &format!("{place}{suffix}[l]"), &format!("{name}{suffix}"))
                    }
                    _ => format!("{name}{suffix}"),
                };
                parts.lanes.push(format!("{place}{suffix}[l] = {value};"));
            }
        }
        self.places(fused, shared, &mut parts);
        self.finish(fused, &parts, text);
    }

    /// The values of axes that are written out, of those among `axes`.
    fn suffix(&self, axes: impl Iterator<Item = AxisId>, choice: &Choice) -> String {
        let chosen: BTreeSet<AxisId> = axes.filter(|axis| choice.contains_key(axis)).collect();
        chosen.iter().map(|axis| format!("_{}", choice[axis])).collect()
    }

    fn value_suffix(&self, value: usize, choice: &Choice) -> String {
        let value = self.kernel.nodes.ids().nth(value).expect("internal: a name of a value");
        self.suffix(self.axes_of(value).into_iter(), choice)
    }

    /// Puts one value where it is computed.
    fn put(&self, fused: &Fused<'_>, value: ValueId, choice: &Choice, parts: &mut Parts) {
        let id = value.position();
        let suffix = self.value_suffix(id, choice);
        if !parts.named.insert(format!("{id}{suffix}")) {
            return;
        }
        let inside = fused.axis.is_some_and(|axis| self.axes_of(value).contains(&axis));
        let mut lines: Vec<String> = Vec::new();
        if !self.varies(value) {
            lines.push(format!("let u{id}: f64 = {};", self.uniform(value)));
            lines.push(format!("let t{id}: T = T::from_f64(u{id});"));
        } else if let (Node::Load { buffer, .. }, true) = (&self.kernel.nodes[value], self.is_fetched(value))
        {
            if fused.nests.iter().any(|nest| self.kernel.nests[nest.nest].out == *buffer) {
                let axes = self.kernel.buffers[*buffer].axes.iter().copied();
                let made = format!("{}{}", local("v", *buffer), self.suffix(axes, choice));
                parts.lanes.push(format!("let x{id}{suffix}: T = {made};"));
                return;
            }
            let mut fetched = Text::default();
            self.fetch(value, &mut fetched);
            lines.push(format!("let mut b{id} = [T::ZERO; LANES];"));
            lines.extend(fetched.finish().lines().map(str::to_owned));
            parts.argument(format!("r{id}{suffix}"), "&[T]");
            parts.lanes.push(format!("let x{id}{suffix}: T = r{id}{suffix}[l];"));
        } else {
            let line = format!("let x{id}: T = {};", self.lane(value, 0));
            let line = self.lane_text(&line, choice, parts);
            parts.lanes.push(line);
            return;
        }
        let lines = lines.iter().map(|line| self.instance(line, choice, |_| {}));
        if inside { parts.inside.extend(lines) } else { parts.outside.extend(lines) }
    }

    fn lane_text(&self, text: &str, choice: &Choice, parts: &mut Parts) -> String {
        let text = self.instance(text, choice, |name| {
            if name.starts_with('t') {
                parts.argument(name.to_owned(), "T");
            }
        });
        // Lanes that were fetched have been read already.
        let mut read = String::new();
        let mut rest = text.as_str();
        while let Some(end) = rest.find("[l]") {
            let start =
                rest[..end].rfind(|c: char| !(c.is_alphanumeric() || c == '_')).map_or(0, |at| at + 1);
            read.push_str(&rest[..start]);
            read.push_str(&format!("x{}", &rest[start + 1..end]));
            rest = &rest[end + 3..];
        }
        read + rest
    }

    /// Text with the names of values and axes made those of one copy.
    fn instance(&self, text: &str, choice: &Choice, mut name: impl FnMut(&str)) -> String {
        let mut out = String::new();
        let mut rest = text;
        while !rest.is_empty() {
            let is_word = |c: char| c.is_alphanumeric() || c == '_';
            let end = rest.find(|c| !is_word(c)).unwrap_or(rest.len());
            if end == 0 {
                let first = rest.chars().next().map_or(1, char::len_utf8);
                out.push_str(&rest[..first]);
                rest = &rest[first..];
                continue;
            }
            let word = &rest[..end];
            rest = &rest[end..];
            let kind = word.trim_end_matches(|c: char| c.is_ascii_digit());
            let number: Option<usize> = word[kind.len()..].parse().ok();
            match (kind, number) {
                ("u" | "t" | "r" | "x" | "b" | "from" | "inside", Some(number)) => {
                    let word = format!("{word}{}", self.value_suffix(number, choice));
                    name(&word);
                    out.push_str(&word);
                }
                ("i", Some(number)) => match choice.iter().find(|(axis, _)| axis.position() == number) {
                    Some((_, value)) => out.push_str(&format!("{value}usize")),
                    None => out.push_str(word),
                },
                _ => out.push_str(word),
            }
        }
        out
    }

    fn keep(&self, out: BufferId, suffix: &str, choice: &Choice, parts: &mut Parts) {
        let plane = self.instance(&self.plane(out), choice, |_| {});
        let kept = (suffix.to_owned(), plane);
        match parts.kept.iter_mut().find(|(known, _)| *known == out) {
            Some((_, copies)) => copies.push(kept),
            None => parts.kept.push((out, vec![kept])),
        }
        parts.argument(format!("{}{suffix}", local("w", out)), "&mut [T]");
    }

    /// Where the buffers that are kept are made.
    fn places(&self, fused: &Fused<'_>, shared: &[BufferId], parts: &mut Parts) {
        for (out, copies) in &parts.kept {
            let names: Vec<String> =
                copies.iter().map(|(suffix, _)| format!("{}{suffix}", local("w", *out))).collect();
            let planes: Vec<&str> = copies.iter().map(|(_, plane)| plane.as_str()).collect();
            let is_shared = shared.contains(out);
            let source = match is_shared {
                true => local("y", *out),
                false => format!("{}.as_chunks_mut::<LANES>().0", local("m", *out)),
            };
            let mut lines = vec![format!(
                "let [{}] = {source}.get_disjoint_mut([{}]).expect(\"internal: cells apart\");",
                names.join(", "),
                planes.join(", ")
            )];
            let range = if is_shared { "place..place + width" } else { "..width" };
            lines.extend(names.iter().map(|name| format!("let {name}: &mut [T] = &mut {name}[{range}];")));
            let maker = fused.nests.iter().find(|nest| self.kernel.nests[nest.nest].out == *out);
            let maker = maker.expect("internal: it is made here");
            if fused.axis.is_some_and(|axis| maker.outer.contains(&axis)) {
                parts.inside.extend(lines);
                continue;
            }
            if let (Some(fold), true) = (self.kernel.nests[maker.nest].reduce.fold(), fused.axis.is_some()) {
                let start = super::value::constant(fold.start());
                lines.extend(names.iter().map(|name| format!("{name}.fill(T::from_f64({start}));")));
            }
            parts.outside.extend(lines);
        }
    }

    fn finish(&self, fused: &Fused<'_>, parts: &Parts, text: &mut Text) {
        parts.outside.iter().for_each(|line| text.line(line));
        if let Some(axis) = fused.axis {
            text.open(format!("for {} in 0..{}", local("i", axis), local("e", axis)));
        }
        parts.inside.iter().for_each(|line| text.line(line));
        let typed: Vec<String> =
            parts.arguments.iter().map(|(name, kind)| format!("{name}: {kind}")).collect();
        text.line("#[inline(always)]");
        text.open(format!("fn lanes<T: Scalar>(start: usize, width: usize, {})", typed.join(", ")));
        for (name, kind) in &parts.arguments {
            match *kind {
                "&[T]" => text.line(format!("let {name} = &{name}[..width];")),
                "&mut [T]" => text.line(format!("let {name} = &mut {name}[..width];")),
                _ => {}
            }
        }
        text.open("for l in 0..width");
        parts.lanes.iter().for_each(|line| text.line(line));
        text.close();
        text.close();
        let names: Vec<&str> = parts.arguments.iter().map(|(name, _)| name.as_str()).collect();
        text.line(format!("lanes(start, width, {});", names.join(", ")));
        if fused.axis.is_some() {
            text.close();
        }
    }
}

fn folded(fold: Fold, folded: &str, value: &str) -> String {
    match fold {
        Fold::Sum => format!("{folded} + {value}"),
        Fold::Product => format!("{folded} * {value}"),
        Fold::Maximum => format!("Scalar::maximum({folded}, {value})"),
    }
}

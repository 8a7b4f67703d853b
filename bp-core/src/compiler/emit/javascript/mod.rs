//! Kernels as JavaScript: an ES module with a function for each kernel, in f64.
//!
//! In: [`Kernel`]s whose sizes are known. Out: a [`Javascript`]. Invariant: a function computes what the interpreter
//! computes, up to the rounding of `exp`, `log` and the functions of `web/functions.js`; it allocates its arrays once, and
//! computes again only the nests that depend on an input that has changed.
//! Language: Ecma International, *ECMAScript 2020 Language Specification*.

mod print;

use super::cellwise::Cellwise;
use super::names::{Names, snake};
use super::text::{Text, in_a_comment};
use crate::error::Error;
use crate::ids::{BufferId, Id};
use crate::kernel::schedule::{Group, Loops, Schedule, reachable, roots};
use crate::kernel::{Buffer, Kernel, Node, Numbers, OutputKey, Role, Values};
use crate::loops::validate;
use print::{Printer, number};
use std::collections::BTreeSet;

/// Tables of more numbers are written once for all functions, and by the places of their different numbers.
const MOST_WRITTEN: usize = 1024;

/// The digits of places of numbers.
const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

/// The functions that emitted code calls.
const FUNCTIONS: &str = include_str!("../../../../web/functions.js");

/// Those that it calls where an interval of a law without a cumulative distribution has a probability.
const MASSES: &str = include_str!("../../../../web/masses.js");

/// Reserved words of JavaScript, and names that are not bound anew in a module, that are no keywords of Rust.
const RESERVED: [&str; 30] = [
    "arguments",
    "case",
    "catch",
    "class",
    "debugger",
    "default",
    "delete",
    "eval",
    "export",
    "extends",
    "finally",
    "function",
    "implements",
    "import",
    "instanceof",
    "interface",
    "let",
    "new",
    "null",
    "package",
    "private",
    "protected",
    "public",
    "switch",
    "this",
    "throw",
    "typeof",
    "undefined",
    "var",
    "void",
];

/// Kernels as JavaScript.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Javascript {
    /// The functions and the ones that they call, as statements.
    pub text: String,
    /// The name of the function of each kernel. It has one parameter, an object with the inputs by the names that the program
    /// gives them: a number for each, or an array; those with a default may be left out. It returns an object: `answers`,
    /// the array of each ask of the kernel, the last axis contiguous; and `lnEvidence`, ln P(evidence), or `null`. Of a normal
    /// law it has `moments`: means, then covariances, row by row up to the diagonal; and over time `law`, those that are
    /// carried to the next instant. The arrays belong to the function, which writes them again when it is called next. An input that does not fit is a
    /// `RangeError`.
    pub names: Vec<String>,
}

impl Javascript {
    /// The text of an ES module that exports the functions.
    pub fn module(&self) -> String {
        format!("{}\nexport {{ {} }};\n", self.text, self.names.join(", "))
    }
}

/// Writes kernels as JavaScript.
///
/// # Errors
/// A size that is not known ([`Kernel::with_sizes`] fixes it); displacements on a grid.
pub fn emit_javascript(kernels: &[Kernel]) -> Result<Javascript, Error> {
    let mut names = Names::default();
    RESERVED.into_iter().chain(defined(FUNCTIONS)).chain(defined(MASSES)).for_each(|name| {
        names.unique(name);
    });
    let mut text = Text::default();
    text.line(FUNCTIONS);
    let integrates = |kernel: &Kernel| kernel.nodes.values().any(|node| matches!(node, Node::Mass(..)));
    if kernels.iter().any(integrates) {
        text.line(MASSES);
    }
    let mut made = Javascript::default();
    let tables = Tables::of(kernels, &mut names, &mut text);
    for kernel in kernels {
        is_possible(kernel)?;
        let name = names.unique(&snake(&kernel.name));
        text.line("");
        function(kernel, &name, &tables, &mut text);
        made.names.push(name);
    }
    made.text = text.finish();
    Ok(made)
}

/// The names of the tables that are written once.
struct Tables<'k>(Vec<(&'k [f64], String)>);

impl<'k> Tables<'k> {
    /// Writes the long tables of some kernels.
    fn of(kernels: &'k [Kernel], names: &mut Names, text: &mut Text) -> Self {
        let mut all = Self(Vec::new());
        for buffer in kernels.iter().flat_map(|kernel| kernel.buffers.values()) {
            let Role::Table { numbers, .. } = &buffer.role else { continue };
            if numbers.len() <= MOST_WRITTEN || all.name(numbers).is_some() {
                continue;
            }
            let mut different: Vec<u64> = numbers.iter().map(|number| number.to_bits()).collect();
            different.sort_unstable();
            different.dedup();
            let width = (1..).find(|width| 64usize.pow(*width) >= different.len()).unwrap_or(1);
            let places = numbers.iter().map(|one| different.binary_search(&one.to_bits()).unwrap_or(0));
            let digits: String = places
                .flat_map(|place| (0..width).rev().map(move |digit| place / 64usize.pow(digit) % 64))
                .map(|digit| char::from(DIGITS[digit]))
                .collect();
            let name = names.unique("table");
            let own: Vec<String> = different.iter().map(|bits| number(f64::from_bits(*bits))).collect();
            text.line(format!("const {name} = unpacked([{}], {width}, \"{digits}\");", own.join(", ")));
            all.0.push((numbers, name));
        }
        all
    }

    /// The name of a table that is written once.
    fn name(&self, numbers: &[f64]) -> Option<&str> {
        let same = |own: &[f64]| {
            own.len() == numbers.len()
                && own.iter().zip(numbers).all(|(one, other)| one.to_bits() == other.to_bits())
        };
        self.0.iter().find(|(own, _)| same(own)).map(|(_, name)| name.as_str())
    }
}

/// The names that a text defines at its top.
fn defined(text: &'static str) -> impl Iterator<Item = &'static str> {
    let opens = |line: &'static str| {
        let mut words = line.split([' ', '(']);
        let is_definition = matches!(words.next(), Some("function" | "const"));
        is_definition.then(|| words.next()).flatten()
    };
    text.lines().filter_map(opens)
}

/// Whether a kernel can be written.
fn is_possible(kernel: &Kernel) -> Result<(), Error> {
    let refused = |reason: String| Err(Error::Unplanned { question: kernel.name.clone(), reason });
    if let Some(size) = kernel.sizes().first() {
        return refused(format!(
            "JavaScript is written for known sizes, and `{}` is given at run time",
            size.name
        ));
    }
    match kernel.buffers.values().find(|buffer| matches!(buffer.role, Role::Positions(..))) {
        Some(buffer) => {
            refused(format!("JavaScript has no displacements on a grid, which `{}` holds", buffer.name))
        }
        None => Ok(()),
    }
}

/// Writes the function of a kernel.
fn function(kernel: &Kernel, name: &str, tables: &Tables<'_>, text: &mut Text) {
    // Without a plate, each nest is a pass of its own, with all loops.
    let kernel = Kernel { parallel: Vec::new(), ..kernel.clone() };
    let read = changes(&kernel);
    text.line(format!("// {}", in_a_comment(&kernel.name)));
    text.open(format!("const {name} = (() =>"));
    text.line("let fresh = true;");
    kernel.buffers.iter().for_each(|(id, buffer)| array(&kernel, id, buffer, tables, text));
    text.open("return (given) =>");
    for (id, buffer) in kernel.buffers.iter().filter(|(_, buffer)| buffer.role.input().is_some()) {
        let ordinal = match buffer.values {
            Some(_) => format!("of{}", id.position()),
            None => "undefined".to_owned(),
        };
        let default = match &buffer.role {
            Role::Input { default: Some(default), .. } => number(*default),
            Role::Table { .. } => format!("t{}", id.position()),
            _ => "undefined".to_owned(),
        };
        let place = id.position();
        let host = string(&buffer.name);
        text.line(format!(
            "const c{place} = take(b{place}, {host}, given[{host}], {default}, {ordinal}) || fresh;"
        ));
    }
    let cells = Cellwise { kernel: &kernel, axes: &[], unrolls: false };
    let printer = Printer { kernel: &kernel };
    let schedule = Schedule::of(&kernel);
    let all: Vec<&Loops> = schedule.groups.iter().flat_map(|group| &group.nests).collect();
    // Many numbers share most of their values.
    let is_one_pass = all.len() > 1 && all.iter().all(|loops| cells.is_number(loops));
    let passes: Vec<Vec<&Loops>> = match is_one_pass {
        true => vec![all],
        false => all.into_iter().map(|loops| vec![loops]).collect(),
    };
    for pass in passes {
        let inputs = pass.iter().flat_map(|loops| &read[kernel.nests[loops.nest].out.position()]);
        let inputs: BTreeSet<&BufferId> = inputs.collect();
        let changed: Vec<String> = inputs.iter().map(|id| format!("c{}", id.position())).collect();
        let changed = if changed.is_empty() { "fresh".to_owned() } else { changed.join(" || ") };
        let nest = [match pass.as_slice() {
            [loops] => cells.nest(&Group { parallel: false, nests: Vec::new() }, loops),
            numbers => cells.numbers(numbers),
        }];
        validate(&nest, []);
        printer.guarded(&changed, &nest, text);
    }
    text.line("fresh = false;");
    let outputs = |of: fn(OutputKey) -> bool| {
        let own = kernel.outputs().filter(move |(_, key)| of(*key));
        own.map(|(id, _)| format!("b{}", id.position())).collect::<Vec<_>>()
    };
    let asks = outputs(|key| matches!(key, OutputKey::Ask(_)));
    let evidence = match outputs(|key| matches!(key, OutputKey::LnEvidence | OutputKey::Total)).first() {
        Some(array) => format!("{array}[0]"),
        None => "null".to_owned(),
    };
    let mut parts = vec![format!("answers: [{}]", asks.join(", ")), format!("lnEvidence: {evidence}")];
    let laws = [
        ("law", outputs(|key| matches!(key, OutputKey::Law(_)))),
        ("moments", outputs(|key| matches!(key, OutputKey::Moment(_)))),
    ];
    for (name, arrays) in laws {
        let numbers: Vec<String> = arrays.iter().map(|array| format!("{array}[0]")).collect();
        if !numbers.is_empty() {
            parts.push(format!("{name}: [{}]", numbers.join(", ")));
        }
    }
    text.line(format!("return {{ {} }};", parts.join(", ")));
    text.close_with("};");
    text.close_with("})();");
}

/// Defines the array of a buffer, and what its input needs.
fn array(kernel: &Kernel, id: BufferId, buffer: &Buffer, tables: &Tables<'_>, text: &mut Text) {
    let place = id.position();
    let count = kernel.known_cells(&buffer.axes).expect("internal: all sizes are known");
    let note = in_a_comment(&buffer.name);
    match &buffer.role {
        Role::Table { key, numbers } => {
            let name = if key.is_some() { "t" } else { "b" };
            let own = match tables.name(numbers) {
                Some(table) => table.to_owned(),
                None => {
                    let own: Vec<String> = numbers.iter().map(|one| number(*one)).collect();
                    format!("new Float64Array([{}])", own.join(", "))
                }
            };
            text.line(format!("const {name}{place} = {own}; // {note}"));
            if key.is_some() {
                text.line(format!("const b{place} = new Float64Array({count});"));
            }
        }
        _ => text.line(format!("const b{place} = new Float64Array({count}); // {note}")),
    }
    match buffer.values.as_ref().map(|Values { numbers, .. }| numbers) {
        Some(Numbers::Whole { first, count }) => {
            let values = count.iter().filter_map(|extent| extent.known()).product::<usize>();
            text.line(format!("const of{place} = whole({first}, {values});"));
        }
        Some(Numbers::Bins(bins)) => {
            let edges: Vec<String> = bins.edges().iter().map(|edge| number(*edge)).collect();
            text.line(format!("const of{place} = bins([{}], {});", edges.join(", "), bins.is_circle()));
        }
        Some(Numbers::Real) => text.line(format!("const of{place} = undefined;")),
        None => {}
    }
}

/// The inputs on which each buffer depends.
fn changes(kernel: &Kernel) -> Vec<BTreeSet<BufferId>> {
    let mut read: Vec<BTreeSet<BufferId>> = vec![BTreeSet::new(); kernel.buffers.len()];
    for (id, _) in kernel.buffers.iter().filter(|(_, buffer)| buffer.role.input().is_some()) {
        read[id.position()].insert(id);
    }
    // The inputs of each node; a buffer is read after the nest that computes it.
    for nest in &kernel.nests {
        let nodes = roots(&nest.reduce, nest.value).into_iter().flat_map(|root| reachable(kernel, root));
        let mut own = BTreeSet::new();
        for node in nodes {
            if let Node::Load { buffer, .. } = &kernel.nodes[node] {
                own.extend(read[buffer.position()].iter().copied());
            }
        }
        read[nest.out.position()] = own;
    }
    read
}

/// A string of JavaScript.
fn string(text: &str) -> String {
    serde_json::to_string(text).expect("internal: a string is valid JSON")
}

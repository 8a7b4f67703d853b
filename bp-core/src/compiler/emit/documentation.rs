//! The documentation of the arrays of a question: indices, lengths, and the index of each value.
//!
//! In: a buffer and its meaning. Out: lines of documentation. Invariant: indices are named in the order of the memory,
//! the last one fastest; a domain is described as the program declares it.

use crate::ids::{AxisId, BufferId, VariableId};
use crate::kernel::{Extent, Kernel, Role};
use crate::lower::Output;
use crate::model::{Domain, Model, Statistic};

/// Limit of labels whose indices are listed.
const MOST_LABELS: usize = 12;

/// An input.
pub(super) fn input(kernel: &Kernel, id: BufferId) -> Vec<String> {
    let buffer = &kernel.buffers[id];
    let what = match &buffer.values {
        Some(values) => {
            format!("`{}`: a value of `{}`, which is {}", buffer.name, values.variable, values.domain)
        }
        None => format!("`{}`", buffer.name),
    };
    if buffer.axes.is_empty() {
        return vec![format!("{what}.")];
    }
    let shape = match buffer.axes.as_slice() {
        // The axis of an array alone has the name of the array.
        [only] if kernel.axes[*only].name == buffer.name => format!("{} numbers.", length(kernel, &[*only])),
        axes => shape(kernel, axes),
    };
    let mut lines = vec![format!("{what}."), shape];
    if matches!(buffer.role, Role::Input { broadcast: true, .. }) && !kernel.parallel.is_empty() {
        let own: Vec<AxisId> =
            buffer.axes.iter().copied().filter(|axis| !kernel.parallel.contains(axis)).collect();
        let once = if own.is_empty() { "one number".to_owned() } else { length(kernel, &own) + " numbers" };
        lines.push(format!("Or {once} for the whole plate."));
    }
    lines
}

/// An output.
pub(super) fn output(model: &Model, kernel: &Kernel, id: BufferId, output: &Output) -> Vec<String> {
    let axes = &kernel.buffers[id].axes;
    let mut lines = vec![format!("`{}`, {}.", output.name, unit(output)), shape(kernel, axes)];
    lines.extend(output.variables.iter().filter_map(|variable| index(model, *variable)));
    lines
}

fn unit(output: &Output) -> &'static str {
    match output.ask.as_ref().map(|ask| &ask.statistic) {
        None => "a natural logarithm",
        Some(Statistic::Entropy) => "in nats",
        Some(Statistic::Argmax { .. }) => {
            "scores that need not sum to one: `bp_core::compiler::answer::argmax` finds the largest that is nearest"
        }
        Some(_) => "probabilities",
    }
}

/// A field of moments.
pub(super) fn law(field: &str) -> String {
    let of = if field == "law" { "what is carried to the next instant" } else { "the searched variables" };
    format!(
        "The normal law of {of}: means, then covariances, row by row up to the diagonal; each a number, or the plate's."
    )
}

/// The indices of an array and its length.
pub(super) fn shape(kernel: &Kernel, axes: &[AxisId]) -> String {
    let names: Vec<&str> = axes.iter().map(|axis| kernel.axes[*axis].name.as_str()).collect();
    match names.as_slice() {
        [] => "One number.".to_owned(),
        [one] => format!("By `[{one}]`: {} numbers.", length(kernel, axes)),
        several => {
            format!(
                "By `[{}]`, the last index fastest: {} numbers.",
                several.join("]["),
                length(kernel, axes)
            )
        }
    }
}

/// The number of cells of some axes, as text.
fn length(kernel: &Kernel, axes: &[AxisId]) -> String {
    if let Some(cells) = kernel.known_cells(axes) {
        return cells.to_string();
    }
    let factor = |axis: &AxisId| match &kernel.axes[*axis].extent {
        Extent { size: None, offset } => offset.to_string(),
        Extent { size: Some(size), offset } => match (&kernel.size(*size).name, *offset) {
            (size, 0) => format!("`{size}`"),
            (size, more) if more > 0 => format!("(`{size}` + {more})"),
            (size, less) => format!("(`{size}` − {})", less.unsigned_abs()),
        },
    };
    axes.iter().map(factor).collect::<Vec<_>>().join(" · ")
}

/// The index of each value of a variable.
pub(super) fn index(model: &Model, variable: VariableId) -> Option<String> {
    let (name, domain) = (model.variable_name(variable), &model.variables[variable].domain);
    let words = match domain {
        Domain::Boolean => "0 is `false`, 1 is `true`".to_owned(),
        Domain::Finite { labels, range } => {
            let listed = labels.iter().take(MOST_LABELS).enumerate();
            let mut words: Vec<String> =
                listed.map(|(index, label)| format!("{index} is `{label}`")).collect();
            if labels.len() > MOST_LABELS {
                words.push("…".to_owned());
            }
            match range {
                Some(_) if domain.base() == 0 => words.push("a number is its own index".to_owned()),
                Some(_) => words.push(format!("a number's index is the number {:+}", -domain.base())),
                None => {}
            }
            words.join(", ")
        }
        Domain::Bins(bins) => {
            let (low, high) = bins.ends();
            let around = if bins.is_circle() { " of a circle" } else { "" };
            format!("{} bins{around} from {low} to {high}, the lowest is 0", bins.count())
        }
        Domain::Set(_) | Domain::Real | Domain::Vector(_) => return None,
    };
    Some(format!("`{name}`: {words}."))
}

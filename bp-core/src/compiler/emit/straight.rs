//! Numbers without loops: consecutive nests of one cell each, as straight-line code.
//!
//! In: nests that compute one number each. Out: their statements in one block. Invariant: a value that several of them share is
//! computed once, in f64; each number is rounded when it is stored.

use super::names::local;
use super::nest::Nests;
use super::print;
use super::question::room;
use super::text::Text;
use crate::ids::ValueId;
use crate::kernel::schedule::{Group, Loops, Schedule};
use crate::kernel::{Kernel, Reduce};
use crate::loops::{Local, Of, Statement, validate};
use std::collections::HashSet;

/// The loops of a group that computes one number.
fn of_number<'g>(kernel: &Kernel, group: &'g Group) -> Option<&'g Loops> {
    let [loops] = group.nests.as_slice() else { return None };
    let nest = &kernel.nests[loops.nest];
    let is_number =
        !group.parallel && nest.reduce == Reduce::None && kernel.buffers[nest.out].axes.is_empty();
    is_number.then_some(loops)
}

/// How many of the first groups compute one number each.
pub(super) fn numbers(kernel: &Kernel, groups: &[Group]) -> usize {
    groups.iter().take_while(|group| of_number(kernel, group).is_some()).count()
}

/// Writes the first groups, as long as they compute one number each.
pub(super) fn numbers_once(
    kernel: &Kernel,
    schedule: &Schedule,
    groups: &[Group],
    is_linear: bool,
    text: &mut Text,
) {
    let mut known: HashSet<ValueId> = HashSet::new();
    for group in groups {
        let Some(nest) = of_number(kernel, group) else { return };
        let nests = Nests::new(kernel, schedule, group, is_linear);
        let (out, value) = (kernel.nests[nest.nest].out, kernel.nests[nest.nest].value);
        room(kernel, out, text);
        let before: Vec<Local> =
            known.iter().flat_map(|value| [Of::Once(*value).into(), Of::Whole(*value).into()]).collect();
        let new = nest.levels.iter().flatten().copied().filter(|value| known.insert(*value));
        let mut body: Vec<Statement> =
            new.collect::<Vec<_>>().into_iter().flat_map(|value| nests.settled(value)).collect();
        body.push(Statement::Store(out, nests.plane(out), Of::Once(value).into()));
        validate(&body, before);
        print::statements(&body, text);
        let array = local("m", out);
        text.line(format!("let {array}: &[T] = &{array}[..];"));
        nests.looked_at_once(out).iter().for_each(|look| text.line(print::look(*look, &array)));
    }
}

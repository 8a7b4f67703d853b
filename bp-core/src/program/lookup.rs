//! Lookup in a part of an answer, by name.
//!
//! In: a [`Part`], a name. Out: positions of slots, a part of one context; or an error with the available names.
//! Invariant: slots stay in their order.

use crate::answer::{Part, PartLaw, Slot};
use crate::guess::{listed, near};
use crate::model::Model;

/// The positions of the slots of this name: of one element, or of all elements of a family.
pub(super) fn slots_named(model: &Model, slots: &[Slot], name: &str) -> Vec<usize> {
    let is = |slot: &Slot| slot.name(model) == name || model.variable_name(slot.variable) == name;
    (0..slots.len()).filter(|place| is(&slots[*place])).collect()
}

/// The error for a name without a slot.
pub(super) fn absent(name: &str, all: &[String]) -> String {
    let names = all.iter().map(String::as_str);
    // Another element is not a misspelling.
    let near = near(name, names.clone()).filter(|_| !name.contains('['));
    match (near, all.is_empty()) {
        (_, true) => "it has no variables: read it with `number`".to_owned(),
        (Some(near), _) => format!("it does not contain `{name}`; did you mean `{near}`?"),
        (None, _) => format!("it does not contain `{name}`, but {}", listed(names, "and")),
    }
}

/// The error for a name without a context.
pub(super) fn not_given(name: &str, known: &[String]) -> String {
    match known.is_empty() {
        true => format!("`{name}` is not open in it: no variable is"),
        false => {
            let open = listed(known.iter().map(String::as_str), "and");
            format!("`{name}` is not open in it; the open variables are {open}")
        }
    }
}

/// The error for a name that is not in the question.
pub(super) fn unknown(name: &str, mut known: Vec<&str>) -> String {
    known.sort_unstable();
    match near(name, known.iter().copied()) {
        Some(near) => format!("the question does not know it; did you mean `{near}`?"),
        None => format!("the question does not know it; it knows {}", listed(known, "and")),
    }
}

/// The only slot.
pub(super) fn one_slot(part: &Part) -> Option<&Slot> {
    if let [slot] = part.of.as_slice() { Some(slot) } else { None }
}

/// The contexts in which the known slot at a position has this value.
pub(super) fn in_context(part: &Part, place: usize, value: usize) -> Part {
    let mut given = part.given.clone();
    let slot = given.remove(place);
    let PartLaw::Finite(numbers) = &part.law else { return Part { given, ..part.clone() } };
    let inner: usize =
        part.given[place + 1..].iter().map(|slot| slot.count).product::<usize>() * part.width();
    let blocks = numbers.chunks(inner.max(1)).enumerate();
    let chosen = blocks.filter(|(block, _)| block % slot.count == value).flat_map(|(_, block)| block);
    let law = PartLaw::Finite(chosen.copied().collect());
    Part { instant: part.instant, given, of: part.of.clone(), law }
}

//! Suggestions for misspelled names.
//!
//! In: an unknown name, and the known ones. Out: the nearest one, if it is near. Invariant: a suggestion differs by a
//! typing error, and is never a different word.

/// The nearest of the names, if at most one letter in four differs, or only the case.
pub(crate) fn nearest<'n>(wanted: &str, known: impl IntoIterator<Item = &'n str>) -> Option<&'n str> {
    within(wanted.chars().count() / 4, wanted, known)
}

/// The nearest of the names, if no other word is plausible: in a word of three letters one may differ too.
pub(crate) fn near<'n>(wanted: &str, known: impl IntoIterator<Item = &'n str>) -> Option<&'n str> {
    let letters = wanted.chars().count();
    within(if letters < 3 { 0 } else { letters.div_ceil(4) }, wanted, known)
}

fn within<'n>(most: usize, wanted: &str, known: impl IntoIterator<Item = &'n str>) -> Option<&'n str> {
    let capital = |name: &str| name.starts_with(char::is_uppercase);
    // The order of names does not matter: among equally near ones equal case is preferred, then the alphabet decides.
    known
        .into_iter()
        .filter(|name| *name != wanted)
        .map(|name| (distance(&wanted.to_lowercase(), &name.to_lowercase()), name))
        .filter(|(distance, _)| *distance <= most)
        .min_by_key(|(distance, name)| (*distance, capital(name) != capital(wanted), *name))
        .map(|(_, name)| name)
}

/// A help that suggests the nearest of the names.
pub(crate) fn did_you_mean<'n>(wanted: &str, known: impl IntoIterator<Item = &'n str>) -> Option<String> {
    nearest(wanted, known).map(|name| format!("did you mean `{name}`?"))
}

/// The help for a word of other languages, with the word of this one: `gaussian` is `normal` here.
pub(crate) fn otherwise_called(wanted: &str, names: &[(&str, &str)]) -> Option<String> {
    let lower = wanted.to_lowercase();
    let found = names.iter().find(|(others, _)| others.split(' ').any(|other| other == lower));
    found.map(|(_, here)| format!("write {here}"))
}

/// The edit distance: insertions, deletions, replacements and swaps of neighbours.
fn distance(left: &str, right: &str) -> usize {
    let (left, right): (Vec<char>, Vec<char>) = (left.chars().collect(), right.chars().collect());
    let mut rows: Vec<Vec<usize>> = vec![(0..=right.len()).collect()];
    for row in 1..=left.len() {
        let mut next = vec![row];
        for column in 1..=right.len() {
            let same = left[row - 1] == right[column - 1];
            let mut best = (rows[row - 1][column] + 1).min(next[column - 1] + 1);
            best = best.min(rows[row - 1][column - 1] + usize::from(!same));
            let swapped = row > 1 && column > 1;
            if swapped && left[row - 1] == right[column - 2] && left[row - 2] == right[column - 1] {
                best = best.min(rows[row - 2][column - 2] + 1);
            }
            next.push(best);
        }
        rows.push(next);
    }
    rows[left.len()][right.len()]
}

/// Limit of the names in a list.
const MOST_LISTED: usize = 40;

/// Names as an English list in backticks: all of them, or the first ones and the number of the others.
pub(crate) fn listed<'n>(names: impl IntoIterator<Item = &'n str>, last: &str) -> String {
    let mut words: Vec<String> = names.into_iter().map(|name| format!("`{name}`")).collect();
    if words.len() > MOST_LISTED {
        let more = words.len() - MOST_LISTED;
        words.truncate(MOST_LISTED);
        words.push(format!("{more} more"));
    }
    match words.split_last() {
        None => String::new(),
        Some((only, [])) => only.clone(),
        Some((end, rest)) => format!("{} {last} {end}", rest.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slips_are_near_and_other_words_are_not() {
        assert_eq!(nearest("Sprinkelr", ["Rain", "Sprinkler", "Wet"]), Some("Sprinkler"));
        assert_eq!(nearest("wet", ["Rain", "Wet"]), Some("Wet"));
        assert_eq!(nearest("l_max", ["tau_max", "mu_l"]), None);
    }
}

//! Suggestions for misspelled names.
//!
//! In: an unknown name, and the known ones. Out: the nearest one, if it is near. Invariant: a suggestion differs by a
//! typing error, and is never a different word.

/// The nearest of the names, if at most one letter in four differs, or only the case; several that are equally near.
pub(crate) fn nearest<'n>(wanted: &str, known: impl IntoIterator<Item = &'n str>) -> Vec<&'n str> {
    within(wanted.chars().count() / 4, wanted, known)
}

/// The nearest of the names, if no other word is plausible: in a word of three letters one may differ too.
pub(crate) fn near<'n>(wanted: &str, known: impl IntoIterator<Item = &'n str>) -> Option<&'n str> {
    let letters = wanted.chars().count();
    let known: Vec<&str> = known.into_iter().collect();
    // `W1`, `W_1` and `w(1)` are `W[1]` in other notations.
    let same = |name: &&&str| **name != wanted && plain(name) == plain(wanted);
    if let Some(same) = known.iter().find(same).filter(|_| plain(wanted).contains(char::is_alphabetic)) {
        return Some(same);
    }
    within(if letters < 3 { 0 } else { letters.div_ceil(4) }, wanted, known).first().copied()
}

/// The letters and digits of a name, in lower case.
fn plain(name: &str) -> String {
    name.chars().filter(|letter| letter.is_alphanumeric()).flat_map(char::to_lowercase).collect()
}

fn within<'n>(most: usize, wanted: &str, known: impl IntoIterator<Item = &'n str>) -> Vec<&'n str> {
    let capital = |name: &str| name.starts_with(char::is_uppercase);
    // The order of names does not matter: among equally near ones equal case is preferred; they are in the order of the alphabet.
    let mut found: Vec<((usize, bool), &str)> = known
        .into_iter()
        .filter(|name| *name != wanted)
        .map(|name| (distance(&wanted.to_lowercase(), &name.to_lowercase()), name))
        .filter(|(distance, _)| *distance <= most)
        .map(|(distance, name)| ((distance, capital(name) != capital(wanted)), name))
        .collect();
    found.sort_unstable();
    found.dedup();
    let least = found.first().map(|(own, _)| *own);
    found.into_iter().take_while(|(own, _)| Some(*own) == least).map(|(_, name)| name).collect()
}

/// The most names of a help.
const MOST_MEANT: usize = 3;

/// The name that was meant, if a slip of the hand is likelier than a name of its own: two neighbours swapped, or a letter missing
/// or doubled inside. `mu_l` is no slip for `mu_r`.
pub(crate) fn slipped<'n>(wanted: &str, known: impl IntoIterator<Item = &'n str>) -> Option<&'n str> {
    let ends = |name: &str| (name.chars().next(), name.chars().next_back());
    let letters = |name: &str| {
        let mut letters: Vec<char> = name.chars().collect();
        letters.sort_unstable();
        letters
    };
    let is_slip = |name: &str| match wanted.chars().count().abs_diff(name.chars().count()) {
        0 => letters(wanted) == letters(name),
        1 => ends(wanted) == ends(name),
        _ => false,
    };
    let near = known.into_iter().filter(|name| wanted.chars().count() >= 5 && is_slip(name));
    near.filter(|name| distance(wanted, name) == 1).min()
}

/// A help that suggests the nearest of the names.
pub(crate) fn did_you_mean<'n>(wanted: &str, known: impl IntoIterator<Item = &'n str>) -> Option<String> {
    let names = nearest(wanted, known);
    (!names.is_empty()).then(|| format!("did you mean {}?", listed(names.into_iter().take(MOST_MEANT), "or")))
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
        assert_eq!(nearest("Sprinkelr", ["Rain", "Sprinkler", "Wet"]), ["Sprinkler"]);
        assert_eq!(nearest("wet", ["Rain", "Wet"]), ["Wet"]);
        assert_eq!(near("w_1", ["Rain", "W[1]"]), Some("W[1]"));
        assert!(nearest("l_max", ["tau_max", "mu_l"]).is_empty());
        assert_eq!(slipped("given_hma", ["given_spam", "given_ham"]), Some("given_ham"));
        assert_eq!(slipped("sigma_r", ["sigma_l", "sigma"]), None);
        let help = did_you_mean("Wall", ["Ball", "Hall", "Wet", "Wals"]);
        assert_eq!(help.as_deref(), Some("did you mean `Ball`, `Hall` or `Wals`?"));
    }
}

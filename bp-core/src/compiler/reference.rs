//! The reference: an entry for each domain, form, function, question and word of the language, and for each option of `bp`.
//!
//! In: the pages `docs/reference/*.md`. Out: entries by name. Invariant: page and command have one source; tests hold
//! the names to the grammar, to the tables of forms, functions and questions, and to the options of the commands.

use crate::guess::{did_you_mean, listed};

/// The kinds of entries, in the plural, and their pages.
const PAGES: [(&str, &str); 6] = [
    ("domains", include_str!("../../../docs/reference/domains.md")),
    ("forms", include_str!("../../../docs/reference/forms.md")),
    ("functions", include_str!("../../../docs/reference/functions.md")),
    ("questions", include_str!("../../../docs/reference/questions.md")),
    ("words", include_str!("../../../docs/reference/structure.md")),
    ("options", include_str!("../../../docs/reference/options.md")),
];

/// Words of messages that name no entry, and the entry that explains the mistake.
const SUBJECTS: [(&str, &str); 22] = [
    ("form `", "forms"),
    ("function `", "functions"),
    ("is not a domain", "domains"),
    ("probabilities of a row", "table"),
    ("this table", "table"),
    ("this row", "table"),
    ("has no distribution", "decomposition"),
    ("two distributions", "decomposition"),
    ("are distributed one by one", "prod"),
    ("depends on itself", "decomposition"),
    ("expected a form", "forms"),
    ("not a form", "forms"),
    ("has no form", "forms"),
    ("has two forms", "forms"),
    ("has a form, but", "forms"),
    ("must be a probability", "probability"),
    ("estimator", "unknown"),
    ("learned", "unknown"),
    ("virtual evidence", "virtual"),
    ("soft evidence", "soft"),
    ("likelihoods of", "virtual"),
    ("covariance matrix", "normal"),
];

/// Names of other texts, with the entry that has what they mean.
const ELSEWHERE: [(&str, &str); 14] = [
    ("gauss gaussian", "normal"),
    ("hmm hidden_markov_model markov_chain bayes_filter forward", "filter"),
    ("kalman kalman_filter", "filter"),
    ("forward_backward backward smoother smoothing", "smooth"),
    ("viterbi map_sequence", "sequence"),
    ("forecast forecasting prediction", "predict"),
    ("mode map mpe", "argmax"),
    ("mean average expected", "expectation"),
    ("sample sampling", "draw"),
    ("quantiles median percentile", "quantile"),
    ("credible_interval hdi ci", "interval"),
    ("plate loop for", "prod"),
    ("mixture_model gmm clusters", "mixture"),
    ("delta deterministic", "dirac"),
];

/// An entry.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Entry {
    /// Its kind, in the plural: `forms`.
    pub kind: &'static str,
    /// Its names; several words that belong together share an entry. That of an option begins with `--`.
    pub names: Vec<&'static str>,
    /// Its text, in Markdown.
    pub text: &'static str,
}

impl Entry {
    /// How it is written, with its meaning: the first line of its text.
    pub fn summary(&self) -> &'static str {
        self.text.lines().next().unwrap_or("")
    }
}

/// The kinds of entries.
pub fn kinds() -> impl Iterator<Item = &'static str> {
    PAGES.iter().map(|(kind, _)| *kind)
}

/// All entries, in the order of the pages.
pub fn entries() -> Vec<Entry> {
    let mut found = Vec::new();
    for (kind, page) in PAGES {
        for part in page.split("\n### ").skip(1) {
            let (heading, text) = part.split_once('\n').unwrap_or((part, ""));
            found.push(Entry { kind, names: heading.split(", ").collect(), text: text.trim() });
        }
    }
    found
}

/// The entries of a name: `max` is a function and a question, `draw` a question, `plot` the option `--plot`.
pub fn named(name: &str) -> Vec<Entry> {
    let bare = name.trim_start_matches('-');
    let is_named = |one: &&str| *one == name || one.strip_prefix("--") == Some(bare);
    entries().into_iter().filter(|entry| entry.names.iter().any(is_named)).collect()
}

/// The entries of a name, or of what it means in other texts: `kalman` is `filter`.
pub fn meant(name: &str) -> Vec<Entry> {
    let found = named(name);
    let plain = name.to_lowercase().replace([' ', '-'], "_");
    let elsewhere = ELSEWHERE.iter().find(|(others, _)| others.split(' ').any(|other| other == plain));
    match elsewhere {
        Some((_, here)) if found.is_empty() => named(here),
        _ => found,
    }
}

/// What to say about a name without an entry.
pub fn unknown(name: &str) -> String {
    let all = entries();
    let names: Vec<&str> = all.iter().flat_map(|entry| entry.names.iter().copied()).collect();
    match did_you_mean(name, names) {
        Some(help) => format!("the reference has no entry `{name}`; {help}"),
        None => format!(
            "the reference has no entry `{name}`; `bp reference` lists all, and its kinds are {}",
            listed(kinds(), "and")
        ),
    }
}

/// The entry, or the kind of entries, that explains the mistake of a message: that of the first word of the language which
/// the message quotes, or that of its subject.
pub fn about(message: &str) -> Option<String> {
    let subject = |place: fn(&str, &str) -> bool| {
        SUBJECTS.iter().find(|(words, _)| place(message, words)).map(|(_, entry)| (*entry).to_owned())
    };
    if let Some(kind) =
        subject(|message, words| message.starts_with(words) && message.contains("is not known"))
    {
        return Some(kind);
    }
    let all = entries();
    let known = |name: &str| all.iter().any(|entry| entry.kind != "options" && entry.names.contains(&name));
    // `normal`, `normal(0, 1)` and `argmax P(X)`, but not `P(X)`.
    let quoted =
        message.split('`').skip(1).step_by(2).map(|piece| piece.split(['(', ' ']).next().unwrap_or(""));
    let mut named = quoted.filter(|word| *word != "P" && known(word)).map(str::to_owned);
    named.next().or_else(|| subject(|message, words| message.contains(words)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn entries_have_names_and_text() {
        assert!(entries().len() > 100, "{}", entries().len());
        assert!(entries().iter().all(|entry| !entry.text.is_empty() && !entry.names.is_empty()));
        assert!(named("--plot") == named("plot") && named("plot").len() == 1);
        assert_eq!(named("max").len(), 2);
        assert!(ELSEWHERE.iter().all(|(_, name)| entries().iter().any(|entry| entry.names.contains(name))));
        assert_eq!(meant("Kalman filter"), named("filter"));
        assert!(unknown("poison").contains("poisson"));
        assert_eq!(about("`normal` takes 2 arguments, found 1").as_deref(), Some("normal"));
        assert_eq!(about("form `norml` is not known; known forms are …").as_deref(), Some("forms"));
        assert_eq!(about("variable `Wet` has no distribution").as_deref(), Some("decomposition"));
        assert_eq!(about("only `argmax` has ties that `nearest` could break").as_deref(), Some("argmax"));
        assert_eq!(about("`Rain` is not a value"), None);
        assert_eq!(about("`P(Y | X)` is odd"), None);
        assert!(
            SUBJECTS.iter().all(|(_, entry)| !named(entry).is_empty() || kinds().any(|kind| kind == *entry))
        );
    }
}

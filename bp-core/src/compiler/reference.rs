//! The reference of the language: an entry for each domain, form, function, question and word.
//!
//! In: the pages `docs/reference/*.md`. Out: entries by name. Invariant: page and command have one source; a test holds
//! the names to the grammar and to the tables of forms, functions and questions.

use crate::guess::{did_you_mean, listed};

/// The kinds of entries, in the plural, and their pages.
const PAGES: [(&str, &str); 5] = [
    ("domains", include_str!("../../../docs/reference/domains.md")),
    ("forms", include_str!("../../../docs/reference/forms.md")),
    ("functions", include_str!("../../../docs/reference/functions.md")),
    ("questions", include_str!("../../../docs/reference/questions.md")),
    ("words", include_str!("../../../docs/reference/structure.md")),
];

/// An entry.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Entry {
    /// Its kind, in the plural: `forms`.
    pub kind: &'static str,
    /// Its names; several words that belong together share an entry.
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

/// The entries of a name: `max` is a function and a question.
pub fn named(name: &str) -> Vec<Entry> {
    entries().into_iter().filter(|entry| entry.names.contains(&name)).collect()
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

/// The entry that explains the mistake of a message: that of a form or function with wrong arguments.
pub fn about(message: &str) -> Option<String> {
    if message.starts_with("form `") && message.contains("is not known") {
        return Some("forms".to_owned());
    }
    if message.starts_with("function `") && message.contains("is not known") {
        return Some("functions".to_owned());
    }
    let (before, _) = message.split_once("` takes ")?;
    let name = before.rsplit('`').next()?;
    (!named(name).is_empty()).then(|| name.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn entries_have_names_and_text() {
        assert!(entries().len() > 100, "{}", entries().len());
        assert!(entries().iter().all(|entry| !entry.text.is_empty() && !entry.names.is_empty()));
        assert_eq!(named("max").len(), 2);
        assert!(unknown("poison").contains("poisson"));
        assert_eq!(about("`normal` takes 2 arguments, found 1").as_deref(), Some("normal"));
        assert_eq!(about("form `norml` is not known; known forms are …").as_deref(), Some("forms"));
        assert_eq!(about("`Rain` is not a value"), None);
    }
}

//! The words before a distribution: the statistic, and the kind of question over time.
//!
//! In: an ask as written. Out: its [`Statistic`] and its [`When`]. Invariant: at most one of each, the statistic first;
//! `sequence` alone is the most likely sequence.

use super::names::{did_you_mean, listed, otherwise_called};
use super::{integer, number};
use crate::diagnostic::{Diagnostic, Diagnostics};
use crate::model::{Statistic, When};
use crate::source::Span;
use crate::syntax::ast::{Ask, Sign, Word};

const STATISTICS: [&str; 11] = [
    "argmax",
    "max",
    "best",
    "draw",
    "entropy",
    "expectation",
    "variance",
    "quantile",
    "interval",
    "information",
    "divergence",
];
const WHEN: [&str; 4] = ["filter", "predict", "smooth", "sequence"];

/// Statistics by other names, and how they are written here.
const ELSEWHERE: [(&str, &str); 6] = [
    ("mean average e expected expect", "`expectation P(…)`"),
    ("var std sd deviation", "`variance P(…)`"),
    ("median percentile", "`quantile(0.5) P(…)`"),
    ("mode map mpe likeliest", "`argmax P(…)`"),
    ("sample simulate", "`draw(10) P(…)`"),
    ("credible hdi ci", "`interval(0.9) P(…)`"),
];

/// The meaning of one word.
enum Meaning {
    Statistic(Statistic),
    When(When),
}

/// Interprets the words of an ask; reports the wrong ones, and interprets the rest.
pub(super) fn read(written: &Ask, wrong: &mut Diagnostics) -> (Statistic, When) {
    let (mut statistic, when) = of(written, &written.words, wrong);
    let divergence = statistic.as_ref().is_some_and(|it| matches!(it, Statistic::Divergence { .. }));
    if let (Some(name), false) = (&written.nearest, matches!(statistic, Some(Statistic::Argmax { .. }))) {
        let message = "only `argmax` has ties that `nearest` could break";
        wrong.push(Diagnostic::new(name.span(), message).with_help("write `argmax P(…) nearest …`"));
    }
    if let (Some(second), false, false) = (&written.from, divergence, written.words.is_empty()) {
        let message = "only `divergence` compares a distribution with another";
        let help = "write `divergence P(…) from P(…)`";
        wrong.push(Diagnostic::new(second.distribution.at.0, message).with_help(help));
    }
    if divergence {
        let Some(second) = &written.from else {
            let message = "`divergence` compares two distributions, but there is one";
            let help = "write `divergence P(…) from P(…)`";
            wrong.push(Diagnostic::new(written.words[0].at.0, message).with_help(help));
            return (Statistic::Distribution, when);
        };
        let (other, second_when) = of(written, &second.words, wrong);
        if let (Some(_), Some(word)) = (other, second.words.first()) {
            let message = format!("`{}` cannot be used here: a divergence compares distributions", word.name);
            wrong.push(Diagnostic::new(word.at.0, message).with_help("leave it out"));
        }
        statistic = Some(Statistic::Divergence { when: second_when, from: Vec::new() });
    }
    let alone =
        if when == When::Sequence { Statistic::Argmax { nearest: None } } else { Statistic::Distribution };
    (statistic.unwrap_or(alone), when)
}

/// The statistic and the kind of question over time that some words name.
fn of(ask: &Ask, words: &[Word], wrong: &mut Diagnostics) -> (Option<Statistic>, When) {
    let (mut statistic, mut when): (Option<Statistic>, Option<When>) = (None, None);
    for (position, word) in words.iter().enumerate() {
        let span = word.at.0;
        match meaning(ask, word, wrong) {
            None => {}
            Some(Meaning::Statistic(_)) if statistic.is_some() => {
                let message =
                    format!("`{}` and `{word}` are both statistics: ask for one", words[position - 1]);
                wrong.push(
                    Diagnostic::new(span, message).with_help("write them as two asks, between semicolons"),
                );
            }
            Some(Meaning::Statistic(read)) => {
                if let Some(before) = &when {
                    let before = before.word();
                    let message = format!("the statistic `{word}` must precede `{before}`");
                    let help = format!("write `{word} {before} P(…)`");
                    wrong.push(Diagnostic::new(span, message).with_help(help));
                }
                statistic = Some(read);
            }
            Some(Meaning::When(read)) => match when {
                Some(before) => {
                    let message = format!(
                        "`{}` and `{word}` are different questions over time: ask for one",
                        before.word()
                    );
                    wrong.push(Diagnostic::new(span, message));
                }
                None => when = Some(read),
            },
        }
    }
    (statistic, when.unwrap_or_default())
}

fn meaning(ask: &Ask, word: &Word, wrong: &mut Diagnostics) -> Option<Meaning> {
    let name = word.name.text.as_str();
    let most = match name {
        "quantile" => usize::MAX,
        "best" | "draw" | "predict" | "interval" => 1,
        _ => 0,
    };
    if let (Some((at, text)), true) = (word.amounts.get(most), known(name)) {
        let (takes, help) = match most {
            0 => ("no number", format!("write `{name} P(…)`")),
            _ => ("one number", format!("write `{name}({}) P(…)`", word.amounts[0].1)),
        };
        let message = format!("`{name}` takes {takes}, found `{text}`");
        wrong.push(Diagnostic::new(at.0, message).with_help(help));
        return None;
    }
    let statistic = match name {
        "best" => Statistic::Best(count(word, wrong)?),
        "draw" => Statistic::Draw(count(word, wrong)?),
        "max" => Statistic::Maximum,
        "argmax" => Statistic::Argmax { nearest: ask.nearest.as_ref().map(|name| name.text.clone()) },
        "entropy" => Statistic::Entropy,
        "expectation" => Statistic::Expectation,
        "variance" => Statistic::Variance,
        "quantile" => Statistic::Quantile(levels(word, "0.1, 0.5, 0.9", wrong)?),
        "interval" => Statistic::Interval(levels(word, "0.9", wrong)?[0]),
        "information" => Statistic::Information,
        "divergence" => Statistic::Divergence { when: When::Now, from: Vec::new() },
        "predict" => return Some(Meaning::When(When::Predict(count(word, wrong)?))),
        "filter" => return Some(Meaning::When(When::Filter)),
        "smooth" => return Some(Meaning::When(When::Smooth)),
        "sequence" => return Some(Meaning::When(When::Sequence)),
        other => {
            unknown(other, word.name.span(), wrong);
            return None;
        }
    };
    Some(Meaning::Statistic(statistic))
}

fn known(name: &str) -> bool {
    STATISTICS.contains(&name) || WHEN.contains(&name)
}

fn unknown(word: &str, span: Span, wrong: &mut Diagnostics) {
    let message = format!(
        "`{word}` is neither a statistic ({}) nor a question over time ({})",
        listed(STATISTICS, "and"),
        listed(WHEN, "and")
    );
    // `argmax_Spam P(Spam | W)`, `Σ_X P(X Y)`, `arg max P(X)`
    let indexed = word.split_once('_').and_then(|(first, name)| match first {
        "Σ" | "∑" | "sum" => {
            Some(format!("`{name}` is summed out where it is neither searched nor known: leave it out"))
        }
        first if known(first) => {
            Some(format!("what is searched stands in the brackets: `{first} P({name} | …)`"))
        }
        _ => None,
    });
    let apart = (word == "arg").then(|| "write `argmax P(…)`".to_owned());
    let help = indexed
        .or(apart)
        .or_else(|| otherwise_called(word, &ELSEWHERE))
        .or_else(|| did_you_mean(word, STATISTICS.into_iter().chain(WHEN)));
    wrong.push(Diagnostic { help, ..Diagnostic::new(span, message) });
}

/// The number in brackets after a word.
fn count(word: &Word, wrong: &mut Diagnostics) -> Option<usize> {
    let name = &word.name.text;
    let help = format!("write `{name}(5) P(…)`");
    let Some((at, text)) = word.amounts.first() else {
        let message = format!("`{name}` needs a number");
        wrong.push(Diagnostic::new(word.at.0, message).with_help(help));
        return None;
    };
    let count = integer(Sign::None, text).and_then(|count| usize::try_from(count).ok());
    if count.is_none() {
        let message = format!("`{name}` takes a whole number, found `{text}`");
        wrong.push(Diagnostic::new(at.0, message).with_help(help));
    }
    count
}

/// The levels that are asked for: one at least.
fn levels(word: &Word, example: &str, wrong: &mut Diagnostics) -> Option<Vec<f64>> {
    if word.amounts.is_empty() {
        let name = &word.name.text;
        let message = format!("`{name}` needs a probability");
        wrong.push(Diagnostic::new(word.at.0, message).with_help(format!("write `{name}({example}) P(…)`")));
        return None;
    }
    let level = |(_, text): &(_, String)| match text.strip_prefix('-') {
        Some(positive) => number(positive).map(|number| -number),
        None => number(text.trim_start_matches('+')),
    };
    word.amounts.iter().map(level).collect()
}

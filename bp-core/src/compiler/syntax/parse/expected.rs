//! Messages of syntax errors.
//!
//! In: the parser's error. Out: one diagnostic at the unexpected token. Invariant: names of rules are never shown; if
//! the end of a statement or of a list is possible, only that is suggested.

use super::grammar::Rule;
use super::{comments, notations};
use crate::compiler::reference;
use crate::diagnostic::Diagnostic;
use crate::source::Span;
use crate::spelling::{RESERVED, quoted_length};
use crate::units;
use pest::error::{Error, ErrorVariant, InputLocation};

/// The diagnostic of a parse error.
pub(super) fn diagnostic(error: &Error<Rule>, text: &str) -> Diagnostic {
    let position = match error.location {
        InputLocation::Pos(position) | InputLocation::Span((position, _)) => skip_comments(text, position),
    };
    let rules: &[Rule] = match &error.variant {
        ErrorVariant::ParsingError { positives, .. } => positives,
        ErrorVariant::CustomError { .. } => &[],
    };
    let found = token(text, position);
    let shown = if found.is_empty() { "the end of the text".to_owned() } else { format!("`{found}`") };
    let expected = expected(rules);
    let before = token_before(text, position);
    let is_end = ["`;`", "`)`", "`]`", "`}`", "`,` or `)`", "`,` or `]`"].contains(&expected.as_str());
    let mut diagnostic = if is_end && text[before.end..position].contains('\n') {
        // A missing token is reported at the end of the previous line, not at the start of this one.
        let after = &text[before.start..before.end];
        Diagnostic::new(before, format!("expected {expected} after `{after}`, found {shown}"))
    } else {
        let span = Span::new(position, position + found.len());
        Diagnostic::new(span, format!("expected {expected}, found {shown}"))
    };
    if let Some(help) = units::help(&text[..before.end], found) {
        diagnostic = diagnostic.with_help(help);
    } else if let Some(help) = asked_elsewhere(text.split_at(position), found, rules) {
        diagnostic = diagnostic.with_help(help);
    } else if let Some(whole) = one_word(&text[before.start..before.end], found) {
        diagnostic = diagnostic.with_help(format!("did you mean `{whole}`?"));
    } else if rules.contains(&Rule::kw_parameters) {
        diagnostic = diagnostic.with_help(
            "a program has the sections `parameters`, `variables`, `decomposition`, `forms`, `identification` and `question`",
        );
    } else if let Some(help) = notations::help(text.split_at(position), found, &expected) {
        diagnostic = diagnostic.with_help(help);
    } else if let Some(help) = elsewhere(found, rules, &expected, &text[before.start..before.end]) {
        diagnostic = diagnostic.with_help(help);
    } else if found == "∝" {
        diagnostic = diagnostic.with_help("write `=`: what is proportional is normalised");
    } else if found.starts_with('\'') || found == "′" {
        diagnostic = diagnostic.with_help("write `X^-1` for `X` at the previous instant");
    } else if found == "^" || &text[before.start..before.end] == "^" {
        diagnostic = diagnostic.with_help(
            "`X^-1` is `X` at the previous instant, and `^` means nothing else; a power is `pow(x, 2)`",
        );
    } else if expected == "a form" {
        if let Some(help) = no_form(found) {
            diagnostic = diagnostic.with_help(help);
        }
    } else if found == "let" && rules.contains(&Rule::expression) {
        diagnostic =
            diagnostic.with_help("`let` stands before a form: `P(X) = let p = 1 / 3 in bernoulli(p);`");
    } else if found == "=" && rules.contains(&Rule::infix) {
        diagnostic = diagnostic.with_help("write `==` to compare");
    } else if RESERVED.contains(&found) && rules.contains(&Rule::name) {
        diagnostic =
            diagnostic.with_help(format!("`{found}` is a word of the language; in quotes it can be a name"));
    }
    diagnostic
}

/// Statistics of a distribution as books write them, and as they are written here.
const IN_BOOKS: [(&str, &str); 6] = [
    ("pr prob probability p", "P(X)"),
    ("e mean average expected", "expectation P(X)"),
    ("var variation", "variance P(X)"),
    ("h", "entropy P(X)"),
    ("i mi", "information P(X, Y)"),
    ("d kl dkl", "divergence P(X | Z) from P(X)"),
];

/// The help for a question in the notation of books: `Pr(X)`, `E(X)`, `H[X]`, `entropy(X)`.
fn asked_elsewhere((text, rest): (&str, &str), found: &str, rules: &[Rule]) -> Option<String> {
    let is_ask = rules.iter().any(|rule| describe(*rule) == "`P(`");
    if found == "P" && is_ask {
        return rest[1..]
            .trim_start()
            .starts_with(['[', '{'])
            .then(|| "write `P(X)`, in round brackets".to_owned());
    }
    if found.is_empty() && is_ask {
        let (words, last) = text.trim_end().rsplit_once(' ')?;
        return last
            .starts_with(char::is_uppercase)
            .then(|| format!("write `{} P({last})`", words.trim_end()));
    }
    let is_amount = [Rule::amount, Rule::sign, Rule::number].iter().any(|rule| rules.contains(rule));
    let is_after = matches!(found, "[" | "(") && is_ask;
    let name = match text.trim_end().strip_suffix('(') {
        Some(before) if is_amount => before,
        _ if is_after => text,
        _ => return None,
    };
    let name = name.trim_end().rsplit(|letter: char| !letter.is_alphanumeric()).next().unwrap_or_default();
    let lower = name.to_lowercase();
    let here = IN_BOOKS.iter().find(|(others, _)| others.split(' ').any(|other| other == lower));
    match here {
        Some((_, here)) => Some(format!("write `{here}`")),
        None => (reference::named(name).iter().any(|entry| entry.kind == "questions"))
            .then(|| format!("a statistic stands before a distribution: `{name} P(X)`")),
    }
}

/// The name that two words make, where one of the language is meant: `noisy or`.
fn one_word(before: &str, found: &str) -> Option<String> {
    let whole = format!("{before}_{found}");
    let is_word = !before.is_empty() && !found.is_empty();
    (is_word && reference::named(&whole).iter().any(|entry| entry.names.contains(&whole.as_str())))
        .then_some(whole)
}

/// The help for signs of other languages.
fn elsewhere(found: &str, rules: &[Rule], expected: &str, before: &str) -> Option<String> {
    let help = match found {
        ".." if rules.contains(&Rule::dots) => "a range has both of its ends: write `1..=5`",
        "*" | "·" | "," if expected.contains("`prod`") => "factors stand side by side: `P(A) P(B | A)`",
        "Pr" | "Prob" | "prob" | "pr" | "p" if expected.contains("`P(`") => "write `P(…)`",
        "&" | "&&" => "write `and`",
        "||" => "write `or`",
        "!" => "write `not`",
        "?" => "a choice is `if … { … } else { … }`",
        "<" | ">" | "<=" | ">=" | "==" | "!=" | "+" | "-" | "*" | "/"
            if expected == "`;`" && before.starts_with(char::is_alphabetic) =>
        {
            return Some(format!(
                "`{before}` is read as a form; a value is computed inside one, as in `dirac({before} {found} …)`"
            ));
        }
        _ => return None,
    };
    Some(help.to_owned())
}

/// The help for what stands where a form must stand: a number, a truth value or a list is not a distribution.
fn no_form(found: &str) -> Option<String> {
    let number = found.starts_with(|first: char| first.is_ascii_digit());
    match found {
        _ if number => Some(format!(
            "a form is a distribution: `bernoulli({found})` gives `true` the probability {found}, and `dirac({found})` is the \
             value {found} for certain"
        )),
        "true" | "false" | "not" => Some(
            "a form is a distribution: `dirac(…)` is a value for certain, and `bernoulli(p)` gives `true` the probability p"
                .to_owned(),
        ),
        "[" | "{" => Some(
            "a form is a distribution: `categorical(p, q, …)` gives each value its probability, and `table { … }` has a row of \
             them for each value of the variables on the right"
                .to_owned(),
        ),
        "(" | "-" => Some(
            "a form is a distribution, such as `bernoulli(p)`, `normal(mean, deviation)` or `dirac(value)`".to_owned(),
        ),
        _ => None,
    }
}

/// The parser's position may be before blanks and comments.
fn skip_comments(text: &str, mut position: usize) -> usize {
    loop {
        let rest = &text[position..];
        let trimmed = rest.trim_start();
        position += rest.len() - trimmed.len();
        let length = if trimmed.starts_with("//") {
            trimmed.find('\n').unwrap_or(trimmed.len())
        } else if trimmed.starts_with("/*") {
            match trimmed.find("*/") {
                Some(end) => end + 2,
                None => return position,
            }
        } else {
            return position;
        };
        position += length;
    }
}

/// The token at a position: a word, a number, or one sign.
fn token(text: &str, position: usize) -> &str {
    let rest = &text[position..];
    let word = |character: char| character.is_alphanumeric() || character == '_';
    match rest.chars().next() {
        None => "",
        Some(character) if word(character) => {
            let letters = |text: &str| text.find(|c| !word(c)).unwrap_or(text.len());
            let whole = letters(rest);
            let decimals = rest[whole..].strip_prefix('.').map_or(0, letters);
            let is_decimal = character.is_ascii_digit()
                && rest[whole..].trim_start_matches('.').starts_with(|digit: char| digit.is_ascii_digit());
            &rest[..if is_decimal && decimals > 0 { whole + 1 + decimals } else { whole }]
        }
        Some('"') => &rest[..quoted_length(rest).unwrap_or(1)],
        Some(character) => {
            let pairs = ["..=", "..", "=>", "==", "!=", "<=", ">=", "->", "&&", "||", "/*"];
            let known = pairs.into_iter().find(|pair| rest.starts_with(pair));
            &rest[..known.map_or(character.len_utf8(), str::len)]
        }
    }
}

/// The token that ends before a position, whatever blanks and comments are between.
fn token_before(text: &str, position: usize) -> Span {
    let comments = comments::find(text);
    let mut end = position;
    loop {
        end = text[..end].trim_end().len();
        match comments.iter().find(|comment| comment.start < end && end <= comment.end) {
            Some(comment) => end = comment.start,
            None => break,
        }
    }
    if let Some(name) = comments::hidden(text).find(|hidden| hidden.end == end) {
        return name;
    }
    let rest = &text[..end];
    let word = |character: char| character.is_alphanumeric() || character == '_';
    let letters = rest.len() - rest.trim_end_matches(word).len();
    let last = rest.chars().next_back().map_or(0, char::len_utf8);
    Span::new(end - letters.max(last), end)
}

/// The expected tokens, as an English list.
fn expected(rules: &[Rule]) -> String {
    let has = |rule| rules.contains(&rule);
    let mut words: Vec<&str> = Vec::new();
    let ends = [Rule::semicolon, Rule::close_paren, Rule::close_bracket, Rule::close_brace];
    // After an element of a list or an expression, an operator or another element is possible too, but the end is the
    // likely omission.
    let follows = [Rule::comma, Rule::infix, Rule::bar, Rule::semicolon].into_iter().any(has);
    if let Some(end) = ends.into_iter().find(|end| has(*end)).filter(|_| follows) {
        if has(Rule::comma) && !has(Rule::name) && end != Rule::semicolon {
            words.push("`,`");
        }
        words.push(describe(end));
    } else {
        for rule in rules {
            let word = describe(*rule);
            if !words.contains(&word) {
                words.push(word);
            }
        }
        if words.contains(&"an expression") || words.contains(&"a form") {
            let parts = ["a name", "a number", "`true` or `false`", "`-`", "`if`", "`match`", "`(`", "`[`"];
            words.retain(|word| !parts.contains(word));
        }
        // An index or an argument is possible almost everywhere.
        let suffixes = ["`(`", "`[`", "`.`", "`^`"];
        if words.iter().any(|word| !suffixes.contains(word)) {
            words.retain(|word| !suffixes.contains(word));
        }
        words.truncate(6);
    }
    match words.split_last() {
        None => "something else".to_owned(),
        Some((last, [])) => (*last).to_owned(),
        Some((last, rest)) => format!("{} or {last}", rest.join(", ")),
    }
}

fn describe(rule: Rule) -> &'static str {
    use Rule::*;
    match rule {
        EOI => "the end of the text",
        file | program | kw_program | lone_asks => "`program`",
        plate | kw_over => "`over`",
        kw_in => "`in`",
        section | parameters | variables | decomposition | forms | identification | question
        | kw_parameters | kw_variables | kw_decomposition | kw_forms | kw_identification | kw_question => {
            "a section"
        }
        parameter | parameter_name => "a parameter",
        space => "a set or a range",
        range | bound => "a range",
        declaration | declared => "a variable",
        family | open_bracket | index => "`[`",
        before | caret => "`^`",
        except | kw_except => "`except`",
        kw_or => "`or`",
        domain | labels => "a domain",
        product | kw_prod => "`prod`",
        factor | probability | ask | distribution => "`P(`",
        occurrences | occurrence | searched | item | slice | initial | kw_initial => "a variable",
        definition => "`P(`",
        form | plain_form | otherwise | named_form | if_form | match_form | table | ask_form | previous
        | kw_table | kw_previous | kw_ask => "a form",
        binding | kw_let => "`let`",
        form_branch | branch | expression | group | term | term_primary | term_group | vector | reference
        | prefix | primary | if_expression | match_expression | first | kw_not | kw_first => "an expression",
        kw_if => "`if`",
        kw_match => "`match`",
        kw_else => "`else`",
        form_arm | arm | pattern | wildcard => "a pattern",
        row => "a row of numbers",
        keys | value => "a value",
        path | segment | name | quoted | reserved => "a name",
        arguments | open_paren => "`(`",
        learnt | hidden | kw_hidden => "the names that are learned",
        by | apart | kw_by => "`by`",
        from | kw_from => "`from`",
        word => "a statistic such as `argmax`",
        known | bar => "`|`",
        nearest | kw_nearest => "`nearest`",
        likelihoods | kw_virtual => "`virtual`",
        soft | kw_soft => "`soft`",
        infix => "an operator",
        suffix | answer | field | dot => "`.`",
        amount | number | digits | one | sign => "a number",
        boolean => "`true` or `false`",
        open_brace => "`{`",
        close_brace => "`}`",
        close_paren => "`)`",
        close_bracket => "`]`",
        semicolon => "`;`",
        colon => "`:`",
        comma => "`,`",
        equal => "`=`",
        arrow => "`=>`",
        dots => "`..=`",
        minus => "`-`",
        kw_with => "`with`",
        kw_at => "`at`",
        WHITESPACE | COMMENT => "a blank",
    }
}

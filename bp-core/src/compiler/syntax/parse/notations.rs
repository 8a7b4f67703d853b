//! Help for the notations of papers and of other languages.
//!
//! In: the token that was not expected, and the text around it. Out: how it is written here, if it is known elsewhere. Invariant:
//! a help gives text that can be written as it stands, or with the names of the program.

/// The help for a sign of mathematics.
fn sign(found: &str) -> Option<&'static str> {
    Some(match found {
        "∧" | "∩" => "write `and`; variables that are asked together stand side by side: `P(A B)`",
        "∨" | "∪" => "write `or`",
        "¬" => "write `not`: `P(not A)`; known to be false: `P(B | A = false)`",
        "∣" | "｜" | "¦" => "write `|`",
        "≤" => "write `<=`",
        "≥" => "write `>=`",
        "≠" => "write `!=`",
        "×" | "⋅" | "∏" | "Π" => {
            "factors stand side by side: `P(A) P(B | A)`; of a family under a product: `prod(i) { P(X[i]) }`"
        }
        "−" | "–" => "write `-`",
        "∈" => "a domain stands behind a colon: `X : 1..=6;`",
        "→" | "←" => "an arrow from A to B is a factor: `P(B | A)`",
        "⊥" | "⫫" | "╨" => {
            "whether A and B are independent is measured: `information P(A, B)` is 0 where they are"
        }
        _ => return None,
    })
}

/// The help for what stands at `found`; `expected` is what could stand there.
pub(super) fn help((before, rest): (&str, &str), found: &str, expected: &str) -> Option<String> {
    if let Some(help) = sign(found) {
        return Some(help.to_owned());
    }
    let inside = before.rfind("P(").is_some_and(|at| !before[at..].contains(')'));
    let line = rest.lines().next().unwrap_or_default();
    match found {
        "#" => Some("a comment begins with `//`".to_owned()),
        "." => {
            let digits: String = rest[1..].chars().take_while(char::is_ascii_digit).collect();
            (!digits.is_empty()).then(|| format!("write `0.{digits}`"))
        }
        "then" => Some("a choice is `if … { … } else { … }`".to_owned()),
        "[" if expected == "a domain" => {
            Some("a domain is `0..=10`, `bins(0, 10, 20)`, `real`, `bool` or `{ Low, High }`".to_owned())
        }
        "=" if of_parameter(before) => {
            let name = before.trim_end().rsplit(|letter: char| !letter.is_alphanumeric() && letter != '_').next()?;
            Some(format!("a parameter has a kind before its default: `{name} : real = …;`"))
        }
        "=" if is_argument(before) => Some("arguments have no names: `normal(mean, deviation)`".to_owned()),
        "~" if inside => Some("write `not`: `P(not A)`".to_owned()),
        ";" if inside && expected.contains("`)`") => Some(
            "the parameters of a program are not in its distributions: they have the values that they are given".to_owned(),
        ),
        "+" | "-" if inside && before.trim_end().ends_with(['|', ',', '(']) => {
            let name = rest[1..].split(|letter: char| !letter.is_alphanumeric() && letter != '_').next()?;
            let value = if found == "+" { "true" } else { "false" };
            (!name.is_empty()).then(|| format!("write `{name} = {value}`"))
        }
        "|" if expected.contains("`P(`") => Some("a question is a distribution: `P(A | B)`".to_owned()),
        "for" if expected.contains("`P(`") || expected.contains("`prod`") => {
            Some("a family is distributed under a product: `prod(i in 1..=N) { P(Y[i] | Mu) }`".to_owned())
        }
        _ if expected.contains("`P(`") && is_name(found) => of_statement(found, line),
        _ => None,
    }
}

/// Whether a text ends in the section `parameters`, behind a name.
fn of_parameter(before: &str) -> bool {
    let section = before.rfind("parameters").map(|at| &before[at..]);
    section.is_some_and(|section| {
        let last = section.rsplit(['{', ';']).next().unwrap_or_default();
        section.contains('{') && !section.contains('}') && !last.contains(':')
    })
}

/// Whether a text ends in the arguments of a form, behind a name: `P(X) = normal(mean`.
fn is_argument(before: &str) -> bool {
    let form = before.rsplit(['{', ';', '}']).next().unwrap_or_default();
    let Some((_, form)) = form.split_once('=') else { return false };
    let open = form.matches('(').count() > form.matches(')').count();
    let name = form.rsplit(['(', ',']).next().unwrap_or_default().trim().to_lowercase();
    open && ARGUMENTS.split(' ').any(|known| known == name)
}

/// Names of arguments in other languages.
const ARGUMENTS: &str = "mean mu loc location sd std stdev sigma scale deviation variance var p prob probability probs rate lambda \
                         lam shape alpha beta a b n k r df nu low high lower upper min max";

fn is_name(found: &str) -> bool {
    found.starts_with(|first: char| first.is_alphabetic() || first == '_')
}

/// The help for a statement of Stan, BUGS or PyMC where a factor or a form must stand: `y ~ normal(mu, 1);`
fn of_statement(name: &str, line: &str) -> Option<String> {
    let rest = line.strip_prefix(name)?;
    let index = rest.strip_prefix('[').and_then(|rest| rest.split_once(']')).map(|(index, _)| index);
    let variable = index.map_or_else(|| name.to_owned(), |index| format!("{name}[{index}]"));
    if rest.contains('~') {
        return Some(format!(
            "`{variable} ~ …` is written in two places: the factor `P({variable} | …)` in `decomposition`, and `P({variable} | …) = …;` in \
             `forms`"
        ));
    }
    rest.contains('=').then(|| format!("a form is that of a factor: `P({variable} | …) = …;`"))
}

#[cfg(test)]
mod tests {
    use super::help;

    #[test]
    fn signs_and_statements_of_other_notations() {
        let cases = [
            (("P(A ", "∧ B)"), "∧", "`)`", "write `and`"),
            (("P(", "¬A)"), "¬", "a variable", "P(not A)"),
            (("P(", "~A)"), "~", "a variable", "P(not A)"),
            (("P(X | Y", ";θ)"), ";", "`,` or `)`", "parameters of a program"),
            (("P(Rain | ", "+wet)"), "+", "a variable", "write `wet = true`"),
            (("forms { ", "y[i] ~ normal(mu, 1); }"), "y", "`P(` or `}`", "`P(y[i] | …) = …;`"),
            (("forms { ", "mu = 3; }"), "mu", "`P(` or `}`", "`P(mu | …) = …;`"),
            (
                ("forms { P(X) = normal(mean ", "= 0, sd = 1); }"),
                "=",
                "an operator",
                "arguments have no names",
            ),
            (("forms { P(A) = bernoulli(", ".25); }"), ".", "an expression", "write `0.25`"),
            (("parameters { sigma ", "= 3; }"), "=", "`:` or `,`", "`sigma : real = …;`"),
            (("variables { X : ", "[0, 10]; }"), "[", "a domain", "bins(0, 10, 20)"),
            (("", "# a comment"), "#", "`program`", "`//`"),
            (("decomposition { ", "for (i in 1:N) {"), "for", "`prod`, `P(` or `}`", "prod(i in 1..=N)"),
        ];
        for (text, found, expected, wanted) in cases {
            let help = help(text, found, expected).unwrap_or_default();
            assert!(help.contains(wanted), "{found}: {help}");
        }
        assert_eq!(help(("P(A ", "B"), "B", "`)`"), None);
    }
}

//! The distributions that an ask combines, and their combination.
//!
//! In: an ask. Out: asks to be planned, and lines for its derivation. Invariant: no part is a divergence or has soft
//! evidence; a simple ask is its own only part.
//!
//! Soft evidence (Jeffrey 1965): P′(S) = Σ_X q(X) P(S | X); it is made of P(S X | the other evidence).
//! Divergence (Kullback and Leibler 1951): Σ_S P(S | K) ln (P(S | K) / P(S | K′)); it is made of the two.

use super::Notation;
use super::print::Line;
use crate::ids::VariableId;
use crate::model::{Ask, Finding, Known, Model, Searched, Statistic};

/// The distributions that an ask combines, in order.
pub fn parts(model: &Model, ask: &Ask) -> Vec<Ask> {
    match &ask.statistic {
        Statistic::Divergence { when, from } => {
            let whole = |when, known: &[Known]| Ask {
                statistic: Statistic::Distribution,
                when,
                searched: ask.searched.clone(),
                known: known.to_vec(),
            };
            let both = [whole(ask.when, &ask.known), whole(*when, from)];
            both.iter().map(|part| without_soft(model, part)).collect()
        }
        _ => vec![without_soft(model, ask)],
    }
}

/// Variables with soft evidence are searched too: soft evidence replaces their distribution.
fn without_soft(model: &Model, ask: &Ask) -> Ask {
    let is_soft = |known: &&Known| matches!(known.evidence, Finding::Soft(_));
    let (soft, known): (Vec<&Known>, Vec<&Known>) = ask.known.iter().partition(is_soft);
    // It is refused over time.
    if soft.is_empty() || ask.when.is_over_time() {
        return ask.clone();
    }
    let soft = soft.into_iter().map(|known| Searched { variable: known.variable, at: None });
    // Given values are selected at the end: soft evidence applies to all values.
    let open = |item: &Searched| match model.variables[item.variable].domain.is_finite() {
        true => Searched { variable: item.variable, at: None },
        false => item.clone(),
    };
    let searched = ask.searched.iter().map(open).chain(soft).collect();
    Ask {
        statistic: Statistic::Distribution,
        when: ask.when,
        searched,
        known: known.into_iter().cloned().collect(),
    }
}

/// The combination of the parts.
pub(crate) fn lines(model: &Model, ask: &Ask, notation: Notation) -> Vec<Line> {
    let name = |id: VariableId| notation.name(model, id);
    let searched: Vec<String> = ask.searched.iter().map(|item| name(item.variable)).collect();
    let is_soft = |known: &&Known| matches!(known.evidence, Finding::Soft(_));
    let hard = |known: &[Known]| -> Vec<String> {
        known.iter().filter(|known| !is_soft(known)).map(|known| name(known.variable)).collect()
    };
    let mut lines = Vec::new();
    let mut replaced = |known: &[Known]| {
        for soft in known.iter().filter(is_soft) {
            let one = name(soft.variable);
            let right: Vec<String> = std::iter::once(one.clone()).chain(hard(known)).collect();
            let sum = notation.sum(std::slice::from_ref(&one));
            let q = format!("{}{}", notation.label("q"), notation.group(&one));
            let given = notation.distribution(&searched, &right);
            let prime = notation.choose("P′", "P'", "<mi>P′</mi>");
            let plain = notation.choose("P", "P", "<mi>P</mi>");
            let left = notation.distribution(&searched, &hard(known)).replacen(plain, prime, 1);
            let reason = format!(
                "the posterior of `{}` is replaced (Jeffrey); distributions given it are unchanged",
                model.variable_name(soft.variable)
            );
            lines.push((
                "soft evidence".to_owned(),
                reason,
                notation.equation(&left, "=", &format!("{sum}{q} {given}")),
            ));
        }
    };
    replaced(&ask.known);
    if let Statistic::Divergence { from, .. } = &ask.statistic {
        replaced(from);
        let of = |known: &[Known]| notation.distribution(&searched, &hard(known));
        let (p, q) = (notation.label("p"), notation.label("q"));
        let body = format!("{}{}", notation.sum(&searched), p_ln(notation, &notation.ratio(&p, &q)));
        let equation = notation.equation(&notation.label("D"), "=", &body);
        let with = [notation.relation(&p, "=", &of(&ask.known)), notation.relation(&q, "=", &of(from))];
        let reason = "the divergence of the first from the second, in nats".to_owned();
        lines.push(("divergence".to_owned(), reason, where_(notation, &equation, &with)));
    }
    lines
}

/// A statistic of one distribution: the rule and its equation.
pub(super) fn read_out(
    ask: &Ask,
    names: &[String],
    distribution: &str,
    notation: Notation,
) -> Option<(&'static str, String)> {
    let p = notation.label("p");
    let vector = match names {
        [one] => one.clone(),
        several => {
            notation.group(&several.join(notation.choose(", ", ", ", "<mo separator=\"true\">,</mo>")))
        }
    };
    let sum = notation.sum(names);
    let with = [notation.relation(&p, "=", distribution)];
    Some(match &ask.statistic {
        Statistic::Best(count) => {
            let many = notation
                .text(&format!("the {count} largest of "), &format!("\\text{{the {count} largest of }}"));
            ("best", format!("{many}{distribution}"))
        }
        Statistic::Draw(count) => {
            let times = notation.text(&format!(", {count} times"), &format!(",\\ {count}\\text{{ times}}"));
            let sign = notation.choose("~", "\\sim", "~");
            ("draw", format!("{}{times}", notation.equation(&vector, sign, distribution)))
        }
        Statistic::Expectation => {
            let body = format!("{sum}{vector} {distribution}");
            ("expectation", notation.equation(&notation.label("E"), "=", &body))
        }
        Statistic::Variance => {
            let less = notation.group(&notation.relation(&vector, "−", &notation.label("E")));
            let square = match notation {
                Notation::Unicode => format!("{less}²"),
                Notation::Latex => format!("{less}^2"),
                Notation::MathMl => format!("<msup>{less}<mn>2</mn></msup>"),
            };
            let body = format!("{sum}{square} {distribution}");
            ("variance", notation.equation(&notation.label("Var"), "=", &body))
        }
        Statistic::Quantile(_) | Statistic::Interval(_) => {
            let levels: Vec<String> = ask.statistic.levels()?.iter().map(f64::to_string).collect();
            let words = format!("the quantiles at {} of ", levels.join(", "));
            let many = notation.text(&words, &format!("\\text{{{words}}}"));
            ("quantile", format!("{many}{distribution}"))
        }
        Statistic::Information => {
            let alone: String = names.iter().map(|name| format!("{p}{}", notation.group(name))).collect();
            let body = format!("{sum}{}", p_ln(notation, &notation.ratio(&p, &alone)));
            let equation = notation.equation(&notation.label("I"), "=", &body);
            ("information", where_(notation, &equation, &with))
        }
        _ => return None,
    })
}

/// `p ln (…)`.
fn p_ln(notation: Notation, ratio: &str) -> String {
    let ln = notation.choose(" ln ", " \\ln ", "<mspace width=\"0.17em\"/><mi>ln</mi>");
    format!("{}{ln}{}", notation.label("p"), notation.group(ratio))
}

/// An equation with the meaning of its letters.
fn where_(notation: Notation, equation: &str, with: &[String]) -> String {
    let comma = notation.choose(", ", ",\\quad ", "<mo separator=\"true\">,</mo><mspace width=\"1em\"/> ");
    std::iter::once(equation).chain(with.iter().map(String::as_str)).collect::<Vec<_>>().join(comma)
}

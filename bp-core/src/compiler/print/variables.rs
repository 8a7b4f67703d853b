//! The relevant variables with their domains.
//!
//! In: the tree of a program. Out: a line for each declaration. Invariant: the names are in the order of the text.

use super::{Line, text};
use crate::equation::Notation;
use crate::syntax::ast::{
    Bound, Declared, Domain, DomainKind, Program, Range, Section, SectionKind, Sign, Space,
};

/// The declarations, and the set of a plate.
pub(super) fn variables(program: &Program, notation: Notation) -> Vec<Line> {
    let comma = comma(notation);
    let mut lines = Vec::new();
    if let Some(plate) = &program.plate {
        let (index, set) = (notation.word(&plate.index.text), notation.word(&plate.set.text));
        let words = text(notation, ", for each of which the program holds");
        lines.push(Line::new(0, format!("{}{words}", notation.relation(&index, "∈", &set))));
    }
    for section in &program.sections {
        let SectionKind::Variables(declarations) = &section.kind else { continue };
        for declaration in declarations {
            let each = declaration.variables.iter().flat_map(|one| with_before(program, one));
            let names: Vec<_> = each.map(|one| declared(&one, notation)).collect();
            let domain = domain(&declaration.domain, notation);
            lines.push(Line::new(0, notation.relation(&names.join(comma), "∈", &domain)));
        }
    }
    if lines.is_empty() {
        lines.push(Line::new(0, text(notation, "none yet")));
    }
    lines
}

/// The names of all variables.
pub(super) fn names(program: &Program, notation: Notation) -> Vec<String> {
    let declared = program.sections.iter().filter_map(|section| match &section.kind {
        SectionKind::Variables(declarations) => Some(declarations),
        _ => None,
    });
    let each = declared.flatten().flat_map(|declaration| &declaration.variables);
    let each = each.flat_map(|one| with_before(program, one));
    each.map(|one| notation.typeset(&format!("{}{}", one.name, if one.before { "^-1" } else { "" })))
        .collect()
}

/// A variable, and the same variable at the previous instant if factors name it and no declaration does.
fn with_before(program: &Program, one: &Declared) -> Vec<Declared> {
    let mut both = vec![one.clone()];
    let is_declared = |section: &Section| match &section.kind {
        SectionKind::Variables(declarations) => declarations
            .iter()
            .flat_map(|declaration| &declaration.variables)
            .any(|other| other.before && other.name.text == one.name.text),
        _ => false,
    };
    let is_named = super::factors(program).into_iter().any(|factor| {
        let mut names = factor.left.iter().chain(&factor.right);
        names.any(|used| used.before && used.name.text == one.name.text)
    });
    if is_named && !one.before && !program.sections.iter().any(is_declared) {
        both.push(Declared { before: true, ..one.clone() });
    }
    both
}

/// A comma after which a line may be broken.
pub(super) fn comma(notation: Notation) -> &'static str {
    notation.choose(", ", ",\\, ", "<mo separator=\"true\">,</mo> ")
}

fn declared(one: &Declared, notation: Notation) -> String {
    let before = if one.before { "^-1" } else { "" };
    let name = notation.typeset(&format!("{}{before}", one.name));
    let Some(family) = &one.family else { return name };
    let over = space(&family.space, notation);
    let over = match &family.index {
        None => over,
        Some(index) => notation.relation(&notation.word(&index.text), "∈", &over),
    };
    let except = family.except.as_ref().map(|except| {
        let except = notation.word(&except.text);
        notation.choose(" ∖ ", " \\setminus ", "<mo>∖</mo>").to_owned() + &except
    });
    notation.element(&name, &(over + &except.unwrap_or_default()))
}

/// The range of an index.
pub(super) fn space(space: &Space, notation: Notation) -> String {
    match space {
        Space::Set(name) => notation.word(&name.text),
        Space::Range(range) => range_of(range, notation),
    }
}

fn bound(bound: &Bound, notation: Notation) -> String {
    match (&bound.name, &bound.offset) {
        (None, Some((Sign::Minus, number))) => {
            notation.choose("−", "-", "<mo form=\"prefix\">−</mo>").to_owned() + &notation.label(number)
        }
        _ => notation.typeset(&bound.to_string()),
    }
}

fn range_of(range: &Range, notation: Notation) -> String {
    let number = |bound: &Bound| match (&bound.name, &bound.offset) {
        (None, Some((sign, number))) => {
            number.parse::<i64>().ok().map(|number| if *sign == Sign::Minus { -number } else { number })
        }
        _ => None,
    };
    let (low, high) = (bound(&range.low, notation), bound(&range.high, notation));
    if let (Some(first), Some(last)) = (number(&range.low), number(&range.high)) {
        if first == last {
            return braces(&low, notation);
        }
        if last == first + 1 {
            return braces(&[low, high].join(comma(notation)), notation);
        }
    }
    let dots = notation.choose(", …, ", ",\\ldots,", "<mo>,</mo><mo>…</mo><mo>,</mo>");
    braces(&format!("{low}{dots}{high}"), notation)
}

fn braces(inside: &str, notation: Notation) -> String {
    match notation {
        Notation::Unicode => format!("{{{inside}}}"),
        Notation::Latex => format!("\\{{{inside}\\}}"),
        Notation::MathMl => {
            let bracket = |sign, side| format!("<mo stretchy=\"false\" form=\"{side}\">{sign}</mo>");
            format!("{}{inside}{}", bracket("{", "prefix"), bracket("}", "postfix"))
        }
    }
}

fn domain(domain: &Domain, notation: Notation) -> String {
    let comma = comma(notation);
    let reals = notation.choose("ℝ", "\\mathbb{R}", "<mi>ℝ</mi>");
    match &domain.kind {
        DomainKind::Named(name) if name.text == "bool" => {
            braces(&["false", "true"].map(|value| notation.label(value)).join(comma), notation)
        }
        DomainKind::Named(name) if name.text == "real" => reals.to_owned(),
        DomainKind::Named(name) => notation.word(&name.text),
        DomainKind::Listed(name, lengths) if name.text == "real" && lengths.len() == 1 => {
            let length = notation.typeset(&lengths[0].to_string());
            match notation {
                Notation::Unicode => format!("ℝ^{length}"),
                Notation::Latex => format!("{reals}^{{{length}}}"),
                Notation::MathMl => format!("<msup>{reals}<mrow>{length}</mrow></msup>"),
            }
        }
        DomainKind::Listed(name, edges) => {
            let edges: Vec<_> = edges.iter().map(|edge| notation.typeset(&edge.to_string())).collect();
            let words = text(notation, &format!("{} between", name.text));
            format!("{words}{}{}", super::space(notation), edges.join(comma))
        }
        DomainKind::Divided(name, numbers) => match numbers.as_slice() {
            [low, high, count] => {
                let [low, high, count] = [low, high, count].map(|one| notation.typeset(&one.to_string()));
                let words = if name.text == "circle" { "bins of the circle from" } else { "bins from" };
                let blank = super::space(notation);
                let (words, to) = (text(notation, words), text(notation, "to"));
                format!("{count}{blank}{words}{blank}{low}{blank}{to}{blank}{high}")
            }
            _ => notation.typeset(&domain.to_string()),
        },
        DomainKind::Range(range) => range_of(range, notation),
        DomainKind::Labels(labels, range) => {
            let labels: Vec<_> = labels.iter().map(|label| notation.label(&label.text)).collect();
            let labels = braces(&labels.join(comma), notation);
            match range {
                None => labels,
                Some(range) => {
                    let with = notation.choose(" ∪ ", " \\cup ", "<mo>∪</mo>");
                    format!("{labels}{with}{}", range_of(range, notation))
                }
            }
        }
    }
}

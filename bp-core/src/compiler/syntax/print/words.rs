//! The parts that fit on a line: names, domains, factors, asks, expressions.
//!
//! In: nodes of the tree. Out: `Display` for each, in normal spacing. Invariant: printed text parses to an equal
//! node; two variables are separated by a comma only if one of them has a value or an index.

use crate::spelling::quoted;
use crate::syntax::ast::*;
use std::fmt::{Display, Formatter, Result};

/// Items with a separator between them.
pub(super) fn list<T: Display>(items: &[T], separator: &str) -> String {
    items.iter().map(T::to_string).collect::<Vec<_>>().join(separator)
}

impl Display for Name {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        f.write_str(&quoted(&self.text))
    }
}

impl Display for Space {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        match self {
            Space::Set(name) => name.fmt(f),
            Space::Range(range) => range.fmt(f),
        }
    }
}

impl Display for Range {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        write!(f, "{}..={}", self.low, self.high)
    }
}

impl Display for Bound {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        let blank = if self.name.is_some() { " " } else { "" };
        if let Some(name) = &self.name {
            name.fmt(f)?;
        }
        match &self.offset {
            Some((Sign::Plus, number)) => write!(f, "{blank}+{blank}{number}"),
            Some((Sign::Minus, number)) => write!(f, "{blank}-{blank}{number}"),
            Some((Sign::None, number)) => f.write_str(number),
            None => Ok(()),
        }
    }
}

impl Display for Declared {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        self.name.fmt(f)?;
        if let Some(family) = &self.family {
            f.write_str("[")?;
            if let Some(index) = &family.index {
                write!(f, "{index} in ")?;
            }
            family.space.fmt(f)?;
            if let Some(except) = &family.except {
                write!(f, " except {except}")?;
            }
            f.write_str("]")?;
        }
        f.write_str(if self.before { "^-1" } else { "" })
    }
}

impl Display for Domain {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        match &self.kind {
            DomainKind::Named(name) => name.fmt(f),
            DomainKind::Listed(name, numbers) => write!(f, "{name}[{}]", list(numbers, ", ")),
            DomainKind::Divided(name, numbers) => write!(f, "{name}({})", list(numbers, ", ")),
            DomainKind::Range(range) => range.fmt(f),
            DomainKind::Labels(labels, None) => write!(f, "{{ {} }}", list(labels, ", ")),
            DomainKind::Labels(labels, Some(range)) => write!(f, "{{ {} }} or {range}", list(labels, ", ")),
        }
    }
}

impl Display for Occurrence {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        self.name.fmt(f)?;
        if !self.index.is_empty() {
            write!(f, "[{}]", list(&self.index, ", "))?;
        }
        f.write_str(if self.before { "^-1" } else { "" })
    }
}

impl Display for Factor {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        let left = list(&self.left, " ");
        let left = if self.initial { format!("initial({left})") } else { left };
        write!(f, "P({left}")?;
        if !self.right.is_empty() {
            write!(f, " | {}", list(&self.right, " "))?;
        }
        f.write_str(")")
    }
}

impl Display for Value {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        match &self.kind {
            ValueKind::Number(Sign::None, number) => f.write_str(number),
            ValueKind::Number(Sign::Plus, number) => write!(f, "+{number}"),
            ValueKind::Number(Sign::Minus, number) => write!(f, "-{number}"),
            ValueKind::Boolean(value) => value.fmt(f),
            ValueKind::Name(name) => name.fmt(f),
            ValueKind::List(values) => write!(f, "[{}]", list(values, ", ")),
        }
    }
}

impl Display for Item {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        match &self.subject {
            Subject::Variable(variable) => variable.fmt(f)?,
            Subject::Slice(name, range) => write!(f, "{name}[{range}]")?,
            Subject::Term(term) => term.fmt(f)?,
        }
        match &self.evidence {
            None => Ok(()),
            Some(Finding::Hard(value)) => write!(f, " = {value}"),
            Some(Finding::Virtual(weights)) => write!(f, " virtual [{}]", list(weights, ", ")),
            Some(Finding::Soft(weights)) => write!(f, " soft [{}]", list(weights, ", ")),
        }
    }
}

impl Display for Word {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        let amounts: Vec<&str> = self.amounts.iter().map(|(_, text)| text.as_str()).collect();
        match amounts.as_slice() {
            [] => self.name.fmt(f),
            all => write!(f, "{}({})", self.name, all.join(", ")),
        }
    }
}

impl Display for Distribution {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        let items = |items: &[Item]| {
            let plain =
                items.iter().all(|item| item.evidence.is_none() && !matches!(item.subject, Subject::Term(_)));
            list(items, if plain { " " } else { ", " })
        };
        write!(f, "P({}", items(&self.searched))?;
        if !self.known.is_empty() {
            let blank = if self.searched.is_empty() { "" } else { " " };
            write!(f, "{blank}| {}", items(&self.known))?;
        }
        f.write_str(")")
    }
}

impl Display for Ask {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        let words = |words: &[Word]| words.iter().map(|word| format!("{word} ")).collect::<String>();
        write!(f, "{}{}", words(&self.words), self.distribution)?;
        if let Some(from) = &self.from {
            write!(f, " from {}{}", words(&from.words), from.distribution)?;
        }
        match &self.nearest {
            Some(nearest) => write!(f, " nearest {nearest}"),
            None => Ok(()),
        }
    }
}

impl Display for Pattern {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        match &self.kind {
            PatternKind::Any => f.write_str("_"),
            PatternKind::Value(value) => value.fmt(f),
            PatternKind::Range(low, high) => write!(f, "{low}..={high}"),
        }
    }
}

impl Display for Segment {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        self.name.fmt(f)?;
        if self.index.is_empty() { Ok(()) } else { write!(f, "[{}]", list(&self.index, ", ")) }
    }
}

impl Display for Expr {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        match &self.kind {
            ExprKind::Number(number) => f.write_str(number),
            ExprKind::Boolean(value) => value.fmt(f),
            ExprKind::Name(name) => name.fmt(f),
            ExprKind::Call(name, arguments) => write!(f, "{name}({})", list(arguments, ", ")),
            ExprKind::Index(of, index) => write!(f, "{of}[{}]", list(index, ", ")),
            ExprKind::Before(of) => write!(f, "{of}^-1"),
            ExprKind::Field(of, name) => write!(f, "{of}.{name}"),
            ExprKind::Answer { of, searched, known } if known.is_empty() => {
                write!(f, "{of}.P({})", list(searched, " "))
            }
            ExprKind::Answer { of, searched, known } => {
                write!(f, "{of}.P({} | {})", list(searched, " "), list(known, " "))
            }
            ExprKind::First { family, with, index } => write!(f, "first({family} with {with} at {index})"),
            ExprKind::Unary(UnaryOp::Minus, operand) => write!(f, "-{operand}"),
            ExprKind::Unary(UnaryOp::Not, operand) => write!(f, "not {operand}"),
            ExprKind::Binary(op, left, right) => write!(f, "{left} {} {right}", op.text()),
            ExprKind::Group(inner) => write!(f, "({inner})"),
            ExprKind::Vector(entries) => write!(f, "[{}]", list(entries, ", ")),
            ExprKind::If(choice) => {
                for (condition, body) in &choice.branches {
                    write!(f, "if {condition} {{ {body} }} else ")?;
                }
                write!(f, "{{ {} }}", choice.otherwise)
            }
            ExprKind::Match(choice) => {
                let arms: Vec<_> =
                    choice.arms.iter().map(|(pattern, body)| format!("{pattern} => {body}")).collect();
                write!(f, "match {} {{ {} }}", choice.on, arms.join(", "))
            }
        }
    }
}

//! Plate, parameters, variables and their domains.
//!
//! In: the first sections of a program. Out: sets, parameters and variables of the model, and the meaning of their
//! names. Invariant: an undeclared capitalised name, used as a set, is a set given at run time; any other undeclared
//! name is an error.

use super::names::{did_you_mean, listed, otherwise_called};
use super::{Checker, Meaning, constant, integer};
use crate::diagnostic::Diagnostic;
use crate::ids::{ParameterId, SetId};
use crate::model::{Bound, Domain, Family, IndexSpace, ParameterKind, Range, SetKind};
use crate::syntax::ast::{self, ExprKind, Name};

/// Domains by other names, and how they are written here.
const ELSEWHERE: [(&str, &str); 4] = [
    ("boolean logical binary truth", "`bool`"),
    ("int integer whole natural count", "the range of its values, as `0..=10`"),
    ("float double number f64 continuous", "`real`, or `bins(low, high, count)`"),
    ("enum string label categorical", "the values themselves: `{ Red, Green }`"),
];

const KINDS: [&str; 4] = ["probability", "real", "size", "integer"];

impl Checker<'_> {
    pub(super) fn plate(&mut self, plate: &ast::Plate) {
        let Some(set) = self.set(&plate.set) else { return };
        let index = self.model.plate(&plate.index.text, set);
        self.variable_spans.insert(index, plate.index.span());
        self.declare(&plate.index, Meaning::Variable(index));
    }

    /// The set of this name: declared, or given at run time.
    pub(super) fn set(&mut self, name: &Name) -> Option<SetId> {
        match self.meaning(&name.text) {
            Some(Meaning::Set(set)) => return Some(set),
            Some(_) => {
                let message = format!("expected a set, but `{}` is something else", name.text);
                let first = self.names[&name.text].1;
                self.wrong.push(Diagnostic::new(name.span(), message).with_label(first, "declared here"));
                return None;
            }
            None => {}
        }
        let lower = name.text.to_lowercase();
        if !name.text.starts_with(char::is_uppercase) || ["bool", "real"].contains(&lower.as_str()) {
            let sets = self.model.so_far().sets.values().map(|set| set.name.as_str());
            let known: Vec<&str> = ["bool", "real"].into_iter().chain(sets).collect();
            let help = if ["bool", "real"].contains(&lower.as_str()) {
                format!("did you mean `{lower}`?")
            } else {
                let here =
                    otherwise_called(&name.text, &ELSEWHERE).or_else(|| did_you_mean(&name.text, known));
                here.unwrap_or_else(|| {
                    "a domain is `bool`, `real`, `real[3]`, `{ A, B }`, `1..=N`, `bins(low, high, count)`, \
                     `circle(low, high, count)`, or a set with a capital"
                        .to_owned()
                })
            };
            self.complain_and_help(name.span(), format!("`{}` is not a domain or a set", name.text), help);
            return None;
        }
        let set = self.model.set(&name.text, SetKind::Plain);
        self.names.insert(name.text.clone(), (Meaning::Set(set), name.span()));
        Some(set)
    }

    pub(super) fn parameter(&mut self, parameter: &ast::Parameter) {
        let kind = match parameter.kind.text.as_str() {
            "probability" => ParameterKind::Probability,
            "real" => ParameterKind::Real,
            "size" => ParameterKind::Size,
            "integer" => ParameterKind::Integer,
            other if other.starts_with(char::is_uppercase) => {
                self.set(&parameter.kind).map_or(ParameterKind::Real, ParameterKind::Element)
            }
            other => {
                let message =
                    format!("`{other}` is not a kind of parameter; the kinds are {}", listed(KINDS, "and"));
                let mut wrong = Diagnostic::new(parameter.kind.span(), message);
                wrong.help = did_you_mean(other, KINDS);
                self.wrong.push(wrong);
                // The name is declared anyway, so that its uses are not errors too.
                ParameterKind::Real
            }
        };
        let default = parameter.default.as_ref().map_or_else(Vec::new, |written| self.numbers_known(written));
        for (name, spaces) in &parameter.names {
            let over: Vec<IndexSpace> = spaces.iter().filter_map(|space| self.space(space)).collect();
            let id = self.model.parameter_over(&name.text, kind, default.clone(), over);
            let span = parameter.default.as_ref().map_or(name.span(), ast::Expr::span);
            if let Some(written) = &parameter.default {
                self.rows_fit(name, written, id);
            }
            self.parameter_spans.insert(id, span);
            self.declare(name, Meaning::Parameter(id));
        }
    }

    /// The value of a parameter: a number, or a list with one for each element of its range; of two ranges also a list
    /// of rows.
    fn numbers_known(&mut self, written: &ast::Expr) -> Vec<f64> {
        let entries: Vec<&ast::Expr> = parts(written).into_iter().flat_map(parts).collect();
        let mut numbers = Vec::new();
        for entry in entries {
            match constant(entry) {
                Some(number) => numbers.push(number),
                None => {
                    self.complain(
                        entry.span(),
                        "the value of a parameter must be a number that is known here",
                    );
                    return Vec::new();
                }
            }
        }
        numbers
    }

    /// A list of rows has the rows of a parameter, as far as its sizes are known.
    fn rows_fit(&mut self, name: &Name, written: &ast::Expr, parameter: ParameterId) {
        let rows: Vec<usize> = parts(written).into_iter().map(|row| parts(row).len()).collect();
        let is_row = |row: &&ast::Expr| matches!(row.kind, ExprKind::Vector(_));
        let counts = self.model.so_far().parameters[parameter].over.iter();
        let counts: Vec<Option<usize>> = counts.map(|over| self.model.so_far().index_count(over)).collect();
        let ([high, wide], true) = (counts.as_slice(), parts(written).iter().any(is_row)) else { return };
        let (least, most) = (rows.iter().min().copied(), rows.iter().max().copied());
        let fits = high.is_none_or(|high| rows.len() == high)
            && wide.is_none_or(|wide| least == Some(wide) && most == Some(wide));
        let message = match (high, wide, least, most) {
            (_, _, Some(least), Some(most)) if fits && least != most => {
                format!("the rows of `{}` have different lengths: {least} and {most}", name.text)
            }
            (_, _, Some(wide), _) if fits => {
                return self.model.default_rows(parameter, vec![rows.len(), wide]);
            }
            (Some(high), Some(wide), ..) => {
                format!("`{}` has {high} rows of {wide} numbers, but this list has other rows", name.text)
            }
            (None, Some(wide), ..) => {
                format!("`{}` has rows of {wide} numbers, but this list has other rows", name.text)
            }
            (Some(high), None, ..) => {
                format!("`{}` has {high} rows, but this list has {}", name.text, rows.len())
            }
            _ => return,
        };
        self.complain(written.span(), message);
    }

    pub(super) fn space(&mut self, space: &ast::Space) -> Option<IndexSpace> {
        match space {
            ast::Space::Set(name) => self.set(name).map(IndexSpace::Set),
            ast::Space::Range(range) => self.range(range).map(IndexSpace::Range),
        }
    }

    pub(super) fn range(&mut self, range: &ast::Range) -> Option<Range> {
        let (low, high) = (self.bound(&range.low), self.bound(&range.high));
        let (low, high) = (low?, high?);
        if low.size.is_some() {
            let message = "the first value of a range must be a number";
            self.complain_and_help(range.low.at.0, message, "only the last may be a parameter");
            return None;
        }
        if high.size.is_none() && high.offset < low.offset {
            let message =
                format!("the range `{range}` is empty: {} is less than {}", high.offset, low.offset);
            self.complain(range.at.0, message);
            return None;
        }
        Some(Range { low: low.offset, high })
    }

    fn bound(&mut self, bound: &ast::Bound) -> Option<Bound> {
        let offset = match &bound.offset {
            None => 0,
            Some((sign, text)) => match integer(*sign, text) {
                Some(offset) => offset,
                None => {
                    let large = text.chars().all(|digit| digit.is_ascii_digit() || digit == '_');
                    let message = match large {
                        true => format!(
                            "a bound lies between −1099511627776 and 1099511627776 (2^40), but this is `{bound}`"
                        ),
                        false => format!("a bound must be a whole number, but this is `{bound}`"),
                    };
                    self.complain(bound.at.0, message);
                    return None;
                }
            },
        };
        let Some(name) = &bound.name else { return Some(Bound::constant(offset)) };
        let kind_of = |checker: &Self, id| checker.model.so_far().parameters[id].kind;
        match self.meaning(&name.text) {
            Some(Meaning::Parameter(id)) if kind_of(self, id) == ParameterKind::Size => {
                Some(Bound { size: Some(id), offset })
            }
            Some(_) => {
                let first = self.names[&name.text].1;
                let message = format!("a bound must be a number or a `size`, but `{}` is neither", name.text);
                let wrong = Diagnostic::new(name.span(), message).with_label(first, "declared here");
                self.wrong
                    .push(wrong.with_help(format!("declare it: `parameters {{ {} : size; }}`", name.text)));
                None
            }
            None => {
                let sizes =
                    self.model.so_far().parameters.values().filter(|known| known.kind == ParameterKind::Size);
                let help = did_you_mean(&name.text, sizes.map(|known| known.name.as_str()))
                    .unwrap_or_else(|| format!("declare it: `parameters {{ {} : size; }}`", name.text));
                self.complain_and_help(name.span(), format!("unknown name `{}`", name.text), help);
                None
            }
        }
    }

    pub(super) fn declaration(&mut self, declaration: &ast::Declaration) {
        let domain = self.domain(&declaration.domain);
        for declared in &declaration.variables {
            self.declared(declared, domain.clone());
        }
    }

    fn declared(&mut self, declared: &ast::Declared, domain: Option<Domain>) {
        let name = &declared.name;
        let broken = domain.is_none();
        let domain = domain.unwrap_or(Domain::Boolean);
        if declared.before {
            return self.declared_before(declared, &domain, broken);
        }
        let family = declared.family.as_ref().map(|family| self.family(family));
        let id = match family {
            None => self.model.variable(&name.text, domain),
            Some(Some(family)) => self.model.family(&name.text, domain, family),
            Some(None) => {
                // A family with an unknown range: its name is declared, and no further errors are reported for it.
                let over = IndexSpace::Range(Range { low: 1, high: Bound::constant(1) });
                let id = self.model.family(&name.text, domain, Family { over, except: None });
                self.broken_variables.insert(id);
                id
            }
        };
        if broken {
            self.broken_variables.insert(id);
            self.untyped.insert(name.text.clone());
        }
        self.variable_spans.insert(id, declared.at.0);
        if !self.declare(name, Meaning::Variable(id)) {
            self.broken_variables.insert(id);
        }
    }

    fn declared_before(&mut self, declared: &ast::Declared, domain: &Domain, broken: bool) {
        let name = &declared.name;
        let Some(Meaning::Variable(of)) = self.meaning(&name.text) else {
            let message =
                format!("`{0}^-1` is `{0}` at the previous instant, but there is no `{0}`", name.text);
            self.complain_and_help(declared.at.0, message, format!("declare `{}` first", name.text));
            return;
        };
        let expected = &self.model.so_far().variables[of].domain;
        if expected != domain && !broken && !self.broken_variables.contains(&of) {
            let text = self.model.so_far().domain_text(expected);
            let message = format!("`{0}^-1` must have the domain of `{0}`, which is `{text}`", name.text);
            self.complain(declared.at.0, message);
        }
        let id = self.model.previous(of);
        if self.variable_spans.insert(id, declared.at.0).is_some() {
            self.complain(declared.at.0, format!("`{}^-1` is declared twice", name.text));
        }
    }

    fn family(&mut self, family: &ast::Family) -> Option<Family> {
        let over = self.space(&family.space)?;
        let except = match &family.except {
            None => None,
            Some(name) => match self.meaning(&name.text) {
                Some(Meaning::Variable(id)) => {
                    let domain = &self.model.so_far().variables[id].domain;
                    let same = match (&over, domain) {
                        (IndexSpace::Set(set), Domain::Set(of)) => set == of,
                        (IndexSpace::Range(range), Domain::Finite { labels, range: Some(of) }) => {
                            labels.is_empty() && range == of
                        }
                        _ => false,
                    };
                    if !same && !self.broken_variables.contains(&id) {
                        let text = self.model.so_far().domain_text(domain);
                        let message = format!(
                            "`except {}` leaves out one element, but `{}` is `{text}` and the family runs over `{}`",
                            name.text, name.text, family.space
                        );
                        self.complain(name.span(), message);
                        return None;
                    }
                    Some(id)
                }
                _ => {
                    let message =
                        format!("`except` needs a variable declared before, but `{}` is not one", name.text);
                    self.complain(name.span(), message);
                    return None;
                }
            },
        };
        Some(Family { over, except })
    }
}

/// The entries of a list; what is no list is one entry.
fn parts(of: &ast::Expr) -> Vec<&ast::Expr> {
    match &of.kind {
        ExprKind::Vector(parts) => parts.iter().collect(),
        _ => vec![of],
    }
}

//! Domains: the values that a variable may take.
//!
//! In: a domain as written. Out: a [`Domain`], or `None` after a reported error. Invariant: the numbers in a domain are
//! known where it is written; only the last value of a range may be a parameter.

use super::names::did_you_mean;
use super::{Checker, constant};
use crate::diagnostic::Diagnostic;
use crate::model::{Bins, Domain, MOST_BINS};
use crate::source::Span;
use crate::syntax::ast::{self, DomainKind, Expr, Name};
use std::collections::HashSet;

const LONGEST_VECTOR: usize = 1024;

impl Checker<'_> {
    pub(super) fn domain(&mut self, domain: &ast::Domain) -> Option<Domain> {
        let span = domain.at.0;
        match &domain.kind {
            DomainKind::Named(name) => match name.text.as_str() {
                "bool" => Some(Domain::Boolean),
                "real" => Some(Domain::Real),
                "bins" | "circle" => {
                    let help = format!("write `{name}(low, high, count)`");
                    self.complain_and_help(span, format!("`{name}` needs its bounds"), help);
                    None
                }
                _ => self.set(name).map(Domain::Set),
            },
            DomainKind::Listed(name, numbers) => self.listed_domain(span, name, numbers),
            DomainKind::Divided(name, numbers) => self.divided_domain(span, name, numbers),
            DomainKind::Range(range) => {
                let range = self.range(range)?;
                Some(Domain::Finite { labels: Vec::new(), range: Some(range) })
            }
            DomainKind::Labels(names, range) => {
                let range = match range {
                    Some(range) => Some(self.range(range)?),
                    None => None,
                };
                let mut labels: Vec<String> = Vec::new();
                let mut known: HashSet<&str> = HashSet::new();
                for name in names {
                    match known.insert(&name.text) {
                        true => labels.push(name.text.clone()),
                        false => {
                            self.complain(name.span(), format!("the value `{}` is listed twice", name.text));
                        }
                    }
                }
                Some(Domain::Finite { labels, range })
            }
        }
    }

    /// `real[3]`, `bins[0, 1, 5]`
    fn listed_domain(&mut self, span: Span, name: &Name, written: &[Expr]) -> Option<Domain> {
        let numbers = self.known_numbers(written)?;
        match name.text.as_str() {
            "real" => {
                let length = match numbers.as_slice() {
                    [length] if length.fract() == 0.0 && *length >= 1.0 => *length as usize,
                    _ => 0,
                };
                let fits = (1..=LONGEST_VECTOR).contains(&length);
                if !fits {
                    self.complain(span, format!("a vector has between 1 and {LONGEST_VECTOR} components"));
                }
                fits.then_some(Domain::Vector(length))
            }
            "bins" => {
                let bins = Bins::between(numbers);
                if bins.is_none() {
                    let message =
                        "the edges of bins are two numbers or more, each greater than the one before";
                    self.complain_and_help(
                        span,
                        message,
                        "for bins of equal width write `bins(low, high, count)`",
                    );
                }
                bins.map(Domain::Bins)
            }
            other => {
                let message =
                    format!("only `real` and `bins` take numbers in brackets, but this is `{other}[…]`");
                let help = did_you_mean(other, ["real", "bins"]);
                self.wrong.push(Diagnostic { help, ..Diagnostic::new(span, message) });
                None
            }
        }
    }

    /// `bins(-50, 50, 20)`, `circle(0, 360, 36)`
    fn divided_domain(&mut self, span: Span, name: &Name, written: &[Expr]) -> Option<Domain> {
        let known = ["bins", "circle"];
        if !known.contains(&name.text.as_str()) {
            let message =
                format!("`{name}(…)` is not a domain; `bins` and `circle` take a low, a high and a count");
            let help = did_you_mean(&name.text, known);
            self.wrong.push(Diagnostic { help, ..Diagnostic::new(name.span(), message) });
            return None;
        }
        let numbers = self.known_numbers(written)?;
        let [low, high, count] = numbers.as_slice() else {
            let message =
                format!("`{name}` takes a low, a high and a count, found {} numbers", numbers.len());
            self.complain_and_help(span, message, format!("write `{name}(0, 360, 36)`"));
            return None;
        };
        let whole = count.fract() == 0.0 && (1.0..=MOST_BINS as f64).contains(count);
        let bins = whole.then(|| Bins::even(*low, *high, *count as usize, name.text == "circle")).flatten();
        if bins.is_none() {
            let message = match whole {
                true => format!("`{name}` needs low < high, but {low} is not less than {high}"),
                false => {
                    format!("the count of `{name}` is a whole number from 1 to {MOST_BINS}, found {count}")
                }
            };
            self.complain(span, message);
        }
        bins.map(Domain::Bins)
    }

    fn known_numbers(&mut self, written: &[Expr]) -> Option<Vec<f64>> {
        let mut numbers = Vec::new();
        for entry in written {
            match constant(entry) {
                Some(number) => numbers.push(number),
                None => {
                    self.complain(
                        entry.span(),
                        format!("a domain is made of numbers known here, but this is `{entry}`"),
                    );
                    return None;
                }
            }
        }
        Some(numbers)
    }
}

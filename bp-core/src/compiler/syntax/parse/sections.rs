//! Programs and their sections, from pairs to the tree.
//!
//! In: pair `program` and its content. Out: [`Program`]. Invariant: only blanks, commas between variables, and comments
//! are dropped; comments are attached afterwards.

use super::children::{Children, at};
use super::expressions::{expression, expressions};
use super::forms::definition;
use super::grammar::Rule;
use crate::syntax::ast::*;
use pest::iterators::Pair;

/// A program from its pair.
pub(super) fn program(pair: Pair<'_, Rule>) -> Program {
    let place = at(&pair);
    let mut children = Children::of(pair);
    let name = children.name();
    let plate = children.take(Rule::plate).map(|pair| {
        let mut children = Children::of(pair);
        Plate { index: children.name(), set: children.name() }
    });
    let sections = std::iter::from_fn(|| children.any()).map(section).collect();
    Program { at: place, comments: Comments::default(), name, plate, sections, closing: Vec::new() }
}

fn section(pair: Pair<'_, Rule>) -> Section {
    let place = at(&pair);
    let rule = pair.as_rule();
    let mut children = Children::of(pair);
    let kind = match rule {
        Rule::parameters => {
            SectionKind::Parameters(children.all(Rule::parameter).into_iter().map(parameter).collect())
        }
        Rule::variables => {
            SectionKind::Variables(children.all(Rule::declaration).into_iter().map(declaration).collect())
        }
        Rule::decomposition => SectionKind::Decomposition(terms(children)),
        Rule::forms => {
            SectionKind::Forms(children.all(Rule::definition).into_iter().map(definition).collect())
        }
        Rule::identification => {
            SectionKind::Identification(children.all(Rule::learnt).into_iter().map(learnt).collect())
        }
        _ => {
            let name = children.name();
            SectionKind::Question { name, asks: children.all(Rule::ask).into_iter().map(ask).collect() }
        }
    };
    Section { at: place, comments: Comments::default(), kind, closing: Vec::new() }
}

fn parameter(pair: Pair<'_, Rule>) -> Parameter {
    let place = at(&pair);
    let mut children = Children::of(pair);
    let names = children.all(Rule::parameter_name).into_iter().map(|pair| {
        let mut children = Children::of(pair);
        (children.name(), children.all(Rule::space).into_iter().map(space).collect())
    });
    let names = names.collect();
    let kind = children.name();
    let default = children.take(Rule::expression).map(expression);
    Parameter { at: place, comments: Comments::default(), names, kind, default }
}

fn space(pair: Pair<'_, Rule>) -> Space {
    let mut children = Children::of(pair);
    match children.take(Rule::range) {
        Some(pair) => Space::Range(range(pair)),
        None => Space::Set(children.name()),
    }
}

fn range(pair: Pair<'_, Rule>) -> Range {
    let place = at(&pair);
    let mut children = Children::of(pair);
    Range { at: place, low: bound(children.one()), high: bound(children.one()) }
}

fn bound(pair: Pair<'_, Rule>) -> Bound {
    let place = at(&pair);
    let mut children = Children::of(pair);
    let name = children.take(Rule::name).map(|pair| super::children::name(&pair));
    let sign = sign(&mut children);
    let offset = children.take(Rule::number).map(|pair| (sign, pair.as_str().to_owned()));
    Bound { at: place, name, offset }
}

fn sign(children: &mut Children<'_>) -> Sign {
    match children.take(Rule::sign) {
        Some(pair) if pair.as_str().starts_with('-') => Sign::Minus,
        Some(_) => Sign::Plus,
        None => Sign::None,
    }
}

fn declaration(pair: Pair<'_, Rule>) -> Declaration {
    let place = at(&pair);
    let mut children = Children::of(pair);
    let variables = children.all(Rule::declared).into_iter().map(declared).collect();
    Declaration { at: place, comments: Comments::default(), variables, domain: domain(children.one()) }
}

fn declared(pair: Pair<'_, Rule>) -> Declared {
    let place = at(&pair);
    let mut children = Children::of(pair);
    let name = children.name();
    let family = children.take(Rule::family).map(|pair| {
        let place = at(&pair);
        let mut children = Children::of(pair);
        let index = children.take(Rule::name).map(|pair| super::children::name(&pair));
        let space = space(children.need(Rule::space));
        let except = children.take(Rule::except).map(|pair| Children::of(pair).name());
        Family { at: place, index, space, except }
    });
    Declared { at: place, name, family, before: children.take(Rule::before).is_some() }
}

fn domain(pair: Pair<'_, Rule>) -> Domain {
    let place = at(&pair);
    let mut children = Children::of(pair);
    let kind = if let Some(labels) = children.take(Rule::labels) {
        DomainKind::Labels(Children::of(labels).names(), children.take(Rule::range).map(range))
    } else if let Some(pair) = children.take(Rule::range) {
        DomainKind::Range(range(pair))
    } else {
        let name = children.name();
        if let Some(numbers) = children.take(Rule::index) {
            DomainKind::Listed(name, expressions(numbers))
        } else if let Some(numbers) = children.take(Rule::arguments) {
            DomainKind::Divided(name, expressions(numbers))
        } else {
            DomainKind::Named(name)
        }
    };
    Domain { at: place, kind }
}

fn terms(mut children: Children<'_>) -> Vec<Term> {
    let pairs = std::iter::from_fn(|| children.any());
    let build = |pair: Pair<'_, Rule>| match pair.as_rule() {
        Rule::product => Term::Product(Box::new(product(pair))),
        _ => Term::Factor(factor(pair)),
    };
    pairs.map(build).collect()
}

fn product(pair: Pair<'_, Rule>) -> Product {
    let place = at(&pair);
    let mut children = Children::of(pair);
    let index = children.name();
    let space = children.take(Rule::space).map(space);
    Product { at: place, comments: Comments::default(), index, space, terms: terms(children) }
}

/// `P(left | right)`, `P(initial(X) | right)`
pub(super) fn factor(pair: Pair<'_, Rule>) -> Factor {
    let place = at(&pair);
    let mut children = Children::of(pair);
    let initial = children.take(Rule::initial);
    let is_initial = initial.is_some();
    let left = match initial {
        Some(initial) => Children::of(initial).take(Rule::occurrences).map(occurrences).unwrap_or_default(),
        None => occurrences(children.one()),
    };
    let right = children.take(Rule::occurrences).map(occurrences).unwrap_or_default();
    Factor { at: place, comments: Comments::default(), initial: is_initial, left, right }
}

/// The variables of a list.
pub(super) fn occurrences(pair: Pair<'_, Rule>) -> Vec<Occurrence> {
    Children::of(pair).all(Rule::occurrence).into_iter().map(occurrence).collect()
}

/// `X`, `X[i]`, `X^-1`; `X[i]^-1` is also written `X^-1[i]`
pub(super) fn occurrence(pair: Pair<'_, Rule>) -> Occurrence {
    let place = at(&pair);
    let mut children = Children::of(pair);
    let name = children.name();
    let first = children.take(Rule::before).is_some();
    let index = children.take(Rule::index).map(expressions).unwrap_or_default();
    Occurrence { at: place, name, index, before: first || children.take(Rule::before).is_some() }
}

fn learnt(pair: Pair<'_, Rule>) -> Learnt {
    let place = at(&pair);
    let mut children = Children::of(pair);
    if let Some(hidden) = children.take(Rule::hidden) {
        let names = Children::of(hidden).names();
        return Learnt { at: place, comments: Comments::default(), names, from: None, by: Vec::new() };
    }
    let mut names = children.names();
    // In the grammar the data set follows the names; the keyword between them is not a child.
    let from = names.pop().expect("internal: the grammar promises the data's name");
    let by = children.take(Rule::by).map(|pair| Children::of(pair).names()).unwrap_or_default();
    Learnt { at: place, comments: Comments::default(), names, from: Some(from), by }
}

/// One ask of a question.
pub(super) fn ask(pair: Pair<'_, Rule>) -> Ask {
    let place = at(&pair);
    let mut children = Children::of(pair);
    let words = children.all(Rule::word).into_iter().map(word).collect();
    let distribution = self::distribution(children.one());
    let from = children.take(Rule::from).map(|pair| {
        let mut children = Children::of(pair);
        let words = children.all(Rule::word).into_iter().map(word).collect();
        Second { words, distribution: self::distribution(children.one()) }
    });
    let nearest = children.take(Rule::nearest).map(|pair| Children::of(pair).name());
    Ask { at: place, comments: Comments::default(), words, distribution, from, nearest }
}

fn word(pair: Pair<'_, Rule>) -> Word {
    let place = at(&pair);
    let mut children = Children::of(pair);
    let name = children.name();
    let amounts = children.all(Rule::amount).into_iter();
    let amounts = amounts.map(|pair| (at(&pair), pair.as_str().to_owned())).collect();
    Word { at: place, name, amounts }
}

fn distribution(pair: Pair<'_, Rule>) -> Distribution {
    let place = at(&pair);
    let mut children = Children::of(pair);
    let mut items = |rule| match children.take(rule) {
        Some(pair) => Children::of(pair).all(Rule::item).into_iter().map(item).collect(),
        None => Vec::new(),
    };
    Distribution { at: place, searched: items(Rule::searched), known: items(Rule::known) }
}

fn item(pair: Pair<'_, Rule>) -> Item {
    let place = at(&pair);
    let mut children = Children::of(pair);
    let pair = children.one();
    let subject = match pair.as_rule() {
        Rule::term => Subject::Term(expression(pair)),
        Rule::slice => {
            let mut children = Children::of(pair);
            Subject::Slice(children.name(), range(children.need(Rule::range)))
        }
        _ => Subject::Variable(occurrence(pair)),
    };
    let evidence = children.any().map(|pair| match pair.as_rule() {
        Rule::value => Finding::Hard(value(pair)),
        Rule::likelihoods => Finding::Virtual(expressions(pair)),
        _ => Finding::Soft(expressions(pair)),
    });
    Item { at: place, subject, evidence }
}

/// A value from its pair.
pub(super) fn value(pair: Pair<'_, Rule>) -> Value {
    let place = at(&pair);
    let mut children = Children::of(pair);
    let sign = sign(&mut children);
    let kind = if let Some(pair) = children.take(Rule::number) {
        ValueKind::Number(sign, pair.as_str().to_owned())
    } else if let Some(pair) = children.take(Rule::boolean) {
        ValueKind::Boolean(pair.as_str() == "true")
    } else if let Some(pair) = children.take(Rule::name) {
        ValueKind::Name(super::children::name(&pair))
    } else {
        ValueKind::List(children.all(Rule::value).into_iter().map(value).collect())
    };
    Value { at: place, kind }
}

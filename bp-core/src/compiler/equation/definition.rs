//! The forms of factors as mathematics, to stand in their place.
//!
//! In: a factor, and the values that are bound. Out: text of the language, `normal(Y; A + 2 * X, 1)`, in which bound
//! names have their values. Invariant: the left-hand variable stands before the semicolon; a Dirac is the bracket that is 1
//! where its equation holds; a probability of a given value is the number.

use super::print::Line;
use super::printer::Printer;
use super::tokens::substituted;
use super::{Binding, Exact, Notation, Term, reachable};
use crate::ids::{ExpressionId, FactorId, VariableId};
use crate::model::{Domain, Factor, Form, Model, Value};
use crate::radix;
use crate::spelling::list;
use std::collections::{BTreeMap, HashMap};

/// Forms that are listed; of more, the others are counted.
const MOST: usize = 40;

/// Rows of a table that are written.
const MOST_ROWS: usize = 12;

/// The forms of these factors, each as an equation.
pub(crate) fn forms(model: &Model, factors: &[FactorId], notation: Notation) -> Vec<Line> {
    let mut lines: Vec<Line> = (factors.iter().take(MOST))
        .map(|id| {
            let factor = &model.factors[*id];
            let right = notation.typeset(&text(model, factor, &factor.form, None));
            let rest = rest(model, factor).map_or_else(String::new, |rest| format!(": {rest}"));
            let reason = format!("of `{}`, as the program has it{rest}", model.head(factor));
            ("form".to_owned(), reason, notation.equation(&notation.head(model, factor), "=", &right))
        })
        .collect();
    if factors.len() > MOST {
        let others = factors.len() - MOST;
        let dots = notation.text("…", "\\dots");
        lines.push(("forms".to_owned(), format!("{others} more factors have forms"), dots));
    }
    lines
}

/// What the equation of a form leaves out: the rows of a small table, and the form before the first step.
fn rest(model: &Model, factor: &Factor) -> Option<String> {
    let row = |row: &Vec<ExpressionId>| {
        row.iter().map(|id| model.expression_text(*id, &factor.products)).collect::<Vec<_>>().join(", ")
    };
    match &factor.form {
        Form::Table(rows) if (2..=MOST_ROWS).contains(&rows.len()) => {
            let domains: Vec<&Domain> =
                factor.right.iter().map(|use_| &model.variables[use_.variable].domain).collect();
            let counts = domains.iter().map(|domain| domain.count()).collect::<Option<Vec<_>>>()?;
            let rows = rows.iter().enumerate().map(|(place, entries)| {
                let ordinals = radix::in_order(place, counts.iter().copied());
                let keys = domains.iter().zip(ordinals).map(|(domain, ordinal)| domain.value_name(ordinal));
                format!("{}: {}", keys.collect::<Vec<_>>().join(", "), row(entries))
            });
            Some(rows.collect::<Vec<_>>().join("; "))
        }
        Form::Previous { otherwise, .. } if **otherwise != Form::Uniform => {
            Some(format!("before the first step it is {}", text(model, factor, otherwise, None)))
        }
        _ => None,
    }
}

/// A form as text of the language; `value` is the ordinal of the left-hand variable, if it is known.
fn text(model: &Model, factor: &Factor, form: &Form, value: Option<usize>) -> String {
    let expression = |id| model.expression_text(id, &factor.products);
    let list = |ids: &[_]| ids.iter().map(|id| expression(*id)).collect::<Vec<_>>().join(", ");
    let names: Vec<String> = factor.left.iter().map(|use_| model.use_name(use_, &factor.products)).collect();
    let left = names.join(" ");
    let count = model.variables[factor.left[0].variable].domain.count();
    match form {
        Form::Uniform => match count {
            Some(count) if count > 0 => format!("1 / {count}"),
            _ => format!("uniform({left})"),
        },
        Form::Flat => "1".to_owned(),
        Form::Bernoulli(p, _) => match value {
            Some(1) => format!("({})", expression(*p)),
            Some(0) => format!("(1 - ({}))", expression(*p)),
            _ => format!("bernoulli({left}; {})", expression(*p)),
        },
        Form::Categorical(entries) => match value.and_then(|value| entries.get(value)) {
            Some(entry) => format!("({})", expression(*entry)),
            None => format!("categorical({left}; {})", list(entries)),
        },
        Form::Table(rows) => match (rows.as_slice(), value) {
            ([row], Some(value)) if value < row.len() => format!("({})", expression(row[value])),
            ([row], None) => format!("categorical({left}; {})", list(row)),
            _ => format!("table({left}; {})", right(model, factor)),
        },
        Form::Constants(_) => format!("table({left}; {})", right(model, factor)),
        Form::Dirac(of) => match model.variables[factor.left[0].variable].domain {
            Domain::Vector(_) | Domain::Real => format!("dirac({left} - ({}))", expression(*of)),
            _ => format!("[{left} = {}]", expression(*of)),
        },
        Form::NormalVector { mean, .. } => {
            let whole = model.form_text(factor, form);
            let arguments = whole.split_once("normal(").map_or("", |(_, rest)| rest.trim_end_matches(')'));
            match arguments.is_empty() {
                true => format!("normal({left}; {})", expression(*mean)),
                false => format!("normal({left}; {arguments})"),
            }
        }
        Form::NormalBins { mean, deviation } => {
            format!("normal_bins({left}; {}, {})", expression(*mean), expression(*deviation))
        }
        Form::Multinomial { trials, probabilities } => {
            format!("multinomial({left}; {}, {})", expression(*trials), list(probabilities))
        }
        Form::Weights(weight) => format!("weights({left}; {})", expression(*weight)),
        Form::Law { arguments, .. } => format!("{}({left}; {})", form.name(), list(arguments)),
        Form::Dirichlet(entries) => format!("dirichlet({left}; {})", list(entries)),
        Form::Mixture(parts) => {
            let part = |(weight, part): &(_, Form)| {
                format!("{} * {}", expression(*weight), text(model, factor, part, value))
            };
            format!("({})", parts.iter().map(part).collect::<Vec<_>>().join(" + "))
        }
        Form::Truncated { form, low, high } => format!(
            "truncated({}, {}, {})",
            text(model, factor, form, None),
            expression(*low),
            expression(*high)
        ),
        Form::Ordered(form) => format!("ordered({})", text(model, factor, form, None)),
        Form::If { condition, then, otherwise } => format!(
            "(if {} {{ {} }} else {{ {} }})",
            expression(*condition),
            text(model, factor, then, value),
            text(model, factor, otherwise, value)
        ),
        Form::Previous { of, at, .. } => {
            let at = at.map_or_else(String::new, |at| format!(", {}", model.spelled(at)));
            format!("previous({}{at})", model.spelled(*of))
        }
        Form::Initial { later, .. } => text(model, factor, later, value),
        Form::Ask { path, .. } => format!("ask({path})"),
        Form::HalfFlat | Form::Unknown(_) => format!("{}({left})", form.name()),
    }
}

fn right(model: &Model, factor: &Factor) -> String {
    let names: Vec<String> = factor.right.iter().map(|use_| model.use_name(use_, &factor.products)).collect();
    names.join(", ")
}

impl Printer<'_> {
    /// The form of a factor in its place, with bound values.
    pub(super) fn form(&self, id: FactorId) -> String {
        let factor = &self.model.factors[id];
        let value = match self.bindings.get(&factor.left[0].variable) {
            Some(Binding::Value(Value::Ordinal(ordinal))) => Some(*ordinal),
            _ => None,
        };
        let spelled: HashMap<String, String> = (self.bindings.iter())
            .filter_map(|(id, binding)| Some((self.model.spelled(*id), self.spelled_value(*id, binding)?)))
            .collect();
        let written = substituted(&text(self.model, factor, &factor.form, value), &spelled);
        let products: String =
            factor.products.iter().map(|(index, _)| self.notation.product(index)).collect();
        format!("{products}{}", self.notation.typeset(&written))
    }

    /// The value of a bound variable as text of the language.
    fn spelled_value(&self, id: VariableId, binding: &Binding) -> Option<String> {
        let model = self.model;
        let is_named = matches!(&model.variables[id].domain, Domain::Finite { labels, range: None } if !labels.is_empty());
        Some(match binding {
            // Comparisons name its values: `Town = Paris`, as the left of the equation has it.
            Binding::Value(Value::Ordinal(_)) if is_named => return None,
            Binding::Value(Value::Ordinal(ordinal)) => model.variables[id].domain.value_spelled(*ordinal),
            Binding::Value(Value::Real(number)) if *number < 0.0 => format!("({number})"),
            Binding::Value(Value::Real(number)) => number.to_string(),
            Binding::Value(Value::Vector(numbers)) => list(numbers),
            Binding::Value(Value::Given(name)) if *name == model.variable_name(id) => name.to_lowercase(),
            Binding::Value(Value::Given(name)) => name.clone(),
            Binding::Expression(expression) => format!("({})", model.expression_text(*expression, &[])),
            Binding::Antecedent { cell, displacement } => {
                format!("({} - {})", model.spelled(*cell), model.spelled(*displacement))
            }
            // Its equation is printed where it is bound.
            Binding::Solved(_) => return None,
        })
    }
}

impl Exact {
    /// The factors of its equation, in the order of the program.
    pub(crate) fn used_factors(&self) -> Vec<FactorId> {
        let mut used: Vec<FactorId> = (reachable(&self.terms, &[self.joint]).into_iter())
            .flat_map(|term| match &self.terms[term] {
                Term::Factor(factor) | Term::Possible(factor) => vec![*factor],
                Term::FirstScan(scan) => vec![scan.prior, scan.factor],
                _ => Vec::new(),
            })
            .collect();
        used.sort();
        used.dedup();
        used
    }

    /// The equation that is computed, each factor replaced by its form.
    pub(crate) fn with_forms(&self, model: &Model, notation: Notation) -> Line {
        let none = BTreeMap::new();
        let bindings = self.derivation.last().map_or(&none, |step| &step.bindings);
        let mut printer = Printer {
            model,
            exact: self,
            bindings,
            conditioned: true,
            proportional: true,
            forms: false,
            notation,
        };
        let asked = printer.asked();
        printer.forms = true;
        let sign = if self.normalised { "=" } else { "∝" };
        let equation = notation.equation(&asked, sign, &printer.term(self.joint));
        ("forms".to_owned(), "each factor is replaced by its form".to_owned(), equation)
    }
}

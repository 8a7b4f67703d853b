//! The programs of this test: their text, and the density of each factor, written from the documentation of the
//! language.
//!
//! In: a [`Program`]. Out: its text for the compiler, and the logarithm of each factor at an assignment. Invariant:
//! nothing here uses the library; every number is computed from these types alone. Products are sums of logarithms,
//! which neither underflow nor overflow.

use std::fmt::Write;

/// The values of a variable.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) enum Domain {
    Boolean,
    /// Labels `L0`, `L1`, …, this many.
    Labels(usize),
    /// This many integers from the first one on.
    Range(i64, usize),
    Real,
}

#[derive(Clone, Debug)]
pub(crate) struct Variable {
    /// `X` for X^-1 as well.
    pub(crate) name: String,
    pub(crate) domain: Domain,
    /// The number of elements of a family.
    pub(crate) family: Option<usize>,
    /// The variable of which this is the value at the previous instant.
    pub(crate) previous_of: Option<usize>,
}

/// The element of a family whose index is that of the left-hand side.
pub(crate) const OWN: usize = usize::MAX;

/// A number: an element of a variable, or computed from several.
#[derive(Clone, Debug)]
pub(crate) enum Number {
    Constant(f64),
    Of(usize, usize),
    Binary(&'static str, Box<Number>, Box<Number>),
    If(Box<Truth>, Box<Number>, Box<Number>),
}

#[derive(Clone, Debug)]
pub(crate) enum Truth {
    Is(usize, usize),
    Label(usize, usize, usize),
    Compare(&'static str, Number, Number),
    Not(Box<Truth>),
    Both(Box<Truth>, Box<Truth>),
    Either(Box<Truth>, Box<Truth>),
}

#[derive(Clone, Debug)]
pub(crate) enum Form {
    Uniform,
    /// Rows in sixteenths, by the values of the right-hand side, the last fastest.
    Table(Vec<Vec<u32>>),
    Bernoulli(Number),
    Dirac(Number),
    DiracTruth(Truth),
    Weights(Number),
    /// Of an integer range: proportional to the density at each; of a real: the density.
    Normal(Number, f64),
    /// Of a real.
    Exponential(f64),
    If(Truth, Box<Form>, Box<Form>),
}

#[derive(Clone, Debug)]
pub(crate) struct Factor {
    pub(crate) left: usize,
    pub(crate) right: Vec<usize>,
    pub(crate) form: Form,
}

#[derive(Clone, Debug, Default)]
pub(crate) struct Program {
    pub(crate) variables: Vec<Variable>,
    /// One for each variable, in their order.
    pub(crate) factors: Vec<Factor>,
}

/// ln Σ exp of some logarithms; the largest of them is subtracted before the exponentials.
pub(crate) fn ln_sum(logarithms: &[f64]) -> f64 {
    let most = logarithms.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    match most == f64::NEG_INFINITY {
        true => most,
        false => most + logarithms.iter().map(|ln| (ln - most).exp()).sum::<f64>().ln(),
    }
}

/// A value for each slot (a variable, or an element of a family): the ordinal of a finite value, or a real.
pub(crate) type Assignment = Vec<f64>;

impl Program {
    pub(crate) fn elements(&self, variable: usize) -> usize {
        self.variables[variable].family.unwrap_or(1)
    }

    pub(crate) fn slot(&self, variable: usize, element: usize) -> usize {
        (0..variable).map(|before| self.elements(before)).sum::<usize>() + element
    }

    pub(crate) fn slots_of(&self, variable: usize) -> std::ops::Range<usize> {
        let first = self.slot(variable, 0);
        first..first + self.elements(variable)
    }

    pub(crate) fn slots(&self) -> usize {
        self.slot(self.variables.len(), 0)
    }

    pub(crate) fn variable_of(&self, slot: usize) -> usize {
        (0..self.variables.len()).find(|variable| self.slots_of(*variable).contains(&slot)).unwrap()
    }

    pub(crate) fn slot_name(&self, slot: usize) -> String {
        let variable = self.variable_of(slot);
        self.element_text(variable, slot - self.slot(variable, 0))
    }

    /// A variable, or with an index an element of it: `X`, `X^-1`, `X[2]`, `X[i]^-1`.
    fn written(&self, variable: usize, index: &str) -> String {
        let Variable { name, family, previous_of, .. } = &self.variables[variable];
        let index = if family.is_some() { index } else { "" };
        format!("{name}{index}{}", if previous_of.is_some() { "^-1" } else { "" })
    }

    pub(crate) fn count(&self, variable: usize) -> usize {
        match self.variables[variable].domain {
            Domain::Boolean => 2,
            Domain::Labels(count) | Domain::Range(_, count) => count,
            Domain::Real => panic!("a real has no count"),
        }
    }

    /// The notation of a value.
    pub(crate) fn value(&self, variable: usize, ordinal: usize) -> String {
        match self.variables[variable].domain {
            Domain::Boolean => (ordinal == 1).to_string(),
            Domain::Labels(_) => format!("L{ordinal}"),
            Domain::Range(low, _) => (low + ordinal as i64).to_string(),
            Domain::Real => panic!("a real has no ordinals"),
        }
    }

    /// The number of a value in an expression.
    pub(crate) fn number_of(&self, variable: usize, value: f64) -> f64 {
        match self.variables[variable].domain {
            Domain::Range(low, _) => low as f64 + value,
            _ => value,
        }
    }

    /// The number for an element of the left-hand side.
    fn number(&self, of: &Number, own: usize, at: &[f64]) -> f64 {
        match of {
            Number::Constant(number) => *number,
            Number::Of(variable, element) => self.number_of(*variable, self.at(*variable, *element, own, at)),
            Number::Binary(operator, one, other) => {
                let (x, y) = (self.number(one, own, at), self.number(other, own, at));
                match *operator {
                    "+" => x + y,
                    "-" => x - y,
                    "*" => x * y,
                    "min" => x.min(y),
                    "max" => x.max(y),
                    other => panic!("{other}"),
                }
            }
            Number::If(condition, then, otherwise) => {
                self.number(if self.truth(condition, own, at) { then } else { otherwise }, own, at)
            }
        }
    }

    fn at(&self, variable: usize, element: usize, own: usize, at: &[f64]) -> f64 {
        at[self.slot(variable, if element == OWN { own } else { element })]
    }

    fn truth(&self, of: &Truth, own: usize, at: &[f64]) -> bool {
        match of {
            Truth::Is(variable, element) => self.at(*variable, *element, own, at) == 1.0,
            Truth::Label(variable, element, ordinal) => {
                self.at(*variable, *element, own, at) == *ordinal as f64
            }
            Truth::Compare(operator, one, other) => {
                let (x, y) = (self.number(one, own, at), self.number(other, own, at));
                match *operator {
                    "<" => x < y,
                    "<=" => x <= y,
                    "==" => x == y,
                    other => panic!("{other}"),
                }
            }
            Truth::Not(one) => !self.truth(one, own, at),
            Truth::Both(one, other) => self.truth(one, own, at) && self.truth(other, own, at),
            Truth::Either(one, other) => self.truth(one, own, at) || self.truth(other, own, at),
        }
    }

    /// ln P(left element | right), or of its density.
    pub(crate) fn ln_density(&self, factor: &Factor, element: usize, at: &[f64]) -> f64 {
        self.form(&factor.form, factor, element, at)
    }

    fn form(&self, form: &Form, factor: &Factor, element: usize, at: &[f64]) -> f64 {
        let (left, slot) = (factor.left, self.slot(factor.left, element));
        let value = at[slot];
        // The number of the form at each value of the left-hand side.
        let each = |of: &Number| -> Vec<f64> {
            let mut at = at.to_vec();
            (0..self.count(left))
                .map(|ordinal| {
                    at[slot] = ordinal as f64;
                    self.number(of, element, &at)
                })
                .collect()
        };
        let sure = |is: bool| if is { 0.0 } else { f64::NEG_INFINITY };
        match form {
            Form::Uniform => -(self.count(left) as f64).ln(),
            Form::Table(rows) => {
                let digits = factor.right.iter();
                let row = digits.fold(0, |row, one| row * self.count(*one) + at[self.slot(*one, 0)] as usize);
                (f64::from(rows[row][value as usize]) / 16.0).ln()
            }
            Form::Bernoulli(p) => {
                let p = self.number(p, element, at);
                if value == 1.0 { p.ln() } else { (1.0 - p).ln() }
            }
            Form::Dirac(of) => sure(self.number(of, element, at) == self.number_of(left, value)),
            Form::DiracTruth(of) => sure(self.truth(of, element, at) == (value == 1.0)),
            Form::Weights(of) => {
                let weights = each(of);
                let total: f64 = weights.iter().sum();
                if total > 0.0 { (weights[value as usize] / total).ln() } else { f64::NEG_INFINITY }
            }
            Form::Normal(mean, deviation) => {
                let mean = self.number(mean, element, at);
                let bell = |x: f64| -0.5 * ((x - mean) / deviation).powi(2);
                match self.variables[left].domain {
                    Domain::Real => bell(value) - (deviation * std::f64::consts::TAU.sqrt()).ln(),
                    _ => {
                        let all = (0..self.count(left)).map(|one| bell(self.number_of(left, one as f64)));
                        bell(self.number_of(left, value)) - ln_sum(&all.collect::<Vec<f64>>())
                    }
                }
            }
            Form::Exponential(rate) if value >= 0.0 => rate.ln() - rate * value,
            Form::Exponential(_) => f64::NEG_INFINITY,
            Form::If(condition, then, otherwise) => {
                let form = if self.truth(condition, element, at) { then } else { otherwise };
                self.form(form, factor, element, at)
            }
        }
    }

    /// ln of the product of all factors of some variables at an assignment.
    pub(crate) fn ln_joint(&self, of: &[usize], at: &[f64]) -> f64 {
        let mut sum = 0.0;
        for variable in of {
            for element in 0..self.elements(*variable) {
                sum += self.ln_density(&self.factors[*variable], element, at);
                if sum == f64::NEG_INFINITY {
                    return sum;
                }
            }
        }
        sum
    }

    /// The program as a user writes it.
    pub(crate) fn text(&self) -> String {
        let mut text = "program Random {\n    variables {\n".to_owned();
        // Variables of the previous instant are declared after those of the present.
        let (before, now): (Vec<_>, Vec<_>) =
            (0..self.variables.len()).partition(|one| self.variables[*one].previous_of.is_some());
        for number in now.into_iter().chain(before) {
            let variable = &self.variables[number];
            let family = variable.family.map_or(String::new(), |count| format!("[1..={count}]"));
            let domain = match variable.domain {
                Domain::Boolean => "bool".to_owned(),
                Domain::Labels(count) => {
                    let labels: Vec<String> = (0..count).map(|label| format!("L{label}")).collect();
                    format!("{{ {} }}", labels.join(", "))
                }
                Domain::Range(low, count) => format!("{low}..={}", low + count as i64 - 1),
                Domain::Real => "real".to_owned(),
            };
            writeln!(text, "        {} : {domain};", self.written(number, &family)).unwrap();
        }
        let head = |factor: &Factor| {
            let left = self.written(factor.left, "[i]");
            let right: Vec<String> = factor.right.iter().map(|one| self.written(*one, "")).collect();
            match right.is_empty() {
                true => format!("P({left})"),
                false => format!("P({left} | {})", right.join(" ")),
            }
        };
        text.push_str("    }\n    decomposition {\n");
        for factor in &self.factors {
            match self.variables[factor.left].family {
                Some(count) => {
                    writeln!(text, "        prod(i in 1..={count}) {{ {} }}", head(factor)).unwrap();
                }
                None => writeln!(text, "        {}", head(factor)).unwrap(),
            }
        }
        text.push_str("    }\n    forms {\n");
        for factor in &self.factors {
            writeln!(text, "        {} = {};", head(factor), self.form_text(&factor.form)).unwrap();
        }
        text.push_str("    }\n}\n");
        text
    }

    fn form_text(&self, form: &Form) -> String {
        match form {
            Form::Uniform => "uniform".to_owned(),
            Form::Table(rows) => {
                let row = |row: &Vec<u32>| {
                    let cells: Vec<String> =
                        row.iter().map(|cell| (f64::from(*cell) / 16.0).to_string()).collect();
                    format!("{};", cells.join(", "))
                };
                format!("table {{ {} }}", rows.iter().map(row).collect::<Vec<_>>().join(" "))
            }
            Form::Bernoulli(p) => format!("bernoulli({})", self.number_text(p)),
            Form::Dirac(of) => format!("dirac({})", self.number_text(of)),
            Form::DiracTruth(of) => format!("dirac({})", self.truth_text(of)),
            Form::Weights(of) => format!("weights({})", self.number_text(of)),
            Form::Normal(mean, deviation) => format!("normal({}, {deviation:?})", self.number_text(mean)),
            Form::Exponential(rate) => format!("exponential({rate:?})"),
            Form::If(condition, then, otherwise) => format!(
                "if {} {{ {} }} else {{ {} }}",
                self.truth_text(condition),
                self.form_text(then),
                self.form_text(otherwise)
            ),
        }
    }

    fn element_text(&self, variable: usize, element: usize) -> String {
        match element {
            OWN => self.written(variable, "[i]"),
            _ => self.written(variable, &format!("[{}]", element + 1)),
        }
    }

    fn number_text(&self, of: &Number) -> String {
        match of {
            Number::Constant(number) if *number < 0.0 => format!("(0 - {})", -number),
            Number::Constant(number) => number.to_string(),
            Number::Of(variable, element) => self.element_text(*variable, *element),
            Number::Binary(operator @ ("min" | "max"), one, other) => {
                format!("{operator}({}, {})", self.number_text(one), self.number_text(other))
            }
            Number::Binary(operator, one, other) => {
                format!("({} {operator} {})", self.number_text(one), self.number_text(other))
            }
            Number::If(condition, then, otherwise) => format!(
                "(if {} {{ {} }} else {{ {} }})",
                self.truth_text(condition),
                self.number_text(then),
                self.number_text(otherwise)
            ),
        }
    }

    fn truth_text(&self, of: &Truth) -> String {
        match of {
            Truth::Is(variable, element) => self.element_text(*variable, *element),
            Truth::Label(variable, element, ordinal) => {
                format!("({} == {})", self.element_text(*variable, *element), self.value(*variable, *ordinal))
            }
            Truth::Compare(operator, one, other) => {
                format!("({} {operator} {})", self.number_text(one), self.number_text(other))
            }
            Truth::Not(one) => format!("(not {})", self.truth_text(one)),
            Truth::Both(one, other) => format!("({} and {})", self.truth_text(one), self.truth_text(other)),
            Truth::Either(one, other) => format!("({} or {})", self.truth_text(one), self.truth_text(other)),
        }
    }
}

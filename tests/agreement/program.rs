//! Programs as this test means them: their text, and what each factor says, written from the language's pages.
//!
//! In: a [`Program`]. Out: its text for the compiler, and the density of each factor at an assignment. Invariant: nothing
//! here knows the library; every number is computed from these types alone.

use std::fmt::Write;

/// The values of a variable.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) enum Domain {
    Boolean,
    /// As many labels, `L0`, `L1`, …
    Labels(usize),
    /// As many integers from a first one.
    Range(i64, usize),
    Real,
}

#[derive(Clone, Debug)]
pub(crate) struct Variable {
    pub(crate) name: String,
    pub(crate) domain: Domain,
    /// The number of elements of a family.
    pub(crate) family: Option<usize>,
    /// The variable of which this is the value at the previous instant.
    pub(crate) previous_of: Option<usize>,
}

/// A number: an element of a variable, or what is computed from several.
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
        match self.variables[variable].family {
            Some(_) => format!("{}[{}]", self.variables[variable].name, slot - self.slot(variable, 0) + 1),
            None => self.variables[variable].name.clone(),
        }
    }

    pub(crate) fn count(&self, variable: usize) -> usize {
        match self.variables[variable].domain {
            Domain::Boolean => 2,
            Domain::Labels(count) | Domain::Range(_, count) => count,
            Domain::Real => panic!("a real has no count"),
        }
    }

    /// How a value is written.
    pub(crate) fn value(&self, variable: usize, ordinal: usize) -> String {
        match self.variables[variable].domain {
            Domain::Boolean => (ordinal == 1).to_string(),
            Domain::Labels(_) => format!("L{ordinal}"),
            Domain::Range(low, _) => (low + ordinal as i64).to_string(),
            Domain::Real => panic!("a real has no ordinals"),
        }
    }

    /// The number that a value is in an expression.
    pub(crate) fn number_of(&self, variable: usize, value: f64) -> f64 {
        match self.variables[variable].domain {
            Domain::Range(low, _) => low as f64 + value,
            _ => value,
        }
    }

    fn number(&self, of: &Number, at: &[f64]) -> f64 {
        match of {
            Number::Constant(number) => *number,
            Number::Of(variable, element) => self.number_of(*variable, at[self.slot(*variable, *element)]),
            Number::Binary(operator, one, other) => {
                let (x, y) = (self.number(one, at), self.number(other, at));
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
                self.number(if self.truth(condition, at) { then } else { otherwise }, at)
            }
        }
    }

    fn truth(&self, of: &Truth, at: &[f64]) -> bool {
        match of {
            Truth::Is(variable, element) => at[self.slot(*variable, *element)] == 1.0,
            Truth::Label(variable, element, ordinal) => at[self.slot(*variable, *element)] == *ordinal as f64,
            Truth::Compare(operator, one, other) => {
                let (x, y) = (self.number(one, at), self.number(other, at));
                match *operator {
                    "<" => x < y,
                    "<=" => x <= y,
                    "==" => x == y,
                    other => panic!("{other}"),
                }
            }
            Truth::Not(one) => !self.truth(one, at),
            Truth::Both(one, other) => self.truth(one, at) && self.truth(other, at),
            Truth::Either(one, other) => self.truth(one, at) || self.truth(other, at),
        }
    }

    /// P(left element | right), or its density.
    pub(crate) fn density(&self, factor: &Factor, element: usize, at: &[f64]) -> f64 {
        self.form(&factor.form, factor, element, at)
    }

    fn form(&self, form: &Form, factor: &Factor, element: usize, at: &[f64]) -> f64 {
        let (left, slot) = (factor.left, self.slot(factor.left, element));
        let value = at[slot];
        // The form's number with the left-hand side at each of its values.
        let each = |of: &Number| -> Vec<f64> {
            let mut at = at.to_vec();
            (0..self.count(left))
                .map(|ordinal| {
                    at[slot] = ordinal as f64;
                    self.number(of, &at)
                })
                .collect()
        };
        match form {
            Form::Uniform => 1.0 / self.count(left) as f64,
            Form::Table(rows) => {
                let digits = factor.right.iter();
                let row = digits.fold(0, |row, one| row * self.count(*one) + at[self.slot(*one, 0)] as usize);
                f64::from(rows[row][value as usize]) / 16.0
            }
            Form::Bernoulli(p) => {
                let p = self.number(p, at);
                if value == 1.0 { p } else { 1.0 - p }
            }
            Form::Dirac(of) => f64::from(u8::from(self.number(of, at) == self.number_of(left, value))),
            Form::DiracTruth(of) => f64::from(u8::from(self.truth(of, at) == (value == 1.0))),
            Form::Weights(of) => {
                let weights = each(of);
                let total: f64 = weights.iter().sum();
                if total > 0.0 { weights[value as usize] / total } else { 0.0 }
            }
            Form::Normal(mean, deviation) => {
                let mean = self.number(mean, at);
                let bell = |x: f64| (-0.5 * ((x - mean) / deviation).powi(2)).exp();
                match self.variables[left].domain {
                    Domain::Real => bell(value) / (deviation * std::f64::consts::TAU.sqrt()),
                    _ => {
                        let all = (0..self.count(left)).map(|one| bell(self.number_of(left, one as f64)));
                        bell(self.number_of(left, value)) / all.sum::<f64>()
                    }
                }
            }
            Form::Exponential(rate) => {
                if value >= 0.0 {
                    rate * (-rate * value).exp()
                } else {
                    0.0
                }
            }
            Form::If(condition, then, otherwise) => {
                let form = if self.truth(condition, at) { then } else { otherwise };
                self.form(form, factor, element, at)
            }
        }
    }

    /// The product of all factors of some variables at an assignment.
    pub(crate) fn joint(&self, of: &[usize], at: &[f64]) -> f64 {
        let mut product = 1.0;
        for variable in of {
            for element in 0..self.elements(*variable) {
                product *= self.density(&self.factors[*variable], element, at);
                if product == 0.0 {
                    return 0.0;
                }
            }
        }
        product
    }

    /// The program as a user writes it.
    pub(crate) fn text(&self) -> String {
        let mut text = "program Random {\n    variables {\n".to_owned();
        // What was before is declared after what is now.
        let (before, now): (Vec<_>, Vec<_>) =
            self.variables.iter().partition(|variable| variable.previous_of.is_some());
        for variable in now.into_iter().chain(before) {
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
            writeln!(text, "        {}{family} : {domain};", variable.name).unwrap();
        }
        let head = |factor: &Factor| {
            let left = &self.variables[factor.left];
            let index = if left.family.is_some() { "[i]" } else { "" };
            let right: Vec<&str> =
                factor.right.iter().map(|one| self.variables[*one].name.as_str()).collect();
            match right.is_empty() {
                true => format!("P({}{index})", left.name),
                false => format!("P({}{index} | {})", left.name, right.join(" ")),
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
        self.slot_name(self.slot(variable, element))
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

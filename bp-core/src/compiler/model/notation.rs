//! Notation of a model's parts: names, heads of factors, expressions, questions.
//!
//! In: ids. Out: text in the language's own spelling. Invariant: the text parses back to the same part of the model.

use super::{
    Ask, Domain, Expression, Factor, Finding, Folded, Form, IndexSpace, Known, Model, Statistic, Value,
    VariableUse,
};
use crate::ids::{ExpressionId, VariableId};
use crate::operators::{Binary, Unary};
use crate::radix;
use crate::spelling::{exact, list, quoted};

/// Limit of the length of a form's arguments in a message, in characters.
const LONGEST: usize = 48;

/// Limit of the length of an expression in bytes: with shared nodes, it may be exponentially longer than its program.
const LONGEST_EXPRESSION: usize = 4000;

/// The notation of a function of one number.
fn function(operator: Unary) -> &'static str {
    match operator {
        Unary::Absolute => "abs",
        Unary::Exponential => "exp",
        Unary::NaturalLogarithm => "ln",
        Unary::SquareRoot => "sqrt",
        Unary::Floor => "floor",
        Unary::Ceiling => "ceil",
        Unary::Round => "round",
        Unary::Sine => "sin",
        Unary::Cosine => "cos",
        Unary::BinaryLogarithm => "log2",
        Unary::LnGamma => "ln_gamma",
        Unary::LnBessel => "ln_bessel",
        Unary::NormalCumulative => "probit",
        Unary::EntropyTerm => "entropy_term",
        Unary::Negate => "-",
        Unary::Not => "not ",
    }
}

impl Model {
    /// A variable's name as written: `O`, `O^-1`.
    pub fn variable_name(&self, id: VariableId) -> String {
        let variable = &self.variables[id];
        match variable.previous_of {
            Some(_) => format!("{}^-1", variable.name),
            None => variable.name.clone(),
        }
    }

    /// A variable in the notation of the language: `O`, `O^-1`, `"two words"`.
    pub fn spelled(&self, id: VariableId) -> String {
        let variable = &self.variables[id];
        match (variable.derived, variable.family.map(|family| family.over)) {
            (Some(_), Some(IndexSpace::Range(range))) => {
                let (low, high) = (range.low, range.high.offset);
                let elements = if low == high { low.to_string() } else { format!("{low}..={high}") };
                return format!("{}[{elements}]", quoted(&variable.name));
            }
            (Some(_), _) => return variable.name.clone(),
            (None, _) => {}
        }
        let before = if variable.previous_of.is_some() { "^-1" } else { "" };
        format!("{}{before}", quoted(&variable.name))
    }

    /// A use of a variable in a factor: `O`, `Z[i]`.
    pub fn use_name(&self, use_: &VariableUse, products: &[(String, IndexSpace)]) -> String {
        let name = self.spelled(use_.variable);
        let Some(element) = use_.element else { return name };
        let element = self.expression_text(element, products);
        match name.strip_suffix("^-1") {
            Some(name) => format!("{name}[{element}]^-1"),
            None => format!("{name}[{element}]"),
        }
    }

    /// A factor's head: `P(Z[i] | V O C)`.
    pub fn head(&self, factor: &Factor) -> String {
        let list = |uses: &[VariableUse]| {
            uses.iter().map(|use_| self.use_name(use_, &factor.products)).collect::<Vec<_>>().join(" ")
        };
        match factor.right.is_empty() {
            true => format!("P({})", list(&factor.left)),
            false => format!("P({} | {})", list(&factor.left), list(&factor.right)),
        }
    }

    /// A factor with a form in it, for a message: `P(Y | X) = bernoulli(X / 2)`. Long parts are omitted.
    pub fn form_text(&self, factor: &Factor, form: &Form) -> String {
        let list = |ids: &[ExpressionId]| {
            let words: Vec<String> =
                ids.iter().map(|id| self.expression_text(*id, &factor.products)).collect();
            let text = words.join(", ");
            if text.chars().count() > LONGEST { "…".to_owned() } else { text }
        };
        let derived = self.variables[factor.left[0].variable].derived.is_some();
        let arguments = match form {
            // As the question has it, without what was added to it.
            Form::Dirac(_) if derived => self.variable_name(factor.left[0].variable),
            Form::Uniform | Form::Flat | Form::HalfFlat => {
                return format!("{} = {}", self.head(factor), form.name());
            }
            Form::Table(_) | Form::Constants(_) => {
                return format!("{} = table {{ … }}", self.head(factor));
            }
            Form::Bernoulli(argument, _) | Form::Dirac(argument) | Form::Weights(argument) => {
                list(&[*argument])
            }
            Form::NormalBins { mean, deviation } => list(&[*mean, *deviation]),
            Form::Categorical(entries) | Form::Dirichlet(entries) | Form::Law { arguments: entries, .. } => {
                list(entries)
            }
            Form::NormalVector { mean, covariance } => {
                format!("{}, {}", list(&[*mean]), self.matrix_text(factor, covariance))
            }
            Form::Multinomial { trials, probabilities } => {
                format!("{}, {}", list(&[*trials]), list(probabilities))
            }
            Form::Ordered(form) => format!("{}(…)", form.name()),
            Form::Truncated { form, low, high } => format!("{}(…), {}", form.name(), list(&[*low, *high])),
            Form::Previous { of, .. } => self.spelled(*of),
            Form::Mixture(_)
            | Form::Unknown(_)
            | Form::Ask { .. }
            | Form::If { .. }
            | Form::Initial { .. } => "…".to_owned(),
        };
        // For a subform, the surrounding form is omitted.
        let inner = if std::ptr::eq(&factor.form, form) { "" } else { "… " };
        format!("{} = {inner}{}({arguments})", self.head(factor), form.name())
    }

    /// A covariance matrix as written: the name of a parameter, or its entries.
    fn matrix_text(&self, factor: &Factor, matrix: &[Vec<ExpressionId>]) -> String {
        if let Expression::Parameter { parameter, .. } = &self.expressions[matrix[0][0]]
            && let Expression::Parameter { parameter: last, .. } =
                &self.expressions[matrix[matrix.len() - 1][matrix.len() - 1]]
            && parameter == last
            && self.parameters[*parameter].over.len() == 2
        {
            return self.parameters[*parameter].name.clone();
        }
        let row = |row: &Vec<ExpressionId>| {
            let entries: Vec<String> =
                row.iter().map(|id| self.expression_text(*id, &factor.products)).collect();
            format!("[{}]", entries.join(", "))
        };
        let text = format!("[{}]", matrix.iter().map(row).collect::<Vec<_>>().join(", "));
        if text.chars().count() > LONGEST { "[…]".to_owned() } else { text }
    }

    /// One ask, as a user would type it.
    pub fn ask_text(&self, ask: &Ask) -> String {
        let value = |variable: VariableId, value: &Value| match value {
            Value::Ordinal(ordinal) => self.variables[variable].domain.value_spelled(*ordinal),
            Value::Real(number) => exact(*number),
            Value::Vector(numbers) => list(numbers),
            Value::Given(name) => name.clone(),
        };
        let item = |variable: VariableId, at: Option<&Value>| match at {
            // A predicate or an equation that is true.
            Some(Value::Ordinal(1)) if self.is_predicate(variable) => self.spelled(variable),
            Some(Value::Real(_)) if self.is_equation(variable) => self.spelled(variable),
            Some(at) => format!("{} = {}", self.spelled(variable), value(variable, at)),
            None => self.spelled(variable),
        };
        let weighted = |variable: VariableId, word: &str, weights: &[f64]| {
            format!("{} {word} {}", self.spelled(variable), list(weights))
        };
        let join = |items: Vec<String>| {
            let separator = if items.iter().any(|item| item.contains(' ')) { ", " } else { " " };
            items.join(separator)
        };
        let distribution = |known: &[Known]| {
            let searched: Vec<_> = ask.searched.iter().map(|s| item(s.variable, s.at.as_ref())).collect();
            let known: Vec<_> = (known.iter())
                .map(|known| match &known.evidence {
                    // A value given under the variable's own name is typed as that name alone.
                    Finding::Hard(Value::Given(name)) if *name == self.variable_name(known.variable) => {
                        self.spelled(known.variable)
                    }
                    Finding::Hard(Value::Vector(numbers)) => self.components_text(known.variable, numbers),
                    Finding::Hard(value) => item(known.variable, Some(value)),
                    Finding::Each => self.spelled(known.variable),
                    Finding::Virtual(weights) => weighted(known.variable, "virtual", weights),
                    Finding::Soft(weights) => weighted(known.variable, "soft", weights),
                })
                .collect();
            let bar = if known.is_empty() { "" } else { " | " };
            format!("P({}{bar}{})", join(searched), join(known))
        };
        let first = format!("{}{}", ask.words(), distribution(&ask.known));
        match &ask.statistic {
            Statistic::Argmax { nearest: Some(field) } => format!("{first} nearest {field}"),
            Statistic::Divergence { when, from } => {
                let blank = if when.is_over_time() { " " } else { "" };
                format!("{first} from {}{blank}{}", when.word(), distribution(from))
            }
            _ => first,
        }
    }

    /// The known components of a vector: `V = [1, 2]`, or those that are observed, `V[0] = 1`.
    pub(crate) fn components_text(&self, variable: VariableId, numbers: &[f64]) -> String {
        let name = self.spelled(variable);
        if numbers.iter().all(|number| !number.is_nan()) {
            return format!("{name} = {}", list(numbers));
        }
        let known = numbers.iter().enumerate().filter(|(_, number)| !number.is_nan());
        let known: Vec<String> =
            known.map(|(component, number)| format!("{name}[{component}] = {}", exact(*number))).collect();
        known.join(", ")
    }

    /// An expression, as written in a form under these `prod`s; `…` replaces very long parts.
    pub fn expression_text(&self, id: ExpressionId, products: &[(String, IndexSpace)]) -> String {
        self.fold(id, |expression, below| self.node_text(expression, below, products)).root().0
    }

    /// A node as written, and its precedence.
    fn node_text(
        &self,
        expression: &Expression,
        below: &Folded<(String, u8)>,
        products: &[(String, IndexSpace)],
    ) -> (String, u8) {
        const TIGHT: u8 = u8::MAX;
        let text = |id: &ExpressionId, loosest: u8| {
            let (text, tightness) = below.of(*id);
            if *tightness < loosest { format!("({text})") } else { text.clone() }
        };
        let list = |ids: &[ExpressionId]| ids.iter().map(|id| text(id, 0)).collect::<Vec<_>>().join(", ");
        let mut tightness = TIGHT;
        let written = match expression {
            Expression::Number(number) => exact(*number),
            Expression::Parameter { parameter, indices } if indices.is_empty() => {
                self.parameters[*parameter].name.clone()
            }
            Expression::Parameter { parameter, indices } => {
                format!("{}[{}]", self.parameters[*parameter].name, list(indices))
            }
            Expression::Variable(use_) => match &use_.element {
                Some(element) => format!("{}[{}]", self.spelled(use_.variable), text(element, 0)),
                None => self.spelled(use_.variable),
            },
            Expression::Index(depth) => {
                products.get(*depth).map_or_else(|| format!("index{depth}"), |(name, _)| name.clone())
            }
            Expression::Unary(Unary::Negate, operand) => format!("-{}", text(operand, 6)),
            Expression::Unary(Unary::Not, operand) => format!("not {}", text(operand, 6)),
            Expression::Unary(operator, operand) => format!("{}({})", function(*operator), text(operand, 0)),
            Expression::Binary(operator, left, right) if operator.is_function() => {
                format!("{}({}, {})", operator.notation().1, text(left, 0), text(right, 0))
            }
            Expression::Binary(operator, left, right) => {
                let (own, sign) = operator.notation();
                tightness = own;
                let [one, other] =
                    [(left, right), (right, left)].map(|(of, with)| self.label_text(*operator, *of, *with));
                let one = one.unwrap_or_else(|| text(left, own));
                format!("{one} {sign} {}", other.unwrap_or_else(|| text(right, own + 1)))
            }
            Expression::If { condition, then, otherwise } => {
                let [condition, then, otherwise] = [condition, then, otherwise].map(|part| text(part, 0));
                format!("if {condition} {{ {then} }} else {{ {otherwise} }}")
            }
            Expression::First { family, with } => {
                let name = self.spelled(*family);
                match with {
                    Some((value, at)) => format!("first({name} with {} at {})", text(value, 0), text(at, 0)),
                    None => format!("first({name})"),
                }
            }
            Expression::Foreign { path, .. } => path.clone(),
            Expression::GradientNorm { field, at, before } => {
                let before =
                    before.as_ref().map_or_else(String::new, |before| format!(", {}", text(before, 0)));
                format!("norm(gradient({}, {}{before}))", text(field, 0), text(at, 0))
            }
            Expression::Frontier { condition, at } => {
                format!("frontier({}, {})", text(condition, 0), text(at, 0))
            }
            Expression::Innermost { at } => format!("innermost({})", text(at, 0)),
            Expression::Vector(name, parts) if name == "component" => {
                format!("{}[{}]", text(&parts[0], 0), text(&parts[1], 0))
            }
            Expression::Vector(name, parts) => format!("{name}({})", list(parts)),
        };
        match written.len() <= LONGEST_EXPRESSION {
            true => (written, tightness),
            false => ("…".to_owned(), TIGHT),
        }
    }

    /// The name of a value that is compared with a variable of names.
    fn label_text(&self, operator: Binary, value: ExpressionId, with: ExpressionId) -> Option<String> {
        let (Expression::Number(number), Expression::Variable(use_)) =
            (&self.expressions[value], &self.expressions[with])
        else {
            return None;
        };
        let domain = &self.variables[use_.variable].domain;
        let is_named = match domain {
            Domain::Finite { labels, .. } => !labels.is_empty(),
            other => *other == Domain::Boolean,
        };
        let ordinal = domain.ordinal_at(*number).filter(|_| operator.compares() && is_named)?;
        Some(domain.value_spelled(ordinal))
    }

    /// The values of several variables at a position of their table, the last one fastest: `Rain = true, Wet = false`.
    pub fn combination_text(&self, uses: &[VariableUse], position: usize) -> String {
        let count = |use_: &VariableUse| self.variables[use_.variable].domain.count().unwrap_or(1).max(1);
        let word = |(use_, ordinal): (&VariableUse, usize)| {
            format!("{} = {}", self.variable_name(use_.variable), self.value_name(use_.variable, ordinal))
        };
        let ordinals = radix::ordinals(position, uses.iter().rev().map(count));
        let mut words: Vec<String> = uses.iter().rev().zip(ordinals).map(word).collect();
        words.reverse();
        words.join(", ")
    }

    /// The name of a value of a variable, given its ordinal.
    pub fn value_name(&self, variable: VariableId, ordinal: usize) -> String {
        let domain = &self.variables[variable].domain;
        let named = if let Domain::Set(set) = domain { self.sets[*set].elements.get(ordinal) } else { None };
        named.cloned().unwrap_or_else(|| domain.value_name(ordinal))
    }

    /// The name of an element of a family, or of a component of a vector: `Z[2]`, `Level[Hill]`.
    pub fn element_name(&self, variable: VariableId, index: i64) -> String {
        let name = self.variable_name(variable);
        match self.variables[variable].family.map(|family| family.over) {
            Some(IndexSpace::Set(set)) => {
                let element = usize::try_from(index).ok().and_then(|at| self.sets[set].elements.get(at));
                element.map_or_else(|| format!("{name}[{index}]"), |element| format!("{name}[{element}]"))
            }
            _ => format!("{name}[{index}]"),
        }
    }

    /// A domain, as written.
    pub fn domain_text(&self, domain: &Domain) -> String {
        match domain {
            Domain::Boolean => "bool".to_owned(),
            Domain::Real => "real".to_owned(),
            Domain::Vector(length) => format!("real[{length}]"),
            Domain::Bins(bins) if bins.points().is_some() => {
                let points: Vec<_> = bins.points().into_iter().flatten().map(f64::to_string).collect();
                format!("{{ {} }}", points.join(", "))
            }
            Domain::Bins(bins) => {
                let (low, high) = bins.ends();
                match (bins.width(), bins.is_circle()) {
                    (Some(_), true) => format!("circle({low}, {high}, {})", bins.count()),
                    (Some(_), false) => format!("bins({low}, {high}, {})", bins.count()),
                    (None, _) => {
                        let edges: Vec<_> = bins.edges().iter().map(f64::to_string).collect();
                        format!("bins[{}]", edges.join(", "))
                    }
                }
            }
            Domain::Set(set) => self.sets[*set].name.clone(),
            Domain::Finite { labels, range } => {
                let mut parts = Vec::new();
                if !labels.is_empty() {
                    let labels: Vec<_> = labels.iter().map(|label| quoted(label)).collect();
                    parts.push(format!("{{ {} }}", labels.join(", ")));
                }
                if let Some(range) = range {
                    let high = match (range.high.size, range.high.offset) {
                        (None, offset) => offset.to_string(),
                        (Some(size), 0) => self.parameters[size].name.clone(),
                        (Some(size), offset) => format!("{} {offset:+}", self.parameters[size].name),
                    };
                    parts.push(format!("{}..={high}", range.low));
                }
                parts.join(" or ")
            }
        }
    }
}

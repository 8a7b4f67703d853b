//! The number of free parameters of a decomposition, compared with the joint distribution.
//!
//! In: a model. Out: counts. Invariant: a count that depends on sizes or on reals is absent.
//!
//! A *table of the joint distribution* has Π|X| − 1 free parameters, over all variables X of the program. *Tables of the
//! factors* have (Π|left| − 1) · Π|right| for each factor, under a `prod` for each element. *As written*, a factor has
//! - uniform, Dirac, `previous` and `ask`: none, since they contain no free number;
//! - a row of probabilities (categorical, table, weights of a mixture): its constant entries, minus one if all entries are
//!   constant, since they sum to one;
//! - any other form: the numbers in its arguments. A constant expression (`1 / 6`) is one number; an expression that occurs
//!   again in the form (`(X + 50) * (X + 50)`) counts once; numbers in conditions and comparisons do not count.
//!
//! A declared parameter counts once in the program, with one number for each element of its range; sizes do not count.
//!
//! Bessière et al., *Bayesian Programming*, CRC 2013, compares the first two.

use bp_core::compiler::distribution::Setting;
use bp_core::compiler::ids::{ExpressionId, ParameterId};
use bp_core::compiler::model::{Expression, Factor, Form, IndexSpace, Model, ParameterKind, VariableUse};
use bp_core::compiler::operators::{Binary, Unary};
use std::collections::{BTreeSet, HashMap};

/// Free parameters, each `None` if it depends on sizes or on reals.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Free {
    /// Of a table of the joint distribution.
    pub(crate) joint: Option<f64>,
    /// Of tables of the factors.
    pub(crate) tables: Option<f64>,
    /// Of the forms as they are written.
    pub(crate) forms: Option<f64>,
}

/// The counts of a program; with sizes, if they are known.
pub(crate) fn free(model: &Model, sizes: Option<&Setting<'_>>) -> Free {
    let counts = Counts { model, sizes };
    let whole = model.variables.ids().filter(|id| Some(*id) != model.plate_index());
    let joint = whole.map(|id| counts.values(&VariableUse::from(id))).product::<Option<f64>>();
    let mut written = Written::default();
    let columns =
        |factor: &Factor| factor.left.iter().map(|use_| counts.values(use_)).product::<Option<f64>>();
    let numbers: usize =
        model.factors.values().map(|factor| written.factor(model, factor, columns(factor))).sum();
    let fields: Option<f64> = written.parameters.iter().map(|id| counts.entries(*id)).sum();
    Free {
        joint: joint.map(|joint| joint - 1.0),
        tables: model.factors.values().map(|factor| counts.table(factor)).sum(),
        forms: fields.map(|fields| fields + numbers as f64),
    }
}

/// The counts, as a sentence.
pub(crate) fn in_words(model: &Model, sizes: Option<&Setting<'_>>) -> String {
    let plural = |count: usize| if count == 1 { "" } else { "s" };
    let count = model.factors.len();
    let factors = format!("{count} factor{}", plural(count));
    let Free { joint, tables, forms } = free(model, sizes);
    let forms = forms.map(|forms| format!("{forms} free parameter{}", plural(forms as usize)));
    match (forms, joint, tables) {
        (Some(forms), Some(joint), Some(tables)) => format!(
            "{factors} with {forms}; a table of the joint distribution would have {joint}, tables of the factors {tables}"
        ),
        (Some(forms), ..) => {
            format!(
                "{factors} with {forms}; no table of the joint distribution: it depends on sizes, or on reals"
            )
        }
        _ => format!("{factors}; how many free parameters depends on sizes"),
    }
}

/// The numbers of values, with sizes where they are known.
struct Counts<'c> {
    model: &'c Model,
    sizes: Option<&'c Setting<'c>>,
}

impl Counts<'_> {
    /// (Π|left| − 1) · Π|right|, for each element of a `prod`.
    fn table(&self, factor: &Factor) -> Option<f64> {
        let count = |uses: &[VariableUse]| {
            let uses = uses.iter().filter(|use_| Some(use_.variable) != self.model.plate_index());
            uses.map(|use_| self.values(use_)).product::<Option<f64>>()
        };
        let repeated = factor.products.iter().map(|(_, over)| Some(self.length(over)? as f64));
        Some(count(&factor.right)? * (count(&factor.left)? - 1.0) * repeated.product::<Option<f64>>()?)
    }

    fn length(&self, over: &IndexSpace) -> Option<usize> {
        self.model.index_count(over).or_else(|| self.sizes?.length(over).ok())
    }

    /// The number of values of a use of a variable: for a whole family the joint values of all its elements.
    fn values(&self, use_: &VariableUse) -> Option<f64> {
        let variable = &self.model.variables[use_.variable];
        let of_sizes =
            || self.sizes.filter(|_| variable.domain.is_finite()).map(|sizes| sizes.count(use_.variable));
        let one = variable.domain.count().or_else(of_sizes)? as f64;
        match (&variable.family, use_.element) {
            (Some(family), None) => {
                let elements = self.length(&family.over)? - usize::from(family.except.is_some());
                Some(one.powi(elements as i32))
            }
            _ => Some(one),
        }
    }

    /// The number of numbers of a parameter; 0 for a size.
    fn entries(&self, id: ParameterId) -> Option<f64> {
        let parameter = &self.model.parameters[id];
        match parameter.kind {
            ParameterKind::Size => Some(0.0),
            _ => parameter.over.iter().map(|over| Some(self.length(over)? as f64)).product(),
        }
    }
}

/// The parameters and nodes found in the forms of a program.
#[derive(Default)]
struct Written {
    /// Parameters that are used.
    parameters: BTreeSet<ParameterId>,
    /// Nodes that were counted: a `let` counts once.
    seen: BTreeSet<ExpressionId>,
    /// For each expression of a form the first that is equal to it.
    first: HashMap<ExpressionId, ExpressionId>,
    /// The first of equal expressions, by their text.
    equal: HashMap<String, ExpressionId>,
}

impl Written {
    /// The number of constants in the form of a factor whose left-hand side has so many values.
    fn factor(&mut self, model: &Model, factor: &Factor, columns: Option<f64>) -> usize {
        self.first.clear();
        self.equal.clear();
        match &factor.form {
            Form::Constants(entries) => {
                columns.map_or(0, |columns| entries.len() - (entries.len() as f64 / columns) as usize)
            }
            form => self.form(model, form),
        }
    }

    /// The number of constants in a form.
    fn form(&mut self, model: &Model, form: &Form) -> usize {
        match form {
            Form::Initial { first, later } => self.form(model, first) + self.form(model, later),
            Form::Ordered(form) => self.form(model, form),
            Form::Truncated { form, low, high } => {
                self.form(model, form) + self.numbers(model, *low) + self.numbers(model, *high)
            }
            Form::Mixture(parts) => {
                let weights: Vec<ExpressionId> = parts.iter().map(|(weight, _)| *weight).collect();
                let parts: usize = parts.iter().map(|(_, part)| self.form(model, part)).sum();
                self.row(model, &weights) + parts
            }
            Form::Uniform | Form::Dirac(_) | Form::Ask { .. } => 0,
            Form::Previous { otherwise, .. } => self.form(model, otherwise),
            Form::Categorical(entries) => self.row(model, entries),
            Form::Table(rows) => rows.iter().map(|row| self.row(model, row)).sum(),
            Form::If { then, otherwise, .. } => self.form(model, then) + self.form(model, otherwise),
            other => {
                let mut arguments = Vec::new();
                other.each_expression(&mut |argument| arguments.push(argument));
                arguments.into_iter().map(|argument| self.numbers(model, argument)).sum()
            }
        }
    }

    /// The free entries of a row that sums to one.
    fn row(&mut self, model: &Model, entries: &[ExpressionId]) -> usize {
        let constant = entries.iter().filter(|entry| model.constant(**entry).is_some()).count();
        for entry in entries {
            self.numbers(model, *entry);
        }
        constant - usize::from(constant == entries.len())
    }

    /// The number of constants in an expression that is not a condition.
    fn numbers(&mut self, model: &Model, id: ExpressionId) -> usize {
        if model.constant(id).is_some() {
            return usize::from(self.seen.insert(id));
        }
        let first = self.first_equal(model, id);
        if !self.seen.insert(first) {
            return 0;
        }
        match &model.expressions[id] {
            Expression::Parameter { parameter, .. } => {
                self.parameters.insert(*parameter);
                0
            }
            Expression::Unary(Unary::Not, _) => 0,
            Expression::Unary(_, operand) => self.numbers(model, *operand),
            Expression::Binary(operator, ..) if is_condition(*operator) => 0,
            Expression::Binary(_, left, right) => self.numbers(model, *left) + self.numbers(model, *right),
            Expression::If { then, otherwise, .. } => {
                self.numbers(model, *then) + self.numbers(model, *otherwise)
            }
            Expression::Vector(_, parts) => parts.iter().map(|part| self.numbers(model, *part)).sum(),
            _ => 0,
        }
    }
}

impl Written {
    /// The first expression of the form that is equal to this one.
    fn first_equal(&mut self, model: &Model, id: ExpressionId) -> ExpressionId {
        if let Some(known) = self.first.get(&id) {
            return *known;
        }
        let mut nodes = model.nodes_below(id);
        nodes.sort_unstable();
        for node in nodes {
            if !self.first.contains_key(&node) {
                let text =
                    format!("{:?}", model.expressions[node].renumbered(&|operand| self.first[&operand]));
                let first = *self.equal.entry(text).or_insert(node);
                self.first.insert(node, first);
            }
        }
        self.first[&id]
    }
}

fn is_condition(operator: Binary) -> bool {
    use Binary::{And, Equal, Greater, GreaterOrEqual, Less, LessOrEqual, NotEqual, Or};
    matches!(operator, And | Or | Equal | NotEqual | Less | LessOrEqual | Greater | GreaterOrEqual)
}

#[cfg(test)]
mod tests {
    use super::*;
    use bp_core::compiler::source::Source;
    use bp_core::compiler::syntax::compile;

    #[track_caller]
    fn counts(text: &str) -> [Option<f64>; 3] {
        let Free { joint, tables, forms } = free(&compile(&Source::new("test", text)).unwrap(), None);
        [joint, tables, forms]
    }

    #[test]
    fn wet_grass_by_hand() {
        // Joint 2³ − 1; tables 1 + 1 · 2 + 1 · 4; forms: .3, then .1 and .9, then none for the Dirac.
        let text = include_str!("../../../../tests/programs/wet_grass.bp");
        assert_eq!(counts(text), [Some(7.0), Some(7.0), Some(3.0)]);
    }

    #[test]
    fn phototaxy_as_in_the_book() {
        // Lebeltel et al. 2004: 8 directions, 21 rotations: 8 · 21 − 1; as tables 7 and 8 rows of 20.
        let text = "program Phototaxy {
            variables { ThetaL : { m170, m90, m45, m10, p10, p45, p90, p170 }; Vrot : -10..=10; }
            decomposition { P(ThetaL) P(Vrot | ThetaL) }
            forms { P(ThetaL) = uniform; P(Vrot | ThetaL) = dirac(if ThetaL == p10 { 1 } else { 0 }); } }";
        assert_eq!(counts(text), [Some(167.0), Some(167.0), Some(0.0)]);
    }

    #[test]
    fn independence_saves() {
        // Four binary symptoms of a binary cause: 2⁵ − 1 against 1 + 4 · 2.
        let text = "program Naive { variables { C : bool; S[1..=4] : bool; } decomposition { P(C) prod(i) { P(S[i] | C) } }
            forms { P(C) = bernoulli(0.5); P(S[i] | C) = bernoulli(if C { 0.9 } else { 0.2 }); } }";
        assert_eq!(counts(text), [Some(31.0), Some(9.0), Some(3.0)]);
    }

    #[test]
    fn rows_sum_to_one_and_parameters_count_once() {
        let text = "program Rows { parameters { e : probability = 0.1; } variables { A : 1..=3; B : bool; X : real; }
            decomposition { P(A) P(B | A) P(X | A) }
            forms { P(A) = categorical(1 / 6, 1 / 3, 1 / 2);
                    P(B | A) = table { 1 - e, e; e, 1 - e; 0.5, 0.5; };
                    P(X | A) = normal(if A == 2 { 2 * A } else { -1 }, 1.5); } }";
        // Two of three; e once and one of two halves; 2, −1 and 1.5, but not the 2 that is compared.
        assert_eq!(counts(text), [None, None, Some(2.0 + 1.0 + 1.0 + 3.0)]);
    }

    #[test]
    fn equal_expressions_of_a_form_count_once() {
        // 50 and 5, not 50 twice: X + 50 is one number from one constant.
        let text = "program Square { variables { X : 0..=9; Y : real; } decomposition { P(X) P(Y | X) }
            forms { P(X) = uniform; P(Y | X) = normal((X + 50) * (X + 50), 5); } }";
        assert_eq!(counts(text)[2], Some(2.0));
        // Two parameters of equal value are two.
        let text =
            "program Two { variables { Y : real; } decomposition { P(Y) } forms { P(Y) = normal(5, 5); } }";
        assert_eq!(counts(text)[2], Some(2.0));
    }

    #[test]
    fn rows_at_the_first_instant_and_weights_of_mixtures_sum_to_one() {
        // 1 of the first instant, 2 of the later ones; then one weight, two means and two deviations.
        let text = "program Both { variables { X, X^-1 : bool; Y : real; } decomposition { P(initial(X)) P(X | X^-1) P(Y | X) }
            forms { P(initial(X)) = categorical(0.2, 0.8); P(X | X^-1) = table { 0.9, 0.1; 0.3, 0.7; };
                    P(Y | X) = mixture(0.4, normal(0, 1), 0.6, normal(3, 2)); } }";
        assert_eq!(counts(text)[2], Some(1.0 + 2.0 + 5.0));
    }

    #[test]
    fn sizes_that_are_not_known() {
        let text = include_str!("../../../../tests/programs/line_of_sight.bp");
        assert_eq!(counts(text)[..2], [None, None]);
    }
}

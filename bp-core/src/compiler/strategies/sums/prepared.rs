//! A sum of products compiled to a kernel.
//!
//! In: an equation. Out: the table of each ask, and ln P(evidence). Invariant: kernel and schedule do not depend on the
//! inputs and are made once; a number outside the range of a form is an error that names the form.

use super::super::{Case, Found, Prepared};
use super::{by_tables, impossible};
use crate::analysis::relevant_factors;
use crate::equation::{Exact, Mark};
use crate::error::Error;
use crate::exec::{Guarded, Lanes};
use crate::ids::{ExpressionId, FactorId};
use crate::kernel::{Kernel, OutputKey};
use crate::lower::{Output, lower_guarded};
use crate::model::{Ask, DerivedKind, Expression, Finding, Form, Model, Question, Statistic, VariableUse};
use crate::operators::{Binary, Unary};
use crate::posterior::{Table, check};

/// Sums and products, ready to run.
#[derive(Debug)]
pub(super) struct Kernels {
    ln_evidence: bool,
    /// Whether exponents are kept separately from the start.
    log: bool,
    lanes: Lanes,
    outputs: Vec<Output>,
    /// The ask of each output, as a user would type it.
    texts: Vec<String>,
    /// For each ask of the route, the index of its table.
    places: Vec<usize>,
    /// Diracs of reals, and of functions, whose value may not be finite.
    diracs: Vec<FactorId>,
}

impl Kernels {
    pub(super) fn new(model: &Model, exact: &Exact, question: &Question) -> Result<Self, Error> {
        let (tables, places) = by_tables(exact);
        let log = exact.mark(model) == Mark::Log || question.asks.iter().any(compares);
        let exact = tables;
        let lowered = lower_guarded(model, &exact, &question.name)?;
        let outputs: Vec<Output> = lowered.outputs.into_iter().filter(|it| it.ask.is_some()).collect();
        let texts = outputs.iter().flat_map(|output| &output.ask).map(|ask| model.ask_text(ask)).collect();
        let (ln_evidence, lanes) = (exact.ln_evidence, Lanes::new(lowered.kernel));
        let mut diracs = relevant_factors(model, &exact.asks);
        diracs.retain(|id| {
            let factor = &model.factors[*id];
            // A function's values beyond the range of numbers lie outside its domain.
            let matters = |left: &VariableUse| {
                let variable = &model.variables[left.variable];
                !variable.domain.is_finite() || variable.derived == Some(DerivedKind::Function)
            };
            factor.left.iter().any(matters) && may_be_infinite(model, &factor.form)
        });
        Ok(Self { ln_evidence, log, lanes, outputs, texts, places, diracs })
    }
}

/// Whether a form has a Dirac whose value contains an operator that may leave the finite numbers.
fn may_be_infinite(model: &Model, form: &Form) -> bool {
    let leaves = |id: ExpressionId| match model.expressions[id] {
        Expression::Binary(Binary::Divide, _, by) => model.constant(by).is_none_or(|by| by == 0.0),
        Expression::Binary(operator, ..) => matches!(operator, Binary::Power | Binary::Remainder),
        Expression::Unary(operator, _) => matches!(
            operator,
            Unary::NaturalLogarithm
                | Unary::BinaryLogarithm
                | Unary::Exponential
                | Unary::SquareRoot
                | Unary::LnGamma
        ),
        _ => false,
    };
    match form {
        Form::Dirac(value) => model.nodes_below(*value).into_iter().any(leaves),
        Form::If { then, otherwise, .. } => may_be_infinite(model, then) || may_be_infinite(model, otherwise),
        _ => false,
    }
}

/// Whether the host divides by probabilities that may be tiny and so needs separate exponents.
fn compares(ask: &Ask) -> bool {
    matches!(ask.statistic, Statistic::Divergence { .. })
        || ask.known.iter().any(|known| matches!(known.evidence, Finding::Soft(_)))
}

impl Prepared for Kernels {
    fn place(&self, ask: usize) -> usize {
        self.places[ask]
    }

    fn kernel(&self) -> Option<&Kernel> {
        Some(self.lanes.kernel())
    }

    fn run(&self, model: &Model, case: &Case<'_>) -> Result<Vec<Found>, Error> {
        let inputs = case.inputs;
        check::families(self.outputs.iter().filter_map(|output| output.ask.as_ref()), inputs)?;
        for output in &self.outputs {
            let Some(ask) = &output.ask else { continue };
            check::refused_value(model, ask, inputs, &self.diracs)?;
        }
        let Guarded { mut outputs, mut extended, extents } = self.lanes.run_guarded(inputs, self.log)?;
        let ln_evidence = self.ln_evidence.then(|| outputs.get(OutputKey::LnEvidence)[0]);
        let mut found = Vec::new();
        for (output, text) in self.outputs.iter().zip(&self.texts) {
            let Some(ask) = &output.ask else { continue };
            let own = outputs.arrays.iter().position(|(key, _)| *key == output.key);
            let own = own.expect("internal: the output exists");
            let cells = std::mem::take(&mut outputs.arrays[own].1);
            let number = |cell: &f64| *cell >= 0.0 && cell.is_finite();
            if !cells.iter().all(number) || ln_evidence.is_some_and(|ln| ln.is_nan() || ln == f64::INFINITY) {
                return Err(check::not_a_number(model, ask, inputs));
            }
            if ln_evidence == Some(f64::NEG_INFINITY) {
                return Err(impossible(model, ask, inputs));
            }
            let extended = extended.as_mut().map(|all| std::mem::take(&mut all.arrays[own].1));
            let asked = (ask, text.clone());
            let table = Table::read(model, asked, &output.variables, cells, extended, &extents[own]);
            found.push(Found::Table(table, ln_evidence));
        }
        Ok(found)
    }
}

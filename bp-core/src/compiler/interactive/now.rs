//! Questions without time: sums of products, and closed forms of normal laws.
//!
//! In: a route. Out: its kernels, and where the answer of each ask is found. Invariant: the sizes of kernels are known.

use super::shown::{Source, of_law, of_table};
use super::{Part, Refused};
use crate::analysis::relevant_variables;
use crate::emit::javascript::emit_javascript;
use crate::error::Error;
use crate::ids::{AxisId, VariableId};
use crate::kernel::{Kernel, Reduce, Role};
use crate::lower::{NormalLowered, Phase, lower, lower_normal};
use crate::model::{Ask, Model, Question};
use crate::plan::{Exact, Options, Plan, Route, Strategy, plan_for_answer};
use crate::strategies::by_tables;
use crate::strategies::gaussian::Gaussian;
use std::collections::BTreeSet;

/// The largest number of factors for which loops are written where a join tree would be chosen.
const MOST_LOOPS: usize = 2000;

/// The largest number of products that a page computes when a control moves: about a second.
const MOST_PRODUCTS: f64 = 1e8;

/// The most reals of an instant whose law a page computes: each covariance is a line of its code.
const MOST_REALS: usize = 32;

/// The largest number of constants in the code of a question, and of different ones.
const MOST_CONSTANTS: usize = 1 << 18;
const MOST_DIFFERENT: usize = 1 << 14;

/// The plan by sums of products, where loops can be written.
pub(super) fn by_sums(model: &Model, question: &Question) -> Result<Plan, Error> {
    let cheapest = plan_for_answer(model, question, Options::default())?;
    let is_tree = |route: &Route| matches!(route, Route::Tree(tree) if tree.factors.len() <= MOST_LOOPS);
    match cheapest.routes.iter().any(is_tree) {
        true => plan_for_answer(model, question, Options::from(Some(Strategy::Sums))).or(Ok(cheapest)),
        false => Ok(cheapest),
    }
}

/// A sum of products: one run.
pub(super) fn sums(model: &Model, exact: &Exact, run: usize, name: &str) -> Result<Vec<Part>, Refused> {
    let (tables, places) = by_tables(exact);
    let mut lowered = lower(model, &tables, name)?;
    lowered.kernel = sized(lowered.kernel)?;
    let sources: Vec<Source> =
        places.iter().map(|place| of_table(model, run, &lowered, *place)).collect::<Result<_, _>>()?;
    Ok(vec![Part { kernels: vec![lowered.kernel], steps: None, sources }])
}

/// A normal law: a run for each ask.
pub(super) fn normal(
    model: &Model,
    gaussian: &Gaussian,
    run: usize,
    name: &str,
) -> Result<Vec<Part>, Refused> {
    let mut parts = Vec::new();
    for (place, ask) in gaussian.asks.iter().enumerate() {
        if ask.searched.iter().any(|item| model.is_predicate(item.variable)) {
            return Err(Refused::of(model, ask, "it asks for a predicate of reals"));
        }
        let relevant = relevant_variables(model, std::slice::from_ref(ask));
        let NormalLowered { kernel, searched, .. } =
            law(model, ask, (&gaussian.carried, &relevant), Phase::First, name)?;
        let source = of_law(model, run + place, &searched);
        let kernels = vec![sized(kernel)?];
        parts.push(Part { kernels, steps: None, sources: vec![source] });
    }
    Ok(parts)
}

/// A normal law, if it has no more reals than a page computes.
pub(super) fn law(
    model: &Model,
    ask: &Ask,
    (carried, relevant): (&[(VariableId, VariableId)], &BTreeSet<VariableId>),
    phase: Phase,
    name: &str,
) -> Result<NormalLowered, Refused> {
    // Data give it, and with them observations: what is asked without is another question.
    let given = model
        .parameters
        .values()
        .find(|parameter| !parameter.over.is_empty() && parameter.default.is_empty());
    if let Some(parameter) = given {
        let reason = format!("`{}` has a number for each of its elements, which data give", parameter.name);
        return Err(Refused::of(model, ask, reason));
    }
    let elements = |id: &VariableId| {
        let family = model.variables[*id].family;
        family.and_then(|family| model.index_count(&family.over)).unwrap_or(1) * model.components(*id)
    };
    let reals: usize = relevant.iter().map(elements).sum();
    if reals > MOST_REALS {
        let reason = format!("it has {reals} reals; a page computes {MOST_REALS}");
        return Err(Refused::of(model, ask, reason));
    }
    lower_normal(model, ask, (carried, relevant), phase, name).map_err(|error| match error {
        Error::Unplanned { reason, .. } => Refused::of(model, ask, reason),
        other => Refused::from(other),
    })
}

/// A kernel with the sizes that the program gives, if a page can hold and run it.
pub(super) fn sized(kernel: Kernel) -> Result<Kernel, Error> {
    let kernel = kernel.with_default_sizes()?;
    emit_javascript(std::slice::from_ref(&kernel))?;
    fits(&kernel)?;
    Ok(kernel)
}

/// Whether an input need not be given.
pub(super) fn has_default(role: &Role) -> bool {
    matches!(role, Role::Input { default: Some(_), .. } | Role::Table { .. })
}

/// Whether a page can hold and run a kernel whose sizes are known.
fn fits(kernel: &Kernel) -> Result<(), Error> {
    let constants = kernel.buffers.values().filter_map(|buffer| match &buffer.role {
        Role::Table { numbers, .. } => Some(numbers),
        _ => None,
    });
    let refused = |reason: String| Err(Error::Unplanned { question: kernel.name.clone(), reason });
    let count: usize = constants.clone().map(Vec::len).sum();
    if count > MOST_CONSTANTS {
        return refused(format!("its tables have {count} numbers; a page holds {MOST_CONSTANTS}"));
    }
    let different: BTreeSet<u64> = constants.flatten().map(|number| number.to_bits()).collect();
    if different.len() > MOST_DIFFERENT {
        let count = different.len();
        return refused(format!("its tables have {count} different numbers; a page holds {MOST_DIFFERENT}"));
    }
    let extent = |axis: &AxisId| kernel.axes[*axis].extent.known().unwrap_or(1) as f64;
    let products = kernel.nests.iter().map(|nest| {
        let folded = if let Reduce::Fold(_, axes) = &nest.reduce { axes.as_slice() } else { &[] };
        kernel.buffers[nest.out].axes.iter().chain(folded).map(extent).product::<f64>()
    });
    match products.sum::<f64>() {
        products if products > MOST_PRODUCTS => {
            refused(format!("it computes {products:.0} products; a page computes {MOST_PRODUCTS:.0}"))
        }
        _ => Ok(()),
    }
}

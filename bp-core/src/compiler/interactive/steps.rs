//! Filters and predictions of finite variables, as functions of a page.
//!
//! In: a question over time, and its route. Out: the kernels of its kinds of instants, and [`Steps`]: how a page runs them.
//! Invariant: an observation may be absent at any instant; the numbers are those of a filter on the host.

use super::shown::{self, Shown};
use super::{Compiled, Control, Instants, Refused, fits, has_default};
use crate::emit::javascript::emit_javascript;
use crate::error::Error;
use crate::kernel::{InputKey, Kernel};
use crate::lower::Step;
use crate::model::{Ask, Model, Statistic, When};
use crate::plan::{InstantCode, OverTime, Place};
use serde::Serialize;

/// How a page runs the functions of a question over time: the first at the first instant, the second at each later one, and
/// the third, if there is one, at the instants that are predicted.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct Steps {
    /// The input of the later functions that takes the first answer of the instant before.
    pub carried: String,
    /// The number of instants that are predicted.
    pub ahead: usize,
}

/// The functions of a filter or a prediction.
pub(super) fn followed(
    model: &Model,
    ask: &Ask,
    instants: &Instants,
    route: &OverTime,
    mut controls: Vec<Control>,
) -> Result<(Compiled, Steps), Refused> {
    let text = model.ask_text(ask);
    let refused = |why: &str| Refused(format!("a page does not compute `{text}`: {why}"));
    let (When::Filter | When::Predict(_), Statistic::Distribution) = (ask.when, &ask.statistic) else {
        return Err(refused(
            "of the questions over time it computes the distributions of `filter` and `predict`",
        ));
    };
    let mut codes = Vec::new();
    let mut carried = String::new();
    for phase in route.phases() {
        let InstantCode::Chain { step, mut lowered, .. } = route.instant(model, *phase, &text, false)? else {
            return Err(refused("it follows finite variables"));
        };
        lowered.kernel = lowered.kernel.with_default_sizes()?;
        emit_javascript(std::slice::from_ref(&lowered.kernel))?;
        fits(&lowered.kernel)?;
        let own = settable(&step, instants, &lowered.kernel, &mut controls)?;
        carried = own.unwrap_or(carried);
        codes.push((step, lowered));
    }
    let (step, shown_by) = codes.last().ok_or_else(|| refused("it has no instants"))?;
    // The last ask is that of the question; the first is that of what is carried.
    let parts = [(shown_by.clone(), vec![step.asks.len() - 1])];
    let asks: Vec<Shown> = vec![shown::shown(model, ask, &[Place { route: 0, ask: 0 }], &parts)?];
    let kernels = codes.into_iter().map(|(_, lowered)| lowered.kernel).collect();
    Ok(((kernels, controls, asks), Steps { carried, ahead: ask.when.ahead() }))
}

/// Adds a control for each parameter that the kernel of an instant reads; gives the name of the input that is carried.
fn settable(
    step: &Step,
    instants: &Instants,
    kernel: &Kernel,
    controls: &mut Vec<Control>,
) -> Result<Option<String>, Error> {
    let mut carried = None;
    for buffer in kernel.buffers.values() {
        match buffer.role.input() {
            None => {}
            Some(InputKey::Previous(_)) => carried = Some(buffer.name.clone()),
            Some(InputKey::Parameter(id)) if step.absent.iter().any(|(_, flag)| flag == id) => {}
            Some(InputKey::Parameter(id)) if buffer.axes.is_empty() => {
                if controls.iter().all(|control| control.name != buffer.name) {
                    controls.push(Control::of_parameter(&step.model.parameters[*id]));
                }
            }
            Some(InputKey::Value(variable, name))
                if instants.columns.iter().any(|column| column.name == *name)
                    && step.absent.iter().any(|(own, _)| own == variable) => {}
            _ if has_default(&buffer.role) => {}
            _ => return Err(Error::input(&buffer.name, "it is given at each instant")),
        }
    }
    Ok(carried)
}

//! Observations over time: what a reader sets at each instant.
//!
//! In: a question over time. Out: its [`Instants`]. Invariant: a column is observed at each instant, or not; its number is a value
//! of its variable.

use super::control::{Control, Element};
use super::open::{component, count, first};
use crate::ids::VariableId;
use crate::model::{Domain, Finding, Model, Question};
use serde::Serialize;

/// The number of instants at first.
const AT_FIRST: usize = 4;

/// The most columns.
const MOST_COLUMNS: usize = 32;

/// What a reader sets at each instant.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct Instants {
    /// A control for each observation of an instant.
    pub columns: Vec<Control>,
    /// The number of instants at first.
    pub count: usize,
    /// The variable of each column.
    #[serde(skip)]
    variables: Vec<VariableId>,
}

impl Instants {
    /// The observations of a question, none if it knows only what holds at each instant; `None` if it is not over time, or has too
    /// many columns.
    pub fn of(model: &Model, question: &Question) -> Option<Self> {
        let mut found = Self { columns: Vec::new(), count: AT_FIRST, variables: Vec::new() };
        let asks = question.asks.iter().filter(|ask| ask.when.is_over_time());
        let known = asks.clone().flat_map(|ask| ask.known.iter().chain(ask.statistic.from()));
        let open = known.filter(|known| {
            known.evidence == Finding::Each
                && Some(known.variable) != model.plate_index()
                && !model.is_equation(known.variable)
        });
        for known in open {
            found.add(model, known.variable)?;
        }
        (asks.count() > 0).then_some(found)
    }

    /// Adds the columns of a variable: one, or one for each element of a family.
    fn add(&mut self, model: &Model, id: VariableId) -> Option<()> {
        let variable = &model.variables[id];
        let whole = variable.family.map_or_else(|| model.variable_name(id), |_| variable.name.clone());
        let names = match (variable.family, &variable.domain) {
            (None, Domain::Vector(length)) => (0..*length).map(|at| format!("{whole}[{at}]")).collect(),
            (None, _) => vec![whole.clone()],
            (Some(family), _) => {
                let count = count(model, &family.over).filter(|count| *count <= MOST_COLUMNS)? as i64;
                let indices = family.over.first()..family.over.first() + count;
                indices.map(|index| format!("{whole}[{index}]")).collect::<Vec<_>>()
            }
        };
        for (place, name) in names.iter().enumerate() {
            if self.columns.iter().any(|column| column.name == *name) {
                continue;
            }
            let value = first(model, id, name);
            let control = Control::of_evidence(name, name, component(&variable.domain), value)?;
            let element = (*name != whole).then(|| Element { of: whole.clone(), place });
            self.columns.push(Control { element, ..control });
            self.variables.push(id);
        }
        (self.columns.len() <= MOST_COLUMNS).then_some(())
    }

    /// Whether a number is a value of a column.
    pub fn admits(&self, model: &Model, column: &str, number: f64) -> bool {
        let place = self.columns.iter().position(|one| one.name == column);
        place.is_some_and(|place| match &model.variables[self.variables[place]].domain {
            Domain::Real | Domain::Vector(_) => number.is_finite(),
            domain => domain.ordinal_at(number).is_some(),
        })
    }
}

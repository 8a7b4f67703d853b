//! Questions to a program whose families have data.
//!
//! In: a question as asked. Out: the same, in which the observed elements are known. Invariant: evidence for a family
//! in the question goes before the data; a searched family is searched where its cells are missing.

use super::{Family, PlateData};
use crate::door::Advice;
use crate::error::Error;
use crate::ids::{ExpressionId, Id, VariableId};
use crate::model::{
    Ask, Derived, DerivedKind, Expression, Finding, Known, Model, Question, Searched, Statistic, Value,
    VariableUse, When,
};

/// The most missing cells that are searched together.
const MOST_MISSING: usize = 1000;

/// Missing cells of reals that are asked together where each is wanted alone.
const TOGETHER: usize = 250;

/// The most joint values of missing cells that are asked together where each is wanted alone.
const MOST_JOINT: usize = 256;

impl PlateData {
    /// The question where the observed elements are known.
    ///
    /// # Errors
    /// It searches an observed element, or observes it again.
    pub fn known_in(&self, model: &Model, question: &Question) -> Result<Question, Error> {
        let mut question = question.clone();
        for family in &self.families {
            let mut derived = std::mem::take(&mut question.derived);
            for ask in &mut question.asks {
                self.search(model, family, ask, &mut derived)?;
                self.observed_once(family, ask.known.iter().map(|known| known.variable), &derived)?;
                know(&mut ask.known, family);
                if let Statistic::Divergence { from, .. } = &mut ask.statistic {
                    know(from, family);
                }
            }
            question.derived = derived;
        }
        Ok(question)
    }

    /// Questions for the missing cells, in their order, some cells together: reals in one question for each family, finite
    /// values in one question for at most 256 joint values.
    pub fn missing(&self, model: &Model) -> Vec<Question> {
        let mut questions = Vec::new();
        for family in &self.families {
            let missing: Vec<i64> = family.missing().collect();
            let domain = &model.variables[family.variable].domain;
            let together = match domain.count() {
                None if !domain.is_finite() => TOGETHER,
                Some(count @ 2..) => MOST_JOINT.ilog(count).max(1) as usize,
                _ => 1,
            };
            let asks: Vec<&[i64]> = missing.chunks(together).collect();
            let in_one = if domain.is_finite() { 1 } else { asks.len().max(1) };
            questions.extend(asks.chunks(in_one).map(|asks| self.question(model, family, asks)));
        }
        questions
    }

    /// A question with an ask for each of some groups of elements of a family, given all data.
    fn question(&self, model: &Model, family: &Family, asks: &[&[i64]]) -> Question {
        let mut question = Question { name: "missing".to_owned(), asks: Vec::new(), derived: Vec::new() };
        for indices in asks {
            let searched = indices.iter().map(|index| {
                question.derived.push(element(model, family, *index));
                Searched { variable: Derived::id(question.derived.len() - 1), at: None }
            });
            let (searched, mut known) = (searched.collect(), Vec::new());
            self.families.iter().for_each(|family| know(&mut known, family));
            let ask = Ask { statistic: Statistic::Distribution, when: When::Now, searched, known };
            question.asks.push(ask);
        }
        question
    }

    /// A whole family that is searched becomes its elements whose cells are missing.
    fn search(
        &self,
        model: &Model,
        family: &Family,
        ask: &mut Ask,
        derived: &mut Vec<Derived>,
    ) -> Result<(), Error> {
        let whole = |item: &Searched| item.variable == family.variable && item.at.is_none();
        let Some(at) = ask.searched.iter().position(whole) else {
            return self.observed_once(family, ask.searched.iter().map(|item| item.variable), derived);
        };
        let missing: Vec<i64> = family.missing().collect();
        let name = &family.name;
        if missing.is_empty() {
            let file = self.tables[family.place.table].path.display();
            let message =
                format!("`{file}` has a value in each cell of its column: there is nothing to predict");
            return Err(Error::input(name, message));
        }
        if missing.len() > MOST_MISSING {
            let (cells, most) = (missing.len() as f64, MOST_MISSING as f64);
            let help =
                format!("ask for some elements (`Y[3]`), or for each cell alone: `{}`", Advice::Missing);
            return Err(Error::TooLarge { name: name.clone(), cells, most, help });
        }
        let mut searched = ask.searched.split_off(at);
        let rest = searched.split_off(1);
        for index in missing {
            let wanted = element(model, family, index);
            let known = derived.iter().position(|other| other.name == wanted.name);
            let place = known.unwrap_or_else(|| {
                derived.push(wanted);
                derived.len() - 1
            });
            ask.searched.push(Searched { variable: Derived::id(place), at: None });
        }
        ask.searched.extend(rest);
        Ok(())
    }

    /// Refuses elements that a question names and whose cells have values.
    fn observed_once(
        &self,
        family: &Family,
        named: impl Iterator<Item = VariableId>,
        derived: &[Derived],
    ) -> Result<(), Error> {
        let elements = named.filter_map(|id| derived.get((u32::MAX as usize).checked_sub(id.position())?));
        let mut indices = elements.flat_map(|derived| indices(derived, family.variable));
        let Some(row) = indices.find_map(|at| family.row_of(at)) else { return Ok(()) };
        let name = format!("{}[{}]", family.name, row as i64 + family.first);
        let message = format!("known: it is the value of `{name}`; only missing cells are predicted or set");
        Err(self.tables[family.place.table].wrong(row, family.place.column, message))
    }
}

/// The elements of a family that a derived variable is; none of a predicate or a function.
fn indices(derived: &Derived, family: VariableId) -> Vec<i64> {
    let of = derived.kind == DerivedKind::Element && derived.right.iter().all(|use_| use_.variable == family);
    let index = derived.right.first().and_then(|use_| use_.element).map(|id| &derived.nodes[id.position()]);
    match (of, derived.over, index) {
        (true, Some(range), _) => (range.low..=range.high.offset).collect(),
        (true, None, Some(Expression::Number(number))) => vec![*number as i64],
        _ => Vec::new(),
    }
}

/// One element of a family, as a question would name it.
fn element(model: &Model, family: &Family, index: i64) -> Derived {
    let use_ = VariableUse { element: Some(ExpressionId::new(0)), ..VariableUse::from(family.variable) };
    Derived {
        name: model.element_name(family.variable, index),
        kind: DerivedKind::Element,
        domain: model.variables[family.variable].domain.clone(),
        over: None,
        right: vec![use_.clone()],
        nodes: vec![Expression::Number(index as f64), Expression::Variable(use_)],
    }
}

/// Adds the observed elements of a family to the known variables, unless the question gives the family other evidence.
fn know(known: &mut Vec<Known>, family: &Family) {
    let evidence = Finding::Hard(Value::Given(family.name.clone()));
    match known.iter_mut().find(|known| known.variable == family.variable) {
        Some(known) if known.evidence == Finding::Each => known.evidence = evidence,
        Some(_) => {}
        None if family.values.iter().all(|value| value.is_nan()) => {}
        None => known.push(Known { variable: family.variable, evidence }),
    }
}

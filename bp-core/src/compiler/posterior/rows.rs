//! Statistics of a table: all of it, its maximum, draws, moments.
//!
//! In: a table, the ask, the host's inputs. Out: rows, those of all of a table as its cells. Invariant: a statistic is computed in each context separately;
//! an impossible context has rows of zeros if probabilities are asked, and no row otherwise.

use super::list::AnswerRows;
use super::quantile::{figures, of_finite};
use super::statistic::check_draws;
use super::table::{Column, Table};
use super::{Figure, Row, argmax, check, moments, rank};
use crate::door::Advice;
use crate::error::Error;
use crate::exec::Inputs;
use crate::exec::compiled::least_tied;
use crate::ids::VariableId;
use crate::memory;
use crate::model::{Ask, Finding, Model, Statistic, Value};
use crate::operators::entropy;
use crate::random::seeded;
use crate::spelling::{exact, list};
use rand::RngExt;

/// Limit of the rows with names.
const MOST_ROWS: f64 = 5e6;

/// Bytes of a row, and of a name and a value in it, as they are allocated.
const ROW: f64 = 500.0;
const NAMES: f64 = 112.0;

/// Below this size the free memory is not queried: that takes longer than most answers.
const SMALL_BYTES: f64 = 256e6;

pub(crate) struct Reader<'r> {
    pub(crate) model: &'r Model,
    pub(crate) ask: &'r Ask,
    pub(crate) table: &'r Table,
    pub(crate) inputs: &'r Inputs<'r, f64>,
    pub(crate) seed: u64,
}

impl Reader<'_> {
    /// The rows, context by context.
    ///
    /// # Errors
    /// A field for ties of the wrong length; more draws than fit in memory.
    pub(crate) fn rows(&self) -> Result<AnswerRows, Error> {
        self.fits()?;
        let is_whole = self.ask.searched.iter().all(|searched| searched.at.is_none());
        match self.ask.statistic == Statistic::Distribution && is_whole {
            true => Ok(AnswerRows::of_table(self.table)),
            false => self.chosen().map(AnswerRows::from),
        }
    }

    /// The rows that a statistic makes of each context, or those of given values.
    fn chosen(&self) -> Result<Vec<Row>, Error> {
        let field = self.field()?;
        let mut random = seeded(self.seed, &self.table.question);
        if let Statistic::Draw(count) = self.ask.statistic {
            let contexts = self.table.numbers.len() / self.table.width();
            let cells = count as f64 * contexts as f64;
            check_draws(|| self.table.question.clone(), cells)?;
            self.hold(cells, "draw fewer values")?;
        }
        let left: Vec<Vec<usize>> =
            (0..self.table.width()).map(|at| Column::ordinals(&self.table.left, at)).collect();
        let mut rows = Vec::new();
        let is_density =
            self.ask.searched.iter().any(|item| item.at.is_some() && self.has_density(item.variable));
        for (context, numbers) in self.table.contexts().enumerate() {
            let wanted: Vec<usize> =
                (0..numbers.len()).filter(|at| self.is_wanted(&left[*at], context)).collect();
            let figure = |at: usize| {
                let figure = match is_density {
                    true => Figure::Density { density: numbers[at] },
                    false => Figure::Probability { p: numbers[at] },
                };
                (at, figure)
            };
            let possible = numbers.iter().any(|p| *p > 0.0);
            let chosen: Vec<(usize, Figure)> = match &self.ask.statistic {
                Statistic::Distribution => wanted.into_iter().map(figure).collect(),
                _ if !possible => continue,
                Statistic::Entropy => {
                    let entropy = entropy(wanted.iter().map(|at| numbers[*at]));
                    rows.push(self.context_row(context, Figure::Entropy { entropy, error: None }));
                    continue;
                }
                Statistic::Maximum => {
                    self.largest(numbers, &wanted, None, context).into_iter().take(1).map(figure).collect()
                }
                Statistic::Argmax { .. } => {
                    self.largest(numbers, &wanted, field, context).into_iter().map(figure).collect()
                }
                Statistic::Best(count) => {
                    let mut best = wanted;
                    best.retain(|at| numbers[*at] > 0.0);
                    rank(&mut best, |at| numbers[*at], least_tied, |at| [*at, 0]);
                    best.into_iter().take(*count).map(figure).collect()
                }
                Statistic::Draw(count) => {
                    let mut reached = 0.0;
                    let cumulative: Vec<f64> = (numbers.iter())
                        .map(|p| {
                            reached += p;
                            reached
                        })
                        .collect();
                    let mut draw = |number: usize| {
                        let at = random.random::<f64>() * reached;
                        // The first cumulative value above has a probability above 0.
                        (cumulative.partition_point(|sum| *sum <= at), Figure::Draw { draw: number })
                    };
                    (1..=*count).map(&mut draw).collect()
                }
                Statistic::Expectation | Statistic::Variance => {
                    for (column, own) in self.table.left.iter().enumerate() {
                        let Some(id) = own.variable else { continue };
                        let domain = &self.model.variables[id].domain;
                        let values = left.iter().map(|ordinals| domain.number(ordinals[column]));
                        let (expectation, variance) = moments::of(numbers, values);
                        let figure = match self.ask.statistic {
                            Statistic::Expectation => Figure::Expectation { expectation, error: None },
                            _ => Figure::Variance { variance, error: None },
                        };
                        let mut row = self.context_row(context, figure);
                        row.values.push((own.name.clone(), String::new()));
                        rows.push(row);
                    }
                    continue;
                }
                Statistic::Quantile(_) | Statistic::Interval(_) => {
                    for (column, own) in self.table.left.iter().enumerate() {
                        let Some(id) = own.variable else { continue };
                        let mut alone = vec![0.0; own.values.len()];
                        left.iter().zip(numbers).for_each(|(ordinals, p)| alone[ordinals[column]] += p);
                        let domain = &self.model.variables[id].domain;
                        let at = |levels: &[f64]| {
                            levels.iter().map(|level| (of_finite(domain, &alone, *level), None)).collect()
                        };
                        for figure in figures(&self.ask.statistic, at).unwrap_or_default() {
                            let mut row = self.context_row(context, figure);
                            row.values.push((own.name.clone(), String::new()));
                            rows.push(row);
                        }
                    }
                    continue;
                }
                Statistic::Information => {
                    let first = self.ask.searched[0].variable;
                    let second: usize = (self.table.left.iter())
                        .filter(|column| column.variable != Some(first))
                        .map(|column| column.values.len())
                        .product();
                    let information = moments::information(numbers, second);
                    rows.push(self.context_row(context, Figure::Information { information }));
                    continue;
                }
                Statistic::Divergence { .. } => {
                    let reason = "a divergence compares two tables, and here is one".to_owned();
                    return Err(Error::Unplanned { question: self.table.question.clone(), reason });
                }
            };
            rows.extend(chosen.into_iter().map(|(at, figure)| {
                let mut row = self.context_row(context, figure);
                row.values.extend(named(&self.table.left, &left[at]));
                self.name_bound(&mut row, context);
                row
            }));
        }
        Ok(rows)
    }

    /// Whether values of a variable have densities.
    fn has_density(&self, id: VariableId) -> bool {
        let form =
            || self.model.factor_of(id).is_some_and(|factor| self.model.factors[factor].form.has_density());
        !self.model.variables[id].domain.is_finite() && form()
    }

    /// Refuses more rows than fit in memory. A statistic of a context is smaller than the context itself.
    fn fits(&self) -> Result<(), Error> {
        let cells = self.table.numbers.len() as f64;
        fit(self.ask, &self.table.question, cells)?;
        match self.ask.statistic {
            Statistic::Distribution => self.hold(cells, &Advice::NumbersAlone.to_string()),
            _ => Ok(()),
        }
    }

    fn columns(&self) -> f64 {
        (self.table.right.len() + self.table.left.len()) as f64
    }

    /// Refuses rows whose names do not fit in memory.
    fn hold(&self, rows: f64, help: &str) -> Result<(), Error> {
        let bytes = rows * (ROW + NAMES * self.columns());
        match (bytes > SMALL_BYTES).then(memory::free).flatten() {
            Some(free) if bytes > free => {
                let (name, help) = (self.table.question.clone(), help.to_owned());
                Err(Error::TooLarge { name, cells: bytes / 8.0, most: (free / 8.0).floor(), help })
            }
            _ => Ok(()),
        }
    }

    /// The field that breaks ties: one number for each value, or for each value in each context.
    fn field(&self) -> Result<Option<&[f64]>, Error> {
        let Statistic::Argmax { nearest: Some(name) } = &self.ask.statistic else { return Ok(None) };
        let field = self.inputs.find(name);
        let field = field.ok_or_else(|| Error::input(name, "it was not given; it breaks ties"))?;
        let expected = [self.table.width(), self.table.numbers.len()];
        match expected.contains(&field.len()) {
            true => Ok(Some(field)),
            false => {
                let (found, expected) = (field.len(), expected[1]);
                let message = format!("{found} numbers were given, but {expected} are expected");
                Err(Error::input(name, message))
            }
        }
    }

    /// The positions of the maxima of a context.
    fn largest(
        &self,
        numbers: &[f64],
        wanted: &[usize],
        field: Option<&[f64]>,
        context: usize,
    ) -> Vec<usize> {
        let scores: Vec<f64> = wanted.iter().map(|at| numbers[*at]).collect();
        let near = |field: &[f64]| -> Vec<f64> {
            let start = if field.len() == numbers.len() { 0 } else { context * numbers.len() };
            wanted.iter().map(|at| field[start + at]).collect()
        };
        let near = field.map(near);
        argmax(&scores, near.as_deref()).into_iter().map(|tied| wanted[tied]).collect()
    }

    fn context_row(&self, context: usize, figure: Figure) -> Row {
        let right = &self.table.right;
        Row { values: named(right, &Column::ordinals(right, context)).collect(), figure }
    }

    /// Names the searched variables without a column: those with a given value.
    fn name_bound(&self, row: &mut Row, context: usize) {
        for searched in &self.ask.searched {
            let has_column = self.table.left.iter().any(|column| column.variable == Some(searched.variable));
            if let (Some(at), false) = (&searched.at, has_column) {
                let name = self.model.variable_name(searched.variable);
                row.values.push((name, self.value_at(searched.variable, at, context)));
            }
        }
    }

    /// Whether a cell is at the given values of the question.
    fn is_wanted(&self, ordinals: &[usize], context: usize) -> bool {
        self.table.left.iter().zip(ordinals).all(|(column, ordinal)| {
            let searched = self.ask.searched.iter().find(|it| Some(it.variable) == column.variable);
            match searched.and_then(|searched| searched.at.as_ref()) {
                Some(Value::Ordinal(wanted)) => ordinal == wanted,
                Some(Value::Given(name)) => {
                    let domain = column.variable.map(|id| &self.model.variables[id].domain);
                    let Some((domain, given)) = domain.zip(self.given(name, context)) else { return true };
                    domain.ordinal_among(given, None) == Some(*ordinal)
                }
                _ => true,
            }
        })
    }

    /// The input of a name: one number for all, or one for each element of the plate, which is the fastest among the
    /// contexts.
    fn given(&self, name: &str, context: usize) -> Option<f64> {
        let values = self.inputs.find(name)?;
        values.get(context % values.len().max(1)).copied()
    }

    fn value_at(&self, variable: VariableId, at: &Value, context: usize) -> String {
        let domain = &self.model.variables[variable].domain;
        match at {
            Value::Ordinal(ordinal) => self.model.value_name(variable, *ordinal),
            Value::Real(number) => exact(*number),
            Value::Vector(numbers) => list(numbers),
            Value::Given(name) => match self.given(name, context) {
                Some(number) => match domain.ordinal_among(number, None).filter(|_| domain.is_finite()) {
                    Some(ordinal) => domain.value_name(ordinal),
                    None => exact(number),
                },
                None => name.clone(),
            },
        }
    }
}

/// Refuses an answer of more rows than are shown, before its table is computed; without the contexts of a plate.
pub(crate) fn will_fit(model: &Model, ask: &Ask, inputs: &Inputs<'_, f64>) -> Result<(), Error> {
    let searched = ask.searched.iter().filter(|searched| searched.at.is_none());
    let known = ask.known.iter().filter(|known| known.evidence == Finding::Each);
    let open = searched.map(|searched| searched.variable).chain(known.map(|known| known.variable));
    let mut cells = 1.0;
    for id in open {
        let Some((count, elements)) = check::values(model, id, inputs) else { return Ok(()) };
        cells *= (count as f64).powf(elements as f64);
    }
    match cells > SMALL_BYTES / ROW {
        true => fit(ask, &model.ask_text(ask), cells),
        false => Ok(()),
    }
}

/// Refuses more rows than are shown.
fn fit(ask: &Ask, question: &str, cells: f64) -> Result<(), Error> {
    if cells <= MOST_ROWS {
        return Ok(());
    }
    let fewer = "search and know fewer variables";
    let help = match ask.statistic == Statistic::Distribution {
        true => format!("{}; or {fewer}", Advice::NumbersAlone),
        false => fewer.to_owned(),
    };
    Err(Error::TooLarge { name: question.to_owned(), cells, most: MOST_ROWS, help })
}

/// The names of values, with those of their variables.
pub(crate) fn named<'t>(
    columns: &'t [Column],
    ordinals: &'t [usize],
) -> impl Iterator<Item = (String, String)> + use<'t> {
    let name = |(column, ordinal): (&Column, &usize)| (column.name.clone(), column.values[*ordinal].clone());
    columns.iter().zip(ordinals).map(name)
}

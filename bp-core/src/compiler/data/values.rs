//! The value of a variable in a cell.
//!
//! In: a text, and the variable that it is a value of. Out: a [`Value`], a missing value, or an error. Invariant: a
//! label of the program is read first, so that a label `NA` or `?` is a value; nothing is rounded.

use crate::guess::near;
use crate::ids::VariableId;
use crate::model::{Domain, Model};
use crate::units;

/// The notations of a missing value, besides an empty cell, as in pandas, R, spreadsheets and UCI data.
pub const MISSING: [&str; 17] = [
    "?", "NA", "N/A", "n/a", "#N/A", "#N/A N/A", "#NA", "<NA>", "NaN", "nan", "NAN", "-NaN", "-nan", "NULL",
    "null", "None", "Null",
];

/// Whether a text means a missing value.
pub fn is_missing(text: &str) -> bool {
    let text = text.trim();
    text.is_empty() || MISSING.contains(&text)
}

/// A value of a variable.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Value {
    /// The ordinal in a finite domain, from 0; `None` for reals.
    pub ordinal: Option<usize>,
    /// The number in an expression; for a real in bins the number in the data, not the centre of its bin.
    pub number: f64,
}

/// The domain of a variable, for reading its values.
#[derive(Clone, Debug)]
pub struct Values<'m> {
    domain: &'m Domain,
    name: String,
    /// The domain in the notation of the language, with the size that it depends on.
    text: String,
    /// The number of values, if it is known.
    count: Option<usize>,
}

static REAL: Domain = Domain::Real;

impl Values<'static> {
    /// Real numbers that belong to no variable, such as weights.
    pub fn reals(name: &str) -> Self {
        Self { domain: &REAL, name: name.to_owned(), text: "`real`".to_owned(), count: None }
    }
}

impl<'m> Values<'m> {
    /// The domain of a variable. `size` gives sizes and the numbers of elements of sets by name, as far as they are
    /// known.
    pub fn new(model: &'m Model, variable: VariableId, size: &dyn Fn(&str) -> Option<usize>) -> Self {
        let domain = &model.variables[variable].domain;
        let named = match domain {
            Domain::Set(set) => Some(&model.sets[*set].name),
            Domain::Finite { range: Some(range), .. } => range.high.size.map(|id| &model.parameters[id].name),
            _ => None,
        };
        let known = named.and_then(|name| Some((name, size(name)?)));
        let mut text = format!("`{}`", model.domain_text(domain));
        if let Some((name, size)) = known {
            text.push_str(&format!(", with `{name}` = {size}"));
        }
        let count = match (domain, known) {
            (Domain::Set(_), Some((_, size))) => Some(size),
            (Domain::Finite { labels, range: Some(range) }, Some((_, size))) => {
                let integers = size as i64 + range.high.offset - range.low + 1;
                Some(labels.len() + usize::try_from(integers).unwrap_or(0))
            }
            _ => domain.count(),
        };
        Self { domain, name: model.variable_name(variable), text, count }
    }

    /// The value of a text; `None` if it means a missing value.
    ///
    /// # Errors
    /// It is not a value of the variable: "not a value of `X`, which is `0..=2`", to follow "`7` is ".
    pub fn read(&self, text: &str) -> Result<Option<Value>, String> {
        self.read_written(text, None)
    }

    /// The same, in a table with decimal commas, such as this one.
    pub(super) fn read_written(&self, text: &str, comma: Option<&str>) -> Result<Option<Value>, String> {
        let bare = bare(text);
        let label = || [text, text.trim(), bare].into_iter().find_map(|text| self.label(text));
        if let Some(ordinal) = label() {
            return Ok(Some(self.at(ordinal)));
        }
        if is_missing(bare) {
            return Ok(None);
        }
        if let Some(example) = comma.filter(|_| bare.contains('.') && bare.parse::<f64>().is_ok()) {
            return Err(format!(
                "written with a point, but this file has decimal commas, such as `{example}`: a point might divide \
                 thousands; write all numbers alike"
            ));
        }
        let pointed = comma.and_then(|_| with_point(bare));
        let found = self.value(pointed.as_deref().unwrap_or(bare));
        found.map(Some).ok_or_else(|| self.refusal(bare))
    }

    /// The ordinal of a label.
    fn label(&self, text: &str) -> Option<usize> {
        let Domain::Finite { labels, .. } = self.domain else { return None };
        labels.iter().position(|label| label == text)
    }

    /// The value of this ordinal.
    fn at(&self, ordinal: usize) -> Value {
        Value { ordinal: Some(ordinal), number: self.domain.number(ordinal) }
    }

    /// The value of a text that is not a label.
    fn value(&self, text: &str) -> Option<Value> {
        // −0 is 0.
        let real = || text.parse().ok().filter(|number: &f64| number.is_finite()).map(|number| number + 0.0);
        let below = |ordinal: &usize| self.count.is_none_or(|count| *ordinal < count);
        match self.domain {
            Domain::Boolean => boolean(text).map(|truth| self.at(usize::from(truth))),
            Domain::Finite { labels, range } => {
                let number = integer(text)?;
                if let Some(ordinal) = self.label(&number.to_string()) {
                    return Some(self.at(ordinal));
                }
                range.as_ref()?;
                let ordinal = usize::try_from(number.checked_sub(self.domain.base())?).ok()?;
                (ordinal >= labels.len() && below(&ordinal)).then(|| self.at(ordinal))
            }
            Domain::Set(_) => {
                let element = usize::try_from(integer(text)?).ok().filter(below)?;
                Some(Value { ordinal: Some(element), number: element as f64 })
            }
            Domain::Bins(bins) => {
                let number = real()?;
                Some(Value { ordinal: Some(bins.holding(number)?), number })
            }
            Domain::Real | Domain::Vector(_) => Some(Value { ordinal: None, number: real()? }),
        }
    }

    /// The error for a text that is not a value.
    fn refusal(&self, text: &str) -> String {
        let help = match self.domain {
            Domain::Boolean => ": write `true` or `false`, `1` or `0`".to_owned(),
            Domain::Bins(_) => self.domain.help().map_or_else(String::new, |help| format!(": {help}")),
            Domain::Real | Domain::Vector(_) if text.parse::<f64>().is_ok() => {
                ": write a finite number".to_owned()
            }
            Domain::Real | Domain::Vector(_) if with_point(text).is_some() => {
                ": write a decimal point, or separate columns with semicolons".to_owned()
            }
            Domain::Finite { labels, .. } => match near(text, labels.iter().map(String::as_str)) {
                Some(name) => format!("; did you mean `{name}`?"),
                None => String::new(),
            },
            _ => String::new(),
        };
        let unit = if self.domain == &Domain::Boolean { None } else { units::in_value(text) };
        let help = unit.map_or(help, |help| format!(": {help}"));
        format!("not a value of `{}`, which is {}{help}", self.name, self.text)
    }
}

/// Without the blanks around it, and without the quotation marks then around it.
fn bare(text: &str) -> &str {
    let text = text.trim();
    let inside = |mark: char| text.strip_prefix(mark).and_then(|rest| rest.strip_suffix(mark)).map(str::trim);
    inside('"').or_else(|| inside('\'')).unwrap_or(text)
}

/// A boolean as programs, pandas, R and spreadsheets write it.
fn boolean(text: &str) -> Option<bool> {
    match text.to_ascii_lowercase().as_str() {
        "true" | "t" => Some(true),
        "false" | "f" => Some(false),
        _ => match text.parse::<f64>() {
            Ok(1.0) => Some(true),
            Ok(0.0) => Some(false),
            _ => None,
        },
    }
}

/// A whole number, also as `1.0` or `1e3`.
fn integer(text: &str) -> Option<i64> {
    // Larger whole numbers are not exact in f64.
    const MOST: f64 = 9_007_199_254_740_992.0;
    text.parse().ok().or_else(|| {
        let number: f64 = text.parse().ok()?;
        (number.fract() == 0.0 && number.abs() < MOST).then_some(number as i64)
    })
}

/// A number with a decimal comma, written with a point; `None` where it is not one.
pub(super) fn with_point(text: &str) -> Option<String> {
    let (whole, rest) = text.split_once(',')?;
    let digits = rest.split(['e', 'E']).next().unwrap_or(rest);
    let plain =
        !whole.contains('.') && !digits.is_empty() && digits.bytes().all(|byte| byte.is_ascii_digit());
    let pointed = format!("{whole}.{rest}");
    (plain && pointed.parse::<f64>().is_ok()).then_some(pointed)
}

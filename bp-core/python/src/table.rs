//! Tables of Python as records.
//!
//! In: a frame with Arrow's C data interface (`__arrow_c_stream__`: pandas, polars, pyarrow, DuckDB), or a mapping of names
//! to columns. Out: [`Records`], whose cells are read as those of a file. Invariant: null and NaN are missing; a category
//! is its name; the rows of messages are positions in the frame, from 0.

use crate::error::wrong;
use arrow_array::cast::AsArray;
use arrow_array::types::{
    Decimal32Type, Decimal64Type, Decimal128Type, Decimal256Type, Float16Type, Float32Type, Float64Type,
    Int8Type, Int16Type, Int32Type, Int64Type, UInt8Type, UInt16Type, UInt32Type, UInt64Type,
};
use arrow_array::{
    Array, ArrayRef, BooleanArray, LargeStringArray, RecordBatch, StringArray, StringViewArray,
};
use arrow_schema::{DataType, Schema};
use bp_core::compiler::model::{Domain, Model};
use bp_core::prelude::{Error, Records};
use numpy::{PyArrayDescrMethods, PyReadonlyArray1, PyUntypedArray, PyUntypedArrayMethods};
use pyo3::exceptions::{PyImportError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{IntoPyDict, PyMapping, PyString};
use pyo3_arrow::PyArray;
use pyo3_arrow::input::AnyRecordBatch;
use std::fmt::Write;
use std::sync::Arc;

/// The name of a table in memory in messages.
const NAME: &str = "the table";

/// A table in memory: batches of columns of equal length.
pub(crate) struct Table {
    columns: Vec<String>,
    /// The words for false and true in each column.
    words: Vec<[&'static str; 2]>,
    batches: Vec<(usize, Vec<Cells>)>,
}

/// The cells of a column in a batch.
enum Cells {
    /// Of Arrow, or numbers of numpy, without a copy.
    Arrow(ArrayRef),
    /// Texts of Arrow, without a copy: most columns are these, and finding the type of an array takes longer than a text.
    Strings(StringArray),
    LargeStrings(LargeStringArray),
    Views(StringViewArray),
    /// Categories: the name of each, and the position of that of each row.
    Categories(Vec<Option<usize>>, ArrayRef),
    /// As text; empty where missing.
    Texts(Vec<String>),
    /// This number of cells that are not read.
    Ignored(usize),
}

impl Table {
    /// The table of a Python object; `model` gives the words of its labels for true and false. Ignored columns are empty.
    ///
    /// # Errors
    /// An object without columns, columns of different lengths, a type of cells that is no value.
    pub(crate) fn of(
        py: Python<'_>,
        model: Option<&Model>,
        table: &Bound<'_, PyAny>,
        ignored: &[String],
    ) -> PyResult<Self> {
        // The index of a pandas frame would be a column.
        let plain = match table.hasattr("reset_index")? {
            true => Some(table.call_method("reset_index", (), Some(&[("drop", true)].into_py_dict(py)?))?),
            false => None,
        };
        let table = plain.as_ref().unwrap_or(table);
        let is_arrow = table.hasattr("__arrow_c_stream__")? || table.hasattr("__arrow_c_array__")?;
        let mut found = match is_arrow {
            true => match read(table) {
                Ok((schema, batches)) => Self::of_arrow(&schema, &batches, ignored)?,
                // pandas exports by means of pyarrow, which may be absent; Arrow may not read a type of polars.
                Err(error) if table.hasattr("columns")? || table.hasattr("schema")? => {
                    Self::of_columns(table, ignored).map_err(|other| {
                        match error.is_instance_of::<PyImportError>(py) {
                            true => other,
                            false if error.is_instance_of::<PyValueError>(py) => {
                                wrong(error.value(py).to_string())
                            }
                            false => error,
                        }
                    })?
                }
                // One column, such as a series.
                Err(_) => return Err(no_columns(table)),
            },
            false => Self::of_columns(table, ignored)?,
        };
        found.words = found.columns.iter().map(|name| words(model, name)).collect();
        Ok(found)
    }

    fn of_arrow(schema: &Schema, batches: &[RecordBatch], ignored: &[String]) -> PyResult<Self> {
        let fields = schema.fields();
        let columns: Vec<String> = fields.iter().map(|field| field.name().clone()).collect();
        let mut found = Vec::new();
        for batch in batches {
            let cells = fields.iter().zip(batch.columns()).map(|(field, array)| {
                if ignored.contains(field.name()) {
                    return Ok(Cells::Ignored(array.len()));
                }
                match field.metadata().get("ARROW:extension:name") {
                    // The numbers in which the values of a type of others are kept are no values: pandas' periods are months since 1970.
                    Some(kind) => Err(no_value(field.name(), kind)),
                    None => arrow(field.name(), array),
                }
            });
            found.push((batch.num_rows(), cells.collect::<PyResult<_>>()?));
        }
        Ok(Self { columns, words: Vec::new(), batches: found })
    }

    fn of_columns(table: &Bound<'_, PyAny>, ignored: &[String]) -> PyResult<Self> {
        let names: Vec<Bound<'_, PyAny>> = if let Ok(mapping) = table.cast::<PyMapping>() {
            mapping.keys()?.iter().collect()
        } else if table.hasattr("columns")? {
            table.getattr("columns")?.try_iter()?.collect::<PyResult<_>>()?
        } else {
            return Err(no_columns(table));
        };
        let (mut columns, mut cells, mut rows) = (Vec::new(), Vec::new(), None);
        for name in names {
            let (column, own) = column(&name, &table.get_item(&name)?, ignored)?;
            let expected = *rows.get_or_insert(own.len());
            if own.len() != expected {
                return Err(wrong(format!(
                    "column `{column}` has {} rows, but `{}` has {expected}",
                    own.len(),
                    columns[0]
                )));
            }
            columns.push(column);
            cells.push(own);
        }
        Ok(Self { columns, words: Vec::new(), batches: vec![(rows.unwrap_or(0), cells)] })
    }

    /// The number of rows.
    pub(crate) fn len(&self) -> usize {
        self.batches.iter().map(|(rows, _)| rows).sum()
    }

    /// All rows.
    ///
    /// # Errors
    /// See [`Records::of_columns`].
    pub(crate) fn records(&self) -> Result<Records, Error> {
        self.part(0, self.len())
    }

    /// Some rows, from one on.
    ///
    /// # Errors
    /// See [`Records::of_columns`].
    pub(crate) fn part(&self, from: usize, rows: usize) -> Result<Records, Error> {
        // The batch of the current row, and the row in which it begins: rows ascend.
        let (mut batch, mut begin) = (0, 0);
        Records::of_columns(NAME, self.columns.clone(), (from, rows), |row, column, text| {
            let row = from + row;
            while row - begin >= self.batches[batch].0 {
                begin += self.batches[batch].0;
                batch += 1;
            }
            self.batches[batch].1[column].write(row - begin, self.words[column], text);
        })
    }
}

impl Cells {
    fn len(&self) -> usize {
        match self {
            Cells::Arrow(array) => array.len(),
            Cells::Strings(texts) => texts.len(),
            Cells::LargeStrings(texts) => texts.len(),
            Cells::Views(texts) => texts.len(),
            Cells::Categories(keys, _) => keys.len(),
            Cells::Texts(texts) => texts.len(),
            Cells::Ignored(count) => *count,
        }
    }

    /// Appends the text of a cell.
    fn write(&self, row: usize, words: [&str; 2], text: &mut String) {
        // Writing to a string cannot fail.
        match self {
            Cells::Arrow(array) => arrow_cell(array, row, words, text),
            Cells::Strings(texts) if texts.is_valid(row) => text.push_str(texts.value(row)),
            Cells::LargeStrings(texts) if texts.is_valid(row) => text.push_str(texts.value(row)),
            Cells::Views(texts) if texts.is_valid(row) => text.push_str(texts.value(row)),
            Cells::Strings(_) | Cells::LargeStrings(_) | Cells::Views(_) => {}
            Cells::Categories(keys, names) => {
                if let Some(key) = keys[row] {
                    arrow_cell(names, key, words, text);
                }
            }
            Cells::Texts(texts) => text.push_str(&texts[row]),
            Cells::Ignored(_) => {}
        }
    }
}

/// A real with all its digits; nothing if it is NaN.
fn real(number: f64, text: &mut String) {
    if !number.is_nan() {
        let _ = write!(text, "{number:?}");
    }
}

/// The words for false and true in a column: those of the variable, if it has labels.
fn words(model: Option<&Model>, name: &str) -> [&'static str; 2] {
    const SPELLINGS: [[&str; 2]; 3] = [["false", "true"], ["False", "True"], ["FALSE", "TRUE"]];
    let plain = name.split('[').next().unwrap_or(name);
    let domain = model.and_then(|model| Some(&model.variables[model.variable(plain)?].domain));
    let Some(Domain::Finite { labels, .. }) = domain else { return SPELLINGS[0] };
    let has = |words: &[&str; 2]| words.iter().all(|word| labels.iter().any(|label| label == word));
    SPELLINGS.into_iter().find(has).unwrap_or(SPELLINGS[0])
}

/// The schema and the batches of a table of Arrow.
fn read(table: &Bound<'_, PyAny>) -> PyResult<(Arc<Schema>, Vec<RecordBatch>)> {
    let reader = table.extract::<AnyRecordBatch>()?.into_reader()?;
    let schema = reader.schema();
    let batches = reader.collect::<Result<_, _>>().map_err(|error| wrong(error.to_string()))?;
    Ok((schema, batches))
}

/// The cells of an Arrow array.
fn arrow(name: &str, array: &ArrayRef) -> PyResult<Cells> {
    if let Some(categories) = array.as_any_dictionary_opt() {
        plain(name, categories.values().data_type())?;
        let keys = categories.normalized_keys().into_iter().enumerate();
        let keys = keys.map(|(row, key)| categories.keys().is_valid(row).then_some(key)).collect();
        return Ok(Cells::Categories(keys, categories.values().clone()));
    }
    plain(name, array.data_type())?;
    Ok(match array.data_type() {
        DataType::Utf8 => Cells::Strings(array.as_string().clone()),
        DataType::LargeUtf8 => Cells::LargeStrings(array.as_string().clone()),
        DataType::Utf8View => Cells::Views(array.as_string_view().clone()),
        _ => Cells::Arrow(array.clone()),
    })
}

/// Refuses a type whose cells are no values.
fn plain(name: &str, kind: &DataType) -> PyResult<()> {
    let known = kind.is_integer()
        || matches!(
            kind,
            DataType::Null
                | DataType::Boolean
                | DataType::Float16
                | DataType::Float32
                | DataType::Float64
                | DataType::Decimal32(..)
                | DataType::Decimal64(..)
                | DataType::Decimal128(..)
                | DataType::Decimal256(..)
                | DataType::Utf8
                | DataType::LargeUtf8
                | DataType::Utf8View
        );
    known.then_some(()).ok_or_else(|| no_value(name, kind))
}

fn no_value(name: &str, kind: impl std::fmt::Display) -> PyErr {
    wrong(format!("column `{name}` has the type {kind}: give text, booleans, integers, reals or categories"))
}

/// Appends the text of a cell of an array that is [`plain`].
fn arrow_cell(array: &ArrayRef, row: usize, words: [&str; 2], text: &mut String) {
    macro_rules! integers {
        ($($kind:ident => $of:ident),*) => {
            match array.data_type() {
                $(DataType::$kind => drop(write!(text, "{}", array.as_primitive::<$of>().value(row))),)*
                DataType::Boolean => text.push_str(words[usize::from(array.as_boolean().value(row))]),
                DataType::Decimal32(..) => text.push_str(&array.as_primitive::<Decimal32Type>().value_as_string(row)),
                DataType::Decimal64(..) => text.push_str(&array.as_primitive::<Decimal64Type>().value_as_string(row)),
                DataType::Decimal128(..) => text.push_str(&array.as_primitive::<Decimal128Type>().value_as_string(row)),
                DataType::Decimal256(..) => text.push_str(&array.as_primitive::<Decimal256Type>().value_as_string(row)),
                DataType::Float16 => real(array.as_primitive::<Float16Type>().value(row).to_f64(), text),
                DataType::Float32 => {
                    let number = array.as_primitive::<Float32Type>().value(row);
                    if !number.is_nan() {
                        let _ = write!(text, "{number:?}");
                    }
                }
                DataType::Float64 => real(array.as_primitive::<Float64Type>().value(row), text),
                DataType::Utf8 => text.push_str(array.as_string::<i32>().value(row)),
                DataType::LargeUtf8 => text.push_str(array.as_string::<i64>().value(row)),
                DataType::Utf8View => text.push_str(array.as_string_view().value(row)),
                _ => {}
            }
        };
    }
    if array.is_valid(row) {
        integers!(
            Int8 => Int8Type, Int16 => Int16Type, Int32 => Int32Type, Int64 => Int64Type,
            UInt8 => UInt8Type, UInt16 => UInt16Type, UInt32 => UInt32Type, UInt64 => UInt64Type
        );
    }
}

fn no_columns(table: &Bound<'_, PyAny>) -> PyErr {
    let kind = table.get_type().name().map_or_else(|_| "object".to_owned(), |name| name.to_string());
    wrong(format!(
        "a table is a path, a frame (pandas, polars, Arrow) or a mapping of names to columns, not a `{kind}`"
    ))
}

/// The numbers or booleans of an array of numpy; `None` of other types. Numbers that are contiguous, aligned and of
/// the machine's byte order are read where they are, others are copied; booleans become bits.
fn numbers(array: &Bound<'_, PyUntypedArray>) -> PyResult<Option<ArrayRef>> {
    if let Ok(truths) = array.extract::<PyReadonlyArray1<'_, bool>>() {
        let truths: BooleanArray = truths.as_array().iter().map(|truth| Some(*truth)).collect();
        return Ok(Some(Arc::new(truths)));
    }
    let native = array.dtype().call_method1("newbyteorder", ("=",))?;
    let requirements = (array, native, ["C_CONTIGUOUS", "ALIGNED"]);
    let plain = array.py().import("numpy")?.call_method1("require", requirements)?;
    Ok(plain.extract::<PyArray>().ok().map(|numbers| numbers.into_inner().0))
}

/// A column of a mapping: an array, or any sequence of booleans, numbers, texts and `None`.
fn column(
    name: &Bound<'_, PyAny>,
    values: &Bound<'_, PyAny>,
    ignored: &[String],
) -> PyResult<(String, Cells)> {
    let name = name.cast::<PyString>().map_err(|_| wrong(format!("the column name {name} is not a text")))?;
    let name = name.to_str()?.to_owned();
    if ignored.contains(&name) {
        return Ok((name, Cells::Ignored(values.len()?)));
    }
    let values = match values.hasattr("to_numpy")? {
        true => values.call_method0("to_numpy")?,
        // A masked array of numpy: a list with `None` where it is masked.
        false if values.hasattr("mask")? && values.hasattr("filled")? => values.call_method0("tolist")?,
        false => values.clone(),
    };
    if let Ok(array) = values.cast::<PyUntypedArray>() {
        if array.ndim() != 1 {
            return Err(wrong(format!("column `{name}` has {} axes: give one", array.ndim())));
        }
        if let Some(numbers) = numbers(array)? {
            return Ok((name, Cells::Arrow(numbers)));
        }
        // Texts, objects and reals of other widths are read one by one.
        if !b"UOTf".contains(&array.dtype().kind()) {
            return Err(no_value(&name, array.dtype()));
        }
    }
    if values.cast::<PyString>().is_ok() || !values.hasattr("__iter__")? {
        return Err(wrong(format!("column `{name}` is {}: give a list or an array", values.repr()?)));
    }
    let text = |value: Bound<'_, PyAny>| -> PyResult<String> {
        let mut text = String::new();
        if let Ok(truth) = value.extract::<bool>() {
            text.push_str(if truth { "true" } else { "false" });
        } else if let Ok(label) = value.cast::<PyString>() {
            text.push_str(label.to_str()?);
        } else if let Ok(number) = value.extract::<i64>() {
            let _ = write!(text, "{number}");
        } else if let Ok(number) = value.extract::<f64>() {
            real(number, &mut text);
        } else if !value.is_none() && value.get_type().name()? != "NAType" {
            let kind = value.get_type().name()?;
            return Err(wrong(format!(
                "column `{name}` has {} of type `{kind}`, which is no value",
                value.repr()?
            )));
        }
        Ok(text)
    };
    let texts = values.try_iter()?.map(|value| text(value?)).collect::<PyResult<_>>()?;
    Ok((name, Cells::Texts(texts)))
}

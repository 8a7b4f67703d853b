//! The cells of a column as values.
//!
//! In: a table, a column, and the variable that it is of. Out: the value of each cell. Invariant: values are those of
//! [`Records::cell`]; a short text that occurs again and again is read once.

use super::{Records, Value, Values};
use crate::error::Error;

/// Number of texts that are remembered.
const TEXTS: usize = 64;

/// Reads the cells of a column.
#[derive(Clone, Debug)]
pub struct Cells<'t> {
    table: &'t Records,
    column: usize,
    values: Values<'t>,
    /// Short texts with their values, each at a place that its bytes determine.
    known: [Option<(u64, Option<Value>)>; TEXTS],
}

impl<'t> Cells<'t> {
    /// The cells of a column, as values of a variable.
    pub fn new(table: &'t Records, column: usize, values: Values<'t>) -> Self {
        Self { table, column, values, known: [None; TEXTS] }
    }

    /// The value of the cell in a row; `None` if it is missing.
    ///
    /// # Errors
    /// The cell is not a value of the variable.
    pub fn value(&mut self, row: usize) -> Result<Option<Value>, Error> {
        let Some(text) = packed(self.table.text(row, self.column)) else {
            return self.table.cell(row, self.column, &self.values);
        };
        // The high bits of the product depend on all bytes (Knuth, The Art of Computer Programming, volume 3, 6.4).
        let place = (text.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 58) as usize;
        match self.known[place] {
            Some((known, value)) if known == text => Ok(value),
            _ => {
                let value = self.table.cell(row, self.column, &self.values)?;
                self.known[place] = Some((text, value));
                Ok(value)
            }
        }
    }
}

/// The bytes of a text and their number, if these are at most seven.
fn packed(text: &str) -> Option<u64> {
    let mut bytes = [0; 8];
    bytes.get_mut(..text.len()).filter(|_| text.len() < 8)?.copy_from_slice(text.as_bytes());
    bytes[7] = text.len() as u8;
    Some(u64::from_le_bytes(bytes))
}

#[cfg(test)]
mod tests {
    use super::super::{Values, read_table};
    use super::Cells;
    use crate::source::Source;
    use std::path::Path;

    /// Against [`Records::cell`], for texts that differ only in blanks, in length, or in a byte that is zero.
    #[test]
    fn cells_are_those_of_the_table() {
        let text = "program Table { variables { A : { low, high }; R : real; }
            decomposition { P(A) P(R) } forms { P(A) = uniform; P(R) = normal(0, 1); } }";
        let model = crate::syntax::compile(&Source::new("p", text)).unwrap();
        let mut rows = String::from("A,R\n");
        for row in 0..400 {
            let a = ["low", " low", "high", "", "NA", "\"low \""][row * 7 % 6];
            let r = ["1", "1.0", "10", "-0", "?", "123456789.5", "1e3"][row * 5 % 7];
            rows.push_str(&format!("{a},{r}\n"));
        }
        let table = read_table(Path::new("d.csv"), rows.as_bytes()).unwrap();
        for (column, name) in ["A", "R"].into_iter().enumerate() {
            let values = Values::new(&model, model.variable(name).unwrap(), &|_| None);
            let mut cells = Cells::new(&table, column, values.clone());
            for row in 0..table.len() {
                assert_eq!(cells.value(row).unwrap(), table.cell(row, column, &values).unwrap());
            }
        }
        let wrong = read_table(Path::new("d.csv"), "A,R\nlow,1\nlaw,2\n".as_bytes()).unwrap();
        let values = Values::new(&model, model.variable("A").unwrap(), &|_| None);
        let mut cells = Cells::new(&wrong, 0, values);
        assert!(cells.value(0).is_ok());
        let error = cells.value(1).unwrap_err().to_string();
        assert!(error.starts_with("`d.csv`, row 3, column `A`: `law` is not a value of `A`"), "{error}");
    }
}

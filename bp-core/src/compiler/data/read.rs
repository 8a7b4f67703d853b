//! Reads a table from a file.
//!
//! In: bytes. Out: a [`Records`]. Invariant: violations of RFC 4180 are errors with their row: text that is not UTF-8, an
//! unclosed quotation mark, a row too short or too long, a duplicate column name.

use super::values::{is_missing, with_point};
use super::{Records, shown, wrong};
use crate::error::Error;
use crate::files;
use csv::{ReaderBuilder, StringRecord};
use std::collections::HashMap;
use std::fs::File;
use std::io::Read;
use std::path::Path;

/// Possible separators, the most likely first.
const SEPARATORS: [u8; 3] = [b',', b';', b'\t'];

/// Number of rows used to detect the separator.
const LOOKED_AT: usize = 50;

/// Appended to the text while it is read, to detect an unclosed quotation mark.
const END: &str = "\u{1}";

/// Reads a table from a file; `separator` overrides the detection.
///
/// # Errors
/// See [`read_table`].
pub fn open(path: &Path, separator: Option<u8>) -> Result<Records, Error> {
    let file = File::open(path).map_err(|error| Error::file(path, error))?;
    read(path, file, separator)
}

/// Reads a table whose columns are separated by commas, semicolons or tabs, whichever divides the first row into the
/// most columns.
///
/// # Errors
/// The file cannot be read, is too long, is not UTF-8, has no header or a duplicate column name, a row that is too
/// short or too long, or an unclosed quotation mark.
pub fn read_table(path: &Path, from: impl Read) -> Result<Records, Error> {
    read(path, from, None)
}

impl Records {
    pub(super) fn push<'c>(&mut self, line: usize, cells: impl IntoIterator<Item = &'c str>) {
        for cell in cells {
            self.cells.push_str(cell);
            self.ends.push(self.cells.len() as u32);
        }
        self.lines.push(line as u32);
    }
}

pub(super) fn read(path: &Path, from: impl Read, separator: Option<u8>) -> Result<Records, Error> {
    let bytes = files::bounded(from).map_err(|error| Error::file(path, error))?;
    let mut text = text(bytes).map_err(|message| wrong(path, message))?;
    if !text.ends_with(['\n', '\r']) {
        text.push('\n');
    }
    text.push_str(END);
    // Spreadsheets read a first line `sep=;`.
    let declared = match text.as_bytes() {
        [b's', b'e', b'p', b'=', sign, b'\r' | b'\n', ..]
            if sign.is_ascii_punctuation() || *sign == b'\t' =>
        {
            Some(*sign)
        }
        _ => None,
    };
    let separator = separator.or(declared);
    if declared.is_some() {
        text.replace_range(..5, "");
    }
    let length = text.len() - END.len();
    let found = separator.unwrap_or_else(|| separator_of(&text));
    let mut rows = Rows::new(&text, found);
    if rows.next(path)?.is_none_or(|row| row.begin >= length) {
        return Err(wrong(path, "row 1 must name the columns, but the file is empty".to_owned()));
    }
    let names = rows.record.clone();
    let width = names.len();
    let mut table = Records { path: path.to_owned(), separator: found, width, ..Records::default() };
    table.names = names.iter().map(str::to_owned).collect();
    while let Some(row) = rows.next(path)? {
        // An empty row is an unobserved instant if there is one column, and is ignored if there are several.
        let blank_rows = if width == 1 { row.blanks } else { 0 };
        for blank in 0..blank_rows {
            table.push(row.line - row.blanks + blank, [""]);
        }
        if row.begin >= length {
            break;
        }
        let record = &rows.record;
        if width > 1 && record.len() == 1 && record[0].trim().is_empty() {
            continue;
        }
        if record.len() != width {
            return Err(wrong(path, ragged(&row, record.len(), width)));
        }
        table.push(row.line, record);
    }
    name_columns(&mut table, &names)?;
    find_decimal_commas(&mut table, found);
    if table.is_empty() {
        table.notes.push("it has column names, but no rows".to_owned());
    }
    if let (None, b';' | b'\t') = (separator, found) {
        let what = if found == b';' { "semicolons" } else { "tabs" };
        table.notes.insert(0, format!("its columns are separated by {what}"));
    }
    Ok(table)
}

/// Decodes the text, without a byte order mark.
fn text(bytes: Vec<u8>) -> Result<String, String> {
    if files::is_utf16(&bytes) {
        return Err("UTF-16 text; save it as UTF-8".to_owned());
    }
    if let Some(at) = bytes.iter().position(|byte| *byte == 0) {
        let row = row_of(&bytes[..at]);
        return Err(format!("row {row} contains a zero byte: the file is not text, or not UTF-8"));
    }
    let mut text = String::from_utf8(bytes).map_err(|error| {
        let row = row_of(&error.as_bytes()[..error.utf8_error().valid_up_to()]);
        format!("row {row} is not UTF-8 text; save the file as UTF-8")
    })?;
    if text.starts_with('\u{feff}') {
        text.drain(..'\u{feff}'.len_utf8());
    }
    Ok(text)
}

fn row_of(before: &[u8]) -> usize {
    before.iter().filter(|byte| **byte == b'\n').count() + 1
}

/// Detects the separator: it divides the first row into the most columns and, among equals, the next rows into the same
/// number.
fn separator_of(text: &str) -> u8 {
    let score = |separator: u8| {
        let mut rows = ReaderBuilder::new()
            .has_headers(false)
            .flexible(true)
            .delimiter(separator)
            .from_reader(text.as_bytes());
        let mut widths = rows.byte_records().take(LOOKED_AT).map_while(Result::ok).map(|row| row.len());
        let width = widths.next().unwrap_or(0);
        (width, widths.filter(|found| *found == width).count())
    };
    let scored = SEPARATORS.into_iter().rev().map(|separator| (score(separator), separator));
    // The first of the best; with one column there is no separator.
    let best = scored.filter(|((width, _), _)| *width > 1).max_by_key(|(score, _)| *score);
    best.map_or(SEPARATORS[0], |(_, separator)| separator)
}

/// The position of a row.
struct Row {
    /// Its first byte.
    begin: usize,
    /// Its first line, from 1.
    line: usize,
    /// The number of its lines.
    lines: usize,
    /// The empty lines before it.
    blanks: usize,
}

/// The rows of a text, with their positions; the last one is [`END`].
struct Rows<'t> {
    text: &'t str,
    reader: csv::Reader<&'t [u8]>,
    /// The cells of the last row read.
    record: StringRecord,
    line: usize,
}

impl<'t> Rows<'t> {
    fn new(text: &'t str, separator: u8) -> Self {
        let mut builder = ReaderBuilder::new();
        builder.has_headers(false).flexible(true).delimiter(separator);
        Self { text, reader: builder.from_reader(text.as_bytes()), record: StringRecord::new(), line: 1 }
    }

    fn next(&mut self, path: &Path) -> Result<Option<Row>, Error> {
        let mut begin = self.reader.position().byte() as usize;
        let read = self.reader.read_record(&mut self.record);
        if !read.map_err(|error| Error::file(path, error.into()))? {
            return Ok(None);
        }
        let end = self.reader.position().byte() as usize;
        let text = self.text.as_bytes();
        // The reader may stop between `\r` and `\n`.
        if begin > 0 && text[begin - 1] == b'\r' && text[begin] == b'\n' {
            begin += 1;
        }
        let first = (begin..end).find(|at| !matches!(text[*at], b'\r' | b'\n')).unwrap_or(end);
        let blanks = line_ends(&text[begin..first]);
        let line = self.line + blanks;
        let lines = line_ends(&text[first..end]);
        self.line = line + lines;
        if end == text.len() && first + END.len() < end {
            return Err(wrong(path, format!("row {line} opens a quotation mark that is never closed")));
        }
        Ok(Some(Row { begin: first, line, lines, blanks }))
    }
}

/// Number of line ends in a text: `\n`, `\r\n` or `\r`.
fn line_ends(text: &[u8]) -> usize {
    let ends = |(at, byte): (usize, &u8)| match byte {
        b'\n' => true,
        b'\r' => text.get(at + 1) != Some(&b'\n'),
        _ => false,
    };
    text.iter().enumerate().filter(|pair| ends(*pair)).count()
}

fn ragged(row: &Row, found: usize, width: usize) -> String {
    let cells = |count: usize| format!("{count} cell{}", if count == 1 { "" } else { "s" });
    let columns = if width == 1 { "is 1 column".to_owned() } else { format!("are {width} columns") };
    let mut message = format!("row {} has {}, but there {columns}", row.line, cells(found));
    if row.lines > 1 {
        let last = row.line + row.lines - 1;
        message.push_str(&format!("; a quotation mark opened there is closed only in row {last} only"));
    }
    message
}

/// Names the columns. A first column without a name numbers the rows, as pandas and R write it; others without a name
/// must be empty.
fn name_columns(table: &mut Records, names: &StringRecord) -> Result<(), Error> {
    let mut known: HashMap<&str, usize> = HashMap::with_capacity(names.len());
    for (position, name) in names.iter().enumerate() {
        let name = name.trim();
        let counts = position == 0 && names.len() > 1 && (name.is_empty() || name == "Unnamed: 0");
        if counts {
            table.notes.push("its first column has no name and was ignored".to_owned());
            continue;
        }
        if name.is_empty() {
            let filled =
                (0..table.len()).find(|row| !table.cell_text(row * table.width + position).trim().is_empty());
            let column = position + 1;
            let message = match filled {
                None if names.len() > 1 => continue,
                None => "row 1 must name the columns, but it is empty".to_owned(),
                Some(row) => {
                    format!("column {column} has no name in row 1, but a cell in row {}", table.line(row))
                }
            };
            return Err(wrong(&table.path, message));
        }
        if let Some(first) = known.insert(name, position) {
            let (name, first, second) = (shown(name), first + 1, position + 1);
            let help = match name.trim().parse::<f64>() {
                Ok(_) => ": it has the names of the columns, but here it has numbers",
                Err(_) => "",
            };
            let message = format!(
                "row 1 names the column `{name}` twice, as column {first} and as column {second}{help}"
            );
            return Err(wrong(&table.path, message));
        }
        table.columns.push(name.to_owned());
        table.positions.push(position);
    }
    match table.columns.is_empty() {
        false => Ok(()),
        true => Err(wrong(&table.path, "row 1 must name the columns, but it is empty".to_owned())),
    }
}

/// A column has decimal commas if all its cells are numbers, and one has a comma.
fn find_decimal_commas(table: &mut Records, separator: u8) {
    if separator == b',' {
        return;
    }
    let example = (0..table.columns.len()).find_map(|column| {
        let cells =
            || (0..table.len()).map(|row| table.text(row, column).trim()).filter(|cell| !is_missing(cell));
        let numbers = cells().all(|cell| with_point(cell).is_some() || cell.parse::<f64>().is_ok());
        cells().find(|cell| cell.contains(',')).filter(|_| numbers).map(str::to_owned)
    });
    if let Some(example) = &example {
        table.notes.push(format!("its numbers have decimal commas, such as `{example}`"));
    }
    table.decimal_comma = example;
}

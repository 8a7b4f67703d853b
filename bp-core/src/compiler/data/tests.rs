//! Tests of the reader by examples.
//!
//! In: tables as pandas, R, spreadsheets and people write them. Out: values determined by hand. Invariant: none.

use super::*;
use crate::model::{Bins, Bound, Domain, Model, ModelBuilder, Range};
use proptest::prelude::*;

/// Variables A : 0..=2; B : bool; C : { low, high }; R : real; K : { "NA", "1" } or 5..=6; S : bins(0, 10, 5).
fn model() -> Model {
    let mut model = ModelBuilder::new("Pandas");
    let mixed = Domain::Finite {
        labels: vec!["NA".to_owned(), "1".to_owned()],
        range: Some(Range { low: 5, high: Bound::constant(6) }),
    };
    let domains = [
        ("A", Domain::integers(0, 2)),
        ("B", Domain::Boolean),
        ("C", Domain::labels(["low", "high"])),
        ("R", Domain::Real),
        ("K", mixed),
        ("S", Domain::Bins(Bins::even(0.0, 10.0, 5, false).unwrap())),
    ];
    for (name, domain) in domains {
        model.variable(name, domain);
    }
    model.so_far().clone()
}

fn table(text: &str) -> Result<Records, String> {
    read_table(Path::new("d.csv"), text.as_bytes()).map_err(|error| error.to_string())
}

/// The values of a table: ordinals, reals, `None` if missing.
fn read(text: &str) -> Result<Vec<Vec<Option<f64>>>, String> {
    let model = model();
    let table = table(text)?;
    let values: Vec<Values<'_>> = (table.columns.iter())
        .map(|column| Values::new(&model, model.variable(column).unwrap(), &|_| None))
        .collect();
    let row = |row: usize| {
        let cell = |(column, values)| {
            let value = table.cell(row, column, values)?;
            Ok(value.map(|value| value.ordinal.map_or(value.number, |ordinal| ordinal as f64)))
        };
        values.iter().enumerate().map(cell).collect::<Result<Vec<_>, Error>>()
    };
    (0..table.len()).map(row).collect::<Result<_, _>>().map_err(|error| error.to_string())
}

fn some(cells: &[f64]) -> Vec<Option<f64>> {
    cells.iter().map(|cell| (!cell.is_nan()).then_some(*cell)).collect()
}

/// Nothing was observed.
const NO: f64 = f64::NAN;

#[test]
fn pandas_r_and_spreadsheets_write_the_same_table() {
    let plain = [some(&[1.0, 1.0, 0.0]), some(&[NO, 0.0, 1.0])];
    for text in [
        "A,B,C\n1,true,low\n,false,high\n",
        "A,B,C\n1.0,True,low\nNaN,False,high",
        "\"A\",\"B\",\"C\"\n\"1\",\"TRUE\",\"low\"\nNA,\"FALSE\",\"high\"\n",
        "\u{feff}A,B,C\r\n1,TRUE,low\r\n#N/A,FALSE,high\r\n",
        "A;B;C\n1,0;1;low\n;0;high\n",
        "A\tB\tC\n1\tT\tlow\n?\tF\thigh\n",
        "A, B, C\n1, true, low\nNA, false, high\n",
        ",A,B,C\n0,1.0,True,low\n1,,False,high\n",
        "\"\",\"A\",\"B\",\"C\"\n\"1\",1,TRUE,\"low\"\n\"2\",NA,FALSE,\"high\"\n",
        "Unnamed: 0,A,B,C\n0,1,1.0,low\n1,null,0.0,high\n",
        "A,B,C,\n1,true,low,\n,false,high,\n",
        "A,B,C\n\n1,true,low\n\n  \n,false,high\n\n",
        "A,B,C\r1,true,low\r,false,high",
        "sep=;\r\nA;B;C\r\n1;true;low\r\n;false;high\r\n",
    ] {
        assert_eq!(read(text).as_deref(), Ok(plain.as_slice()), "{text}");
    }
}

#[test]
fn decisions_of_the_reader_are_noted() {
    let notes = |text: &str| table(text).unwrap().notes;
    assert!(notes("A,R\n1,0.5\n").is_empty());
    assert_eq!(notes("A,R\n"), ["it has column names, but no rows"]);
    assert_eq!(
        notes("A;R\n1;0,5\n2;-1,25e1\n"),
        ["its columns are separated by semicolons", "its numbers have decimal commas, such as `0,5`"]
    );
    assert_eq!(notes("A\tR\n1\t0.5\n"), ["its columns are separated by tabs"]);
    assert_eq!(notes(",R\n0,0.5\n"), ["its first column has no name and was ignored"]);
    assert_eq!(read("A;R\n1;0,5\n2;-1,25e1\n").unwrap(), [some(&[1.0, 0.5]), some(&[2.0, -12.5])]);
    // A single column has no separator; if a separator is given, its decimal commas are read.
    let message = read("R\n0,5\n").unwrap_err();
    assert_eq!(message, "`d.csv`: row 2 has 2 cells, but there is 1 column");
    let one = super::read::read(Path::new("d.csv"), "R\n0,5\n".as_bytes(), Some(b';')).unwrap();
    assert_eq!(one.notes, ["its numbers have decimal commas, such as `0,5`"]);
    // Next to decimal commas, a point may separate thousands.
    let message = read("R;S\n0,5;1\n1.234;2\n").unwrap_err();
    assert!(message.starts_with("`d.csv`, row 3, column `R`: `1.234` is written with a point"), "{message}");
}

#[test]
fn an_empty_line_of_one_column_is_a_row() {
    assert_eq!(read("R\n1\n\n2\n").unwrap(), [some(&[1.0]), some(&[NO]), some(&[2.0])]);
    assert_eq!(read("R\r\n1\r\n\r\n2").unwrap(), [some(&[1.0]), some(&[NO]), some(&[2.0])]);
    assert_eq!(read("R\n\n\n2\n\n").unwrap(), [some(&[NO]), some(&[NO]), some(&[2.0]), some(&[NO])]);
    assert_eq!(read("R\n\"\"\n  \nNA\n2\n").unwrap(), [some(&[NO]), some(&[NO]), some(&[NO]), some(&[2.0])]);
    assert_eq!(read("R\n").unwrap(), Vec::<Vec<Option<f64>>>::new());
    // Rows are lines of the file.
    let message = read("R\n1\n\nx\n").unwrap_err();
    assert_eq!(message, "`d.csv`, row 4, column `R`: `x` is not a value of `R`, which is `real`");
    let message = read("R,\"B\"\n\n\n1,\"tr\nue\"\n2,x\n").unwrap_err();
    assert!(message.starts_with("`d.csv`, row 4, column `B`: `tr\\nue` is"), "{message}");
}

#[test]
fn labels_come_first_and_numbers_may_have_points() {
    assert_eq!(
        read("K\nNA\n1\n1.0\n5\n6.0\n?\n").unwrap(),
        [0.0, 1.0, 1.0, 2.0, 3.0, NO].map(|k| some(&[k]))
    );
    assert_eq!(read("C\n\" low\"\n'high'\n\"\"\"low\"\"\"\n").unwrap(), [0.0, 1.0, 0.0].map(|c| some(&[c])));
    assert_eq!(read("S\n0.5\n9.5\n").unwrap(), [0.0, 4.0].map(|s| some(&[s])));
    let model = model();
    let bins = Values::new(&model, model.variable("S").unwrap(), &|_| None);
    assert_eq!(bins.read("9.5").unwrap(), Some(Value { ordinal: Some(4), number: 9.5 }));
    let integers = Values::new(&model, model.variable("K").unwrap(), &|_| None);
    assert_eq!(integers.read("5").unwrap(), Some(Value { ordinal: Some(2), number: 5.0 }));
    assert_eq!(read("R\n-0\n1e-300\n+.5\n").unwrap(), [0.0, 1e-300, 0.5].map(|r| some(&[r])));
}

#[test]
fn wrong_cells_name_row_column_and_domain() {
    for (text, expected) in [
        ("A\n3\n", "row 2, column `A`: `3` is not a value of `A`, which is `0..=2`"),
        ("A\n1.5\n", "row 2, column `A`: `1.5` is not a value of `A`, which is `0..=2`"),
        (
            "B\nyes\n",
            "row 2, column `B`: `yes` is not a value of `B`, which is `bool`: write `true` or `false`",
        ),
        ("B\n2\n", "row 2, column `B`: `2` is not a value of `B`"),
        ("C\nhihg\n", "`hihg` is not a value of `C`, which is `{ low, high }`; did you mean `high`?"),
        ("R\ninf\n", "`inf` is not a value of `R`, which is `real`: write a finite number"),
        ("R\n1e999\n", "`1e999` is not a value of `R`, which is `real`: write a finite number"),
        ("R\n\"1,5\"\n", "which is `real`: write a decimal point, or separate columns with semicolons"),
        ("S\n10.5\n", "row 2, column `S`: `10.5` is not a value of `S`, which is `bins(0, 10, 5)`"),
        ("A,B\n1,true\n2\n", "`d.csv`: row 3 has 1 cell, but there are 2 columns"),
        ("A,B\n1,true,\n", "`d.csv`: row 2 has 3 cells, but there are 2 columns"),
        ("A\n1,2\n", "`d.csv`: row 2 has 2 cells, but there is 1 column"),
        ("A,B,A\n", "`d.csv`: row 1 names the column `A` twice, as column 1 and as column 3"),
        ("A,,B\n1,x,true\n", "`d.csv`: column 2 has no name in row 1, but a cell in row 2"),
        ("", "`d.csv`: row 1 must name the columns, but the file is empty"),
        ("\n\n", "`d.csv`: row 1 must name the columns, but the file is empty"),
        (",\n1,2\n", "`d.csv`: column 2 has no name in row 1, but a cell in row 2"),
        ("B\n\"true\n", "`d.csv`: row 2 opens a quotation mark that is never closed"),
        ("B\n\"true", "`d.csv`: row 2 opens a quotation mark that is never closed"),
        ("A,B\n1,true\n\n2,\"false\n3,true\n", "`d.csv`: row 4 opens a quotation mark"),
        ("\"B\ntrue\n", "`d.csv`: row 1 opens a quotation mark that is never closed"),
        (
            "A,B\n\"1,true\n2\",false\n3,true,\"x\ny\"\n",
            "row 4 has 3 cells, but there are 2 columns; a quotation mark opened there is closed only in row 5 only",
        ),
        ("A,B\n1,\"true\n2,\"false\"\n", "row 2, column `B`: `true\\n2,false\"` is not a value of `B`"),
    ] {
        let found = read(text).unwrap_err();
        assert!(found.contains(expected), "{text:?}: {found}");
    }
    let wrong = |bytes: &[u8]| read_table(Path::new("d.csv"), bytes).unwrap_err().to_string();
    assert_eq!(wrong(b"A\n1\n\xe4\n"), "`d.csv`: row 3 is not UTF-8 text; save the file as UTF-8");
    assert_eq!(wrong(b"\xff\xfeA\0\n\0"), "`d.csv`: UTF-16 text; save it as UTF-8");
    assert_eq!(wrong(b"A\n\0"), "`d.csv`: row 2 contains a zero byte: the file is not text, or not UTF-8");
    let endless = read_table(Path::new("d.csv"), std::io::repeat(b'1')).unwrap_err().to_string();
    assert_eq!(endless, "`d.csv`: it holds more than 256 MiB: too long to be read, or without an end");
    let missing = table("fever,Rain\n").unwrap();
    assert_eq!(
        missing.needed("Fever").unwrap_err().to_string(),
        "`d.csv`: there is no column `Fever`; did you mean `fever`?"
    );
    assert_eq!(
        missing.needed("Sprinkler").unwrap_err().to_string(),
        "`d.csv`: there is no column `Sprinkler`; the columns are `fever` and `Rain`"
    );
    assert_eq!(
        missing.unknown(0, ["Fever", "Rain"]).to_string(),
        "`d.csv`: column `fever` names no variable; did you mean `Fever`? (`ignore` leaves a column out)"
    );
}

#[test]
fn columns_in_memory_are_a_table() {
    let cells = [["1", "low"], ["", "hihg"]];
    let columns = || vec!["A".to_owned(), "C".to_owned()];
    let table = Records::of_columns("the frame", columns(), (7, 2), |row, column, text| {
        text.push_str(cells[row][column]);
    });
    let table = table.unwrap();
    assert_eq!((table.len(), table.text(1, 1), table.text(0, 0)), (2, "hihg", "1"));
    let model = model();
    let values = |name| Values::new(&model, model.variable(name).unwrap(), &|_| None);
    assert_eq!(table.cell(0, 0, &values("A")).unwrap(), Some(Value { ordinal: Some(1), number: 1.0 }));
    assert_eq!(table.cell(1, 0, &values("A")).unwrap(), None);
    let error = table.cell(1, 1, &values("C")).unwrap_err().to_string();
    assert!(error.starts_with("`the frame`, row 8, column `C`: `hihg` is not a value of `C`"), "{error}");
    let twice = vec!["A".to_owned(), "B".to_owned(), "A".to_owned()];
    let error = Records::of_columns("the frame", twice, (0, 0), |_, _, _| ()).unwrap_err().to_string();
    assert_eq!(error, "`the frame`: two columns have the name `A`");
}

proptest! {
    /// Tables written by RFC 4180 are read back unchanged, with any separator and any line endings.
    #[test]
    fn tables_come_back(
        rows in proptest::collection::vec(proptest::collection::vec("[a-c\"; ,\t\n]{0,4}", 3), 0..6),
        separator in 0usize..3,
        windows: bool,
    ) {
        let separator = [b',', b';', b'\t'][separator];
        let end = if windows { csv::Terminator::CRLF } else { csv::Terminator::Any(b'\n') };
        let mut writer = csv::WriterBuilder::new().delimiter(separator).terminator(end).from_writer(Vec::new());
        writer.write_record(["X", "Y", "Z"]).unwrap();
        rows.iter().for_each(|row| writer.write_record(row).unwrap());
        let bytes = writer.into_inner().unwrap();
        let table = read_table(Path::new("d.csv"), bytes.as_slice()).unwrap();
        prop_assert_eq!(table.len(), rows.len());
        for (row, cells) in rows.iter().enumerate() {
            for (column, cell) in cells.iter().enumerate() {
                prop_assert_eq!(table.text(row, column), cell);
            }
        }
    }

    /// For any bytes the result is a table with as many cells as columns in each row, or an error on one line.
    #[test]
    fn any_bytes_are_read_or_refused(text in "[\"A-C0-9.,;\t\r\n ?\u{feff}\u{0}é-]{0,40}", noise in proptest::collection::vec(any::<u8>(), 0..6)) {
        let bytes: Vec<u8> = text.bytes().chain(noise).collect();
        match read_table(Path::new("d.csv"), bytes.as_slice()) {
            Err(error) => prop_assert!(!error.to_string().contains('\n'), "{error}"),
            Ok(table) => {
                let model = model();
                for row in 0..table.len() {
                    prop_assert!(table.line(row) > 1 && (row == 0 || table.line(row) > table.line(row - 1)));
                    for column in 0..table.columns.len() {
                        for id in model.variables.ids() {
                            let cell = table.cell(row, column, &Values::new(&model, id, &|_| None));
                            let fine = match cell {
                                Ok(value) => value.is_none_or(|value| value.number.is_finite()),
                                Err(error) => !error.to_string().contains('\n'),
                            };
                            prop_assert!(fine);
                        }
                    }
                }
            }
        }
    }
}

//! The `bp` command: rows of tables as elements of sets.
//!
//! In: the built binary, programs and tables. Out: answers, filled tables, messages. Invariant: expected numbers are computed by
//! hand; a message names file, row, column and cell.

use super::data::Folder;
use serde_json::Value;

const LINE: &str = "program Line {
    variables { A : real; Y[row in Rows] : real; }
    decomposition { P(A) prod(row in Rows) { P(Y[row] | A) } }
    forms { P(A) = normal(0, 1); P(Y[row] | A) = normal(A * x[row], 1); }
}
";

const SCHOOLS: &str = "program Schools {
    variables { Mu : real; Alpha[s in Schools] : real; Y[row in Rows] : real; }
    decomposition { P(Mu) prod(s in Schools) { P(Alpha[s] | Mu) } prod(row in Rows) { P(Y[row] | Alpha) } }
    forms {
        P(Mu) = normal(0, 1);
        P(Alpha[s] | Mu) = normal(Mu + bonus[s], 1);
        P(Y[row] | Alpha) = normal(Alpha[school[row]], 1);
    }
}
";

const ROOMS: &str = "program Rooms {
    variables { Hot[s in Rooms] : bool; Alarm[row in Rows] : bool; }
    decomposition { prod(s in Rooms) { P(Hot[s]) } prod(row in Rows) { P(Alarm[row] | Hot) } }
    forms { P(Hot[s]) = bernoulli(0.2); P(Alarm[row] | Hot) = bernoulli(if Hot[room[row]] { 0.9 } else { 0.3 }); }
}
";

fn folder() -> Folder {
    Folder::with(&[
        ("line.bp", LINE.as_bytes()),
        ("schools.bp", SCHOOLS.as_bytes()),
        ("rooms.bp", ROOMS.as_bytes()),
        // Precision 1 + 1 + 4, information 1 + 4.
        ("points.csv", b"x,Y,who\n1,1,Ann\n2,2,\"Bo, Jr\"\n3,,Cid\n"),
    ])
}

fn numbers(text: &str, key: &str) -> Vec<f64> {
    let answer: Value = serde_json::from_str(text).unwrap();
    answer["answer"].as_array().unwrap().iter().map(|row| row[key].as_f64().unwrap()).collect()
}

#[track_caller]
fn near(found: &[f64], expected: &[f64]) {
    assert_eq!(found.len(), expected.len(), "{found:?}");
    let close = |(found, expected): (&f64, &f64)| (found - expected).abs() < 1e-12;
    assert!(found.iter().zip(expected).all(close), "{found:?}, expected {expected:?}");
}

#[test]
fn rows_are_evidence_and_missing_cells_are_filled() {
    let folder = folder();
    let rows = ["--rows", "points.csv", "--ignore", "who"];
    let asked = folder.well(&[&["ask", "line.bp", "P(A)", "--json"], &rows[..]].concat());
    near(&numbers(&asked, "mean"), &[5.0 / 6.0]);
    let asked = folder.well(&[&["ask", "line.bp", "P(Y)", "--json"], &rows[..]].concat());
    near(&numbers(&asked, "mean"), &[2.5]);
    near(&numbers(&asked, "deviation"), &[2.5f64.sqrt()]);
    let named = ["ask", "line.bp", "P(A)", "--json", "--rows", "Rows=points.csv", "--ignore", "who"];
    near(&numbers(&folder.well(&named), "mean"), &[5.0 / 6.0]);
    folder.well(&[&["ask", "line.bp", "--fill", "filled.csv"], &rows[..]].concat());
    let expected = "x,Y,who,Y deviation\n1,1,Ann,\n2,2,\"Bo, Jr\",\n3,2.5,Cid,1.58114\n";
    assert_eq!(folder.read("filled.csv"), expected);
}

#[test]
fn each_set_has_a_table_of_its_own() {
    let folder = folder();
    folder.write("schools.csv", "Schools,bonus\nLake,0\nHill,3\n");
    folder.write("pupils.csv", "school,Y\nHill,4\nHill,4\n");
    let files = ["--rows", "pupils.csv", "--rows", "schools.csv"];
    let asked = folder.well(&[&["ask", "schools.bp", "P(Mu, Alpha)", "--json"], &files[..]].concat());
    // The mean of two marks is 4 = Mu + 3 + noise of variance 3/2: Mu has the mean 1/(1 + 3/2) = 2/5. That of Hill, given
    // them, is (2 · 4 + 3 / 2) / (2 + 1/2).
    near(&numbers(&asked, "mean"), &[0.4, 0.4, 3.8]);
    // The elements have the names of the table, in answers and in questions.
    let hill = folder.well(&[&["ask", "schools.bp", "P(Alpha[Hill])"], &files[..]].concat());
    assert!(hill.contains("Alpha[Hill]") && hill.contains("3.8"), "{hill}");
    let all = folder.well(&[&["ask", "schools.bp", "P(Alpha)"], &files[..]].concat());
    assert!(all.contains("Alpha[Lake]") && all.contains("Alpha[Hill]"), "{all}");
}

#[test]
fn finite_groups_that_are_data_are_enumerated() {
    let folder = folder();
    folder.write("alarms.csv", "room,Alarm\nattic,1\nattic,1\nbath,0\nbath,\nbath,1\n");
    let rows = ["--json", "--rows", "alarms.csv"];
    // Attic: 0.2 · 0.81 against 0.8 · 0.09. Bath: 0.2 · 0.1 · 0.9 against 0.8 · 0.7 · 0.3.
    let (attic, bath) = (0.162 / 0.234, 0.018 / 0.186);
    let both = folder.well(&[&["ask", "rooms.bp", "P(Hot)"], &rows[..]].concat());
    let product = |a: f64, b: f64| a * b;
    let cold = [1.0 - attic, attic];
    let bath_cold = [1.0 - bath, bath];
    let expected: Vec<f64> = cold.iter().flat_map(|a| bath_cold.map(|b| product(*a, b))).collect();
    near(&numbers(&both, "p"), &expected);
    let missing = folder.well(&[&["ask", "rooms.bp", "P(Alarm)"], &rows[..]].concat());
    near(&numbers(&missing, "p"), &[1.0 - (0.3 + 0.6 * bath), 0.3 + 0.6 * bath]);
}

#[test]
fn tables_that_do_not_fit_are_refused() {
    let folder = folder();
    let tables = [
        (
            "line.bp",
            "x,y\n1,2\n",
            "no field and no family over `Rows` has the name of the column `y`; did you mean `Y`?",
        ),
        ("line.bp", "x,Y\n1,3 cm\n", "numbers have no units: write `3`"),
        ("line.bp", "x,Y\n30%,2\n", "write the share itself: `30%` is `0.3`"),
        ("line.bp", "x,Y,who\n1,2,Ann\n", "there are `x` and `Y`; or ignore the column: `--ignore who`"),
        ("line.bp", "x,A\n1,2\n", "`A` does not range over `Rows`: it has no value for each row"),
        ("line.bp", "x,Y\n1,2\n1\n", "row 3 has 1 cell, but there are 2 columns"),
        ("line.bp", "x,Y\n,2\n", "row 2, column `x`: `` is missing, but `x` is a field"),
        ("line.bp", "x,Y\nbig,2\n", "row 2, column `x`: `big` is not a value of `x`, which is `real`"),
        ("line.bp", "x,Y\n1,3 cm\n", "row 2, column `Y`: `3 cm` is not a value of `Y`, which is `real`"),
        ("line.bp", "x,Y\n", "it has no rows, so `Rows` would have no element"),
        ("line.bp", "Y\n1\n", "input `x`: it was not given: it has a number for each element of `Rows`"),
        ("rooms.bp", "room,Alarm\nattic,2\n", "row 2, column `Alarm`: `2` is not a value of `Alarm`"),
        (
            "rooms.bp",
            "room,Alarm\n,1\n",
            "row 2, column `room`: `` is missing, but each row needs an element of `Rooms`",
        ),
        ("schools.bp", "a,b\n1,2\n", "no column is named as a family or a field of the program"),
    ];
    for (file, table, expected) in tables {
        folder.write("t.csv", table);
        let question = if file == "rooms.bp" { "P(Hot[0])" } else { "P(A)" };
        let question = if file == "schools.bp" { "P(Mu)" } else { question };
        let message = folder.ill(&["ask", file, question, "--rows", "t.csv"]);
        assert!(message.contains(expected), "{table:?}: {message}\nexpected: {expected}");
    }
    folder.write("t.csv", "room,Alarm\n0,1\n5,0\n");
    let message = folder.ill(&["ask", "rooms.bp", "P(Hot[0])", "--rows", "t.csv", "--set", "Rooms=3"]);
    assert!(
        message
            .contains("row 3, column `room`: `5` is not an element of `Rooms`, which has 3, counted from 0"),
        "{message}"
    );
    let message = folder.ill(&["ask", "rooms.bp", "P(Hot[0])", "--rows", "Row=t.csv"]);
    assert!(message.contains("did you mean `Rows`?"), "{message}");
    let message = folder.ill(&["ask", "line.bp", "P(A)"]);
    assert!(!message.contains("internal"), "{message}");
}

#[test]
fn unknown_forms_are_learned_from_all_rows() {
    let folder = folder();
    folder.write(
        "coin.bp",
        "program Coin {
    variables { Toss[row in Rows] : bool; }
    decomposition { prod(row in Rows) { P(Toss[row]) } }
    forms { P(Toss[row]) = unknown; }
}
",
    );
    folder.write("tosses.csv", "Toss\n1\n1\n0\n\n1\n");
    folder.well(&["learn", "coin.bp", "--rows", "tosses.csv", "--out", "learned.bp"]);
    // Laplace: (3 + 1) / (4 + 2) for true; the empty row was not observed.
    let learned = folder.read("learned.bp");
    assert!(learned.contains("bernoulli(0.6666666666666666)"), "{learned}");
}

#[test]
fn filled_tables_are_written_as_they_were_and_read_back() {
    let folder = folder();
    // The posterior of A has the precision 1 + 1/4 + 9/4 and the mean (1/2 + 15/4) / (7/2) = 17/14.
    let cases = [
        (
            "x;Y\n0,5;1\n1,5;2,5\n2;NA\n",
            &[][..],
            "x;Y;Y deviation\n0,5;1;\n1,5;2,5;\n2;2,42857142857;1,46385\n",
        ),
        (
            "x|Y\n0.5|1\n1.5|2.5\n2|\n",
            &["--separator", "|"][..],
            "x|Y|Y deviation\n0.5|1|\n1.5|2.5|\n2|2.42857142857|1.46385\n",
        ),
        (
            ",x,Y\n7,0.5,1\n8,1.5,2.5\n9,2,\n",
            &[][..],
            ",x,Y,Y deviation\n7,0.5,1,\n8,1.5,2.5,\n9,2,2.42857142857,1.46385\n",
        ),
        (
            "x,Y,Y deviation\n0.5,1,a\n1.5,2.5,b\n2,,c\n",
            &["--ignore", "Y deviation"][..],
            "x,Y,Y deviation,Y deviation 2\n0.5,1,a,\n1.5,2.5,b,\n2,2.42857142857,c,1.46385\n",
        ),
    ];
    for (table, more, expected) in cases {
        folder.write("t.csv", table);
        let command = ["ask", "line.bp", "--rows", "t.csv", "--fill", "f.csv"];
        folder.well(&[&command[..], more].concat());
        assert_eq!(folder.read("f.csv"), expected);
    }
    let tosses = "program T { variables { B : bool; T[row in Rows] : bool; } decomposition { P(B) prod(row in Rows) { P(T[row] | B) } }
        forms { P(B) = bernoulli(0.5); P(T[row] | B) = bernoulli(if B { 0.75 } else { 0.25 }); } }";
    folder.write("tosses.bp", tosses);
    folder.write("t.csv", "T\n1\n0\n0\nNA\n");
    folder.well(&["ask", "tosses.bp", "--rows", "t.csv", "--fill", "f.csv"]);
    // B = true has 3/64 against 9/64: 1/4 · 1/4 + 3/4 · 3/4 for false.
    assert_eq!(folder.read("f.csv"), "T,T probability\n1,\n0,\n0,\n0,0.625000\n");
}

#[test]
fn a_family_without_a_column_is_declared_hidden() {
    let folder = folder();
    let mixture = "program M { variables { K[r in Rows] : bool; Y[r in Rows] : real; }
        decomposition { prod(r in Rows) { P(K[r]) } prod(r in Rows) { P(Y[r] | K[r]) } }
        forms { P(K[r]) = unknown(histogram); P(Y[r] | K[r]) = unknown(normal); } }";
    folder.write("m.bp", mixture);
    folder.write("y.csv", "Y\n0\n1\n5\n7\nNA\n");
    let message = folder.ill(&["learn", "m.bp", "--rows", "y.csv"]);
    let expected = "there is no column for the variable `K`; if it is hidden, declare it: `--hidden K`";
    assert!(message.contains(expected), "{message}");
    let report = folder.well(&["learn", "m.bp", "--rows", "y.csv", "--hidden", "K"]);
    assert!(report.contains("1 cell missing") && report.contains("hidden: K"), "{report}");
}

#[test]
fn rows_whose_finite_variables_are_few_are_answered_exactly() {
    let folder = folder();
    folder.write(
        "outliers.bp",
        "program Outliers {
    variables { M : real; K[row in Rows] : bool; Y[row in Rows] : real; }
    decomposition { P(M) prod(row in Rows) { P(K[row]) } prod(row in Rows) { P(Y[row] | K M) } }
    forms { P(M) = normal(0, 2); P(K[row]) = bernoulli(0.25); P(Y[row] | K M) = normal(M, if K[row] { 3 } else { 1 }); }
}
",
    );
    folder.write("y.csv", "Y\n1\n5\n");
    // Σ over the four combinations of K, each a normal posterior of M, by NumPy.
    let asked = folder.well(&["ask", "outliers.bp", "P(M)", "--rows", "y.csv", "--json"]);
    near(&numbers(&asked, "mean"), &[1.5637528793527233]);
    near(&numbers(&asked, "deviation"), &[1.2593129872310134]);
    let answer: Value = serde_json::from_str(&asked).unwrap();
    assert!(answer.get("estimate").is_none(), "{answer}");
    assert!((answer["ln_evidence"].as_f64().unwrap() + 6.077398586317081).abs() < 1e-12, "{answer}");
    let second = folder.well(&["ask", "outliers.bp", "P(K[1])", "--rows", "y.csv", "--json"]);
    assert!((numbers(&second, "p")[1] - 0.8159833743839399).abs() < 1e-12, "{second}");
    let explained = folder.well(&["explain", "outliers.bp", "P(M)", "--rows", "y.csv"]);
    assert!(explained.contains("offer: mixture, exact") && explained.contains("taken"), "{explained}");
    // Without rows their number is not known.
    let explained = folder.well(&["explain", "outliers.bp", "P(M)"]);
    assert!(explained.contains("offer: mixture, refused"), "{explained}");
}

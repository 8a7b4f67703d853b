//! Data as a plate: rows of tables are the elements of sets.
//!
//! In: programs, and columns in memory. Out: posteriors, predictions, learned numbers, errors. Invariant: expected values are
//! from normal equations in exact fractions, or counted by hand.

use crate::support::close;
use bp_core::prelude::*;

const LINE: &str = "program Line {
    variables { A, B : real; Y[row in Rows] : real; }
    decomposition { P(A) P(B) prod(row in Rows) { P(Y[row] | A B) } }
    forms { P(A) = normal(0, 10); P(B) = normal(0, 10); P(Y[row] | A B) = normal(A * x[row] + B, 0.5); }
}";

/// Pupils of schools: which school is data.
const SCHOOLS: &str = "program Schools {
    variables { Mu : real; Alpha[s in Schools] : real; Y[row in Rows] : real; }
    decomposition { P(Mu) prod(s in Schools) { P(Alpha[s] | Mu) } prod(row in Rows) { P(Y[row] | Alpha) } }
    forms {
        P(Mu) = normal(0, 10);
        P(Alpha[s] | Mu) = normal(Mu, 2);
        P(Y[row] | Alpha) = normal(Alpha[school[row]], 1);
    }
}";

const SPAM: &str = "program Spam {
    variables { Spam : bool; W[row in Rows] : bool; }
    decomposition { P(Spam) prod(row in Rows) { P(W[row] | Spam) } }
    forms { P(Spam) = bernoulli(0.3); P(W[row] | Spam) = bernoulli(if Spam { p[row] } else { 0.5 }); }
}";

fn program(text: &str) -> Program {
    Program::parse(text).unwrap_or_else(|error| panic!("{error}"))
}

fn points() -> Rows {
    Rows::new().column("x", [1.0, 2.0, 3.0, 4.0]).column("Y", [1.5, 2.0, 3.7, f64::NAN])
}

fn pupils() -> Rows {
    let schools = ["Hill", "Hill", "Lake", "Hill", "Lake", "Mill"];
    Rows::new().column("school", schools).column("Y", [2.0, 3.0, 7.0, 2.5, 6.5, f64::NAN])
}

#[track_caller]
fn refused(rows: Result<Program, bp_core::Error>, words: &str) {
    let message = rows.map(|_| "read").unwrap_err().to_string();
    assert!(message.contains(words), "{message}\nexpected: {words}");
}

#[test]
fn a_regression_over_rows_is_the_solution_of_its_normal_equations() {
    let line = program(LINE).rows(points()).unwrap();
    let both = line.ask("P(A, B)").unwrap();
    assert_eq!(both.strategy().name(), "gaussian");
    close(both.of("A").unwrap().mean().unwrap(), 1.099_130_017_449_299_3);
    close(both.of("B").unwrap().mean().unwrap(), 0.201_571_988_444_364_47);
    close(both.covariance("A", "A").unwrap(), 0.124_224_116_441_749_65);
    close(both.covariance("A", "B").unwrap(), -0.248_241_365_079_266_56);
    close(both.ln_evidence().unwrap(), -8.054_494_826_094_109);
    // The row without a value is predicted; a row beyond the others may be one too.
    for question in ["P(Y)", "P(Y[3])", "P(Y[3] | Y)"] {
        let new = line.ask(question).unwrap();
        close(new.mean().unwrap(), 4.598_092_058_241_561);
        close(new.variance().unwrap(), 0.830_988_228_187_600_1);
    }
    let missing = line.missing().unwrap();
    assert_eq!((missing.len(), missing[0].question()), (1, "P(Y[3])"));
    close(missing[0].mean().unwrap(), 4.598_092_058_241_561);
    // Evidence that the missing row has a value: a point on the line gives no new information about its height.
    let known = line.ask("P(A | Y[3] = 4.598092058241561)").unwrap();
    close(known.mean().unwrap(), 1.099_130_017_449_299_3);
}

#[test]
fn groups_that_are_data_are_ragged_and_named() {
    let schools = program(SCHOOLS).rows(pupils()).unwrap();
    let all = schools.ask("P(Mu, Alpha)").unwrap();
    let expected = [
        ("Mu", 4.485_877_792_135_868, 2.159_867_085_102_455),
        ("Alpha[Hill]", 2.652_759_830_164_297_4, 0.320_472_586_302_381_4),
        ("Alpha[Lake]", 6.498_430_865_792_875, 0.471_109_470_186_450_05),
        ("Alpha[Mill]", 4.485_877_792_135_868, 6.159_867_085_102_455),
    ];
    for (name, mean, variance) in expected {
        let one = all.of(name).unwrap();
        close(one.mean().unwrap(), mean);
        close(one.variance().unwrap(), variance);
    }
    // A new pupil of a school without other pupils.
    let new = schools.ask("P(Y)").unwrap();
    close(new.variance().unwrap(), 7.159_867_085_102_455);
    // The same schools by their numbers, and as a table of their own in another order.
    let numbered = Rows::new().column("school", [0, 0, 1, 0, 1]).column("Y", [2.0, 3.0, 7.0, 2.5, 6.5]);
    let numbered = program(SCHOOLS).with("Schools", 3).unwrap().rows(numbered).unwrap();
    close(numbered.ask("P(Alpha[2])").unwrap().variance().unwrap(), 6.159_867_085_102_455);
    let names = Rows::new().column("Schools", ["Mill", "Lake", "Hill"]);
    let names = names.and_records(pupils_as_records());
    let named = program(SCHOOLS).rows(names).unwrap();
    close(named.ask("P(Alpha[2])").unwrap().mean().unwrap(), 2.652_759_830_164_297_4);
}

fn pupils_as_records() -> bp_core::compiler::data::Records {
    let text = "school,Y\nHill,2\nHill,3\nLake,7\nHill,2.5\nLake,6.5\nMill,\n";
    bp_core::compiler::data::read_table("pupils.csv".as_ref(), text.as_bytes()).unwrap()
}

#[test]
fn finite_rows_are_counted_and_missing_ones_predicted() {
    let rows = || Rows::new().column("p", [0.1, 0.2, 0.3]);
    let all = program(SPAM).rows(rows().column("W", ["true", "true", "false"])).unwrap();
    // 0.3 · 0.1 · 0.2 · 0.7 against 0.7 / 8.
    close(all.ask("P(Spam)").unwrap().p(true).unwrap(), 0.0042 / (0.0042 + 0.0875));
    let some = program(SPAM).rows(rows().column("W", ["true", "NA", "false"])).unwrap();
    // 0.3 · 0.1 · 0.7 against 0.7 / 4: 3/28; the missing word 3/28 · 1/5 + 25/28 · 1/2.
    close(some.ask("P(Spam)").unwrap().p(true).unwrap(), 3.0 / 28.0);
    close(some.ask("P(W)").unwrap().p(true).unwrap(), 13.1 / 28.0);
    close(some.missing().unwrap()[0].p(true).unwrap(), 13.1 / 28.0);
    close(some.ask("P(W[1] | Spam = true)").unwrap().p(true).unwrap(), 0.2);
}

#[test]
fn a_range_of_run_time_length_has_a_row_for_each_index() {
    let tosses = "program Tosses {
        parameters { N : size; }
        variables { Fair : bool; Toss[1..=N] : bool; }
        decomposition { P(Fair) prod(i) { P(Toss[i] | Fair) } }
        forms { P(Fair) = bernoulli(0.5); P(Toss[i] | Fair) = bernoulli(if Fair { 0.5 } else { 0.75 }); }
    }";
    let rows = Rows::new().column("Toss", [true, true, false, true]);
    let tosses = program(tosses).rows(rows).unwrap();
    // 1/16 against 27/256.
    close(tosses.ask("P(Fair)").unwrap().p(true).unwrap(), 16.0 / 43.0);
}

#[test]
fn several_columns_of_numbers_and_truth_values_are_fields() {
    let dose = "program Dose {
        variables { Base, Effect : real; Y[row in Rows] : real; }
        decomposition { P(Base) P(Effect) prod(row in Rows) { P(Y[row] | Base Effect) } }
        forms {
            P(Base) = normal(0, 1);
            P(Effect) = normal(0, 1);
            P(Y[row] | Base Effect) = normal(Base + (if treated[row] > 0 { Effect * dose[row] } else { 0 }), sigma[row]);
        }
    }";
    let rows = Rows::new()
        .column("treated", ["False", "True"])
        .column("dose", [9.0, 2.0])
        .column("sigma", [1.0, 1.0])
        .column("Y", [1.0, 3.0]);
    let asked = program(dose).rows(rows).unwrap().ask("P(Base, Effect)").unwrap();
    // Precision [[3, 2], [2, 5]], information [4, 6]: [8, 10] / 11.
    close(asked.of("Base").unwrap().mean().unwrap(), 8.0 / 11.0);
    close(asked.of("Effect").unwrap().mean().unwrap(), 10.0 / 11.0);
}

#[test]
fn unknown_forms_are_pooled_over_rows() {
    let unknown = "program Weigh {
        variables { Y[row in Rows] : real; }
        decomposition { prod(row in Rows) { P(Y[row]) } }
        forms { P(Y[row]) = normal(mu, sigma); }
        identification { mu, sigma from weights; }
    }";
    // The mean of the three values that there are.
    let rows = Rows::new().column("Y", [1.0, 2.0, 4.5, f64::NAN]);
    let learned = program(unknown).rows(rows).unwrap().learn_from_rows(&Default::default()).unwrap();
    let text = learned.text().unwrap();
    assert!(text.contains("mu : real = 2.5;"), "{text}");
}

#[test]
fn tables_that_do_not_fit_are_refused_with_row_and_column() {
    let line = |rows: Rows| program(LINE).rows(rows);
    let schools = |rows: Rows| program(SCHOOLS).rows(rows);
    let x = || Rows::new().column("x", [1.0, 2.0]);
    refused(line(x().column("y", [1.0, 2.0])), "column `y`; did you mean `Y`?");
    refused(line(x().column("A", [1.0, 2.0])), "`A` does not range over `Rows`");
    refused(
        line(x().column("Y", ["1", "much"])),
        "row 3, column `Y`: `much` is not a value of `Y`, which is `real`",
    );
    refused(
        line(Rows::new().column("x", [1.0, f64::NAN])),
        "row 3, column `x`: `NaN` is missing, but `x` is a field",
    );
    refused(
        line(Rows::new().column("x", Vec::<f64>::new())),
        "it has no rows, so `Rows` would have no element",
    );
    refused(program(LINE).with("Rows", 5).unwrap().rows(points()), "it has 4 rows, but `Rows` was set to 5");
    let numbered = || Rows::new().column("school", [0, 4]).column("Y", [1.0, 2.0]);
    refused(
        program(SCHOOLS).with("Schools", 3).unwrap().rows(numbered()),
        "row 3, column `school`: `4` is not an element of `Schools`, which has 3, counted from 0",
    );
    let names = Rows::new().column("Schools", ["Hill", "Mill"]);
    refused(
        schools(names.and_records(pupils_as_records())),
        "row 4, column `school`: `Lake` is not an element of `Schools`",
    );
    let both = Rows::new().column("Alpha", [1.0, 2.0]).column("Y", [1.0, 2.0]);
    refused(schools(both), "its columns range over `Rows` and over `Schools`");
    refused(line(points().of("Row")), "did you mean `Rows`?");
    let line = line(points()).unwrap();
    for (question, words) in [
        ("P(Y[1])", "row 3, column `Y`: `2` is known: it is the value of `Y[1]`"),
        ("P(A | Y[0] = 2)", "row 2, column `Y`: `1.5` is known"),
    ] {
        let message = line.ask(question).unwrap_err().to_string();
        assert!(message.contains(words), "{message}\nexpected: {words}");
    }
    let full = program(LINE).rows(x().column("Y", [1.0, 2.0])).unwrap();
    let message = full.ask("P(Y)").unwrap_err().to_string();
    assert!(message.contains("there is nothing to predict"), "{message}");
}

#[test]
fn each_missing_cell_of_thousands_is_answered_alone() {
    let tosses = "program Tosses {
        variables { Fair : bool; Toss[row in Rows] : bool; }
        decomposition { P(Fair) prod(row in Rows) { P(Toss[row] | Fair) } }
        forms { P(Fair) = bernoulli(0.5); P(Toss[row] | Fair) = bernoulli(if Fair { 0.5 } else { 0.75 }); }
    }";
    // 1026 heads, 600 tails and 2000 missing cells: the odds against a fair coin are 1.5^1026 0.5^600.
    let cell = |row: usize| ["true", "false", "NA"][usize::from(row >= 1026) + usize::from(row >= 1626)];
    let missing =
        program(tosses).rows(Rows::new().column("Toss", (0..3626).map(cell))).unwrap().missing().unwrap();
    let fair = 1.0 / (1.0 + (1026.0 * 1.5f64.ln() + 600.0 * 0.5f64.ln()).exp());
    assert_eq!((missing.len(), missing[1].question()), (2000, "P(Toss[1627])"));
    for cell in [&missing[0], &missing[1999]] {
        let p = cell.p(true).unwrap();
        assert!((p - (0.5 * fair + 0.75 * (1.0 - fair))).abs() < 1e-10, "{p}");
    }
}

#[test]
fn missing_labels_are_predicted_from_reals() {
    let mixed = "program Mixed {
        variables { K[row in Rows] : bool; Y[row in Rows] : real; }
        decomposition { prod(row in Rows) { P(K[row]) } prod(row in Rows) { P(Y[row] | K[row]) } }
        forms { P(K[row]) = bernoulli(0.4); P(Y[row] | K[row]) = normal(if K[row] { 3 } else { 0 }, 1); }
    }";
    let y = |row: usize| 0.25 * row as f64 - 2.0;
    let k = (0..40).map(|row| if row % 8 == 0 { "true" } else { "NA" });
    let rows = Rows::new().column("K", k).column("Y", (0..40).map(y));
    let missing = program(mixed).rows(rows).unwrap().missing().unwrap();
    assert_eq!(missing.len(), 35);
    // The density at 3 over that at 0 is exp(3 y - 9/2).
    for (row, cell) in (0..40).filter(|row| row % 8 != 0).zip(&missing) {
        let odds = 0.4 / 0.6 * (3.0 * y(row) - 4.5).exp();
        close(cell.p(true).unwrap(), odds / (1.0 + odds));
    }
}

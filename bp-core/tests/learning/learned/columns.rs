//! Columns: hidden variables, ignored columns, weights; misspelled names are errors.
//!
//! In: tables with columns too many and too few. Out: messages, and learned programs. Invariant: a variable without
//! data is never learned without a declaration.

use crate::support::learning::{program, written};
use crate::support::model_of;
use bp_core::compiler::data::read_table;
use bp_core::compiler::learn::{Columns, Learned, Learner};
use std::path::Path;

fn columns(hidden: &[&str], ignore: &[&str], weight: Option<&str>) -> Columns {
    let own = |names: &[&str]| names.iter().map(|name| (*name).to_owned()).collect();
    Columns {
        hidden: own(hidden),
        ignore: own(ignore),
        weight: weight.map(str::to_owned),
        ..Columns::default()
    }
}

fn learn(text: &str, table: &str, columns: &Columns) -> Result<Learned, String> {
    let mut learner = Learner::new(&model_of(text)).map_err(|error| error.to_string())?;
    let table = read_table(Path::new("d.csv"), table.as_bytes()).map_err(|error| error.to_string())?;
    learner.observe_table(&table, columns).map_err(|error| error.to_string())?;
    learner.learned().map_err(|error| error.to_string())
}

fn fevers() -> String {
    program("Fever, Flu : bool;", "P(Flu) P(Fever | Flu)", "P(Flu) = unknown; P(Fever | Flu) = unknown;")
}

#[test]
fn a_misspelled_column_is_reported_with_a_guess() {
    let refusal = |table: &str, columns: &Columns| learn(&fevers(), table, columns).unwrap_err();
    let none = Columns::default();
    assert_eq!(
        refusal("Flu,fever\n1,1\n", &none),
        "input `d.csv`: `Learning` has no variable named `fever`; did you mean `Fever`? Otherwise ignore the column: \
         `ignore(\"fever\")`"
    );
    assert_eq!(
        refusal("Flu\n1\n", &none),
        "input `d.csv`: there is no column for the variable `Fever`; if it is hidden, declare it: `hidden(\"Fever\")`, or \
         `hidden Fever;` in `identification`"
    );
    assert!(
        refusal("Flu,fever\n1,1\n", &columns(&[], &["fever"], None))
            .contains("did you mean the column `fever`?")
    );
    assert!(refusal("Flu,Fever\n1,1\n", &columns(&[], &["id"], None)).contains("there is no column `id`"));
    assert!(refusal("Flu,Fever\n1,1\n", &columns(&["Feevr"], &[], None)).contains("did you mean `Fever`?"));
    assert!(refusal("Flu,Fever\n1,1\n", &columns(&["Fever"], &[], None)).contains("`ignore(\"Fever\")`"));
}

#[test]
fn hidden_variables_may_be_declared_in_the_program() {
    let declared = fevers().replace("forms {", "identification { hidden Flu; } forms {");
    let table = "Fever,id\n1,7\n0,8\n1,9\n";
    let one = learn(&declared, table, &columns(&[], &["id"], None)).unwrap();
    let other = learn(&fevers(), table, &columns(&["Flu"], &["id"], None)).unwrap();
    assert_eq!(one.report, other.report);
    assert_eq!(one.report.hidden, ["Flu"]);
    let words = written(&declared, &one);
    assert!(words.contains("hidden Flu;"), "{words}");
    // If a hidden variable has a column nevertheless, its values are used.
    let some = learn(&declared, "Fever,Flu\n1,1\n0,\n", &Columns::default()).unwrap();
    assert_eq!((some.report.cells_missing, some.report.hidden.len()), (1, 0));
    let named = program("X : bool;", "P(X)", "P(X) = bernoulli(hidden);")
        .replace("forms {", "parameters { hidden : probability; } identification { hidden from d; } forms {");
    assert!(written(&named, &learn(&named, "X\n1\n0\n", &Columns::default()).unwrap()).contains("= 0.5;"));
}

#[test]
fn a_weight_is_so_many_rows() {
    let text = program(
        "K : { a, b }; X : real; N : 0..=9;",
        "P(K) P(X | K) P(N | K)",
        "P(K) = unknown(dirichlet(0.5)); P(X | K) = unknown(normal, unbiased); P(N | K) = unknown(poisson);",
    );
    let once = [
        ("a", 0.3, 2, 3),
        ("a", 0.9, 0, 2),
        ("b", -1.7, 4, 1),
        ("b", 2.5, 5, 4),
        ("a", 7.0, 9, 0),
        ("", 1.1, 3, 2),
    ];
    let (mut weighted, mut repeated) = ("K,X,N,times\n".to_owned(), "K,X,N\n".to_owned());
    for (k, x, n, times) in once {
        weighted.push_str(&format!("{k},{x},{n},{times}\n"));
        (0..times).for_each(|_| repeated.push_str(&format!("{k},{x},{n}\n")));
    }
    let one = learn(&text, &weighted, &columns(&[], &[], Some("times"))).unwrap();
    let other = learn(&text, &repeated, &Columns::default()).unwrap();
    // Equal to the last bit.
    assert_eq!(one.model(), other.model());
    assert_eq!(one.report.ln_likelihood.to_bits(), other.report.ln_likelihood.to_bits());
    assert_eq!((one.report.cases, one.report.weight, other.report.weight), (6, Some(12.0), None));
    // Fractional weights: twice a half is once.
    let halves = "X,w\n1,0.5\n1,0.5\n0,2\n";
    let coin = program("X : bool;", "P(X)", "P(X) = unknown(histogram);");
    let learned = learn(&coin, halves, &columns(&[], &[], Some("w"))).unwrap();
    assert!(written(&coin, &learned).contains(&format!("bernoulli({})", 1.0 / 3.0)));
    for (table, row) in [
        ("X,w\n1,1\n0,-1\n", 3),
        ("X,w\n1,NA\n", 2),
        ("X,w\n1,inf\n", 2),
        ("X,w\n1,x\n", 2),
        ("X,w\n1,1e308\n1,1e308\n", 2),
        ("X,w\n1,1e-320\n", 2),
    ] {
        let message = learn(&coin, table, &columns(&[], &[], Some("w"))).unwrap_err();
        assert!(message.contains(&format!("`d.csv`, row {row}, column `w`")), "{message}");
    }
}

#[test]
fn a_case_of_weight_0_may_be_impossible() {
    let text = program("A, B : bool;", "P(A) P(B | A)", "P(A) = unknown(histogram); P(B | A) = dirac(A);");
    let table = |weight: u32| format!("A,B,w\n1,1,3\n0,0,1\n1,0,{weight}\n");
    learn(&text, &table(0), &columns(&[], &[], Some("w"))).unwrap();
    let message = learn(&text, &table(1), &columns(&[], &[], Some("w"))).unwrap_err();
    assert!(
        message.contains("the case `A = true, B = false` has probability zero by `P(B | A)`"),
        "{message}"
    );
}

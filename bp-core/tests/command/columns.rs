//! The columns of answers on a page.
//!
//! In: figures. Out: headings and texts, which are those of `bp ask`. Without node the test says that it was skipped.

use crate::javascript::web;
use crate::node::run;
use serde_json::{Value, json};
use std::process::Command;

#[test]
fn columns_of_pages_have_errors_and_levels() {
    if Command::new("node").arg("--version").output().is_err() {
        return println!("skipped: there is no program `node`");
    }
    // Rounded by hand: six digits of a number, two of its error.
    let cases = [
        (
            json!({ "p": 0.532_179_9, "error": 0.002_513 }),
            json!([["probability ± error", "0.532180 ± 0.0025"]]),
        ),
        (json!({ "entropy": 7.147_231_4 }), json!([["entropy", "7.14723 nats"]])),
        (json!({ "divergence": "infinite", "infinite": true }), json!([["divergence", "infinite"]])),
        (json!({ "expectation": 7.139e-9 }), json!([["expectation", "7.13900e-9"]])),
        (
            json!({ "level": 0.9, "quantile": 1_234_567.0 }),
            json!([["level", "0.900000"], ["quantile", "1.23457e6"]]),
        ),
        (
            json!({ "mean": [0.532_179_9, 0.002_513], "deviation": [0.695_396, 0.002_1],
                "quantiles": [[-0.6, 0.01], [0.5, 0.01], [1.7, 0.02]] }),
            json!([
                ["mean ± error", "0.532180 ± 0.0025"],
                ["deviation", "0.695396"],
                ["5 %", "-0.600000"],
                ["50 %", "0.500000"],
                ["95 %", "1.70000"]
            ]),
        ),
        (json!({ "mean": 0.0, "deviation": 12.0 }), json!([["mean ± deviation", "0 ± 12.0000"]])),
    ];
    let figures: Vec<&Value> = cases.iter().map(|(figure, _)| figure).collect();
    let reader = r#"
        module(`${answer}; export { columns };`).then(({ columns }) => {
            console.log(JSON.stringify(cases.map(columns)));
        });
    "#;
    let found = run(reader, &json!({ "text": "", "answer": web("answer.js"), "cases": figures }));
    let expected: Vec<Value> = cases.iter().map(|(_, columns)| columns.clone()).collect();
    assert_eq!(found, expected);
}

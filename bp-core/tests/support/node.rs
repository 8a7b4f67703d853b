//! Programs of node.
//!
//! In: the text of a program, and what it reads as JSON. Out: what it prints. Invariant: a program that fails is a failure of the
//! test, with its messages.

use serde_json::Value;
use std::io::Write;
use std::process::{Command, Stdio};

/// Reads the texts of modules and cases from stdin; `module` imports a text.
const IMPORTS: &str = r#"
const fs = require("fs");
const { text, answer, cases } = JSON.parse(fs.readFileSync(0, "utf8"));
const module = async (text) => {
    const folder = fs.mkdtempSync(require("path").join(require("os").tmpdir(), "bp-"));
    fs.writeFileSync(`${folder}/module.mjs`, text);
    try {
        return await import(`${folder}/module.mjs`);
    } finally {
        fs.rmSync(folder, { recursive: true });
    }
};
"#;

/// Whether node is installed.
pub(crate) fn is_there() -> bool {
    Command::new("node").arg("--version").output().is_ok()
}

/// What a program of node prints for an input.
pub(crate) fn run(program: &str, given: &Value) -> Vec<Value> {
    let mut node = Command::new("node")
        .args(["-e", &format!("{IMPORTS}{program}")])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    node.stdin.take().unwrap().write_all(given.to_string().as_bytes()).unwrap();
    let output = node.wait_with_output().unwrap();
    let messages = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{messages}");
    serde_json::from_slice(&output.stdout).unwrap()
}

//! `bp convert`, and networks where a program is expected.
//!
//! In: files in a folder of their own. Out: files, what is told, and exit codes.

use std::path::Path;
use std::process::{Command, Output};

const NETWORK: &str = "variable a { type discrete [2] { <5, >=5 }; }
probability (a) { table 0.3, 0.6999; }
";

fn bp(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_bp")).current_dir(folder).args(arguments).output().unwrap()
}

fn words(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

#[test]
fn a_network_goes_through_every_format_and_back() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("a.bif"), NETWORK).unwrap();
    for step in [["a.bif", "a.bp"], ["a.bp", "a.net"], ["a.net", "a.xmlbif"], ["a.xmlbif", "b.bif"]] {
        let done = bp(folder.path(), &["convert", step[0], step[1]]);
        assert!(done.status.success(), "{step:?}: {}", words(&done.stderr));
        assert_eq!(words(&done.stderr).contains("divided by"), step[0] == "a.bif", "{}", words(&done.stderr));
    }
    let program = std::fs::read_to_string(folder.path().join("a.bp")).unwrap();
    assert!(program.contains("a : { \"<5\", \">=5\" };"), "{program}");
    let back = std::fs::read_to_string(folder.path().join("b.bif")).unwrap();
    assert!(back.contains("{ <5, >=5 }") && back.contains("table 0.3000"), "{back}");
    let uai = bp(folder.path(), &["convert", "b.bif", "-", "--to", "uai"]);
    assert!(words(&uai.stdout).starts_with("BAYES\n1\n2\n1\n1 0\n"), "{}", words(&uai.stdout));
    assert!(words(&uai.stderr).contains("UAI holds no names"));
}

#[test]
fn a_network_is_checked_and_asked_like_a_program() {
    let folder = tempfile::tempdir().unwrap();
    // Latin-1, as older tools write it.
    let text: Vec<u8> = [&NETWORK.as_bytes()[..11], b"% \xe9t\xe9\n", &NETWORK.as_bytes()[11..]].concat();
    std::fs::write(folder.path().join("a.bif"), text).unwrap();
    let checked = bp(folder.path(), &["check", "a.bif"]);
    assert_eq!(words(&checked.stdout), "ok: program unknown: 1 variable, 1 factor, 0 questions\n");
    assert!(words(&checked.stderr).contains("read as Latin-1"), "{}", words(&checked.stderr));
    let asked = bp(folder.path(), &["ask", "a.bif", "P(a = \"<5\")", "--json"]);
    assert!(
        words(&asked.stdout).contains("\"a\":\"<5\""),
        "{}{}",
        words(&asked.stdout),
        words(&asked.stderr)
    );
}

#[test]
fn what_cannot_be_converted_leaves_no_file() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("a.bif"), "variable a {").unwrap();
    std::fs::write(folder.path().join("a.dat"), NETWORK).unwrap();
    for (arguments, told) in [
        (vec!["a.bif", "b.bp"], "a.bif:1:13"),
        (vec!["a.dat", "b.bp"], "say `--from` and one of `bp`, `bif`, `xmlbif`, `uai`, `net`"),
        (vec!["a.dat", "b.bp", "--from", "gif"], "the formats are"),
        (vec!["none.bif", "b.bp"], "none.bif"),
    ] {
        let done = bp(folder.path(), &[&["convert"], arguments.as_slice()].concat());
        assert!(!done.status.success());
        assert!(words(&done.stderr).contains(told), "{}", words(&done.stderr));
    }
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 2);
}

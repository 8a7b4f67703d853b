//! The `bp convert` command, and networks as programs.
//!
//! In: files in a folder of their own. Out: files, messages, and exit statuses.

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
    assert!(words(&uai.stderr).contains("UAI has no names"));
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
fn failed_conversions_leave_no_file() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("a.bif"), "variable a {").unwrap();
    std::fs::write(folder.path().join("a.dat"), NETWORK).unwrap();
    for (arguments, expected) in [
        (vec!["a.bif", "b.bp"], "a.bif:1:13"),
        (vec!["a.dat", "b.bp"], "give `--from` and one of `bp`, `bif`, `xmlbif`, `uai`, `net`"),
        (vec!["a.dat", "b.bp", "--from", "gif"], "the formats are"),
        (vec!["none.bif", "b.bp"], "none.bif"),
    ] {
        let done = bp(folder.path(), &[&["convert"], arguments.as_slice()].concat());
        assert!(!done.status.success());
        assert!(words(&done.stderr).contains(expected), "{}", words(&done.stderr));
    }
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 2);
}

/// P(Y | X) = dirac(X + 1): where X = 1, Y has no value.
const DEFICIT: &str = "program A { variables { X : 0..=1; Y : 0..=1; } decomposition { P(X) P(Y | X) }
    forms { P(X) = uniform; P(Y | X) = dirac(X + 1); } question q { P(X) } }";

#[test]
fn the_distribution_is_never_changed_without_a_word() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("a.bp"), DEFICIT).unwrap();
    for name in ["a.bif", "a.net", "a.xmlbif"] {
        let done = bp(folder.path(), &["convert", "a.bp", name]);
        assert_eq!(done.status.code(), Some(1));
        assert!(
            words(&done.stderr).contains("the probabilities of `Y` at X = 1 are all 0"),
            "{}",
            words(&done.stderr)
        );
        assert!(!folder.path().join(name).exists());
    }
    let done = bp(folder.path(), &["convert", "a.bp", "a.uai"]);
    assert!(done.status.success(), "{}", words(&done.stderr));
    assert!(words(&done.stderr).contains("`Y` at X = 1 are all 0"), "{}", words(&done.stderr));
    let uai = std::fs::read_to_string(folder.path().join("a.uai")).unwrap();
    assert!(uai.ends_with("\n4\n0.0 1.0 0.0 0.0\n"), "{uai}");
    // The row of zeros implies that X is 0, in every command.
    for arguments in [
        &["ask", "a.bp", "q", "--json"][..],
        &["ask", "a.uai", "P(\"0\")", "--json"],
        &["marginals", "a.uai", "--json"],
        &["marginals", "a.uai", "--only", "0", "--json"],
        &["marginals", "a.bp", "--only", "X", "--json"],
    ] {
        let done = bp(folder.path(), arguments);
        assert!(done.status.success(), "{}", words(&done.stderr));
        let answer: serde_json::Value = serde_json::from_slice(&done.stdout).unwrap();
        let p = match answer.get("posteriors") {
            Some(all) => all.get("X").or(all.get("0")).unwrap()["0"].clone(),
            None => answer["answer"][0]["p"].clone(),
        };
        assert_eq!(p.as_f64(), Some(1.0), "{arguments:?}: {answer}");
    }
    let again = bp(folder.path(), &["convert", "a.uai", "b.uai"]);
    assert!(words(&again.stderr).contains("1 row is zero everywhere"), "{}", words(&again.stderr));
    assert_eq!(std::fs::read_to_string(folder.path().join("b.uai")).unwrap(), uai);
}

#[test]
fn files_are_recognised_by_their_names() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("a.bif"), NETWORK).unwrap();
    let mut packed = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
    std::io::Write::write_all(&mut packed, NETWORK.as_bytes()).unwrap();
    std::fs::write(folder.path().join("b.bif.gz"), packed.finish().unwrap()).unwrap();
    let done = bp(folder.path(), &["convert", "a.bif", "c.xbif"]);
    assert!(done.status.success(), "{}", words(&done.stderr));
    for name in ["b.bif.gz", "c.xbif"] {
        let plain = bp(folder.path(), &["marginals", "a.bif"]);
        let other = bp(folder.path(), &["marginals", name]);
        assert_eq!(words(&other.stdout), words(&plain.stdout), "{}", words(&other.stderr));
    }
    for (name, expected) in [
        (
            "a.xdsl",
            "`a.xdsl`: it is a network of GeNIe or SMILE, which is not read: in GeNIe, save it as Hugin NET",
        ),
        ("a.dne", "a network of Netica"),
        ("a.DSC", "a network of MSBN"),
        ("a.oobn", "of Hugin"),
        ("a.pgmx", "of OpenMarkov or Elvira"),
    ] {
        std::fs::write(folder.path().join(name), "<xml/>").unwrap();
        for arguments in [&["check", name][..], &["marginals", name], &["convert", name, "d.bif"]] {
            let done = bp(folder.path(), arguments);
            assert_eq!(done.status.code(), Some(1));
            assert!(words(&done.stderr).contains(expected), "{}", words(&done.stderr));
        }
    }
    let refused = bp(folder.path(), &["convert", "a.bif", "d.bif.gz"]);
    assert!(words(&refused.stderr).contains("`.gz` is read, not written"), "{}", words(&refused.stderr));
}

#[test]
fn a_probability_that_no_number_of_a_file_holds_is_reported() {
    let folder = tempfile::tempdir().unwrap();
    let program = "program Narrow { variables { X : 0..=1; Y : 0..=60; } decomposition { P(X) P(Y | X) }
        forms { P(X) = uniform; P(Y | X) = normal(30 * X, 1); } }";
    std::fs::write(folder.path().join("narrow.bp"), program).unwrap();
    for to in ["narrow.bif", "narrow.net", "narrow.xmlbif", "narrow.uai"] {
        let done = bp(folder.path(), &["convert", "narrow.bp", to]);
        let message = words(&done.stderr);
        assert!(done.status.success(), "{to}: {message}");
        // At X = 0 the first value below 10^-307.65 is 38: −38²/2 − ln Σ exp(−k²/2) = −722 − 0.5618.
        assert!(
            message.contains("`Y = 38` at X = 0 is e^-722.56") && message.contains("rounded"),
            "{to}: {message}"
        );
    }
    // P(B | A) = P(A B) / P(A): 1/8 and 3/8 of 1/2.
    let pair = "program Pair { variables { X : 0..=1; A, B : bool; } decomposition { P(X) P(A B | X) }
        forms { P(X) = uniform; P(A B | X) = table { 0: 0.25, 0.25, 0.125, 0.375; 1: 0.25, 0.25, 0.125, 0.375; }; } }";
    std::fs::write(folder.path().join("pair.bp"), pair).unwrap();
    let done = bp(folder.path(), &["convert", "pair.bp", "-", "--to", "bif"]);
    assert!(words(&done.stdout).contains("0.25, 0.75"), "{}", words(&done.stdout));
    assert!(words(&done.stderr).is_empty(), "{}", words(&done.stderr));
}

//! Golden pages: derivations, networks and HTML, as the command writes them.
//!
//! In: the programs of `tests/programs`. Out: the golden pages of `bp-core/tests/pages`; `BLESS=1` rewrites them.
//! Invariant: XML is well-formed, and text from a program is never markup.

use roxmltree::{Document, ParsingOptions};
use std::path::{Path, PathBuf};
use std::process::Command;

pub(crate) fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

pub(crate) fn bp(arguments: &[&str]) -> String {
    let output = Command::new(env!("CARGO_BIN_EXE_bp")).args(arguments).current_dir(root()).output().unwrap();
    assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

/// The programs of the tests, of the gallery and of the map, from the root.
pub(crate) fn programs() -> Vec<String> {
    let mut found = Vec::new();
    for folder in ["tests/programs", "examples", "examples/course", "bvm/models", "bp-core/tests/posteriors"]
    {
        for entry in std::fs::read_dir(root().join(folder)).unwrap() {
            let name = entry.unwrap().file_name().to_string_lossy().into_owned();
            if name.ends_with(".bp") {
                found.push(format!("{folder}/{name}"));
            }
        }
    }
    found.sort();
    found
}

/// Compares a text with its golden page.
#[track_caller]
pub(crate) fn golden(name: &str, found: &str) {
    let path = root().join("bp-core/tests/pages").join(name);
    if std::env::var_os("BLESS").is_some() {
        std::fs::write(&path, found).unwrap();
    }
    let expected = std::fs::read_to_string(&path).unwrap_or_default();
    assert!(found == expected, "{} has changed; BLESS=1 writes it anew\n{found}", path.display());
}

pub(crate) fn parsed(xml: &str) -> Document<'_> {
    let options = ParsingOptions { allow_dtd: true, ..ParsingOptions::default() };
    Document::parse_with_options(xml, options).unwrap_or_else(|error| panic!("{error}\n{xml}"))
}

/// The number of elements of a name.
pub(crate) fn count(document: &Document<'_>, name: &str) -> usize {
    document.descendants().filter(|node| node.tag_name().name() == name).count()
}

#[test]
fn derivations() {
    for (page, file, question) in [
        ("wet_grass", "tests/programs/wet_grass.bp", "P(Rain | Wet = true)"),
        ("cell", "tests/programs/cell.bp", "state"),
        ("line_of_sight", "tests/programs/line_of_sight.bp", "reading"),
        ("vestibular", "bvm/models/vestibular.bp", "rotation"),
    ] {
        golden(&format!("{page}.txt"), &bp(&["explain", file, question]));
        golden(&format!("{page}.tex"), &bp(&["explain", file, question, "--latex"]));
        let json: serde_json::Value =
            serde_json::from_str(&bp(&["explain", file, question, "--json"])).unwrap();
        let steps = json["steps"].as_array().unwrap().iter().map(|step| step["mathml"].as_str().unwrap());
        let lines: String = steps.map(|line| format!("<math>{line}</math>\n")).collect();
        let whole = format!("<steps>\n{lines}</steps>\n");
        assert_eq!(count(&parsed(&whole), "math"), json["steps"].as_array().unwrap().len());
        golden(&format!("{page}.mathml"), &whole);
    }
}

#[test]
fn documents_for_latex() {
    let text = bp(&["explain", "tests/programs/wet_grass.bp", "--latex", "--standalone"]);
    golden("wet_grass_standalone.tex", &text);
    let balanced =
        |open: &str, close: &str| assert_eq!(text.matches(open).count(), text.matches(close).count());
    balanced("\\begin{", "\\end{");
    assert!(text.starts_with("\\documentclass") && text.ends_with("\\end{document}\n"));
}

#[test]
fn a_document_with_letters_that_latex_cannot_set_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("weather.bp");
    let text =
        "program Weather { variables { 雨 : bool; } decomposition { P(雨) } forms { P(雨) = bernoulli(0.3); }
                question rain { P(雨) } }";
    std::fs::write(&path, text).unwrap();
    let file = path.to_str().unwrap();
    for command in ["explain", "print"] {
        let all = [command, file, "--latex", "--standalone"];
        let output = Command::new(env!("CARGO_BIN_EXE_bp")).args(all).output().unwrap();
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(
            output.status.code() == Some(1) && said.contains("`雨`") && said.contains("XeLaTeX"),
            "{said}"
        );
        assert!(output.stdout.is_empty());
        // A part of a document that another engine sets keeps them.
        assert!(bp(&[command, file, "--latex"]).contains('雨'));
    }
}

#[test]
fn networks() {
    for (page, file, question) in [
        ("wet_grass", "tests/programs/wet_grass.bp", "P(Rain | Wet = true)"),
        ("cell", "tests/programs/cell.bp", "state"),
        ("line_of_sight", "tests/programs/line_of_sight.bp", "reading"),
    ] {
        golden(&format!("{page}.svg"), &bp(&["draw", file, question]));
        golden(&format!("{page}.dot"), &bp(&["draw", file, question, "--dot"]));
    }
}

#[test]
fn a_network_has_each_node_and_each_edge_once() {
    let svg = bp(&["draw", "tests/programs/cell.bp", "state"]);
    let document = parsed(&svg);
    let named =
        |name: &str| document.descendants().filter(|node| node.tag_name().name() == name).collect::<Vec<_>>();
    // P(A) P(V | A) P(C | V A) P(O⁻¹ | A) P(O | O⁻¹) P(Z | V O C): 1 + 2 + 1 + 1 + 3 edges, an arrowhead for each.
    assert_eq!(named("polygon").len(), 8);
    let edges = named("path").into_iter().filter(|path| path.attribute("fill") == Some("none"));
    let mut edges: Vec<_> = edges.map(|path| path.attribute("d").unwrap().to_owned()).collect();
    edges.sort();
    edges.dedup();
    assert_eq!(edges.len(), 8);
    // A, C, V, O⁻¹ and Z once, and O and V, which are searched, with a double edge.
    let outlines = named("path").into_iter().chain(named("ellipse"));
    let outlines: Vec<_> = outlines.filter(|node| node.attribute("class") == Some("node")).collect();
    assert_eq!(outlines.len(), 6 + 2);
    let dashed = outlines.iter().filter(|node| node.attribute("stroke-dasharray").is_some()).count();
    assert_eq!(dashed, 1, "O⁻¹ alone is of the previous instant");
    // The box of the sensors, and that of the whole program.
    assert_eq!(named("rect").len(), 2);
    let dot = bp(&["draw", "tests/programs/cell.bp", "state", "--dot"]);
    assert_eq!((dot.matches(" -> ").count(), dot.matches("peripheries=2").count()), (8, 2));
}

#[test]
fn a_page_needs_nothing_else_and_is_well_formed() {
    for file in [
        "tests/programs/wet_grass.bp",
        "tests/programs/cell.bp",
        "tests/programs/line_of_sight.bp",
        "tests/programs/gaze.bp",
        "bvm/models/vestibular.bp",
        "bvm/models/binaural.bp",
        "bvm/models/view.bp",
    ] {
        let html = bp(&["explain", file, "--html"]);
        let document = parsed(&html);
        assert_eq!(count(&document, "script"), 0);
        for node in document.descendants() {
            let links = ["src", "href"].iter().any(|name| node.attribute(*name).is_some());
            assert!(!links, "{file}: {node:?} leads out of the page");
        }
        assert!(!html.contains("url(") && !html.contains("@import"));
        let (questions, lines) = (count(&document, "section"), count(&document, "li"));
        assert!(questions > 0 && lines >= questions, "{file}");
        assert_eq!(count(&document, "svg"), questions + usize::from(questions > 1), "{file}");
        // Each line, and the computed equation.
        assert!(count(&document, "math") >= lines + questions, "{file}");
    }
    golden("wet_grass.html", &bp(&["explain", "tests/programs/wet_grass.bp", "rain", "--html"]));
}

#[test]
fn names_from_a_program_are_escaped() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("hard.bp");
    let text = "/// </pre><script>alert(1)</script> & \"quotes\" 50% $x$ \\end{document}\n\
        program Hard_1 { parameters { s : real = 1; }\n\
        variables { ρ, a_b : bool; Y : real; } // <img src=x>\n\
        decomposition { P(ρ) P(a_b | ρ) P(Y | a_b) }\n\
        forms { P(ρ) = bernoulli(0.3); P(a_b | ρ) = bernoulli(if ρ { 0.1 } else { 0.2 }); \
        P(Y | a_b) = if a_b { normal(0, s) } else { normal(1, 2) }; }\n\
        question q { P(ρ | Y = 0.5) } }";
    std::fs::write(&path, text).unwrap();
    let file = path.to_str().unwrap();
    let html = bp(&["explain", file, "--html"]);
    let document = parsed(&html);
    assert_eq!((count(&document, "script"), count(&document, "img")), (0, 0));
    let shown: String =
        document.descendants().filter_map(|node| node.text().filter(|_| node.is_text())).collect();
    assert!(shown.contains("</pre><script>alert(1)</script> & \"quotes\"") && shown.contains("<img src=x>"));
    assert!(parsed(&bp(&["draw", file])).descendants().any(|node| node.text() == Some("a_b")));
    let latex = bp(&["explain", file, "--latex", "--standalone"]);
    assert!(latex.contains("Hard\\_1") && latex.contains("\\rho") && latex.contains("50\\%"), "{latex}");
    assert_eq!(latex.matches("\\end{document}").count(), 1, "{latex}");
}

#[test]
fn pages_go_to_files_whole() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let svg = bp(&["draw", "tests/programs/wet_grass.bp"]);
    assert_eq!(bp(&["draw", "tests/programs/wet_grass.bp", "--out", &path("g.svg")]), "");
    assert_eq!(std::fs::read_to_string(path("g.svg")).unwrap(), svg);
    bp(&["explain", "tests/programs/wet_grass.bp", "--html", "--out", &path("g.html")]);
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 2, "nothing is left behind");
    let missing = path("none/g.svg");
    let output = Command::new(env!("CARGO_BIN_EXE_bp"))
        .args(["draw", "tests/programs/wet_grass.bp", "--out", &missing])
        .current_dir(root())
        .output()
        .unwrap();
    assert_eq!(output.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&output.stderr).contains("none/g.svg"));
}

#[test]
fn completions_of_shells_contain_every_command() {
    for shell in ["bash", "zsh", "fish", "powershell", "elvish"] {
        let script = bp(&["completions", shell]);
        for verb in ["check", "fmt", "explain", "ask", "draw", "completions"] {
            assert!(script.contains(verb), "{shell} does not complete {verb}");
        }
    }
}

#[test]
fn costs_by_hand() {
    // Σ_Sprinkler over two factors that depend on Rain too: 2 · 2 products, 2 additions, a table of 2 numbers; then the
    // answer: two factors and a division for each of 2 rows, and one addition.
    let text = bp(&["explain", "tests/programs/wet_grass.bp", "P(Rain | Wet = true)", "--json"]);
    let json: serde_json::Value = serde_json::from_str(&text).unwrap();
    let cost = &json["cost"][0];
    let row = |row: usize| {
        ["entries", "multiplications", "additions", "bytes"]
            .map(|key| cost["rows"][row][key].as_f64().unwrap())
    };
    assert_eq!((row(0), row(1)), ([2.0, 4.0, 2.0, 16.0], [2.0, 4.0, 1.0, 16.0]));
    assert_eq!(
        (cost["rows"][0]["summed"].as_str(), cost["rows"][1]["summed"].as_str()),
        (Some("Sprinkler"), None)
    );
    assert_eq!((cost["multiplications"].as_f64(), cost["additions"].as_f64()), (Some(8.0), Some(3.0)));
    assert_eq!(json["free_parameters"], 3.0);
    assert_eq!(
        (&json["free_parameters_of_joint"], &json["free_parameters_of_tables"]),
        (&7.0.into(), &7.0.into())
    );
}

//! Pages of LaTeX: no line is wider than its page.
//!
//! In: the derivations and the brace layout of every program, in one document. Out: pass if `pdflatex` reports no
//! `Overfull \hbox`; where it is not installed, a line that says so. Invariant: one run of `pdflatex`.

use super::pages::{programs, root};
use std::process::Command;

/// The output of a command that may refuse a program, such as one that is not learned yet.
fn tried(arguments: &[&str]) -> Option<String> {
    let output = Command::new(env!("CARGO_BIN_EXE_bp")).args(arguments).current_dir(root()).output().unwrap();
    output.status.success().then(|| String::from_utf8(output.stdout).unwrap())
}

fn body(document: &str) -> &str {
    let (_, rest) = document.split_once("\\begin{document}").expect("a document");
    rest.split_once("\\end{document}").expect("its end").0
}

#[test]
fn no_line_of_latex_overflows() {
    if Command::new("pdflatex").arg("--version").output().is_err() {
        eprintln!(
            "skipped: pdflatex is not installed (Debian: texlive-latex-base, texlive-latex-recommended)"
        );
        return;
    }
    let mut document = String::from(
        "\\documentclass{article}\n\\usepackage[utf8]{inputenc}\n\\usepackage[margin=25mm]{geometry}\n\
         \\usepackage{amsmath,amssymb,array,graphicx}\n\\begin{document}\n",
    );
    let (mut derivations, mut layouts) = (0, Vec::new());
    for file in programs() {
        for forms in [None, Some("--forms")] {
            let arguments = ["explain", file.as_str(), "--latex", "--standalone"].into_iter().chain(forms);
            let Some(page) = tried(&arguments.collect::<Vec<_>>()) else { continue };
            derivations += 1;
            document
                .push_str(&format!("\\typeout{{AT explain {file}}}\n{{{}\\par}}\\clearpage\n", body(&page)));
        }
        let page = tried(&["print", &file, "--latex", "--standalone"]).expect("every program prints");
        layouts.push(format!("\\typeout{{AT print {file}}}\n{}", body(&page)));
    }
    assert!(derivations > 80 && layouts.len() > 40, "{derivations} {}", layouts.len());
    // Those pages set their own size, so they are last.
    document.push_str(&layouts.concat());
    document.push_str("\\end{document}\n");
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("all.tex"), document).unwrap();
    let run = Command::new("pdflatex")
        .args(["-interaction=nonstopmode", "-halt-on-error", "all.tex"])
        .env("max_print_line", "1000")
        .current_dir(folder.path())
        .output()
        .unwrap();
    let log = String::from_utf8_lossy(&run.stdout).into_owned();
    let (mut at, mut wide) = ("", Vec::new());
    for line in log.lines() {
        if let Some(file) = line.strip_prefix("AT ") {
            at = file;
        } else if line.starts_with("Overfull \\hbox") || line.starts_with('!') {
            wide.push(format!("{at}: {line}"));
        }
    }
    assert!(wide.is_empty(), "{} lines are too wide:\n{}", wide.len(), wide.join("\n"));
    assert!(run.status.success(), "{log}");
}

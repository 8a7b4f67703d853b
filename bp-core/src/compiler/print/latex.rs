//! The brace layout for LaTeX.
//!
//! In: sheets in LaTeX. Out: a fragment for a figure of a paper, or a complete document with a page for each sheet.
//! Invariant: TeX breaks the lines, so that none is wider than its brace allows; the fragment is as wide as
//! `\linewidth`, with the network at its right, or below it if it is wide.
//!
//! The fragment needs amsmath, amssymb and graphicx.

use super::{Part, Sheet};
use crate::latex::{breakable, escaped};
use std::fmt::Write;

/// The width of a name and its brace, in points.
const BRACE: usize = 32;
/// A pixel of the network, in points.
const UNIT: f64 = 0.62;
/// The widest network beside the layout, in points.
const BESIDE: f64 = 165.0;
/// The most variables of a network in a figure.
const MOST_NODES: usize = 40;

/// The figure of a sheet, to be read into a document.
pub fn fragment(sheet: &Sheet) -> String {
    let mut text = format!("% program {} (amsmath, amssymb, graphicx)\n", sheet.name.replace('\n', " "));
    let nodes = sheet.network.nodes.len();
    let shown = (1..=MOST_NODES).contains(&nodes);
    let (width, _) = sheet.network.picture_size();
    let wide = (width * UNIT).ceil();
    let beside = shown && wide <= BESIDE;
    let room = if beside { wide as usize + 14 } else { 0 };
    // Writing to a string cannot fail.
    let _ = writeln!(text, "\\begingroup\\parindent0pt\\parskip0pt\\raggedright\\noindent");
    part(&sheet.whole, room, &mut text);
    let picture = || format!("\\setlength{{\\unitlength}}{{{UNIT}pt}}\\small\n{}", sheet.network.picture());
    if beside {
        let _ = writeln!(text, "\\hfill\\raisebox{{-0.5\\height}}{{{}}}\\par", picture());
    } else if shown {
        let _ = writeln!(
            text,
            "\\par\\bigskip\\hbox to \\linewidth{{\\hss\\setbox0\\hbox{{{}}}\\ifdim\\wd0>\\linewidth\
             \\resizebox{{\\linewidth}}{{!}}{{\\box0}}\\else\\box0\\fi\\hss}}\\par",
            picture()
        );
    } else if nodes > 0 {
        let _ =
            writeln!(text, "\\par\\bigskip The network has {nodes} variables, too many for a figure.\\par");
    }
    if !sheet.missing.is_empty() {
        let _ = writeln!(text, "\\medskip\\textbf{{Missing}}\\par");
        for line in &sheet.missing {
            let _ = writeln!(text, "\\hangindent1em\\hangafter1 -- {}\\par", prose(line));
        }
    }
    text.push_str("\\endgroup\n");
    text
}

/// A document: each sheet on a page that is as large as it.
pub fn document(sheets: &[Sheet]) -> String {
    let mut text = String::from(
        "\\documentclass{article}\n\\usepackage[utf8]{inputenc}\n\
         \\usepackage{amsmath,amssymb,graphicx}\n\\pagestyle{empty}\n\\begin{document}\n",
    );
    for sheet in sheets {
        let _ = writeln!(text, "\\setbox1\\vbox{{\\hsize160mm\\linewidth\\hsize\\textwidth\\hsize");
        let _ = writeln!(text, "\\noindent{{\\large\\textbf{{{}}}}}\\par\\medskip", escaped(&sheet.name));
        if !sheet.documentation.is_empty() {
            let _ =
                writeln!(text, "{{\\raggedright\\noindent {}\\par}}\\medskip", prose(&sheet.documentation));
        }
        let _ = writeln!(text, "{}}}", fragment(sheet));
        text.push_str(
            "\\pdfpagewidth\\dimexpr\\wd1+20mm\\relax\\pdfpageheight\\dimexpr\\ht1+\\dp1+20mm\\relax\n\
             \\hoffset\\dimexpr10mm-1in\\relax\\voffset\\hoffset\n\\shipout\\box1\n",
        );
    }
    text.push_str("\\end{document}\n");
    text
}

fn part(one: &Part, room: usize, text: &mut String) {
    match one {
        Part::Brace(name, parts) => {
            let room = room + BRACE;
            let _ = writeln!(
                text,
                "\\hbox to 15pt{{\\hss\\rotatebox[origin=c]{{90}}{{\\textit{{{name}}}}}\\hss}}\
                 $\\left\\{{\\,\\vcenter{{\\hsize\\dimexpr\\linewidth-{room}pt\\relax\\raggedright\\parindent0pt"
            );
            for one in parts {
                match one {
                    Part::Brace(..) => {
                        text.push_str("\\hbox{");
                        part(one, room, text);
                        text.push_str("}\n");
                    }
                    Part::Lines(..) => part(one, room, text),
                }
            }
            let _ = write!(text, "}}\\right.$");
        }
        Part::Lines(title, lines) => {
            let _ = writeln!(text, "\\strut\\textbf{{{title}}}\\par");
            for line in lines {
                let first = line.depth + 1;
                let _ = writeln!(
                    text,
                    "\\leftskip{}em\\hangindent1em\\hangafter1\\strut${}$\\par",
                    first,
                    breakable(line.mathematics.trim_end())
                );
            }
            text.push_str("\\leftskip0pt\\smallskip\n");
        }
    }
}

/// A sentence with names in backticks.
fn prose(text: &str) -> String {
    let parts = text.split('`').enumerate().map(|(position, part)| match position % 2 {
        0 => escaped(part),
        _ => format!("\\texttt{{{}}}", escaped(part)),
    });
    parts.collect()
}

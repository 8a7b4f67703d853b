//! The brace layout as a page of HTML.
//!
//! In: sheets in MathML. Out: one self-contained page without scripts. Invariant: the page is well-formed XML too; text
//! from a program is never markup.

use super::{Part, Sheet};
use crate::xml::{escaped, pieces};
use std::fmt::Write;

/// The style sheet.
const STYLE: &str = include_str!("sheet.css");

/// A curly bracket that is as high as what it opens.
const BRACE: &str = "<svg viewBox=\"0 0 14 100\" preserveAspectRatio=\"none\" aria-hidden=\"true\"><path d=\"M13 0 Q7 0 7 6 \
    L7 44 Q7 50 1 50 Q7 50 7 56 L7 94 Q7 100 13 100\" fill=\"none\" stroke=\"#222\" stroke-width=\"1.3\" \
    vector-effect=\"non-scaling-stroke\"/></svg>";

/// A page with these sheets, which must be in MathML.
pub fn page(sheets: &[Sheet]) -> String {
    let title = sheets.last().map_or("", |sheet| sheet.name.as_str());
    let mut page = format!(
        "<!DOCTYPE html>\n<html xmlns=\"http://www.w3.org/1999/xhtml\" lang=\"en\">\n<head><meta \
         charset=\"utf-8\"/><title>Program {}</title>\n<meta name=\"viewport\" content=\"width=device-width, \
         initial-scale=1\"/>\n<style>\n{STYLE}</style></head>\n<body><main>\n",
        escaped(title)
    );
    page.push_str(&sections(sheets));
    page.push_str("</main></body>\n</html>\n");
    page
}

/// The sections of a page with these sheets, one for each, which must be in MathML.
pub fn sections(sheets: &[Sheet]) -> String {
    let mut sections = String::new();
    sheets.iter().for_each(|sheet| sheet.section(&mut sections));
    sections
}

impl Sheet {
    fn section(&self, page: &mut String) {
        // Writing to a string cannot fail.
        let _ = writeln!(page, "<section>\n<h1>{}</h1>", escaped(&self.name));
        if !self.documentation.is_empty() {
            let _ = writeln!(page, "<p class=\"documentation\">{}</p>", escaped(&self.documentation));
        }
        page.push_str("<div class=\"beside\">\n<div class=\"layout\">\n");
        part(&self.whole, page);
        page.push_str("</div>\n");
        if !self.network.nodes.is_empty() {
            let _ = writeln!(
                page,
                "<figure>\n{}<figcaption>The network.</figcaption></figure>",
                self.network.svg()
            );
        }
        page.push_str("</div>\n");
        if !self.missing.is_empty() {
            page.push_str("<div class=\"missing\"><p class=\"title\">Missing</p>\n<ul>\n");
            for line in &self.missing {
                let _ = writeln!(page, "<li>{}</li>", escaped(line));
            }
            page.push_str("</ul></div>\n");
        }
        page.push_str("</section>\n");
    }
}

fn part(one: &Part, page: &mut String) {
    match one {
        Part::Brace(name, parts) => {
            let _ = writeln!(
                page,
                "<div class=\"brace\"><div class=\"name\">{name}</div>{BRACE}<div class=\"parts\">"
            );
            parts.iter().for_each(|one| part(one, page));
            page.push_str("</div></div>\n");
        }
        Part::Lines(title, lines) => {
            let _ = writeln!(page, "<div class=\"part\"><div class=\"title\">{title}</div>");
            for line in lines {
                let math = pieces(&line.mathematics);
                let math =
                    math.iter().map(|piece| format!("<math>{piece}</math>")).collect::<Vec<_>>().join(" ");
                let indent = 2.0 + 1.2 * line.depth as f64;
                let _ =
                    writeln!(page, "<div class=\"line\" style=\"padding-left: {indent}rem\">{math}</div>");
            }
            page.push_str("</div>\n");
        }
    }
}

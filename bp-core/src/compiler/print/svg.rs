//! The brace layout as a picture.
//!
//! In: a sheet in Unicode. Out: one self-contained `svg` element. Invariant: it is well-formed XML; names are text,
//! never markup; the network stands at the right of the layout.

use super::terminal::broken;
use super::{Part, Sheet};
use crate::xml::escaped;
use std::fmt::Write;

const INK: &str = "#222222";
const FONT: &str = "STIX Two Text, Latin Modern Roman, Cambria, Georgia, Times New Roman, serif";
/// The height of a line, in pixels.
const LINE: f64 = 21.0;
/// The width of a letter, on the safe side.
const LETTER: f64 = 7.9;
/// The columns of a line within the innermost brace.
const COLUMNS: usize = 62;
/// The width of a name and its brace.
const BRACE: f64 = 42.0;
const MARGIN: f64 = 16.0;

impl Sheet {
    /// The layout with the network beside it; the sheet must be in Unicode.
    pub fn svg(&self) -> String {
        let mut body = String::new();
        let mut lines = Vec::new();
        let height = measure(&self.whole);
        let mut top = MARGIN + 2.2 * LINE;
        let heading = top - 1.1 * LINE;
        draw(&self.whole, MARGIN, top, &mut body, &mut lines);
        let reach = |(x, text): &(f64, String)| x + text.chars().count() as f64 * LETTER;
        let mut width = lines.iter().map(reach).fold(MARGIN + 200.0, f64::max);
        top += height;
        if !self.missing.is_empty() {
            top += LINE;
            text(&mut body, MARGIN, top, "Missing", "font-weight=\"bold\"");
            for line in &self.missing {
                top += LINE;
                text(&mut body, MARGIN + 16.0, top, line, "");
                width = width.max(MARGIN + 16.0 + line.chars().count() as f64 * LETTER);
            }
        }
        let mut bottom = top + MARGIN;
        let network = self.network.svg();
        if !self.network.nodes.is_empty() {
            let (wide, high) = size(&network);
            let y = (MARGIN + 2.2 * LINE + (height - high) / 2.0).max(MARGIN);
            let _ = write!(
                body,
                "<g transform=\"translate({:.1} {y:.1})\">\n{network}</g>\n",
                width + 2.0 * MARGIN
            );
            width += 2.0 * MARGIN + wide;
            bottom = bottom.max(y + high + MARGIN);
        }
        let (width, bottom) = ((width + MARGIN).ceil(), bottom.ceil());
        let mut svg = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" role=\"img\" width=\"{width}\" height=\"{bottom}\" \
             viewBox=\"0 0 {width} {bottom}\" font-family=\"{FONT}\" font-size=\"15\" fill=\"{INK}\">\n"
        );
        let _ = writeln!(svg, "<title>{}</title>", escaped(&format!("The program {}", self.name)));
        let _ = writeln!(svg, "<rect width=\"{width}\" height=\"{bottom}\" fill=\"#ffffff\"/>");
        text(&mut svg, MARGIN, heading, &self.name, "font-weight=\"bold\" font-size=\"18\"");
        svg.push_str(&body);
        svg.push_str("</svg>\n");
        svg
    }
}

/// Width and height of an `svg` element of this crate, which stand in its first line.
fn size(svg: &str) -> (f64, f64) {
    let number = |name: &str| {
        let (_, rest) = svg.split_once(&format!(" {name}=\""))?;
        rest.split('"').next()?.parse().ok()
    };
    (number("width").unwrap_or(0.0), number("height").unwrap_or(0.0))
}

/// The lines of a part without braces: (indented text, whether it is a title).
fn rows(part: &Part) -> Vec<(String, bool)> {
    let Part::Lines(title, lines) = part else { return Vec::new() };
    let mut rows = vec![((*title).to_owned(), true)];
    rows.extend(lines.iter().flat_map(|line| broken(line, COLUMNS)).map(|line| (line, false)));
    rows
}

/// The height of a part.
fn measure(part: &Part) -> f64 {
    match part {
        Part::Lines(..) => rows(part).len() as f64 * LINE + 6.0,
        Part::Brace(title, parts) => {
            let name = title.chars().count() as f64 * LETTER + 8.0;
            parts.iter().map(measure).sum::<f64>().max(name)
        }
    }
}

fn draw(part: &Part, left: f64, top: f64, svg: &mut String, lines: &mut Vec<(f64, String)>) {
    match part {
        Part::Lines(..) => {
            let mut y = top + 3.0;
            for (row, is_title) in rows(part) {
                y += LINE;
                let indent = row.chars().take_while(|letter| *letter == ' ').count() as f64 * 8.0;
                let style = if is_title { "font-weight=\"bold\"" } else { "" };
                text(svg, left + indent, y - 6.0, row.trim_start(), style);
                lines.push((left + indent, row.trim_start().to_owned()));
            }
        }
        Part::Brace(title, parts) => {
            let height = measure(part);
            let (middle, x) = (top + height / 2.0, left + 14.0);
            let _ = writeln!(
                svg,
                "<text x=\"{x:.1}\" y=\"{middle:.1}\" text-anchor=\"middle\" font-style=\"italic\" \
                 transform=\"rotate(-90 {x:.1} {middle:.1})\">{title}</text>"
            );
            brace(svg, left + 20.0, top + 2.0, top + height - 2.0);
            let mut y = top;
            for part in parts {
                draw(part, left + BRACE, y, svg, lines);
                y += measure(part);
            }
        }
    }
}

/// A curly bracket that opens to the right, 14 pixels wide.
fn brace(svg: &mut String, left: f64, top: f64, bottom: f64) {
    let (right, stem, middle) = (left + 14.0, left + 7.0, (top + bottom) / 2.0);
    let _ = writeln!(
        svg,
        "<path d=\"M{right:.1} {top:.1} Q{stem:.1} {top:.1} {stem:.1} {:.1} L{stem:.1} {:.1} Q{stem:.1} {middle:.1} \
         {left:.1} {middle:.1} Q{stem:.1} {middle:.1} {stem:.1} {:.1} L{stem:.1} {:.1} Q{stem:.1} {bottom:.1} \
         {right:.1} {bottom:.1}\" fill=\"none\" stroke=\"{INK}\" stroke-width=\"1.3\"/>",
        top + 9.0,
        middle - 9.0,
        middle + 9.0,
        bottom - 9.0,
    );
}

fn text(svg: &mut String, x: f64, y: f64, text: &str, style: &str) {
    let _ = writeln!(
        svg,
        "<text x=\"{x:.1}\" y=\"{y:.1}\" xml:space=\"preserve\" {style}>{}</text>",
        escaped(text)
    );
}

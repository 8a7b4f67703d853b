//! Diagnostics of programs: values, collected, and rendered here.
//!
//! In: spans and messages from the parser and the checker. Out: [`Diagnostics`], which a macro maps onto its tokens,
//! and which [`Diagnostics::render`] shows as source lines with carets. Invariant: a message is lower case, puts names
//! in backticks, and states the found and the expected text; `help` is given only if there is an obvious
//! correction.

use crate::source::{Source, Span};
use ariadne::{CharSet, Color, Config, IndexType, Label, Report, ReportKind};
use std::fmt;

/// One error with its span.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Diagnostic {
    /// The span of the error.
    pub span: Span,
    /// The message, one sentence.
    pub message: String,
    /// Related spans, each with a remark; a label may also have the main span.
    pub labels: Vec<(Span, String)>,
    /// The suggested correction, if there is one.
    pub help: Option<String>,
}

impl Diagnostic {
    /// An error at a span.
    pub fn new(span: Span, message: impl Into<String>) -> Self {
        Self { span, message: message.into(), labels: Vec::new(), help: None }
    }

    /// With a remark at another span.
    #[must_use]
    pub fn with_label(mut self, span: Span, remark: impl Into<String>) -> Self {
        self.labels.push((span, remark.into()));
        self
    }

    /// With a suggested correction.
    #[must_use]
    pub fn with_help(mut self, help: impl Into<String>) -> Self {
        self.help = Some(help.into());
        self
    }
}

/// The errors of a program, in the order of its text.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Diagnostics(pub Vec<Diagnostic>);

impl Diagnostics {
    /// Adds an error.
    pub fn push(&mut self, diagnostic: Diagnostic) {
        self.0.push(diagnostic);
    }

    /// True if there are no errors.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// The errors, in order.
    pub fn iter(&self) -> impl Iterator<Item = &Diagnostic> {
        self.0.iter()
    }

    /// Sorts the errors by their position, and removes duplicates.
    pub fn sort(&mut self) {
        self.0.sort_by(|a, b| a.span.cmp(&b.span).then_with(|| a.message.cmp(&b.message)));
        self.0.dedup();
    }

    /// The value if there are no errors, else the errors in order.
    pub fn or<T>(mut self, value: T) -> Result<T, Diagnostics> {
        if self.is_empty() {
            return Ok(value);
        }
        self.sort();
        Err(self)
    }

    /// The errors for users: each with its source lines and carets, with or without colour.
    pub fn render(&self, source: &Source, colour: bool) -> String {
        let mut text = String::new();
        for diagnostic in &self.0 {
            text.push_str(&render_one(diagnostic, source, colour));
        }
        text
    }
}

impl From<Diagnostic> for Diagnostics {
    fn from(diagnostic: Diagnostic) -> Self {
        Self(vec![diagnostic])
    }
}

/// The messages only, one per line, if there is no source.
impl fmt::Display for Diagnostics {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (index, diagnostic) in self.0.iter().enumerate() {
            if index > 0 {
                writeln!(f)?;
            }
            write!(f, "{}", diagnostic.message)?;
            if let Some(help) = &diagnostic.help {
                write!(f, " (help: {help})")?;
            }
        }
        Ok(())
    }
}

impl std::error::Error for Diagnostics {}

/// The longest line that is shown in full.
const LONGEST: usize = 400;

/// The error with its surroundings, if the line is too long to be shown: network files have tables of a million numbers
/// on one line.
fn excerpt(diagnostic: &Diagnostic, source: &Source) -> Option<String> {
    let text = source.text.as_str();
    let long = |span: Span| {
        let start = span.start.min(text.len());
        let before = text.as_bytes()[..start].iter().rev().take_while(|byte| **byte != b'\n').count();
        let after = text.as_bytes()[start..].iter().take_while(|byte| **byte != b'\n').count();
        before + after > LONGEST
    };
    let spans = diagnostic.labels.iter().map(|(span, _)| *span).chain([diagnostic.span]);
    if !spans.into_iter().any(long) {
        return None;
    }
    let (line, column) = source.line_and_column(diagnostic.span.start);
    let start = text.floor_char_boundary(diagnostic.span.start);
    let before: String = text[..start].chars().rev().take(30).take_while(|letter| *letter != '\n').collect();
    let before: String = before.chars().rev().collect();
    let after: String = text[start..].chars().take(50).take_while(|letter| *letter != '\n').collect();
    let blanks = " ".repeat(before.chars().count());
    let mut page = format!("error: {}\n   ╭─[ {}:{line}:{column} ]\n", diagnostic.message, source.name);
    page.push_str(&format!("   │ …{before}{}…\n   │  {blanks}╰── here\n", after.trim_end()));
    if let Some(help) = &diagnostic.help {
        page.push_str(&format!("   │ Help: {help}\n"));
    }
    page.push_str("───╯\n");
    Some(page)
}

fn render_one(diagnostic: &Diagnostic, source: &Source, colour: bool) -> String {
    if let Some(page) = excerpt(diagnostic, source) {
        return page;
    }
    let name = source.name.as_str();
    let fit = |span: Span| {
        // Whole characters: the text is cut at these positions.
        let end = source.text.ceil_char_boundary(span.end);
        (name, source.text.floor_char_boundary(span.start).min(end)..end)
    };
    let config =
        Config::new().with_color(colour).with_index_type(IndexType::Byte).with_char_set(CharSet::Unicode);
    let mut report = Report::build(ReportKind::Error, fit(diagnostic.span))
        .with_config(config)
        .with_message(&diagnostic.message);
    if !diagnostic.labels.iter().any(|(span, _)| *span == diagnostic.span) {
        report.add_label(Label::new(fit(diagnostic.span)).with_message("here").with_color(Color::Red));
    }
    for (span, remark) in &diagnostic.labels {
        let tone = if *span == diagnostic.span { Color::Red } else { Color::Blue };
        report.add_label(Label::new(fit(*span)).with_message(remark).with_color(tone));
    }
    if let Some(help) = &diagnostic.help {
        report.set_help(help);
    }
    let mut bytes = Vec::new();
    let written = report.finish().write((name, ariadne::Source::from(source.text.as_str())), &mut bytes);
    match written {
        // Trailing blanks would complicate the golden files.
        Ok(()) => {
            // The first word is the kind of report; commands print it in lower case.
            let text = String::from_utf8_lossy(&bytes).replacen("Error:", "error:", 1);
            text.lines().map(|line| format!("{}\n", line.trim_end())).collect()
        }
        Err(error) => format!("error: {} ({error})\n", diagnostic.message),
    }
}

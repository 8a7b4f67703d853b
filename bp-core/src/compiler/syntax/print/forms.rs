//! Prints forms: on one line if they fit, else one row, branch or arm per line.
//!
//! In: a definition or a form. Out: lines on a [`Page`]. Invariant: a table whose rows have comments is never put on
//! one line.

use super::words::list;
use super::{Page, after};
use crate::syntax::ast::*;

impl Page {
    pub(super) fn definition(&mut self, definition: &Definition) {
        self.before(&definition.comments);
        let opening = format!("{} = ", definition.head);
        self.form(&opening, &definition.form, &format!(";{}", after(&definition.comments)));
    }

    /// A form between the opening of its first line and the closing of its last.
    fn form(&mut self, opening: &str, form: &Form, closing: &str) {
        if let Some(words) = inline(form) {
            let line = format!("{opening}{words}{closing}");
            let compound = matches!(form.kind, FormKind::Table(_) | FormKind::If(_) | FormKind::Match(_));
            if self.fits(&line) || !compound && !matches!(form.kind, FormKind::Let { .. }) {
                return self.line(&line);
            }
        }
        match &form.kind {
            FormKind::Let { name, value, body } => {
                self.line(&format!("{opening}let {name} = {value} in"));
                match opening.is_empty() {
                    true => self.form("", body, closing),
                    false => self.deeper(|page| page.form("", body, closing)),
                }
            }
            FormKind::Previous { variable, of, otherwise: Some(body) } => {
                self.form(&format!("{opening}{} else ", previous(variable, of.as_deref())), body, closing);
            }
            FormKind::Table(rows) => {
                self.line(&format!("{opening}table {{"));
                self.deeper(|page| {
                    rows.iter().for_each(|row| page.item(&row.comments, &format!("{};", words_of(row))))
                });
                self.line(&format!("}}{closing}"));
            }
            FormKind::If(choice) => {
                let mut opening = opening.to_owned();
                for (condition, body) in &choice.branches {
                    self.line(&format!("{opening}if {condition} {{"));
                    self.deeper(|page| page.form("", body, ""));
                    opening = "} else ".to_owned();
                }
                self.line(&format!("{opening}{{"));
                self.deeper(|page| page.form("", &choice.otherwise, ""));
                self.line(&format!("}}{closing}"));
            }
            FormKind::Match(choice) => {
                self.line(&format!("{opening}match {} {{", choice.on));
                self.deeper(|page| {
                    for (pattern, body) in &choice.arms {
                        page.form(&format!("{pattern} => "), body, ",");
                    }
                });
                self.line(&format!("}}{closing}"));
            }
            _ => self.line(&format!("{opening}{}{closing}", inline(form).unwrap_or_default())),
        }
    }
}

/// A form on one line; `None` if it contains a comment.
fn inline(form: &Form) -> Option<String> {
    Some(match &form.kind {
        FormKind::Named { name, arguments, by } => {
            let arguments = arguments.as_ref().map_or_else(String::new, |it| format!("({})", list(it, ", ")));
            let by = if by.is_empty() { String::new() } else { format!(" by {}", list(by, " ")) };
            format!("{name}{arguments}{by}")
        }
        FormKind::Table(rows) => {
            if rows.iter().any(|row| row.comments != Comments::default()) {
                return None;
            }
            let rows: String = rows.iter().map(|row| format!("{}; ", words_of(row))).collect();
            format!("table {{ {rows}}}")
        }
        FormKind::Previous { variable, of, otherwise: None } => previous(variable, of.as_deref()),
        FormKind::Previous { variable, of, otherwise: Some(body) } => {
            format!("{} else {}", previous(variable, of.as_deref()), inline(body)?)
        }
        FormKind::Ask { path, given: None } => format!("ask({})", list(path, ".")),
        FormKind::Ask { path, given: Some(given) } => {
            format!("ask({} | {})", list(path, "."), list(given, " "))
        }
        FormKind::Let { name, value, body } => format!("let {name} = {value} in {}", inline(body)?),
        FormKind::If(choice) => {
            let mut words = String::new();
            for (condition, body) in &choice.branches {
                words.push_str(&format!("if {condition} {{ {} }} else ", inline(body)?));
            }
            format!("{words}{{ {} }}", inline(&choice.otherwise)?)
        }
        FormKind::Match(choice) => {
            let arms: Option<Vec<String>> = choice
                .arms
                .iter()
                .map(|(pattern, body)| Some(format!("{pattern} => {}", inline(body)?)))
                .collect();
            format!("match {} {{ {} }}", choice.on, arms?.join(", "))
        }
    })
}

fn previous(variable: &Occurrence, of: Option<&Expr>) -> String {
    match of {
        Some(of) => format!("previous({variable}, {of})"),
        None => format!("previous({variable})"),
    }
}

fn words_of(row: &Row) -> String {
    let values = list(&row.values, ", ");
    if row.keys.is_empty() { values } else { format!("{}: {values}", list(&row.keys, ", ")) }
}

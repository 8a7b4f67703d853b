//! The forms, and the parameters in them.
//!
//! In: the tree of a program. Out: a line for each form; choices, tables and mixtures have one line for each case.
//! Invariant: a table with many rows is shortened, and the number of the others is stated.

use super::variables::{comma, space};
use super::{Line, factors, text};
use crate::equation::{Notation, elided};
use crate::syntax::ast::{Definition, Expr, ExprKind, Form, FormKind, Parameter, Program, Row, SectionKind};
use std::collections::HashSet;

pub(super) fn forms(program: &Program, notation: Notation) -> Vec<Line> {
    let mut writer = Writer { notation, lines: Vec::new() };
    let mut given = HashSet::new();
    for section in &program.sections {
        if let SectionKind::Forms(definitions) = &section.kind {
            for definition in definitions {
                given.insert(definition.head.to_string());
                writer.definition(definition);
            }
        }
    }
    for factor in factors(program) {
        if !given.contains(&factor.to_string()) {
            let words = text(notation, "has no form yet");
            let head = notation.typeset(&factor.to_string());
            writer.lines.push(Line::new(0, format!("{head}{}{words}", super::space(notation))));
        }
    }
    for section in &program.sections {
        if let SectionKind::Parameters(parameters) = &section.kind {
            parameters.iter().for_each(|parameter| writer.parameter(parameter));
        }
    }
    match writer.lines.is_empty() {
        true => vec![Line::words(notation, "none yet")],
        false => writer.lines,
    }
}

struct Writer {
    notation: Notation,
    lines: Vec<Line>,
}

impl Writer {
    fn push(&mut self, depth: usize, mathematics: String) {
        self.lines.push(Line::new(depth, mathematics));
    }

    fn definition(&mut self, definition: &Definition) {
        let head = self.notation.typeset(&definition.head.to_string());
        let head = format!("{head} {} ", self.notation.choose("=", "=", "<mo>=</mo>"));
        self.form(0, &head, &definition.form, "");
    }

    /// A form between an opening and a condition.
    fn form(&mut self, depth: usize, opening: &str, form: &Form, condition: &str) {
        let notation = self.notation;
        let set = |text: &str| notation.typeset(text);
        match &form.kind {
            FormKind::Named { name, arguments: None, by } => {
                let words = match by.as_slice() {
                    [] => name.text.clone(),
                    by => {
                        let by: Vec<&str> = by.iter().map(|index| index.text.as_str()).collect();
                        format!("{} for each {}", name.text, by.join(", "))
                    }
                };
                self.push(depth, format!("{opening}{}{condition}", text(notation, &words)));
            }
            FormKind::Named { name, arguments: Some(arguments), .. } => match arguments.as_slice() {
                [argument] if is_choice(argument) => self.choice(depth, opening, &name.text, argument),
                _ => {
                    let arguments: Vec<String> = arguments.iter().map(Expr::to_string).collect();
                    let call = set(&format!("{name}({})", arguments.join(", ")));
                    self.push(depth, format!("{opening}{call}{condition}"));
                }
            },
            FormKind::Table(rows) => self.table(depth, opening, rows, condition),
            FormKind::Previous { variable, of, otherwise } => {
                let of = of.as_ref().map_or_else(String::new, |of| format!(", {of}"));
                let call = set(&format!("previous({variable}{of})"));
                self.push(depth, format!("{opening}{call}{condition}"));
                if let Some(otherwise) = otherwise {
                    let at_first = text(notation, "before the first step:");
                    self.form(depth + 1, &format!("{at_first}{}", super::space(notation)), otherwise, "");
                }
            }
            FormKind::Ask { path, given } => {
                let path: Vec<String> = path.iter().map(ToString::to_string).collect();
                let given = given.as_ref().map_or_else(String::new, |given| {
                    let names: Vec<String> = given.iter().map(ToString::to_string).collect();
                    format!(" | {}", names.join(" "))
                });
                let call = set(&format!("ask({}{given})", path.join(".")));
                self.push(depth, format!("{opening}{call}{condition}"));
            }
            FormKind::Let { name, value, body } => {
                self.form(depth, opening, body, condition);
                let holds = notation.relation(&notation.word(&name.text), "=", &set(&value.to_string()));
                let words = text(notation, "where");
                self.push(depth + 1, format!("{words}{}{holds}", super::space(notation)));
            }
            FormKind::If(choice) => {
                self.push(depth, format!("{}{condition}", opening.trim_end()));
                for (when, body) in &choice.branches {
                    let when = self.when(&set(&when.to_string()));
                    self.form(depth + 1, "", body, &when);
                }
                let otherwise = self.otherwise();
                self.form(depth + 1, "", &choice.otherwise, &otherwise);
            }
            FormKind::Match(choice) => {
                self.push(depth, format!("{}{condition}", opening.trim_end()));
                for (pattern, body) in &choice.arms {
                    let when = self.arm(&choice.on, &pattern.to_string());
                    self.form(depth + 1, "", body, &when);
                }
            }
        }
    }

    /// A form whose argument is a choice of numbers: a line for each.
    fn choice(&mut self, depth: usize, opening: &str, name: &str, argument: &Expr) {
        let call = |body: &Expr| self.notation.typeset(&format!("{name}({body})"));
        let mut cases: Vec<(String, String)> = Vec::new();
        match &argument.kind {
            ExprKind::If(choice) => {
                for (when, body) in &choice.branches {
                    cases.push((call(body), self.when(&self.notation.typeset(&when.to_string()))));
                }
                cases.push((call(&choice.otherwise), self.otherwise()));
            }
            ExprKind::Match(choice) => {
                for (pattern, body) in &choice.arms {
                    cases.push((call(body), self.arm(&choice.on, &pattern.to_string())));
                }
            }
            _ => {}
        }
        self.push(depth, opening.trim_end().to_owned());
        for (body, when) in cases {
            self.push(depth + 1, format!("{body}{when}"));
        }
    }

    fn when(&self, condition: &str) -> String {
        let blank = super::space(self.notation);
        format!("{blank}{}{blank}{condition}", text(self.notation, "if"))
    }

    fn otherwise(&self) -> String {
        format!("{}{}", super::space(self.notation), text(self.notation, "otherwise"))
    }

    fn arm(&self, on: &Expr, pattern: &str) -> String {
        match pattern {
            "_" => self.otherwise(),
            _ => self.when(&self.notation.typeset(&format!("{on} = {pattern}"))),
        }
    }

    fn table(&mut self, depth: usize, opening: &str, rows: &[Row], condition: &str) {
        let notation = self.notation;
        let values = |row: &Row| {
            let each: Vec<_> = row.values.iter().map(|one| notation.typeset(&one.to_string())).collect();
            each.join(comma(notation))
        };
        if let [row] = rows
            && row.keys.is_empty()
        {
            return self.push(depth, format!("{opening}{}{condition}", notation.group(&values(row))));
        }
        self.push(depth, format!("{}{condition}", opening.trim_end()));
        let shown = elided(
            rows.len(),
            16,
            |at| {
                let row = &rows[at];
                let keys: Vec<_> = row.keys.iter().map(|key| notation.label(&key.to_string())).collect();
                match keys.is_empty() {
                    true => values(row),
                    false => format!(
                        "{}{} {}",
                        keys.join(comma(notation)),
                        notation.choose(":", "\\colon\\ ", "<mo>:</mo>"),
                        values(row)
                    ),
                }
            },
            |others| text(notation, &format!("… {others} more rows …")),
        );
        shown.into_iter().for_each(|line| self.push(depth + 1, line));
    }

    /// A parameter: its range and its default.
    fn parameter(&mut self, parameter: &Parameter) {
        let notation = self.notation;
        let (blank, comma) = (super::space(notation), comma(notation));
        let name = |(name, spaces): &(crate::syntax::ast::Name, Vec<crate::syntax::ast::Space>)| {
            let base = notation.word(&name.text);
            match spaces.is_empty() {
                true => base,
                false => {
                    let over: Vec<_> = spaces.iter().map(|one| space(one, notation)).collect();
                    notation.element(&base, &over.join(comma))
                }
            }
        };
        let names: Vec<String> = parameter.names.iter().map(name).collect();
        let range = match parameter.kind.text.as_str() {
            "probability" => "[0, 1]".to_owned(),
            "real" => notation.choose("ℝ", "\\mathbb{R}", "<mi>ℝ</mi>").to_owned(),
            "integer" => notation.choose("ℤ", "\\mathbb{Z}", "<mi>ℤ</mi>").to_owned(),
            "size" => {
                notation.choose("{1, 2, …}", "\\{1,2,\\ldots\\}", "<mtext>{1, 2, …}</mtext>").to_owned()
            }
            other => notation.word(other),
        };
        let range = if range == "[0, 1]" {
            notation.choose("[0, 1]", "[0,1]", "<mtext>[0, 1]</mtext>").to_owned()
        } else {
            range
        };
        let mut line = format!(
            "{}{blank}{}",
            text(notation, "with"),
            notation.relation(&names.join(comma), "∈", &range)
        );
        if let Some(default) = &parameter.default {
            let words = text(notation, "by default");
            line = format!("{line}{comma}{}{blank}{words}", notation.typeset(&default.to_string()));
        }
        self.push(0, line);
    }
}

fn is_choice(argument: &Expr) -> bool {
    matches!(argument.kind, ExprKind::If(_) | ExprKind::Match(_))
}

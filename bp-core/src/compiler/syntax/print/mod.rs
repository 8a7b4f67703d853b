//! Tree to text, for `bp fmt`.
//!
//! In: a tree. Out: its text, four blanks to a level, one item to a line unless all fit. Invariant: the text parses to
//! an equal tree, comments included, and prints to itself.

mod forms;
mod words;

use crate::syntax::ast::*;
use std::fmt::{Display, Formatter, Result};
use words::list;

/// The maximum width of a line.
const WIDTH: usize = 100;

/// The output text.
#[derive(Default)]
struct Page {
    text: String,
    depth: usize,
}

impl Page {
    fn line(&mut self, words: &str) {
        if !words.is_empty() {
            self.text.push_str(&"    ".repeat(self.depth));
            self.text.push_str(words);
        }
        self.text.push('\n');
    }

    /// An item with its comments.
    fn item(&mut self, comments: &Comments, words: &str) {
        self.before(comments);
        self.line(&format!("{words}{}", after(comments)));
    }

    fn before(&mut self, comments: &Comments) {
        for comment in &comments.before {
            self.line(comment);
        }
    }

    fn fits(&self, words: &str) -> bool {
        !words.contains('\n') && self.depth * 4 + words.chars().count() <= WIDTH
    }

    fn deeper(&mut self, write: impl FnOnce(&mut Page)) {
        self.depth += 1;
        write(self);
        self.depth -= 1;
    }

    fn program(&mut self, program: &Program) {
        self.before(&program.comments);
        let plate = match &program.plate {
            Some(plate) => format!(" over {} in {}", plate.index, plate.set),
            None => String::new(),
        };
        self.line(&format!("program {}{plate} {{", program.name));
        self.deeper(|page| {
            program.sections.iter().for_each(|section| page.section(section));
            program.closing.iter().for_each(|comment| page.line(comment));
        });
        self.line(&format!("}}{}", after(&program.comments)));
    }

    fn section(&mut self, section: &Section) {
        self.before(&section.comments);
        let end = &End { closing: &section.closing, behind: after(&section.comments) };
        match &section.kind {
            SectionKind::Parameters(list) => {
                self.items("parameters", end, list, |item| (&item.comments, item.to_string()));
            }
            SectionKind::Variables(list) => {
                self.items("variables", end, list, |item| (&item.comments, item.to_string()));
            }
            SectionKind::Identification(list) => {
                self.items("identification", end, list, |item| (&item.comments, item.to_string()));
            }
            SectionKind::Question { name, asks } => {
                let last = asks.len().saturating_sub(1);
                let numbered: Vec<_> = asks.iter().enumerate().collect();
                self.items(&format!("question {name}"), end, &numbered, |(position, ask)| {
                    (&ask.comments, format!("{ask}{}", if *position == last { "" } else { ";" }))
                });
            }
            SectionKind::Decomposition(terms) => {
                let inline =
                    inline_terms(terms).map(|terms| format!("decomposition {{ {terms} }}{}", end.behind));
                match inline.filter(|line| end.closing.is_empty() && self.fits(line)) {
                    Some(line) => self.line(&line),
                    None => self.block("decomposition", end, |page| page.terms(terms)),
                }
            }
            SectionKind::Forms(definitions) => self.block("forms", end, |page| {
                definitions.iter().for_each(|definition| page.definition(definition));
            }),
        }
    }

    fn block(&mut self, title: &str, end: &End<'_>, write: impl FnOnce(&mut Page)) {
        self.line(&format!("{title} {{"));
        self.deeper(|page| {
            write(page);
            end.closing.iter().for_each(|comment| page.line(comment));
        });
        self.line(&format!("}}{}", end.behind));
    }

    /// A section of items: on one line if there is only one and it fits.
    fn items<T>(
        &mut self,
        title: &str,
        end: &End<'_>,
        items: &[T],
        show: impl Fn(&T) -> (&Comments, String),
    ) {
        if let [item] = items {
            let (comments, words) = show(item);
            let line = format!("{title} {{ {words} }}{}", end.behind);
            if *comments == Comments::default() && end.closing.is_empty() && self.fits(&line) {
                return self.line(&line);
            }
        }
        self.block(title, end, |page| {
            for item in items {
                let (comments, words) = show(item);
                page.item(comments, &words);
            }
        });
    }

    fn terms(&mut self, terms: &[Term]) {
        let mut line = String::new();
        for term in terms {
            let alone = inline_terms(std::slice::from_ref(term));
            match (alone, term) {
                (Some(words), _) if self.fits(&words) => {
                    let longer = if line.is_empty() { words.clone() } else { format!("{line} {words}") };
                    if self.fits(&longer) {
                        line = longer;
                        continue;
                    }
                    self.line(&std::mem::replace(&mut line, words));
                }
                (_, Term::Factor(factor)) => {
                    self.flush(&mut line);
                    self.item(&factor.comments, &factor.to_string());
                }
                (_, Term::Product(product)) => {
                    self.flush(&mut line);
                    self.before(&product.comments);
                    let end = End { closing: &[], behind: after(&product.comments) };
                    self.block(&head(product), &end, |page| page.terms(&product.terms));
                }
            }
        }
        self.flush(&mut line);
    }

    fn flush(&mut self, line: &mut String) {
        if !line.is_empty() {
            self.line(&std::mem::take(line));
        }
    }
}

/// The end of a block: the comments before its brace, and those after it.
struct End<'t> {
    closing: &'t [String],
    behind: String,
}

/// The comments after an item, with the blank that precedes them.
fn after(comments: &Comments) -> String {
    comments.after.iter().map(|comment| format!("  {comment}")).collect()
}

fn head(product: &Product) -> String {
    match &product.space {
        Some(space) => format!("prod({} in {space})", product.index),
        None => format!("prod({})", product.index),
    }
}

/// The terms on one line; `None` if there is a comment among them.
fn inline_terms(terms: &[Term]) -> Option<String> {
    let words: Option<Vec<String>> = terms
        .iter()
        .map(|term| match term {
            Term::Factor(factor) => (factor.comments == Comments::default()).then(|| factor.to_string()),
            Term::Product(product) if product.comments == Comments::default() => {
                Some(format!("{} {{ {} }}", head(product), inline_terms(&product.terms)?))
            }
            Term::Product(_) => None,
        })
        .collect();
    words.map(|words| words.join(" "))
}

impl Display for File {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        for (position, program) in self.programs.iter().enumerate() {
            if position > 0 {
                f.write_str("\n")?;
            }
            program.fmt(f)?;
        }
        self.closing.iter().try_for_each(|comment| writeln!(f, "{comment}"))
    }
}

impl Display for Program {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        let mut page = Page::default();
        page.program(self);
        f.write_str(&page.text)
    }
}

impl Display for Parameter {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        let names = self.names.iter().map(|(name, spaces)| match spaces.as_slice() {
            [] => name.to_string(),
            spaces => format!("{name}[{}]", list(spaces, ", ")),
        });
        write!(f, "{} : {}", names.collect::<Vec<_>>().join(", "), self.kind)?;
        match &self.default {
            Some(default) => write!(f, " = {default};"),
            None => f.write_str(";"),
        }
    }
}

impl Display for Declaration {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        write!(f, "{} : {};", list(&self.variables, ", "), self.domain)
    }
}

impl Display for Learnt {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        let Some(from) = &self.from else { return write!(f, "hidden {};", list(&self.names, ", ")) };
        write!(f, "{} from {from}", list(&self.names, ", "))?;
        match self.by.as_slice() {
            [] => f.write_str(";"),
            by => write!(f, " by {};", list(by, ", ")),
        }
    }
}

//! Attaches comments to the items that they describe.
//!
//! In: the text, and the tree without comments. Out: the tree with them. Invariant: no comment is lost; a comment after
//! an item on the same line belongs to that item, any other to the next item in the same braces; the remaining ones are
//! at the end of the section, the program or the file.

use crate::source::Span;
use crate::spelling::quoted_length;
use crate::syntax::ast::*;

/// The spans of all comments of a text, in order.
pub(super) fn find(text: &str) -> Vec<Span> {
    hidden(text).filter(|span| text[span.start..].starts_with('/')).collect()
}

/// The spans of all comments and quoted names, which are not scanned for punctuation.
pub(super) fn hidden(text: &str) -> impl Iterator<Item = Span> {
    let mut position = 0;
    std::iter::from_fn(move || {
        loop {
            let start = position + text[position..].find(['/', '"'])?;
            let rest = &text[start..];
            let length = if rest.starts_with("//") {
                Some(rest.find('\n').unwrap_or(rest.len()))
            } else if let Some(inner) = rest.strip_prefix("/*") {
                Some(inner.find("*/").map_or(rest.len(), |end| end + 4))
            } else {
                quoted_length(rest)
            };
            position = start + length.unwrap_or(1);
            if let Some(length) = length {
                return Some(Span::new(start, start + length));
            }
        }
    })
}

/// Attaches every comment of the text to an item of the file.
pub(super) fn attach(text: &str, file: &mut File) {
    let mut closing = Vec::new();
    let mut items: Vec<(Span, &mut Comments)> = Vec::new();
    let mut braces: Vec<(Span, &mut Vec<String>)> = Vec::new();
    for program in &mut file.programs {
        items.push((program.at.0, &mut program.comments));
        braces.push((program.at.0, &mut program.closing));
        for section in &mut program.sections {
            items.push((section.at.0, &mut section.comments));
            braces.push((section.at.0, &mut section.closing));
            of_section(&mut section.kind, &mut items);
        }
    }
    for span in find(text) {
        let words = text[span.start..span.end].trim_end().to_owned();
        let line = text[..span.start].rfind('\n').map_or(0, |newline| newline + 1);
        let ended =
            items.iter().enumerate().filter(|(_, (item, _))| item.end > line && item.end <= span.start);
        // The one that ends last; of those, the outermost.
        let behind =
            ended.max_by_key(|(index, (item, _))| (item.end, usize::MAX - index)).map(|(index, _)| index);
        if let Some(index) = behind {
            items[index].1.after.push(words);
            continue;
        }
        // The innermost braces around it, which come last.
        let around = braces.iter_mut().rfind(|(brace, _)| brace.start < span.start && span.end <= brace.end);
        let end = around.as_ref().map_or(usize::MAX, |(brace, _)| brace.end);
        let next = items.iter_mut().find(|(item, _)| item.start >= span.end && item.start < end);
        match (next, around) {
            (Some((_, comments)), _) => comments.before.push(words),
            (None, Some((_, closing))) => closing.push(words),
            (None, None) => closing.push(words),
        }
    }
    drop((items, braces));
    file.closing = closing;
}

fn of_section<'t>(kind: &'t mut SectionKind, items: &mut Vec<(Span, &'t mut Comments)>) {
    match kind {
        SectionKind::Parameters(list) => {
            items.extend(list.iter_mut().map(|item| (item.at.0, &mut item.comments)))
        }
        SectionKind::Variables(list) => {
            items.extend(list.iter_mut().map(|item| (item.at.0, &mut item.comments)))
        }
        SectionKind::Identification(list) => {
            items.extend(list.iter_mut().map(|item| (item.at.0, &mut item.comments)));
        }
        SectionKind::Question { asks, .. } => {
            items.extend(asks.iter_mut().map(|item| (item.at.0, &mut item.comments)));
        }
        SectionKind::Decomposition(terms) => of_terms(terms, items),
        SectionKind::Forms(list) => {
            for definition in list {
                items.push((definition.at.0, &mut definition.comments));
                of_form(&mut definition.form, items);
            }
        }
    }
}

fn of_terms<'t>(terms: &'t mut [Term], items: &mut Vec<(Span, &'t mut Comments)>) {
    for term in terms {
        match term {
            Term::Factor(factor) => items.push((factor.at.0, &mut factor.comments)),
            Term::Product(product) => {
                items.push((product.at.0, &mut product.comments));
                of_terms(&mut product.terms, items);
            }
        }
    }
}

fn of_form<'t>(form: &'t mut Form, items: &mut Vec<(Span, &'t mut Comments)>) {
    match &mut form.kind {
        FormKind::Table(rows) => items.extend(rows.iter_mut().map(|row| (row.at.0, &mut row.comments))),
        FormKind::Previous { otherwise: Some(body), .. } | FormKind::Let { body, .. } => of_form(body, items),
        FormKind::If(choice) => {
            choice.branches.iter_mut().for_each(|(_, body)| of_form(body, items));
            of_form(&mut choice.otherwise, items);
        }
        FormKind::Match(choice) => choice.arms.iter_mut().for_each(|(_, body)| of_form(body, items)),
        _ => {}
    }
}

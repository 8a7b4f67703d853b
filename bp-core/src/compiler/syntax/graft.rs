//! Inserts learned forms and parameters into the author's text.
//!
//! In: a file, and a program with only parameters and forms. Out: the file, in whose last program each `unknown` is
//! replaced by the form with the same head, in the order of the text, and each parameter has the given value.
//! Invariant: nothing else changes, comments included.

use super::ast::*;

/// Inserts parameters and forms of one program into the last program of a file.
pub fn graft(file: &mut File, learned: &Program) {
    let Some(program) = file.programs.last_mut() else { return };
    for section in &learned.sections {
        match &section.kind {
            SectionKind::Parameters(list) => list.iter().for_each(|parameter| give(program, parameter)),
            SectionKind::Forms(list) => list.iter().for_each(|definition| replace(program, definition)),
            _ => {}
        }
    }
}

/// What was learned, as it stands in the author's text: the parameters, and each form that had an `unknown`, once.
pub fn learned_part(file: &File, learned: &Program) -> Program {
    let mut part = learned.clone();
    let mut grafted = file.clone();
    let heads: Vec<String> = (file.programs.last().into_iter().flat_map(definitions))
        .filter(|definition| unknown(&mut definition.form.clone()).is_some())
        .map(|definition| definition.head.to_string())
        .collect();
    graft(&mut grafted, learned);
    let forms: Vec<Definition> = (grafted.programs.last().into_iter().flat_map(definitions))
        .filter(|definition| heads.contains(&definition.head.to_string()))
        .map(|definition| Definition { comments: Comments::default(), ..definition.clone() })
        .collect();
    for section in &mut part.sections {
        if let SectionKind::Forms(own) = &mut section.kind {
            own.clone_from(&forms);
        }
    }
    part
}

/// The forms of a program, in the order written.
fn definitions(program: &Program) -> impl Iterator<Item = &Definition> {
    program.sections.iter().flat_map(|section| match &section.kind {
        SectionKind::Forms(definitions) => definitions.as_slice(),
        _ => &[],
    })
}

/// Replaces the next `unknown` of a factor by a form.
fn replace(program: &mut Program, learned: &Definition) {
    let Some(left) = learned.head.left.first().map(Occurrence::to_string) else { return };
    for section in &mut program.sections {
        let SectionKind::Forms(definitions) = &mut section.kind else { continue };
        for definition in definitions {
            if definition.head.left.iter().any(|known| known.to_string() == left)
                && let Some(place) = unknown(&mut definition.form)
            {
                // A table of its own factor has its rows in the order of that factor.
                *place = learned.form.clone();
                return;
            }
        }
    }
}

/// The first `unknown` in a form, in the order written.
fn unknown(form: &mut Form) -> Option<&mut Form> {
    if matches!(&form.kind, FormKind::Named { name, .. } if name.text == "unknown") {
        return Some(form);
    }
    match &mut form.kind {
        FormKind::Let { body, .. } => unknown(body),
        FormKind::Previous { otherwise, .. } => otherwise.as_mut().and_then(|otherwise| unknown(otherwise)),
        FormKind::If(choice) => {
            let branches = choice.branches.iter_mut().map(|(_, body)| body);
            branches.chain([choice.otherwise.as_mut()]).find_map(unknown)
        }
        FormKind::Match(choice) => choice.arms.iter_mut().find_map(|(_, body)| unknown(body)),
        _ => None,
    }
}

/// Sets the value of a parameter, and declares it if necessary.
fn give(program: &mut Program, learned: &Parameter) {
    let Some((name, _)) = learned.names.first() else { return };
    let mut place = None;
    for (number, section) in program.sections.iter_mut().enumerate() {
        let SectionKind::Parameters(list) = &mut section.kind else { continue };
        let declared = list
            .iter()
            .position(|parameter| parameter.names.iter().any(|(known, _)| known.text == name.text));
        if let Some(position) = declared {
            if list[position].names.len() == 1 {
                list[position].default.clone_from(&learned.default);
                return;
            }
            // It was declared together with others, which keep their values.
            let mut own = learned.clone();
            list[position].names.retain(|(known, spaces)| {
                let same = known.text == name.text;
                if same {
                    own.names = vec![(known.clone(), spaces.clone())];
                }
                !same
            });
            own.kind = list[position].kind.clone();
            list.insert(position + 1, own);
            return;
        }
        place = place.or(Some(number));
    }
    let number = place.unwrap_or_else(|| {
        let section = Section {
            at: learned.at,
            comments: Comments::default(),
            kind: SectionKind::Parameters(Vec::new()),
            closing: Vec::new(),
        };
        program.sections.insert(0, section);
        0
    });
    if let SectionKind::Parameters(list) = &mut program.sections[number].kind {
        list.push(learned.clone());
    }
}

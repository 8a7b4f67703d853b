//! Questions to other programs: subroutines, and answers bound from outside.
//!
//! In: `ask(Paris.rain)`, `ask(Sensors[i].reading | O)`. Out: a form, and the [`Subroutine`] if the program is earlier
//! in the same file. Invariant: each known variable of the subroutine's question gets its value from a variable of the
//! same domain; the searched variable has the domain of the left-hand variable.

use super::Checker;
use super::expressions::Scope;
use super::forms::Target;
use super::names::{did_you_mean, listed};
use crate::diagnostic::Diagnostic;
use crate::ids::VariableId;
use crate::model::{Ask, Domain, Finding, Form, Model, Statistic, Subroutine};
use crate::syntax::ast::{self, Name, Segment};

impl Checker<'_> {
    pub(super) fn ask_form(
        &mut self,
        path: &[Segment],
        given: Option<&[ast::Occurrence]>,
        target: &Target,
        scope: &Scope,
    ) -> Option<Form> {
        let mut right = true;
        for index in path.iter().flat_map(|segment| &segment.index) {
            right &= self.expression(index, scope, None).is_some();
        }
        if let [only] = path {
            let message = format!(
                "`ask` takes a question of another program, and `{}` does not name a question",
                only.name
            );
            self.complain_and_help(only.name.span(), message, format!("write `ask({}.question)`", only.name));
            return None;
        }
        if let [program, question] = path
            && let Some(found) = self.earlier.iter().position(|model| model.name == program.name.text)
            && program.index.is_empty()
        {
            return right.then(|| self.subroutine(found, &question.name, given, target, scope)).flatten();
        }
        let given = match given {
            None => target.right.clone(),
            Some(written) => self.passed(written, scope)?,
        };
        let path: Vec<String> = path.iter().map(Segment::to_string).collect();
        right.then(|| Form::Ask { path: path.join("."), given })
    }

    /// The variables whose values are passed to another program.
    fn passed(&mut self, written: &[ast::Occurrence], scope: &Scope) -> Option<Vec<VariableId>> {
        let mut ids = Vec::new();
        let mut right = true;
        for occurrence in written {
            let id = self.variable_of(occurrence)?;
            if !scope.visible.contains(&id) {
                let message = format!("`{occurrence}` is not on the right of `{}`", scope.head);
                self.complain(occurrence.at.0, message);
                right = false;
            }
            ids.push(id);
        }
        right.then_some(ids)
    }

    /// A question of the program at this position among the earlier ones.
    fn subroutine(
        &mut self,
        found: usize,
        question: &Name,
        written: Option<&[ast::Occurrence]>,
        target: &Target,
        scope: &Scope,
    ) -> Option<Form> {
        let program = self.earlier[found].clone();
        let path = format!("{}.{question}", program.name);
        let ask = self.one_ask(&program, question)?;
        let [searched] = ask.searched.as_slice() else {
            let message = format!("`{path}` searches several variables; a form distributes one");
            let help = format!(
                "add a question about one of them to `{}`, and another for the others given it",
                program.name
            );
            self.complain_and_help(question.span(), message, help);
            return None;
        };
        if !self.same_values(&program, searched.variable, target.left, question, "distributes") {
            return None;
        }
        let wanted: Vec<VariableId> = ask.known.iter().map(|known| known.variable).collect();
        let names: Vec<String> = wanted.iter().map(|id| program.variable_name(*id)).collect();
        let given = match written {
            Some(written) => {
                let passed = self.passed(written, scope)?;
                if passed.len() != wanted.len() {
                    let expected = match names.is_empty() {
                        true => "nothing".to_owned(),
                        false => listed(names.iter().map(String::as_str), "and"),
                    };
                    let message =
                        format!("`{path}` must be given {expected}, found {} variables", passed.len());
                    let help = in_order(&path, &names);
                    self.complain_and_help(question.span(), message, help);
                    return None;
                }
                passed
            }
            None => {
                let mut passed = Vec::new();
                for name in &names {
                    let model = self.model.so_far();
                    let same = target.right.iter().find(|id| model.variable_name(**id) == *name);
                    let Some(id) = same else {
                        let message = format!(
                            "`{path}` must be given `{name}`, which is not on the right of `{}`",
                            scope.head
                        );
                        let help = in_order(&path, &names);
                        self.complain_and_help(question.span(), message, help);
                        return None;
                    };
                    passed.push(*id);
                }
                passed
            }
        };
        for (passed, wanted) in given.iter().zip(&wanted) {
            if !self.same_values(&program, *wanted, *passed, question, "is given") {
                return None;
            }
        }
        self.model.subroutine(Subroutine {
            path: path.clone(),
            program,
            question: question.text.clone(),
            table: Vec::new(),
        });
        Some(Form::Ask { path, given })
    }

    /// The single ask of a question, if it can be a form.
    fn one_ask(&mut self, program: &Model, question: &Name) -> Option<Ask> {
        let Some(asked) = program.question(&question.text) else {
            let known: Vec<&str> =
                program.questions.values().map(|question| question.name.as_str()).collect();
            let message = format!("`{}` has no question `{question}`", program.name);
            let mut wrong = Diagnostic::new(question.span(), message);
            wrong.help = did_you_mean(&question.text, known.iter().copied()).or_else(|| {
                (!known.is_empty()).then(|| format!("its questions are {}", listed(known, "and")))
            });
            self.wrong.push(wrong);
            return None;
        };
        let is_open = |ask: &Ask| ask.known.iter().all(|known| known.evidence == Finding::Each);
        match asked.asks.as_slice() {
            [ask]
                if ask.statistic == Statistic::Distribution
                    && !ask.when.is_over_time()
                    && is_open(ask)
                    && program.plate.is_none() =>
            {
                Some(ask.clone())
            }
            _ => {
                let path = format!("{}.{question}", program.name);
                let fixed = asked
                    .asks
                    .iter()
                    .flat_map(|ask| &ask.known)
                    .find(|known| known.evidence != Finding::Each);
                let why = match (asked.asks.as_slice(), fixed) {
                    ([_], Some(known)) => {
                        format!("`{path}` fixes the value of `{}`", program.variable_name(known.variable))
                    }
                    ([ask], _) if ask.when.is_over_time() => format!("`{path}` is asked over time"),
                    ([ask], _) if ask.statistic != Statistic::Distribution => {
                        format!("`{path}` asks for `{}`", ask.statistic.word())
                    }
                    ([_], _) => format!("`{}` is repeated over a plate", program.name),
                    (several, _) => format!("`{path}` asks for {} answers", several.len()),
                };
                let message = format!(
                    "{why}; a form takes one distribution, for all values of what it is given: `P(X | Y)`"
                );
                let help = format!("add a question `P(X | Y)` to `{}`", program.name);
                self.complain_and_help(question.span(), message, help);
                None
            }
        }
    }

    /// Whether a variable of another program and one of this have the same finite domain.
    fn same_values(
        &mut self,
        program: &Model,
        theirs: VariableId,
        ours: VariableId,
        at: &Name,
        what: &str,
    ) -> bool {
        let model = self.model.so_far();
        let (their_domain, our_domain) = (&program.variables[theirs].domain, &model.variables[ours].domain);
        let finite = their_domain.is_finite() && !matches!(their_domain, Domain::Set(_));
        if their_domain == our_domain && finite && program.variables[theirs].family.is_none() {
            return true;
        }
        let (name, text) = (program.variable_name(theirs), program.domain_text(their_domain));
        let (own, own_text) = (model.variable_name(ours), model.domain_text(our_domain));
        let message = match their_domain == our_domain {
            true => {
                format!("`{}.{at}` {what} `{name}`, whose values (`{text}`) cannot be listed", program.name)
            }
            false => {
                format!(
                    "`{}.{at}` {what} `{name}`, which is `{text}`, but `{own}` is `{own_text}`",
                    program.name
                )
            }
        };
        self.complain(at.span(), message);
        false
    }
}

/// How a question is given the variables of another program.
fn in_order(path: &str, names: &[String]) -> String {
    let wanted = listed(names.iter().map(String::as_str), "and");
    match names {
        [] => format!("write `ask({path})`"),
        [_] => format!("write `ask({path} | A)` with the variable `A` of this program that is its {wanted}"),
        _ => format!(
            "write `ask({path} | A B …)` with the variables of this program that are its {wanted}, in this order"
        ),
    }
}

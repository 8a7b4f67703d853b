//! The reader of UAI networks.
//!
//! In: a text. Out: a network, or the first mistake. Invariant: allocations are bounded by the length of the text.

use crate::diagnostic::{Diagnostic, Diagnostics};
use crate::ids::Id;
use crate::ids::VariableId;
use crate::io::draft::{Draft, Table};
use crate::io::lexer::{Dialect, Lexer, Token, number, probability, shortened, unexpected};
use crate::io::{Network, Warning};
use crate::model::{Finding, Known, Value};
use crate::source::{Source, Span};

pub(super) const UAI: Dialect = Dialect { signs: b"", percent: true, escapes: false };

/// Reads a network.
pub fn read(source: &Source) -> Result<Network, Diagnostics> {
    let mut reader = Reader {
        lexer: Lexer::new(&source.text, &UAI),
        draft: Draft::with_zero_rows(),
        most: source.text.len(),
        ln_scale: 0.0,
    };
    let count = reader.file()?;
    let (model, warnings) = reader.draft.model(Span::new(0, 0))?;
    let potentials = model.variables.len() - count;
    let known = (0..potentials)
        .map(|place| Known {
            variable: VariableId::new(count + place),
            evidence: Finding::Hard(Value::Ordinal(1)),
        })
        .collect();
    Ok(Network { model, known, ln_scale: reader.ln_scale, warnings })
}

struct Reader<'s> {
    lexer: Lexer<'s>,
    draft: Draft,
    /// Limit of the number of values of all variables together: the length of the text.
    most: usize,
    /// ln of the maxima of the potentials, and of the numbers of values of the variables, which are uniform.
    ln_scale: f64,
}

impl Reader<'_> {
    /// Returns the number of variables; the potentials follow them.
    fn file(&mut self) -> Result<usize, Diagnostic> {
        let (word, kind) = self.lexer.name("`BAYES` or `MARKOV`")?;
        let markov = match word.to_ascii_uppercase().as_str() {
            "BAYES" => false,
            "MARKOV" => true,
            _ => return Err(unexpected(kind, Token::Word(word), "`BAYES` or `MARKOV`")),
        };
        let (count, _) = self.whole("the number of variables")?;
        let (mut sizes, mut values) = (Vec::new(), 0usize);
        for variable in 0..count {
            let (size, span) = self.whole("how many values a variable has")?;
            values = values.saturating_add(size);
            if size == 0 || values > self.most {
                let message =
                    format!("variable {variable} has {size} values: none, or more than this file could hold");
                return Err(Diagnostic::new(span, message));
            }
            sizes.push(size);
            let states = (0..size).map(|state| state.to_string()).collect();
            self.draft.node(&variable.to_string(), span, states)?;
        }
        if markov {
            self.ln_scale += sizes.iter().map(|size| (*size as f64).ln()).sum::<f64>();
        }
        let (tables, span) = self.whole("the number of tables")?;
        if !markov && tables != count {
            let message = format!(
                "a Bayesian network of {count} variables has {count} tables, but {tables} are declared"
            );
            return Err(Diagnostic::new(span, message));
        }
        let mut scopes = Vec::new();
        for _ in 0..tables {
            let (length, mut span) = self.whole("how many variables a table has")?;
            if length == 0 && !markov {
                return Err(Diagnostic::new(span, "a table of a Bayesian network distributes a variable"));
            }
            let mut scope = Vec::new();
            for _ in 0..length {
                let (variable, at) = self.whole("the index of a variable")?;
                if variable >= count {
                    let message =
                        format!("unknown variable {variable}: they are 0 to {}", count.saturating_sub(1));
                    return Err(Diagnostic::new(at, message));
                }
                scope.push(variable);
                span = span.to(at);
            }
            scopes.push((scope, span));
        }
        if markov {
            for (variable, size) in sizes.into_iter().enumerate() {
                let table = Table { numbers: vec![1.0 / size as f64; size], places: Vec::new() };
                let span = self.draft.nodes[variable].span;
                self.draft.distribution(variable, Vec::new(), table, span)?;
            }
        }
        for (position, (mut scope, span)) in scopes.into_iter().enumerate() {
            match (markov, scope.pop()) {
                (false, Some(child)) => self.conditional(child, scope, span)?,
                (_, last) => self.potential(position, scope.into_iter().chain(last).collect(), span)?,
            }
        }
        match self.lexer.next()? {
            (Token::End, _) if !markov || tables == 0 => {}
            (Token::End, _) => {
                let message = format!(
                    "a Markov network: its {tables} potentials became variables that are observed to be true"
                );
                self.draft.warnings.push(Warning::new(kind, message));
            }
            (found, span) => return Err(unexpected(span, found, "the end of the file after the last table")),
        }
        Ok(count)
    }

    fn conditional(&mut self, child: usize, parents: Vec<usize>, span: Span) -> Result<(), Diagnostic> {
        let (rows, entries) = self.draft.shape(child, &parents, span)?;
        self.length(rows * entries)?;
        let (mut numbers, mut places) = (Vec::new(), Vec::new());
        for _ in 0..rows {
            let mut place: Option<Span> = None;
            for _ in 0..entries {
                let (word, at) = self.lexer.name("a probability")?;
                numbers.push(probability(word, at)?);
                place = Some(place.map_or(at, |place| place.to(at)));
            }
            places.extend(place);
        }
        self.draft.distribution(child, parents, Table { numbers, places }, span)
    }

    /// A potential: a variable that is true with probability φ / max φ.
    fn potential(&mut self, position: usize, scope: Vec<usize>, span: Span) -> Result<(), Diagnostic> {
        let states = vec!["false".to_owned(), "true".to_owned()];
        let node = self.draft.node(&format!("potential {position}"), span, states)?;
        let (rows, _) = self.draft.shape(node, &scope, span)?;
        self.length(rows)?;
        let mut numbers = Vec::new();
        for _ in 0..rows {
            let (word, at) = self.lexer.name("a number")?;
            match number(word) {
                Some(value) if value >= 0.0 => numbers.push(value),
                _ => {
                    let message =
                        format!("a potential is a number of at least 0, but this is `{}`", shortened(word));
                    return Err(Diagnostic::new(at, message));
                }
            }
        }
        let most = numbers.iter().copied().fold(0.0, f64::max);
        if most == 0.0 {
            return Err(Diagnostic::new(span, "this potential is 0 everywhere: nothing is possible"));
        }
        self.ln_scale += most.ln();
        let entries = numbers.iter().flat_map(|value| [1.0 - value / most, value / most]).collect();
        self.draft.distribution(node, scope, Table { numbers: entries, places: vec![span] }, span)
    }

    /// The declared length of a table.
    fn length(&mut self, expected: usize) -> Result<(), Diagnostic> {
        let (found, span) = self.whole("how many numbers the table has")?;
        match found == expected {
            true => Ok(()),
            false => Err(Diagnostic::new(
                span,
                format!("a table of {found} numbers is declared, but its variables have {expected}"),
            )),
        }
    }

    fn whole(&mut self, what: &str) -> Result<(usize, Span), Diagnostic> {
        let (word, span) = self.lexer.name(what)?;
        let number = word.parse().map_err(|_| unexpected(span, Token::Word(word), what))?;
        Ok((number, span))
    }
}

//! The reader of BIF.
//!
//! In: a text. Out: a model and warnings, or the first mistake. Invariant: one pass; a distribution that precedes the
//! declaration of its variables is read again at the end.

use crate::diagnostic::{Diagnostic, Diagnostics};
use crate::io::Warning;
use crate::io::draft::{Draft, Fastest, Table};
use crate::io::lexer::{Dialect, Lexer, Token, number, probability, shortened, unexpected};
use crate::model::Model;
use crate::source::{Source, Span};

const BIF: Dialect = Dialect { signs: b"{}()[];,|", percent: false, escapes: false };

/// Reads a network, with warnings about corrections.
pub fn read(source: &Source) -> Result<(Model, Vec<Warning>), Diagnostics> {
    let mut reader = Reader { lexer: Lexer::new(&source.text, &BIF), network: Draft::default() };
    reader.file()?;
    reader.network.model(Span::new(0, 0))
}

struct Reader<'s> {
    lexer: Lexer<'s>,
    network: Draft,
}

impl<'s> Reader<'s> {
    fn file(&mut self) -> Result<(), Diagnostic> {
        let mut waiting: Vec<Lexer<'s>> = Vec::new();
        loop {
            match self.lexer.next()? {
                (Token::End, _) => break,
                (Token::Word("network"), _) => self.heading()?,
                (Token::Word("variable"), _) => self.variable()?,
                (Token::Word("probability"), _) => {
                    let here = self.lexer.clone();
                    match self.head()? {
                        Some((node, parents, span)) => self.table(node, &parents, span)?,
                        None => {
                            waiting.push(here);
                            self.skip_block()?;
                        }
                    }
                }
                (Token::Word("property"), _) => self.lexer.skip_property(),
                (Token::Sign(b';'), _) => {}
                (found, span) => {
                    return Err(unexpected(span, found, "`network`, `variable` or `probability`"));
                }
            }
        }
        for lexer in waiting {
            self.lexer = lexer.clone();
            match self.head()? {
                Some((node, parents, span)) => self.table(node, &parents, span)?,
                None => {
                    self.lexer = lexer;
                    self.unknown_name()?;
                }
            }
        }
        Ok(())
    }

    /// `network name { property …; }`
    fn heading(&mut self) -> Result<(), Diagnostic> {
        let mut words = Vec::new();
        loop {
            match self.lexer.next()? {
                (Token::Word(word) | Token::Quoted(word), _) => words.push(word),
                (Token::Sign(b'{'), _) => break,
                (found, span) => return Err(unexpected(span, found, "`{` after the name of the network")),
            }
        }
        self.network.name = words.join(" ");
        loop {
            match self.lexer.next()? {
                (Token::Word("property"), _) => self.lexer.skip_property(),
                (Token::Sign(b';'), _) => {}
                (Token::Sign(b'}'), _) => return Ok(()),
                (found, span) => return Err(unexpected(span, found, "`property` or `}`")),
            }
        }
    }

    /// `variable name { type discrete [ 2 ] { a, b }; property …; }`
    fn variable(&mut self) -> Result<(), Diagnostic> {
        let (name, span) = self.lexer.name("the name of a variable")?;
        self.lexer.sign(b'{', "the name of the variable")?;
        let mut states = None;
        loop {
            match self.lexer.next()? {
                (Token::Word("type"), at) if states.is_none() => states = Some(self.states(name, at)?),
                (Token::Word("property"), _) => self.lexer.skip_property(),
                (Token::Sign(b';'), _) => {}
                (Token::Sign(b'}'), _) => break,
                (found, span) => return Err(unexpected(span, found, "`type`, `property` or `}`")),
            }
        }
        let Some(states) = states else {
            let message = format!("variable `{}` has no `type`", shortened(name));
            return Err(Diagnostic::new(span, message).with_help("write `type discrete [ 2 ] { yes, no };`"));
        };
        self.network.node(name, span, states)?;
        Ok(())
    }

    /// `discrete [ 2 ] { a, b }`
    fn states(&mut self, name: &str, at: Span) -> Result<Vec<String>, Diagnostic> {
        match self.lexer.next()? {
            (Token::Word("discrete"), _) => {}
            (found, span) => {
                return Err(unexpected(span, found, "`discrete`: a network has finite variables"));
            }
        }
        let mut count: Option<usize> = None;
        if self.lexer.takes(b'[')? {
            let (word, span) = self.lexer.name("how many values the variable has")?;
            count = Some(word.parse().map_err(|_| unexpected(span, Token::Word(word), "a whole number"))?);
            self.lexer.sign(b']', "the number of values")?;
        }
        self.lexer.sign(b'{', "the type")?;
        // Words without a comma between them are several names, or one name with blanks: the count decides.
        let (mut groups, mut words): (Vec<Vec<&str>>, usize) = (vec![Vec::new()], 0);
        let end = loop {
            match self.lexer.next()? {
                (Token::Word(word) | Token::Quoted(word), _) => {
                    words += 1;
                    groups.last_mut().expect("internal: there is a group").push(word);
                }
                (Token::Sign(b','), _) => groups.push(Vec::new()),
                (Token::Sign(b'}'), span) => break span,
                (found, span) => return Err(unexpected(span, found, "the name of a value, `,` or `}`")),
            }
        };
        groups.retain(|group| !group.is_empty());
        let found = if count == Some(groups.len()) { groups.len() } else { words };
        match count {
            Some(count) if count != found => Err(Diagnostic::new(
                at.to(end),
                format!(
                    "variable `{}` is declared with {count} values, but {found} are named",
                    shortened(name)
                ),
            )),
            _ if count == Some(groups.len()) => Ok(groups.iter().map(|group| group.join(" ")).collect()),
            _ => Ok(groups.concat().into_iter().map(str::to_owned).collect()),
        }
    }

    /// `( X | Y, Z )`; nothing if a name is not declared (yet).
    fn head(&mut self) -> Result<Option<(usize, Vec<usize>, Span)>, Diagnostic> {
        let mut span = self.lexer.sign(b'(', "`probability`")?;
        let (mut nodes, mut known) = (Vec::new(), true);
        loop {
            match self.lexer.next()? {
                (Token::Word(name) | Token::Quoted(name), _) => match self.network.find(name) {
                    Some(node) => nodes.push(node),
                    None => known = false,
                },
                (Token::Sign(b'|' | b','), _) => {}
                (Token::Sign(b')'), end) => {
                    span = span.to(end);
                    break;
                }
                (found, span) => return Err(unexpected(span, found, "the name of a variable or `)`")),
            }
        }
        if !known {
            return Ok(None);
        }
        if nodes.is_empty() {
            return Err(Diagnostic::new(span, "this distribution names no variable"));
        }
        let node = nodes.remove(0);
        Ok(Some((node, nodes, span)))
    }

    /// Reports the first unknown name of a head.
    fn unknown_name(&mut self) -> Result<(), Diagnostic> {
        loop {
            match self.lexer.next()? {
                (Token::Word(name) | Token::Quoted(name), span) => {
                    self.network.known(name, span)?;
                }
                (Token::Sign(b')') | Token::End, _) => return Ok(()),
                _ => {}
            }
        }
    }

    fn skip_block(&mut self) -> Result<(), Diagnostic> {
        self.lexer.sign(b'{', "the variables of the distribution")?;
        loop {
            match self.lexer.next()? {
                (Token::Sign(b'}'), _) => return Ok(()),
                (Token::End, span) => return Err(unexpected(span, Token::End, "`}`")),
                _ => {}
            }
        }
    }

    /// `{ table …; }`, or `{ (a, b) p, q; default p, q; }`
    fn table(&mut self, node: usize, parents: &[usize], span: Span) -> Result<(), Diagnostic> {
        let (rows, entries) = self.network.shape(node, parents, span)?;
        self.lexer.sign(b'{', "the variables of the distribution")?;
        let mut numbers: Vec<f64> = Vec::new();
        let mut places: Vec<Span> = Vec::new();
        let mut default: Option<Vec<f64>> = None;
        let mut whole = false;
        loop {
            match self.lexer.next()? {
                (Token::Word("table"), at) if !whole && numbers.is_empty() => {
                    let end = self.numbers(&mut numbers, rows * entries)?;
                    self.count(numbers.len(), rows * entries, at.to(end))?;
                    places = vec![at.to(end)];
                    if !parents.is_empty() {
                        numbers = self.network.by_rows(numbers, node, Fastest::Parents, at);
                    }
                    whole = true;
                }
                (Token::Word("default"), at) if default.is_none() => {
                    let mut row = Vec::new();
                    let end = self.numbers(&mut row, entries)?;
                    self.count(row.len(), entries, at.to(end))?;
                    default = Some(row);
                }
                (Token::Sign(b'('), at) if !whole => {
                    let row = self.key(parents, at)?;
                    // Most files list the rows in order: the table is not initialised.
                    let next = numbers.len() / entries;
                    let mut written = Vec::new();
                    let target = if row == next { &mut numbers } else { &mut written };
                    let before = target.len();
                    let end = Self::numbers_of(&mut self.lexer, target, entries)?;
                    let found = target.len() - before;
                    self.count(found, entries, at.to(end))?;
                    if places.len() <= row {
                        places.resize(row + 1, Span::default());
                    }
                    if places[row] != Span::default() {
                        let name = self.network.row_name(parents, row);
                        let message = format!("the row of {name} is written twice");
                        return Err(
                            Diagnostic::new(at.to(end), message).with_label(places[row], "first here")
                        );
                    }
                    places[row] = at.to(end);
                    if row != next {
                        if numbers.len() < (row + 1) * entries {
                            numbers.resize((row + 1) * entries, f64::NAN);
                        }
                        numbers[row * entries..(row + 1) * entries].copy_from_slice(&written);
                    }
                }
                (Token::Word("property"), _) => self.lexer.skip_property(),
                (Token::Sign(b';'), _) => {}
                (Token::Sign(b'}'), _) => break,
                (found, span) => {
                    return Err(unexpected(
                        span,
                        found,
                        "`table`, a row such as `(yes, no) 0.1, 0.9;`, or `}`",
                    ));
                }
            }
        }
        if !whole {
            numbers.resize(rows * entries, f64::NAN);
            places.resize(rows, Span::default());
            self.complete(&mut numbers, &mut places, default, parents, node, span)?;
        }
        self.network.distribution(node, parents.to_vec(), Table { numbers, places }, span)
    }

    /// `a, b)`: the index of a row.
    fn key(&mut self, parents: &[usize], at: Span) -> Result<usize, Diagnostic> {
        let (mut row, mut found) = (0, 0);
        loop {
            match self.lexer.next()? {
                (Token::Word(state) | Token::Quoted(state), span) => {
                    if let Some(parent) = parents.get(found) {
                        let ordinal = self.network.ordinal(*parent, state, span)?;
                        row = row * self.network.nodes[*parent].states.len() + ordinal;
                    }
                    found += 1;
                }
                (Token::Sign(b','), _) => {}
                (Token::Sign(b')'), _) if found == parents.len() => return Ok(row),
                (Token::Sign(b')'), span) => {
                    let count = parents.len();
                    let message =
                        format!("this row names {found} values: expected {count}, one for each parent");
                    return Err(Diagnostic::new(at.to(span), message));
                }
                (found, span) => return Err(unexpected(span, found, "the value of a parent or `)`")),
            }
        }
    }

    fn numbers(&mut self, numbers: &mut Vec<f64>, most: usize) -> Result<Span, Diagnostic> {
        Self::numbers_of(&mut self.lexer, numbers, most)
    }

    /// Numbers up to `;`, or up to the next token that is not a number. Returns the span of the last one.
    fn numbers_of(lexer: &mut Lexer<'s>, numbers: &mut Vec<f64>, most: usize) -> Result<Span, Diagnostic> {
        let (before, mut end) = (numbers.len(), Span::default());
        loop {
            match lexer.peek()? {
                (Token::Sign(b','), _) => {
                    lexer.next()?;
                }
                (Token::Sign(b';'), _) => {
                    lexer.next()?;
                    return Ok(end);
                }
                (Token::Word(word) | Token::Quoted(word), span) => {
                    // A row without `;` ends when it is complete.
                    if numbers.len() - before >= most && number(word).is_none() {
                        return Ok(end);
                    }
                    let read = probability(word, span)?;
                    lexer.next()?;
                    numbers.push(read);
                    end = span;
                }
                (Token::Sign(b'}' | b'('), _) => return Ok(end),
                (found, span) => return Err(unexpected(span, found, "a probability or `;`")),
            }
        }
    }

    fn count(&self, found: usize, expected: usize, span: Span) -> Result<(), Diagnostic> {
        if found == expected {
            return Ok(());
        }
        let what = if expected == 1 { "probability" } else { "probabilities" };
        Err(Diagnostic::new(span, format!("expected {expected} {what} here, found {found}")))
    }

    /// Fills missing rows with the default, or reports them.
    fn complete(
        &self,
        numbers: &mut [f64],
        places: &mut [Span],
        default: Option<Vec<f64>>,
        parents: &[usize],
        node: usize,
        span: Span,
    ) -> Result<(), Diagnostic> {
        let missing: Vec<usize> = (0..places.len()).filter(|row| places[*row] == Span::default()).collect();
        let entries = numbers.len() / places.len();
        let Some(default) = default else {
            if missing.is_empty() {
                return Ok(());
            }
            let name = shortened(&self.network.nodes[node].name);
            if parents.is_empty() {
                return Err(Diagnostic::new(span, format!("`{name}` has no `table`")));
            }
            let named: Vec<String> =
                missing.iter().take(3).map(|row| self.network.row_name(parents, *row)).collect();
            let more =
                if missing.len() > 3 { format!(" and {} more", missing.len() - 3) } else { String::new() };
            let message = format!("`{name}` has no row for {}{more}", named.join("; for "));
            return Err(Diagnostic::new(span, message).with_help("add the rows, or a `default`"));
        };
        for row in missing {
            numbers[row * entries..(row + 1) * entries].copy_from_slice(&default);
            places[row] = span;
        }
        Ok(())
    }
}

//! The names that a text declares, and where they stand.
//!
//! In: a tree, a text. Out: [`Symbol`]s, and the [`Word`]s of the text. Invariant: a name of one program is not visible in
//! another, except the names of programs.

use super::document::Document;
use bp_core::compiler::source::{Source, Span};
use bp_core::compiler::syntax::ast::{DomainKind, File, Program, SectionKind, Term};
use lsp_types::{DocumentSymbol, GotoDefinitionResponse, Location, SymbolKind, Uri};

/// What a name is of.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Kind {
    Program,
    Parameter,
    Variable,
    Index,
    Question,
    Label,
}

/// A declared name.
#[derive(Clone, Debug)]
pub(super) struct Symbol {
    pub(super) name: String,
    pub(super) kind: Kind,
    /// Where it is declared.
    pub(super) at: Span,
    /// The program in which it is visible.
    pub(super) within: Span,
    /// Its declaration, in the notation of the language.
    pub(super) declaration: String,
    /// Its documentation comments.
    pub(super) documentation: String,
    /// The forms of the factors that distribute it.
    pub(super) forms: Vec<String>,
}

/// The names that a file declares, in the order of the text.
pub(super) fn symbols(file: &File, source: &Source) -> Vec<Symbol> {
    let mut all = Vec::new();
    for program in &file.programs {
        of_program(program, source, &mut all);
    }
    all
}

fn of_program(program: &Program, source: &Source, all: &mut Vec<Symbol>) {
    let within = program.at.0;
    let mut add = |name: &str, kind, at: Span, within, declaration: String, documentation: String| {
        let forms = Vec::new();
        all.push(Symbol { name: name.to_owned(), kind, at, within, declaration, documentation, forms });
    };
    let whole = Span::new(0, source.text.len());
    let name = &program.name;
    let title = format!("program {}", name.text);
    add(&name.text, Kind::Program, name.span(), whole, title, program.comments.documentation());
    if let Some(plate) = &program.plate {
        let of = format!("{} in {}", plate.index.text, plate.set.text);
        add(&plate.index.text, Kind::Index, plate.index.span(), within, of, String::new());
    }
    let first = all.len();
    let mut add = |name: &str, kind, at: Span, declaration: String, documentation: String| {
        let forms = Vec::new();
        all.push(Symbol { name: name.to_owned(), kind, at, within, declaration, documentation, forms });
    };
    let mut forms = Vec::new();
    for section in &program.sections {
        match &section.kind {
            SectionKind::Parameters(parameters) => {
                for parameter in parameters {
                    let text = one_line(source.slice(parameter.at.0));
                    for (name, _) in &parameter.names {
                        let documentation = remarks(&parameter.comments);
                        add(&name.text, Kind::Parameter, name.span(), text.clone(), documentation);
                    }
                }
            }
            SectionKind::Variables(declarations) => {
                for declaration in declarations {
                    let domain = one_line(source.slice(declaration.domain.at.0));
                    for declared in declaration.variables.iter().filter(|declared| !declared.before) {
                        let own = one_line(source.slice(declared.at.0));
                        let text = format!("{own} : {domain}");
                        let documentation = remarks(&declaration.comments);
                        add(&declared.name.text, Kind::Variable, declared.name.span(), text, documentation);
                        if let Some(index) = declared.family.as_ref().and_then(|family| family.index.as_ref())
                        {
                            add(
                                &index.text,
                                Kind::Index,
                                index.span(),
                                format!("index of `{own}`"),
                                String::new(),
                            );
                        }
                    }
                    if let DomainKind::Labels(labels, _) = &declaration.domain.kind {
                        for label in labels {
                            let of = format!("a value of {domain}");
                            add(&label.text, Kind::Label, label.span(), of, String::new());
                        }
                    }
                }
            }
            SectionKind::Decomposition(terms) => {
                for index in terms.iter().flat_map(indices) {
                    add(&index.0, Kind::Index, index.1, one_line(&index.2), String::new());
                }
            }
            SectionKind::Forms(definitions) => {
                for definition in definitions {
                    let left = definition.head.left.iter().map(|one| one.name.text.clone());
                    forms.push((left.collect::<Vec<_>>(), one_line(source.slice(definition.at.0))));
                }
            }
            SectionKind::Identification(_) => {}
            SectionKind::Question { name, .. } => {
                let text = one_line(source.slice(section.at.0));
                add(&name.text, Kind::Question, name.span(), text, section.comments.documentation());
            }
        }
    }
    for symbol in &mut all[first..] {
        if symbol.kind == Kind::Variable {
            let own = forms.iter().filter(|(left, _)| left.contains(&symbol.name));
            symbol.forms = own.map(|(_, form)| form.clone()).collect();
        }
    }
}

/// The indices of the products of a term: name, span, text.
fn indices(term: &Term) -> Vec<(String, Span, String)> {
    let Term::Product(product) = term else { return Vec::new() };
    let own = (
        product.index.text.clone(),
        product.index.span(),
        format!("index of a product: {}", product.index.text),
    );
    std::iter::once(own).chain(product.terms.iter().flat_map(indices)).collect()
}

/// The comments of an item, as its documentation.
fn remarks(comments: &bp_core::compiler::syntax::ast::Comments) -> String {
    let after = comments.after.iter().map(|line| line.trim_start_matches('/').trim().to_owned());
    let mut all = vec![comments.documentation()];
    all.extend(after);
    all.retain(|line| !line.is_empty());
    all.join("\n")
}

fn one_line(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// A name in the text.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Word {
    pub(super) span: Span,
    /// The name, without quotation marks.
    pub(super) name: String,
    /// Whether it follows a point: a part of another program.
    pub(super) is_part: bool,
}

/// The names of a text, in order; comments have none.
pub(super) fn names(text: &str) -> Vec<Word> {
    let is_letter = |character: char| character.is_alphanumeric() || character == '_';
    let (mut found, mut at) = (Vec::new(), 0);
    let mut last = ' ';
    while let Some(character) = text[at..].chars().next() {
        let rest = &text[at..];
        let length = if rest.starts_with("//") {
            rest.find('\n').unwrap_or(rest.len())
        } else if rest.starts_with("/*") {
            rest.find("*/").map_or(rest.len(), |end| end + 2)
        } else if character == '"' {
            let inner = quoted(rest);
            let name = rest[1..inner].replace("\\\"", "\"");
            found.push(Word { span: Span::new(at, at + inner + 1), name, is_part: last == '.' });
            inner + 1
        } else if is_letter(character) {
            let length = rest.find(|character| !is_letter(character)).unwrap_or(rest.len());
            if !character.is_ascii_digit() {
                let name = rest[..length].to_owned();
                found.push(Word { span: Span::new(at, at + length), name, is_part: last == '.' });
            }
            length
        } else {
            character.len_utf8()
        };
        if !character.is_whitespace() {
            last = text[..at + length].chars().next_back().unwrap_or(' ');
        }
        at += length;
    }
    found
}

/// The offset of the closing quotation mark, or of the last character.
fn quoted(text: &str) -> usize {
    let mut escaped = false;
    for (at, character) in text.char_indices().skip(1) {
        match character {
            '"' if !escaped => return at,
            '\\' => escaped = !escaped,
            _ => escaped = false,
        }
    }
    text.char_indices().next_back().map_or(1, |(at, _)| at.max(1))
}

impl Document {
    /// The name at an offset, or one that ends there.
    pub(super) fn word(&self, offset: usize) -> Option<Word> {
        let mut at = names(&self.source.text).into_iter();
        at.find(|word| word.span.start <= offset && offset <= word.span.end)
    }

    /// The symbol that a name means.
    pub(super) fn symbol(&self, word: &Word) -> Option<&Symbol> {
        let visible = |symbol: &&Symbol| {
            symbol.name == word.name
                && symbol.within.start <= word.span.start
                && word.span.end <= symbol.within.end
                && (!word.is_part || symbol.kind == Kind::Question)
        };
        let declared = |symbol: &&Symbol| symbol.at == word.span;
        let mut all = self.symbols.iter().filter(visible);
        all.clone().find(declared).or_else(|| all.next())
    }

    /// Where the name at an offset is declared.
    pub(super) fn definition(&self, uri: &Uri, offset: usize) -> Option<GotoDefinitionResponse> {
        self.tree.as_ref()?;
        let symbol = self.symbol(&self.word(offset)?)?;
        let location = Location { uri: uri.clone(), range: self.range(symbol.at) };
        Some(GotoDefinitionResponse::Scalar(location))
    }

    /// Where the name at an offset stands in its program.
    pub(super) fn references(&self, uri: &Uri, offset: usize) -> Vec<Location> {
        let uses = self.uses(offset).map(|(_, uses)| uses).unwrap_or_default();
        uses.iter().map(|word| Location { uri: uri.clone(), range: self.range(word.span) }).collect()
    }

    /// The symbol of the name at an offset, and all its uses.
    pub(super) fn uses(&self, offset: usize) -> Option<(&Symbol, Vec<Word>)> {
        self.tree.as_ref()?;
        let symbol = self.symbol(&self.word(offset)?)?;
        let same = |word: &Word| self.symbol(word).is_some_and(|other| other.at == symbol.at);
        Some((symbol, names(&self.source.text).into_iter().filter(same).collect()))
    }

    /// What the document declares, as an outline.
    #[allow(deprecated)] // A field of the protocol that is replaced by `tags` must still be filled.
    pub(super) fn outline(&self) -> Vec<DocumentSymbol> {
        let one = |symbol: &Symbol| DocumentSymbol {
            name: symbol.name.clone(),
            detail: Some(symbol.declaration.clone()),
            kind: match symbol.kind {
                Kind::Program => SymbolKind::MODULE,
                Kind::Parameter => SymbolKind::CONSTANT,
                Kind::Variable => SymbolKind::VARIABLE,
                Kind::Index => SymbolKind::KEY,
                Kind::Question => SymbolKind::FUNCTION,
                Kind::Label => SymbolKind::ENUM_MEMBER,
            },
            tags: None,
            deprecated: None,
            range: self.range(symbol.at),
            selection_range: self.range(symbol.at),
            children: None,
        };
        self.symbols.iter().filter(|symbol| symbol.kind != Kind::Label).map(one).collect()
    }
}

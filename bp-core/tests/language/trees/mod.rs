//! Random trees, of every kind of node.
//!
//! In: proptest's random source. Out: files with correct syntax and no meaning. Invariant: an operand that is an
//! operator's expression is in brackets.

use bp_core::compiler::syntax::ast::*;
use proptest::prelude::*;

fn name_text() -> impl Strategy<Value = String> {
    let bare = ["A", "Rain", "sigma_a", "x1", "first", "_k", "over", "by", "Tau"];
    let quoted = ["Asy/Patch", "<5", "two words", "true", "P", "a//b", "(", "say \"so\\", "_"];
    prop::sample::select([bare, quoted].concat()).prop_map(str::to_owned)
}

fn name() -> impl Strategy<Value = Name> {
    name_text().prop_map(|text| Name { at: At::default(), text })
}

fn names() -> impl Strategy<Value = Vec<Name>> {
    prop::collection::vec(name(), 1..4)
}

fn number() -> impl Strategy<Value = String> {
    prop::sample::select(vec!["0", "1", "42", "0.5", "1e-3", "2.50"]).prop_map(str::to_owned)
}

fn sign() -> impl Strategy<Value = Sign> {
    prop::sample::select(vec![Sign::None, Sign::Plus, Sign::Minus])
}

fn bound() -> impl Strategy<Value = Bound> {
    prop_oneof![
        (sign(), number()).prop_map(|offset| Bound { at: At::default(), name: None, offset: Some(offset) }),
        (name(), prop::option::of((prop::sample::select(vec![Sign::Plus, Sign::Minus]), number())))
            .prop_map(|(name, offset)| Bound { at: At::default(), name: Some(name), offset }),
    ]
}

fn range() -> impl Strategy<Value = Range> {
    (bound(), bound()).prop_map(|(low, high)| Range { at: At::default(), low, high })
}

fn space() -> impl Strategy<Value = Space> {
    prop_oneof![name().prop_map(Space::Set), range().prop_map(Space::Range)]
}

fn value() -> impl Strategy<Value = Value> {
    let leaf = prop_oneof![
        (sign(), number()).prop_map(|(sign, number)| ValueKind::Number(sign, number)),
        any::<bool>().prop_map(ValueKind::Boolean),
        name().prop_map(ValueKind::Name),
    ]
    .prop_map(|kind| Value { at: At::default(), kind });
    leaf.prop_recursive(2, 6, 3, |value| {
        prop::collection::vec(value, 0..3)
            .prop_map(|values| Value { at: At::default(), kind: ValueKind::List(values) })
    })
}

fn occurrence() -> impl Strategy<Value = Occurrence> {
    let index = prop::collection::vec(name().prop_map(|name| expr_of(ExprKind::Name(name))), 0..2);
    (name(), index, any::<bool>()).prop_map(|(name, index, before)| Occurrence {
        at: At::default(),
        name,
        index,
        before,
    })
}

fn occurrences() -> impl Strategy<Value = Vec<Occurrence>> {
    prop::collection::vec(occurrence(), 1..4)
}

fn expr_of(kind: ExprKind) -> Expr {
    Expr { at: At::default(), kind }
}

/// An operand: in brackets if it is an operator's expression.
fn operand(inner: Expr) -> Box<Expr> {
    let bare = !matches!(inner.kind, ExprKind::Unary(..) | ExprKind::Binary(..));
    Box::new(if bare { inner } else { expr_of(ExprKind::Group(Box::new(inner))) })
}

fn pattern() -> impl Strategy<Value = Pattern> {
    prop_oneof![
        Just(PatternKind::Any),
        value().prop_map(PatternKind::Value),
        (value(), value()).prop_map(|(low, high)| PatternKind::Range(low, high)),
    ]
    .prop_map(|kind| Pattern { at: At::default(), kind })
}

fn expr() -> impl Strategy<Value = Expr> {
    let leaf = prop_oneof![
        number().prop_map(ExprKind::Number),
        any::<bool>().prop_map(ExprKind::Boolean),
        name().prop_map(ExprKind::Name),
    ]
    .prop_map(expr_of);
    leaf.prop_recursive(4, 24, 3, |inner| {
        let some = prop::collection::vec(inner.clone(), 0..3);
        let many = prop::collection::vec(inner.clone(), 1..3);
        let unary = prop::sample::select(vec![UnaryOp::Minus, UnaryOp::Not]);
        let binary = prop::sample::select(BinaryOp::ALL.to_vec());
        let branches = prop::collection::vec((inner.clone(), inner.clone()), 1..3);
        let arms = prop::collection::vec((pattern(), inner.clone()), 0..3);
        prop_oneof![
            (name(), some.clone()).prop_map(|(name, arguments)| ExprKind::Call(name, arguments)),
            (inner.clone(), many).prop_map(|(of, index)| ExprKind::Index(operand(of), index)),
            inner.clone().prop_map(|of| ExprKind::Before(operand(of))),
            (inner.clone(), name()).prop_map(|(of, name)| ExprKind::Field(operand(of), name)),
            (inner.clone(), occurrences(), prop::collection::vec(occurrence(), 0..3))
                .prop_map(|(of, searched, known)| ExprKind::Answer { of: operand(of), searched, known }),
            (name(), any::<bool>(), occurrence(), inner.clone()).prop_map(|(name, before, with, index)| {
                // `first` searches a whole family: it takes no index.
                let family = Occurrence { at: At::default(), name, index: Vec::new(), before };
                ExprKind::First { family, with, index: Box::new(index) }
            }),
            (unary, inner.clone()).prop_map(|(op, of)| ExprKind::Unary(op, operand(of))),
            (binary, inner.clone(), inner.clone()).prop_map(|(op, left, right)| ExprKind::Binary(
                op,
                operand(left),
                operand(right)
            )),
            inner.clone().prop_map(|of| ExprKind::Group(Box::new(of))),
            some.prop_map(ExprKind::Vector),
            (branches, inner.clone())
                .prop_map(|(branches, last)| ExprKind::If(If { branches, otherwise: Box::new(last) })),
            (inner, arms).prop_map(|(on, arms)| ExprKind::Match(Match { on: Box::new(on), arms })),
        ]
        .prop_map(expr_of)
    })
}

fn comments() -> impl Strategy<Value = Comments> {
    let before = prop::collection::vec(prop::sample::select(vec!["// one", "/// two", "/* three */"]), 0..2);
    let after = prop::option::weighted(0.2, Just("// behind".to_owned()));
    prop_oneof![
        3 => Just(Comments::default()),
        1 => (before, after).prop_map(|(before, after)| Comments {
            before: before.into_iter().map(str::to_owned).collect(),
            after: after.into_iter().collect(),
        }),
    ]
}

fn form_of(kind: FormKind) -> Form {
    Form { at: At::default(), kind }
}

fn form() -> impl Strategy<Value = Form> {
    let row = (comments(), prop::collection::vec(value(), 0..3), prop::collection::vec(expr(), 1..3))
        .prop_map(|(comments, keys, values)| Row { at: At::default(), comments, keys, values });
    let segment =
        (name(), prop::collection::vec(expr(), 0..2)).prop_map(|(name, index)| Segment { name, index });
    let named =
        (name(), prop::option::of(prop::collection::vec(expr(), 0..3)), prop::collection::vec(name(), 0..2))
            .prop_map(|(name, arguments, by)| FormKind::Named { name, arguments, by });
    let leaf = prop_oneof![
        named,
        prop::collection::vec(row, 0..3).prop_map(FormKind::Table),
        (prop::collection::vec(segment, 1..3), prop::option::of(occurrences()))
            .prop_map(|(path, given)| FormKind::Ask { path, given }),
    ]
    .prop_map(form_of)
    .boxed();
    let otherwise = prop::option::of(leaf.clone().prop_map(Box::new));
    let previous =
        (occurrence(), prop::option::of(expr()), otherwise).prop_map(|(variable, of, otherwise)| {
            form_of(FormKind::Previous { variable: Box::new(variable), of: of.map(Box::new), otherwise })
        });
    prop_oneof![leaf, previous].prop_recursive(2, 6, 2, |inner| {
        let branches = prop::collection::vec((expr(), inner.clone()), 1..3);
        let arms = prop::collection::vec((pattern(), inner.clone()), 0..3);
        prop_oneof![
            (name(), expr(), inner.clone()).prop_map(|(name, value, body)| FormKind::Let {
                name,
                value: Box::new(value),
                body: Box::new(body)
            }),
            (branches, inner)
                .prop_map(|(branches, last)| FormKind::If(If { branches, otherwise: Box::new(last) })),
            (expr(), arms).prop_map(|(on, arms)| FormKind::Match(Match { on: Box::new(on), arms })),
        ]
        .prop_map(form_of)
    })
}

fn factor(comments: Comments) -> impl Strategy<Value = Factor> {
    (any::<bool>(), occurrences(), prop::collection::vec(occurrence(), 0..3)).prop_map(
        move |(initial, left, right)| Factor {
            initial,
            at: At::default(),
            comments: comments.clone(),
            left,
            right,
        },
    )
}

fn term() -> impl Strategy<Value = Term> {
    let leaf = comments().prop_flat_map(factor).prop_map(Term::Factor);
    leaf.prop_recursive(2, 6, 3, |term| {
        (comments(), name(), prop::option::of(space()), prop::collection::vec(term, 0..3)).prop_map(
            |(comments, index, space, terms)| {
                Term::Product(Box::new(Product { at: At::default(), comments, index, space, terms }))
            },
        )
    })
}

fn section() -> impl Strategy<Value = Section> {
    let indexed = prop::collection::vec((name(), prop::collection::vec(space(), 0..3)), 1..3);
    let parameter = (comments(), indexed, name(), prop::option::of(expr())).prop_map(
        |(comments, names, kind, default)| Parameter { at: At::default(), comments, names, kind, default },
    );
    let family = (prop::option::of(name()), space(), prop::option::of(name()))
        .prop_map(|(index, space, except)| Family { at: At::default(), index, space, except });
    let declared = (name(), prop::option::of(family), any::<bool>())
        .prop_map(|(name, family, before)| Declared { at: At::default(), name, family, before });
    let domain = prop_oneof![
        name().prop_map(DomainKind::Named),
        (name(), prop::collection::vec(expr(), 1..3))
            .prop_map(|(name, numbers)| DomainKind::Listed(name, numbers)),
        (name(), prop::collection::vec(expr(), 0..4))
            .prop_map(|(name, numbers)| DomainKind::Divided(name, numbers)),
        range().prop_map(DomainKind::Range),
        (names(), prop::option::of(range())).prop_map(|(labels, range)| DomainKind::Labels(labels, range)),
    ]
    .prop_map(|kind| Domain { at: At::default(), kind });
    let declaration = (comments(), prop::collection::vec(declared, 1..3), domain).prop_map(
        |(comments, variables, domain)| Declaration { at: At::default(), comments, variables, domain },
    );
    let definition = (comments(), factor(Comments::default()), form())
        .prop_map(|(comments, head, form)| Definition { at: At::default(), comments, head, form });
    let source = prop::option::of((name(), prop::collection::vec(name(), 0..2)));
    let learnt = (comments(), names(), source).prop_map(|(comments, names, source)| {
        // A hidden variable has no source.
        let (from, by) = source.map_or((None, Vec::new()), |(from, by)| (Some(from), by));
        Learnt { at: At::default(), comments, names, from, by }
    });
    let evidence = prop_oneof![
        value().prop_map(Finding::Hard),
        prop::collection::vec(expr(), 1..3).prop_map(Finding::Virtual),
        prop::collection::vec(expr(), 1..3).prop_map(Finding::Soft),
    ];
    let item = (occurrence(), prop::option::of(evidence)).prop_map(|(variable, evidence)| Item {
        at: At::default(),
        subject: Subject::Variable(variable),
        evidence,
    });
    let items = prop::collection::vec(item, 0..3).boxed();
    let distribution = (items.clone(), items)
        .prop_map(|(searched, known)| Distribution { at: At::default(), searched, known })
        .boxed();
    let amounts = prop::collection::vec(number().prop_map(|number| (At::default(), number)), 0..3);
    let word = (name(), amounts).prop_map(|(name, amounts)| Word { at: At::default(), name, amounts });
    let words = prop::collection::vec(word, 0..3).boxed();
    let from = (words.clone(), distribution.clone())
        .prop_map(|(words, distribution)| Second { words, distribution });
    let ask = (comments(), words, distribution, prop::option::of(from), prop::option::of(name())).prop_map(
        |(comments, words, distribution, from, nearest)| Ask {
            at: At::default(),
            comments,
            words,
            distribution,
            from,
            nearest,
        },
    );
    let kind = prop_oneof![
        prop::collection::vec(parameter, 0..3).prop_map(SectionKind::Parameters),
        prop::collection::vec(declaration, 0..3).prop_map(SectionKind::Variables),
        prop::collection::vec(term(), 0..4).prop_map(SectionKind::Decomposition),
        prop::collection::vec(definition, 0..3).prop_map(SectionKind::Forms),
        prop::collection::vec(learnt, 0..2).prop_map(SectionKind::Identification),
        (name(), prop::collection::vec(ask, 1..3))
            .prop_map(|(name, asks)| SectionKind::Question { name, asks }),
    ];
    (comments(), kind, closing()).prop_map(|(comments, kind, closing)| Section {
        at: At::default(),
        comments,
        kind,
        closing,
    })
}

fn closing() -> impl Strategy<Value = Vec<String>> {
    prop_oneof![4 => Just(Vec::new()), 1 => Just(vec!["// closing".to_owned()])]
}

/// A file of one or two programs.
pub(crate) fn file() -> impl Strategy<Value = File> {
    let plate = prop::option::of((name(), name()).prop_map(|(index, set)| Plate { index, set }));
    let program = (comments(), name(), plate, prop::collection::vec(section(), 0..4), closing()).prop_map(
        |(comments, name, plate, sections, closing)| Program {
            at: At::default(),
            comments,
            name,
            plate,
            sections,
            closing,
        },
    );
    (prop::collection::vec(program, 1..3), closing())
        .prop_map(|(programs, closing)| File { programs, closing })
}

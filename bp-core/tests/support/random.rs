//! Random discrete programs, written as text.
//!
//! In: a tape of bytes. Out: a program and questions to it. Invariant: the same tape gives the same program, and a
//! shorter tape a simpler one, so that failures can be shrunk.

use std::fmt::Write;

/// Choices, read from a tape; 0 once it has run out.
pub(crate) struct Tape<'t> {
    bytes: &'t [u8],
    next: usize,
}

impl<'t> Tape<'t> {
    pub(crate) fn new(bytes: &'t [u8]) -> Self {
        Self { bytes, next: 0 }
    }

    /// A number below `many`.
    pub(crate) fn below(&mut self, many: usize) -> usize {
        let byte = self.bytes.get(self.next).copied().unwrap_or(0);
        self.next += 1;
        byte as usize % many
    }

    fn one_in(&mut self, many: usize) -> bool {
        self.below(many) == many - 1
    }
}

#[derive(Clone, PartialEq)]
enum Kind {
    Bool,
    Labels(usize),
    Range(i64, i64),
    LabelledRange(i64),
}

impl Kind {
    fn count(&self) -> usize {
        match self {
            Kind::Bool => 2,
            Kind::Labels(count) => *count,
            Kind::Range(low, high) => (high - low + 1) as usize,
            Kind::LabelledRange(high) => *high as usize + 1,
        }
    }

    fn domain(&self) -> String {
        match self {
            Kind::Bool => "bool".to_owned(),
            Kind::Labels(count) => format!("{{ {} }}", ["low", "middle", "high"][..*count].join(", ")),
            Kind::Range(low, high) => format!("{low}..={high}"),
            Kind::LabelledRange(high) => format!("{{ Nothing }} or 1..={high}"),
        }
    }

    fn value(&self, ordinal: usize) -> String {
        match self {
            Kind::Bool => ["false", "true"][ordinal].to_owned(),
            Kind::Labels(_) => ["low", "middle", "high"][ordinal].to_owned(),
            Kind::Range(low, _) => (low + ordinal as i64).to_string(),
            Kind::LabelledRange(_) if ordinal == 0 => "Nothing".to_owned(),
            Kind::LabelledRange(_) => ordinal.to_string(),
        }
    }
}

/// A program under construction.
pub(crate) struct Random {
    kinds: Vec<Kind>,
    text: String,
}

fn probability(tape: &mut Tape<'_>) -> f64 {
    [0.25, 0.5, 0.75, 0.1, 0.9, 0.05, 0.625, 1.0, 0.0][tape.below(9)]
}

fn row(tape: &mut Tape<'_>, count: usize) -> String {
    let mut weights: Vec<f64> = (0..count).map(|_| tape.below(8) as f64).collect();
    if weights.iter().all(|weight| *weight == 0.0) {
        weights[0] = 1.0;
    }
    let total: f64 = weights.iter().sum();
    weights.iter().map(|weight| (weight / total).to_string()).collect::<Vec<_>>().join(", ")
}

impl Random {
    /// A program of 2 to 6 variables.
    pub(crate) fn program(tape: &mut Tape<'_>) -> Self {
        let count = 2 + tape.below(5);
        let mut made = Self { kinds: Vec::new(), text: String::new() };
        let (mut variables, mut decomposition, mut forms) = (String::new(), String::new(), String::new());
        for number in 0..count {
            let kind = match tape.below(6) {
                0 | 1 => Kind::Bool,
                2 => Kind::Labels(2 + tape.below(2)),
                3 | 4 => {
                    let low = tape.below(4) as i64 - 2;
                    Kind::Range(low, low + 1 + tape.below(3) as i64)
                }
                _ => Kind::LabelledRange(1 + tape.below(3) as i64),
            };
            let mut parents: Vec<usize> = Vec::new();
            for parent in (0..number).rev() {
                if parents.len() < 3 && tape.below(2) == 1 {
                    parents.push(parent);
                }
            }
            writeln!(variables, "V{number} : {};", kind.domain()).unwrap();
            made.kinds.push(kind.clone());
            let names: Vec<String> = parents.iter().map(|parent| format!("V{parent}")).collect();
            let head = match names.is_empty() {
                true => format!("P(V{number})"),
                false => format!("P(V{number} | {})", names.join(" ")),
            };
            write!(decomposition, "{head} ").unwrap();
            let form = made.form(tape, &kind, &parents, 2);
            writeln!(forms, "{head} = {form};").unwrap();
        }
        made.text = format!(
            "program Random {{ variables {{ {variables} }} decomposition {{ {decomposition} }} forms {{ {forms} }} }}"
        );
        made
    }

    pub(crate) fn text(&self) -> &str {
        &self.text
    }

    fn form(&self, tape: &mut Tape<'_>, kind: &Kind, parents: &[usize], depth: usize) -> String {
        match tape.below(8) {
            0 => "uniform".to_owned(),
            1 => format!("categorical({})", row(tape, kind.count())),
            2 | 3 if depth == 2 => {
                let rows: usize = parents.iter().map(|parent| self.kinds[*parent].count()).product();
                let rows: Vec<String> = (0..rows).map(|_| row(tape, kind.count())).collect();
                format!("table {{ {}; }}", rows.join("; "))
            }
            4 if depth > 0 => {
                let condition = self.truth(tape, parents, 1);
                let then = self.form(tape, kind, parents, depth - 1 - depth / 2);
                let otherwise = self.form(tape, kind, parents, depth - 1 - depth / 2);
                format!("if {condition} {{ {then} }} else {{ {otherwise} }}")
            }
            _ => match kind {
                Kind::Bool if tape.below(2) == 0 => format!("dirac({})", self.truth(tape, parents, 2)),
                Kind::Bool => {
                    let condition = self.truth(tape, parents, 1);
                    format!(
                        "bernoulli(if {condition} {{ {} }} else {{ {} }})",
                        probability(tape),
                        probability(tape)
                    )
                }
                Kind::Range(..) if tape.below(3) == 0 => {
                    format!("normal({}, {})", self.integer(tape, parents, 1), 0.5 + tape.below(3) as f64)
                }
                Kind::Range(..) | Kind::LabelledRange(_) => {
                    format!("dirac({})", self.integer(tape, parents, 2))
                }
                Kind::Labels(_) => format!("categorical({})", row(tape, kind.count())),
            },
        }
    }

    fn pick(&self, tape: &mut Tape<'_>, parents: &[usize], fits: impl Fn(&Kind) -> bool) -> Option<usize> {
        let fit: Vec<usize> = parents.iter().copied().filter(|parent| fits(&self.kinds[*parent])).collect();
        (!fit.is_empty()).then(|| fit[tape.below(fit.len())])
    }

    /// A truth value.
    fn truth(&self, tape: &mut Tape<'_>, parents: &[usize], depth: usize) -> String {
        match tape.below(6) {
            0 | 1 => match self.pick(tape, parents, |kind| *kind == Kind::Bool) {
                Some(parent) => format!("V{parent}"),
                None => "true".to_owned(),
            },
            2 => match self.pick(tape, parents, |kind| matches!(kind, Kind::Labels(_))) {
                Some(parent) => {
                    let ordinal = tape.below(self.kinds[parent].count());
                    format!("match V{parent} {{ {} => true, _ => false }}", self.kinds[parent].value(ordinal))
                }
                None => "false".to_owned(),
            },
            3 if depth > 0 => format!("not ({})", self.truth(tape, parents, depth - 1)),
            4 if depth > 0 => {
                let operator = ["and", "or"][tape.below(2)];
                let (left, right) =
                    (self.truth(tape, parents, depth - 1), self.truth(tape, parents, depth - 1));
                format!("(({left}) {operator} ({right}))")
            }
            _ => {
                let operator = ["<", "<=", "==", "!=", ">", ">="][tape.below(6)];
                format!("({} {operator} {})", self.integer(tape, parents, 1), self.integer(tape, parents, 1))
            }
        }
    }

    /// An integer.
    fn integer(&self, tape: &mut Tape<'_>, parents: &[usize], depth: usize) -> String {
        match tape.below(6) {
            0..3 => match self
                .pick(tape, parents, |kind| matches!(kind, Kind::Range(..) | Kind::LabelledRange(_)))
            {
                Some(parent) => format!("V{parent}"),
                None => (tape.below(4) as i64 - 1).to_string(),
            },
            3 if depth > 0 => {
                let operator = ["+", "-", "*"][tape.below(3)];
                format!(
                    "({} {operator} {})",
                    self.integer(tape, parents, depth - 1),
                    self.integer(tape, parents, depth - 1)
                )
            }
            4 if depth > 0 => {
                let condition = self.truth(tape, parents, 0);
                let (then, otherwise) =
                    (self.integer(tape, parents, depth - 1), self.integer(tape, parents, depth - 1));
                format!("(if {condition} {{ {then} }} else {{ {otherwise} }})")
            }
            _ => (tape.below(4) as i64 - 1).to_string(),
        }
    }

    /// A random ask: `each` allows known variables without a value, `soft` virtual evidence.
    pub(crate) fn ask(&self, tape: &mut Tape<'_>, each: bool, reductions: bool) -> String {
        let (mut searched, mut known) = (Vec::new(), Vec::new());
        let first = tape.below(self.kinds.len());
        for (number, kind) in self.kinds.iter().enumerate() {
            let value = |tape: &mut Tape<'_>| kind.value(tape.below(kind.count()));
            let role = if number == first { 0 } else { tape.below(8) };
            match role {
                0 | 1 if tape.one_in(5) => searched.push(format!("V{number} = {}", value(tape))),
                0 | 1 => searched.push(format!("V{number}")),
                2 => known.push(format!("V{number} = {}", value(tape))),
                3 if each => known.push(format!("V{number}")),
                3 | 4 => {
                    let mut weights: Vec<String> =
                        (0..kind.count()).map(|_| tape.below(4).to_string()).collect();
                    weights[0] = "0.5".to_owned();
                    known.push(format!("V{number} virtual [{}]", weights.join(", ")));
                }
                _ => {}
            }
        }
        let reduction = if reductions && tape.one_in(4) { "entropy " } else { "" };
        match known.is_empty() {
            true => format!("{reduction}P({})", searched.join(", ")),
            false => format!("{reduction}P({} | {})", searched.join(", "), known.join(", ")),
        }
    }
}

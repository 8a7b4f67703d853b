//! Random programs over time, against the enumeration of every history.
//!
//! In: programs with zeros in start laws, transitions and observations; one chain or several; labels, numbers, bins and
//! booleans; families; Diracs; reals; likelihoods; missing observations. Out: nothing where filter, predict, smooth,
//! sequence and ln P agree. Invariant: the enumerator has its own tables and multiplies them history by history; it shares
//! nothing with the library but the text of the program that it writes.

mod support;

use bp_core::answer::{Answer, ask_over_time};
use bp_core::error::Error;
use bp_core::exec::Inputs;
use bp_core::model::Model;
use bp_core::sample::Sampling;
use std::collections::HashMap;
use std::fmt::Write;
use support::{model_of, question};

/// Numbers at random (Steele, Lea and Flood 2014).
struct Dice(u64);

impl Dice {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    fn below(&mut self, many: usize) -> usize {
        ((self.next() >> 11) % many as u64) as usize
    }

    fn unit(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1u64 << 53) as f64
    }

    fn chance(&mut self, p: f64) -> bool {
        self.unit() < p
    }
}

#[derive(Clone, Copy, PartialEq)]
enum Kind {
    Bool,
    Labels,
    Range(i64),
    Bins,
}

const LABELS: [&str; 3] = ["low", "middle", "high"];

/// Where a value is looked up: of this instant, or of the one before.
#[derive(Clone, Copy, PartialEq)]
enum Place {
    Now(usize),
    Before(usize),
}

/// A finite variable of an instant, or one element of a family.
struct Slot {
    name: String,
    kind: Kind,
    count: usize,
    carried: bool,
    known: bool,
}

/// What distributes a slot, or a real.
enum Form {
    /// A row for each combination of the parents, the last one fastest.
    Table(Vec<f64>),
    /// This ordinal; none where it falls outside.
    Dirac(Vec<Option<usize>>),
}

struct Factor {
    slot: usize,
    parents: Vec<Place>,
    form: Form,
}

/// A real: mean and deviation for each combination of the parents.
struct Real {
    name: &'static str,
    parents: Vec<Place>,
    laws: Vec<[f64; 2]>,
}

/// A program as tables, and its text.
#[derive(Default)]
struct World {
    slots: Vec<Slot>,
    start: Vec<Factor>,
    factors: Vec<Factor>,
    reals: Vec<Real>,
    /// A likelihood of a slot at each instant.
    likelihood: Option<(usize, Vec<f64>)>,
    text: String,
}

impl World {
    fn place_name(&self, place: Place) -> String {
        match place {
            Place::Now(slot) => self.slots[slot].name.clone(),
            Place::Before(slot) => format!("{}^-1", self.slots[slot].name),
        }
    }

    fn of(&self, place: Place) -> &Slot {
        let (Place::Now(slot) | Place::Before(slot)) = place;
        &self.slots[slot]
    }

    fn rows(&self, parents: &[Place]) -> usize {
        parents.iter().map(|place| self.of(*place).count).product()
    }

    /// A number that depends on the parents, as an expression.
    fn choice(&self, parents: &[Place], values: &[String]) -> String {
        let Some((first, rest)) = parents.split_first() else { return values[0].clone() };
        let (slot, name) = (self.of(*first), self.place_name(*first));
        let chunks: Vec<String> =
            values.chunks(values.len() / slot.count).map(|part| self.choice(rest, part)).collect();
        if slot.kind == Kind::Labels {
            let arms: Vec<String> =
                chunks.iter().zip(LABELS).map(|(part, label)| format!("{label} => {part}")).collect();
            return format!("match {name} {{ {} }}", arms.join(", "));
        }
        let mut text = chunks[slot.count - 1].clone();
        for value in (0..slot.count - 1).rev() {
            let condition = match slot.kind {
                Kind::Bool => format!("not {name}"),
                Kind::Range(low) => format!("{name} == {}", low + value as i64),
                _ => format!("{name} < {}", value + 1),
            };
            text = format!("if {condition} {{ {} }} else {{ {text} }}", chunks[value]);
        }
        text
    }

    fn head(&self, left: &str, parents: &[Place]) -> String {
        let names: Vec<String> = parents.iter().map(|place| self.place_name(*place)).collect();
        match names.is_empty() {
            true => format!("P({left})"),
            false => format!("P({left} | {})", names.join(" ")),
        }
    }

    /// P(slot | parents) of a factor.
    fn p(&self, factor: &Factor, now: &[usize], before: &[usize]) -> f64 {
        let row = self.row(&factor.parents, now, before);
        let value = match factor.parents.iter().any(|place| matches!(place, Place::Now(_))) || !now.is_empty()
        {
            true => now[factor.slot],
            false => before[factor.slot],
        };
        match &factor.form {
            Form::Table(cells) => cells[row * self.slots[factor.slot].count + value],
            Form::Dirac(values) => f64::from(u8::from(values[row] == Some(value))),
        }
    }

    fn row(&self, parents: &[Place], now: &[usize], before: &[usize]) -> usize {
        parents.iter().fold(0, |row, place| {
            let value = match place {
                Place::Now(slot) => now[*slot],
                Place::Before(slot) => before[*slot],
            };
            row * self.of(*place).count + value
        })
    }
}

/// A row of probabilities, with zeros.
fn row(dice: &mut Dice, count: usize, zeros: f64) -> Vec<f64> {
    let mut weights: Vec<f64> =
        (0..count).map(|_| if dice.chance(zeros) { 0.0 } else { 1.0 + dice.below(8) as f64 }).collect();
    if weights.iter().all(|weight| *weight == 0.0) {
        weights[dice.below(count)] = 1.0;
    }
    let total: f64 = weights.iter().sum();
    weights.iter().map(|weight| weight / total).collect()
}

fn table(dice: &mut Dice, rows: usize, count: usize, zeros: f64) -> Vec<f64> {
    (0..rows).flat_map(|_| row(dice, count, zeros)).collect()
}

fn some(dice: &mut Dice, from: &[Place], most: usize) -> Vec<Place> {
    let mut parents: Vec<Place> = Vec::new();
    for _ in 0..dice.below(most + 1) {
        let place = from[dice.below(from.len())];
        if !parents.contains(&place) {
            parents.push(place);
        }
    }
    parents
}

fn written(cells: &[f64], count: usize) -> String {
    let rows: Vec<String> = (cells.chunks(count))
        .map(|row| row.iter().map(f64::to_string).collect::<Vec<_>>().join(", "))
        .collect();
    format!("table {{ {} }}", rows.join("; "))
}

/// A program at random.
fn world(dice: &mut Dice) -> World {
    let mut world = World::default();
    let (mut variables, mut decomposition, mut forms) = (String::new(), String::new(), String::new());
    let zeros = [0.0, 0.3, 0.5][dice.below(3)];
    let sure = dice.chance(0.5);
    let add = |world: &mut World, dice: &mut Dice, name: String, carried: bool, known: bool| {
        let kind =
            [Kind::Bool, Kind::Labels, Kind::Range(dice.below(4) as i64 - 2), Kind::Bins][dice.below(4)];
        let count = if kind == Kind::Bool { 2 } else { 2 + dice.below(2) };
        world.slots.push(Slot { name, kind, count, carried, known });
        world.slots.len() - 1
    };
    let declare = |world: &World, slot: usize| {
        let Slot { name, kind, count, carried, .. } = &world.slots[slot];
        let domain = match kind {
            Kind::Bool => "bool".to_owned(),
            Kind::Labels => format!("{{ {} }}", LABELS[..*count].join(", ")),
            Kind::Range(low) => format!("{low}..={}", low + *count as i64 - 1),
            Kind::Bins => format!("bins(0, {count}, {count})"),
        };
        let before = if *carried { format!(", {name}^-1") } else { String::new() };
        format!("{name}{before} : {domain}; ")
    };
    // Chains.
    for number in 0..1 + dice.below(3) {
        let known = dice.chance(0.1);
        let slot = add(&mut world, dice, format!("X{number}"), true, known);
        variables.push_str(&declare(&world, slot));
        let earlier: Vec<Place> = (0..slot).map(Place::Before).collect();
        let parents = if earlier.is_empty() { Vec::new() } else { some(dice, &earlier, 1) };
        let (rows, count) = (world.rows(&parents), world.slots[slot].count);
        let cells = match sure {
            true => {
                let one = dice.below(count);
                (0..rows * count).map(|cell| f64::from(u8::from(cell % count == one))).collect()
            }
            false => table(dice, rows, count, 0.5),
        };
        let head = world.head(&format!("X{number}^-1"), &parents);
        write!(decomposition, "{head} ").unwrap();
        writeln!(forms, "{head} = previous(X{number}) else {};", written(&cells, count)).unwrap();
        world.start.push(Factor { slot, parents, form: Form::Table(cells) });
    }
    let chains = world.slots.len();
    let before: Vec<Place> = (0..chains).map(Place::Before).collect();
    let mut factor = |world: &mut World, dice: &mut Dice, slot: usize, parents: Vec<Place>, zeros: f64| {
        let (rows, count) = (world.rows(&parents), world.slots[slot].count);
        let cells = table(dice, rows, count, zeros);
        let head = world.head(&world.slots[slot].name, &parents);
        write!(decomposition, "{head} ").unwrap();
        writeln!(forms, "{head} = {};", written(&cells, count)).unwrap();
        world.factors.push(Factor { slot, parents, form: Form::Table(cells) });
    };
    for slot in 0..chains {
        let mut from: Vec<Place> = before.clone();
        from.extend((0..slot).map(Place::Now));
        let mut parents = some(dice, &from, 1);
        if !parents.contains(&Place::Before(slot)) && dice.chance(0.9) {
            parents.push(Place::Before(slot));
        }
        factor(&mut world, dice, slot, parents, zeros);
    }
    // Hidden variables of an instant, then observed ones.
    for (name, many, known) in [("H", dice.below(2), false), ("Z", 1 + dice.below(2), true)] {
        for number in 0..many {
            let mut from: Vec<Place> = (0..world.slots.len()).map(Place::Now).collect();
            from.extend(&before);
            let parents = some(dice, &from, 2);
            let slot = add(&mut world, dice, format!("{name}{number}"), false, known);
            variables.push_str(&declare(&world, slot));
            factor(&mut world, dice, slot, parents, zeros);
        }
    }
    // A Dirac, whose value may fall outside its domain.
    let numbers: Vec<usize> =
        (0..world.slots.len()).filter(|slot| matches!(world.slots[*slot].kind, Kind::Range(_))).collect();
    if numbers.len() > 1 && dice.chance(0.5) {
        let (one, other) = (numbers[0], numbers[1]);
        let (Kind::Range(low), Kind::Range(second)) = (world.slots[one].kind, world.slots[other].kind) else {
            unreachable!()
        };
        let (from, count, known) = (low + second, 2 + dice.below(3), dice.chance(0.5));
        world.slots.push(Slot {
            name: "D".to_owned(),
            kind: Kind::Range(from),
            count,
            carried: false,
            known,
        });
        let (slot, parents) = (world.slots.len() - 1, vec![Place::Now(one), Place::Now(other)]);
        variables.push_str(&declare(&world, slot));
        let head = world.head("D", &parents);
        write!(decomposition, "{head} ").unwrap();
        writeln!(forms, "{head} = dirac({} + {});", world.slots[one].name, world.slots[other].name).unwrap();
        let inner = world.slots[other].count;
        let sum = |row: usize| Some(row / inner + row % inner).filter(|sum| *sum < count);
        let values = (0..world.rows(&parents)).map(sum).collect();
        world.factors.push(Factor { slot, parents, form: Form::Dirac(values) });
    }
    // A family, each element with its own law.
    if dice.chance(0.5) {
        let (known, parents) = (dice.chance(0.6), some(dice, &[Place::Now(0), Place::Now(chains - 1)], 1));
        let rows = world.rows(&parents);
        let cells: Vec<[f64; 2]> = (0..2 * rows)
            .map(|_| {
                let row = row(dice, 2, zeros);
                [row[0], row[1]]
            })
            .collect();
        variables.push_str("F[1..=2] : bool; ");
        let head = world.head("F[i]", &parents);
        write!(decomposition, "prod(i) {{ {head} }} ").unwrap();
        let chosen = |element: usize| {
            let values: Vec<String> =
                cells[element * rows..(element + 1) * rows].iter().map(|row| row[1].to_string()).collect();
            world.choice(&parents, &values)
        };
        let (one, other) = (chosen(0), chosen(1));
        writeln!(forms, "{head} = bernoulli(if i == 1 {{ {one} }} else {{ {other} }});").unwrap();
        for element in 0..2 {
            let name = format!("F[{}]", element + 1);
            world.slots.push(Slot { name, kind: Kind::Bool, count: 2, carried: false, known });
            let form = Form::Table(cells[element * rows..(element + 1) * rows].concat());
            world.factors.push(Factor { slot: world.slots.len() - 1, parents: parents.clone(), form });
        }
        if !known {
            // A hidden family matters through what depends on its elements.
            let slot = world.slots.len();
            let rows: Vec<String> = (0..4).map(|_| row(dice, 2, zeros)[1].to_string()).collect();
            let elements = [Place::Now(slot - 2), Place::Now(slot - 1)];
            world.slots.push(Slot {
                name: "W".to_owned(),
                kind: Kind::Bool,
                count: 2,
                carried: false,
                known: true,
            });
            variables.push_str("W : bool; ");
            decomposition.push_str("P(W | F) ");
            writeln!(forms, "P(W | F) = bernoulli({});", world.choice(&elements, &rows)).unwrap();
            let one = |p: &String| {
                let p: f64 = p.parse().unwrap();
                [1.0 - p, p]
            };
            let cells = rows.iter().flat_map(one).collect();
            world.factors.push(Factor { slot, parents: elements.to_vec(), form: Form::Table(cells) });
        }
    }
    // Reals: one that is seen, perhaps through one that a Dirac says.
    if dice.chance(0.5) {
        let from: Vec<Place> = (0..world.slots.len())
            .filter(|slot| !world.slots[*slot].name.contains('['))
            .map(Place::Now)
            .collect();
        let parents = some(dice, &from, 2);
        let laws: Vec<[f64; 2]> = (0..world.rows(&parents))
            .map(|_| [dice.below(9) as f64 - 4.0, 0.5 + dice.below(3) as f64 / 2.0])
            .collect();
        let of = |part: usize| {
            let values: Vec<String> = laws.iter().map(|law| law[part].to_string()).collect();
            world.choice(&parents, &values)
        };
        let (mean, deviation) = (of(0), of(1));
        let (head, seen) = (world.head("Y", &parents), dice.chance(0.5));
        if seen && !parents.is_empty() {
            variables.push_str("R, Y : real; ");
            let names: Vec<String> = parents.iter().map(|place| world.place_name(*place)).collect();
            let names = names.join(" ");
            write!(decomposition, "P(R | {names}) P(Y | R {names}) ").unwrap();
            writeln!(forms, "P(R | {names}) = dirac({mean}); P(Y | R {names}) = normal(R, {deviation});")
                .unwrap();
        } else {
            variables.push_str("Y : real; ");
            write!(decomposition, "{head} ").unwrap();
            writeln!(forms, "{head} = normal({mean}, {deviation});").unwrap();
        }
        world.reals.push(Real { name: "Y", parents, laws });
    }
    let hidden: Vec<usize> = (0..world.slots.len())
        .filter(|slot| !world.slots[*slot].known && !world.slots[*slot].name.contains('['))
        .collect();
    if dice.chance(0.2) && hidden.len() > 1 {
        let slot = hidden[dice.below(hidden.len())];
        let weights = (0..world.slots[slot].count).map(|_| dice.below(4) as f64 * 0.3).collect::<Vec<_>>();
        if weights.iter().any(|weight| *weight > 0.0) {
            world.likelihood = Some((slot, weights));
        }
    }
    world.text = format!(
        "program World {{ variables {{ {variables}}}\n decomposition {{ {decomposition}}}\n forms {{ {forms}}} }}"
    );
    world
}

/// What was observed at an instant: slots, then reals; NaN where nothing was.
type Row = Vec<f64>;

impl World {
    fn bell(&self, real: &Real, value: f64, now: &[usize], before: &[usize]) -> f64 {
        let [mean, deviation] = real.laws[self.row(&real.parents, now, before)];
        let standard = (value - mean) / deviation;
        (-0.5 * standard * standard).exp() / (deviation * std::f64::consts::TAU.sqrt())
    }

    /// A history of this length that can be, if any is found.
    fn history(&self, dice: &mut Dice, length: usize) -> Option<Vec<Row>> {
        let draw = |dice: &mut Dice, factor: &Factor, row: usize| match &factor.form {
            Form::Table(cells) => {
                let count = self.slots[factor.slot].count;
                let (mut rest, mut value) = (dice.unit(), None);
                for (ordinal, p) in cells[row * count..(row + 1) * count].iter().enumerate() {
                    if *p > 0.0 && rest >= 0.0 {
                        value = Some(ordinal);
                    }
                    rest -= p;
                }
                value
            }
            Form::Dirac(values) => values[row],
        };
        let mut before = vec![0; self.slots.len()];
        for factor in &self.start {
            before[factor.slot] = draw(dice, factor, self.row(&factor.parents, &[], &before))?;
        }
        let mut rows = Vec::new();
        for _ in 0..length {
            let mut now = vec![0; self.slots.len()];
            for factor in &self.factors {
                now[factor.slot] = draw(dice, factor, self.row(&factor.parents, &now, &before))?;
            }
            let mut row: Row = (self.slots.iter().zip(&now))
                .map(|(slot, value)| if slot.known && dice.chance(0.65) { *value as f64 } else { f64::NAN })
                .collect();
            for real in &self.reals {
                let [mean, deviation] = real.laws[self.row(&real.parents, &now, &before)];
                let value = mean + deviation * (dice.unit() * 4.0 - 2.0);
                row.push(if dice.chance(0.7) { value } else { f64::NAN });
            }
            if dice.chance(0.15) {
                row.fill(f64::NAN);
            }
            rows.push(row);
            before = now;
        }
        Some(rows)
    }

    /// Calls `visit(history, its weight)` for every history that is not impossible; the first of a history is what was
    /// before the first instant.
    fn each_history(&self, rows: &[Row], ahead: usize, visit: &mut dyn FnMut(&[Vec<usize>], f64)) {
        let mut history = vec![vec![0; self.slots.len()]];
        self.begin(rows, ahead, 0, 1.0, &mut history, visit);
    }

    fn begin(
        &self,
        rows: &[Row],
        ahead: usize,
        number: usize,
        weight: f64,
        history: &mut Vec<Vec<usize>>,
        visit: &mut dyn FnMut(&[Vec<usize>], f64),
    ) {
        let Some(factor) = self.start.get(number) else {
            history.push(vec![0; self.slots.len()]);
            self.go_on(rows, ahead, 0, weight, history, visit);
            history.pop();
            return;
        };
        for value in 0..self.slots[factor.slot].count {
            history[0][factor.slot] = value;
            let p = self.p(factor, &[], &history[0]);
            if p > 0.0 {
                self.begin(rows, ahead, number + 1, weight * p, history, visit);
            }
        }
    }

    fn go_on(
        &self,
        rows: &[Row],
        ahead: usize,
        number: usize,
        weight: f64,
        history: &mut Vec<Vec<usize>>,
        visit: &mut dyn FnMut(&[Vec<usize>], f64),
    ) {
        let instant = history.len() - 2;
        let Some(factor) = self.factors.get(number) else {
            let (now, before) = (&history[instant + 1], &history[instant]);
            let mut weight = weight;
            if let Some(row) = rows.get(instant) {
                for (real, value) in self.reals.iter().zip(&row[self.slots.len()..]) {
                    weight *= if value.is_nan() { 1.0 } else { self.bell(real, *value, now, before) };
                }
                if let Some((slot, weights)) = &self.likelihood {
                    weight *= weights[now[*slot]];
                }
            }
            if weight == 0.0 {
                return;
            }
            if instant + 1 == rows.len() + ahead {
                visit(history, weight);
                return;
            }
            history.push(vec![0; self.slots.len()]);
            self.go_on(rows, ahead, 0, weight, history, visit);
            history.pop();
            return;
        };
        let seen = rows.get(instant).map_or(f64::NAN, |row| row[factor.slot]);
        for value in 0..self.slots[factor.slot].count {
            if !seen.is_nan() && seen != value as f64 {
                continue;
            }
            history[instant + 1][factor.slot] = value;
            let p = self.p(factor, &history[instant + 1], &history[instant]);
            if p > 0.0 {
                self.go_on(rows, ahead, number + 1, weight * p, history, visit);
            }
        }
    }

    /// What is asked of some slots, searched by their variables' names.
    fn asked(&self, word: &str, searched: &[usize]) -> String {
        let mut names: Vec<&str> = Vec::new();
        for slot in searched {
            let name = self.slots[*slot].name.split('[').next().unwrap();
            if !names.contains(&name) {
                names.push(name);
            }
        }
        let mut known: Vec<String> = Vec::new();
        for slot in self.slots.iter().filter(|slot| slot.known) {
            let name = slot.name.split('[').next().unwrap().to_owned();
            if !known.contains(&name) {
                known.push(name);
            }
        }
        known.extend(self.reals.iter().map(|real| real.name.to_owned()));
        if let Some((slot, weights)) = &self.likelihood {
            known.push(format!("{} virtual {weights:?}", self.slots[*slot].name));
        }
        let bar = if known.is_empty() { "" } else { " | " };
        format!("{word} P({}{bar}{})", names.join(" "), known.join(", "))
    }

    fn answered(&self, model: &Model, text: &str, rows: &[Row]) -> Result<Answer, Error> {
        let names: Vec<&str> = (self.slots.iter().map(|slot| slot.name.as_str()))
            .chain(self.reals.iter().map(|real| real.name))
            .collect();
        let observed = |row: &Row| {
            let cells = names.iter().zip(row).filter(|(_, value)| !value.is_nan());
            cells.map(|(name, value)| ((*name).to_owned(), *value)).collect::<Vec<_>>()
        };
        let rows: Vec<_> = rows.iter().map(observed).collect();
        let answers =
            ask_over_time(model, &question(model, text), &rows, &Inputs::new(), Sampling::default());
        answers.map(|mut answers| answers.remove(0))
    }

    fn ordinal(&self, searched: &[usize], values: &[usize]) -> usize {
        searched.iter().fold(0, |at, slot| at * self.slots[*slot].count + values[*slot])
    }
}

/// Tolerance of a probability.
const NEAR: f64 = 1e-10;

#[track_caller]
fn near(context: &str, found: &[f64], expected: &[f64]) {
    assert_eq!(found.len(), expected.len(), "{context}\n{found:?}\n{expected:?}");
    let all = found.iter().zip(expected).all(|(p, q)| (p - q).abs() <= NEAR);
    assert!(all, "{context}\nfound {found:?}\nexpected {expected:?}");
}

fn figures(answer: &Answer) -> Vec<f64> {
    answer.answer.iter().map(|row| row.p().unwrap()).collect()
}

/// Holds one random program to the enumeration; gives whether its observations can be.
fn hold(seed: u64) -> bool {
    let dice = &mut Dice(seed);
    let world = world(dice);
    let states: f64 = world.slots.iter().map(|slot| slot.count as f64).product();
    let length = (1 + dice.below(4)).min((12.0 / states.ln()).floor().max(1.0) as usize);
    let Some(mut rows) = world.history(dice, length) else { return false };
    if dice.chance(0.1) {
        // Something that may be impossible.
        let (row, slot) = (dice.below(length), dice.below(world.slots.len()));
        if world.slots[slot].known {
            rows[row][slot] = dice.below(world.slots[slot].count) as f64;
        }
    }
    let model = model_of(&world.text);
    let likely = world.likelihood.as_ref().map(|(slot, _)| *slot);
    let is_free = |slot: &usize| !world.slots[*slot].known && Some(*slot) != likely;
    let free: Vec<usize> = (0..world.slots.len()).filter(is_free).collect();
    if free.is_empty() {
        return false;
    }
    let mut searched: Vec<usize> = free.iter().copied().filter(|_| dice.chance(0.6)).collect();
    if searched.is_empty() {
        searched.push(free[dice.below(free.len())]);
    }
    // A family is searched whole.
    let family: Vec<usize> =
        free.iter().copied().filter(|slot| world.slots[*slot].name.starts_with('F')).collect();
    if searched.iter().any(|slot| family.contains(slot)) {
        searched.retain(|slot| !family.contains(slot));
        searched.extend(&family);
    }
    let width: usize = searched.iter().map(|slot| world.slots[*slot].count).product();
    let carried: Vec<usize> = (0..world.slots.len()).filter(|slot| world.slots[*slot].carried).collect();
    let sequenced: Option<Vec<usize>> = carried.iter().all(is_free).then(|| {
        let beside = searched.iter().copied().filter(|slot| !carried.contains(slot));
        carried.iter().copied().chain(beside).collect()
    });
    let (mut total, mut smooth) = (0.0, vec![vec![0.0; width]; length]);
    let mut sequences: HashMap<Vec<usize>, f64> = HashMap::new();
    world.each_history(&rows, 0, &mut |history, weight| {
        total += weight;
        for (instant, now) in history[1..].iter().enumerate() {
            smooth[instant][world.ordinal(&searched, now)] += weight;
        }
        if let Some(slots) = &sequenced {
            let key = history[1..].iter().map(|now| world.ordinal(slots, now)).collect();
            *sequences.entry(key).or_default() += weight;
        }
    });
    let text = world.asked("filter", &searched);
    let context = format!("seed {seed}\n{}\n{text}\n{rows:?}", world.text);
    let filter = world.answered(&model, &text, &rows);
    if total == 0.0 {
        let error = filter.expect_err(&context).to_string();
        assert!(error.contains("probability zero"), "{context}\n{error}");
        return false;
    }
    let filter = filter.unwrap_or_else(|error| panic!("{context}\n{error}"));
    smooth.iter_mut().flatten().for_each(|p| *p /= total);
    near(&context, &figures(&filter), &smooth[length - 1]);
    let ln = filter.ln_evidence.unwrap();
    assert!((ln - total.ln()).abs() <= NEAR, "{context}\nln P = {ln}, expected {}", total.ln());
    let all = world.answered(&model, &world.asked("smooth", &searched), &rows).unwrap();
    near(&context, &figures(&all), &smooth.concat());
    assert!((all.ln_evidence.unwrap() - total.ln()).abs() <= NEAR, "{context}");
    if let Some(slots) = &sequenced {
        let best = sequences.values().copied().fold(0.0, f64::max);
        let found = world.answered(&model, &world.asked("sequence", slots), &rows).unwrap();
        assert_eq!(found.answer.len(), length, "{context}");
        let value = |row: usize, column: usize| {
            let (name, slot) = (&found.answer[row].values[column + 1].1, &world.slots[slots[column]]);
            let named = |ordinal: usize| match slot.kind {
                Kind::Bool => ["false", "true"][ordinal].to_owned(),
                Kind::Labels => LABELS[ordinal].to_owned(),
                Kind::Range(low) => (low + ordinal as i64).to_string(),
                Kind::Bins => model.variables[model.variable(&slot.name).unwrap()].domain.value_name(ordinal),
            };
            (0..slot.count).find(|ordinal| named(*ordinal) == *name).unwrap()
        };
        let key: Vec<usize> = (0..length)
            .map(|row| {
                (slots.iter().enumerate())
                    .fold(0, |at, (column, slot)| at * world.slots[*slot].count + value(row, column))
            })
            .collect();
        let likely = sequences.get(&key).copied().unwrap_or(0.0);
        assert!(likely >= best * (1.0 - 1e-9), "{context}\n{found:?}\n{likely} of {best}");
    }
    let ahead = 1 + dice.below(2);
    if (length + ahead) as f64 * states.ln() > 12.0 {
        return true;
    }
    let (mut future, mut whole) = (vec![0.0; width], 0.0);
    world.each_history(&rows, ahead, &mut |history, weight| {
        future[world.ordinal(&searched, &history[history.len() - 1])] += weight;
        whole += weight;
    });
    if whole > 0.0 {
        future.iter_mut().for_each(|p| *p /= whole);
        let asked = world.asked(&format!("predict({ahead})"), &searched);
        let predicted = world.answered(&model, &asked, &rows).unwrap();
        near(&context, &figures(&predicted), &future);
        assert!((predicted.ln_evidence.unwrap() - total.ln()).abs() <= NEAR, "{context}");
    }
    true
}

#[test]
fn random_programs_are_the_sum_over_all_histories() {
    let possible = (0..1500).filter(|seed| hold(*seed)).count();
    assert!(possible > 1000, "only {possible} programs had observations that can be");
}

//! Random programs over time, compared with the enumeration of every history.
//!
//! In: programs with zeros in start laws, transitions and observations; one chain or several; labels, numbers, bins and
//! booleans; families; Diracs; reals; likelihoods; missing observations. Out: pass if filter, predict, smooth, sequence
//! and ln P agree. Invariant: the enumerator has its own tables and multiplies them history by history; it shares
//! nothing with the library but the text of the program that it writes.

mod hold;
mod statistics;

use std::fmt::Write;

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

/// The instant of a value: this one, or the previous one.
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

/// The form of a slot, or of a real.
enum Form {
    /// A row for each combination of the parents, the last one fastest.
    Table(Vec<f64>),
    /// This ordinal; `None` where it is outside the domain.
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
            // A hidden family matters through the variables that depend on its elements.
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
    // Reals: an observed one, possibly through another that a Dirac determines.
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

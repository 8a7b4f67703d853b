//! The printer of loops as Rust.
//!
//! In: statements of the loop language. Out: lines. Invariant: one line for each statement except blocks; a name is a letter,
//! the position of its object, and the indices of unrolled axes: `u` are uniform numbers (f64), `z` uniform integers (isize),
//! `t` uniform numbers in the type of the lanes, `r` fetched lanes, `a` lanes computed at an outer depth, `x` one lane.

use super::text::Text;
use super::value::{arithmetic, constant, unary};
use crate::ids::{AxisId, Id};
use crate::kernel::Fold;
use crate::loops::{
    Element, Expression, Grain, Kind, Lanes, Local, Look, Of, Operation, Statement, Target, Type,
};
use crate::operators::Unary;

/// A name.
pub(super) fn name(local: &Local) -> String {
    let (kind, position) = match local.of {
        Of::Extent(axis) => ("e", axis.position()),
        Of::Running(axis) => ("i", axis.position()),
        Of::Array(buffer) => ("m", buffer.position()),
        Of::Planes(buffer) => ("y", buffer.position()),
        Of::Stride(buffer, axis) => return format!("q{}_{axis}", buffer.position()),
        Of::IsWhole(buffer) => ("g", buffer.position()),
        Of::Once(value) => ("u", value.position()),
        Of::Whole(value) => ("z", value.position()),
        Of::Splat(value) => ("t", value.position()),
        Of::Splats(value) => ("all_t", value.position()),
        Of::Lane(value) => ("x", value.position()),
        Of::Kept(value) => ("a", value.position()),
        Of::Fetched(value) => ("r", value.position()),
        Of::Place(value) => ("p", value.position()),
        Of::Places(value) => ("all_p", value.position()),
        Of::Copies(value) => ("b", value.position()),
        Of::From(value) => ("from", value.position()),
        Of::Inside(value) => ("inside", value.position()),
        Of::Index(value, index) => return format!("x{}_{index}", value.position()),
        Of::Cell(buffer) => ("v", buffer.position()),
        Of::Tile(buffer) => ("w", buffer.position()),
        Of::Tiles(buffer) => ("k", buffer.position()),
        Of::Made => return "made".to_owned(),
        Of::Own => return "own".to_owned(),
        Of::Folded => return "folded".to_owned(),
        Of::Cells => return "cells".to_owned(),
        Of::State => return "state".to_owned(),
    };
    let copy: String = local.copy.iter().map(|chosen| format!("_{chosen}")).collect();
    format!("{kind}{position}{copy}")
}

fn of(of: Of) -> String {
    name(&of.into())
}

fn extent(axis: AxisId) -> String {
    of(Of::Extent(axis))
}

/// The type of numbers, and their 0.
fn kind(kind: Kind) -> (&'static str, &'static str) {
    match kind {
        Kind::Once => ("f64", "0.0"),
        Kind::Lane => ("T", "T::ZERO"),
    }
}

/// An expression.
pub(super) fn expression(it: &Expression) -> String {
    let parts: Vec<String> = it.operands.iter().map(expression).collect();
    let all = |by: &str, none: &str| if parts.is_empty() { none.to_owned() } else { parts.join(by) };
    let part: Vec<&str> = parts.iter().map(String::as_str).collect();
    match (&it.operation, part.as_slice()) {
        (Operation::Local(local), []) => name(local),
        (Operation::LaneOf(local), []) => format!("{}[l]", name(local)),
        (Operation::At(local), [at]) => format!("{}[{at}]", name(local)),
        (Operation::Constant(Kind::Once, bits), []) => constant(f64::from_bits(*bits)),
        (Operation::Constant(Kind::Lane, bits), []) => {
            format!("T::from_f64({})", constant(f64::from_bits(*bits)))
        }
        (Operation::Unary(Kind::Once, Unary::Not), [x]) => format!("1.0 - {x}"),
        (Operation::Unary(Kind::Once, Unary::Negate), [x]) => format!("-{x}"),
        // These functions have the same results on every processor, and are slow without instruction selection.
        (Operation::Unary(Kind::Once, operator), [x]) => format!("Unary::{operator:?}.apply({x})"),
        (Operation::Unary(Kind::Lane, operator), [x]) => unary(*operator, x),
        (Operation::Binary(of, operator), [x, y]) => arithmetic(*operator, x, y, kind(*of).0, kind(*of).1),
        (Operation::Select(of), [condition, then, otherwise]) => {
            format!("if {condition} != {} {{ {then} }} else {{ {otherwise} }}", kind(*of).1)
        }
        (Operation::Mass(of, law), _) => {
            let (kind, operands) = (kind(*of).0, parts.join(", "));
            format!("<{kind} as Scalar>::mass(::bp_core::compiler::operators::Mass::{law:?}, [{operands}])")
        }
        (Operation::OnlyIf, [condition, number]) => format!("only_if({condition} != 0.0, {number})"),
        (Operation::IsBelowInfinity, [x]) => format!("<T as Scalar>::truth(Scalar::is_below_infinity({x}))"),
        (Operation::Number, [x]) => format!("{x} as f64"),
        (Operation::RunningLane, []) => "T::from_f64((start + l) as f64)".to_owned(),
        (Operation::Element(Kind::Once, Element::Position), [array, at]) => {
            format!("f64::from({array}[{at}])")
        }
        (Operation::Element(Kind::Once, _), [array, at]) => format!("{array}[{at}].to_f64()"),
        (Operation::Element(Kind::Lane, Element::Position), [array, at]) => {
            format!("T::from_f64(f64::from({array}[{at}]))")
        }
        (Operation::Element(Kind::Lane, Element::Table), [array, at]) => {
            format!("T::from_f64({array}[{at}])")
        }
        (Operation::Element(Kind::Lane, Element::Number), [array, at]) => format!("{array}[{at}]"),
        (Operation::Position, [array, at]) => format!("{array}[{at}] as isize"),
        (Operation::Wide, [x]) => format!("{x}.to_f64()"),
        (Operation::Narrow, [x]) => format!("T::from_f64({x})"),
        (Operation::If, [condition, then, otherwise]) => {
            format!("if {condition} {{ {then} }} else {{ {otherwise} }}")
        }
        (Operation::Zero, []) => "T::ZERO".to_owned(),
        (Operation::Count(count), []) => format!("{count}"),
        (Operation::Chosen(value), []) => format!("{value}usize"),
        (Operation::Start, []) => "start".to_owned(),
        (Operation::LaneWithin, []) => "(start + l.min(width - 1))".to_owned(),
        (Operation::Sum, _) => all(" + ", "0"),
        (Operation::Product, _) => all(" * ", "1"),
        (Operation::Strided, [at, stride]) => format!("{at} * ({stride})"),
        (Operation::AsIndex, [x]) => format!("({x} as usize)"),
        (Operation::AsSigned, [x]) => format!("{x} as isize"),
        (Operation::Grouped, [x]) => format!("({x})"),
        (Operation::InLanes, [x]) => format!("({x}) * LANES"),
        (Operation::Slot, [x]) => format!("{x} * LANES"),
        (Operation::PlusLane, [x]) => format!("{x} + l"),
        (Operation::Turned, [at, by, extent, wraps]) => {
            format!("turn({at} as isize + {by}, {extent}, {wraps} != 0.0)")
        }
        (Operation::StartPlus, [by]) => format!("start as isize + {by}"),
        (Operation::IsInside, [at, extent]) => format!("{at} >= 0 && {at} < {extent} as isize"),
        (Operation::IsInsideNumber, [at, extent]) => format!("{at} >= 0.0 && {at} < {extent} as f64"),
        (Operation::Always, []) => "true".to_owned(),
        (Operation::All, _) => all(" && ", "true"),
        (Operation::IsLaneInside, [wraps, from, extent]) => format!(
            "({wraps} != 0.0 || ({from} + l as isize >= 0 && {from} + (l as isize) < {extent} as isize))"
        ),
        (Operation::PlaceAt, [offset]) => format!("Place::at({offset})"),
        (Operation::IfWhole, [whole, then, otherwise]) => {
            format!("if {whole} == 1 {{ {then} }} else {{ {otherwise} }}")
        }
        (Operation::Fetch, [copies, slot, source, offset]) => {
            format!("fetch(&mut {copies}[..], {slot}, {source}, {offset} + start, width)")
        }
        (Operation::FetchTurned(grain), [copies, slot, source, offset, from, extent, wraps, fill]) => {
            let grain = match grain {
                Grain::Block => "LANES",
                Grain::Tile => "TILE",
            };
            format!(
                "fetch_turned(&mut {copies}[..], {slot}, {source}, {offset}, {from}, {extent}, {wraps} != 0.0, width, {fill}, {grain})"
            )
        }
        (Operation::Splat, [copies, slot, number]) => {
            format!("splat(&mut {copies}[..], {slot}, {number}, width)")
        }
        (Operation::Fill, [copies, slot, fill]) => format!("fill(&mut {copies}[..], {slot}, {fill}, width)"),
        (Operation::LanesAt, [place, source, copies]) => {
            format!("&{place}.of({source}, &{copies}[..])[..width]")
        }
        (Operation::ReadTile, [place, source, copies, slot]) => {
            format!("read_tile({place}, {source}, &{copies}[..], {slot}, at)")
        }
        (Operation::Row, [place, source, copies]) => {
            format!("row_at({place}, {source}, &{copies}[..], width)")
        }
        (Operation::TileOf, [row]) => format!("tile_of({row}, at)"),
        (Operation::Kept, [tile]) => format!("&{tile}"),
        (Operation::OneFor, [x]) => format!("&[{x}]"),
        (Operation::Source, [array]) => format!("&{array}[..]"),
        (Operation::NoSource, []) => "&[]".to_owned(),
        (operation, operands) => {
            unreachable!("internal: {operation:?} has {} operands", operands.len())
        }
    }
}

fn least(is_linear: bool) -> &'static str {
    if is_linear { "T::ZERO" } else { "T::LEAST_TOTAL" }
}

/// A check of lanes.
pub(super) fn look(look: Look, lanes: &str) -> String {
    match look {
        Look::Totals { is_linear } => format!("suspects += suspect_totals({lanes}, {});", least(is_linear)),
        Look::Numbers => format!("suspects += suspect_numbers({lanes});"),
        Look::Doubt => format!("doubt_numbers(&mut doubt, {lanes});"),
    }
}

/// Statements.
pub(super) fn statements(all: &[Statement], text: &mut Text) {
    all.iter().for_each(|one| statement(one, text));
}

fn block(head: impl AsRef<str>, body: &[Statement], text: &mut Text) {
    text.open(head);
    statements(body, text);
    text.close();
}

fn statement(it: &Statement, text: &mut Text) {
    match it {
        Statement::Let(local, of, value) => {
            let of = match of {
                Type::Once => "f64",
                Type::Lane => "T",
                Type::Signed => "isize",
                Type::Truth => "bool",
                Type::Place => "Place",
                Type::Lanes => "&[T]",
                Type::Tile => "&[T; TILE]",
            };
            text.line(format!("let {}: {of} = {};", name(local), expression(value)));
        }
        Statement::LetWhere(local, [otherwise, holds, value]) => {
            let [otherwise, holds, value] = [otherwise, holds, value].map(expression);
            text.line(format!("let {}: T = if {holds} {{ {value} }} else {{ {otherwise} }};", name(local)));
        }
        Statement::Turn(axis, value, body) => {
            text.open("");
            text.line(format!("let {}: usize = {value};", of(Of::Running(*axis))));
            statements(body, text);
            text.close();
        }
        Statement::Block(local) => text.line(format!("let mut {} = Aligned([T::ZERO; LANES]);", name(local))),
        Statement::Tile(local, start) => {
            text.line(format!("let mut {} = Aligned([{}; TILE]);", name(local), expression(start)));
        }
        Statement::Tiles(local, count) => {
            text.line(format!("let mut {} = [Aligned([T::ZERO; TILE]); {count}];", name(local)));
        }
        Statement::Scope(body) => block("", body, text),
        Statement::For(axis, body) => {
            block(format!("for {} in 0..{}", of(Of::Running(*axis)), extent(*axis)), body, text);
        }
        Statement::Scan { axis, backward, body } => {
            let (running, extent) = (of(Of::Running(*axis)), extent(*axis));
            text.open(format!("for step in 0..{extent}"));
            text.line(match backward {
                true => format!("let {running} = {extent} - 1 - step;"),
                false => format!("let {running} = step;"),
            });
            statements(body, text);
            text.close();
        }
        Statement::ForLanes(lanes, body) => {
            let count = match lanes {
                Lanes::Width => "width",
                Lanes::Filled => "filled",
                Lanes::Tile => "TILE",
            };
            block(format!("for l in 0..{count}"), body, text);
        }
        Statement::ForTiles(body) => {
            text.line("let mut tile: usize = 0;");
            text.open("while tile < width");
            text.line("let count = TILE.min(width);");
            text.line("let at = if tile + TILE <= width { tile } else { width - count };");
            text.line("let start = start + at;");
            statements(body, text);
            text.line("tile += TILE;");
            text.close();
        }
        Statement::Set(place, value) => text.line(format!("{} = {};", expression(place), expression(value))),
        Statement::BeginLanes(fold) => {
            text.line(format!("folded[..filled].fill(T::from_f64({}));", start(*fold)));
        }
        Statement::Cells(count, start) => {
            text.line(format!("let mut cells = [{}; {count}];", expression(start)));
        }
        Statement::Begin(fold) => text.line(format!("let mut folded = {};", start(*fold))),
        Statement::Fold(fold, value) => text.line(match (fold, expression(value)) {
            (Fold::Sum, value) => format!("folded += {value};"),
            (Fold::Product, value) => format!("folded *= {value};"),
            (Fold::Maximum, value) => format!("folded = f64::max(folded, {value});"),
        }),
        Statement::StateOfLanes(value) => {
            text.line("let mut state = Aligned([T::ZERO; LANES]);");
            text.line(format!("for l in 0..width {{ state[l] = {}; }}", expression(value)));
        }
        Statement::State(value) => text.line(format!("let mut state = {};", expression(value))),
        Statement::Store(array, plane, value) => text.line(format!(
            "{}[{}] = T::from_f64({});",
            of(Of::Array(*array)),
            expression(plane),
            expression(value)
        )),
        Statement::Own(array, plane) => text.line(format!(
            "let own: &mut [T] = &mut {}[({}) * LANES..][..LANES];",
            of(Of::Array(*array)),
            expression(plane)
        )),
        Statement::Keep { target, plane, lanes } => {
            let plane = expression(plane);
            let to = match target {
                Target::Own(array) => format!("{}[({plane}) * LANES..][..width]", of(Of::Array(*array))),
                Target::Planes(array) => {
                    format!("{}[{plane}][place..place + width]", of(Of::Planes(*array)))
                }
            };
            text.line(format!("{to}.copy_from_slice(&{}[..width]);", name(lanes)));
        }
        Statement::Look(how, lanes) => text.line(look(*how, &format!("&{}[..width]", name(lanes)))),
        Statement::LookAtTile(how, tile) => {
            let is_linear = matches!(how, Look::Totals { is_linear: true });
            // The last tile of a row begins with lanes that were counted in the previous tile.
            text.line(format!(
                "suspect_tile(&mut small, &{}, tile - at, count, {});",
                name(tile),
                least(is_linear)
            ));
        }
        Statement::KeepTile { target, plane, tile, doubt } => {
            let (plane, tile) = (expression(plane), name(tile));
            let place = match target {
                Target::Own(array) => format!("&mut {}[..], ({plane}) * LANES + at", of(Of::Array(*array))),
                Target::Planes(array) => format!("&mut {}[{plane}][..], place + at", of(Of::Planes(*array))),
            };
            text.line(match doubt {
                true => format!("write_numbers({place}, count, {tile}, &mut doubt);"),
                false => format!("write_tile({place}, count, {tile});"),
            });
        }
        Statement::Shorten(local, axis) => {
            let local = name(local);
            text.line(format!("let {local} = &{local}[..{}];", extent(*axis)));
        }
    }
}

fn start(fold: Fold) -> &'static str {
    match fold {
        Fold::Sum => "0.0f64",
        Fold::Product => "1.0f64",
        Fold::Maximum => "f64::NEG_INFINITY",
    }
}

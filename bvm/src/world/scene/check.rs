//! Checks of a scene file.
//!
//! In: its text. Out: a [`Scene`], or the first mistake. Invariant: every mistake is reported at the value that causes it.

use super::file::{self, SceneFile, SurfaceFile};
use super::parts::Jitter;
use super::robot::{cameras, fault, imu, neck};
use super::{Scene, SceneError};
use crate::frame::unit_vector;
use crate::world::{Body, Fog, Motion, Place, Shape, Sound, Source, Surface, Thing, World};
use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};
use std::ops::{Range, RangeInclusive};
use std::path::Path;
use toml::Spanned;

/// The head that nothing may touch: a ball, m.
const HEAD_M: f64 = 0.15;
/// How far a wall may be, m.
const MOST_ROOM_M: f64 = 1000.0;
/// Paths are checked at these times, s.
const STEP_S: f64 = 0.05;
const LONGEST_S: f64 = 600.0;

/// The surfaces that have names.
const SURFACES: [(&str, Surface); 6] = [
    ("wallpaper", Surface { albedo: 0.55, contrast: 0.5, transparent: false }),
    ("wood", Surface { albedo: 0.4, contrast: 0.6, transparent: false }),
    ("cloth", Surface { albedo: 0.3, contrast: 0.6, transparent: false }),
    ("skin", Surface { albedo: 0.6, contrast: 0.35, transparent: false }),
    ("black", Surface { albedo: 0.01, contrast: 0.0, transparent: false }),
    ("glass", Surface { albedo: 0.1, contrast: 0.0, transparent: true }),
];

/// A mistake: where, and what.
pub(super) type Mistake = (Range<usize>, String);

/// A scene from the text of a file.
pub(super) fn scene(text: &str, path: &Path) -> Result<Scene, SceneError> {
    let name = path.file_stem().map_or(String::new(), |stem| stem.to_string_lossy().into_owned());
    let read = |file: SceneFile| checked(file, name);
    let syntax = |error: toml::de::Error| (error.span().unwrap_or(0..0), error.message().replace('\n', ", "));
    toml::from_str(text).map_err(syntax).and_then(read).map_err(|(span, reason)| {
        let before = &text[..span.start.min(text.len())];
        let line = before.rsplit('\n').next().unwrap_or("");
        SceneError {
            path: path.to_path_buf(),
            line: 1 + before.matches('\n').count(),
            column: 1 + line.chars().count(),
            reason,
        }
    })
}

fn checked(file: SceneFile, name: String) -> Result<Scene, Mistake> {
    let room = room(&file.room)?;
    let walls = surface(file.room.surface.as_ref(), "wallpaper")?;
    let mut names: Vec<String> = Vec::new();
    let mut jitter = Jitter::default();
    let mut things = Vec::new();
    for solid in &file.things {
        let (thing, reach) = thing(solid, &room, &mut names)?;
        things.push(thing);
        jitter.things.push(reach);
    }
    let mut bodies = Vec::new();
    for solid in &file.bodies {
        let (body, is_free) = body(solid, &room, (&things, &jitter.things), &mut names)?;
        bodies.push(body);
        jitter.phases.push(is_free);
    }
    let sources = file.sounds.iter().map(|sound| source(sound, &room, &bodies)).collect::<Result<_, _>>()?;
    let fog = file.fog.iter().map(fog).collect::<Result<_, _>>()?;
    let world = World { room, walls, things, bodies, sources, fog };
    Ok(Scene {
        name,
        title: file.title,
        world: Some(world),
        jitter,
        cameras: cameras(&file.cameras)?,
        neck: neck(&file.neck)?,
        imu: imu(&file.imu)?,
        faults: file.faults.iter().map(fault).collect::<Result<_, _>>()?,
    })
}

pub(super) fn finite<T>(value: &Spanned<T>, numbers: &[f64]) -> Result<(), Mistake> {
    match numbers.iter().find(|number| !number.is_finite()) {
        Some(number) => Err((
            value.span(),
            format!("found {}, expected a finite number", number.to_string().to_lowercase()),
        )),
        None => Ok(()),
    }
}

/// A number that may be absent, within bounds.
pub(super) fn within(
    value: Option<&Spanned<f64>>,
    default: f64,
    bounds: RangeInclusive<f64>,
) -> Result<f64, Mistake> {
    let Some(value) = value else { return Ok(default) };
    finite(value, &[*value.get_ref()])?;
    if bounds.contains(value.get_ref()) {
        return Ok(*value.get_ref());
    }
    let (from, to) = (bounds.start(), bounds.end());
    Err((value.span(), format!("found {}, expected {from} to {to}", value.get_ref())))
}

fn room(room: &file::Room) -> Result<[[f64; 3]; 2], Mistake> {
    let (min, max) = (*room.min.get_ref(), *room.max.get_ref());
    finite(&room.min, &min)?;
    finite(&room.max, &max)?;
    let refuse = |value: f64| format!("found {value}: the head is at 0, at least {HEAD_M} m from each wall");
    let far = |value: f64| format!("found {value}: expected a wall within {MOST_ROOM_M} m of the head");
    for (low, high) in min.into_iter().zip(max) {
        if low < -MOST_ROOM_M {
            return Err((room.min.span(), far(low)));
        }
        if high > MOST_ROOM_M {
            return Err((room.max.span(), far(high)));
        }
        if low >= -HEAD_M {
            return Err((room.min.span(), refuse(low)));
        }
        if high <= HEAD_M {
            return Err((room.max.span(), refuse(high)));
        }
    }
    Ok([min, max])
}

fn is_inside([min, max]: &[[f64; 3]; 2], point: &[f64; 3]) -> bool {
    (0..3).all(|axis| (min[axis]..=max[axis]).contains(&point[axis]))
}

fn surface(value: Option<&Spanned<SurfaceFile>>, default: &str) -> Result<Surface, Mistake> {
    let named = |name: &str| SURFACES.iter().find(|(known, _)| *known == name).map(|(_, surface)| *surface);
    let Some(value) = value else { return Ok(named(default).unwrap_or_default()) };
    match value.get_ref() {
        SurfaceFile::Name(name) => named(name).ok_or_else(|| {
            let known: Vec<&str> = SURFACES.iter().map(|(name, _)| *name).collect();
            (value.span(), format!("there is no surface `{name}`: expected {}", known.join(", ")))
        }),
        SurfaceFile::Numbers(numbers) => {
            let (albedo, contrast) = (numbers.albedo, numbers.contrast);
            finite(value, &[albedo, contrast])?;
            if !(0.0..=1.0).contains(&albedo) || !(0.0..=1.0).contains(&contrast) {
                let reason = format!("albedo {albedo}, contrast {contrast}: expected both from 0 to 1");
                return Err((value.span(), reason));
            }
            Ok(Surface { albedo, contrast, transparent: numbers.transparent })
        }
    }
}

fn positive<T>(value: &Spanned<T>, sizes: &[(&str, f64)]) -> Result<(), Mistake> {
    match sizes.iter().find(|(_, size)| *size <= 0.0) {
        Some((name, size)) => Err((value.span(), format!("{name} is {size} m, expected more than 0"))),
        None => Ok(()),
    }
}

fn shape(solid: &Spanned<file::Solid>) -> Result<Shape, Mistake> {
    let file = solid.get_ref();
    let mut found: Vec<(Range<usize>, Shape)> = Vec::new();
    if let Some(block) = &file.block {
        let (min, max) = (block.get_ref().min, block.get_ref().max);
        finite(block, &[min, max].concat())?;
        let size = |axis: usize| max[axis] - min[axis];
        let sizes =
            [("its size along x", size(0)), ("its size along y", size(1)), ("its size along z", size(2))];
        positive(block, &sizes)?;
        found.push((block.span(), Shape::Block { min, max }));
    }
    if let Some(ball) = &file.ball {
        let (centre, radius) = (ball.get_ref().centre, ball.get_ref().radius);
        finite(ball, &[centre[0], centre[1], centre[2], radius])?;
        positive(ball, &[("its radius", radius)])?;
        found.push((ball.span(), Shape::Ball { centre, radius }));
    }
    if let Some(cylinder) = &file.cylinder {
        let (axis, radius, height) =
            (cylinder.get_ref().axis, cylinder.get_ref().radius, cylinder.get_ref().height);
        finite(cylinder, &[axis[0], axis[1], radius, height[0], height[1]])?;
        positive(cylinder, &[("its radius", radius), ("its height", height[1] - height[0])])?;
        found.push((cylinder.span(), Shape::Cylinder { axis, radius, height }));
    }
    match found.as_slice() {
        [(_, only)] => Ok(*only),
        [] => {
            Err((file.name.span(), String::from("it has no shape: expected `block`, `ball` or `cylinder`")))
        }
        [_, (span, _), ..] => Err((span.clone(), String::from("it has a shape already: expected one"))),
    }
}

fn add_name(name: &Spanned<String>, names: &mut Vec<String>) -> Result<String, Mistake> {
    if names.contains(name.get_ref()) {
        return Err((name.span(), format!("there is another `{}`: names are unique", name.get_ref())));
    }
    names.push(name.get_ref().clone());
    Ok(name.get_ref().clone())
}

/// The points of the head that a solid must not contain.
fn head() -> impl Iterator<Item = [f64; 3]> {
    let around = |row: i32| {
        (0..8).map(move |column| {
            unit_vector(f64::from(column) * FRAC_PI_4, f64::from(row) * FRAC_PI_4).map(|part| part * HEAD_M)
        })
    };
    let poles = [FRAC_PI_2, -FRAC_PI_2].map(|pole| unit_vector(0.0, pole).map(|part| part * HEAD_M));
    (-1..=1).flat_map(around).chain(poles).chain([[0.0; 3]])
}

/// Whether a solid that may be displaced holds a point.
fn holds(shape: &Shape, [x, y]: [f64; 2], point: [f64; 3]) -> bool {
    let ends = [[0.0, 0.0], [x, y], [x, -y], [-x, y], [-x, -y]];
    ends.iter().any(|[x, y]| shape.moved(*x, *y).contains(point))
}

fn thing(
    solid: &Spanned<file::Solid>,
    room: &[[f64; 3]; 2],
    names: &mut Vec<String>,
) -> Result<(Thing, [f64; 2]), Mistake> {
    let file = solid.get_ref();
    let name = add_name(&file.name, names)?;
    let motion = file.walk.as_ref().map(|walk| walk.ends.span());
    let motion = motion.or_else(|| file.path.as_ref().map(Spanned::span));
    if let Some(span) = motion.or_else(|| file.swing.as_ref().map(|swing| swing.hinge.span())) {
        return Err((span, format!("`{name}` does not move: what moves is one of `bodies`")));
    }
    let shape = shape(solid)?;
    let reach = file.jitter_m.as_ref().map_or([0.0; 2], |reach| *reach.get_ref());
    if let Some(given) = &file.jitter_m {
        finite(given, &reach)?;
        if reach.iter().any(|reach| !(0.0..=10.0).contains(reach)) {
            return Err((given.span(), format!("found {reach:?} m, expected 0 to 10")));
        }
    }
    let [min, max] = shape.bounds();
    if (0..3).any(|axis| min[axis] >= room[1][axis] || max[axis] <= room[0][axis]) {
        return Err((file.name.span(), format!("`{name}` is outside the room")));
    }
    let touches = head().any(|point| holds(&shape, reach, point));
    let wraps = (0..3).all(|axis| min[axis] < HEAD_M && max[axis] > -HEAD_M)
        && head().any(|point| shape.contains(point));
    if touches || wraps {
        let how = if reach == [0.0; 2] { "" } else { ", with its `jitter_m`" };
        return Err((file.name.span(), format!("the head, at 0, is inside `{name}`{how}")));
    }
    Ok((Thing { name, shape, surface: surface(file.surface.as_ref(), "wood")? }, reach))
}

fn body(
    solid: &Spanned<file::Solid>,
    room: &[[f64; 3]; 2],
    (things, reaches): (&[Thing], &[[f64; 2]]),
    names: &mut Vec<String>,
) -> Result<(Body, bool), Mistake> {
    let file = solid.get_ref();
    let name = add_name(&file.name, names)?;
    let shape = shape(solid)?;
    if let Some(reach) = &file.jitter_m {
        return Err((reach.span(), String::from("a body has no `jitter_m`: the seed chooses its phase")));
    }
    let (span, motion, is_free) = motion(file)?;
    let body = Body { name, shape, motion, surface: surface(file.surface.as_ref(), "cloth")? };
    let ends = match &body.motion {
        Motion::Walk { period_s, .. } => *period_s,
        motion => motion.ends_s().unwrap_or(0.0),
    };
    let is_swing = matches!(body.motion, Motion::Swing { .. });
    for step in 0..=(ends.min(LONGEST_S) / STEP_S).ceil() as usize {
        let time = step as f64 * STEP_S;
        let now = body.shape(time);
        if head().any(|point| now.contains(point)) {
            let reason = format!("at {time:.1} s the head, at 0, is inside `{}`", body.name);
            return Err((span, reason));
        }
        let [min, max] = now.bounds();
        let middle = [0, 1, 2].map(|axis| 0.5 * (min[axis] + max[axis]));
        let [x, y, _] = middle;
        if !is_inside(room, &middle) {
            let reason = format!("at {time:.1} s `{}` is at ({x:.2}, {y:.2}) m: outside the room", body.name);
            return Err((span, reason));
        }
        let through = things.iter().zip(reaches).find(|(thing, reach)| {
            let heights = [min[2] + 0.01, middle[2], max[2] - 0.01];
            !is_swing && heights.iter().any(|z| holds(&thing.shape, **reach, [x, y, *z]))
        });
        if let Some((thing, _)) = through {
            let reason = format!("at {time:.1} s `{}` passes through `{}`", body.name, thing.name);
            return Err((span, reason));
        }
    }
    Ok((body, is_free))
}

fn motion(file: &file::Solid) -> Result<(Range<usize>, Motion, bool), Mistake> {
    let mut found: Vec<(Range<usize>, Motion, bool)> = Vec::new();
    if let Some(walk) = &file.walk {
        let ends = *walk.ends.get_ref();
        finite(&walk.ends, &ends.concat())?;
        let period_s = within(Some(&walk.period_s), 1.0, 0.5..=3600.0)?;
        let phase = within(walk.phase.as_ref(), 0.0, 0.0..=1.0)?;
        found.push((walk.ends.span(), Motion::Walk { ends, period_s, phase }, walk.phase.is_none()));
    }
    if let Some(path) = &file.path {
        let points = path.get_ref().clone();
        finite(path, &points.concat())?;
        let times_increase = points.windows(2).all(|pair| pair[0][0] < pair[1][0]);
        if points.len() < 2 || !times_increase || points[0][0] < 0.0 {
            let reason = "expected at least two points [time, x, y], with times from 0 on that increase";
            return Err((path.span(), String::from(reason)));
        }
        found.push((path.span(), Motion::Path { points }, false));
    }
    if let Some(swing) = &file.swing {
        let (hinge, degrees) = (*swing.hinge.get_ref(), *swing.degrees.get_ref());
        finite(&swing.hinge, &hinge)?;
        finite(&swing.degrees, &degrees)?;
        let start = within(Some(&swing.start_s), 0.0, 0.0..=3600.0)?;
        let takes = within(Some(&swing.takes_s), 1.0, 0.1..=3600.0)?;
        let yaw = degrees.map(f64::to_radians);
        found.push((swing.hinge.span(), Motion::Swing { hinge, yaw, time_s: [start, takes] }, false));
    }
    match found.len() {
        1 => Ok(found.remove(0)),
        0 => Err((file.name.span(), String::from("it does not move: expected `walk`, `path` or `swing`"))),
        _ => Err((found[1].0.clone(), String::from("it has a motion already: expected one"))),
    }
}

fn source(
    sound: &Spanned<file::SoundFile>,
    room: &[[f64; 3]; 2],
    bodies: &[Body],
) -> Result<Source, Mistake> {
    let file = sound.get_ref();
    let place = match (&file.at, &file.carried_by) {
        (Some(at), None) => {
            let point = *at.get_ref();
            finite(at, &point)?;
            if !is_inside(room, &point) {
                return Err((at.span(), format!("`{}` is outside the room", file.name.get_ref())));
            }
            if point.iter().map(|part| part * part).sum::<f64>() < HEAD_M * HEAD_M {
                return Err((at.span(), format!("`{}` is inside the head", file.name.get_ref())));
            }
            Place::Fixed(point)
        }
        (None, Some(carrier)) => {
            let number = bodies.iter().position(|body| body.name == *carrier.get_ref()).ok_or_else(|| {
                let known: Vec<&str> = bodies.iter().map(|body| body.name.as_str()).collect();
                let known = if known.is_empty() { "there is none".to_owned() } else { known.join(", ") };
                (carrier.span(), format!("there is no body `{}`: {known}", carrier.get_ref()))
            })?;
            Place::Carried(number, within(file.height.as_ref(), 0.3, room[0][2]..=room[1][2])?)
        }
        _ => return Err((file.name.span(), String::from("expected either `at` or `carried_by`"))),
    };
    let sound = match file.plays.get_ref().as_str() {
        "noise" => Sound::Noise,
        "speech" => Sound::Speech,
        "tone" => Sound::Tone,
        other => {
            return Err((file.plays.span(), format!("found `{other}`, expected noise, speech or tone")));
        }
    };
    let from = within(file.from_s.as_ref(), 0.0, 0.0..=1e6)?;
    let until = within(file.until_s.as_ref(), f64::INFINITY, 0.0..=1e6)?;
    if let Some(end) = file.until_s.as_ref().filter(|_| until <= from) {
        return Err((end.span(), format!("found {until} s, expected more than `from_s`, {from} s")));
    }
    Ok(Source {
        name: file.name.get_ref().clone(),
        place,
        sound,
        level_db: within(file.level_db.as_ref(), -20.0, -80.0..=0.0)?,
        plays_s: [from, until],
    })
}

fn fog(file: &file::FogFile) -> Result<Fog, Mistake> {
    let between = [*file.min.get_ref(), *file.max.get_ref()];
    finite(&file.min, &between[0])?;
    finite(&file.max, &between[1])?;
    let sizes = [0, 1, 2].map(|axis| ("a size of the fog", between[1][axis] - between[0][axis]));
    positive(&file.max, &sizes)?;
    Ok(Fog { between, visibility_m: within(Some(&file.visibility_m), 1.0, 0.01..=1e6)? })
}

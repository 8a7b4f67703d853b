//! Moving bodies: ghosts, velocities and tracks.

use bvm::frame::Spherical;
use bvm::head::depth::Options;
use bvm::head::tracks::tracks;
use bvm::head::{Gaze, Head, depth};
use bvm::map::{Heading, Map};
use bvm::vision::EvidenceKind;
use bvm::world::World;
use bvm::world::scene::Scene;
use std::path::Path;

fn head(world: &World, missing: bool, joint: bool) -> Head {
    depth::head_with(world.clone(), EvidenceKind::Virtual, Options { missing, joint }, 1).unwrap()
}

/// Looks ahead, and a little down.
fn ahead(_: &Map, _: &Heading) -> Result<Gaze, bvm::error::Error> {
    Ok(Gaze::at(0.0, -0.2))
}

/// P(O) of the cell around the middle of a body at a place.
fn at(head: &Head, [x, y]: [f64; 2]) -> f32 {
    let seen = Spherical::from_cartesian([x, y, -0.3]);
    let grid = head.map().grid();
    // The body's front is nearer than its middle.
    let cell = grid.cell_of(Spherical { rho_m: seen.rho_m - 0.24, ..seen }).unwrap();
    head.map().occupancy()[grid.index(cell)]
}

/// Someone stands for three seconds before a curtain that gives no reading, then leaves; how many looks later the place is
/// free; at most 60.
fn forgotten_after(missing: bool) -> usize {
    let text = "title = 'x'\n[room]\nmin = [-2, -3, -1.2]\nmax = [5, 3, 1.4]\n[[things]]\nname = 'curtain'\n\
                block = { min = [4.5, -3, -1.2], max = [5, 3, 1.4] }\nsurface = 'black'\n[[bodies]]\nname = 'guest'\n\
                cylinder = { radius = 0.25, height = [-1.2, 0.5] }\npath = [[3, 2.4, 0.3], [5, 2.4, 2.7]]\n";
    let world = Scene::parse(text, Path::new("guest.toml")).unwrap().world(1);
    let mut head = head(&world, missing, false);
    // Seven looks until it moves; two seconds later it is out of view.
    (0..7).for_each(|_| {
        head.look(&mut ahead).unwrap();
    });
    assert!(at(&head, [2.4, 0.3]) > 0.9, "the guest is seen: {}", at(&head, [2.4, 0.3]));
    (1..=60)
        .find(|_| {
            head.look(&mut ahead).unwrap();
            println!("{missing}: {:.3}", at(&head, [2.4, 0.3]));
            at(&head, [2.4, 0.3]) < 0.5
        })
        .unwrap_or(61)
}

#[test]
fn what_leaves_is_forgotten_though_nothing_behind_it_is_read() {
    let (with, without) = (forgotten_after(true), forgotten_after(false));
    println!("forgotten after {with} looks, without evidence from silence after {without}");
    // It takes a look to leave the cell, and two or three of silence to forget it.
    assert!(with <= 5, "{with}");
    assert!(without > 20, "the paper's rule keeps a ghost: {without}");
}

/// From the right to the left at 0.28 m/s, two metres ahead: a cell of 4° in half a second.
fn walker() -> World {
    let text = "title = 'x'\n[room]\nmin = [-2, -3, -1.2]\nmax = [4, 3, 1.4]\n[[bodies]]\nname = 'walker'\n\
                cylinder = { radius = 0.25, height = [-1.2, 0.5] }\npath = [[0, 2, -1.4], [10, 2, 1.4]]\n";
    Scene::parse(text, Path::new("walker.toml")).unwrap().world(1)
}

/// Tracks of a walker: looks with one, of these those in the right direction, and those near it.
fn tracked(joint: bool) -> [usize; 3] {
    let world = walker();
    let mut head = head(&world, true, joint);
    let mut counts = [0; 3];
    for look in 1..=16 {
        let time = head.time_s();
        head.look(&mut ahead).unwrap();
        let [x, y] = world.bodies[0].motion.place(time).at;
        let all = tracks(head.map(), depth::STEP_S);
        let Some(track) = all.first().filter(|_| look > 3) else { continue };
        println!("joint {joint}, look {look}: at ({x:.2}, {y:.2}): {track:?}");
        counts[0] += 1;
        counts[1] += usize::from(track.velocity_m_s[1] > 0.0);
        counts[2] += usize::from((track.position_m[0] - x).hypot(track.position_m[1] - y) < 0.6);
        assert!(track.velocity_spread_m_s.iter().chain(&track.spread_m).all(|spread| spread.is_finite()));
    }
    counts
}

#[test]
fn tracks_point_where_the_body_goes() {
    for joint in [false, true] {
        let [found, right, near] = tracked(joint);
        println!("joint {joint}: {found} tracks: {right} in the right direction, {near} near");
        assert!(found >= 5, "{found} looks with a track");
        assert!(right * 10 >= found * 8 && near * 10 >= found * 8, "{found}: {right} right, {near} near");
    }
}

#[test]
fn the_joint_distribution_starts_where_the_marginals_do() {
    let world = walker();
    let mut heads = [false, true].map(|joint| head(&world, false, joint));
    let occupancies = heads.each_mut().map(|head| {
        head.look(&mut ahead).unwrap();
        head.map().occupancy().to_vec()
    });
    let worst = occupancies[0]
        .iter()
        .zip(&occupancies[1])
        .map(|(one, other)| (one - other).abs())
        .fold(0.0, f32::max);
    assert!(worst < 1e-5, "after one look of an unknown map both are the same: {worst}");
    let later = heads.each_mut().map(|head| {
        (0..6).for_each(|_| {
            head.look(&mut ahead).unwrap();
        });
        head.map().occupancy().to_vec()
    });
    let differ = later[0].iter().zip(&later[1]).filter(|(one, other)| (*one - *other).abs() > 0.01).count();
    println!("after seven looks {differ} of {} cells differ by more than 0.01", later[0].len());
    assert!(differ > 0 && later[1].iter().all(|p| (0.0..=1.0).contains(p)));
}

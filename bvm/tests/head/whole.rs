//! The whole head: pictures, waveforms and inertial samples in one loop.

use bvm::exploration::{PolicyKind, Score};
use bvm::head::real::{self, Senses};
use bvm::head::{Head, Look};
use bvm::world::scene::Scene;
use std::path::Path;

const ALL: Senses = Senses { stereo: true, audio: true, imu: true, joint: false };

/// A scene with small pictures, for speed.
fn small(name: &str, more: &str) -> Scene {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    let text = std::fs::read_to_string(folder.join(format!("{name}.toml"))).unwrap();
    let text = format!("{text}\n[cameras]\nsize_px = [160, 120]\n{more}");
    Scene::parse(&text, Path::new("small.toml")).unwrap()
}

fn explored(scene: &Scene, senses: Senses, steps: usize) -> (Head, Vec<Look>) {
    let (mut head, _) = real::head(scene, senses, 1).unwrap();
    let mut policy = PolicyKind::Sweep.policy(head.map(), &real::camera_of(scene), real::most_tilt(scene), 1);
    let looks = (0..steps).map(|_| head.look(policy.as_mut()).unwrap()).collect();
    (head, looks)
}

fn yaw_error_degrees(look: &Look) -> f64 {
    bvm::frame::wrap_angle(look.attitude.yaw - look.truth.unwrap().yaw).abs().to_degrees()
}

#[test]
fn the_map_of_all_senses_is_where_the_world_is() {
    let scene = small("office", "");
    let (head, looks) = explored(&scene, ALL, 10);
    for look in &looks {
        println!("{:?} {:?}", look.gaze, look.senses);
    }
    let score = Score::of(head.map(), &scene.world(1).truth_state(head.map().grid(), looks[9].time_s));
    println!("{score:?}");
    assert!(looks.iter().all(|look| yaw_error_degrees(look) < 1.0));
    assert!(score.log_loss < 0.4 && score.found > 0.5, "{score:?}");
    assert!(looks.iter().all(|look| look.senses.iter().all(|sense| sense.fault.is_none())), "no fault");
}

#[test]
fn the_speaker_behind_is_heard_before_it_is_seen() {
    let scene = small("speaker_behind", "");
    let (_, looks) = explored(&scene, ALL, 3);
    // At (−1.6, 0.6): azimuth 159°, elevation 7°; from ahead, the cone of confusion holds the front too.
    let lateral = |azimuth: f64| azimuth.to_radians().sin();
    let heard: Vec<_> = looks.iter().flat_map(|look| &look.senses[1].found).collect();
    println!("{heard:?}");
    assert!(!heard.is_empty());
    let first = heard[0];
    assert!(
        (lateral(first.azimuth_deg) * first.elevation_deg.to_radians().cos() - 0.36).abs() < 0.15,
        "{first:?}"
    );
}

#[test]
fn faults_are_reported_and_the_run_goes_on() {
    let faults = "[[faults]]\norgan = 'right camera'\nlooks = [2, 2]\n[[faults]]\norgan = 'left ear'\nlooks = [1, 9]\n\
                  [[faults]]\norgan = 'imu'\nlooks = [3, 3]\n[[faults]]\norgan = 'left camera'\nkind = 'frozen'\nlooks = [4, 4]\n";
    let scene = small("speaker_behind", faults);
    let (head, looks) = explored(&scene, ALL, 5);
    let fault = |look: usize, sense: usize| looks[look - 1].senses[sense].fault.clone().unwrap_or_default();
    assert_eq!(fault(1, 0), "");
    assert_eq!(fault(2, 0), "the right camera gave no picture");
    assert_eq!(fault(3, 2), "no inertial samples: the commanded turn is used");
    assert!(fault(4, 0).contains("left camera repeats its last picture"), "{}", fault(4, 0));
    assert!((1..=5).all(|look| fault(look, 1) == "the left channel is silent"));
    assert!(head.map().numbers().iter().all(|number| number.is_finite()));
    assert!(head.map().occupancy().iter().all(|p| (0.0..=1.0).contains(p)));
    assert!(looks.iter().all(|look| yaw_error_degrees(look) < 1.5), "the neck knows what it was told");
}

#[test]
fn hearing_raises_less_than_one_cell() {
    let scene = small("speaker_behind", "");
    let (head, looks) = explored(&scene, Senses { stereo: false, ..ALL }, 1);
    let raised: f64 = head.map().occupancy().iter().map(|p| (f64::from(*p) - 0.5).max(0.0)).sum();
    assert!(looks[0].senses[0].readings > 10, "{:?}", looks[0].senses);
    assert!(raised > 0.01 && raised < 1.0, "{raised} cells");
    assert_eq!(head.map().occupancy().iter().filter(|p| **p > 0.55).count(), 0);
}

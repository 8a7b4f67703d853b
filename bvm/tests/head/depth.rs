//! The fast head: ends, resumed runs, threads.

use bvm::exploration::PolicyKind;
use bvm::head::checkpoint::{Checkpoint, Settings};
use bvm::head::{Ended, Head, Look, depth, run};
use bvm::map::{Heading, Map};
use bvm::vision::EvidenceKind;
use bvm::world::scene::Scene;
use bvm::world::sensors::DepthCamera;
use std::sync::atomic::AtomicBool;
use tempfile::TempDir;

fn head(scene: &str, seed: u64) -> Head {
    depth::head(Scene::find(scene).unwrap().world(seed), EvidenceKind::Virtual, seed).unwrap()
}

fn looks(head: &mut Head, kind: PolicyKind, steps: usize) -> (Vec<Look>, Ended) {
    let mut policy = kind.policy(head.map(), &DepthCamera::default(), depth::MOST_TILT, 1);
    let mut looks = Vec::new();
    let ended =
        run(head, policy.as_mut(), &mut looks, steps, None, &AtomicBool::new(false), |_, _| ()).unwrap();
    (looks, ended)
}

fn bits(map: &Map) -> Vec<u32> {
    map.numbers().iter().map(|number| number.to_bits()).collect()
}

#[test]
fn in_a_sealed_box_exploration_ends_and_says_what_is_hidden() {
    let mut head = head("box", 1);
    let (looks, ended) = looks(&mut head, PolicyKind::Sweep, 400);
    assert_eq!(ended, Ended::NothingLeft);
    assert!(looks.len() < 200, "{} looks", looks.len());
    let unseeable = head.coverage().unseeable(head.map());
    // The walls are 0.9 to 1.7 m away, and the grid goes from 0.5 to 6 m: ln(1.2 / 0.5) / ln(12) = 35 % of the cells are
    // before them.
    let hidden = unseeable.hidden_cells as f64 / unseeable.cells as f64;
    assert!((0.55..0.75).contains(&hidden), "{hidden}");
    assert!(unseeable.beyond_the_neck < 1e-9 && unseeable.without_reading < 0.02, "{unseeable:?}");
}

#[test]
fn where_there_is_more_to_see_exploration_goes_on() {
    let mut head = head("furnished", 1);
    assert_eq!(looks(&mut head, PolicyKind::View, 40).1, Ended::Steps);
}

#[test]
fn surfaces_without_readings_are_reported() {
    let mut head = head("glass_and_black", 1);
    looks(&mut head, PolicyKind::Sweep, 15);
    let share = head.coverage().unseeable(head.map()).without_reading;
    // The cupboard spans 34° to 67° of azimuth to the left at 1.4 m, the pane about as much to the right, the ceiling all
    // above 18 to 50°: between a tenth and a half of the sphere.
    assert!((0.1..0.5).contains(&share), "{share}");
}

#[test]
fn a_resumed_run_is_the_run() {
    let folder = TempDir::new().unwrap();
    let settings = |seed: u64| Settings {
        scene: String::from("office"),
        checksum: String::new(),
        seed,
        senses: String::from("depth"),
        policy: String::from("random gaze"),
        evidence: String::from("virtual"),
    };
    let never = AtomicBool::new(false);
    let policy =
        |head: &Head| PolicyKind::Random.policy(head.map(), &DepthCamera::default(), depth::MOST_TILT, 3);
    let go = |head: &mut Head, looks: &mut Vec<Look>, steps: usize, resume: bool| {
        let mut policy = policy(head);
        let mut checkpoint = Checkpoint::new(folder.path(), settings(3));
        if resume {
            *looks = checkpoint.resume(head, policy.as_mut()).unwrap();
        }
        run(head, policy.as_mut(), looks, steps, Some(&mut checkpoint), &never, |_, _| ()).unwrap()
    };
    let (mut whole, mut all) = (head("office", 3), Vec::new());
    go(&mut whole, &mut all, 9, false);
    go(&mut head("office", 3), &mut Vec::new(), 4, false);
    let (mut resumed, mut rest) = (head("office", 3), Vec::new());
    go(&mut resumed, &mut rest, 9, true);
    assert_eq!((all.len(), rest.len()), (9, 9));
    assert_eq!(bits(whole.map()), bits(resumed.map()));
    assert_eq!(whole.attitude(), resumed.attitude());
    assert_eq!(all[8].next, rest[8].next);
    let refused =
        Checkpoint::new(folder.path(), settings(4)).resume(&mut head("office", 4), policy(&whole).as_mut());
    let message = refused.unwrap_err().to_string();
    assert!(message.contains("it is of a run with scene office, seed 3"), "{message}");
}

#[test]
fn one_thread_and_four_give_the_same_bits() {
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let mut head = head("office", 2);
            looks(&mut head, PolicyKind::View, 5);
            bits(head.map())
        })
    };
    assert_eq!(with(1), with(4));
}

#[test]
fn a_gaze_that_is_a_closure_is_a_policy() {
    let mut head = head("empty", 1);
    let mut policy = |_: &Map, heading: &Heading| Ok(bvm::head::Gaze::at(heading.yaw + 0.5, 0.0));
    let (first, second) = (head.look(&mut policy).unwrap(), head.look(&mut policy).unwrap());
    assert_eq!((first.number, second.number), (1, 2));
    assert!((second.gaze.azimuth - 0.5).abs() < 1e-12);
    let depth = &second.senses[0];
    assert!(depth.sense == "depth" && depth.readings > 200 && depth.information > 100.0, "{depth:?}");
}

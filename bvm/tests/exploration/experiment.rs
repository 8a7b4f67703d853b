//! The experiment: the same figures for any number of threads, and after an interruption.
//!
//! In: a small plan. Out: runs and files. Invariant: only the times of decisions may differ.

use bvm::experiment::{Contender, Plan, Run, Summary};
use bvm::exploration::PolicyKind;
use bvm::head::real::Senses;
use bvm::world::scene::Scene;

fn plan() -> Plan {
    Plan {
        scenes: vec![Scene::furnished()],
        contenders: [PolicyKind::Inhibited, PolicyKind::Random].map(Contender::Policy).to_vec(),
        seeds: vec![1, 2],
        steps: 3,
        senses: None,
    }
}

fn without_times(mut runs: Vec<Run>) -> Vec<Run> {
    runs.iter_mut().for_each(|run| run.decision_us = 0.0);
    runs
}

#[test]
fn runs_are_the_same_for_one_and_four_threads_and_are_resumed() {
    let folder = tempfile::TempDir::new().unwrap();
    let [one, four] = [1, 4].map(|threads| {
        let out = folder.path().join(threads.to_string());
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        without_times(pool.install(|| plan().execute(&out, false, || ())).unwrap())
    });
    // Two policies, the oracle and the floor, with two seeds.
    assert_eq!((one.len(), &one), (8, &four));
    // One file is lost, one is cut short, as by an interruption of another program.
    let out = folder.path().join("1");
    let mut files: Vec<_> =
        std::fs::read_dir(out.join("runs")).unwrap().map(|file| file.unwrap().path()).collect();
    files.sort();
    assert_eq!(files.len(), 8);
    std::fs::remove_file(&files[0]).unwrap();
    std::fs::write(&files[1], "{\"scene\"").unwrap();
    let kept = std::fs::metadata(&files[2]).unwrap().modified().unwrap();
    assert_eq!(without_times(plan().execute(&out, true, || ()).unwrap()), one);
    assert_eq!(std::fs::metadata(&files[2]).unwrap().modified().unwrap(), kept, "not computed again");
    // Another length is another experiment.
    let longer = Plan { steps: 4, ..plan() }.execute(&out, true, || ()).unwrap();
    assert!(longer.iter().all(|run| run.looks.len() == 4));
    let summary = Summary::of(&one);
    assert_eq!(summary.figures.len(), 4);
    let of = |contender: Contender| summary.figures.iter().find(|one| one.contender == contender).unwrap();
    // The floor sees everything at once; nothing in view of a head is seen better.
    assert!(of(Contender::Floor).reachable.mean.abs() < 1e-9);
    for contender in [Contender::Oracle, Contender::Policy(PolicyKind::Inhibited)] {
        let share = of(contender).reachable.mean;
        assert!(share > 0.02 && share < 0.98, "{contender:?}: {share}");
    }
    assert!(summary.table("furnished").lines().all(|line| line.chars().count() <= 80));
    assert!(summary.table("furnished").contains('±'));
    let of_one: Vec<Run> = one.iter().filter(|run| run.seed == 1).cloned().collect();
    assert!(!Summary::of(&of_one).table("furnished").contains('±'), "one seed has no spread");
    let written = summary.write(&out).unwrap();
    assert!(written.iter().all(|path| path.is_file()));
    let csv = std::fs::read_to_string(out.join("summary.csv")).unwrap();
    assert_eq!(csv.lines().count(), 5);
    let columns: Vec<usize> = csv.lines().map(|line| line.split(',').count()).collect();
    assert!(columns.iter().all(|count| *count == columns[0]), "{columns:?}");
}

#[test]
fn the_whole_head_takes_part() {
    let scene = Scene::find("speaker_behind").unwrap();
    let senses = Senses { stereo: true, audio: true, imu: true, joint: false };
    let plan = Plan {
        scenes: vec![scene],
        contenders: vec![Contender::Policy(PolicyKind::Sweep)],
        seeds: vec![1],
        steps: 3,
        senses: Some(senses),
    };
    let runs = plan.measure(|| true).unwrap();
    let looks = &runs[0].looks;
    assert_eq!((runs.len(), looks.len()), (1, 3));
    // Each look takes the time that the ears listen, 0.3 s, and the turn before it.
    assert!(looks.windows(2).all(|pair| pair[1].seconds > pair[0].seconds + 0.3), "{looks:?}");
    assert!(looks[2].log_loss < looks[0].log_loss && looks[2].travel_rad > 0.5, "{looks:?}");
    // The map has the speaker where it is once the sweep has it in view, if at all.
    assert!(runs[0].found.body_s.is_none_or(|seconds| seconds >= looks[0].seconds));
}

//! Time and memory of all posteriors of the classic networks.
//!
//! In: the networks of a folder (`NETWORKS=folder`, or the recordings beside the project; each with a reference file
//! that gives its evidence; `ONLY=asia,alarm` selects networks). Out: a table, least of several runs, in milliseconds.
//! `peers.py` in this folder times another engine on the same networks and the same evidence.
//!
//! *load*: from the text to the tables. *plan*: triangulation, and tables that do not depend on the evidence. *ask*:
//! one question with an existing plan. *whole*: plan and ask. *batch*: a case among a thousand, all threads. *of read*:
//! the time to read the stored tables once, at the bandwidth of memory, divided by the time of an answer; above 1 if
//! they fit in a cache.

use bp_core::compiler::io::bif;
use bp_core::compiler::source::Source;
use bp_core::compiler::strategies::join_tree::{Marginals, Named, NetworkEvidence, answer_cases};
use std::path::PathBuf;
use std::time::Instant;

/// The least time of a task, in milliseconds: at least three runs, and half a second of them.
fn least(mut work: impl FnMut()) -> f64 {
    let (begin, mut best, mut runs) = (Instant::now(), f64::INFINITY, 0);
    while runs < 3 || (begin.elapsed().as_secs_f64() < 0.5 && runs < 100_000) {
        let start = Instant::now();
        work();
        best = best.min(start.elapsed().as_secs_f64() * 1e3);
        runs += 1;
    }
    best
}

/// Bytes that one thread reads in a second, from an array that no cache holds.
fn read_bandwidth() -> f64 {
    let numbers = vec![1.0f64; 1 << 26];
    let sum = || {
        let mut lanes = [0.0; 16];
        for row in numbers.chunks_exact(16) {
            lanes.iter_mut().zip(row).for_each(|(lane, number)| *lane += number);
        }
        std::hint::black_box(lanes);
    };
    8.0 * numbers.len() as f64 / (least(sum) / 1e3)
}

fn evidence(named: &Named, case: &serde_json::Value) -> NetworkEvidence {
    let hard = case["hard_evidence"].as_object().into_iter().flatten().filter_map(|(variable, value)| {
        Some((named.number_of(variable).ok()?, usize::try_from(value["index"].as_u64()?).ok()?))
    });
    NetworkEvidence { hard: hard.collect(), ..NetworkEvidence::default() }
}

fn main() {
    let beside = concat!(env!("CARGO_MANIFEST_DIR"), "/../../shared/data/networks");
    let folder = PathBuf::from(std::env::var("NETWORKS").unwrap_or_else(|_| beside.to_owned()));
    let Ok(entries) = std::fs::read_dir(&folder) else {
        println!("skipped: no folder {}", folder.display());
        return;
    };
    let mut files: Vec<PathBuf> = entries.filter_map(|entry| Some(entry.ok()?.path())).collect();
    files.retain(|path| path.extension().is_some_and(|end| end == "bif"));
    if let Ok(only) = std::env::var("ONLY") {
        files.retain(|path| path.file_stem().is_some_and(|name| only.split(',').any(|one| name == one)));
    }
    files.sort_by_key(|path| path.metadata().map_or(0, |data| data.len()));
    let bandwidth = read_bandwidth();
    println!("one thread reads {:.1} GB/s from memory", bandwidth / 1e9);
    let pools =
        [1, 2].map(|threads| rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads"));
    println!(
        "{:12} {:>8} {:>8} {:>9} {:>8} {:>9} {:>9} {:>9} {:>9} {:>9} {:>8}",
        "network",
        "evidence",
        "load",
        "cells",
        "plan",
        "ask 1",
        "ask 2",
        "whole 1",
        "whole 2",
        "batch",
        "of read"
    );
    for path in files {
        let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let text = std::fs::read_to_string(&path).expect("a file that is there");
        let read = || {
            let (model, _) = bif::read(&Source::new(name.clone(), text.clone())).expect("a network");
            Named::new(model, &[]).expect("tables")
        };
        let load = least(|| drop(read()));
        let named = read();
        let reference =
            std::fs::read_to_string(folder.join(format!("reference/{name}.json"))).unwrap_or_default();
        let reference: serde_json::Value = serde_json::from_str(&reference).unwrap_or_default();
        let every = named.shown();
        let all = reference["cases"].as_array().cloned().unwrap_or_default();
        for case in &all {
            let id = case["id"].as_str().unwrap_or_default();
            if !["prior", "ev1"].contains(&id) {
                continue;
            }
            let evidence = evidence(&named, case);
            // The same observed variables, with other values if the reference has such a case.
            let other = all.iter().filter(|other| other["id"] == format!("{id}b"));
            let others: Vec<NetworkEvidence> =
                [case].into_iter().chain(other).map(|case| self::evidence(&named, case)).collect();
            let given: Vec<usize> = evidence.hard.iter().map(|(variable, _)| *variable).collect();
            let make = || Marginals::new(&named.network, &given, &[], &every).expect("room");
            let plan = least(|| drop(make()));
            let marginals = make();
            let [ask_1, ask_2] = [0, 1].map(|pool| {
                pools[pool].install(|| {
                    let mut session = marginals.session();
                    least(|| session.ask(&evidence).expect("possible evidence"))
                })
            });
            let [whole_1, whole_2] = [0, 1].map(|pool| {
                pools[pool].install(|| least(|| make().session().ask(&evidence).expect("possible evidence")))
            });
            let cells = marginals.cost().cells;
            // Every stored number is read at least once: that time, as a share of the time of an answer.
            let limit = marginals.cost().bytes / bandwidth / (ask_1 / 1e3);
            let batch = match cells < 2e5 {
                true => {
                    let cases: Vec<NetworkEvidence> = others.iter().cycle().take(1000).cloned().collect();
                    let time =
                        least(|| drop(answer_cases(&named.network, &cases, &every, || {}).expect("room")));
                    format!("{:9.4}", time / 1000.0)
                }
                false => format!("{:>9}", "-"),
            };
            println!(
                "{name:12} {id:>8} {load:8.2} {cells:9.2e} {plan:8.3} {ask_1:9.4} {ask_2:9.4} {whole_1:9.3} {whole_2:9.3} {batch} {limit:>8.2}"
            );
        }
    }
}

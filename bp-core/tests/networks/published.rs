//! Network files: the classic networks, if the folder exists.
//!
//! In: the files of a folder that may be absent. Out: their sizes, compared with the literature.

use bp_core::compiler::io::{self, Format, Network, bif};
use bp_core::compiler::model::{Form, Model};
use bp_core::compiler::source::Source;
use std::path::Path;

const FOLDER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../shared/data/networks");

/// Nodes, arcs and free parameters of networks of the repository of bnlearn (Scutari, www.bnlearn.com/bnrepository).
const SIZES: [(&str, usize, usize, usize); 16] = [
    ("asia", 8, 8, 18),
    ("cancer", 5, 4, 10),
    ("earthquake", 5, 4, 10),
    ("sachs", 11, 17, 178),
    ("survey", 6, 6, 21),
    ("alarm", 37, 46, 509),
    ("child", 20, 25, 230),
    ("insurance", 27, 52, 1008),
    ("water", 32, 66, 10083),
    ("barley", 48, 84, 114005),
    ("hailfinder", 56, 66, 2656),
    ("hepar2", 70, 123, 1453),
    ("win95pts", 76, 112, 574),
    ("andes", 223, 338, 1157),
    ("link", 724, 1125, 14211),
    ("munin2", 1003, 1244, 69431),
];

#[test]
fn the_classic_networks_have_their_published_sizes() {
    if !Path::new(FOLDER).is_dir() {
        println!("skipped: no folder {FOLDER}");
        return;
    }
    for (name, nodes, arcs, parameters) in SIZES {
        let path = format!("{FOLDER}/{name}.bif");
        let source = Source::new(name, std::fs::read_to_string(&path).unwrap());
        let (model, _) =
            bif::read(&source).unwrap_or_else(|wrong| panic!("{}", wrong.render(&source, false)));
        let free: usize = (model.factors.values())
            .map(|factor| {
                let count = |id| model.variables[id].domain.count().unwrap();
                let rows: usize = factor.right.iter().map(|use_| count(use_.variable)).product();
                rows * (count(factor.left[0].variable) - 1)
            })
            .sum();
        let found: usize = model.factors.values().map(|factor| factor.right.len()).sum();
        assert_eq!((model.variables.len(), found, free), (nodes, arcs, parameters), "{name}");
    }
}

/// Every number of a network, table after table.
fn numbers(model: &Model) -> Vec<f64> {
    let constant = |id: &_| model.constant(*id).unwrap();
    (model.factors.values())
        .flat_map(|factor| match &factor.form {
            Form::Constants(numbers) => numbers.clone(),
            Form::Table(rows) => rows.iter().flatten().map(constant).collect(),
            Form::Categorical(row) => row.iter().map(constant).collect(),
            other => panic!("{}", other.name()),
        })
        .collect()
}

#[test]
fn the_classic_networks_go_through_every_format_without_loss() {
    if !Path::new(FOLDER).is_dir() {
        println!("skipped: no folder {FOLDER}");
        return;
    }
    for (name, ..) in SIZES {
        let source = Source::new(name, std::fs::read_to_string(format!("{FOLDER}/{name}.bif")).unwrap());
        let (model, warnings) = bif::read(&source).unwrap();
        let mut network = Network { model, known: Vec::new(), ln_scale: 0.0, warnings };
        let expected = numbers(&network.model);
        for format in Format::ALL {
            let written = Source::new("written", io::write(&network, format).unwrap());
            let back = io::read(&written, format)
                .unwrap_or_else(|wrong| panic!("{}", wrong.render(&written, false)));
            assert!(numbers(&back.model) == expected, "{name} {format:?}");
            assert_eq!(back.warnings, [], "{name} {format:?}");
            if format != Format::Uai {
                assert!(back.model.variables == network.model.variables, "{name} {format:?}");
                // The next format starts from the network that this one read back.
                network = back;
            }
        }
    }
}

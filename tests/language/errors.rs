//! Golden pages of error messages: the messages for the author of a wrong program.
//!
//! In: `tests/errors/*.bp`, and network files of other formats there, each with mistakes. Out: the rendered
//! diagnostics, compared with the `.txt` file of the same name; with `BLESS=1` in the environment the files are written
//! instead. Invariant: every program there is wrong, and every page belongs to one of them.

use bp_core::compiler::io::{self, Format};
use bp_core::compiler::source::Source;
use std::path::PathBuf;

/// The wrong files: programs, and networks of every format.
fn wrong_files() -> Vec<PathBuf> {
    Format::ALL.into_iter().flat_map(|format| pages(format.endings()[0])).collect()
}

fn pages(extension: &str) -> Vec<PathBuf> {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/errors");
    let entries = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let mut paths: Vec<_> =
        entries.filter(|path| path.extension().is_some_and(|found| found == extension)).collect();
    paths.sort();
    paths
}

#[test]
fn wrong_programs_get_the_pages_beside_them() {
    let bless = std::env::var_os("BLESS").is_some_and(|value| value == "1");
    let programs = wrong_files();
    assert!(programs.len() >= 25, "only {} wrong programs", programs.len());
    let mut different = Vec::new();
    for path in &programs {
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        let source = Source::new(name.clone(), std::fs::read_to_string(path).unwrap());
        let page = match io::read(&source, Format::of(path).unwrap()) {
            Ok(_) => panic!("{name} is not wrong"),
            Err(wrong) => wrong.render(&source, false),
        };
        let beside = path.with_extension("txt");
        if bless {
            std::fs::write(&beside, &page).unwrap();
        } else if std::fs::read_to_string(&beside).unwrap_or_default() != page {
            different.push(format!("{name} now reads\n{page}"));
        }
    }
    assert!(different.is_empty(), "BLESS=1 accepts these pages:\n{}", different.join("\n"));
    let kept: Vec<_> = programs.iter().map(|path| path.with_extension("txt")).collect();
    let orphans: Vec<_> = pages("txt").into_iter().filter(|page| !kept.contains(page)).collect();
    assert!(orphans.is_empty(), "pages without a program: {orphans:?}");
}

#[test]
fn no_page_shows_the_names_of_rules() {
    for page in pages("txt") {
        let text = std::fs::read_to_string(&page).unwrap();
        for rule in ["kw_", "close_", "open_paren", "open_brace", "named_form", "occurrence"] {
            assert!(!text.contains(rule), "{} contains {rule}", page.display());
        }
    }
}

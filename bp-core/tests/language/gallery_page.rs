//! The commands of the gallery's page: `docs/gallery.md` shows the output of `bp`.
//!
//! In: the page. Out: pass or fail; with `BLESS=1` the page is rewritten, for review. Invariant: the commands run in a folder
//! that holds only the examples, and every program of the gallery is asked or learned, none only checked.

use crate::course::copy;
use crate::shown::Shown;
use std::path::Path;

#[test]
fn the_page_shows_the_output_of_bp() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let folder = tempfile::tempdir().unwrap();
    for part in ["examples", "examples/data"] {
        copy(&root, part, folder.path());
    }
    let bp = Shown { name: "bp", program: env!("CARGO_BIN_EXE_bp"), folder: folder.path() };
    let commands = bp.check(&root.join("docs/gallery.md"));
    assert!(commands >= 30, "only {commands} commands on the page");
}

#[test]
fn every_program_of_the_gallery_is_asked() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let page = std::fs::read_to_string(root.join("docs/gallery.md")).unwrap();
    for part in page.split("\n### ").skip(1) {
        let title = part.lines().next().unwrap();
        assert!(part.contains("$ bp ask ") || part.contains("\n$ bp learn "), "{title} is only checked");
    }
    for entry in std::fs::read_dir(root.join("examples")).unwrap().map(|entry| entry.unwrap().path()) {
        if entry.extension().is_some_and(|extension| extension == "bp") {
            let name = entry.file_name().unwrap().to_string_lossy().into_owned();
            assert!(page.contains(&format!("(../examples/{name})")), "{name} is not on the page");
        }
    }
}

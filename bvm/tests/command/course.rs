//! The commands `bvm` of the course: `docs/course/*.md` show their output.
//!
//! In: the pages. Out: pass or fail; with `BLESS=1` they are rewritten, for review.

use super::shown::Shown;
use std::path::Path;

#[test]
fn the_pages_show_the_output_of_bvm() {
    let pages = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/course");
    let folder = tempfile::tempdir().unwrap();
    let bvm = Shown { name: "bvm", program: env!("CARGO_BIN_EXE_bvm"), folder: folder.path() };
    let mut paths: Vec<_> = std::fs::read_dir(pages).unwrap().map(|entry| entry.unwrap().path()).collect();
    paths.sort();
    let commands: usize = paths.iter().map(|path| bvm.check(path)).sum();
    assert!(commands > 0, "no page shows `bvm`");
}

//! The constants of the map that stand outside its programs: each is in the table of docs/models.md.
//!
//! In: the sources of the senses, the map and its policies; the table. Out: pass or fail. Invariant: the table names every
//! constant of these folders that is a real number, or a list of such, with its file, and nothing else.

use std::collections::BTreeSet;
use std::fs::{read_dir, read_to_string};
use std::path::Path;

/// Folders of `bvm/src` whose constants may change what the map says.
const FOLDERS: [&str; 6] = ["audition", "exploration", "head", "map", "vestibular", "vision"];

/// Parts of these that only draw and write.
const PICTURES: [&str; 2] = ["exploration/page", "exploration/report.rs"];

/// Pairs of a file and a constant in it.
type Constants = BTreeSet<(String, String)>;

/// The real constants of a file or a folder.
fn add(root: &Path, path: &Path, found: &mut Constants) {
    let name = path.strip_prefix(root).unwrap().to_string_lossy().replace('\\', "/");
    if PICTURES.contains(&name.as_str()) {
        return;
    }
    if path.is_dir() {
        read_dir(path).unwrap().for_each(|entry| add(root, &entry.unwrap().path(), found));
        return;
    }
    for line in read_to_string(path).unwrap().lines() {
        let Some((before, after)) = line.split_once("const ") else { continue };
        let is_item = before.trim().is_empty() || before.trim().starts_with("pub");
        let Some((constant, kind)) = after.split_once(": ") else { continue };
        if is_item && ["f32", "f64", "[f32", "[f64"].iter().any(|real| kind.starts_with(real)) {
            found.insert((name.clone(), constant.to_owned()));
        }
    }
}

/// The words in code marks.
fn marked(cell: &str) -> impl Iterator<Item = &str> {
    cell.split('`').skip(1).step_by(2)
}

#[test]
fn constants_outside_the_programs_are_listed() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let sources = root.join("bvm/src");
    let mut found = Constants::new();
    FOLDERS.iter().for_each(|folder| add(&sources, &sources.join(folder), &mut found));
    assert!(found.len() > 50, "only {} constants found", found.len());
    let page = read_to_string(root.join("docs/models.md")).unwrap();
    let table = page.split("## What stands outside the programs").nth(1).expect("the section is there");
    let rows = table.lines().skip_while(|line| !line.starts_with("|---"));
    let mut listed = Constants::new();
    for row in rows.skip(1).take_while(|line| line.starts_with('|')) {
        let cells: Vec<&str> = row.split('|').collect();
        let file = marked(cells[1]).next().unwrap_or_else(|| panic!("{row}"));
        listed.extend(marked(cells[2]).map(|constant| (file.to_owned(), constant.to_owned())));
    }
    let missing: Vec<_> = found.difference(&listed).collect();
    let stale: Vec<_> = listed.difference(&found).collect();
    assert!(missing.is_empty(), "not in the table of docs/models.md: {missing:?}");
    assert!(stale.is_empty(), "in the table of docs/models.md, but not in the code: {stale:?}");
}

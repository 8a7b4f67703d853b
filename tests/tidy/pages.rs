//! The pages: every program in them compiles, every mistake in them gives the stated message, and links have targets.
//!
//! In: `README.md`, `docs/*.md`, `docs/reference/*.md` and `docs/course/*.md`. Out: pass or fail. Blocks marked `bp` must compile, print to text with the same
//! meaning, and have an answer to each question; those marked `bp-unanswered` have none. Blocks marked `bp-error` must
//! not compile: their first line is `// ` and the message. Invariant: the pages describe the current language.

use bp_core::compiler::answer::plan_sized;
use bp_core::compiler::exec::Inputs;
use bp_core::compiler::plan::{Options, plan};
use bp_core::compiler::source::Source;
use bp_core::compiler::syntax::{compile, parse};
use std::path::{Path, PathBuf};

/// A page's path from the root, and its text.
fn pages() -> Vec<(PathBuf, String)> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let entries = ["docs", "docs/reference", "docs/course"]
        .into_iter()
        .flat_map(|folder| std::fs::read_dir(root.join(folder)).unwrap().map(|entry| entry.unwrap().path()));
    let mut paths: Vec<_> =
        entries.filter(|path| path.extension().is_some_and(|found| found == "md")).collect();
    paths.push(root.join("README.md"));
    paths.sort();
    paths.into_iter().map(|path| (path.clone(), std::fs::read_to_string(path).unwrap())).collect()
}

/// The fenced blocks of a page with this mark: the line where each begins, and its text.
fn blocks<'t>(text: &'t str, mark: &str) -> Vec<(usize, String)> {
    let (mut found, mut open): (Vec<(usize, String)>, Option<&'t str>) = (Vec::new(), None);
    for (number, line) in text.lines().enumerate() {
        match (line.trim_start().strip_prefix("```"), open) {
            (Some(kind), None) => {
                open = Some(kind);
                if kind == mark {
                    found.push((number + 1, String::new()));
                }
            }
            (Some(_), Some(_)) => open = None,
            (None, Some(kind)) if kind == mark => {
                let (_, block) = found.last_mut().unwrap();
                block.push_str(line);
                block.push('\n');
            }
            _ => {}
        }
    }
    assert!(open.is_none(), "a block is not closed");
    found
}

#[test]
fn programs_in_the_pages_compile_print_back_and_are_answered() {
    let (mut count, mut wrong) = (0, Vec::new());
    for (path, text) in pages() {
        let answered = blocks(&text, "bp").into_iter().map(|(line, block)| (line, block, true));
        let unanswered = blocks(&text, "bp-unanswered").into_iter().map(|(line, block)| (line, block, false));
        for (line, block, answered) in answered.chain(unanswered) {
            count += 1;
            let source = Source::new(format!("{}:{line}", path.display()), block);
            match compile(&source) {
                Err(mistakes) => wrong.push(mistakes.render(&source, false)),
                Ok(model) => {
                    let printed = Source::new("printed", parse(&source).unwrap().to_string());
                    assert_eq!(compile(&printed).unwrap(), model, "{}:{line}", path.display());
                    for question in model.questions.values() {
                        let planned = plan(&model, question, Options::default());
                        // Families of known sizes may be answered element by element.
                        let sized =
                            || plan_sized(&model, question, Options::default(), &Inputs::new()).is_ok();
                        let is_answered = planned.is_ok() || sized();
                        assert_eq!(is_answered, answered, "{}:{line}: {planned:?}", path.display());
                    }
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert!(count >= 15, "only {count} programs in the pages");
}

#[test]
fn mistakes_in_the_pages_have_the_messages_that_are_shown() {
    for (path, text) in pages() {
        for (line, block) in blocks(&text, "bp-error") {
            let place = format!("{}:{line}", path.display());
            let message = block.lines().next().and_then(|first| first.strip_prefix("// "));
            let message = message.unwrap_or_else(|| panic!("{place} does not begin with its message"));
            let Err(mistakes) = compile(&Source::new("page", block.as_str())) else {
                panic!("{place} compiles")
            };
            let found: Vec<_> = mistakes.iter().map(|mistake| mistake.message.as_str()).collect();
            assert!(found.contains(&message), "{place} shows `{message}`, but the messages are {found:#?}");
        }
    }
}

/// The name of a heading in links, as GitHub and mdBook make it.
fn anchor(heading: &str) -> String {
    let kept = heading.chars().filter(|character| character.is_alphanumeric() || " -_".contains(*character));
    kept.collect::<String>().trim().to_lowercase().replace(' ', "-")
}

/// The anchors of a page: those of its headings, the second of the same name with `-1`.
fn anchors(text: &str) -> Vec<String> {
    let (mut found, mut inside): (Vec<String>, bool) = (Vec::new(), false);
    for line in text.lines() {
        if line.trim_start().starts_with("```") {
            inside = !inside;
        } else if let (false, Some((level, heading))) = (inside, line.split_once("# "))
            && level.chars().all(|character| character == '#')
        {
            let name = anchor(heading);
            let before = found.iter().filter(|one| **one == name).count();
            found.push(if before == 0 { name } else { format!("{name}-{before}") });
        }
    }
    found
}

#[test]
fn links_lead_somewhere() {
    let (mut dead, mut count) = (Vec::new(), 0);
    for (path, text) in pages() {
        for (before, after) in text.match_indices("](").map(|(at, _)| text.split_at(at)) {
            let opened = before.rfind('[').unwrap_or(0);
            let target = after[2..].split(')').next().unwrap_or_default();
            let (file, heading) = target.split_once('#').unwrap_or((target, ""));
            if file.contains("://") {
                continue;
            }
            count += 1;
            let folder = path.parent().unwrap();
            let there = if file.is_empty() { path.clone() } else { folder.join(file) };
            // A checkout without the pictures has none of them.
            let is_picture = before[..opened].ends_with('!');
            let known = is_picture && !folder.join(file).parent().is_some_and(Path::exists) || there.exists();
            let headed = heading.is_empty()
                || std::fs::read_to_string(&there)
                    .is_ok_and(|page| anchors(&page).iter().any(|one| one == heading));
            if !known || !headed {
                dead.push(format!("{}: {target}", path.display()));
            }
        }
    }
    assert!(dead.is_empty(), "{} dead links:\n{}", dead.len(), dead.join("\n"));
    assert!(count > 150, "only {count} links");
}

#[test]
fn the_book_lists_every_page() {
    let docs = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs");
    let summary = std::fs::read_to_string(docs.join("SUMMARY.md")).unwrap();
    for (path, _) in pages() {
        let Ok(page) = path.strip_prefix(&docs) else { continue };
        let page = page.to_string_lossy().replace('\\', "/");
        assert!(page == "SUMMARY.md" || summary.contains(&format!("]({page})")), "{page} is not in the book");
    }
}

#[test]
fn the_list_of_examples_is_complete() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let readme = std::fs::read_to_string(root.join("README.md")).unwrap();
    let mut listed: Vec<_> = (readme.lines())
        .filter_map(|line| line.strip_prefix("| [`")?.split('`').next())
        .map(str::to_owned)
        .collect();
    let entries = std::fs::read_dir(root.join("examples")).unwrap().map(|entry| entry.unwrap().path());
    let mut there: Vec<_> = (entries.filter(|path| path.extension().is_some_and(|found| found == "rs")))
        .map(|path| path.file_stem().unwrap().to_string_lossy().into_owned())
        .collect();
    listed.sort();
    there.sort();
    assert_eq!(listed, there, "README's table of examples, and the folder");
}

#[test]
fn examples_are_short_and_end_in_an_assert() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let entries = std::fs::read_dir(root.join("examples")).unwrap().map(|entry| entry.unwrap().path());
    for path in entries.filter(|path| path.extension().is_some_and(|found| found == "rs")) {
        let text = std::fs::read_to_string(&path).unwrap();
        let lines: Vec<_> = text.lines().collect();
        assert!(lines[0].starts_with("//!"), "{} has no documentation", path.display());
        assert!(lines.len() < 60, "{} has {} lines", path.display(), lines.len());
        assert!(text.contains("assert"), "{} asserts nothing", path.display());
    }
}

//! The course: its commands, its programs, its calculations, its pictures and its exercises.
//!
//! In: `docs/course/*.md`, `examples/course`, `examples/course.rs`. Out: pass or fail; `BLESS=1` writes outputs, programs and
//! pictures anew, for review. Invariant: every number with a decimal point in the text is one that a command prints, that
//! stands in a program, or that a calculation on the page has; an answer of an exercise is computed twice, by `bp` and by hand.

use crate::arithmetic::value;
use crate::pages::root;
use crate::shown::Shown;
use std::path::{Path, PathBuf};

#[allow(dead_code)]
#[path = "../../../examples/course.rs"]
mod hints;

/// A page of the course.
struct Page {
    path: PathBuf,
    /// `01_coin`.
    name: String,
    text: String,
}

/// Every page of the course.
fn pages() -> Vec<Page> {
    let entries = std::fs::read_dir(root().join("docs/course")).unwrap().map(|entry| entry.unwrap().path());
    let mut found: Vec<Page> = entries
        .map(|path| {
            let name = path.file_stem().unwrap().to_string_lossy().into_owned();
            Page { text: std::fs::read_to_string(&path).unwrap(), path, name }
        })
        .collect();
    found.sort_by(|one, other| one.name.cmp(&other.name));
    found
}

/// Those that are lessons.
fn lessons() -> Vec<Page> {
    pages().into_iter().filter(|page| page.name.starts_with(|first: char| first.is_ascii_digit())).collect()
}

/// Copies the files of a folder, without those of the folders in it.
pub(crate) fn copy(root: &Path, part: &str, to: &Path) {
    std::fs::create_dir_all(to.join(part)).unwrap();
    for entry in std::fs::read_dir(root.join(part)).unwrap().map(|entry| entry.unwrap()) {
        if entry.path().is_file() {
            std::fs::copy(entry.path(), to.join(part).join(entry.file_name())).unwrap();
        }
    }
}

/// A folder with the programs that the pages ask.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    for part in ["examples/course", "examples/course/solutions", "bvm/models", "docs/images/course"] {
        copy(&root(), part, folder.path());
    }
    folder
}

/// The text without its blocks of code.
fn prose(text: &str) -> String {
    let mut inside = false;
    let mut kept = String::new();
    for line in text.lines() {
        match line.starts_with("```") {
            true => inside = !inside,
            false if !inside => kept.push_str(&format!("{line}\n")),
            false => {}
        }
    }
    kept
}

/// The calculations of a text: `` `3 / 6` = 0.5 `` has its text, and the number as it is written.
fn calculations(text: &str) -> Vec<(String, String)> {
    let text = text.replace('\n', " ");
    let pieces: Vec<&str> = text.split('`').collect();
    let mut found = Vec::new();
    // Odd pieces stand between backquotes.
    for (place, piece) in pieces.iter().enumerate().filter(|(place, _)| place % 2 == 1) {
        if let Some(rest) = pieces.get(place + 1).and_then(|after| after.trim_start().strip_prefix("= ")) {
            let is_part = |character: char| character.is_ascii_digit() || "-.".contains(character);
            let number: String =
                rest.trim_start().chars().take_while(|character| is_part(*character)).collect();
            found.push(((*piece).to_owned(), number.trim_end_matches('.').to_owned()));
        }
    }
    found
}

/// Half a unit of the last digit of a number as it is written.
fn half_unit(number: &str) -> f64 {
    let decimals = number.split_once('.').map_or(0, |(_, decimals)| decimals.len());
    0.5 * 10f64.powi(-(decimals as i32))
}

/// Whether a number is another one, rounded as it is written.
fn is_rounded(written: &str, exact: f64) -> bool {
    let number: f64 = written.parse().unwrap_or(f64::NAN);
    (number - exact).abs() <= half_unit(written) * 1.000_001
}

/// The numbers of a text, each as it is written.
fn numbers(text: &str) -> Vec<String> {
    let is_part = |character: char| character.is_ascii_alphanumeric() || "._".contains(character);
    let pieces = text.split(|character: char| !is_part(character)).map(|piece| piece.trim_matches('.'));
    pieces
        .filter(|piece| piece.starts_with(|first: char| first.is_ascii_digit()))
        .filter(|piece| piece.parse::<f64>().is_ok())
        .map(str::to_owned)
        .collect()
}

#[test]
fn the_pages_show_the_output_of_bp() {
    let mut commands = 0;
    for page in pages() {
        let folder = folder();
        let bp = Shown { name: "bp", program: env!("CARGO_BIN_EXE_bp"), folder: folder.path() };
        commands += bp.check(&page.path);
    }
    assert!(commands >= 100, "only {commands} commands in the course");
}

#[test]
fn programs_on_the_pages_are_those_of_the_files() {
    let lessons = lessons();
    assert!(lessons.len() >= 15, "{} lessons", lessons.len());
    for page in lessons {
        let file = root().join(format!("examples/course/{}.bp", page.name));
        let program = std::fs::read_to_string(&file).unwrap();
        // A program that is still to be learned has no answer yet.
        let mark = if page.text.contains("```bp\n") { "```bp\n" } else { "```bp-unanswered\n" };
        let (before, rest) = page.text.split_once(mark).expect("a program");
        let (there, after) = rest.split_once("```").expect("the end of a program");
        if std::env::var_os("BLESS").is_some() {
            std::fs::write(&page.path, format!("{before}{mark}{program}```{after}")).unwrap();
        } else {
            assert!(there == program, "{}: not the program of {file:?}", page.name);
        }
        assert!(!after.contains("```bp\n"), "{} has two programs", page.name);
    }
}

#[test]
fn calculations_have_the_values_that_are_stated() {
    let mut count = 0;
    for page in pages() {
        for (calculation, stated) in calculations(&prose(&page.text)) {
            let exact = value(&calculation).unwrap_or_else(|error| panic!("{}: {error}", page.name));
            assert!(is_rounded(&stated, exact), "{}: `{calculation}` is {exact}, not {stated}", page.name);
            count += 1;
        }
    }
    assert!(count >= 200, "only {count} calculations in the course");
}

#[test]
fn numbers_in_the_text_stand_in_an_output_a_program_or_a_calculation() {
    let mut loose = Vec::new();
    for page in pages() {
        let text = prose(&page.text);
        // An exercise states numbers of its own.
        let lesson = text.split("## Exercises").next().unwrap_or("");
        let outside: String = lesson.split('`').step_by(2).collect::<Vec<_>>().join(" ");
        // Names of exercises and targets of links are no statements.
        let outside: String = outside.split("**").step_by(2).collect();
        let outside: String =
            outside.split("](").map(|part| part.split_once(')').map_or(part, |(_, rest)| rest)).collect();
        let outside: String =
            outside.lines().filter(|line| !line.starts_with('#')).collect::<Vec<_>>().join("\n");
        let inside: String =
            page.text.lines().filter(|line| !text.contains(*line)).collect::<Vec<_>>().join("\n");
        let mut held: Vec<f64> = numbers(&inside).iter().filter_map(|number| number.parse().ok()).collect();
        for (calculation, stated) in calculations(&text) {
            held.extend(value(&calculation).ok().into_iter().chain(stated.parse().ok()).map(f64::abs));
            held.extend(numbers(&calculation).iter().filter_map(|number| number.parse::<f64>().ok()));
        }
        for number in numbers(&outside).iter().filter(|number| number.contains('.')) {
            if !held.iter().any(|held| is_rounded(number, *held)) {
                loose.push(format!("{}: {number}", page.name));
            }
        }
    }
    assert!(loose.is_empty(), "nothing on the page holds {loose:?}");
}

#[test]
fn pictures_are_those_that_the_commands_of_the_pages_draw() {
    for page in lessons() {
        let folder = folder();
        let bp = Shown { name: "bp", program: env!("CARGO_BIN_EXE_bp"), folder: folder.path() };
        let drawing =
            page.text.lines().filter(|line| line.starts_with("bp ") && line.contains("docs/images/course/"));
        let mut drawn = 0;
        for line in drawing {
            let picture = line.rsplit(' ').next().unwrap();
            std::fs::remove_file(folder.path().join(picture)).ok();
            bp.run(line.strip_prefix("bp ").unwrap());
            let (found, there) = (folder.path().join(picture), root().join(picture));
            if std::env::var_os("BLESS").is_some() {
                std::fs::copy(&found, &there).unwrap();
            }
            assert!(
                std::fs::read(&found).unwrap() == std::fs::read(&there).unwrap_or_default(),
                "{picture} has changed"
            );
            assert!(
                page.text.contains(&format!("](../../{picture})").replace("../../docs", "..")),
                "{picture} is not shown"
            );
            drawn += 1;
        }
        assert!(drawn > 0, "{} has no picture", page.name);
    }
}

/// The parts of the solutions: the name of an exercise, and its text.
fn solutions() -> Vec<(String, String)> {
    let page = pages().into_iter().find(|page| page.name == "solutions").expect("the solutions");
    let parts = page.text.split("\n### ").skip(1);
    parts
        .map(|part| part.split_once('\n').unwrap())
        .map(|(name, text)| (name.to_owned(), text.to_owned()))
        .collect()
}

#[test]
fn every_exercise_has_a_solution() {
    let mut exercises = Vec::new();
    for page in lessons() {
        let text = page.text.split_once("## Exercises").expect("exercises").1;
        exercises.extend(
            text.lines().filter_map(|line| line.strip_prefix("- **")?.split("**").next()).map(str::to_owned),
        );
    }
    let solved: Vec<String> = solutions().into_iter().map(|(name, _)| name).collect();
    assert_eq!(exercises, solved);
    assert!(exercises.len() >= 45);
}

#[test]
fn answers_of_exercises_are_those_of_bp_and_mistakes_are_others() {
    for (name, text) in solutions() {
        let (outputs, rest) = text.split_once("**Answer**").unwrap_or_else(|| panic!("{name} has no answer"));
        let (answer, mistakes) =
            rest.split_once("| if you got |").unwrap_or_else(|| panic!("{name} has no hints"));
        let (_, right) = calculations(answer).pop().unwrap_or_else(|| panic!("{name} has no calculation"));
        let printed = numbers(outputs.split("```text").skip(1).collect::<String>().as_str());
        // By hand a solution is rounded between its steps.
        let near = |number: &String| {
            let (found, right): (f64, f64) = (number.parse().unwrap(), right.parse().unwrap());
            (found - right).abs() <= 1e-5 * right.abs()
        };
        assert!(printed.iter().any(near), "{name}: `bp` prints {printed:?}, but the answer is {right}");
        let mistakes = calculations(mistakes);
        assert!(mistakes.len() >= 2, "{name} has {} hints", mistakes.len());
        for (calculation, wrong) in mistakes {
            let (wrong, right): (f64, f64) = (wrong.parse().unwrap(), right.parse().unwrap());
            let apart = (wrong - right).abs() > 2.0 * hints::SHARE * right.abs();
            assert!(apart, "{name}: `{calculation}` = {wrong} is too near to the answer {right}");
        }
    }
}

#[test]
fn an_answer_is_judged_and_a_common_mistake_has_its_hint() {
    let judged = |exercise: &str, number: f64| hints::judge(exercise, number).unwrap();
    assert!(judged("1.1", 1.0 / 6.0).contains("right"));
    assert!(judged("1.1", 0.05).contains("Divide it by the probability of tails"));
    assert!(judged("1.1", 0.3).contains("not the answer"));
    for (name, text) in solutions() {
        let (_, rest) = text.split_once("**Answer**").unwrap();
        let (answer, mistakes) = rest.split_once("| if you got |").unwrap();
        let (_, right) = calculations(answer).pop().unwrap();
        assert!(judged(&name, right.parse().unwrap()).contains("right"), "{name}");
        for (_, wrong) in calculations(mistakes) {
            let said = judged(&name, wrong.parse().unwrap());
            assert!(
                !said.contains("is right") && !said.contains("not the answer"),
                "{name}: {wrong}: {said}"
            );
        }
    }
    assert!(hints::judge("99.1", 1.0).is_err());
}

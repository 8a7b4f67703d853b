//! Thousands of wrong programs: no panic, no hang, and no NaN in an answer.
//!
//! In: programs of the gallery with bytes flipped and with tokens deleted, doubled and swapped, and arbitrary bytes;
//! all seeded. Out: pass or fail. Invariant: a text that compiles is also printed, planned and, if its plan is cheap,
//! asked.

use bp_core::compiler::answer::ask;
use bp_core::compiler::answer::link;
use bp_core::compiler::exec::Inputs;
use bp_core::compiler::model::Model;
use bp_core::compiler::plan::{Options, Route, plan_for_answer};
use bp_core::compiler::source::Source;
use bp_core::compiler::syntax::{check, compile, parse, parse_question};

/// Upper limit on the joint values of all variables for which a mutant is asked: the sum of a mutant may run over all
/// of them.
const MOST_VALUES: f64 = 3e5;

/// SplitMix64 (Steele, Lea and Flood 2014).
struct Random(u64);

impl Random {
    fn below(&mut self, bound: usize) -> usize {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut mixed = (self.0 ^ self.0 >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        mixed = (mixed ^ mixed >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((mixed ^ mixed >> 31) % bound.max(1) as u64) as usize
    }
}

fn gallery() -> Vec<(String, String)> {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/examples");
    let paths = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let mut paths: Vec<_> =
        paths.filter(|path| path.extension().is_some_and(|found| found == "bp")).collect();
    paths.sort();
    let text = |path: &std::path::PathBuf| std::fs::read_to_string(path).unwrap();
    paths.iter().map(|path| (path.display().to_string(), text(path))).collect()
}

/// Words, numbers and signs; blanks belong to the preceding token.
fn tokens(text: &str) -> Vec<&str> {
    let mut tokens = Vec::new();
    let mut start = 0;
    let kind = |character: char| match character {
        _ if character.is_alphanumeric() || character == '_' => 0,
        _ if character.is_whitespace() => 1,
        _ => 2,
    };
    let characters: Vec<(usize, char)> = text.char_indices().collect();
    for pair in characters.windows(2) {
        let (before, after) = (kind(pair[0].1), kind(pair[1].1));
        if before != after && after != 1 || before == 2 && after == 2 {
            tokens.push(&text[start..pair[1].0]);
            start = pair[1].0;
        }
    }
    tokens.push(&text[start..]);
    tokens
}

/// One to three changes.
fn mutant(text: &str, random: &mut Random) -> String {
    let mut text = text.to_owned();
    for _ in 0..=random.below(3) {
        if random.below(5) == 0 {
            let mut bytes = text.into_bytes();
            let at = random.below(bytes.len());
            bytes[at] ^= 1 << random.below(8);
            text = String::from_utf8_lossy(&bytes).into_owned();
            continue;
        }
        let mut words: Vec<String> = tokens(&text).into_iter().map(str::to_owned).collect();
        let (one, other) = (random.below(words.len()), random.below(words.len()));
        match random.below(4) {
            0 => drop(words.remove(one)),
            1 => words.insert(one, words[one].clone()),
            2 => words.swap(one, other),
            _ => words[one] = words[other].clone(),
        }
        text = words.concat();
    }
    text
}

fn values(model: &Model) -> f64 {
    let count = |domain: &bp_core::compiler::model::Domain| domain.count().map_or(1.0, |count| count as f64);
    let one =
        |model: &Model| model.variables.values().map(|variable| count(&variable.domain)).product::<f64>();
    let subroutines = model.subroutines.iter().map(|subroutine| one(&subroutine.program));
    subroutines.fold(one(model), f64::max)
}

/// Processes a text completely; returns whether it compiled and whether it was asked.
fn put_through(text: &str) -> (bool, bool) {
    let source = Source::new("mutant", text);
    let tree = match parse(&source) {
        Err(wrong) => {
            assert!(!wrong.render(&source, false).is_empty());
            return (false, false);
        }
        Ok(tree) => tree,
    };
    let printed = Source::new("printed", tree.to_string());
    let again = parse(&printed).unwrap_or_else(|wrong| panic!("{}", wrong.render(&printed, false)));
    assert_eq!(again.to_string(), printed.text, "printed twice, from\n{text}");
    if let Err(wrong) = check(&tree) {
        assert!(!wrong.render(&source, false).is_empty());
        return (false, false);
    }
    let model = compile(&source).unwrap();
    if values(&model) > MOST_VALUES {
        return (true, false);
    }
    let Ok(model) = link(&model) else { return (true, false) };
    let mut asked = false;
    for question in model.questions.values() {
        let Ok(plan) = plan_for_answer(&model, question, Options::default()) else { continue };
        let cheap = plan.routes.iter().all(|route| match route {
            Route::Exact(exact) => exact.cost <= MOST_VALUES,
            Route::Tree(_) | Route::Gaussian(_) | Route::Conjugate(_) | Route::Precision(_) => true,
            Route::Mixture(mixture) => mixture.components <= MOST_VALUES,
            Route::Summed(_) => true,
            // A hundred thousand draws of each mutant would take too long.
            Route::Sampled(_) | Route::OverTime(_) => false,
        });
        if cheap && let Ok(answers) = ask(&model, question, &Inputs::new()) {
            let numbers = answers.iter().flat_map(|answer| &answer.answer).filter_map(|row| row.p());
            numbers.for_each(|p| assert!(p.is_finite() && p >= 0.0, "{p} from\n{text}"));
            asked = true;
        }
    }
    (true, asked)
}

#[test]
fn mutants_of_the_gallery() {
    let mut random = Random(7);
    let (mut compiled, mut asked) = (0, 0);
    for (name, text) in gallery() {
        for number in 0..60 {
            let mutant = mutant(&text, &mut random);
            let done = std::panic::catch_unwind(|| put_through(&mutant));
            let (one, other) = done.unwrap_or_else(|_| panic!("mutant {number} of {name}:\n{mutant}"));
            compiled += usize::from(one);
            asked += usize::from(other);
        }
    }
    assert!(compiled > 50 && asked > 20, "{compiled} mutants compile, {asked} are answered: too few");
}

#[test]
fn arbitrary_bytes() {
    let mut random = Random(11);
    let words = "program P ( ) { } [ ] | = : ; , . ^ -1 ..= in over variables forms question uniform normal bool 0 1e9 X Y";
    let words: Vec<&str> = words.split(' ').collect();
    for number in 0..3000 {
        let length = random.below(120);
        let text = match number % 3 {
            0 => String::from_utf8_lossy(&(0..length).map(|_| random.below(256) as u8).collect::<Vec<_>>())
                .into_owned(),
            1 => (0..length).map(|_| char::from(32 + random.below(95) as u8)).collect(),
            _ => (0..length).map(|_| words[random.below(words.len())].to_owned() + " ").collect(),
        };
        put_through(&text);
    }
}

#[test]
fn questions_that_are_wrong() {
    let mut random = Random(13);
    for (name, text) in gallery() {
        let model = compile(&Source::new(name.as_str(), text.as_str())).unwrap();
        let known: Vec<String> = model
            .questions
            .values()
            .flat_map(|question| &question.asks)
            .map(|ask| model.ask_text(ask))
            .collect();
        for _ in 0..60 {
            let typed = mutant(&known[random.below(known.len())], &mut random);
            let source = Source::new("question", typed);
            match parse_question(&source, &model) {
                Err(wrong) => assert!(!wrong.render(&source, false).is_empty()),
                Ok(question) => drop(plan_for_answer(&model, &question, Options::default())),
            }
        }
    }
}

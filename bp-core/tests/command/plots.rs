//! `bp ask --plot`, `bp learn --plot`: pictures of answers and of learning.
//!
//! In: programs and data. Out: PNG and SVG files, read back. Invariant: the table is printed all the same; nothing is
//! written where there is nothing to draw.
#![cfg(feature = "plot")]

use roxmltree::Document;
use std::path::Path;
use std::process::{Command, Output};

fn root() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/.."))
}

fn bp(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_bp")).args(arguments).current_dir(root()).output().unwrap()
}

/// The texts and the number of elements of a name in the SVG that a command draws.
fn drawn(arguments: &[&str], element: &str) -> (Vec<String>, usize) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("plot.svg");
    let mut all = arguments.to_vec();
    all.extend(["--plot", path.to_str().unwrap()]);
    let output = bp(&all);
    assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    assert!(!output.stdout.is_empty(), "the table is printed too");
    let text = std::fs::read_to_string(&path).unwrap();
    let document = Document::parse(&text).unwrap();
    let named =
        |name: &str| document.descendants().filter(|node| node.tag_name().name() == name).collect::<Vec<_>>();
    let words =
        named("text").iter().filter_map(|node| node.text()).map(|text| text.trim().to_owned()).collect();
    (words, named(element).len())
}

fn has(words: &[String], wanted: &[&str]) {
    for word in wanted {
        assert!(words.iter().any(|text| text.contains(word)), "no `{word}` in {words:?}");
    }
}

#[test]
fn bars_have_a_title_axes_and_the_numbers_of_the_answer() {
    let (words, bars) = drawn(&["ask", "tests/programs/wet_grass.bp", "P(Rain | Wet = true)"], "rect");
    has(&words, &["P(Rain | Wet = true)", "Rain", "probability", "true", "false", "0.3226", "0.6774"]);
    // Two bars, and the background.
    assert_eq!(bars, 3);
}

#[test]
fn two_variables_are_a_heat_map_with_a_colour_bar() {
    let (words, cells) = drawn(&["ask", "examples/sprinkler.bp", "rain"], "rect");
    has(&words, &["Location", "Rain", "probability", "InParis", "InNice"]);
    // Four cells, the hundred steps of the colour bar, and the background.
    assert_eq!(cells, 4 + 100 + 1);
}

#[test]
fn reals_have_a_density_with_an_interval_and_a_mean() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("t.bp");
    std::fs::write(
        &path,
        "program T { variables { T, A : real; } decomposition { P(T) P(A | T) }
         forms { P(T) = normal(20, 5); P(A | T) = normal(T, 1); } question t { P(T | A = 24) } }",
    )
    .unwrap();
    // The mean is (20 / 25 + 24) / (1 / 25 + 1) = 23.846, its deviation √(25 / 26) = 0.98058.
    let (words, lines) = drawn(&["ask", path.to_str().unwrap(), "t"], "polyline");
    has(&words, &["P(T | A = 24)", "probability density", "mean 23.85", "90 %: 22.23 to 25.46"]);
    assert!(lines >= 2, "{lines}");
}

#[test]
fn two_reals_have_a_joint_density_too() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("two.bp");
    std::fs::write(
        &path,
        "program Two { variables { A, B : real; } decomposition { P(A) P(B | A) }
         forms { P(A) = normal(0, 1); P(B | A) = normal(0.8 * A, 0.6); } question both { P(A B) } }",
    )
    .unwrap();
    // The deviations are 1 and √(0.64 + 0.36) = 1, the highest density is 1 / (2π · 1 · 0.6) = 0.265.
    for by in [["--by", "gaussian"], ["--by", "gibbs"]] {
        let arguments = ["ask", path.to_str().unwrap(), "both", by[0], by[1]];
        let (words, cells) = drawn(&arguments, "rect");
        let place = |word: &str| words.iter().position(|text| text == word).unwrap();
        let ticks = &words[place("probability density (per unit of A and of B)")..place("P(A B): A")];
        assert_eq!(ticks.last().unwrap(), "0.25", "{words:?}");
        has(&words, &["P(A B)", "P(A B): B"]);
        assert!(cells > 100 + 16 * 16, "{cells}");
    }
}

#[test]
fn elements_of_a_family_have_intervals_on_one_axis() {
    let pupils = ["ask", "examples/pupils.bp", "schools", "--rows", "examples/data/pupils.csv"];
    let (words, means) = drawn(&pupils, "circle");
    has(
        &words,
        &["P(Level | Mark)", "element of Level", "Hill", "Lake", "Park", "Mill", "mean", "5 % to 95 %"],
    );
    // One for each school, and one in the legend.
    assert_eq!(means, 4 + 1);
}

#[test]
fn questions_over_time_are_lines_with_bands() {
    let folder = tempfile::tempdir().unwrap();
    let (program, data) = (folder.path().join("w.bp"), folder.path().join("w.csv"));
    std::fs::write(
        &program,
        "program W { variables { X, X^-1, Z : real; } decomposition { P(X^-1) P(X | X^-1) P(Z | X) }
         forms { P(X^-1) = previous(X) else normal(0, 10); P(X | X^-1) = normal(X^-1, 1); P(Z | X) = normal(X, 2); }
         question x { smooth P(X | Z) } }",
    )
    .unwrap();
    std::fs::write(&data, "Z\n1\n2\n2.5\n4\n").unwrap();
    let (words, bands) =
        drawn(&["ask", program.to_str().unwrap(), "x", "--data", data.to_str().unwrap()], "polygon");
    has(&words, &["smooth P(X | Z)", "instant t", "mean, with 5 % to 95 %"]);
    assert!(bands >= 1, "a band");
}

#[test]
fn sequences_are_stairs_between_the_values_of_a_variable() {
    let door = ["ask", "examples/course/06_door.bp", "path", "--data", "examples/course/06_door.csv"];
    let (words, stairs) = drawn(&door, "polyline");
    has(&words, &["sequence P(Open | Seen)", "instant t", "Open", "true", "false", "1", "8"]);
    assert!(words.iter().all(|word| word != "1.5" && word != "probability"), "{words:?}");
    assert!(stairs >= 1, "{stairs}");
    let best = ["ask", "examples/course/06_door.bp", "best(2) sequence P(Open | Seen)", "--data", door[4]];
    has(&drawn(&best, "polyline").0, &["sequence 1", "sequence 2"]);
    // Instants are whole numbers.
    let each = ["ask", "examples/course/06_door.bp", "now", "--each", "--data", "examples/course/06_two.csv"];
    let (words, _) = drawn(&each, "polyline");
    has(&words, &["filter P(Open | Seen)", "instant t", "1", "2"]);
    assert!(words.iter().all(|word| word != "1.5"), "{words:?}");
}

#[test]
fn learning_has_a_curve_and_densities_over_histograms() {
    let folder = tempfile::tempdir().unwrap();
    let (program, data) = (folder.path().join("m.bp"), folder.path().join("m.csv"));
    std::fs::write(
        &program,
        "program M { variables { K : bool; X : real; } decomposition { P(K) P(X | K) }
         forms { P(K) = unknown; P(X | K) = unknown(normal); } identification { hidden K; } }",
    )
    .unwrap();
    let rows: String =
        (0..60).map(|row| format!("{}\n", f64::from(row % 7) + if row < 30 { 0.0 } else { 20.0 })).collect();
    std::fs::write(&data, format!("X\n{rows}")).unwrap();
    let (words, bars) =
        drawn(&["learn", program.to_str().unwrap(), "--data", data.to_str().unwrap()], "rect");
    has(&words, &["Learning curve", "step of expectation maximisation", "P(X | K) and the data", "data"]);
    assert!(bars > 30, "{bars}");
}

#[test]
fn png_is_a_picture_that_is_not_blank() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("plot.png");
    let output = bp(&["ask", "tests/programs/wet_grass.bp", "P(Rain)", "--plot", path.to_str().unwrap()]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let bytes = std::fs::read(&path).unwrap();
    assert_eq!(&bytes[..8], b"\x89PNG\r\n\x1a\n");
    // Width and height, big-endian, after the header of the first chunk.
    let number = |at: usize| u32::from_be_bytes(bytes[at..at + 4].try_into().unwrap());
    assert_eq!((number(16), number(20)), (1800, 860));
    assert!(bytes.len() > 8000, "{} bytes", bytes.len());
}

#[test]
fn what_cannot_be_drawn_is_refused_and_nothing_is_written() {
    let folder = tempfile::tempdir().unwrap();
    for (question, name, why) in
        [("P(Rain)", "plot.pdf", "PNG or SVG"), ("draw(3) P(Rain)", "plot.svg", "nothing to plot")]
    {
        let path = folder.path().join(name);
        let output = bp(&["ask", "tests/programs/wet_grass.bp", question, "--plot", path.to_str().unwrap()]);
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.code() == Some(1) && said.contains(why), "{question}: {said}");
        assert!(!path.exists());
    }
}

/// A program in a folder, and the path of a file in it.
fn program(text: &str) -> (tempfile::TempDir, String) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("program.bp");
    std::fs::write(&path, text).unwrap();
    let name = path.to_str().unwrap().to_owned();
    (folder, name)
}

/// The numbers among the texts of a picture.
fn numbers(words: &[String]) -> Vec<f64> {
    words.iter().filter_map(|word| word.replace('−', "-").parse().ok()).collect()
}

#[test]
fn a_narrow_part_of_a_mixture_is_drawn() {
    let (_folder, path) = program(
        "program M { variables { K : bool; X : real; } decomposition { P(K) P(X | K) }
         forms { P(K) = bernoulli(0.5); P(X | K) = if K { normal(3, 0.001) } else { normal(0, 10) }; } }",
    );
    let (words, _) = drawn(&["ask", &path, "P(X)"], "polyline");
    // Half of 1 / (0.001 √(2π)) = 199; the wide part has 0.02.
    let highest = numbers(&words).into_iter().fold(0.0, f64::max);
    assert!((150.0..220.0).contains(&highest), "{words:?}");
}

#[test]
fn ticks_of_a_narrow_distribution_differ() {
    for (mean, deviation) in [("1000", "0.0001"), ("123456789", "0.01"), ("-0.00001", "0.0000000001")] {
        let (_folder, path) = program(&format!(
            "program N {{ variables {{ X : real; }} decomposition {{ P(X) }} forms {{ P(X) = normal({mean}, {deviation}); }} }}"
        ));
        let (words, _) = drawn(&["ask", &path, "P(X)"], "polyline");
        let near = numbers(&words).into_iter().filter(|number| {
            let mean: f64 = mean.parse().unwrap();
            (number - mean).abs() <= 0.01 * mean.abs()
        });
        let ticks: Vec<f64> = near.collect();
        let mut different = ticks.clone();
        different.dedup();
        assert!(ticks.len() >= 4 && ticks == different, "{mean}: {words:?}");
    }
}

#[test]
fn long_labels_are_abridged_and_those_of_wide_letters_too() {
    let long: Vec<String> = (1..=8).map(|n| format!("a_rather_long_name_of_value_{n}")).collect();
    let wide: Vec<String> = (1..=8).map(|n| format!("とても長い値の名前{n}番")).collect();
    for labels in [long, wide] {
        let (_folder, path) = program(&format!(
            "program L {{ variables {{ X : {{ {} }}; }} decomposition {{ P(X) }} forms {{ P(X) = uniform; }} }}",
            labels.join(", ")
        ));
        let (words, _) = drawn(&["ask", &path, "P(X)"], "rect");
        let mut shown: Vec<&String> = words.iter().filter(|word| word.contains('…')).collect();
        shown.sort();
        shown.dedup();
        assert_eq!(shown.len(), 8, "each label is there, and differs from the others: {words:?}");
    }
}

#[test]
fn a_png_whose_font_lacks_letters_says_so() {
    let (folder, path) = program(
        "program L { variables { X : { 雨, 晴 }; } decomposition { P(X) } forms { P(X) = uniform; } }",
    );
    for (name, warned) in [("plot.png", true), ("plot.svg", false)] {
        let plot = folder.path().join(name);
        let output = bp(&["ask", &path, "P(X)", "--plot", plot.to_str().unwrap()]);
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.success() && plot.exists(), "{said}");
        assert_eq!(said.contains("`雨`") && said.contains("write SVG"), warned, "{said}");
    }
}

#[test]
fn contexts_are_written_with_the_names_of_values() {
    let (folder, path) = program(
        "program M { variables { K : bool; L : { Low, Middle, High }; X : real; } decomposition { P(K) P(L) P(X | K L) }
         forms { P(K) = uniform; P(L) = uniform; P(X | K L) = unknown(normal); } }",
    );
    let rows: String = (0..60)
        .map(|row| {
            let (k, l) = (row % 2 == 0, ["Low", "Middle", "High"][row % 3]);
            format!("{k},{l},{}\n", row % 7 + 10 * (row % 3))
        })
        .collect();
    let data = folder.path().join("m.csv");
    std::fs::write(&data, format!("K,L,X\n{rows}")).unwrap();
    let (words, _) = drawn(&["learn", &path, "--data", data.to_str().unwrap()], "rect");
    has(&words, &["K = false, L = Low", "K = true, L = High", "K = false, L = Middle"]);
    assert!(!words.iter().any(|word| word.contains("==")), "{words:?}");
}

#[test]
fn nothing_is_learned_where_the_picture_cannot_be_written() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (program, data) = (path("m.bp"), path("m.csv"));
    let text =
        "program M { variables { X : real; } decomposition { P(X) } forms { P(X) = unknown(normal); } }";
    std::fs::write(&program, text).unwrap();
    std::fs::write(&data, "X\n1\n2\n4\n").unwrap();
    // A wrong extension, and a folder that does not exist.
    for plot in [path("plot.pdf"), path("none/plot.svg")] {
        let output = bp(&["learn", &program, "--data", &data, "--out", &path("learned.bp"), "--plot", &plot]);
        assert_eq!(output.status.code(), Some(1), "{plot}");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 2, "{plot}: something was written");
    }
    // Tables that are learned in one step have no picture, and are written all the same.
    let (program, data) = ("examples/coin_learning.bp", "examples/data/coin.csv");
    let (learned, plot) = (path("learned.bp"), path("plot.svg"));
    let output = bp(&["learn", program, "--data", data, "--out", &learned, "--plot", &plot]);
    assert_eq!(output.status.code(), Some(0));
    assert!(String::from_utf8_lossy(&output.stderr).contains("no picture"), "{output:?}");
    assert!(std::fs::exists(&learned).unwrap() && !std::fs::exists(&plot).unwrap());
}

//! The `bvm` command.
//!
//! In: arguments, synthetic pairs of images, wrong data of every kind. Out: files, figures, exit statuses. Invariant: 0
//! for success, 1 for wrong data, 2 for wrong usage; an error is one line on stderr that names its subject, and leaves
//! nothing behind.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use tempfile::TempDir;

const KEYS: [(&str, &str); 6] = [
    ("focal_px", "100.0"),
    ("cx_px", "48.0"),
    ("cy_px", "32.0"),
    ("baseline_m", "0.1"),
    ("doffs_px", "0.0"),
    ("max_disparity_px", "16"),
];

const WIDTH: usize = 96;
const HEIGHT: usize = 64;

pub(crate) fn bvm(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_bvm")).args(arguments).output().unwrap()
}

pub(crate) fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

#[track_caller]
pub(crate) fn succeeds(arguments: &[&str]) -> Output {
    let output = bvm(arguments);
    assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    output
}

/// An error in the data: exit status 1, and one line that contains all of these.
#[track_caller]
pub(crate) fn refuses(arguments: &[&str], names: &[&str]) {
    let output = bvm(arguments);
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(1), "{arguments:?}: {message}");
    assert!(message.starts_with("error: ") && message.lines().count() == 1, "{arguments:?}: {message}");
    for name in names {
        assert!(message.contains(name), "{arguments:?}: {message} should name {name}");
    }
    assert!(output.stdout.is_empty(), "{arguments:?}: a refusal answers nothing");
}

/// Texture that is the same on every machine.
fn texture(x: usize, y: usize) -> u8 {
    let mut seed = (x as u64) << 32 | y as u64;
    for _ in 0..3 {
        seed = (seed ^ 0x9e37_79b9_7f4a_7c15).wrapping_mul(0xbf58_476d_1ce4_e5b9).rotate_left(27);
    }
    (seed >> 56) as u8
}

/// A wall with a nearer board before it, seen by the left eye or the right one.
fn picture(right: bool) -> Vec<u8> {
    let far = if right { 4 } else { 0 };
    let near = if right { 10 } else { 0 };
    let mut pixels = vec![0; WIDTH * HEIGHT];
    for y in 0..HEIGHT {
        for x in 0..WIDTH {
            // A board of 40 by 32 pixels in the middle of the left picture.
            let board = (28..68).contains(&(x + near)) && (16..48).contains(&y);
            pixels[y * WIDTH + x] = if board { texture(x + near + 1000, y) } else { texture(x + far, y) };
        }
    }
    pixels
}

fn png(path: &Path, width: usize, height: usize, grey: &[u8]) {
    let file = std::io::BufWriter::new(std::fs::File::create(path).unwrap());
    let mut encoder = png::Encoder::new(file, width as u32, height as u32);
    encoder.set_color(png::ColorType::Grayscale);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.write_header().unwrap().write_image_data(grey).unwrap();
}

/// A calibration in which one key has another value; `None`: the key is missing.
fn calibration(key: &str, value: Option<&str>) -> String {
    let lines = KEYS.iter().filter_map(|(known, good)| match (*known == key, value) {
        (true, value) => value.map(|value| format!("{known} = {value}\n")),
        (false, _) => Some(format!("{known} = {good}\n")),
    });
    lines.collect()
}

/// A valid pair with its calibration, and a folder for the output.
struct Pair {
    folder: TempDir,
}

impl Pair {
    fn new() -> Self {
        let folder = TempDir::new().unwrap();
        for (name, right) in [("left.png", false), ("right.png", true)] {
            png(&folder.path().join(name), WIDTH, HEIGHT, &picture(right));
        }
        std::fs::write(folder.path().join("pair.toml"), calibration("", None)).unwrap();
        Self { folder }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn write(&self, name: &str, bytes: &[u8]) {
        std::fs::write(self.path(name), bytes).unwrap();
    }

    /// `bvm look` refuses these files and leaves no output.
    #[track_caller]
    fn refused(&self, left: &str, right: &str, toml: &str, names: &[&str]) {
        let (left, right, toml, out) = (self.path(left), self.path(right), self.path(toml), self.path("out"));
        let arguments =
            ["look", "--left", text(&left), "--right", text(&right), "--calibration", text(&toml)];
        refuses(&[&arguments[..], &["--out", text(&out)]].concat(), names);
        let left_behind = std::fs::read_dir(&out).map_or(0, |entries| entries.count());
        assert_eq!(left_behind, 0, "{names:?}: something is left in the folder");
    }
}

#[test]
fn explore_leaves_a_folder_and_the_same_figures_twice() {
    let folder = TempDir::new().unwrap();
    let runs = ["first", "second"].map(|name| folder.path().join(name));
    for out in &runs {
        let output = succeeds(&["explore", "--steps", "2", "--seed", "3", "--out", text(out)]);
        let page = String::from_utf8(output.stdout).unwrap();
        for entry in std::fs::read_dir(out).unwrap() {
            let path = entry.unwrap().path();
            assert!(page.contains(&format!("wrote {}", path.display())), "{page}");
        }
    }
    let [first, second] = runs.map(|out| std::fs::read(out.join("run.json")).unwrap());
    assert_eq!(first, second, "the same seed gives the same figures");
    let run: serde_json::Value = serde_json::from_slice(&first).unwrap();
    assert_eq!((&run["scene"], &run["seed"], &run["steps"]), (&"furnished".into(), &3.into(), &2.into()));
    let policies = run["policies"].as_array().unwrap();
    assert_eq!(policies.len(), 4, "the default, and three to compare it with");
    for policy in policies {
        assert_eq!(policy["steps"].as_array().unwrap().len(), 2);
        assert!(policy["final_entropy_share"].as_f64().unwrap() < 1.0, "a look teaches something");
    }
    for name in ["report.html", "map.ply", "map.bt", "map.ot"] {
        assert!(folder.path().join("first").join(name).is_file(), "{name}");
    }
    for name in
        ["entropy.png", "occupancy_panorama.png", "entropy_panorama.png", "gaze_path.png", "top_view.png"]
    {
        bvm::vision::image::read(&folder.path().join("first").join(name)).unwrap();
    }
}

#[test]
fn look_makes_a_map_of_a_synthetic_pair() {
    let pair = Pair::new();
    let (left, right, toml, out) =
        (pair.path("left.png"), pair.path("right.png"), pair.path("pair.toml"), pair.path("out"));
    let arguments = ["look", "--left", text(&left), "--right", text(&right), "--calibration", text(&toml)];
    let output = succeeds(&[&arguments[..], &["--out", text(&out), "--json"]].concat());
    let answer: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let kept: serde_json::Value =
        serde_json::from_slice(&std::fs::read(out.join("look.json")).unwrap()).unwrap();
    assert_eq!(answer, kept);
    assert!(answer["density"].as_f64().unwrap() > 0.6, "{answer}");
    // Disparities of 10 and 4 pixels are 1.0 and 2.5 m deep.
    let (nearest, farthest) = (answer["nearest_m"].as_f64().unwrap(), answer["farthest_m"].as_f64().unwrap());
    assert!((0.95..1.1).contains(&nearest) && (2.4..3.1).contains(&farthest), "{answer}");
    for name in ["disparity.png", "confidence.png", "range_panorama.png", "top_view.png"] {
        bvm::vision::image::read(&out.join(name)).unwrap();
    }
}

#[test]
fn a_look_hears_codes_where_they_are_asked_for() {
    let pair = Pair::new();
    let (left, right, toml) = (pair.path("left.png"), pair.path("right.png"), pair.path("pair.toml"));
    for matcher in ["scanline", "coherence"] {
        let seen = ["hard", "virtual"].map(|evidence| {
            let out = pair.path(evidence);
            let arguments =
                ["look", "--left", text(&left), "--right", text(&right), "--calibration", text(&toml)];
            let more = ["--matcher", matcher, "--evidence", evidence, "--out", text(&out), "--json"];
            let output = succeeds(&[&arguments[..], &more].concat());
            let answer: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
            assert_eq!(answer["evidence"], evidence);
            let panorama = std::fs::read(out.join("occupancy_panorama.png")).unwrap();
            (answer["readings"].clone(), panorama)
        });
        assert_eq!(seen[0].0, seen[1].0, "the same directions have readings");
        assert!(seen[0].1 != seen[1].1, "the map hears something else");
    }
}

#[test]
fn look_at_a_recorded_pair() {
    let beside = || Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().nth(2).map(|up| up.join("shared/data"));
    let root = std::env::var_os("BP_DATA").map(PathBuf::from).or_else(beside).unwrap();
    let folder = root.join("stereo/middlebury2014_motorcycle");
    if !folder.is_dir() {
        println!("skipped: no folder {}", folder.display());
        return;
    }
    let made = TempDir::new().unwrap();
    let (toml, out) = (made.path().join("motorcycle.toml"), made.path().join("out"));
    let text_of = "focal_px = 994.978\ncx_px = 311.193\ncy_px = 254.877\nbaseline_m = 0.193001\n\
                   doffs_px = 31.086\nmax_disparity_px = 64\n";
    std::fs::write(&toml, text_of).unwrap();
    let (left, right) = (folder.join("motorcycle_left.png"), folder.join("motorcycle_right.png"));
    let arguments = ["look", "--left", text(&left), "--right", text(&right), "--calibration", text(&toml)];
    let output = succeeds(&[&arguments[..], &["--out", text(&out), "--json"]].concat());
    let answer: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert!(answer["density"].as_f64().unwrap() > 0.8, "{answer}");
}

#[test]
fn wrong_images_are_named() {
    let pair = Pair::new();
    png(&pair.path("small.png"), 95, HEIGHT, &picture(true)[..95 * HEIGHT]);
    pair.write("empty.png", b"");
    let whole = std::fs::read(pair.path("left.png")).unwrap();
    pair.write("truncated.png", &whole[..whole.len() / 2]);
    pair.write("header.png", &whole[..12]);
    pair.write("words.png", b"this is no picture");
    pair.refused("left.png", "small.png", "pair.toml", &["96x64", "95x64"]);
    pair.refused("empty.png", "right.png", "pair.toml", &["empty.png", "empty"]);
    pair.refused("truncated.png", "right.png", "pair.toml", &["truncated.png", "truncated"]);
    pair.refused("left.png", "header.png", "pair.toml", &["header.png"]);
    pair.refused("left.png", "words.png", "pair.toml", &["words.png", "not an image"]);
    pair.refused("left.png", "nowhere.png", "pair.toml", &["nowhere.png"]);
    pair.refused("left.png", "right.png", "nowhere.toml", &["nowhere.toml"]);
}

#[test]
fn wrong_calibrations_are_named_by_key() {
    let pair = Pair::new();
    let refused = |text: String, names: &[&str]| {
        pair.write("wrong.toml", text.as_bytes());
        pair.refused("left.png", "right.png", "wrong.toml", &[&["wrong.toml"], names].concat());
    };
    for (key, _) in KEYS {
        refused(calibration(key, None), &[key, "missing"]);
        refused(calibration(key, Some("nan")), &[key, "nan"]);
        refused(calibration(key, Some("\"many\"")), &[key, "many"]);
    }
    // The principal point and its offset may be negative; lengths and counts may not.
    for key in ["focal_px", "baseline_m", "max_disparity_px"] {
        refused(calibration(key, Some("-1")), &[key, "-1"]);
        refused(calibration(key, Some("0")), &[key]);
    }
    refused(calibration("", None) + "fokal_px = 3\n", &["fokal_px", "unknown"]);
    refused("focal_px = = 3\n".to_owned(), &["line 1"]);
    // A calibration for other pictures: Middlebury's file contains their size.
    let middlebury = |width: usize, doffs: f64| {
        format!(
            "cam0=[100 0 48; 0 100 32; 0 0 1]\ncam1=[100 0 48; 0 100 32; 0 0 1]\ndoffs={doffs}\nbaseline=100\n\
             width={width}\nheight={}\nndisp=16\n",
            width * 2 / 3
        )
    };
    refused(middlebury(192, 0.0), &["`width`", "192x128", "96x64", "by 0.5"]);
    refused(middlebury(96, 7.0), &["`doffs`", "is 7", "is 0.000"]);
    pair.write("wide.toml", calibration("max_disparity_px", Some("96")).as_bytes());
    pair.refused("left.png", "right.png", "wide.toml", &["96 disparities", "96 pixels wide"]);
}

#[test]
fn folders_that_cannot_be_written_are_refused() {
    let pair = Pair::new();
    pair.write("file", b"a regular file");
    let (left, right, toml) = (pair.path("left.png"), pair.path("right.png"), pair.path("pair.toml"));
    let below = pair.path("file").join("out");
    let look = ["look", "--left", text(&left), "--right", text(&right), "--calibration", text(&toml)];
    refuses(&[&look[..], &["--out", text(&below)]].concat(), &["file", "cannot write"]);
    refuses(&["explore", "--steps", "1", "--out", text(&below)], &["file", "cannot write"]);
    assert_eq!(std::fs::read(pair.path("file")).unwrap(), b"a regular file");
}

#[test]
fn wrong_usage_is_code_2() {
    let cases: [&[&str]; 9] = [
        &[],
        &["explore", "--steps", "0"],
        &["explore", "--steps", "many"],
        &["explore", "--speed", "3"],
        &["explore", "--policy", "greedy"],
        &["experiment"],
        &["experiment", "--seeds", "0", "--out", "runs"],
        &["look", "--left", "left.png"],
        &["listen"],
    ];
    for arguments in cases {
        let output = bvm(arguments);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}");
        assert!(output.stdout.is_empty() && !output.stderr.is_empty(), "{arguments:?}");
    }
}

#[test]
fn help_is_at_most_80_columns_wide() {
    let commands = ["explore", "experiment", "look", "replay", "calibrate", "listen", "balance", "synth"]
        .map(|name| vec![name]);
    let others = [vec![], vec!["calibrate", "vision"], vec!["calibrate", "audition"]];
    for command in commands.iter().chain(&others) {
        for flag in ["-h", "--help"] {
            let output = succeeds(&[command.as_slice(), &[flag]].concat());
            let page = String::from_utf8(output.stdout).unwrap();
            let long = page.lines().find(|line| line.chars().count() > 80);
            assert!(page.contains("Usage:") && long.is_none(), "{command:?} {flag}: {long:?}");
        }
    }
}

#[test]
fn look_writes_disparities_alone_where_they_are_asked_for() {
    let pair = Pair::new();
    let (left, right, toml) = (pair.path("left.png"), pair.path("right.png"), pair.path("pair.toml"));
    let field = pair.path("d.pfm");
    for matcher in ["scanline", "coherence"] {
        let arguments =
            ["look", "--left", text(&left), "--right", text(&right), "--calibration", text(&toml)];
        let more = ["--matcher", matcher, "--disparity", text(&field), "--json"];
        let output = succeeds(&[&arguments[..], &more].concat());
        let answer: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        assert_eq!(answer["matcher"], matcher);
        let field = bvm::vision::pfm::read(&field).unwrap();
        assert_eq!((field.width, field.values.len()), (WIDTH, WIDTH * HEIGHT));
        let claims = field.values.iter().filter(|value| value.is_finite()).count();
        assert!(
            (answer["density"].as_f64().unwrap() - claims as f64 / field.values.len() as f64).abs() < 1e-9
        );
        // The middle of the board; the file's rows are turned back.
        let board = field.values[32 * WIDTH + 48];
        assert!((board - 10.0).abs() < 0.5 || board.is_infinite(), "{board}");
        assert!(matcher == "coherence" || board.is_finite());
    }
    let names: Vec<_> =
        std::fs::read_dir(pair.folder.path()).unwrap().map(|e| e.unwrap().file_name()).collect();
    assert_eq!(names.len(), 4, "{names:?}");
}

#[test]
fn calibration_of_sight_leaves_out_cells_that_are_not_numbers() {
    let pair = Pair::new();
    let truth = |x: usize, y: usize| match (x, y) {
        (0..=9, _) => f32::NAN,
        (28..=67, 16..=47) => 10.0,
        _ => 4.0,
    };
    let values: Vec<f32> = (0..WIDTH * HEIGHT).map(|at| truth(at % WIDTH, at / WIDTH)).collect();
    bvm::vision::pfm::write(&pair.path("truth.pfm"), WIDTH, &values).unwrap();
    bvm::vision::pfm::write(&pair.path("small.pfm"), WIDTH / 2, &values).unwrap();
    let files = ["left.png", "right.png", "pair.toml", "truth.pfm"].map(|name| pair.path(name));
    let out = pair.path("calibration");
    let paths: Vec<&str> = files.iter().map(|file| text(file)).collect();
    let arguments =
        [&["calibrate", "vision", "--pair"], &paths[..], &["--out", text(&out), "--json"]].concat();
    let answer: serde_json::Value = serde_json::from_slice(&succeeds(&arguments).stdout).unwrap();
    assert_eq!(answer[0]["matcher"], "scanline");
    assert!(answer[0]["wrong_by_2_matched"].as_f64().unwrap() < 0.05, "{}", answer[0]);
    assert_eq!(answer[2]["wrong_by_2_all"], 0.0, "exact depth is never wrong");
    for name in ["reliability.png", "sparsification.png"] {
        bvm::vision::image::read(&out.join(name)).unwrap();
    }
    // The evidence of the pair for the map: a reading, or a code, for each direction.
    let maps = answer[0]["maps"].as_array().unwrap();
    assert!(maps.iter().any(|map| map["evidence"] == "virtual" && map["hidden"] == "map"), "{maps:?}");
    assert!(maps.iter().all(|map| map["log_loss"].as_f64().unwrap() < 0.7), "{maps:?}");
    for (name, value) in [("none.pfm", f32::NAN), ("far.pfm", f32::INFINITY), ("zero.pfm", 0.0)] {
        bvm::vision::pfm::write(&pair.path(name), WIDTH, &[value; WIDTH * HEIGHT]).unwrap();
        let none = arguments.iter().map(|word| word.replace("truth.pfm", name)).collect::<Vec<_>>();
        refuses(&none.iter().map(String::as_str).collect::<Vec<_>>(), &[name, "no truth", "96x64"]);
    }
    let small = arguments.iter().map(|word| word.replace("truth.pfm", "small.pfm")).collect::<Vec<_>>();
    refuses(&small.iter().map(String::as_str).collect::<Vec<_>>(), &["48x128", "96x64"]);
    // A perfect pair: the truth is the matcher's own result. Its errors have no deviation, and there are no outliers.
    let look = ["look", "--left", paths[0], "--right", paths[1], "--calibration", paths[2]];
    succeeds(&[&look[..], &["--disparity", text(&pair.path("own.pfm"))]].concat());
    let own = arguments.iter().map(|word| word.replace("truth.pfm", "own.pfm")).collect::<Vec<_>>();
    let output = succeeds(&own.iter().map(String::as_str).collect::<Vec<_>>());
    assert!(!String::from_utf8_lossy(&output.stdout).contains("null"), "absent figures are left out");
    let answer: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!((&answer[0]["sigma_min_px"], &answer[0]["wrong_by_1_matched"]), (&0.0.into(), &0.0.into()));
    for class in answer[0]["classes"].as_array().unwrap() {
        assert_eq!((&class["sigma_px"], &class["outliers"]), (&0.0.into(), &0.0.into()), "{class}");
    }
}

//! The files of a run, read by the programs that they are for.
//!
//! In: a short run. Out: what OctoMap's tools, the Python reader of MCAP and a browser find in its files. Invariant: a
//! test says that it was skipped where its program is not installed; `.ci/run` installs all of them.

use bvm::exploration::{Episode, PolicyKind, Record, explore};
use bvm::frame::Spherical;
use bvm::vision::EvidenceKind;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;
use tempfile::TempDir;

const LOOKS: usize = 4;

/// The run and its folder.
struct Left {
    folder: TempDir,
    episode: Episode,
}

impl Left {
    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }
}

fn left() -> &'static Left {
    static LEFT: OnceLock<Left> = OnceLock::new();
    LEFT.get_or_init(|| {
        let folder = TempDir::new().unwrap();
        let mut record = Record::new(folder.path(), LOOKS, false).unwrap();
        let add = |map: &bvm::map::Map, look: &bvm::head::Look| record.add(map, look);
        let episode = explore(PolicyKind::Inhibited, EvidenceKind::Virtual, LOOKS, 3, add).unwrap();
        let other = explore(PolicyKind::Null, EvidenceKind::Virtual, LOOKS, 3, |_, _| ()).unwrap();
        let episodes = [episode, other];
        // A title that would end the script, if it were not escaped.
        let paths = record.leave(folder.path(), "a run </script>", &episodes).unwrap();
        assert!(paths.iter().all(|path| path.is_file()), "{paths:?}");
        let [episode, _] = episodes;
        Left { folder, episode }
    })
}

/// What a program prints; none if it is not installed.
fn prints(program: &str, arguments: &[&Path], setting: Option<(&str, PathBuf)>) -> Option<String> {
    let mut command = Command::new(program);
    command.args(arguments);
    if let Some((name, value)) = setting {
        command.env(name, value);
    }
    let output = match command.output() {
        Ok(output) => output,
        Err(_) => {
            println!("skipped: there is no program `{program}`");
            return None;
        }
    };
    let messages = String::from_utf8_lossy(&output.stderr).into_owned();
    if messages.contains("ModuleNotFoundError") || messages.contains("MODULE_NOT_FOUND") {
        println!("skipped: `{program}` lacks a module");
        return None;
    }
    assert!(output.status.success(), "{program}: {messages}");
    Some(String::from_utf8_lossy(&output.stdout).into_owned())
}

fn program(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/exploration/programs").join(name)
}

/// The centres of all voxels of 0.1 m in a state, from the map alone.
fn voxels(is: impl Fn(f32) -> bool) -> Vec<[f64; 3]> {
    let map = &left().episode.map;
    let side = -60..60;
    let centre = |k: i32| (f64::from(k) + 0.5) * 0.1;
    let mut found = Vec::new();
    for x in side.clone() {
        for y in side.clone() {
            for z in side.clone() {
                let point = [centre(x), centre(y), centre(z)];
                let cell = map.grid().cell_of(Spherical::from_cartesian(point));
                if cell.is_some_and(|cell| is(map.occupancy()[map.grid().index(cell)])) {
                    found.push(point);
                }
            }
        }
    }
    found
}

#[test]
fn a_run_leaves_no_file_of_an_earlier_one() {
    let folder = TempDir::new().unwrap();
    let write = |name: &str| std::fs::write(folder.path().join(name), "x").unwrap();
    let names = || {
        let entries = std::fs::read_dir(folder.path()).unwrap();
        let mut names: Vec<_> =
            entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    };
    ["map.ply", "notes.txt"].into_iter().for_each(write);
    Record::clear(folder.path()).unwrap();
    assert_eq!(names(), ["map.ply", "notes.txt"], "no run was here");
    ["run.json", "cameras.png", "run_2.mcap", "checkpoint-null.bvm"].into_iter().for_each(write);
    Record::clear(folder.path()).unwrap();
    assert_eq!(names(), ["notes.txt"]);
}

#[test]
fn octomap_reads_the_trees() {
    let left = left();
    let (bt, ot) = (left.path("map.bt"), left.path("map.ot"));
    if prints("bt2vrml", &[&bt], None).is_none() {
        return;
    }
    // Boxes: the middle of each on one line, the length of its side on the next.
    let text = std::fs::read_to_string(left.path("map.bt.wrl")).unwrap();
    let numbers = |line: &str, after: &str| -> Option<Vec<f64>> {
        let rest = line.split(after).nth(1)?;
        Some(
            rest.split_whitespace()
                .take(3)
                .filter_map(|part| part.trim_end_matches('}').parse().ok())
                .collect(),
        )
    };
    let middles = text.lines().filter_map(|line| numbers(line, "translation "));
    let sides = text.lines().filter_map(|line| numbers(line, "size "));
    let key = |value: f64| (value / 0.1 - 0.5).round() as i32;
    let mut found = Vec::new();
    for (middle, side) in middles.zip(sides) {
        let count = (side[0] / 0.1).round() as i32;
        let first = [0, 1, 2].map(|axis| {
            let edge = (middle[axis] - 0.5 * side[0]) / 0.1;
            assert!((edge - edge.round()).abs() < 1e-3, "{middle:?}: a box begins at {edge} voxels");
            edge.round() as i32
        });
        for voxel in 0..count.pow(3) {
            let offset = [voxel / (count * count), voxel / count % count, voxel % count];
            found.push([0, 1, 2].map(|axis| first[axis] + offset[axis]));
        }
    }
    let mut expected: Vec<[i32; 3]> = voxels(|p| p >= 0.55).into_iter().map(|point| point.map(key)).collect();
    found.sort_unstable();
    expected.sort_unstable();
    assert!(!expected.is_empty());
    assert_eq!(found, expected, "the occupied voxels are those of the map");
    // OctoMap's own conversion of one file agrees with the other in all states.
    let converted = left.path("converted.ot");
    prints("convert_octree", &[&bt, &converted], None).unwrap();
    assert!(std::fs::metadata(&converted).unwrap().len() > 1000);
    let compared = prints("compare_octrees", &[&converted, &ot], None).unwrap();
    let known = voxels(|p| (p - 0.5).abs() >= 0.05).len();
    assert!(compared.contains(&format!("Expanded num. leafs: {known}")), "{known} known voxels: {compared}");
}

#[test]
fn the_tree_has_its_free_voxels() {
    // Of the header's number of nodes, and a walk through the file's bytes: OctoMap's format, read here again.
    let left = left();
    let bytes = std::fs::read(left.path("map.bt")).unwrap();
    let begin = bytes.windows(5).position(|window| window == b"data\n").unwrap() + 5;
    let header = String::from_utf8(bytes[..begin].to_vec()).unwrap();
    assert!(header.starts_with("# Octomap OcTree binary file\n") && header.contains("\nid OcTree\n"));
    assert!(header.contains("\nres 0.1\n"), "{header}");
    let size: usize = header.lines().find_map(|line| line.strip_prefix("size ")).unwrap().parse().unwrap();
    // Depth first; for each node the voxels along its side.
    let (mut at, mut nodes, mut free, mut occupied) = (begin, 1, 0u64, 0u64);
    let mut open = vec![1u64 << 16];
    while let Some(side) = open.pop() {
        let codes = u16::from_le_bytes([bytes[at], bytes[at + 1]]);
        at += 2;
        let half = side / 2;
        for child in 0..8 {
            match codes >> (2 * child) & 3 {
                0 => continue,
                1 => free += half.pow(3),
                2 => occupied += half.pow(3),
                _ => open.push(half),
            }
            nodes += 1;
        }
    }
    assert_eq!((at, nodes), (bytes.len(), size));
    assert_eq!(free, voxels(|p| p <= 0.45).len() as u64);
    assert_eq!(occupied, voxels(|p| p >= 0.55).len() as u64);
    assert!(free > occupied && occupied > 0, "{free} free, {occupied} occupied");
}

#[cfg(feature = "recording")]
#[test]
fn a_recording_is_read_by_python() {
    let left = left();
    let recording = left.path("run.mcap");
    let Some(printed) = prints("python3", &[&program("recording.py"), &recording], None) else { return };
    let found: serde_json::Value = serde_json::from_str(&printed).unwrap();
    assert_eq!(found["profile"], "ros2");
    for (topic, schema) in [
        ("/map", "sensor_msgs/msg/PointCloud2"),
        ("/tf", "tf2_msgs/msg/TFMessage"),
        ("/gaze", "geometry_msgs/msg/PoseStamped"),
        ("/entropy", "std_msgs/msg/Float64"),
    ] {
        assert_eq!(found["topics"][topic]["schema"], schema);
        assert_eq!(found["topics"][topic]["count"], LOOKS);
    }
    // The last cloud: the occupied cells of the map, in order.
    let map = &left.episode.map;
    let occupied: Vec<usize> =
        (0..map.grid().cells()).filter(|cell| map.occupancy()[*cell] >= 0.55).collect();
    let cloud = &found["clouds"][LOOKS - 1];
    let points = cloud["points"].as_array().unwrap();
    assert_eq!((points.len(), &cloud["dense"]), (occupied.len(), &true.into()));
    for (point, index) in points.iter().zip(&occupied).step_by(97) {
        let centre = map.grid().centre(map.grid().cell(*index).unwrap()).to_cartesian();
        for (axis, expected) in centre.iter().enumerate() {
            assert!((point[axis].as_f64().unwrap() - expected).abs() < 1e-5);
        }
        assert!((point[3].as_f64().unwrap() - f64::from(map.occupancy()[*index])).abs() < 1e-6);
    }
    // A gaze of azimuth a and elevation e: a turn about z by a, then the nose up by e, which is −e about y.
    for (found, look) in found["gazes"].as_array().unwrap().iter().zip(&left.episode.looks) {
        let [(sa, ca), (se, ce)] = [0.5 * look.gaze.azimuth, -0.5 * look.gaze.elevation].map(f64::sin_cos);
        let expected = [-sa * se, ca * se, sa * ce, ca * ce];
        let dot: f64 = (0..4).map(|part| expected[part] * found[part].as_f64().unwrap()).sum();
        assert!((dot.abs() - 1.0).abs() < 1e-9, "{expected:?} {found}");
    }
    // Without its end it is readable up to the last closed chunk.
    let bytes = std::fs::read(&recording).unwrap();
    let cut = left.path("cut.mcap");
    std::fs::write(&cut, &bytes[..bytes.len() * 3 / 5]).unwrap();
    let printed = prints("python3", &[&program("cut.py"), &cut], None).unwrap();
    let kept: serde_json::Value = serde_json::from_str(&printed).unwrap();
    assert!(kept["/map"].as_u64().is_some_and(|count| (1..LOOKS as u64).contains(&count)), "{kept}");
}

#[test]
fn the_cloud_has_one_vertex_for_each_occupied_cell() {
    let left = left();
    let bytes = std::fs::read(left.path("map.ply")).unwrap();
    let begin = bytes.windows(11).position(|window| window == b"end_header\n").unwrap() + 11;
    let header = String::from_utf8(bytes[..begin].to_vec()).unwrap();
    let count = left.episode.map.occupancy().iter().filter(|p| **p >= 0.55).count();
    assert!(header.contains(&format!("element vertex {count}\n")), "{header}");
    // Three coordinates, three colours, occupancy, velocity.
    assert_eq!(bytes.len() - begin, count * (12 + 3 + 4 + 12));
    for vertex in bytes[begin..].chunks_exact(31) {
        let number = |at: usize| f32::from_le_bytes(vertex[at..at + 4].try_into().unwrap());
        let distance = (0..3).map(|axis| number(4 * axis).powi(2)).sum::<f32>().sqrt();
        assert!((0.5..=6.0).contains(&distance) && number(15) >= 0.55);
    }
}

#[test]
fn the_page_works_in_a_browser_without_network() {
    let left = left();
    let page = std::fs::read_to_string(left.path("report.html")).unwrap();
    assert!(!page.contains("://") && !page.contains("@DATA@"), "nothing leads out of the page");
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap().join("target/browser/node_modules");
    let modules = std::env::var_os("BVM_NODE_MODULES").map_or(root, PathBuf::from);
    let chromium = Path::new("/usr/bin/chromium");
    if !chromium.is_file() {
        return println!("skipped: there is no {}", chromium.display());
    }
    let picture = left.path("page.png");
    let arguments = [&program("page.cjs"), &left.path("report.html"), chromium, &picture];
    let Some(printed) = prints("node", &arguments, Some(("NODE_PATH", modules))) else { return };
    let found: serde_json::Value = serde_json::from_str(&printed).unwrap();
    assert_eq!(found["errors"], serde_json::json!([]));
    assert_eq!(found["requests"].as_array().unwrap().len(), 1, "the page itself: {found}");
    assert_eq!((&found["drawn"], &found["title"]), (&"all".into(), &"a run </script>".into()));
    assert_eq!(found["figures"].as_array().unwrap().len(), 3, "a row for each policy");
    assert_eq!(found["senses"].as_array().unwrap().len(), 4, "sight, hearing, balance");
    for canvas in ["curves", "cloud", "panorama", "information"] {
        assert!(found["colours"][canvas].as_u64().unwrap() > 4, "{canvas} is empty: {found}");
    }
    for action in ["turns", "zooms", "goes_back", "chooses"] {
        assert_eq!(found[action], true, "{action}");
    }
    if let Some(folder) = std::env::var_os("BVM_SCREENSHOTS") {
        std::fs::copy(picture, Path::new(&folder).join("report.png")).unwrap();
    }
}

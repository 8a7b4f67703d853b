//! Scene files: the built-in ones, and every mistake with its line and column.

use super::*;
use crate::frame::Spherical;

fn refusal(text: &str) -> String {
    Scene::parse(text, Path::new("my.toml")).unwrap_err().to_string()
}

#[test]
fn built_in_scenes_are_possible_for_any_seed() {
    assert!(Scene::names().count() >= 11);
    for name in Scene::names() {
        let scene = Scene::find(name).unwrap();
        assert_eq!(scene.name, name);
        assert!(!scene.title.is_empty());
        for seed in 0..20 {
            let world = scene.world(seed);
            assert_eq!(world, scene.world(seed));
            for time in [0.0, 4.0, 8.5, 13.0] {
                assert!(!world.occupied([0.0; 3], time), "{name}, seed {seed}: the head is inside something");
                for source in &world.sources {
                    let point = world.source_at(source, time);
                    let [min, max] = world.room;
                    assert!((0..3).all(|axis| (min[axis]..max[axis]).contains(&point[axis])));
                    assert!(Spherical::from_cartesian(point).rho_m > 0.3, "{name}: `{}`", source.name);
                }
            }
        }
    }
}

const ROOM: &str = "title = 'x'\n[room]\nmin = [-2, -2, -1]\nmax = [3, 2, 1.5]\n";
const BALL: &str = "[[things]]\nname = 'a'\nball = { centre = [1, 0, 0], radius = 0.1 }\n";
const BODY: &str = "[[bodies]]\nname = 'b'\ncylinder = { radius = 0.2, height = [-1, 0.3] }\n";
const SOUND: &str = "[[sounds]]\nname = 's'\nat = [1, 0, 0]\n";

/// What stands before the mistake, the mistake, its line and its column in both, and a part of the message.
const MISTAKES: [(&str, &str, usize, usize, &str); 37] = [
    (
        "[[things]]\nname = 'sofa'\n",
        "block = { min = [-1, -1, -1], max = [1, 1, 1] }",
        2,
        8,
        "the head, at 0, is inside `sofa`",
    ),
    (
        "[[things]]\nname = 'post'\n",
        "ball = { centre = [0.5, 0, 0], radius = 0.2 }\njitter_m = [0.4, 0]",
        2,
        8,
        "is inside `post`, with its `jitter_m`",
    ),
    (
        "[[things]]\nname = 'far'\n",
        "ball = { centre = [9, 0, 0], radius = 0.2 }",
        2,
        8,
        "`far` is outside the room",
    ),
    (
        "[[things]]\nname = 'a'\n",
        "block = { min = [1, 1, 0], max = [2, 0.5, 1] }",
        3,
        9,
        "its size along y is -0.5 m",
    ),
    (
        "[[things]]\nname = 'a'\n",
        "ball = { centre = [1, 0, 0], radius = -0.2 }",
        3,
        8,
        "its radius is -0.2 m, expected more than 0",
    ),
    (
        "[[things]]\nname = 'a'\n",
        "ball = { centre = [1, nan, 0], radius = 0.2 }",
        3,
        8,
        "found nan, expected a finite number",
    ),
    (
        "[[things]]\nname = 'a'\n",
        "ball = { centre = [1, 0, 0], radius = inf }",
        3,
        8,
        "found inf, expected a finite number",
    ),
    (
        "[[things]]\nname = 'a'\n",
        "cylinder = { axis = [1, 0], radius = 0.2, height = [1, 0] }",
        3,
        12,
        "its height is -1 m",
    ),
    ("[[things]]\nname = 'a'\n", "ball = { centre = [1, 0], radius = 0.2 }", 3, 19, "length"),
    ("[[things]]\n", "name = 'a'", 2, 8, "it has no shape"),
    (BALL, "block = { min = [1, 1, 0], max = [2, 2, 1] }", 3, 8, "it has a shape already"),
    (BALL, "colour = 'red'", 4, 1, "unknown field `colour`"),
    (
        "[[things]]\nname = 'a'\n",
        "ball = { centre = [1, 0, 0], radius = 0.1, size = 3 }",
        3,
        44,
        "unknown field `size`",
    ),
    (BALL, "surface = 'fur'", 4, 11, "there is no surface `fur`"),
    (BALL, "surface = { albedo = 1.5, contrast = 0 }", 4, 11, "expected both from 0 to 1"),
    (
        BALL,
        "[[things]]\nname = 'a'\nball = { centre = [1, 1, 0], radius = 0.1 }",
        5,
        8,
        "there is another `a`",
    ),
    (BALL, "path = [[0, 1, 1], [1, 1, 0]]", 4, 8, "`a` does not move"),
    (BALL, "jitter_m = [-1, 0]", 4, 12, "expected 0 to 10"),
    (BODY, "", 2, 8, "it does not move"),
    (BODY, "path = [[0, 1, 1], [2, 1, 3]]", 4, 8, "`b` is at (1.00, 2.05) m: outside the room"),
    (BODY, "path = [[0, 1, 1], [2, -1, -1]]", 4, 8, "the head, at 0, is inside `b`"),
    (
        "[[things]]\nname = 'wall'\nblock = { min = [1, -0.1, -1], max = [2, 0.1, 1] }\n[[bodies]]\nname = 'b'\ncylinder = { radius = 0.2, height = [-1, 0.3] }\n",
        "walk = { ends = [[1.5, 1], [1.5, -1]], period_s = 8 }",
        7,
        17,
        "`b` passes through `wall`",
    ),
    (BODY, "path = [[2, 1, 1], [1, 1, 0]]", 4, 8, "times from 0 on that increase"),
    (BODY, "walk = { ends = [[1, 1], [1, -1]], period_s = -8 }", 4, 47, "found -8, expected 0.5 to 3600"),
    ("[[sounds]]\nname = 's'\n", "at = [9, 0, 0]\nplays = 'noise'", 3, 6, "`s` is outside the room"),
    ("[[sounds]]\nname = 's'\n", "at = [0.1, 0, 0]\nplays = 'noise'", 3, 6, "`s` is inside the head"),
    (
        "[[sounds]]\nname = 's'\n",
        "carried_by = 'dog'\nplays = 'noise'",
        3,
        14,
        "there is no body `dog`: there is none",
    ),
    ("[[sounds]]\nname = 's'\n", "plays = 'noise'", 2, 8, "expected either `at` or `carried_by`"),
    (SOUND, "plays = 'jazz'", 4, 9, "found `jazz`, expected noise, speech or tone"),
    (SOUND, "plays = 'noise'\nfrom_s = 3\nuntil_s = 2", 6, 11, "found 2 s, expected more than"),
    ("[[fog]]\nmin = [0, 0, 0]\nmax = [1, 1, 1]\n", "visibility_m = 0", 4, 16, "found 0, expected 0.01"),
    ("[cameras]\n", "size_px = [10, 10]", 2, 11, "expected 64 to 1920"),
    ("[cameras]\n", "baseline_m = nan", 2, 14, "found nan, expected a finite number"),
    ("[neck]\n", "yaw_degrees = [10, 90]", 2, 15, "the head starts at 0"),
    ("[imu]\n", "rate_hz = 1", 2, 11, "found 1, expected 20 to 2000"),
    ("[[faults]]\norgan = 'nose'\n", "looks = [1, 2]", 2, 9, "there is no organ `nose`"),
    ("[[faults]]\norgan = 'imu'\n", "looks = [3, 2]", 3, 9, "counted from 1"),
];

#[test]
fn mistakes_have_a_line_and_a_column() {
    let mut wrong = Vec::new();
    for (before, text, line, column, reason) in MISTAKES {
        let message = refusal(&format!("{ROOM}{before}{text}\n"));
        let place = format!("`my.toml` line {}, column {column}: ", line + 4);
        if !message.starts_with(&place) || !message.contains(reason) {
            wrong.push(format!("{before}{text}\n  expected {place}{reason}\n  found    {message}"));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn mistakes_of_the_whole_file() {
    for (text, place, reason) in [
        ("", "line 1, column 1", "missing field `title`"),
        ("title = 'x'\n", "line 1, column 1", "missing field `room`"),
        ("title = 'x'\n[room]\nmin = [0, -2, -1]\nmax = [3, 2, 1]\n", "line 3, column 7", "the head is at 0"),
        (
            "title = 'x'\n[room]\nmin = [-1, -2, -1]\nmax = [3, -2, 1]\n",
            "line 4, column 7",
            "the head is at 0",
        ),
        ("title = 'x'\n[room\n", "line 2", ""),
        ("title = 'x'\nrooms = 3\n", "line 2, column 1", "unknown field `rooms`"),
    ] {
        let message = refusal(text);
        assert!(message.contains(place) && message.contains(reason), "{text}\n{message}");
    }
}

#[test]
fn a_name_that_is_no_scene_gets_the_list() {
    let message = Scene::find("kitchen").unwrap_err().to_string();
    assert!(message.contains("there is no scene `kitchen`: expected furnished, empty, office"), "{message}");
    let missing = Scene::find("kitchen.toml").unwrap_err().to_string();
    assert!(missing.contains("cannot read `kitchen.toml`"), "{missing}");
}

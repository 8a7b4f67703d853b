//! The right-handed frame in all output: no file is a mirror image.
//!
//! In: an asymmetric scene, a near board to the left and above before a far wall, seen by a pair of pictures, then by a
//! head that has turned to the left. Out: PLY, PNG, JSON. Invariant: objects on the left of a person standing there
//! have a positive azimuth and a positive y, and are left in the pictures; a turn to the left has a positive yaw.

use serde_json::Value;
use std::f64::consts::PI;
use std::path::Path;
use std::process::Command;
use tempfile::TempDir;

const WIDTH: usize = 200;
const HEIGHT: usize = 96;
/// f = 150 px, B = 0.1 m: 15 px are 1 m deep, 6 px are 2.5 m.
const DISPARITIES: [usize; 2] = [6, 15];
/// The board in the left picture: columns and rows. Its middle is 50 px left of the axis and 14 px above it.
const BOARD: [std::ops::Range<usize>; 2] = [20..80, 8..60];

fn texture(x: usize, y: usize) -> u8 {
    let mut seed = (x as u64) << 32 | y as u64;
    for _ in 0..3 {
        seed = (seed ^ 0x9e37_79b9_7f4a_7c15).wrapping_mul(0xbf58_476d_1ce4_e5b9).rotate_left(27);
    }
    (seed >> 56) as u8
}

/// The picture of one eye; in the right one everything is shifted to the left by the disparity.
fn write_picture(path: &Path, is_right: bool) {
    let [far, near] = if is_right { DISPARITIES } else { [0, 0] };
    let pixel = |at: usize| {
        let (x, y) = (at % WIDTH, at / WIDTH);
        let board = BOARD[0].contains(&(x + near)) && BOARD[1].contains(&y);
        if board { texture(x + near + 1000, y) } else { texture(x + far, y) }
    };
    let file = std::io::BufWriter::new(std::fs::File::create(path).unwrap());
    let mut encoder = png::Encoder::new(file, WIDTH as u32, HEIGHT as u32);
    encoder.set_color(png::ColorType::Grayscale);
    let pixels: Vec<u8> = (0..WIDTH * HEIGHT).map(pixel).collect();
    encoder.write_header().unwrap().write_image_data(&pixels).unwrap();
}

/// A written picture: pixels by column and row.
struct Written {
    width: usize,
    rgb: Vec<u8>,
}

impl Written {
    fn read(path: &Path) -> Self {
        let decoder = png::Decoder::new(std::io::BufReader::new(std::fs::File::open(path).unwrap()));
        let mut reader = decoder.read_info().unwrap();
        let mut rgb = vec![0; reader.output_buffer_size().unwrap()];
        let frame = reader.next_frame(&mut rgb).unwrap();
        Self { width: frame.width as usize, rgb }
    }

    fn at(&self, x: f64, y: f64) -> [u8; 3] {
        let at = 3 * (y as usize * self.width + x as usize);
        [self.rgb[at], self.rgb[at + 1], self.rgb[at + 2]]
    }

    /// Mean column and row of the pixels of a kind.
    fn centre_of(&self, is_kind: fn([u8; 3]) -> bool) -> [f64; 2] {
        let (mut sum, mut count) = ([0.0, 0.0], 0.0);
        let pixels = self.rgb.as_chunks::<3>().0;
        for at in (0..pixels.len()).filter(|at| is_kind(pixels[*at])) {
            sum = [sum[0] + (at % self.width) as f64, sum[1] + (at / self.width) as f64];
            count += 1.0;
        }
        assert!(count > 100.0, "{count} pixels");
        sum.map(|sum| sum / count)
    }
}

/// Yellow and green: the near end of the scale of ranges.
fn is_near([red, green, blue]: [u8; 3]) -> bool {
    green > 180 && blue < 120 && red > 90
}

/// Violet and blue: the far end.
fn is_far([red, green, blue]: [u8; 3]) -> bool {
    red < 70 && green < 110 && blue > 70
}

fn run(arguments: &[&str]) -> Value {
    let output = Command::new(env!("CARGO_BIN_EXE_bvm")).args(arguments).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

#[test]
fn a_look_is_not_mirrored() {
    let folder = TempDir::new().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let [left, right, rig, out] = ["left.png", "right.png", "rig.toml", "out"].map(path);
    write_picture(Path::new(&left), false);
    write_picture(Path::new(&right), true);
    let text =
        "focal_px = 150\ncx_px = 100\ncy_px = 48\nbaseline_m = 0.1\ndoffs_px = 0\nmax_disparity_px = 32\n";
    std::fs::write(&rig, text).unwrap();
    let answer =
        run(&["look", "--left", &left, "--right", &right, "--calibration", &rig, "--out", &out, "--json"]);
    assert!(answer["frame"].as_str().unwrap().starts_with("x ahead, y left, z up"), "{answer}");
    let out = Path::new(&out);

    let ply = std::fs::read(out.join("cloud.ply")).unwrap();
    let end = ply.windows(11).position(|bytes| bytes == b"end_header\n").unwrap() + 11;
    let header = std::str::from_utf8(&ply[..end]).unwrap();
    assert!(header.contains("comment frame of the map: x ahead, y left, z up"), "{header}");
    // Three floats, three bytes of grey, λ.
    let points: Vec<[f32; 3]> = (ply[end..].chunks_exact(19))
        .map(|point| [0, 4, 8].map(|at| f32::from_le_bytes(point[at..at + 4].try_into().unwrap())))
        .collect();
    let mean = |is_in: fn(f32) -> bool, axis: usize| {
        let values: Vec<f32> =
            points.iter().filter(|point| is_in(point[0])).map(|point| point[axis]).collect();
        assert!(values.len() > 500, "{}", values.len());
        values.iter().sum::<f32>() / values.len() as f32
    };
    let board = |ahead: f32| ahead < 1.5;
    let wall = |ahead: f32| ahead > 2.0;
    // 50 / 150 and 14 / 150 of a metre.
    assert!((mean(board, 0) - 1.0).abs() < 0.05 && (mean(wall, 0) - 2.5).abs() < 0.2);
    assert!((mean(board, 1) - 0.333).abs() < 0.05, "to the left: {}", mean(board, 1));
    assert!((mean(board, 2) - 0.093).abs() < 0.03, "above: {}", mean(board, 2));
    assert!(
        mean(wall, 1) < -0.05 && mean(wall, 2) < -0.02,
        "what is left of the wall is to the right, and below"
    );

    for name in ["range_panorama.png", "occupancy_panorama.png"] {
        // Without the colour bar, which is to the right of the frame.
        let mut picture = Written::read(&out.join(name));
        let width = picture.width;
        for (at, value) in picture.rgb.iter_mut().enumerate() {
            *value = if at / 3 % width > width - 125 { 255 } else { *value };
        }
        let (near, far) = (picture.centre_of(is_near), picture.centre_of(is_far));
        assert!(near[0] + 50.0 < far[0] && near[1] + 20.0 < far[1], "{name}: {near:?} {far:?}");
    }
    // From above: 540 pixels for 1.04 times the reach to either side, ahead upwards.
    let above = Written::read(&out.join("top_view.png"));
    let reach = answer["grid"]["rho_max_m"].as_f64().unwrap();
    let dark = |ahead: f64, to_the_left: f64| {
        let scale = 270.0 / (1.04 * reach);
        let places = (-4..=4).flat_map(|dx| (-4..=4).map(move |dy| (f64::from(dx), f64::from(dy))));
        let darkest = places.map(|(dx, dy)| {
            above
                .at(365.0 - scale * to_the_left + dx, 320.0 - scale * ahead + dy)
                .map(u32::from)
                .iter()
                .sum::<u32>()
        });
        darkest.min().unwrap() < 200
    };
    assert!(dark(1.0, 0.333) && !dark(1.0, -0.333), "the board is on the left, and only there");
}

/// A recording of frames at some times, ns, and of `readings` inertial readings at 200 Hz: a body at rest (x ahead, y left, z up) that
/// turns to the left by half a radian a second from 0.2 s on.
fn write_recording(folder: &Path, times: &[i64], readings: i64) {
    for (camera, is_right) in [("cam0", false), ("cam1", true)] {
        let data = folder.join(camera).join("data");
        std::fs::create_dir_all(&data).unwrap();
        for time in times {
            write_picture(&data.join(format!("{time}.png")), is_right);
        }
        // Columns: the camera's right is −y, its down −z, its ahead x; the right camera is 0.1 m along −y.
        let place = if is_right { -0.1 } else { 0.0 };
        let text = format!(
            "T_BS:\n  data: [0.0, 0.0, 1.0, 0.0,\n -1.0, 0.0, 0.0, {place},\n 0.0, -1.0, 0.0, 0.0,\n 0.0, 0.0, 0.0, 1.0]\n\
             resolution: [{WIDTH}, {HEIGHT}]\ncamera_model: pinhole\nintrinsics: [150.0, 150.0, 100.0, 48.0]\n\
             distortion_model: radial-tangential\ndistortion_coefficients: [0.0, 0.0, 0.0, 0.0]\n"
        );
        std::fs::write(folder.join(camera).join("sensor.yaml"), text).unwrap();
    }
    let mut rows = "#time,wx,wy,wz,ax,ay,az\n".to_owned();
    for step in 0..readings {
        // Counter-clockwise about the vertical is positive, as for any gyroscope.
        let rate = if step > 40 { 0.5 } else { 0.0 };
        rows += &format!("{},0.0,0.0,{rate},0.0,0.0,9.81\n", step * 5_000_000);
    }
    std::fs::write(folder.join("imu0.csv"), rows).unwrap();
}

#[test]
fn a_replay_turns_to_the_left() {
    let folder = TempDir::new().unwrap();
    write_recording(folder.path(), &[200_000_000, 1_200_000_000], 241);
    let out = folder.path().join("out");
    let answer = run(&[
        "replay",
        "--recording",
        folder.path().to_str().unwrap(),
        "--out",
        out.to_str().unwrap(),
        "--json",
    ]);
    assert!(answer["frame"].as_str().unwrap().contains("left positive"), "{answer}");
    let yaw = answer["frames"][1]["yaw_degrees"].as_f64().unwrap();
    assert!((yaw - 0.5f64.to_degrees()).abs() < 0.6, "{yaw}");
    // The board is 18° left of the head's axis: 47° left in the map. On the right, only the first frame saw the wall,
    // and the map is unknown beyond 34°.
    let panorama = Written::read(&out.join("occupancy_panorama.png"));
    let of_panorama = |azimuth: f64, elevation: f64| {
        panorama.at(90.0 + 6.75 * (60.0 - azimuth), 50.0 + 6.75 * (40.0 - elevation))
    };
    let strip = Written::read(&out.join("strip.png"));
    // The second tile, below two pictures of 50 × 24; 50 × 33 pixels for ±60° by ±40°.
    let of_strip = |azimuth: f64, elevation: f64| {
        strip.at(50.0 + 25.0 * (1.0 - azimuth / 60.0), 48.0 + 16.5 * (1.0 - elevation / 40.0))
    };
    for (name, pixel) in [("panorama", &of_panorama as &dyn Fn(f64, f64) -> [u8; 3]), ("strip", &of_strip)] {
        let [left, right] = [47.0, -20.0].map(|azimuth| pixel(azimuth, 8.0));
        assert!(is_near(left) && left[0] > right[0] + 60, "{name}: {left:?} {right:?}");
        assert_eq!(pixel(-50.0, 8.0), [214, 220, 230], "{name}");
    }
}

#[test]
fn a_replay_says_what_is_late_or_missing() {
    let folder = TempDir::new().unwrap();
    // Frames every 50 ms; two are missing, one has no partner, and the inertial readings end at 0.3 s.
    let times = [200_000_000, 250_000_000, 300_000_000, 450_000_000];
    write_recording(folder.path(), &times, 61);
    write_picture(&folder.path().join("cam0").join("data").join("500000000.png"), false);
    // The body goes half a metre ahead within the first 0.1 s; nobody knows where it is at 0.45 s.
    let poses = folder.path().join("poses.csv");
    let rows = [(100_000_000, 2.0), (200_000_000, 2.0), (300_000_000, 2.5)];
    let row = |(time, x): &(i64, f64)| format!("{time},{x},7,1,1,0,0,0\n");
    std::fs::write(&poses, format!("#ns,x,y,z\n{}", rows.iter().map(row).collect::<String>())).unwrap();
    let out = folder.path().join("out");
    let text = |path: &Path| path.to_str().unwrap().to_owned();
    let (recording, out, poses) = (text(folder.path()), text(&out), text(&poses));
    let answer = run(&["replay", "--recording", &recording, "--poses", &poses, "--out", &out, "--json"]);
    let clock = &answer["clock"];
    for (name, expected) in [
        ("missing_frames", 2),
        ("unpaired_frames", 1),
        ("frames_without_orientation", 1),
        ("frames_without_place", 1),
        ("surplus_frames", 0),
    ] {
        assert_eq!(clock[name].as_u64(), Some(expected), "{name}: {clock}");
    }
    assert_eq!(clock["period_ms"].as_f64(), Some(50.0));
    let frames = answer["frames"].as_array().unwrap();
    assert_eq!(frames[3]["instants"].as_u64(), Some(3));
    let number = |frame: usize, name: &str| frames[frame][name].as_f64().unwrap();
    assert!((number(3, "inertial_age_ms") - 150.0).abs() < 0.1);
    // The prior of rates, 0.7 rad/s, for 0.15 s.
    assert!((number(3, "sd_yaw_degrees") - 6.0).abs() < 0.2, "{}", number(3, "sd_yaw_degrees"));
    assert!(number(2, "sd_yaw_degrees") < 1.0);
    assert!((number(3, "yaw_degrees") - number(2, "yaw_degrees")).abs() < 1e-9);
    let place = |frame: usize, axis: usize| frames[frame]["place_m"][axis].as_f64().unwrap();
    assert_eq!(place(0, 0), 0.0);
    for (frame, ahead) in [(1, 0.25), (2, 0.5)] {
        let (x, y) = (place(frame, 0), place(frame, 1));
        assert!((x - ahead).abs() < 1e-3 && y.abs() < 1e-3, "{frame}: {x} {y}");
    }
    assert!(frames[3]["place_m"].is_null());
}

#[test]
fn an_exploration_looks_in_the_reported_directions() {
    let folder = TempDir::new().unwrap();
    let out = folder.path().join("out");
    let answer = run(&["explore", "--steps", "4", "--out", out.to_str().unwrap(), "--json"]);
    assert!(answer["frame"].as_str().unwrap().starts_with("x ahead, y left, z up"));
    for policy in answer["policies"].as_array().unwrap() {
        for step in policy["steps"].as_array().unwrap() {
            let angle = |value: &Value| value.as_f64().unwrap();
            let off = angle(&step["true_yaw"]) - angle(&step["gaze"]["azimuth"]);
            assert!(off.sin().abs() < 0.02 && off.cos() > 0.0, "{step}");
            let is_wrapped = |angle: f64| angle > -PI && angle <= PI;
            let angles = [&step["true_yaw"], &step["estimated_yaw"], &step["gaze"]["azimuth"]];
            assert!(angles.map(angle).into_iter().all(is_wrapped), "{step}");
        }
    }
}

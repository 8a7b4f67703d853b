//! Rendered pictures against the geometry of the world.

use bvm::head::{Attitude, Extrinsics};
use bvm::vision::{Calibration, Matcher, Pair};
use bvm::world::render::{Pinhole, exposed, exposure};
use bvm::world::scene::Scene;
use bvm::world::{World, seeded};

const SIZE: [usize; 2] = [320, 240];
const FOCAL: f64 = 190.0;

fn pinhole(side: usize, attitude: &Attitude) -> Pinhole {
    let camera = Extrinsics::of(0.12, 0.05).camera_to_map(side, attitude);
    Pinhole { place: camera.translation, rotation: camera.rotation, size_px: SIZE, focal_px: FOCAL }
}

fn world(scene: &str) -> World {
    Scene::find(scene).unwrap().world(1)
}

#[test]
fn disparities_of_rendered_pairs_are_those_of_the_world() {
    let world = world("office");
    let attitude = Attitude { yaw: 0.4, pitch: -0.2, ..Attitude::default() };
    let mut random = seeded(1, "test");
    let pictures = [0, 1].map(|side| {
        let seen = pinhole(side, &attitude).brightness(&world, 0.0);
        exposed(SIZE, &seen, exposure(&seen), 2.0, &mut random).unwrap()
    });
    let [left, right] = pictures;
    let camera = pinhole(0, &attitude);
    let rig = Calibration::of_rig(FOCAL, camera.centre_px(), 0.12, 60).unwrap();
    let found = Pair::new(left, right, rig).unwrap().matched(Matcher::Scanline).unwrap();
    let (mut count, mut near) = (0, 0);
    for y in (10..230).step_by(7) {
        for x in (70..310).step_by(7) {
            let disparity = f64::from(found.disparity[y * SIZE[0] + x]);
            let Some(range) = rig.range_m(x as f64, y as f64, disparity) else { continue };
            // The truth: the ray from the camera, by bisection of `occupied`, which rendering does not use.
            let slopes = rig.ray(x as f64, y as f64);
            let length = slopes.iter().map(|part| part * part).sum::<f64>().sqrt();
            let point = |range: f64| {
                let along = slopes.map(|part| part / length * range);
                let turned =
                    camera.rotation.map(|row| row[0] * along[0] + row[1] * along[1] + row[2] * along[2]);
                [0, 1, 2].map(|axis| camera.place[axis] + turned[axis])
            };
            let truth =
                (1..1000).map(|step| f64::from(step) * 0.01).find(|range| world.occupied(point(*range), 0.0));
            let expected = rig.disparity_px(x as f64, y as f64, truth.unwrap());
            count += 1;
            near += usize::from((disparity - expected).abs() < 1.0);
            assert!(range > 0.0);
        }
    }
    assert!(count > 600, "{count} of 1085 pixels have a disparity");
    assert!(near * 100 > count * 93, "{near} of {count} within a pixel");
}

#[test]
fn exposure_makes_the_mean_and_noise_its_deviation() {
    let seen = pinhole(0, &Attitude::default()).brightness(&world("empty"), 0.0);
    let mut random = seeded(1, "test");
    let clean = exposed(SIZE, &seen, exposure(&seen), 0.0, &mut random).unwrap();
    let noisy = exposed(SIZE, &seen, exposure(&seen), 3.0, &mut random).unwrap();
    let count = clean.pixels().len() as f32;
    let mean = clean.pixels().iter().sum::<f32>() / count;
    assert!((mean - 110.0).abs() < 1.0, "{mean}");
    let differences = clean.pixels().iter().zip(noisy.pixels()).map(|(one, other)| (one - other).powi(2));
    let deviation = (differences.sum::<f32>() / count).sqrt();
    // 3 grey levels, and the rounding of both: √(9 + 1/12).
    assert!((deviation - 3.01).abs() < 0.1, "{deviation}");
    let contrast = clean.pixels().iter().map(|level| (level - mean).powi(2)).sum::<f32>() / count;
    assert!(contrast.sqrt() > 10.0, "texture: {}", contrast.sqrt());
}

#[test]
fn fog_and_black_take_the_contrast() {
    let deviation = |scene: &str, attitude: Attitude| {
        let seen = pinhole(0, &attitude).brightness(&world(scene), 0.0);
        let middle: Vec<f64> = (100..140).flat_map(|y| seen[y * 320 + 140..y * 320 + 180].to_vec()).collect();
        let mean = middle.iter().sum::<f64>() / middle.len() as f64;
        let square = middle.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / middle.len() as f64;
        (mean, square.sqrt())
    };
    let looking = |yaw: f64| Attitude { yaw, ..Attitude::default() };
    // Half a visibility of fog leaves √0.02 = 14 % of the contrast.
    let (_, clear) = deviation("fog", looking(-1.0));
    let (_, foggy) = deviation("fog", looking(0.7));
    assert!(foggy < 0.6 * clear, "{foggy} of {clear}");
    let (dark, flat) = deviation("glass_and_black", looking(0.9));
    assert!(dark < 0.02 && flat < 1e-9, "the black cupboard: {dark} ± {flat}");
}

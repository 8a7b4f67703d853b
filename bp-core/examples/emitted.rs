//! scratch
#![allow(missing_docs, unreachable_pub, unused)]
include!("/tmp/emit/out.rs");
use bp_core::{exec::*, space::*, *};
fn lanes(model: &model::Model, q: &str) -> Vec<Lanes> {
    let question = model.question(q).unwrap();
    let p = plan::plan(model, question, Default::default()).unwrap();
    p.routes.iter().map(|r| match r { plan::Route::Exact(e) => Lanes::new(lower::lower(model, e, q).unwrap().kernel), _ => panic!() }).collect()
}
fn same(name: &str, a: &[f64], b: &[f64]) { 
    assert_eq!(a.len(), b.len(), "{name}");
    let d = a.iter().zip(b).map(|(x, y)| (x - y).abs()).fold(0.0, f64::max); println!("{name}: max difference {d:e} of {}", a.len()); assert!(d < 1e-12 || a.iter().zip(b).all(|(x,y)| (x-y).abs() <= 1e-9*x.abs().max(1e-9))); }
fn main() {
    let space = Space::new([5, 9, 130], [Edge::Open, Edge::Pole, Edge::Circle]).unwrap();
    let cells = space.cells();
    let vs = [[0, 0, 0], [1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]];
    let moves = space.antecedents(&vs);
    let mut seed = 1u64; let mut r = || { seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407); ((seed >> 33) as f64) / (1u64 << 31) as f64 };
    let po1: Vec<f64> = (0..cells).map(|_| r()).collect();
    let po: Vec<f64> = po1.iter().map(|p| 1.0 - p).chain(po1.iter().copied()).collect();
    let mut pv: Vec<f64> = (0..7 * cells).map(|_| r() + 0.01).collect();
    for c in 0..cells { let s: f64 = (0..7).map(|v| pv[v * cells + c]).sum(); for v in 0..7 { pv[v * cells + c] /= s; } }
    let lik: Vec<f64> = (0..2 * 2 * cells).map(|_| r() + 0.01).collect();
    let inputs = Inputs::new().grid("Grid", &space).displacements("Velocity", &moves).size("Sensors", 2).number("epsilon", 0.02).array("previous O", &po).array("previous V", &pv).array("Sensors[i].reading", &lik);
    let m = cell::model();
    for l in lanes(&m, "observe") {
        let a = interpret(l.kernel(), &inputs).unwrap(); let b = l.run(&inputs).unwrap();
        for ((n, x), (_, y)) in a.arrays.iter().zip(&b.arrays) { same(n, x, y); }
        let mut o = cell::observe::Outputs::default();
        cell::observe::run(&cell::observe::Inputs { grid: &space, velocity: &moves, sensors: 2, epsilon: 0.02, previous_o: &po, previous_v: &pv, sensors_i_reading: &lik, marker: std::marker::PhantomData }, &mut o).unwrap();
        same("emitted O", &a.arrays[0].1, &o.p_o_z); same("emitted V", &a.arrays[1].1, &o.p_v_z); same("emitted H", &a.arrays[2].1, &o.entropy_p_o_v_z);
        for b in l.kernel().buffers.values() { println!("   {:?} {:?} {:?}", b.name, b.role, b.axes.iter().map(|a| &l.kernel().axes[*a].name).collect::<Vec<_>>()); }
    }
    let rays = 300; let sigma: Vec<f64> = (0..rays).map(|_| r() + 0.1).collect(); let z: Vec<f64> = (0..rays).map(|_| (r() * 11.0).floor()).collect();
    let inputs = Inputs::new().size("Rays", rays).size("N", 10).array("sigma", &sigma).array("z", &z);
    for l in lanes(&line_of_sight::model(), "reading") {
        let a = interpret(l.kernel(), &inputs).unwrap(); let b = l.run(&inputs).unwrap();
        same("los", &a.arrays[0].1, &b.arrays[0].1);
        let mut o = line_of_sight::reading::Outputs::default();
        line_of_sight::reading::run(&line_of_sight::reading::Inputs { rays, n: 10, sigma: &sigma, z: &z, marker: std::marker::PhantomData }, &mut o).unwrap();
        same("los emitted", &a.arrays[0].1, &o.p_z_z_o_c);
    }
    let sigma = [0.6]; let z = [3.0]; let mut o = line_of_sight::reading::Outputs::default();
    line_of_sight::reading::run(&line_of_sight::reading::Inputs { rays: 1, n: 10, sigma: &sigma, z: &z, marker: std::marker::PhantomData }, &mut o).unwrap();
    println!("{:.4?}", (0..10).map(|c| o.p_z_z_o_c[10 + c] / (o.p_z_z_o_c[10 + c] + o.p_z_z_o_c[c])).collect::<Vec<f64>>());
    let heading: Vec<f64> = (0..cells).map(|_| r()).collect(); let h: Vec<f64> = (0..cells).map(|_| r()).collect();
    let inputs = Inputs::new().grid("Grid", &space).number("eta", 0.001).array("map.P(O | C)", &po1).array("map.H", &h).array("heading", &heading);
    for l in lanes(&gaze::model(), "look") {
        let a = interpret(l.kernel(), &inputs).unwrap(); let b = l.run(&inputs).unwrap();
        same("gaze", &a.arrays[0].1, &b.arrays[0].1);
        let mut o = gaze::look::Outputs::default();
        gaze::look::run(&gaze::look::Inputs { grid: &space, eta: 0.001, map_p_o_c: &po1, map_h: &h, marker: std::marker::PhantomData }, &mut o).unwrap();
        same("gaze emitted", &a.arrays[0].1, &o.argmax_p_g_nearest_heading);
    }
    let mut_: Vec<f64> = (0..cells).map(|_| r() * 1e-4).collect(); let mul: Vec<f64> = (0..4 * cells).map(|_| r() * 5.0).collect();
    let (tau, lv) = ([0.3e-4], [1.0, 2.0, 3.0, 4.0]);
    let inputs = Inputs::new().size("Grid", cells).size("Channels", 4).number("rate", 0.1).number("tau_max", 1e-3).number("l_max", 40.0).number("sigma_tau", 2e-5).number("sigma_l", 3.0).array("mu_tau", &mut_).array("mu_l", &mul).array("tau", &tau).array("l", &lv);
    for l in lanes(&binaural::model(), "reading") {
        let a = interpret(l.kernel(), &inputs).unwrap(); let b = l.run(&inputs).unwrap();
        same("binaural", &a.arrays[0].1, &b.arrays[0].1);
        let mut o = binaural::reading::Outputs::default();
        binaural::reading::run(&binaural::reading::Inputs { grid: cells, channels: 4, rate: 0.1, tau_max: 1e-3, l_max: 40.0, sigma_tau: 2e-5, sigma_l: 3.0, mu_tau: &mut_, mu_l: &mul, tau: &tau, l: &lv, marker: std::marker::PhantomData }, &mut o).unwrap();
        same("binaural emitted", &a.arrays[0].1, &o.p_tau_tau_l_l_o);
    }
    let mut f = vestibular::rotation::filter(&[]).unwrap(); f.settle().unwrap();
    println!("gains {:?} {:?}", f.gain_of("Omega", "V"), f.gain_of("C", "V").map(|g| g / 0.01));
    let big = Space::new([10, 90, 360], [Edge::Open, Edge::Pole, Edge::Circle]).unwrap(); let mv = big.antecedents(&vs); let n = big.cells();
    let po = vec![0.5f32; 2 * n]; let pv = vec![1.0 / 7.0f32; 7 * n]; let lik = vec![0.4f32; 2 * n];
    let mut o = cell::step::Outputs::default(); let mut o2 = cell::observe::Outputs::default();
    for _ in 0..3 {
        let t = std::time::Instant::now();
        for _ in 0..10 { cell::step::run(&cell::step::Inputs { grid: &big, velocity: &mv, sensors: 1, epsilon: 0.02, previous_o: &po, previous_v: &pv, sensors_i_reading: &lik, marker: std::marker::PhantomData }, &mut o).unwrap(); }
        println!("emitted step {:?}", t.elapsed() / 10);
        let t = std::time::Instant::now();
        for _ in 0..10 { cell::observe::run(&cell::observe::Inputs { grid: &big, velocity: &mv, sensors: 1, epsilon: 0.02, previous_o: &po, previous_v: &pv, sensors_i_reading: &lik, marker: std::marker::PhantomData }, &mut o2).unwrap(); }
        println!("emitted observe {:?}", t.elapsed() / 10);
        let inputs = Inputs::new().grid("Grid", &big).displacements("Velocity", &mv).size("Sensors", 1).number("epsilon", 0.02).array("previous O", &po).array("previous V", &pv).array("Sensors[i].reading", &lik);
        let l = &lanes(&m, "step")[0]; let t = std::time::Instant::now(); for _ in 0..3 { l.run(&inputs).unwrap(); } println!("lanes step {:?}", t.elapsed() / 3);
    }
}

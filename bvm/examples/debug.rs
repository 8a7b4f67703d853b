//! scratch
use bvm::{
    audition::*,
    grid::*,
    map::*,
    vision::*,
    world::{sensors::*, *},
};
fn main() {
    let grid = Grid::new(GridConfiguration::default_exploration()).unwrap();
    let world = World::embedded(1);
    let camera = DepthCamera::default();
    let mut n = seeded(1, "sight");
    let mut hn = seeded(1, "hearing");
    let mut s = Sight::default();
    let mut h = Hearing::calibrated(&grid);
    let mut map = Map::new(grid.clone()).unwrap();
    let cells = grid.cells();
    for t in 0..30 {
        let yaw = t as f64 * 0.7;
        let r = camera.look(&world, &grid, yaw, 0.3 * (t % 3) as f64, t as f64, &mut n);
        let l = s.likelihood(&grid, &r, camera.sigma_min_m).unwrap();
        let c = Ears::default().hear(&world, yaw, &mut hn);
        let a = c.map(|c| h.likelihood(&c).unwrap());
        let before = (map.occupancy().to_vec(), map.velocity().to_vec());
        let ls: Vec<_> = std::iter::once(&l).chain(&a).collect();
        map.observe(&ls).unwrap();
        let bad: Vec<usize> = (0..cells)
            .filter(|i| !map.entropy()[*i].is_finite() || !map.occupancy()[*i].is_finite())
            .collect();
        println!(
            "{t} bad {} lmax {:?} amax {:?}",
            bad.len(),
            l.iter().copied().fold(0.0, f32::max),
            a.as_ref().map(|a| a.iter().copied().fold(0.0, f32::max))
        );
        if let Some(i) = bad.first() {
            println!(
                "{i} o {} H {} Ho {} l {} {} a {:?} before {} v {:?} after v {:?}",
                map.occupancy()[*i],
                map.entropy()[*i],
                map.occupancy_entropy()[*i],
                l[*i],
                l[cells + i],
                a.map(|a| (a[*i], a[cells + i])),
                before.0[*i],
                (0..7).map(|v| before.1[v * cells + i]).collect::<Vec<_>>(),
                (0..7).map(|v| map.velocity()[v * cells + i]).collect::<Vec<_>>()
            );
            break;
        }
    }
}

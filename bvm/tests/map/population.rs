//! Population codes and ranges: the programs against enumeration, and against the paper's program of one reading.
//!
//! In: a short line of sight, at random. Out: pass or fail. Invariant: expected values are sums over all states of the
//! hidden cells, with normal laws that are integrated here, or the answers of `models/line_of_sight.bp`.

use bvm::grid::{Grid, GridConfiguration};
use bvm::map::Map;
use bvm::programs::{population_code, range_code};
use bvm::vision::{EvidenceKind, RangeReading, Sight};

const N: usize = 4;

/// The integral of the normal density about `mean`, by Simpson's rule.
fn integral(mean: f64, sigma: f64, from: f64, to: f64) -> f64 {
    let density =
        |u: f64| (-0.5 * ((u - mean) / sigma).powi(2)).exp() / (sigma * (2.0 * std::f64::consts::PI).sqrt());
    let steps = 2000;
    let h = (to - from) / f64::from(steps);
    let weight = |i: i32| {
        if i == 0 || i == steps {
            1.0
        } else if i % 2 == 1 {
            4.0
        } else {
            2.0
        }
    };
    (0..=steps).map(|i| weight(i) * density(from + h * f64::from(i))).sum::<f64>() * h / 3.0
}

/// P_k(z): the mass of the normal law about k − ½ in bin z; 0 is all beyond N, or no cell.
fn bins(k: usize, sigma: f64) -> [f64; N + 1] {
    let mut bins = [0.0; N + 1];
    if k > N {
        bins[0] = 1.0;
        return bins;
    }
    let mean = k as f64 - 0.5;
    // Ranges nearer than the first cell count as in it.
    bins[1] = integral(mean, sigma, mean - 12.0 * sigma, 1.0);
    (2..=N).for_each(|z| bins[z] = integral(mean, sigma, z as f64 - 1.0, z as f64));
    bins[0] = 1.0 - bins[1..].iter().sum::<f64>();
    bins
}

/// P(reading | O C): all states of the other cells, `of_first` for the first occupied cell, N + 1 where there is none.
fn over_states(c: usize, o: bool, hidden: &[f64; N], of_first: impl Fn(usize) -> f64) -> f64 {
    let others: Vec<usize> = (1..=N).filter(|j| *j != c).collect();
    (0..1usize << others.len())
        .map(|state| {
            let (mut p, mut first) = (1.0, if o { c } else { N + 1 });
            for (bit, &j) in others.iter().enumerate() {
                let is_occupied = state >> bit & 1 == 1;
                p *= if is_occupied { hidden[j - 1] } else { 1.0 - hidden[j - 1] };
                first = if is_occupied { first.min(j) } else { first };
            }
            p * of_first(first)
        })
        .sum()
}

/// P(Code | O C): all states of the other cells, and all readings.
fn enumerated(c: usize, o: bool, hidden: &[f64; N], code: &[f64; N + 1], sigma: f64) -> f64 {
    let of_first = |first| bins(first, sigma).iter().zip(code).map(|(z, code)| z * code).sum::<f64>();
    over_states(c, o, hidden, of_first)
}

#[test]
fn a_range_is_heard_as_of_a_surface_anywhere_within_its_cell() {
    // The edges of the cells are at 1, 2, 4, 8 and 16 m. Readings within a cell, on an edge, next to the end, beyond it and
    // nearer than the grid; deviations of 2 % to 40 % of the range.
    let (rho_min, ln_b) = (1.0f64, 2f64.ln());
    for (rho, sigma_m) in [(3.0, 0.3), (4.0, 0.08), (15.5, 2.0), (20.0, 4.0), (0.9, 0.2), (6.5, 2.6)] {
        let question = range_code::reading().rays(1).n(N).rho_min(rho_min).sigma_min(0.01).ln_b(ln_b);
        let answer = question.lambda(&[0.01 / sigma_m]).rho(&[rho]).ask().unwrap();
        let (u, s) = ((rho / rho_min).ln() / ln_b, sigma_m / rho / ln_b);
        // The density of the reading, of a surface at each place of its cell: surfaces nearer than the grid are in its first
        // cell, and where no cell is occupied the surface is beyond.
        let of_first = |k: usize| {
            let from = if k == 1 { u.min(1.0) - 12.0 * s } else { k as f64 - 1.0 };
            let to = if k > N { u.max(N as f64) + 12.0 * s } else { k as f64 };
            integral(u, s, from, to)
        };
        for c in 1..=N {
            for o in [false, true] {
                let found: f64 = answer.p(o, c as i64)[0];
                let expected = over_states(c, o, &[0.5; N], of_first);
                assert!(
                    (found - expected).abs() < 1e-6,
                    "{rho} m, C = {c}, O = {o}: {found}, not {expected}"
                );
            }
        }
    }
}

#[test]
fn hidden_cells_and_readings_are_summed_out() {
    let cases: [([f64; N], [f64; N + 1], f64); 3] = [
        ([0.5; N], [0.05, 0.1, 0.6, 0.2, 0.05], 0.4),
        ([0.02, 0.9, 0.3, 0.7], [0.3, 0.1, 0.2, 0.15, 0.25], 0.8),
        // A map without doubt: there is no division by zero.
        ([0.0, 1.0, 0.0, 0.5], [0.0, 0.0, 1.0, 0.0, 0.0], 0.3),
    ];
    for (hidden, code, sigma) in cases {
        let question = population_code::heard().rays(1).n(N).sigma_min(sigma).ln_b(1.0);
        let question = question.lambda(&[1.0]).rho(&[1.0]).hidden(&hidden).code(&code);
        let answer = question.ask().unwrap();
        for c in 1..=N {
            for o in [false, true] {
                let found: f64 = answer.p(o, c as i64)[0];
                let expected = enumerated(c, o, &hidden, &code, sigma);
                assert!((found - expected).abs() < 1e-6, "C = {c}, O = {o}: {found} is not {expected}");
            }
        }
    }
}

/// A small sphere, with a reading here and there.
fn scene() -> (Grid, Vec<Option<RangeReading>>) {
    let grid = Grid::new(GridConfiguration {
        cells_rho: 8,
        rho_min_m: 1.0,
        rho_max_m: 4.0,
        azimuth_cells: 8,
        elevation_cells: 4,
    })
    .unwrap();
    let reading = |ray: usize| {
        (!ray.is_multiple_of(3)).then(|| RangeReading {
            range_m: 0.9 + 0.11 * ray as f32,
            confidence: 0.2 + 0.8 * (ray % 5) as f32 / 5.0,
        })
    };
    let readings = (0..grid.directions()).map(reading).collect();
    (grid, readings)
}

#[test]
fn an_unknown_map_hides_cells_as_in_the_paper() {
    let (grid, readings) = scene();
    let view = bvm::vision::ViewReadings::hard(readings.clone(), 0.05);
    let unknown = Map::new(grid.clone()).unwrap();
    let mut sight = Sight::default();
    let paper = sight.likelihood(&grid, &readings, 0.05, EvidenceKind::Hard).unwrap();
    let mapped = sight.likelihood_of(&grid, &view, Some(&unknown)).unwrap();
    assert_eq!(paper.len(), 2 * grid.cells());
    for (paper, mapped) in paper.iter().zip(&mapped) {
        assert!((paper - mapped).abs() < 1e-5, "{mapped} is not {paper}");
    }
    // A direction without a reading is uninformative.
    assert!(paper.iter().step_by(grid.directions()).all(|one| *one == 1.0));
}

#[test]
fn cells_known_to_be_empty_hide_nothing() {
    let (grid, readings) = scene();
    let view = bvm::vision::ViewReadings::hard(readings.clone(), 0.05);
    let mut sight = Sight::default();
    let mut map = Map::new(grid.clone()).unwrap();
    for _ in 0..3 {
        let likelihood = sight.likelihood(&grid, &readings, 0.05, EvidenceKind::Hard).unwrap();
        map.observe(&[&likelihood]).unwrap();
    }
    let ray = (0..readings.len()).find(|ray| readings[*ray].is_some_and(|one| one.range_m > 2.5)).unwrap();
    let z = grid.rho_of(f64::from(readings[ray].unwrap().range_m)).unwrap();
    let occupied = |likelihood: &[f32]| likelihood[grid.cells() + z * grid.directions() + ray];
    let paper = sight.likelihood(&grid, &readings, 0.05, EvidenceKind::Hard).unwrap();
    let mapped = sight.likelihood_of(&grid, &view, Some(&map)).unwrap();
    // With ½ for each nearer cell, the reading hardly ever reaches this one.
    assert!(occupied(&mapped) > 4.0 * occupied(&paper), "{} and {}", occupied(&mapped), occupied(&paper));
}

//! Plates and families: all elements contribute to shared parameters.
//!
//! In: programs over a plate or with families, a few rows. Out: their parameters, and answers of the written text.
//! Invariant: expected numbers are computed by hand, or published.

use crate::support::learning::{learned, near, seen, written};
use crate::support::{model_of, question};
use bp_core::compiler::answer::ask;
use bp_core::compiler::exec::Inputs;
use bp_core::compiler::learn::{Case, Learned, Learner, Settings};
use bp_core::program::{Program, Rows};

fn default(learned: &Learned, name: &str) -> Vec<f64> {
    learned.model().parameters.values().find(|it| it.name == name).unwrap().default.clone()
}

fn pdf(x: f64, mean: f64, deviation: f64) -> f64 {
    let z = (x - mean) / deviation;
    (-0.5 * z * z).exp() / (deviation * (2.0 * std::f64::consts::PI).sqrt())
}

/// Three cells, two channels; cell 2 was never heard.
const RECORDINGS: &str = "C,S,Tau,L[0],L[1]
0,true,0.0001,2,-1
0,true,0.0003,4,-3
1,true,-0.0002,10,7
0,false,0.0011,-30,30
1,true,-0.0004,10,9
2,false,0.0001,0,0
";

#[test]
fn the_model_of_hearing_is_calibrated_cell_by_cell() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../bvm/models/binaural.bp");
    let text = std::fs::read_to_string(path).unwrap();
    let learned = learned(&text, RECORDINGS);
    assert_eq!(learned.report.hidden, ["O"]);
    near(&default(&learned, "mu_tau"), &[0.0002, -0.0003, -0.00005], 1e-18);
    // For a cell without cases, the mean of all others.
    let all = (2.0 + 4.0 + 10.0 + 10.0 - 1.0 - 3.0 + 7.0 + 9.0) / 8.0;
    near(&default(&learned, "mu_l"), &[3.0, -2.0, 10.0, 8.0, all, all], 1e-14);
    // Residuals of all cells together: ±10⁻⁴ four times; ±1, ±1 and 0, ±1 over eight.
    near(&default(&learned, "sigma_tau"), &[0.0001], 1e-18);
    near(&default(&learned, "sigma_l"), &[0.75_f64.sqrt()], 1e-15);
    // The text asks the same, cell by cell, in the order in which fields are written.
    let model = model_of(&written(&text, &learned));
    let tau = [0.0002];
    let l = [3.5, -1.0];
    let inputs = Inputs::new().size("Grid", 3).size("Channels", 2).array("tau", &tau).array("l", &l);
    for (model, inputs) in [(learned.model(), &inputs), (&model, &inputs)] {
        let answer = ask(model, model.question("source").unwrap(), inputs).unwrap();
        let found: Vec<f64> = answer[0].answer.iter().filter_map(|row| row.p()).collect();
        for cell in 0..3 {
            let heard = pdf(tau[0], default(&learned, "mu_tau")[cell], 0.0001)
                * pdf(l[0], default(&learned, "mu_l")[2 * cell], 0.75_f64.sqrt())
                * pdf(l[1], default(&learned, "mu_l")[2 * cell + 1], 0.75_f64.sqrt());
            let prior = 0.5 * 0.000_005;
            let silent = 1.0 / 0.0024 / 80.0 / 80.0;
            let expected = prior * heard / (prior * heard + (1.0 - prior) * silent);
            let row = found.iter().any(|p| (p - expected).abs() < 1e-12);
            assert!(row, "cell {cell}: {expected} in {found:?}");
        }
    }
    // ln L of the whole program: O is summed out, P(S = true) = 0.5 · rate.
    let mut ln = 4.0 * (0.5_f64 * 0.000_005).ln() + 2.0 * (1.0 - 0.5_f64 * 0.000_005).ln();
    for (tau, mean) in [(0.0001, 0.0002), (0.0003, 0.0002), (-0.0002, -0.0003), (-0.0004, -0.0003)] {
        ln += pdf(tau, mean, 0.0001).ln();
    }
    for (l, mean) in [
        (2.0, 3.0),
        (4.0, 3.0),
        (10.0, 10.0),
        (10.0, 10.0),
        (-1.0, -2.0),
        (-3.0, -2.0),
        (7.0, 8.0),
        (9.0, 8.0),
    ] {
        ln += pdf(l, mean, 0.75_f64.sqrt()).ln();
    }
    ln += 2.0 * (1.0 / 0.0024 / 80.0 / 80.0_f64).ln();
    near(&[learned.report.ln_likelihood], &[ln], 1e-9);
}

#[test]
fn a_field_over_the_plate_has_a_law_for_each_element_and_unknown_forms_one_for_all() {
    let text = "program Rooms over R in House {
        variables { Warm : bool; T : real; }
        decomposition { P(Warm) P(T | Warm) }
        forms { P(Warm) = unknown(histogram); P(T | Warm) = normal(mean[R, Warm], spread[R, Warm]); }
        identification { mean, spread from diary by R; }
    }";
    let rows = "R,Warm,T\n0,0,1\n0,0,3\n0,1,20\n0,1,24\n1,0,5\n1,0,9\n1,1,30\n1,1,31\n1,1,32\n";
    let learned = learned(text, rows);
    near(&default(&learned, "mean"), &[2.0, 22.0, 7.0, 31.0], 1e-14);
    near(&default(&learned, "spread"), &[1.0, 2.0, 2.0, (2.0_f64 / 3.0).sqrt()], 1e-14);
    assert!(written(text, &learned).contains("P(Warm) = bernoulli(0.5555555555555556);"));
    let ln: f64 = [
        (1.0, 2.0, 1.0),
        (3.0, 2.0, 1.0),
        (20.0, 22.0, 2.0),
        (24.0, 22.0, 2.0),
        (5.0, 7.0, 2.0),
        (9.0, 7.0, 2.0),
    ]
    .iter()
    .chain([30.0, 31.0, 32.0].map(|t| (t, 31.0, (2.0_f64 / 3.0).sqrt())).iter())
    .map(|(t, mean, spread)| pdf(*t, *mean, *spread).ln())
    .sum();
    let expected = ln + 5.0 * (5.0_f64 / 9.0).ln() + 4.0 * (4.0_f64 / 9.0).ln();
    near(&[learned.report.ln_likelihood], &[expected], 1e-12);
}

#[test]
fn elements_of_a_family_pool_where_their_form_is_one() {
    let text = |over: &str| {
        format!(
            "program Alarms {{ variables {{ Hot : bool; A[i in {over}] : bool; X[i in {over}] : real; }}
             decomposition {{ P(Hot) prod(i in {over}) {{ P(A[i] | Hot) P(X[i] | A[i]) }} }}
             forms {{ P(Hot) = unknown(histogram); P(A[i] | Hot) = unknown; P(X[i] | A[i]) = unknown(normal); }} }}"
        )
    };
    for (text, first) in [
        (text("Rooms"), 0),
        (text("Rooms").replace("i in Rooms] :", "1..=2] :").replace("prod(i in Rooms)", "prod(i)"), 1),
    ] {
        let (one, two) = (first, first + 1);
        let rows =
            format!("Hot,A[{one}],A[{two}],X[{one}],X[{two}]\n1,1,1,2,4\n1,1,0,6,1\n0,0,0,1,4\n0,1,,12,\n");
        let learned = learned(&text, &rows);
        let words = written(&text, &learned);
        // Hot: three of four are 1. Not hot: one of three; the missing one is uninformative.
        assert!(words.contains("false: 0.6, 0.4; true: 0.3333333333333333, 0.6666666666666666;"), "{words}");
        // Those that do not ring: 1, 1, 4; those that do: 2, 4, 6, 12.
        assert!(words.contains("normal(2, 1.4142135623730951)"), "{words}");
        assert!(words.contains("normal(6, 3.7416573867739413)"), "{words}");
        model_of(&words);
    }
}

#[test]
fn two_coins_of_ten_tosses_each_are_separated() {
    // Do and Batzoglou, *Nature Biotechnology* 26:897-899, 2008: from 0.6 and 0.5 to 0.80 and 0.52.
    let text = "program Coins { parameters { p[0..=1] : probability = [0.6, 0.5]; }
        variables { Coin : { A, B }; Toss[1..=10] : bool; }
        decomposition { P(Coin) prod(i) { P(Toss[i] | Coin) } }
        forms { P(Coin) = uniform; P(Toss[i] | Coin) = bernoulli(p[Coin]); }
        identification { p from tosses; } }";
    let heads: Vec<String> = (1..=10).map(|toss| format!("Toss[{toss}]")).collect();
    let mut rows = format!("{}\n", heads.join(","));
    for tosses in ["HTTTHHTHTH", "HHHHTHHHHH", "HTHHHHHTHH", "HTHTTTHHTT", "THHHTHHHTH"] {
        let cells: Vec<&str> = tosses.chars().map(|toss| if toss == 'H' { "1" } else { "0" }).collect();
        rows.push_str(&format!("{}\n", cells.join(",")));
    }
    let learned = learned(text, &rows);
    near(&default(&learned, "p"), &[0.80, 0.52], 0.005);
    // At the maximum a step changes nothing.
    let (mut a, mut b) = (default(&learned, "p")[0], default(&learned, "p")[1]);
    let (before, mut sums) = ([a, b], [[0.0; 2]; 2]);
    for heads in [5, 9, 8, 4, 7] {
        let [one, other] = [a, b].map(|p: f64| p.powi(heads) * (1.0 - p).powi(10 - heads));
        for (sum, share) in sums.iter_mut().zip([one / (one + other), other / (one + other)]) {
            *sum = [sum[0] + share * f64::from(heads), sum[1] + share * 10.0];
        }
    }
    (a, b) = (sums[0][0] / sums[0][1], sums[1][0] / sums[1][1]);
    near(&[a, b], &before, 1e-7);
}

#[test]
fn the_index_and_sizes_are_checked() {
    let text = "program Rooms over R in House { variables { T : real; } decomposition { P(T) }
        forms { P(T) = normal(mean[R], 1); } identification { mean from diary by R; } }";
    let model = model_of(text);
    assert!(Learner::new(&model).is_err());
    let given = Inputs::new().size("House", 2);
    let mut learner = Learner::with(&model, &given).unwrap();
    let (r, t) = (model.variable("R").unwrap(), model.variable("T").unwrap());
    assert!(learner.observe(&Case::new(&model).with(r, 2.0).with(t, 1.0)).is_err());
    learner.observe(&Case::new(&model).with(t, 1.0)).unwrap();
    let message = learner.learned().unwrap_err().to_string();
    assert!(message.contains("`R`: it is missing, but the program is repeated over it"), "{message}");
    let learned = seen(text, "R,T\n1,4\n1,6\n0,1\n").learned().unwrap();
    near(&default(&learned, "mean"), &[1.0, 5.0], 1e-15);
    let asked = question(learned.model(), "P(T = 4)");
    let answer = ask(learned.model(), &asked, &Inputs::new().size("House", 3));
    assert!(answer.unwrap_err().to_string().contains("2 numbers were given, but 3 are expected"));
}

#[test]
fn thousands_of_missing_elements_are_learned_from_rows() {
    let text = "program Tests {
        variables { K[row in Rows] : bool; Y[row in Rows] : bool; }
        decomposition { prod(row in Rows) { P(K[row]) } prod(row in Rows) { P(Y[row] | K[row]) } }
        forms { P(K[row]) = unknown(histogram); P(Y[row] | K[row]) = bernoulli(if K[row] { 0.9 } else { 0.2 }); }
    }";
    // Half of K is seen, half of it true; of the rest 55 in 100 have Y: the derivative of ln L,
    // 1000 / p - 1000 / (1 - p) + 1100 (0.7 / (0.2 + 0.7 p)) - 900 (0.7 / (0.8 - 0.7 p)), is 0 at p = 1/2.
    let cell = |row: usize| if row < 2000 { ["false", "true"][row % 2] } else { "NA" };
    let seen = |row: usize| if row < 2000 { row % 4 < 2 } else { row < 3100 };
    let rows = Rows::new().column("K", (0..4000).map(cell)).column("Y", (0..4000).map(seen));
    let learned =
        Program::parse(text).unwrap().rows(rows).unwrap().learn_from_rows(&Settings::default()).unwrap();
    let report = learned.report();
    assert_eq!(report.cells_missing, 2000);
    // 500 rows of each kind that is seen.
    let kinds = [0.9f64, 0.1, 0.2, 0.8].map(|p| 500.0 * (0.5 * p).ln()).iter().sum::<f64>();
    near(&[report.ln_likelihood], &[kinds + 1100.0 * 0.55f64.ln() + 900.0 * 0.45f64.ln()], 1e-9);
}

//! Reals that are drawn together along the gradient of their density.
//!
//! In: models whose parameters depend on each other so much that draws of one at a time hardly move. Out: means within four combined
//! standard errors, deviations within three of their standard errors (15 %, some 500 effective draws on either side), and chains that have converged. Invariant: expected values are those of another engine.

use bp_core::prelude::*;

/// The answers of 100 persons to 20 questions, drawn from the model: a bit for each question, the first one highest.
const ANSWERS: [u32; 100] = [
    0x64b5d, 0x752fb, 0x7297f, 0x22419, 0x77f13, 0x76e7f, 0x64e27, 0xf4f17, 0x62ed7, 0xa7cc9, 0x67cd6,
    0xe7db5, 0x05806, 0x66ae3, 0x66c0d, 0x64d77, 0x40a0e, 0x67d09, 0xe4a04, 0x66484, 0x6391f, 0xe6c23,
    0xf6bbf, 0xf6c3f, 0x60000, 0x24080, 0x26d04, 0x60c5c, 0xf5af9, 0x66cfd, 0xf6dff, 0x410c1, 0x44c91,
    0xfdeff, 0x6781f, 0xf5bff, 0x64c91, 0x00003, 0x52e7b, 0x6483b, 0x20004, 0x218b1, 0x26cc9, 0x22020,
    0x65ad1, 0x2289d, 0x67f8e, 0x664b0, 0x74855, 0xf5cb5, 0xe66f7, 0xa6300, 0x66c35, 0x708cd, 0xf4fb7,
    0x23802, 0xe5fff, 0x76839, 0x21300, 0x65eb8, 0x468ac, 0x66eb5, 0x66910, 0x20010, 0xe6dad, 0x6768f,
    0x47c49, 0x66e47, 0x07459, 0x63673, 0x77ffd, 0xc5c51, 0x6029b, 0x75f3f, 0xe2c3f, 0x66f4d, 0x64c17,
    0x22634, 0x42995, 0xa6814, 0x65fdd, 0xe7e96, 0x21002, 0x20490, 0xe6f6d, 0xe6ff7, 0x2508b, 0x246d3,
    0x26d93, 0xf6f35, 0xe5bfd, 0x74c8f, 0x64e33, 0xe7218, 0xf4edf, 0x04200, 0x64b9d, 0x62a17, 0xe460c,
    0xc0ede,
];

/// Means with their standard errors, and deviations: four chains of 2500 draws of NumPyro 0.22 (NUTS).
const REFERENCE: [(&str, [f64; 3]); 14] = [
    ("SigmaTheta", [1.0412, 0.0095, 0.1980]),
    ("SigmaA", [0.6703, 0.0044, 0.1902]),
    ("MuB", [0.0653, 0.0041, 0.3207]),
    ("SigmaB", [1.2670, 0.0107, 0.3149]),
    ("A[0]", [1.0874, 0.0087, 0.3576]),
    ("A[2]", [0.9623, 0.0076, 0.2978]),
    ("A[6]", [0.3817, 0.0033, 0.1710]),
    ("A[10]", [0.7590, 0.0061, 0.2773]),
    ("A[15]", [0.9951, 0.0080, 0.3285]),
    ("B[0]", [1.0689, 0.0097, 0.3918]),
    ("B[2]", [-2.3164, 0.0199, 0.6592]),
    ("B[6]", [-0.2698, 0.0074, 0.6137]),
    ("B[10]", [0.1972, 0.0054, 0.3629]),
    ("B[15]", [-0.7805, 0.0081, 0.3454]),
];

/// The abilities of persons, and how well questions discriminate (two-parameter logistic item response): the likelihood stays the
/// same where abilities and difficulties grow and discriminations shrink, so that a hundred and forty parameters move together.
#[test]
fn item_responses_of_two_parameters() {
    let text = "program ItemResponse {
        parameters { person[Rows] : Persons; item[Rows] : Items; }
        variables {
            SigmaTheta, SigmaA, MuB, SigmaB : real;
            Theta[p in Persons], A[i in Items], B[i in Items] : real;
            Right[row in Rows] : bool;
        }
        decomposition {
            P(SigmaTheta) P(SigmaA) P(MuB) P(SigmaB)
            prod(p in Persons) { P(Theta[p] | SigmaTheta) }
            prod(i in Items) { P(A[i] | SigmaA) P(B[i] | MuB SigmaB) }
            prod(row in Rows) { P(Right[row] | Theta A B) }
        }
        forms {
            P(SigmaTheta) = half_cauchy(2);
            P(SigmaA)     = half_cauchy(2);
            P(MuB)        = normal(0, 5);
            P(SigmaB)     = half_cauchy(2);
            P(Theta[p] | SigmaTheta) = normal(0, SigmaTheta);
            P(A[i] | SigmaA)         = lognormal(0, SigmaA);
            P(B[i] | MuB SigmaB)     = normal(MuB, SigmaB);
            P(Right[row] | Theta A B) = bernoulli(logistic(A[item[row]] * (Theta[person[row]] - B[item[row]])));
        }
        question posterior { P(SigmaTheta, SigmaA, MuB, SigmaB, A, B) }
    }";
    let pairs = || (0..100u32).flat_map(|person| (0..20u32).map(move |item| (person, item)));
    let right = pairs().map(|(person, item)| ANSWERS[person as usize] >> (19 - item) & 1 == 1);
    let rows = Rows::new()
        .column("person", pairs().map(|(person, _)| person))
        .column("item", pairs().map(|(_, item)| item))
        .column("Right", right);
    let program = Program::parse(text).unwrap_or_else(|error| panic!("{error}")).rows(rows).unwrap();
    let posterior = program.draws(6000).ask("posterior").unwrap_or_else(|error| panic!("{error}"));
    assert_eq!((posterior.strategy().name(), posterior.warning()), ("gibbs", None));
    for (name, [expected, error_of_expected, deviation]) in REFERENCE {
        let own = posterior.of(name).unwrap();
        let [mean, error] = own.mean_and_error().unwrap();
        let combined = error.hypot(error_of_expected);
        assert!((mean - expected).abs() < 4.0 * combined, "{name}: {mean} ± {error}, expected {expected}");
        let ratio = own.deviation().unwrap() / deviation;
        assert!((ratio - 1.0).abs() < 0.15, "{name}: {ratio} of the expected deviation");
    }
}

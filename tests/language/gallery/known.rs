//! Known answers, as data.
//!
//! In: nothing. Out: for a program and a question, the rows that its answer must have. Invariant: each number is
//! published, or follows from the arithmetic in its comment.

/// The known part of one answer.
pub(crate) struct Known {
    pub(crate) file: &'static str,
    /// As typed, or the name of a declared question.
    pub(crate) asked: &'static str,
    pub(crate) given: &'static [(&'static str, &'static [f64])],
    /// Values separated by blanks, as the columns of the answer, and the probability.
    pub(crate) rows: &'static [(&'static str, f64)],
    /// Relative tolerance of a probability: half a unit in the last place published.
    pub(crate) share: f64,
}

/// Programs whose answers other files here enumerate.
pub(crate) const ENUMERATED: [&str; 18] = [
    "boat",
    "boat_relaxed",
    "boat_soft",
    "categorisation",
    "classification",
    "fault_tree",
    "homing",
    "inverse_programming",
    "khepera_driver",
    "layered_network",
    "light_fusion",
    "markov_localisation",
    "phototaxy",
    "pseudo_kalman",
    "pupils",
    "situation_recognition",
    "stitching",
    "water_centre",
];

/// Programs with `unknown` forms in their questions: their tests learn them first.
pub(crate) const LEARNED: [&str; 7] = [
    "coin_learning",
    "em_behaviour",
    "khepera_avoiding",
    "khepera_following",
    "khepera_pushing",
    "mixture_learning",
    "normal_learning",
];

/// Programs whose questions need something given: their tests give it.
pub(crate) const GIVEN_WHEN_ASKED: [&str; 5] =
    ["layered_network", "light_fusion", "markov_localisation", "pseudo_kalman", "pupils"];

const fn known(
    file: &'static str,
    asked: &'static str,
    rows: &'static [(&'static str, f64)],
    share: f64,
) -> Known {
    Known { file, asked, given: &[], rows, share }
}

const EXACT: f64 = 1e-12;
const SIX: f64 = 1e-5;

pub(crate) const ANSWERS: &[Known] = &[
    known("dice", "dice", &[("1", 1.0 / 6.0), ("6", 1.0 / 6.0)], EXACT),
    // Fortune, Next, Programming, Money, You, then Spam.
    known(
        "spam",
        "spam",
        &[
            ("false false false false false true", 0.502649),
            ("false false false false true true", 0.502649),
            ("false false false true false true", 0.999995),
            ("false false true false false true", 5.36149e-6),
            ("false true false false false true", 0.00134393),
            ("false true false true false true", 0.996073),
            ("false true true false false true", 7.13918e-9),
            ("false true true false true true", 7.13918e-9),
            ("true false false false false true", 0.996073),
            ("true true false false false true", 0.252494),
            ("true true false true false true", 0.999984),
            ("true true true false false true", 1.79193e-6),
            ("true false true false false true", 0.00134393),
        ],
        SIX,
    ),
    // (n + 1) / (N + 2): 1/252, 126/252, 251/252; 376/752, 1/752, 751/752.
    known(
        "spam",
        "P(Programming | Spam)",
        &[("false true", 251.0 / 252.0), ("true true", 1.0 / 752.0)],
        EXACT,
    ),
    known("spam", "money", &[("true", 0.999995)], 1e-6),
    // Contexts in which O would be −1 no longer count: 7 and 10 cases remain of 8 and 11.
    known(
        "water_unit",
        "P(O | I0 = 1, I1 = 0, S = 5, C = 10)",
        &[("0", 2.0 / 7.0), ("1", 2.0 / 7.0), ("2", 2.0 / 7.0), ("3", 1.0 / 7.0), ("4", 0.0)],
        EXACT,
    ),
    known(
        "water_unit",
        "P(O | I0 = 0, I1 = 1, S = 5, C = 10)",
        &[("0", 0.3), ("1", 0.3), ("2", 0.3), ("3", 0.1), ("4", 0.0)],
        EXACT,
    ),
    known("classification", "danger", &[("true", 0.564367)], 1e-6),
    known("log_coding", "code", &[("1", 2.0 / 254.0), ("4", 16.0 / 254.0), ("7", 128.0 / 254.0)], EXACT),
    known("log_coding", "number", &[("3", 0.0), ("4", 0.25), ("7", 0.25), ("8", 0.0)], EXACT),
    // .3 / (.3 + .7 · .9) and .1 / (.1 + .9 · .9).
    known("sprinkler", "rain", &[("InParis true", 0.3 / 0.93), ("InNice true", 0.1 / 0.91)], EXACT),
    known("sprinkler", "wet", &[("InParis true", 0.93), ("InNice true", 0.91)], EXACT),
    known("sprinkler", "P(Rain = true | Roof = true, Location = InNice)", &[("true", 1.0)], EXACT),
    // .7 · .9 and .9 · .9.
    known("sprinkler", "where", &[("InParis", 63.0 / 144.0), ("InNice", 81.0 / 144.0)], EXACT),
    known("rain_umbrella", "rain", &[("true", 0.38 / 0.44)], EXACT),
    // 1 − .99 · .98 = .0298.
    known(
        "fault_tree",
        "faults",
        &[("false false", 0.98 * 0.9702), ("true false", 0.02 * 0.9702), ("true true", 0.02 * 0.0298)],
        EXACT,
    ),
    known("fault_tree", "P(F3)", &[("true", 0.0298)], EXACT),
    known(
        "sum_of_dice",
        "sum",
        &[("5", 0.0), ("6", 1.0 / 36.0), ("9", 4.0 / 36.0), ("11", 6.0 / 36.0), ("16", 1.0 / 36.0)],
        EXACT,
    ),
    known(
        "sum_of_dice",
        "last",
        &[("1", 0.0), ("2", 1.0 / 15.0), ("3", 2.0 / 15.0), ("4", 0.2), ("5", 4.0 / 15.0), ("6", 1.0 / 3.0)],
        EXACT,
    ),
    known(
        "homing",
        "choice",
        &[
            ("0 Avoid", 0.0953),
            ("5 Avoid", 0.2689),
            ("9 Avoid", 0.5),
            ("12 Avoid", 0.6792),
            ("15 Avoid", 0.8176),
        ],
        6e-4,
    ),
    // Lauritzen and Spiegelhalter (1988), Tables 2 and following.
    known("asia", "P(Either)", &[("true", 0.064828)], SIX),
    known("asia", "P(XRay)", &[("true", 0.110290)], SIX),
    known("asia", "P(Dyspnoea)", &[("true", 0.435971)], 1e-6),
    known("asia", "P(Tuberculosis)", &[("true", 0.0104)], EXACT),
    known("asia", "P(Cancer)", &[("true", 0.055)], EXACT),
    known("asia", "P(Bronchitis)", &[("true", 0.45)], EXACT),
];

//! Chains of finite states.
//!
//! In: start, transition and sensor as tables. Out: the filtered distribution by enumeration of all histories.

use super::near;
use bp_macros::bayesian_program;

bayesian_program! {
    program Door {
        parameters { miss : probability = 0.3; }
        variables { Open, Open^-1, Seen : bool; }
        decomposition { P(Open^-1) P(Open | Open^-1) P(Seen | Open) }
        forms {
            P(Open^-1)        = previous(Open) else bernoulli(0);
            P(Open | Open^-1) = table { false: 0.9, 0.1; true: 0.2, 0.8; };
            P(Seen | Open)    = bernoulli(if Open { 1 - miss } else { 0.1 });
        }
        question open { filter P(Open | Seen) }
        question soon { predict(3) P(Open | Seen) }
    }
}

bayesian_program! {
    program Robot {
        variables {
            Place, Place^-1 : 1..=4;
            Mood, Mood^-1 : { calm, wild };
            Push : bool;
            Light : { dark, dim } or 0..=1;
        }
        decomposition {
            P(Push) P(Place^-1) P(Mood^-1 | Place^-1) P(Mood | Mood^-1)
            P(Place | Place^-1 Mood Push) P(Light | Place)
        }
        forms {
            P(Push) = bernoulli(0.25);
            P(Place^-1) = categorical(0, 1, 0, 0);
            P(Mood^-1 | Place^-1) = table { 1: 1, 0; 2: 0.5, 0.5; 3: 1, 0; 4: 1, 0; };
            P(Mood | Mood^-1) = table { calm: 0.9, 0.1; wild: 0, 1; };
            P(Place | Place^-1 Mood Push) = weights(
                if Place == Place^-1 { 1 } else if abs(Place - Place^-1) > 1 { 0 }
                else { (if Push { 3 } else { 0 }) + (if Mood == wild { 2 } else { 0.5 }) }
            );
            P(Light | Place) = table { 1: 1, 0, 0, 0; 2: 0.5, 0.5, 0, 0; 3: 0, 0.25, 0.5, 0.25; 4: 0, 0, 0.25, 0.75; };
        }
        question place { filter P(Place | Light Push) }
        question both { filter P(Mood, Place | Light Push = push) }
        question best { argmax filter P(Place | Light Push) }
    }
}

bayesian_program! {
    program Level {
        parameters { s : real = 0.7; }
        variables { X, X^-1 : 1..=3; Y : real; }
        decomposition { P(initial(X)) P(X | X^-1) P(Y | X) }
        forms {
            P(initial(X)) = categorical(0.5, 0, 0.5);
            P(X | X^-1) = table { 1: 0.8, 0.2, 0; 2: 0.1, 0.8, 0.1; 3: 0, 0.4, 0.6; };
            P(Y | X) = normal(X, s);
        }
        question level { filter P(X | Y = y) }
    }
}

bayesian_program! {
    program Stuck {
        variables { Up, Up^-1, Z : bool; }
        decomposition { P(Up^-1) P(Up | Up^-1) P(Z | Up) }
        forms { P(Up^-1) = bernoulli(0); P(Up | Up^-1) = dirac(Up^-1); P(Z | Up) = dirac(Up); }
        question up { filter P(Up | Z) }
    }
}

bayesian_program! {
    program Lines over line in Lines {
        parameters { stay : probability = 0.75; }
        variables { X, X^-1 : 0..=2; Z : bool; }
        decomposition { P(X^-1) P(X | X^-1) P(Z | X) }
        forms {
            P(X^-1) = previous(X) else categorical(0.5, 0.5, 0);
            P(X | X^-1) = table { 0: stay, 1 - stay, 0; 1: 0, stay, 1 - stay; 2: 1 - stay, 0, stay; };
            P(Z | X) = table { 0: 0.75, 0.25; 1: 0.5, 0.5; 2: 0, 1; };
        }
        question lines { filter P(X | Z) }
    }
}

/// For each instant: the distribution of the last state, and ln P(observations), by enumeration of all histories.
/// `start[x]`: of the first state; `step(instant, x⁻¹, x)`; `seen(instant, x)`.
fn histories(
    instants: usize,
    states: usize,
    start: &dyn Fn(usize) -> f64,
    step: &dyn Fn(usize, usize, usize) -> f64,
    seen: &dyn Fn(usize, usize) -> f64,
) -> Vec<(Vec<f64>, f64)> {
    let mut all = Vec::new();
    for last in 1..=instants {
        let mut weights = vec![0.0; states];
        for history in 0..states.pow(last as u32) {
            let at = |instant: usize| history / states.pow(instant as u32) % states;
            let mut weight = start(at(0)) * seen(0, at(0));
            for instant in 1..last {
                weight *= step(instant, at(instant - 1), at(instant)) * seen(instant, at(instant));
            }
            weights[at(last - 1)] += weight;
        }
        let total: f64 = weights.iter().sum();
        all.push((weights.iter().map(|weight| weight / total).collect(), total.ln()));
    }
    all
}

const SEEN: [Option<bool>; 6] = [Some(true), Some(false), None, Some(true), Some(true), None];

fn door_histories(instants: usize, miss: f64) -> Vec<(Vec<f64>, f64)> {
    let rows = [[0.9, 0.1], [0.2, 0.8]];
    let open = |x: usize| if x == 1 { 1.0 - miss } else { 0.1 };
    let seen = |instant: usize, x: usize| match SEEN.get(instant).copied().flatten() {
        Some(true) => open(x),
        Some(false) => 1.0 - open(x),
        None => 1.0,
    };
    // Before the first instant it is shut.
    histories(instants, 2, &|x| rows[0][x], &|_, before, x| rows[before][x], &seen)
}

#[test]
fn a_door_is_filtered_instant_by_instant() {
    for miss in [0.3, 0.05] {
        let expected = door_histories(SEEN.len(), miss);
        let (mut state, mut narrow) = (door::open::State::<f64>::new(), door::open::State::<f32>::new());
        for (seen, (p, ln)) in SEEN.iter().zip(&expected) {
            let mut question = door::open().miss(miss);
            let mut single = door::open::Question::<f32>::new().miss(miss);
            if let Some(seen) = seen {
                (question, single) = (question.seen(*seen), single.seen(*seen));
            }
            assert_eq!(question.step(&mut state).unwrap().impossible, 0);
            single.step(&mut narrow).unwrap();
            near("open", state.p(true), p[1], 1e-14);
            near("ln P", state.ln_evidence(), *ln, 1e-13);
            near("open, f32", f64::from(narrow.p(true)), p[1], 1e-6);
        }
        assert_eq!(state.instants(), SEEN.len());
    }
}

#[test]
fn a_prediction_follows_each_instant() {
    let mut state = door::soon::State::<f64>::new();
    for (instant, seen) in SEEN.iter().enumerate() {
        let question = door::soon();
        match seen {
            Some(seen) => question.seen(*seen).step(&mut state).unwrap(),
            None => question.step(&mut state).unwrap(),
        };
        let mut p = door_histories(instant + 1, 0.3)[instant].0[1];
        for _ in 0..3 {
            p = 0.1 * (1.0 - p) + 0.8 * p;
        }
        near("open soon", state.p(true), p, 1e-14);
    }
}

#[test]
fn what_is_carried_together_is_joint() {
    use robot::{Light, Mood};
    let lights = [Some(1), None, Some(2), Some(0), Some(1)];
    let pushes = [true, false, true, false, false];
    // States: place − 1 and mood, the mood fastest.
    let transition = |instant: usize, before: usize, now: usize| {
        let ((from, mood_before), (to, mood)) = ((before / 2, before % 2), (now / 2, now % 2));
        let moods = [[0.9, 0.1], [0.0, 1.0]][mood_before][mood];
        let each = if pushes[instant] { 3.0 } else { 0.0 } + if mood == 1 { 2.0 } else { 0.5 };
        let weight = |to: usize| match to.abs_diff(from) {
            0 => 1.0,
            1 => each,
            _ => 0.0,
        };
        moods * weight(to) / (0..4).map(weight).sum::<f64>()
    };
    let table = [[1.0, 0.0, 0.0, 0.0], [0.5, 0.5, 0.0, 0.0], [0.0, 0.25, 0.5, 0.25], [0.0, 0.0, 0.25, 0.75]];
    let push = |instant: usize| if pushes[instant] { 0.25 } else { 0.75 };
    let seen = |instant: usize, x: usize| {
        push(instant) * lights[instant].map_or(1.0, |light: usize| table[x / 2][light])
    };
    // Before the first instant the place is 2, and both moods have probability ½.
    let start = |x: usize| [2, 3].iter().map(|before| 0.5 * transition(0, *before, x)).sum();
    let expected = histories(lights.len(), 8, &start, &transition, &seen);
    let mut place = robot::place::State::<f64>::new();
    let mut both = robot::both::State::<f64>::new();
    let mut best = robot::best::State::<f64>::new();
    for instant in 0..lights.len() {
        let (mut first, mut second, mut third) = (
            robot::place().push(pushes[instant]),
            robot::both().push(pushes[instant]),
            robot::best().push(pushes[instant]),
        );
        if let Some(light) = lights[instant] {
            let light = [Light::dark, Light::dim, Light::Number(0), Light::Number(1)][light];
            (first, second, third) = (first.light(light), second.light(light), third.light(light));
        }
        first.step(&mut place).unwrap();
        second.step(&mut both).unwrap();
        third.step(&mut best).unwrap();
        let (p, ln) = &expected[instant];
        for x in 0..4 {
            near("place", place.p(x as i64 + 1), p[2 * x] + p[2 * x + 1], 1e-14);
            for (mood, value) in [Mood::calm, Mood::wild].into_iter().enumerate() {
                near("mood and place", both.p(value, x as i64 + 1), p[2 * x + mood], 1e-14);
            }
        }
        near("ln P", place.ln_evidence(), *ln, 1e-13);
        let marginal = |x: usize| p[2 * x] + p[2 * x + 1];
        let most = (0..4).map(marginal).fold(0.0, f64::max);
        near("best", marginal(best.argmax().unwrap() as usize - 1), most, 1e-14);
    }
}

#[test]
fn the_first_instant_has_a_form_of_its_own_and_reals_are_observed() {
    let readings = [Some(1.2), Some(2.9), None, Some(-4.0), Some(40.0)];
    let rows = [[0.8, 0.2, 0.0], [0.1, 0.8, 0.1], [0.0, 0.4, 0.6]];
    for s in [0.7, 2.5] {
        let seen = |instant: usize, x: usize| {
            readings[instant].map_or(1.0, |y: f64| {
                let z = (y - (x as f64 + 1.0)) / s;
                (-0.5 * z * z).exp() / (s * std::f64::consts::TAU.sqrt())
            })
        };
        let expected =
            histories(readings.len(), 3, &|x| [0.5, 0.0, 0.5][x], &|_, before, x| rows[before][x], &seen);
        let mut state = level::level::State::<f64>::new();
        for (y, (p, ln)) in readings.iter().zip(&expected) {
            let question = level::level().s(s);
            match y {
                Some(y) => question.y(*y).step(&mut state).unwrap(),
                None => question.step(&mut state).unwrap(),
            };
            // With s = 0.7 the last reading is 53 deviations away: its densities are below the smallest f64.
            if ln.is_finite() {
                (0..3).for_each(|x| near("level", state.p(x as i64 + 1), p[x], 1e-12));
                near("ln P", state.ln_evidence(), *ln, 1e-12);
            } else {
                near("level", state.p(3), 1.0, 1e-12);
            }
        }
    }
}

#[test]
fn a_plate_has_a_filter_for_each_element() {
    const LINES: usize = 70;
    let readings = |instant: usize, line: usize| (instant * 7 + line * 3) % 5 < 2;
    let stay = 0.75;
    let rows = [[stay, 1.0 - stay, 0.0], [0.0, stay, 1.0 - stay], [1.0 - stay, 0.0, stay]];
    let sees = [0.25, 0.5, 1.0];
    let mut state = lines::lines::State::<f64>::new();
    for instant in 0..4 {
        let z: Vec<f64> = (0..LINES).map(|line| f64::from(u8::from(readings(instant, line)))).collect();
        // Nothing is seen at the third instant.
        match instant {
            2 => lines::lines().lines(LINES).step(&mut state).unwrap(),
            _ => lines::lines().lines(LINES).z(&z).step(&mut state).unwrap(),
        };
        for line in 0..LINES {
            let seen = |instant: usize, x: usize| match (instant, readings(instant, line)) {
                (2, _) => 1.0,
                (_, true) => sees[x],
                (_, false) => 1.0 - sees[x],
            };
            let start = |x: usize| 0.5 * rows[0][x] + 0.5 * rows[1][x];
            let expected = histories(instant + 1, 3, &start, &|_, before, x| rows[before][x], &seen);
            let (p, ln) = &expected[instant];
            (0..3).for_each(|x| near("line", state.p(x as i64)[line], p[x], 1e-13));
            near("ln P", state.ln_evidence()[line], *ln, 1e-13);
        }
    }
}

#[test]
fn wrong_inputs_leave_the_state_as_it_was() {
    let mut state = robot::place::State::<f64>::new();
    let error = robot::place().step(&mut state).unwrap_err().to_string();
    assert!(error.contains("`push`"), "{error}");
    robot::place().push(false).light(robot::Light::dim).step(&mut state).unwrap();
    let before = (state.p(1), state.p(2), state.ln_evidence());
    near("after dim", before.0, 0.0, 0.0);
    // From places 1 to 3 no place gives light 1 and dark, one instant after the other.
    robot::place().push(false).light(robot::Light::dark).step(&mut state).unwrap();
    let (kept, instants) = (state.clone(), state.instants());
    let error =
        robot::place().push(false).light(robot::Light::Number(9)).step(&mut state).unwrap_err().to_string();
    assert!(error.contains('9'), "{error}");
    assert!(state.instants() == instants && state.p(2) == kept.p(2) && before.2 < 0.0);
    let mut shut = stuck::up::State::<f64>::new();
    stuck::up().z(false).step(&mut shut).unwrap();
    let error = stuck::up().z(true).step(&mut shut).unwrap_err().to_string();
    assert!(error.contains("probability zero") || error.contains("impossible"), "{error}");
    assert_eq!((shut.instants(), shut.p(true), shut.ln_evidence()), (1, 0.0, 0.0));
    let mut wrong = door::open::State::<f64>::new();
    let error = door::open().miss(1.5).seen(true).step(&mut wrong).unwrap_err().to_string();
    assert!(error.contains("1.5"), "{error}");
    assert_eq!((wrong.instants(), wrong.p(true)), (0, 0.0));
}

#[test]
fn a_step_allocates_nothing_after_the_first_ones() {
    let mut state = door::open::State::<f64>::new();
    let mut steps = || {
        (0..1000).for_each(|k| {
            door::open().seen(k % 3 > 0).step(&mut state).unwrap();
        })
    };
    steps();
    assert_eq!(allocation_counter::measure(steps).count_total, 0);
}

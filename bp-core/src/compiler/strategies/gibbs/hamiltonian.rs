//! Hamiltonian Monte Carlo: a block of reals is drawn along trajectories that follow the gradient of its density.
//!
//! In: a density with its gradient, and the current state of a chain. Out: the next state. Invariant: step and metric adapt during
//! burn-in only; a trajectory is reversible and keeps volumes whatever the slopes are, so that a density with steps has its right
//! distribution too.
//!
//! With momenta p ~ N(0, 1), leapfrog steps keep ln π(x) − p²/2 nearly. A trajectory is doubled forwards or backwards until it turns
//! back, and a state of it is drawn with its probability (Hoffman and Gelman, *JMLR* 15:1593-1623, 2014; Betancourt,
//! arXiv:1701.02434, 2017). The step is found by dual averaging, the metric is the covariance of the draws of all chains.

use super::blanket::Blankets;
use super::gradient::{Gradient, Slopes};
use super::metric::Metric;
use crate::distribution::ln_sum;
use crate::random::Random;
use rand::RngExt;
use rand_distr::{Distribution as _, StandardNormal};

/// Trajectories have at most 2 to the power of this many steps; before a metric is learned, of `FIRST_DOUBLINGS`.
const MOST_DOUBLINGS: u32 = 10;
const FIRST_DOUBLINGS: u32 = 5;

/// A trajectory that has lost so much of ln π − p²/2 is given up.
const MOST_LOSS: f64 = 1000.0;

/// The acceptance that the step aims at, and the constants of dual averaging (Hoffman and Gelman 2014, section 3.2).
const ACCEPTANCE: f64 = 0.8;
const SHRINKAGE: f64 = 0.05;
const FIRST_WEIGHT: f64 = 10.0;
const DECAY: f64 = 0.75;

/// Upper limit on the steps that are tried at first.
const MOST_TRIALS: usize = 60;

/// The sampler of a block in one chain.
#[derive(Clone, Debug, Default)]
pub(super) struct Hamiltonian {
    step: f64,
    tuning: Option<Tuning>,
    /// None before it is learned.
    pub(super) metric: Option<Metric>,
    /// The coordinates after each sweep of the burn-in.
    pub(super) history: Vec<f64>,
    memory: Slopes,
}

/// Dual averaging of ln of the step.
#[derive(Clone, Copy, Debug)]
struct Tuning {
    count: f64,
    /// The point to which it shrinks.
    centre: f64,
    lack: f64,
    average: f64,
}

/// A state of a trajectory, relative to its start and in the coordinates of the metric.
#[derive(Clone, Debug)]
struct Point {
    at: Vec<f64>,
    momentum: Vec<f64>,
    slope: Vec<f64>,
    ln: f64,
}

impl Point {
    /// ln π(x) − p²/2
    fn level(&self) -> f64 {
        self.ln - 0.5 * dot(&self.momentum, &self.momentum)
    }
}

/// A part of a trajectory.
struct Part {
    first: Point,
    last: Point,
    drawn: Vec<f64>,
    ln_weight: f64,
    /// Σ p
    momentum: Vec<f64>,
    /// Whether it turns back, or is given up.
    ends: bool,
    accepted: f64,
    steps: f64,
}

/// What a trajectory needs.
struct Flow<'f> {
    gradient: &'f Gradient,
    blankets: &'f Blankets<'f>,
    memory: &'f mut Slopes,
    random: &'f mut Random,
    metric: &'f Metric,
    start: Vec<f64>,
    step: f64,
    level: f64,
}

fn dot(one: &[f64], other: &[f64]) -> f64 {
    one.iter().zip(other).map(|(one, other)| one * other).sum()
}

fn sum(one: &[f64], other: &[f64]) -> Vec<f64> {
    one.iter().zip(other).map(|(one, other)| one + other).collect()
}

impl Hamiltonian {
    /// Draws the block.
    pub(super) fn draw(
        &mut self,
        gradient: &Gradient,
        (blankets, values): (&Blankets<'_>, &mut [f64]),
        random: &mut Random,
        burns_in: bool,
    ) {
        let dimensions = gradient.dimensions();
        let metric = self.metric.clone().unwrap_or_else(|| Metric::unit(dimensions));
        let start = gradient.begin(values, &mut self.memory);
        if burns_in {
            self.history.extend(&start);
        }
        let doublings = if self.metric.is_some() { MOST_DOUBLINGS } else { FIRST_DOUBLINGS };
        let memory = &mut self.memory;
        let mut flow =
            Flow { gradient, blankets, memory, random, metric: &metric, start, step: 1.0, level: 0.0 };
        let mut from = Point { at: vec![0.0; dimensions], momentum: Vec::new(), slope: Vec::new(), ln: 0.0 };
        flow.evaluate(&mut from);
        from.momentum = flow.momentum(dimensions);
        if from.ln == f64::NEG_INFINITY {
            return;
        }
        if self.tuning.is_none() {
            self.step = flow.first_step(&from);
            let centre = (10.0 * self.step).ln();
            self.tuning = Some(Tuning { count: 0.0, centre, lack: 0.0, average: 0.0 });
        }
        flow.step = self.step;
        flow.level = from.level();
        let (drawn, acceptance) = flow.trajectory(from, doublings);
        let place = flow.place(&drawn);
        gradient.end(&place, flow.memory, values);
        if let Some(tuning) = self.tuning.as_mut().filter(|_| burns_in) {
            self.step = tuning.next(acceptance);
        }
    }

    /// Takes a metric; the step is found anew.
    pub(super) fn take(&mut self, metric: Metric) {
        self.metric = Some(metric);
        self.tuning = None;
    }

    /// Fixes the step: the burn-in has ended.
    pub(super) fn settle(&mut self) {
        if let Some(tuning) = self.tuning.filter(|tuning| tuning.count > 0.0) {
            self.step = tuning.average.exp();
        }
        self.history = Vec::new();
    }
}

impl Tuning {
    /// The next step, after a trajectory with this acceptance.
    fn next(&mut self, acceptance: f64) -> f64 {
        self.count += 1.0;
        let weight = 1.0 / (self.count + FIRST_WEIGHT);
        self.lack += weight * (ACCEPTANCE - acceptance - self.lack);
        let ln = self.centre - self.count.sqrt() / SHRINKAGE * self.lack;
        self.average += self.count.powf(-DECAY) * (ln - self.average);
        ln.exp()
    }
}

impl Flow<'_> {
    fn momentum(&mut self, dimensions: usize) -> Vec<f64> {
        (0..dimensions).map(|_| StandardNormal.sample(self.random)).collect()
    }

    /// The coordinates of the block at a point of the trajectory.
    fn place(&self, at: &[f64]) -> Vec<f64> {
        sum(&self.start, &self.metric.along(at))
    }

    /// Computes the density at a point, and its slopes.
    fn evaluate(&mut self, point: &mut Point) {
        let place = self.place(&point.at);
        let mut slopes = vec![0.0; place.len()];
        point.ln = self.gradient.ln(self.blankets, &place, self.memory, &mut slopes);
        point.slope = self.metric.across(&slopes);
    }

    /// One leapfrog step.
    fn advance(&mut self, from: &Point, step: f64) -> Point {
        let mut next = from.clone();
        let kick = |point: &mut Point| {
            point.momentum.iter_mut().zip(&point.slope).for_each(|(p, slope)| *p += 0.5 * step * slope);
        };
        kick(&mut next);
        next.at.iter_mut().zip(&next.momentum).for_each(|(at, p)| *at += step * p);
        self.evaluate(&mut next);
        if next.ln > f64::NEG_INFINITY {
            kick(&mut next);
        }
        next
    }

    /// A step of which one alone is accepted with about the wanted probability.
    fn first_step(&mut self, from: &Point) -> f64 {
        let level = from.level();
        let mut step = 1.0;
        let mut grows = None;
        for _ in 0..MOST_TRIALS {
            let gain = self.advance(from, step).level() - level;
            let accepts = gain > ACCEPTANCE.ln();
            if *grows.get_or_insert(accepts) != accepts {
                break;
            }
            step *= if accepts { 2.0 } else { 0.5 };
        }
        step
    }

    /// A state of a trajectory through a point, and the mean acceptance of its steps.
    fn trajectory(&mut self, from: Point, doublings: u32) -> (Vec<f64>, f64) {
        let mut all = Part {
            drawn: from.at.clone(),
            momentum: from.momentum.clone(),
            first: from.clone(),
            last: from,
            ln_weight: 0.0,
            ends: false,
            accepted: 0.0,
            steps: 0.0,
        };
        for depth in 0..doublings {
            let forwards = self.random.random::<bool>();
            let next = self.part(if forwards { &all.last } else { &all.first }, forwards, depth);
            let ends = next.ends;
            // The newer half is preferred: the state moves further.
            let takes = !ends && self.random.random::<f64>().ln() < next.ln_weight - all.ln_weight;
            let drawn = if takes { next.drawn.clone() } else { all.drawn.clone() };
            all = if forwards { joined(all, next) } else { joined(next, all) };
            all.drawn = drawn;
            if ends || all.ends {
                break;
            }
        }
        (all.drawn, all.accepted / all.steps.max(1.0))
    }

    /// 2 to the power of `depth` steps from a point.
    fn part(&mut self, from: &Point, forwards: bool, depth: u32) -> Part {
        if depth == 0 {
            let point = self.advance(from, if forwards { self.step } else { -self.step });
            let gain = point.level() - self.level;
            let gain = if gain.is_nan() { f64::NEG_INFINITY } else { gain };
            return Part {
                drawn: point.at.clone(),
                momentum: point.momentum.clone(),
                first: point.clone(),
                last: point,
                ln_weight: gain,
                ends: gain < -MOST_LOSS,
                accepted: gain.min(0.0).exp(),
                steps: 1.0,
            };
        }
        let one = self.part(from, forwards, depth - 1);
        if one.ends {
            return one;
        }
        let next = self.part(if forwards { &one.last } else { &one.first }, forwards, depth - 1);
        let total = ln_sum(&[one.ln_weight, next.ln_weight]);
        let takes = self.random.random::<f64>().ln() < next.ln_weight - total;
        let drawn = if takes { next.drawn.clone() } else { one.drawn.clone() };
        let mut both = if forwards { joined(one, next) } else { joined(next, one) };
        both.drawn = drawn;
        both
    }
}

/// Two parts of a trajectory, one after the other.
fn joined(one: Part, next: Part) -> Part {
    let momentum = sum(&one.momentum, &next.momentum);
    let turns = |from: &Point, to: &Point, momentum: &[f64]| {
        dot(&from.momentum, momentum) <= 0.0 || dot(&to.momentum, momentum) <= 0.0
    };
    let ends = one.ends
        || next.ends
        || turns(&one.first, &next.last, &momentum)
        || turns(&one.first, &next.first, &sum(&one.momentum, &next.first.momentum))
        || turns(&one.last, &next.last, &sum(&next.momentum, &one.last.momentum));
    Part {
        first: one.first,
        last: next.last,
        drawn: Vec::new(),
        ln_weight: ln_sum(&[one.ln_weight, next.ln_weight]),
        momentum,
        ends,
        accepted: one.accepted + next.accepted,
        steps: one.steps + next.steps,
    }
}

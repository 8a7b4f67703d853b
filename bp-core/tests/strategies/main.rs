//! Every strategy, and the back ends that run kernels.
//!
//! In: programs, questions and evidence. Out: answers, compared with enumeration, other strategies, or published
//! values. Invariant: an oracle shares no code with the code that it checks.

mod at_values;
mod back_ends;
mod bands;
mod carried;
mod cell;
mod chains;
mod choices;
mod collapsed;
mod compared;
mod conjugate;
mod contexts;
mod covariance;
mod determined;
mod digits;
mod extended;
mod first_instants;
mod flat;
mod gaussian;
mod gibbs;
mod gradients;
mod guided;
mod histories;
mod join_trees;
mod kalman;
mod kalman_families;
mod likelihoods;
mod many_parents;
mod missing;
mod mixtures;
mod modes;
mod no_value;
mod normal_laws;
mod normal_vectors;
mod particles;
mod paths;
mod planner;
mod points_and_precisions;
mod predicates;
mod predictions;
mod programs;
mod recursions;
mod reference_posteriors;
mod regressions;
mod rows;
mod shared;
mod sizes;
mod summed;
#[path = "../support/mod.rs"]
mod support;
mod weighting;

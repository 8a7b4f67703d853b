//! The mixture strategy: finite variables and reals that are linear and Gaussian given them.
//!
//! In: a program whose reals are normal or Dirac, with means linear in other reals and coefficients, deviations and
//! conditions that depend on finite variables and on known reals. Out: exact answers, as mixtures of normal distributions. Invariant: every
//! combination of values of the finite variables that has a positive probability is one component.
//!
//! P(D, x | z) = Σ_d w_d [D = d] N(x; m_d, Σ_d),  w_d ∝ P(d) N(z; H m_d, H Σ_d Hᵀ)   (Lauritzen 1992, for one clique)

mod answer;
mod components;
mod offer;

pub(crate) use offer::Engine;
pub use offer::Mixture;

//! The conjugate strategy: unknown probabilities, rates and proportions whose posterior is of the same family as their prior.
//!
//! In: a program whose reals have `beta`, `uniform(0, 1)`, `gamma`, `exponential` or `dirichlet` priors with known parameters, and
//! observations of `bernoulli`, `binomial`, `categorical`, `multinomial`, `poisson`, `exponential` and `gamma` forms that each read
//! one of them. Out: the posterior as a named distribution, predictions, ln P(evidence). Invariant: given the observations the
//! unknowns are independent of each other, and an observation is two numbers added to the parameters of one of them.
//!
//! beta(a, b) with s successes among n trials: beta(a + s, b + n − s), P = B(a + s, b + n − s) / B(a, b).
//! A precision with a gamma prior, beside reals that are linear and Gaussian given it, is in `precision`.
//!
//! gamma(k, r) with n events in a time t: gamma(k + n, r + t), P = Γ(k + n) rᵏ / (Γ(k) (r + t)^(k + n)).
//! dirichlet(a) with counts n: dirichlet(a + n), P = B(a + n) / B(a), B(a) = Π Γ(aᵢ) / Γ(Σ aᵢ).

mod answer;
mod likelihood;
mod marginal;
mod offer;
mod precision;
mod scaled;
mod summed;
mod unknown;

pub(crate) use marginal::Marginal;
pub use offer::Conjugate;
pub(crate) use offer::Engine;
pub use precision::Precision;
pub use summed::Summed;
pub(crate) use summed::marginalised;

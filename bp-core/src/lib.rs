//! Bayesian Programs, declared as the formalism prints them, and answered by compiled kernels.

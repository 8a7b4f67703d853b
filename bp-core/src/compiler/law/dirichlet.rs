//! Dirichlet law: proportions x₁ … xₖ, each positive, which sum to one.
//!
//! In: parameters a₁ … aₖ, each greater than 0. Out: density, moments, the law of each proportion given the earlier
//! ones. Invariant: the density is with respect to all proportions but the last, which is one minus their sum.
//!
//! f(x) = Γ(Σa) / Π Γ(aᵢ) · Π xᵢ^(aᵢ−1),  E xᵢ = aᵢ/Σa,  Var xᵢ = aᵢ (Σa − aᵢ) / ((Σa)² (Σa + 1)),  xᵢ ~ beta(aᵢ, Σa −
//! aᵢ);
//! given x₁ … xᵢ₋₁, which leave r: xᵢ / r ~ beta(aᵢ, aᵢ₊₁ + … + aₖ)   (Connor and Mosimann, JASA 64:194-206, 1969).

use super::{Constraint, Law};

/// A Dirichlet law.
#[derive(Clone, PartialEq, Debug)]
pub struct Dirichlet(Vec<f64>);

/// Tolerance for the sum of proportions.
const SUM_TOLERANCE: f64 = 1e-9;

impl Dirichlet {
    /// Its name in the language.
    pub const NAME: &'static str = "dirichlet";

    /// The constraint on each parameter.
    pub const PARAMETER: Constraint = Constraint::Positive;

    /// The law with these parameters, or the position of the first invalid one.
    ///
    /// # Errors
    /// A parameter that is not greater than 0.
    pub fn new(parameters: Vec<f64>) -> Result<Self, usize> {
        match parameters.iter().position(|a| Self::PARAMETER.refuses(*a).is_some()) {
            None => Ok(Self(parameters)),
            Some(position) => Err(position),
        }
    }

    fn total(&self) -> f64 {
        self.0.iter().sum()
    }

    /// Its expectation.
    pub fn mean(&self) -> Vec<f64> {
        self.0.iter().map(|a| a / self.total()).collect()
    }

    /// The variance of each proportion.
    pub fn variance(&self) -> Vec<f64> {
        let total = self.total();
        self.0.iter().map(|a| a * (total - a) / (total * total * (total + 1.0))).collect()
    }

    /// P(Xᵢ ≤ x)
    pub fn cumulative(&self, position: usize, x: f64) -> f64 {
        let a = self.0[position];
        Law::Beta.cumulative(x, &[a, self.total() - a])
    }

    /// The law of a proportion given the values of the earlier ones.
    pub fn share(&self, before: &[f64]) -> Share {
        let of = (1.0 - before.iter().sum::<f64>()).max(0.0);
        let rest = &self.0[before.len() + 1..];
        Share { of, beta: (!rest.is_empty()).then(|| [self.0[before.len()], rest.iter().sum()]) }
    }

    /// ln of the density, −∞ outside the simplex.
    pub fn ln_density(&self, x: &[f64]) -> f64 {
        (0..x.len()).map(|position| self.share(&x[..position]).ln_density(x[position])).sum()
    }
}

/// The law of one proportion, given the earlier ones.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Share {
    /// The rest that the earlier ones leave.
    pub of: f64,
    /// The beta law of its share of that rest; `None` for the last proportion, which is the whole rest.
    pub beta: Option<[f64; 2]>,
}

impl Share {
    /// ln of the density. Of the last proportion: 0 where it equals the rest within rounding, else −∞.
    pub fn ln_density(&self, x: f64) -> f64 {
        match self.beta {
            Some(parameters) if self.of > 0.0 => {
                Law::Beta.ln_density(&mut super::Numbers, x / self.of, &parameters) - self.of.ln()
            }
            None if x >= 0.0 && (x - self.of).abs() <= SUM_TOLERANCE => 0.0,
            _ => f64::NEG_INFINITY,
        }
    }

    /// A draw.
    pub fn draw(&self, by: &mut impl rand::Rng) -> f64 {
        self.beta.map_or(self.of, |parameters| self.of * Law::Beta.draw(by, &parameters))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::seeded;
    use statrs::distribution::{Beta, ContinuousCDF};
    use statrs::function::gamma::ln_gamma;

    const CASES: [&[f64]; 4] =
        [&[1.0, 1.0], &[2.0, 3.5, 0.7], &[0.4, 0.4, 0.4, 9.0], &[5.0, 1.0, 1.0, 2.0, 0.5]];

    fn drawn(law: &Dirichlet, by: &mut crate::random::Random) -> Vec<f64> {
        let mut x = Vec::new();
        while x.len() < law.0.len() {
            x.push(law.share(&x).draw(by));
        }
        x
    }

    #[test]
    fn the_density_is_that_of_the_formula() {
        for parameters in CASES {
            let law = Dirichlet::new(parameters.to_vec()).unwrap();
            let total: f64 = parameters.iter().sum();
            let constant = ln_gamma(total) - parameters.iter().map(|a| ln_gamma(*a)).sum::<f64>();
            // Points of the simplex: weights 1, 2, … in turn, normalised.
            for turn in 0..parameters.len() {
                let weights =
                    (0..parameters.len()).map(|place| 1.0 + ((place + turn) % parameters.len()) as f64);
                let total: f64 = weights.clone().sum();
                let x: Vec<f64> = weights.map(|weight| weight / total).collect();
                let powers: f64 = x.iter().zip(parameters).map(|(x, a)| (a - 1.0) * x.ln()).sum();
                let expected = constant + powers;
                assert!((law.ln_density(&x) - expected).abs() < 1e-9, "{parameters:?} {x:?} {expected}");
            }
            // Uniform on the simplex of three, whose area is 1/2.
            let flat = Dirichlet::new(vec![1.0; 3]).unwrap();
            assert!((flat.ln_density(&[0.2, 0.5, 0.3]) - 2f64.ln()).abs() < 1e-12);
            let mut beside = vec![0.6; parameters.len()];
            assert_eq!(law.ln_density(&beside), f64::NEG_INFINITY);
            beside[0] = -0.1;
            assert_eq!(law.ln_density(&beside), f64::NEG_INFINITY);
        }
    }

    #[test]
    fn each_proportion_has_a_beta_law() {
        let law = Dirichlet::new(vec![2.0, 3.5, 0.7]).unwrap();
        let beta = Beta::new(3.5, 2.7).unwrap();
        assert!((law.cumulative(1, 0.3) - beta.cdf(0.3)).abs() < 1e-12);
        // 3.5 / 6.2 and 3.5 · 2.7 / (6.2² · 7.2).
        assert!((law.mean()[1] - 3.5 / 6.2).abs() < 1e-12);
        assert!((law.variance()[1] - 9.45 / (38.44 * 7.2)).abs() < 1e-12);
    }

    #[test]
    fn draws_have_its_moments() {
        let mut random = seeded(1, "dirichlet");
        for parameters in CASES {
            let law = Dirichlet::new(parameters.to_vec()).unwrap();
            let count = 20_000;
            let draws: Vec<Vec<f64>> = (0..count).map(|_| drawn(&law, &mut random)).collect();
            assert!(draws.iter().all(|x| (x.iter().sum::<f64>() - 1.0).abs() < 1e-12));
            for position in 0..parameters.len() {
                let (mean, variance) = (law.mean()[position], law.variance()[position]);
                let average = |f: &dyn Fn(f64) -> f64| {
                    draws.iter().map(|x| f(x[position])).sum::<f64>() / f64::from(count)
                };
                let found = average(&|x| x);
                assert!((found - mean).abs() < 4.0 * (variance / f64::from(count)).sqrt(), "{parameters:?}");
                let square = average(&|x| (x - mean).powi(2));
                let fourth = average(&|x| (x - mean).powi(4));
                let error = ((fourth - square * square) / f64::from(count)).sqrt();
                assert!((square - variance).abs() < 4.0 * error, "{parameters:?}");
            }
        }
    }

    #[test]
    fn parameters_are_checked() {
        assert_eq!(Dirichlet::new(vec![1.0, 0.0]), Err(1));
        assert_eq!(Dirichlet::new(vec![f64::NAN, 1.0]), Err(0));
    }
}

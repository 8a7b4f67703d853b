//! Means over seeds.
//!
//! In: numbers, one for each seed. Out: their mean, its standard error, and a 95 % confidence interval by Student's t.

use serde::Serialize;

/// A mean with its uncertainty.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Mean {
    /// The mean.
    pub mean: f64,
    /// Its standard error; none for a single number.
    pub standard_error: Option<f64>,
    /// Half the width of the 95 % confidence interval; none for a single number.
    pub half_width: Option<f64>,
}

/// The 0.975 quantiles of Student's t for 1 to 30 degrees of freedom.
const T: [f64; 30] = [
    12.706, 4.303, 3.182, 2.776, 2.571, 2.447, 2.365, 2.306, 2.262, 2.228, 2.201, 2.179, 2.160, 2.145, 2.131,
    2.120, 2.110, 2.101, 2.093, 2.086, 2.080, 2.074, 2.069, 2.064, 2.060, 2.056, 2.052, 2.048, 2.045, 2.042,
];

/// The mean of some numbers; 0 of none.
pub fn mean(values: &[f64]) -> Mean {
    let count = values.len() as f64;
    if values.is_empty() {
        return Mean::default();
    }
    let mean = values.iter().sum::<f64>() / count;
    if values.len() == 1 {
        return Mean { mean, ..Mean::default() };
    }
    let variance = values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / (count - 1.0);
    let standard_error = (variance / count).sqrt();
    let quantile = T.get(values.len() - 2).copied().unwrap_or(1.96);
    Mean { mean, standard_error: Some(standard_error), half_width: Some(quantile * standard_error) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn four_numbers_by_hand() {
        // Mean 3, variance 20/3, standard error √(5/3) = 1.291; t(3) = 3.182.
        let found = mean(&[0.0, 2.0, 4.0, 6.0]);
        assert_eq!(found.mean, 3.0);
        assert!((found.standard_error.unwrap() - (5.0f64 / 3.0).sqrt()).abs() < 1e-12);
        assert!((found.half_width.unwrap() - 3.182 * found.standard_error.unwrap()).abs() < 1e-12);
        assert_eq!(
            mean(&[2.0]),
            Mean { mean: 2.0, standard_error: None, half_width: None },
            "one number has no spread"
        );
    }
}

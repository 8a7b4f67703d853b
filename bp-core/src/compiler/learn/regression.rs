//! Least squares: intercept, slopes and deviation of a linear regression.
//!
//! In: rows (x₁ … xₙ, y) with weights. Out: intercept, slopes, deviation of maximum likelihood. Invariant: columns are
//! centred and scaled before the normal equations are solved, so that large numbers lose no digits.
//!
//! a = (X̃ᵀ W X̃)⁻¹ X̃ᵀ W ỹ,  b = ȳ − Σ aᵢ x̄ᵢ,  s² = Σ w (y − b − Σ aᵢ xᵢ)² / Σ w

use crate::law::Refusal;
use nalgebra::{DMatrix, DVector};

pub(super) fn least_squares(rows: &[(Vec<f64>, f64)]) -> Result<Vec<f64>, Refusal> {
    let total: f64 = rows.iter().map(|(_, weight)| weight).sum();
    let Some(width) = rows.first().map(|(row, _)| row.len()).filter(|_| total > 0.0) else {
        return Err("no case contains information about it");
    };
    let mean =
        |of: &dyn Fn(&[f64]) -> f64| rows.iter().map(|(row, weight)| weight * of(row)).sum::<f64>() / total;
    let centres: Vec<f64> = (0..width).map(|column| mean(&|row| row[column])).collect();
    let scales: Vec<f64> =
        (0..width).map(|column| mean(&|row| (row[column] - centres[column]).powi(2)).sqrt()).collect();
    let slopes = width - 1;
    let too_alike = "a regression needs more cases, in which the variables on the right differ independently";
    if scales[..slopes].iter().zip(&centres).any(|(scale, centre)| *scale <= 1e-12 * centre.abs().max(1e-300))
    {
        return Err(too_alike);
    }
    let standard = |row: &[f64], column: usize| (row[column] - centres[column]) / scales[column];
    let gram =
        DMatrix::from_fn(slopes, slopes, |one, other| mean(&|row| standard(row, one) * standard(row, other)));
    let against =
        DVector::from_fn(slopes, |one, _| mean(&|row| standard(row, one) * (row[slopes] - centres[slopes])));
    // Correlations: the smallest eigenvalue measures the independence of the columns.
    if slopes > 0 && gram.clone().symmetric_eigenvalues().min() < 1e-10 {
        return Err(too_alike);
    }
    let solved = gram.cholesky().map(|gram| gram.solve(&against)).ok_or(too_alike)?;
    let slope: Vec<f64> = (0..slopes).map(|column| solved[column] / scales[column]).collect();
    let intercept =
        centres[slopes] - slope.iter().zip(&centres).map(|(slope, centre)| slope * centre).sum::<f64>();
    let residual = |row: &[f64]| {
        row[slopes] - intercept - slope.iter().zip(row).map(|(slope, x)| slope * x).sum::<f64>()
    };
    let deviation = mean(&|row| residual(row).powi(2)).sqrt();
    if deviation <= 1e-12 * scales[slopes] || deviation == 0.0 {
        return Err("the cases lie on a plane without deviation; a regression needs more of them");
    }
    Ok(std::iter::once(intercept).chain(slope).chain([deviation]).collect())
}

#[cfg(test)]
mod tests {
    use super::least_squares;

    #[test]
    fn a_line_through_four_points_is_the_one_counted_by_hand() {
        // x̄ = 1.5, ȳ = 4, Sxy = 7, Sxx = 5: slope 1.4, intercept 1.9; residuals −0.9, 0.7, 1.3, −1.1: Σ² = 4.2.
        let rows: Vec<_> =
            [[0.0, 1.0], [1.0, 4.0], [2.0, 6.0], [3.0, 5.0]].map(|row| (row.to_vec(), 1.0)).to_vec();
        let found = least_squares(&rows).unwrap();
        for (found, expected) in found.iter().zip([1.9, 1.4, (4.2_f64 / 4.0).sqrt()]) {
            assert!((found - expected).abs() < 1e-13, "{found} {expected}");
        }
        // Far from the origin the slope is the same up to rounding.
        let far: Vec<_> = (rows.iter()).map(|(row, weight)| (vec![row[0] + 1e8, row[1]], *weight)).collect();
        assert!((least_squares(&far).unwrap()[1] - 1.4).abs() < 1e-7);
    }

    #[test]
    fn columns_that_depend_on_each_other_are_refused() {
        let rows: Vec<_> = (0..9).map(f64::from).map(|x| (vec![x, 2.0 * x, x * x], 1.0)).collect();
        assert!(least_squares(&rows).is_err());
        assert!(least_squares(&[]).is_err());
    }
}

//! The covariances of an answer: of reals that are asked together.
//!
//! In: the rows of an answer and its parts. Out: a [`Covariance`] for each part of several reals. Invariant: a matrix
//! is in the order of the rows beside which it stands; it is symmetric.

use super::{Answer, Figure, Part, PartLaw, Row, Slot, apart};

/// The covariances of the reals of some consecutive rows.
#[derive(Clone, PartialEq, Debug)]
pub struct Covariance {
    /// The first of the rows.
    pub first: usize,
    /// The names of the reals.
    pub names: Vec<String>,
    /// Row by row; the diagonal holds the variances.
    pub matrix: Vec<Vec<f64>>,
}

/// Above this many reals, an answer does not write their covariances: they are more than all its other numbers.
const MOST: usize = 100;

impl Answer {
    /// The covariances of the reals that it answers together with their means and deviations: a matrix for each
    /// instant, or for each combination of values of finite variables asked with them. None beside other statistics, of a single real, of more than 100, and where one does not exist.
    pub fn covariances(&self) -> Vec<Covariance> {
        let mut first = 0;
        let mut found = Vec::new();
        for part in &self.parts {
            for matrix in matrices(part, &mut first) {
                let rows = self.answer.get(first..first + matrix.len()).unwrap_or_default();
                let names: Option<Vec<String>> = rows.iter().map(named).collect();
                let Some(names) = names.filter(|names| names.len() == matrix.len()) else {
                    return Vec::new();
                };
                let exist = matrix.iter().flatten().all(|number| number.is_finite());
                if exist && (2..=MOST).contains(&matrix.len()) {
                    found.push(Covariance { first, names, matrix });
                }
                first += rows.len();
            }
        }
        found
    }
}

/// The covariances of the reals of a part, in the order of its rows, of which the first may be of finite slots; of more
/// reals than are written, none of their numbers.
fn matrices(part: &Part, first: &mut usize) -> Vec<Vec<Vec<f64>>> {
    let matrix = |size: usize, covariance: &dyn Fn(usize, usize) -> f64| -> Vec<Vec<f64>> {
        let written = if size <= MOST { size } else { 0 };
        (0..size).map(|one| (0..written).map(|other| covariance(one, other)).collect()).collect()
    };
    let size = part.of.len();
    match &part.law {
        PartLaw::Normal { covariance, .. } | PartLaw::Laws { covariance, .. } => {
            vec![matrix(size, &|one, other| covariance[one * size + other])]
        }
        PartLaw::Mixture(mixture) => vec![matrix(size, &|one, other| mixture.covariance(one, other))],
        PartLaw::NamedMixture(mixture) => vec![matrix(size, &|one, other| mixture.covariance(one, other))],
        PartLaw::ConditionalGaussian(law) => {
            let (finite, reals) = apart(&part.of);
            let finite: Vec<Slot> = finite.into_iter().map(|place| part.of[place].clone()).collect();
            *first += finite.iter().map(|slot| slot.count).product::<usize>();
            let each = law.given_each(&finite).into_iter();
            each.map(|(_, mixture)| matrix(reals.len(), &|one, other| mixture.covariance(one, other)))
                .collect()
        }
        PartLaw::Finite(_) | PartLaw::Draws(..) => Vec::new(),
    }
}

/// The real of a row with its mean and deviation.
fn named(row: &Row) -> Option<String> {
    let (name, value) = row.values.last()?;
    let moments = matches!(row.figure, Figure::Normal { .. } | Figure::Mixture { .. } | Figure::Law { .. });
    (moments && value.is_empty()).then(|| name.clone())
}

//! Validation of distributions: the kind of their variable, and the domain of their parameters.
//!
//! In: a law and its arguments. Out: faults. Invariant: only constant arguments are checked here; the others are
//! checked when they are computed.

use super::{Fault, Place, fault, fault_with_help};
use crate::ids::{ExpressionId, FactorId};
use crate::law::{Law, Support};
use crate::model::{Domain, Fit, Model};

pub(super) fn law_faults(
    model: &Model,
    id: FactorId,
    law: Law,
    arguments: &[ExpressionId],
    domain: &Domain,
    name: &str,
    faults: &mut Vec<Fault>,
) {
    faults.extend(domain_fault(model, id, law, domain, name));
    let count = faults.len();
    for (position, argument) in arguments.iter().enumerate() {
        faults.extend(argument_fault(model, id, law, position, *argument));
    }
    let known: Option<Vec<f64>> = arguments.iter().map(|argument| model.constant(*argument)).collect();
    if let (Law::Uniform, Some([low, high]), true) = (law, known.as_deref(), faults.len() == count)
        && low >= high
    {
        faults.push(fault(Place::Form(id), format!("`uniform` needs low < high, but {low} ≥ {high}")));
    }
}

/// The fault of one argument of a distribution.
pub(super) fn argument_fault(
    model: &Model,
    id: FactorId,
    law: Law,
    position: usize,
    argument: ExpressionId,
) -> Option<Fault> {
    let (what, constraint) = law.parameters()[position];
    let value = model.constant(argument)?;
    let value = if constraint.is_probability() { model.rounded(argument, value) } else { value };
    let expected = constraint.refuses(value)?;
    Some(fault(
        Place::Expression(id, argument),
        format!("the {what} must be {expected}, but this is {value}"),
    ))
}

fn domain_fault(model: &Model, id: FactorId, law: Law, domain: &Domain, name: &str) -> Option<Fault> {
    let (place, law_name) = (Place::Form(id), law.name());
    if let (Domain::Bins(_), Support::Counts) = (domain, law.support()) {
        return Some(fault_with_help(
            place,
            format!(
                "`{law_name}` distributes whole numbers, but `{name}` is cut into bins: `{}`",
                model.domain_text(domain)
            ),
            format!("declare an integer range, such as `{name} : 0..=100`"),
        ));
    }
    let is = || format!("`{name}` is `{}`", model.domain_text(domain));
    let fits = match domain {
        Domain::Real => true,
        Domain::Bins(_) => true,
        Domain::Vector(_) => law == Law::Normal,
        Domain::Finite { labels, range } => labels.is_empty() && range.is_some(),
        Domain::Boolean | Domain::Set(_) => false,
    };
    if !fits {
        return Some(fault(
            place,
            format!("`{law_name}` needs a real, bins or an integer range, but {}", is()),
        ));
    }
    None
}

pub(super) fn fit_faults(
    model: &Model,
    id: FactorId,
    fit: &Fit,
    domain: &Domain,
    name: &str,
    faults: &mut Vec<Fault>,
) {
    let place = Place::Form(id);
    let is = || format!("`{name}` is `{}`", model.domain_text(domain));
    match fit {
        Fit::Law { law, known } => {
            faults.extend(domain_fault(model, id, *law, domain, name));
            if *law == Law::Binomial && known.is_empty() {
                let message = "the number of trials of `binomial` is not learned";
                faults.push(fault_with_help(place, message, "write it: `unknown(binomial(10))`"));
            }
            faults.extend(numbers_fault(place, *law, known, 0));
        }
        Fit::UnbiasedNormal | Fit::LinearRegression => {
            faults.extend(domain_fault(model, id, Law::Normal, domain, name));
            if let Domain::Vector(_) = domain {
                faults.push(fault(place, format!("components are not learned, but {}", is())));
            }
        }
        Fit::Conjugate { law, known, prior } => {
            faults.extend(domain_fault(model, id, *law, domain, name));
            let from = usize::from(*law == Law::Normal);
            faults.extend(numbers_fault(place, *law, known, from));
            if let Some(before) = Fit::prior_of(*law) {
                faults.extend(numbers_fault(place, before, prior, 0));
            }
        }
        Fit::Beta(..) if *domain != Domain::Boolean => {
            let message = format!("`beta(a, b)` is the prior of a `bool`, but {}", is());
            faults.push(fault_with_help(
                place,
                message,
                "of a real in ]0; 1[ learn `unknown(beta)`; of other values `unknown(dirichlet(1))`",
            ));
        }
        Fit::Beta(a, b) => faults.extend(numbers_fault(place, Law::Beta, &[*a, *b], 0)),
        Fit::LaplaceSuccession | Fit::Histogram | Fit::Dirichlet(_) if !domain.is_finite() => {
            faults.push(fault_with_help(
                place,
                format!("values are counted, but {}", is()),
                "learn a law: `unknown(normal)`",
            ));
        }
        Fit::Dirichlet(prior) if prior.is_nan() || *prior <= 0.0 => {
            faults.push(fault(place, format!("a prior count must be greater than 0, but this is {prior}")));
        }
        _ => {}
    }
}

/// The fault of some parameters of a distribution, the first of which is at `from`.
fn numbers_fault(place: Place, law: Law, numbers: &[f64], from: usize) -> Option<Fault> {
    let parameters = &law.parameters()[from..];
    parameters.iter().zip(numbers).find_map(|((what, constraint), number)| {
        let expected = constraint.refuses(*number)?;
        Some(fault(place, format!("the {what} of `{}` must be {expected}, but this is {number}", law.name())))
    })
}

//! An unknown precision τ with a gamma prior, beside reals that are linear and Gaussian given it.
//!
//! In: a program in which each standard deviation is a number over √τ. Out: τ has a gamma posterior, each real a Student
//! distribution. Invariant: given τ the program is linear and Gaussian, and τ multiplies all its precisions.
//!
//! With N observations, p(y | τ) = C τ^(N/2) exp(−τ Q/2), from which C, N and Q are read at three values of τ. With τ ~
//! gamma(a, b): τ | y ~ gamma(a′, b′), a′ = a + N/2, b′ = b + Q/2; a real of mean m and deviation s at τ = 1 has a Student
//! distribution of 2a′ degrees of freedom with location m and scale s √(b′/a′);
//! P(y) = C bᵃ Γ(a′) / (Γ(a) b′^a′) (DeGroot, *Optimal Statistical Decisions*, 1970, section 9.6).

use super::answer::{of_laws, truth};
use super::offer::predicate_of;
use super::scaled::{is_scaled, scales};
use crate::analysis::relevant_factors;
use crate::distribution::{Distribution, Setting};
use crate::equation::{CLOSE, Line, Notation, OPEN, Strategy};
use crate::error::Error;
use crate::ids::{FactorId, VariableId};
use crate::law::Law;
use crate::model::{Ask, Domain, Expression, Finding, Form, Model, Question, Searched, Statistic};
use crate::posterior::{Answer, NamedLaw, Slot, Table, refused_of_reals, refused_values};
use crate::special::ln_rising;
use crate::strategies::gaussian::{self, Conditioned, Gaussian, Slots};
use crate::strategies::{Case, Found, Offered, Prepared, Purpose};

/// An answer by the conjugate prior of a precision.
#[derive(Clone, PartialEq, Debug)]
pub struct Precision {
    asks: Vec<Ask>,
    /// τ, and the factor of its prior.
    unknown: VariableId,
    prior: FactorId,
    /// What is asked, without τ, of the program in which τ is a number.
    given: Gaussian,
}

/// The offer; `None` where no real is a precision, or why it is not conjugate.
pub(super) fn offer(model: &Model, asks: &[Ask]) -> Option<Result<Precision, String>> {
    let factors = relevant_factors(model, asks);
    let is_known = |id: VariableId| asks[0].known.iter().any(|known| known.variable == id);
    let (unknown, prior) = factors.iter().find_map(|id| {
        let factor = &model.factors[*id];
        let [left] = factor.left.as_slice() else { return None };
        let is_gamma = matches!(&factor.form, Form::Law { law: Law::Gamma | Law::Exponential, arguments }
            if arguments.iter().all(|id| model.degree(*id, &|_| true) == Some(0)));
        let alone = model.variables[left.variable].family.is_none()
            && model.variables[left.variable].domain == Domain::Real;
        let others = factors.iter().filter(|other| *other != id);
        let is_precision =
            || others.clone().any(|other| scales(model, &model.factors[*other].form, left.variable));
        (is_gamma && alone && !is_known(left.variable) && is_precision()).then_some((left.variable, *id))
    })?;
    let asked = |id: FactorId| {
        let left = model.factors[id].left[0].variable;
        !is_known(left) && of_unknown(model, left, unknown)
    };
    let all_scale = factors
        .iter()
        .filter(|id| !asked(**id))
        .find(|id| !is_scaled(model, &model.factors[**id].form, unknown));
    let tau = model.variable_name(unknown);
    if let Some(id) = all_scale {
        let head = model.head(&model.factors[*id]);
        return Some(Err(format!(
            "`{head}` is not normal with a standard deviation that is a number over the square root of `{tau}`"
        )));
    }
    Some(offer_given(model, asks, unknown).map(|given| Precision {
        asks: asks.to_vec(),
        unknown,
        prior,
        given,
    }))
}

/// Whether a variable is τ, or a predicate of τ alone.
fn of_unknown(model: &Model, variable: VariableId, unknown: VariableId) -> bool {
    let reads_it = |id: FactorId| model.factors[id].right.iter().all(|use_| use_.variable == unknown);
    let predicate =
        || predicate_of(model, variable).is_some() && model.factor_of(variable).is_some_and(reads_it);
    variable == unknown || predicate()
}

fn offer_given(model: &Model, asks: &[Ask], unknown: VariableId) -> Result<Gaussian, String> {
    let tau = model.variable_name(unknown);
    for ask in asks {
        let reals = ask.searched.iter().filter(|item| !model.is_predicate(item.variable));
        let sizes = reals.map(|item| match model.variables[item.variable].family {
            None => model.components(item.variable),
            Some(_) => 2,
        });
        let count: usize = sizes.sum();
        if let Some(why) = refused_of_reals(&ask.statistic, count) {
            return Err(why);
        }
        if matches!(ask.statistic, Statistic::Draw(_)) && count > 1 {
            return Err("of reals that depend on each other one is drawn at a time".to_owned());
        }
        if ask.searched.iter().any(|item| item.at.is_some() && !model.is_predicate(item.variable)) {
            if let Some(why) = refused_values(model, ask) {
                return Err(why);
            }
            if count > 1 {
                return Err("reals depend on each other through the precision: the density of one is computed at a time".to_owned());
            }
        }
        if ask.known.iter().any(|known| !matches!(known.evidence, Finding::Hard(_) | Finding::Each)) {
            return Err("evidence that is not hard is no observation of a real".to_owned());
        }
        let reads = |item: &Searched| {
            model.is_predicate(item.variable)
                && model
                    .factor_of(item.variable)
                    .is_some_and(|id| model.factors[id].right.iter().any(|use_| use_.variable == unknown))
        };
        let alone = ask.searched.len() == 1;
        if ask
            .searched
            .iter()
            .any(|item| reads(item) && !(alone && of_unknown(model, item.variable, unknown)))
        {
            return Err(format!("a predicate of `{tau}` and of other variables is not computed here"));
        }
    }
    let number = with_number(model, unknown, 1.0);
    let rest = |ask: &Ask| Ask {
        statistic: Statistic::Distribution,
        searched: ask
            .searched
            .iter()
            .filter(|item| !of_unknown(model, item.variable, unknown))
            .map(|item| Searched { at: None, ..item.clone() })
            .collect(),
        ..ask.clone()
    };
    let rest: Vec<Ask> = asks.iter().map(rest).collect();
    match rest.iter().all(|ask| gaussian::is_linear(&number, ask)) {
        true => gaussian::offer(&number, rest).map_err(|error| error.to_string()),
        false => Err(format!("given `{tau}` not all variables are real, linear and Gaussian")),
    }
}

/// The program in which a variable is a number wherever it is read.
fn with_number(model: &Model, unknown: VariableId, number: f64) -> Model {
    let mut model = model.clone();
    for id in model.expressions.ids().collect::<Vec<_>>() {
        if matches!(&model.expressions[id], Expression::Variable(use_) if use_.variable == unknown) {
            model.expressions[id] = Expression::Number(number);
        }
    }
    model
}

/// What the observations say of τ: p(y | τ) = C τ^(N/2) exp(−τ Q/2).
struct Likelihood {
    ln_constant: f64,
    /// N.
    count: f64,
    /// Q.
    squares: f64,
}

/// A number times more than this is nothing beside it.
const NOTHING_BESIDE: f64 = 1e18;
/// The largest precision at which the likelihood is computed: deviations have squares there.
const MOST_PRECISION: f64 = 1e150;

impl Precision {
    fn given(&self, model: &Model, tau: f64, case: &Case<'_>) -> Result<Conditioned, Error> {
        let number = with_number(model, self.unknown, tau);
        gaussian::conditioned(&Setting::new(&number, case.inputs)?, &self.given)
    }

    /// The likelihood of τ, from values of τ near its maximum N/Q, where no digits cancel. `rate` is b: a Q that is nothing
    /// beside it is 0.
    fn likelihood(&self, model: &Model, case: &Case<'_>, rate: f64) -> Result<Likelihood, Error> {
        let refused = |reason: &str| {
            let question = model.ask_text(&self.asks[0]);
            Err(Error::Unplanned { question, reason: reason.to_owned() })
        };
        let mut tau = 1.0;
        for _ in 0..60 {
            let ln = |factor: f64| self.given(model, factor * tau, case).map(|given| given.ln_evidence);
            let (at, once, twice) = (ln(1.0)?, ln(4.0)?, ln(16.0)?);
            if !(at.is_finite() && once.is_finite() && twice.is_finite()) {
                // The observations lie too many deviations away for a density.
                tau *= 1e-40;
                continue;
            }
            if at == once && once == twice {
                return Ok(Likelihood { ln_constant: at, count: 0.0, squares: 0.0 });
            }
            // ln p(4τ) − ln p(τ) = N ln 2 − 3/2 τ Q, and ln p(16τ) − ln p(4τ) = N ln 2 − 6 τ Q.
            let scaled = ((once - at) - (twice - once)) / 4.5;
            let found = (once - at + 1.5 * scaled) / std::f64::consts::LN_2;
            let count = found.round().max(1.0);
            if scaled > 20.0 * count.max(50.0) {
                tau /= scaled;
            } else if scaled < 0.05 * count && (tau * rate > NOTHING_BESIDE * count || tau > MOST_PRECISION) {
                return Ok(Likelihood { ln_constant: at - 0.5 * count * tau.ln(), count, squares: 0.0 });
            } else if scaled < 0.05 * count {
                tau *= if scaled > 1e-9 * count { count / scaled } else { 1e6 };
            } else if (found - count).abs() > 1e-4 {
                return refused(
                    "internal: the likelihood of the precision is not that of normal observations",
                );
            } else {
                let ln_constant = at - 0.5 * count * tau.ln() + 0.5 * scaled;
                return Ok(Likelihood { ln_constant, count, squares: scaled / tau });
            }
        }
        refused("the observations are too far from their means: their density is beyond the range of numbers")
    }

    /// The parameters of the prior.
    fn prior(&self, model: &Model, case: &Case<'_>) -> Result<[f64; 2], Error> {
        let setting = Setting::new(model, case.inputs)?;
        let instance = setting.instances(self.prior)?.remove(0);
        let values = vec![f64::NAN; setting.slots()];
        Ok(match setting.distribution(&instance, &values)? {
            Distribution::Law(Law::Gamma, [shape, rate, _]) => [shape, rate],
            Distribution::Law(_, [rate, ..]) => [1.0, rate],
            _ => {
                let reason = format!("`{}` is no conjugate prior", model.head(&model.factors[self.prior]));
                return Err(Error::Unplanned { question: model.ask_text(&self.asks[0]), reason });
            }
        })
    }
}

impl Prepared for Precision {
    fn run(&self, model: &Model, case: &Case<'_>) -> Result<Vec<Found>, Error> {
        let [shape, rate] = self.prior(model, case)?;
        let likelihood = self.likelihood(model, case, rate)?;
        let [a, b] = [shape + 0.5 * likelihood.count, rate + 0.5 * likelihood.squares];
        let ln_evidence = likelihood.ln_constant + ln_rising(shape, 0.5 * likelihood.count)
            - shape * (0.5 * likelihood.squares / rate).ln_1p()
            - 0.5 * likelihood.count * b.ln();
        let ln_evidence = (likelihood.count > 0.0).then_some(ln_evidence);
        // At the posterior mean of τ, so that scales are those of its deviations.
        let laws = self.given(model, a / b, case)?.laws;
        let setting = Setting::new(model, case.inputs)?;
        let answer = |(ask, law): (&Ask, gaussian::NormalLaw)| {
            let student = |mean: f64, deviation: f64| -> Result<NamedLaw, Error> {
                match deviation > 0.0 {
                    true => Ok(NamedLaw { law: Law::StudentT, parameters: [2.0 * a, mean, deviation] }),
                    false => Err(Error::Unplanned {
                        question: model.ask_text(ask),
                        reason: "what is asked is determined by what is known".to_owned(),
                    }),
                }
            };
            if let [only] = ask.searched.as_slice()
                && only.variable != self.unknown
                && of_unknown(model, only.variable, self.unknown)
                && let Some(root) = predicate_of(model, only.variable)
            {
                let gamma = |_: usize| NamedLaw { law: Law::Gamma, parameters: [a, b, 0.0] };
                return Ok(Found::Table(truth(&setting, ask, root, &gamma), ln_evidence));
            }
            if let [only] = ask.searched.as_slice()
                && let Some(root) = gaussian::of_normal(model, only.variable, true)
            {
                let law = student(law.mean(0), law.deviation(0))?;
                let leaves = Slots { setting: &setting, indices: &[] };
                let cells = gaussian::by_intervals(model, root, &|low, high| law.between(low, high), &leaves);
                let text = (ask, model.ask_text(ask));
                let table = Table::read(model, text, &[only.variable], cells.to_vec(), None, &[2]);
                return Ok(Found::Table(table, ln_evidence));
            }
            self.reals(&setting, ask, (&law, [a, b]), &student, (ln_evidence, case.sampling.seed))
                .map(Found::Answer)
        };
        self.asks.iter().zip(laws).map(answer).collect()
    }
}

impl Precision {
    /// The named laws of reals.
    fn reals(
        &self,
        setting: &Setting<'_>,
        ask: &Ask,
        (normal, [a, b]): (&gaussian::NormalLaw, [f64; 2]),
        student: &dyn Fn(f64, f64) -> Result<NamedLaw, Error>,
        known: (Option<f64>, u64),
    ) -> Result<Answer, Error> {
        let (mut laws, mut of, mut rows) = (Vec::new(), Vec::new(), Vec::new());
        let mut next = 0;
        for slot in ask.searched.iter().flat_map(|item| setting.slots_of(item.variable)) {
            of.push(Slot::of(setting, slot));
            if setting.variable_of(slot) == self.unknown {
                laws.push(NamedLaw { law: Law::Gamma, parameters: [a, b, 0.0] });
                rows.push(None);
            } else {
                laws.push(student(normal.mean(next), normal.deviation(next))?);
                rows.push(Some(next));
                next += 1;
            }
        }
        // The covariance at τ = a′/b′ times a′/(a′ − 1); of τ and a real 0, as the mean does not depend on τ.
        let (at, more) = (normal.covariance(), if a > 1.0 { a / (a - 1.0) } else { f64::INFINITY });
        let mut covariance = Vec::with_capacity(laws.len() * laws.len());
        for (one, law) in rows.iter().zip(&laws) {
            covariance.extend(rows.iter().map(|other| match (one, other) {
                _ if one == other => law.variance(),
                (Some(one), Some(other)) if at[(*one, *other)] != 0.0 => at[(*one, *other)] * more,
                _ => 0.0,
            }));
        }
        of_laws(setting, ask, (of, laws, covariance), known)
    }
}

impl Offered for Precision {
    fn strategy(&self) -> Strategy {
        Strategy::Conjugate
    }

    fn asks(&self) -> &[Ask] {
        &self.asks
    }

    /// As that of the program in which the precision is a number, at four values.
    fn cost(&self, model: &Model) -> Option<f64> {
        self.given.cost(model).map(|cost| 4.0 * cost)
    }

    fn reason(&self) -> &'static str {
        "exact, in closed form: the gamma prior of the precision is conjugate, and given it all reals are linear and Gaussian"
    }

    fn derive(&self, model: &Model, notation: Notation) -> (Vec<Line>, Vec<Line>) {
        let names =
            |ids: &mut dyn Iterator<Item = VariableId>| notation.names(model, &ids.collect::<Vec<_>>());
        let known = names(&mut self.asks[0].known.iter().map(|known| known.variable));
        let line = |of: &[String], reason: String, [unicode, latex, mathml]: [&str; 3]| {
            let right = notation.choose(unicode, latex, mathml);
            let left = notation.distribution(of, &known);
            ("conjugate".to_owned(), reason, notation.equation(&left, "=", right))
        };
        let tau = names(&mut std::iter::once(self.unknown));
        let searched = self.given.asks.iter().flat_map(|ask| &ask.searched);
        let searched = names(&mut searched.map(|item| item.variable));
        let law = |name: &str, of: &str| format!("<mi>{name}</mi>{OPEN}<mtext>{of}</mtext>{CLOSE}");
        let name = model.variable_name(self.unknown);
        let mut lines = vec![line(
            &tau,
            format!(
                "every deviation is a number over √{name}: the N observations have the density C {name}^(N/2) exp(−{name} Q/2), to \
                 which the gamma prior of `{name}` is conjugate"
            ),
            [
                "gamma(a + N/2, b + Q/2)",
                "\\text{gamma}(a + N/2,\\; b + Q/2)",
                &law("gamma", "a + N/2, b + Q/2"),
            ],
        )];
        if !searched.is_empty() {
            lines.push(line(
                &searched,
                format!(
                    "a normal distribution of deviation s/√{name}, averaged over the posterior of `{name}`"
                ),
                [
                    "student_t(2a′, m, s √(b′/a′))",
                    "\\text{student\\_t}(2a', m, s \\sqrt{b'/a'})",
                    &law("student_t", "2a′, m, s √(b′/a′)"),
                ],
            ));
        }
        (lines, Vec::new())
    }

    fn not_printed(&self, _: &Model) -> Option<String> {
        Some("conjugate posteriors are computed by `answer::ask`, not by emitted code".to_owned())
    }

    fn prepare(&self, _: &Model, _: &Question, _: Purpose) -> Result<Box<dyn Prepared>, Error> {
        Ok(Box::new(self.clone()))
    }
}

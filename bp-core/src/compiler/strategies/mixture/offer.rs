//! The offer of the mixture strategy.
//!
//! In: asks that know the same. Out: a [`Mixture`], or why not. Invariant: a real never is a parent of a finite variable,
//! except of one predicate that is asked.

use crate::analysis::{Scope, is_linear_in, of_form, relevant_factors};
use crate::equation::{CLOSE, Line, Notation, OPEN, Strategy};
use crate::error::Error;
use crate::ids::{ExpressionId, FactorId, VariableId};
use crate::model::{Ask, Domain, Finding, IndexSpace, Known, Model, Question, Searched, Statistic};
use crate::posterior::{refused_of_reals, refused_values};
use crate::strategies::gaussian::of_normal;
use crate::strategies::sums::is_mixed_at_value;
use crate::strategies::weighting::refused_factor;
use crate::strategies::{self, Offered, Prepared, Purpose, Route, Turn, refused};
use std::collections::BTreeSet;

/// The most components of a mixture.
pub(super) const MOST_COMPONENTS: f64 = 131_072.0;

/// An answer as a mixture of normal distributions.
#[derive(Clone, PartialEq, Debug)]
pub struct Mixture {
    /// The asks.
    pub asks: Vec<Ask>,
    /// The factors that matter, parents first, without those of predicates.
    pub factors: Vec<FactorId>,
    /// The reals.
    pub linear: Vec<VariableId>,
    /// The known reals that forms may read in any way: their values are numbers.
    pub numbers: Vec<VariableId>,
    /// The factors of known reals, and of finite variables, that are no part of the linear equations.
    pub weighed: Vec<FactorId>,
    /// The finite variables that are not observed.
    pub finite: Vec<VariableId>,
    /// The number of combinations of their values.
    pub components: f64,
}

/// The strategy.
pub(crate) struct Engine;

impl strategies::Engine for Engine {
    fn offer(&self, model: &Model, asks: &[Ask], turn: &Turn<'_>) -> Result<Route, Error> {
        offer(model, asks, turn.forced).map(Route::Mixture).map_err(|why| refused(model, asks, &why))
    }
}

fn offer(model: &Model, asks: &[Ask], forced: bool) -> Result<Mixture, String> {
    if let Some(why) = asks.iter().find_map(|ask| refused_ask(model, ask)) {
        return Err(why);
    }
    let is_finite = |id: &VariableId| model.variables[*id].domain.is_finite();
    let one_kind = || Err("it is for programs with both finite variables and reals".to_owned());
    if model.variables.ids().all(|id| is_finite(&id)) {
        return one_kind();
    }
    let factors = relevant_factors(model, asks);
    let predicate = |id: &FactorId| {
        let left = model.factors[*id].left[0].variable;
        let own = |ask: &Ask| {
            own_predicate(model, ask).is_some_and(|(place, _)| ask.searched[place].variable == left)
        };
        asks.iter().any(own)
    };
    let several = |ask: &&Ask| {
        let searched = |id: FactorId| {
            let left = model.factors[id].left[0].variable;
            predicate(&id) && ask.searched.iter().any(|item| item.variable == left)
        };
        own_predicate(model, ask).is_none() && factors.iter().any(|id| searched(*id))
    };
    if asks.iter().any(|ask| several(&ask)) {
        return Err("one predicate of reals is computed at a time: ask for each".to_owned());
    }
    let factors: Vec<FactorId> =
        model.parents_first(&factors).into_iter().filter(|id| !predicate(id)).collect();
    let left = |id: &FactorId| model.factors[*id].left.iter().map(|use_| use_.variable);
    let (mut finite, mut linear): (Vec<VariableId>, Vec<VariableId>) =
        factors.iter().flat_map(left).partition(is_finite);
    for variables in [&mut finite, &mut linear] {
        variables.sort_unstable();
        variables.dedup();
    }
    let mut known: Vec<VariableId> =
        asks[0].known.iter().filter(|known| is_hard(known)).map(|known| known.variable).collect();
    // A vector of which a question names each component.
    let named: BTreeSet<(VariableId, usize)> = (known.iter().filter_map(|id| model.named_component(*id)))
        .filter(|(use_, _)| use_.element.is_none())
        .map(|(use_, at)| (use_.variable, at))
        .collect();
    known.extend(linear.iter().copied().filter(|id| {
        let components = model.components(*id);
        components > 1 && (0..components).all(|component| named.contains(&(*id, component)))
    }));
    let known = |id: &VariableId| known.contains(id);
    let numbers: Vec<VariableId> = linear.iter().copied().filter(known).collect();
    if linear.is_empty() || finite.is_empty() && numbers.is_empty() {
        return one_kind();
    }
    // Where values of known reals need not be numbers, they are part of the linear equations, which agree up to rounding.
    let (numbers, weighed) = match weighed(model, &factors, &linear, &[]) {
        Ok(weighed) => (Vec::new(), weighed),
        Err(why) if numbers.is_empty() => return Err(why),
        Err(_) => match weighed(model, &factors, &linear, &numbers) {
            Ok(weighed) => (numbers, weighed),
            Err(_) if finite.is_empty() => return one_kind(),
            Err(why) => return Err(why),
        },
    };
    if finite.is_empty() && numbers.is_empty() {
        return one_kind();
    }
    // Chosen by name it answers these too. A vector has no kernel, and sums do not add points to densities.
    let has_sums = |id: &FactorId| {
        let factor = &model.factors[*id];
        let is_vector = matches!(model.variables[factor.left[0].variable].domain, Domain::Vector(_));
        !is_vector && !is_mixed_at_value(model, asks, *id)
    };
    if !forced && linear.iter().all(known) && factors.iter().all(has_sums) {
        return Err("all reals are observed: densities at single values are factors of sums".to_owned());
    }
    finite.retain(|id| !known(id) && Some(*id) != model.plate_index());
    if let Some(why) = asks.iter().find_map(|ask| refused_mixture(model, ask, &finite)) {
        return Err(why);
    }
    let mut components = 1.0;
    let contexts = asks[0].known.iter().filter(|known| is_context(model, known)).map(|known| known.variable);
    let contexts: Vec<VariableId> = contexts.collect();
    for id in finite.iter().chain(&contexts) {
        let variable = &model.variables[*id];
        let length = match variable.family.map(|family| family.over) {
            None => Some(1),
            Some(IndexSpace::Range(range)) if range.high.size.is_none() => {
                model.index_count(&IndexSpace::Range(range))
            }
            Some(_) => None,
        };
        let (Some(length), Some(count)) = (length, variable.domain.count()) else {
            let name = model.variable_name(*id);
            return Err(format!("the number of values of `{name}` is known only when it is asked"));
        };
        components *= (count as f64).powf(length as f64);
    }
    if components > MOST_COMPONENTS {
        return Err(format!(
            "the finite variables have {components} combinations, more than {MOST_COMPONENTS}"
        ));
    }
    Ok(Mixture { asks: asks.to_vec(), factors, linear, numbers, weighed, finite, components })
}

/// The predicate of reals that an ask of finite variables searches, the only one: its position and its expression.
pub(super) fn own_predicate(model: &Model, ask: &Ask) -> Option<(usize, ExpressionId)> {
    if !ask.searched.iter().all(|item| model.variables[item.variable].domain.is_finite()) {
        return None;
    }
    let of = |(place, item): (usize, &Searched)| Some((place, of_normal(model, item.variable, false)?));
    let mut all = ask.searched.iter().enumerate().filter_map(of);
    all.next().filter(|_| all.next().is_none())
}

/// Whether the answer has a context for each value of what is known, unless a value is given.
pub(super) fn is_context(model: &Model, known: &Known) -> bool {
    known.evidence == Finding::Each
        && model.variables[known.variable].domain.is_finite()
        && Some(known.variable) != model.plate_index()
}

/// Whether all of a variable is known by values.
fn is_hard(known: &Known) -> bool {
    known.is_whole() || known.evidence == Finding::Each
}

/// The factors of known reals that are no part of the linear equations, where the values of these reals are numbers; or why the reals
/// are not linear and Gaussian.
fn weighed(
    model: &Model,
    factors: &[FactorId],
    reals: &[VariableId],
    numbers: &[VariableId],
) -> Result<Vec<FactorId>, String> {
    let scope: Scope = reals.iter().copied().filter(|id| !numbers.contains(id)).collect();
    let mut weighed = Vec::new();
    for id in factors {
        let factor = &model.factors[*id];
        let head = model.head(factor);
        if let Some(why) = refused_factor(model, factor) {
            return Err(why);
        }
        let left = factor.left[0].variable;
        let real = of_form(model, *id).into_iter().find(|parent| scope.contains(parent));
        let real = real.map(|real| model.variable_name(real));
        if model.variables[left].domain.is_finite() {
            if let Some(real) = real {
                return Err(format!("`{head}` is a finite variable that depends on the real `{real}`"));
            }
        } else if factor.left.len() > 1 || !is_linear_in(model, &factor.form, &scope) {
            // Its density at the known value is a number; that of a vector is a product over its components, given the earlier ones.
            let is_number = numbers.contains(&left) && factor.left.len() == 1 && real.is_none();
            if !is_number || factor.form.has_point() || factor.form.is_improper() {
                return Err(format!("`{head}` is not normal with a mean that is linear in reals"));
            }
            weighed.push(*id);
        }
    }
    Ok(weighed)
}

/// Why an ask is not answered by a mixture.
fn refused_ask(model: &Model, ask: &Ask) -> Option<String> {
    let is_finite = |variable: VariableId| model.variables[variable].domain.is_finite();
    if ask.when.is_over_time() {
        return Some("over time the components multiply".to_owned());
    }
    let finite = ask.searched.iter().filter(|item| is_finite(item.variable)).count();
    if finite == 0 {
        // Of several reals it depends on what is summed out.
        let reals = if is_of_both(&ask.statistic) { 1 } else { ask.searched.len() };
        if let Some(why) = refused_of_reals(&ask.statistic, reals) {
            return Some(why);
        }
        if let Some(why) = refused_values(model, ask) {
            return Some(why);
        }
    } else if finite < ask.searched.len() {
        if !is_of_both(&ask.statistic) {
            let word = ask.statistic.word();
            return Some(format!(
                "`{word}` of finite variables and reals together is not computed: ask for `P(…)`, or for each"
            ));
        }
        if let Some(why) = refused_values(model, ask) {
            return Some(why);
        }
    }
    ask.known.iter().find_map(|known| {
        let name = model.variable_name(known.variable);
        match &known.evidence {
            Finding::Soft(_) => Some(format!("soft evidence on `{name}` is mixed from answers without it")),
            Finding::Each if is_context(model, known) && finite < ask.searched.len() => Some(format!(
                "a table over `{name}` is made of finite variables alone: give its value, `{name} = …`"
            )),
            _ => None,
        }
    })
}

/// Whether a statistic is computed of finite variables and reals together.
fn is_of_both(statistic: &Statistic) -> bool {
    matches!(
        statistic,
        Statistic::Distribution
            | Statistic::Entropy
            | Statistic::Maximum
            | Statistic::Argmax { .. }
            | Statistic::Draw(_)
    )
}

/// Why the entropy or the mode of several reals is not computed: where other finite variables are summed out, each combination of
/// values has a mixture of several reals, unless these are determined.
fn refused_mixture(model: &Model, ask: &Ask, finite: &[VariableId]) -> Option<String> {
    let needs_one =
        matches!(ask.statistic, Statistic::Entropy | Statistic::Maximum | Statistic::Argmax { .. });
    let searched = |id: &VariableId| ask.searched.iter().any(|item| item.variable == *id);
    let reals: usize = (ask.searched.iter().map(|item| item.variable))
        .filter(|id| !model.variables[*id].domain.is_finite())
        .map(|id| size(model, id))
        .sum();
    let word = ask.statistic.word();
    let is_known = |id: VariableId| ask.known.iter().any(|known| known.variable == id && is_hard(known));
    let is_open = |item: &Searched| {
        let is_real = !model.variables[item.variable].domain.is_finite();
        is_real && !model.is_determined(item.variable, &is_known)
    };
    let needs_one = needs_one && ask.searched.iter().any(is_open);
    let other = finite.iter().find(|id| !searched(id)).filter(|_| needs_one && reals > 1)?;
    let other = model.variable_name(*other);
    Some(format!(
        "`{word}` of several reals together is not computed where `{other}` is summed out: ask for `{other}` too"
    ))
}

/// The number of reals of a variable; several where it is a family whose size is known only when it is asked.
fn size(model: &Model, variable: VariableId) -> usize {
    match model.variables[variable].family.map(|family| family.over) {
        None => model.components(variable),
        Some(_) => 2,
    }
}

impl Offered for Mixture {
    fn strategy(&self) -> Strategy {
        Strategy::Mixture
    }

    fn asks(&self) -> &[Ask] {
        &self.asks
    }

    fn cost(&self, _: &Model) -> Option<f64> {
        let reals = (self.linear.len() - self.weighed.len()) as f64;
        Some(self.components * reals.powi(3))
    }

    fn reason(&self) -> &'static str {
        match self.numbers.is_empty() {
            true => "exact, as a mixture: given the finite variables all reals are linear and Gaussian",
            false => {
                "exact: given the finite variables and what is known the other reals are linear and Gaussian"
            }
        }
    }

    fn derive(&self, model: &Model, notation: Notation) -> (Vec<Line>, Vec<Line>) {
        let names =
            |ids: &mut dyn Iterator<Item = VariableId>| notation.names(model, &ids.collect::<Vec<_>>());
        let searched = names(&mut self.asks[0].searched.iter().map(|item| item.variable));
        let known = names(&mut self.asks[0].known.iter().map(|known| known.variable));
        let left = notation.distribution(&searched, &known);
        // A reason is text in every notation.
        let given = [self.finite.as_slice(), self.numbers.as_slice()].concat();
        let given = Notation::Unicode.names(model, &given).join(" ");
        let line = |rule: &str, reason: String, [unicode, latex, mathml]: [&str; 3]| {
            let right = notation.choose(unicode, latex, mathml);
            (rule.to_owned(), reason, notation.equation(&left, "=", right))
        };
        let normal =
            |of: &str, mean: &str| format!("<mi>𝒩</mi>{OPEN}{of}<mo separator=\"true\">;</mo>{mean}{CLOSE}");
        let (sum, weight) = ("<msub><mo>Σ</mo><mi>d</mi></msub>", "<msub><mi>w</mi><mi>d</mi></msub>");
        let mathml = format!(
            "{sum}{weight}{}",
            normal(
                "<mi>x</mi>",
                "<msub><mi>m</mi><mi>d</mi></msub><mo separator=\"true\">,</mo><msub><mi>Σ</mi><mi>d</mi></msub>"
            )
        );
        let lines = vec![line(
            "mixture",
            format!(
                "given `{given}` all other reals are linear and Gaussian: each of the {} combinations d of values has a weight \
                 w_d ∝ P(d) p(observations | d) and a normal distribution",
                self.components
            ),
            ["Σ_d w_d N(x; m_d, Σ_d)", "\\sum_d w_d\\, \\mathcal{N}(x; m_d, \\Sigma_d)", &mathml],
        )];
        (lines, Vec::new())
    }

    fn not_printed(&self, _: &Model) -> Option<String> {
        Some("a mixture of normal distributions is computed by `answer::ask`, not by emitted code".to_owned())
    }

    fn prepare(&self, _: &Model, _: &Question, _: Purpose) -> Result<Box<dyn Prepared>, Error> {
        Ok(Box::new(self.clone()))
    }
}

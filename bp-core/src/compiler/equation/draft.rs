//! A plan under construction: a normalising constant, a sum and a product of factors, transformed by the rules.
//!
//! In: a question. Out: [`Exact`]. Invariant: at any time the draft denotes
//! Σ_free Π factors, normalised, under its bindings; each change is recorded with its reason.

use super::{Binding, Elimination, Exact, Options, Step, Term, eliminate, elision};
use crate::error::Error;
use crate::ids::{Arena, TermId, VariableId};
use crate::model::{Ask, Domain, Finding, Form, Model, Value};
use crate::spelling::{exact, list};
use std::collections::{BTreeMap, BTreeSet, HashSet};

/// The rule of the definition of a question.
pub(super) const DEFINITION: &str = "definition";

/// The rule of substituting known values.
pub(super) const EVIDENCE: &str = "evidence";

pub(crate) struct Draft<'m> {
    pub(crate) model: &'m Model,
    pub(crate) options: Options,
    asks: Vec<Ask>,
    /// The plate's index and the known variables, without virtual evidence.
    known: HashSet<VariableId>,
    pub(crate) terms: Arena<TermId, Term>,
    /// The factors of the product; before the decomposition, the joint alone.
    pub(crate) factors: Vec<TermId>,
    /// Variables that are still to be summed out.
    pub(crate) free: BTreeSet<VariableId>,
    pub(crate) searched: Vec<VariableId>,
    pub(crate) each: Vec<VariableId>,
    pub(crate) bindings: BTreeMap<VariableId, Binding>,
    pub(crate) normalise: bool,
    pub(crate) cost: f64,
    pub(crate) eliminations: Vec<Elimination>,
    derivation: Vec<Step>,
}

impl<'m> Draft<'m> {
    /// P(S | K) = P(S K) / P(K), by the definition of a question.
    pub(crate) fn define(model: &'m Model, asks: Vec<Ask>, options: Options) -> Self {
        let (mut searched, mut met) = (Vec::new(), HashSet::new());
        for item in asks.iter().flat_map(|ask| &ask.searched) {
            if met.insert(item.variable) {
                searched.push(item.variable);
            }
        }
        let hard = asks[0].known.iter().filter(|known| !matches!(known.evidence, Finding::Virtual(_)));
        let known = hard.map(|known| known.variable).chain(model.plate_index()).collect();
        let mut terms = Arena::default();
        let joint = terms.push(Term::Joint);
        let mut draft = Self {
            model,
            options,
            terms,
            factors: vec![joint],
            known,
            free: BTreeSet::new(),
            searched,
            each: Vec::new(),
            bindings: BTreeMap::new(),
            normalise: true,
            cost: 0.0,
            eliminations: Vec::new(),
            derivation: Vec::new(),
            asks,
        };
        for known in &draft.asks[0].known {
            match &known.evidence {
                Finding::Each if !given_when_asked(model, known.variable) => draft.each.push(known.variable),
                _ => {}
            }
        }
        draft.record(
            DEFINITION,
            "a conditional distribution is the joint one divided by that of the known variables".to_owned(),
        );
        draft
    }

    /// Known variables: the plate's index and those of the question.
    pub(crate) fn is_known(&self, variable: VariableId) -> bool {
        self.known.contains(&variable)
    }

    /// Sums over everything that is neither searched nor known.
    pub(crate) fn marginalise(&mut self) {
        let searched: HashSet<VariableId> = self.searched.iter().copied().collect();
        self.free = (self.model.variables.ids())
            .filter(|variable| !searched.contains(variable) && !self.is_known(*variable))
            .collect();
        if !self.free.is_empty() {
            let names: Vec<_> = self.free.iter().map(|id| self.model.variable_name(*id)).collect();
            self.record("marginalisation", format!("{} neither searched nor known", are(&names)));
        }
    }

    /// The joint is the product of the factors of the decomposition.
    pub(crate) fn decompose(&mut self) {
        let factors: Vec<_> = self.model.factors.ids().map(Term::Factor).collect();
        self.factors = factors.into_iter().map(|factor| self.terms.push(factor)).collect();
        self.record("decomposition", "the program's conditional independences".to_owned());
    }

    /// Substitutes known values; virtual evidence multiplies.
    ///
    /// # Errors
    /// Soft evidence, which is mixed from answers that search the variable.
    pub(crate) fn condition(&mut self) -> Result<(), Error> {
        let mut reasons = Vec::new();
        for known in self.asks[0].known.clone() {
            let name = self.model.variable_name(known.variable);
            let value = match known.evidence {
                Finding::Hard(value) => {
                    reasons.push(match &value {
                        Value::Ordinal(ordinal) => {
                            format!("`{name}` is {}", self.model.value_name(known.variable, *ordinal))
                        }
                        Value::Real(number) => format!("`{name}` is {}", exact(*number)),
                        Value::Vector(numbers) => format!("`{name}` is {}", list(numbers)),
                        Value::Given(given) => format!("`{name}` is given when asked, as `{given}`"),
                    });
                    value
                }
                Finding::Each if given_when_asked(self.model, known.variable) => {
                    reasons.push(format!("`{name}` is given when asked"));
                    Value::Given(name)
                }
                Finding::Each => continue,
                Finding::Virtual(weights) => {
                    let likelihood = self.terms.push(Term::Likelihood(known.variable, weights));
                    self.factors.push(likelihood);
                    reasons.push(format!("`{name}` is known by likelihoods, which multiply (Pearl)"));
                    continue;
                }
                Finding::Soft(_) => {
                    let reason = format!("soft evidence on `{name}` is mixed from answers without it");
                    return Err(self.unplanned(reason));
                }
            };
            self.bindings.insert(known.variable, Binding::Value(value));
        }
        // A searched real with a given value has no axis: the value is substituted from the start.
        for item in self.asks.iter().flat_map(|ask| &ask.searched) {
            if let (Some(value), false) = (&item.at, self.model.variables[item.variable].domain.is_finite()) {
                self.bindings.insert(item.variable, Binding::Value(value.clone()));
                reasons.push(format!("`{}` has a given value", self.model.variable_name(item.variable)));
            }
        }
        if !reasons.is_empty() {
            let others = |count| format!("and {} more", elision::grouped(count));
            let reasons = elision::list(reasons.len(), |at| reasons[at].clone(), others);
            self.record(EVIDENCE, reasons.join("; "));
        }
        Ok(())
    }

    /// Records the current state of the draft.
    pub(crate) fn record(&mut self, rule: &'static str, reason: String) {
        let term = self.snapshot();
        self.derivation.push(Step { rule, reason, term, bindings: self.bindings.clone() });
    }

    fn snapshot(&mut self) -> TermId {
        let mut term = self.body();
        if !self.free.is_empty() {
            term = self.terms.push(Term::Sum(self.free.iter().copied().collect(), term));
        }
        match self.normalise {
            true => self.terms.push(Term::Normalise(self.searched.clone(), term)),
            false => term,
        }
    }

    fn body(&mut self) -> TermId {
        match self.factors.as_slice() {
            [one] => *one,
            several => self.terms.push(Term::Product(several.to_vec())),
        }
    }

    /// The plan, once all sums are made.
    pub(crate) fn finish(mut self) -> Result<Exact, Error> {
        assert!(self.free.is_empty(), "internal: variables are left unsummed");
        let real = |variable: &&VariableId| {
            !self.model.variables[**variable].domain.is_finite() && !self.bindings.contains_key(variable)
        };
        if let Some(variable) = self.searched.iter().find(real) {
            let name = self.model.variable_name(*variable);
            return Err(
                self.unplanned(format!("`{name}` is real, and not everything is linear and Gaussian"))
            );
        }
        let bound = |variable: &&VariableId| !self.model.variables[**variable].domain.is_finite();
        if let (Some(variable), true) = (self.searched.iter().find(bound), self.normalise) {
            let name = self.model.variable_name(*variable);
            return Err(self.unplanned(format!("its normalising constant is an integral over `{name}`")));
        }
        for variable in self.searched.iter().chain(&self.each) {
            if !self.bindings.contains_key(variable) {
                eliminate::summable(&self, *variable)?;
            }
        }
        let joint = self.body();
        Ok(Exact {
            asks: self.asks,
            terms: self.terms,
            joint,
            normalised: !self.normalise,
            bindings: self.bindings,
            each: self.each,
            searched: self.searched,
            ln_evidence: self.options.ln_evidence,
            derivation: self.derivation,
            cost: self.cost,
            eliminations: self.eliminations,
        })
    }

    /// The sum of products, for a strategy with its own elimination order.
    pub(crate) fn unordered(mut self) -> Exact {
        let mut joint = self.body();
        if !self.free.is_empty() {
            joint = self.terms.push(Term::Sum(self.free.iter().copied().collect(), joint));
        }
        Exact {
            asks: self.asks,
            terms: self.terms,
            joint,
            normalised: false,
            bindings: self.bindings,
            each: self.each,
            searched: self.searched,
            ln_evidence: self.options.ln_evidence,
            derivation: self.derivation,
            cost: 0.0,
            eliminations: Vec::new(),
        }
    }

    /// The error that no exact strategy applies.
    pub(crate) fn unplanned(&self, reason: String) -> Error {
        Error::Unplanned { question: self.model.ask_text(&self.asks[0]), reason }
    }
}

/// Known variables without a table: reals, and those whose form is a question to another program.
fn given_when_asked(model: &Model, variable: VariableId) -> bool {
    let asks = |form: &Form| matches!(form, Form::Ask { .. });
    matches!(model.variables[variable].domain, Domain::Real | Domain::Vector(_))
        || model.factor_of(variable).is_some_and(|factor| asks(&model.factors[factor].form))
}

/// `A`, `B` and `C` are.
pub(super) fn are(names: &[String]) -> String {
    match names {
        [one] => format!("`{one}` is"),
        [first, last] => format!("`{first}` and `{last}` are"),
        several => {
            let others = |count| format!("… ({} more)", elision::grouped(count));
            let mut names = elision::list(several.len(), |at| format!("`{}`", several[at]), others);
            let last = names.pop().expect("internal: no names");
            format!("{} and {last} are", names.join(", "))
        }
    }
}

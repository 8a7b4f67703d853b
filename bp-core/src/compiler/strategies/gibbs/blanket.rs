//! Markov blankets: the factors in the full conditional of each variable.
//!
//! In: the steps of a route. Out: a [`Site`] for each slot that is drawn, with the nodes of its Markov blanket.
//! Invariant: a slot that a Dirac determines is not a site: its value is recomputed when one of its parents moves.
//!
//! P(x | all else) ∝ P(x | parents) Π P(child | its parents)   (Pearl, *Artificial Intelligence* 32:245-257, 1987)

use crate::distribution::{Distribution, Instance, Setting};
use crate::error::Error;
use crate::ids::VariableId;
use crate::model::{Form, Model};
use crate::sample::Observations;
use crate::strategies::particles::is_linear_in;
use crate::strategies::weighting::{Step, has_point, solve};
use std::collections::BTreeSet;

/// One term of the joint density, or one deterministic assignment.
pub(super) enum Node {
    /// A left-hand side with a density.
    Weighed(Instance),
    /// A left-hand side that a Dirac determines, or the last proportion of a simplex.
    Determined(Instance),
    /// A left-hand side with a density, solved from an observed Dirac.
    Solved(Instance, Instance),
    /// Virtual evidence: a slot with a likelihood for each value.
    Likelihood(usize, Vec<f64>),
}

/// A slot that is drawn.
pub(super) struct Site {
    /// The slot.
    pub(super) slot: usize,
    /// The number of its values; `None` for a real.
    pub(super) count: Option<usize>,
    /// The nodes that depend on its value, its own first, in an order in which they can be computed.
    pub(super) blanket: Vec<usize>,
    /// Whether its full conditional is normal: every node of its blanket is normal and linear in it.
    pub(super) is_normal: bool,
}

/// A model prepared for Markov chains.
pub(super) struct Blankets<'s> {
    pub(super) setting: &'s Setting<'s>,
    pub(super) observations: &'s Observations,
    pub(super) nodes: Vec<Node>,
    pub(super) sites: Vec<Site>,
}

impl<'s> Blankets<'s> {
    /// The sites of a route.
    ///
    /// # Errors
    /// A variable that single-site moves cannot change, because a Dirac ties it to others.
    pub(super) fn new(
        setting: &'s Setting<'s>,
        steps: &[Step],
        observations: &'s Observations,
    ) -> Result<Self, Error> {
        let hidden = |slot: usize| observations.values[slot].is_nan();
        let (mut nodes, mut drawn) = (Vec::new(), Vec::new());
        for (step, instance) in
            steps.iter().flat_map(|step| step.instances.iter().map(move |own| (step, own)))
        {
            let form = &setting.model.factors[instance.factor].form;
            let hides = instance.left.iter().any(|slot| hidden(*slot));
            nodes.push(match &step.dirac {
                Some(dirac) => Node::Solved(instance.clone(), dirac.clone()),
                None if hides && is_point(form, instance.component) => Node::Determined(instance.clone()),
                None => {
                    let slots: Vec<usize> =
                        instance.left.iter().copied().filter(|slot| hidden(*slot)).collect();
                    if let Some(slot) = slots.first().filter(|_| may_count(form)) {
                        return Err(stuck(
                            setting,
                            *slot,
                            "is a count of `multinomial`, tied to the others by their sum",
                        ));
                    }
                    let real = |slot: &&usize| !is_finite(setting, **slot);
                    if let Some(slot) =
                        slots.iter().find(real).filter(|_| may_be_point(form, instance.component))
                    {
                        return Err(stuck(setting, *slot, "has a `dirac` in part of its form"));
                    }
                    drawn.extend(slots);
                    Node::Weighed(instance.clone())
                }
            });
        }
        for (slot, likelihoods) in &observations.likelihoods {
            nodes.push(Node::Likelihood(*slot, likelihoods.clone()));
        }
        let reads: Vec<BTreeSet<usize>> = nodes.iter().map(|node| reads(setting, node)).collect();
        let sites = drawn.into_iter().map(|slot| site(setting, &nodes, &reads, slot)).collect();
        let blankets = Self { setting, observations, nodes, sites };
        match blankets.tied() {
            Some(slot) => Err(stuck(
                setting,
                slot,
                "is observed, and its `dirac` constrains several unobserved variables, which cannot be sampled one by one",
            )),
            None => Ok(blankets),
        }
    }

    /// An observed slot whose Dirac depends on several sites.
    fn tied(&self) -> Option<usize> {
        self.nodes.iter().enumerate().find_map(|(position, node)| {
            let Node::Weighed(instance) = node else { return None };
            let observed = |slot: &usize| !self.observations.values[*slot].is_nan();
            let is_dirac = has_point(&self.setting.model.factors[instance.factor].form);
            let sites = self.sites.iter().filter(|site| site.blanket.contains(&position)).count();
            (is_dirac && sites > 1 && instance.left.iter().all(observed)).then_some(instance.left[0])
        })
    }

    /// ln of the full conditional of a site's value, up to a constant; recomputes the values that depend on it.
    ///
    /// # Errors
    /// A parameter outside the range that its law accepts.
    pub(super) fn ln_conditional(&self, site: &Site, values: &mut [f64]) -> Result<f64, Error> {
        let mut sum = 0.0;
        for node in &site.blanket {
            let ln = self.ln_density(&self.nodes[*node], values)?;
            sum += ln;
            // Later terms may be undefined at this value (a deviation that is not positive), so the sum ends here.
            if ln == f64::NEG_INFINITY || sum.is_nan() {
                return Ok(f64::NEG_INFINITY);
            }
        }
        Ok(sum)
    }

    fn ln_density(&self, node: &Node, values: &mut [f64]) -> Result<f64, Error> {
        match node {
            Node::Weighed(instance) => self.setting.ln_density(instance, values),
            Node::Determined(instance) => self.determine(instance, values),
            Node::Solved(instance, dirac) => solve(self.setting, instance, dirac, self.observations, values),
            Node::Likelihood(slot, likelihoods) => Ok(likelihoods[values[*slot] as usize].ln()),
        }
    }

    /// Computes the value of a Dirac; returns −∞ where it lies outside the domain.
    fn determine(&self, instance: &Instance, values: &mut [f64]) -> Result<f64, Error> {
        Ok(match self.setting.distribution(instance, values)?.only_value() {
            Some(value) => {
                self.setting.put(instance, value, values);
                0.0
            }
            None => f64::NEG_INFINITY,
        })
    }

    /// For each normal law of a site's blanket, its deviation and the residual of its value, where the site has this
    /// value; `None` where a law is not normal.
    ///
    /// # Errors
    /// A parameter outside the range that its law accepts.
    pub(super) fn residuals(
        &self,
        site: &Site,
        value: f64,
        values: &mut [f64],
    ) -> Result<Option<Vec<[f64; 2]>>, Error> {
        values[site.slot] = value;
        let mut residuals = Vec::with_capacity(site.blanket.len());
        for node in &site.blanket {
            match &self.nodes[*node] {
                Node::Determined(instance) => {
                    self.determine(instance, values)?;
                }
                Node::Weighed(instance) => match self.setting.distribution(instance, values)? {
                    Distribution::Law(crate::law::Law::Normal, [mean, deviation, _]) => {
                        residuals.push([self.setting.left_value(instance, values) - mean, deviation]);
                    }
                    _ => return Ok(None),
                },
                _ => return Ok(None),
            }
        }
        Ok(Some(residuals))
    }
}

fn is_finite(setting: &Setting<'_>, slot: usize) -> bool {
    setting.model.variables[setting.variable_of(slot)].domain.is_finite()
}

/// Whether a form determines its value for all values of its parents.
fn is_point(form: &Form, component: usize) -> bool {
    match form {
        Form::Dirac(_) => true,
        Form::Dirichlet(parameters) => component + 1 == parameters.len(),
        Form::If { then, otherwise, .. } => is_point(then, component) && is_point(otherwise, component),
        _ => false,
    }
}

/// Whether a form determines its value for some values of its parents.
fn may_be_point(form: &Form, component: usize) -> bool {
    let mut found = is_point(form, component);
    form.each_part(&mut |part| found |= may_be_point(part, component));
    found
}

/// Whether a form gives counts that are tied to each other, for some values of its parents.
fn may_count(form: &Form) -> bool {
    let mut found = matches!(form, Form::Multinomial { .. });
    form.each_part(&mut |part| found |= may_count(part));
    found
}

fn reads(setting: &Setting<'_>, node: &Node) -> BTreeSet<usize> {
    match node {
        Node::Weighed(instance) | Node::Determined(instance) => setting.reads(instance),
        Node::Solved(instance, dirac) => {
            let mut both = setting.reads(instance);
            both.extend(setting.reads(dirac));
            both.retain(|slot| !instance.left.contains(slot));
            both
        }
        Node::Likelihood(slot, _) => BTreeSet::from([*slot]),
    }
}

fn site(setting: &Setting<'_>, nodes: &[Node], reads: &[BTreeSet<usize>], slot: usize) -> Site {
    let mut moved = BTreeSet::from([slot]);
    let mut blanket = Vec::new();
    for (position, node) in nodes.iter().enumerate() {
        let own = matches!(node, Node::Weighed(instance) if instance.left.contains(&slot));
        if !own && reads[position].is_disjoint(&moved) {
            continue;
        }
        blanket.push(position);
        if let Node::Determined(instance) | Node::Solved(instance, _) = node {
            moved.extend(&instance.left);
        }
    }
    let variable = setting.variable_of(slot);
    let moved: BTreeSet<VariableId> = moved.into_iter().map(|slot| setting.variable_of(slot)).collect();
    let is_normal = blanket.iter().all(|node| node_is_linear(setting.model, &nodes[*node], &moved));
    let count = is_finite(setting, slot).then(|| setting.count(variable));
    Site { slot, count, blanket, is_normal: is_normal && count.is_none() }
}

fn node_is_linear(model: &Model, node: &Node, moved: &BTreeSet<VariableId>) -> bool {
    let (Node::Weighed(instance) | Node::Determined(instance)) = node else { return false };
    let factor = &model.factors[instance.factor];
    !model.variables[factor.left[0].variable].domain.is_finite() && is_linear_in(model, &factor.form, moved)
}

fn stuck(setting: &Setting<'_>, slot: usize, why: &str) -> Error {
    let name = setting.slot_name(slot);
    let reason = format!(
        "`{name}` {why}; Gibbs sampling would never leave where it begins: add some noise, \
         `normal(…, deviation)`, or take `--by weighting`"
    );
    Error::Unplanned { question: setting.model.name.clone(), reason }
}

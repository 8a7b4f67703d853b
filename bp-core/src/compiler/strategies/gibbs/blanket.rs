//! Markov blankets: the factors in the full conditional of each variable.
//!
//! In: the steps of a route. Out: a [`Site`] for each slot that is drawn, with the nodes of its Markov blanket.
//! Invariant: a slot that a Dirac determines is not a site: its value is recomputed when one of its parents moves.
//!
//! P(x | all else) ∝ P(x | parents) Π P(child | its parents)   (Pearl, *Artificial Intelligence* 32:245-257, 1987)

use super::compiled::{Compiled, Terms};
use super::finite_rest::{FiniteRest, Sums};
use super::integrated::may_follow;
use super::linear_rest::{Equations, LinearRest};
use super::sites::{Part, behind, check_moves, is_point, site, stuck, summed};
use crate::distribution::{Distribution, Instance, Setting};
use crate::error::Error;
use crate::ids::VariableId;
use crate::model::Form;
use crate::random::Random;
use crate::sample::Observations;
use crate::strategies::weighting::{Step, draw_or_weigh, solve};
use std::collections::BTreeSet;

/// One term of the joint density, or one deterministic assignment.
pub(super) enum Node {
    /// A left-hand side with a density.
    Weighed(Instance),
    /// A left-hand side that a Dirac determines, or the last proportion of a simplex.
    Determined(Instance),
    /// A left-hand side with a density, solved from an observed Dirac.
    Solved(Instance, Instance),
    /// A left-hand side that is integrated out, or that depends on such.
    Integrated(Instance),
    /// A left-hand side that is summed out, or that depends on such, and the place of the sum.
    Summed(Instance, usize),
    /// Virtual evidence: a slot with a likelihood for each value.
    Likelihood(usize, Vec<f64>),
}

/// What a chain has computed, for its next steps.
#[derive(Clone, Debug, Default)]
pub(super) struct Memory {
    pub(super) sums: Sums,
    pub(super) equations: Equations,
    pub(super) cells: Vec<f64>,
}

/// A slot that is drawn.
#[derive(Clone, Debug)]
pub(super) struct Site {
    /// The slot.
    pub(super) slot: usize,
    /// The number of its values; `None` for a real.
    pub(super) count: Option<usize>,
    /// The nodes that depend on its value, its own first, in an order in which they can be computed.
    pub(super) blanket: Vec<usize>,
    /// Whether its full conditional is normal: every node of its blanket is normal and linear in it.
    pub(super) is_normal: bool,
    /// Whether what is integrated out depends on its value.
    pub(super) moves_rest: bool,
    /// The sums that depend on its value.
    pub(super) clumps: Vec<usize>,
    /// Its blanket, parted into what is compiled and what is not.
    pub(super) terms: Terms,
}

/// A model prepared for Markov chains.
pub(super) struct Blankets<'s> {
    pub(super) setting: &'s Setting<'s>,
    pub(super) observations: &'s Observations,
    pub(super) nodes: Vec<Node>,
    pub(super) sites: Vec<Site>,
    pub(super) compiled: Compiled,
    /// What is integrated out.
    pub(super) rest: Option<LinearRest<'s>>,
    /// What is summed out, and of this what is drawn after a sweep.
    pub(super) finite: FiniteRest<'s>,
    clumps: Vec<usize>,
    /// What is drawn after a sweep, parents first: nothing observed depends on it.
    forward: Vec<Node>,
}

impl<'s> Blankets<'s> {
    /// The sites of a route, where some variables are integrated out and some slots are kept.
    ///
    /// # Errors
    /// A variable that single-site moves cannot change, because a Dirac ties it to others.
    pub(super) fn new(
        setting: &'s Setting<'s>,
        steps: &[Step],
        observations: &'s Observations,
        integrated: &[VariableId],
        kept: &[usize],
    ) -> Result<Self, Error> {
        let hidden = |slot: &usize| observations.values[*slot].is_nan();
        let parts: Vec<Part<'_>> = steps.iter().flat_map(|step| Part::of(setting, step)).collect();
        let seeds = observations.likelihoods.iter().map(|(slot, _)| *slot);
        let needed = behind(&parts, seeds.collect(), &|part| {
            part.dirac.is_some()
                || !part.instance.left.iter().all(hidden)
                || !may_follow(setting.model, part.instance.factor)
        });
        let wanted = behind(&parts, kept.iter().copied().collect(), &|_| false);
        let mut linear = vec![false; setting.slots()];
        let own = integrated.iter().flat_map(|variable| setting.slots_of(*variable));
        own.filter(hidden).for_each(|slot| linear[slot] = needed.slots.contains(&slot));
        let is_integrated =
            |part: &Part<'_>| linear[part.instance.left[0]] || part.reads.iter().any(|slot| linear[*slot]);
        let of_needed = parts.iter().zip(&needed.parts).filter(|(_, needed)| **needed).map(|(part, _)| part);
        let finite = summed(setting, of_needed, observations, &is_integrated);
        let (mut nodes, mut reads, mut drawn, mut forward) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        for (number, part) in parts.into_iter().enumerate() {
            let instance = part.instance;
            let form = setting.form_at(instance);
            let slots: Vec<usize> = instance.left.iter().copied().filter(hidden).collect();
            let is_determined = !slots.is_empty() && is_point(form, instance.component);
            let clump = instance.left.iter().chain(&part.reads).find_map(|slot| finite.clump(*slot));
            let node = match (part.dirac, clump) {
                _ if needed.parts[number] && is_integrated(&part) => Node::Integrated(instance.clone()),
                (None, Some(clump)) if needed.parts[number] => Node::Summed(instance.clone(), clump),
                (Some(dirac), _) => Node::Solved(instance.clone(), dirac.clone()),
                (None, _) if is_determined => Node::Determined(instance.clone()),
                (None, _) => Node::Weighed(instance.clone()),
            };
            if !needed.parts[number] {
                forward.extend(wanted.parts[number].then_some(node));
                continue;
            }
            let own = linear[instance.left[0]] || finite.clump(instance.left[0]).is_some();
            if !own && !matches!(node, Node::Solved(..) | Node::Determined(_)) {
                check_moves(setting, form, instance.component, &slots)?;
                drawn.extend(slots);
            }
            nodes.push(node);
            reads.push(part.reads);
        }
        for (slot, likelihoods) in &observations.likelihoods {
            if finite.clump(*slot).is_none() {
                nodes.push(Node::Likelihood(*slot, likelihoods.clone()));
                reads.push(BTreeSet::from([*slot]));
            }
        }
        let is_integrated = |node: &Node| match node {
            Node::Integrated(instance) => Some(instance.clone()),
            _ => None,
        };
        let instances: Vec<Instance> = nodes.iter().filter_map(is_integrated).collect();
        let hidden: Vec<bool> = (0..setting.slots()).map(|slot| hidden(&slot) && !linear[slot]).collect();
        let rest = match instances.is_empty() {
            true => None,
            false => Some(LinearRest::new(setting, &instances, linear, &hidden, &observations.values)?),
        };
        let compiled = Compiled::new(setting, observations, &nodes);
        let site_of = |slot: usize| {
            let site = site(setting, &nodes, &reads, slot);
            Site { terms: compiled.terms(&site.blanket), ..site }
        };
        let sites = drawn.into_iter().map(site_of).collect();
        let clumps: BTreeSet<usize> = wanted.slots.iter().filter_map(|slot| finite.clump(*slot)).collect();
        let clumps = clumps.into_iter().collect();
        let blankets = Self { setting, observations, nodes, sites, compiled, rest, finite, clumps, forward };
        match blankets.tied() {
            Some(slot) => Err(stuck(
                setting,
                slot,
                "is observed, and its `dirac` constrains several unobserved variables, which cannot be sampled one by one",
            )),
            None => Ok(blankets),
        }
    }

    /// Completes a state by what is not drawn site by site: what is integrated out, and what nothing observed depends on.
    ///
    /// # Errors
    /// A parameter outside the range that its law accepts.
    pub(super) fn complete(
        &self,
        values: &mut [f64],
        memory: &mut Memory,
        random: &mut Random,
    ) -> Result<(), Error> {
        self.finite.draw(&self.clumps, values, &mut memory.sums, random)?;
        if let Some(rest) = &self.rest {
            rest.draw(values, &mut memory.equations, random)?;
            for instance in rest.determined() {
                self.determine(instance, values)?;
            }
        }
        for node in &self.forward {
            match node {
                Node::Weighed(instance) => {
                    draw_or_weigh(self.setting, (instance, None), self.observations, random, values)?;
                }
                other => {
                    self.ln_density(other, values)?;
                }
            }
        }
        Ok(())
    }

    /// Takes back what [`Blankets::complete`] has added.
    pub(super) fn withdraw(&self, values: &mut [f64]) {
        self.finite.withdraw(values);
        if let Some(rest) = &self.rest {
            rest.withdraw(values);
        }
        for node in &self.forward {
            if let Node::Weighed(instance) | Node::Determined(instance) = node {
                let hidden = instance.left.iter().filter(|slot| self.observations.values[**slot].is_nan());
                hidden.for_each(|slot| values[*slot] = f64::NAN);
            }
        }
    }

    /// Whether its form is `flat` or `half_flat`.
    pub(super) fn is_flat(&self, instance: &Instance) -> bool {
        matches!(self.setting.model.factors[instance.factor].form, Form::Flat | Form::HalfFlat)
    }

    pub(super) fn is_half_flat(&self, instance: &Instance) -> bool {
        matches!(self.setting.model.factors[instance.factor].form, Form::HalfFlat)
    }

    /// An observed slot whose Dirac depends on several sites; a predicate of reals leaves each of them an interval.
    fn tied(&self) -> Option<usize> {
        self.nodes.iter().enumerate().find_map(|(position, node)| {
            let Node::Weighed(instance) = node else { return None };
            let observed = |slot: &usize| !self.observations.values[*slot].is_nan();
            let is_dirac = self.setting.model.factors[instance.factor].form.has_point();
            let sites = self.sites.iter().filter(|site| site.blanket.contains(&position));
            let left = &self.setting.model.variables[self.setting.variable_of(instance.left[0])];
            let leaves_room = left.domain.is_finite() && sites.clone().all(|site| site.count.is_none());
            (is_dirac && !leaves_room && sites.count() > 1 && instance.left.iter().all(observed))
                .then_some(instance.left[0])
        })
    }

    /// ln of the full conditional of a site's value, up to a constant; recomputes the values that depend on it.
    ///
    /// # Errors
    /// A parameter outside the range that its law accepts.
    pub(super) fn ln_conditional(
        &self,
        site: &Site,
        values: &mut [f64],
        memory: &mut Memory,
    ) -> Result<f64, Error> {
        let mut sum = match self.ln_compiled(site, values, memory) {
            Some(ln) => ln,
            None => self.ln_of(&site.blanket, values)?,
        };
        if sum == f64::NEG_INFINITY {
            return Ok(sum);
        }
        if !site.clumps.is_empty() {
            sum += self.finite.ln_sum(&site.clumps, values, &mut memory.sums)?;
        }
        match &self.rest {
            Some(rest) if site.moves_rest && sum > f64::NEG_INFINITY => {
                Ok(sum + rest.ln_density(values, &mut memory.equations)?)
            }
            _ => Ok(sum),
        }
    }

    /// ln of the product of some nodes.
    pub(super) fn ln_of(&self, nodes: &[usize], values: &mut [f64]) -> Result<f64, Error> {
        let mut sum = 0.0;
        for node in nodes {
            let ln = self.ln_density(&self.nodes[*node], values)?;
            sum += ln;
            // Later terms may be undefined at this value (a deviation that is not positive), so the sum ends here.
            if ln == f64::NEG_INFINITY || sum.is_nan() {
                return Ok(f64::NEG_INFINITY);
            }
        }
        Ok(sum)
    }

    pub(super) fn ln_density(&self, node: &Node, values: &mut [f64]) -> Result<f64, Error> {
        match node {
            Node::Weighed(instance) if self.is_flat(instance) => {
                let outside = self.is_half_flat(instance) && values[instance.left[0]] <= 0.0;
                Ok(if outside { f64::NEG_INFINITY } else { 0.0 })
            }
            Node::Weighed(instance)
                if instance.left.iter().all(|slot| !self.observations.values[*slot].is_nan()) =>
            {
                self.setting.ln_density(instance, values)
            }
            Node::Weighed(instance) => {
                let distribution = self.setting.distribution(instance, values)?;
                let slot = instance.left[0];
                if matches!(distribution, Distribution::Point(_)) && self.observations.values[slot].is_nan() {
                    return Err(stuck(
                        self.setting,
                        slot,
                        "is determined by the other components of its vector",
                    ));
                }
                Ok(distribution.ln_density(self.setting.left_value(instance, values)))
            }
            Node::Integrated(_) | Node::Summed(..) => Ok(0.0),
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

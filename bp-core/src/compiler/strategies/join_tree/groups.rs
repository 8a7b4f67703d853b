//! Answers of a group of asks with the same known variables, by shared propagations of a join tree.
//!
//! In: a [`JoinTree`] route whose asks are a group, and the host's inputs. Out: an answer for each ask. Invariant: all
//! variables of the program are in the network, numbered as their slots; errors contain their names.

use super::answer::evidence;
use super::{
    JoinTree, Marginals, Named, NetworkEvidence, Observation, entropy, joint, most_probable, observations,
};
use crate::distribution::Setting;
use crate::equation::{Group, Strategy};
use crate::error::{Error, Impossible};
use crate::ids::VariableId;
use crate::model::{Ask, Model, Statistic};
use crate::posterior::{Answer, Figure, Part, PartLaw, Row, Slot};
use crate::strategies::{Case, Findings, Found};
use std::f64::consts::LN_2;

/// The largest number of cells of a joint posterior.
const MOST_CELLS: f64 = 1e6;

/// The answer of each ask.
pub(super) fn answers(model: &Model, route: &JoinTree, case: &Case<'_>) -> Result<Vec<Found>, Error> {
    let setting = Setting::new(model, case.inputs)?;
    let named = Named::with(model.clone(), &[], case.inputs)?;
    let numbers: Vec<usize> = (0..setting.slots()).collect();
    let (mut evidence, _) = evidence(&setting, route, &numbers)?;
    let findings = case.findings.cloned().unwrap_or_default();
    let slot = |variable: VariableId, element: usize| setting.slots_of(variable).start + element;
    evidence.hard.extend(findings.hard.iter().map(|(id, element, value)| (slot(*id, *element), *value)));
    let weighed = findings.weighed.iter().map(|(id, at, weights)| (slot(*id, *at), weights.clone()));
    evidence.likelihoods.extend(weighed);
    let group = Asked { setting: &setting, route, named: &named, evidence, findings };
    let question = || model.ask_text(&route.exact.asks[0]);
    let mut values = vec![f64::NAN; setting.slots()];
    group.evidence.hard.iter().for_each(|(slot, value)| values[*slot] = *value as f64);
    let found = match route.group {
        Group::Joint => group.joint(),
        Group::Mode => group.mode(),
        Group::Information => group.information(),
        Group::Marginals | Group::Tables => group.marginals(),
    };
    found.map_err(|error| match error {
        Error::Contradiction { variables, .. } if variables.is_empty() => {
            Error::Impossible(Impossible { question: question(), reason: setting.zero_factor(&values) })
        }
        other => named.with_names(other),
    })
}

/// A group of asks, and its evidence.
struct Asked<'a> {
    setting: &'a Setting<'a>,
    route: &'a JoinTree,
    named: &'a Named,
    evidence: NetworkEvidence,
    findings: Findings,
}

impl Asked<'_> {
    fn numbers(&self, slots: &[(VariableId, usize)]) -> Vec<usize> {
        slots.iter().map(|(variable, element)| self.setting.slots_of(*variable).start + element).collect()
    }

    fn answer(&self, ask: &Ask, ln_evidence: Option<f64>, parts: Vec<Part>, rows: Vec<Row>) -> Found {
        Found::Answer(Answer {
            question: self.setting.model.ask_text(ask),
            ln_evidence: ln_evidence.filter(|_| self.route.exact.ln_evidence),
            estimate: None,
            answer: rows.into(),
            strategy: Strategy::JoinTree,
            when: ask.when,
            parts,
        })
    }

    fn part(&self, slots: &[usize], law: Vec<f64>) -> Part {
        let of = slots.iter().map(|slot| Slot::of(self.setting, *slot)).collect();
        Part { instant: None, given: Vec::new(), of, law: PartLaw::Finite(law.into()) }
    }

    /// The marginal of each variable, by a single propagation.
    fn marginals(&self) -> Result<Vec<Found>, Error> {
        let model = self.setting.model;
        let searched = |ask: &Ask| self.setting.slots_of(ask.searched[0].variable);
        let wanted: Vec<usize> = self.route.exact.asks.iter().flat_map(searched).collect();
        let given: Vec<usize> = self.evidence.hard.iter().map(|(one, _)| *one).collect();
        let weighed: Vec<usize> = self.evidence.likelihoods.iter().map(|(one, _)| *one).collect();
        let plan = Marginals::new(&self.named.network, &given, &weighed, &wanted)?;
        let mut session = plan.session();
        session.ask(&self.evidence)?;
        let answer = |ask: &Ask| {
            let part = |place: usize| self.part(&[place], session.posterior(place, &self.evidence));
            let parts: Vec<Part> = searched(ask).map(part).collect();
            let rows = parts.iter().flat_map(|part| part.rows(model)).collect();
            self.answer(ask, Some(session.ln_evidence()), parts, rows)
        };
        Ok(self.route.exact.asks.iter().map(answer).collect())
    }

    /// The joint posterior of some variables.
    fn joint(&self) -> Result<Vec<Found>, Error> {
        let slots = self.numbers(&self.findings.about);
        let cells: f64 = slots.iter().map(|one| self.named.network.cardinalities[*one] as f64).product();
        if cells > MOST_CELLS {
            let (name, help) = ("the joint posterior".to_owned(), "name fewer variables".to_owned());
            return Err(Error::TooLarge { name, cells, most: MOST_CELLS, help });
        }
        let found = joint(&self.named.network, &self.evidence, &slots)?;
        let part = self.part(&slots, found.probabilities);
        let rows = part.rows(self.setting.model);
        let ask = &self.route.exact.asks[0];
        Ok(vec![self.answer(ask, Some(found.ln_evidence), vec![part], rows)])
    }

    /// The most probable assignment of all variables.
    fn mode(&self) -> Result<Vec<Found>, Error> {
        let (values, ln_p) = most_probable(&self.named.network, &self.evidence)?;
        let named = values.iter().enumerate();
        let values = named.map(|(one, value)| (self.named.variable(one), self.named.value(one, *value)));
        let row = Row { values: values.collect(), figure: Figure::LnProbability { ln_p } };
        let ask = &self.route.exact.asks[0];
        Ok(vec![self.answer(ask, None, Vec::new(), vec![row])])
    }

    /// The information of each candidate about the targets, from the marginals of all candidates for each value of the
    /// targets. An ask has a row for each of its candidates.
    fn information(&self) -> Result<Vec<Found>, Error> {
        let (about, among) = (self.numbers(&self.findings.about), self.numbers(&self.findings.among));
        let network = &self.named.network;
        let (now, found) = observations(network, &self.evidence, &about, &among)?;
        let answer = |ask: &Ask| {
            let own = ask.searched[0].variable;
            let is_entropy = ask.statistic == Statistic::Entropy;
            let mut rows = Vec::new();
            if is_entropy && Some(ask) == self.route.exact.asks.first() {
                let entropy = entropy(&now.probabilities) * LN_2;
                rows.push(Row { values: Vec::new(), figure: Figure::Entropy { entropy, error: None } });
            }
            let alone = ask.searched.len() == 1 || !is_entropy;
            let own = |one: &&Observation| alone && self.setting.variable_of(one.variable) == own;
            rows.extend(found.iter().filter(own).map(|one| {
                let figure = match is_entropy {
                    true => Figure::Entropy { entropy: one.entropy * LN_2, error: None },
                    false => Figure::Information { information: one.information * LN_2 },
                };
                Row { values: vec![(self.named.variable(one.variable), String::new())], figure }
            }));
            self.answer(ask, Some(now.ln_evidence), Vec::new(), rows)
        };
        Ok(self.route.exact.asks.iter().map(answer).collect())
    }
}

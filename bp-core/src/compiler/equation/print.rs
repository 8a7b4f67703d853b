//! Derivations: from the question to the equation that is computed, line by line.
//!
//! In: a plan. Out: for each step its rule, its reason and its equation, in Unicode or in LaTeX. Invariant: every line
//! is a true equation: values are substituted on both sides at once, and `∝` is used after constants have been dropped.

use super::draft::{DEFINITION, EVIDENCE, are};
use super::printer::Printer;
use super::{Binding, Exact, Notation, Step, cancel, parts};
use crate::ids::VariableId;
use crate::model::{Ask, Model, Searched, Statistic};
use std::collections::BTreeMap;

/// p ln p in MathML, and the p that follows.
const LN_P: &str = "<mi>p</mi><mspace width=\"0.17em\"/><mi>ln</mi><mspace width=\"0.17em\"/><mi>p</mi>\
    <mo separator=\"true\">,</mo> <mi>p</mi>";

/// (rule, reason, equation).
pub(crate) type Line = (String, String, String);

impl Exact {
    /// The lines of the distribution, and those of the answers.
    pub(crate) fn lines(&self, model: &Model, notation: Notation) -> (Vec<Line>, Vec<Line>) {
        let known = BTreeMap::new();
        let mut printer = Printer {
            model,
            exact: self,
            bindings: &known,
            conditioned: false,
            proportional: false,
            forms: false,
            notation,
        };
        let mut lines = Vec::new();
        for Step { rule, reason, term, bindings } in &self.derivation {
            printer.bindings = bindings;
            printer.conditioned |= *rule == EVIDENCE;
            printer.proportional |= *rule == cancel::CONSTANTS;
            let equation = printer.equation(*term);
            // Without known variables, the definition is trivial, and a normalising constant of 1 is not shown.
            let repeats = lines.last().is_some_and(|(_, _, before): &Line| *before == equation);
            let is_trivial = printer.evidence().is_none() && *rule == DEFINITION;
            if !repeats && !is_trivial {
                lines.push(((*rule).to_owned(), reason.clone(), equation));
            }
        }
        lines.extend(self.last_line(&printer));
        let read_outs = self.asks.iter().filter_map(|ask| self.read_out(ask, &printer)).collect();
        (lines, read_outs)
    }

    /// The whole answer, with normalising constant and given values, if the last step does not show it.
    fn last_line(&self, printer: &Printer<'_>) -> Option<Line> {
        let wanted = self.wanted_alone();
        let mut bindings = printer.bindings.clone();
        bindings.extend(wanted.iter().map(|(variable, value)| (*variable, Binding::Value(value.clone()))));
        let at = Printer { bindings: &bindings, ..*printer };
        let (asked, above) = (at.asked(), at.term(self.joint));
        if self.normalised || (printer.evidence().is_none() && !printer.proportional) {
            let names: Vec<_> = wanted.iter().map(|(id, _)| printer.model.variable_name(*id)).collect();
            return (!wanted.is_empty()).then(|| {
                let reason = format!("{} at a given value", are(&names));
                ("value".to_owned(), reason, printer.notation.equation(&asked, "=", &above))
            });
        }
        let notation = printer.notation;
        let searched = notation.sum(&notation.names(printer.model, &self.searched));
        let below = format!("{searched}{}", printer.term(self.joint));
        let reason = "over all searched variables, the answer sums to one".to_owned();
        let equation = notation.equation(&asked, "=", &notation.normalised(&above, &below));
        Some(("normalisation".to_owned(), reason, equation))
    }

    /// The given values of the searched variables of a single ask.
    fn wanted_alone(&self) -> Vec<(VariableId, crate::model::Value)> {
        let [Ask { statistic: Statistic::Distribution, searched, .. }] = self.asks.as_slice() else {
            return Vec::new();
        };
        let free = |item: &&Searched| !self.bindings.contains_key(&item.variable);
        searched.iter().filter(free).filter_map(|item| Some((item.variable, item.at.clone()?))).collect()
    }

    /// The statistic of an ask.
    fn read_out(&self, ask: &Ask, printer: &Printer<'_>) -> Option<Line> {
        let (model, notation) = (printer.model, printer.notation);
        let own: Vec<VariableId> = ask.searched.iter().map(|searched| searched.variable).collect();
        let rest: Vec<_> = self.searched.iter().copied().filter(|id| !own.contains(id)).collect();
        let alone = Exact { searched: own.clone(), ..self.clone() };
        let left = Printer { exact: &alone, ..*printer }.asked();
        let names = notation.names(model, &own);
        let (rule, equation) = match &ask.statistic {
            Statistic::Distribution if rest.is_empty() => return None,
            Statistic::Distribution => {
                let sum = notation.sum(&notation.names(model, &rest));
                ("read-out", notation.equation(&left, "=", &format!("{sum}{}", printer.asked())))
            }
            Statistic::Entropy => {
                let sum = notation.sum(&names);
                let (h, minus, ln) = (
                    notation.choose("H", "H", "<mi>H</mi>"),
                    notation.choose("−", "-", "<mo form=\"prefix\">−</mo>"),
                    notation.choose("p ln p, p", "p \\ln p,\\quad p", LN_P),
                );
                (
                    "entropy",
                    notation.equation(h, "=", &notation.equation(&format!("{minus}{sum}{ln}"), "=", &left)),
                )
            }
            Statistic::Maximum => ("maximum", format!("{}{left}", notation.extremum("max", &names))),
            Statistic::Argmax { .. } => ("argmax", format!("{}{left}", notation.extremum("argmax", &names))),
            Statistic::Best(_)
            | Statistic::Draw(_)
            | Statistic::Expectation
            | Statistic::Variance
            | Statistic::Quantile(_)
            | Statistic::Interval(_)
            | Statistic::Information => parts::read_out(ask, &names, &left, notation)?,
            Statistic::Divergence { .. } => return None,
        };
        Some((rule.to_owned(), "the statistic of the distribution".to_owned(), equation))
    }
}

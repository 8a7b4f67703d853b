//! Programs, for Rust users: opened, configured, asked.
//!
//! In: a file, a text or a [`Model`]. Out: a [`Program`], whose questions are answered by a [`Posterior`]. Invariant: a
//! program is immutable: setting a value returns a new one; every error states the found value, the expected one, and
//! where.

mod batch;
mod evidence;
mod expanded;
mod filter;
mod groups;
mod learned;
mod lookup;
mod marginals;
mod mode;
mod numbers;
mod posterior;
mod question;
mod rows;
pub mod settings;
mod source;
mod value;

pub use batch::{Batch, Cases};
pub use evidence::Evidence;
pub use filter::Filter;
pub use groups::Observation;
pub use learned::{Learned, Learning};
pub use posterior::Posterior;
pub use question::Question;
pub use rows::Rows;
pub use value::Value;

use crate::answer::link;
use crate::data::PlateData;
use crate::error::Error;
use crate::exec::Inputs;
use crate::guess::listed;
use crate::io::{self, Network};
use crate::model::{Known, Model};
use crate::plan::{Options, Strategy};
use crate::sample::Sampling;
use crate::source::Source;
use crate::syntax::{compile, parse_question};
use expanded::observed;
use settings::{Meaning, Settings, meaning, names};
use std::path::Path;
use std::sync::{Arc, OnceLock};

/// A Bayesian Program, or a network of another tool, with its settings.
///
/// ```
/// use bp_core::prelude::*;
/// # fn main() -> Result<(), bp_core::Error> {
/// let coin = Program::parse(
///     "program Coin {
///          parameters { bias : probability = 0.5; }
///          variables { Heads : bool; }
///          decomposition { P(Heads) }
///          forms { P(Heads) = bernoulli(bias); }
///      }",
/// )?;
/// assert_eq!(coin.ask("P(Heads)")?.p(true)?, 0.5);
/// assert_eq!(coin.with("bias", 0.25)?.ask("P(Heads)")?.p(true)?, 0.25);
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug)]
pub struct Program {
    opened: Arc<Opened>,
    /// The settings, including sizes derived from the numbers of parameters.
    given: Arc<Settings>,
    settings: Arc<Settings>,
    /// The settings in the form of kernels, computed when a filter first needs them.
    inputs: OnceLock<Arc<Inputs<'static, f64>>>,
    sampling: Sampling,
    /// How questions are planned.
    options: Options,
}

/// The parts that do not depend on settings.
#[derive(Clone, Debug)]
struct Opened {
    model: Model,
    /// Its text, if it has one.
    source: Option<Source>,
    /// Evidence that always holds: the potentials of a Markov network.
    known: Vec<Known>,
    ln_scale: f64,
    warnings: Vec<String>,
    /// The data of its tables of rows.
    rows: Arc<PlateData>,
}

impl Program {
    /// Opens a program (`.bp`) or a network (BIF, XMLBIF, UAI, Hugin NET), by its extension; `-` is standard input.
    ///
    /// # Errors
    /// A file that cannot be read; every mistake of the program, under its lines.
    pub fn open(path: impl AsRef<Path>) -> Result<Self, Error> {
        let io::Opened { network, source, warnings } = io::open(path.as_ref())?;
        let Network { model, known, ln_scale, .. } = network;
        Self::made(Opened { source: Some(source), known, ln_scale, warnings, ..Opened::from(model) })
    }

    /// The program of a network that has been read.
    ///
    /// # Errors
    /// A subroutine that cannot be answered.
    pub fn of_network(network: Network) -> Result<Self, Error> {
        let Network { model, known, ln_scale, .. } = network;
        Self::made(Opened { known, ln_scale, ..Opened::from(model) })
    }

    /// Reads a program from its text. Of several programs the last one is asked.
    ///
    /// # Errors
    /// Every mistake of the program, under its lines.
    pub fn parse(text: &str) -> Result<Self, Error> {
        let source = Source::new("program", text);
        let model = compile(&source).map_err(|wrong| Error::program(&source, wrong))?;
        Self::made(Opened { source: Some(source), ..Opened::from(model) })
    }

    /// The program with the answers of its subroutines.
    fn made(mut opened: Opened) -> Result<Self, Error> {
        if opened.model.subroutines.iter().any(|subroutine| subroutine.table.is_empty()) {
            opened.model = link(&opened.model)?.into_owned();
        }
        Ok(Self::of(opened))
    }

    fn of(opened: Opened) -> Self {
        let settings = Settings::new(&opened.model);
        Self::with_settings(Arc::new(opened), settings, (Sampling::default(), Options::default()))
    }

    fn with_settings(opened: Arc<Opened>, given: Settings, (sampling, options): (Sampling, Options)) -> Self {
        let settings = Arc::new(given.clone().with_inferred_sizes(&opened.model));
        Self { opened, given: Arc::new(given), settings, inputs: OnceLock::new(), sampling, options }
    }

    /// The program with a value for a parameter (a number, or a list of them), or a size for a set. A grid takes its
    /// extents, `[4, 3, 8]`.
    ///
    /// # Errors
    /// The program has no parameter and no set of this name; a value outside its range.
    pub fn with(self, name: &str, value: impl Into<Value>) -> Result<Self, Error> {
        let meaning = meaning(name, &names(&self.opened.model))?;
        self.set(name, &value.into(), meaning)
    }

    /// The program with these settings, in place of those it has.
    #[must_use]
    pub fn with_all(self, settings: Settings) -> Self {
        Self::with_settings(self.opened, settings, (self.sampling, self.options))
    }

    fn set(self, name: &str, value: &Value, meaning: Meaning) -> Result<Self, Error> {
        let mut given = Arc::unwrap_or_clone(self.given);
        given.set(&self.opened.model, name, value, meaning)?;
        Ok(Self::with_settings(self.opened, given, (self.sampling, self.options)))
    }

    /// The program with this number of draws for estimates.
    #[must_use]
    pub fn draws(mut self, count: usize) -> Self {
        self.sampling.particles = count.max(1);
        self
    }

    /// The program with this random seed: the same seed gives the same answer.
    #[must_use]
    pub fn seed(mut self, seed: u64) -> Self {
        self.sampling.seed = seed;
        self
    }

    /// The program with a selected strategy, by the name that `--by` takes: `sums`, `join_tree`, `gaussian`, `chain`,
    /// `weighting`, `gibbs` or `particles`. By default the planner chooses.
    ///
    /// # Errors
    /// There is no such strategy. A strategy that cannot answer a question is refused when it is asked.
    pub fn by(mut self, strategy: &str) -> Result<Self, Error> {
        let named = Strategy::of_name(strategy).ok_or_else(|| {
            let names = listed(Strategy::ALL.map(Strategy::name), "and");
            Error::input("by", format!("there is no strategy `{strategy}`; there are {names}"))
        })?;
        self.options.by = Some(named);
        Ok(self)
    }

    /// The program with all options of the planner, for the stages of the compiler.
    #[must_use]
    pub fn planned(mut self, options: Options) -> Self {
        self.options = options;
        self
    }

    /// The program with a budget: an exact answer of more products is estimated instead, where it can be. By default an
    /// exact answer is never replaced by an estimate.
    #[must_use]
    pub fn budget(mut self, products: u64) -> Self {
        self.options.budget = Some(products);
        self
    }

    /// The name of the program.
    pub fn name(&self) -> &str {
        &self.opened.model.name
    }

    /// Its text, as it was read or learned; `None` of a model without text.
    pub fn text(&self) -> Option<&str> {
        Some(&self.opened.source.as_ref()?.text)
    }

    /// The names of its variables.
    pub fn variables(&self) -> Vec<String> {
        let model = &self.opened.model;
        model.variables.ids().map(|id| model.variable_name(id)).collect()
    }

    /// The names of the questions that it declares.
    pub fn questions(&self) -> Vec<&str> {
        self.opened.model.questions.values().map(|question| question.name.as_str()).collect()
    }

    /// The corrections made when a network was opened, one line each.
    pub fn warnings(&self) -> &[String] {
        &self.opened.warnings
    }

    /// The model, for the stages of the compiler.
    pub fn model(&self) -> &Model {
        &self.opened.model
    }

    /// Asks a question, or one that the program declares, by its name.
    ///
    /// # Errors
    /// A wrong question, under its words; one that has no answer; evidence of probability zero; several answers
    /// ([`Program::ask_all`]).
    pub fn ask(&self, question: &str) -> Result<Posterior, Error> {
        self.question(question)?.ask()
    }

    /// Asks a question with several answers: `P(Rain); entropy P(Rain)`.
    ///
    /// # Errors
    /// As [`Program::ask`].
    pub fn ask_all(&self, question: &str) -> Result<Vec<Posterior>, Error> {
        self.question(question)?.ask_all()
    }

    /// Compiles a question for repeated use.
    ///
    /// # Errors
    /// A wrong question, under its words; one that has no answer.
    pub fn question(&self, question: &str) -> Result<Question, Error> {
        Question::new(self, self.asked(question)?)
    }

    /// A filter: the posterior at each instant, given the observations up to it. `question` is `P(Open | Seen)`;
    /// `filter` before it is optional.
    ///
    /// # Errors
    /// As [`Program::question`]; the program has no variable `X^-1`.
    pub fn filter(&self, question: &str) -> Result<Filter<'_>, Error> {
        Filter::new(self, self.asked(question)?)
    }

    /// The posterior of each variable, given some evidence.
    ///
    /// # Errors
    /// An unknown name, a value outside the variable's domain; evidence of probability zero.
    pub fn marginals(&self, evidence: &Evidence) -> Result<Posterior, Error> {
        marginals::marginals(self, &[], &observed(self.model(), evidence))
    }

    /// The posterior of each of some variables, or of elements of families (`Z[2]`), given some evidence.
    ///
    /// # Errors
    /// As [`Program::marginals`].
    pub fn marginals_of(&self, names: &[String], evidence: &Evidence) -> Result<Posterior, Error> {
        marginals::marginals(self, names, &observed(self.model(), evidence))
    }

    /// The joint posterior of some variables, or of elements of families (`Z[2]`), given some evidence.
    ///
    /// # Errors
    /// As [`Program::marginals`]; a name that stands twice, or is observed.
    pub fn joint(&self, names: &[String], evidence: &Evidence) -> Result<Posterior, Error> {
        groups::joint(self, names, &observed(self.model(), evidence))
    }

    /// The most probable value of all variables together, given some evidence: one row, whose number is ln of the joint
    /// probability, or density, of these values and the evidence.
    ///
    /// # Errors
    /// As [`Program::marginals`].
    pub fn most_probable(&self, evidence: &Evidence) -> Result<Posterior, Error> {
        groups::most_probable(self, &observed(self.model(), evidence))
    }

    /// The entropy in nats of some targets together, given some evidence, and the information that the observation of
    /// each of some other variables (of all, if none is named) gives about the targets, the most informative first.
    ///
    /// # Errors
    /// As [`Program::joint`].
    pub fn observations(
        &self,
        about: &[String],
        among: &[String],
        evidence: &Evidence,
    ) -> Result<(f64, Vec<Observation>), Error> {
        groups::observations(self, (about, among), &observed(self.model(), evidence))
    }

    /// Learns the `unknown` forms of the program, and the parameters that `identification` names, from a table of cases
    /// (CSV): `learn("lawns.csv")`, `learn(Learning::from("mails.csv").hidden("Kind"))`.
    ///
    /// # Errors
    /// A table that cannot be read or does not fit, with file, row and column; a program without anything to learn.
    pub fn learn(&self, data: impl Into<Learning>) -> Result<Learned, Error> {
        learned::learn(self, &data.into())
    }

    /// A question as typed, with the evidence that always holds.
    fn asked(&self, text: &str) -> Result<crate::model::Question, Error> {
        let source = Source::new("question", text);
        let asked = parse_question(&source, &self.opened.model);
        let mut asked = asked.map_err(|wrong| Error::program(&source, wrong))?;
        asked.asks.iter_mut().for_each(|ask| ask.known.extend_from_slice(&self.opened.known));
        self.opened.rows.known_in(&self.opened.model, &asked)
    }

    /// The program with a question's derived variables, and that question.
    fn posed(&self, asked: crate::model::Question) -> (Self, crate::model::Question) {
        if asked.derived.is_empty() {
            return (self.clone(), asked);
        }
        let mut opened = (*self.opened).clone();
        let asked = opened.model.pose(&asked);
        (Self { opened: Arc::new(opened), ..self.clone() }, asked)
    }

    /// The settings, for the lifetime of the program.
    fn inputs(&self) -> &Inputs<'_, f64> {
        self.inputs.get_or_init(|| Arc::new(self.settings.inputs().into_owned()))
    }
}

impl From<Model> for Opened {
    fn from(model: Model) -> Self {
        Opened {
            model,
            source: None,
            known: Vec::new(),
            ln_scale: 0.0,
            warnings: Vec::new(),
            rows: Arc::default(),
        }
    }
}

/// The program of a model, such as one of [`ModelBuilder`](crate::model::ModelBuilder).
impl From<Model> for Program {
    fn from(model: Model) -> Self {
        Self::of(Opened::from(model))
    }
}

/// The program of a text.
impl std::str::FromStr for Program {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self, Error> {
        Self::parse(text)
    }
}

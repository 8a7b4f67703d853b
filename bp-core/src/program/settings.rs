//! Settings of a program and its questions, by name: `with("rate", 0.2)`, `--set rate=0.2`.
//!
//! In: names and values, a model and its questions. Out: [`Inputs`]. Invariant: every name is known to the model or a
//! question, and every value is in its domain; both are checked here, where the names are available.

mod fields;
mod typed;
mod values;

use super::Value;
use crate::answer::CompiledQuestion;
use crate::error::Error;
use crate::exec::Inputs;
use crate::guess::{listed, near};
use crate::ids::{ParameterId, SetId, VariableId};
use crate::kernel::{InputKey, Role};
use crate::model::{
    self, Finding, Form, IndexSpace, Model, Parameter, ParameterKind, Question, SetKind, Statistic,
};
use crate::space::{Edge, Moves, Space};
use crate::spelling::number as written;
use std::collections::BTreeMap;
use typed::{displacement, numbers, one_size, shaped, size, words};

/// The meaning of a settable name.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Meaning {
    /// A parameter.
    Parameter(ParameterId),
    /// The size of a set.
    Set(SetId),
    /// The value of a variable.
    Value(VariableId),
    /// Numbers whose count only the kernel knows.
    Field,
}

/// The parameters and the sets of a model, by name.
pub fn names(model: &Model) -> BTreeMap<String, Meaning> {
    let sets = model.sets.iter().map(|(id, set)| (set.name.clone(), Meaning::Set(id)));
    let parameters = model.parameters.iter().map(|(id, it)| (it.name.clone(), Meaning::Parameter(id)));
    sets.chain(parameters).collect()
}

/// Every name that can be set for these questions, and its meaning.
///
/// # Errors
/// A name means values of different domains.
pub fn names_of<'q, 'm: 'q>(
    model: &Model,
    questions: impl IntoIterator<Item = &'q CompiledQuestion<'m>>,
) -> Result<BTreeMap<String, Meaning>, Error> {
    let mut all = BTreeMap::new();
    for question in questions {
        for kernel in question.kernels() {
            // The grid determines whether it is periodic.
            let is_own =
                |role: &Role| matches!(role, Role::Input { key, .. } if !matches!(key, InputKey::Wraps(_)));
            let own = kernel.buffers.values().filter(|buffer| is_own(&buffer.role));
            all.extend(own.map(|buffer| (buffer.name.clone(), Meaning::Field)));
        }
        for (name, meaning) in values_of(model, question.question())? {
            let before = all.insert(name.clone(), meaning);
            same_domain(model, &name, (before, meaning))?;
        }
    }
    all.extend(names(model));
    Ok(all)
}

/// The names of the values that a question leaves open, and their meanings.
///
/// # Errors
/// A name means values of different domains.
pub fn values_of(model: &Model, question: &Question) -> Result<BTreeMap<String, Meaning>, Error> {
    let mut all = BTreeMap::new();
    for ask in &question.asks {
        let searched = ask.searched.iter().filter_map(|item| Some((item.variable, item.at.clone()?)));
        let known = ask.known.iter().chain(ask.statistic.from()).filter_map(|known| match &known.evidence {
            Finding::Hard(value) => Some((known.variable, value.clone())),
            Finding::Each => given_when_asked(model, known.variable),
            Finding::Virtual(_) | Finding::Soft(_) => None,
        });
        for (variable, value) in searched.chain(known) {
            let model::Value::Given(name) = value else { continue };
            let meaning = Meaning::Value(variable);
            let before = all.insert(name.clone(), meaning);
            same_domain(model, &name, (before, meaning))?;
        }
        if let Statistic::Argmax { nearest: Some(field) } = &ask.statistic {
            all.insert(field.clone(), Meaning::Field);
        }
    }
    Ok(all)
}

/// Refuses a name of values of different domains.
fn same_domain(model: &Model, name: &str, meanings: (Option<Meaning>, Meaning)) -> Result<(), Error> {
    let (Some(Meaning::Value(other)), Meaning::Value(variable)) = meanings else { return Ok(()) };
    if model.variables[other].domain == model.variables[variable].domain {
        return Ok(());
    }
    let (one, other) = (model.variable_name(variable), model.variable_name(other));
    let message = format!("it names values of both `{other}` and `{one}`, which have different domains");
    Err(Error::input(name, message))
}

/// Known variables without a table are given under their own names, except those whose form asks another program: they
/// are given through that program's answers.
fn given_when_asked(model: &Model, variable: VariableId) -> Option<(VariableId, model::Value)> {
    let form = model.factor_of(variable).map(|factor| &model.factors[factor].form);
    let asks = matches!(form, Some(Form::Ask { .. }));
    let given = !asks && !model.variables[variable].domain.is_finite();
    given.then(|| (variable, model::Value::Given(model.variable_name(variable))))
}

/// The meaning of a name.
///
/// # Errors
/// The name is unknown; the error lists the known names.
pub fn meaning(name: &str, names: &BTreeMap<String, Meaning>) -> Result<Meaning, Error> {
    names.get(name).copied().ok_or_else(|| {
        let known = names.keys().map(String::as_str);
        let known = match (near(name, known.clone()), names.is_empty()) {
            (Some(near), _) => format!("did you mean `{near}`?"),
            (None, true) => "nothing can be set".to_owned(),
            (None, false) => format!("what can be set here is {}", listed(known, "and")),
        };
        Error::input(name, format!("neither the program nor the question knows this name; {known}"))
    })
}

/// The settings in the form of kernels.
#[derive(Clone, Debug, Default)]
pub struct Settings {
    pub(super) sizes: BTreeMap<String, usize>,
    pub(super) arrays: BTreeMap<String, Vec<f64>>,
    grids: Vec<(String, Space)>,
    moves: Vec<(String, Moves)>,
}

impl Settings {
    /// The default sizes of a model.
    pub fn new(model: &Model) -> Self {
        let mut settings = Settings::default();
        for parameter in model.parameters.values() {
            if let (ParameterKind::Size, Some(default)) = (parameter.kind, parameter.default_number()) {
                settings.sizes.insert(parameter.name.clone(), default as usize);
            }
        }
        settings
    }

    /// The settings of a learned program: sizes, including those taken from the data. Its parameters have their
    /// numbers.
    pub(super) fn learned(&self, model: &Model, given: &Inputs<'_, f64>) -> Self {
        let mut settings = self.clone();
        settings.arrays.retain(|name, _| model.parameters.values().all(|parameter| parameter.name != *name));
        let names = model.sets.values().map(|set| &set.name);
        let sized = names.filter_map(|name| Some((name.clone(), given.find_size(name)?)));
        settings.sizes.extend(sized);
        settings
    }

    /// Parses `name=value`.
    ///
    /// # Errors
    /// An unknown name, or one that is set twice; a value outside its range.
    pub fn read(model: &Model, typed: &[String], names: &BTreeMap<String, Meaning>) -> Result<Self, Error> {
        let mut settings = Settings::new(model);
        let mut parts: Vec<(&str, &str, Meaning)> = Vec::new();
        for text in typed {
            let (name, value, meaning) = split(model, text, names)?;
            if parts.iter().any(|(before, ..)| *before == name) {
                return Err(Error::input(name, "it is set twice"));
            }
            parts.push((name, value, meaning));
        }
        // Values of variables may depend on sizes, and displacements on grids: sizes and grids are set first.
        let rank = |meaning: Meaning| match meaning {
            Meaning::Parameter(id) if model.parameters[id].kind == ParameterKind::Size => 0,
            Meaning::Parameter(_) => 3,
            Meaning::Set(set) => 1 + usize::from(matches!(model.sets[set].kind, SetKind::Displacements(_))),
            Meaning::Value(_) | Meaning::Field => 3,
        };
        parts.sort_by_key(|(_, _, meaning)| rank(*meaning));
        for (name, value, meaning) in parts {
            settings.set(model, name, &Value::from(value), meaning)?;
        }
        Ok(settings)
    }

    /// With the sizes of sets that were not set, inferred from the lengths of fields, given or written: 3 from
    /// `mu[Grid] = [1, 2, 3]`.
    pub fn with_inferred_sizes(mut self, model: &Model) -> Self {
        let fields = || model.parameters.values();
        let by_fields = |it: &Self| fields().find_map(|field| it.size_by_field(model, field));
        while let Some((name, size)) = by_fields(&self).or_else(|| self.size_by_indices(model)) {
            self.sizes.insert(name, size);
        }
        self
    }

    /// The size of the only set of a field whose size is not known.
    fn size_by_field(&self, model: &Model, field: &Parameter) -> Option<(String, usize)> {
        let (mut open, mut known) = (None, 1);
        for over in &field.over {
            match over {
                IndexSpace::Range(range) => {
                    let high = range
                        .high
                        .size
                        .map_or(Some(0), |size| self.sizes.get(&model.parameters[size].name).copied());
                    known *= usize::try_from(high? as i64 + range.high.offset - range.low + 1).ok()?;
                }
                IndexSpace::Set(set) => {
                    let (name, kind) = (&model.sets[*set].name, &model.sets[*set].kind);
                    let plain = !matches!(kind, SetKind::Displacements(_));
                    if let Some(size) = self.sizes.get(name) {
                        known *= size;
                    } else if open.is_some() || !plain || self.grids.iter().any(|(grid, _)| grid == name) {
                        return None;
                    } else {
                        open = Some(name);
                    }
                }
            }
        }
        let given = self.arrays.get(&field.name);
        let (name, count) = (open?, given.map_or(field.default.len(), Vec::len));
        // A single number may be one for all elements, so it implies no size.
        (known > 0 && count > 1 && count % known == 0).then(|| (name.clone(), count / known))
    }

    /// The size implied by the values given for a family, where it is not known.
    pub(super) fn size_by_values(
        &self,
        model: &Model,
        of: VariableId,
        count: usize,
    ) -> Option<(String, usize)> {
        let (name, size) = match model.variables[of].family?.over {
            IndexSpace::Set(set) if model.sets[set].kind == SetKind::Plain => (&model.sets[set].name, count),
            IndexSpace::Set(_) => return None,
            IndexSpace::Range(range) => {
                let size = count as i64 + range.low - 1 - range.high.offset;
                (&model.parameters[range.high.size?].name, usize::try_from(size).ok()?)
            }
        };
        // A single value may be one for all elements, so it implies no size.
        (count > 1 && size > 0 && !self.sizes.contains_key(name)).then(|| (name.clone(), size))
    }

    /// Sets the value of a name. A text is parsed: several values are separated by commas.
    ///
    /// # Errors
    /// A value outside its range; displacements on a grid that was not given.
    pub fn set(&mut self, model: &Model, name: &str, value: &Value, meaning: Meaning) -> Result<(), Error> {
        match meaning {
            Meaning::Parameter(id) => {
                let kind = model.parameters[id].kind;
                let (shape, values) = shaped(name, value)?;
                let refused = values.iter().find_map(|value| Some((*value, kind.refuses(*value)?)));
                if let Some((value, expected)) = refused {
                    let message = format!("it is {}, but it must be {expected}", written(value));
                    return Err(Error::input(name, message));
                }
                if kind == ParameterKind::Size {
                    self.sizes.insert(name.to_owned(), one_size(name, value)?);
                }
                let values = self.in_order(model, id, (&shape, values))?;
                self.arrays.insert(name.to_owned(), values);
            }
            Meaning::Set(id) => match model.sets[id].kind {
                SetKind::Plain => {
                    self.sizes.insert(name.to_owned(), one_size(name, value)?);
                }
                SetKind::Grid => {
                    let mut extents = [1; 3];
                    let given: Vec<usize> =
                        words(value).iter().map(|word| size(name, word)).collect::<Result<_, _>>()?;
                    let axes = extents.get_mut(..given.len());
                    axes.ok_or_else(|| Error::input(name, "a grid has three axes at most"))?
                        .copy_from_slice(&given);
                    let space = Space::new(extents, [Edge::Open; 3]);
                    let space = space.map_err(|why| Error::input(name, why.to_string()))?;
                    self.grids.retain(|(known, _)| known != name);
                    self.grids.push((name.to_owned(), space));
                }
                SetKind::Displacements(grid) => {
                    let grid_name = &model.sets[grid].name;
                    let grid = self.grids.iter().find(|(known, _)| known == grid_name);
                    let (_, space) = grid.ok_or_else(|| Error::input(grid_name, "it was not given"))?;
                    let displacements: Vec<[i32; 3]> =
                        words(value).iter().map(|word| displacement(name, word)).collect::<Result<_, _>>()?;
                    let moves = space.antecedents(&displacements);
                    self.moves.retain(|(known, _)| known != name);
                    self.moves.push((name.to_owned(), moves));
                }
            },
            Meaning::Value(variable) => {
                let values = self.values(model, variable, name, value)?;
                self.sizes.extend(self.size_by_values(model, variable, values.len()));
                self.arrays.insert(name.to_owned(), values);
            }
            Meaning::Field => {
                self.arrays.insert(name.to_owned(), numbers(name, value)?);
            }
        }
        Ok(())
    }

    /// Whether a name is set.
    pub fn has(&self, name: &str) -> bool {
        self.arrays.contains_key(name)
    }

    /// A size that was set, or has a default.
    pub fn size(&self, name: &str) -> Option<usize> {
        self.sizes.get(name).copied()
    }

    /// The inputs of a kernel.
    pub fn inputs(&self) -> Inputs<'_, f64> {
        let mut inputs = Inputs::new();
        for (name, size) in &self.sizes {
            inputs = inputs.size(name, *size).number(name, *size as f64);
        }
        for (name, values) in &self.arrays {
            inputs = inputs.array(name, values);
        }
        for (name, space) in &self.grids {
            inputs = inputs.grid(name, space);
        }
        for (name, moves) in &self.moves {
            inputs = inputs.displacements(name, moves);
        }
        inputs
    }
}

/// Name and value: the longest known name before an `=`, since names such as `map.P(O = true | C)` contain some.
fn split<'t>(
    model: &Model,
    text: &'t str,
    names: &BTreeMap<String, Meaning>,
) -> Result<(&'t str, &'t str, Meaning), Error> {
    let places = text.match_indices('=').rev();
    let known = places.map(|(at, _)| (text[..at].trim(), text[at + 1..].trim()));
    let found = known.into_iter().find_map(|(name, value)| Some((name, value, *names.get(name)?)));
    found.ok_or_else(|| {
        let name = text.split('=').next().unwrap_or(text).trim();
        if let Some((whole, _)) = name.split_once('[').filter(|(whole, _)| model.variable(whole).is_some()) {
            let message = format!(
                "elements are set together: `{whole}=[…, …]`; or the question names those that are known: `P(… | {name} = …)`"
            );
            return Error::input(name, message);
        }
        if model.variable(name).is_some() && !names.contains_key(name) {
            let message = format!(
                "a variable is set where a question leaves its value open: write `P(… | {name} = value)`, and set `value`; \
                 or write the value in the question"
            );
            return Error::input(name, message);
        }
        meaning(name, names).err().unwrap_or_else(|| Error::input(name, "it has no value"))
    })
}

//! `--set name=value`: what is given when a question is asked.
//!
//! In: settings as typed, a model and its questions. Out: [`Inputs`]. Invariant: every name is one that the model or a
//! question knows, every value is one that its domain has; both are checked here, where the words are still known.

use crate::failure::Failure;
use bp_core::data::Values;
use bp_core::error::Error;
use bp_core::exec::Inputs;
use bp_core::ids::{ParameterId, SetId, VariableId};
use bp_core::model::{IndexSpace, Model, Parameter, ParameterKind, SetKind};
use bp_core::space::{Edge, Moves, Space};
use bp_core::spelling::number as written;
use std::collections::BTreeMap;

/// What a name that can be set stands for.
#[derive(Clone, Copy, PartialEq)]
pub(crate) enum Meaning {
    Parameter(ParameterId),
    Set(SetId),
    /// The value of a variable.
    Value(VariableId),
    /// Numbers of which only the kernel knows how many.
    Field,
}

/// What was set, ready to be given to a kernel.
#[derive(Default)]
pub(crate) struct Settings {
    sizes: BTreeMap<String, usize>,
    arrays: BTreeMap<String, Vec<f64>>,
    grids: Vec<(String, Space)>,
    moves: Vec<(String, Moves)>,
}

impl Settings {
    /// Reads what was typed.
    pub(crate) fn read(
        model: &Model,
        typed: &[String],
        names: &BTreeMap<String, Meaning>,
    ) -> Result<Self, Failure> {
        let mut settings = Settings::default();
        let mut parts: Vec<(&str, &str, Meaning)> = Vec::new();
        for text in typed {
            let (name, value, meaning) = split(text, names)?;
            if parts.iter().any(|(before, ..)| *before == name) {
                return Err(Error::input(name, "it is set twice").into());
            }
            parts.push((name, value, meaning));
        }
        // Values of variables may depend on sizes, and displacements on grids: those come first.
        let rank = |meaning: Meaning| match meaning {
            Meaning::Parameter(_) => 0,
            Meaning::Set(set) => 1 + usize::from(matches!(model.sets[set].kind, SetKind::Displacements(_))),
            Meaning::Value(_) | Meaning::Field => 3,
        };
        parts.sort_by_key(|(_, _, meaning)| rank(*meaning));
        for parameter in model.parameters.values() {
            if let (ParameterKind::Size, Some(default)) = (parameter.kind, parameter.default_number()) {
                settings.sizes.insert(parameter.name.clone(), default as usize);
            }
        }
        for (name, value, meaning) in parts {
            settings.set(model, name, value, meaning)?;
        }
        Ok(settings)
    }

    /// With the sizes of sets that were not set, as the numbers of parameters tell them: of `mu[Grid] = [1, 2, 3]` 3.
    pub(crate) fn with_told(mut self, model: &Model) -> Self {
        let fields = || model.parameters.values().filter(|parameter| parameter.default.len() > 1);
        while let Some((name, size)) = fields().find_map(|field| self.told_by(model, field)) {
            self.sizes.insert(name, size);
        }
        self
    }

    /// The size of the only set of a field whose size is not known.
    fn told_by(&self, model: &Model, field: &Parameter) -> Option<(String, usize)> {
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
        let (name, count) = (open?, field.default.len());
        (known > 0 && count % known == 0).then(|| (name.clone(), count / known))
    }

    fn set(&mut self, model: &Model, name: &str, text: &str, meaning: Meaning) -> Result<(), Error> {
        match meaning {
            Meaning::Parameter(id) => {
                let kind = model.parameters[id].kind;
                let values = list(text, |part| {
                    let value = number(name, part)?;
                    match kind.refuses(value) {
                        None => Ok(value),
                        Some(expected) => Err(Error::input(
                            name,
                            format!("it is {}, but it must be {expected}", written(value)),
                        )),
                    }
                })?;
                if kind == ParameterKind::Size {
                    self.sizes.insert(name.to_owned(), size(name, text)?);
                }
                self.arrays.insert(name.to_owned(), values);
            }
            Meaning::Set(id) => match model.sets[id].kind {
                SetKind::Plain => {
                    self.sizes.insert(name.to_owned(), size(name, text)?);
                }
                SetKind::Grid => {
                    let mut extents = [1; 3];
                    let given = list(text, |part| size(name, part))?;
                    let axes = extents.get_mut(..given.len());
                    axes.ok_or_else(|| Error::input(name, "a grid has three axes at most"))?
                        .copy_from_slice(&given);
                    let space = Space::new(extents, [Edge::Open; 3]);
                    self.grids
                        .push((name.to_owned(), space.map_err(|why| Error::input(name, why.to_string()))?));
                }
                SetKind::Displacements(grid) => {
                    let grid_name = &model.sets[grid].name;
                    let grid = self.grids.iter().find(|(known, _)| known == grid_name);
                    let (_, space) = grid.ok_or_else(|| Error::input(grid_name, "it was not given"))?;
                    let displacements = list(text, |part| displacement(name, part))?;
                    self.moves.push((name.to_owned(), space.antecedents(&displacements)));
                }
            },
            Meaning::Value(variable) => {
                let values = list(text, |part| self.value(model, variable, name, part))?;
                self.arrays.insert(name.to_owned(), values);
            }
            Meaning::Field => {
                self.arrays.insert(name.to_owned(), list(text, |part| number(name, part))?);
            }
        }
        Ok(())
    }

    /// Whether something was set under a name.
    pub(crate) fn has(&self, name: &str) -> bool {
        self.arrays.contains_key(name)
    }

    /// A value of a variable by its name, as the number that the host gives for it.
    fn value(&self, model: &Model, variable: VariableId, name: &str, text: &str) -> Result<f64, Error> {
        match Values::new(model, variable, &|size| self.size(size)).read(text) {
            Ok(Some(value)) => Ok(value.number),
            Ok(None) => Err(Error::input(name, format!("`{text}` is no value: leave out what is not known"))),
            Err(expected) => Err(Error::input(name, format!("`{text}` is {expected}"))),
        }
    }

    /// A size that was set, or has a default.
    pub(crate) fn size(&self, name: &str) -> Option<usize> {
        self.sizes.get(name).copied()
    }

    /// What the inputs of a kernel are.
    pub(crate) fn inputs(&self) -> Inputs<'_, f64> {
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

/// Name and value: the longest known name that an `=` follows, since names such as `map.P(O = true | C)` hold some.
fn split<'t>(
    text: &'t str,
    names: &BTreeMap<String, Meaning>,
) -> Result<(&'t str, &'t str, Meaning), Failure> {
    let places = text.match_indices('=').rev();
    let known = places.map(|(at, _)| (text[..at].trim(), text[at + 1..].trim()));
    let found = known.into_iter().find_map(|(name, value)| Some((name, value, *names.get(name)?)));
    found.ok_or_else(|| {
        let name = text.split('=').next().unwrap_or(text).trim();
        let listed: Vec<_> = names.keys().map(|name| format!("`{name}`")).collect();
        let known = match listed.is_empty() {
            true => "nothing can be set".to_owned(),
            false => format!("what can be set here is {}", listed.join(", ")),
        };
        Error::input(name, format!("neither the program nor the question knows this name; {known}")).into()
    })
}

/// What each part of a list with commas says.
fn list<T>(text: &str, read: impl Fn(&str) -> Result<T, Error>) -> Result<Vec<T>, Error> {
    text.split(',').map(|part| read(part.trim())).collect()
}

fn number(name: &str, text: &str) -> Result<f64, Error> {
    let finite = text.parse().ok().filter(|number: &f64| number.is_finite());
    // −0 is 0.
    let finite = finite.map(|number| number + 0.0);
    finite.ok_or_else(|| Error::input(name, format!("`{text}` is not a finite number")))
}

fn size(name: &str, text: &str) -> Result<usize, Error> {
    let size = text.parse().ok().filter(|size| (1..=1 << 40).contains(size));
    size.ok_or_else(|| {
        Error::input(name, format!("`{text}` is not a number of elements, which is 1 or more"))
    })
}

/// A displacement: `-1`, or `0:1:-2` along the three axes of the grid.
fn displacement(name: &str, text: &str) -> Result<[i32; 3], Error> {
    let wrong = || Error::input(name, format!("`{text}` is not a displacement, such as `-1` or `0:1:-2`"));
    let parts: Vec<i32> =
        text.split(':').map(|part| part.parse().map_err(|_| wrong())).collect::<Result<_, _>>()?;
    let mut displacement = [0; 3];
    displacement.get_mut(..parts.len()).ok_or_else(wrong)?.copy_from_slice(&parts);
    Ok(displacement)
}

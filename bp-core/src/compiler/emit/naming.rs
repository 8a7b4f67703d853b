//! Names of the fields of inputs.
//!
//! In: sizes and inputs, by their keys. Out: names. Invariant: kernels that are used together, as those of the instants of a
//! filter, share one [`Naming`], so that an input has one name in all of them.

use super::door::METHODS;
use super::interface::SizeOf;
use super::names::{Names, snake};
use crate::kernel::InputKey;

/// The names of inputs, which are the same in the kernels of all instants.
pub(super) struct Naming {
    names: Names,
    sizes: Vec<(SizeOf, String)>,
    inputs: Vec<(InputKey, String)>,
}

impl Naming {
    pub(super) fn new() -> Self {
        let mut names = Names::default();
        METHODS.iter().for_each(|method| drop(names.unique(method)));
        Self { names, sizes: Vec::new(), inputs: Vec::new() }
    }

    /// A name that is no input's.
    pub(super) fn unique(&mut self, wanted: &str) -> String {
        self.names.unique(wanted)
    }

    pub(super) fn size(&mut self, of: SizeOf, wanted: &str) -> String {
        if let Some((_, name)) = self.sizes.iter().find(|(known, _)| *known == of) {
            return name.clone();
        }
        let name = self.names.unique(wanted);
        self.sizes.push((of, name.clone()));
        name
    }

    pub(super) fn input(&mut self, key: &InputKey, wanted: &str) -> String {
        if let Some((_, name)) = self.inputs.iter().find(|(known, _)| known == key) {
            return name.clone();
        }
        let name = self.names.unique(wanted);
        self.inputs.push((key.clone(), name.clone()));
        name
    }
}

/// The field of an input: its name without the fixed values of a question in it.
pub(super) fn input_name(name: &str) -> String {
    let mut plain = String::new();
    let mut parts = name.split(" = ");
    plain.push_str(parts.next().unwrap_or_default());
    for part in parts {
        // The value ends where the next name begins.
        plain.push_str(part.find([' ', ',', '|', ')']).map_or("", |end| &part[end..]));
    }
    snake(&plain)
}

#[cfg(test)]
mod tests {
    use super::input_name;

    #[test]
    fn inputs_are_named_without_the_values_that_are_fixed() {
        let cases = [
            ("map.P(O | C)", "map_p_o_c"),
            ("map.P(O = true | C)", "map_p_o_c"),
            ("map.P(O = true, V | C = 3)", "map_p_o_v_c"),
            ("previous V", "previous_v"),
            ("m²", "m2"),
        ];
        for (name, field) in cases {
            assert_eq!(input_name(name), field, "{name}");
        }
    }
}

//! Fields of numbers: their shapes, and the order in which they are read.
//!
//! In: numbers as a parameter is declared. Out: the same in the order of the inputs. Invariant: a list of rows has the shape of the
//! parameter, as far as its sizes are known.

use super::Settings;
use crate::error::Error;
use crate::ids::ParameterId;
use crate::model::{IndexSpace, Model, Parameter, SetKind};
use crate::radix;

impl Settings {
    /// The numbers of a parameter, given as declared, in the order in which they are read.
    ///
    /// # Errors
    /// Rows of another shape than that of the parameter; sizes that are needed and were not given.
    pub(super) fn in_order(
        &self,
        model: &Model,
        id: ParameterId,
        (shape, values): (&[usize], Vec<f64>),
    ) -> Result<Vec<f64>, Error> {
        let Parameter { name, over, .. } = &model.parameters[id];
        let is_grid = |over: &IndexSpace| matches!(over, IndexSpace::Set(set) if model.sets[*set].kind != SetKind::Plain);
        let known: Vec<Option<usize>> = over.iter().map(|over| self.length(model, over)).collect();
        let fits = |(own, known): (&usize, &Option<usize>)| known.is_none_or(|known| known == *own);
        let has_rows = shape.len() > 1 && !over.iter().any(is_grid);
        if has_rows && (shape.len() != over.len() || !shape.iter().zip(&known).all(fits)) {
            let by = |lengths: &mut dyn Iterator<Item = String>| lengths.collect::<Vec<_>>().join(" × ");
            let own = by(&mut shape.iter().map(usize::to_string));
            let declared =
                by(&mut known.iter().map(|known| known.map_or("any".to_owned(), |known| known.to_string())));
            return Err(Error::input(
                name,
                format!("its list is {own} numbers, but it is declared with {declared}"),
            ));
        }
        let order = model.input_order(id);
        if order.is_sorted() || values.len() < 2 {
            return Ok(values);
        }
        let product: usize = known.iter().flatten().product();
        let open = known.iter().filter(|known| known.is_none()).count();
        let extents: Vec<usize> = match shape.len() == over.len() {
            true => shape.to_vec(),
            false if open < 2 && product > 0 => {
                known.iter().map(|known| known.unwrap_or(values.len() / product)).collect()
            }
            false => return Err(Error::input(name, "its sizes must be given first, or its numbers as rows")),
        };
        if extents.iter().product::<usize>() != values.len() {
            return Ok(values);
        }
        let read = order.iter().map(|at| extents[*at]).collect::<Vec<usize>>();
        let at = |place: usize| {
            let indices = radix::in_order(place, read.iter().copied());
            let mut declared = vec![0; order.len()];
            order.iter().zip(indices).for_each(|(at, index)| declared[*at] = index);
            values[radix::position(declared.into_iter().zip(extents.iter().copied()))]
        };
        Ok((0..values.len()).map(at).collect())
    }

    /// The number of indices of a range or a set, where it is known.
    fn length(&self, model: &Model, over: &IndexSpace) -> Option<usize> {
        match over {
            IndexSpace::Set(set) => self.size(&model.sets[*set].name),
            IndexSpace::Range(range) => {
                let high = match range.high.size {
                    Some(size) => self.size(&model.parameters[size].name)? as i64,
                    None => 0,
                };
                usize::try_from(high + range.high.offset - range.low + 1).ok()
            }
        }
    }
}

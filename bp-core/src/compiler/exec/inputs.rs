//! The inputs and outputs of a kernel.
//!
//! In: sizes, numbers and arrays by name. Out: a [`Bound`] kernel: every extent known, every array of the right
//! length. Invariant: errors name the input, the found and the expected value.

use super::compiled::check_length;
use super::scalar::{Extended, Scalar};
use super::{SIZE_NOT_GIVEN, values};
use crate::error::Error;
use crate::ids::{Arena, AxisId, BufferId, Id};
use crate::kernel::{
    Buffer, Coordinate, Displacements, Extent, GridAxis, InputKey, Kernel, Numbers, OutputKey, Reduce, Role,
    SizeKey, Values,
};
use crate::memory;
use crate::radix;
use crate::space::{Moves, Space};
use std::any::Any;
use std::borrow::Cow;
use std::collections::HashMap;
use std::ops::RangeInclusive;

/// Size of the largest array that is allocated without a memory check, in cells.
pub(super) const MOST_CELLS: f64 = 1e9;

/// The inputs of the host, by name.
#[derive(Clone, Debug, Default)]
pub struct Inputs<'a, T: Clone> {
    sizes: HashMap<String, usize>,
    arrays: HashMap<String, Cow<'a, [T]>>,
    grids: HashMap<String, &'a Space>,
    displacements: HashMap<String, &'a Moves>,
}

impl<'a, T: Clone> Inputs<'a, T> {
    /// No inputs.
    pub fn new() -> Self {
        Self {
            sizes: HashMap::new(),
            arrays: HashMap::new(),
            grids: HashMap::new(),
            displacements: HashMap::new(),
        }
    }

    /// A size: the number of elements of a set, or a parameter of kind size.
    pub fn size(mut self, name: &str, count: usize) -> Self {
        self.sizes.insert(name.to_owned(), count);
        self
    }

    /// One number.
    pub fn number(mut self, name: &str, number: T) -> Self {
        self.arrays.insert(name.to_owned(), Cow::Owned(vec![number]));
        self
    }

    /// An array, its last axis contiguous.
    pub fn array(mut self, name: &str, values: &'a [T]) -> Self {
        self.arrays.insert(name.to_owned(), Cow::Borrowed(values));
        self
    }

    /// An array, borrowed or owned.
    pub fn numbers(mut self, name: &str, values: Cow<'a, [T]>) -> Self {
        self.arrays.insert(name.to_owned(), values);
        self
    }

    /// A function of integers, for a field that ranges over them: the element of `f[0..=10, 1..=6]` at each index is
    /// `value(&[a, b])`. So a program uses a Rust function: `dirac(f[A, B])`.
    pub fn function<const N: usize>(
        mut self,
        name: &str,
        over: [RangeInclusive<i64>; N],
        value: impl Fn(&[i64; N]) -> T,
    ) -> Self {
        let mut values = Vec::new();
        let mut at: [i64; N] = std::array::from_fn(|axis| *over[axis].start());
        // An odometer, the last index fastest; an empty range has no elements.
        while over.iter().zip(&at).all(|(range, place)| range.contains(place)) {
            values.push(value(&at));
            let Some(turned) = (0..N).rev().find(|axis| at[*axis] < *over[*axis].end()) else { break };
            at[turned] += 1;
            (turned + 1..N).for_each(|axis| at[axis] = *over[axis].start());
        }
        self.arrays.insert(name.to_owned(), Cow::Owned(values));
        self
    }

    /// The extents of a grid, and whether its lanes are periodic.
    pub fn grid(mut self, name: &str, space: &'a Space) -> Self {
        for (axis, extent) in GridAxis::ALL.iter().zip(space.extents()) {
            self.sizes.insert(format!("{name}.{}", axis.name()), extent);
        }
        self.grids.insert(name.to_owned(), space);
        self
    }

    /// The displacements of a set, on the grid that it belongs to.
    pub fn displacements(mut self, name: &str, moves: &'a Moves) -> Self {
        self.sizes.insert(name.to_owned(), moves.displacements);
        self.displacements.insert(name.to_owned(), moves);
        self
    }

    /// An owned copy of sizes and numbers, without the positions of grids, which only kernels read.
    pub fn into_owned(self) -> Inputs<'static, T> {
        let owned = |(name, values): (String, Cow<'_, [T]>)| (name, Cow::Owned(values.into_owned()));
        Inputs { sizes: self.sizes, arrays: self.arrays.into_iter().map(owned).collect(), ..Inputs::new() }
    }

    /// The input of a name.
    pub fn find(&self, name: &str) -> Option<&[T]> {
        self.arrays.get(name).map(|values| values.as_ref())
    }

    /// The size of a name.
    pub fn find_size(&self, name: &str) -> Option<usize> {
        self.sizes.get(name).copied()
    }

    /// The same, for numbers with unbounded exponents.
    pub(crate) fn extended(&self) -> Inputs<'_, Extended>
    where
        T: Scalar,
    {
        let extended =
            |values: &Cow<'_, [T]>| values.iter().map(|x| Extended::from_f64(x.to_f64())).collect();
        Inputs {
            sizes: self.sizes.clone(),
            arrays: self.arrays.iter().map(|(name, values)| (name.clone(), extended(values))).collect(),
            grids: self.grids.clone(),
            displacements: self.displacements.clone(),
        }
    }

    /// Checks everything against a kernel.
    pub(crate) fn bind<'k>(&'k self, kernel: &'k Kernel) -> Result<Bound<'k, T>, Error>
    where
        T: Scalar,
    {
        let size = |key: SizeKey| {
            let size = kernel.size(key);
            let given = self.find_size(&size.name).or(size.default);
            let missing = SIZE_NOT_GIVEN;
            given.ok_or_else(|| Error::input(&size.name, missing))
        };
        let mut extents = Vec::with_capacity(kernel.axes.len());
        for axis in kernel.axes.values() {
            extents.push(axis.count(axis.extent.size.map_or(Ok(0), size)?)?);
        }
        let mut bound = Bound { kernel, extents, arrays: Arena::default() };
        for (id, buffer) in kernel.buffers.iter() {
            let cells: f64 = buffer.axes.iter().map(|axis| bound.extent(*axis) as f64).product();
            if cells > MOST_CELLS {
                let help = "ask a smaller question, or one that is answered by sampling".to_owned();
                return Err(Error::TooLarge { name: buffer.name.clone(), cells, most: MOST_CELLS, help });
            }
            bound.arrays.push(match &buffer.role {
                Role::Input { key: InputKey::Wraps(grid), .. } => {
                    let name = kernel.set_name(*grid);
                    let space =
                        self.grids.get(name).ok_or_else(|| Error::input(name, "this grid was not given"))?;
                    Array::Given(Cow::Owned(vec![T::truth(space.wraps())]))
                }
                Role::Input { default, broadcast, .. } => {
                    self.bind_array(&bound, id, default.is_some(), *broadcast, &size)?
                }
                Role::Table { key, numbers } => match key.is_some() && self.arrays.contains_key(&buffer.name)
                {
                    true => self.bind_array(&bound, id, false, false, &size)?,
                    false => {
                        check_length(&buffer.name, numbers.len(), bound.length(id))?;
                        Array::Owned(in_precision(numbers))
                    }
                },
                Role::Positions(by, coordinate) => {
                    let table = self.positions(kernel, *by, *coordinate)?;
                    check_length(&buffer.name, table.len(), bound.length(id))?;
                    Array::Positions(table)
                }
                Role::Scratch | Role::Output(_) => Array::Made,
            });
        }
        bound.fits()?;
        Ok(bound)
    }

    /// A table of positions of a grid or of its displacements.
    fn positions<'k>(
        &'k self,
        kernel: &'k Kernel,
        by: Displacements,
        coordinate: Coordinate,
    ) -> Result<&'k [i32], Error> {
        let moves = match by {
            Displacements::Steps(grid) => {
                let name = kernel.set_name(grid);
                self.grids.get(name).map(|space| space.steps()).ok_or((name, "this grid was not given"))
            }
            Displacements::Of(set) => {
                let name = kernel.set_name(set);
                self.displacements.get(name).copied().ok_or((name, "these displacements were not given"))
            }
        };
        let moves = moves.map_err(|(name, message)| Error::input(name, message))?;
        Ok(match coordinate {
            Coordinate::Depth => &moves.depth,
            Coordinate::Row => &moves.row,
            Coordinate::Turn => &moves.turn,
        })
    }

    fn bind_array<'k>(
        &'k self,
        bound: &Bound<'k, T>,
        id: BufferId,
        optional: bool,
        broadcast: bool,
        size: &dyn Fn(SizeKey) -> Result<usize, Error>,
    ) -> Result<Array<'k, T>, Error>
    where
        T: Scalar,
    {
        let name = &bound.kernel.buffers[id].name;
        match self.arrays.get(name) {
            Some(values) if broadcast && values.len() == bound.serial_length(id) => {
                Ok(Array::Broadcast(ordinals(&bound.kernel.buffers[id], values, size)?))
            }
            Some(values) => {
                check_length(name, values.len(), bound.length(id))?;
                Ok(Array::Given(ordinals(&bound.kernel.buffers[id], values, size)?))
            }
            None if optional => Ok(Array::Default),
            None => Err(Error::input(name, "it was not given, and it has no default")),
        }
    }
}

/// Numbers in the type of the computation; no copy if that is f64.
#[allow(clippy::ptr_arg)] // `Any` needs a sized type, which a slice is not
fn in_precision<T: Scalar>(numbers: &Vec<f64>) -> Cow<'_, [T]> {
    match (numbers as &dyn Any).downcast_ref::<Vec<T>>() {
        Some(numbers) => Cow::Borrowed(numbers),
        None => numbers.iter().map(|number| T::from_f64(*number)).collect(),
    }
}

/// The form of an input that a kernel reads: for values of a variable their ordinals.
fn ordinals<'n, T: Scalar>(
    buffer: &Buffer,
    numbers: &'n [T],
    size: &dyn Fn(SizeKey) -> Result<usize, Error>,
) -> Result<Cow<'n, [T]>, Error> {
    let Some(Values { variable, domain, numbers: known }) = &buffer.values else {
        return Ok(Cow::Borrowed(numbers));
    };
    let known = match known {
        Numbers::Real => values::Numbers::Real,
        Numbers::Bins(bins) => values::Numbers::Bins { edges: bins.edges(), circle: bins.is_circle() },
        Numbers::Whole { first, count } => {
            let extent = |extent: &Extent| {
                let size = extent.size.map_or(Ok(0), size)?;
                Ok(usize::try_from(size as i64 + extent.offset).unwrap_or(0))
            };
            let counts = count.iter().map(extent).collect::<Result<Vec<usize>, Error>>()?;
            values::Numbers::Whole { first: *first, count: counts.into_iter().fold(1, usize::saturating_mul) }
        }
    };
    values::Domain { input: &buffer.name, variable, text: domain, numbers: known }.ordinals(numbers)
}

/// The storage of a buffer.
pub(crate) enum Array<'k, T: Clone> {
    Given(Cow<'k, [T]>),
    /// One value for all cells along the parallel axes.
    Broadcast(Cow<'k, [T]>),
    /// The default, everywhere.
    Default,
    /// The numbers that come with the kernel.
    Owned(Cow<'k, [T]>),
    Positions(&'k [i32]),
    Made,
}

/// A kernel whose inputs have been checked.
pub(crate) struct Bound<'k, T: Clone> {
    pub(crate) kernel: &'k Kernel,
    extents: Vec<usize>,
    pub(crate) arrays: Arena<BufferId, Array<'k, T>>,
}

/// Size in bytes above which an array is allocated only after a memory check.
const SMALL_BYTES: f64 = 256e6;

/// Limit of the iterations of all loops: some ten seconds of one core.
const MOST_WORK: f64 = 2e10;

impl<T: Clone> Bound<'_, T> {
    /// Refuses arrays that do not fit in memory, and loops that are too long.
    fn fits(&self) -> Result<(), Error> {
        let (mut cells, mut largest) = (0.0, (0.0, ""));
        let (mut work, mut longest) = (0.0, (0.0, ""));
        for nest in &self.kernel.nests {
            let buffer = &self.kernel.buffers[nest.out];
            let own: f64 = buffer.axes.iter().map(|axis| self.extent(*axis) as f64).product();
            let inner: f64 = match &nest.reduce {
                Reduce::Fold(_, axes) => axes.iter().map(|axis| self.extent(*axis) as f64).product(),
                _ => 1.0,
            };
            cells += own;
            work += own * inner;
            if own > largest.0 {
                largest = (own, &buffer.name);
            }
            if own * inner > longest.0 {
                longest = (own * inner, &buffer.name);
            }
        }
        if work > MOST_WORK {
            let help = "give smaller sizes, or ask for a part at a time".to_owned();
            let question = longest.1.to_owned();
            return Err(Error::TooLong { question, products: work, most: MOST_WORK, help });
        }
        let bytes = cells * size_of::<T>() as f64;
        match (bytes > SMALL_BYTES).then(memory::free).flatten() {
            Some(free) if bytes > free => {
                let (name, help) = (largest.1.to_owned(), "ask a smaller question".to_owned());
                let most = (free / size_of::<T>() as f64).floor();
                Err(Error::TooLarge { name, cells, most, help })
            }
            _ => Ok(()),
        }
    }

    pub(crate) fn extent(&self, axis: AxisId) -> usize {
        self.extents[axis.position()]
    }

    pub(crate) fn length(&self, buffer: BufferId) -> usize {
        self.kernel.buffers[buffer].axes.iter().map(|axis| self.extent(*axis)).product()
    }

    /// Number of cells of a buffer without its parallel axes.
    pub(crate) fn serial_length(&self, buffer: BufferId) -> usize {
        let axes = self.kernel.buffers[buffer].axes.iter();
        axes.filter(|axis| !self.kernel.parallel.contains(axis)).map(|axis| self.extent(*axis)).product()
    }

    /// The stride of each axis of a buffer.
    pub(crate) fn strides(&self, buffer: BufferId) -> Vec<usize> {
        // A default has one cell, and a broadcast one has one for all cells of the plate.
        let is_stored = |axis: &AxisId| match self.arrays[buffer] {
            Array::Default => false,
            Array::Broadcast(_) => !self.kernel.parallel.contains(axis),
            _ => true,
        };
        let axes = &self.kernel.buffers[buffer].axes;
        let stored: Vec<AxisId> = axes.iter().copied().filter(is_stored).collect();
        axes.iter().map(|axis| radix::stride(&stored, axis, |axis| self.extent(*axis))).collect()
    }

    /// The default of an input.
    pub(crate) fn default(&self, buffer: BufferId) -> f64 {
        match self.kernel.buffers[buffer].role {
            Role::Input { default, .. } => default.unwrap_or(0.0),
            _ => 0.0,
        }
    }
}

/// The kernel's outputs, in order.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Outputs<T> {
    /// The key of each, and its cells, the last axis contiguous.
    pub arrays: Vec<(OutputKey, Vec<T>)>,
}

impl<T> Outputs<T> {
    /// An output.
    ///
    /// # Panics
    /// If the kernel has no such output.
    pub fn get(&self, key: OutputKey) -> &[T] {
        let found = self.arrays.iter().find(|(known, _)| *known == key);
        &found.unwrap_or_else(|| panic!("internal: the kernel has no output {key:?}")).1
    }
}

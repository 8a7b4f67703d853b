//! Typed ids and the arena that they index.
//!
//! In: values, one after the other. Out: an id for each. Invariant: an id is made only by the arena that contains its
//! value, so that a lookup cannot fail.

use serde::{Deserialize, Serialize};
use std::marker::PhantomData;
use std::ops::{Index, IndexMut};

/// A position in an [`Arena`].
pub trait Id: Copy {
    /// The id at a position.
    fn new(position: usize) -> Self;
    /// The position.
    fn position(self) -> usize;
}

macro_rules! define_ids {
    ($($(#[$doc:meta])* $name:ident),* $(,)?) => {$(
        $(#[$doc])*
        #[derive(Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Debug, Serialize, Deserialize)]
        pub struct $name(u32);
        impl Id for $name {
            fn new(position: usize) -> Self {
                Self(u32::try_from(position).expect("internal: an arena of more than 2^32 entries"))
            }
            fn position(self) -> usize {
                self.0 as usize
            }
        }
    )*};
}

define_ids! {
    /// A named set: given at run time, or a grid, or its displacements.
    SetId,
    /// A parameter: a number, or a field of numbers, that is given when a question is asked.
    ParameterId,
    /// A variable of a model.
    VariableId,
    /// A node of a model's expressions.
    ExpressionId,
    /// A factor of the decomposition.
    FactorId,
    /// A question of a model.
    QuestionId,
    /// A node of a plan's terms.
    TermId,
    /// A loop axis of a kernel.
    AxisId,
    /// An array of a kernel.
    BufferId,
    /// A node of a kernel's expressions.
    ValueId,
}

/// Values in the order of insertion, looked up by id.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct Arena<I, T> {
    items: Vec<T>,
    #[serde(skip)]
    id: PhantomData<fn() -> I>,
}

impl<I: Id, T> Arena<I, T> {
    /// Adds a value and returns its id.
    pub fn push(&mut self, value: T) -> I {
        self.items.push(value);
        I::new(self.items.len() - 1)
    }

    /// The number of values.
    pub fn len(&self) -> usize {
        self.items.len()
    }

    /// Whether it is empty.
    pub fn is_empty(&self) -> bool {
        self.items.is_empty()
    }

    /// The values with their ids, in order.
    pub fn iter(&self) -> impl DoubleEndedIterator<Item = (I, &T)> {
        self.items.iter().enumerate().map(|(position, value)| (I::new(position), value))
    }

    /// The ids, in order.
    pub fn ids(&self) -> impl DoubleEndedIterator<Item = I> + use<I, T> {
        (0..self.items.len()).map(I::new)
    }

    /// The values, in order.
    pub fn values(&self) -> std::slice::Iter<'_, T> {
        self.items.iter()
    }

    /// Removes and returns the values from a position on.
    pub fn split_off(&mut self, position: usize) -> Vec<T> {
        self.items.split_off(position)
    }

    /// The id of the first value that satisfies `condition`.
    pub fn find(&self, condition: impl Fn(&T) -> bool) -> Option<I> {
        self.items.iter().position(condition).map(I::new)
    }
}

impl<I, T> Default for Arena<I, T> {
    fn default() -> Self {
        Self { items: Vec::new(), id: PhantomData }
    }
}

impl<I: Id, T> Index<I> for Arena<I, T> {
    type Output = T;
    fn index(&self, id: I) -> &T {
        &self.items[id.position()]
    }
}

impl<I: Id, T> IndexMut<I> for Arena<I, T> {
    fn index_mut(&mut self, id: I) -> &mut T {
        &mut self.items[id.position()]
    }
}

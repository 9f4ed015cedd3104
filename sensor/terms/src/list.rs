//! A short list in fixed storage that can be copied.

use core::fmt;
use core::hash::{Hash, Hasher};
use core::ops::{Deref, DerefMut};

/// Up to `MOST` items. Items beyond `MOST` are left out; no call panics.
#[derive(Clone, Copy)]
pub struct List<T, const MOST: usize> {
    count: usize,
    items: [T; MOST],
}

impl<T: Copy + Default, const MOST: usize> List<T, MOST> {
    /// A list of `count` equal items.
    #[inline]
    pub fn filled(count: usize, item: T) -> Self {
        List::from_fn(count, |_| item)
    }

    /// A list of `count` default items.
    #[inline]
    pub fn defaults(count: usize) -> Self {
        List {
            count: count.min(MOST),
            items: [T::default(); MOST],
        }
    }

    /// A list of `count` items, each made from its index.
    #[inline]
    pub fn from_fn(count: usize, mut item: impl FnMut(usize) -> T) -> Self {
        let mut list = List::defaults(count);
        for (index, place) in list.iter_mut().enumerate() {
            *place = item(index);
        }
        list
    }

    /// A list of the first `MOST` of these items.
    #[inline]
    pub fn of(items: impl IntoIterator<Item = T>) -> Self {
        let mut list = List::default();
        for (place, item) in list.items.iter_mut().zip(items) {
            *place = item;
            list.count += 1;
        }
        list
    }

    /// Makes this a list of `count` equal items.
    #[inline]
    pub fn reset(&mut self, count: usize, item: T) {
        self.count = count.min(MOST);
        for place in self.iter_mut() {
            *place = item;
        }
    }

    /// Appends an item, unless the list is full.
    #[inline]
    pub fn push(&mut self, item: T) {
        if let Some(place) = self.items.get_mut(self.count) {
            *place = item;
            self.count += 1;
        }
    }

    /// A list of what `change` makes of each item.
    #[inline]
    pub fn map<U: Copy + Default>(&self, mut change: impl FnMut(T) -> U) -> List<U, MOST> {
        let mut list = List::defaults(self.count);
        for (place, item) in list.iter_mut().zip(self.iter()) {
            *place = change(*item);
        }
        list
    }
}

impl<T: Copy + Default, const MOST: usize> Default for List<T, MOST> {
    /// A list without items.
    #[inline]
    fn default() -> Self {
        List::defaults(0)
    }
}

impl<T, const MOST: usize> Deref for List<T, MOST> {
    type Target = [T];

    #[inline]
    fn deref(&self) -> &[T] {
        self.items.get(..self.count).unwrap_or_default()
    }
}

impl<T, const MOST: usize> DerefMut for List<T, MOST> {
    #[inline]
    fn deref_mut(&mut self) -> &mut [T] {
        self.items.get_mut(..self.count).unwrap_or_default()
    }
}

impl<T: PartialEq, const MOST: usize> PartialEq for List<T, MOST> {
    fn eq(&self, other: &Self) -> bool {
        **self == **other
    }
}

impl<T: Eq, const MOST: usize> Eq for List<T, MOST> {}

impl<T: Hash, const MOST: usize> Hash for List<T, MOST> {
    fn hash<H: Hasher>(&self, state: &mut H) {
        (**self).hash(state);
    }
}

impl<T: fmt::Debug, const MOST: usize> fmt::Debug for List<T, MOST> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        (**self).fmt(f)
    }
}

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

    /// The item with this index; the default if there is none.
    #[inline]
    pub fn at(&self, index: usize) -> T {
        self.get(index).copied().unwrap_or_default()
    }

    /// The first `N` items, filled up with default items.
    #[inline]
    pub fn array<const N: usize>(&self) -> [T; N] {
        core::array::from_fn(|index| self.at(index))
    }

    /// All items, if there are exactly `N`.
    #[inline]
    pub fn exactly<const N: usize>(&self) -> Option<[T; N]> {
        (self.count == N).then(|| self.array())
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

impl<T: Copy + Default, const MOST: usize, const N: usize> From<[T; N]> for List<T, MOST> {
    /// A list of the first `MOST` items.
    fn from(items: [T; N]) -> Self {
        List::of(items)
    }
}

impl<T, const MOST: usize> IntoIterator for List<T, MOST> {
    type Item = T;
    type IntoIter = core::iter::Take<core::array::IntoIter<T, MOST>>;

    fn into_iter(self) -> Self::IntoIter {
        self.items.into_iter().take(self.count)
    }
}

impl<'a, T, const MOST: usize> IntoIterator for &'a List<T, MOST> {
    type Item = &'a T;
    type IntoIter = core::slice::Iter<'a, T>;

    #[inline]
    fn into_iter(self) -> Self::IntoIter {
        self.iter()
    }
}

impl<'a, T, const MOST: usize> IntoIterator for &'a mut List<T, MOST> {
    type Item = &'a mut T;
    type IntoIter = core::slice::IterMut<'a, T>;

    #[inline]
    fn into_iter(self) -> Self::IntoIter {
        self.iter_mut()
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

impl<T: PartialEq, const MOST: usize, const N: usize> PartialEq<[T; N]> for List<T, MOST> {
    fn eq(&self, other: &[T; N]) -> bool {
        **self == *other
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

#[cfg(test)]
mod tests {
    use super::*;
    use std::format;

    type Short = List<i32, 4>;

    #[test]
    fn only_the_items_there_are_count() {
        let list = Short::from([1, 2, 3]);
        assert_eq!(list, [1, 2, 3]);
        assert_ne!(list, Short::from([1, 2, 3, 0]));
        assert_eq!((list.len(), list.at(2), list.at(3)), (3, 3, 0));
        assert_eq!(list.array(), [1, 2, 3, 0]);
        assert_eq!(
            (list.exactly(), list.exactly::<4>()),
            (Some([1, 2, 3]), None)
        );
        assert_eq!(list.map(|item| 2 * item).into_iter().sum::<i32>(), 12);
        assert_eq!(format!("{list:?}"), "[1, 2, 3]");
    }

    #[test]
    fn what_does_not_fit_is_left_out() {
        let mut list = Short::of([7; 40]);
        list.push(8);
        assert_eq!(list, [7; 4]);
        assert_eq!(Short::filled(9, 1), [1; 4]);
        list.reset(2, 5);
        list.push(6);
        assert_eq!(list, [5, 5, 6]);
        assert_eq!(Short::defaults(1), [0]);
    }
}

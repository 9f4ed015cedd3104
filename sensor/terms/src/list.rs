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

    /// The item with this index, or the default.
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

    /// A list of `change` applied to each item.
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

/// Carries a list in messages: its length, then its items. More than `MOST` are an error.
#[cfg(feature = "wire")]
mod wire {
    use super::List;
    use core::fmt;
    use core::marker::PhantomData;
    use postcard_schema::Schema;
    use postcard_schema::schema::{DataModelType, NamedType};
    use serde::de::{Deserialize, Deserializer, Error, SeqAccess, Visitor};
    use serde::ser::{Serialize, Serializer};

    impl<T: Serialize, const MOST: usize> Serialize for List<T, MOST> {
        fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
            serializer.collect_seq(self)
        }
    }

    impl<'de, T, const MOST: usize> Deserialize<'de> for List<T, MOST>
    where
        T: Deserialize<'de> + Copy + Default,
    {
        fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
            deserializer.deserialize_seq(Items(PhantomData))
        }
    }

    impl<T: Schema, const MOST: usize> Schema for List<T, MOST> {
        const SCHEMA: &'static NamedType = &NamedType {
            name: "List",
            ty: &DataModelType::Seq(T::SCHEMA),
        };
    }

    struct Items<T, const MOST: usize>(PhantomData<T>);

    impl<'de, T, const MOST: usize> Visitor<'de> for Items<T, MOST>
    where
        T: Deserialize<'de> + Copy + Default,
    {
        type Value = List<T, MOST>;

        fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
            write!(f, "at most {MOST} items")
        }

        fn visit_seq<A: SeqAccess<'de>>(self, mut items: A) -> Result<Self::Value, A::Error> {
            let mut list = List::default();
            while let Some(item) = items.next_element()? {
                if list.len() == MOST {
                    return Err(A::Error::invalid_length(MOST + 1, &self));
                }
                list.push(item);
            }
            Ok(list)
        }
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

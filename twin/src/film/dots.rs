//! One value for each dot of a film.

use std::fmt;
use std::ops::{Deref, DerefMut};

/// The largest number of dots of a film.
pub const MOST_DOTS: usize = 16;

/// One value for each dot, by identity; at most [`MOST_DOTS`].
#[derive(Clone, Copy)]
pub struct Dots<T> {
    values: [T; MOST_DOTS],
    count: usize,
}

impl<T: Copy + Default> Dots<T> {
    /// Returns the values of the dots 0 to `count` − 1, at most [`MOST_DOTS`].
    pub fn from_fn(count: usize, mut value: impl FnMut(usize) -> T) -> Dots<T> {
        let count = count.min(MOST_DOTS);
        let values = |k| if k < count { value(k) } else { T::default() };
        Dots {
            values: std::array::from_fn(values),
            count,
        }
    }

    /// Returns the first [`MOST_DOTS`] values.
    pub fn of(values: &[T]) -> Dots<T> {
        Dots::from_fn(values.len(), |k| values[k])
    }

    /// Returns another value for each dot.
    pub fn map<R: Copy + Default>(self, mut other: impl FnMut(T) -> R) -> Dots<R> {
        Dots::from_fn(self.count, |k| other(self.values[k]))
    }

    /// Returns the values of the first four dots.
    pub fn four(&self) -> [T; 4] {
        std::array::from_fn(|dot| self.at(dot))
    }

    /// Returns a dot's value; the default if it has none.
    pub fn at(&self, dot: usize) -> T {
        self.get(dot).copied().unwrap_or_default()
    }
}

impl<T: Copy + Default, const N: usize> From<[T; N]> for Dots<T> {
    /// Takes the first [`MOST_DOTS`] values.
    fn from(values: [T; N]) -> Dots<T> {
        Dots::of(&values)
    }
}

impl<T> Deref for Dots<T> {
    type Target = [T];

    fn deref(&self) -> &[T] {
        &self.values[..self.count]
    }
}

impl<T> DerefMut for Dots<T> {
    fn deref_mut(&mut self) -> &mut [T] {
        &mut self.values[..self.count]
    }
}

impl<T> IntoIterator for Dots<T> {
    type Item = T;
    type IntoIter = std::iter::Take<std::array::IntoIter<T, MOST_DOTS>>;

    fn into_iter(self) -> Self::IntoIter {
        self.values.into_iter().take(self.count)
    }
}

impl<'a, T> IntoIterator for &'a Dots<T> {
    type Item = &'a T;
    type IntoIter = std::slice::Iter<'a, T>;

    fn into_iter(self) -> Self::IntoIter {
        self.iter()
    }
}

impl<'a, T> IntoIterator for &'a mut Dots<T> {
    type Item = &'a mut T;
    type IntoIter = std::slice::IterMut<'a, T>;

    fn into_iter(self) -> Self::IntoIter {
        self.iter_mut()
    }
}

impl<T: PartialEq> PartialEq for Dots<T> {
    fn eq(&self, other: &Dots<T>) -> bool {
        **self == **other
    }
}

impl<T: PartialEq, const N: usize> PartialEq<[T; N]> for Dots<T> {
    fn eq(&self, other: &[T; N]) -> bool {
        **self == *other
    }
}

impl<T: fmt::Debug> fmt::Debug for Dots<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        (**self).fmt(f)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_dots_there_are_count() {
        let dots = Dots::from([1, 2, 3]);
        assert_eq!(dots, [1, 2, 3]);
        assert_ne!(dots, Dots::from([1, 2, 3, 0]));
        assert_eq!((dots.len(), dots.at(2), dots.at(3)), (3, 3, 0));
        assert_eq!(dots.four(), [1, 2, 3, 0]);
        assert_eq!(dots.map(|k| 2 * k).into_iter().sum::<i32>(), 12);
        assert_eq!(Dots::of(&[7; 40]).len(), MOST_DOTS);
        assert_eq!(format!("{dots:?}"), "[1, 2, 3]");
    }
}

//! One value for each dot of a film.

use hivtac_terms::list::List;
use hivtac_terms::marker::MOST_MARKERS;

/// The largest number of dots of a film.
pub const MOST_DOTS: usize = MOST_MARKERS;

/// One value for each dot, by identity.
pub type Dots<T> = List<T, MOST_DOTS>;

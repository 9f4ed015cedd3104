//! One value for each dot of a film.

use hivtac_terms::list::List;

/// The largest number of dots of a film.
pub const MOST_DOTS: usize = 16;

/// One value for each dot, by identity.
pub type Dots<T> = List<T, MOST_DOTS>;

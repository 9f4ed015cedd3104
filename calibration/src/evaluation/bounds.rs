//! Factors from standard uncertainties to 95 % bounds.

/// The 95 % bound of a direction over its standard uncertainty: √(−ln 0.05), for a root mean square
/// over two dimensions.
pub const DIRECTION_BOUND: f64 = 1.730_818_382_602_285_4;
/// The 95 % bound of |F| over its standard uncertainty.
pub const MAGNITUDE_BOUND: f64 = 1.959_963_984_540_054;

/// The 95 % bound of a place over the standard uncertainty of each of its coordinates: √(−2 ln
/// 0.05).
pub const PLACE_BOUND: f64 = 2.447_746_830_680_816;

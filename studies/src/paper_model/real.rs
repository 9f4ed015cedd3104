//! The two floating-point types that the model is computed in.

use std::ops::{Add, Div, Mul, Neg, Sub};

/// `f32` or `f64`, with the two functions that the model needs beyond arithmetic.
pub trait Real:
    Copy
    + PartialOrd
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
{
    /// The nearest value of this type.
    fn of(value: f64) -> Self;
    /// This value, exactly.
    fn to_f64(self) -> f64;
    /// Square root, correctly rounded.
    fn sqrt(self) -> Self;
    /// The angle of the point (x, y) from the x axis: y.atan2(x), −π to π.
    fn atan2(self, x: Self) -> Self;
}

impl Real for f64 {
    fn of(value: f64) -> f64 {
        value
    }

    fn to_f64(self) -> f64 {
        self
    }

    fn sqrt(self) -> f64 {
        libm::sqrt(self)
    }

    fn atan2(self, x: f64) -> f64 {
        libm::atan2(self, x)
    }
}

impl Real for f32 {
    fn of(value: f64) -> f32 {
        value as f32
    }

    fn to_f64(self) -> f64 {
        f64::from(self)
    }

    fn sqrt(self) -> f32 {
        libm::sqrtf(self)
    }

    fn atan2(self, x: f32) -> f32 {
        libm::atan2f(self, x)
    }
}

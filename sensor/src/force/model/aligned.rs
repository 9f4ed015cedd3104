//! Aligns a model file for the kernels.

/// A model file at a multiple of four, as the kernels need it: a [`Model`](super::Model) of such
/// bytes [is aligned](super::Model::is_aligned). An unaligned one works too, with the portable
/// code.
///
/// ```
/// # use hivtac_sensor::force::model::AlignedFile;
/// static FILE: &AlignedFile<[u8]> = &AlignedFile(*b"what include_bytes! gives");
/// assert!(FILE.0.as_ptr().cast::<u32>().is_aligned());
/// ```
#[repr(C, align(4))]
#[derive(Clone, Copy, Debug)]
pub struct AlignedFile<Bytes: ?Sized>(pub Bytes);

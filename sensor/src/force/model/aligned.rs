//! Where a model file must lie for the kernels.

/// A model file at a multiple of four, as the kernels need it: a [`Model`](super::Model) of such
/// bytes [is aligned](super::Model::is_aligned). One that is not runs as well, by the portable
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

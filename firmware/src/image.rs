//! The marks by which an update knows what this image is for (`hivtac-image`), at places that
//! `memory.x` fixes.

use crate::board;
use hivtac_image::header::{Header, Mark};

#[used]
#[unsafe(link_section = ".first_stage.mark")]
static FIRST_STAGE: Mark = Mark::of_first_stage(board::NAME);

/// Without length and checksum, which an image gets when it is made of the ELF.
#[used]
#[unsafe(link_section = ".image_header")]
static HEADER: Header = Header::unsealed(board::NAME, env!("CARGO_PKG_VERSION"));

//! The picture of Figure 8 in the documentation.

use hivtac_studies::paper_model::{Design, Map, OutOfDomain, PinholeDistance};

/// `docs/pictures/figure8.svg`.
pub fn figure8_svg() -> Result<String, OutOfDomain> {
    let map = Map::new(&Design::paper(PinholeDistance::Slant), 100)?;
    Ok(map.to_svg("R* that maximizes Q (Figure 8; slant D_ph, ε = 0)"))
}

//! STEP AP242 files of a part: analytic faces, shared edges, a product for each shell.

mod bodies;
mod curve;
mod file;
mod product;
mod surface;
mod unit;

use crate::fit::constant::Table;
use crate::geometry::LengthUnit;
use crate::model::brep::build::Model;
use crate::model::brep::part::Source;

use bodies::Bodies;

/// The numbers that are decided with, by file.
pub(super) static TABLES: &[Table] = &[surface::CONSTANTS];

/// The STEP file of a segmentation in its cloud's unit, millimetres where none is known; `version` is the program's, `color` a
/// region's red, green and blue.
pub fn step(
    source: &Source,
    unit: Option<LengthUnit>,
    version: &str,
    color: impl Fn(i32) -> [u8; 3],
) -> String {
    let model = Model::of(source);
    let mut bodies = Bodies::new(&model, source.regions);
    for shell in 0..model.shells.len() {
        bodies.body(shell);
    }
    product::file(bodies.written(), &model, source.regions, unit, version, color)
}

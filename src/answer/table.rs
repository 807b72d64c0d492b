use super::Document;
use crate::{
    formats::{DIMENSIONS, RegionRow},
    geometry::LengthUnit,
    segment::Region,
};

/// The rows of the table of regions.
pub(super) fn rows(document: &Document) -> Vec<RegionRow> {
    let row = |region: &Region| RegionRow {
        id: region.id,
        surface_type: region.surface_type,
        point_count: region.point_count,
        rms: region.fit.rms,
        max: region.fit.max,
        coefficients: region.coefficients,
        coefficients_error: region.coefficients_error,
        local_origin: region.local_origin,
        local_coefficients: region.local_coefficients,
        surface: region.surface,
        unit: document.input.unit.map(LengthUnit::name).unwrap_or_default(),
        dimensions: dimensions(region),
    };
    document.regions.iter().map(row).collect()
}

/// The cells of [`DIMENSIONS`], in its order.
fn dimensions(region: &Region) -> [String; DIMENSIONS.len()] {
    let d = &region.dimensions;
    let deviation = |name: &str| region.uncertainty.as_ref()?.get(name)?.as_f64();
    let ends = |k: usize| d.ends.map(|ends| ends[k / 3][k % 3]);
    let degrees = |angle: Option<f64>| angle.map(f64::to_degrees);
    let number = |value: Option<f64>| value.map(|v| v.to_string()).unwrap_or_default();
    let before = [0, 1, 2, 3, 4, 5].map(ends).into_iter().chain([
        d.length,
        deviation("length"),
        d.diameter,
        deviation("diameter"),
        d.end_radii.map(|r| r[0]),
        d.end_radii.map(|r| r[1]),
        degrees(d.full_angle),
        degrees(d.swept_angle),
        degrees(d.arc_angle),
        degrees(deviation("arc_angle")),
    ]);
    let side = d.side.map(|side| side.name().to_owned()).unwrap_or_default();
    let after = [d.share_seen, d.area, d.size.map(|s| s[0]), d.size.map(|s| s[1])];
    let mut cells = before.map(number).chain([side]).chain(after.map(number));
    std::array::from_fn(|_| cells.next().unwrap_or_default())
}

use std::io::{self, Write};

use crate::geometry::{Surface, SurfaceType, Vec3};

/// One region of a result, as a table shows it.
#[derive(Clone, Debug, PartialEq)]
pub struct RegionRow {
    /// The label of its points.
    pub id: usize,
    /// The surface's type.
    pub surface_type: SurfaceType,
    /// How many points carry its label.
    pub point_count: usize,
    /// Root mean square distance of its points.
    pub rms: f64,
    /// Largest distance of its points.
    pub max: f64,
    /// a1..a10 in the seed's order; none of a torus.
    pub coefficients: Option<[f64; 10]>,
    /// How far off these are as written, as a length; `None` where that is not known.
    pub coefficients_error: Option<f64>,
    /// An origin near the points.
    pub local_origin: [f64; 3],
    /// a1..a10 about that one.
    pub local_coefficients: Option<[f64; 10]>,
    /// The surface in engineering terms, where it has any.
    pub surface: Option<Surface>,
    /// The unit of its lengths; empty where none is known.
    pub unit: &'static str,
    /// The cells from `end_1_x` on, in the order of [`DIMENSIONS`]; empty text where there is none.
    pub dimensions: [String; DIMENSIONS.len()],
}

/// The columns of a region's dimensions: lengths in the input's unit, angles in degrees, `_sd` = standard deviation.
pub const DIMENSIONS: [&str; 21] = [
    "end_1_x",
    "end_1_y",
    "end_1_z",
    "end_2_x",
    "end_2_y",
    "end_2_z",
    "length",
    "length_sd",
    "diameter",
    "diameter_sd",
    "end_radius_1",
    "end_radius_2",
    "full_angle_deg",
    "swept_angle_deg",
    "arc_angle_deg",
    "arc_angle_sd_deg",
    "side",
    "share_seen",
    "area",
    "size_1",
    "size_2",
];

const COLUMNS: &str = "id,type,point_count,rms,max,position_x,position_y,position_z,\
    direction_x,direction_y,direction_z,radius,half_angle,semi_axis_1,semi_axis_2,semi_axis_3,\
    semi_axis_1_x,semi_axis_1_y,semi_axis_1_z,semi_axis_2_x,semi_axis_2_y,semi_axis_2_z,\
    a1,a2,a3,a4,a5,a6,a7,a8,a9,a10,coefficients_error,local_origin_x,local_origin_y,local_origin_z,\
    local_a1,local_a2,local_a3,local_a4,local_a5,local_a6,local_a7,local_a8,local_a9,local_a10,\
    major_radius,minor_radius";

/// Writes one line for each region, under a line of names; a parameter its surface lacks stays empty.
///
/// `position` is the plane's point, the centre, a point of the axis or the apex; `direction` the normal
/// or the axis; semi-axes stand with the largest first, the third's direction is the cross product of
/// the other two (or the axis). Lengths are in the input's unit, angles in radians.
///
/// # Errors
/// `out` fails.
pub fn write_regions_csv(out: &mut impl Write, rows: &[RegionRow]) -> io::Result<()> {
    writeln!(out, "{COLUMNS},{},unit", DIMENSIONS.join(","))?;
    for row in rows {
        let name = row.surface_type.name();
        write!(out, "{},{name},{},{},{}", row.id, row.point_count, row.rms, row.max)?;
        let surface = row.surface.as_ref().map_or([None; 17], parameters);
        let ten = |all: Option<[f64; 10]>| all.map_or([None; 10], |all| all.map(Some));
        let torus = match row.surface {
            Some(Surface::Torus(s)) => [s.major_radius, s.minor_radius].map(Some),
            _ => [None; 2],
        };
        let cells = surface
            .into_iter()
            .chain(ten(row.coefficients))
            .chain([row.coefficients_error])
            .chain(row.local_origin.map(Some))
            .chain(ten(row.local_coefficients))
            .chain(torus);
        for cell in cells {
            match cell {
                Some(value) => write!(out, ",{value}")?,
                None => write!(out, ",")?,
            }
        }
        for cell in &row.dimensions {
            write!(out, ",{cell}")?;
        }
        writeln!(out, ",{}", row.unit)?;
    }
    Ok(())
}

/// The parameters of a surface in the order of the columns from `position_x` to `semi_axis_2_z`.
fn parameters(surface: &Surface) -> [Option<f64>; 17] {
    let mut cells = [None; 17];
    let mut put = |at: usize, values: &[f64]| {
        cells[at..at + values.len()].iter_mut().zip(values).for_each(|(c, v)| *c = Some(*v));
    };
    let directions = |d: &[Vec3]| -> Vec<f64> { d.iter().flat_map(|d| [d.x, d.y, d.z]).collect() };
    let (position, direction) = match surface {
        Surface::Plane(s) => (s.point, Some(s.normal)),
        Surface::Sphere(s) => {
            put(6, &[s.radius]);
            (s.center, None)
        }
        Surface::Cylinder(s) => {
            put(6, &[s.radius]);
            (s.axis_point, Some(s.axis_direction))
        }
        Surface::Cone(s) => {
            put(7, &[s.half_angle]);
            (s.apex, Some(s.axis_direction))
        }
        Surface::EllipticCylinder(s) => {
            put(8, &s.semi_axes);
            put(11, &directions(&s.semi_axis_directions));
            (s.axis_point, Some(s.axis_direction))
        }
        Surface::Ellipsoid(s) => {
            put(8, &s.semi_axes);
            put(11, &directions(&s.semi_axis_directions[..2]));
            (s.center, None)
        }
        Surface::Torus(s) => (s.center, Some(s.axis_direction)),
    };
    put(0, position.as_slice());
    if let Some(direction) = direction {
        put(3, direction.as_slice());
    }
    cells
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Cylinder, EllipticCylinder};

    fn table(surface_type: SurfaceType, surface: Option<Surface>) -> Vec<(String, String)> {
        let row = RegionRow {
            id: 3,
            surface_type,
            point_count: 120,
            rms: 0.01,
            max: 0.04,
            coefficients: Some([0.5; 10]),
            coefficients_error: None,
            local_origin: [500_000.1, 0.0, -2.0],
            local_coefficients: Some([0.25; 10]),
            surface,
            unit: "mm",
            dimensions: std::array::from_fn(|k| format!("d{k}")),
        };
        let mut bytes = Vec::new();
        write_regions_csv(&mut bytes, &[row]).unwrap();
        let text = String::from_utf8(bytes).unwrap();
        let lines: Vec<Vec<_>> = text.lines().map(|l| l.split(',').collect()).collect();
        assert_eq!((lines.len(), lines[0].len()), (2, lines[1].len()));
        lines[0].iter().zip(&lines[1]).map(|(a, b)| (a.to_string(), b.to_string())).collect()
    }

    fn cell(table: &[(String, String)], name: &str) -> String {
        table.iter().find(|(n, _)| n == name).unwrap().1.clone()
    }

    #[test]
    fn every_parameter_stands_under_its_name() {
        let cylinder = Cylinder {
            axis_point: Vec3::new(1.0, 2.0, 3.0),
            axis_direction: Vec3::z(),
            radius: 7.25,
        };
        let t = table(SurfaceType::Cylinder, Some(Surface::Cylinder(cylinder)));
        let cells = ["id", "type", "position_y", "direction_z", "radius", "half_angle", "a10"];
        assert_eq!(cells.map(|c| cell(&t, c)), ["3", "cylinder", "2", "1", "7.25", "", "0.5"]);
        let cells =
            ["coefficients_error", "local_origin_x", "local_origin_z", "local_a1", "local_a10"];
        assert_eq!(cells.map(|c| cell(&t, c)), ["", "500000.1", "-2", "0.25", "0.25"]);
        assert_eq!(["end_1_x", "length", "size_2"].map(|c| cell(&t, c)), ["d0", "d6", "d20"]);
        assert_eq!(cell(&t, "unit"), "mm");
        let elliptic = EllipticCylinder {
            axis_point: Vec3::zeros(),
            axis_direction: Vec3::z(),
            semi_axes: [5.0, 4.0],
            semi_axis_directions: [Vec3::x(), Vec3::y()],
        };
        let t = table(SurfaceType::EllipticCylinder, Some(Surface::EllipticCylinder(elliptic)));
        let cells = ["semi_axis_1", "semi_axis_2", "semi_axis_3", "semi_axis_2_y", "radius"];
        assert_eq!(cells.map(|c| cell(&t, c)), ["5", "4", "", "1", ""]);
    }

    #[test]
    fn a_quadric_without_parameters_has_its_coefficients() {
        let t = table(SurfaceType::HyperboloidOneSheet, None);
        assert_eq!((cell(&t, "position_x"), cell(&t, "a1")), (String::new(), "0.5".to_string()));
    }
}

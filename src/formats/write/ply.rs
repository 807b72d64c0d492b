use std::io::{self, Write};

use crate::formats::Fields;
use crate::geometry::{PointCloud, Vec3};

/// A cloud and what is known about each of its points.
#[derive(Clone, Copy, Debug)]
pub struct Labelled<'a> {
    /// The points.
    pub cloud: &'a PointCloud,
    /// One label for each input point, in input order.
    pub labels: &'a [i32],
    /// The signed distance of each from its own surface, in the same order; NaN where it has none.
    pub deviations: &'a [f64],
    /// The file's own columns.
    pub fields: &'a Fields,
}

/// What is written for every vertex, before the file's own columns.
const OWN: [(&str, &str); 8] = [
    ("x", "double"),
    ("y", "double"),
    ("z", "double"),
    ("red", "uchar"),
    ("green", "uchar"),
    ("blue", "uchar"),
    ("label", "int"),
    ("deviation", "double"),
];
/// Its bytes.
const VERTEX: usize = 39;

/// Writes a cloud as binary little-endian PLY: x, y, z (double), red, green, blue (uchar), label (int), deviation
/// (double), then the columns that the file had itself; of those with such a name, the name begins with `input_`.
///
/// Points that were left out for their NaN coordinates come back as NaN, so that the vertices stand in input order.
///
/// # Errors
/// `out` fails.
pub fn write_labelled_ply(out: &mut impl Write, labelled: &Labelled) -> io::Result<()> {
    let cloud = labelled.cloud;
    let grid = cloud
        .grid
        .map(|g| format!("obj_info num_cols {}\nobj_info num_rows {}\n", g.width, g.height));
    write!(
        out,
        "ply\nformat binary_little_endian 1.0\ncomment conicoid: label = region id, -1 = unassigned\n\
         comment conicoid: deviation = signed distance from the own surface\n{}element vertex {}\n",
        grid.unwrap_or_default(),
        cloud.input_len
    )?;
    for (name, kind) in OWN {
        writeln!(out, "property {kind} {name}")?;
    }
    for (name, kind) in &labelled.fields.columns {
        let taken = OWN.iter().any(|(own, _)| own.eq_ignore_ascii_case(name));
        writeln!(out, "property {kind} {}{name}", if taken { "input_" } else { "" })?;
    }
    writeln!(out, "end_header")?;
    write_vertices(out, labelled)
}

fn write_vertices(out: &mut impl Write, labelled: &Labelled) -> io::Result<()> {
    const BLOCK: usize = 2048;
    let Labelled { cloud, labels, deviations, fields } = labelled;
    let whole = VERTEX + fields.stride;
    let mut buffer = Vec::with_capacity(BLOCK * whole);
    let mut stored = 0;
    for i in 0..cloud.input_len {
        let is_stored = match &cloud.input_index {
            Some(index) => index.get(stored).is_some_and(|&at| at as usize == i),
            None => true,
        };
        let point = cloud.points.get(stored).filter(|_| is_stored);
        stored += usize::from(is_stored);
        push_vertex(&mut buffer, point, labels.get(i).copied().unwrap_or(-1));
        buffer.extend(deviations.get(i).copied().unwrap_or(f64::NAN).to_le_bytes());
        let from = i * fields.stride;
        match fields.records.get(from..from + fields.stride) {
            Some(own) => buffer.extend_from_slice(own),
            None => buffer.resize(buffer.len() + fields.stride, 0),
        }
        if buffer.len() >= BLOCK * whole {
            out.write_all(&buffer)?;
            buffer.clear();
        }
    }
    out.write_all(&buffer)
}

fn push_vertex(buffer: &mut Vec<u8>, point: Option<&Vec3>, label: i32) {
    let point = point.copied().unwrap_or(Vec3::repeat(f64::NAN));
    for coordinate in &point {
        buffer.extend_from_slice(&coordinate.to_le_bytes());
    }
    buffer.extend_from_slice(&region_color(label));
    buffer.extend_from_slice(&label.to_le_bytes());
}

/// The colour (red, green, blue) of a region's points; grey for -1.
///
/// Hues step by the golden angle, so that regions with near ids look different, and brightness changes
/// every round.
pub fn region_color(label: i32) -> [u8; 3] {
    if label < 0 {
        return [128; 3];
    }
    let hue = (f64::from(label) * 0.618_033_988_749_895).fract() * 6.0;
    let value = [255.0, 200.0, 150.0][(label / 12 % 3) as usize];
    let saturation = if label / 36 % 2 == 0 { 0.85 } else { 0.5 };
    [5.0, 3.0, 1.0].map(|shift| {
        let k = (shift + hue) % 6.0;
        (value * (1.0 - saturation * k.min(4.0 - k).clamp(0.0, 1.0))) as u8
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::{Limits, read};

    #[test]
    fn what_is_written_is_read_back_with_its_holes() {
        let hole = Vec3::repeat(f64::NAN);
        let points = vec![Vec3::new(1e6 + 0.1, -2.0, 3.0), hole, Vec3::new(4.0, 5.0, 6.0), hole];
        let mut cloud = PointCloud::from_points(points);
        cloud.grid = Some(crate::geometry::Grid { width: 2, height: 2 });
        let mut bytes = Vec::new();
        let fields = Fields {
            columns: vec![("red".into(), "uchar"), ("nx".into(), "ushort")],
            stride: 3,
            records: (0..12).collect(),
        };
        let (labels, deviations) = ([0, -1, 7, -1], [0.5, f64::NAN, -0.25, f64::NAN]);
        let labelled =
            Labelled { cloud: &cloud, labels: &labels, deviations: &deviations, fields: &fields };
        write_labelled_ply(&mut bytes, &labelled).unwrap();
        assert_eq!(read(&bytes, None, &Limits::default()).unwrap(), cloud);
        let vertex = |i: usize| bytes[bytes.len() - 42 * i..][..42].to_vec();
        assert_eq!((&vertex(4)[27..31], &vertex(2)[27..31]), (&[0; 4][..], &[7, 0, 0, 0][..]));
        assert_eq!(vertex(2)[31..39], (-0.25f64).to_le_bytes());
        assert_eq!(vertex(2)[39..], [6, 7, 8]);
        let kept = Fields::of(&bytes);
        let names: Vec<_> = kept.columns.iter().map(|c| c.0.as_str()).collect();
        assert_eq!(names[3..], ["label", "deviation", "input_red", "nx"]);
    }

    #[test]
    fn regions_have_colours_of_their_own() {
        assert_eq!(region_color(-1), [128; 3]);
        let colours: std::collections::HashSet<_> = (0..72).map(region_color).collect();
        assert_eq!(colours.len(), 72);
        assert!(!colours.contains(&[128; 3]));
    }
}

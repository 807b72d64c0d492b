use std::io::{self, Write};

use super::{
    labelled::{Known, Labelled},
    palette::region_color,
};
use crate::geometry::Vec3;

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

/// Writes a cloud as binary little-endian PLY: x, y, z (double), red, green, blue (uchar), label (int), deviation
/// (double), then the columns that the file had itself; of those with such a name, the name begins with `input_`.
///
/// Points that were left out for their NaN coordinates come back as NaN, so that the vertices stand in input order.
///
/// # Errors
/// `out` fails.
pub fn write_labelled_ply(out: &mut (impl Write + Send), labelled: &Labelled) -> io::Result<()> {
    let grid = labelled
        .grid
        .map(|g| format!("obj_info num_cols {}\nobj_info num_rows {}\n", g.width, g.height));
    write!(
        out,
        "ply\nformat binary_little_endian 1.0\ncomment conicoid: label = region id, -1 = unassigned\n\
         comment conicoid: deviation = signed distance from the own surface\n{}element vertex {}\n",
        grid.unwrap_or_default(),
        labelled.count
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

fn write_vertices(out: &mut (impl Write + Send), labelled: &Labelled) -> io::Result<()> {
    let fields = labelled.fields;
    // the label -1 comes first
    let last = labelled.labels.iter().copied().max().unwrap_or(-1);
    let colors: Vec<[u8; 3]> = (-1..=last).map(region_color).collect();
    let mut buffer = Vec::new();
    labelled.each(|first, known| {
        buffer.clear();
        let read = labelled.points.records(first, known.len());
        let (records, before) = match &read {
            Some(records) => (records, 0),
            None => (&fields.records, first),
        };
        for (k, Known { point, label, deviation }) in known.iter().enumerate() {
            let color = usize::try_from(label + 1).ok().and_then(|at| colors.get(at));
            push_vertex(&mut buffer, point, color.copied().unwrap_or(region_color(-1)), *label);
            buffer.extend(deviation.to_le_bytes());
            let from = (before + k) * fields.stride;
            match records.get(from..from + fields.stride) {
                Some(own) => buffer.extend_from_slice(own),
                None => buffer.resize(buffer.len() + fields.stride, 0),
            }
        }
        out.write_all(&buffer)
    })
}

fn push_vertex(buffer: &mut Vec<u8>, point: &Vec3, color: [u8; 3], label: i32) {
    for coordinate in point {
        buffer.extend_from_slice(&coordinate.to_le_bytes());
    }
    buffer.extend_from_slice(&color);
    buffer.extend_from_slice(&label.to_le_bytes());
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::{Fields, Limits, read};
    use crate::geometry::PointCloud;

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
        let labels = [0, -1, 7, -1];
        let labelled = Labelled {
            points: &cloud,
            count: 4,
            grid: cloud.grid,
            labels: &labels,
            deviation: &|label, _| {
                if label < 0 { f64::NAN } else { 0.5 - f64::from(label) * 0.75 / 7.0 }
            },
            fields: &fields,
        };
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
}

use std::io::{self, Write};

use crate::geometry::{PointCloud, Vec3};

/// Writes the cloud as binary little-endian PLY: x, y, z (double), red, green, blue (uchar), label (int).
///
/// `labels` are in input order, one for each input point; points that were left out for their NaN
/// coordinates come back as NaN, so that the vertices stand in input order too.
///
/// # Errors
/// `out` fails.
pub fn write_labelled_ply(
    out: &mut impl Write,
    cloud: &PointCloud,
    labels: &[i32],
) -> io::Result<()> {
    let grid = cloud
        .grid
        .map(|g| format!("obj_info num_cols {}\nobj_info num_rows {}\n", g.width, g.height));
    write!(
        out,
        "ply\nformat binary_little_endian 1.0\ncomment conicoid: label = region id, -1 = unassigned\n\
         {}element vertex {}\nproperty double x\nproperty double y\nproperty double z\n\
         property uchar red\nproperty uchar green\nproperty uchar blue\nproperty int label\n\
         end_header\n",
        grid.unwrap_or_default(),
        cloud.input_len
    )?;
    write_vertices(out, cloud, labels)
}

fn write_vertices(out: &mut impl Write, cloud: &PointCloud, labels: &[i32]) -> io::Result<()> {
    const BLOCK: usize = 2048;
    const VERTEX: usize = 31;
    let mut buffer = Vec::with_capacity(BLOCK * VERTEX);
    let mut stored = 0;
    for i in 0..cloud.input_len {
        let is_stored = match &cloud.input_index {
            Some(index) => index.get(stored).is_some_and(|&at| at as usize == i),
            None => true,
        };
        let point = cloud.points.get(stored).filter(|_| is_stored);
        stored += usize::from(is_stored);
        push_vertex(&mut buffer, point, labels.get(i).copied().unwrap_or(-1));
        if buffer.len() >= BLOCK * VERTEX {
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
        write_labelled_ply(&mut bytes, &cloud, &[0, -1, 7, -1]).unwrap();
        assert_eq!(read(&bytes, None, &Limits::default()).unwrap(), cloud);
        let label = |i: usize| bytes[bytes.len() - 31 * i..][27..31].to_vec();
        assert_eq!((label(4), label(2)), (vec![0; 4], vec![7, 0, 0, 0]));
    }

    #[test]
    fn regions_have_colours_of_their_own() {
        assert_eq!(region_color(-1), [128; 3]);
        let colours: std::collections::HashSet<_> = (0..72).map(region_color).collect();
        assert_eq!(colours.len(), 72);
        assert!(!colours.contains(&[128; 3]));
    }
}

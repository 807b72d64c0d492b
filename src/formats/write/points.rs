use std::io::{self, Write};

use super::Labelled;

/// Writes one line for each input point under a line of names: x, y, z, label (-1 = unassigned), deviation; empty
/// where there is none.
///
/// # Errors
/// `out` fails.
pub fn write_points_csv(out: &mut impl Write, labelled: &Labelled) -> io::Result<()> {
    let Labelled { cloud, labels, deviations, .. } = labelled;
    writeln!(out, "x,y,z,label,deviation")?;
    let mut stored = cloud.points.iter().enumerate().peekable();
    for i in 0..cloud.input_len {
        let place = |k: usize| cloud.input_index.as_ref().map_or(k, |index| index[k] as usize);
        match stored.next_if(|(k, _)| place(*k) == i) {
            Some((_, p)) => write!(out, "{},{},{}", p.x, p.y, p.z)?,
            None => write!(out, ",,")?,
        }
        write!(out, ",{},", labels.get(i).copied().unwrap_or(-1))?;
        match deviations.get(i).filter(|d| !d.is_nan()) {
            Some(deviation) => writeln!(out, "{deviation}")?,
            None => writeln!(out)?,
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::Fields;
    use crate::geometry::{PointCloud, Vec3};

    #[test]
    fn every_input_point_has_its_line() {
        let points = vec![Vec3::new(1.0, 2.5, -3.0), Vec3::repeat(f64::NAN), Vec3::zeros()];
        let (cloud, fields) = (PointCloud::from_points(points), Fields::default());
        let (labels, deviations) = ([4, -1, -1], [0.125, f64::NAN, f64::NAN]);
        let labelled =
            Labelled { cloud: &cloud, labels: &labels, deviations: &deviations, fields: &fields };
        let mut bytes = Vec::new();
        write_points_csv(&mut bytes, &labelled).unwrap();
        let text = String::from_utf8(bytes).unwrap();
        assert_eq!(text, "x,y,z,label,deviation\n1,2.5,-3,4,0.125\n,,,-1,\n0,0,0,-1,\n");
    }
}

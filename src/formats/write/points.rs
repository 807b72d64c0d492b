use std::io::{self, Write};

use super::labelled::{Known, Labelled};

/// Writes one line for each input point under a line of names: x, y, z, label (-1 = unassigned), deviation; empty
/// where there is none.
///
/// # Errors
/// `out` fails.
pub fn write_points_csv(out: &mut (impl Write + Send), labelled: &Labelled) -> io::Result<()> {
    writeln!(out, "x,y,z,label,deviation")?;
    labelled.each(|_, known| {
        for Known { point: p, label, deviation } in known {
            match p.x.is_nan() {
                true => write!(out, ",,")?,
                false => write!(out, "{},{},{}", p.x, p.y, p.z)?,
            }
            write!(out, ",{label},")?;
            match deviation.is_nan() {
                true => writeln!(out)?,
                false => writeln!(out, "{deviation}")?,
            }
        }
        Ok(())
    })
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
        let labelled = Labelled {
            points: &cloud,
            count: 3,
            grid: None,
            labels: &[4, -1, -1],
            deviation: &|label, _| if label < 0 { f64::NAN } else { 0.125 },
            fields: &fields,
        };
        let mut bytes = Vec::new();
        write_points_csv(&mut bytes, &labelled).unwrap();
        let text = String::from_utf8(bytes).unwrap();
        assert_eq!(text, "x,y,z,label,deviation\n1,2.5,-3,4,0.125\n,,,-1,\n0,0,0,-1,\n");
    }
}

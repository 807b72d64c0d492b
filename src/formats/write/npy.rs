use std::io::{self, Write};

use super::labelled::Labelled;

/// Writes labels as a NumPy array (NPY 1.0): one dimension, little-endian int32.
///
/// `numpy.load` reads it back; labels stand in input order, -1 = unassigned.
///
/// # Errors
/// `out` fails.
pub fn write_labels_npy(out: &mut impl Write, labels: &[i32]) -> io::Result<()> {
    write_head(out, "<i4", labels.len())?;
    write_numbers(out, labels, |label| label.to_le_bytes())
}

/// Writes deviations as a NumPy array (NPY 1.0): one dimension, little-endian float64.
///
/// They stand in input order, NaN = unassigned.
///
/// # Errors
/// `out` fails.
pub fn write_deviations_npy(out: &mut (impl Write + Send), labelled: &Labelled) -> io::Result<()> {
    write_head(out, "<f8", labelled.count)?;
    labelled.each(|_, known| {
        let deviations: Vec<f64> = known.iter().map(|known| known.deviation).collect();
        write_numbers(out, &deviations, |deviation| deviation.to_le_bytes())
    })
}

fn write_head(out: &mut impl Write, kind: &str, count: usize) -> io::Result<()> {
    let dictionary =
        format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': ({count},), }}");
    // magic, version, length and dictionary fill a multiple of 64 bytes, the last one a line feed
    let total = (10 + dictionary.len() + 1).next_multiple_of(64);
    let width = total - 11;
    out.write_all(b"\x93NUMPY\x01\x00")?;
    out.write_all(&((total - 10) as u16).to_le_bytes())?;
    writeln!(out, "{dictionary:<width$}")
}

/// Writes numbers in blocks: one call for each would cost more than the numbers.
fn write_numbers<T: Copy, const N: usize>(
    out: &mut impl Write,
    numbers: &[T],
    bytes: impl Fn(T) -> [u8; N],
) -> io::Result<()> {
    const BLOCK: usize = 4096;
    let mut buffer = Vec::with_capacity(N * BLOCK);
    for block in numbers.chunks(BLOCK) {
        buffer.clear();
        buffer.extend(block.iter().flat_map(|number| bytes(*number)));
        out.write_all(&buffer)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::Fields;
    use crate::geometry::{PointCloud, Vec3};

    #[test]
    fn the_header_is_what_numpy_reads() {
        let mut bytes = Vec::new();
        write_labels_npy(&mut bytes, &[0, -1, 70_000]).unwrap();
        assert_eq!(&bytes[..8], b"\x93NUMPY\x01\0");
        let length = usize::from(u16::from_le_bytes([bytes[8], bytes[9]]));
        assert_eq!((10 + length) % 64, 0);
        let header = std::str::from_utf8(&bytes[10..10 + length]).unwrap();
        assert!(header.starts_with("{'descr': '<i4', 'fortran_order': False, 'shape': (3,), }"));
        assert!(header.ends_with('\n'));
        assert_eq!(bytes[10 + length..], [0, 0, 0, 0, 255, 255, 255, 255, 0x70, 0x11, 1, 0]);
    }

    #[test]
    fn deviations_are_doubles() {
        let mut bytes = Vec::new();
        let cloud = PointCloud::from_points(vec![Vec3::zeros(); 2]);
        let labelled = Labelled {
            points: &cloud,
            count: 2,
            grid: None,
            labels: &[0, -1],
            deviation: &|label, _| if label < 0 { f64::NAN } else { 0.5 },
            fields: &Fields::default(),
        };
        write_deviations_npy(&mut bytes, &labelled).unwrap();
        let head = String::from_utf8_lossy(&bytes[10..64]).into_owned();
        assert!(head.contains("'descr': '<f8'") && head.contains("(2,)"), "{head}");
        assert_eq!(bytes[bytes.len() - 16..bytes.len() - 8], 0.5f64.to_le_bytes());
    }

    #[test]
    fn no_labels_are_an_empty_array() {
        let mut bytes = Vec::new();
        write_labels_npy(&mut bytes, &[]).unwrap();
        assert_eq!(bytes.len() % 64, 0);
    }
}

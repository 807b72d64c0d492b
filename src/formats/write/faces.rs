use std::io::{self, Write};

/// Writes one line for each face of a mesh under a line of names: its place in the file, from 0, and its label
/// (-1 = unassigned).
///
/// # Errors
/// `out` fails.
pub fn write_faces_csv(out: &mut impl Write, labels: &[i32]) -> io::Result<()> {
    writeln!(out, "face,label")?;
    for (face, label) in labels.iter().enumerate() {
        writeln!(out, "{face},{label}")?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_face_has_its_line() {
        let mut bytes = Vec::new();
        write_faces_csv(&mut bytes, &[2, -1, 0]).unwrap();
        assert_eq!(bytes, b"face,label\n0,2\n1,-1\n2,0\n");
    }
}

use super::{
    Format, FormatError, Hints, MeshWay, advice::most_kept, e57, las, obj, off, pcd, ply, stl, text,
};

/// Bytes that a point takes once it is read.
pub const BYTES_PER_POINT: u64 = 24;
/// Bytes that a point takes which thinning does not keep: the point that stands for it, and its label.
pub const BYTES_PER_THINNED: u64 = 8;

/// How many points a cloud will have at most, by its header or, where it has none, by its length and
/// lines; nothing is unpacked. Zero where [`super::read`] will refuse the bytes.
///
/// No more points are announced than the bytes can hold, however many the header claims: compressed
/// formats are believed to hold up to 64 a byte.
pub fn announced_points(bytes: &[u8], hints: impl Into<Hints>) -> u64 {
    let hints = hints.into();
    let meshes = hints.meshes;
    let Some(format) = hints.format_of(bytes) else { return 0 };
    let most: Result<u64, FormatError> = match format {
        // the shortest line has two separators and its end
        Format::Xyz | Format::Ptx if text::is_utf16(bytes) => Ok(bytes.len() as u64 / 6 + 1),
        Format::Xyz | Format::Ptx => Ok(text::line_count(bytes)),
        Format::Obj => Ok(obj::most_points(bytes)),
        Format::Off => Ok(off::most_points(bytes)),
        Format::Stl => Ok(stl::most_points(bytes)),
        Format::Ply => ply::most_points(bytes),
        Format::Pcd => pcd::most_points(bytes),
        Format::Las => Ok(las::most_points(bytes)),
        Format::E57 => e57::most_points(bytes),
    };
    let Ok(most) = most else { return 0 };
    if meshes.way != MeshWay::Vertices && has_faces(bytes, format) {
        most.max(meshes.most.get() as u64)
    } else {
        most
    }
}

/// Whether a file is a mesh, whose faces may be sampled.
fn has_faces(bytes: &[u8], format: Format) -> bool {
    match format {
        Format::Stl => true,
        Format::Ply => ply::has_faces(bytes),
        Format::Off => off::has_faces(bytes),
        Format::Obj => obj::has_faces(bytes),
        Format::Xyz | Format::Ptx | Format::Pcd | Format::Las | Format::E57 => false,
    }
}

/// Most bytes that looking at the faces of a mesh takes: two hundred a triangle, for as many as are looked at.
const MOST_FOR_FACES: u64 = 400 << 20;

/// Whether [`super::read`] goes through a file point by point where it thins the cloud; others it reads whole before.
pub fn is_handed_on(bytes: &[u8], hints: impl Into<Hints>) -> bool {
    let hints = hints.into();
    match hints.format_of(bytes) {
        Some(Format::Xyz | Format::Ptx) => !text::is_utf16(bytes),
        Some(Format::Las | Format::E57) => true,
        Some(Format::Ply) => ply::is_handed_on(bytes, &hints.meshes),
        Some(Format::Pcd) => pcd::is_handed_on(bytes),
        _ => false,
    }
}

/// Bytes that reading a cloud takes beside its file and its points: a LAZ file is read from a copy, and so is a text of
/// two bytes a character; a triangle of 50 bytes takes 200 where it is looked at.
pub fn bytes_beside(bytes: &[u8], hints: impl Into<Hints>) -> u64 {
    match hints.into().format_of(bytes) {
        // what is left of the copy without other layers is a copy again
        Some(Format::Las) if las::is_compressed(bytes) => 2 * bytes.len() as u64,
        Some(Format::Las) => 0,
        // a character of two bytes may become one of three
        Some(Format::Xyz | Format::Ptx | Format::Obj) if text::is_utf16(bytes) => {
            2 * bytes.len() as u64
        }
        Some(format) if has_faces(bytes, format) => (4 * bytes.len() as u64).min(MOST_FOR_FACES),
        _ => 0,
    }
}

/// Bytes that a cloud of at most `points` takes once it is read, with what reading it takes beside its file. Where it is
/// thinned, it is gone through once for about how many points that keeps.
pub fn bytes_read(bytes: &[u8], hints: Hints, points: u64) -> u64 {
    let beside = bytes_beside(bytes, hints);
    let of = |points: u64, each: u64| points.saturating_mul(each);
    let (held, thinned) = match hints.thin {
        Some(length) if is_handed_on(bytes, hints) => {
            (most_kept(bytes, hints, length, points), points)
        }
        Some(_) => (points, points),
        None => (points, 0),
    };
    let all = of(held, BYTES_PER_POINT).saturating_add(of(thinned, BYTES_PER_THINNED));
    all.saturating_add(beside)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::{Limits, Meshes, hostile::files, read};

    #[test]
    fn every_format_announces_as_many_points_as_it_has_or_a_few_more() {
        for (format, bytes) in files() {
            let meshes = Meshes { way: MeshWay::Vertices, ..Meshes::default() };
            let hints = Hints { meshes, ..Hints::default() };
            let points = read(&bytes, hints, &Limits::default()).unwrap().input_len as u64;
            let announced = announced_points(&bytes, None);
            let vertices = announced_points(&bytes, hints);
            assert!((points..=5 * points + 8).contains(&vertices), "{format}: {vertices}");
            let most = Meshes::MOST.get() as u64;
            assert!(announced == vertices || announced == most, "{format}: {announced}");
        }
    }

    #[test]
    fn claims_beyond_the_bytes_are_not_passed_on() {
        let ply = "ply\nformat binary_little_endian 1.0\nelement vertex 4000000000\nproperty float x\n\
            property float y\nproperty float z\nend_header\n";
        let pcd = "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 4000000000\n\
            HEIGHT 1\nDATA binary_compressed\n";
        // twelve bytes a point, and 88 times as many of what LZF makes
        for (head, most) in [(ply, 100), (pcd, 8800)] {
            let bytes = [head.as_bytes(), &[0; 1200]].concat();
            assert_eq!(announced_points(&bytes, None), most, "{head}");
        }
        let mut las = vec![0; 400];
        las[..4].copy_from_slice(b"LASF");
        las[24..26].copy_from_slice(&[1, 4]);
        las[94] = 227;
        (las[96], las[105]) = (227, 20);
        las[247..255].fill(255);
        assert_eq!(announced_points(&las, None), 8);
        las[104] = 128;
        assert_eq!(announced_points(&las, None), 64 * 400);
        for format in Format::ALL {
            let most = if format == Format::Stl { Meshes::MOST.get() as u64 } else { 1 };
            assert!(announced_points(b"", Some(format)) <= most, "{format}");
        }
    }
}

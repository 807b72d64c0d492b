use super::{Bounds, Format, FormatError, e57, error::excerpt, las, obj, pcd, ply, stl, xyz};
use crate::geometry::PointCloud;

/// Reads a point cloud; the format is told from the bytes where `format` is `None`.
///
/// Points with a NaN or infinite coordinate are counted and left out; see [`PointCloud`]. `limits` are
/// [`super::Limits`], or [`super::Watched`] where the caller may lose interest.
///
/// # Errors
/// The bytes are no cloud of that format, hold no finite point, or exceed `limits`.
pub fn read(
    bytes: &[u8],
    format: Option<Format>,
    limits: &dyn Bounds,
) -> Result<PointCloud, FormatError> {
    if bytes.is_empty() {
        return Err(FormatError::Empty);
    }
    if let Some(with) = packed(bytes) {
        return Err(FormatError::Compressed { with });
    }
    let unknown = || FormatError::Unknown { start: excerpt(bytes) };
    let format = format.or_else(|| Format::detect(bytes)).ok_or_else(unknown)?;
    let cloud = match format {
        Format::Ply => ply::read(bytes, limits),
        Format::Xyz => xyz::read(bytes, limits),
        Format::Pcd => pcd::read(bytes, limits),
        Format::Las => las::read(bytes, limits),
        Format::E57 => e57::read(bytes, limits),
        Format::Stl => stl::read(bytes, limits),
        Format::Obj => obj::read(bytes, limits),
    }?;
    if cloud.input_len == 0 {
        return Err(FormatError::NoPoints { format });
    }
    if cloud.points.is_empty() {
        return Err(FormatError::NoFinitePoints { points: cloud.input_len });
    }
    Ok(cloud)
}

/// What compressed the bytes, told from their first ones; no format read here begins with those.
fn packed(bytes: &[u8]) -> Option<&'static str> {
    const KNOWN: [(&[u8], &str); 5] = [
        (b"\x1f\x8b\x08", "gzip"),
        (b"\x28\xb5\x2f\xfd", "zstd"),
        (b"PK\x03\x04", "zip"),
        (b"BZh", "bzip2"),
        (b"\xfd7zXZ\0", "xz"),
    ];
    KNOWN.iter().find(|(start, _)| bytes.starts_with(start)).map(|(_, with)| *with)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::Limits;

    fn error(bytes: &[u8], format: Option<Format>) -> FormatError {
        read(bytes, format, &Limits::default()).unwrap_err()
    }

    #[test]
    fn what_holds_no_point_is_refused() {
        assert_eq!(error(b"", None), FormatError::Empty);
        let start = "<html>".to_string();
        assert_eq!(error(b"<html>", None), FormatError::Unknown { start });
        let format = Format::Xyz;
        assert_eq!(error(b"# nothing\n", Some(format)), FormatError::NoPoints { format });
        assert_eq!(
            error(b"nan nan nan\ninf 0 0\n", None),
            FormatError::NoFinitePoints { points: 2 }
        );
    }

    #[test]
    fn compressed_bytes_are_told_whatever_format_is_named() {
        for format in [None, Some(Format::Ply)] {
            let with = "gzip";
            assert_eq!(error(b"\x1f\x8b\x08\0\0", format), FormatError::Compressed { with });
        }
    }
}

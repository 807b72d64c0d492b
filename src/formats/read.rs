use super::{
    Bounds, Format, FormatError, Hints, e57, error::excerpt, foreign, las, obj, off, origin, pcd,
    ply, ptx, stl, text, xyz,
};
use crate::geometry::PointCloud;

/// Reads a point cloud, as `hints` say where the sender knows more than the bytes show.
///
/// Points with a NaN or infinite coordinate are counted and left out; see [`PointCloud`]. `limits` are
/// [`super::Limits`], or [`super::Watched`] where the caller may lose interest.
///
/// # Errors
/// The bytes are no cloud of that format, hold no finite point, or exceed `limits`.
pub fn read(
    bytes: &[u8],
    hints: impl Into<Hints>,
    limits: &dyn Bounds,
) -> Result<PointCloud, FormatError> {
    let hints = hints.into();
    let meshes = hints.meshes;
    if bytes.is_empty() {
        return Err(FormatError::Empty);
    }
    if let Some(with) = packed(bytes) {
        return Err(FormatError::Compressed { with });
    }
    let format = hints.format_of(bytes);
    let decoded = match format {
        None | Some(Format::Xyz | Format::Ptx | Format::Obj) => text::from_utf16(bytes),
        _ => None,
    };
    let bytes = decoded.as_deref().unwrap_or(bytes);
    let told = || text::behind_lines(bytes, hints.skip_lines);
    if matches!(format, None | Some(Format::Xyz))
        && let Some((what, advice)) = foreign::kind(told())
    {
        return Err(FormatError::Foreign { what, advice });
    }
    let format = format.ok_or_else(|| FormatError::Unknown { start: excerpt(bytes) })?;
    check_parameters(&hints, format)?;
    let mut cloud = match format {
        Format::Ply => ply::read(bytes, &meshes, limits),
        Format::Xyz => xyz::read(told(), &hints, limits),
        Format::Ptx => ptx::read(bytes, limits),
        Format::Pcd => pcd::read(bytes, limits),
        Format::Las => las::read(bytes, limits),
        Format::E57 => e57::read(bytes, limits),
        Format::Stl => stl::read(bytes, &meshes, limits),
        Format::Obj => obj::read(bytes, &meshes, limits),
        Format::Off => off::read(bytes, &meshes, limits),
    }?;
    if cloud.input_len == 0 {
        return Err(FormatError::NoPoints { format });
    }
    // E57 has a state for points that are none
    if format != Format::E57 {
        origin::take_holes(&mut cloud);
    }
    if cloud.points.is_empty() {
        return Err(FormatError::NoFinitePoints { points: cloud.input_len });
    }
    Ok(cloud)
}

/// Refuses parameters of texts for what is none.
fn check_parameters(hints: &Hints, format: Format) -> Result<(), FormatError> {
    let given = [("columns", hints.columns.is_some()), ("skip_lines", hints.skip_lines > 0)];
    match given.into_iter().find(|(_, given)| *given) {
        Some((parameter, _)) if format != Format::Xyz => {
            Err(FormatError::ParameterOfText { parameter, format })
        }
        _ => Ok(()),
    }
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
    if bytes.get(257..262) == Some(b"ustar") {
        return Some("tar");
    }
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
        let start = "hello".to_string();
        assert_eq!(error(b"hello", None), FormatError::Unknown { start });
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

    #[test]
    fn texts_of_other_kinds_are_named_also_where_they_are_called_text() {
        let step = b"ISO-10303-21;\n1 2 3\n";
        for format in [None, Some(Format::Xyz)] {
            assert!(matches!(
                error(step, format),
                FormatError::Foreign { what: "a STEP model", .. }
            ));
        }
        assert!(matches!(error(step, Some(Format::Ply)), FormatError::Header { .. }));
    }

    #[test]
    fn columns_are_for_text() {
        let columns = crate::formats::Columns::new([2, 3, 4]);
        let told = |bytes: &[u8], format| {
            read(bytes, Hints { format, columns, ..Hints::default() }, &Limits::default())
        };
        assert_eq!(told(b"9 1 2 3\n", None).unwrap().points[0].x, 1.0);
        let format = Format::Obj;
        let refused = Err(FormatError::ParameterOfText { parameter: "columns", format });
        assert_eq!(told(b"v 1 2 3\n", None), refused);
        assert_eq!(told(b"9 1 2 3\n", Some(format)), refused);
    }
}

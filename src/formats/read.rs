use std::borrow::Cow;

use super::{
    Bounds, Format, FormatError, Hints, e57,
    error::excerpt,
    foreign, las, obj, off, origin, pcd, ply, ptx,
    sink::{About, Sink},
    stl, text, thin, xyz,
};
use crate::geometry::PointCloud;

/// Reads a point cloud, as `hints` say where the sender knows more than the bytes show.
///
/// Points with a NaN or infinite coordinate are counted and left out; see [`PointCloud`]. Where `hints` say so the cloud
/// is thinned as it is read, and most formats are never held whole then. `limits` are
/// [`super::Limits`], or [`super::Watched`] where the caller may lose interest.
///
/// # Errors
/// The bytes are no cloud of that format, hold no finite point, or exceed `limits`.
pub fn read(
    bytes: &[u8],
    hints: impl Into<Hints>,
    limits: &dyn Bounds,
) -> Result<PointCloud, FormatError> {
    let source = Source::open(bytes, hints.into())?;
    let Some(length) = source.hints.thin else { return source.whole(limits) };
    // what is not known before the first pass, such as a grid, is known after it
    let mut is_passed = true;
    let mut pass = |sink: &mut dyn Sink| {
        let about = source.pass(limits, sink)?;
        is_passed = about.is_some();
        Ok(about.unwrap_or_default())
    };
    let cloud = thin::thin(&mut pass, length, source.format != Format::E57, limits);
    if !is_passed {
        return thin::thinned(&source.whole(limits)?, length, limits);
    }
    source.checked(cloud?)
}

/// Gives `sink` all points of a cloud in their order, also those that [`read`] thins out or takes for holes; those without
/// three finite coordinates as they are; what else the file says of them. No more of a file is held at a time than its format
/// needs.
///
/// # Errors
/// As those of [`read`], and those of `sink`.
pub fn each_point(
    bytes: &[u8],
    hints: impl Into<Hints>,
    limits: &dyn Bounds,
    sink: &mut dyn Sink,
) -> Result<About, FormatError> {
    let source = Source::open(bytes, hints.into().whole())?;
    if let Some(about) = source.pass(limits, sink)? {
        return Ok(about);
    }
    let cloud = source.whole(limits)?;
    cloud.each_block(|points| sink.take(points))?;
    Ok(About { grid: cloud.grid, unit: cloud.unit, resolution: cloud.resolution })
}

/// Bytes whose format is known.
struct Source<'a> {
    bytes: Cow<'a, [u8]>,
    format: Format,
    hints: Hints,
}

impl<'a> Source<'a> {
    fn open(bytes: &'a [u8], hints: Hints) -> Result<Self, FormatError> {
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
        let bytes = decoded.map_or(Cow::Borrowed(bytes), Cow::Owned);
        if matches!(format, None | Some(Format::Xyz))
            && let Some((what, advice)) =
                foreign::kind(text::behind_lines(&bytes, hints.skip_lines))
        {
            return Err(FormatError::Foreign { what, advice });
        }
        let format = format.ok_or_else(|| FormatError::Unknown { start: excerpt(&bytes) })?;
        check_parameters(&hints, format)?;
        Ok(Self { bytes, format, hints })
    }

    /// The text behind the lines that are passed over.
    fn told(&self) -> &[u8] {
        text::behind_lines(&self.bytes, self.hints.skip_lines)
    }

    /// Hands the points on as they are read; `None` where they are not read in one go, before any.
    fn pass(&self, limits: &dyn Bounds, sink: &mut dyn Sink) -> Result<Option<About>, FormatError> {
        let (bytes, hints) = (&self.bytes, &self.hints);
        match self.format {
            Format::Ply => ply::pass(bytes, &hints.meshes, limits, sink),
            Format::Xyz => xyz::pass(self.told(), hints, limits, sink).map(Some),
            Format::Pcd => pcd::pass(bytes, limits, sink),
            Format::Las => las::pass(bytes, limits, sink).map(Some),
            Format::Ptx => ptx::pass(bytes, limits, sink).map(Some),
            Format::E57 => e57::pass(bytes, limits, sink).map(Some),
            Format::Stl | Format::Obj | Format::Off => Ok(None),
        }
    }

    /// The cloud with all its points.
    fn whole(&self, limits: &dyn Bounds) -> Result<PointCloud, FormatError> {
        let (bytes, meshes) = (&self.bytes, &self.hints.meshes);
        let mut cloud = match self.format {
            Format::Ply => ply::read(bytes, meshes, limits),
            Format::Xyz => xyz::read(self.told(), &self.hints, limits),
            Format::Ptx => ptx::read(bytes, limits),
            Format::Pcd => pcd::read(bytes, limits),
            Format::Las => las::read(bytes, limits),
            Format::E57 => e57::read(bytes, limits),
            Format::Stl => stl::read(bytes, meshes, limits),
            Format::Obj => obj::read(bytes, meshes, limits),
            Format::Off => off::read(bytes, meshes, limits),
        }?;
        // E57 has a state for points that are none
        if self.format != Format::E57 {
            origin::take_holes(&mut cloud);
        }
        self.checked(cloud)
    }

    /// Refuses a cloud without any point.
    fn checked(&self, cloud: PointCloud) -> Result<PointCloud, FormatError> {
        let (format, points) = (self.format, cloud.input_len);
        match cloud.points.is_empty() {
            true if points == 0 => Err(FormatError::NoPoints { format }),
            true => Err(FormatError::NoFinitePoints { points }),
            false => Ok(cloud),
        }
    }
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

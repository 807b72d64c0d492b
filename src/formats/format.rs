use std::fmt;

use super::{off, ptx, text};

/// A format point clouds are read from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Format {
    /// Stanford polygon file, ascii or binary: the vertices, or samples of the faces.
    Ply,
    /// Lines of text with three coordinates: XYZ, CSV, TSV, PTS.
    Xyz,
    /// Leica PTX: scans with their poses.
    Ptx,
    /// Point Cloud Library file: ascii, binary, binary_compressed.
    Pcd,
    /// ASPRS LAS, compressed (LAZ) or not.
    Las,
    /// ASTM E57.
    E57,
    /// Stereolithography, ascii or binary: the distinct vertices, or samples of the triangles.
    Stl,
    /// Wavefront OBJ: the vertices, or samples of the faces.
    Obj,
    /// Geomview OFF: the vertices, or samples of the faces.
    Off,
}

impl Format {
    /// Every format.
    pub const ALL: [Self; 9] = [
        Self::Ply,
        Self::Xyz,
        Self::Ptx,
        Self::Pcd,
        Self::Las,
        Self::E57,
        Self::Stl,
        Self::Obj,
        Self::Off,
    ];

    /// The name used in settings and answers, for example `ply`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Ply => "ply",
            Self::Xyz => "xyz",
            Self::Ptx => "ptx",
            Self::Pcd => "pcd",
            Self::Las => "las",
            Self::E57 => "e57",
            Self::Stl => "stl",
            Self::Obj => "obj",
            Self::Off => "off",
        }
    }

    /// The endings its file names have, in lower case and without the dot.
    pub fn extensions(self) -> &'static [&'static str] {
        match self {
            Self::Ply => &["ply"],
            Self::Xyz => &["xyz", "csv", "tsv", "txt", "asc", "pts", "xyzn", "xyzrgb"],
            Self::Ptx => &["ptx"],
            Self::Pcd => &["pcd"],
            Self::Las => &["las", "laz"],
            Self::E57 => &["e57"],
            Self::Stl => &["stl"],
            Self::Obj => &["obj"],
            Self::Off => &["off"],
        }
    }

    /// The format of a file name's ending (with or without the dot, any case).
    pub fn from_extension(extension: &str) -> Option<Self> {
        let extension = extension.trim_start_matches('.').to_ascii_lowercase();
        Self::ALL.into_iter().find(|format| format.extensions().contains(&extension.as_str()))
    }

    /// The format a media type names; its parameters are left aside.
    ///
    /// `None` for types that any format may travel under (`application/octet-stream`, `text/plain`):
    /// leave those to [`Format::detect`].
    pub fn from_media_type(media_type: &str) -> Option<Self> {
        let essence = media_type.split(';').next().unwrap_or_default().trim().to_ascii_lowercase();
        let (kind, subtype) = essence.split_once('/')?;
        match (kind, subtype.trim_start_matches("x-")) {
            ("model" | "application", "ply") => Some(Self::Ply),
            ("text", "csv" | "xyz" | "tab-separated-values") => Some(Self::Xyz),
            ("application", "xyz" | "csv") | ("chemical" | "model", "xyz") => Some(Self::Xyz),
            ("model" | "application" | "text", "ptx") => Some(Self::Ptx),
            ("model" | "application", "pcd" | "vnd.pcd") => Some(Self::Pcd),
            ("application", "vnd.las" | "vnd.laszip" | "las" | "laz") => Some(Self::Las),
            ("model" | "application", "e57") => Some(Self::E57),
            ("model" | "application", "stl" | "sla" | "vnd.ms-pki.stl") => Some(Self::Stl),
            ("model" | "application", "obj") | ("text", "prs.wavefront-obj") => Some(Self::Obj),
            ("model" | "application", "off") => Some(Self::Off),
            _ => None,
        }
    }

    /// The format the bytes themselves show, by their first bytes and their first lines.
    pub fn detect(bytes: &[u8]) -> Option<Self> {
        if bytes.starts_with(b"ply\n") || bytes.starts_with(b"ply\r") {
            return Some(Self::Ply);
        }
        if bytes.starts_with(b"LASF") {
            return Some(Self::Las);
        }
        if bytes.starts_with(b"ASTM-E57") {
            return Some(Self::E57);
        }
        if is_binary_stl(bytes) {
            return Some(Self::Stl);
        }
        match text::from_utf16(&bytes[..bytes.len().min(SNIFFED_BYTES)]) {
            Some(head) => text_format(&head),
            None => text_format(bytes),
        }
    }
}

impl fmt::Display for Format {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.name().to_ascii_uppercase())
    }
}

/// A binary STL has no magic number: its length must be that of the triangles it announces.
pub(super) fn is_binary_stl(bytes: &[u8]) -> bool {
    let count = bytes.get(80..84).and_then(|b| b.first_chunk());
    count.is_some_and(|&b| {
        let triangles = u64::from(u32::from_le_bytes(b));
        triangles > 0 && bytes.len() as u64 == 84 + 50 * triangles
    })
}

/// How much of a text is looked at to tell its format.
const SNIFFED_BYTES: usize = 64 * 1024;

fn text_format(bytes: &[u8]) -> Option<Format> {
    let head = text::without_bom(&bytes[..bytes.len().min(SNIFFED_BYTES)]);
    if head.starts_with(b"# .PCD") {
        return Some(Format::Pcd);
    }
    let mut lines = text::lines(head).map(<[u8]>::trim_ascii);
    let first = lines.find(|line| !line.is_empty() && !text::is_comment(line))?;
    match first.split(u8::is_ascii_whitespace).next()? {
        word if off::is_header(word) => Some(Format::Off),
        b"VERSION" | b"FIELDS" => Some(Format::Pcd),
        word if word.eq_ignore_ascii_case(b"solid") => Some(Format::Stl),
        b"v" | b"vn" | b"vt" | b"vp" | b"o" | b"g" | b"s" | b"f" | b"mtllib" | b"usemtl" => {
            Some(Format::Obj)
        }
        _ if head.contains(&0) => None,
        _ if ptx::begins(head) => Some(Format::Ptx),
        // titles, names, units and a point count may come before the first point
        _ => {
            let lines = lines.filter(|line| !line.is_empty() && !text::is_comment(line));
            std::iter::once(first).chain(lines.take(5)).any(text::is_row).then_some(Format::Xyz)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn formats_are_told_from_their_bytes() {
        let cases: [(&[u8], Option<Format>); 15] = [
            (b"ply\nformat ascii 1.0\n", Some(Format::Ply)),
            (b"ply\r\nformat ascii 1.0\r\n", Some(Format::Ply)),
            (b"# .PCD v0.7\nVERSION 0.7\n", Some(Format::Pcd)),
            (b"VERSION 0.7\nFIELDS x y z\nDATA binary\n\0\0\0", Some(Format::Pcd)),
            (b"LASF\0\0", Some(Format::Las)),
            (b"ASTM-E57\x01", Some(Format::E57)),
            (b"solid cube\n facet normal 0 0 1\n", Some(Format::Stl)),
            (b"# made by hand\nv 1 2 3\n", Some(Format::Obj)),
            (b"1 2 3\n", Some(Format::Xyz)),
            (b"\xef\xbb\xbfx;y;z\n1;2;3\n", Some(Format::Xyz)),
            (b"# comment\n\n3\n1,2,3\n", Some(Format::Xyz)),
            (b"# comment\r3\r1,2,3\r", Some(Format::Xyz)),
            (b"<html>\n<body>\nhello\n", None),
            (b"\x89PNG\r\n\x1a\n\0\0", None),
            (b"", None),
        ];
        for (bytes, format) in cases {
            assert_eq!(Format::detect(bytes), format, "{}", bytes.escape_ascii());
        }
        let mut stl = vec![0; 84 + 100];
        stl[80] = 2;
        assert_eq!(Format::detect(&stl), Some(Format::Stl));
    }

    #[test]
    fn formats_are_named_by_extension_and_media_type() {
        for format in Format::ALL {
            assert_eq!(Format::from_extension(format.name()), Some(format));
        }
        assert_eq!(Format::from_extension(".LAZ"), Some(Format::Las));
        assert_eq!(Format::from_media_type("text/csv; charset=utf-8"), Some(Format::Xyz));
        assert_eq!(Format::from_media_type("Model/STL"), Some(Format::Stl));
        assert_eq!(Format::from_media_type("application/x-ply"), Some(Format::Ply));
        assert_eq!(Format::from_media_type("application/octet-stream"), None);
    }
}

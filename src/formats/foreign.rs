//! Texts of other kinds, whose numbers must not be taken for points.

use super::{off, text};

/// How much of a text is looked at.
const HEAD_BYTES: usize = 64 * 1024;

const SAMPLE: &str =
    "convert it to STL, OBJ, OFF or PLY, or sample points on its surfaces and send those";
const OFF: &str = "name its format, off, or send its vertices alone as text";
const FACES: &str = "convert it to OFF or OBJ, or leave out its faces";
const CONVERT: &str = "convert it to one of the formats read";

/// A kind of text: what it is, and what to send instead.
pub(super) type Kind = (&'static str, &'static str);

/// Kinds told by the first words of their first line.
const STARTS: [(&[u8], Kind); 19] = [
    (b"# vtk DataFile", ("a VTK file", CONVERT)),
    (b"#VRML", ("a VRML scene", SAMPLE)),
    (b"#Inventor", ("an Inventor scene", SAMPLE)),
    (b"ncols", ("an ESRI grid", CONVERT)),
    (b"NCOLS", ("an ESRI grid", CONVERT)),
    (b"DSAA", ("a Surfer grid", CONVERT)),
    (b"ISO-10303-21", ("a STEP model", SAMPLE)),
    (b"$MeshFormat", ("a Gmsh mesh", SAMPLE)),
    (b"MeshVersionFormatted", ("a Medit mesh", SAMPLE)),
    (b"*HEADING", ("an Abaqus mesh", SAMPLE)),
    (b"*Heading", ("an Abaqus mesh", SAMPLE)),
    (b"*NODE", ("an Abaqus mesh", SAMPLE)),
    (b"*Node", ("an Abaqus mesh", SAMPLE)),
    (b"HEADER    ", ("a PDB molecule", CONVERT)),
    (b"ATOM  ", ("a PDB molecule", CONVERT)),
    (b"<", ("XML or HTML", CONVERT)),
    (b"{\\rtf", ("a document", CONVERT)),
    (b"{", ("JSON", CONVERT)),
    (b"[", ("JSON", CONVERT)),
];

/// What a text is, if it is of a known kind that holds no cloud, or holds one in a way that is not read.
pub(super) fn kind(bytes: &[u8]) -> Option<Kind> {
    let text = text::without_bom(bytes);
    let head = &text[..text.len().min(HEAD_BYTES)];
    let first = head.trim_ascii_start();
    if let Some((_, kind)) = STARTS.iter().find(|(start, _)| first.starts_with(start)) {
        return Some(*kind);
    }
    let told = text::lines(head).map(<[u8]>::trim_ascii);
    let told = told.filter(|line| !line.is_empty() && !text::is_comment(line));
    let rows: Vec<Vec<&[u8]>> = told.take(30).map(fields).collect();
    if is_off(rows.first()?) {
        return Some(("an OFF mesh", OFF));
    }
    if is_dxf(&rows) {
        return Some(("a DXF drawing", CONVERT));
    }
    if is_node(&rows) {
        return Some((
            "a TetGen node file",
            "pass over its first line and name its columns: skip_lines=1, columns=2,3,4",
        ));
    }
    if is_off_body(text, &rows) {
        return Some(("an OFF mesh without its first word", OFF));
    }
    let is_row = |row: &&Vec<&[u8]>| row.iter().filter(|f| text::number(f).is_some()).count() >= 3;
    has_faces(text, rows.iter().find(is_row)?).then_some(("a mesh with faces", FACES))
}

fn fields(line: &[u8]) -> Vec<&[u8]> {
    line.split(u8::is_ascii_whitespace).filter(|field| !field.is_empty()).collect()
}

fn count(field: &[u8]) -> Option<u64> {
    std::str::from_utf8(field).ok()?.parse().ok()
}

/// The numbers of a line that has nothing else.
fn counts(row: &[&[u8]]) -> Option<Vec<u64>> {
    row.iter().map(|field| count(field)).collect()
}

/// Whether every one of `n` fields is a number.
fn has_numbers(row: &[&[u8]], n: usize) -> bool {
    row.len() == n && row.iter().all(|field| text::number(field).is_some())
}

/// `OFF`, with letters before it for what each vertex has; counts may stand in the same line.
fn is_off(first: &[&[u8]]) -> bool {
    let [word, counts @ ..] = first else { return false };
    off::is_header(word) && counts.iter().all(|c| count(c).is_some() || *c == b"BINARY")
}

/// `0` and `SECTION`, pairs of a code and a value.
fn is_dxf(rows: &[Vec<&[u8]>]) -> bool {
    matches!(rows, [zero, section, ..]
        if zero[..] == [b"0".as_slice()] && section[..] == [b"SECTION".as_slice()])
}

/// Points, the dimension 3, attributes and markers; then rows that begin with 0 or 1 and count up.
fn is_node(rows: &[Vec<&[u8]>]) -> bool {
    let [first, rest @ ..] = rows else { return false };
    let first = counts(first).unwrap_or_default();
    let [_, 3, more @ ..] = first.as_slice() else { return false };
    let columns = more.iter().fold(4u64, |sum, n| sum.saturating_add(*n));
    let numbered = |(i, row): (usize, &Vec<&[u8]>)| {
        let begin = rest.first().and_then(|row| count(row.first()?)).filter(|n| *n < 2);
        row.len() as u64 == columns
            && begin.is_some_and(|begin| count(row[0]) == Some(begin + i as u64))
    };
    rest.len() >= 2 && more.len() <= 2 && rest.iter().enumerate().all(numbered)
}

/// The last line with anything but a comment in it, if it is not the only one.
fn last_row(text: &[u8]) -> Option<Vec<&[u8]>> {
    let tail = &text[text.len().saturating_sub(1024)..];
    let lines: Vec<_> = text::lines(tail).map(<[u8]>::trim_ascii).collect();
    let told = |line: &&&[u8]| !line.is_empty() && !text::is_comment(line);
    lines.iter().rev().find(told).filter(|_| lines.len() > 1).map(|line| fields(line))
}

/// How many corners a face has, 3 to 8, if a row is one: their count, their vertices, and a colour of up to
/// four numbers.
fn corners(row: &[&[u8]]) -> Option<usize> {
    let corners = count(row.first()?).filter(|n| (3..=8).contains(n))? as usize;
    let (face, colour) = row.split_at_checked(1 + corners)?;
    let coloured = matches!(colour.len(), 0 | 1 | 3 | 4) && has_numbers(colour, colour.len());
    (counts(face).is_some() && coloured).then_some(corners)
}

/// Whether the last line is a face, and the first row is none.
fn has_faces(text: &[u8], first: &[&[u8]]) -> bool {
    let Some(last) = last_row(text).filter(|last| last.len() != first.len()) else { return false };
    let Some(corners) = corners(&last) else { return false };
    // a face with a colour may be a point with more columns, and one without the point of a grid
    match counts(first) {
        None => last.len() == corners + 1 || first.len() == 3,
        Some(numbers) => last.len() == corners + 1 && numbers.len() == 3,
    }
}

/// Vertices, faces and, not always, edges; then as many lines, three coordinates or more in the first of
/// them, and a face in the last where there are faces.
fn is_off_body(text: &[u8], rows: &[Vec<&[u8]>]) -> bool {
    /// Fewer points with their number before them may be points all.
    const FEWEST: u64 = 4;
    let [first, second, ..] = rows else { return false };
    let first = counts(first).unwrap_or_default();
    let (2..=3, [vertices, faces, ..]) = (first.len(), first.as_slice()) else { return false };
    let is_point = second.len() >= 3 && second[..3].iter().all(|f| text::number(f).is_some());
    if *vertices < FEWEST || !is_point {
        return false;
    }
    let told = text::lines(text).map(<[u8]>::trim_ascii);
    let told = told.filter(|line| !line.is_empty() && !text::is_comment(line)).count() as u64;
    let face = || last_row(text).is_some_and(|last| corners(&last).is_some());
    told - 1 == vertices.saturating_add(*faces) && (*faces == 0 || face())
}

#[cfg(test)]
mod tests {
    use super::*;

    const POINTS: &str = "0.1 0.2 0.3\n1.5 2.5 3.5\n4 5 6\n";

    fn name(text: &str) -> Option<&'static str> {
        kind(text.as_bytes()).map(|(name, _)| name)
    }

    #[test]
    fn meshes_and_other_texts_are_named() {
        for (text, what) in [
            (format!("OFF\n3 1 0\n{POINTS}3 0 1 2\n"), "an OFF mesh"),
            (format!("OFF 3 1 0\r\n{POINTS}3 0 1 2\n"), "an OFF mesh"),
            (format!("# made by hand\nCOFF\n3 1 0\n{POINTS}"), "an OFF mesh"),
            (format!("NOFF\n3 1 0\n{POINTS}"), "an OFF mesh"),
            (format!("4 1\n{POINTS}7 8 9\n3 0 1 2\n"), "an OFF mesh without its first word"),
            (format!("4 0 0\n{POINTS}7 8 9\n"), "an OFF mesh without its first word"),
            (
                format!("# a\n4 2 5\n\n{POINTS}7 8 9\n3 0 1 2 255 0 0\n4 0 1 2 3  0 0 9 255\n"),
                "an OFF mesh without its first word",
            ),
            (
                "4 1 0\n0 0 1 9 9 9\n0 1 0 9 9 9\n1 0 0 9 9 9\n1 1 1 9 9 9\n3 0 1 2 0.5 0.5 1\n# end\n"
                    .into(),
                "an OFF mesh without its first word",
            ),
            // without the counts too
            (format!("{POINTS}3 0 1 2 255 0 0\n"), "a mesh with faces"),
            (format!("{POINTS}3 0 1 2 0.5 0.25 0 1\n"), "a mesh with faces"),
            (format!("3 1 0\n{POINTS}3 0 1 2\n"), "a mesh with faces"),
            (
                format!("# vtk DataFile Version 3.0\nx\nASCII\nPOINTS 3 float\n{POINTS}"),
                "a VTK file",
            ),
            (format!("#VRML V2.0 utf8\n{POINTS}"), "a VRML scene"),
            ("ncols 3\nnrows 3\n1 2 3\n".into(), "an ESRI grid"),
            ("<svg><path d=\"\n1 2 3\n\"/></svg>".into(), "XML or HTML"),
            ("\u{feff} [[1,2,3],\n[4,5,6]]".into(), "JSON"),
            ("  0\nSECTION\n  2\nENTITIES\n".into(), "a DXF drawing"),
            ("3 3 0 0\n1 0.1 0.2 0.3\n2 1 2 3\n3 4 5 6\n".into(), "a TetGen node file"),
            ("2 3 1 1\n0 0.1 0.2 0.3 7 1\n1 1 2 3 7 1\n# end\n".into(), "a TetGen node file"),
        ] {
            assert_eq!(name(&text), Some(what), "{text}");
        }
    }

    #[test]
    fn clouds_are_of_no_other_kind() {
        for text in [
            POINTS.to_owned(),
            format!("3\n{POINTS}"),
            format!("0\n3\n{POINTS}"),
            format!("# a cloud\n{POINTS}"),
            "3 3 0 0\n1 5 2 3\n".to_owned(),
            "3 3 3\n3 1 2 3\n".repeat(9) + "3 1 2 3 4\n",
            "3 1 2 3\n3 4 5 6\n".to_owned(),
            "OFFICE 1 2\n1 2 3\n".to_owned(),
            format!("999\n{POINTS}"),
            format!("5 0 0\n{POINTS}7 8 9\n"),
            format!("4 1 0\n{POINTS}7 8 9\n7 7 7\n"),
            "0.5 1 2 3 4 5 6 7\n3 1 2 3 255 0 0\n".to_owned(),
            "1 0 0\n0 1 0\n".to_owned(),
            "//x y z intensity of light\n0.5 1 2 3\n3 1 2 3\n".to_owned(),
            String::new(),
        ] {
            assert_eq!(name(&text), None, "{text}");
        }
    }
}

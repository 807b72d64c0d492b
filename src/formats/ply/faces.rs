//! The faces of a mesh, to tell CAD meshes from scans. What is wrong with them is passed over: nobody
//! asked for them.

use super::super::{Format, mesh::Triangles, scalar::Endian, text::Words};
use super::{
    ascii, binary,
    header::{Element, Encoding, Header, Kind},
};

/// The triangles of the faces in a file with `vertices` vertices, as far as they are of use.
pub(super) fn read(bytes: &[u8], header: &Header, vertices: usize) -> Triangles {
    let mut triangles = Triangles::default();
    let faces = header.elements.iter().position(|e| e.is_named("face") && e.count > 0);
    if let Some(element) = faces.filter(|_| triangles.are_wanted(vertices as u64)) {
        let read = match header.encoding {
            Encoding::Ascii => ascii_faces(bytes, header, element, &mut triangles),
            Encoding::Binary(endian) => {
                binary_faces(bytes, header, element, endian, &mut triangles)
            }
        };
        // the faces read before the first that is cut off do
        let _ = read;
    }
    triangles
}

/// The place of the list of corners among the properties.
fn corners_of(element: &Element) -> Option<usize> {
    element.properties.iter().position(|property| {
        let named = property.is_named("vertex_indices") || property.is_named("vertex_index");
        named && matches!(property.kind, Kind::List { .. })
    })
}

fn binary_faces(
    bytes: &[u8],
    header: &Header,
    element: usize,
    endian: Endian,
    triangles: &mut Triangles,
) -> Option<()> {
    let mut body = binary::Body::new(&bytes[header.body..], endian);
    header.elements[..element].iter().try_for_each(|other| body.skip(other))?;
    let element = &header.elements[element];
    let corners = corners_of(element)?;
    let mut face = Vec::new();
    for _ in 0..element.count {
        for (place, property) in element.properties.iter().enumerate() {
            match property.kind {
                Kind::List { count, item } if place == corners => {
                    body.list(count, item, &mut face)?
                }
                kind => body.property(kind).map(drop)?,
            }
        }
        triangles.push(&face);
        if !triangles.are_wanted(0) {
            break;
        }
    }
    Some(())
}

fn ascii_faces(
    bytes: &[u8],
    header: &Header,
    element: usize,
    triangles: &mut Triangles,
) -> Option<()> {
    let mut words = Words::new(Format::Ply, bytes, header.body);
    for other in &header.elements[..element] {
        ascii::skip(&mut words, other).ok()??;
    }
    let element = &header.elements[element];
    let corners = corners_of(element)?;
    let mut face = Vec::new();
    for _ in 0..element.count {
        for (place, property) in element.properties.iter().enumerate() {
            let word = words.next()?;
            if place == corners {
                face.clear();
                for _ in 0..number(word)? {
                    face.push(number(words.next()?)?);
                }
            } else {
                ascii::skip_list(&mut words, property.kind, word).ok()??;
            }
        }
        triangles.push(&face);
        if !triangles.are_wanted(0) {
            break;
        }
    }
    Some(())
}

fn number(word: &[u8]) -> Option<u32> {
    std::str::from_utf8(word).ok()?.parse().ok()
}

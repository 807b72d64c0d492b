//! The faces of a mesh. A list cut short ends them: a cloud's points are all there, whatever follows.

use super::super::{Format, mesh::Faces, scalar::Endian, text::Words};
use super::{
    ascii, binary,
    header::{Element, Encoding, Header, Kind},
};

/// The faces in a file, as far as they are of use.
pub(super) fn read(bytes: &[u8], header: &Header) -> Faces {
    let mut faces = Faces::default();
    if let Some(element) = element(header) {
        let read = match header.encoding {
            Encoding::Ascii => ascii_faces(bytes, header, element, &mut faces),
            Encoding::Binary(endian) => binary_faces(bytes, header, element, endian, &mut faces),
        };
        // the faces read before the first that is cut off do
        let _ = read;
        if !faces.are_wanted() {
            faces.set_count(header.elements[element].count);
        }
    }
    faces
}

/// The place of the faces among the elements.
pub(super) fn element(header: &Header) -> Option<usize> {
    header.elements.iter().position(|e| e.is_named("face") && e.count > 0)
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
    faces: &mut Faces,
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
        faces.push(&face);
        if !faces.are_wanted() {
            break;
        }
    }
    Some(())
}

fn ascii_faces(bytes: &[u8], header: &Header, element: usize, faces: &mut Faces) -> Option<()> {
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
        faces.push(&face);
        if !faces.are_wanted() {
            break;
        }
    }
    Some(())
}

fn number(word: &[u8]) -> Option<u32> {
    std::str::from_utf8(word).ok()?.parse().ok()
}

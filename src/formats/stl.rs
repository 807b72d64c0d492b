//! STL, ascii and binary: the corners of the triangles, each place once, and the triangles.
//!
//! A corner comes again in every triangle that meets there. A cloud with each point six times would
//! mislead every count, so equal corners become one point, in the order of their first appearance.

use std::hash::{BuildHasher, RandomState};

use super::{
    Bounds, Format, FormatError,
    format::is_binary_stl,
    memory::room_for,
    mesh::{self, Faces, Meshes},
    text::Words,
};
use crate::geometry::{PointCloud, Vec3};

/// Bytes before the first triangle, and of a triangle.
const HEADER: usize = 84;
const TRIANGLE: usize = 50;
/// Bytes of an ascii corner: `vertex 0 0 0` and a space.
const ASCII_CORNER: usize = 13;

/// Reads the distinct corners, or samples of the triangles.
pub(super) fn read(
    bytes: &[u8],
    how: &Meshes,
    limits: &dyn Bounds,
) -> Result<PointCloud, FormatError> {
    let mut corners = Corners::default();
    if is_ascii(bytes) {
        ascii(bytes, &mut corners, limits)
    } else {
        binary(bytes, &mut corners, limits)
    }?;
    mesh::cloud(corners.points, &corners.faces, how, limits)
}

/// The most corners that the bytes can hold.
pub(super) fn most_points(bytes: &[u8]) -> u64 {
    let corners = if is_ascii(bytes) {
        bytes.len() / ASCII_CORNER
    } else {
        bytes.len().saturating_sub(HEADER) / TRIANGLE * 3
    };
    corners as u64
}

/// Many binary files begin with "solid" too: the length decides first.
fn is_ascii(bytes: &[u8]) -> bool {
    let word = bytes.trim_ascii_start().get(..5).unwrap_or_default();
    !is_binary_stl(bytes) && word.eq_ignore_ascii_case(b"solid")
}

fn truncated(announced: u64, found: u64) -> FormatError {
    FormatError::Truncated { format: Format::Stl, announced, found }
}

/// The distinct corners, in the order of their first appearance, and their triangles.
#[derive(Default)]
struct Corners {
    points: Vec<Vec3>,
    places: Places,
    faces: Faces,
}

impl Corners {
    fn add(&mut self, triangle: [Vec3; 3], limits: &dyn Bounds) -> Result<(), FormatError> {
        let mut places = [0; 3];
        for (place, corner) in places.iter_mut().zip(triangle) {
            *place = self.place(corner, limits)?;
        }
        self.faces.push(&places);
        Ok(())
    }

    fn place(&mut self, corner: Vec3, limits: &dyn Bounds) -> Result<u32, FormatError> {
        self.places.make_room(&self.points)?;
        let slot = self.places.slot(&corner, &self.points);
        if *slot == FREE {
            limits.check(self.points.len() as u64 + 1)?;
            // the limit is below 2^32 points
            *slot = self.points.len() as u32;
            self.points.push(corner);
        }
        Ok(*slot)
    }
}

/// The mark of a slot without a corner.
const FREE: u32 = u32::MAX;

/// Where each corner stands among the points: a hash table of places alone, for a map with the corners
/// themselves would take four times as much memory as the points.
#[derive(Default)]
struct Places {
    slots: Vec<u32>,
    hash: RandomState,
}

impl Places {
    /// Makes sure that one corner more leaves half of the slots free.
    fn make_room(&mut self, points: &[Vec3]) -> Result<(), FormatError> {
        if self.slots.len() > 2 * points.len() {
            return Ok(());
        }
        let len = (4 * points.len()).max(1 << 10).next_power_of_two();
        self.slots = Vec::new();
        self.slots = room_for(len as u64)?;
        self.slots.resize(len, FREE);
        for (place, corner) in (0..).zip(points) {
            *self.slot(corner, points) = place;
        }
        Ok(())
    }

    /// The slot of a corner, or the free one where it belongs.
    fn slot(&mut self, corner: &Vec3, points: &[Vec3]) -> &mut u32 {
        let mask = self.slots.len() - 1;
        let mut at = self.hash.hash_one(key(corner)) as usize & mask;
        while self.slots[at] != FREE && key(&points[self.slots[at] as usize]) != key(corner) {
            at = (at + 1) & mask;
        }
        &mut self.slots[at]
    }
}

/// What two corners at one place have in common; adding zero makes -0 and 0 one.
fn key(corner: &Vec3) -> [u64; 3] {
    corner.map(|x| (x + 0.0).to_bits()).into()
}

fn binary(bytes: &[u8], corners: &mut Corners, limits: &dyn Bounds) -> Result<(), FormatError> {
    let count = bytes.get(80..HEADER).and_then(|b| b.first_chunk());
    let count = count.map(|&b| u32::from_le_bytes(b)).ok_or_else(|| truncated(1, 0))? as usize;
    let body = &bytes[HEADER..];
    if count > body.len() / TRIANGLE {
        return Err(truncated(3 * count as u64, 3 * (body.len() / TRIANGLE) as u64));
    }
    // a closed mesh has two triangles a corner
    corners.points = room_for((count as u64 / 2).min(limits.most()))?;
    for triangle in body.chunks_exact(TRIANGLE).take(count) {
        let number =
            |i: usize| triangle[12 + 4 * i..].first_chunk().map_or(0.0, |&b| f32::from_le_bytes(b));
        let corner =
            |i: usize| Vec3::new(number(i).into(), number(i + 1).into(), number(i + 2).into());
        corners.add([corner(0), corner(3), corner(6)], limits)?;
    }
    Ok(())
}

fn ascii(bytes: &[u8], corners: &mut Corners, limits: &dyn Bounds) -> Result<(), FormatError> {
    let mut words = Words::new(Format::Stl, bytes, 0);
    let (mut triangle, mut found) = ([Vec3::zeros(); 3], 0u64);
    while let Some(word) = words.next() {
        if word.eq_ignore_ascii_case(b"vertex") {
            let corner = &mut triangle[(found % 3) as usize];
            for axis in 0..3 {
                let word = words.next().ok_or_else(|| truncated(found + 1, found))?;
                corner[axis] = words.number(word)?;
            }
            found += 1;
            if found.is_multiple_of(3) {
                corners.add(triangle, limits)?;
            }
        }
    }
    // a triangle cut short has corners all the same
    for corner in &triangle[..(found % 3) as usize] {
        corners.place(*corner, limits)?;
    }
    Ok(())
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::formats::{Limits, MeshWay, mesh::tests::turned};

    const CORNERS: [[f32; 3]; 6] = [
        [0.0, 0.0, 0.0],
        [1.5, 0.0, 0.0],
        [0.0, 1.0, 0.0],
        [1.5, 0.0, -0.0],
        [1.5, 1.0, 0.0],
        [0.0, 1.0, 0.0],
    ];

    pub(in crate::formats) fn binary_file() -> Vec<u8> {
        let mut file = b"solid in name only".to_vec();
        file.resize(80, b' ');
        file.extend(2u32.to_le_bytes());
        for triangle in CORNERS.chunks(3) {
            file.extend([0; 12]);
            file.extend(triangle.iter().flatten().flat_map(|x| x.to_le_bytes()));
            file.extend([0; 2]);
        }
        file
    }

    pub(in crate::formats) fn ascii_file() -> String {
        let triangle = |c: &[[f32; 3]]| {
            let vertex = |p: &[f32; 3]| format!("   vertex {} {} {:e}\n", p[0], p[1], p[2]);
            let vertices: String = c.iter().map(vertex).collect();
            format!(" facet normal 0 0 1\n  outer loop\n{vertices}  endloop\n endfacet\n")
        };
        let body: String = CORNERS.chunks(3).map(triangle).collect();
        format!("solid plate\n{body}endsolid plate\n")
    }

    #[test]
    fn ascii_and_binary_give_each_corner_once() {
        let expected = [[0.0, 0.0, 0.0], [1.5, 0.0, 0.0], [0.0, 1.0, 0.0], [1.5, 1.0, 0.0]];
        for file in [binary_file(), ascii_file().into_bytes()] {
            assert_eq!(Format::detect(&file), Some(Format::Stl));
            let how = Meshes { way: MeshWay::Vertices, ..Meshes::default() };
            let cloud = read(&file, &how, &Limits::of(4)).unwrap();
            let points: Vec<[f64; 3]> = cloud.points.iter().map(|&p| p.into()).collect();
            assert_eq!(points, expected);
            assert_eq!(
                read(&file, &how, &Limits::of(3)),
                Err(FormatError::TooManyPoints { points: 4, limit: 3 })
            );
        }
    }

    #[test]
    fn a_count_beyond_the_bytes_is_refused() {
        let mut file = binary_file();
        file[..5].copy_from_slice(b"rigid");
        file[83] = 255;
        let announced = 3 * (255 * (1 << 24) + 2);
        assert_eq!(
            read(&file, &Meshes::default(), &Limits::default()),
            Err(FormatError::Truncated { format: Format::Stl, announced, found: 6 })
        );
    }

    #[test]
    fn a_cad_mesh_is_sampled_and_words_may_be_in_capitals() {
        let (points, faces) = turned(48, 10.0, 40.0, 10.0);
        let mut text = String::from("solid part\n");
        for face in faces {
            text += "facet normal 0 0 0\nouter loop\n";
            for p in face.map(|i| points[i as usize]) {
                text += &format!("vertex {:e} {:e} {:e}\n", p.x, p.y, p.z);
            }
            text += "endloop\nendfacet\n";
        }
        for text in [text.clone(), text.to_uppercase()] {
            assert_eq!(Format::detect(text.as_bytes()), Some(Format::Stl));
            let cloud = read(text.as_bytes(), &Meshes::default(), &Limits::default()).unwrap();
            let mesh = cloud.mesh.unwrap();
            assert_eq!((mesh.vertices, mesh.faces), (98, 192));
            assert!(mesh.samples.is_some());
        }
    }
}

//! Meshes as CAD programs make them, with the true surface of each face: parts turned on a lathe, and plates with bores,
//! cut into facets whose vertices lie on the surface and that undercut it by a chord error.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use conicoid::geometry::Vec3;

/// A piece of a turned part's profile, in radius and height.
#[derive(Clone, Copy)]
pub enum Piece {
    /// A straight line from the end of the piece before.
    Line([f64; 2]),
    /// An arc about a centre, from one angle to another.
    Arc([f64; 2], f64, [f64; 2]),
}

/// A mesh and which surface each face is of.
#[derive(Default)]
pub struct Facets {
    pub points: Vec<Vec3>,
    /// Corners of each face, three or four.
    pub faces: Vec<Vec<usize>>,
    pub truth: Vec<usize>,
}

/// Steps of an arc with that chord error.
fn steps(radius: f64, angle: f64, chord_error: f64) -> usize {
    let step = 2.0 * (1.0 - (chord_error / radius).min(0.5)).acos();
    (angle / step.min(PI / 8.0)).ceil() as usize
}

impl Facets {
    /// A part turned about the z axis; each piece of the profile is a surface of its own.
    pub fn turned(begin: [f64; 2], profile: &[Piece], chord_error: f64) -> Self {
        let mut rows = vec![begin];
        let mut of_row = Vec::new();
        for (surface, piece) in profile.iter().enumerate() {
            match *piece {
                Piece::Line(end) => rows.push(end),
                Piece::Arc([r, z], radius, [from, to]) => {
                    let n = steps(radius, (to - from).abs(), chord_error);
                    rows.extend((1..=n).map(|k| {
                        let angle = from + (to - from) * k as f64 / n as f64;
                        [(r + radius * angle.cos()).max(0.0), z + radius * angle.sin()]
                    }));
                }
            }
            of_row.resize(rows.len() - 1, surface);
        }
        let widest = rows.iter().map(|row| row[0]).fold(0.0, f64::max);
        let sides = steps(widest, TAU, chord_error);
        let mut mesh = Self::default();
        let at = |[r, z]: [f64; 2], side: usize| {
            let (sin, cos) = (TAU * (side % sides) as f64 / sides as f64).sin_cos();
            Vec3::new(r * cos, r * sin, z)
        };
        for (pair, surface) in rows.windows(2).zip(of_row) {
            for side in 0..sides {
                let corners =
                    [(pair[0], side), (pair[0], side + 1), (pair[1], side + 1), (pair[1], side)];
                let mut corners: Vec<Vec3> = corners.map(|(row, side)| at(row, side)).into();
                corners.dedup_by(|a, b| (*a - *b).norm() < 1e-9);
                if (corners[0] - corners[corners.len() - 1]).norm() < 1e-9 {
                    corners.pop();
                }
                mesh.push(&corners, surface);
            }
        }
        mesh
    }

    /// Square cells in a row, each with a bore through its middle: walls, top and bottom are surfaces 0 to 5.
    pub fn plate(side: f64, thickness: f64, bores: &[f64], chord_error: f64) -> Self {
        let mut mesh = Self::default();
        for (cell, &radius) in bores.iter().enumerate() {
            let n = steps(radius, FRAC_PI_2, chord_error);
            let middle = Vec3::new(side * (cell as f64 + 0.5), side / 2.0, 0.0);
            let at = |k: usize, out: bool, z: f64| {
                let (sin, cos) = (TAU * k as f64 / (4 * n) as f64 + PI / 4.0).sin_cos();
                let reach = if out { side / 2.0 / sin.abs().max(cos.abs()) } else { radius };
                middle + Vec3::new(reach * cos, reach * sin, z)
            };
            for k in 0..4 * n {
                for (surface, z) in [(4, 0.0), (5, thickness)] {
                    mesh.push(
                        &[at(k, false, z), at(k + 1, false, z), at(k + 1, true, z), at(k, true, z)],
                        surface,
                    );
                }
                let bore = [
                    at(k, false, 0.0),
                    at(k + 1, false, 0.0),
                    at(k + 1, false, thickness),
                    at(k, false, thickness),
                ];
                mesh.push(&bore, 6 + cell);
                // the wall beside: north, west, south, east
                let wall = k / n;
                let inner = wall == 1 && cell > 0 || wall == 3 && cell + 1 < bores.len();
                if !inner {
                    mesh.push(
                        &[
                            at(k, true, 0.0),
                            at(k + 1, true, 0.0),
                            at(k + 1, true, thickness),
                            at(k, true, thickness),
                        ],
                        wall,
                    );
                }
            }
        }
        mesh
    }

    fn push(&mut self, corners: &[Vec3], surface: usize) {
        let places = corners.iter().map(|corner| {
            let near = |p: &Vec3| (p - corner).norm() < 1e-9;
            let recent = self.points.len().saturating_sub(4096);
            let known = self.points[recent..].iter().position(near).map(|place| place + recent);
            known.unwrap_or_else(|| {
                self.points.push(*corner);
                self.points.len() - 1
            })
        });
        let face = places.collect();
        self.faces.push(face);
        self.truth.push(surface);
    }

    /// Each face's area.
    pub fn areas(&self) -> Vec<f64> {
        let area = |face: &Vec<usize>| {
            let at = |k: usize| self.points[face[k]];
            let cross = |k| (at(k) - at(0)).cross(&(at(k + 1) - at(0)));
            (1..face.len() - 1).map(cross).sum::<Vec3>().norm() / 2.0
        };
        self.faces.iter().map(area).collect()
    }

    /// The same with triangles alone.
    pub fn cut(&self) -> Self {
        let mut cut = Self { points: self.points.clone(), ..Self::default() };
        for (face, surface) in self.faces.iter().zip(&self.truth) {
            for k in 1..face.len() - 1 {
                cut.faces.push(vec![face[0], face[k], face[k + 1]]);
                cut.truth.push(*surface);
            }
        }
        cut
    }

    /// A binary STL file of faces that are triangles.
    pub fn stl(&self) -> Vec<u8> {
        let mut file = vec![b' '; 80];
        file.extend((self.faces.len() as u32).to_le_bytes());
        for face in &self.faces {
            file.extend([0; 12]);
            let corners = face.iter().flat_map(|&i| self.points[i].iter().copied());
            file.extend(corners.flat_map(|x| (x as f32).to_le_bytes()));
            file.extend([0; 2]);
        }
        file
    }

    /// An OBJ file; every other face counts its corners from the last vertex, and goes round the other way.
    pub fn obj(&self) -> String {
        let mut text = String::from("o part\n");
        self.points.iter().for_each(|p| text += &format!("v {} {} {}\n", p.x, p.y, p.z));
        for (k, face) in self.faces.iter().enumerate() {
            let mut words: Vec<String> = if k % 2 == 0 {
                face.iter().map(|i| format!("{}//1", i + 1)).collect()
            } else {
                face.iter().map(|i| format!("{}", *i as i64 - self.points.len() as i64)).collect()
            };
            if k % 2 == 1 {
                words.reverse();
            }
            text += &format!("f {}\n", words.join(" "));
        }
        text
    }

    /// An OFF file with colours behind the faces.
    pub fn off(&self) -> String {
        let mut text = format!("OFF\n{} {} 0\n", self.points.len(), self.faces.len());
        self.points.iter().for_each(|p| text += &format!("{} {} {}\n", p.x, p.y, p.z));
        for face in &self.faces {
            let corners: Vec<String> = face.iter().map(usize::to_string).collect();
            text += &format!("{} {} 255 0 0\n", face.len(), corners.join(" "));
        }
        text
    }

    /// A PLY file.
    pub fn ply(&self) -> Vec<u8> {
        let mut file = format!(
            "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty double x\nproperty double y\n\
             property double z\nelement face {}\nproperty list uchar int vertex_indices\nend_header\n",
            self.points.len(),
            self.faces.len()
        )
        .into_bytes();
        file.extend(
            self.points
                .iter()
                .flat_map(|p| p.iter().flat_map(|x| x.to_le_bytes()).collect::<Vec<_>>()),
        );
        for face in &self.faces {
            file.push(face.len() as u8);
            file.extend(face.iter().flat_map(|&i| (i as i32).to_le_bytes()));
        }
        file
    }
}

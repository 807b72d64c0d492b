//! Meshes: their vertices, or points spread over the surface that their faces stand for.
//!
//! Of a scanner's mesh the vertices are the scan. A CAD program puts vertices on the edges of faces, where no method
//! can tell the surface by them: there the faces are sampled. `coarse` tells the two apart. `sheet` finds the flat
//! facets, `bends` which edges run across curved surfaces, `normals` the surface's direction at the vertices, `lift`
//! the surface itself, which the facets undercut by the chord error, and `sample` puts points on it.

mod bends;
mod coarse;
mod corners;
mod lift;
mod normals;
mod polygons;
mod sample;
mod sheet;
mod starved;

use std::num::NonZeroUsize;

pub(super) use polygons::Faces;

use super::{Bounds, FormatError};
use crate::geometry::{Mesh, MeshSamples, PointCloud, Vec3};
use normals::Corners;
use polygons::Triangle;
use sample::Samples;
use sheet::Sheet;

/// How a mesh is read.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Meshes {
    /// What its points are.
    pub way: MeshWay,
    /// Distance of samples from each other; worked out from the mesh when absent.
    pub spacing: Option<f64>,
    /// Most samples.
    pub most: NonZeroUsize,
}

/// What the points of a mesh are.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum MeshWay {
    /// Samples where the vertices are the corners of large faces alone, or else the vertices.
    #[default]
    Auto,
    /// The vertices.
    Vertices,
    /// Samples of the faces.
    Faces,
}

impl Meshes {
    /// The default of `most`.
    pub const MOST: NonZeroUsize = NonZeroUsize::new(100_000).expect("it is not zero");
}

impl Default for Meshes {
    fn default() -> Self {
        Self { way: MeshWay::Auto, spacing: None, most: Self::MOST }
    }
}

/// The cloud of a mesh.
///
/// # Errors
/// Samples are wanted, and there are no faces, too many of them, or too many samples.
pub(super) fn cloud(
    points: Vec<Vec3>,
    faces: &Faces,
    how: &Meshes,
    limits: &dyn Bounds,
) -> Result<PointCloud, FormatError> {
    let vertices = |points: Vec<Vec3>| {
        let mesh = Mesh { vertices: points.len(), faces: faces.count(), samples: None };
        let mesh = (faces.count() > 0).then(|| mesh.into());
        Ok(PointCloud { mesh, ..PointCloud::from_points(points) })
    };
    let asked = how.way == MeshWay::Faces;
    if how.way == MeshWay::Vertices || (faces.count() == 0 || faces.too_many()) && !asked {
        return vertices(points);
    }
    if faces.too_many() {
        return Err(FormatError::TooManyFaces { corners: Faces::MOST_CORNERS });
    }
    if !asked && coarse::is_dense(&points, faces) {
        return vertices(points);
    }
    let places = corners::places(&points);
    limits.go_on()?;
    let triangles = faces.triangles(&points, &places);
    limits.go_on()?;
    if asked && triangles.is_empty() {
        return Err(FormatError::NoFaces);
    }
    if !asked && !coarse::is_coarse(&points, &triangles, &places) {
        return vertices(points);
    }
    let thickness = coarse::thickness(&triangles, &points, &places);
    let sheet = Sheet::of(&points, &triangles, thickness);
    let smooth = bends::smooth(&sheet);
    limits.go_on()?;
    let corners = Corners::of(&sheet, &smooth.sides, smooth.facets);
    let most = (limits.most()).min(how.most.get() as u64) as usize;
    let spacing = how.spacing.unwrap_or_else(|| sample::spacing(&sheet, &smooth.sides, most));
    let area: f64 = triangles.iter().map(|t| t.area).sum();
    let wanted = area / (spacing * spacing);
    if wanted.is_nan() || wanted >= most as f64 + 1.0 {
        return Err(FormatError::TooManySamples { wanted: wanted as u64, most });
    }
    let samples = sample::samples(&sheet, &corners, spacing);
    limits.go_on()?;
    Ok(told(samples, &triangles, &sheet, faces.count(), points.len()))
}

/// The samples with what is told of the mesh.
fn told(
    samples: Samples,
    triangles: &[Triangle],
    sheet: &Sheet,
    faces: usize,
    vertices: usize,
) -> PointCloud {
    let face_of = samples.triangle_of.iter().map(|&t| triangles[t as usize].face).collect();
    let told = MeshSamples {
        spacing: samples.spacing,
        chord_error: samples.chord_error,
        faces,
        face_of,
        stand_ins: stand_ins(&samples, triangles, sheet),
    };
    let mesh = Mesh { vertices, faces, samples: Some(told) };
    let mut cloud = PointCloud::from_points(samples.points);
    cloud.mesh = Some(mesh.into());
    cloud
}

/// A sample for each face that has none: that of its flat facet which is nearest, or of any facet.
fn stand_ins(samples: &Samples, triangles: &[Triangle], sheet: &Sheet) -> Vec<[u32; 2]> {
    let faces = triangles.iter().map(|t| t.face as usize + 1).max().unwrap_or(0);
    let mut has = vec![false; faces];
    samples.triangle_of.iter().for_each(|&t| has[triangles[t as usize].face as usize] = true);
    let mut first = vec![u32::MAX; sheet.facets.len()];
    for (i, &t) in (0u32..).zip(&samples.triangle_of) {
        let first = &mut first[sheet.facet_of[t as usize] as usize];
        *first = i.min(*first);
    }
    let mut out = Vec::new();
    for (t, triangle) in triangles.iter().enumerate() {
        if has[triangle.face as usize] {
            continue;
        }
        let own = first[sheet.facet_of[t] as usize];
        // samples come in the order of the triangles: the next one is of a triangle close by
        let next = samples.triangle_of.partition_point(|&u| (u as usize) < t);
        let next = next.min(samples.points.len().saturating_sub(1)) as u32;
        let near = if own == u32::MAX { next } else { own };
        if !samples.points.is_empty() {
            has[triangle.face as usize] = true;
            out.push([triangle.face, near]);
        }
    }
    out
}

#[cfg(test)]
pub(super) mod tests;

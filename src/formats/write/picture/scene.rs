use crate::geometry::Vec3;

/// What a picture shows.
#[derive(Clone, Copy, Debug)]
pub struct Scene<'a> {
    /// The points, all finite.
    pub points: &'a [Vec3],
    /// The region of each; -1 = unassigned.
    pub labels: &'a [i32],
    /// The unit normal of its surface at each, of either sign; zeros where there is none.
    pub normals: &'a [[f32; 3]],
}

//! Values: points and clouds, the general quadric, the explicit surfaces, and their distances.

mod classify;
mod cloud;
mod direction;
mod frame;
mod lot;
mod quadric;
mod recover;
mod surface;
mod thinned;
mod unit;

pub use classify::{CanonicalForm, QuadricType, classify};
pub use cloud::{Grid, Mesh, MeshSamples, PointCloud};
pub use direction::moderate;
pub use frame::Frame;
pub use lot::lot;
pub use quadric::{Quadric, Scale};
pub use recover::{Recovered, Tolerance, recover, recover_local};
pub use surface::{
    Cone, Cylinder, Ellipsoid, EllipticCylinder, Plane, Sphere, Surface, SurfaceType, Torus,
};
pub use thinned::Thinned;
pub use unit::LengthUnit;

/// A point or a direction in the input's unit.
pub type Vec3 = nalgebra::Vector3<f64>;
/// A 3 x 3 matrix.
pub type Mat3 = nalgebra::Matrix3<f64>;

/// Two unit vectors that make a right-handed frame (u, v, w) with the unit vector `w`.
pub fn perpendicular_frame(w: &Vec3) -> (Vec3, Vec3) {
    let helper = if w.z.abs() < 0.9 { Vec3::z() } else { Vec3::x() };
    let u = w.cross(&helper).normalize();
    (u, w.cross(&u))
}

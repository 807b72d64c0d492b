use std::sync::atomic::{AtomicU64, Ordering};

use rayon::prelude::*;

use super::{camera::Camera, scene::Scene, spacing::spacings};
use crate::geometry::Vec3;

/// Points worked on at once.
const CHUNK: usize = 4096;
/// Radius of a disc in spacings: of points in no order, one place in two hundred then has none.
const REACH: f32 = 1.3;
/// The same of a point without a region, which hides nothing.
const REACH_UNASSIGNED: f32 = 0.35;
/// Smallest and largest radius in pixels.
const RADII: [f32; 2] = [1.2, 60.0];
/// A disc seen edge-on is drawn as if its normal had at least this part towards who looks.
const LEAST_FACING: f32 = 0.2;

/// What wins each pixel: the nearest disc's depth, then the point's index.
#[derive(Debug)]
pub struct Winners {
    /// Pixels in a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    keys: Vec<AtomicU64>,
    /// Radius of each point's disc, in pixels.
    pub radii: Vec<f32>,
    /// The cloud's depth in pixels.
    pub span: f64,
}

impl Winners {
    /// The point seen at pixel `at`, row by row; `None` where the background is.
    pub fn point(&self, at: usize) -> Option<usize> {
        let key = self.keys[at].load(Ordering::Relaxed);
        (key != u64::MAX).then_some(key as u32 as usize)
    }

    /// The depth of what is seen at pixel `at`, in pixels; infinite where the background is.
    pub fn depth(&self, at: usize) -> f64 {
        let key = self.keys[at].load(Ordering::Relaxed);
        if key == u64::MAX { f64::INFINITY } else { (key >> 32) as f64 / DEPTHS * self.span }
    }

    /// Lets pixel `at` show what pixel `from` shows.
    pub fn copy(&self, from: usize, at: usize) {
        self.keys[at].store(self.keys[from].load(Ordering::Relaxed), Ordering::Relaxed);
    }
}

/// Steps of depth.
const DEPTHS: f64 = (u32::MAX - 1) as f64;

/// A disc as the camera sees it.
struct Disc {
    x: f32,
    y: f32,
    depth: f64,
    radius: f32,
    // right, up and backward part of the normal
    normal: [f32; 3],
}

/// Draws every point as a disc on its surface.
pub fn draw(scene: &Scene, camera: &Camera, width: usize, height: usize) -> Winners {
    let keys = (0..width * height).map(|_| AtomicU64::new(u64::MAX)).collect();
    let mut radii = spacings(scene.points);
    for (radius, label) in radii.iter_mut().zip(scene.labels) {
        let reach = if *label < 0 { REACH_UNASSIGNED } else { REACH };
        *radius = (reach * *radius * camera.scale as f32).clamp(RADII[0], RADII[1]);
    }
    let span = ((camera.depths[1] - camera.depths[0]) * camera.scale).max(1.0);
    let winners = Winners { width, height, keys, radii, span };
    scene.points.par_iter().with_min_len(CHUNK).enumerate().for_each(|(k, p)| {
        draw_disc(&winners, k as u32, &disc(scene, camera, k, p, winners.radii[k]));
    });
    winners
}

fn disc(scene: &Scene, camera: &Camera, k: usize, p: &Vec3, radius: f32) -> Disc {
    let (x, y, depth) = camera.place(p);
    let [right, up, back] = camera.turned(scene.normals[k]);
    let sign = if back < 0.0 { -1.0 } else { 1.0 };
    Disc { x: x as f32, y: y as f32, depth, radius, normal: [sign * right, sign * up, sign * back] }
}

/// Draws one disc.
fn draw_disc(winners: &Winners, index: u32, disc: &Disc) {
    let [right, up, back] = disc.normal;
    let facing = back.max(LEAST_FACING);
    let has_normal = disc.normal != [0.0; 3];
    let sq_radius = disc.radius * disc.radius;
    let row = |y: f32| (y.max(0.0) as usize).min(winners.height);
    let column = |x: f32| (x.max(0.0) as usize).min(winners.width);
    for j in row(disc.y - disc.radius)..row(disc.y + disc.radius + 1.0) {
        for i in column(disc.x - disc.radius)..column(disc.x + disc.radius + 1.0) {
            let (dx, dy) = (i as f32 + 0.5 - disc.x, disc.y - j as f32 - 0.5);
            // how far the tangent plane comes nearer from the middle to here
            let rise = if has_normal { -(right * dx + up * dy) / facing } else { 0.0 };
            let sq = dx * dx + dy * dy + rise * rise;
            let is_middle = dx.abs() <= 0.5 && dy.abs() <= 0.5;
            if sq > sq_radius && !is_middle {
                continue;
            }
            // of two discs of one surface the one with the nearer middle wins
            let behind = f64::from(0.5 * sq.min(sq_radius) / disc.radius - rise);
            let depth = (disc.depth + behind / winners.span).clamp(0.0, 1.0);
            let key = ((depth * DEPTHS) as u64) << 32 | u64::from(index);
            let pixel = &winners.keys[j * winners.width + i];
            if key < pixel.load(Ordering::Relaxed) {
                pixel.fetch_min(key, Ordering::Relaxed);
            }
        }
    }
}

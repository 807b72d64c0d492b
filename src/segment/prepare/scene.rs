//! The points a discovery works on, with their neighbours, normals and noise.

use rayon::prelude::*;

use crate::fit::Shape;
use crate::geometry::Vec3;
use crate::segment::prepare::candidates::K;
use crate::segment::prepare::nearest::{Runs, Search};
use crate::segment::prepare::normals::{consensus_normal, normal_of};
use crate::segment::prepare::profiles::Profiles;
use crate::segment::prepare::steps::rounding;
use crate::segment::prepare::work::Work;
use crate::segment::{Cancelled, Monitor};

/// Points worked on at once; fixed, so that the result does not depend on the number of threads.
const CHUNK: usize = 512;

/// Distinct points in Morton order with the graph of their nearest neighbours.
pub struct Scene<'a> {
    /// The points, relative to the cloud's centre.
    pub points: Vec<Vec3>,
    /// The place of each in the cloud that they were taken from, rising.
    pub places: Vec<u32>,
    /// A unit normal of each point's neighbourhood; its sign means nothing.
    pub normals: Vec<Vec3>,
    /// How rough each neighbourhood is: the smallest eigenvalue's share of the scatter.
    pub roughness: Vec<f32>,
    /// `K` neighbours of each point, nearest first.
    neighbours: Vec<u32>,
    /// Median distance to the fourth neighbour.
    pub spacing: f64,
    /// The profiles that its points lie on, drawn together where neighbours are looked for.
    pub profiles: Option<Profiles>,
    /// The even step of each coordinate, nought where it has none: points scatter no less than rounding to these.
    pub steps: [f64; 3],
    /// The work done on it.
    pub work: Work,
    /// Who may cancel the work on it.
    monitor: &'a dyn Monitor,
}

impl<'a> Scene<'a> {
    /// The scene that nobody cancels.
    #[cfg(test)]
    pub fn new(points: Vec<Vec3>) -> Self {
        Self::built(points, None, &crate::segment::Silent)
    }

    /// Builds the graph and the normals of points in Morton order. At least one point.
    ///
    /// # Errors
    /// `monitor` cancelled the work.
    pub fn watched(points: Vec<Vec3>, monitor: &'a dyn Monitor) -> Result<Self, Cancelled> {
        Self::on_profiles(points, None, monitor)
    }

    /// The same of points on `profiles`, where they are on any.
    ///
    /// # Errors
    /// `monitor` cancelled the work.
    pub fn on_profiles(
        points: Vec<Vec3>,
        profiles: Option<Profiles>,
        monitor: &'a dyn Monitor,
    ) -> Result<Self, Cancelled> {
        let scene = Self::built(points, profiles, monitor);
        monitor.check().map(|()| scene)
    }

    /// The scene of points that had these places in a cloud.
    pub fn taken_from(self, places: Vec<u32>) -> Self {
        Self { places, ..self }
    }

    /// The scene of points whose coordinates come in such steps.
    pub fn stepped(self, steps: [f64; 3]) -> Self {
        Self { steps, ..self }
    }

    /// The scatter that rounding to the steps alone gives points along the normals of their surfaces.
    pub fn rounding<'p>(&self, points: impl Iterator<Item = (&'p Shape, &'p Vec3)>) -> f64 {
        let (mut sum, mut n) = (0.0, 0.0);
        for (shape, p) in points {
            sum += rounding(&self.steps, &shape.offset(p).normal).powi(2);
            n += 1.0;
        }
        if n > 0.0 { (sum / n).sqrt() } else { 0.0 }
    }

    /// The scene; half of one where `monitor` cancels meanwhile.
    fn built(points: Vec<Vec3>, profiles: Option<Profiles>, monitor: &'a dyn Monitor) -> Self {
        let n = points.len();
        let mut neighbours = vec![0u32; n * K];
        let mut normals = vec![Vec3::z(); n];
        let mut roughness = vec![0f32; n];
        let mut fourth = vec![0f64; n];
        let drawn: Option<Vec<Vec3>> =
            profiles.map(|all| points.iter().map(|p| all.drawn(p)).collect());
        let near_to = drawn.as_ref().unwrap_or(&points);
        let runs = Runs::of(near_to);
        neighbours
            .par_chunks_mut(K * CHUNK)
            .zip(normals.par_chunks_mut(CHUNK))
            .zip(roughness.par_chunks_mut(CHUNK))
            .zip(fourth.par_chunks_mut(CHUNK))
            .enumerate()
            .for_each(|(c, (((neighbours, normals), roughness), fourth))| {
                if monitor.cancelled() {
                    return;
                }
                let mut search = Search::default();
                for (k, out) in neighbours.chunks_mut(K).enumerate() {
                    let i = c * CHUNK + k;
                    let (near, sq) = runs.nearest(i, &mut search);
                    // Where there are too few points, a point stands for its missing neighbours.
                    for (out, j) in out.iter_mut().zip(near) {
                        *out = if j == u32::MAX { i as u32 } else { j };
                    }
                    fourth[k] = if sq.is_finite() { sq.sqrt() } else { 0.0 };
                    (normals[k], roughness[k]) = normal_of(near_to, i, out);
                    if let Some(all) = &profiles {
                        normals[k] = all.undrawn(&normals[k]);
                    }
                }
            });
        let mid = n / 2;
        let spacing = *fourth.select_nth_unstable_by(mid, f64::total_cmp).1;
        let work = Work::default();
        let places = (0..n as u32).collect();
        Self {
            points,
            places,
            normals,
            roughness,
            neighbours,
            spacing,
            profiles,
            steps: [0.0; 3],
            work,
            monitor,
        }
    }

    /// Whether the work on the scene is to stop. Loops over points, regions or pairs of them ask it every few
    /// milliseconds and then leave off: what they return is worth nothing, and whoever has the monitor asks next.
    #[inline]
    pub fn cancelled(&self) -> bool {
        self.monitor.cancelled()
    }

    /// Replaces normals of rough neighbourhoods (edges, thin walls), where a plane through the point and two
    /// neighbours holds at least seven neighbours within three sigmas, by that plane's.
    pub fn sharpen_normals(&mut self, sigma: f64) {
        let sq_limit = 9.0 * sigma * sigma;
        let next: Vec<(Vec3, f32)> = (0..self.len())
            .into_par_iter()
            .with_min_len(256)
            .map(|i| {
                let old = (self.normals[i], self.roughness[i]);
                if i % CHUNK == 0 && self.cancelled() {
                    return old;
                }
                let p = self.points[i];
                let mut q = [Vec3::zeros(); K];
                let mut sum = 0.0;
                for (q, &j) in q.iter_mut().zip(self.neighbours(i)) {
                    *q = self.points[j as usize] - p;
                    sum += q.norm_squared();
                }
                if f64::from(old.1) * sum < 4.0 * sq_limit {
                    return old;
                }
                if self.has_even_chords(i, &q, sq_limit) {
                    return old;
                }
                consensus_normal(&q, 3.0 * sigma).map_or(old, |v| (v, 0.0))
            })
            .collect();
        for (i, (v, r)) in next.into_iter().enumerate() {
            self.normals[i] = v;
            self.roughness[i] = r;
        }
    }

    /// Whether a neighbourhood is smooth, curved as it may be: on a quadratic surface the chord to each neighbour,
    /// here `q`, is at right angles to the mean of both normals.
    fn has_even_chords(&self, i: usize, q: &[Vec3; K], sq_limit: f64) -> bool {
        let normal = self.normals[i];
        let mut sum = 0.0;
        for (q, &j) in q.iter().zip(self.neighbours(i)) {
            let other = self.normals[j as usize];
            let mean = 0.5 * (normal + other * normal.dot(&other).signum());
            sum += mean.dot(q).powi(2);
        }
        sum < K as f64 * sq_limit
    }

    /// The neighbours of point `i`, nearest first.
    #[inline]
    pub fn neighbours(&self, i: usize) -> &[u32] {
        &self.neighbours[i * K..(i + 1) * K]
    }

    /// Median roughness of the neighbourhoods of some points, at least one.
    pub fn median_roughness(&self, points: impl Iterator<Item = u32>) -> f32 {
        let mut rough: Vec<f32> = points.map(|i| self.roughness[i as usize]).collect();
        let mid = rough.len() / 2;
        *rough.select_nth_unstable_by(mid, f32::total_cmp).1
    }

    /// Number of points.
    pub fn len(&self) -> usize {
        self.points.len()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_few_points_stand_for_their_missing_neighbours() {
        for n in 1..20_u32 {
            let points = (0..n).map(|k| Vec3::new(f64::from(k), 0.0, 0.0)).collect();
            let scene = Scene::new(points);
            for i in 0..scene.len() {
                let near = scene.neighbours(i);
                let own = near.iter().filter(|j| **j as usize == i).count();
                assert_eq!(own, (K + 1).saturating_sub(scene.len()));
            }
            assert!(scene.spacing.is_finite());
        }
    }
}

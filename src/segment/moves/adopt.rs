//! Pieces of a surface apart from it: points without a surface that hang together, and that one found elsewhere
//! explains.
//!
//! Labels spread from neighbour to neighbour, so what a slot or a rib cuts off a face stays without one until
//! growth finds it again; of a few dozen points growth finds nothing.

use crate::fit::Ruler;
use crate::segment::objective::{ACCEPT, APART, FEW, LITTLE, SURE};
use crate::segment::partition::Partition;
use crate::segment::prepare::scene::Scene;
use crate::segment::union::Union;

/// Gives pieces of at least a dozen points to the surfaces that explain them. Returns how many points went.
pub fn adopt(scene: &Scene, model: &mut Partition, sigma: f64) -> usize {
    let rulers: Vec<Ruler> = model.shapes.iter().map(Ruler::of).collect();
    let mut adopted = 0;
    for piece in unassigned(scene, &model.labels) {
        if scene.cancelled() {
            break;
        }
        let explains = |ruler: &Ruler| explained(scene, &piece, ruler, sigma);
        let found = rulers.iter().take_while(|_| !scene.cancelled()).map(explains).enumerate();
        let best =
            found.filter_map(|(l, mean_sq)| Some((l, mean_sq?))).min_by(|a, b| a.1.total_cmp(&b.1));
        let Some((l, _)) = best else { continue };
        for &i in &piece {
            if rulers[l].distance(&scene.points[i as usize]).abs() <= ACCEPT.get() * sigma {
                model.labels[i as usize] = l as i32;
                adopted += 1;
            }
        }
    }
    adopted
}

/// Groups of points without a surface that are chained by short edges of the graph.
fn unassigned(scene: &Scene, labels: &[i32]) -> Vec<Vec<u32>> {
    let open: Vec<u32> = (0..scene.len() as u32).filter(|&i| labels[i as usize] < 0).collect();
    let mut union = Union::new(open.len());
    let sq_reach = (APART.get() * scene.spacing).powi(2);
    for (k, &i) in open.iter().enumerate() {
        let p = &scene.points[i as usize];
        for &j in scene.neighbours(i as usize) {
            if let Ok(m) = open.binary_search(&j)
                && (scene.points[j as usize] - p).norm_squared() <= sq_reach
            {
                union.join(k as u32, m as u32);
            }
        }
    }
    let sets = union.sets().into_iter().take_while(|s| s.len() >= FEW.get() / 2);
    sets.map(|s| s.into_iter().map(|k| open[k as usize]).collect()).collect()
}

/// Mean square of the distances of a piece's points from a surface, in sigmas, where it explains them.
fn explained(scene: &Scene, piece: &[u32], ruler: &Ruler, sigma: f64) -> Option<f64> {
    // Outliers are among the points of a piece.
    let most_off = (LITTLE.get() * piece.len() as f64) as usize;
    let (mut off, mut sum) = (0, 0.0);
    for &i in piece {
        let sq = (ruler.distance(&scene.points[i as usize]) / sigma).powi(2);
        if sq <= ACCEPT.get().powi(2) {
            sum += sq;
        } else {
            off += 1;
            if off > most_off {
                return None;
            }
        }
    }
    let on = (piece.len() - off) as f64;
    let mean_sq = sum / on;
    (mean_sq < 1.0 + SURE.get() * (2.0 / on).sqrt()).then_some(mean_sq)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::{Family, Shape};
    use crate::geometry::Vec3;

    const SIGMA: f64 = 0.01;

    /// A large face with a region; a small one beside, `height` above its plane, without.
    fn apart(height: f64) -> (Scene<'static>, Partition) {
        let grid = |n: usize, x: f64, z: f64| {
            (0..n * n).map(move |k| Vec3::new(x + (k % n) as f64, (k / n) as f64, z))
        };
        let scene = Scene::new(grid(20, 0.0, 0.0).chain(grid(5, 40.0, height)).collect());
        let labels = scene.points.iter().map(|p| if p.x < 30.0 { 0 } else { -1 }).collect();
        let plane = Shape::with_axis(Family::Plane, Vec3::zeros(), Vec3::z(), [0.0; 3]);
        (scene, Partition { shapes: vec![plane], labels, ..Partition::default() })
    }

    #[test]
    fn a_piece_on_the_surface_goes_to_it() {
        let (scene, mut model) = apart(0.5 * SIGMA);
        assert_eq!(adopt(&scene, &mut model, SIGMA), 25);
        assert!(model.labels.iter().all(|&l| l == 0));
    }

    #[test]
    fn one_beside_it_stays_without() {
        // Within reach of single points, but not as noise would lie.
        for height in [2.0 * SIGMA, 5.0 * SIGMA] {
            let (scene, mut model) = apart(height);
            assert_eq!(adopt(&scene, &mut model, SIGMA), 0);
        }
    }

    #[test]
    fn single_points_on_the_surface_stay_outliers() {
        let (scene, mut model) = apart(3.0 * SIGMA);
        let mut points = scene.points.clone();
        for (k, p) in points.iter_mut().filter(|p| p.x > 30.0).enumerate() {
            p.z = if k == 12 { 0.0 } else { 30.0 + 7.0 * (k * k % 11) as f64 };
        }
        let scene = Scene::new(points);
        model.labels = scene.points.iter().map(|p| if p.x < 30.0 { 0 } else { -1 }).collect();
        assert_eq!(adopt(&scene, &mut model, SIGMA), 0);
    }
}

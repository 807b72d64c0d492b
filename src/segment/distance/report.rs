//! Writing down what was found.

use super::Found;
use crate::fit::Shape;
use crate::geometry::{PointCloud, Vec3};
use crate::segment::{Extent, Fit, Parameters, Region, Segmentation, Unassigned};

/// The regions in the contract's terms, in world coordinates.
pub fn report(cloud: &PointCloud, parameters: &Parameters, found: Found) -> Segmentation {
    let mut points = vec![Vec::new(); found.shapes.len()];
    for (p, &l) in cloud.points.iter().zip(&found.labels) {
        if l >= 0 {
            points[l as usize].push(p - found.centre);
        }
    }
    let regions = found
        .shapes
        .iter()
        .zip(&points)
        .enumerate()
        .filter_map(|(id, (shape, points))| region(id, shape, points, &found.centre))
        .collect();
    let count = found.labels.iter().filter(|l| **l < 0).count();
    let mut parameters = parameters.clone();
    parameters.noise_sigma = Some(found.sigma);
    parameters.tolerance = Some(parameters.tolerance.unwrap_or(4.0 * found.sigma));
    Segmentation {
        parameters,
        regions,
        labels: found.labels,
        unassigned: Unassigned { count, reasons: [("no_quadric", count)].into() },
        counters: found.counters,
    }
}

fn region(id: usize, shape: &Shape, points: &[Vec3], centre: &Vec3) -> Option<Region> {
    let world = shape.translated(centre);
    let surface = world.surface()?;
    let (coefficients, coefficients_scale) = surface.quadric().scaled();
    Some(Region {
        id,
        surface_type: surface.surface_type(),
        point_count: points.len(),
        coefficients: coefficients.0,
        coefficients_scale,
        surface: Some(surface),
        uncertainty: None,
        fit: fit_of(shape, points),
        evidence: None,
        extent: extent_of(points, centre),
        neighbours: Vec::new(),
    })
}

fn fit_of(shape: &Shape, points: &[Vec3]) -> Fit {
    let (mut sum, mut max) = (0.0, 0.0_f64);
    for p in points {
        let d = shape.distance(p).abs();
        sum += d * d;
        max = max.max(d);
    }
    let rms = (sum / points.len().max(1) as f64).sqrt();
    Fit { rms, max, used: points.len(), rejected: 0 }
}

fn extent_of(points: &[Vec3], centre: &Vec3) -> Option<Extent> {
    let min = points.iter().copied().reduce(|a, b| a.inf(&b))? + centre;
    let max = points.iter().copied().reduce(|a, b| a.sup(&b))? + centre;
    Some(Extent { min: min.into(), max: max.into() })
}

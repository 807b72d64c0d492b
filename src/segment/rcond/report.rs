use super::Found;
use crate::geometry::{Frame, Quadric, Recovered, Tolerance, Vec3, recover};
use crate::segment::{Extent, Fit, Parameters, Region, Segmentation, Unassigned};

/// Writes down what was found. Regions whose final surface is imaginary, or two crossing planes, are
/// dropped.
pub fn report(mut found: Found, points: &[Vec3], parameters: &Parameters) -> Segmentation {
    let described: Vec<_> = found
        .surfaces
        .iter()
        .zip(found.members(points))
        .map(|(surface, members)| describe(&surface.quadric, &members))
        .collect();
    let kept = found.surfaces.iter().zip(&described).map(|(s, d)| d.as_ref().map(|_| *s)).collect();
    found.keep(kept);
    let numbered = described.into_iter().flatten().enumerate();
    let regions = numbered.map(|(id, region)| Region { id, ..region }).collect();
    let count = found.labels.iter().filter(|l| **l < 0).count();
    Segmentation {
        parameters: parameters.clone(),
        regions,
        labels: found.labels,
        unassigned: Unassigned { count, reasons: [("no_quadric", count)].into() },
        counters: found.counters,
    }
}

/// The region of `points` with its surface in world coordinates, not numbered yet.
fn describe(quadric: &Quadric, points: &[Vec3]) -> Option<Region> {
    let frame = Frame::of(points.iter().copied());
    let Recovered { surface_type, surface } = recover(quadric, &frame, Tolerance::default())?;
    let (scaled, coefficients_scale) = quadric.scaled();
    Some(Region {
        id: 0,
        surface_type,
        point_count: points.len(),
        coefficients: scaled.0,
        coefficients_scale,
        surface,
        uncertainty: None,
        fit: fit(quadric, &frame, points),
        evidence: None,
        extent: extent(points),
        neighbours: Vec::new(),
    })
}

/// Distances are taken in the local frame, where far coordinates cost no digits.
fn fit(quadric: &Quadric, frame: &Frame, points: &[Vec3]) -> Fit {
    let local = frame.local_quadric(quadric);
    let (mut sum, mut max) = (0.0, 0.0_f64);
    for p in points {
        let distance = frame.scale * local.distance(&frame.local_from_world(p));
        sum += distance * distance;
        max = max.max(distance);
    }
    let rms = (sum / points.len().max(1) as f64).sqrt();
    Fit { rms, max, used: points.len(), rejected: 0 }
}

fn extent(points: &[Vec3]) -> Option<Extent> {
    let min = points.iter().copied().reduce(|a, b| a.inf(&b))?;
    let max = points.iter().copied().reduce(|a, b| a.sup(&b))?;
    Some(Extent { min: min.into(), max: max.into() })
}

use super::{found::Found, surface::FittedSurface};
use crate::geometry::{Frame, Quadric, Recovered, Tolerance, Vec3, recover_local};
use crate::segment::equation::Equations;
use crate::segment::median::deviation;
use crate::segment::{
    Dimensions, Extent, Fit, Monitor, Parameters, Region, Segmentation, Unassigned,
};

/// Writes down what was found. Regions whose final surface is imaginary, or two crossing planes, are
/// dropped.
pub fn report(
    mut found: Found,
    points: &[Vec3],
    parameters: &Parameters,
    monitor: &dyn Monitor,
) -> Segmentation {
    let described: Vec<_> = found
        .surfaces
        .iter()
        .zip(found.members(points))
        .map(|(surface, members)| (!monitor.cancelled()).then(|| describe(surface, &members))?)
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
        sampling: None,
        warnings: Vec::new(),
        hints: Vec::new(),
    }
}

/// The region of `points` with its surface in world coordinates, not numbered yet.
///
/// Its type, parameters and distances are those of the fit as it was made, near the points; the world coefficients
/// that the method worked with say themselves how far off they are.
fn describe(surface: &FittedSurface, points: &[Vec3]) -> Option<Region> {
    let frame = Frame::of(points.iter().copied());
    let local = surface.within(&frame);
    let recovered = recover_local(&local, &frame, Tolerance::default())?;
    let Recovered { surface_type, surface: parameters } = recovered;
    let extent = extent(points)?;
    let about = |origin: &Vec3| surface.within(&Frame { origin: *origin, scale: 1.0 });
    let equations = Equations::of(&surface.quadric, about, &extent, points.len(), |k| points[k]);
    Some(Region {
        id: 0,
        surface_type,
        point_count: points.len(),
        coefficients: Some(equations.coefficients),
        coefficients_scale: Some(equations.coefficients_scale),
        coefficients_error: equations.coefficients_error,
        local_origin: equations.local_origin,
        local_coefficients: Some(equations.local_coefficients),
        surface: parameters,
        dimensions: Dimensions::default(),
        uncertainty: None,
        fit: fit(&local, &frame, points),
        evidence: None,
        extent: Some(extent),
        neighbours: Vec::new(),
        snapped: None,
    })
}

/// Distances are taken in the local frame, where far coordinates cost no digits.
fn fit(local: &Quadric, frame: &Frame, points: &[Vec3]) -> Fit {
    let (mut sum, mut max) = (0.0, 0.0_f64);
    let mut distances = Vec::with_capacity(points.len());
    for p in points {
        let distance = frame.scale * local.distance(&frame.local_from_world(p));
        sum += distance * distance;
        max = max.max(distance);
        distances.push(distance);
    }
    let rms = (sum / points.len().max(1) as f64).sqrt();
    let noise = deviation(distances.into_iter()).unwrap_or(0.0);
    Fit { rms, noise, max, used: points.len(), rejected: 0 }
}

fn extent(points: &[Vec3]) -> Option<Extent> {
    let min = points.iter().copied().reduce(|a, b| a.inf(&b))?;
    let max = points.iter().copied().reduce(|a, b| a.sup(&b))?;
    Some(Extent { min: min.into(), max: max.into() })
}

//! What a face is in a designer's terms: ends, length, diameter, hole or boss, outline. One place reckons them for
//! every form of a result.

pub mod around;
pub mod contour;
pub mod cover;
pub mod crossing;
pub mod ends;
pub mod outline;
pub mod propagate;
pub mod side;

use rayon::prelude::*;
use serde_json::{Value, json};

use crate::fit::constant::constants;
use crate::fit::{Family, Shape};
use crate::geometry::Vec3;
use crate::segment::dimensions::Dimensions;
use crate::segment::found::Found;
use crate::segment::report::constraints::Candidate;
use crate::segment::report::dimensions::around::Arc;
use crate::segment::report::dimensions::ends::{Ends, Place, radial};
use crate::segment::report::dimensions::outline::outline;
use crate::segment::report::dimensions::side::{by_normals, sides};
use crate::segment::report::known::{Joint, Known, Told};
use crate::segment::report::motion::falling;
use crate::segment::report::tally::sample;

constants! {
    /// Points of a region that outlines, arcs and shares are told by.
    SAMPLE: usize = 20_000, Effort("points looked at");
    /// Points whose neighbours tell the spacing of a region.
    SPACED: usize = 300, Effort("points looked at");
    /// Gaps about an axis up to this many spacings are none.
    GAP: f64 = 3.0, Trial(3.0, 3.0);
    /// The largest such gap in radians, where a tube is hardly wider than the spacing.
    MOST_GAP: f64 = 1.0, Trial(1.0, 1.0);
}

/// The dimensions of all regions; `labels` of the scene's points, `density` the cloud's points for each of these.
pub fn all(
    surfaces: &[Known],
    kept: &[Candidate],
    joints: &[Joint],
    labels: &[i32],
    found: &Found,
    density: f64,
) -> Vec<Told> {
    let spacings = spacings(surfaces.len(), labels, found, density);
    let sides = sides(&found.scene, labels, surfaces, joints, found.noise);
    let sides = match &found.normals {
        None => sides,
        Some(normals) => {
            let normal = |k: usize| normals[found.scene.places[k] as usize];
            by_normals(&found.scene, labels, surfaces, normal, &sides)
        }
    };
    let one = |(id, candidate): (usize, &Candidate)| {
        if found.scene.cancelled() || candidate.members.is_empty() {
            return Told::default();
        }
        let sigma = surfaces[id].fit.rms;
        let place = Place { surfaces, joints, id, spacing: spacings[id], sigma };
        let mut told = of_region(place, candidate, found);
        if surfaces[id].shape.family != Family::Plane {
            told.dimensions.side = Some(sides[id]);
        }
        told
    };
    kept.par_iter().take(surfaces.len()).enumerate().map(one).collect()
}

/// Median distance to the fourth neighbour of each region's points, in the cloud.
fn spacings(regions: usize, labels: &[i32], found: &Found, density: f64) -> Vec<f64> {
    let scene = &found.scene;
    let mut own = vec![Vec::new(); regions];
    for (i, &l) in labels.iter().enumerate() {
        if let Some(own) = usize::try_from(l).ok().and_then(|l| own.get_mut(l)) {
            own.push(i);
        }
    }
    let fourth =
        |i: usize| (scene.points[scene.neighbours(i)[3] as usize] - scene.points[i]).norm();
    let median = |places: Vec<usize>| {
        let stride = places.len().div_ceil(SPACED.get()).max(1);
        let mut all: Vec<f64> = places.into_iter().step_by(stride).map(fourth).collect();
        let middle = all.len() / 2;
        let known = !all.is_empty();
        if known { *all.select_nth_unstable_by(middle, f64::total_cmp).1 } else { scene.spacing }
    };
    own.into_iter().map(|places| median(places) / density.sqrt()).collect()
}

fn of_region(place: Place, candidate: &Candidate, found: &Found) -> Told {
    let shape = place.surfaces[place.id].shape;
    let few = sample(&found.points, &candidate.members, SAMPLE.get());
    // Of fewer points the spacing is larger.
    let apart = place.spacing * (candidate.members.len() as f64 / few.len() as f64).sqrt();
    match shape.family {
        Family::Plane => of_plane(&shape, &few, apart, &found.centre),
        Family::Sphere | Family::Ellipsoid => of_ball(&place.surfaces[place.id], &few),
        Family::Torus => of_torus(place, &few, apart, &found.centre),
        Family::Cylinder | Family::EllipticCylinder | Family::Cone => {
            let height = |i: &u32| (found.points[*i as usize] - shape.origin).dot(&shape.w());
            let heights: Vec<f64> = candidate.members.iter().map(height).collect();
            of_axial(place, &heights, &few, apart, &found.centre)
        }
    }
}

fn of_plane(shape: &Shape, points: &[Vec3], spacing: f64, centre: &Vec3) -> Told {
    let uv = |p: &Vec3| {
        let q = shape.frame.tr_mul(&(p - shape.origin));
        [q.x, q.y]
    };
    let Some(found) = outline(&points.iter().map(uv).collect::<Vec<_>>(), spacing) else {
        return Told::default();
    };
    let turned = |u: f64, v: f64| shape.frame * Vec3::new(u, v, 0.0);
    let corner = |p: &[f64; 2]| (centre + shape.origin + turned(p[0], p[1])).into();
    let [x, y] = found.along;
    let dimensions = Dimensions {
        outline: Some(found.loops.iter().map(|l| l.iter().map(corner).collect()).collect()),
        area: Some(found.area),
        size: Some(found.size),
        size_directions: Some([turned(x, y).into(), turned(-y, x).into()]),
        ..Dimensions::default()
    };
    Told { dimensions, deviations: Vec::new() }
}

fn of_ball(known: &Known, points: &[Vec3]) -> Told {
    let mut told = Told::default();
    told.dimensions.share_seen = Some(cover::share(&known.shape, points));
    diameters(known, &mut told);
    told
}

/// The diameters of a region and their deviations: of an ellipse all, the largest first.
fn diameters(known: &Known, told: &mut Told) {
    let twice = |name: &str| -> Option<Vec<f64>> {
        let deviations = known.uncertainty.as_ref()?.deviations_of(name)?;
        Some(deviations.iter().map(|d| 2.0 * d).collect())
    };
    let size = known.shape.size;
    let (name, one) = match known.shape.family {
        Family::Sphere | Family::Cylinder => ("radius", Some(size[0])),
        Family::Torus => ("minor_radius", Some(size[1])),
        Family::EllipticCylinder | Family::Ellipsoid => ("semi_axes", None),
        Family::Plane | Family::Cone => return,
    };
    if let Some(radius) = one {
        told.dimensions.diameter = Some(2.0 * radius);
        told.deviations.extend(twice(name).map(|d| ("diameter", json!(d[0]))));
    } else {
        let all = falling(&known.shape).into_iter().map(|k| 2.0 * size[k]);
        told.dimensions.diameters = Some(all.collect());
        told.deviations.extend(twice(name).map(|d| ("diameters", json!(d))));
    }
}

fn of_axial(place: Place, heights: &[f64], few: &[Vec3], apart: f64, centre: &Vec3) -> Told {
    let known = &place.surfaces[place.id];
    let shape = known.shape;
    let turn = |p: &Vec3| {
        let q = shape.frame.tr_mul(&(p - shape.origin));
        q.y.atan2(q.x)
    };
    let gap = (GAP.get() * apart / shape.max_radius()).min(MOST_GAP.get());
    let arc = Arc::of(&mut few.iter().map(turn).collect::<Vec<_>>(), gap);
    let ends = place.along_axis(heights);
    let mut told = bounded(&ends);
    diameters(known, &mut told);
    let d = &mut told.dimensions;
    d.swept_angle = Some(arc.angle);
    // A cone's axis points from the apex, which the shape's may not.
    let turned = shape.family == Family::Cone && shape.size[1] < 0.0;
    let mut at = ends.ends.map(|e| e.at);
    if turned {
        at.reverse();
        d.bounded_by.iter_mut().for_each(|b| b.reverse());
        for (name, value) in &mut told.deviations {
            if let (&mut "ends", Value::Array(both)) = (name, value) {
                both.reverse();
            }
        }
    }
    let d = &mut told.dimensions;
    d.ends = Some(at.map(|t| (centre + shape.origin + shape.w() * t).into()));
    if shape.family == Family::Cone {
        d.full_angle = Some(2.0 * shape.size[1].abs());
        d.end_radii = Some(at.map(|t| (shape.size[0] + t * shape.size[1].tan()).max(0.0)));
    }
    told
}

fn of_torus(place: Place, few: &[Vec3], apart: f64, centre: &Vec3) -> Told {
    let known = &place.surfaces[place.id];
    let shape = known.shape;
    let [major, minor, _] = shape.size;
    let local: Vec<Vec3> = few.iter().map(|p| shape.frame.tr_mul(&(p - shape.origin))).collect();
    let about_tube = local.iter().map(|q| q.z.atan2(q.x.hypot(q.y) - major));
    let gap = (GAP.get() * apart / minor).min(MOST_GAP.get());
    let swept = Arc::of(&mut about_tube.collect::<Vec<_>>(), gap).angle;
    let mut angles: Vec<f64> = local.iter().map(|q| q.y.atan2(q.x)).collect();
    let mut told = match (Place { spacing: apart, ..place }).along_tube(&mut angles) {
        Some(ends) => {
            let mut told = bounded(&ends);
            let at = |e: ends::End| centre + shape.origin + radial(&shape, e.at) * major;
            told.dimensions.ends = Some(ends.ends.map(|e| at(e).into()));
            told.dimensions.arc_angle = Some(ends.ends[1].at - ends.ends[0].at);
            told.deviations.extend(ends.of_angle().map(|d| ("arc_angle", json!(d))));
            told
        }
        None => {
            let mut told = Told::default();
            let whole = std::f64::consts::TAU;
            told.dimensions.arc_angle = Some(whole);
            told.dimensions.length = Some(whole * major);
            let deviation =
                known.uncertainty.as_ref().and_then(|u| u.deviations_of("major_radius"));
            told.deviations.extend(deviation.map(|d| ("length", json!(whole * d[0]))));
            told
        }
    };
    told.dimensions.swept_angle = Some(swept);
    diameters(known, &mut told);
    told
}

/// The length between ends and who bounds them.
fn bounded(ends: &Ends) -> Told {
    let dimensions = Dimensions {
        bounded_by: Some(ends.bounded_by()),
        length: Some(ends.length()),
        ..Dimensions::default()
    };
    let mut told = Told { dimensions, deviations: Vec::new() };
    told.deviations.extend(ends.each().map(|d| ("ends", json!(d))));
    told.deviations.extend(ends.of_length().map(|d| ("length", json!(d))));
    told
}

//! A region in the contract's terms.

use serde_json::Value;

use crate::fit::{Ruler, Shape};
use crate::geometry::Vec3;
use crate::segment::Continuity;
use crate::segment::dimensions::Dimensions;
use crate::segment::equation::{Equations, origin_near};
use crate::segment::found::Found;
use crate::segment::median::deviation;
use crate::segment::report::constraints::Candidate;
use crate::segment::report::evidence::evidence;
use crate::segment::report::tally::{Tally, sample};
use crate::segment::report::uncertainty::Uncertainty;
use crate::segment::report::{evidence, uncertainty};
use crate::segment::{Evidence, Extent, Fit, Neighbour, Region};

/// A region's dimensions, and their standard deviations by name.
#[derive(Default)]
pub struct Told {
    /// The dimensions.
    pub dimensions: Dimensions,
    /// What adds to the region's uncertainty.
    pub deviations: Vec<(&'static str, Value)>,
}

/// Two regions that touch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Joint {
    /// The regions, the smaller number first.
    pub regions: [usize; 2],
    /// How their surfaces meet.
    pub continuity: Continuity,
    /// How far from the true joint the boundary may lie.
    pub resolution: f64,
}

impl Known {
    /// `None` where the work was cancelled.
    pub fn of(candidate: &Candidate, tally: &Tally, found: &Found) -> Option<Self> {
        if found.scene.cancelled() {
            return None;
        }
        let members = &candidate.members;
        let n = tally.n;
        let centroid = tally.sum / n.max(1) as f64;
        let shape = candidate.shape.recentred(&centroid);
        let fit = tally.scatter.fit(n, candidate.rejected);
        // The points' scatter about their surface tells its form error too.
        let freedom = n.saturating_sub(shape.family.dof()).max(1) as f64;
        let sigma = found.rounding.max(fit.rms * (n as f64 / freedom).sqrt());
        let stride = members.len().div_ceil(uncertainty::SAMPLE.get()).max(1);
        let some: Vec<Vec3> =
            members.iter().step_by(stride).map(|&i| found.points[i as usize]).collect();
        let share = n as f64 / some.len() as f64;
        let fit = Fit { noise: noise(&shape, &some), ..fit };
        let few = sample(&found.points, members, evidence::SAMPLE.get());
        let extent = tally.extent(&found.centre);
        Some(Self {
            uncertainty: Uncertainty::with(
                &shape,
                &some,
                share,
                sigma,
                &candidate.told.unwrap_or_default(),
            ),
            evidence: evidence(&shape, &few, sigma),
            equations: extent.and_then(|extent| equations(&shape, members, &extent, found)),
            extent,
            shape,
            fit,
        })
    }

    pub fn region(&self, id: usize, centre: &Vec3, joints: &[Joint], told: Told) -> Option<Region> {
        let mut uncertainty = self.uncertainty.as_ref().map(Uncertainty::to_json);
        if let Some(Value::Object(all)) = &mut uncertainty {
            all.extend(told.deviations.into_iter().map(|(name, value)| (name.to_owned(), value)));
        }
        let surface = self.shape.translated(centre).surface();
        let equations = self.equations;
        let extent = self.extent?;
        Some(Region {
            id,
            surface_type: surface.surface_type(),
            point_count: self.fit.used,
            coefficients: equations.map(|e| e.coefficients),
            coefficients_scale: equations.map(|e| e.coefficients_scale),
            coefficients_error: equations.and_then(|e| e.coefficients_error),
            local_origin: origin_near(&extent).into(),
            local_coefficients: equations.map(|e| e.local_coefficients),
            surface: Some(surface),
            dimensions: told.dimensions,
            uncertainty,
            fit: self.fit,
            evidence: self.evidence,
            extent: Some(extent),
            neighbours: joints.iter().filter_map(|j| neighbour(j, id)).collect(),
            snapped: None,
        })
    }
}

/// The noise that points about a surface show: most of them, whatever a few outliers do. What the fit took is counted in.
fn noise(shape: &Shape, points: &[Vec3]) -> f64 {
    let ruler = Ruler::of(shape);
    let n = points.len();
    let freedom = n.saturating_sub(shape.family.dof()).max(1) as f64;
    let scatter = deviation(points.iter().map(|p| ruler.distance(p))).unwrap_or(0.0);
    scatter * (n as f64 / freedom).sqrt()
}

/// The equations of a shape relative to the cloud's centre. The one about an origin near the points comes from the
/// shape itself: what the file's origin has cancelled is not to be had back.
fn equations(shape: &Shape, members: &[u32], extent: &Extent, found: &Found) -> Option<Equations> {
    let far = shape.translated(&found.centre).surface().quadric()?;
    let local = |o: &Vec3| shape.translated(&(found.centre - o)).quadric().unwrap_or(far);
    let point = |k: usize| found.points[members[k] as usize] + found.centre;
    Some(Equations::of(&far, local, extent, members.len(), point))
}

fn neighbour(joint: &Joint, id: usize) -> Option<Neighbour> {
    let [a, b] = joint.regions;
    let region = if a == id {
        b
    } else if b == id {
        a
    } else {
        return None;
    };
    Some(Neighbour { region, continuity: joint.continuity, resolution: joint.resolution })
}

/// A region's surface and all that is known about it.
pub struct Known {
    /// The surface, relative to the cloud's centre, its origin beside the points' centroid.
    pub shape: Shape,
    /// How exactly it is known.
    pub uncertainty: Option<Uncertainty>,
    /// How well the points fit.
    pub fit: Fit,
    /// Why this type.
    pub evidence: Option<Evidence>,
    /// Where the points lie.
    pub extent: Option<Extent>,
    /// The surface's coefficients; none of a torus and of a region without points.
    pub equations: Option<Equations>,
}

//! How exactly a least-squares feature is known.

use nalgebra::DMatrix;

use super::asked::Asked;
use super::descend::residuals;
use super::kind::FeatureType;
use super::lobes::lobes;
use super::pose::Pose;
use super::profile::untold;
use super::small::{Square, inverse};
use super::student::coverage_factor;
use super::terms::{Nature, Term, changes, terms};
use super::together::Together;
use crate::geometry::Vec3;

/// One parameter with its uncertainty.
#[derive(Clone, Debug, PartialEq)]
pub struct Parameter {
    /// Name, as in the surface.
    pub name: &'static str,
    /// Components: of a point its coordinates, of directions theirs.
    pub values: Vec<f64>,
    /// Standard uncertainty of each component; of each direction one, that of its angle in radians. From the scatter of the points, and
    /// in quadrature from the type B input, which counts in full for lengths and over the points' size for angles.
    pub standard: Vec<f64>,
    /// The same times the coverage factor.
    pub expanded: Vec<f64>,
}

/// What is known of how exactly.
#[derive(Clone, Debug, PartialEq)]
pub struct Exactness {
    /// The parameters that the points tell.
    pub parameters: Vec<Parameter>,
    /// The parameters whose components the rows of `covariance` are.
    pub covariance_of: Vec<&'static str>,
    /// Covariance of all their components from the scatter of the points.
    pub covariance: Vec<Vec<f64>>,
    /// Standard deviation of the distances, degrees of freedom taken off.
    pub s: f64,
    /// How many independent points tell as much as these.
    pub n_eff: f64,
    /// Effective degrees of freedom.
    pub freedom: f64,
    /// The factor of expanded uncertainties.
    pub k: f64,
}

/// A size whose standard deviation is over this share of it cannot be told from zero; nor a direction of so many radians: three of
/// them reach zero.
const TOLD: f64 = 1.0 / 3.0;

/// Distances below this, in the points' size, are rounding.
const EXACT: f64 = 1e-13;

/// The uncertainty of a pose of local points whose unit is `scale` long, and the parameters that they do not tell; `None` where there
/// are no more rows than unknowns.
pub fn exactness(
    pose: &Pose,
    points: &[Vec3],
    jj: &Square,
    asked: &Asked,
    scale: f64,
) -> Option<(Exactness, Vec<&'static str>)> {
    let free = asked.fixed.freedoms(pose.kind);
    let (p, rows) = (free.count(), pose.kind.rows() * points.len());
    if rows <= p {
        return None;
    }
    let cost: f64 = residuals(pose, points).iter().map(|d| d * d).sum();
    let s = (cost / (rows - p) as f64).sqrt();
    let information = DMatrix::from_fn(p, p, |a, b| jj[a][b]);
    let white = inverse(&information)?;
    // Lobes are taken out before the rest is asked what it has in common.
    let lobes = if s > EXACT { lobes(pose, points, &free, jj, &white) } else { None };
    let without = lobes.as_ref().map(|lobes| lobes.without(points));
    let rest = without.as_deref().unwrap_or(points);
    let s_rest = lobes.as_ref().map_or(s, |lobes| lobes.deviation);
    let shaken = if s_rest > EXACT {
        &white * Together::of(pose, rest, &free, jj, s_rest).shaken()
    } else {
        DMatrix::identity(p, p)
    };
    let inflation = (shaken.trace() / p.max(1) as f64).max(1.0);
    let n_eff = points.len() as f64 / inflation;
    let freedom = (pose.kind.rows() as f64 * n_eff - p as f64).max(1.0);
    let k = coverage_factor(asked.coverage, freedom);
    let mut of_freedoms = shaken * &white * (s_rest * s_rest);
    let untold = untold(pose, rest, &free, &of_freedoms, |a| of_freedoms[(a, a)] / white[(a, a)]);
    if let Some(lobes) = &lobes {
        of_freedoms += &lobes.moved;
    }
    let all = changes(pose);
    let open = DMatrix::from_fn(all.nrows(), p, |row, a| all[(row, free.slots()[a])]);
    let by_untold = through(&of_freedoms, &untold, &open);
    let mut covariance = &open * of_freedoms * open.transpose();
    let terms = terms(pose);
    let factors: Vec<f64> =
        terms.iter().flat_map(|t| t.values.iter().map(|_| factor(t, scale))).collect();
    for (row, a) in factors.iter().enumerate() {
        for (column, b) in factors.iter().enumerate() {
            covariance[(row, column)] *= a * b;
        }
    }
    let by_untold = by_untold.iter().zip(&factors).map(|(v, f)| v * f * f).collect();
    let sq_size = points.iter().map(Vec3::norm_squared).sum::<f64>() / points.len() as f64;
    let size = sq_size.sqrt() * scale;
    let is_thin = is_thin(pose, s);
    let told = Told { covariance, k, scale, type_b: asked.type_b, size, by_untold, is_thin };
    let (parameters, rows, unknown) = told.parameters(terms);
    let row = |&a: &usize| rows.iter().map(|&b| told.covariance[(a, b)]).collect();
    let covariance = rows.iter().map(row).collect();
    let covariance_of = parameters.iter().map(|p| p.name).collect();
    let s = s * scale;
    Some((Exactness { parameters, covariance_of, covariance, s, n_eff, freedom, k }, unknown))
}

/// What the components of a parameter are multiplied by to be in the input's unit.
fn factor(term: &Term, scale: f64) -> f64 {
    if matches!(term.nature, Nature::Point | Nature::Size) { scale } else { 1.0 }
}

/// What the uncertainties of single parameters are made of.
struct Told {
    /// That of all components.
    covariance: DMatrix<f64>,
    k: f64,
    scale: f64,
    type_b: f64,
    /// Root mean square size of the points.
    size: f64,
    /// What of the variance of each component comes by sizes that are told less well than `covariance` says; empty where there
    /// are none.
    by_untold: Vec<f64>,
    /// Whether the feature is thinner than its noise.
    is_thin: bool,
}

/// A size of fewer standard deviations of the noise is none. Of 20 points one lies on the other side of the middle then; and a cylinder
/// round the points of a line is 1.9 wide, as it is always nearer to them than the line.
const THIN: f64 = 2.0;

/// Whether a pose is thinner than noise of deviation `s`.
fn is_thin(pose: &Pose, s: f64) -> bool {
    let free = pose.kind.slots().iter().filter_map(|slot| slot.checked_sub(6));
    // a cone has no thickness: its radius beside the points may be zero
    pose.kind != FeatureType::Cone && free.map(|k| pose.size[k]).any(|size| size < THIN * s)
}

/// Share of a parameter's variance that may come by an untold size: without it, its standard uncertainty is less by a tenth.
const BY_UNTOLD: f64 = 0.19;

/// What of the variances of the components `open`, which are linear in the places, comes by the `untold` ones: that of their
/// regression on these. Empty where there are none, or none can be told.
fn through(covariance: &DMatrix<f64>, untold: &[usize], open: &DMatrix<f64>) -> Vec<f64> {
    if untold.is_empty() {
        return Vec::new();
    }
    let among =
        DMatrix::from_fn(untold.len(), untold.len(), |a, b| covariance[(untold[a], untold[b])]);
    let with =
        DMatrix::from_fn(covariance.nrows(), untold.len(), |a, b| covariance[(a, untold[b])]);
    let with = open * with;
    // singular where one untold size follows from the others: then these say it all
    let inverse = among.clone().pseudo_inverse(1e-12 * among.amax()).unwrap_or(among);
    (&with * inverse * with.transpose()).diagonal().iter().copied().collect()
}

impl Told {
    /// The parameters that are told, the rows of their components, and the names of the others.
    fn parameters(&self, terms: Vec<Term>) -> (Vec<Parameter>, Vec<usize>, Vec<&'static str>) {
        let (mut parameters, mut rows, mut unknown, mut at) = (vec![], vec![], vec![], 0);
        for term in terms {
            let (from, width) = (at, term.values.len());
            at += width;
            let values: Vec<f64> =
                term.values.iter().map(|v| v * factor(&term, self.scale)).collect();
            let scatter = self.scatter(term.nature, from, width);
            let is_told = match term.nature {
                _ if self.is_thin => false,
                Nature::Size | Nature::Angle if !self.by_untold.is_empty() => false,
                _ if self.is_by_untold(from, width) => false,
                // which direction is the first is told by the sizes
                Nature::Direction if width > 3 && !self.by_untold.is_empty() => false,
                Nature::Point => true,
                Nature::Direction => scatter.iter().all(|u| *u < TOLD),
                _ => scatter.iter().zip(&values).all(|(u, v)| *u < TOLD * v.abs()),
            };
            if !is_told {
                unknown.push(term.name);
                continue;
            }
            rows.extend(from..at);
            let is_length = matches!(term.nature, Nature::Point | Nature::Size);
            let common = if is_length { self.type_b } else { self.type_b / self.size };
            let standard: Vec<f64> = scatter.iter().map(|u| u.hypot(common)).collect();
            let expanded = standard.iter().map(|u| self.k * u).collect();
            parameters.push(Parameter { name: term.name, values, standard, expanded });
        }
        (parameters, rows, unknown)
    }

    /// Whether too much of the variance of so many components comes by untold sizes.
    fn is_by_untold(&self, from: usize, width: usize) -> bool {
        let all: f64 = (from..from + width).map(|k| self.covariance[(k, k)]).sum();
        let by: f64 = self.by_untold.iter().skip(from).take(width).sum();
        by > BY_UNTOLD * all
    }

    /// Standard deviations of components; of directions those of their angles.
    fn scatter(&self, nature: Nature, from: usize, width: usize) -> Vec<f64> {
        let of = |k: usize| self.covariance[(from + k, from + k)].max(0.0);
        match nature {
            Nature::Direction => {
                (0..width).step_by(3).map(|k| (of(k) + of(k + 1) + of(k + 2)).sqrt()).collect()
            }
            _ => (0..width).map(|k| of(k).sqrt()).collect(),
        }
    }
}

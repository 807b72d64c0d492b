mod error;
mod given;
mod hint;
mod kind;
mod limits;
mod method;
mod table;

use serde::{Deserialize, Serialize};

use crate::geometry::SurfaceType;
use given::Given;

pub use error::ParameterError;
pub use given::truth;
pub use hint::{EXAMPLE as HINT_EXAMPLE, Hint, HintAction};
pub use kind::ParameterKind;
pub use limits::{MAX_HINT_BYTES, MAX_HINTS};
pub use method::Method;
pub use table::{PARAMETERS, ParameterSpec};

/// Every parameter of a segmentation. Lengths are in the input's unit, angles in radians.
///
/// `PARAMETERS` holds each one's name, unit, range and meaning; all transports read that table.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct Parameters {
    /// Which policies to run with.
    pub method: Method,
    /// Largest distance of a point from its surface; four noise sigmas when absent. No region has a point
    /// beyond it.
    pub tolerance: Option<f64>,
    /// Standard deviation of the points' noise; estimated from the cloud when absent. No region is
    /// reported whose residuals' root mean square is above twice the value given, or above half the
    /// tolerance where one is given that allows more. What is below 5e-8 of the cloud's size, the rounding
    /// of single precision, counts as that.
    pub noise_sigma: Option<f64>,
    /// The types looked for.
    pub surfaces: Vec<SurfaceType>,
    /// Smallest number of points a region may have.
    pub min_points: usize,
    /// Largest number of regions reported.
    pub max_regions: usize,
    /// Largest gap inside one piece of a surface: wider ones part it into regions; none does when absent.
    pub connectivity: Option<f64>,
    /// Smallest radius or semi-axis looked for.
    pub min_radius: Option<f64>,
    /// Largest radius or semi-axis looked for.
    pub max_radius: Option<f64>,
    /// Direction the axes (or plane normals) must have.
    pub axis_direction: Option<[f64; 3]>,
    /// Largest angle between an axis and `axis_direction`.
    pub axis_tolerance: f64,
    /// Seed of the random generator.
    pub seed: u64,
    /// How many seeds in a row may fail before growth stops.
    pub max_failed_seeds: usize,
    /// Whether pieces of one surface are joined.
    pub merge: bool,
    /// Whether boundaries and surfaces are refined at the end.
    pub refine: bool,
    /// `rcond` only: a point joins while rcond(S) stays below this. 1-norm, raw coordinates.
    pub rcond_threshold: f64,
    /// `rcond` only: largest algebraic residual |x.a| (a10 = 1) of an extracted point.
    pub algebraic_threshold: f64,
    /// What a person knows of places in the cloud. `rcond` takes those alone that crop.
    #[serde(default)]
    #[schema(max_items = 64)]
    pub hints: Vec<Hint>,
}

impl Default for Parameters {
    fn default() -> Self {
        Self {
            method: Method::Distance,
            tolerance: None,
            noise_sigma: None,
            surfaces: SurfaceType::DEFAULT.to_vec(),
            min_points: 50,
            max_regions: 10_000,
            connectivity: None,
            min_radius: None,
            max_radius: None,
            axis_direction: None,
            axis_tolerance: 0.05,
            seed: 0,
            max_failed_seeds: 50,
            merge: true,
            refine: true,
            rcond_threshold: 0.5e-19,
            algebraic_threshold: 5e-5,
            hints: Vec::new(),
        }
    }
}

impl Parameters {
    /// Sets one parameter from text, as queries and flags give it.
    ///
    /// # Errors
    /// The name is unknown, or the value is not one the parameter takes, by itself or beside those set
    /// before.
    pub fn set(&mut self, name: &str, value: &str) -> Result<(), ParameterError> {
        let spec = PARAMETERS
            .iter()
            .find(|p| p.name == name)
            .ok_or_else(|| ParameterError::Unknown(name.to_owned()))?;
        let given = Given { spec, value };
        match spec.name {
            "method" => self.method = given.method()?,
            "tolerance" => self.tolerance = Some(given.number()?),
            "noise_sigma" => self.noise_sigma = Some(given.number()?),
            "surfaces" => self.surfaces = given.types()?,
            "min_points" => self.min_points = given.integer()? as usize,
            "max_regions" => self.max_regions = given.integer()? as usize,
            "connectivity" => self.connectivity = Some(given.number()?),
            "min_radius" => self.min_radius = Some(given.number()?),
            "max_radius" => self.max_radius = Some(given.number()?),
            "axis_direction" => self.axis_direction = Some(given.direction()?),
            "axis_tolerance" => self.axis_tolerance = given.number()?,
            "seed" => self.seed = given.integer()?,
            "max_failed_seeds" => self.max_failed_seeds = given.integer()? as usize,
            "merge" => self.merge = given.boolean()?,
            "refine" => self.refine = given.boolean()?,
            "rcond_threshold" => self.rcond_threshold = given.number()?,
            "algebraic_threshold" => self.algebraic_threshold = given.number()?,
            "hints" => self.hints = hint::read(value)?,
            _ => return Err(ParameterError::Unknown(name.to_owned())),
        }
        self.check_radii()?;
        self.check_hints()
    }

    fn check_hints(&self) -> Result<(), ParameterError> {
        let crops = |hint: &Hint| hint.action == HintAction::Crop;
        if self.method == Method::Rcond && !self.hints.iter().all(crops) {
            let detail = "method rcond takes those alone that crop: leave the others out, or use method distance";
            return Err(ParameterError::Hints(detail.to_owned()));
        }
        Ok(())
    }

    fn check_radii(&self) -> Result<(), ParameterError> {
        match (self.min_radius, self.max_radius) {
            (Some(min), Some(max)) if min > max => Err(ParameterError::EmptyRange { min, max }),
            _ => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_row_with_a_default_sets_to_that_default() {
        let mut p = Parameters::default();
        for spec in PARAMETERS {
            if let Some(default) = spec.default {
                p.set(spec.name, default).unwrap_or_else(|e| panic!("{e}"));
            }
        }
        assert_eq!(p, Parameters::default());
    }

    #[test]
    fn the_table_names_every_field() {
        let json = serde_json::to_value(Parameters::default()).unwrap_or_default();
        let mut fields: Vec<_> = json.as_object().into_iter().flat_map(|o| o.keys()).collect();
        let mut rows: Vec<_> = PARAMETERS.iter().map(|p| p.name).collect();
        fields.sort();
        rows.sort();
        assert_eq!(fields, rows);
    }

    #[test]
    fn a_value_out_of_range_is_refused_with_its_range() {
        let error = Parameters::default().set("axis_tolerance", "2").map_err(|e| e.to_string());
        assert_eq!(
            error,
            Err("parameter 'axis_tolerance': '2' is not a number above 0 and at most 1.5707963267948966".into())
        );
        for (name, value) in [
            ("tolerance", "0"),
            ("tolerance", "NaN"),
            ("min_points", "9"),
            ("surfaces", "plane,blob"),
            ("axis_direction", "0,0,0"),
            ("merge", "maybe"),
        ] {
            assert!(Parameters::default().set(name, value).is_err(), "{name}={value}");
        }
    }

    #[test]
    fn a_smallest_radius_above_the_largest_is_refused_whichever_comes_first() {
        let set = |order: [(&str, &str); 2]| {
            let mut p = Parameters::default();
            order.iter().try_for_each(|(name, value)| p.set(name, value))
        };
        let error = Err(ParameterError::EmptyRange { min: 5.0, max: 2.0 });
        assert_eq!(set([("min_radius", "5"), ("max_radius", "2")]), error);
        assert_eq!(set([("max_radius", "2"), ("min_radius", "5")]), error);
        assert_eq!(set([("min_radius", "2"), ("max_radius", "2")]), Ok(()));
    }
}

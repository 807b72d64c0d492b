use serde::{Deserialize, Serialize};

use crate::fit::{Family, Shape};
use crate::geometry::{Mat3, Vec3};
use crate::segment::label::around::Around;
use crate::segment::prepare::morton::Codes;
use crate::segment::prepare::scene::Scene;

/// What the points of a tile are labelled by.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Guide {
    /// The cloud's centre.
    centre: [f64; 3],
    /// Corner of the box of the Morton codes, relative to the centre, and steps of a length.
    corner: [f64; 3],
    steps: f64,
    /// Some of the cloud's points in the order of their codes, relative to the centre.
    points: Vec<[f64; 3]>,
    /// The labels that each and its neighbours have: where those of each end, and all of them.
    ends: Vec<u32>,
    labels: Vec<i32>,
    surfaces: Vec<Surface>,
}

/// A surface that points are given to.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Surface {
    /// The place of its family among all of them.
    family: usize,
    origin: [f64; 3],
    /// Column by column.
    frame: [[f64; 3]; 3],
    size: [f64; 3],
    /// The scatter that points are given to it by, and how far from it they lie at most.
    sigma: f64,
    reach: f64,
}

impl Surface {
    fn of(shape: &Shape, sigma: f64, reach: f64) -> Self {
        let family = Family::ALL.iter().position(|f| *f == shape.family).unwrap_or_default();
        let frame = [0, 1, 2].map(|k| shape.frame.column(k).into_owned().into());
        Self { family, origin: shape.origin.into(), frame, size: shape.size, sigma, reach }
    }

    fn shape(&self) -> Option<Shape> {
        let family = *Family::ALL.get(self.family)?;
        let frame = Mat3::from_columns(&self.frame.map(Vec3::from));
        Some(Shape { family, origin: self.origin.into(), frame, size: self.size })
    }
}

impl Guide {
    /// The guide by the points of a scene, which have these labels, to surfaces, each with its scatter and its reach.
    pub fn of(
        scene: &Scene,
        centre: &Vec3,
        labels: &[i32],
        surfaces: impl Iterator<Item = (Shape, f64, f64)>,
    ) -> Self {
        let codes = Codes::of(&scene.points);
        let (ends, labels) = Around::of(scene, labels).into_parts();
        Self {
            centre: (*centre).into(),
            corner: codes.lo.into(),
            steps: codes.scale,
            points: scene.points.iter().map(|p| (*p).into()).collect(),
            ends,
            labels,
            surfaces: surfaces
                .map(|(shape, sigma, reach)| Surface::of(&shape, sigma, reach))
                .collect(),
        }
    }

    /// The cloud's centre.
    pub fn centre(&self) -> Vec3 {
        self.centre.into()
    }

    pub(super) fn codes(&self) -> Codes {
        Codes { lo: self.corner.into(), scale: self.steps }
    }

    pub(super) fn points(&self) -> Vec<Vec3> {
        self.points.iter().map(|p| Vec3::from(*p)).collect()
    }

    /// The labels around each point; `None` where they are not those of as many points and surfaces.
    pub(super) fn around(&self) -> Option<Around> {
        let known = -1..self.surfaces.len() as i32;
        let fits = self.ends.len() == self.points.len()
            && self.ends.is_sorted()
            && self.ends.last().is_none_or(|end| *end as usize == self.labels.len())
            && self.labels.iter().all(|l| known.contains(l));
        fits.then(|| Around::from_parts(self.ends.clone(), self.labels.clone()))
    }

    /// The surfaces; `None` where one is of no known family.
    pub(super) fn shapes(&self) -> Option<Vec<Shape>> {
        self.surfaces.iter().map(Surface::shape).collect()
    }

    /// The scatter that points are given to each surface by.
    pub(super) fn sigmas(&self) -> Vec<f64> {
        self.surfaces.iter().map(|s| s.sigma).collect()
    }

    /// How far from each surface its points lie at most.
    pub(super) fn reaches(&self) -> Vec<f64> {
        self.surfaces.iter().map(|s| s.reach).collect()
    }
}

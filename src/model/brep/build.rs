//! From a segmentation to faces, edges and vertices.

use rayon::prelude::*;

use super::arc::arcs;
use super::bound::bounded;
use super::corner::corners;
use super::edge::{Edge, OWN, edges};
use super::face::Face;
use super::joint::joints;
use super::part::{Part, Source};
use super::settle::settle;
use super::sheet::Sheet;
use super::shell::{Shell, shells};
use crate::geometry::Vec3;

/// Faces, edges and vertices of a part.
pub struct Model {
    /// The middle of the points' box: all places are told from here.
    pub centre: Vec3,
    /// The surface of each region.
    pub sheets: Vec<Option<Sheet>>,
    /// Places of the vertices.
    pub vertices: Vec<Vec3>,
    /// Edges.
    pub edges: Vec<Edge>,
    /// Faces.
    pub faces: Vec<Face>,
    /// Faces that hang together.
    pub shells: Vec<Shell>,
    /// For each region whose joints could not be closed to a line around it, why: its faces have borders of their own.
    pub apart: Vec<(usize, &'static str)>,
}

impl Model {
    /// The boundary representation of a segmentation.
    pub fn of(source: &Source) -> Self {
        let part = Part::of(source);
        let mut joints = joints(&part);
        let (cuts, mut vertices) = corners(&part, &joints);
        let inner = vertices.len();
        let mut all = arcs(&part, &joints, &cuts, &mut vertices);
        let odd = settle(&joints, &mut all, |c| c >= inner);
        super::mend::mend(&part, &mut joints, &mut all, &mut vertices, odd);
        let mut edges = edges(&joints, &all);
        let regions: Vec<usize> =
            (0..part.sheets.len()).filter(|&r| part.sheets[r].is_some()).collect();
        let all: Vec<_> =
            regions.par_iter().map(|&r| bounded(&part, &edges, &vertices, r)).collect();
        let (mut faces, mut apart) = (Vec::new(), Vec::new());
        for (r, one) in regions.iter().zip(all) {
            let Some(one) = one else {
                apart.push((*r, "its points have no outline"));
                continue;
            };
            if let Some(why) = one.apart {
                apart.push((*r, why));
                edges.iter_mut().for_each(|e| e.regions.retain(|own| own != r));
            }
            let shift = [vertices.len(), edges.len()];
            vertices.extend(one.vertices);
            let place = |k: usize| if k >= OWN { k - OWN + shift[0] } else { k };
            let own = one.own.into_iter();
            edges.extend(own.map(|e| Edge { ends: e.ends.map(place), ..e }));
            for mut face in one.faces {
                for u in face.bounds.iter_mut().flat_map(|b| &mut b.uses) {
                    if u.edge >= OWN {
                        u.edge = u.edge - OWN + shift[1];
                    }
                }
                faces.push(face);
            }
        }
        let shells = shells(source.regions, &part, &mut edges, &mut faces);
        Self { centre: part.centre, sheets: part.sheets, vertices, edges, faces, shells, apart }
    }
}

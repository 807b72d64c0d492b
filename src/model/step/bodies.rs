//! The shells of a part with their faces, edges and vertices.

use std::collections::BTreeMap;

use super::file::{self, Entities, Id, list};
use super::product::{self, Written};
use super::{curve, surface};
use crate::geometry::Vec3;
use crate::model::brep::build::Model;
use crate::model::brep::edge::{Edges, Use};
use crate::model::brep::face::Face;
use crate::model::brep::measure::line;
use crate::segment::Region;

/// What is written for a part's shells.
pub struct Bodies<'a> {
    model: &'a Model,
    regions: &'a [Region],
    out: Entities,
    vertices: BTreeMap<usize, Id>,
    edges: BTreeMap<usize, Id>,
    /// Each face with its region.
    faces: Vec<(Id, usize)>,
    /// Each shell's place in the model, and the item that stands for it.
    items: Vec<(usize, Id)>,
}

impl<'a> Bodies<'a> {
    pub fn new(model: &'a Model, regions: &'a [Region]) -> Self {
        Self {
            model,
            regions,
            out: Entities::default(),
            vertices: BTreeMap::new(),
            edges: BTreeMap::new(),
            faces: Vec::new(),
            items: Vec::new(),
        }
    }

    /// Writes a shell.
    pub fn body(&mut self, shell: usize) {
        let model = self.model;
        let shell_of = &model.shells[shell];
        let faces: Vec<Id> =
            shell_of.faces.iter().filter_map(|&f| self.face(&model.faces[f])).collect();
        if faces.is_empty() {
            return;
        }
        let name = product::name(model, self.regions, shell);
        let name = file::string(&name);
        let faces = list(faces);
        let item = if shell_of.closed {
            let skin = self.out.add(&format!("CLOSED_SHELL({name},{faces})"));
            self.out.add(&format!("MANIFOLD_SOLID_BREP({name},{skin})"))
        } else {
            let skin = self.out.add(&format!("OPEN_SHELL({name},{faces})"));
            self.out.add(&format!("SHELL_BASED_SURFACE_MODEL({name},({skin}))"))
        };
        self.items.push((shell, item));
    }

    /// What was written.
    pub fn written(self) -> Written {
        Written { out: self.out, faces: self.faces, items: self.items }
    }

    fn face(&mut self, face: &Face) -> Option<Id> {
        let model = self.model;
        let sheet = model.sheets[face.region].as_ref()?;
        let region = &self.regions[face.region];
        let edges = Edges::all(&model.edges);
        let lines: Vec<Vec<Vec3>> = face.bounds.iter().map(|b| line(&edges, &b.uses)).collect();
        let exact = region.surface.as_ref()?;
        let surface = surface::surface(&mut self.out, exact, sheet, &model.centre, &lines);
        let mut bounds = Vec::new();
        for (k, bound) in face.bounds.iter().enumerate() {
            let edges = self.line(&bound.uses, face.flipped);
            let line = self.out.add(&format!("EDGE_LOOP('',{})", list(edges)));
            let kind = if k == 0 && face.has_outer { "FACE_OUTER_BOUND" } else { "FACE_BOUND" };
            bounds.push(self.out.add(&format!("{kind}('',{line},.T.)")));
        }
        if bounds.is_empty() {
            let at = self.out.point(&(sheet.at([0.0, 0.0]) + model.centre));
            let vertex = self.out.add(&format!("VERTEX_POINT('',{at})"));
            let line = self.out.add(&format!("VERTEX_LOOP('',{vertex})"));
            bounds.push(self.out.add(&format!("FACE_BOUND('',{line},.T.)")));
        }
        let name = file::string(&product::face_name(region));
        let sense = if face.flipped { ".F." } else { ".T." };
        let id = self.out.add(&format!("ADVANCED_FACE({name},{},{surface},{sense})", list(bounds)));
        self.faces.push((id, face.region));
        Some(id)
    }

    /// The edges of a line around a face, counter-clockwise seen from outside of the material.
    fn line(&mut self, uses: &[Use], flipped: bool) -> Vec<Id> {
        let mut uses: Vec<Use> = uses.to_vec();
        if flipped {
            uses.reverse();
            uses.iter_mut().for_each(|u| u.forward = !u.forward);
        }
        uses.iter()
            .map(|u| {
                let edge = self.edge(u.edge);
                let sense = if u.forward { ".T." } else { ".F." };
                self.out.add(&format!("ORIENTED_EDGE('',*,*,{edge},{sense})"))
            })
            .collect()
    }

    fn edge(&mut self, k: usize) -> Id {
        if let Some(id) = self.edges.get(&k) {
            return *id;
        }
        let edge = &self.model.edges[k];
        let ends = edge.ends.map(|v| self.vertex(v));
        let curve = curve::curve(&mut self.out, edge, &self.model.centre);
        let id = self.out.add(&format!("EDGE_CURVE('',{},{},{curve},.T.)", ends[0], ends[1]));
        self.edges.insert(k, id);
        id
    }

    fn vertex(&mut self, v: usize) -> Id {
        let (model, out) = (self.model, &mut self.out);
        *self.vertices.entry(v).or_insert_with(|| {
            let at = out.point(&(model.vertices[v] + model.centre));
            out.add(&format!("VERTEX_POINT('',{at})"))
        })
    }
}

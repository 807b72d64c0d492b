//! Faces that hang together by their edges, and which side the material is on.

use std::collections::{BTreeMap, BTreeSet};

use super::edge::{Edge, Edges, Use};
use super::face::Face;
use super::measure::measure;
use super::part::Part;
use crate::segment::{Region, Side};

/// Faces joined by shared edges.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Shell {
    /// The faces.
    pub faces: Vec<usize>,
    /// Whether every edge lies between two of them: then it is the skin of a solid.
    pub closed: bool,
    /// Regions with an edge that no other face shares.
    pub open: Vec<usize>,
}

/// The faces and directions of use of each edge.
fn uses(faces: &[Face]) -> BTreeMap<usize, Vec<(usize, bool)>> {
    let mut out: BTreeMap<usize, Vec<(usize, bool)>> = BTreeMap::new();
    for (k, face) in faces.iter().enumerate() {
        for u in face.bounds.iter().flat_map(|b| &b.uses) {
            out.entry(u.edge).or_default().push((k, u.forward));
        }
    }
    out
}

/// Groups faces into shells and turns each face's normal outward. An edge that two faces use so that no normal fits both is
/// doubled: they then have one each.
pub fn shells(
    regions: &[Region],
    part: &Part,
    edges: &mut Vec<Edge>,
    faces: &mut [Face],
) -> Vec<Shell> {
    let groups = loop {
        let (groups, wrong) = groups(faces);
        if wrong.is_empty() {
            break groups;
        }
        for (edge, face) in wrong {
            let copy = edges[edge].clone();
            edges.push(copy);
            let fresh = edges.len() - 1;
            for u in faces[face].bounds.iter_mut().flat_map(|b| &mut b.uses) {
                if u.edge == edge {
                    u.edge = fresh;
                }
            }
        }
    };
    let uses = uses(faces);
    groups.into_iter().map(|group| finished(regions, part, edges, faces, &uses, group)).collect()
}

/// Faces that hang together, each turned as its neighbours are, and the edges, with a face, at which that is not possible.
fn groups(faces: &mut [Face]) -> (Vec<Vec<usize>>, BTreeSet<(usize, usize)>) {
    let uses = uses(faces);
    let mut of = vec![usize::MAX; faces.len()];
    let (mut groups, mut wrong) = (Vec::new(), BTreeSet::new());
    for first in 0..faces.len() {
        if of[first] != usize::MAX {
            continue;
        }
        let id = groups.len();
        (of[first], faces[first].flipped) = (id, false);
        let (mut group, mut next) = (vec![first], 0);
        while next < group.len() {
            let k = group[next];
            next += 1;
            let own: Vec<Use> = faces[k].bounds.iter().flat_map(|b| b.uses.clone()).collect();
            for u in own {
                let beside = uses.get(&u.edge).into_iter().flatten().filter(|o| o.0 != k);
                for &(other, way) in beside {
                    let flipped = faces[k].flipped ^ (way == u.forward);
                    if of[other] == usize::MAX {
                        (of[other], faces[other].flipped) = (id, flipped);
                        group.push(other);
                    } else if faces[other].flipped != flipped {
                        wrong.insert((u.edge, k.max(other)));
                    }
                }
            }
        }
        group.sort_unstable();
        groups.push(group);
    }
    (groups, wrong)
}

fn finished(
    regions: &[Region],
    part: &Part,
    edges: &[Edge],
    faces: &mut [Face],
    uses: &BTreeMap<usize, Vec<(usize, bool)>>,
    group: Vec<usize>,
) -> Shell {
    let is_open = |f: &usize| {
        faces[*f]
            .bounds
            .iter()
            .flat_map(|b| &b.uses)
            .any(|u| uses.get(&u.edge).map_or(0, Vec::len) != 2)
    };
    let mut open: Vec<usize> =
        group.iter().filter(|f| is_open(f)).map(|f| faces[*f].region).collect();
    open.sort_unstable();
    open.dedup();
    let closed = open.is_empty();
    let sign = |f: &usize| if faces[*f].flipped { -1.0 } else { 1.0 };
    let outward: f64 = if closed {
        let volume = |f: &usize| {
            part.sheets[faces[*f].region]
                .as_ref()
                .map_or(0.0, |s| measure(s, &Edges::all(edges), &faces[*f]).volume)
        };
        group.iter().map(|f| sign(f) * volume(f)).sum()
    } else {
        let side = |f: &usize| match regions[faces[*f].region].dimensions.side {
            Some(Side::Hole) => -1.0,
            Some(Side::Boss) => 1.0,
            _ => 0.0,
        };
        group.iter().map(|f| sign(f) * side(f)).sum()
    };
    if outward < 0.0 {
        group.iter().for_each(|&f| faces[f].flipped = !faces[f].flipped);
    }
    Shell { faces: group, closed, open }
}

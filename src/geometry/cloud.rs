use std::sync::Arc;

use super::{LengthUnit, Thinned, Vec3};

/// The rows and columns of an organised cloud.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Grid {
    /// Points in a row.
    pub width: usize,
    /// Number of rows.
    pub height: usize,
}

/// The finite points of a cloud, and where they stood in the input.
///
/// Input points with a NaN or infinite coordinate (the holes of an organised cloud among them) are
/// not stored; they are counted, and labelled -1 in every answer. Of a thinned cloud no others are stored than the kept
/// points, and each input point has the label of the one nearest to it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PointCloud {
    /// The finite points in input order, in the input's unit.
    pub points: Vec<Vec3>,
    /// The input index of each stored point, ascending; `None` where nothing was skipped.
    pub input_index: Option<Vec<u32>>,
    /// How many points the input had, skipped ones included.
    pub input_len: usize,
    /// Rows and columns, where the input was organised.
    pub grid: Option<Grid>,
    /// The mesh, where the input was one.
    pub mesh: Option<Arc<Mesh>>,
    /// The unit of its lengths, where the file states it.
    pub unit: Option<LengthUnit>,
    /// The step in which the file's numbers came before a pose was applied, as far as it is known: 0 where not.
    pub resolution: f64,
    /// How many of the skipped points stood at exactly 0, 0, 0, where so many do that they are taken for holes.
    pub holes_at_origin: usize,
    /// A number for each stored point, where the input has a column of such: those of an earlier result.
    pub labels: Option<Vec<i32>>,
    /// The outward normal at each stored point, of any length, where the input has them.
    pub normals: Option<Vec<[f32; 3]>>,
    /// Finite points that are worked on elsewhere, and not stored.
    pub elsewhere: usize,
    /// How the input was thinned, where it was: the stored points are those that were kept.
    pub thinned: Option<Arc<Thinned>>,
}

/// A mesh, of which the points are the vertices or samples.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// Vertices of the file.
    pub vertices: usize,
    /// Faces of the file.
    pub faces: usize,
    /// What the points are samples of; the points are the vertices where it is absent.
    pub samples: Option<MeshSamples>,
}

/// How the surface of a mesh was sampled, and what each sample is of.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MeshSamples {
    /// Distance of a sample from the next, were they on squares.
    pub spacing: f64,
    /// The largest distance of the curved surfaces from the flat faces that stand for them, but for a few. Samples scatter
    /// by a fifth of it.
    pub chord_error: f64,
    /// Faces of the file.
    pub faces: usize,
    /// The face of each point.
    pub face_of: Vec<u32>,
    /// Faces with an area and without a sample, each with a sample near by.
    pub stand_ins: Vec<[u32; 2]>,
}

impl MeshSamples {
    /// The label of each face: the one that most of its samples have, the smaller one of two; -1 without any area.
    pub fn face_labels(&self, labels: &[i32]) -> Vec<i32> {
        let mut pairs: Vec<(u32, i32)> =
            self.face_of.iter().zip(labels).map(|(face, label)| (*face, *label)).collect();
        let label = |point: u32| labels.get(point as usize).copied().unwrap_or(-1);
        pairs.extend(self.stand_ins.iter().map(|[face, point]| (*face, label(*point))));
        pairs.sort_unstable();
        let mut told = vec![-1; self.faces];
        for of_face in pairs.chunk_by(|a, b| a.0 == b.0) {
            let runs = of_face.chunk_by(|a, b| a.1 == b.1);
            // the first of the longest
            let most = runs.rev().max_by_key(|run| run.len());
            if let Some(run) = most {
                told[run[0].0 as usize] = run[0].1;
            }
        }
        told
    }
}

impl PointCloud {
    /// Keeps the finite points of `points` and remembers the input index of each.
    pub fn from_points(mut points: Vec<Vec3>) -> Self {
        let input_len = points.len();
        let finite = |p: &Vec3| p.x.is_finite() && p.y.is_finite() && p.z.is_finite();
        if points.iter().all(finite) {
            return Self { points, input_len, ..Self::default() };
        }
        let index = (0u32..).zip(&points).filter(|(_, p)| finite(p)).map(|(i, _)| i).collect();
        points.retain(finite);
        Self { points, input_index: Some(index), input_len, ..Self::default() }
    }

    /// What the points are samples of, where they are.
    pub fn samples(&self) -> Option<&MeshSamples> {
        self.mesh.as_deref().and_then(|mesh| mesh.samples.as_ref())
    }

    /// How many input points were left out because a coordinate was not finite.
    pub fn skipped(&self) -> usize {
        self.input_len
            - self.thinned.as_ref().map_or(self.points.len() + self.elsewhere, |t| t.finite)
    }

    /// Gives `take` all input points in their order, some at a time; those left out are NaN. The cloud must not be thinned.
    ///
    /// # Errors
    /// `take` fails.
    pub fn each_block<E>(&self, mut take: impl FnMut(&[Vec3]) -> Result<(), E>) -> Result<(), E> {
        /// Points of a block with holes.
        const BLOCK: usize = 4096;
        let Some(index) = &self.input_index else { return take(&self.points) };
        let (mut block, mut stored) = (Vec::with_capacity(BLOCK), 0);
        for first in (0..self.input_len).step_by(BLOCK) {
            let end = self.input_len.min(first + BLOCK);
            block.clear();
            block.resize(end - first, Vec3::repeat(f64::NAN));
            while let Some(&at) = index.get(stored).filter(|&&at| (at as usize) < end) {
                block[at as usize - first] = self.points[stored];
                stored += 1;
            }
            take(&block)?;
        }
        Ok(())
    }

    /// The points that `keep` says, by themselves; input indices are those of the stored points here.
    pub fn part(&self, keep: &[bool]) -> Self {
        let index: Vec<u32> = (0..self.points.len() as u32).filter(|&i| keep[i as usize]).collect();
        fn taken<T: Copy>(values: &[T], index: &[u32]) -> Vec<T> {
            index.iter().map(|&i| values[i as usize]).collect()
        }
        Self {
            points: taken(&self.points, &index),
            input_len: self.points.len(),
            grid: None,
            labels: self.labels.as_ref().map(|all| taken(all, &index)),
            normals: self.normals.as_ref().map(|all| taken(all, &index)),
            input_index: Some(index),
            unit: self.unit,
            resolution: self.resolution,
            holes_at_origin: 0,
            mesh: None,
            elsewhere: 0,
            thinned: None,
        }
    }

    /// The values of the stored points among those of all input points; none where these are not as many.
    pub fn of_stored<T: Copy>(&self, all: Vec<T>) -> Option<Vec<T>> {
        if all.len() != self.input_len {
            return None;
        }
        let Some(index) = &self.input_index else { return Some(all) };
        Some(index.iter().map(|&i| all[i as usize]).collect())
    }

    /// Spreads labels of the stored points over all input points; skipped ones get -1.
    pub fn labels_in_input_order(&self, labels: Vec<i32>) -> Vec<i32> {
        if let Some(thinned) = &self.thinned {
            return thinned.spread(&labels, -1);
        }
        let Some(index) = &self.input_index else { return labels };
        let mut all = vec![-1; self.input_len];
        for (&i, label) in index.iter().zip(labels) {
            all[i as usize] = label;
        }
        all
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_that_are_not_finite_are_left_out_and_labelled_minus_one() {
        let cloud = PointCloud::from_points(vec![
            Vec3::new(1.0, 2.0, 3.0),
            Vec3::new(f64::NAN, 0.0, 0.0),
            Vec3::new(4.0, 5.0, f64::INFINITY),
            Vec3::new(7.0, 8.0, 9.0),
        ]);
        assert_eq!((cloud.points.len(), cloud.skipped()), (2, 2));
        assert_eq!(cloud.labels_in_input_order(vec![5, 6]), [5, -1, -1, 6]);
    }

    #[test]
    fn a_part_has_what_its_points_have_and_gives_labels_back_to_all() {
        let points = (0..4).map(|k| Vec3::new(f64::from(k), 0.0, 0.0)).collect();
        let cloud =
            PointCloud { labels: Some(vec![7, 8, 9, 10]), ..PointCloud::from_points(points) };
        let part = cloud.part(&[false, true, false, true]);
        assert_eq!(part.points, [cloud.points[1], cloud.points[3]]);
        assert_eq!(part.labels, Some(vec![8, 10]));
        assert_eq!(part.labels_in_input_order(vec![0, 1]), [-1, 0, -1, 1]);
    }
}

use crate::geometry::{Mat3, Vec3};

/// Where a scan lies: its matrix, turned to that of column vectors.
pub(super) struct Pose {
    linear: Mat3,
    place: Vec3,
}

impl Pose {
    /// The pose of a matrix for row vectors, whose last column is 0, 0, 0 and any number that the others are over.
    ///
    /// # Errors
    /// It is that of no pose: what is wrong with it.
    pub(super) fn of(rows: &[[f64; 4]; 4]) -> Result<Self, String> {
        let last = rows.map(|row| row[3]);
        let [0.0, 0.0, 0.0, weight] = last else {
            let [a, b, c, d] = last;
            return Err(format!(
                "the last column of the scan's matrix is {a}, {b}, {c}, {d} and must be 0, 0, 0, 1: a matrix \
                 written for column vectors has to be transposed"
            ));
        };
        let row = |k: usize| Vec3::new(rows[k][0], rows[k][1], rows[k][2]) / weight;
        let pose = Self { linear: Mat3::from_columns(&[row(0), row(1), row(2)]), place: row(3) };
        let volume = pose.linear.determinant().abs();
        if !(volume > 0.0 && volume.is_finite() && pose.place.iter().all(|x| x.is_finite())) {
            return Err(
                "the scan's matrix makes all points one, or flat: write the pose, or the unit \
                        matrix where there is none"
                    .to_owned(),
            );
        }
        Ok(pose)
    }

    /// A point of the scanner's frame in that of all scans.
    pub(super) fn world(&self, local: &Vec3) -> Vec3 {
        self.linear * local + self.place
    }

    /// The most that a length grows by.
    pub(super) fn scale(&self) -> f64 {
        self.linear.column_iter().map(|column| column.norm()).fold(0.0, f64::max)
    }
}

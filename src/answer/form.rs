use std::io;

use super::{Answer, AnswerError, ErrorKind, json::json, report, step::step, table::rows};
use crate::{
    formats::{
        Fields, Labelled, write_deviations_npy, write_labelled_ply, write_labels_npy,
        write_points_csv, write_regions_csv,
    },
    segment::deviations,
};

/// A form in which an answer is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form {
    /// The whole result as JSON.
    Json,
    /// The labels as a NumPy array of int32.
    Npy,
    /// The points with label and colour as a binary PLY file.
    Ply,
    /// One line a region.
    Csv,
    /// The points' deviations as a NumPy array of float64.
    Deviations,
    /// One line a point.
    Points,
    /// A boundary representation for CAD systems.
    Step,
    /// A document for people.
    Html,
    /// A picture.
    Png,
}

impl Form {
    /// Every form, the default first.
    pub const ALL: [Self; 9] = [
        Self::Json,
        Self::Npy,
        Self::Ply,
        Self::Csv,
        Self::Deviations,
        Self::Points,
        Self::Step,
        Self::Html,
        Self::Png,
    ];

    /// The ending of its files.
    pub fn extension(self) -> &'static str {
        match self {
            Self::Json => "json",
            Self::Npy => "npy",
            Self::Ply => "ply",
            Self::Csv => "csv",
            Self::Deviations => "deviations.npy",
            Self::Points => "points.csv",
            Self::Step => "step",
            Self::Html => "html",
            Self::Png => "png",
        }
    }

    /// The form whose files end so, in any case.
    pub fn from_extension(extension: &str) -> Option<Self> {
        let is = |name: &str| name.eq_ignore_ascii_case(extension);
        let form = Self::ALL.into_iter().find(|form| is(form.extension()));
        form.or_else(|| is("stp").then_some(Self::Step))
    }

    /// Writes `answer` in this form; `labels` says whether JSON holds the labels.
    ///
    /// # Errors
    /// The answer has no place in this form.
    pub fn write(self, answer: Answer, labels: bool) -> Result<Vec<u8>, AnswerError> {
        let mut bytes = Vec::new();
        let written = match self {
            Self::Json => return Ok(json(answer.document.shown(labels))?),
            Self::Npy => write_labels_npy(&mut bytes, answer.document.labels()),
            Self::Ply => with_deviations(&answer, |all| write_labelled_ply(&mut bytes, all)),
            Self::Points => with_deviations(&answer, |all| write_points_csv(&mut bytes, all)),
            Self::Deviations => {
                with_deviations(&answer, |all| write_deviations_npy(&mut bytes, all.deviations))
            }
            Self::Png => return report::picture(&answer).map_err(|error| unwritten(&error)),
            Self::Html => {
                let picture = report::picture(&answer).map_err(|error| unwritten(&error))?;
                return Ok(report::report(&answer, &picture).into_bytes());
            }
            Self::Csv => write_regions_csv(&mut bytes, &rows(&answer.document)),
            Self::Step => return Ok(step(&answer).into_bytes()),
        };
        written.map(|()| bytes).map_err(|error: io::Error| unwritten(&error))
    }
}

/// Gives `write` the cloud with each point's deviation.
fn with_deviations(
    answer: &Answer,
    write: impl FnOnce(&Labelled) -> io::Result<()>,
) -> io::Result<()> {
    let Answer { document, cloud, fields, .. } = answer;
    // the columns of a mesh are of its vertices, which its samples are not
    let none = Fields::default();
    let fields = if cloud.samples().is_some() { &none } else { fields };
    let labels = document.labels();
    let deviations = deviations(cloud, labels, &document.regions);
    write(&Labelled { cloud, labels, deviations: &deviations, fields })
}

fn unwritten(error: &dyn std::fmt::Display) -> AnswerError {
    AnswerError::new(ErrorKind::Internal, format!("the result could not be written: {error}"))
}

impl From<serde_json::Error> for AnswerError {
    fn from(error: serde_json::Error) -> Self {
        unwritten(&error)
    }
}

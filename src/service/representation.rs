use std::io;

use prost::Message;

use super::{Answer, Document, ErrorKind, ServiceError, message::v1};
use crate::formats::{RegionRow, write_labelled_ply, write_labels_npy, write_regions_csv};

/// A form in which a result can be told.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Representation {
    /// The whole result as JSON.
    Json,
    /// The whole result as the protobuf message `conicoid.v1.Segmentation`.
    Protobuf,
    /// The labels as a NumPy array of int32.
    Npy,
    /// The points with label and colour as a binary PLY file.
    Ply,
    /// One line a region.
    Csv,
}

impl Representation {
    /// Every form, the default first.
    pub const ALL: &[Self] = &[Self::Json, Self::Protobuf, Self::Npy, Self::Ply, Self::Csv];

    /// The media type it is sent under.
    pub fn media_type(self) -> &'static str {
        self.media_types()[0]
    }

    /// The media types it is asked for by.
    pub fn media_types(self) -> &'static [&'static str] {
        match self {
            Self::Json => &["application/json"],
            Self::Protobuf => &[
                "application/x-protobuf",
                "application/protobuf",
                "application/vnd.google.protobuf",
            ],
            Self::Npy => &["application/x-npy"],
            Self::Ply => &["model/ply", "application/x-ply"],
            Self::Csv => &["text/csv"],
        }
    }

    /// What it holds, for the reference.
    pub fn help(self) -> &'static str {
        match self {
            Self::Json => "The whole result",
            Self::Protobuf => "The whole result as the message `conicoid.v1.Segmentation`",
            Self::Npy => "The labels as a NumPy array of int32",
            Self::Ply => "The points with label and colour, binary",
            Self::Csv => "One line a region",
        }
    }

    /// Writes `answer` in this form; `labels` says whether JSON and protobuf hold the labels.
    ///
    /// # Errors
    /// The answer has no place in this form.
    pub fn render(self, answer: Answer, labels: bool) -> Result<Vec<u8>, ServiceError> {
        let mut bytes = Vec::new();
        let written = match self {
            Self::Json => return Ok(serde_json::to_vec(&answer.document.shown(labels))?),
            Self::Protobuf => {
                let message = v1::Segmentation::from(answer.document.shown(labels));
                return Ok(message.encode_to_vec());
            }
            Self::Npy => write_labels_npy(&mut bytes, answer.document.labels()),
            Self::Ply => write_labelled_ply(&mut bytes, &answer.cloud, answer.document.labels()),
            Self::Csv => write_regions_csv(&mut bytes, &rows(&answer.document)),
        };
        written.map(|()| bytes).map_err(|error: io::Error| unwritten(&error))
    }
}

fn rows(document: &Document) -> Vec<RegionRow> {
    let row = |region: &crate::segment::Region| RegionRow {
        id: region.id,
        surface_type: region.surface_type,
        point_count: region.point_count,
        rms: region.fit.rms,
        max: region.fit.max,
        coefficients: region.coefficients,
        surface: region.surface,
    };
    document.regions.iter().map(row).collect()
}

fn unwritten(error: &dyn std::fmt::Display) -> ServiceError {
    ServiceError::new(ErrorKind::Internal, format!("the result could not be written: {error}"))
}

impl From<serde_json::Error> for ServiceError {
    fn from(error: serde_json::Error) -> Self {
        unwritten(&error)
    }
}

use std::{
    io::{self, Write},
    sync::Arc,
};

use super::{
    Answer, AnswerError, Document, ErrorKind,
    handover::{Inspection, characteristics, dmis, qif},
    json::json,
    report,
    step::step,
    table::rows,
};
use crate::{
    formats::{
        EachPoint, Fields, Labelled, PICTURE_BYTES, write_deviations_npy, write_faces_csv,
        write_labelled_ply, write_labels_npy, write_points_csv, write_regions_csv,
    },
    segment::Measures,
};

/// A form in which an answer is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form {
    /// The whole result as JSON.
    Json,
    /// The whole result as a protobuf message, which the service alone writes.
    Protobuf,
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
    /// QIF 3.0 Results.
    Qif,
    /// DMIS output.
    Dmis,
    /// One line a measured quantity.
    Characteristics,
    /// One line a face of a mesh.
    Faces,
}

impl Form {
    /// Every form, the default first.
    pub const ALL: [Self; 14] = [
        Self::Json,
        Self::Protobuf,
        Self::Npy,
        Self::Ply,
        Self::Csv,
        Self::Deviations,
        Self::Points,
        Self::Step,
        Self::Html,
        Self::Png,
        Self::Qif,
        Self::Dmis,
        Self::Characteristics,
        Self::Faces,
    ];

    /// The ending of its files, and its name on the command line.
    pub fn extension(self) -> &'static str {
        match self {
            Self::Json => "json",
            Self::Protobuf => "pb",
            Self::Npy => "npy",
            Self::Ply => "ply",
            Self::Csv => "csv",
            Self::Deviations => "deviations.npy",
            Self::Points => "points.csv",
            Self::Step => "step",
            Self::Html => "html",
            Self::Png => "png",
            Self::Qif => "qif",
            Self::Dmis => "dmo",
            Self::Characteristics => "characteristics.csv",
            Self::Faces => "faces.csv",
        }
    }

    /// The form whose files end so, in any case.
    pub fn from_extension(extension: &str) -> Option<Self> {
        let is = |name: &str| name.eq_ignore_ascii_case(extension);
        let form = Self::ALL.into_iter().find(|form| is(form.extension()));
        form.or_else(|| is("stp").then_some(Self::Step))
    }

    /// Whether it tells of the points themselves, for which the cloud is needed.
    pub fn has_points(self) -> bool {
        matches!(
            self,
            Self::Ply | Self::Deviations | Self::Points | Self::Step | Self::Html | Self::Png
        )
    }

    /// Memory that writing it takes, beside the cloud and what comes out, in bytes.
    pub fn bytes_beside(self) -> u64 {
        if matches!(self, Self::Html | Self::Png) { PICTURE_BYTES } else { 0 }
    }

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
            Self::Deviations => &["application/vnd.conicoid.deviations+npy"],
            Self::Points => &["application/vnd.conicoid.points+csv"],
            Self::Step => &["model/step", "application/step"],
            Self::Html => &["text/html"],
            Self::Png => &["image/png"],
            Self::Qif => &["application/vnd.conicoid.qif+xml"],
            Self::Dmis => &["application/vnd.conicoid.dmis"],
            Self::Characteristics => &["application/vnd.conicoid.characteristics+csv"],
            Self::Faces => &["application/vnd.conicoid.faces+csv"],
        }
    }

    /// Its name in the gRPC contract, in lower case.
    pub fn name(self) -> &'static str {
        match self {
            Self::Protobuf => "protobuf",
            Self::Dmis => "dmis",
            other => other.extension().split('.').next().unwrap_or_default(),
        }
    }

    /// The form of that name, in any case.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|form| form.name().eq_ignore_ascii_case(name))
    }

    /// What it holds, for the reference.
    pub fn help(self) -> &'static str {
        match self {
            Self::Json => "The whole result",
            Self::Protobuf => {
                "The whole result as the message `conicoid.v1.Segmentation` of the gRPC contract"
            }
            Self::Npy => {
                "The labels as a NumPy array (NPY 1.0) of int32: one a point, in input order, -1 = \
                 unassigned"
            }
            Self::Ply => {
                "The points in input order as binary little-endian PLY: `x`, `y`, `z` (double, NaN for \
                 points left out), `red`, `green`, `blue` (uchar, the region's colour), `label` (int, \
                 -1 = unassigned), `deviation` (double, the signed distance from the own surface, positive \
                 outside, on a plane on the side of its normal; NaN for unassigned points), then the columns \
                 that a PLY file had itself (normals, colours, intensity), those of a name that stands here \
                 already as `input_` and that name"
            }
            Self::Deviations => {
                "The signed distance of each point from its own surface as a NumPy array (NPY 1.0) of float64, in \
                 input order; NaN = unassigned"
            }
            Self::Points => {
                "One line a point, in input order, under a line of names: `x`, `y`, `z`, `label`, `deviation` (the \
                 signed distance from the own surface); empty where there is none"
            }
            Self::Step => {
                "STEP AP242 in the cloud's unit, or in millimetres where none is known: a face for each region with its exact surface, edges that neighbours share where \
                 their surfaces meet, vertices where three do; a border without a neighbour follows the points. What closes \
                 up is a solid; the description of each other product names the regions with an open border. Faces have \
                 names with the size and its standard deviation, and the regions' colours"
            }
            Self::Html => {
                "A report for people, one file that asks for nothing else and prints on A4: a picture, the surfaces \
                 with their dimensions and uncertainties, a histogram of the deviations of each, the parameters as \
                 used, what was found of the cloud, and its SHA-256"
            }
            Self::Png => {
                "A picture of 1280 x 960 pixels: the points in the colours of their surfaces, seen from the front and \
                 above, with the surfaces' ids, axes and a scale bar"
            }
            Self::Qif => {
                "QIF 3.0 Results for inspection software: a measured feature for each region, of its fit where \
                 `association` asks for one; ellipsoids and elliptic cylinders, for which QIF has no type, as other \
                 surfaces whose attributes hold the parameters; where the unit is not known, millimetres"
            }
            Self::Dmis => {
                "DMIS output for inspection software: `FA(...)=FEAT/...` for each region, of its fit where `association` \
                 asks for one; what DMIS has no word for stands in comments; angles in degrees"
            }
            Self::Characteristics => {
                "One line a measured quantity under a line of names, for statistical process control: the passed-through \
                 fields, `feature`, `type`, `association`, `points`, `characteristic`, `nominal`, limits, `measured`, \
                 `deviation`, uncertainties, `verdict`, units"
            }
            Self::Faces => {
                "One line a face of a mesh whose faces were sampled, in the order of its file, under a line of names: \
                 `face` (from 0), `label` (the region of most of its samples, -1 = none)"
            }
            Self::Csv => {
                "One line a region under a line of names: `id`, `type`, `point_count`, `rms`, `max`, \
                 `position_x` to `position_z` (a point of the plane or axis, the centre or the apex), \
                 `direction_x` to `direction_z` (normal or axis), `radius`, `half_angle`, semi-axes and \
                 their directions, `a1` to `a10`, `coefficients_error`, `local_origin_x` to \
                 `local_origin_z`, `local_a1` to `local_a10`, `major_radius`, `minor_radius` (of a torus), and its dimensions, angles in degrees, `_sd` = standard \
                 deviation: `end_1_x` to `end_2_z`, `length`, `length_sd`, `diameter`, `diameter_sd`, `end_radius_1`, \
                 `end_radius_2`, `full_angle_deg`, `swept_angle_deg`, `arc_angle_deg`, `arc_angle_sd_deg`, `side`, \
                 `share_seen`, `area`, `size_1`, `size_2`, and `unit`, that of all lengths; empty where a surface has none, or the unit is not known"
            }
        }
    }

    /// Writes an inspection in this form; nothing where it is none for that.
    pub(super) fn hand_over(self, inspection: &Inspection) -> Vec<u8> {
        let text = match self {
            Self::Qif => qif(inspection),
            Self::Dmis => dmis(inspection),
            Self::Characteristics => characteristics(inspection),
            _ => String::new(),
        };
        text.into_bytes()
    }

    /// Writes `answer` in this form; `labels` says whether JSON holds the labels.
    ///
    /// # Errors
    /// The answer has no place in this form.
    pub fn write(self, answer: Answer, labels: bool) -> Result<Vec<u8>, AnswerError> {
        let mut bytes = Vec::new();
        let whole = answer.whole.clone().unwrap_or_else(|| Arc::clone(&answer.cloud));
        self.write_to(&mut bytes, answer, labels, &*whole)?;
        Ok(bytes)
    }

    /// Writes `answer` to `out` as it goes; `points` are all those of the input, for forms that tell of each.
    ///
    /// # Errors
    /// The answer has no place in this form, the points cannot be read, or `out` fails.
    pub fn write_to(
        self,
        out: &mut (impl Write + Send),
        answer: Answer,
        labels: bool,
        points: &dyn EachPoint,
    ) -> Result<(), AnswerError> {
        let written = match self {
            Self::Json => json(out, answer.document.shown(labels)),
            Self::Protobuf => return Err(unwritten(&"protobuf is a form of the service")),
            Self::Npy => write_labels_npy(out, answer.document.labels()),
            Self::Ply => with_deviations(&answer, points, |all| write_labelled_ply(out, all)),
            Self::Points => with_deviations(&answer, points, |all| write_points_csv(out, all)),
            Self::Deviations => {
                with_deviations(&answer, points, |all| write_deviations_npy(out, all))
            }
            Self::Png => report::picture(&answer).and_then(|picture| out.write_all(&picture)),
            Self::Html => report::picture(&answer)
                .and_then(|picture| out.write_all(report::report(&answer, &picture).as_bytes())),
            Self::Csv => write_regions_csv(out, &rows(&answer.document)),
            Self::Faces => write_faces_csv(out, face_labels(&answer.document)?),
            Self::Step => out.write_all(step(&answer).as_bytes()),
            Self::Qif | Self::Dmis | Self::Characteristics => {
                let name = answer.name.as_deref();
                out.write_all(&self.hand_over(&Inspection::of(&answer.document, name)))
            }
        };
        written.map_err(|error: io::Error| unwritten(&error))
    }
}

/// Gives `write` the points with each one's deviation.
fn with_deviations(
    answer: &Answer,
    points: &dyn EachPoint,
    write: impl FnOnce(&Labelled) -> io::Result<()>,
) -> io::Result<()> {
    let Answer { document, cloud, fields, .. } = answer;
    // the columns of a mesh are of its vertices, which its samples are not
    let none = Fields::default();
    let fields = if cloud.samples().is_some() { &none } else { fields };
    let measures = Measures::of(&document.regions);
    write(&Labelled {
        points,
        count: document.input.points,
        grid: cloud.grid,
        labels: document.labels(),
        deviation: &|label, point| measures.deviation(label, point),
        fields,
    })
}

/// The label of each face.
fn face_labels(document: &Document) -> Result<&[i32], AnswerError> {
    document.face_labels.as_deref().ok_or_else(|| {
        let why = match document.input.mesh {
            Some(_) => {
                "the points are the vertices of the mesh, not samples of its faces: give mesh=faces, or take points.csv"
            }
            None => "the cloud is no mesh: take points.csv",
        };
        AnswerError::new(ErrorKind::NotAcceptable, format!("there are no labels of faces: {why}"))
    })
}

fn unwritten(error: &dyn std::fmt::Display) -> AnswerError {
    AnswerError::new(ErrorKind::Internal, format!("the result could not be written: {error}"))
}

impl From<serde_json::Error> for AnswerError {
    fn from(error: serde_json::Error) -> Self {
        unwritten(&error)
    }
}

use prost::Message;

use super::{Answer, ServiceError, message::v1};
use crate::answer::Form;
use crate::formats::PICTURE_BYTES;

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

impl Representation {
    /// Every form, the default first.
    pub const ALL: &[Self] = &[
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
    ];

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
        }
    }

    /// The ending of its files, and its name on the command line.
    pub fn extension(self) -> &'static str {
        self.form().map_or("pb", Form::extension)
    }

    /// The form whose files end so, in any case.
    pub fn from_extension(extension: &str) -> Option<Self> {
        if extension.eq_ignore_ascii_case("pb") {
            return Some(Self::Protobuf);
        }
        let form = Form::from_extension(extension)?;
        Self::ALL.iter().copied().find(|own| own.form() == Some(form))
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

    /// Writes `answer` in this form; `labels` says whether JSON and protobuf hold the labels.
    ///
    /// # Errors
    /// The answer has no place in this form.
    pub fn render(self, answer: Answer, labels: bool) -> Result<Vec<u8>, ServiceError> {
        match self.form() {
            Some(form) => form.write(answer, labels),
            None => Ok(v1::Segmentation::from(answer.document.shown(labels)).encode_to_vec()),
        }
    }

    /// The form that the library writes; protobuf is the service's own.
    fn form(self) -> Option<Form> {
        Some(match self {
            Self::Protobuf => return None,
            Self::Json => Form::Json,
            Self::Npy => Form::Npy,
            Self::Ply => Form::Ply,
            Self::Csv => Form::Csv,
            Self::Deviations => Form::Deviations,
            Self::Points => Form::Points,
            Self::Step => Form::Step,
            Self::Html => Form::Html,
            Self::Png => Form::Png,
        })
    }
}

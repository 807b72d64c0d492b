use std::io;

use prost::Message;
use rayon::prelude::*;

use super::{Answer, Document, ErrorKind, ServiceError, message::v1, report, step::step};
use crate::formats::{
    DIMENSIONS, Labelled, PICTURE_BYTES, RegionRow, write_deviations_npy, write_labelled_ply,
    write_labels_npy, write_points_csv, write_regions_csv,
};
use crate::segment::{Region, deviations};

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
        }
    }

    /// The form whose files end so, in any case.
    pub fn from_extension(extension: &str) -> Option<Self> {
        let is = |name: &str| name.eq_ignore_ascii_case(extension);
        let form = Self::ALL.iter().copied().find(|form| is(form.extension()));
        form.or_else(|| is("stp").then_some(Self::Step))
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
                "STEP AP242 in millimetres: a face for each region with its exact surface, edges that neighbours share where \
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
                 `share_seen`, `area`, `size_1`, `size_2`; empty where a surface has none"
            }
        }
    }

    /// Writes `answer` in this form; `labels` says whether JSON and protobuf hold the labels.
    ///
    /// # Errors
    /// The answer has no place in this form.
    pub fn render(self, answer: Answer, labels: bool) -> Result<Vec<u8>, ServiceError> {
        let mut bytes = Vec::new();
        let written = match self {
            Self::Json => return json(answer.document.shown(labels)),
            Self::Protobuf => {
                let message = v1::Segmentation::from(answer.document.shown(labels));
                return Ok(message.encode_to_vec());
            }
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
    let labels = document.labels();
    let deviations = deviations(cloud, labels, &document.regions);
    write(&Labelled { cloud, labels, deviations: &deviations, fields })
}

/// Labels whose text is written at once.
const BLOCK: usize = 1 << 15;

/// The document as JSON, with its labels last: they are most of the text, and written by all threads.
fn json(mut document: Document) -> Result<Vec<u8>, ServiceError> {
    let Some(labels) = document.labels.take() else { return Ok(serde_json::to_vec(&document)?) };
    let blocks: Vec<Vec<u8>> =
        labels.par_chunks(BLOCK).map(serde_json::to_vec).collect::<Result<_, _>>()?;
    let mut bytes = serde_json::to_vec(&document)?;
    // the object is opened again
    bytes.pop();
    bytes.reserve(blocks.iter().map(Vec::len).sum::<usize>() + 16);
    bytes.extend_from_slice(b",\"labels\":[");
    for (k, block) in blocks.iter().enumerate() {
        if k > 0 {
            bytes.push(b',');
        }
        // without its own brackets
        bytes.extend_from_slice(&block[1..block.len() - 1]);
    }
    bytes.extend_from_slice(b"]}");
    Ok(bytes)
}

fn rows(document: &Document) -> Vec<RegionRow> {
    let row = |region: &Region| RegionRow {
        id: region.id,
        surface_type: region.surface_type,
        point_count: region.point_count,
        rms: region.fit.rms,
        max: region.fit.max,
        coefficients: region.coefficients,
        coefficients_error: region.coefficients_error,
        local_origin: region.local_origin,
        local_coefficients: region.local_coefficients,
        surface: region.surface,
        dimensions: dimensions(region),
    };
    document.regions.iter().map(row).collect()
}

/// The cells of [`DIMENSIONS`], in its order.
fn dimensions(region: &Region) -> [String; DIMENSIONS.len()] {
    let d = &region.dimensions;
    let deviation = |name: &str| region.uncertainty.as_ref()?.get(name)?.as_f64();
    let ends = |k: usize| d.ends.map(|ends| ends[k / 3][k % 3]);
    let degrees = |angle: Option<f64>| angle.map(f64::to_degrees);
    let number = |value: Option<f64>| value.map(|v| v.to_string()).unwrap_or_default();
    let before = [0, 1, 2, 3, 4, 5].map(ends).into_iter().chain([
        d.length,
        deviation("length"),
        d.diameter,
        deviation("diameter"),
        d.end_radii.map(|r| r[0]),
        d.end_radii.map(|r| r[1]),
        degrees(d.full_angle),
        degrees(d.swept_angle),
        degrees(d.arc_angle),
        degrees(deviation("arc_angle")),
    ]);
    let side = d.side.map(|side| side.name().to_owned()).unwrap_or_default();
    let after = [d.share_seen, d.area, d.size.map(|s| s[0]), d.size.map(|s| s[1])];
    let mut cells = before.map(number).chain([side]).chain(after.map(number));
    std::array::from_fn(|_| cells.next().unwrap_or_default())
}

fn unwritten(error: &dyn std::fmt::Display) -> ServiceError {
    ServiceError::new(ErrorKind::Internal, format!("the result could not be written: {error}"))
}

impl From<serde_json::Error> for ServiceError {
    fn from(error: serde_json::Error) -> Self {
        unwritten(&error)
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Input, Timing, UnassignedPoints};
    use super::*;
    use crate::segment::{Counters, Parameters};

    #[test]
    fn labels_written_by_all_threads_are_those_of_the_document() {
        for n in [0, 1, BLOCK, BLOCK + 1, 3 * BLOCK - 5] {
            let labels: Vec<i32> = (0..n as i32).map(|k| k % 1013 - 1).collect();
            let document = Document {
                conicoid: "1".into(),
                input: Input {
                    points: n,
                    sha256: "0".into(),
                    format: "ply".into(),
                    skipped: 0,
                    mesh: None,
                },
                parameters: Parameters::default(),
                regions: Vec::new(),
                labels: Some(labels),
                face_labels: None,
                unassigned: UnassignedPoints::default(),
                sampling: None,
                warnings: Vec::new(),
                relations: Vec::new(),
                relation_scatter: 0.0,
                measures: Vec::new(),
                snapping: None,
                counters: Counters::default(),
                timing: Timing::default(),
            };
            let told: Document = serde_json::from_slice(&json(document.clone()).unwrap()).unwrap();
            assert_eq!(told, document);
            assert_eq!(json(document.clone().shown(false)).unwrap(), {
                serde_json::to_vec(&document.shown(false)).unwrap()
            });
        }
    }
}

use crate::{
    formats::{Columns, Hints},
    model::datum::MAX_DATUMS,
    segment::{ParameterKind, ParameterSpec},
};

/// Longest name of a cloud, in characters: what file systems allow a file.
pub(super) const MAX_NAME: usize = 255;
/// What the points of a mesh may be.
const MESH_WAYS: &[&str] = &["auto", "vertices", "faces"];
/// The largest `mesh_points`: more say nothing that the facets do not, and take memory that the file does not announce.
const MOST_MESH_POINTS: u64 = 10_000_000;
/// The largest `thin`, as of other lengths.
pub(super) const MOST_THIN: f64 = 1e12;
/// The formats of clouds.
pub(super) const FORMATS: &[&str] =
    &["ply", "xyz", "ptx", "pcd", "las", "e57", "stl", "obj", "off"];

/// The units of lengths.
pub(super) const UNITS: &[&str] = &["um", "mm", "cm", "m", "km", "in", "ft", "us_ft"];

/// Names of the associations.
pub(super) const ASSOCIATIONS: &[&str] =
    &["gaussian", "minimum_zone", "minimum_circumscribed", "maximum_inscribed"];

/// What a request may say beyond the method's parameters, in the same terms.
pub const OPTIONS: &[ParameterSpec] = &[
    ParameterSpec {
        name: "format",
        kind: ParameterKind::Choice(FORMATS),
        unit: None,
        default: None,
        help: "The cloud's format (from its media type, file name or bytes when absent); other usual endings, such as csv, txt and laz, name it too",
    },
    ParameterSpec {
        name: "columns",
        kind: ParameterKind::Columns { max: Columns::MAX },
        unit: None,
        default: None,
        help: "Which columns of a text are x, y and z, counted from 1, such as 2,3,4 behind a running number (by their names, or the first three, when absent)",
    },
    ParameterSpec {
        name: "skip_lines",
        kind: ParameterKind::Integer { min: 0, max: Hints::MAX_SKIP_LINES },
        unit: None,
        default: Some("0"),
        help: "How many lines of a text to pass over before it begins, titles and protocols that carry no comment mark. Names of columns among them are not looked at",
    },
    ParameterSpec {
        name: "unit",
        kind: ParameterKind::Choice(UNITS),
        unit: None,
        default: None,
        help: "The unit of the cloud's lengths (the one that the file states when absent: E57, LAS with a coordinate system, text with names such as 'x [mm]'). It is told in every answer and stated in STEP; nothing is converted",
    },
    ParameterSpec {
        name: "mesh",
        kind: ParameterKind::Choice(MESH_WAYS),
        unit: None,
        default: Some("auto"),
        help: "What the points of a mesh (STL, OBJ, OFF, PLY with faces) are: its vertices, or points spread evenly over the surface that its faces stand for. auto: the faces where the vertices are the corners of large faces alone, as in CAD meshes, or else the vertices",
    },
    ParameterSpec {
        name: "mesh_spacing",
        kind: ParameterKind::Number { min: 0.0, max: 1e12 },
        unit: Some("length"),
        default: None,
        help: "Distance of the points on the faces of a mesh from each other (when absent so that nine in ten of its smooth pieces get 150 points or more, but 20 000 to mesh_points in all)",
    },
    ParameterSpec {
        name: "mesh_points",
        kind: ParameterKind::Integer { min: 1_000, max: MOST_MESH_POINTS },
        unit: None,
        default: Some("100000"),
        help: "Most points on the faces of a mesh",
    },
    ParameterSpec {
        name: "thin",
        kind: ParameterKind::Number { min: 0.0, max: MOST_THIN },
        unit: Some("length"),
        default: None,
        help: "Thins the cloud as it is read: of points closer to each other than this one is kept, the surfaces are found by those kept, and every other point gets the label of the kept one nearest to it. For clouds larger than the memory (all points are used when absent)",
    },
    ParameterSpec {
        name: "name",
        kind: ParameterKind::Text { max: MAX_NAME },
        unit: None,
        default: None,
        help: "What the cloud is called in its report, such as the name of its file",
    },
    ParameterSpec {
        name: "labels",
        kind: ParameterKind::Choice(&["inline", "none"]),
        unit: None,
        default: Some("inline"),
        help: "Whether the answer holds one label a point",
    },
    ParameterSpec {
        name: "snap",
        kind: ParameterKind::Boolean,
        unit: None,
        default: Some("false"),
        help: "Whether each region is given a second surface, `snapped`, for which all accepted relations hold exactly",
    },
    ParameterSpec {
        name: "association",
        kind: ParameterKind::Choice(ASSOCIATIONS),
        unit: None,
        default: None,
        help: "Fits one feature to all points of each region too, `fits`, by this association, as a fit of these points alone would (none is fitted when absent)",
    },
    ParameterSpec {
        name: "datums",
        kind: ParameterKind::Regions { most: MAX_DATUMS },
        unit: None,
        default: None,
        help: "Makes a coordinate system of these regions, the primary datum first, after ISO 5459, `datum_system`, of their surfaces or, with association, of their fits. Ids of regions are the same for the same cloud and parameters (none is made when absent)",
    },
    ParameterSpec {
        name: "deadline",
        kind: ParameterKind::Number { min: 0.1, max: 86_400.0 },
        unit: Some("seconds"),
        default: None,
        help: "Longest time the work may take (the service's own limit when absent)",
    },
];

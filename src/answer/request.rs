use std::time::Duration;

use super::{
    AnswerError, ErrorKind,
    options::{MAX_NAME, MOST_THIN, OPTIONS},
};
use crate::{
    fit::feature::Association,
    formats::{Columns, Format, Hints, MeshWay, Meshes},
    geometry::{LengthUnit, moderate},
    model::datum::MAX_DATUMS,
    segment::{MAX_HINT_BYTES, PARAMETERS, ParameterKind, ParameterSpec, Parameters, truth},
};

/// Longest text of one value: that of the longest 64-bit number, written without an exponent.
const MAX_VALUE_BYTES: usize = 350;
/// Longest text of a list: three such numbers.
const MAX_LIST_BYTES: usize = 3 * MAX_VALUE_BYTES;

/// Every parameter and option a request may have.
pub fn specs() -> impl Iterator<Item = &'static ParameterSpec> + Clone {
    PARAMETERS.iter().chain(OPTIONS)
}

/// Whether a parameter takes several values.
pub fn is_list(spec: &ParameterSpec) -> bool {
    use ParameterKind::{Columns, Direction, List, Regions};
    matches!(spec.kind, List(_) | Direction | Columns { .. } | Regions { .. })
}

/// Whether a parameter is a list of objects as JSON.
fn is_hints(spec: &ParameterSpec) -> bool {
    matches!(spec.kind, ParameterKind::Hints { .. })
}

/// Two texts of one parameter as one: values of a list stand one behind the other, and so do hints, each text of which is
/// a JSON list of them or one alone; said twice, anything else is still one thing. `None` where a parameter has two
/// values.
pub fn joined(spec: &ParameterSpec, before: &str, text: &str) -> Option<String> {
    if is_hints(spec) {
        // what is neither is left to be refused as it stands
        let items = |text: &str| {
            let list = text.trim().strip_prefix('[').and_then(|text| text.strip_suffix(']'));
            list.unwrap_or(text).trim().to_owned()
        };
        let all = [items(before), items(text)].into_iter().filter(|items| !items.is_empty());
        return Some(format!("[{}]", all.collect::<Vec<_>>().join(",")));
    }
    if is_list(spec) {
        return Some(format!("{before},{text}"));
    }
    (before == text).then(|| before.to_owned())
}

/// A request that is set by names and text, from queries, forms, messages and flags.
pub trait ParameterForm {
    /// Sets one option or parameter from text.
    ///
    /// # Errors
    /// The name is unknown, or the value is not one it takes.
    fn set(&mut self, name: &str, value: &str) -> Result<(), AnswerError>;

    /// What it says of the cloud, and all that was set.
    fn request(&mut self) -> &mut Request;

    /// The parameter of that name.
    fn spec(&self, name: &str) -> Option<&'static ParameterSpec>;
}

impl ParameterForm for Request {
    fn set(&mut self, name: &str, value: &str) -> Result<(), AnswerError> {
        Self::set(self, name, value)
    }

    fn request(&mut self) -> &mut Request {
        self
    }

    fn spec(&self, name: &str) -> Option<&'static ParameterSpec> {
        specs().find(|spec| spec.name == name)
    }
}

/// What to do with a cloud.
#[derive(Clone, Debug, PartialEq)]
pub struct Request {
    /// The method's parameters.
    pub parameters: Parameters,
    /// The cloud's format; worked out from the bytes when absent.
    pub format: Option<Format>,
    /// The columns of a text; by their names or their place when absent.
    pub columns: Option<Columns>,
    /// How many lines of a text are passed over.
    pub skip_lines: usize,
    /// The unit of the cloud's lengths; the file's when absent.
    pub unit: Option<LengthUnit>,
    /// How a mesh is read.
    pub meshes: Meshes,
    /// The least distance of the points that are used; all are when absent.
    pub thin: Option<f64>,
    /// What the cloud is called.
    pub name: Option<String>,
    /// Whether the answer holds the labels.
    pub labels: bool,
    /// Whether regions are given second surfaces, for which the accepted relations hold exactly.
    pub snap: bool,
    /// How a feature is fitted to each region's points; none is when absent.
    pub association: Option<Association>,
    /// The regions that a datum system is made of, the primary one first; none is made of no region.
    pub datums: Vec<usize>,
    /// Longest time the work may take.
    pub deadline: Option<Duration>,
    /// Longest answer that the caller takes, in bytes; any when absent.
    pub max_answer_bytes: Option<u64>,
    /// What was set, as names and text, in its order: the request as it is kept with a job.
    pub given: Vec<(String, String)>,
}

impl Default for Request {
    fn default() -> Self {
        Self {
            parameters: Parameters::default(),
            format: None,
            columns: None,
            skip_lines: 0,
            unit: None,
            meshes: Meshes::default(),
            thin: None,
            name: None,
            labels: true,
            snap: false,
            association: None,
            datums: Vec::new(),
            deadline: None,
            max_answer_bytes: None,
            given: Vec::new(),
        }
    }
}

impl Request {
    /// Reads name and value pairs, as a query gives them.
    ///
    /// # Errors
    /// A name is unknown, or a value is not one its parameter takes.
    pub fn from_pairs<'a>(
        pairs: impl IntoIterator<Item = (&'a str, &'a str)>,
    ) -> Result<Self, AnswerError> {
        let mut request = Self::default();
        for (name, value) in pairs {
            request.set(name, value)?;
        }
        Ok(request)
    }

    /// Lets the work take no longer than `limit`, if there is one.
    pub fn shorten_deadline(&mut self, limit: Option<Duration>) {
        self.deadline = self.deadline.into_iter().chain(limit).min();
    }

    /// Sets one option or parameter from text.
    ///
    /// # Errors
    /// The name is unknown, or the value is not one it takes.
    pub fn set(&mut self, name: &str, value: &str) -> Result<(), AnswerError> {
        let text = match specs().find(|spec| spec.name == name) {
            Some(spec) => {
                check_length(spec, value.trim())?;
                worded(spec, value.trim())
            }
            None => value.trim(),
        };
        match name {
            "format" => {
                let format = Format::from_extension(text).ok_or_else(|| unknown_format(text))?;
                self.format = Some(format);
                // by its own name: another word for it is no other request
                self.given.push((name.to_owned(), format.name().to_owned()));
                return Ok(());
            }
            "columns" => {
                self.columns = Some(columns(text).ok_or_else(|| invalid(name, value))?);
            }
            "skip_lines" => {
                let lines = text.parse::<u64>().ok().filter(|n| *n <= Hints::MAX_SKIP_LINES);
                let lines = lines.and_then(|n| usize::try_from(n).ok());
                self.skip_lines = lines.ok_or_else(|| invalid(name, value))?;
            }
            "unit" => {
                let unit = LengthUnit::from_name(text);
                self.unit = Some(unit.ok_or_else(|| invalid(name, value))?);
            }
            "mesh" | "mesh_spacing" | "mesh_points" => {
                self.set_mesh(name, text).ok_or_else(|| invalid(name, value))?;
            }
            "thin" => {
                let length = text.parse::<f64>().ok().filter(|l| *l > 0.0 && *l <= MOST_THIN);
                self.thin = Some(length.ok_or_else(|| invalid(name, value))?);
            }
            "name" => {
                let is_line = text.chars().count() <= MAX_NAME && !value.contains(char::is_control);
                let line = is_line.then(|| text.to_owned()).ok_or_else(|| invalid(name, value))?;
                self.name = Some(line).filter(|line| !line.is_empty());
            }
            "labels" => {
                self.labels = match text {
                    "inline" => true,
                    "none" => false,
                    _ => return Err(invalid(name, value)),
                }
            }
            "snap" => self.snap = truth(text).ok_or_else(|| invalid(name, value))?,
            "association" => {
                let named = Association::from_name(text).ok_or_else(|| invalid(name, value))?;
                self.association = Some(named);
            }
            "datums" => self.datums = regions(text).ok_or_else(|| invalid(name, value))?,
            "deadline" => {
                let seconds = text.parse::<f64>().ok().filter(|s| (0.1..=86_400.0).contains(s));
                let seconds = seconds.ok_or_else(|| invalid(name, value))?;
                self.deadline = Some(Duration::from_secs_f64(seconds));
            }
            _ if PARAMETERS.iter().any(|spec| spec.name == name) => {
                self.parameters.set(name, if text == value.trim() { value } else { text })?;
                let hinted = self.parameters.hints.iter_mut().map(|hint| &mut hint.axis_direction);
                for direction in hinted.chain([&mut self.parameters.axis_direction]).flatten() {
                    *direction = moderate(*direction);
                }
            }
            _ => return Err(unknown_parameter(name)),
        }
        // however a truth is written, the request is the same
        let text = truth(text).map_or_else(|| text.to_owned(), |yes| yes.to_string());
        self.given.push((name.to_owned(), text));
        Ok(())
    }

    fn set_mesh(&mut self, name: &str, text: &str) -> Option<()> {
        let kind = OPTIONS.iter().find(|spec| spec.name == name)?.kind;
        match kind {
            ParameterKind::Number { max, .. } => {
                let spacing: f64 = text.parse().ok()?;
                self.meshes.spacing = Some(spacing).filter(|s| *s > 0.0 && *s <= max);
                self.meshes.spacing.map(drop)
            }
            ParameterKind::Integer { min, max } => {
                let most: usize = text.parse().ok()?;
                (min..=max).contains(&(most as u64)).then_some(())?;
                self.meshes.most = most.try_into().ok()?;
                Some(())
            }
            _ => {
                self.meshes.way = match text {
                    "auto" => MeshWay::Auto,
                    "vertices" => MeshWay::Vertices,
                    "faces" => MeshWay::Faces,
                    _ => return None,
                };
                Some(())
            }
        }
    }

    /// What the request says of the cloud's bytes.
    pub fn hints(&self) -> Hints {
        Hints {
            format: self.format,
            columns: self.columns,
            skip_lines: self.skip_lines,
            meshes: self.meshes,
            thin: self.thin,
        }
    }

    /// Takes the format from where the request does not name it.
    pub fn set_format(&mut self, format: Option<Format>) {
        if let (None, Some(format)) = (self.format, format) {
            self.format = Some(format);
            self.given.push(("format".to_owned(), format.name().to_owned()));
        }
    }
}

/// A truth in words where it is a number, as spreadsheets and shells write it; any other value as it is.
pub(super) fn worded<'a>(spec: &ParameterSpec, text: &'a str) -> &'a str {
    match (spec.kind, text) {
        (ParameterKind::Boolean, "1") => "true",
        (ParameterKind::Boolean, "0") => "false",
        _ => text,
    }
}

/// Refuses texts longer than any value needs, which would only be kept.
pub(super) fn check_length(spec: &ParameterSpec, text: &str) -> Result<(), AnswerError> {
    let most = match spec.kind {
        // the longest characters take four bytes
        ParameterKind::Text { max } => 4 * max,
        ParameterKind::Hints { .. } => MAX_HINT_BYTES,
        _ if is_list(spec) => MAX_LIST_BYTES,
        _ => MAX_VALUE_BYTES,
    };
    if text.len() <= most {
        return Ok(());
    }
    let detail = format!(
        "parameter '{}': a text of {} bytes is longer than {most}: write the value shorter",
        spec.name,
        text.len()
    );
    Err(AnswerError::new(ErrorKind::InvalidParameter, detail))
}

fn columns(text: &str) -> Option<Columns> {
    let numbers: Vec<u64> =
        text.split(',').map(|number| number.trim().parse().ok()).collect::<Option<_>>()?;
    Columns::new(numbers.try_into().ok()?)
}

/// One to three different ids of regions.
fn regions(text: &str) -> Option<Vec<usize>> {
    let ids: Vec<usize> =
        text.split(',').map(|id| id.trim().parse().ok()).collect::<Option<_>>()?;
    let is_once = |(k, id): (usize, &usize)| !ids[..k].contains(id);
    (ids.len() <= MAX_DATUMS && ids.iter().enumerate().all(is_once)).then_some(ids)
}

fn invalid(name: &str, value: &str) -> AnswerError {
    let expected = OPTIONS.iter().find(|spec| spec.name == name).map(|spec| spec.kind.to_string());
    AnswerError::new(
        ErrorKind::InvalidParameter,
        format!("parameter '{name}': '{value}' is not {}", expected.unwrap_or_default()),
    )
}

/// The error for a parameter that nobody knows.
pub fn unknown_parameter(name: &str) -> AnswerError {
    let known = known_names(specs());
    AnswerError::new(
        ErrorKind::UnknownParameter,
        format!("unknown parameter '{name}'; known ones: {known}"),
    )
}

/// The names of some parameters, as errors list them.
pub(super) fn known_names(specs: impl Iterator<Item = &'static ParameterSpec>) -> String {
    specs.map(|spec| spec.name).collect::<Vec<_>>().join(", ")
}

/// The error for a format nobody reads.
pub fn unknown_format(name: &str) -> AnswerError {
    let known = Format::ALL.map(|format| match format.extensions() {
        [_] => format.name().to_owned(),
        [_, others @ ..] => format!("{} ({})", format.name(), others.join(", ")),
        [] => String::new(),
    });
    AnswerError::new(
        ErrorKind::UnknownFormat,
        format!("'{name}' is not a known format; known ones: {}", known.join(", ")),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn options_and_parameters_are_set_by_name() {
        let request = Request::from_pairs([
            ("format", "ply"),
            ("columns", "4, 3,2"),
            ("skip_lines", "12"),
            ("unit", "us_ft"),
            ("thin", "0.5"),
            ("name", " bracket 2.ply "),
            ("labels", "none"),
            ("snap", "True"),
            ("deadline", "1.5"),
            ("tolerance", "0.25"),
        ]);
        let request = request.unwrap();
        assert_eq!(request.format, Some(Format::Ply));
        assert_eq!(request.hints().columns, Columns::new([4, 3, 2]));
        assert_eq!((request.hints().skip_lines, request.unit), (12, Some(LengthUnit::UsFt)));
        assert_eq!((request.thin, request.hints().thin), (Some(0.5), Some(0.5)));
        assert_eq!(request.deadline, Some(Duration::from_millis(1500)));
        assert_eq!(request.name.as_deref(), Some("bracket 2.ply"));
        assert!(!request.labels && request.snap && request.parameters.tolerance == Some(0.25));
    }

    #[test]
    fn truths_are_words_or_numbers() {
        let set = |name, value: &str| Request::from_pairs([(name, value)]);
        for (value, word) in [("1", "true"), (" 0 ", "false"), ("True", "true")] {
            assert_eq!(set("merge", value), set("merge", word), "{value}");
            assert_eq!(set("snap", value), set("snap", word), "{value}");
        }
        // of numbers they are none
        assert_eq!(set("seed", "1").unwrap().given, [("seed".to_owned(), "1".to_owned())]);
        assert!(set("merge", "2").is_err());
    }

    #[test]
    fn a_direction_may_have_any_length() {
        for length in ["1e-200", "1e160", "1e308"] {
            let request = Request::from_pairs([("axis_direction", &*format!("0,0,{length}"))]);
            let request = request.unwrap();
            assert_eq!(request.parameters.axis_direction, Some([0.0, 0.0, 1.0]), "{length}");
        }
        let hint = r#"{"at": [[1, 2, 3]], "type": "plane", "axis_direction": [0, 1e-200, 0]}"#;
        let request = Request::from_pairs([("hints", hint)]).unwrap();
        assert_eq!(request.parameters.hints[0].axis_direction, Some([0.0, 1.0, 0.0]));
    }

    #[test]
    fn a_format_is_named_by_any_of_its_endings_in_any_case() {
        for (word, name) in [("PLY", "ply"), ("csv", "xyz"), ("laz", "las")] {
            let named = Request::from_pairs([("format", word)]).unwrap();
            assert_eq!(named, Request::from_pairs([("format", name)]).unwrap());
        }
    }

    #[test]
    fn the_format_list_is_the_formats_there_are() {
        assert_eq!(super::super::options::FORMATS, Format::ALL.map(Format::name));
        assert_eq!(super::super::options::UNITS, LengthUnit::ALL.map(LengthUnit::name));
    }

    #[test]
    fn a_value_is_as_long_as_the_longest_number_and_no_longer() {
        let number = |length: usize| format!("1.{}", "0".repeat(length - 2));
        let set = |name, value: &str| Request::from_pairs([(name, value)]).map_err(|e| e.kind);
        assert!(set("tolerance", &number(MAX_VALUE_BYTES)).is_ok());
        let long = set("tolerance", &number(MAX_VALUE_BYTES + 1));
        assert_eq!(long, Err(ErrorKind::InvalidParameter));
        let list = |length: usize| format!("0,0,{}", number(length - 4));
        assert!(set("axis_direction", &list(MAX_LIST_BYTES)).is_ok());
        let long = set("axis_direction", &list(MAX_LIST_BYTES + 1));
        assert_eq!(long, Err(ErrorKind::InvalidParameter));
        let hints = |length: usize| format!("{}[]", " ".repeat(length - 2));
        let padded = |length: usize| format!("[{}]", " ".repeat(length - 2));
        assert!(set("hints", &padded(MAX_HINT_BYTES)).is_ok());
        assert!(set("hints", &hints(MAX_HINT_BYTES + 1)).is_ok());
        let long = set("hints", &padded(MAX_HINT_BYTES + 1));
        assert_eq!(long, Err(ErrorKind::InvalidParameter));
        // numbers come from messages as Rust writes them
        for number in [f64::MIN_POSITIVE, 2.225_073_858_507_201e-308, 5e-324, -f64::MAX] {
            assert!(number.to_string().len() <= MAX_VALUE_BYTES);
        }
    }

    #[test]
    fn what_is_unknown_or_out_of_range_is_refused_by_name() {
        let kind = |name, value: &str| Request::from_pairs([(name, value)]).map_err(|e| e.kind);
        assert_eq!(kind("radius", "1"), Err(ErrorKind::UnknownParameter));
        assert_eq!(kind("format", "dwg"), Err(ErrorKind::UnknownFormat));
        for (name, value) in
            [("deadline", "0.09"), ("deadline", "86401"), ("labels", "some"), ("snap", "2")]
        {
            assert_eq!(kind(name, value), Err(ErrorKind::InvalidParameter), "{name}={value}");
        }
        for value in
            ["", "1,2", "1,2,3,4", "1,2,2", "0,1,2", "1,2,1001", "x,y,z", "1.0,2,3", "-1,2,3"]
        {
            assert_eq!(kind("columns", value), Err(ErrorKind::InvalidParameter), "{value}");
        }
        assert!(kind("columns", "1,2,1000").is_ok());
        for value in ["-1", "1.5", "1000001", ""] {
            assert_eq!(kind("skip_lines", value), Err(ErrorKind::InvalidParameter), "{value}");
        }
        assert!(kind("skip_lines", "1000000").is_ok());
        assert_eq!(kind("unit", "MM"), Err(ErrorKind::InvalidParameter));
        for value in ["two\nlines", "\ttab", &"x".repeat(256)] {
            assert_eq!(kind("name", value), Err(ErrorKind::InvalidParameter), "{value}");
        }
        assert!(kind("name", &"𝔵".repeat(255)).is_ok());
        assert_eq!(Request::from_pairs([("name", " ")]).map(|request| request.name), Ok(None));
        for (name, value) in [
            ("mesh", "triangles"),
            ("mesh_spacing", "0"),
            ("mesh_spacing", "1.1e12"),
            ("thin", "0"),
            ("thin", "-1"),
            ("thin", "nan"),
            ("thin", "1.1e12"),
            ("mesh_points", "999"),
            ("mesh_points", "10000001"),
        ] {
            assert_eq!(kind(name, value), Err(ErrorKind::InvalidParameter), "{name}={value}");
        }
        for (name, value) in [
            ("mesh", "faces"),
            ("mesh_spacing", "1e12"),
            ("thin", "1e12"),
            ("thin", "1e-300"),
            ("mesh_points", "1000"),
            ("mesh_points", "10000000"),
        ] {
            assert!(kind(name, value).is_ok(), "{name}={value}");
        }
        for value in ["", "a", "-1", "1.5", "0,0", "1,2,3,4", "1,,2"] {
            assert_eq!(kind("datums", value), Err(ErrorKind::InvalidParameter), "{value}");
        }
        assert!(kind("datums", "0").is_ok() && kind("datums", "7, 0,12").is_ok());
        assert!(kind("deadline", "86400").is_ok() && kind("deadline", "0.1").is_ok());
    }
}

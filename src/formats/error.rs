use super::Format;

/// Why bytes could not be read as a point cloud, and what to do about it.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum FormatError {
    /// There are no bytes.
    #[error("the input is empty: send the bytes of a point cloud file")]
    Empty,
    /// The format was not named and the bytes look like none that is known.
    #[error(
        "the format cannot be told from the first bytes ({start}): name it; known formats are \
         ply, xyz (text, csv, pts), ptx, pcd, las (laz), e57, stl, obj and off; a text with many lines before its points needs the parameter skip_lines"
    )]
    Unknown {
        /// The first bytes, made printable.
        start: String,
    },
    /// The text is of a kind that is not read, though it has rows of numbers.
    #[error("the text looks like {what}, which is not read: {advice}")]
    Foreign {
        /// What it looks like.
        what: &'static str,
        /// What to do.
        advice: &'static str,
    },
    /// The bytes are those of a compressed file or an archive.
    #[error(
        "the bytes are compressed or an archive ({with}): unpack them; gzip and zstd alone are unpacked here, and \
         once"
    )]
    Compressed {
        /// By what.
        with: &'static str,
    },
    /// A compressed file cannot be unpacked.
    #[error(
        "the {with} file is damaged or cut off ({reason}): send the whole file, or unpack it first"
    )]
    Packed {
        /// By what it is compressed.
        with: &'static str,
        /// What is wrong.
        reason: String,
    },
    /// The system has no memory for what comes out of a compressed file.
    #[error("there is no memory for the {bytes} bytes of the unpacked file")]
    NoMemoryToUnpack {
        /// Bytes unpacked by then.
        bytes: u64,
    },
    /// The header is not what the format prescribes.
    #[error("the {format} header is wrong at line {line}: {reason}")]
    Header {
        /// The format read.
        format: Format,
        /// Line of the file, from 1.
        line: usize,
        /// What is wrong.
        reason: String,
    },
    /// The header announces more than the file holds.
    #[error(
        "the {format} file ends too early: its header announces {announced} points, the data \
         behind it holds at most {found}; send the whole file or correct the header"
    )]
    Truncated {
        /// The format read.
        format: Format,
        /// Points announced.
        announced: u64,
        /// Points there can be at most.
        found: u64,
    },
    /// A coordinate is not a number.
    #[error("line {line} of the {format} file has '{text}' where a number is needed{}", hint(*.format))]
    BadNumber {
        /// The format read.
        format: Format,
        /// Line of the file, from 1.
        line: usize,
        /// What stands there, cut to a few characters.
        text: String,
    },
    /// A field looks like a number and is none.
    #[error("line {line} of the text has '{text}' where a number is needed: {cure}")]
    OddNumber {
        /// Line of the file, from 1.
        line: usize,
        /// What stands there, cut to a few characters.
        text: String,
        /// What it seems to be, and what to do.
        cure: &'static str,
    },
    /// A line has fewer columns than a point needs.
    #[error(
        "line {line} of the {format} file has {found} columns; a point needs {needed}{}",
        hint(*.format)
    )]
    TooFewColumns {
        /// The format read.
        format: Format,
        /// Line of the file, from 1.
        line: usize,
        /// Columns there.
        found: usize,
        /// Columns up to the last coordinate.
        needed: usize,
    },
    /// A line of text is longer than any with a point.
    #[error(
        "the text's line {line} has more than {most} {of}: give each point a line of its own, and leave \
         out columns that are no coordinates"
    )]
    LongLine {
        /// Line of the file, from 1.
        line: usize,
        /// The most there may be.
        most: usize,
        /// Of what there are too many.
        of: &'static str,
    },
    /// No field of the file holds coordinates.
    #[error(
        "the {format} file has no coordinates: it needs fields x, y and z; it has {found}{}",
        hint(*.format)
    )]
    NoCoordinates {
        /// The format read.
        format: Format,
        /// The fields there are.
        found: String,
    },
    /// A scan of an E57 file has no coordinates.
    #[error(
        "scan {scan} of the E57 file has no coordinates: it needs cartesianX, cartesianY and cartesianZ, or \
         sphericalRange, sphericalAzimuth and sphericalElevation, and has {found}; export the file without it, or \
         with its coordinates"
    )]
    ScanWithoutCoordinates {
        /// Its place in the file, from 1.
        scan: usize,
        /// The fields it has.
        found: String,
    },
    /// The coordinates are named twice.
    #[error(
        "the text has more than one column for a coordinate: {found}; say which are meant by the \
         parameter columns"
    )]
    AmbiguousColumns {
        /// The columns there are.
        found: String,
    },
    /// The first column may be x or something before the coordinates.
    #[error(
        "the first column of the text, at line {line}, may be x, or a running number, a time or the \
         number of a scan: say which columns are x, y and z by the parameter columns, columns=1,2,3 \
         or columns=2,3,4"
    )]
    FirstColumn {
        /// Line of the file, from 1.
        line: usize,
    },
    /// A parameter of texts is given for another format.
    #[error("the parameter {parameter} is for text; the cloud is {format}: leave it out")]
    ParameterOfText {
        /// The parameter.
        parameter: &'static str,
        /// The format read.
        format: Format,
    },
    /// Samples of faces are wanted where there are none.
    #[error("there are no faces with an area to sample: leave the parameter mesh out")]
    NoFaces,
    /// Samples of more faces are wanted than are kept.
    #[error(
        "the faces of the mesh have more than {corners} corners, too many to sample: take mesh=vertices, or \
         make a coarser mesh"
    )]
    TooManyFaces {
        /// The most there may be.
        corners: usize,
    },
    /// The spacing asked for makes more samples than there may be.
    #[error(
        "mesh_spacing makes {wanted} points of the mesh and there may be {most}: take a larger spacing, or \
         raise mesh_points"
    )]
    TooManySamples {
        /// Samples by the spacing.
        wanted: u64,
        /// The most there may be.
        most: usize,
    },
    /// The file is in order but has no points.
    #[error("the {format} file has no points")]
    NoPoints {
        /// The format read.
        format: Format,
    },
    /// Every point has a coordinate that is NaN or infinite.
    #[error("none of the {points} points has three finite coordinates")]
    NoFinitePoints {
        /// Points in the file.
        points: usize,
    },
    /// More points than the limit.
    #[error(
        "the cloud has {points} points or more and the limit is {limit}: thin it out, or raise \
         the limit"
    )]
    TooManyPoints {
        /// Points announced, or read before the reader stopped.
        points: u64,
        /// The limit.
        limit: usize,
    },
    /// The system has no memory for the points.
    #[error("there is no memory for {points} points")]
    OutOfMemory {
        /// The points there may be.
        points: u64,
    },
    /// The length of thinning cannot be told beside the coordinates.
    #[error(
        "thin={length} is too small beside a coordinate of {coordinate}: take {least} or more, or leave it out"
    )]
    ThinTooSmall {
        /// The length.
        length: String,
        /// One that can be told.
        least: String,
        /// The largest coordinate.
        coordinate: String,
    },
    /// Thinning keeps more points than there is memory for.
    #[error(
        "thin={length} keeps more points than the {megabytes} MB hold that it may take, after {read} points of the file: \
         take a larger thin (twice the length takes about a quarter of the memory)"
    )]
    ThinTakesMemory {
        /// The length.
        length: String,
        /// Points read by then.
        read: u64,
        /// Megabytes that there are.
        megabytes: u64,
    },
    /// The caller wants the cloud no longer.
    #[error("reading was stopped")]
    Stopped,
    /// The bytes break the format in some other way.
    #[error("the {format} file is damaged: {reason}")]
    Damaged {
        /// The format read.
        format: Format,
        /// What is wrong.
        reason: String,
    },
    /// A variant of the format that is not read.
    #[error("this {format} file needs {what}, which is not supported")]
    Unsupported {
        /// The format read.
        format: Format,
        /// The feature.
        what: String,
    },
}

/// What helps where a text is not read as it was meant.
fn hint(format: Format) -> &'static str {
    match format {
        Format::Xyz => {
            " (the parameter columns says which columns are x, y and z, skip_lines passes over titles)"
        }
        _ => "",
    }
}

/// `bytes` as a short printable text for an error.
pub(super) fn excerpt(bytes: &[u8]) -> String {
    let printed = |&b: &u8| match b {
        // quotes stay as they are
        b' '..=b'~' => vec![b],
        _ => std::ascii::escape_default(b).collect(),
    };
    bytes.iter().take(24).flat_map(printed).map(char::from).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_excerpt_is_short_and_printable() {
        assert_eq!(excerpt(b"\x93NUMPY {'descr'\n"), "\\x93NUMPY {'descr'\\n");
        assert_eq!(excerpt(&[b'x'; 99]).len(), 24);
    }
}

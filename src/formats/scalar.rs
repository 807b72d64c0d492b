use super::{FormatError, memory::zeros, sink::Sink};
use crate::geometry::Vec3;

/// Byte order of binary numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Endian {
    Little,
    Big,
}

/// The type of a stored number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    I64,
    U64,
    F32,
    F64,
}

/// Calls `$run` with a function from the scalar's bytes to f64. The choice is made once, outside of
/// the loop that `$run` is.
macro_rules! with_converter {
    ($scalar:expr, $endian:expr, $run:expr) => {
        match ($scalar, $endian) {
            (Scalar::I8, _) => $run(|b: [u8; 1]| f64::from(i8::from_le_bytes(b))),
            (Scalar::U8, _) => $run(|b: [u8; 1]| f64::from(b[0])),
            (Scalar::I16, Endian::Little) => $run(|b| f64::from(i16::from_le_bytes(b))),
            (Scalar::I16, Endian::Big) => $run(|b| f64::from(i16::from_be_bytes(b))),
            (Scalar::U16, Endian::Little) => $run(|b| f64::from(u16::from_le_bytes(b))),
            (Scalar::U16, Endian::Big) => $run(|b| f64::from(u16::from_be_bytes(b))),
            (Scalar::I32, Endian::Little) => $run(|b| f64::from(i32::from_le_bytes(b))),
            (Scalar::I32, Endian::Big) => $run(|b| f64::from(i32::from_be_bytes(b))),
            (Scalar::U32, Endian::Little) => $run(|b| f64::from(u32::from_le_bytes(b))),
            (Scalar::U32, Endian::Big) => $run(|b| f64::from(u32::from_be_bytes(b))),
            (Scalar::I64, Endian::Little) => $run(|b| i64::from_le_bytes(b) as f64),
            (Scalar::I64, Endian::Big) => $run(|b| i64::from_be_bytes(b) as f64),
            (Scalar::U64, Endian::Little) => $run(|b| u64::from_le_bytes(b) as f64),
            (Scalar::U64, Endian::Big) => $run(|b| u64::from_be_bytes(b) as f64),
            (Scalar::F32, Endian::Little) => $run(|b| f64::from(f32::from_le_bytes(b))),
            (Scalar::F32, Endian::Big) => $run(|b| f64::from(f32::from_be_bytes(b))),
            (Scalar::F64, Endian::Little) => $run(f64::from_le_bytes),
            (Scalar::F64, Endian::Big) => $run(f64::from_be_bytes),
        }
    };
}

impl Scalar {
    /// Bytes it takes.
    pub(super) fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::I64 | Self::U64 | Self::F64 => 8,
        }
    }

    /// Its name in a PLY header.
    pub(super) fn ply_name(self) -> &'static str {
        match self {
            Self::I8 => "char",
            Self::U8 => "uchar",
            Self::I16 => "short",
            Self::U16 => "ushort",
            Self::I32 => "int",
            Self::U32 => "uint",
            Self::I64 => "int64",
            Self::U64 => "uint64",
            Self::F32 => "float",
            Self::F64 => "double",
        }
    }

    /// Writes a number, little-endian, the nearest of those that it can be.
    pub(super) fn write(self, value: f64, out: &mut Vec<u8>) {
        match self {
            Self::I8 => out.extend((value as i8).to_le_bytes()),
            Self::U8 => out.push(value as u8),
            Self::I16 => out.extend((value as i16).to_le_bytes()),
            Self::U16 => out.extend((value as u16).to_le_bytes()),
            Self::I32 => out.extend((value as i32).to_le_bytes()),
            Self::U32 => out.extend((value as u32).to_le_bytes()),
            Self::I64 => out.extend((value as i64).to_le_bytes()),
            Self::U64 => out.extend((value as u64).to_le_bytes()),
            Self::F32 => out.extend((value as f32).to_le_bytes()),
            Self::F64 => out.extend(value.to_le_bytes()),
        }
    }

    /// The number at the start of `bytes`; `None` where they are too few.
    pub(super) fn read(self, endian: Endian, bytes: &[u8]) -> Option<f64> {
        with_converter!(self, endian, |convert| first(bytes, convert))
    }
}

fn first<const N: usize>(bytes: &[u8], convert: impl Fn([u8; N]) -> f64) -> Option<f64> {
    bytes.first_chunk().map(|&b| convert(b))
}

/// Where one coordinate of every record lies.
#[derive(Clone, Copy, Debug)]
pub(super) struct Column {
    pub(super) scalar: Scalar,
    pub(super) offset: usize,
}

/// Records decoded at a time: a block's bytes stay in the nearest cache for all three coordinates.
const BLOCK: usize = 256;

/// Decodes records of `stride` bytes into points, one coordinate of a block at a time.
///
/// `bytes` must hold whole records, and each column must lie within a record.
///
/// # Errors
/// The system has no memory for the points.
pub(super) fn decode_records(
    bytes: &[u8],
    stride: usize,
    endian: Endian,
    columns: [Column; 3],
) -> Result<Vec<Vec3>, FormatError> {
    let mut points = zeros((bytes.len() / stride) as u64)?;
    for (block, records) in points.chunks_mut(BLOCK).zip(bytes.chunks(BLOCK * stride)) {
        decode_block(records, stride, endian, columns, block);
    }
    Ok(points)
}

/// Decodes records as [`decode_records`] does, and hands the points on.
///
/// # Errors
/// `sink` does not want them.
pub(super) fn hand_on_records(
    bytes: &[u8],
    stride: usize,
    endian: Endian,
    columns: [Column; 3],
    sink: &mut dyn Sink,
) -> Result<(), FormatError> {
    let mut block = [Vec3::zeros(); BLOCK];
    for records in bytes.chunks(BLOCK * stride) {
        let block = &mut block[..records.len() / stride];
        decode_block(records, stride, endian, columns, block);
        sink.take(block)?;
    }
    Ok(())
}

fn decode_block(
    records: &[u8],
    stride: usize,
    endian: Endian,
    columns: [Column; 3],
    block: &mut [Vec3],
) {
    for (axis, column) in columns.into_iter().enumerate() {
        decode_column(records, stride, endian, column, block, axis);
    }
}

/// Decodes one column of records of `stride` bytes into coordinate `axis` of `points`.
pub(super) fn decode_column(
    bytes: &[u8],
    stride: usize,
    endian: Endian,
    column: Column,
    points: &mut [Vec3],
    axis: usize,
) {
    let records = bytes.get(column.offset..).unwrap_or_default();
    with_converter!(column.scalar, endian, |convert| gather(
        records, stride, points, axis, convert
    ));
}

fn gather<const N: usize>(
    bytes: &[u8],
    stride: usize,
    points: &mut [Vec3],
    axis: usize,
    convert: impl Fn([u8; N]) -> f64,
) {
    // the last record may end before a whole stride: its column starts at the offset
    for (point, record) in points.iter_mut().zip(bytes.chunks(stride)) {
        if let Some(&b) = record.first_chunk() {
            point[axis] = convert(b);
        }
    }
}

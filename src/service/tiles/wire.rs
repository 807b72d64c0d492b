//! What goes to those who work on parts, and what comes back.

use bytes::Bytes;
use serde::{Deserialize, Serialize};

use crate::{
    geometry::Vec3,
    segment::{
        Cancelled, Monitor, Stage,
        tiles::{self, Guide, Sums},
    },
};

/// Whether a point has three coordinates.
pub(super) fn is_finite(p: &Vec3) -> bool {
    p.iter().all(|x| x.is_finite())
}

/// What is asked of a part.
#[derive(Serialize)]
pub(super) struct Asked<'a> {
    pub guide: &'a Guide,
    pub with_labels: bool,
}

#[derive(Deserialize)]
struct Read {
    guide: Guide,
    with_labels: bool,
}

/// What is told of a part, before its labels.
#[derive(Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct PartTold {
    pub sums: Vec<Sums>,
    pub finite: usize,
    pub distinct: usize,
}

/// What has come of a part.
#[derive(Debug, PartialEq)]
pub(super) struct PartCame {
    pub told: PartTold,
    pub labels: Vec<i32>,
}

impl PartCame {
    pub fn write(&self) -> Result<Bytes, String> {
        let told = serde_json::to_vec(&self.told).map_err(|e| e.to_string())?;
        let mut out = (told.len() as u64).to_le_bytes().to_vec();
        out.extend(told);
        let labels: Vec<u8> = self.labels.iter().flat_map(|l| l.to_le_bytes()).collect();
        out.extend(zstd::bulk::compress(&labels, 1).map_err(|e| e.to_string())?);
        Ok(out.into())
    }

    pub fn read(bytes: &[u8]) -> Result<Self, String> {
        let damaged = || "what came of it is damaged".to_owned();
        let (length, rest) = bytes.split_first_chunk().ok_or_else(damaged)?;
        let length = usize::try_from(u64::from_le_bytes(*length)).map_err(|_| damaged())?;
        let (told, labels) = rest.split_at_checked(length).ok_or_else(damaged)?;
        let told = serde_json::from_slice(told).map_err(|e| e.to_string())?;
        let labels = zstd::stream::decode_all(labels).map_err(|e| e.to_string())?;
        let labels = labels.as_chunks().0.iter().map(|l| i32::from_le_bytes(*l)).collect();
        Ok(Self { told, labels })
    }
}

/// The points of a part as bytes, of single precision where that is all they have.
pub(super) fn written(points: &[Vec3]) -> Bytes {
    let is_single = |x: &f64| f64::from(*x as f32) == *x || x.is_nan();
    let single = points.iter().all(|p| p.iter().all(is_single));
    let width = if single { 4 } else { 8 };
    let mut out = Vec::with_capacity(1 + 3 * width * points.len());
    out.push(width as u8);
    for x in points.iter().flat_map(|p| p.iter()) {
        if single {
            out.extend_from_slice(&(*x as f32).to_le_bytes());
        } else {
            out.extend_from_slice(&x.to_le_bytes());
        }
    }
    out.into()
}

/// The points that were [`written`]; nothing where they were not.
pub(super) fn read_points(bytes: &[u8]) -> Option<Vec<Vec3>> {
    let (width, rest) = bytes.split_first()?;
    let point = |x: [f64; 3]| Vec3::from(x);
    match width {
        4 => {
            let (all, []) = rest.as_chunks::<12>() else { return None };
            let number = |p: &[u8; 12], k: usize| {
                f64::from(f32::from_le_bytes([p[4 * k], p[4 * k + 1], p[4 * k + 2], p[4 * k + 3]]))
            };
            Some(all.iter().map(|p| point([0, 1, 2].map(|k| number(p, k)))).collect())
        }
        8 => {
            let (all, []) = rest.as_chunks::<8>() else { return None };
            let (all, []) = all.as_chunks::<3>() else { return None };
            Some(all.iter().map(|p| point(p.map(f64::from_le_bytes))).collect())
        }
        _ => None,
    }
}

/// Labels the points of a part by a guide until that `is_over`.
///
/// # Errors
/// Either cannot be read, or it is over.
pub fn label_part(
    guide: &[u8],
    part: &[u8],
    is_over: &(dyn Fn() -> bool + Sync),
) -> Result<Bytes, String> {
    let Read { guide, with_labels } = serde_json::from_slice(guide).map_err(|e| e.to_string())?;
    let mut points = read_points(part).ok_or("its points cannot be read")?;
    let finite: Option<Vec<bool>> =
        (!points.iter().all(is_finite)).then(|| points.iter().map(is_finite).collect());
    points.retain(is_finite);
    let over = Over(is_over);
    let found = tiles::label(&points, &guide, &over).map_err(|e: Cancelled| e.to_string())?;
    let found = found.ok_or("its guide cannot be followed")?;
    let labels = match (with_labels, finite) {
        (false, _) => Vec::new(),
        (true, None) => found.labels,
        (true, Some(finite)) => {
            let mut labels = found.labels.into_iter();
            finite
                .iter()
                .map(|finite| if *finite { labels.next().unwrap_or(-1) } else { -1 })
                .collect()
        }
    };
    let told = PartTold { sums: found.sums, finite: points.len(), distinct: found.distinct };
    PartCame { told, labels }.write()
}

/// A monitor that hears of no progress.
struct Over<'a>(&'a (dyn Fn() -> bool + Sync));

impl Monitor for Over<'_> {
    fn progress(&self, _: Stage, _: f64) {}

    fn cancelled(&self) -> bool {
        (self.0)()
    }
}

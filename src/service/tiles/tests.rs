use std::sync::Mutex;

use super::wire::{PartCame, PartTold, read_points, written};
use super::*;
use crate::answer::Document;
use crate::geometry::Vec3;
use crate::jobs::Blob;
use crate::service::compute;

/// Parts that are worked on here, the last one first.
#[derive(Default)]
struct Here {
    kept: Mutex<Vec<Bytes>>,
}

impl Parts for Here {
    fn keep(&self, part: Bytes) -> Result<Blob, StoreError> {
        let mut kept = self.kept.lock().unwrap();
        kept.push(part);
        Ok(Blob { name: (kept.len() - 1).to_string(), digest: String::new(), bytes: 0 })
    }

    fn each(
        &self,
        guide: Bytes,
        parts: &[Blob],
        _control: &Control,
        take: &mut dyn FnMut(usize, Bytes) -> Result<(), PartsError>,
    ) -> Result<(), PartsError> {
        for (part, blob) in parts.iter().enumerate().rev() {
            let points = self.kept.lock().unwrap()[blob.name.parse::<usize>().unwrap()].clone();
            let came = label_part(&guide, &points, &|| false);
            take(part, came.map_err(|why| PartsError::Failed { part, why })?)?;
        }
        Ok(())
    }
}

/// Half a tube and a plate, in an order without pattern, every 100th point without coordinates.
fn cloud(n: usize) -> Vec<[f64; 3]> {
    let at = |k: usize| {
        let [a, b, c] = [0.618_034, 0.569_840, 0.754_878].map(|s| (k as f64 * s).fract());
        let noise = 0.01 * (((k * 7919 % 1000) as f64 / 1000.0) + c - 1.0);
        let angle = std::f64::consts::PI * a;
        match k {
            _ if k % 100 == 50 => [f64::NAN; 3],
            _ if k.is_multiple_of(2) => {
                [(2.0 + noise) * angle.cos(), (2.0 + noise) * angle.sin(), 5.0 * b]
            }
            _ => [8.0 * a - 4.0, -1.0 + noise, 5.0 * b],
        }
    };
    (0..n).map(at).collect()
}

fn ply(points: &[[f64; 3]], single: bool) -> Vec<u8> {
    let kind = if single { "float" } else { "double" };
    let mut out = format!(
        "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty {kind} x\n\
         property {kind} y\nproperty {kind} z\nend_header\n",
        points.len()
    )
    .into_bytes();
    for x in points.iter().flatten() {
        if single {
            out.extend_from_slice(&(*x as f32).to_le_bytes());
        } else {
            out.extend_from_slice(&x.to_le_bytes());
        }
    }
    out
}

fn answered(bytes: &[u8], request: &Request, points: usize) -> (Document, usize) {
    let parts = Here::default();
    let cut = Cut { parts: &parts, points };
    let (limits, control) = (Limits::default(), Control::new(None));
    let answer = if cut.is_for(bytes, request) {
        match cut.answer(bytes.to_vec().into(), request, &limits, &control).unwrap() {
            Cutting::Done(answer) => *answer,
            Cutting::Whole(bytes) => compute(&bytes, request, &limits, &control).unwrap(),
        }
    } else {
        compute(bytes, request, &limits, &control).unwrap()
    };
    let kept = parts.kept.lock().unwrap().len();
    (answer.document, kept)
}

#[test]
fn a_cloud_in_parts_is_answered_as_the_whole_is() {
    for single in [true, false] {
        let points = cloud(60_000);
        let bytes = ply(&points, single);
        let request = Request::default();
        let whole = compute(&bytes, &request, &Limits::default(), &Control::new(None));
        let whole = whole.unwrap().document;
        let (document, parts) = answered(&bytes, &request, 25_000);
        assert_eq!(parts, 3);
        assert_eq!((&document.input.sha256, &document.input), (&whole.input.sha256, &whole.input));
        assert_eq!(document.input.skipped, 600);
        let (a, b) = (document.labels(), whole.labels());
        assert_eq!(a.len(), 60_000);
        let differ = a.iter().zip(b).filter(|(a, b)| a != b).count();
        assert!(differ < 300, "{differ}");
        for (p, l) in points.iter().zip(a) {
            assert!(!p[0].is_nan() || *l == -1);
        }
        assert_eq!(document.unassigned.count, a.iter().filter(|l| **l < 0).count());
        assert_eq!(document.unassigned.reasons.values().sum::<usize>(), document.unassigned.count);
        for (a, b) in document.regions.iter().zip(&whole.regions) {
            assert_eq!(a.surface_type, b.surface_type);
            assert!(a.point_count.abs_diff(b.point_count) < 300);
        }
    }
}

#[test]
fn clouds_that_parts_would_not_do_justice_to_are_looked_at_as_a_whole() {
    let points = cloud(6_000);
    let request = Request::default();
    // as many as a part has
    assert_eq!(answered(&ply(&points, true), &request, 6_000).1, 0);
    assert_eq!(answered(&ply(&points, true), &request, 5_999).1, 2);
    assert_eq!(answered(&ply(&points, true), &request, 0).1, 0);
    let asked = |name: &str, value: &str| Request::from_pairs([(name, value)]).unwrap();
    for (name, value) in [("thin", "0.01"), ("association", "minimum_zone"), ("method", "rcond")] {
        assert_eq!(answered(&ply(&points, true), &asked(name, value), 2_000).1, 0, "{name}");
    }
    // each point twice: they are kept, and then told to be copies
    let twice = [&points[..], &points[..]].concat();
    let (document, _) = answered(&ply(&twice, true), &request, 5_000);
    let whole = compute(&ply(&twice, true), &request, &Limits::default(), &Control::new(None));
    assert_eq!(document.regions, whole.unwrap().document.regions);
}

#[test]
fn a_cloud_that_stands_in_one_place_or_nowhere_is_told_as_a_whole_is() {
    for place in [[1.0, 2.0, 3.0], [f64::NAN; 3]] {
        let bytes = ply(&[place; 9_000], true);
        let parts = Here::default();
        let cut = Cut { parts: &parts, points: 2_000 };
        let (limits, control) = (Limits::default(), Control::new(None));
        let request = Request::default();
        assert!(cut.is_for(&bytes, &request));
        let answer = cut.answer(bytes.into(), &request, &limits, &control);
        assert!(matches!(answer, Ok(Cutting::Whole(_))), "{place:?}");
    }
}

#[test]
fn what_is_written_is_read_and_what_is_damaged_is_not() {
    for points in [vec![], vec![Vec3::new(0.5, f64::NAN, -3.0)], vec![Vec3::repeat(0.1); 3]] {
        let bytes = written(&points);
        let read = read_points(&bytes).unwrap();
        assert_eq!(format!("{read:?}"), format!("{points:?}"));
        assert!(read_points(&bytes[..bytes.len() - 1]).is_none());
    }
    let told = PartTold { sums: Vec::new(), finite: 3, distinct: 2 };
    let came = PartCame { told, labels: vec![-1, 0, 7] };
    let bytes = came.write().unwrap();
    assert_eq!(PartCame::read(&bytes).unwrap(), came);
    for end in [0, 7, 9, bytes.len() - 1] {
        assert!(PartCame::read(&bytes[..end]).is_err(), "{end}");
    }
    assert!(label_part(b"{}", &written(&[]), &|| false).is_err());
}

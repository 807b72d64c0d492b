use super::*;
use crate::formats::{Hints, Limits, read as read_any};

/// A scan of two columns and three rows, the second point a hole; its matrix turns by a quarter about z, doubles and moves.
fn scan(ending: &str, more: &str) -> String {
    let lines = [
        "2",
        "3",
        "10 20 30",
        "0 1 0",
        "-1 0 0",
        "0 0 1",
        "0 2 0 0",
        "-2 0 0 0",
        "0 0 2 0",
        "10 20 30 1",
    ];
    let points = [
        format!("1 2 3 0.25{more}"),
        format!("0 0 0 0.500000{more}"),
        format!("-1.5 0.5 4 1{more}"),
        format!("0 1 0 0.1{more}"),
        format!("1e0 0 0 0.1{more}"),
        format!("0 0 1.0D+00 0.1{more}"),
    ];
    let lines = lines.into_iter().map(str::to_owned).chain(points);
    lines.map(|line| line + ending).collect()
}

/// What becomes of its points: [x y z 1] M.
const WORLD: [[f64; 3]; 5] = [
    [6.0, 22.0, 36.0],
    [9.0, 17.0, 38.0],
    [8.0, 20.0, 30.0],
    [10.0, 22.0, 30.0],
    [10.0, 20.0, 32.0],
];

/// A file of two scans.
pub(in crate::formats) fn file() -> String {
    scan("\n", "") + &scan("\n", "")
}

fn told(text: &str) -> Result<PointCloud, FormatError> {
    read_any(text.as_bytes(), None, &Limits::default())
}

fn points(cloud: &PointCloud) -> Vec<[f64; 3]> {
    cloud.points.iter().map(|&p| p.into()).collect()
}

#[test]
fn poses_are_applied_to_row_vectors_and_holes_are_kept_in_place() {
    for (ending, more) in
        [("\n", ""), ("\r\n", ""), ("\n", " 120 99 30"), (" \n", ""), ("\n\n", "")]
    {
        let cloud = told(&scan(ending, more)).unwrap();
        assert_eq!(points(&cloud), WORLD, "{ending:?}");
        assert_eq!(cloud.input_index, Some(vec![0, 2, 3, 4, 5]));
        assert_eq!((cloud.input_len, cloud.grid), (6, Some(Grid { width: 3, height: 2 })));
    }
    for text in [
        scan("\n", "").replacen("2\n3\n", "2 3\n", 1),
        format!("# by hand\n\n{}", scan("\n", "")),
        format!("\u{feff}{}", scan("\n", "").replace(' ', "\t")),
    ] {
        assert_eq!(points(&told(&text).unwrap()), WORLD, "{text}");
    }
    assert_eq!(Format::detect(scan("\n", "").as_bytes()), Some(Format::Ptx));
    // also where it is called text, as some save it
    let named = Hints { format: Some(Format::Xyz), ..Hints::default() };
    let cloud = read_any(scan("\n", "").as_bytes(), named, &Limits::default()).unwrap();
    assert_eq!(points(&cloud), WORLD);
}

#[test]
fn scans_follow_each_other_each_with_its_own_pose_and_size() {
    let second =
        "1\n2\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n5 0 0 1\n1 1 1\n0 0 0 0.5\n";
    let empty =
        second.replacen("1\n2\n", "0\n2\n", 1).lines().take(10).collect::<Vec<_>>().join("\n");
    let cloud = told(&format!("{}{empty}\n{second}", scan("\n", ""))).unwrap();
    assert_eq!(points(&cloud), [&WORLD[..], &[[6.0, 1.0, 1.0]]].concat());
    assert_eq!((cloud.input_len, cloud.grid), (8, None));
}

#[test]
fn the_matrix_may_have_a_weight_and_must_be_one_for_row_vectors() {
    let head = "1\n1\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n";
    let of = |matrix: &str| told(&format!("{head}{matrix}1 2 3 0.5\n"));
    let halved = of("2 0 0 0\n0 2 0 0\n0 0 2 0\n4 0 0 2\n").unwrap();
    assert_eq!(points(&halved), [[3.0, 2.0, 3.0]]);
    for (matrix, cause) in [
        ("1 0 0 5\n0 1 0 6\n0 0 1 7\n0 0 0 1\n", "has to be transposed"),
        ("0 0 0 0\n0 0 0 0\n0 0 0 0\n0 0 0 1\n", "all points one"),
        ("1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 0\n", "all points one"),
    ] {
        let error = of(matrix).unwrap_err();
        let FormatError::Header { format: Format::Ptx, line: 7, reason } = &error else {
            panic!("{error}")
        };
        assert!(reason.contains(cause), "{reason}");
    }
}

#[test]
fn the_step_of_the_decimals_is_that_before_the_pose() {
    let fixed = scan("\n", "").replace("1e0", "1").replace("1.0D+00", "1");
    // one decimal at most, and lengths are doubled
    assert!((told(&fixed).unwrap().resolution - 0.2).abs() < 1e-12);
    // with powers of ten there is no step
    assert_eq!(told(&scan("\n", "")).unwrap().resolution, 0.0);
}

#[test]
fn what_is_missing_or_no_number_is_named_with_its_line() {
    let whole = scan("\n", "");
    let cut = |lines: usize| {
        whole.lines().take(lines).map(|line| format!("{line}\n")).collect::<String>()
    };
    let format = Format::Ptx;
    let truncated = FormatError::Truncated { format, announced: 6, found: 5 };
    assert_eq!(told(&cut(15)).unwrap_err(), truncated);
    let named =
        |text: &str| read_any(text.as_bytes(), Some(Format::Ptx), &Limits::default()).unwrap_err();
    assert!(matches!(named(&cut(8)), FormatError::Header { line: 1, .. }));
    assert!(matches!(named("1 2 3\n"), FormatError::Header { line: 1, .. }));
    let bad = whole.replace("-1.5 0.5 4", "-1.5 oops 4");
    let text = "oops".to_owned();
    assert_eq!(told(&bad).unwrap_err(), FormatError::BadNumber { format, line: 13, text });
    let short = whole.replace("-1.5 0.5 4 1", "-1.5 0.5");
    let few = FormatError::TooFewColumns { format, line: 13, found: 2, needed: 3 };
    assert_eq!(told(&short).unwrap_err(), few);
    // a point more than announced stands where the next scan should begin
    let more = format!("{whole}1 2 3 0.5\n");
    assert!(matches!(told(&more).unwrap_err(), FormatError::Header { line: 17, .. }));
    let limited = |max_points| read_any(whole.as_bytes(), None, &Limits::of(max_points));
    assert!(limited(6).is_ok());
    assert_eq!(limited(5), Err(FormatError::TooManyPoints { points: 6, limit: 5 }));
}

use super::*;
use crate::formats::{Columns, Limits};

pub(super) const TWO: [[f64; 3]; 2] = [[1.0, 2.0, 3.0], [-4.5, 0.5, 6.0]];

pub(super) fn told(text: &str, columns: Option<[u64; 3]>) -> Result<PointCloud, FormatError> {
    let columns = columns.map(|columns| Columns::new(columns).unwrap());
    read(text.as_bytes(), &Hints { columns, ..Hints::default() }, &Limits::default())
}

pub(super) fn points(text: &str) -> Vec<[f64; 3]> {
    let cloud = told(text, None).unwrap_or_else(|error| panic!("{text:?}: {error}"));
    cloud.points.iter().map(|&p| p.into()).collect()
}

pub(super) fn error(text: &str) -> FormatError {
    told(text, None).expect_err(text)
}

#[test]
fn any_usual_separator_is_read() {
    for text in [
        "1 2 3\n-4.5 5e-1 6\n",
        "  1\t2\t3\r\n-4.5\t0.5 6.0 255 255 255",
        "1,2,3\n-4.5, .5,6\n",
        "1, 2, 3\n-4.5, 0.5, 6\n",
        "1 2 3\r-4.5 0.5 6\r",
        "1;2;3;a\n-4.5;+0.5;6;b\n\n",
        "1,2,3,\n-4.5,0.5,6,\n",
        "\"1\",\"2\",\"3\"\n\"-4.5\",0.5,6\n",
        "\u{feff}# comment\n1 2 3\n// another\n% one more\n-4.5 0.5 6\n",
        "1.0D+00 2.D0 3\n-4.5d0 5.0D-01 6\n",
    ] {
        assert_eq!(points(text), TWO, "{text:?}");
    }
}

#[test]
fn a_comma_is_a_decimal_point_where_it_does_not_part_numbers() {
    for text in [
        "1,0;2,0;3\n-4,5;0,5;6\n",
        "1 2 3\n-4,5 0,5 6\n",
        "1,0\t2,0\t3,0\n-4,5\t0,5\t6,0\n",
        "X\tY\tZ\n1,0\t2,0\t3,0\n-4,5\t5,0E-01\t6,0\n",
        // colours are numbers in any case
        "1,0;2,0;3,0;255;0;7\n-4,5;0,5;6,0;255;0;7\n",
        "1,0 2,0 3,0 255 0 7\n-4,5 0,5 6,0 255 0 7\n",
    ] {
        assert_eq!(points(text), TWO, "{text:?}");
    }
    for text in ["1, 2,3\n4, 5,6\n", "1,5, 2,5, 3,5\n"] {
        assert!(matches!(error(text), FormatError::Header { line: 1, .. }), "{text}");
    }
    // thousands, or a comma that parts as blanks do: no guess is made
    for text in [
        "1,234.5 2,345.5 7.5\n",
        "1.5,2.5 3.5\n",
        "1,234.5;2;3\n",
        "1'234.5 2 3\n",
        "1.234,5;2.345,5;7,5\n",
        "1\u{a0}234,5;2\u{a0}345,5;7,5\n",
        "1.5\u{a0}2.5\u{a0}3.5\n",
    ] {
        let told = error(&text.repeat(9));
        assert!(matches!(told, FormatError::OddNumber { line: 1, .. }), "{text}: {told}");
    }
}

#[test]
fn a_header_names_the_columns_however_it_is_parted() {
    for text in [
        "x y z\n1 2 3\n-4.5 0.5 6\n",
        "id,Z,Y [mm],\"X\",i\na,3,2,1,9\nb,6,0.5,-4.5,9\n",
        "East North Up\n1 2 3\n-4.5 0.5 6\n",
        "\"intensity\",\"Points:0\",\"Points:1\",\"Points:2\"\n7,1,2,3\n7,-4.5,0.5,6\n",
        "ID,Easting,Northing,Elevation\nP1,1,2,3\nP2,-4.5,0.5,6\n",
        "//Y X Z\n2 1 3\n0.5 -4.5 6\n",
        "# columns: y x z\n2 1 3\n0.5 -4.5 6\n",
        "X;Y;Z\n1 2 3\n-4.5 0.5 6\n",
        "X [m] Y [m] Z [m]\n1 2 3\n-4.5 0.5 6\n",
        "x;y;z\n[mm];[mm];[mm]\n1;2;3\n-4.5;0.5;6\n",
        "Exported by a scanner, version 3.1\nx y z\n1 2 3\n-4.5 0.5 6\n",
        "//X;Y;Z;Volume density (r=0.01);Nx\n2\n1;2;3;7;8\n-4.5;0.5;6;7;8\n",
        ",x,y,z\n0,1,2,3\n1,-4.5,0.5,6\n",
        "nx ny nz x y z\n0 0 1 1 2 3\n0 0 1 -4.5 0.5 6\n",
        // as R writes a table: the rows have names of their own
        "\"x\" \"y\" \"z\"\n\"a\" 1 2 3\n\"b\" -4.5 0.5 6\n",
        // further columns without names
        "x y z\n1 2 3 7 8\n-4.5 0.5 6 7 8\n",
        "x,y,z,scalar field\n1,2,3,7\n-4.5,0.5,6,7\n",
        // a comment that names no columns
        "# z before y and x\n1 2 3\n-4.5 0.5 6\n",
    ] {
        assert_eq!(points(text), TWO, "{text:?}");
    }
}

#[test]
fn names_that_do_not_tell_the_columns_are_refused() {
    for text in ["a,b,c,d\n1,2,3,4\n", "time lon lat\n1 2 3\n"] {
        assert!(matches!(error(text), FormatError::NoCoordinates { .. }), "{text}");
    }
    let text = "x,y,z,x,y,z\n1,2,3,4,5,6\n";
    let found = "x, y, z, x, y, z".into();
    assert_eq!(error(text), FormatError::AmbiguousColumns { found });
    for (text, at) in [
        ("Point ID X Y Z R G B\n1 1.5 2.5 3.5 4 5 6\n", 1),
        ("x y z\n7 1.5 2.5 3.5\n3 1.5 2.5 3.5\n", 1),
        ("a\nb\nc\nd\n1 2 3\n", 4),
    ] {
        let told = error(text);
        assert!(matches!(told, FormatError::Header { line, .. } if line == at), "{text}: {told}");
    }
}

/// Rows with a number before three coordinates.
fn numbered(numbers: impl Iterator<Item = u64>) -> String {
    numbers
        .enumerate()
        .map(|(i, n)| format!("{n} {}.5 {} {}.25\n", i * i, 7 * i, 10000 - i))
        .collect()
}

#[test]
fn running_numbers_before_the_coordinates_are_passed_over() {
    for start in [0, 1, 1000] {
        let found = points(&numbered(start..start + 9));
        assert_eq!((found.len(), found[2]), (9, [4.5, 14.0, 9998.25]));
    }
    // as doubles, and from below 0
    for write in [|i| format!("{i}.0"), |i| format!("{i}.000e0"), |i: i32| (i - 3).to_string()] {
        let rows = (0..9).map(|i| format!("{} {}.5 {} {}.25\n", write(i), i * i, 7 * i, 10000 - i));
        assert_eq!(points(&rows.collect::<String>())[2], [4.5, 14.0, 9998.25]);
    }
    let named = format!("x y z\n{}", numbered(1..10));
    assert_eq!(points(&named)[2], [4.5, 14.0, 9998.25]);
}

#[test]
fn numbers_that_may_be_running_or_coordinates_are_refused() {
    let gap = numbered((1..2000).filter(|n| *n != 1500));
    let row = (0..9).map(|i| format!("{i} 0.5 {}.25 7\n", i * i)).collect::<String>();
    let whole = (0..9).map(|i| format!("{i} {} {} 7\n", i * i, 9 - i)).collect::<String>();
    let far = numbered((1..10).map(|n| 3 * n));
    // each number once, in no order
    let shuffled = numbered((0..101).map(|i| (i * 37) % 101));
    let falling = numbered((0..101).rev());
    for text in [shuffled, falling] {
        assert_eq!(error(&text), FormatError::FirstColumn { line: 1 });
    }
    // colours behind x, y and z
    let coloured = (0..9).map(|i| format!("{i} {}.{i} 7.5 {} 0 9\n", i * 37 % 11, i * 53 % 256));
    for text in [row, whole, far, coloured.collect()] {
        assert_eq!(error(&text), FormatError::FirstColumn { line: 1 });
        let x = told(&text, Some([1, 2, 3])).unwrap().points[2].x;
        assert!(x == 2.0 || x == 9.0);
    }
    // a grid's second row, and numbers left out, far behind the lines that show the layout
    let grid: String = (0..3000)
        .map(|i| format!("{} {}.5 {}.25 {}.5\n", i % 1500, i / 700, i * i % 97, i % 13))
        .collect();
    assert_eq!(error(&grid), FormatError::FirstColumn { line: 1501 });
    assert_eq!(error(&gap), FormatError::FirstColumn { line: 1500 });
}

#[test]
fn coordinates_that_count_up_are_no_running_numbers() {
    for text in [
        // three columns have no room for one
        (0..9).map(|i| format!("{i} {}.5 {}\n", i * i, 9 - i)).collect::<String>(),
        (0..9).map(|i| format!("{}.5 {i}.5 {} 7\n", i, 9 - i)).collect::<String>(),
        (0..9).map(|i| format!("{} {i} {} 7.5\n", i / 3, 9 - i)).collect::<String>(),
        (0..9).map(|i| format!("{} {i} {} 7\n", i * i, 9 - i)).collect::<String>(),
        // whole numbers that come again are the steps of a grid
        (0..90).map(|i| format!("{} {i}.5 {} 7\n", (i * 37) % 53, 9 - i)).collect::<String>(),
    ] {
        let first: f64 = text.split(' ').nth(1).map_or(0.0, |_| points(&text)[8][0]);
        assert!([8.0, 8.5, 2.0, 64.0, 31.0].contains(&first), "{text}: {first}");
    }
}

#[test]
fn a_name_less_than_there_are_columns_is_that_of_running_numbers_or_times() {
    let rows = |lead: fn(usize) -> String| {
        let row = |i: usize| format!("{} {}.50 {}.75 {}.25\n", lead(i), i * i, 7 * i, 10_000 - i);
        (0..30).map(row).collect::<String>()
    };
    for lead in [|i: usize| format!("{i}"), |i: usize| format!("{}.{:03}", i / 20, i % 20 * 50)] {
        assert_eq!(points(&format!("x y z\n{}", rows(lead)))[2], [4.5, 14.75, 9998.25]);
    }
    let named =
        format!("t,x,y,z\n{}", rows(|i| format!("{i}.5")).replace(' ', ",").replace('\n', ",\n"));
    assert_eq!(points(&named)[2], [4.5, 14.75, 9998.25]);
}

#[test]
fn the_columns_that_the_sender_names_win() {
    let cloud = told("z,y,x\n9,3,2,1\n9,6,0.5,-4.5\n", Some([4, 3, 2])).unwrap();
    assert_eq!(cloud.points.iter().map(|&p| p.into()).collect::<Vec<[f64; 3]>>(), TWO);
    let cloud = told("P1 1 2 3\nP2 -4.5 0.5 6\n", Some([2, 3, 4])).unwrap();
    assert_eq!(cloud.points[1], Vec3::new(-4.5, 0.5, 6.0));
    let needed = 9;
    assert_eq!(
        told("1 2 3\n", Some([1, 2, 9])),
        Err(FormatError::TooFewColumns { format: Format::Xyz, line: 1, found: 3, needed })
    );
}

#[test]
fn blocks_follow_each_other_each_behind_its_count() {
    assert_eq!(points("2\n1 2 3 77\n-4.5 0.5 6 77\n"), TWO);
    assert_eq!(points("1\r\n1 2 3 77\r\n1\r\n-4.5 0.5 6\r\n"), TWO);
    assert_eq!(points("0\n2\n1 2 3 77\n-4.5 0.5 6 77\n0\n"), TWO);
    assert_eq!(points("2\n1,2,3\n-4.5,0.5,6\n"), TWO);
    assert_eq!(points("2\n1;2;3\n-4.5;0.5;6\n"), TWO);
    let (format, announced) = (Format::Xyz, 3);
    assert_eq!(error("3\n1 2 3\n4 5 6\n"), FormatError::Truncated { format, announced, found: 2 });
    let error = error("2\n1 2 3\n2\n4 5 6\n");
    assert_eq!(error, FormatError::TooFewColumns { format, line: 3, found: 1, needed: 3 });
}

#[test]
fn missing_and_infinite_values_are_skipped_points() {
    let text = ",,\n1,2,3\n1,,3\nnan,0,0\n0,1e999,0\n4,5,6";
    let errors = "#N/A,#N/A,#N/A\n1,2,3\n#NV,2,3\n-nan(ind),0,#DIV/0!\n0,NaN(123),0\n4,5,6";
    assert_eq!(told(errors, None).unwrap().input_index, Some(vec![1, 5]));
    let cloud = told(text, None).unwrap();
    assert_eq!((cloud.input_len, cloud.skipped()), (6, 4));
    assert_eq!(cloud.input_index, Some(vec![1, 5]));
    let text =
        "x,y,z\nNULL,NULL,NULL\n1,2,3\n1,-,3\n-1.#IND,0,0\n0,1.#INF00,0\n4,5,6\nn/a,NA,NaN\n";
    let cloud = told(text, None).unwrap();
    assert_eq!(cloud.input_index, Some(vec![1, 5]));
    assert_eq!(cloud.input_len, 7);
}

#[test]
fn errors_name_the_line() {
    let (format, line) = (Format::Xyz, 3);
    let text = "oops".to_string();
    assert_eq!(error("1 2 3\n\n4 oops 6"), FormatError::BadNumber { format, line, text });
    assert_eq!(
        error("# a\n1 2 3\n4 5"),
        FormatError::TooFewColumns { format, line, found: 2, needed: 3 }
    );
    assert_eq!(
        error("x y z\n\n4 5"),
        FormatError::TooFewColumns { format, line, found: 2, needed: 3 }
    );
    let limited =
        |max_points| read(b"1 2 3\n4 5 6\n7 8 9", &Hints::default(), &Limits::of(max_points));
    assert_eq!(limited(2), Err(FormatError::TooManyPoints { points: 3, limit: 2 }));
    assert!(limited(3).is_ok());
}

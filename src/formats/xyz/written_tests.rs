//! Tabs, quotes, titles, characters of two bytes and units: what programs write beside plain rows.

use super::{
    tests::{TWO, error, points, told},
    *,
};
use crate::{
    formats::{Columns, Limits},
    geometry::LengthUnit,
};

#[test]
fn tabs_part_fields_without_anything_in_them() {
    for text in [
        "Point ID\tX (m)\tY (m)\tZ (m)\nP 1\t1\t2\t3\nP 2\t-4.5\t0.5\t6\n",
        "n\tcode\tx\ty\tz\n1\t\t1\t2\t3\n2\tTREE\t-4.5\t0.5\t6\n",
        "\tx\ty\tz\n0\t1\t2\t3\n1\t-4.5\t0.5\t6\n",
        "Name\tX\tY\tZ\n\"A\tB\"\t1,0\t2,0\t3,0\nC\t-4,5\t0,5\t6,0\n",
        // tabs for the looks of it
        "1\t\t2\t\t3\n-4.5\t\t0.5\t\t6\n",
        "1 2\t3\n-4.5\t0.5 6\n",
        "1.0\t\t2.0\t3.0\n-4.5\t0.5\t\t6.0\n",
    ] {
        assert_eq!(points(text), TWO, "{text:?}");
    }
    // a value that is not there is no reason to take the next column for it
    let cloud = told("1\t2\t3\t9\n\t5\t6\t9\n7\t8\t\t9\n-4.5\t0.5\t6\t9\n", None).unwrap();
    assert_eq!(cloud.input_index, Some(vec![0, 3]));
}

#[test]
fn fields_in_quotes_may_hold_what_parts_fields() {
    for text in [
        "name,x,y,z\n\"a, b\",1,2,3\n\"c\",-4.5,0.5,6\n",
        "\"1,0\",\"2,0\",\"3,0\"\n\"-4,5\",\"0,5\",\"6,0\"\n",
        "name;x;y;z\n\"a;b\";1;2;3\n5\" bore;-4.5;0.5;6\n",
        "x|y|z\n1|2|3\n-4.5|0.5|6\n",
        "1 2 3\n-4.5 0.5 6\n\u{1a}\0\0",
    ] {
        assert_eq!(points(text), TWO, "{text:?}");
    }
}

#[test]
fn commas_in_quotes_that_may_mark_thousands_are_refused() {
    for text in
        ["\"12,345\",\"67,890\",\"1,234\"\n", "x,y,z\n\"12,345\",7,\"-1,234\"\n\"2,345\",8,9\n"]
    {
        let FormatError::Header { reason, .. } = error(text) else { panic!("{text}") };
        assert!(reason.contains("thousands"), "{reason}");
    }
    let found = points("\"12,345\",\"67,890\",\"0,234\"\n\"2,345\",\"7,890\",\"1,234\"\n");
    assert_eq!(found[1], [2.345, 7.89, 1.234]);
}

#[test]
fn lines_before_the_text_are_passed_over_where_the_sender_says_so() {
    let title = "Scan 1 2 3\n4 5 6 were the last\n\n7 8 9\n10\n".to_owned();
    let hints = Hints { skip_lines: 5, ..Hints::default() };
    for (rows, line) in [("1 2 3\n-4.5 0.5 6\n", 8), ("2\r\n1 2 3\r\n-4.5 0.5 6\r\n", 9)] {
        let told = |rows: &str| {
            crate::formats::read((title.clone() + rows).as_bytes(), hints, &Limits::default())
        };
        let cloud = told(rows).unwrap();
        assert_eq!(cloud.points.iter().map(|&p| p.into()).collect::<Vec<[f64; 3]>>(), TWO);
        // lines are counted from the file's first one
        let text = "oops".to_owned();
        let bad = FormatError::BadNumber { format: Format::Xyz, line, text };
        assert_eq!(told(&format!("{rows}4 oops 6\n")).unwrap_err(), bad);
    }
    // a node file without its first line
    let node = "3 3 0 0\n1 0.1 0.2 0.3\n2 1 2 3\n3 4 5 6\n";
    let columns = Columns::new([2, 3, 4]);
    let hints = Hints { skip_lines: 1, columns, ..Hints::default() };
    let cloud = crate::formats::read(node.as_bytes(), hints, &Limits::default()).unwrap();
    assert_eq!(cloud.points[2], Vec3::new(4.0, 5.0, 6.0));
    let all = Hints { skip_lines: 9, ..Hints::default() };
    let none = crate::formats::read(node.as_bytes(), all, &Limits::default());
    assert_eq!(none, Err(FormatError::NoPoints { format: Format::Xyz }));
    let ply = Hints { format: Some(Format::Ply), skip_lines: 1, ..Hints::default() };
    let parameter = "skip_lines";
    assert_eq!(
        crate::formats::read(b"ply\n", ply, &Limits::default()),
        Err(FormatError::ParameterOfText { parameter, format: Format::Ply })
    );
}

#[test]
fn a_text_of_two_bytes_a_character_is_read() {
    let text = "\u{feff}Höhe\tx\ty\tz\r\n7\t1\t2\t3\r\n7\t-4,5\t0,5\t6\r\n";
    let (low, high): (Vec<u8>, Vec<u8>) = (
        text.encode_utf16().flat_map(u16::to_le_bytes).collect(),
        text.encode_utf16().flat_map(u16::to_be_bytes).collect(),
    );
    for bytes in [low, high] {
        for format in [None, Some(Format::Xyz)] {
            let cloud = crate::formats::read(&bytes, format, &Limits::default()).unwrap();
            assert_eq!(cloud.points.iter().map(|&p| p.into()).collect::<Vec<[f64; 3]>>(), TWO);
            assert!(crate::formats::announced_points(&bytes, format) >= 2);
        }
    }
}

#[test]
fn the_unit_is_the_one_that_the_names_of_the_coordinates_state() {
    for (text, unit) in [
        ("X [mm] Y [mm] Z [mm]\n1 2 3\n", Some(LengthUnit::Mm)),
        ("x;y;z\n[mm];[mm];[mm]\n1;2;3\n", Some(LengthUnit::Mm)),
        ("x;y;z\nin;in;in\n1;2;3\n", Some(LengthUnit::In)),
        ("id,Easting (m),Northing (m),Height (m)\n1,1,2,3\n", Some(LengthUnit::M)),
        ("# x_cm y_cm z_cm\n1 2 3\n", Some(LengthUnit::Cm)),
        ("x [m],y [m],z [mm]\n1,2,3\n", None),
        ("x,y,z,t [mm]\n1,2,3,4\n", None),
        ("1 2 3\n", None),
    ] {
        assert_eq!(told(text, None).unwrap().unit, unit, "{text}");
    }
}

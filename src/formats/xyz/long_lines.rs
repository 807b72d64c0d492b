//! Lines that are long, wide or many, and callers who lose interest in them.

use std::sync::atomic::{AtomicUsize, Ordering};

use super::*;
use crate::formats::{Limits, Watched, announced_points, line::MAX_LINE_BYTES};

fn told(text: &str) -> Result<Vec<[f64; 3]>, FormatError> {
    let cloud = read(text.as_bytes(), &Hints::default(), &Limits::default())?;
    Ok(cloud.points.iter().map(|&p| p.into()).collect())
}

fn wide(line: usize) -> Result<Vec<[f64; 3]>, FormatError> {
    Err(FormatError::LongLine { line, most: 1000, of: "columns" })
}

fn long(line: usize) -> Result<Vec<[f64; 3]>, FormatError> {
    Err(FormatError::LongLine { line, most: MAX_LINE_BYTES, of: "bytes" })
}

/// A line of so many fields, all of them the same behind the first three.
fn fields(three: [&str; 3], more: &str, columns: usize, separator: &str) -> String {
    let more = std::iter::repeat_n(more, columns - 3);
    three.into_iter().chain(more).collect::<Vec<_>>().join(separator) + "\n"
}

fn row(columns: usize, separator: &str) -> String {
    fields(["1.5", "2.5", "3.5"], "7", columns, separator)
}

const POINT: [f64; 3] = [1.5, 2.5, 3.5];

#[test]
fn rows_have_a_thousand_columns_and_no_more() {
    for separator in [" ", ",", ";", "\t"] {
        let (most, more) = (row(1000, separator), row(1001, separator));
        assert_eq!(told(&most.repeat(2)), Ok(vec![POINT; 2]), "{separator:?}");
        assert_eq!(told(&more), wide(1), "{separator:?}");
        assert_eq!(told(&format!("{most}{more}")), wide(2), "{separator:?}");
        // behind the lines that show the layout
        let far = row(3, separator).repeat(1500);
        assert_eq!(told(&format!("{far}{more}")), wide(1501), "{separator:?}");
    }
    // fields without anything in them are columns too
    assert_eq!(told(&format!("1.5,2.5,3.5{}\n", ",".repeat(997))), Ok(vec![POINT]));
    assert_eq!(told(&format!("1.5,2.5,3.5{}\n", ",".repeat(998))), wide(1));
}

#[test]
fn a_line_of_names_has_a_thousand_and_no_more() {
    let names = |columns, separator| fields(["z", "y", "x"], "a", columns, separator);
    for separator in [" ", ",", ";"] {
        let rows = fields(["3.5", "2.5", "1.5"], "7", 1000, separator);
        let named = format!("{}{rows}", names(1000, separator));
        assert_eq!(told(&named), Ok(vec![POINT]), "{separator:?}");
        assert_eq!(told(&format!("{}{rows}", names(1001, separator))), wide(1), "{separator:?}");
        // parted in another way than the rows
        assert_eq!(told(&format!("{}{}", names(1001, ";"), row(1000, " "))), wide(1));
    }
    // their units are no columns
    let units = names(1000, " [m] ");
    assert_eq!(told(&format!("{units}{}", row(1000, " "))), Ok(vec![[3.5, 2.5, 1.5]]));
    // a comment with more says nothing
    assert_eq!(told(&format!("# {}{}", names(1001, " "), row(1000, " "))), Ok(vec![POINT]));
    assert_eq!(told(&format!("# {}{}", names(3, " "), row(3, " "))), Ok(vec![[3.5, 2.5, 1.5]]));
}

#[test]
fn a_line_has_sixty_four_kibibytes_and_no_more() {
    let of = |bytes: usize| format!("1.5;2.5;3.5;{}\n", "a".repeat(bytes - 12));
    assert_eq!(told(&of(MAX_LINE_BYTES)), Ok(vec![POINT]));
    assert_eq!(told(&of(MAX_LINE_BYTES + 1)), long(1));
    let far = row(3, ";").repeat(1500);
    assert_eq!(told(&format!("{far}{}", of(MAX_LINE_BYTES + 1))), long(1501));
    // twenty of them show how the text is written as well as a thousand short ones
    let text = "1,5;2,5;3,5;".to_owned() + &"a".repeat(60_000) + "\n";
    assert_eq!(told(&text.repeat(30)), Ok(vec![POINT; 30]));
}

#[test]
fn megabytes_in_one_line_are_refused_at_once() {
    let rows = "1 2 3\n4 5 6\n7 8 10\n";
    for (field, bytes) in [("1 ", 4 << 20), ("x ", 1 << 20), ("x,", 1 << 20), ("y;", 1 << 20)] {
        let line = field.repeat(bytes / 2);
        for text in [line.clone(), format!("{line}\n{rows}")] {
            assert_eq!(told(&text), long(1), "{field}");
            assert!(announced_points(text.as_bytes(), Some(Format::Xyz)) <= 4);
            assert!(matches!(Format::detect(text.as_bytes()), None | Some(Format::Xyz)));
        }
        // and passed over where it is a comment
        let passed = told(&format!("#{line}\n{rows}#{line}"));
        assert_eq!(passed.map(|points| points.len()), Ok(3), "{field}");
        // lines as long as they may be, as many as there is room for
        let most = field.repeat(MAX_LINE_BYTES / 2);
        assert_eq!(told(&format!("{most}\n{most}\n{rows}")), wide(1), "{field}");
        let passed = told(&format!("{}{rows}", format!("#{}\n", &most[2..]).repeat(40)));
        assert_eq!(passed.map(|points| points.len()), Ok(3), "{field}");
    }
}

#[test]
fn any_number_of_comments_may_stand_before_the_points() {
    for comments in [999, 1000, 1001, 200_000] {
        assert_eq!(told(&format!("{}{}", "#\n".repeat(comments), row(3, " "))), Ok(vec![POINT]));
    }
}

/// The error of a caller who loses interest after some looks, and how often it was asked.
fn stopped_after(looks: usize, text: &str) -> (Option<FormatError>, usize) {
    let asked = AtomicUsize::new(0);
    let stopped = || asked.fetch_add(1, Ordering::Relaxed) >= looks;
    let watched = Watched { limits: Limits::default(), stopped: &stopped };
    let error = read(text.as_bytes(), &Hints::default(), &watched).err();
    (error, asked.into_inner())
}

#[test]
fn a_stopped_run_stops_while_the_layout_is_told() {
    // no point is reached: each look is one of the layout's
    for text in ["1 2\n".repeat(3), "x y z\n".repeat(900), "#\n".repeat(100_000)] {
        for looks in 0..2 {
            let told = stopped_after(looks, &text);
            assert_eq!(told, (Some(FormatError::Stopped), looks + 1), "{}", &text[..4]);
        }
    }
}

#[test]
fn a_stopped_run_stops_among_comments_and_empty_lines_behind_the_points() {
    for passed in ["#\n", "\n", "# a long comment of many words\n"] {
        let text = format!("{}{}", row(3, " ").repeat(1000), passed.repeat(1_000_000));
        let all = stopped_after(usize::MAX, &text).1;
        assert!(all > passed.len() * 10, "{all}");
        let told = stopped_after(all - 1, &text);
        assert_eq!(told, (Some(FormatError::Stopped), all));
    }
}

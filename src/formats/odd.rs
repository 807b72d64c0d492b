//! Fields that are no number and look like one.

/// No-break and narrow blanks, as spreadsheets and web pages put between digits.
const BLANKS: [&[u8]; 4] = [b"\xc2\xa0", b"\xe2\x80\xaf", b"\xe2\x80\x89", b"\xe2\x80\x87"];

/// What to do about a field that is no number: `None` where nothing is known of it.
pub(super) fn cure(field: &[u8]) -> Option<&'static str> {
    let has = |what: &[u8]| field.windows(what.len()).any(|part| part == what);
    if !field.iter().any(u8::is_ascii_digit) {
        None
    } else if BLANKS.into_iter().any(has) {
        Some(
            "it has no-break blanks (U+00A0 or the like): replace them by plain ones between numbers, and leave \
             them out within",
        )
    } else if has(b"'") || has(b"\xe2\x80\x99") || (has(b",") && has(b".")) {
        Some(
            "marks of thousands, or commas beside points: write numbers without marks of thousands, and part them \
             all in the same way",
        )
    } else if has(b"\xe2\x88\x92") || has(b"\xe2\x80\x93") {
        Some("it has a typeset minus sign: write the plain one, -")
    } else if field.trim_ascii().iter().any(u8::is_ascii_whitespace) {
        Some(
            "several numbers: part all of them in the same way, by blanks, commas or semicolons alone",
        )
    } else {
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_with_marks_in_them_are_told_from_words() {
        for (field, begins) in [
            ("1\u{a0}234,5", "it has no-break"),
            ("-0.1\u{202f}0.2", "it has no-break"),
            ("694'376.195", "marks of"),
            ("694\u{2019}376", "marks of"),
            ("1,234.5", "marks of"),
            ("0.5 0.7", "several"),
            ("\u{2212}0.5", "it has a typeset"),
        ] {
            assert!(cure(field.as_bytes()).is_some_and(|cure| cure.starts_with(begins)), "{field}");
        }
        for field in ["oops", "P1", "12a", "", "it's"] {
            assert_eq!(cure(field.as_bytes()), None, "{field}");
        }
    }
}

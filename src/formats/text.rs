//! Pieces of text that several formats share.

use super::{Format, FormatError, error::excerpt};

/// `bytes` without the mark that some editors put before UTF-8 text.
pub(super) fn without_bom(bytes: &[u8]) -> &[u8] {
    bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes)
}

/// Whether a mark at its start says that a text has two bytes a character.
pub(super) fn is_utf16(bytes: &[u8]) -> bool {
    bytes.starts_with(b"\xff\xfe") || bytes.starts_with(b"\xfe\xff")
}

/// A text of two bytes a character in UTF-8; `None` where no mark at its start says that it is one.
pub(super) fn from_utf16(bytes: &[u8]) -> Option<Vec<u8>> {
    let unit = match bytes.first_chunk()? {
        [0xff, 0xfe] => u16::from_le_bytes,
        [0xfe, 0xff] => u16::from_be_bytes,
        _ => return None,
    };
    let units = bytes[2..].chunks_exact(2).map(|pair| unit([pair[0], pair[1]]));
    let known = |c: Result<char, _>| c.unwrap_or(char::REPLACEMENT_CHARACTER);
    Some(char::decode_utf16(units).map(known).collect::<String>().into_bytes())
}

/// The text behind its first lines.
pub(super) fn behind_lines(bytes: &[u8], lines: usize) -> &[u8] {
    let end = line_end(bytes);
    let mut ends = bytes.iter().enumerate().filter(|(_, b)| **b == end).map(|(at, _)| at + 1);
    match lines.checked_sub(1) {
        None => bytes,
        Some(last) => ends.nth(last).and_then(|at| bytes.get(at..)).unwrap_or_default(),
    }
}

/// A text without the end-of-file mark and the padding of older systems.
pub(super) fn without_end_mark(bytes: &[u8]) -> &[u8] {
    let end = bytes.iter().rposition(|b| !matches!(b, 0 | 0x1a)).map_or(0, |at| at + 1);
    &bytes[..end]
}

/// A line without the blanks around it; tabs stay, which may part fields without anything in them.
pub(super) fn without_blanks(line: &[u8]) -> &[u8] {
    let is_kept = |b: &u8| *b == b'\t' || !b.is_ascii_whitespace();
    let begin = line.iter().position(is_kept).unwrap_or(line.len());
    let end = line.iter().rposition(is_kept).map_or(begin, |at| at + 1);
    &line[begin..end]
}

/// The lines of a text, ended by LF, by CR LF (then the CR stays), or by CR where the text has no LF.
pub(super) fn lines(bytes: &[u8]) -> impl Iterator<Item = &[u8]> {
    let end = line_end(bytes);
    bytes.split(move |&b| b == end)
}

/// What ends the lines of a text.
fn line_end(bytes: &[u8]) -> u8 {
    if bytes.contains(&b'\n') { b'\n' } else { b'\r' }
}

/// Whether a trimmed line is a comment of the kinds met in text clouds.
pub(super) fn is_comment(line: &[u8]) -> bool {
    (line.starts_with(b"#") && !is_table_error(line))
        || line.starts_with(b"//")
        || line.starts_with(b"%")
}

/// Whether a field, or the line that begins with it, is what tables show for a value that is not there.
pub(super) fn is_table_error(field: &[u8]) -> bool {
    const ERRORS: [&[u8]; 7] =
        [b"#N/A", b"#NV", b"#VALUE!", b"#WERT!", b"#DIV/0!", b"#NUM!", b"#REF!"];
    ERRORS.iter().any(|error| field.starts_with(error))
}

/// How many lines a text has.
pub(super) fn line_count(bytes: &[u8]) -> u64 {
    let end = line_end(bytes);
    let ends = bytes.iter().filter(|&&b| b == end).count() as u64;
    // the last line may go without
    ends + u64::from(bytes.last().is_some_and(|&b| b != end))
}

/// Whether a line has three numbers or more, separated in any usual way.
pub(super) fn is_row(line: &[u8]) -> bool {
    let separator = |b: &u8| b.is_ascii_whitespace() || matches!(b, b',' | b';' | b'|');
    let is_number = |field: &&[u8]| {
        // a number in quotes may have been parted at its own comma
        let field = field.strip_prefix(b"\"").unwrap_or(field);
        let field = field.strip_suffix(b"\"").unwrap_or(field);
        number(field).or_else(|| rare_number(field)).is_some()
    };
    line.split(separator).filter(is_number).count() >= 3
}

/// A field without the quotes around it.
pub(super) fn unquoted(field: &[u8]) -> &[u8] {
    field.strip_prefix(b"\"").and_then(|f| f.strip_suffix(b"\"")).unwrap_or(field)
}

/// The number in a field as Fortran (`1.0D+00`) and older C libraries of Windows (`-1.#IND`, `1.#INF`)
/// write it.
pub(super) fn rare_number(field: &[u8]) -> Option<f64> {
    if field.len() > 64 {
        return None;
    }
    let digits = field.strip_prefix(b"-").unwrap_or(field);
    // as newer ones write the same
    if digits.len() > 5 && digits[..4].eq_ignore_ascii_case(b"nan(") {
        return Some(f64::NAN);
    }
    if !field.last()?.is_ascii_alphanumeric() {
        return None;
    }
    if let Some(special) = digits.strip_prefix(b"1.#") {
        let begins = |word: &&[u8]| special.starts_with(word);
        return match [&b"INF"[..], b"IND", b"QNAN", b"SNAN"].iter().position(begins)? {
            0 => Some(f64::INFINITY),
            _ => Some(f64::NAN),
        };
    }
    let digit = digits.iter().position(|b| matches!(b, b'd' | b'D')).filter(|at| *at > 0)?;
    if !digits[digit - 1].is_ascii_digit() && digits[digit - 1] != b'.' {
        return None;
    }
    let exponent = |&b: &u8| if matches!(b, b'd' | b'D') { b'e' } else { b };
    number(&field.iter().map(exponent).collect::<Vec<u8>>())
}

/// The number a field holds.
pub(super) fn number(field: &[u8]) -> Option<f64> {
    std::str::from_utf8(field).ok()?.parse().ok()
}

/// Words of an ascii body, separated by white space.
pub(super) struct Words<'a> {
    format: Format,
    bytes: &'a [u8],
    position: usize,
}

impl<'a> Words<'a> {
    /// The words of `bytes` from `position` on.
    pub(super) fn new(format: Format, bytes: &'a [u8], position: usize) -> Self {
        Self { format, bytes, position }
    }

    /// Bytes not yet read.
    pub(super) fn remaining(&self) -> usize {
        self.bytes.len() - self.position
    }

    /// The next word; `None` at the end.
    pub(super) fn next(&mut self) -> Option<&'a [u8]> {
        let rest = &self.bytes[self.position..];
        let start = rest.iter().position(|b| !b.is_ascii_whitespace())?;
        let word = &rest[start..];
        let end = word.iter().position(u8::is_ascii_whitespace).unwrap_or(word.len());
        self.position += start + end;
        Some(&word[..end])
    }

    /// The number that `word`, the last one read, holds.
    pub(super) fn number(&self, word: &[u8]) -> Result<f64, FormatError> {
        number(word).ok_or_else(|| self.bad_number(word))
    }

    /// The error for a `word`, the last one read, that is not the number it should be.
    pub(super) fn bad_number(&self, word: &[u8]) -> FormatError {
        let line = line_of(self.bytes, self.position - word.len());
        FormatError::BadNumber { format: self.format, line, text: excerpt(word) }
    }
}

/// The line, from 1, that the byte at `position` stands on.
pub(super) fn line_of(bytes: &[u8], position: usize) -> usize {
    1 + bytes[..position].iter().filter(|&&b| b == b'\n').count()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_line_with_anything_in_it_is_left_out_of_the_count() {
        for text in ["", "a", "a\n", "a\nb", "a\nb\r", "a\r\nb\r\n", "a\rb", "a\rb\r", "\n\na"] {
            let filled = lines(text.as_bytes()).filter(|line| !line.is_empty()).count() as u64;
            assert!(line_count(text.as_bytes()) >= filled, "{text:?}");
        }
    }
}

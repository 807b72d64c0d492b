//! Pieces of text that several formats share.

use super::{Format, FormatError, error::excerpt};

/// `bytes` without the mark that some editors put before UTF-8 text.
pub(super) fn without_bom(bytes: &[u8]) -> &[u8] {
    bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes)
}

/// The lines of a text, ended by LF, by CR LF (then the CR stays), or by CR where the text has no LF.
pub(super) fn lines(bytes: &[u8]) -> impl Iterator<Item = &[u8]> {
    let end = if bytes.contains(&b'\n') { b'\n' } else { b'\r' };
    bytes.split(move |&b| b == end)
}

/// Whether a trimmed line is a comment of the kinds met in text clouds.
pub(super) fn is_comment(line: &[u8]) -> bool {
    line.starts_with(b"#") || line.starts_with(b"//") || line.starts_with(b"%")
}

/// Whether a line has three numbers or more, separated in any usual way.
pub(super) fn is_row(line: &[u8]) -> bool {
    let separator = |b: &u8| b.is_ascii_whitespace() || matches!(b, b',' | b';');
    line.split(separator).filter(|field| number(field).is_some()).count() >= 3
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

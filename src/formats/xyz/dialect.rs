//! How a line of text is parted into fields, and how its numbers are written.

use super::super::{Columns, text};

/// The most columns a line may have: those that the sender can name.
pub(super) const MAX_COLUMNS: usize = Columns::MAX as usize;

/// A line without the blanks around it, and its number in the file, from 1.
pub(super) type Line<'a> = (usize, &'a [u8]);

/// What stands between fields.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Separator {
    /// Any run of white space.
    Blank,
    /// One tab, comma, semicolon or bar.
    Byte(u8),
}

/// One way to write numbers in lines.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Dialect {
    separator: Separator,
    /// Whether the fraction begins with a comma; then it does nowhere begin with a point.
    decimal_comma: bool,
}

const COMMA: Dialect = Dialect { separator: Separator::Byte(b','), decimal_comma: false };
const BLANK: Dialect = Dialect { separator: Separator::Blank, decimal_comma: false };

/// All of them; of those that fit equally well, the first is meant.
pub(super) const DIALECTS: [Dialect; 9] = [
    Dialect { separator: Separator::Byte(b';'), decimal_comma: false },
    BLANK,
    COMMA,
    Dialect { separator: Separator::Byte(b';'), decimal_comma: true },
    Dialect { separator: Separator::Blank, decimal_comma: true },
    Dialect { separator: Separator::Byte(b'|'), decimal_comma: false },
    // in quotes
    Dialect { separator: Separator::Byte(b','), decimal_comma: true },
    Dialect { separator: Separator::Byte(TAB), decimal_comma: false },
    Dialect { separator: Separator::Byte(TAB), decimal_comma: true },
];

const TAB: u8 = b'\t';

impl Dialect {
    /// The dialect in which most of `lines` are rows of numbers, and of the most numbers: colours alone are
    /// some in any.
    pub(super) fn of<'a>(lines: impl Iterator<Item = &'a [u8]> + Clone) -> Self {
        let mut best = (0, 0, None);
        for dialect in DIALECTS {
            let counts = lines.clone().map(|line| dialect.numbers(line)).filter(|n| *n >= 3);
            let (rows, numbers) = counts.fold((0, 0), |(rows, all), n| (rows + 1, all + n));
            if (rows, numbers) > (best.0, best.1) {
                best = (rows, numbers, Some(dialect));
            }
        }
        if let Some(dialect) = best.2.filter(|dialect| dialect.parts_at_blanks()) {
            let tabs = Self { separator: Separator::Byte(TAB), ..dialect };
            return if tabs.parts_all(lines) { tabs } else { dialect };
        }
        // where no line is a row, its error should at least show the fields that were meant
        best.2.unwrap_or_else(|| {
            let has = |byte| lines.clone().next().is_some_and(|line| line.contains(&byte));
            let numbers = |dialect: &Self| lines.clone().map(|line| dialect.numbers(line)).sum();
            // semicolons part nothing else than numbers
            let fits = |d: &Self| !has(b';') || d.separator == Separator::Byte(b';');
            let most = DIALECTS
                .into_iter()
                .filter(fits)
                .rev()
                .max_by_key(|dialect| -> usize { numbers(dialect) });
            match most.filter(|dialect| numbers(dialect) > 0) {
                Some(dialect) => dialect,
                None if has(b';') => DIALECTS[0],
                None if has(b',') => COMMA,
                None => BLANK,
            }
        })
    }

    /// Whether tabs part the fields of all rows: as many in each, one row without an empty field, and no field with
    /// several numbers.
    fn parts_all<'a>(self, lines: impl Iterator<Item = &'a [u8]> + Clone) -> bool {
        let blank = Self { separator: Separator::Blank, ..self };
        let mut rows = lines.filter(|line| blank.has_numbers(line)).map(|line| self.fields(line));
        let Some(first) = rows.next() else { return false };
        let (columns, mut whole) = (first.len(), false);
        for row in std::iter::once(first).chain(rows) {
            whole |= row.iter().all(|field| !field.is_empty());
            let several = |field: &&[u8]| blank.numbers(field) > 1;
            if row.len() != columns || columns < 3 || row.iter().any(several) {
                return false;
            }
        }
        whole
    }

    /// Whether blanks stand between fields.
    pub(super) fn parts_at_blanks(self) -> bool {
        self.separator == Separator::Blank
    }

    /// What a fraction begins with.
    pub(super) fn point(self) -> u8 {
        if self.decimal_comma { b',' } else { b'.' }
    }

    /// Calls `visit` with each field and its column until it says false.
    pub(super) fn each_field<'a>(
        self,
        line: &'a [u8],
        mut visit: impl FnMut(usize, &'a [u8]) -> bool,
    ) {
        match self.separator {
            Separator::Blank => {
                let fields = line.split(u8::is_ascii_whitespace).filter(|f| !f.is_empty());
                let _ = fields.enumerate().all(|(column, field)| visit(column, field));
            }
            Separator::Byte(byte) if are_quoted(line) => {
                let mut quoted = false;
                let parts = |b: &u8| {
                    quoted ^= *b == b'"';
                    *b == byte && !quoted
                };
                let mut fields = line.split(parts).enumerate();
                let _ = fields.all(|(column, field)| visit(column, field.trim_ascii()));
            }
            Separator::Byte(byte) => {
                let mut fields = line.split(|&b| b == byte).enumerate();
                let _ = fields.all(|(column, field)| visit(column, field.trim_ascii()));
            }
        }
    }

    /// The fields of a line; of more than [`MAX_COLUMNS`] the first, and one more.
    pub(super) fn fields(self, line: &[u8]) -> Vec<&[u8]> {
        let mut fields = Vec::new();
        self.each_field(line, |_, field| {
            fields.push(field);
            fields.len() <= MAX_COLUMNS
        });
        fields
    }

    /// Whether a line has more than [`MAX_COLUMNS`] fields.
    pub(super) fn is_wide(self, line: &[u8]) -> bool {
        // each field but the last has a separator behind it
        let mut wide = false;
        if line.len() >= MAX_COLUMNS {
            self.each_field(line, |column, _| {
                wide = column >= MAX_COLUMNS;
                !wide
            });
        }
        wide
    }

    /// The first field of a line; empty where there is none.
    pub(super) fn first(self, line: &[u8]) -> &[u8] {
        let mut first = None;
        self.each_field(line, |_, field| {
            first = Some(field);
            false
        });
        first.unwrap_or_default()
    }

    /// How many fields of a line are numbers, those of missing values apart.
    fn numbers(self, line: &[u8]) -> usize {
        let mut numbers = 0;
        self.each_field(line, |_, field| {
            numbers += usize::from(self.number(text::unquoted(field)).is_some());
            true
        });
        numbers
    }

    /// Whether three fields of a line are numbers.
    pub(super) fn has_numbers(self, line: &[u8]) -> bool {
        self.numbers(line) >= 3
    }

    /// The number a field holds, NaN for a missing value; `None` where it is none.
    pub(super) fn value(self, field: &[u8]) -> Option<f64> {
        if !self.decimal_comma
            && let Some(value) = text::number(field)
        {
            return Some(value);
        }
        let field = text::unquoted(field);
        self.number(field).or_else(|| is_missing(field).then_some(f64::NAN))
    }

    fn number(self, field: &[u8]) -> Option<f64> {
        if !self.decimal_comma {
            return text::number(field).or_else(|| text::rare_number(field));
        }
        if field.contains(&b'.') {
            return None;
        }
        let point = |&b: &u8| if b == b',' { b'.' } else { b };
        let with_point: Vec<u8> = field.iter().map(point).collect();
        text::number(&with_point).or_else(|| text::rare_number(&with_point))
    }

    /// Whether it cannot be told if the commas within the quoted numbers of rows mark thousands or fractions: three digits
    /// stand behind each.
    pub(super) fn may_be_thousands(self, rows: &[Line]) -> bool {
        let may_be = |field: &[u8]| {
            let field = text::unquoted(field);
            let digits = field.strip_prefix(b"-").unwrap_or(field);
            let behind = digits.iter().position(|b| *b == b',').map(|at| (at, digits.len() - at));
            behind
                .is_none_or(|(at, behind)| behind == 4 && digits[0] != b'0' && (1..4).contains(&at))
        };
        let all_may_be = |line: &[u8]| {
            let mut all = true;
            self.each_field(line, |_, field| {
                all = self.number(text::unquoted(field)).is_none() || may_be(field);
                all
            });
            all
        };
        self.separator == Separator::Byte(b',')
            && self.decimal_comma
            && rows.iter().all(|(_, line)| all_may_be(line))
    }

    /// Whether it cannot be told if the commas of a line part numbers or are in them: some have a blank
    /// behind them, others have not, and no number has a point.
    pub(super) fn is_unsure(self, line: &[u8]) -> bool {
        let mut after = line.windows(2).filter(|pair| pair[0] == b',').map(|pair| pair[1]);
        let blank = after.clone().any(|b| b.is_ascii_whitespace());
        self == COMMA
            && blank
            && after.any(|b| b.is_ascii_digit())
            && !line.contains(&b'.')
            && !are_quoted(line)
    }
}

/// Whether a line has fields in quotes, each of which ends.
fn are_quoted(line: &[u8]) -> bool {
    let quotes = line.iter().filter(|b| **b == b'"').count();
    quotes > 0 && quotes.is_multiple_of(2)
}

/// Whether a field without its quotes stands for a value that is not there.
fn is_missing(field: &[u8]) -> bool {
    if text::is_table_error(field) {
        return true;
    }
    const WORDS: [&[u8]; 7] = [b"", b"-", b"na", b"n/a", b"null", b"none", b"nil"];
    WORDS.iter().any(|word| field.eq_ignore_ascii_case(word))
}

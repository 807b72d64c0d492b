use super::{Format, Meshes, ptx};

/// What the sender knows of the bytes; all of it may be absent.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Hints {
    /// The format; told from the bytes when absent.
    pub format: Option<Format>,
    /// Lines before a text begins that are not looked at.
    pub skip_lines: usize,
    /// Which columns of text are x, y and z; told from their names, or their place, when absent.
    pub columns: Option<Columns>,
    /// How a mesh is read.
    pub meshes: Meshes,
    /// The least distance of the points that are kept; all are when absent.
    pub thin: Option<f64>,
}

impl From<Option<Format>> for Hints {
    fn from(format: Option<Format>) -> Self {
        Self { format, ..Self::default() }
    }
}

impl Hints {
    /// The most lines that may be passed over: those of a long protocol before a scan.
    pub const MAX_SKIP_LINES: u64 = 1_000_000;

    /// The same for all points.
    pub fn whole(self) -> Self {
        Self { thin: None, ..self }
    }

    /// The format that bytes are read as: the one named, or the one that they show. `None` where they show none.
    pub fn format_of(&self, bytes: &[u8]) -> Option<Format> {
        // who names columns or lines to pass over has a text
        let text = self.columns.is_some() || self.skip_lines > 0;
        match self.format {
            Some(Format::Xyz) if !text && ptx::begins(bytes) => Some(Format::Ptx),
            None => Format::detect(bytes).or(text.then_some(Format::Xyz)),
            named => named,
        }
    }
}

/// Three different columns of text.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Columns([usize; 3]);

impl Columns {
    /// The last column that may be named.
    pub const MAX: u64 = 1000;

    /// The columns of x, y and z, counted from 1; `None` where one is 0, above [`Columns::MAX`] or there
    /// twice.
    pub fn new(numbers: [u64; 3]) -> Option<Self> {
        let [x, y, z] = numbers;
        let fits = numbers.iter().all(|n| (1..=Self::MAX).contains(n));
        let places = numbers.map(|n| usize::try_from(n).map_or(0, |n| n.saturating_sub(1)));
        (fits && x != y && y != z && z != x).then_some(Self(places))
    }

    /// Their places in a line, counted from 0.
    pub(super) fn places(self) -> [usize; 3] {
        self.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_are_three_different_numbers_from_one_to_the_cap() {
        assert_eq!(Columns::new([2, 3, 1000]).unwrap().places(), [1, 2, 999]);
        for wrong in [[0, 1, 2], [1, 2, 1001], [1, 1, 2], [1, 2, 1], [2, 1, 1]] {
            assert_eq!(Columns::new(wrong), None, "{wrong:?}");
        }
    }
}

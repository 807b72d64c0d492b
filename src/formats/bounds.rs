use std::fmt;

use super::FormatError;

/// What a reader asks as it goes, from whatever thread it runs in.
pub trait Bounds: Sync {
    /// Whether there may be that many points, those with NaN coordinates included.
    ///
    /// # Errors
    /// There are too many, or the cloud is not wanted any more.
    fn check(&self, points: u64) -> Result<(), FormatError>;

    /// The most points there may be.
    fn most(&self) -> u64;

    /// Bytes that thinning may take at most; more than any machine has, where nobody says.
    fn memory(&self) -> u64 {
        u64::MAX
    }

    /// Whether the cloud is still wanted.
    ///
    /// # Errors
    /// It is not.
    fn go_on(&self) -> Result<(), FormatError>;
}

/// How large an input may be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limits {
    /// Largest number of points, those with NaN coordinates included.
    pub max_points: usize,
    /// Bytes that thinning may take.
    pub max_thin_bytes: u64,
}

impl Limits {
    /// So many points, and whatever memory they take.
    pub const fn of(max_points: usize) -> Self {
        Self { max_points, max_thin_bytes: u64::MAX }
    }

    /// The same, with so many bytes at most for thinning.
    pub const fn with_thin_bytes(self, max_thin_bytes: u64) -> Self {
        Self { max_thin_bytes, ..self }
    }
}

impl Default for Limits {
    fn default() -> Self {
        Self::of(100_000_000)
    }
}

impl Bounds for Limits {
    fn check(&self, points: u64) -> Result<(), FormatError> {
        let limit = self.most();
        if points > limit {
            return Err(FormatError::TooManyPoints { points, limit: limit as usize });
        }
        Ok(())
    }

    fn most(&self) -> u64 {
        // input indices are 32-bit numbers, whatever the setting says
        self.max_points.min(u32::MAX as usize) as u64
    }

    fn memory(&self) -> u64 {
        self.max_thin_bytes
    }

    fn go_on(&self) -> Result<(), FormatError> {
        Ok(())
    }
}

/// Limits, and a caller who may lose interest while a long file is read.
pub struct Watched<'a> {
    /// The limits.
    pub limits: Limits,
    /// Whether the cloud is not wanted any more.
    pub stopped: &'a (dyn Fn() -> bool + Sync),
}

impl fmt::Debug for Watched<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Watched").field("limits", &self.limits).finish_non_exhaustive()
    }
}

/// Points read between two looks at whether to go on: about a millisecond of text.
const POINTS_A_LOOK: u64 = 4096;

impl Bounds for Watched<'_> {
    fn check(&self, points: u64) -> Result<(), FormatError> {
        if points.is_multiple_of(POINTS_A_LOOK) {
            self.go_on()?;
        }
        self.limits.check(points)
    }

    fn most(&self) -> u64 {
        self.limits.most()
    }

    fn memory(&self) -> u64 {
        self.limits.memory()
    }

    fn go_on(&self) -> Result<(), FormatError> {
        if (self.stopped)() { Err(FormatError::Stopped) } else { Ok(()) }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicUsize, Ordering};

    use super::*;
    use crate::formats::{Format, read};

    #[test]
    fn reading_stops_soon_after_the_caller_has_lost_interest() {
        let text = "1 2 3\n".repeat(100_000);
        let ply = format!(
            "ply\nformat ascii 1.0\nelement vertex 100000\nproperty float x\nproperty float y\n\
             property float z\nend_header\n{text}"
        );
        for bytes in [text.as_bytes(), ply.as_bytes()] {
            let looks = AtomicUsize::new(0);
            let stopped = || looks.fetch_add(1, Ordering::Relaxed) >= 2;
            let watched = Watched { limits: Limits::default(), stopped: &stopped };
            assert_eq!(read(bytes, None, &watched), Err(FormatError::Stopped));
            assert_eq!(looks.into_inner(), 3);
        }
        let watched = Watched { limits: Limits::default(), stopped: &|| false };
        assert_eq!(read(text.as_bytes(), Some(Format::Xyz), &watched).unwrap().input_len, 100_000);
    }
}

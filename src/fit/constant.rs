//! Numbers that decide: thresholds, prices, sample sizes, rounds.
//!
//! Each stands beside the code that it decides for, with what it means and why it is what it is, and can be scaled at
//! run time, so that what depends on it can be measured. Sizes of arrays, of pieces of parallel loops and the like,
//! which change no result, are plain `const`s.

use std::fmt;
use std::sync::atomic::{AtomicU64, Ordering};

/// Why a number is what it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Origin {
    /// It follows from something else; how.
    Derived(&'static str),
    /// It bounds work, and more of it is never worse; what it bounds.
    Effort(&'static str),
    /// Found by trial: results hold between these values.
    Trial(f64, f64),
}

impl fmt::Display for Origin {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Derived(how) => write!(f, "derived: {how}"),
            Self::Effort(what) => write!(f, "effort: {what}"),
            Self::Trial(from, to) => write!(f, "trial: holds from {from} to {to}"),
        }
    }
}

/// A number that decides.
pub struct Constant<T> {
    name: &'static str,
    meaning: &'static str,
    given: T,
    origin: Origin,
    /// The bits of the value in force.
    bits: AtomicU64,
}

impl Constant<f64> {
    /// A number called `name`, its path.
    pub const fn new(
        name: &'static str,
        meaning: &'static str,
        given: f64,
        origin: Origin,
    ) -> Self {
        Self { name, meaning, given, origin, bits: AtomicU64::new(given.to_bits()) }
    }

    /// The value in force.
    #[inline]
    pub fn get(&self) -> f64 {
        f64::from_bits(self.bits.load(Ordering::Relaxed))
    }
}

impl Constant<usize> {
    /// A number called `name`, its path.
    pub const fn new(
        name: &'static str,
        meaning: &'static str,
        given: usize,
        origin: Origin,
    ) -> Self {
        Self { name, meaning, given, origin, bits: AtomicU64::new(given as u64) }
    }

    /// The value in force.
    #[inline]
    pub fn get(&self) -> usize {
        self.bits.load(Ordering::Relaxed) as usize
    }
}

/// A constant of either type.
pub trait Adjustable: Sync {
    /// Its path in the crate.
    fn name(&self) -> &'static str;
    /// What it means.
    fn meaning(&self) -> &'static str;
    /// Why it is what it is.
    fn origin(&self) -> Origin;
    /// The value that it was declared with.
    fn given(&self) -> f64;
    /// The value in force.
    fn value(&self) -> f64;
    /// Puts `factor` times its declared value in force for all threads; 1 restores it. Whole numbers are rounded, and
    /// change by at least one, but not to zero, where the factor is not 1.
    fn scale(&self, factor: f64);
}

impl Adjustable for Constant<f64> {
    fn name(&self) -> &'static str {
        self.name
    }

    fn meaning(&self) -> &'static str {
        self.meaning
    }

    fn origin(&self) -> Origin {
        self.origin
    }

    fn given(&self) -> f64 {
        self.given
    }

    fn value(&self) -> f64 {
        self.get()
    }

    fn scale(&self, factor: f64) {
        self.bits.store((self.given * factor).to_bits(), Ordering::Relaxed);
    }
}

impl Adjustable for Constant<usize> {
    fn name(&self) -> &'static str {
        self.name
    }

    fn meaning(&self) -> &'static str {
        self.meaning
    }

    fn origin(&self) -> Origin {
        self.origin
    }

    fn given(&self) -> f64 {
        self.given as f64
    }

    fn value(&self) -> f64 {
        self.get() as f64
    }

    fn scale(&self, factor: f64) {
        let scaled = (self.given as f64 * factor).round() as usize;
        let least = self.given + 1;
        let most = self.given.saturating_sub(1);
        let value = match factor.total_cmp(&1.0) {
            std::cmp::Ordering::Less => scaled.min(most).max(1),
            std::cmp::Ordering::Equal => self.given,
            std::cmp::Ordering::Greater => scaled.max(least),
        };
        self.bits.store(value as u64, Ordering::Relaxed);
    }
}

/// Constants of one file, or of all files of a room.
pub type Table = &'static [&'static dyn Adjustable];

/// Declares the constants of a file, each as `NAME: type = value, origin;`, and `CONSTANTS`, the table of them.
macro_rules! constants {
    ($($(#[doc = $line:literal])+ $vis:vis $name:ident: $type:ty = $given:expr, $origin:ident($($of:expr),+);)+) => {
        $(
            $(#[doc = $line])+
            $vis static $name: $crate::fit::constant::Constant<$type> =
                $crate::fit::constant::Constant::<$type>::new(
                    concat!(module_path!(), "::", stringify!($name)),
                    concat!($($line),+),
                    $given,
                    $crate::fit::constant::Origin::$origin($($of),+),
                );
        )+

        /// The constants of this file.
        pub static CONSTANTS: $crate::fit::constant::Table = &[$(&$name),+];
    };
}

pub(crate) use constants;

#[cfg(test)]
mod tests {
    constants! {
        /// Apples.
        APPLES: usize = 3, Effort("what is eaten");
        /// Weight of one,
        /// in pounds.
        WEIGHT: f64 = 0.5, Trial(0.25, 1.0);
    }

    #[test]
    fn a_scaled_constant_is_seen_and_restored() {
        let [apples, weight] = CONSTANTS else { panic!("two are declared") };
        for (factor, expected) in [(0.8, 2), (1.25, 4), (0.1, 1), (4.0, 12), (1.0, 3)] {
            apples.scale(factor);
            assert_eq!(APPLES.get(), expected, "{factor}");
        }
        weight.scale(0.8);
        assert_eq!((WEIGHT.get(), weight.value(), weight.given()), (0.4, 0.4, 0.5));
        weight.scale(1.0);
        assert_eq!(WEIGHT.get(), 0.5);
    }

    #[test]
    fn a_constant_says_where_it_stands_what_it_means_and_why() {
        let [apples, weight] = CONSTANTS else { panic!("two are declared") };
        assert!(weight.name().ends_with("fit::constant::tests::WEIGHT"), "{}", weight.name());
        assert_eq!(weight.meaning(), " Weight of one, in pounds.");
        assert_eq!(apples.origin().to_string(), "effort: what is eaten");
        assert_eq!(weight.origin().to_string(), "trial: holds from 0.25 to 1");
    }
}

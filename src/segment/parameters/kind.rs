/// What kind of value a parameter takes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ParameterKind {
    /// One of these words.
    Choice(&'static [&'static str]),
    /// A comma-separated list of these words.
    List(&'static [&'static str]),
    /// A finite number in `min..=max`; `min` itself is excluded where it is zero.
    Number {
        /// Lower end.
        min: f64,
        /// Upper end.
        max: f64,
    },
    /// A whole number in `min..=max`.
    Integer {
        /// Lower end.
        min: u64,
        /// Upper end.
        max: u64,
    },
    /// `true` or `false`.
    Boolean,
    /// Three comma-separated numbers, not all zero.
    Direction,
    /// Three different comma-separated whole numbers in `1..=max`.
    Columns {
        /// Largest number.
        max: u64,
    },
    /// Up to so many different comma-separated ids of regions.
    Regions {
        /// Most of them.
        most: usize,
    },
    /// A JSON list of objects.
    Hints {
        /// Most of them.
        max: usize,
    },
    /// A text of one line, without control characters.
    Text {
        /// Most characters.
        max: usize,
    },
}

impl std::fmt::Display for ParameterKind {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Choice(words) => write!(f, "one of {}", words.join(", ")),
            Self::List(words) => write!(f, "a comma-separated list of {}", words.join(", ")),
            Self::Number { min, max } if *min == 0.0 => {
                write!(f, "a number above 0 and at most {max}")
            }
            Self::Number { min, max } => write!(f, "a number from {min} to {max}"),
            Self::Integer { min, max } => write!(f, "a whole number from {min} to {max}"),
            Self::Boolean => write!(f, "true or false"),
            Self::Direction => write!(f, "three numbers x,y,z, not all zero"),
            Self::Columns { max } => write!(f, "three different whole numbers from 1 to {max}"),
            Self::Regions { most } => write!(f, "one to {most} different region ids"),
            Self::Hints { max } => write!(f, "a JSON list of at most {max} hints"),
            Self::Text { max } => write!(f, "one line of at most {max} characters"),
        }
    }
}

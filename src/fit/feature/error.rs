use super::association::Association;
use super::kind::FeatureType;

/// Why no feature is fitted.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum FitError {
    /// A coordinate is not finite.
    #[error("point {index} has a coordinate that is not finite")]
    NotFinite {
        /// The point.
        index: usize,
    },
    /// All points are at one place.
    #[error("all points are at one place: give points that are apart")]
    OnePlace,
    /// Fewer points than determine the feature.
    #[error("{points} points do not determine {}: give at least {needed}", kind.with_article())]
    TooFew {
        /// The type.
        kind: FeatureType,
        /// How many there are.
        points: usize,
        /// How many it takes.
        needed: usize,
    },
    /// Too few points to tell what they are of.
    #[error("{points} points do not tell a type: name one, or give at least {needed} points")]
    TooFewForAuto {
        /// How many there are.
        points: usize,
        /// How many it takes.
        needed: usize,
    },
    /// The points are of no type.
    #[error("{}", no_type(fixed))]
    NoType {
        /// The values that are fixed, by name.
        fixed: Vec<&'static str>,
    },
    /// A value is to be fixed that the type does not have.
    #[error("{} has no {name} that can be fixed: leave it out", kind.with_article())]
    NotFixed {
        /// The type.
        kind: FeatureType,
        /// The value.
        name: &'static str,
    },
    /// The type has no such association.
    #[error("{} has no {} association: ask for gaussian", kind.with_article(), association.name())]
    NotAssociated {
        /// The type.
        kind: FeatureType,
        /// The association.
        association: Association,
    },
    /// A value is to be fixed of a feature that is none of least squares.
    #[error("values are fixed with the gaussian association alone: leave them out, or {} away", association.name())]
    FixedExtreme {
        /// The association.
        association: Association,
    },
    /// Nothing holds an inscribed feature.
    #[error(
        "the points lie to one side of {}: the largest inscribed one grows without bound. Give points from all \
         round, or ask for minimum_zone or gaussian",
        kind.with_article()
    )]
    NotHeld {
        /// The type.
        kind: FeatureType,
    },
    /// The search for an extreme feature came to no proven end.
    #[error(
        "no {} {} can be proven for these points: ask for gaussian, or give points that are spread over more of it",
        association.name(),
        kind.name()
    )]
    NotReached {
        /// The type.
        kind: FeatureType,
        /// The association.
        association: Association,
    },
    /// The points leave a combination of the degrees of freedom open.
    #[error(
        "the points do not determine {}: free is {directions}. Give points that are spread over more of it, or \
         fix a value",
        kind.with_article()
    )]
    Free {
        /// The type.
        kind: FeatureType,
        /// What is free, in words.
        directions: String,
    },
    /// The points lie such that many features of the type fit them.
    #[error("the points do not determine {}: give points that are spread over more of it", kind.with_article())]
    Undetermined {
        /// The type.
        kind: FeatureType,
    },
}

fn no_type(fixed: &[&str]) -> String {
    if fixed.is_empty() {
        return "no type of feature is told by the points: name one with type".to_owned();
    }
    let fixed = fixed.join(" and ");
    format!(
        "no type of feature with the given {fixed} is told by the points: leave {fixed} out, or give what they have, or name the \
         type"
    )
}

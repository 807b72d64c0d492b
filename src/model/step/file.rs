//! The text of a STEP file (ISO 10303-21): numbered entities.

use std::fmt::Write;

use crate::geometry::Vec3;

/// The number of an entity.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Id(pub usize);

impl std::fmt::Display for Id {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "#{}", self.0)
    }
}

/// The entities written so far.
#[derive(Default)]
pub struct Entities {
    text: String,
    count: usize,
}

impl Entities {
    /// Adds an entity: its name and parameters.
    pub fn add(&mut self, entity: &str) -> Id {
        self.count += 1;
        // Writing into a string does not fail.
        let _ = writeln!(self.text, "#{}={entity};", self.count);
        Id(self.count)
    }

    /// All of them, one a line.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// A point.
    pub fn point(&mut self, p: &Vec3) -> Id {
        self.add(&format!("CARTESIAN_POINT('',({},{},{}))", real(p.x), real(p.y), real(p.z)))
    }

    /// A direction.
    pub fn direction(&mut self, d: &Vec3) -> Id {
        self.add(&format!("DIRECTION('',({},{},{}))", real(d.x), real(d.y), real(d.z)))
    }

    /// A right-handed system: origin, z axis, and x axis.
    pub fn placement(&mut self, origin: &Vec3, z: &Vec3, x: &Vec3) -> Id {
        let (o, z, x) = (self.point(origin), self.direction(z), self.direction(x));
        self.add(&format!("AXIS2_PLACEMENT_3D('',{o},{z},{x})"))
    }
}

/// A real number with all its digits: the shortest text that reads back as the same.
pub fn real(x: f64) -> String {
    // No minus before nought.
    let text = format!("{:?}", if x == 0.0 { 0.0 } else { x });
    match text.split_once('e') {
        Some((digits, exponent)) if digits.contains('.') => format!("{digits}E{exponent}"),
        Some((digits, exponent)) => format!("{digits}.E{exponent}"),
        None => text,
    }
}

/// Reals in brackets.
pub fn reals(values: impl IntoIterator<Item = f64>) -> String {
    let all: Vec<String> = values.into_iter().map(real).collect();
    format!("({})", all.join(","))
}

/// References in brackets.
pub fn list(ids: impl IntoIterator<Item = Id>) -> String {
    let all: Vec<String> = ids.into_iter().map(|id| id.to_string()).collect();
    format!("({})", all.join(","))
}

/// A text between apostrophes, those within it doubled; what is not plain ASCII becomes a question mark.
pub fn string(text: &str) -> String {
    let plain = |c: char| if (' '..='~').contains(&c) && c != '\\' { c } else { '?' };
    format!("'{}'", text.chars().map(plain).collect::<String>().replace('\'', "''"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reals_have_a_point_and_read_back_as_the_same() {
        for x in
            [0.0, -0.0, 1.0, -2.5, 1e-7, 1e300, -1.5e-300, 0.1 + 0.2, 123_456_789.123_456_79, 1e16]
        {
            let text = real(x);
            assert!(text.split('E').next().unwrap().contains('.'), "{text}");
            assert_eq!(text.parse::<f64>().unwrap(), x, "{text}");
        }
        assert_eq!((real(1e-7), real(1e22)), ("1.E-7".into(), "1.E22".into()));
    }

    #[test]
    fn texts_are_quoted() {
        assert_eq!(string("it's 5 \u{b5}m"), "'it''s 5 ?m'");
    }
}

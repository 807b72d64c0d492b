use serde::{Deserialize, Serialize};

/// The unit of a cloud's lengths: it is stated, and nothing is ever converted to another.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize, utoipa::ToSchema)]
#[serde(rename_all = "lowercase")]
pub enum LengthUnit {
    /// Micrometre.
    Um,
    /// Millimetre.
    Mm,
    /// Centimetre.
    Cm,
    /// Metre.
    M,
    /// Kilometre.
    Km,
    /// Inch: 25.4 mm.
    In,
    /// International foot: 304.8 mm.
    Ft,
    /// Foot of surveys in the United States: 1200/3937 m.
    #[serde(rename = "us_ft")]
    UsFt,
}

impl LengthUnit {
    /// Every unit.
    pub const ALL: [Self; 8] =
        [Self::Um, Self::Mm, Self::Cm, Self::M, Self::Km, Self::In, Self::Ft, Self::UsFt];

    /// The name used in parameters and answers.
    pub fn name(self) -> &'static str {
        match self {
            Self::Um => "um",
            Self::Mm => "mm",
            Self::Cm => "cm",
            Self::M => "m",
            Self::Km => "km",
            Self::In => "in",
            Self::Ft => "ft",
            Self::UsFt => "us_ft",
        }
    }

    /// The unit of that name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|unit| unit.name() == name)
    }

    /// The unit that a word of a file's header stands for, in lower case: its sign or its name.
    pub fn from_word(word: &str) -> Option<Self> {
        match word {
            "um" | "µm" | "μm" | "micron" | "microns" | "micrometre" | "micrometer" => {
                Some(Self::Um)
            }
            "mm" | "millimetre" | "millimeter" | "millimetres" | "millimeters" => Some(Self::Mm),
            "cm" | "centimetre" | "centimeter" | "centimetres" | "centimeters" => Some(Self::Cm),
            "m" | "metre" | "meter" | "metres" | "meters" => Some(Self::M),
            "km" | "kilometre" | "kilometer" | "kilometres" | "kilometers" => Some(Self::Km),
            "in" | "inch" | "inches" => Some(Self::In),
            "ft" | "foot" | "feet" => Some(Self::Ft),
            "us_ft" | "usft" | "ftus" | "us-ft" | "us survey foot" => Some(Self::UsFt),
            _ => None,
        }
    }

    /// Millimetres it has.
    pub fn millimetres(self) -> f64 {
        match self {
            Self::Um => 1e-3,
            Self::Mm => 1.0,
            Self::Cm => 10.0,
            Self::M => 1e3,
            Self::Km => 1e6,
            Self::In => 25.4,
            Self::Ft => 304.8,
            Self::UsFt => 1_200_000.0 / 3937.0,
        }
    }
}

impl std::fmt::Display for LengthUnit {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Um => "µm",
            Self::UsFt => "US survey ft",
            other => other.name(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_read_back_from_their_names_in_texts_and_json() {
        for unit in LengthUnit::ALL {
            assert_eq!(LengthUnit::from_name(unit.name()), Some(unit));
            assert_eq!(LengthUnit::from_word(unit.name()), Some(unit));
            assert_eq!(serde_json::to_value(unit).unwrap(), unit.name());
        }
        assert_eq!(LengthUnit::from_name("furlong"), None);
        // 3937 US survey feet are 1200 m
        assert!((3937.0 * LengthUnit::UsFt.millimetres() - 1.2e6).abs() < 1e-9);
    }
}

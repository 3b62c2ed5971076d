//! Models of how diffuse light is distributed over the sky, and their names.

use std::fmt;
use std::str::FromStr;

use super::radiance::CieType;

/// How diffuse light is distributed over the sky.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SkyModel {
    /// The same radiance from everywhere.
    Uniform,
    /// Moon & Spencer 1942.
    MoonSpencer,
    /// A type of the CIE standard general sky.
    Cie(CieType),
    /// The all-weather sky of Perez, Seals & Michalsky 1993, by measured irradiances.
    Perez,
}

impl SkyModel {
    /// Whether there is no sun in it: the overcast skies, types 1 to 5 of the CIE among them.
    pub fn is_overcast(self) -> bool {
        match self {
            Self::Uniform | Self::MoonSpencer => true,
            Self::Cie(kind) => kind.number() <= 5,
            Self::Perez => false,
        }
    }
}

/// Names of skies, for messages.
pub const SKY_NAMES: &str =
    "perez, cie-1 to cie-15, clear (the same as cie-12), standard-overcast or uniform-overcast";

impl FromStr for SkyModel {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let cie = |number: &str| number.parse().ok().and_then(CieType::new).map(Self::Cie);
        let text = text.replace('_', "-");
        let found = match &text[..] {
            "perez" => Some(Self::Perez),
            "clear" => Some(Self::Cie(CieType::CLEAR)),
            "standard-overcast" => Some(Self::MoonSpencer),
            "uniform-overcast" => Some(Self::Uniform),
            _ => text.strip_prefix("cie-").and_then(cie),
        };
        found.ok_or_else(|| format!("expected {SKY_NAMES}"))
    }
}

impl fmt::Display for SkyModel {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Uniform => f.write_str("uniform-overcast"),
            Self::MoonSpencer => f.write_str("standard-overcast"),
            Self::Cie(kind) => write!(f, "cie-{}", kind.number()),
            Self::Perez => f.write_str("perez"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_name_is_read_as_it_is_written() {
        let cie = (1..=15).map(|n| SkyModel::Cie(CieType::new(n).unwrap()));
        let others = [SkyModel::Perez, SkyModel::MoonSpencer, SkyModel::Uniform];
        for model in cie.chain(others) {
            assert_eq!(model.to_string().parse(), Ok(model));
        }
        assert_eq!("clear".parse(), Ok(SkyModel::Cie(CieType::CLEAR)));
        assert_eq!("uniform_overcast".parse(), Ok(SkyModel::Uniform));
        for text in ["cie-0", "cie-16", "cie", "", "Perez"] {
            assert!(text.parse::<SkyModel>().is_err(), "{text}");
        }
    }
}

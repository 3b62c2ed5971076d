//! How to solve: what the command line and the scene file may both say.

use std::fmt;
use std::str::FromStr;

use glam::DVec3;
use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::threads::MOST_THREADS;

/// Memory that a solve may take where nothing is said, GiB.
pub const DEFAULT_MEMORY_GIB: f64 = 8.0;

/// The options of a solve, each of them optional: the defaults are the plan's.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Options {
    /// Diameter of the sphere within which exchange is computed on the true geometry.
    pub diameter: Option<Diameter>,
    /// Error to aim at, percent of an organ's absorbed power; above 0.
    #[serde(rename = "accuracy_percent")]
    pub accuracy_percent: Option<f64>,
    /// Memory that a solve may take, GiB; above 0.
    #[serde(rename = "memory_GiB")]
    pub memory_GiB: Option<f64>,
    /// Threads to compute with; 0 for as many as the machine has.
    pub threads: Option<usize>,
    /// Seed of all random choices.
    pub seed: Option<u64>,
    /// Whether light is followed after it was scattered.
    pub scatter: Option<Scatter>,
    /// Form of the result tables.
    pub format: Option<TableFormat>,
    /// Write a file for ParaView too.
    pub vtp: Option<bool>,
}

impl Options {
    /// These options where they say something, the others elsewhere.
    #[must_use]
    pub fn over(self, other: Self) -> Self {
        Self {
            diameter: self.diameter.or(other.diameter),
            accuracy_percent: self.accuracy_percent.or(other.accuracy_percent),
            memory_GiB: self.memory_GiB.or(other.memory_GiB),
            threads: self.threads.or(other.threads),
            seed: self.seed.or(other.seed),
            scatter: self.scatter.or(other.scatter),
            format: self.format.or(other.format),
            vtp: self.vtp.or(other.vtp),
        }
    }

    /// Refuses an accuracy or a memory that is not above zero, and more threads than any machine has.
    pub fn check(&self) -> Result<(), OptionFault> {
        for (name, value) in [
            ("accuracy", self.accuracy_percent),
            ("memory", self.memory_GiB),
        ] {
            value.map_or(Ok(0.0), |value| above_zero(name, value))?;
        }
        if let Some(threads) = self.threads
            && threads > MOST_THREADS
        {
            return Err(OptionFault {
                option: "threads",
                expected: "a whole number from 0 to 4096",
                found: threads.to_string(),
            });
        }
        Ok(())
    }
}

/// Refuses what is not a finite number above zero: every option that is a measure.
pub fn above_zero(option: &'static str, value: f64) -> Result<f64, OptionFault> {
    if value.is_finite() && value > 0.0 {
        return Ok(value);
    }
    Err(OptionFault {
        option,
        expected: "a number above 0",
        found: value.to_string(),
    })
}

/// An option that cannot be.
#[derive(Clone, Debug, Error, PartialEq)]
#[error("{option}: expected {expected}, found {found}")]
pub struct OptionFault {
    /// Its name.
    pub option: &'static str,
    /// What it may be.
    pub expected: &'static str,
    /// What it was.
    pub found: String,
}

/// The unit of length of geometry, pattern and soil height in the user's files.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Unit {
    /// Metres.
    #[default]
    #[serde(rename = "m")]
    Metre,
    /// Centimetres.
    #[serde(rename = "cm")]
    Centimetre,
    /// Millimetres.
    #[serde(rename = "mm")]
    Millimetre,
}

impl Unit {
    /// How many of it make a metre. Divide by this: unlike a product with 0.01, the quotient is the
    /// double that is nearest to the true length.
    pub fn per_metre(self) -> f64 {
        match self {
            Self::Metre => 1.0,
            Self::Centimetre => 100.0,
            Self::Millimetre => 1000.0,
        }
    }
}

impl FromStr for Unit {
    type Err = OptionFault;

    fn from_str(text: &str) -> Result<Self, OptionFault> {
        match text {
            "m" => Ok(Self::Metre),
            "cm" => Ok(Self::Centimetre),
            "mm" => Ok(Self::Millimetre),
            _ => Err(OptionFault {
                option: "unit",
                expected: "m, cm or mm",
                found: text.to_owned(),
            }),
        }
    }
}

impl fmt::Display for Unit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Metre => "m",
            Self::Centimetre => "cm",
            Self::Millimetre => "mm",
        })
    }
}

/// The axis that points up in the user's geometry files.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Up {
    /// As everywhere inside.
    #[default]
    Z,
    /// As in many programs for drawing.
    Y,
}

impl Up {
    /// Stands upright what has this axis up: x stays, and of y up the file's y becomes z and its z becomes -y.
    pub fn stand(self, DVec3 { x, y, z }: DVec3) -> DVec3 {
        match self {
            Self::Z => DVec3::new(x, y, z),
            // 0 - 0 is 0, where -0 is another number
            Self::Y => DVec3::new(x, 0.0 - z, y),
        }
    }
}

impl FromStr for Up {
    type Err = OptionFault;

    fn from_str(text: &str) -> Result<Self, OptionFault> {
        match text {
            "z" => Ok(Self::Z),
            "y" => Ok(Self::Y),
            _ => Err(OptionFault {
                option: "up",
                expected: "y or z",
                found: text.to_owned(),
            }),
        }
    }
}

/// The diameter of the near field.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "DiameterText", into = "DiameterText")]
pub enum Diameter {
    /// As the plan finds best.
    #[default]
    Auto,
    /// Without bounds: no far field.
    Infinite,
    /// Metres, finite and above 0.
    Metres(f64),
}

/// A diameter that is taken, for messages.
pub const DIAMETERS: &str = "auto, inf or a number of metres above 0";

impl Diameter {
    /// From a number: a length above zero, or infinity for no bound.
    pub fn metres(value: f64) -> Option<Self> {
        if value == f64::INFINITY {
            return Some(Self::Infinite);
        }
        (value.is_finite() && value > 0.0).then_some(Self::Metres(value))
    }
}

impl FromStr for Diameter {
    type Err = OptionFault;

    fn from_str(text: &str) -> Result<Self, OptionFault> {
        let found = match text {
            "auto" => Some(Self::Auto),
            _ => text.parse().ok().and_then(Self::metres),
        };
        found.ok_or_else(|| OptionFault {
            option: "diameter",
            expected: DIAMETERS,
            found: text.to_owned(),
        })
    }
}

impl fmt::Display for Diameter {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Auto => f.write_str("auto"),
            Self::Infinite => f.write_str("inf"),
            Self::Metres(metres) => write!(f, "{metres}"),
        }
    }
}

/// A diameter as files have it: a number, or a word.
#[derive(Serialize, Deserialize)]
#[serde(
    untagged,
    expecting = "expected auto, inf or a number of metres above 0"
)]
enum DiameterText {
    Metres(f64),
    Word(String),
}

impl TryFrom<DiameterText> for Diameter {
    type Error = OptionFault;

    fn try_from(text: DiameterText) -> Result<Self, OptionFault> {
        match text {
            DiameterText::Word(word) => word.parse(),
            DiameterText::Metres(value) => Self::metres(value).ok_or_else(|| OptionFault {
                option: "diameter",
                expected: DIAMETERS,
                found: value.to_string(),
            }),
        }
    }
}

impl From<Diameter> for DiameterText {
    fn from(diameter: Diameter) -> Self {
        match diameter {
            Diameter::Metres(metres) => Self::Metres(metres),
            word => Self::Word(word.to_string()),
        }
    }
}

/// Whether light is followed after it was scattered.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Scatter {
    /// However often it is.
    #[default]
    All,
    /// Not at all: first order, direct light alone.
    None,
}

impl FromStr for Scatter {
    type Err = OptionFault;

    fn from_str(text: &str) -> Result<Self, OptionFault> {
        match text {
            "all" => Ok(Self::All),
            "none" => Ok(Self::None),
            _ => Err(OptionFault {
                option: "scatter",
                expected: "all or none",
                found: text.to_owned(),
            }),
        }
    }
}

/// The form of the result tables.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum TableFormat {
    /// Comma-separated text.
    #[default]
    Csv,
    /// Apache Parquet.
    Parquet,
}

impl FromStr for TableFormat {
    type Err = OptionFault;

    fn from_str(text: &str) -> Result<Self, OptionFault> {
        match text {
            "csv" => Ok(Self::Csv),
            "parquet" => Ok(Self::Parquet),
            _ => Err(OptionFault {
                option: "format",
                expected: "csv or parquet",
                found: text.to_owned(),
            }),
        }
    }
}

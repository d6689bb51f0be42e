//! Units: symbols, dimensions and conversion.

pub mod catalogue;
mod differences;
pub mod dimension;
mod grammar;
mod mistaken;
mod own;
mod read;
mod unit;

pub use catalogue::{convert, describe, which_is_meant};
pub use dimension::{Dimension, Exponent};
pub use mistaken::mistaken;
pub use own::{OwnUnit, OwnUnits};
pub use read::{UnitError, UnitErrorKind, parse_unit, parse_unit_with, read_unit};
pub use unit::{Datum, Unit};

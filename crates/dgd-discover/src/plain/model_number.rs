//! A number of a model's text, and the values that it has if its unit or its decimal point is wrong.

use dgd_compiler::units::{Unit, mistaken, parse_unit};

use crate::fit::FittedStructure;

/// A number of the model's text.
#[derive(Debug, Clone)]
pub(crate) struct ModelNumber {
    /// Its name.
    pub(crate) name: String,
    pub(crate) is_constant: bool,
    /// Its value in the text or by `--set`, SI.
    pub(crate) declared: f64,
    pub(crate) unit: Unit,
}

/// Constants of nature, and properties of water and air, by their SI value; rounded ones count, too.
const WELL_KNOWN: [(f64, &str); 15] = [
    (9.806_65, "m/s^2"),
    (8.314_462_618, "J/(mol*K)"),
    (96_485.332_12, "C/mol"),
    (6.022_140_76e23, "1/mol"),
    (1.380_649e-23, "J/K"),
    (1.602_176_634e-19, "C"),
    (5.670_374_419e-8, "W/(m^2*K^4)"),
    (299_792_458.0, "m/s"),
    (273.15, "K"),
    (101_325.0, "Pa"),
    (1000.0, "kg/m^3"),
    (4184.0, "J/(kg*K)"),
    (4.18e6, "J/(m^3*K)"),
    (287.05, "J/(kg*K)"),
    (1005.0, "J/(kg*K)"),
];
/// Relative deviation of a rounded one.
const ROUNDED: f64 = 0.004;

/// Least change of a number, in standard deviations.
pub(super) const SIGNIFICANT: f64 = 4.0;

impl ModelNumber {
    /// Whether it is a constant of nature or a property of water or air, which is wrong in few models.
    pub(super) fn is_well_known(&self) -> bool {
        WELL_KNOWN.iter().any(|(value, unit)| {
            let is_alike = parse_unit(unit).is_ok_and(|unit| unit.dimension == self.unit.dimension);
            is_alike && (self.declared / value - 1.0).abs() < ROUNDED
        })
    }

    /// Whether a fit estimates it.
    pub(super) fn is_estimated(&self, fitted: &FittedStructure) -> bool {
        let mut estimates = fitted.estimates.iter().filter(|one| one.recording.is_none());
        estimates.any(|one| one.name == self.name)
    }

    /// Values that it would have in SI if the number was meant in another unit.
    pub(super) fn in_other_units(&self) -> impl Iterator<Item = f64> {
        let number = self.unit.from_si(self.declared);
        mistaken(&self.unit).into_iter().map(move |other| other.to_si(number))
    }

    /// Values with another power of ten.
    pub(super) fn with_other_powers(&self) -> impl Iterator<Item = f64> {
        /// Maximum number of places by which a decimal point has moved.
        const PLACES: i32 = 3;
        let powers = (-PLACES..=PLACES).filter(|power| *power != 0);
        powers.map(move |power| self.declared * 10_f64.powi(power))
    }

    /// The unit in which the number of the text is right, given its estimate and the standard deviation of that, SI.
    pub(crate) fn meant_in(&self, value: f64, std: Option<f64>) -> Option<Unit> {
        /// Minimum ratio of units that can be distinguished.
        const APART: f64 = 1.5;
        let ratio = value / self.declared;
        let spread = std.map_or(f64::NAN, |std| (std / value).abs());
        if spread.is_nan() || spread > 0.1 || (1.0 / APART..APART).contains(&ratio) {
            return None;
        }
        // To the accuracy of the estimate, and to that of a rounded number.
        let within = (3.0 * spread).max(0.005);
        let number = self.unit.from_si(self.declared);
        let off = |unit: &Unit| (unit.to_si(number) / value - 1.0).abs();
        mistaken(&self.unit).into_iter().find(|unit| off(unit) < within)
    }
}

//! The units of the language, one row each.
//!
//! The parser, the messages and the documentation read this table. To add a unit, add a row.

use super::{Datum, Dimension, Exponent, Unit};

/// Difference between gauge and absolute pressure, Pa: the standard atmosphere.
pub const STANDARD_ATMOSPHERE: f64 = 101_325.0;

/// One unit of the catalogue.
#[derive(Debug, Clone, Copy)]
pub struct UnitRow {
    /// Its usual symbol.
    pub symbol: &'static str,
    /// Other spellings.
    pub aliases: &'static [&'static str],
    /// Its dimension.
    pub dimension: Dimension,
    /// Its size in SI units, as a quotient. Both parts are exact if the definition is, so that compositions such as
    /// `l/min` are rounded once, at the end.
    pub factor: (f64, f64),
    /// SI value at its zero, if that differs from zero.
    pub offset: f64,
    /// Whether it allows SI prefixes.
    pub prefixes: Prefixes,
    /// The datum of a pressure unit that specifies one.
    pub datum: Option<Datum>,
    /// A one-line description.
    pub doc: &'static str,
}

/// Whether a unit allows SI prefixes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Prefixes {
    /// With `k`, `m`, … in front.
    Allowed,
    /// Without prefixes.
    None,
}

/// SI prefixes: symbol, other spellings, and factor as a quotient.
pub const PREFIXES: &[(&str, f64, f64)] = &[
    ("T", 1e12, 1.0),
    ("G", 1e9, 1.0),
    ("M", 1e6, 1.0),
    ("k", 1e3, 1.0),
    ("h", 1e2, 1.0),
    ("da", 1e1, 1.0),
    ("d", 1.0, 1e1),
    ("c", 1.0, 1e2),
    ("m", 1.0, 1e3),
    ("µ", 1.0, 1e6),
    ("μ", 1.0, 1e6),
    ("u", 1.0, 1e6),
    ("n", 1.0, 1e9),
    ("p", 1.0, 1e12),
    ("f", 1.0, 1e15),
];

const NUMBER: Dimension = Dimension::ONE;
const MASS: Dimension = Dimension::from_exponents([1, 0, 0, 0, 0, 0, 0]);
const LENGTH: Dimension = Dimension::from_exponents([0, 1, 0, 0, 0, 0, 0]);
pub(super) const TIME: Dimension = Dimension::from_exponents([0, 0, 1, 0, 0, 0, 0]);
const CURRENT: Dimension = Dimension::from_exponents([0, 0, 0, 1, 0, 0, 0]);
const TEMPERATURE: Dimension = Dimension::from_exponents([0, 0, 0, 0, 1, 0, 0]);
const AMOUNT: Dimension = Dimension::from_exponents([0, 0, 0, 0, 0, 1, 0]);
pub(super) const LUMINOUS_INTENSITY: Dimension = Dimension::from_exponents([0, 0, 0, 0, 0, 0, 1]);
const CONCENTRATION: Dimension = Dimension::from_exponents([0, -3, 0, 0, 0, 1, 0]);
const SPEED: Dimension = Dimension::from_exponents([0, 1, -1, 0, 0, 0, 0]);
const AREA: Dimension = Dimension::from_exponents([0, 2, 0, 0, 0, 0, 0]);
const VOLUME: Dimension = Dimension::from_exponents([0, 3, 0, 0, 0, 0, 0]);
const FLOW: Dimension = Dimension::from_exponents([0, 3, -1, 0, 0, 0, 0]);
const FREQUENCY: Dimension = Dimension::from_exponents([0, 0, -1, 0, 0, 0, 0]);
const DENSITY: Dimension = Dimension::from_exponents([1, -3, 0, 0, 0, 0, 0]);
const FORCE: Dimension = Dimension::from_exponents([1, 1, -2, 0, 0, 0, 0]);
pub(super) const PRESSURE: Dimension = Dimension::from_exponents([1, -1, -2, 0, 0, 0, 0]);
const ENERGY: Dimension = Dimension::from_exponents([1, 2, -2, 0, 0, 0, 0]);
const POWER: Dimension = Dimension::from_exponents([1, 2, -3, 0, 0, 0, 0]);
const VISCOSITY: Dimension = Dimension::from_exponents([1, -1, -1, 0, 0, 0, 0]);
const DIFFUSIVITY: Dimension = Dimension::from_exponents([0, 2, -1, 0, 0, 0, 0]);
const CHARGE: Dimension = Dimension::from_exponents([0, 0, 1, 1, 0, 0, 0]);
const VOLTAGE: Dimension = Dimension::from_exponents([1, 2, -3, -1, 0, 0, 0]);
const RESISTANCE: Dimension = Dimension::from_exponents([1, 2, -3, -2, 0, 0, 0]);
const CONDUCTANCE: Dimension = Dimension::from_exponents([-1, -2, 3, 2, 0, 0, 0]);
const CAPACITANCE: Dimension = Dimension::from_exponents([-1, -2, 4, 2, 0, 0, 0]);
const FLUX: Dimension = Dimension::from_exponents([1, 2, -2, -1, 0, 0, 0]);
const FLUX_DENSITY: Dimension = Dimension::from_exponents([1, 0, -2, -1, 0, 0, 0]);
const INDUCTANCE: Dimension = Dimension::from_exponents([1, 2, -2, -2, 0, 0, 0]);

/// kg in a pound, m in an inch and m³ in a US gallon (231 in³), as exact quotients.
const POUND: (f64, f64) = (45_359_237.0, 1e8);
const INCH: (f64, f64) = (254.0, 1e4);
const GALLON: (f64, f64) = (3_785_411_784.0, 1e12);
/// N in a pound-force: the pound under standard gravity, 9.80665 m/s².
const POUND_FORCE: (f64, f64) = (44_482_216_152_605.0, 1e13);
/// Pa in a pound-force on a square inch.
const PSI: (f64, f64) = (44_482_216_152_605.0, 6_451_600_000.0);

impl UnitRow {
    /// A coherent SI unit.
    const fn si(symbol: &'static str, dimension: Dimension, doc: &'static str) -> UnitRow {
        UnitRow {
            prefixes: Prefixes::Allowed,
            ..UnitRow::with_factor(symbol, dimension, (1.0, 1.0), doc)
        }
    }

    /// A unit with a factor, and without prefixes.
    const fn with_factor(
        symbol: &'static str,
        dimension: Dimension,
        factor: (f64, f64),
        doc: &'static str,
    ) -> UnitRow {
        UnitRow {
            symbol,
            aliases: &[],
            dimension,
            factor,
            offset: 0.0,
            prefixes: Prefixes::None,
            datum: None,
            doc,
        }
    }

    /// The unit with SI prefixes allowed.
    const fn with_prefixes(self) -> UnitRow {
        UnitRow { prefixes: Prefixes::Allowed, ..self }
    }

    /// The unit with other spellings.
    const fn or(self, aliases: &'static [&'static str]) -> UnitRow {
        UnitRow { aliases, ..self }
    }

    /// The unit with an offset.
    const fn zero_at(self, offset: f64) -> UnitRow {
        UnitRow { offset, ..self }
    }

    /// The unit with a pressure datum.
    const fn counted_from(self, datum: Datum) -> UnitRow {
        UnitRow { datum: Some(datum), ..self }
    }

    /// Every spelling without a prefix, the symbol first.
    pub fn spellings(&self) -> impl Iterator<Item = &'static str> {
        std::iter::once(self.symbol).chain(self.aliases.iter().copied())
    }
}

/// Every unit, by kind of quantity.
pub static CATALOGUE: &[UnitRow] = &[
    // Base units; the kilogram is a gram with a prefix.
    UnitRow::si("m", LENGTH, "metre"),
    UnitRow::with_factor("g", MASS, (1.0, 1e3), "gram").with_prefixes(),
    UnitRow::si("s", TIME, "second").or(&["sec"]),
    UnitRow::si("A", CURRENT, "ampere"),
    UnitRow::si("K", TEMPERATURE, "kelvin"),
    UnitRow::si("mol", AMOUNT, "mole"),
    UnitRow::si("cd", LUMINOUS_INTENSITY, "candela"),
    // Numbers and angles
    UnitRow::with_factor("%", NUMBER, (1.0, 1e2), "percent: 0.01").or(&["percent"]),
    UnitRow::with_factor("ppm", NUMBER, (1.0, 1e6), "parts per million"),
    UnitRow::with_factor("ppb", NUMBER, (1.0, 1e9), "parts per billion: 10⁻⁹"),
    UnitRow::si("rad", NUMBER, "radian: 1"),
    UnitRow::with_factor("rev", NUMBER, (std::f64::consts::TAU, 1.0), "revolution: 2π rad"),
    UnitRow::si("sr", NUMBER, "steradian: 1"),
    UnitRow::with_factor("deg", NUMBER, (std::f64::consts::PI, 180.0), "degree of arc: π/180")
        .or(&["°"]),
    // Time
    UnitRow::with_factor("min", TIME, (60.0, 1.0), "minute"),
    UnitRow::with_factor("h", TIME, (3600.0, 1.0), "hour").or(&["hr"]),
    UnitRow::with_factor("d", TIME, (86_400.0, 1.0), "day").or(&["day"]),
    UnitRow::with_factor("week", TIME, (604_800.0, 1.0), "week: 7 d"),
    UnitRow::with_factor("year", TIME, (31_557_600.0, 1.0), "Julian year: 365.25 d").or(&["yr"]),
    UnitRow::si("Hz", FREQUENCY, "hertz: 1/s"),
    UnitRow::with_factor(
        "rpm",
        FREQUENCY,
        (std::f64::consts::PI, 30.0),
        "revolutions per minute: 2π/60 rad/s",
    ),
    UnitRow::with_factor("spm", FREQUENCY, (1.0, 60.0), "strokes per minute: 1/60 s⁻¹"),
    // Length, area, volume
    UnitRow::with_factor("in", LENGTH, INCH, "inch: 25.4 mm").or(&["inch"]),
    UnitRow::with_factor("ft", LENGTH, (3048.0, 1e4), "foot: 0.3048 m"),
    UnitRow::with_factor("yd", LENGTH, (9144.0, 1e4), "yard: 0.9144 m"),
    UnitRow::with_factor("mi", LENGTH, (1_609_344.0, 1e3), "mile: 1609.344 m"),
    UnitRow::with_factor("D", AREA, (1.0, 101_325e7), "darcy (permeability)")
        .or(&["darcy"])
        .with_prefixes(),
    UnitRow::with_factor("l", VOLUME, (1.0, 1e3), "litre").or(&["L"]).with_prefixes(),
    UnitRow::with_factor("bbl", VOLUME, (42.0 * GALLON.0, GALLON.1), "oil barrel: 42 US gallons"),
    UnitRow::with_factor("gal", VOLUME, GALLON, "US gallon: 231 in³"),
    // Speed
    UnitRow::with_factor("mph", SPEED, (1_609_344.0, 3_600e3), "mile per hour: 0.44704 m/s"),
    UnitRow::with_factor("knot", SPEED, (1852.0, 3600.0), "nautical mile per hour: 1852 m/h")
        .or(&["kn"]),
    // Flow
    UnitRow::with_factor("lpm", FLOW, (1.0, 60e3), "litres per minute").or(&["LPM"]),
    UnitRow::with_factor("gpm", FLOW, (GALLON.0, 60.0 * GALLON.1), "US gallons per minute")
        .or(&["GPM"]),
    // Mass, force
    UnitRow::with_factor("t", MASS, (1e3, 1.0), "tonne: 1000 kg").or(&["tonne"]),
    UnitRow::with_factor("lb", MASS, POUND, "pound: 0.45359237 kg").or(&["lbm"]),
    UnitRow::si("N", FORCE, "newton"),
    UnitRow::with_factor("lbf", FORCE, POUND_FORCE, "pound-force"),
    UnitRow::with_factor("kgf", FORCE, (980_665.0, 1e5), "kilogram-force: 9.80665 N"),
    // Concentration
    UnitRow::with_factor("M", CONCENTRATION, (1e3, 1.0), "molar: 1 mol/l").with_prefixes(),
    // Density
    UnitRow::with_factor("sg", DENSITY, (1e3, 1.0), "specific gravity: relative to 1000 kg/m³"),
    UnitRow::with_factor("ppg", DENSITY, (POUND.0 * 1e4, GALLON.0), "pounds per US gallon"),
    UnitRow::with_factor(
        "pcf",
        DENSITY,
        (POUND.0 * 1e4, 3048.0 * 3048.0 * 3048.0),
        "pounds per cubic foot",
    ),
    // Pressure
    UnitRow::si("Pa", PRESSURE, "pascal"),
    UnitRow::with_factor("bar", PRESSURE, (1e5, 1.0), "bar: 100 kPa").with_prefixes(),
    UnitRow::with_factor("bara", PRESSURE, (1e5, 1.0), "bar above vacuum")
        .with_prefixes()
        .counted_from(Datum::Absolute),
    UnitRow::with_factor("barg", PRESSURE, (1e5, 1.0), "bar above the standard atmosphere")
        .with_prefixes()
        .counted_from(Datum::Gauge),
    UnitRow::with_factor("psi", PRESSURE, PSI, "pound-force per square inch"),
    UnitRow::with_factor("psia", PRESSURE, PSI, "psi above vacuum").counted_from(Datum::Absolute),
    UnitRow::with_factor("psig", PRESSURE, PSI, "psi above the standard atmosphere")
        .counted_from(Datum::Gauge),
    UnitRow::with_factor("ksi", PRESSURE, (1e3 * PSI.0, PSI.1), "1000 psi"),
    UnitRow::with_factor(
        "atm",
        PRESSURE,
        (STANDARD_ATMOSPHERE, 1.0),
        "standard atmosphere: 101325 Pa",
    ),
    UnitRow::with_factor(
        "torr",
        PRESSURE,
        (STANDARD_ATMOSPHERE, 760.0),
        "torr: 1/760 of an atmosphere",
    )
    .or(&["Torr"])
    .with_prefixes(),
    UnitRow::with_factor("mmHg", PRESSURE, (133_322_387_415.0, 1e9), "millimetre of mercury"),
    UnitRow::with_factor("inHg", PRESSURE, (133_322_387_415.0 * 25.4, 1e9), "inch of mercury"),
    UnitRow::with_factor("mmH2O", PRESSURE, (980_665.0, 1e5), "millimetre of water"),
    UnitRow::with_factor("inH2O", PRESSURE, (980_665.0 * 25.4, 1e5), "inch of water"),
    // Energy, power
    UnitRow::si("J", ENERGY, "joule"),
    UnitRow::si("Nm", ENERGY, "newton metre, of torque: 1 J"),
    UnitRow::with_factor("eV", ENERGY, (1_602_176_634.0, 1e28), "electronvolt: 1.602176634e-19 J")
        .with_prefixes(),
    UnitRow::with_factor("cal", ENERGY, (4184.0, 1e3), "thermochemical calorie: 4.184 J")
        .with_prefixes(),
    UnitRow::with_factor("Wh", ENERGY, (3600.0, 1.0), "watt-hour").with_prefixes(),
    UnitRow::si("W", POWER, "watt"),
    UnitRow::si("VA", POWER, "volt-ampere, of apparent power: 1 W"),
    UnitRow::si("var", POWER, "volt-ampere reactive: 1 W"),
    UnitRow::with_factor(
        "hp",
        POWER,
        (550.0 * 0.3048 * POUND_FORCE.0, POUND_FORCE.1),
        "mechanical horsepower",
    ),
    // Viscosity
    UnitRow::with_factor("P", VISCOSITY, (1.0, 10.0), "poise: 0.1 Pa·s").with_prefixes(),
    UnitRow::with_factor("St", DIFFUSIVITY, (1.0, 1e4), "stokes: 1 cm²/s").with_prefixes(),
    // Electricity
    UnitRow::si("C", CHARGE, "coulomb"),
    UnitRow::with_factor("Ah", CHARGE, (3600.0, 1.0), "ampere-hour: 3600 C").with_prefixes(),
    UnitRow::si("V", VOLTAGE, "volt"),
    UnitRow::si("ohm", RESISTANCE, "ohm").or(&["Ohm", "\u{3a9}", "\u{2126}"]),
    UnitRow::si("S", CONDUCTANCE, "siemens"),
    UnitRow::si("F", CAPACITANCE, "farad"),
    UnitRow::si("Wb", FLUX, "weber"),
    UnitRow::si("T", FLUX_DENSITY, "tesla"),
    UnitRow::si("H", INDUCTANCE, "henry"),
    // Temperature: 0 °F is 459.67 °R, and nine degrees Rankine are five kelvin.
    UnitRow::with_factor("°C", TEMPERATURE, (1.0, 1.0), "degree Celsius")
        .or(&["degC"])
        .zero_at(273.15),
    UnitRow::with_factor("°F", TEMPERATURE, (5.0, 9.0), "degree Fahrenheit")
        .or(&["degF"])
        .zero_at(459.67 * 5.0 / 9.0),
    UnitRow::with_factor("°R", TEMPERATURE, (5.0, 9.0), "degree Rankine").or(&["degR"]),
];

/// The row and factor of a symbol: a whole symbol, or else a prefix and a unit.
pub(super) fn find(symbol: &str) -> Option<(&'static UnitRow, (f64, f64))> {
    let exact = |symbol: &str| CATALOGUE.iter().find(|row| row.spellings().any(|s| s == symbol));
    if let Some(row) = exact(symbol) {
        return Some((row, row.factor));
    }
    PREFIXES.iter().find_map(|&(prefix, up, down)| {
        let row = exact(symbol.strip_prefix(prefix)?)?;
        let factor = reduced(row.factor.0 * up, row.factor.1 * down);
        (row.prefixes == Prefixes::Allowed).then_some((row, factor))
    })
}

/// 1000/1000 is 1/1, so that powers of `kg` stay exact.
fn reduced(up: f64, down: f64) -> (f64, f64) {
    if up == down { (1.0, 1.0) } else { (up, down) }
}

/// Every accepted symbol, for suggestions.
pub(super) fn all_spellings() -> Vec<String> {
    let mut spellings = Vec::new();
    for row in CATALOGUE {
        for spelling in row.spellings() {
            spellings.push(spelling.to_owned());
            if row.prefixes == Prefixes::Allowed {
                spellings.extend(PREFIXES.iter().map(|(prefix, ..)| format!("{prefix}{spelling}")));
            }
        }
    }
    spellings
}

/// A unit for values of a dimension: a named one such as `Pa` if there is one, otherwise one of base units such as
/// `kg/m^4`; `1` for plain numbers.
pub fn describe(dimension: Dimension) -> String {
    // Names of coherent units that involve mass or current; 1/s could be Hz or rad/s.
    let named = CATALOGUE.iter().find(|row| {
        let [mass, _, _, current, ..] = row.dimension.exponents();
        row.dimension == dimension
            && row.factor == (1.0, 1.0)
            && (*mass != Exponent::ZERO || *current != Exponent::ZERO)
    });
    if let Some(row) = named {
        return row.symbol.to_owned();
    }

    let (mut above, mut below) = (Vec::new(), Vec::new());
    for (symbol, &exponent) in super::dimension::BASE_UNITS.iter().zip(dimension.exponents()) {
        let magnitude = if exponent.value() < 0.0 {
            Exponent::new(-1, 1).and_then(|minus| exponent.times(minus)).unwrap_or(exponent)
        } else {
            exponent
        };
        let list = if exponent.value() < 0.0 { &mut below } else { &mut above };
        match magnitude.value() {
            0.0 => {}
            1.0 => list.push((*symbol).to_owned()),
            _ => list.push(format!("{symbol}^{magnitude}")),
        }
    }
    let above = if above.is_empty() { "1".to_owned() } else { above.join("*") };
    match below.as_slice() {
        [] => above,
        [one] => format!("{above}/{one}"),
        several => format!("{above}/({})", several.join("*")),
    }
}

/// A question for two dimensions that should agree, if a `C` may have been meant as `°C`.
pub fn which_is_meant(one: Dimension, other: Dimension) -> Option<String> {
    let apart = one.divide(other)?;
    let is_meant = |a: Dimension, b: Dimension| a.divide(b) == Some(apart);
    (is_meant(CHARGE, TEMPERATURE) || is_meant(TEMPERATURE, CHARGE)).then(|| {
        "is `C` the coulomb here, or a degree Celsius? A temperature is in `°C` or `degC`, a charge in `C`, `A*s` or `Ah`"
            .to_owned()
    })
}

/// Converts a value at the model's interface, between units of one dimension.
///
/// If both units have a datum and these differ, adds or subtracts the standard atmosphere.
pub fn convert(value: f64, from: &Unit, to: &Unit) -> f64 {
    let si = from.to_si(value);
    let si = match (from.datum, to.datum) {
        (Some(Datum::Gauge), Some(Datum::Absolute)) => si + STANDARD_ATMOSPHERE,
        (Some(Datum::Absolute), Some(Datum::Gauge)) => si - STANDARD_ATMOSPHERE,
        (Some(_) | None, Some(_) | None) => si,
    };
    to.from_si(si)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::units::parse_unit;

    fn unit(text: &str) -> Unit {
        parse_unit(text).unwrap_or_else(|error| panic!("{text}: {error}"))
    }

    #[test]
    fn no_symbol_has_two_readings() {
        let mut seen = std::collections::BTreeMap::new();
        for row in CATALOGUE {
            for spelling in row.spellings() {
                let mut readings = vec![spelling.to_owned()];
                if row.prefixes == Prefixes::Allowed {
                    let prefixed = |(prefix, ..): &(&str, f64, f64)| format!("{prefix}{spelling}");
                    readings.extend(PREFIXES.iter().map(prefixed));
                }
                for reading in readings {
                    let other = seen.insert(reading.clone(), row.symbol);
                    assert_eq!(other, None, "`{reading}` is {} and {other:?}", row.symbol);
                    assert!(parse_unit(&reading).is_ok(), "{reading}");
                }
            }
        }
    }

    #[test]
    fn dimensions_are_described_in_units_that_can_be_read_again() {
        for (text, expected) in [
            ("bar", "Pa"),
            ("lbf", "N"),
            ("hp", "W"),
            ("N*m", "J"),
            ("lpm", "m^3/s"),
            ("kg/m^4", "kg/m^4"),
            ("cP", "kg/(m*s)"),
            ("%", "1"),
            ("rpm", "1/s"),
            ("m^(1/2)", "m^(1/2)"),
            ("V/A", "ohm"),
            ("A", "A"),
            ("t", "kg"),
        ] {
            let dimension = unit(text).dimension;
            assert_eq!(describe(dimension), expected);
            assert_eq!(unit(expected).dimension, dimension);
        }
    }
}

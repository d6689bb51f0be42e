//! Reads the text of a unit: factor, offset and dimension.

use std::fmt;
use std::ops::Range;

use super::catalogue::{all_spellings, find};
use super::dimension::{Dimension, Exponent};
use super::grammar;
use super::own::{OwnUnit, OwnUnits};
use super::unit::{Datum, Unit};
use crate::diagnostics::{Code, Diagnostic, suggestion};
use crate::source::{DeclaredUnit, SourceMap, Span};

/// The reason why a text is not a unit.
#[derive(Debug, Clone, PartialEq)]
pub struct UnitError {
    /// The wrong piece, in bytes of the text; empty at its end.
    pub range: Range<usize>,
    /// The kind of error.
    pub kind: UnitErrorKind,
}

/// Errors in a unit's text.
#[derive(Debug, Clone, PartialEq)]
pub enum UnitErrorKind {
    /// A symbol is not in the catalogue.
    Unknown {
        /// The symbol.
        symbol: String,
        /// The probable intention.
        suggestion: Option<String>,
    },
    /// The logarithm of a ratio is not a unit.
    Logarithm {
        /// The symbol.
        symbol: String,
    },
    /// A symbol consists of units without an operator between them.
    Product {
        /// The symbol.
        symbol: String,
        /// The units with operators.
        product: String,
    },
    /// The text does not follow the grammar of units.
    Malformed {
        /// The expected syntax.
        expected: &'static str,
    },
    /// An exponent or a factor is out of range.
    OutOfRange,
}

impl UnitError {
    /// The diagnostic for the unit `text` between `brackets`: at the wrong piece, or at the whole unit if blanks inside
    /// the brackets hide its position. [`read_unit`] can see these.
    pub fn locate(&self, text: &str, brackets: Span) -> Diagnostic {
        let Span { start, end, .. } = brackets;
        if end.saturating_sub(start) == text.len() as u32 + 2 {
            self.locate_after(start + 1, brackets)
        } else {
            self.diagnostic(brackets)
        }
    }

    /// The diagnostic for a unit whose text begins at a byte of a source, inside `brackets`.
    fn locate_after(&self, text_start: u32, brackets: Span) -> Diagnostic {
        let place = |at: usize| (text_start + at as u32).min(brackets.end);
        let span = Span { start: place(self.range.start), end: place(self.range.end), ..brackets };
        self.diagnostic(span)
    }

    fn diagnostic(&self, span: Span) -> Diagnostic {
        let diagnostic = Diagnostic::new(self.code(), span, self.to_string());
        let diagnostic = match &self.kind {
            UnitErrorKind::Unknown { symbol, .. }
            | UnitErrorKind::Logarithm { symbol }
            | UnitErrorKind::Product { symbol, .. } => diagnostic.about(symbol),
            UnitErrorKind::Malformed { .. } | UnitErrorKind::OutOfRange => diagnostic,
        };
        diagnostic.maybe_help(self.help())
    }

    fn code(&self) -> Code {
        match self.kind {
            UnitErrorKind::Unknown { .. }
            | UnitErrorKind::Logarithm { .. }
            | UnitErrorKind::Product { .. } => Code::UnknownUnit,
            UnitErrorKind::Malformed { .. } | UnitErrorKind::OutOfRange => Code::MalformedUnit,
        }
    }

    /// A correction, if one is known.
    pub fn help(&self) -> Option<String> {
        match &self.kind {
            UnitErrorKind::Unknown { suggestion, .. } => {
                suggestion.as_ref().map(|unit| format!("did you mean `{unit}`?"))
            }
            UnitErrorKind::Logarithm { .. } => Some(
                "of a level x, a plain number, `10^(x/20)` is the ratio of amplitudes, and `10^(x/10)` that of powers"
                    .to_owned(),
            ),
            UnitErrorKind::Product { product, .. } => Some(format!("did you mean `{product}`?")),
            UnitErrorKind::Malformed { .. } => Some(
                "units are written like `kg/m^3`, `Pa*s^2/m^6`, `m^(5/2)/s` or `1/(m*s)`"
                    .to_owned(),
            ),
            UnitErrorKind::OutOfRange => None,
        }
    }
}

impl fmt::Display for UnitError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.kind {
            UnitErrorKind::Unknown { symbol, .. } | UnitErrorKind::Product { symbol, .. } => {
                write!(f, "there is no unit `{symbol}`")
            }
            UnitErrorKind::Logarithm { symbol } => {
                write!(f, "`{symbol}` is the logarithm of a ratio, and no unit")
            }
            UnitErrorKind::Malformed { expected } => {
                write!(f, "malformed unit: expected {expected}")
            }
            UnitErrorKind::OutOfRange => f.write_str("the unit leaves the range of numbers"),
        }
    }
}

impl std::error::Error for UnitError {}

/// Reads a unit such as `m^3/s`.
///
/// An offset (°C) and a datum (bara) apply only to a unit on its own. In a product or power a °C is a difference of one
/// kelvin, and `bara` is `bar`.
///
/// # Errors
///
/// [`UnitError`] if the text is not a unit.
pub fn parse_unit(text: &str) -> Result<Unit, UnitError> {
    parse_unit_with(text, &OwnUnits::default())
}

/// Reads a unit like [`parse_unit`], in which units declared by a file may occur.
///
/// # Errors
///
/// [`UnitError`] if the text is not a unit.
pub fn parse_unit_with(text: &str, own: &OwnUnits) -> Result<Unit, UnitError> {
    let factors = grammar::parse(text).map_err(|malformed| {
        let length = text[malformed.at..].chars().next().map_or(0, char::len_utf8);
        UnitError {
            range: malformed.at..malformed.at + length,
            kind: UnitErrorKind::Malformed { expected: malformed.expected },
        }
    })?;

    let mut unit = Unit { symbol: text.trim().to_owned(), ..Unit::one() };
    let (mut numerator, mut denominator) = (1.0, 1.0);
    for factor in &factors {
        let out_of_range =
            || UnitError { range: factor.range.clone(), kind: UnitErrorKind::OutOfRange };
        let symbol = look_up(factor, own)?;
        let exponent = factor.exponent.times(symbol.digits).ok_or_else(out_of_range)?;

        let dimension = symbol.dimension.power(exponent);
        unit.dimension = dimension
            .and_then(|dimension| unit.dimension.times(dimension))
            .ok_or_else(out_of_range)?;

        let (up, down) = symbol.factor;
        if exponent.value() >= 0.0 {
            numerator *= power(up, exponent);
            denominator *= power(down, exponent);
        } else {
            numerator *= power(down, exponent);
            denominator *= power(up, exponent);
        }
        if factors.len() == 1 && exponent.value() == 1.0 {
            unit.offset = symbol.offset;
            unit.datum = symbol.datum;
        }
        unit.factor = numerator / denominator;
        if !unit.factor.is_normal() {
            return Err(out_of_range());
        }
    }
    Ok(unit)
}

/// x^|exponent|, by multiplication for a whole exponent, to be exact if possible.
fn power(x: f64, exponent: Exponent) -> f64 {
    let exponent = exponent.value().abs();
    if exponent.fract() == 0.0 {
        (0..exponent as u32).fold(1.0, |product, _| product * x)
    } else {
        x.powf(exponent)
    }
}

impl OwnUnits {
    /// The units that a model declares.
    pub fn declared(all: &[DeclaredUnit]) -> OwnUnits {
        let one = |of: &DeclaredUnit| {
            let unit = parse_unit(&of.unit).ok()?;
            Some((of.symbol.clone(), OwnUnit::from_unit(of.value, &unit)))
        };
        OwnUnits::new(all.iter().filter_map(one).collect())
    }
}

/// Reads the unit `text` between `brackets` of a source, or reports an error at its place. Units that the model
/// declares are known if `sources` has them.
///
/// # Errors
///
/// A [`Diagnostic`] if the text is not a unit.
pub fn read_unit(text: &str, brackets: Span, sources: &SourceMap) -> Result<Unit, Box<Diagnostic>> {
    parse_unit_with(text, &OwnUnits::declared(&sources.units)).map_err(|error| {
        // The text is the content of the brackets, without surrounding blanks.
        let before = sources.text(brackets).find(text).unwrap_or(0);
        Box::new(error.locate_after(brackets.start + before as u32, brackets))
    })
}

/// A symbol found in the catalogue, or among the units that a file declares.
struct CatalogueSymbol {
    dimension: Dimension,
    /// Its factor, with that of its prefix.
    factor: (f64, f64),
    offset: f64,
    datum: Option<Datum>,
    /// The power given by digits after the symbol.
    digits: Exponent,
}

/// Words that are not units, without a plural s, and the corresponding units.
const SPELLED_OUT: &[(&str, &str)] = &[
    ("second", "s"),
    ("minute", "min"),
    ("hour", "h"),
    ("metre", "m"),
    ("meter", "m"),
    ("kilometre", "km"),
    ("kilometer", "km"),
    ("feet", "ft"),
    ("foot", "ft"),
    ("litre", "L"),
    ("liter", "L"),
    ("ltr", "L"),
    ("gallon", "gal"),
    ("barrel", "bbl"),
    ("gram", "g"),
    ("kilogram", "kg"),
    ("pound", "lb"),
    ("ton", "t"),
    ("newton", "N"),
    ("pascal", "Pa"),
    ("joule", "J"),
    ("watt", "W"),
    ("volt", "V"),
    ("kelvin", "K"),
    ("celsiu", "degC"),
    ("degree", "deg"),
    ("revolution", "rev"),
];

/// Length limit in bytes: no three units with prefixes are longer.
const LONGEST_PRODUCT: usize = 24;

/// Logarithms of ratios that look like units.
const LOGARITHMS: &[&str] = &["dB", "dBA", "dBm", "dBV", "dBu", "dBi", "dBFS", "Np"];

fn look_up(factor: &grammar::UnitFactor, own: &OwnUnits) -> Result<CatalogueSymbol, UnitError> {
    let whole = format!("{}{}", factor.symbol, factor.digits);
    let one = Exponent::new(1, 1);
    let (symbol, digits) =
        if factor.digits.is_empty() || find(&whole).is_some() || own.get(&whole).is_some() {
            (&whole, one)
        } else {
            // m3 is m^3; several digits are a typing error.
            let digit = (factor.digits.len() == 1).then(|| factor.digits.parse().ok()).flatten();
            (&factor.symbol, digit.and_then(|digit| Exponent::new(digit, 1)))
        };
    if let (Some(unit), Some(digits)) = (own.get(symbol), digits) {
        let (dimension, factor) = (unit.dimension, (unit.factor, 1.0));
        return Ok(CatalogueSymbol { dimension, factor, offset: 0.0, datum: None, digits });
    }
    if let (Some((row, factor)), Some(digits)) = (find(symbol), digits) {
        let (dimension, offset, datum) = (row.dimension, row.offset, row.datum);
        return Ok(CatalogueSymbol { dimension, factor, offset, datum, digits });
    }
    let range = factor.range.clone();
    if LOGARITHMS.contains(&whole.as_str()) {
        return Err(UnitError { range, kind: UnitErrorKind::Logarithm { symbol: whole } });
    }
    let meant = SPELLED_OUT.iter().find(|(word, _)| whole.trim_end_matches('s') == *word);
    let spellings = all_spellings();
    let differs_by_case =
        || spellings.iter().any(|known| known.to_lowercase() == whole.to_lowercase());
    if let Some(product) = product(&factor.symbol, &factor.digits)
        && meant.is_none()
        && !differs_by_case()
    {
        return Err(UnitError { range, kind: UnitErrorKind::Product { symbol: whole, product } });
    }
    let suggestion = if let Some((_, symbol)) = meant {
        Some((*symbol).to_owned())
    } else {
        let known =
            own.iter().map(|(symbol, _)| symbol).chain(spellings.iter().map(String::as_str));
        suggestion(&whole, known).map(str::to_owned)
    };
    Err(UnitError { range, kind: UnitErrorKind::Unknown { symbol: whole, suggestion } })
}

/// Consecutive units such as `Pas`, with operators inserted; the power belongs to the last.
fn product(symbol: &str, digits: &str) -> Option<String> {
    // `bars` and `lbs` are plurals.
    let is_plural = symbol.strip_suffix('s').is_some_and(|stem| {
        stem.len() > 1 && stem.chars().all(char::is_lowercase) && find(stem).is_some()
    });
    let parts = if is_plural { None } else { split(symbol) };
    let power = if digits.is_empty() { String::new() } else { format!("^{digits}") };
    parts.map(|parts| format!("{}{power}", parts.join("*")))
}

/// The two or three units that together form this symbol.
fn split(symbol: &str) -> Option<Vec<&str>> {
    if symbol.len() > LONGEST_PRODUCT {
        return None;
    }
    if let Some((first, second)) = pair(symbol) {
        return Some(vec![first, second]);
    }
    first_units(symbol).find_map(|(first, rest)| {
        let (second, third) = pair(rest)?;
        Some(vec![first, second, third])
    })
}

fn pair(symbol: &str) -> Option<(&str, &str)> {
    first_units(symbol).find(|(_, rest)| find(rest).is_some())
}

/// The units that a symbol begins with, the longest first, with the remainder after each.
fn first_units(symbol: &str) -> impl Iterator<Item = (&str, &str)> {
    let ends = symbol.char_indices().rev().map(|(at, _)| at).filter(|at| *at > 0);
    ends.map(|at| symbol.split_at(at)).filter(|(first, _)| find(first).is_some())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::units::catalogue::{LUMINOUS_INTENSITY, PRESSURE, TIME};
    use crate::units::convert;

    fn unit(text: &str) -> Unit {
        parse_unit(text).unwrap_or_else(|error| panic!("{text}: {error}"))
    }

    /// Relative error of a product and a quotient of correctly rounded numbers.
    const ROUNDING: f64 = 4.0 * f64::EPSILON;

    #[test]
    fn spelled_out_units_lead_to_units() {
        let units: Vec<_> =
            SPELLED_OUT.iter().filter(|(word, _)| parse_unit(word).is_ok()).collect();
        assert!(units.is_empty(), "these are units: {units:?}");
        for (_, symbol) in SPELLED_OUT {
            assert!(parse_unit(symbol).is_ok(), "`{symbol}` is no unit");
        }
        let error = parse_unit("kg/seconds").expect_err("no unit");
        assert_eq!(error.help().as_deref(), Some("did you mean `s`?"));
    }

    #[test]
    fn factors_follow_the_exact_definitions() {
        for (text, factor) in [
            ("psi", 6_894.757_293_168_361),
            ("lpm", 1.0 / 60_000.0),
            ("l/min", 1.0 / 60_000.0),
            ("in", 0.0254),
            ("ppg", 0.453_592_37 / 0.003_785_411_784),
            ("lb/gal", 0.453_592_37 / 0.003_785_411_784),
            ("gpm", 3.785_411_784e-3 / 60.0),
            ("bbl", 0.158_987_294_928),
            ("bbl/min", 0.158_987_294_928 / 60.0),
            ("kg", 1.0),
            ("kg/m^4", 1.0),
            ("Pa*s^2/m^6", 1.0),
            ("%", 0.01),
            ("rpm", 2.0 * std::f64::consts::PI / 60.0),
            ("mbar", 100.0),
            ("mL", 1e-6),
            ("m3/h", 1.0 / 3600.0),
            ("m³/h", 1.0 / 3600.0),
            ("mm^2", 1e-6),
            ("cP", 1e-3),
            ("cSt", 1e-6),
            ("kWh", 3.6e6),
            ("hp", 745.699_871_582_270_2),
            ("mmHg", 133.322_387_415),
            ("inH2O", 249.088_91),
            ("pcf", 16.018_463_373_960_14),
            ("ksi", 6_894_757.293_168_361),
            ("lbf", 4.448_221_615_260_5),
            ("mD", 9.869_232_667_160_13e-16),
            ("µm", 1e-6),
            ("μm", 1e-6),
            ("deg", std::f64::consts::PI / 180.0),
            ("ft^(1/2)", 0.3048_f64.sqrt()),
            ("1", 1.0),
            ("kcal", 4184.0),
            ("cal/(g*K)", 4184.0),
            ("M", 1000.0),
            ("µM", 1e-3),
            ("mol/l", 1000.0),
            ("week", 604_800.0),
            ("year", 365.25 * 86_400.0),
            ("1/yr", 1.0 / (365.25 * 86_400.0)),
            ("mph", 0.447_04),
            ("knot", 1852.0 / 3600.0),
            ("ppm", 1e-6),
            ("ppb", 1e-9),
            ("percent", 0.01),
            ("rev", 2.0 * std::f64::consts::PI),
            ("rev/min", 2.0 * std::f64::consts::PI / 60.0),
            ("msec", 1e-3),
            ("torr", 133.322_368_421_052_63),
            ("mTorr", 0.133_322_368_421_052_63),
            ("Nm", 1.0),
            ("kNm", 1e3),
            ("Nm/rad", 1.0),
            ("eV", 1.602_176_634e-19),
            ("MeV", 1.602_176_634e-13),
            ("kVA", 1e3),
            ("Mvar", 1e6),
            ("mAh", 3.6),
        ] {
            let error = (unit(text).factor / factor - 1.0).abs();
            assert!(error <= ROUNDING, "{text}: {} {factor}", unit(text).factor);
        }
        assert_eq!(unit("lpm").factor, unit("l/min").factor);
        assert_eq!(unit("lb/gal").dimension, unit("sg").dimension);
    }

    #[test]
    fn prefixes_stand_only_where_allowed() {
        for text in ["kmin", "mft", "klpm", "kpsi", "mg/kft", "m%"] {
            assert!(parse_unit(text).is_err(), "{text}");
        }
        assert_eq!(unit("min").dimension, TIME);
        assert_eq!(unit("Pa").dimension, PRESSURE);
        assert_eq!(unit("cd").dimension, LUMINOUS_INTENSITY);
    }

    #[test]
    fn zeros_elsewhere_belong_to_a_unit_alone() {
        let close = |a: f64, b: f64| (a - b).abs() <= ROUNDING * b.abs().max(a.abs());
        let (celsius, fahrenheit, kelvin) = (unit("°C"), unit("degF"), unit("K"));
        assert!(close(celsius.to_si(25.0), 298.15));
        assert!(close(convert(212.0, &fahrenheit, &celsius), 100.0));
        assert!(close(convert(0.0, &kelvin, &celsius), -273.15));
        assert_eq!(unit("W/°C").offset, 0.0);
        assert_eq!(unit("°C").offset, 273.15);
        assert_eq!(unit("°C^2").offset, 0.0);

        let (bar, bara, barg, psig) = (unit("bar"), unit("bara"), unit("barg"), unit("psig"));
        assert!(close(convert(0.0, &barg, &bara), 1.01325));
        assert!(close(convert(1.01325, &bara, &psig), 0.0));
        assert_eq!(convert(2.0, &bar, &bara), 2.0);
        assert_eq!(bara.to_si(1.0), barg.to_si(1.0));
        assert_eq!(unit("bara/s").datum, None);
    }

    #[test]
    fn declared_units_are_read_like_others_and_take_no_prefix() {
        let litre = unit("l");
        let stroke = OwnUnit::from_unit(0.118, &litre);
        let kelvin = OwnUnit::from_unit(2.0, &unit("°C"));
        let units = [("stroke".to_owned(), stroke), ("step2".to_owned(), kelvin)];
        let own = OwnUnits::new(units.into_iter().collect());
        let read = |text: &str| parse_unit_with(text, &own);
        let rate = read("stroke/min").expect("a unit");
        assert_eq!((rate.symbol.as_str(), rate.dimension), ("stroke/min", unit("lpm").dimension));
        assert!((rate.factor / (0.118e-3 / 60.0) - 1.0).abs() <= ROUNDING);
        assert_eq!(read("stroke^2").expect("a unit").factor, 0.118e-3 * 0.118e-3);
        assert_eq!(read("step2").expect("a unit").offset, 0.0);
        let error = read("stroek").expect_err("no unit");
        assert_eq!(error.help().as_deref(), Some("did you mean `stroke`?"));
        assert!(read("kstroke").is_err() && parse_unit("stroke").is_err());
    }

    #[test]
    fn units_without_an_operator_are_told_with_one() {
        for (text, product) in [
            ("Pas", "Pa*s"),
            ("Vs", "V*s"),
            ("mPas", "mPa*s"),
            ("kgm", "kg*m"),
            ("kgm2/s", "kg*m^2"),
            ("Nms", "Nm*s"),
            ("VAh", "VA*h"),
        ] {
            let help = parse_unit(text).expect_err("no unit").help().unwrap_or_default();
            assert_eq!(help, format!("did you mean `{product}`?"), "{text}");
        }
        for (text, meant) in
            [("KPa", "kPa"), ("bars", "bar"), ("lbs", "lb"), ("KW", "kW"), ("rads/s", "rad")]
        {
            let help = parse_unit(text).expect_err("no unit").help().unwrap_or_default();
            assert_eq!(help, format!("did you mean `{meant}`?"), "{text}");
        }
        let error = parse_unit("dB/m").expect_err("no unit");
        assert!(error.to_string().contains("logarithm") && error.range == (0..2), "{error}");
        assert!(error.help().unwrap_or_default().contains("`10^(x/20)`"));
    }

    #[test]
    fn mistakes_are_placed_and_explained() {
        let error = parse_unit("kg/lmp").unwrap_err();
        assert_eq!(error.range, 3..6);
        assert_eq!(error.help().as_deref(), Some("did you mean `lpm`?"));
        assert_eq!(parse_unit("KPa").unwrap_err().help().as_deref(), Some("did you mean `kPa`?"));
        assert_eq!(parse_unit("kg m").unwrap_err().range, 3..4);
        assert_eq!(parse_unit("").unwrap_err().range, 0..0);
        assert_eq!(parse_unit("m33").unwrap_err().range, 0..3);
        let large = parse_unit("km^99*km^99").unwrap_err();
        assert_eq!(large.kind, UnitErrorKind::OutOfRange);
    }
}

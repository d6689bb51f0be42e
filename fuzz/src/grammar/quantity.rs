//! Units and typical sizes of quantities in random models.

/// A unit and the typical size of quantities in it.
#[derive(Debug, PartialEq)]
pub(crate) struct Scale {
    /// The dimension: quantities with the same one can be added.
    pub dimension: &'static str,
    /// Symbol in declarations.
    pub symbol: &'static str,
    /// Size of the quantity, in this unit.
    pub size: f64,
    /// The same size in other units.
    pub others: &'static [&'static str],
    /// Unit of its derivative.
    pub rate: &'static str,
    /// Whether its zero is offset from that of the model's scale: differences from 20 °C.
    pub offset: bool,
}

const fn scale(
    dimension: &'static str,
    symbol: &'static str,
    size: f64,
    rate: &'static str,
    others: &'static [&'static str],
) -> Scale {
    Scale { dimension, symbol, size, others, rate, offset: false }
}

/// Units in which quantities are declared; the first is dimensionless.
pub(crate) const SCALES: &[Scale] = &[
    scale("1", "1", 1.0, "1/s", &[]),
    scale("1", "%", 50.0, "%/s", &["0.5"]),
    scale("m", "cm", 10.0, "cm/s", &["100 [mm]", "0.1 [m]"]),
    scale("m", "ft", 3.0, "ft/s", &["36 [in]"]),
    scale("Pa", "bar", 2.0, "bar/s", &["200 [kPa]", "2e5 [Pa]"]),
    scale("Pa", "kPa", 50.0, "kPa/s", &["0.5 [bar]"]),
    scale("m^3/s", "lpm", 600.0, "lpm/s", &["0.01 [m^3/s]", "36 [m^3/h]"]),
    scale("V", "V", 5.0, "V/s", &["5e3 [mV]"]),
    scale("kg", "kg", 40.0, "kg/s", &["4e4 [g]", "0.04 [t]"]),
    Scale { dimension: "K", symbol: "°C", size: 10.0, others: &[], rate: "K/s", offset: true },
];

impl Scale {
    /// The size as a number with its unit, after an operator; empty if dimensionless.
    pub(crate) fn over(&self, operator: &str) -> String {
        match (self.symbol, self.offset) {
            ("1", _) => String::new(),
            (_, true) => format!("{operator}{} [K]", self.size),
            (symbol, false) => format!("{operator}{} [{symbol}]", self.size),
        }
    }

    /// The size of the derivative, after an operator.
    pub(crate) fn rate_over(&self, operator: &str) -> String {
        format!("{operator}{} [{}]", self.size, self.rate)
    }

    /// A quantity divided by its size.
    pub(crate) fn over_size(&self, text: &str, other: Option<&str>) -> String {
        match (self.symbol, self.offset, other) {
            ("1", _, _) => text.to_owned(),
            (_, true, _) => format!("(({text} - 20 [°C])/{} [K])", self.size),
            (_, _, Some(other)) => format!("({text}/{other})"),
            (symbol, ..) => format!("({text}/{} [{symbol}])", self.size),
        }
    }

    /// A quantity of `scalar` times the size.
    pub(crate) fn quantity(&self, scalar: &str) -> String {
        match (self.symbol, self.offset) {
            ("1", _) => scalar.to_owned(),
            (_, true) => format!("20 [°C] + ({scalar})*{} [K]", self.size),
            (symbol, false) => format!("({scalar})*{} [{symbol}]", self.size),
        }
    }

    /// A number in this unit of `scalar` times the size.
    pub(crate) fn value(&self, scalar: f64) -> f64 {
        let zero = if self.offset { 20.0 } else { 0.0 };
        zero + self.size * scalar
    }

    /// The unit in brackets, as in declarations.
    pub(crate) fn brackets(&self) -> String {
        format!("[{}]", self.symbol)
    }
}

/// The kind of a declared name.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    Constant,
    Parameter,
    Input,
    State,
    Unknown,
    /// A `let` of any dimension.
    Let,
    /// An array, with its last index, from 1.
    Array(u32),
    /// A parameter that is a time, for delays and onsets.
    Delay,
    /// An unknown of a part.
    OfPart,
    /// A variable reset by an `every`; others do not read it, because the order of coinciding ticks would matter.
    Held,
    /// Must not be read: a duplicate of the state that the current equation determines.
    Hidden,
}

/// A declared quantity.
#[derive(Debug, Clone)]
pub(crate) struct Known {
    pub name: String,
    pub scale: &'static Scale,
    pub kind: Kind,
}

impl Known {
    pub(crate) fn new(name: &str, scale: &'static Scale, kind: Kind) -> Self {
        Self { name: name.to_owned(), scale, kind }
    }

    /// Its text in an expression; an array with the index of the loop, or with its last index.
    pub(crate) fn text(&self, index: Option<&str>) -> Option<String> {
        match (self.kind, index) {
            (Kind::Array(_), Some(index)) => Some(format!("{}[{index}]", self.name)),
            (Kind::Array(last), None) => Some(format!("{}[{last}]", self.name)),
            (Kind::Delay, _) => None,
            _ => Some(self.name.clone()),
        }
    }
}

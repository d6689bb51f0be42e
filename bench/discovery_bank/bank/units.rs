//! Units as far as twins need them: what time, length, mass and current a unit has, and what else a column can be
//! written in.

/// Exponents of length, mass, time and current.
pub(crate) type Dimension = [f64; 4];

/// Symbols that may be in the bank's units, without prefixes.
const SYMBOLS: &[(&str, Dimension)] = &[
    ("m", [1.0, 0.0, 0.0, 0.0]),
    ("g", [0.0, 1.0, 0.0, 0.0]),
    ("t", [0.0, 1.0, 0.0, 0.0]),
    ("s", [0.0, 0.0, 1.0, 0.0]),
    ("min", [0.0, 0.0, 1.0, 0.0]),
    ("h", [0.0, 0.0, 1.0, 0.0]),
    ("d", [0.0, 0.0, 1.0, 0.0]),
    ("A", [0.0, 0.0, 0.0, 1.0]),
    ("K", [0.0; 4]),
    ("°C", [0.0; 4]),
    ("mol", [0.0; 4]),
    ("1", [0.0; 4]),
    ("%", [0.0; 4]),
    ("ppm", [0.0; 4]),
    ("rad", [0.0; 4]),
    ("deg", [0.0; 4]),
    ("Hz", [0.0, 0.0, -1.0, 0.0]),
    ("rpm", [0.0, 0.0, -1.0, 0.0]),
    ("l", [3.0, 0.0, 0.0, 0.0]),
    ("L", [3.0, 0.0, 0.0, 0.0]),
    ("lpm", [3.0, 0.0, -1.0, 0.0]),
    ("N", [1.0, 1.0, -2.0, 0.0]),
    ("Pa", [-1.0, 1.0, -2.0, 0.0]),
    ("bar", [-1.0, 1.0, -2.0, 0.0]),
    ("bara", [-1.0, 1.0, -2.0, 0.0]),
    ("barg", [-1.0, 1.0, -2.0, 0.0]),
    ("J", [2.0, 1.0, -2.0, 0.0]),
    ("Wh", [2.0, 1.0, -2.0, 0.0]),
    ("W", [2.0, 1.0, -3.0, 0.0]),
    ("C", [0.0, 0.0, 1.0, 1.0]),
    ("Ah", [0.0, 0.0, 1.0, 1.0]),
    ("V", [2.0, 1.0, -3.0, -1.0]),
    ("ohm", [2.0, 1.0, -3.0, -2.0]),
    ("S", [-2.0, -1.0, 3.0, 2.0]),
    ("F", [-2.0, -1.0, 4.0, 2.0]),
    ("H", [2.0, 1.0, -2.0, -2.0]),
    ("Wb", [2.0, 1.0, -2.0, -1.0]),
    ("T", [0.0, 1.0, -2.0, -1.0]),
];

const PREFIXES: &[&str] = &["k", "M", "G", "m", "µ", "u", "n", "c", "d", "h"];

/// The dimension of a unit such as `kg/(m*s^2)`.
///
/// # Errors
///
/// The symbol that is unknown here.
pub(crate) fn dimension(unit: &str) -> Result<Dimension, String> {
    let mut reader = Reader { text: unit, at: 0 };
    let dimension = reader.product()?;
    if reader.at < unit.len() {
        return Err(format!("`{unit}` is not understood from `{}` on", &unit[reader.at..]));
    }
    Ok(dimension)
}

struct Reader<'a> {
    text: &'a str,
    at: usize,
}

impl Reader<'_> {
    fn rest(&self) -> &str {
        &self.text[self.at..]
    }

    fn takes(&mut self, c: char) -> bool {
        let does = self.rest().starts_with(c);
        self.at += if does { c.len_utf8() } else { 0 };
        does
    }

    fn product(&mut self) -> Result<Dimension, String> {
        let mut all = self.power()?;
        loop {
            let sign = if self.takes('*') {
                1.0
            } else if self.takes('/') {
                -1.0
            } else {
                return Ok(all);
            };
            let factor = self.power()?;
            all = std::array::from_fn(|i| all[i] + sign * factor[i]);
        }
    }

    fn power(&mut self) -> Result<Dimension, String> {
        let base = if self.takes('(') {
            let inner = self.product()?;
            self.takes(')');
            inner
        } else {
            let end = self.rest().find(['*', '/', '^', ')']).unwrap_or(self.rest().len());
            let word = self.rest()[..end].trim().to_owned();
            self.at += end;
            symbol(&word)?
        };
        if !self.takes('^') {
            return Ok(base);
        }
        let exponent = self.exponent()?;
        Ok(base.map(|x| x * exponent))
    }

    fn exponent(&mut self) -> Result<f64, String> {
        let is_fraction = self.takes('(');
        let end =
            if is_fraction { self.rest().find(')') } else { self.rest().find(['*', '/', ')']) };
        let word = self.rest()[..end.unwrap_or(self.rest().len())].to_owned();
        self.at += word.len();
        if is_fraction {
            self.takes(')');
        }
        let number =
            |text: &str| text.trim().parse::<f64>().map_err(|_| format!("`{word}` as an exponent"));
        match word.split_once('/') {
            Some((a, b)) => Ok(number(a)? / number(b)?),
            None => number(&word),
        }
    }
}

fn symbol(word: &str) -> Result<Dimension, String> {
    let of = |word: &str| SYMBOLS.iter().find(|(symbol, _)| *symbol == word).map(|(_, d)| *d);
    let with_prefix = || PREFIXES.iter().find_map(|prefix| of(word.strip_prefix(prefix)?));
    of(word).or_else(with_prefix).ok_or_else(|| format!("the bank does not know the unit `{word}`"))
}

/// Units in which time, length, mass and current are 1000, 100, 1/1000 and 1/100 times as large a number or
/// as small: with the declared numbers kept, another plant with the same equations.
const SCALES: [(&str, &str); 4] = [("s", "ks"), ("cm", "m"), ("t", "kg"), ("A", "cA")];

/// The unit that takes the place of this one when time is scaled and, if asked, everything else as well.
///
/// # Errors
///
/// See [`dimension`].
pub(crate) fn scaled(unit: &str, only_time: bool) -> Result<String, String> {
    let [length, mass, time, current] = dimension(unit)?;
    let mut text = unit.to_owned();
    let mut scale = |exponent: f64, (old, new): (&str, &str)| {
        if exponent == 0.0 {
            return;
        }
        let (over, below) = if exponent > 0.0 { (new, old) } else { (old, new) };
        let power = power(exponent.abs());
        text = format!("{text}*{over}{power}/{below}{power}");
    };
    scale(time, SCALES[0]);
    if !only_time {
        scale(length, SCALES[1]);
        scale(mass, SCALES[2]);
        scale(current, SCALES[3]);
    }
    Ok(text)
}

fn power(exponent: f64) -> String {
    let halves = (2.0 * exponent).round() as i64;
    match halves {
        2 => String::new(),
        _ if halves % 2 == 0 => format!("^{}", halves / 2),
        _ => format!("^({halves}/2)"),
    }
}

/// Another unit of the same quantity, its factor and its offset: a value x is (x − offset)/factor in it.
pub(crate) fn other(unit: &str) -> Option<(&'static str, f64, f64)> {
    const OTHERS: &[(&str, &str, f64, f64)] = &[
        ("m", "ft", 0.3048, 0.0),
        ("cm", "in", 2.54, 0.0),
        ("mm", "in", 25.4, 0.0),
        ("m/s", "ft/min", 0.3048 / 60.0, 0.0),
        ("km/h", "m/s", 3.6, 0.0),
        ("m/s^2", "ft/s^2", 0.3048, 0.0),
        ("rad/s", "rpm", std::f64::consts::TAU / 60.0, 0.0),
        ("rpm", "rad/s", 60.0 / std::f64::consts::TAU, 0.0),
        ("rad", "deg", std::f64::consts::TAU / 360.0, 0.0),
        ("deg", "rad", 360.0 / std::f64::consts::TAU, 0.0),
        ("V", "mV", 1e-3, 0.0),
        ("A", "mA", 1e-3, 0.0),
        ("mA", "A", 1e3, 0.0),
        ("N", "lbf", 4.448_221_615_260_5, 0.0),
        ("N*m", "kgf*m", 9.80665, 0.0),
        ("Pa", "mbar", 100.0, 0.0),
        ("kPa", "psi", 6.894_757_293_168_361, 0.0),
        ("bar", "kPa", 0.01, 0.0),
        ("bara", "psia", 0.068_947_572_931_683_6, 0.0),
        ("lpm", "m^3/h", 1000.0 / 60.0, 0.0),
        ("m^3/h", "lpm", 0.06, 0.0),
        ("l/h", "m^3/d", 1000.0 / 24.0, 0.0),
        ("kg/s", "t/h", 1000.0 / 3600.0, 0.0),
        ("kg/h", "g/s", 3.6, 0.0),
        ("%", "1", 100.0, 0.0),
        ("1", "%", 0.01, 0.0),
        ("ppm", "%", 1e4, 0.0),
        ("°C", "K", 1.0, -273.15),
        ("K", "°C", 1.0, 273.15),
        ("W", "kW", 1e3, 0.0),
        ("kW", "W", 1e-3, 0.0),
        ("g/l", "kg/m^3", 1.0, 0.0),
        ("mol/l", "mol/m^3", 1e-3, 0.0),
        ("1/h", "1/min", 60.0, 0.0),
        ("1/min", "1/s", 60.0, 0.0),
        ("1/s", "1/min", 1.0 / 60.0, 0.0),
        ("W/m^2", "kW/m^2", 1e3, 0.0),
    ];
    let found = OTHERS.iter().find(|(from, ..)| *from == unit)?;
    Some((found.1, found.2, found.3))
}

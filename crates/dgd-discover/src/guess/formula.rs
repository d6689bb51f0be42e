//! A formula of a model's names, in the language.

use std::collections::BTreeSet;
use std::fmt::Write;

use dgd_compiler::model::{DeclarationHeader, Model};
use dgd_compiler::units::{Dimension, Exponent, Unit, describe, parse_unit};

use super::forms::{FORMS, FactorForm, FormConstant};

/// A name of the model that a formula may contain.
#[derive(Debug, Clone)]
pub(crate) struct FormulaFactor {
    pub name: String,
    /// The unit of its differences.
    pub unit: Unit,
    /// Positions of the names whose difference it is.
    pub difference: Option<[usize; 2]>,
}

/// Names that a formula may contain: inputs, time, unknowns, then the differences of those that have the same
/// dimension. Dimensionless names have no differences.
pub(crate) fn names(model: &Model) -> Vec<FormulaFactor> {
    let factor = |declared: &DeclarationHeader| FormulaFactor {
        name: declared.name.clone(),
        unit: declared.unit.of_differences(),
        difference: None,
    };
    let second = parse_unit("s").unwrap_or_else(|_| Unit::one());
    let time = FormulaFactor { name: "time".to_owned(), unit: second, difference: None };
    let inputs = model.inputs.iter().map(|input| factor(&input.declared));
    let unknowns = model.unknowns.iter().map(|unknown| factor(&unknown.declared));
    let mut factors: Vec<FormulaFactor> = inputs.chain([time]).chain(unknowns).collect();
    let time = model.inputs.len();
    let plain = factors.len();
    // An unknown first: a loss is due to the difference of a state from its surroundings.
    for (i, j) in (0..plain).rev().flat_map(|i| (0..i).map(move |j| (i, j))) {
        let [a, b] = [i, j].map(|k| &factors[k]);
        let dimension = a.unit.dimension;
        let is_plain = i != time && j != time && (i > time || j > time);
        if is_plain && dimension != Dimension::ONE && dimension == b.unit.dimension {
            let name = format!("({} - {})", a.name, b.name);
            let unit = a.unit.clone();
            factors.push(FormulaFactor { name, unit, difference: Some([i, j]) });
        }
    }
    factors
}

/// Appends the values of differences to those of the names.
pub(crate) fn with_differences(names: &[FormulaFactor], values: &mut Vec<Vec<f64>>) {
    for [i, j] in names.iter().filter_map(|name| name.difference) {
        let difference = values[i].iter().zip(&values[j]).map(|(a, b)| a - b).collect();
        values.push(difference);
    }
}

/// The factors after a coefficient: forms of at most two names, none for a constant.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct FormulaShape {
    /// For each factor, the positions of the name and of its form in the table.
    pub factors: Vec<(usize, usize)>,
    /// Inner constant of a single factor, SI, if its form has one.
    pub inner: Option<f64>,
}

impl FormulaShape {
    /// A shape of some names, without an inner constant.
    pub(crate) fn new(factors: Vec<(usize, usize)>) -> Self {
        FormulaShape { factors, inner: None }
    }

    pub(crate) fn forms(&self) -> impl Iterator<Item = (usize, &'static FactorForm)> {
        self.factors.iter().map(|(name, form)| (*name, &FORMS[*form]))
    }

    pub(crate) fn complexity(&self) -> u32 {
        self.forms().map(|(_, form)| form.complexity).sum()
    }

    /// Positions of the model's names that it reads.
    pub(crate) fn reads(&self, names: &[FormulaFactor]) -> BTreeSet<usize> {
        let plain = |(name, _): (usize, _)| match names[name].difference {
            Some(both) => both.to_vec(),
            None => vec![name],
        };
        self.forms().flat_map(plain).collect()
    }

    /// Whether its inner constant is a threshold.
    pub(crate) fn has_threshold(&self) -> bool {
        self.forms().any(|(_, form)| form.inner == FormConstant::Thresholds)
    }

    /// The shape without one of several factors.
    pub(crate) fn without(&self, factor: usize) -> Option<Self> {
        if self.factors.len() < 2 {
            return None;
        }
        let mut factors = self.factors.clone();
        let (_, form) = factors.remove(factor);
        let is_plain = FORMS[form].inner == FormConstant::None;
        Some(Self { factors, inner: self.inner.filter(|_| is_plain) }.in_order())
    }

    /// The shape with its factors in the order of the names, divisors last; with an inner constant, as it is.
    pub(crate) fn in_order(mut self) -> Self {
        if self.inner.is_none() {
            self.factors.sort_by_key(|(name, form)| (FORMS[*form].divides(), *name));
        }
        self
    }

    /// The shapes with one of its forms replaced by a plainer one, which has no inner constant.
    pub(crate) fn plainer(&self) -> Vec<Self> {
        let mut shapes = Vec::new();
        for (k, (name, form)) in self.factors.iter().enumerate() {
            let current = &FORMS[*form];
            for (position, plain) in FORMS.iter().enumerate() {
                if plain.inner == FormConstant::None && plain.complexity < current.complexity {
                    let mut factors = self.factors.clone();
                    factors[k] = (*name, position);
                    let inner = self.inner.filter(|_| current.inner == FormConstant::None);
                    shapes.push(Self { factors, inner }.in_order());
                }
            }
        }
        shapes
    }

    /// Its value for given values of all names.
    pub(crate) fn value(&self, at: impl Fn(usize) -> f64) -> f64 {
        let inner = self.inner.unwrap_or(f64::NAN);
        self.forms().map(|(name, form)| (form.value)(at(name), inner)).product()
    }

    /// Unit of its inner constant: that of its quantity.
    pub(crate) fn inner_unit<'a>(&self, names: &'a [FormulaFactor]) -> Option<&'a Unit> {
        self.inner?;
        self.factors.first().map(|(name, _)| &names[*name].unit)
    }

    /// Text after a coefficient: ` * q_ssp*abs(q_ssp)`, empty for a constant; an inner constant is written as a number.
    pub(crate) fn text(&self, names: &[FormulaFactor]) -> String {
        let inner = self.inner_unit(names).zip(self.inner).map(|(unit, inner)| {
            let symbol =
                if unit.symbol == "1" { String::new() } else { format!(" [{}]", unit.symbol) };
            format!("{}{symbol}", literal(inner / unit.factor))
        });
        self.text_with(names, &inner.unwrap_or_default())
    }

    /// [`Self::text`] with the inner constant written as `inner`.
    pub(crate) fn text_with(&self, names: &[FormulaFactor], inner: &str) -> String {
        let factors = self
            .forms()
            .map(|(name, form)| form.text.replace("{}", &names[name].name).replace("{b}", inner));
        let product: String = factors.collect();
        match product.split_at_checked(1) {
            Some((operator, rest)) => format!(" {operator} {rest}"),
            None => product,
        }
    }

    /// Its dimension; `None` if that is out of range.
    pub(crate) fn dimension(&self, names: &[FormulaFactor]) -> Option<Dimension> {
        self.forms().try_fold(Dimension::ONE, |all, (name, form)| {
            let (numerator, denominator) = form.power;
            let power = Exponent::new(numerator, denominator)?;
            all.times(names[name].unit.dimension.power(power)?)
        })
    }

    /// Dimension of its coefficient if the product has the dimension `whole`.
    pub(crate) fn coefficient(
        &self,
        names: &[FormulaFactor],
        whole: Dimension,
    ) -> Option<Dimension> {
        whole.divide(self.dimension(names)?)
    }

    /// A unit of that dimension: a parameter's, or one composed of the declared units of the names.
    pub(crate) fn unit(
        &self,
        names: &[FormulaFactor],
        whole: &Unit,
        model: &Model,
    ) -> Option<Unit> {
        let dimension = self.coefficient(names, whole.dimension)?;
        if dimension == Dimension::ONE {
            return Some(Unit::one());
        }
        let of_parameter = model.parameters.iter().map(|p| p.declared.unit.of_differences());
        // A short SI unit is clearer than a quotient of quotients: `m^2` rather than `W/(W/m^2)`.
        let composed = || {
            let composed = parse_unit(&self.composed(names, whole)).ok()?;
            let plain = parse_unit(&describe(dimension)).ok();
            let shorter = |plain: &Unit| {
                plain.factor == composed.factor && plain.symbol.len() < composed.symbol.len()
            };
            Some(plain.filter(shorter).unwrap_or(composed))
        };
        let units = of_parameter.chain(std::iter::once_with(composed).flatten());
        let mut fitting = units.filter(|unit| unit.dimension == dimension && unit.offset == 0.0);
        fitting.next().or_else(|| parse_unit(&describe(dimension)).ok())
    }

    /// The unit of the whole divided by those of the factors, `bar/(lpm)^2`.
    fn composed(&self, names: &[FormulaFactor], whole: &Unit) -> String {
        let (mut above, mut below) = (vec![in_product(&whole.symbol)], Vec::new());
        for (name, form) in self.forms() {
            let unit = &names[name].unit;
            let (n, d) = form.power;
            if n == 0 || (unit.dimension == Dimension::ONE && unit.factor == 1.0) {
                continue;
            }
            let power = match (n.abs(), d) {
                (1, 1) => String::new(),
                (n, 1) => format!("^{n}"),
                (n, d) => format!("^({n}/{d})"),
            };
            let list = if n > 0 { &mut below } else { &mut above };
            list.push(format!("{}{power}", in_product(&unit.symbol)));
        }
        if above.len() > 1 {
            above.retain(|symbol| symbol != "1");
        }
        match below.as_slice() {
            [] if above.len() == 1 => whole.symbol.clone(),
            [] => above.join("*"),
            [one] => format!("{}/{one}", above.join("*")),
            several => format!("{}/({})", above.join("*"), several.join("*")),
        }
    }
}

/// A unit as a factor in a product.
fn in_product(symbol: &str) -> String {
    if symbol.contains(['*', '/', '^']) { format!("({symbol})") } else { symbol.to_owned() }
}

/// Digits of a coefficient.
const DIGITS: usize = 4;

/// One expression of coefficients, SI, each with its unit and its shape.
pub(crate) fn formula(terms: &[(f64, &Unit, &FormulaShape)], names: &[FormulaFactor]) -> String {
    let mut text = String::new();
    for (i, (coefficient, unit, shape)) in terms.iter().enumerate() {
        let value = coefficient / unit.factor;
        let sign = match (i, value < 0.0) {
            (0, false) => "",
            (0, true) => "-",
            (_, false) => " + ",
            (_, true) => " - ",
        };
        let unit = if unit.symbol == "1" { String::new() } else { format!(" [{}]", unit.symbol) };
        // Writing to a string cannot fail.
        let _ = write!(text, "{sign}{}{unit}{}", literal(value.abs()), shape.text(names));
    }
    text
}

/// A number in plain notation, with a few digits.
pub(crate) fn literal(value: f64) -> String {
    let rounded: f64 = format!("{value:.*e}", DIGITS - 1).parse().unwrap_or(value);
    if rounded == 0.0 || (1e-3..1e6).contains(&rounded.abs()) {
        format!("{rounded}")
    } else {
        format!("{rounded:e}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::guess::forms::position;

    fn names() -> Vec<FormulaFactor> {
        [("q", "lpm"), ("h", "m"), ("w", "m/s")]
            .map(|(name, unit)| FormulaFactor {
                name: name.to_owned(),
                unit: parse_unit(unit).expect("a unit"),
                difference: None,
            })
            .to_vec()
    }

    #[test]
    fn coefficients_have_the_unit_that_balances() {
        let names = names();
        let bar = parse_unit("bar").expect("a unit");
        let model = Model::default();
        for (factors, expected, text) in [
            (vec![(0, position("*{}*abs({})"))], "bar/lpm^2", " * q*abs(q)"),
            (vec![(0, position("*{}")), (1, position("/{}"))], "bar*m/lpm", " * q/h"),
            (vec![(2, position("*sqrt({})"))], "bar/(m/s)^(1/2)", " * sqrt(w)"),
            (vec![(1, position("/{}"))], "bar*m", " / h"),
            (vec![], "bar", ""),
        ] {
            let shape = FormulaShape::new(factors);
            assert_eq!(shape.text(&names), text);
            let unit = shape.unit(&names, &bar, &model).expect("a unit");
            if expected.contains("bar*m/") {
                assert!(["bar*m/lpm"].contains(&unit.symbol.as_str()), "{}", unit.symbol);
            } else {
                assert_eq!(unit.symbol, expected);
            }
            let whole = shape.dimension(&names).and_then(|d| d.times(unit.dimension));
            assert_eq!(whole, Some(bar.dimension), "{text}");
        }
    }

    #[test]
    fn a_formula_reads_as_the_language_has_it() {
        let names = names();
        let per = parse_unit("m/lpm").expect("a unit");
        let metre = parse_unit("m").expect("a unit");
        let (flow, one) =
            (FormulaShape::new(vec![(0, position("*{}"))]), FormulaShape::new(Vec::new()));
        let terms = [(-0.012_345_6 * per.factor, &per, &flow), (3e-7, &metre, &one)];
        assert_eq!(formula(&terms, &names), "-0.01235 [m/lpm] * q + 3e-7 [m]");
    }
}

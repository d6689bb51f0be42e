//! The meaning of a model's text: evaluates expressions as written, without any code of the compiler except its parser
//! and its units.

use std::cell::Cell;
use std::collections::BTreeMap;

use dgd_compiler::syntax::ast::{
    Ast, Comparison, Expr, ExprKind, FactorSide, Item, ItemKind, LocalLet, LoopCounter, Reduction,
    ReductionOperation, Sign, WrittenUnit,
};
use dgd_compiler::units::parse_unit;

/// A model's values, functions and equations.
pub(crate) struct Truth<'a> {
    lets: BTreeMap<&'a str, (&'a Expr, f64, f64)>,
    functions: BTreeMap<&'a str, (Vec<&'a str>, &'a [LocalLet], &'a Expr)>,
    /// Number of SI units in each unit that the model declares.
    units: BTreeMap<&'a str, f64>,
    /// Label, left and right side.
    pub equations: Vec<(&'a str, &'a Expr, &'a Expr)>,
    /// Name, expression, and factor and offset of the unit.
    pub outputs: Vec<(&'a str, &'a Expr, f64, f64)>,
    /// Unknowns with a bound.
    pub saturated: Vec<&'a str>,
}

/// A point at which a model is evaluated, SI.
pub(crate) struct Place<'p> {
    pub t: f64,
    /// Unknowns, inputs and parameters by name; derivatives as `der(x)`.
    pub values: &'p BTreeMap<String, f64>,
    /// Smallest relative difference between the two sides of a comparison.
    pub margin: Cell<f64>,
}

fn unit_of_language(unit: Option<&WrittenUnit>) -> Option<(f64, f64)> {
    let Some(unit) = unit else { return Some((1.0, 0.0)) };
    let unit = parse_unit(&unit.text).ok()?;
    Some((unit.factor, unit.offset))
}

/// The error function, from its Taylor series; ±1 where that is correct to rounding.
fn error_function(x: f64) -> f64 {
    if x.abs() > 6.0 {
        return x.signum();
    }
    // erf x = 2/√π exp(−x²) Σ 2ⁿ x²ⁿ⁺¹/(2n + 1)!!, without cancellation.
    let (mut term, mut sum) = (x, x);
    for n in 1..400 {
        term *= 2.0 * x * x / f64::from(2 * n + 1);
        sum += term;
    }
    std::f64::consts::FRAC_2_SQRT_PI * (-x * x).exp() * sum
}

/// ln Γ(x), from Stirling's series far from zero.
fn log_gamma(x: f64) -> f64 {
    let (mut x, mut less) = (x, 0.0);
    while x < 30.0 {
        less += x.ln();
        x += 1.0;
    }
    let series = 1.0 / (12.0 * x) - 1.0 / (360.0 * x.powi(3)) + 1.0 / (1260.0 * x.powi(5));
    (x - 0.5) * x.ln() - x + 0.5 * (2.0 * std::f64::consts::PI).ln() + series - less
}

/// The derivative of order n + 1 of ln Γ(x), from its sum, whose remainder is an integral plus half a term.
fn polygamma(n: f64, x: f64) -> f64 {
    let (order, many) = (n as i32, 2000);
    let sign = if order % 2 == 0 { -1.0 } else { 1.0 };
    let factorial: f64 = (1..=order).map(f64::from).product();
    let end = x + f64::from(many);
    if order == 0 {
        let sum: f64 = (0..many).map(|k| 1.0 / (x + f64::from(k))).sum();
        return end.ln() - 0.5 / end - 1.0 / (12.0 * end * end) - sum;
    }
    let sum: f64 = (0..many).map(|k| (x + f64::from(k)).powi(-order - 1)).sum();
    let rest =
        end.powi(-order) / n + 0.5 * end.powi(-order - 1) + (n + 1.0) / 12.0 * end.powi(-order - 2);
    sign * factorial * (sum + rest)
}

/// Whether an expression consists of plain numbers, which are in the declared unit.
pub(crate) fn is_plain(expr: &Expr) -> bool {
    match &expr.kind {
        ExprKind::Number { unit, .. } => unit.is_none(),
        ExprKind::Name(name) => name == "pi",
        ExprKind::Element(..) => false,
        _ => dgd_compiler::syntax::visit::operands(expr).into_iter().all(is_plain),
    }
}

impl<'a> Truth<'a> {
    pub(crate) fn new(ast: &'a Ast) -> Option<Self> {
        let mut truth = Self {
            lets: BTreeMap::new(),
            functions: BTreeMap::new(),
            units: BTreeMap::new(),
            equations: Vec::new(),
            outputs: Vec::new(),
            saturated: Vec::new(),
        };
        for item in &ast.items {
            if let ItemKind::Unit { name, value } = &item.kind
                && let ExprKind::Number { value, unit, .. } = &value.kind
            {
                truth.units.insert(&name.text, value * unit_of_language(unit.as_ref())?.0);
            }
        }
        truth.items(&ast.items)?;
        Some(truth)
    }

    fn items(&mut self, items: &'a [Item]) -> Option<()> {
        for item in items {
            match &item.kind {
                ItemKind::Constant { name, unit, value } | ItemKind::Let { name, unit, value } => {
                    let (factor, offset) = self.unit_of(unit.as_ref())?;
                    self.lets.insert(&name.text, (value, factor, offset));
                }
                ItemKind::Function { name, arguments, lets, body } => {
                    let names = arguments.iter().map(|a| a.name.text.as_str()).collect();
                    self.functions.insert(&name.text, (names, lets, body));
                }
                ItemKind::Equation { label, left, right, .. } => {
                    self.equations.push((&label.text, left, right));
                }
                ItemKind::Output { name, unit, value: Some(value), .. } => {
                    let (factor, offset) = self.unit_of(unit.as_ref())?;
                    self.outputs.push((&name.text, value, factor, offset));
                }
                ItemKind::Saturate { name, .. } => self.saturated.push(&name.text),
                ItemKind::Variant { choices, .. } => self.items(&choices.first()?.items)?,
                _ => {}
            }
        }
        Some(())
    }

    /// Factor and offset of a unit; one that the model declares cannot be combined.
    fn unit_of(&self, unit: Option<&WrittenUnit>) -> Option<(f64, f64)> {
        match unit.and_then(|unit| self.units.get(unit.text.as_str())) {
            Some(factor) => Some((*factor, 0.0)),
            None => unit_of_language(unit),
        }
    }

    /// The value of an expression in SI; `None` if it is not supported here.
    pub(crate) fn value(&self, expr: &Expr, at: &Place<'_>) -> Option<f64> {
        self.eval(expr, at, &BTreeMap::new())
    }

    /// The value of a declaration, whose plain numbers are in its unit.
    pub(crate) fn declared(
        &self,
        expr: &Expr,
        (factor, offset): (f64, f64),
        at: &Place<'_>,
    ) -> Option<f64> {
        let value = self.value(expr, at)?;
        Some(if is_plain(expr) { value * factor + offset } else { value })
    }

    fn compare(at: &Place<'_>, a: f64, b: f64) {
        let size = a.abs().max(b.abs()).max(f64::MIN_POSITIVE);
        at.margin.set(at.margin.get().min((a - b).abs() / size));
    }

    /// The name of an element, `x[2][3]`.
    fn element(&self, expr: &Expr, at: &Place<'_>, local: &BTreeMap<&str, f64>) -> Option<String> {
        match &expr.kind {
            ExprKind::Name(name) => Some(name.clone()),
            ExprKind::Element(array, index) => {
                let name = self.element(array, at, local)?;
                Some(format!("{name}[{}]", self.eval(index, at, local)?))
            }
            _ => None,
        }
    }

    /// The values of a sum or a similar reduction, for all indices.
    fn each<'e>(
        &self,
        reduction: &'e Reduction,
        counters: &'e [LoopCounter],
        at: &Place<'_>,
        local: &BTreeMap<&'e str, f64>,
        all: &mut Vec<f64>,
    ) -> Option<()> {
        let Some((LoopCounter { index, range }, inner)) = counters.split_first() else {
            all.push(self.eval(&reduction.body, at, local)?);
            return Some(());
        };
        let [from, to] = [&range.lower, &range.upper].map(|end| self.eval(end, at, local));
        let (mut i, to) = (from?, to?);
        let mut local = local.clone();
        while i <= to {
            local.insert(&index.text, i);
            self.each(reduction, inner, at, &local, all)?;
            i += 1.0;
        }
        Some(())
    }

    fn eval(&self, expr: &Expr, at: &Place<'_>, local: &BTreeMap<&str, f64>) -> Option<f64> {
        let value_of = |expr: &Expr| self.eval(expr, at, local);
        let truth = |holds: bool| f64::from(u8::from(holds));
        Some(match &expr.kind {
            ExprKind::Number { value, unit, .. } => match unit {
                None => *value,
                Some(unit) => {
                    let (factor, offset) = self.unit_of(Some(unit))?;
                    value * factor + offset
                }
            },
            ExprKind::Name(name) => {
                if let Some(value) = local.get(name.as_str()) {
                    *value
                } else if let Some(value) = at.values.get(name) {
                    *value
                } else if let Some((expr, factor, offset)) = self.lets.get(name.as_str()) {
                    self.declared(expr, (*factor, *offset), at)?
                } else {
                    match name.as_str() {
                        "time" => at.t,
                        "pi" => std::f64::consts::PI,
                        _ => return None,
                    }
                }
            }
            ExprKind::Element(..) => *at.values.get(&self.element(expr, at, local)?)?,
            ExprKind::Reduce(reduction) => {
                let mut values = Vec::new();
                self.each(reduction, &reduction.counters, at, local, &mut values)?;
                match reduction.kind {
                    ReductionOperation::Sum => values.iter().sum(),
                    ReductionOperation::Product => values.iter().product(),
                    ReductionOperation::Mean => values.iter().sum::<f64>() / values.len() as f64,
                    ReductionOperation::Least | ReductionOperation::Greatest => {
                        for (k, a) in values.iter().enumerate() {
                            values[..k].iter().for_each(|b| Self::compare(at, *a, *b));
                        }
                        let better = match reduction.kind {
                            ReductionOperation::Least => f64::min,
                            _ => f64::max,
                        };
                        values.into_iter().reduce(better)?
                    }
                }
            }
            ExprKind::List(_) => return None,
            ExprKind::Group(a) => value_of(a)?,
            ExprKind::Negate(a) => -value_of(a)?,
            ExprKind::Sum(terms) => {
                let mut sum = 0.0;
                for (sign, term) in terms {
                    match sign {
                        Sign::Plus => sum += value_of(term)?,
                        Sign::Minus => sum -= value_of(term)?,
                    }
                }
                sum
            }
            ExprKind::Product(factors) => {
                let mut product = 1.0;
                for (factor, of_product) in factors {
                    match factor {
                        FactorSide::Times => product *= value_of(of_product)?,
                        FactorSide::Over => product /= value_of(of_product)?,
                    }
                }
                product
            }
            ExprKind::Power(a, b) => value_of(a)?.powf(value_of(b)?),
            ExprKind::If(condition, a, b) => {
                if value_of(condition)? == 0.0 {
                    value_of(b)?
                } else {
                    value_of(a)?
                }
            }
            ExprKind::Compare(comparison, a, b) => {
                let (a, b) = (value_of(a)?, value_of(b)?);
                Self::compare(at, a, b);
                truth(match comparison {
                    Comparison::Less => a < b,
                    Comparison::LessEqual => a <= b,
                    Comparison::Greater => a > b,
                    Comparison::GreaterEqual => a >= b,
                })
            }
            // All operands are evaluated, to determine the margin.
            ExprKind::And(all) => {
                let values: Option<Vec<f64>> = all.iter().map(value_of).collect();
                truth(values?.iter().all(|holds| *holds != 0.0))
            }
            ExprKind::Or(all) => {
                let values: Option<Vec<f64>> = all.iter().map(value_of).collect();
                truth(values?.iter().any(|holds| *holds != 0.0))
            }
            ExprKind::Not(a) => truth(value_of(a)? == 0.0),
            ExprKind::Call { function, arguments } => {
                if function.text == "der" {
                    let name = match &arguments.first()?.kind {
                        ExprKind::Name(name) => name.clone(),
                        _ => self.element(arguments.first()?, at, local)?,
                    };
                    return at.values.get(&format!("der({name})")).copied();
                }
                let values: Option<Vec<f64>> = if function.text == "delay" {
                    return None;
                } else {
                    arguments.iter().map(value_of).collect()
                };
                let values = values?;
                if let Some((names, lets, body)) = self.functions.get(function.text.as_str()) {
                    let mut local: BTreeMap<&str, f64> =
                        names.iter().copied().zip(values).collect();
                    for one in *lets {
                        let value = self.eval(&one.value, at, &local)?;
                        let (factor, offset) = self.unit_of(one.unit.as_ref())?;
                        let is_plain = is_plain(&one.value) && one.unit.is_some();
                        let value = if is_plain { value * factor + offset } else { value };
                        local.insert(&one.name.text, value);
                    }
                    return self.eval(body, at, &local);
                }
                let (a, b) = (*values.first()?, values.get(1).copied().unwrap_or_default());
                let c = values.get(2).copied().unwrap_or_default();
                // Distance to the nearest step.
                let steps = |x: f64| {
                    at.margin.set(at.margin.get().min((x - x.round()).abs() / x.abs().max(1.0)));
                };
                match function.text.as_str() {
                    "sqrt" => a.sqrt(),
                    "exp" => a.exp(),
                    "log" => a.ln(),
                    "log10" => a.log10(),
                    "sin" => a.sin(),
                    "cos" => a.cos(),
                    "tan" => a.tan(),
                    "asin" => a.asin(),
                    "acos" => a.acos(),
                    "atan" => a.atan(),
                    "atan2" => a.atan2(b),
                    "sinh" => a.sinh(),
                    "cosh" => a.cosh(),
                    "tanh" => a.tanh(),
                    "abs" => a.abs(),
                    "sign" => {
                        at.margin.set(at.margin.get().min(a.abs()));
                        if a == 0.0 { 0.0 } else { a.signum() }
                    }
                    "min" | "complementary" => a.min(b),
                    "max" => a.max(b),
                    "clamp" => a.max(b).min(c),
                    "hypot" => (a * a + b * b).sqrt(),
                    "smoothstep" => {
                        let s = ((c - a) / (b - a)).clamp(0.0, 1.0);
                        s * s * (3.0 - 2.0 * s)
                    }
                    "floor" => {
                        steps(a);
                        a.floor()
                    }
                    "ceil" => {
                        steps(a);
                        a.ceil()
                    }
                    "round" => {
                        steps(a + 0.5);
                        (a + 0.5).floor()
                    }
                    "mod" => {
                        steps(a / b);
                        a - b * (a / b).floor()
                    }
                    "erf" => error_function(a),
                    "erfc" => 1.0 - error_function(a),
                    "lgamma" => log_gamma(a),
                    "polygamma" => polygamma(a, b),
                    _ => return None,
                }
            }
        })
    }
}

//! What the text of a model means: its expressions evaluated as they are written, by no code that the
//! compiler has behind its parser and its units.

use std::cell::Cell;
use std::collections::BTreeMap;

use dgd_compiler::syntax::ast::{
    Ast, Comparison, Expr, ExprKind, Factor, Item, ItemKind, Sign, Unit,
};
use dgd_compiler::units::parse_unit;

/// A model's values, functions and equations.
pub(crate) struct Truth<'a> {
    lets: BTreeMap<&'a str, (&'a Expr, f64, f64)>,
    functions: BTreeMap<&'a str, (Vec<&'a str>, &'a Expr)>,
    /// Label, left and right side.
    pub equations: Vec<(&'a str, &'a Expr, &'a Expr)>,
    /// Name, what it reads, and factor and offset of its unit.
    pub outputs: Vec<(&'a str, &'a Expr, f64, f64)>,
    /// What has a bound.
    pub saturated: Vec<&'a str>,
}

/// Where a model is evaluated, SI.
pub(crate) struct Place<'p> {
    pub t: f64,
    /// Unknowns, inputs and parameters by name; derivatives as `der(x)`.
    pub values: &'p BTreeMap<String, f64>,
    /// How near a comparison came to its other side, relative to both.
    pub margin: Cell<f64>,
}

fn unit_of(unit: Option<&Unit>) -> Option<(f64, f64)> {
    let Some(unit) = unit else { return Some((1.0, 0.0)) };
    let unit = parse_unit(&unit.text).ok()?;
    Some((unit.factor, unit.offset))
}

/// Whether an expression is made of plain numbers, which are in the declared unit.
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
            equations: Vec::new(),
            outputs: Vec::new(),
            saturated: Vec::new(),
        };
        truth.items(&ast.items)?;
        Some(truth)
    }

    fn items(&mut self, items: &'a [Item]) -> Option<()> {
        for item in items {
            match &item.kind {
                ItemKind::Constant { name, unit, value } | ItemKind::Let { name, unit, value } => {
                    let (factor, offset) = unit_of(unit.as_ref())?;
                    self.lets.insert(&name.text, (value, factor, offset));
                }
                ItemKind::Function { name, arguments, body } => {
                    let names = arguments.iter().map(|a| a.name.text.as_str()).collect();
                    self.functions.insert(&name.text, (names, body));
                }
                ItemKind::Equation { label, left, right, .. } => {
                    self.equations.push((&label.text, left, right));
                }
                ItemKind::Output { name, unit, value: Some(value), .. } => {
                    let (factor, offset) = unit_of(unit.as_ref())?;
                    self.outputs.push((&name.text, value, factor, offset));
                }
                ItemKind::Saturate { name, .. } => self.saturated.push(&name.text),
                ItemKind::Variant { choices, .. } => self.items(&choices.first()?.items)?,
                _ => {}
            }
        }
        Some(())
    }

    /// An expression in SI; none where it is beyond what is known here.
    pub(crate) fn value(&self, expr: &Expr, at: &Place<'_>) -> Option<f64> {
        self.eval(expr, at, &BTreeMap::new())
    }

    /// The value of a declaration: plain numbers are in its unit.
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

    fn eval(&self, expr: &Expr, at: &Place<'_>, local: &BTreeMap<&str, f64>) -> Option<f64> {
        let of = |expr: &Expr| self.eval(expr, at, local);
        let truth = |holds: bool| f64::from(u8::from(holds));
        Some(match &expr.kind {
            ExprKind::Number { value, unit, .. } => match unit {
                None => *value,
                Some(unit) => {
                    let (factor, offset) = unit_of(Some(unit))?;
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
            ExprKind::Element(array, index) => {
                let ExprKind::Name(array) = &array.kind else { return None };
                let index = of(index)?;
                *at.values.get(&format!("{array}[{index}]"))?
            }
            ExprKind::Group(a) => of(a)?,
            ExprKind::Negate(a) => -of(a)?,
            ExprKind::Sum(terms) => {
                let mut sum = 0.0;
                for (sign, term) in terms {
                    match sign {
                        Sign::Plus => sum += of(term)?,
                        Sign::Minus => sum -= of(term)?,
                    }
                }
                sum
            }
            ExprKind::Product(factors) => {
                let mut product = 1.0;
                for (factor, of_product) in factors {
                    match factor {
                        Factor::Times => product *= of(of_product)?,
                        Factor::Over => product /= of(of_product)?,
                    }
                }
                product
            }
            ExprKind::Power(a, b) => of(a)?.powf(of(b)?),
            ExprKind::If(condition, a, b) => {
                if of(condition)? == 0.0 {
                    of(b)?
                } else {
                    of(a)?
                }
            }
            ExprKind::Compare(comparison, a, b) => {
                let (a, b) = (of(a)?, of(b)?);
                Self::compare(at, a, b);
                truth(match comparison {
                    Comparison::Less => a < b,
                    Comparison::LessEqual => a <= b,
                    Comparison::Greater => a > b,
                    Comparison::GreaterEqual => a >= b,
                })
            }
            // All are evaluated, for the margin.
            ExprKind::And(all) => {
                let all: Option<Vec<f64>> = all.iter().map(of).collect();
                truth(all?.iter().all(|holds| *holds != 0.0))
            }
            ExprKind::Or(all) => {
                let all: Option<Vec<f64>> = all.iter().map(of).collect();
                truth(all?.iter().any(|holds| *holds != 0.0))
            }
            ExprKind::Not(a) => truth(of(a)? == 0.0),
            ExprKind::Call { function, arguments } => {
                if function.text == "der" {
                    let ExprKind::Name(name) = &arguments.first()?.kind else { return None };
                    return at.values.get(&format!("der({name})")).copied();
                }
                let values: Option<Vec<f64>> = if function.text == "delay" {
                    return None;
                } else {
                    arguments.iter().map(of).collect()
                };
                let values = values?;
                if let Some((names, body)) = self.functions.get(function.text.as_str()) {
                    let local = names.iter().copied().zip(values).collect();
                    return self.eval(body, at, &local);
                }
                let (a, b) = (*values.first()?, values.get(1).copied().unwrap_or_default());
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
                    "min" => a.min(b),
                    "max" => a.max(b),
                    _ => return None,
                }
            }
        })
    }
}

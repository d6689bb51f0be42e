//! A formula as an effect file, with its constants as parameters.

use std::collections::BTreeSet;
use std::fmt::Write;

use dgd_compiler::diagnostics::Diagnostics;
use dgd_compiler::effects::Effect;
use dgd_compiler::model::Model;
use dgd_compiler::source::{SourceMap, SourceText};
use dgd_compiler::syntax::parse;
use dgd_compiler::units::Unit;

use super::formula::{FormulaFactor, FormulaShape, literal};
use super::moments::InputTrace;
use super::regression::RankedFormula;
use super::{FormulaSite, GuessedTerm};
use crate::missing_input::PlaceKind;

/// The range of a quantity over which a formula was compared with recordings.
#[derive(Debug, Clone)]
pub struct LawRange {
    /// The quantity.
    pub name: String,
    /// Its unit; for a temperature, that of differences.
    pub unit: dgd_runtime::Unit,
    /// Its minimum, SI.
    pub low: f64,
    /// Its maximum, SI.
    pub high: f64,
}

/// A parameter of a formula's file: a coefficient, or an inner constant such as the b of tanh(x/b).
#[derive(Debug, Clone)]
pub struct LawParameter {
    /// Its name in the file.
    pub name: String,
    /// Its value, SI.
    pub value: f64,
    /// Its standard deviation; `None` if the data does not determine it.
    pub std: Option<f64>,
    /// Its unit.
    pub unit: dgd_runtime::Unit,
}

/// A term of a formula, fitted.
pub(super) struct FittedTerm<'a> {
    pub(super) shape: FormulaShape,
    /// The coefficient, SI, and its standard deviation.
    pub(super) value: f64,
    pub(super) std: Option<f64>,
    /// Standard deviation of the inner constant, SI.
    pub(super) std_of_inner: Option<f64>,
    pub(super) unit: &'a Unit,
}

impl FittedTerm<'_> {
    pub(super) fn told(&self, names: &[FormulaFactor]) -> GuessedTerm {
        GuessedTerm {
            factor: self.shape.text(names).trim_start().to_owned(),
            coefficient: self.value,
            std: self.std,
            unit: plain(self.unit),
        }
    }
}

/// The constants of a formula as parameters of an effect.
pub(super) struct FormulaConstants<'a> {
    pub(super) terms: Vec<TermConstants<'a>>,
}

/// The constants of one term.
pub(super) struct TermConstants<'a> {
    shape: &'a FormulaShape,
    pub(super) name: String,
    /// The coefficient, SI, and its standard deviation.
    value: f64,
    std: Option<f64>,
    unit: &'a Unit,
    /// Name of the inner constant, if there is one.
    pub(super) inner: Option<String>,
    std_of_inner: Option<f64>,
}

impl<'a> FormulaConstants<'a> {
    /// Numbers coefficients, then inner constants, and skips names that the model already uses.
    pub(super) fn named(
        first: &str,
        terms: impl Iterator<Item = (&'a FormulaShape, f64, &'a Unit)>,
        is_taken: impl Fn(&str) -> bool,
    ) -> Self {
        let mut names = (1..).map(|i| format!("{first}_{i}")).filter(|name| !is_taken(name));
        let mut terms: Vec<TermConstants<'a>> = terms
            .zip(names.by_ref())
            .map(|((shape, value, unit), name)| TermConstants {
                shape,
                name,
                value,
                std: None,
                unit,
                inner: None,
                std_of_inner: None,
            })
            .collect();
        for term in terms.iter_mut().filter(|term| term.shape.inner.is_some()) {
            term.inner = names.next();
        }
        FormulaConstants { terms }
    }

    /// The constants of a fitted law.
    pub(super) fn of_law(terms: &'a [FittedTerm<'a>], is_taken: impl Fn(&str) -> bool) -> Self {
        let coefficients = terms.iter().map(|term| (&term.shape, term.value, term.unit));
        let mut constants = FormulaConstants::named("law", coefficients, is_taken);
        for (constant, term) in constants.terms.iter_mut().zip(terms) {
            (constant.std, constant.std_of_inner) = (term.std, term.std_of_inner);
        }
        constants
    }

    /// All constants, as the file declares them.
    pub(super) fn told(&self, names: &[FormulaFactor]) -> Vec<LawParameter> {
        let of_term = |term: &TermConstants<'_>| {
            let TermConstants { name, value, std, unit, .. } = term;
            let parameter = |name: &String, value, std, unit: &Unit| LawParameter {
                name: name.clone(),
                value,
                std,
                unit: plain(unit),
            };
            let coefficient = parameter(name, *value, *std, unit);
            let inner = term.inner.as_ref().zip(term.shape.inner_unit(names));
            let inner = inner.zip(term.shape.inner);
            let inner =
                inner.map(|((n, unit), value)| parameter(n, value, term.std_of_inner, unit));
            std::iter::once(coefficient).chain(inner).collect::<Vec<_>>()
        };
        self.terms.iter().flat_map(of_term).collect()
    }
}

/// A unit of differences as a unit of the runtime.
pub(crate) fn plain(unit: &Unit) -> dgd_runtime::Unit {
    dgd_runtime::Unit { symbol: unit.symbol.clone().into(), factor: unit.factor, offset: 0.0 }
}

/// Factor by which an inner constant may differ from its initial value: beyond the decades of its grid the form becomes
/// a different one.
const INNER_BOUND: f64 = 100.0;

/// Bounds of an inner constant, as its declaration has them; a threshold has none.
pub(crate) fn bounds(shape: &FormulaShape, value: f64, unit: &Unit) -> String {
    if shape.has_threshold() {
        return String::new();
    }
    let [low, high] =
        [1.0 / INNER_BOUND, INNER_BOUND].map(|factor| literal(factor * value / unit.factor));
    format!("  in {low} .. {high}, log")
}

/// The kind of an effect that adds a sum at a place, and its clause.
pub(crate) fn change(kind: PlaceKind, place: &str, sum: &str) -> (&'static str, String) {
    match kind {
        PlaceKind::Equation => ("plant", format!("add {sum} to {place}")),
        PlaceKind::Parameter => ("plant", format!("replace {place} by {place} + {sum}")),
        PlaceKind::Input => ("input", format!("replace {place} by {place} + {sum}")),
        PlaceKind::Output => ("sensor", format!("replace output {place} by {place} + {sum}")),
    }
}

/// Reads an effect from its text, which is added to the sources.
pub(crate) fn read_effect(file: &str, text: String, sources: &mut SourceMap) -> Option<Effect> {
    let mut diagnostics = Diagnostics::default();
    let id = sources.add(SourceText { name: file.to_owned(), text });
    let ast = parse(id, sources, &mut diagnostics).ok()?;
    Effect::read(ast, &mut diagnostics).ok()
}

/// The formula as an effect, with its coefficients as parameters.
pub(super) fn text(
    model: &Model,
    site: &FormulaSite<'_>,
    constants: &FormulaConstants<'_>,
) -> String {
    let (mut parameters, mut nulls, mut sum) = (String::new(), String::new(), Vec::new());
    let declared = |name: &str, value: f64, unit: &Unit, bounds: &str, std: Option<f64>| {
        let std = std.map(|std| format!("    /// ± {}", literal(std / unit.factor)));
        let value = literal(value / unit.factor);
        format!("parameter {name} [{}] = {value}{bounds}{}\n", unit.symbol, std.unwrap_or_default())
    };
    for term in &constants.terms {
        parameters += &declared(&term.name, term.value, term.unit, "", term.std);
        let inner_constant = term.inner.as_ref().zip(term.shape.inner_unit(&site.names));
        if let Some(((name, unit), value)) = inner_constant.zip(term.shape.inner) {
            parameters +=
                &declared(name, value, unit, &bounds(term.shape, value, unit), term.std_of_inner);
        }
        // Writing to a string cannot fail.
        let _ = writeln!(nulls, "null {} = 0", term.name);
        let inner = term.inner.as_deref().unwrap_or_default();
        sum.push(format!("{}{}", term.name, term.shape.text_with(&site.names, inner)));
    }
    let (model, sum) = (&model.name, sum.join(" + "));
    let (kind, change) = change(site.kind, site.name, &sum);
    format!("effect guess on {model}\nkind {kind}\n\n{parameters}{nulls}\n{change}\n")
}

/// Ranges of the names in a formula, in the training recordings.
pub(super) fn ranges(
    site: &FormulaSite<'_>,
    ranked: &RankedFormula,
    train: &[InputTrace],
) -> Vec<LawRange> {
    let used: BTreeSet<usize> =
        ranked.terms.iter().flat_map(|(shape, _)| shape.reads(&site.names)).collect();
    let range = |name: usize| {
        let values = train.iter().flat_map(|trace| trace.names[name].iter().copied());
        let (low, high) = values
            .filter(|value| value.is_finite())
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(x), b.max(x)));
        let FormulaFactor { name, unit, .. } = &site.names[name];
        LawRange { name: name.clone(), unit: plain(unit), low, high }
    };
    used.into_iter().map(range).collect()
}

impl LawRange {
    fn words(&self) -> String {
        let [low, high] = [self.low, self.high].map(|x| literal(x / self.unit.factor));
        format!("`{}` between {low} and {high} {}", self.name, self.unit.symbol)
    }
}

/// The effect file, with standard deviations and the ranges over which the formula was compared.
pub(super) fn law(
    model: &Model,
    site: &FormulaSite<'_>,
    constants: &FormulaConstants<'_>,
    formula: &str,
    ranges: &[LawRange],
) -> String {
    let place = match site.kind {
        PlaceKind::Equation => format!("the equation `{}` lacks", site.name),
        PlaceKind::Parameter => format!("the parameter `{}` changes by", site.name),
        PlaceKind::Input => format!("the input `{}` acts more by", site.name),
        PlaceKind::Output => format!("the sensor `{}` reads more by", site.name),
    };
    let mut doc = format!(
        "/// A formula found in recordings: {place} `{formula}`.\n///\n/// It describes them and is not confirmed."
    );
    let within: Vec<String> = ranges.iter().map(LawRange::words).collect();
    if !within.is_empty() {
        let _ = write!(doc, " It was compared with them for {}.", within.join(", "));
    }
    let text = text(model, site, constants);
    format!("{doc}\n{text}").replacen("effect guess on", "effect law on", 1)
}

//! Fixes for unit errors: a number gets the unit of its neighbour, and an expression of another dimension is multiplied
//! or divided by a declared quantity, such as a volume flow by a density.

use dgd_compiler::diagnostics::{Code, Diagnostic, FixEdit};
use dgd_compiler::source::{SourceId, Span};
use dgd_compiler::syntax::ast::{ItemKind, WrittenUnit};
use dgd_compiler::syntax::{own_units, visit};
use dgd_compiler::units::{Dimension, describe, parse_unit_with};

use crate::analysis::Analysis;

/// Maximum number of proposals; with more, none is made.
const MOST: usize = 3;

/// Maximum number of characters of an expression in a title.
const LONGEST: usize = 30;

/// A proposal: its title and its edits.
pub(super) type ConversionProposal = (String, Vec<FixEdit>);

/// Proposals for a unit error.
pub(super) fn conversions(diagnostic: &Diagnostic, analysis: &Analysis) -> Vec<ConversionProposal> {
    let [wrong, others @ ..] = diagnostic.labels.as_slice() else { return Vec::new() };
    let span = wrong.span;
    let Some(found) = dimension_at(span, analysis) else { return Vec::new() };
    match (diagnostic.code, others) {
        (Code::IncompatibleUnits | Code::UnitsOfSides, [other]) => {
            let Some(wanted) = dimension_at(other.span, analysis) else { return Vec::new() };
            let numbers = [(span, found, wanted), (other.span, wanted, found)];
            let number = numbers
                .iter()
                .find(|(_, own, _)| *own == Dimension::ONE)
                .and_then(|(span, _, other)| with_unit(*span, *other, analysis));
            let scaled = || {
                let other = scaled(other.span, wanted, found, analysis);
                [scaled(span, found, wanted, analysis), other].concat()
            };
            number.map_or_else(scaled, |one| vec![one])
        }
        (Code::UnitsOfSides, []) => {
            let declared = declared_around(span, analysis);
            declared.map_or(Vec::new(), |wanted| scaled(span, found, wanted, analysis))
        }
        (Code::ArgumentWithUnit, []) => scaled(span, found, Dimension::ONE, analysis),
        _ => Vec::new(),
    }
}

/// The dimension of the expression at a span; for a sum, that of its first term, which all terms share.
fn dimension_at(span: Span, analysis: &Analysis) -> Option<Dimension> {
    let first = |(other, _): &(&Span, &Dimension)| {
        other.source == span.source && other.start == span.start && other.end <= span.end
    };
    let starting = analysis.dimensions.iter().filter(first);
    starting.max_by_key(|(other, _)| other.end).map(|(_, dimension)| *dimension)
}

/// Adds a unit to a plain number.
fn with_unit(span: Span, wanted: Dimension, analysis: &Analysis) -> Option<ConversionProposal> {
    let text = analysis.sources.text(span);
    text.parse::<f64>().ok()?;
    let unit = spelt(wanted, analysis);
    Some((
        format!("Write `{text} [{unit}]`"),
        vec![FixEdit::insert_after(span, format!(" [{unit}]"))],
    ))
}

/// A dimension in the file's first spelling, else in base units.
fn spelt(wanted: Dimension, analysis: &Analysis) -> String {
    let quantity =
        declared(analysis).into_iter().find(|one| one.dimension == wanted && one.is_coherent);
    quantity.map_or_else(|| describe(wanted), |one| one.unit.to_owned())
}

/// Products and quotients of an expression and declared quantities that have the wanted dimension.
fn scaled(
    span: Span,
    found: Dimension,
    wanted: Dimension,
    analysis: &Analysis,
) -> Vec<ConversionProposal> {
    if span.source != SourceId(0) {
        return Vec::new();
    }
    let (Some(factor), Some(divisor)) = (wanted.divide(found), found.divide(wanted)) else {
        return Vec::new();
    };
    let mut proposals = Vec::new();
    for one in declared(analysis) {
        let (doing, sign) = match one.dimension {
            dimension if dimension == factor => ("Multiply", '*'),
            dimension if dimension == divisor => ("Divide", '/'),
            _ => continue,
        };
        let mut edits = vec![FixEdit::insert_after(span, format!("{sign}{}", one.name))];
        let text = analysis.sources.text(span);
        if !is_factor(text) {
            edits = vec![
                FixEdit::insert_before(span, "("),
                FixEdit::insert_after(span, format!("){sign}{}", one.name)),
            ];
        }
        proposals.push((format!("{doing} {} by `{}`", quoted(text), one.name), edits));
    }
    if proposals.len() > MOST { Vec::new() } else { proposals }
}

/// An expression in a title, with the middle of a long one elided.
fn quoted(text: &str) -> String {
    let characters: Vec<char> = text.chars().filter(|c| *c != '\n').collect();
    if characters.len() <= LONGEST {
        return format!("`{text}`");
    }
    let end = |part: &[char]| part.iter().collect::<String>();
    format!(
        "`{}…{}`",
        end(&characters[..LONGEST / 2]),
        end(&characters[characters.len() - LONGEST / 2..])
    )
}

/// Whether a text can be a factor without parentheses.
fn is_factor(text: &str) -> bool {
    let (mut depth, mut is_factor) = (0, true);
    for c in text.chars() {
        match c {
            '(' | '[' => depth += 1,
            ')' | ']' => depth -= 1,
            '+' | '-' | '<' | '>' if depth == 0 => is_factor = false,
            _ => {}
        }
    }
    is_factor && !text.starts_with("if ")
}

/// A constant or parameter of the document.
struct DocumentQuantity<'a> {
    name: &'a str,
    unit: &'a str,
    dimension: Dimension,
    /// Whether its unit is coherent with SI.
    is_coherent: bool,
}

fn declared(analysis: &Analysis) -> Vec<DocumentQuantity<'_>> {
    let mut quantities = Vec::new();
    let units = own_units::all(&analysis.asts);
    visit::items(&analysis.asts[0].items, &mut |item| {
        let (ItemKind::Constant { name, unit: Some(WrittenUnit { text, .. }), .. }
        | ItemKind::Parameter { name, unit: Some(WrittenUnit { text, .. }), .. }) = &item.kind
        else {
            return;
        };
        if let Ok(unit) = parse_unit_with(text, &units)
            && unit.dimension != Dimension::ONE
        {
            let is_coherent = unit.factor == 1.0 && unit.offset == 0.0;
            quantities.push(DocumentQuantity {
                name: &name.text,
                unit: text,
                dimension: unit.dimension,
                is_coherent,
            });
        }
    });
    quantities
}

/// The declared dimension of the item around a span.
fn declared_around(place: Span, analysis: &Analysis) -> Option<Dimension> {
    let mut dimension = None;
    let units = own_units::all(&analysis.asts);
    visit::items(&analysis.asts[0].items, &mut |item| {
        let is_around = item.span.source == place.source
            && item.span.start <= place.start
            && place.end <= item.span.end;
        let (ItemKind::Constant { unit, .. }
        | ItemKind::Parameter { unit, .. }
        | ItemKind::Unknown { unit, .. }
        | ItemKind::Output { unit, .. }
        | ItemKind::Let { unit, .. }) = &item.kind
        else {
            return;
        };
        if is_around {
            dimension = unit.as_ref().and_then(|unit| parse_unit_with(&unit.text, &units).ok());
        }
    });
    dimension.map(|unit| unit.dimension)
}

//! Whole numbers that are constant: sizes, the ends of ranges, and indices.

use std::collections::BTreeMap;

use super::names::names_in;
use crate::diagnostics::{Code, Diagnostic, Diagnostics, ErrorReported};
use crate::source::Span;
use crate::syntax::ast::{Expr, ExprKind, FactorSide, Item, ItemKind, Name, NumberRange, Sign};

/// Sizes and indices stay below this, so that they are exact as numbers and fit into memory.
const LARGEST: i64 = 10_000_000;

/// The index of an open loop.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(in crate::model) struct LoopIndex<'a> {
    /// Its name.
    pub(in crate::model) name: &'a str,
    /// Its value at the first passage.
    pub(in crate::model) first: i64,
    /// Number of passages.
    pub(in crate::model) count: u32,
}

/// The innermost open index of this name.
pub(in crate::model) fn open_index<'a>(
    indices: &[LoopIndex<'a>],
    name: &str,
) -> Option<LoopIndex<'a>> {
    indices.iter().rev().find(|index| index.name == name).copied()
}

/// A whole number that may move with the loop: `at` + `slope` k at passage k.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(in crate::model) struct AffineInteger {
    pub(in crate::model) at: i64,
    pub(in crate::model) slope: i64,
}

/// First index and number of elements.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::model) struct IndexExtent {
    pub(in crate::model) lower: i64,
    pub(in crate::model) count: u32,
}

/// Sizes by name; an error proves that a failed one was reported.
pub(in crate::model) type NamedSizes<'a> = BTreeMap<&'a str, Result<i64, ErrorReported>>;

/// The value of an expression of sizes and the loop's index.
pub(in crate::model) fn whole(
    expr: &Expr,
    sizes: &NamedSizes<'_>,
    indices: &[LoopIndex<'_>],
    diagnostics: &mut Diagnostics,
) -> Result<AffineInteger, ErrorReported> {
    let refusal = |what: String| {
        Diagnostic::new(Code::NotAKnownWholeNumber, expr.span, what)
            .help("use whole numbers, sizes and the loop's index, as in `N + 1` or `i - 1`")
    };
    let refuse =
        |diagnostics: &mut Diagnostics, what: String| Err(diagnostics.error(refusal(what)));
    let result = match &expr.kind {
        ExprKind::Number { value, unit: None, .. }
            if value.fract() == 0.0 && value.abs() <= LARGEST as f64 =>
        {
            Some(AffineInteger { at: *value as i64, slope: 0 })
        }
        ExprKind::Number { text, .. } => {
            return refuse(diagnostics, format!("`{text}` is no whole number that can count"));
        }
        ExprKind::Name(name) => match (open_index(indices, name), sizes.get(name.as_str())) {
            (Some(index), _) => {
                let slope = i64::from(index.count > 1);
                Some(AffineInteger { at: index.first, slope })
            }
            (None, Some(size)) => Some(AffineInteger { at: (*size)?, slope: 0 }),
            (None, None) => {
                let what = format!("`{name}` is neither a size nor the index of a loop here");
                return Err(diagnostics.error(refusal(what).about(name)));
            }
        },
        ExprKind::Group(inner) => Some(whole(inner, sizes, indices, diagnostics)?),
        ExprKind::Negate(inner) => {
            let AffineInteger { at, slope } = whole(inner, sizes, indices, diagnostics)?;
            Some(AffineInteger { at: -at, slope: -slope })
        }
        ExprKind::Sum(terms) => {
            let mut sum = AffineInteger { at: 0, slope: 0 };
            for (sign, term) in terms {
                let term = whole(term, sizes, indices, diagnostics)?;
                let sign = if *sign == Sign::Plus { 1 } else { -1 };
                sum = AffineInteger {
                    at: sum.at + sign * term.at,
                    slope: sum.slope + sign * term.slope,
                };
            }
            Some(sum)
        }
        ExprKind::Product(factors) => {
            let mut product = Some(AffineInteger { at: 1, slope: 0 });
            for (factor, operand) in factors {
                let operand = whole(operand, sizes, indices, diagnostics)?;
                product = product.and_then(|product| match factor {
                    FactorSide::Times => product.times(operand),
                    FactorSide::Over => product.divide(operand),
                });
            }
            product
        }
        ExprKind::Element(..)
        | ExprKind::Reduce(_)
        | ExprKind::List(_)
        | ExprKind::Call { .. }
        | ExprKind::Power(..)
        | ExprKind::If(..)
        | ExprKind::Compare(..)
        | ExprKind::And(_)
        | ExprKind::Or(_)
        | ExprKind::Not(_) => None,
    };
    match result {
        Some(result) if result.at.abs() <= LARGEST && result.slope.abs() <= LARGEST => Ok(result),
        Some(_) => refuse(diagnostics, format!("this is beyond {LARGEST}")),
        None => refuse(diagnostics, "this does not come to a whole number".to_owned()),
    }
}

impl AffineInteger {
    fn times(self, other: AffineInteger) -> Option<AffineInteger> {
        let (moving, still) = if self.slope == 0 { (other, self) } else { (self, other) };
        (still.slope == 0)
            .then_some(())
            .and_then(|()| Some((moving.at.checked_mul(still.at)?, moving.slope * still.at)))
            .map(|(at, slope)| AffineInteger { at, slope })
    }

    fn divide(self, other: AffineInteger) -> Option<AffineInteger> {
        let exact = other.slope == 0
            && other.at != 0
            && self.at % other.at == 0
            && self.slope % other.at == 0;
        exact.then(|| AffineInteger { at: self.at / other.at, slope: self.slope / other.at })
    }
}

/// The indices of a range whose ends may read open indices that do not move.
pub(in crate::model) fn extent_within(
    range: &NumberRange,
    sizes: &NamedSizes<'_>,
    indices: &[LoopIndex<'_>],
    diagnostics: &mut Diagnostics,
) -> Result<IndexExtent, ErrorReported> {
    let lower = whole(&range.lower, sizes, indices, diagnostics);
    let upper = whole(&range.upper, sizes, indices, diagnostics);
    let (lower, upper) = (lower?, upper?);
    for (end, expr) in [(lower, &range.lower), (upper, &range.upper)] {
        if end.slope != 0 {
            let message = "the end of this range moves with the loop";
            return Err(diagnostics.error(
                Diagnostic::new(Code::NotAKnownWholeNumber, expr.span, message)
                    .help("let it be the same for all indices, or write the loop out"),
            ));
        }
    }
    between(lower.at, upper.at, range.span, diagnostics)
}

/// The indices of a range of whole numbers; empty if it ends just before it begins.
pub(in crate::model) fn extent(
    range: &NumberRange,
    sizes: &NamedSizes<'_>,
    diagnostics: &mut Diagnostics,
) -> Result<IndexExtent, ErrorReported> {
    extent_within(range, sizes, &[], diagnostics)
}

fn between(
    lower: i64,
    upper: i64,
    span: Span,
    diagnostics: &mut Diagnostics,
) -> Result<IndexExtent, ErrorReported> {
    match u32::try_from(upper - lower + 1) {
        Ok(count) => Ok(IndexExtent { lower, count }),
        Err(_) => Err(diagnostics.error(
            Diagnostic::new(
                Code::NotAKnownWholeNumber,
                span,
                format!("no index runs from {lower} to {upper}"),
            )
            .help("write the smaller end first"),
        )),
    }
}

/// Evaluates the sizes, each after those that it depends on.
pub(in crate::model) fn sizes_of<'a>(
    items: &[&'a Item],
    settings: &BTreeMap<&str, &'a Expr>,
    diagnostics: &mut Diagnostics,
) -> NamedSizes<'a> {
    let mut open: Vec<(&'a Name, &'a Expr)> = Vec::new();
    for item in items {
        if let ItemKind::Size { name, value } = &item.kind {
            open.push((name, settings.get(name.text.as_str()).copied().unwrap_or(value)));
        }
    }
    let position: BTreeMap<&str, usize> =
        open.iter().enumerate().map(|(i, (name, _))| (name.text.as_str(), i)).collect();
    let mut users = vec![Vec::new(); open.len()];
    let mut missing = vec![0_usize; open.len()];
    for (user, (_, value)) in open.iter().enumerate() {
        let mut names = Vec::new();
        names_in(value, &mut names);
        for needed in names.iter().filter_map(|name| position.get(name)) {
            users[*needed].push(user);
            missing[user] += 1;
        }
    }
    let mut sizes = NamedSizes::new();
    let mut ready: Vec<usize> = (0..open.len()).filter(|i| missing[*i] == 0).collect();
    while let Some(i) = ready.pop() {
        let (name, value) = open[i];
        let size = whole(value, &sizes, &[], diagnostics).and_then(|size| {
            if size.at >= 0 {
                return Ok(size.at);
            }
            let message = format!("the size `{}` comes to {}", name.text, size.at);
            Err(diagnostics.error(
                Diagnostic::new(Code::NotAKnownWholeNumber, value.span, message).about(&name.text),
            ))
        });
        sizes.insert(&name.text, size);
        for user in std::mem::take(&mut users[i]) {
            missing[user] -= 1;
            if missing[user] == 0 {
                ready.push(user);
            }
        }
    }
    for (i, (name, value)) in open.iter().enumerate() {
        if missing[i] > 0 && !sizes.contains_key(name.text.as_str()) {
            sizes.insert(&name.text, Err(depends_on_itself(name, value.span, diagnostics)));
        }
    }
    sizes
}

fn depends_on_itself(name: &Name, value: Span, diagnostics: &mut Diagnostics) -> ErrorReported {
    let message = format!("the size `{}` depends on itself", name.text);
    diagnostics.error(
        Diagnostic::new(Code::CircularDefinition, name.span, message)
            .about(&name.text)
            .label(value, "through this"),
    )
}

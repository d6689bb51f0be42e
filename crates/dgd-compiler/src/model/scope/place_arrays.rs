//! Works out the positions of arrays and the ranges of loops.

use std::collections::BTreeMap;

use super::place::{ArrayPlace, LetArray};
use super::shape::{ArrayShape, brackets};
use super::whole::{IndexExtent, extent, sizes_of};
use super::{ModelScope, NameDefinition};
use crate::diagnostics::{Code, Diagnostic, Diagnostics, ErrorReported};
use crate::syntax::ast::{ArrayAxis, ArrayKind, Expr, Item, ItemKind, LoopCounter, Name};
use crate::syntax::edit::element_of;

/// All arrays together have at most this many elements.
const MOST_ELEMENTS: u32 = 10_000_000;

/// Limit on the constants, parameters and inputs in arrays: each has a name and a value.
const MOST_VALUES: u32 = 100_000;

impl<'a> ModelScope<'a> {
    /// Evaluates the sizes, and with them the positions of arrays and the ranges of loops.
    pub(in crate::model) fn place_arrays(
        &mut self,
        items: &[&'a Item],
        settings: &BTreeMap<&str, &'a Expr>,
        diagnostics: &mut Diagnostics,
    ) {
        self.sizes = sizes_of(items, settings, diagnostics);
        let mut first = 0_u32;
        let [mut constants, mut parameters, mut inputs] = self.n_scalars;
        for item in items {
            match &item.kind {
                ItemKind::Array { declared, name, axes, .. } => {
                    for index in axes.iter().filter_map(|axis| axis.index.as_ref()) {
                        self.verify_index(index, diagnostics);
                    }
                    let (next, most) = match declared {
                        ArrayKind::Constant => (&mut constants, MOST_VALUES),
                        ArrayKind::Parameter => (&mut parameters, MOST_VALUES),
                        ArrayKind::Input => (&mut inputs, MOST_VALUES),
                        ArrayKind::State | ArrayKind::Unknown | ArrayKind::Held => {
                            (&mut first, MOST_ELEMENTS)
                        }
                    };
                    let place = self.place(name, axes, next, most, diagnostics);
                    if declared.is_unknown() {
                        self.arrays.push(place);
                    } else if let Some(vector) = self.vectors.iter_mut().find(|v| v.name == name) {
                        vector.place = place;
                    }
                }
                ItemKind::For { counters, items } => {
                    for (i, LoopCounter { index, .. }) in counters.iter().enumerate() {
                        self.verify_index(index, diagnostics);
                        if let Some(first) =
                            counters[..i].iter().find(|c| c.index.text == index.text)
                        {
                            let message = format!("two indices are called `{}`", index.text);
                            diagnostics.error(
                                Diagnostic::new(Code::DuplicateName, index.span, message)
                                    .about(&index.text)
                                    .label(first.index.span, "first here"),
                            );
                        }
                    }
                    let shape = self.shape(counters.iter().map(|c| &c.range), diagnostics);
                    self.loops.push(shape.clone());
                    for item in items {
                        if let ItemKind::Let { name, unit, value } = &item.kind {
                            self.let_arrays.push(LetArray {
                                name: &name.text,
                                counters,
                                shape: shape.clone(),
                                unit: unit.as_ref(),
                                value,
                            });
                        }
                    }
                }
                _ => {}
            }
        }
        self.verify_set_elements(settings, diagnostics);
    }

    fn shape<'r>(
        &self,
        ranges: impl Iterator<Item = &'r crate::syntax::ast::NumberRange>,
        diagnostics: &mut Diagnostics,
    ) -> Result<ArrayShape, ErrorReported> {
        let extents: Vec<Result<IndexExtent, ErrorReported>> =
            ranges.map(|range| extent(range, &self.sizes, diagnostics)).collect();
        Ok(ArrayShape::new(extents.into_iter().collect::<Result<_, _>>()?))
    }

    /// Places an array after those before it.
    fn place(
        &self,
        name: &'a Name,
        axes: &[ArrayAxis],
        next: &mut u32,
        most: u32,
        diagnostics: &mut Diagnostics,
    ) -> Result<ArrayPlace<'a>, ErrorReported> {
        let shape = self.shape(axes.iter().map(|axis| &axis.range), diagnostics)?;
        let empty = shape.axes().iter().position(|axis| axis.count == 0);
        let end = shape.count().and_then(|count| next.checked_add(count));
        let end = end.filter(|end| *end <= most);
        let message = match (empty, end) {
            (Some(_), _) => format!("`{}` has no elements", name.text),
            (None, None) if most == MOST_VALUES => {
                format!("the constants, parameters or inputs are more than {most}")
            }
            (None, None) => format!("the arrays have more than {most} elements"),
            (None, Some(end)) => {
                let first = std::mem::replace(next, end);
                return Ok(ArrayPlace { name: &name.text, first, shape });
            }
        };
        let span = axes[empty.unwrap_or(0)].range.span;
        let diagnostic = Diagnostic::new(Code::NotAKnownWholeNumber, span, message);
        Err(diagnostics.error(diagnostic.about(&name.text)))
    }

    /// Checks that elements that are set from outside, `k[2]`, exist.
    fn verify_set_elements(
        &self,
        settings: &BTreeMap<&str, &'a Expr>,
        diagnostics: &mut Diagnostics,
    ) {
        for (name, value) in settings {
            let Some((of, indices)) = element_of(name) else { continue };
            let Some(NameDefinition::Vector(vector)) =
                self.names.get(of).map(|entry| entry.definition)
            else {
                continue;
            };
            let Ok(place) = &self.vectors[vector].place else { continue };
            if place.shape.position(&indices).is_none() {
                let axes = place.shape.axes().iter();
                let ranges: Vec<String> = axes
                    .map(|axis| {
                        format!("{}..{}", axis.lower, axis.lower + i64::from(axis.count) - 1)
                    })
                    .collect();
                let message = format!(
                    "`{of}` has no element {}: it runs over [{}]",
                    brackets(&indices),
                    ranges.join("][")
                );
                diagnostics
                    .error(Diagnostic::new(Code::IndexOutOfRange, value.span, message).about(of));
            }
        }
    }
}

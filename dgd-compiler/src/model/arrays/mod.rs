//! Arrays of unknowns, loops over equations, and elements in expressions.

pub(super) mod whole;

use std::collections::BTreeMap;

use self::whole::{AffineInteger, Extent, LoopIndex, extent, sizes_of, whole};
use super::check_units::Dim;
use super::define::{Definition, Entry, Scope};
use super::expression::{Arguments, Lowering, Typed, unit_of};
use super::item::{UnknownDeclaration, unit_read};
use super::resolve::{Reading, Resolver};
use super::{Array, Declared, Family, OutputArray};
use crate::diagnostics::{Code, Diagnostic, Diagnostics, Reported};
use crate::expr::{Node, Symbol};
use crate::source::Span;
use crate::syntax::ast::{Attribute, Expr, ExprKind, Item, ItemKind, Name, Unit as WrittenUnit};
use crate::units::{Dimension, Unit};

/// All arrays together have at most this many elements.
const MOST_ELEMENTS: u32 = 10_000_000;

/// Where the elements of an array are among those of all arrays.
#[derive(Debug, Clone, Copy)]
pub(super) struct ArrayPlace<'a> {
    pub(super) name: &'a str,
    pub(super) first: u32,
    pub(super) lower: i64,
    pub(super) count: u32,
}

/// A `let` of a loop: an expression for each index.
#[derive(Debug, Clone, Copy)]
pub(super) struct LetArray<'a> {
    pub(super) name: &'a str,
    /// What the index is called in `value`.
    pub(super) index: &'a str,
    pub(super) extent: Result<Extent, Reported>,
    pub(super) unit: Option<&'a WrittenUnit>,
    pub(super) value: &'a Expr,
}

impl ArrayPlace<'_> {
    /// The name of the element at this position among those of all arrays.
    fn element(&self, position: u32) -> Option<String> {
        let offset = position.checked_sub(self.first).filter(|offset| *offset < self.count)?;
        Some(format!("`{}[{}]`", self.name, self.lower + i64::from(offset)))
    }
}

impl<'a> Scope<'a> {
    /// Works out the sizes, and with them where arrays and loops begin and end.
    pub(super) fn place_arrays(
        &mut self,
        items: &[&'a Item],
        settings: &BTreeMap<&str, &'a Expr>,
        diagnostics: &mut Diagnostics,
    ) {
        self.sizes = sizes_of(items, settings, diagnostics);
        let mut first = 0_u32;
        for item in items {
            match &item.kind {
                ItemKind::Array { name, index, range, .. } => {
                    if let Some(index) = index {
                        self.verify_index(index, diagnostics);
                    }
                    let extent = extent(range, &self.sizes, diagnostics);
                    let place = extent.and_then(|Extent { lower, count }| {
                        let end = first.checked_add(count).filter(|end| *end <= MOST_ELEMENTS);
                        let message = match end {
                            Some(_) if count == 0 => format!("`{}` has no elements", name.text),
                            None => format!("the arrays have more than {MOST_ELEMENTS} elements"),
                            Some(end) => {
                                let begin = std::mem::replace(&mut first, end);
                                return Ok(ArrayPlace {
                                    name: &name.text,
                                    first: begin,
                                    lower,
                                    count,
                                });
                            }
                        };
                        Err(diagnostics.error(Diagnostic::new(Code::E230, range.span, message)))
                    });
                    self.arrays.push(place);
                }
                ItemKind::For { index, range, items } => {
                    self.verify_index(index, diagnostics);
                    let extent = extent(range, &self.sizes, diagnostics);
                    self.loops.push(extent);
                    for item in items {
                        if let ItemKind::Let { name, unit, value } = &item.kind {
                            self.let_arrays.push(LetArray {
                                name: &name.text,
                                index: &index.text,
                                extent,
                                unit: unit.as_ref(),
                                value,
                            });
                        }
                    }
                }
                _ => {}
            }
        }
    }

    /// An index has a name of its own.
    fn verify_index(&self, index: &Name, diagnostics: &mut Diagnostics) {
        let Some(earlier) = self.names.get(index.text.as_str()) else { return };
        let message =
            format!("the index `{}` has the name of {}", index.text, earlier.definition.noun());
        let diagnostic = Diagnostic::new(Code::E202, index.span, message);
        let is_built_in = matches!(earlier.definition, Definition::Time | Definition::Pi);
        diagnostics.error(if is_built_in {
            diagnostic.help("choose another name")
        } else {
            diagnostic.label(earlier.span, "declared here").help("choose another name")
        });
    }

    /// What an element is called, in quotes; of one that moves with a loop, the first.
    pub(super) fn quoted_element(&self, symbol: Symbol) -> Option<String> {
        let (Symbol::Element(i) | Symbol::Swept(i) | Symbol::ElementRate(i) | Symbol::SweptRate(i)) =
            symbol
        else {
            return None;
        };
        self.arrays.iter().flatten().find_map(|place| place.element(i))
    }
}

impl<'a> Lowering<'a> {
    /// The index of the open loop as a number.
    pub(super) fn index_value(&mut self, index: LoopIndex<'a>) -> Typed {
        let first = self.graph.constant(index.first as f64);
        let id = if index.count > 1 {
            let counter = self.graph.symbol(Symbol::Counter);
            self.graph.intern(Node::Add(counter, first))
        } else {
            first
        };
        Typed { id, dim: Dim::ONE }
    }

    /// An element of an array, or its derivative.
    pub(super) fn element(
        &mut self,
        array: &'a Expr,
        index: &'a Expr,
        is_rate: bool,
        arguments: &Arguments<'a>,
        diagnostics: &mut Diagnostics,
    ) -> Result<Typed, Reported> {
        let at = whole(index, &self.scope.sizes, self.index, diagnostics)?;
        let not_an_array = |what: String| {
            Diagnostic::new(Code::E232, array.span, what)
                .help("an index stands behind an array declared as in `state p[1..N]`")
        };
        let ExprKind::Name(name) = &array.kind else {
            let message = "only arrays have elements".to_owned();
            return Err(diagnostics.error(not_an_array(message)));
        };
        let name = name.as_str();
        if arguments.contains_key(name) {
            let message = format!("`{name}` is an argument, not an array");
            return Err(diagnostics.error(not_an_array(message)));
        }
        match self.scope.names.get(name).map(|entry| (entry.definition, entry.span)) {
            Some((Definition::Array { index: position, state }, place)) => {
                let array = self.scope.arrays[position]?;
                let extent = Extent { lower: array.lower, count: array.count };
                let (offset, sweeps) = self.within(at, extent, name, index, place, diagnostics)?;
                let unit = self.scope.dimension(name)?;
                if is_rate && !state {
                    let message = format!("`{name}` is an array of `unknown`s, not of states");
                    return Err(diagnostics.error(
                        Diagnostic::new(Code::E209, index.span, message)
                            .label(place, "declared here")
                            .help("only what is declared `state` has a derivative"),
                    ));
                }
                let position = array.first + offset;
                let (symbol, unit) = match (is_rate, sweeps) {
                    (false, false) => (Symbol::Element(position), unit),
                    (false, true) => (Symbol::Swept(position), unit),
                    (true, sweeps) => {
                        let rate = unit.over(self.scope.second).unwrap_or(Dimension::ONE);
                        let symbol = if sweeps { Symbol::SweptRate } else { Symbol::ElementRate };
                        (symbol(position), rate)
                    }
                };
                Ok(Typed { id: self.graph.symbol(symbol), dim: Dim::Of(unit) })
            }
            Some((Definition::LetArray(_), place)) if is_rate => {
                let message = format!("`{name}` is a `let`, not an array of states");
                Err(diagnostics.error(
                    Diagnostic::new(Code::E209, array.span, message).label(place, "declared here"),
                ))
            }
            Some((Definition::LetArray(position), place)) => {
                let array = self.scope.let_arrays[position];
                let (_, sweeps) =
                    self.within(at, array.extent?, name, index, place, diagnostics)?;
                let count = if sweeps { self.index.map_or(1, |index| index.count) } else { 1 };
                let at = LoopIndex { name: array.index, first: at.at, count };
                self.open_let(array, at, index.span, diagnostics)
            }
            Some((definition, place)) => {
                let message = format!("`{name}` is {}, not an array", definition.noun());
                Err(diagnostics.error(not_an_array(message).label(place, "declared here")))
            }
            None => Err(self.unknown_name(name, array.span, arguments, diagnostics)),
        }
    }

    /// The expression that a `let` of a loop is for an index.
    fn open_let(
        &mut self,
        array: LetArray<'a>,
        at: LoopIndex<'a>,
        span: Span,
        diagnostics: &mut Diagnostics,
    ) -> Result<Typed, Reported> {
        if let Some(done) = self.opened_lets.get(&(array.name, at)) {
            return *done;
        }
        if self.open.contains(&array.name) {
            let message = format!("`{}` depends on itself", array.name);
            return Err(diagnostics.error(
                Diagnostic::new(Code::E206, span, message)
                    .help("an unknown that equations determine can depend on its neighbours"),
            ));
        }
        self.open.push(array.name);
        let outer = self.index.replace(at);
        let result = match array.unit {
            None => self.value(array.value, diagnostics),
            Some(unit) => unit_of(Some(unit), diagnostics).and_then(|unit| {
                self.in_unit(array.value, &unit, Reading::Value, &Arguments::new(), diagnostics)
            }),
        };
        self.index = outer;
        self.open.pop();
        self.opened_lets.insert((array.name, at), result);
        result
    }

    /// How far past the first element an index points, and whether it moves with the loop.
    fn within(
        &self,
        at: AffineInteger,
        extent: Extent,
        name: &str,
        index: &Expr,
        declared: Span,
        diagnostics: &mut Diagnostics,
    ) -> Result<(u32, bool), Reported> {
        if !(0..=1).contains(&at.slope) {
            let message = format!("this index of `{name}` moves by {} with the loop", at.slope);
            return Err(diagnostics.error(
                Diagnostic::new(Code::E230, index.span, message)
                    .help("an index is a number, or the loop's index plus or minus one"),
            ));
        }
        let sweeps = at.slope == 1;
        let passages = self.index.map_or(1, |index| index.count);
        let last_passage = if sweeps { i64::from(passages) - 1 } else { 0 };
        let Extent { lower, count } = extent;
        let upper = lower + i64::from(count) - 1;
        let is_within = |element: i64| (lower..=upper).contains(&element);
        if passages == 0 {
            // The loop is empty: nothing is read.
            return Ok((0, false));
        }
        let outside =
            [at.at, at.at + last_passage].into_iter().find(|element| !is_within(*element));
        let Some(element) = outside else {
            let offset = u32::try_from(at.at - lower).unwrap_or(u32::MAX);
            return Ok((offset, sweeps));
        };
        let when = match self.index {
            Some(own) if sweeps => {
                format!(" where `{}` is {}", own.name, own.first + element - at.at)
            }
            _ => String::new(),
        };
        let message =
            format!("`{name}` has no element {element}{when}: it runs from {lower} to {upper}");
        Err(diagnostics.error(
            Diagnostic::new(Code::E231, index.span, message).label(declared, "declared here"),
        ))
    }
}

impl<'a> Resolver<'a> {
    /// `state p[1..N] = …`
    pub(super) fn array(
        &mut self,
        item: &Item,
        index: Option<&'a Name>,
        declaration: &UnknownDeclaration<'a>,
        diagnostics: &mut Diagnostics,
    ) -> Result<Array, Reported> {
        let Some(Definition::Array { index: position, .. }) = self
            .lowering
            .scope
            .names
            .get(declaration.name.text.as_str())
            .map(|entry| entry.definition)
        else {
            // A second declaration of a name has been reported.
            return diagnostics.check().map(|()| unreachable!("arrays are collected"));
        };
        let place = self.lowering.scope.arrays[position]?;
        self.lowering.index = index.map(|index| LoopIndex {
            name: &index.text,
            first: place.lower,
            count: place.count,
        });
        let unknown = self.unknown(item, declaration, diagnostics);
        self.lowering.index = None;
        let unknown = unknown?;
        Ok(Array { unknown, lower: place.lower, first: place.first, count: place.count })
    }

    pub(super) fn is_array(&self, name: &Name) -> bool {
        let entry = self.lowering.scope.names.get(name.text.as_str());
        entry.is_some_and(|entry| matches!(entry.definition, Definition::Array { .. }))
    }

    /// `output p [bar]` of an array `p`
    pub(super) fn output_array(
        &mut self,
        item: &Item,
        name: &'a Name,
        unit: Option<&'a WrittenUnit>,
        attributes: &'a [Attribute],
        diagnostics: &mut Diagnostics,
    ) -> Result<OutputArray, Reported> {
        let own = unit.map(|unit| unit_of(Some(unit), diagnostics)).transpose()?;
        let entry = self.lowering.scope.names.get(name.text.as_str()).cloned();
        let Some(Entry { definition: Definition::Array { index, .. }, span, unit }) = entry else {
            unreachable!("asked before");
        };
        let declared = unit.unwrap_or_else(|| Ok(Unit::one()))?;
        let unit = unit_read(name, own, &declared, span, diagnostics)?;
        let noise = self.noise_of_elements(attributes, &unit, diagnostics)?;
        let declared =
            Declared { name: name.text.clone(), span: name.span, unit, doc: item.doc.clone() };
        Ok(OutputArray { declared, array: index, noise })
    }

    /// The equations of a loop.
    pub(super) fn loop_(
        &mut self,
        index: &'a Name,
        items: &'a [Item],
        diagnostics: &mut Diagnostics,
    ) -> Result<(), Reported> {
        let extent = self.lowering.scope.loops[self.next_loop];
        self.next_loop += 1;
        let Extent { lower, count } = extent?;
        for item in items {
            let ItemKind::Equation { label, left, right, attributes } = &item.kind else {
                continue;
            };
            self.lowering.index = Some(LoopIndex { name: &index.text, first: lower, count });
            let equation = self.equation(item, label, [left, right], attributes, diagnostics);
            self.lowering.index = None;
            // Each equation reports its own mistakes; the next is independent of them.
            let Ok(mut equation) = equation else { continue };
            match count {
                0 => {}
                1 => {
                    equation.label = format!("{}[{lower}]", equation.label);
                    self.model.equations.push(equation);
                }
                _ => {
                    let index = index.text.clone();
                    self.model.families.push(Family { equation, index, lower, count });
                }
            }
        }
        Ok(())
    }

    /// Looks at `let`s of loops that nothing reads, for the mistakes in them.
    pub(super) fn unused_lets(&mut self, diagnostics: &mut Diagnostics) {
        for position in 0..self.lowering.scope.let_arrays.len() {
            let array = self.lowering.scope.let_arrays[position];
            let Ok(Extent { lower, count }) = array.extent else { continue };
            let at = LoopIndex { name: array.index, first: lower, count };
            // The result is of no interest, only the mistakes met on the way.
            let _: Result<Typed, Reported> =
                self.lowering.open_let(array, at, array.value.span, diagnostics);
        }
    }
}

//! Elements in expressions: of unknowns, constants, parameters, inputs, and of the `let`s of loops; and derivatives.

use super::{ExprLowering, OpenArguments, TypedExpr};
use crate::diagnostics::{Code, Diagnostic, Diagnostics, ErrorReported};
use crate::expr::curve::CurveId;
use crate::expr::{ExprGraph, ExprId, Node, Symbol};
use crate::model::check_units::ExprDimension;
use crate::model::scope::{
    AffineInteger, ArrayPlace, ArrayShape, IndexExtent, LetArray, LoopIndex, NameDefinition, whole,
};
use crate::source::Span;
use crate::syntax::ast::{ArrayKind, Expr, ExprKind, Name};
use crate::syntax::visit;
use crate::units::Dimension;

/// An element that an expression reads.
pub(super) enum ElementRead<'a> {
    Value(TypedExpr),
    /// That of a `let` of a loop at these indices, whose expression is still to be lowered.
    Let(LetArray<'a>, Vec<LoopIndex<'a>>),
}

/// Whether an expression reads a name.
fn reads(expr: &Expr, name: &str) -> bool {
    matches!(&expr.kind, ExprKind::Name(own) if own == name)
        || visit::operands(expr).into_iter().any(|operand| reads(operand, name))
}

/// An element in source form: the array's name, and an index for each pair of brackets.
struct WrittenElement<'a> {
    array: &'a Expr,
    indices: Vec<&'a Expr>,
}

impl<'a> WrittenElement<'a> {
    fn new(array: &'a Expr, index: &'a Expr) -> Self {
        let mut written = WrittenElement { array, indices: vec![index] };
        while let ExprKind::Element(array, index) = &written.array.kind {
            written.indices.insert(0, index);
            written.array = array;
        }
        written
    }
}

/// The position of an index in an array.
#[derive(Debug, Clone, Copy)]
struct IndexPosition {
    /// Distance from the first element, at the first passage.
    offset: u32,
    /// Its increment with each passage.
    slope: i64,
}

impl<'a> ExprLowering<'a> {
    /// Number of passages of the open loop.
    fn passages(&self) -> u32 {
        let indices = || self.indices.iter();
        match indices().find(|index| index.count != 1) {
            Some(index) => index.count,
            None => 1,
        }
    }

    /// An element of an array, or its derivative.
    pub(super) fn read_element(
        &mut self,
        array: &'a Expr,
        index: &'a Expr,
        is_rate: bool,
        arguments: &OpenArguments<'a>,
        diagnostics: &mut Diagnostics,
    ) -> Result<ElementRead<'a>, ErrorReported> {
        let written = WrittenElement::new(array, index);
        let indices = self.whole_indices(&written.indices, diagnostics)?;
        let span = written.array.span;
        let not_an_array = |what: String| {
            Diagnostic::new(Code::ArrayAsNumber, span, what)
                .help("an index stands behind an array declared as in `state p[1..N]`")
        };
        let ExprKind::Name(name) = &written.array.kind else {
            let message = "only arrays have elements".to_owned();
            return Err(diagnostics.error(not_an_array(message)));
        };
        let name = name.as_str();
        if arguments.contains_key(name) {
            let message = format!("`{name}` is an argument, not an array");
            return Err(diagnostics.error(not_an_array(message).about(name)));
        }
        let entry = self.scope.names.get(name).map(|entry| (entry.definition, entry.span));
        let Some((definition, place)) = entry else {
            return Err(self.unknown_name(name, span, arguments, diagnostics));
        };
        let no_rate = |what: &str, diagnostics: &mut Diagnostics| {
            let message = format!("`{name}` is {what}, not an array of states");
            Err(diagnostics.error(
                Diagnostic::new(Code::NoDerivative, span, message)
                    .about(name)
                    .label(place, "declared here")
                    .help("only what is declared `state` has a derivative"),
            ))
        };
        let pointed_in = |lowering: &Self, shape: &ArrayShape, diagnostics: &mut Diagnostics| {
            lowering.pointed(&indices, shape, name, &written.indices, place, diagnostics)
        };
        match definition {
            NameDefinition::Array { index: position, state } => {
                let array = self.scope.arrays[position].clone()?;
                let pointed = pointed_in(self, &array.shape, diagnostics)?;
                let unit = self.scope.dimension(name)?;
                if is_rate && !state {
                    return no_rate("an array of `unknown`s", diagnostics);
                }
                let element = self.unknown_element(&array, pointed, unit, is_rate);
                Ok(ElementRead::Value(element))
            }
            NameDefinition::Vector(position) if is_rate => {
                let word = self.scope.vectors[position].kind.word();
                no_rate(&format!("an array of {word}s"), diagnostics)
            }
            NameDefinition::Vector(position) => {
                let vector = &self.scope.vectors[position];
                let (kind, array) = (vector.kind, vector.place.clone()?);
                let pointed = pointed_in(self, &array.shape, diagnostics)?;
                let dim = ExprDimension::Of(self.scope.dimension(name)?);
                let id = self.vector_element(kind, &array, pointed);
                Ok(ElementRead::Value(TypedExpr { id, dim }))
            }
            NameDefinition::LetArray(_) if is_rate => no_rate("a `let`", diagnostics),
            NameDefinition::LetArray(position) => {
                let array = self.scope.let_arrays[position].clone();
                let shape = array.shape.clone()?;
                pointed_in(self, &shape, diagnostics)?;
                let passages = self.passages();
                let counters = array.counters.iter().zip(&indices);
                let let_indices: Vec<LoopIndex<'a>> = counters
                    .map(|(counter, index)| LoopIndex {
                        name: &counter.index.text,
                        first: index.at,
                        // An empty loop reads no element.
                        count: if passages > 0 && index.slope == 0 { 1 } else { passages },
                    })
                    .collect();
                Ok(ElementRead::Let(array, let_indices))
            }
            definition => {
                let message = format!("`{name}` is {}, not an array", definition.noun());
                Err(diagnostics
                    .error(not_an_array(message).about(name).label(place, "declared here")))
            }
        }
    }

    /// `der(x)`
    pub(super) fn derivative(
        &mut self,
        list: &'a [Expr],
        span: Span,
        diagnostics: &mut Diagnostics,
    ) -> Result<TypedExpr, ErrorReported> {
        let mut only = match list {
            [only] => Some(only),
            _ => None,
        };
        while let Some(Expr { kind: ExprKind::Group(inner), .. }) = only {
            only = Some(inner);
        }
        if let Some(Expr { kind: ExprKind::Element(array, index), .. }) = only {
            return match self.read_element(
                array,
                index,
                true,
                &OpenArguments::new(),
                diagnostics,
            )? {
                ElementRead::Value(rate) => Ok(rate),
                ElementRead::Let(..) => unreachable!("the derivative of a `let` is refused"),
            };
        }
        let Some(Expr { kind: ExprKind::Name(name), span: name_span }) = only else {
            return Err(diagnostics.error(
                Diagnostic::new(Code::NoDerivative, span, "`der` takes the name of one state")
                    .help(
                        "the derivative of an expression follows from those of its states; a second derivative \
                         is that of a state which equals the first, as in `equation v: der(x) = v`",
                    ),
            ));
        };
        let entry = self.scope.names.get(name.as_str());
        match entry.map(|entry| (entry.definition, entry.span)) {
            Some((NameDefinition::Unknown { index, state: true }, _)) => {
                let unit = self.scope.dimension(name)?;
                let rate = unit.divide(self.scope.second).unwrap_or(Dimension::ONE);
                let id = self.graph.symbol(Symbol::Derivative(index));
                Ok(TypedExpr { id, dim: ExprDimension::Of(rate) })
            }
            Some((definition, place)) => {
                let what = definition.noun();
                Err(diagnostics.error(
                    Diagnostic::new(
                        Code::NoDerivative,
                        *name_span,
                        format!("`{name}` is {what}, not a state"),
                    )
                    .about(name)
                    .label(place, "declared here")
                    .help("only what is declared `state` has a derivative"),
                ))
            }
            None => Err(self.unknown_name(name, *name_span, &OpenArguments::new(), diagnostics)),
        }
    }

    /// The element of an array of unknowns that a `reset` or `saturate` names.
    pub(in crate::model) fn element_named(
        &mut self,
        name: &Name,
        indices: &[Expr],
        diagnostics: &mut Diagnostics,
    ) -> Result<Symbol, ErrorReported> {
        let entry = self.scope.names.get(name.text.as_str());
        let Some((NameDefinition::Array { index, .. }, declared)) =
            entry.map(|entry| (entry.definition, entry.span))
        else {
            unreachable!("asked before");
        };
        let array = self.scope.arrays[index].clone()?;
        let indices: Vec<&Expr> = indices.iter().collect();
        let position = self.whole_indices(&indices, diagnostics)?;
        let pointed =
            self.pointed(&position, &array.shape, &name.text, &indices, declared, diagnostics)?;
        Ok(Symbol::Element(array.first + pointed.offset))
    }

    fn whole_indices(
        &self,
        indices: &[&Expr],
        diagnostics: &mut Diagnostics,
    ) -> Result<Vec<AffineInteger>, ErrorReported> {
        let whole = |index: &&Expr| whole(index, &self.scope.sizes, &self.indices, diagnostics);
        indices.iter().map(whole).collect()
    }

    fn unknown_element(
        &mut self,
        array: &ArrayPlace<'a>,
        pointed: IndexPosition,
        unit: Dimension,
        is_rate: bool,
    ) -> TypedExpr {
        let position = array.first + pointed.offset;
        let sweeps = self.sweeps(pointed);
        let symbol = match (is_rate, sweeps) {
            (false, false) => Symbol::Element(position),
            (false, true) => Symbol::Swept(position),
            (true, false) => Symbol::ElementRate(position),
            (true, true) => Symbol::SweptRate(position),
        };
        let unit =
            if is_rate { unit.divide(self.scope.second).unwrap_or(Dimension::ONE) } else { unit };
        TypedExpr { id: self.graph.symbol(symbol), dim: ExprDimension::Of(unit) }
    }

    /// Whether an element moves with the row. Records whether it moves by more than one.
    fn sweeps(&mut self, pointed: IndexPosition) -> bool {
        self.strided |= !(0..=1).contains(&pointed.slope);
        pointed.slope == 1
    }

    fn vector_element(
        &mut self,
        kind: ArrayKind,
        array: &ArrayPlace<'a>,
        pointed: IndexPosition,
    ) -> ExprId {
        let position = array.first + pointed.offset;
        if kind == ArrayKind::Constant {
            return self.constant_element(array, pointed);
        }
        let passages = self.passages();
        let symbol = match (kind, self.sweeps(pointed)) {
            (ArrayKind::Input, false) => Symbol::Input(position),
            (ArrayKind::Input, true) => Symbol::SweptInput(position, passages),
            (_, false) => Symbol::Parameter(position),
            (_, true) => Symbol::SweptParameter(position, passages),
        };
        self.graph.symbol(symbol)
    }

    /// A constant, which is looked up if it moves, by any increment.
    fn constant_element(&mut self, array: &ArrayPlace<'a>, pointed: IndexPosition) -> ExprId {
        let position = array.first + pointed.offset;
        if pointed.slope == 0 {
            return self.graph.symbol(Symbol::Constant(position));
        }
        let constant = |k: u32| {
            let position = i64::from(position) + i64::from(k) * pointed.slope;
            let position = u32::try_from(position).unwrap_or(u32::MAX);
            // A constant with an error has been reported.
            self.constants.get(&position).copied().unwrap_or(0.0)
        };
        let numbers: Vec<f64> = (0..self.passages()).map(constant).collect();
        let counter = self.graph.symbol(Symbol::Counter);
        numbers_at(&mut self.graph, array.name, &numbers, counter)
    }

    /// Discards values computed while an index moved by more than one: they are invalid.
    pub(in crate::model) fn forget_moving(&mut self) {
        self.opened_lets.retain(|(_, at), _| at.iter().all(|index| index.count == 1));
        self.calls.clear();
    }

    /// The position of indices in an array, which must be within it at every passage.
    fn pointed(
        &self,
        at: &[AffineInteger],
        shape: &ArrayShape,
        name: &str,
        indices: &[&Expr],
        declared: Span,
        diagnostics: &mut Diagnostics,
    ) -> Result<IndexPosition, ErrorReported> {
        let (given, wanted) = (at.len(), shape.axes().len());
        if given != wanted {
            let noun = if wanted == 1 { "index" } else { "indices" };
            let message = format!("an element of `{name}` has {wanted} {noun}, not {given}");
            let span = indices.last().map_or(declared, |index| index.span);
            return Err(diagnostics.error(
                Diagnostic::new(Code::ArrayAsNumber, span, message)
                    .about(name)
                    .label(declared, "declared here")
                    .help(format!("write `{name}{}`", "[…]".repeat(wanted))),
            ));
        }
        if self.passages() == 0 {
            // The loop is empty: it reads no element.
            return Ok(IndexPosition { offset: 0, slope: 0 });
        }
        let (mut offset, mut slope) = (0, 0);
        for (axis, (at, index)) in at.iter().zip(indices).enumerate() {
            let extent = shape.axes()[axis];
            self.verify_within(*at, extent, name, index, declared, diagnostics)?;
            offset += (at.at - extent.lower) * shape.stride(axis);
            slope += at.slope * shape.stride(axis);
        }
        Ok(IndexPosition { offset: u32::try_from(offset).unwrap_or(u32::MAX), slope })
    }

    /// Checks that an index stays within its range at every passage.
    fn verify_within(
        &self,
        at: AffineInteger,
        extent: IndexExtent,
        name: &str,
        index: &Expr,
        declared: Span,
        diagnostics: &mut Diagnostics,
    ) -> Result<(), ErrorReported> {
        let IndexExtent { lower, count } = extent;
        let upper = lower + i64::from(count) - 1;
        let last = i64::from(self.passages()) - 1;
        let is_outside = |passage: &i64| !(lower..=upper).contains(&(at.at + at.slope * passage));
        let Some(passage) = [0, last].into_iter().find(is_outside) else { return Ok(()) };
        let read = self.indices.iter().filter(|open| reads(index, open.name));
        let read = read.map(|open| {
            let value = open.first + if open.count > 1 { passage } else { 0 };
            format!("`{}` is {value}", open.name)
        });
        let read: Vec<String> = read.collect();
        let when =
            if read.is_empty() { String::new() } else { format!(" where {}", read.join(" and ")) };
        let element = at.at + at.slope * passage;
        let message =
            format!("`{name}` has no element {element}{when}: it runs from {lower} to {upper}");
        Err(diagnostics.error(
            Diagnostic::new(Code::IndexOutOfRange, index.span, message)
                .about(name)
                .label(declared, "declared here"),
        ))
    }
}

/// Looks numbers up by a whole number, the first at 0.
fn numbers_at(graph: &mut ExprGraph, name: &str, numbers: &[f64], at: ExprId) -> ExprId {
    let (first, others) = match numbers {
        [] => return graph.constant(0.0),
        [first, others @ ..] => (*first, others),
    };
    if others.iter().all(|number| number.to_bits() == first.to_bits()) {
        return graph.constant(first);
    }
    graph.intern(Node::Curve(CurveId::of_numbers(name, numbers, None), at))
}

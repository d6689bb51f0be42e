//! Bindings of the inputs of parts: `pump.q = q_ssp`, for arrays as a whole or piece by piece.

use std::collections::BTreeSet;

use super::indices;
use super::written::{BindingExtent, InputBinding};
use crate::diagnostics::{Code, Diagnostic, Diagnostics};
use crate::syntax::ast::{
    ArrayAxis, ArrayKind, Expr, ExprKind, Item, ItemKind, LoopCounter, Name, WrittenUnit,
};
use crate::syntax::print::print_expression;
use crate::syntax::visit;

/// An input of a part that can be bound.
#[derive(Debug, Clone)]
pub(super) struct PartInput {
    pub(super) unit: WrittenUnit,
    /// Ranges of the indices, for an array.
    pub(super) axes: Vec<ArrayAxis>,
}

/// A binding in its context.
pub(super) struct WrittenBinding<'a> {
    pub(super) item: &'a Item,
    pub(super) input: &'a Name,
    pub(super) indices: &'a [Expr],
    pub(super) value: &'a Expr,
    /// Counters of the enclosing loop.
    pub(super) counters: &'a [LoopCounter],
}

/// Checks that no input of a part is bound twice, except pieces of an array.
pub(super) fn verify_once(bindings: &[InputBinding<'_>], diagnostics: &mut Diagnostics) {
    for (i, bound) in bindings.iter().enumerate() {
        let is_whole = |bound: &InputBinding<'_>| bound.extent == BindingExtent::Whole;
        let same =
            |other: &&InputBinding<'_>| other.meets(bound) && (is_whole(other) || is_whole(bound));
        if let Some(first) = bindings[..i].iter().find(same) {
            let message = format!("`{}` is bound twice", bound.input.text);
            diagnostics.error(
                Diagnostic::new(Code::DuplicateName, bound.input.span, message)
                    .about(&bound.input.text)
                    .label(first.input.span, "first here"),
            );
        }
    }
}

/// Inputs that are bound in pieces: they become unknowns, and each piece an equation.
pub(super) fn in_pieces(bindings: &[InputBinding<'_>]) -> BTreeSet<String> {
    let several = bindings.iter().enumerate().filter(|(i, bound)| {
        bound.extent == BindingExtent::Element
            || bindings[..*i].iter().any(|other| other.meets(bound))
    });
    several.map(|(_, bound)| bound.input.text.clone()).collect()
}

impl WrittenBinding<'_> {
    /// The item that replaces a binding: an equation if the input is bound in pieces, each of which determines some
    /// elements of an unknown. `taken` are names declared by the whole.
    pub(super) fn item(
        &self,
        socket: &PartInput,
        is_in_pieces: bool,
        taken: &BTreeSet<String>,
    ) -> Result<Item, Diagnostic> {
        let WrittenBinding { item, input, indices, value, counters } = *self;
        let n = socket.axes.len();
        let n_indices = indices.len() + counters.len();
        if n_indices != n && n_indices > 0 {
            let (message, help) = match n {
                0 => (
                    format!("input `{}` is not an array", input.text),
                    format!("write `{} = …`", input.text),
                ),
                _ => (
                    format!(
                        "input `{}` has {n} {}",
                        input.text,
                        if n == 1 { "index" } else { "indices" }
                    ),
                    format!("write `{}{} = …`", input.text, "[…]".repeat(n)),
                ),
            };
            return Err(Diagnostic::new(Code::ArrayAsNumber, input.span, message)
                .about(&input.text)
                .help(help));
        }
        let is_whole = n_indices == 0 && n > 0;
        let kind = if is_in_pieces && !is_whole {
            let label = Name { text: self.label(), span: input.span };
            let of_loop = counters.iter().map(|counter| Expr {
                span: counter.index.span,
                kind: ExprKind::Name(counter.index.text.clone()),
            });
            let array = Expr { span: input.span, kind: ExprKind::Name(input.text.clone()) };
            let left = indices.iter().cloned().chain(of_loop).fold(array, |array, index| Expr {
                span: input.span,
                kind: ExprKind::Element(Box::new(array), Box::new(index)),
            });
            let mut right = value.clone();
            measure(&mut right, &socket.unit);
            ItemKind::Equation { label, left, right, attributes: Vec::new() }
        } else {
            let (name, unit) = (input.clone(), Some(socket.unit.clone()));
            ItemKind::Let { name, unit, value: value.clone() }
        };
        let one = Item { kind, ..item.clone() };
        if !is_whole {
            return Ok(one);
        }
        let counters = indices::counters(&socket.axes, input.span, taken.clone());
        let inner = Item { doc: Vec::new(), ..one };
        Ok(Item { kind: ItemKind::For { counters, items: vec![inner] }, ..item.clone() })
    }

    /// Label of a piece: `cell.q_1`, or `cell.q_2_to_N` for a loop.
    fn label(&self) -> String {
        let elements = self.indices.iter().map(print_expression);
        let ranges = self.counters.iter().map(|LoopCounter { range, .. }| {
            let [lower, upper] = [&range.lower, &range.upper].map(print_expression);
            format!("{lower}_to_{upper}")
        });
        let mut label = self.input.text.clone();
        for which in elements.chain(ranges) {
            label.push('_');
            label.extend(
                which
                    .chars()
                    .filter(|c| !c.is_whitespace())
                    .map(|c| if c.is_alphanumeric() { c } else { '_' }),
            );
        }
        label
    }
}

/// Gives a plain number the declared unit.
fn measure(value: &mut Expr, declared: &WrittenUnit) {
    match &mut value.kind {
        ExprKind::Number { unit, .. } => {
            unit.get_or_insert_with(|| declared.clone());
        }
        ExprKind::Negate(inner) | ExprKind::Group(inner) => measure(inner, declared),
        _ => {}
    }
}

/// Turns arrays of inputs that are bound in pieces into unknowns.
pub(super) fn as_unknowns(items: &mut [Item], in_pieces: &BTreeSet<String>) {
    visit::items_mut(items, &mut |item| {
        if let ItemKind::Array { declared, name, attributes, .. } = &mut item.kind
            && *declared == ArrayKind::Input
            && in_pieces.contains(&name.text)
        {
            *declared = ArrayKind::Unknown;
            attributes.clear();
        }
    });
}

//! Arrays of unknowns, row by row.

use crate::diagnostics::{Diagnostics, ErrorReported};
use crate::expr::{ExprGraph, ExprId, Node, Symbol};
use crate::model::item::UnknownDeclaration;
use crate::model::resolver::ModelResolver;
use crate::model::scope::{
    ArrayPlace, ArrayShape, IndexExtent, LoopIndex, NameDefinition, brackets,
};
use crate::model::{Array, Unknown};
use crate::syntax::ast::{ArrayAxis, Comparison, Expr, ExprKind, Item, Name};

impl<'a> ModelResolver<'a> {
    /// `state p[1..N] = …`: a row of elements for each value of the outer indices.
    pub(in crate::model) fn array(
        &mut self,
        item: &Item,
        axes: &'a [ArrayAxis],
        declaration: &UnknownDeclaration<'a>,
        diagnostics: &mut Diagnostics,
    ) -> Result<Vec<Array>, ErrorReported> {
        let name = declaration.name;
        let Some(NameDefinition::Array { index: position, .. }) =
            self.lowering.scope.names.get(name.text.as_str()).map(|entry| entry.definition)
        else {
            // A duplicate declaration of a name has been reported.
            return diagnostics.check().map(|()| unreachable!("arrays are collected"));
        };
        let ArrayPlace { first, shape, .. } = self.lowering.scope.arrays[position].clone()?;
        if let Some(values) = declaration.start {
            shape.verify_list(&name.text, values, diagnostics)?;
        }
        let row = shape.row();
        let mut rows = Vec::new();
        for at in 0..shape.rows() {
            let offset = at * row.count;
            let unknown = self.row(item, axes, declaration, &shape, offset, diagnostics);
            self.lowering.indices.clear();
            let unknown = unknown?;
            rows.push(Array { unknown, lower: row.lower, first: first + offset, count: row.count });
        }
        Ok(rows)
    }

    /// The common properties of the elements of a row, with their start as one expression.
    fn row(
        &mut self,
        item: &Item,
        axes: &'a [ArrayAxis],
        declaration: &UnknownDeclaration<'a>,
        shape: &ArrayShape,
        offset: u32,
        diagnostics: &mut Diagnostics,
    ) -> Result<Unknown, ErrorReported> {
        let IndexExtent { lower, count } = shape.row();
        let of_row = |this: &mut Self, passage: Option<u32>| {
            this.lowering.indices = open_axes(axes, &shape.indices(offset + passage.unwrap_or(0)));
            if passage.is_none()
                && let Some(ArrayAxis { index: Some(index), .. }) = axes.last()
            {
                this.lowering.indices.pop();
                this.lowering.indices.push(LoopIndex { name: &index.text, first: lower, count });
            }
        };
        let name = declaration.name;
        let values = declaration.start;
        let value_at = |k: u32| values.map(|values| shape.value_at(values, offset + k));
        let is_list = values.is_some_and(|values| matches!(values.kind, ExprKind::List(_)));
        let same = |a: Option<&Expr>, b: Option<&Expr>| a.map(|a| a.span) == b.map(|b| b.span);
        let differs = is_list && (1..count).any(|k| !same(value_at(k), value_at(0)));
        of_row(self, None);
        self.lowering.strided = false;
        if !differs {
            let declaration = UnknownDeclaration { start: value_at(0), ..*declaration };
            let mut unknown = self.unknown(item, &declaration, diagnostics)?;
            if !std::mem::take(&mut self.lowering.strided) {
                unknown.declared.name = name_of_row(name, shape, offset);
                return Ok(unknown);
            }
            self.lowering.forget_moving();
        }
        // Each element's own value, chosen by its distance from the first.
        let (mut each, mut histories) = (Vec::new(), Vec::new());
        let mut whole = None;
        for k in 0..count {
            of_row(self, Some(k));
            let declaration = UnknownDeclaration { start: value_at(k), ..*declaration };
            let unknown = self.unknown(item, &declaration, diagnostics)?;
            each.push(unknown.start);
            histories.extend(unknown.history);
            whole.get_or_insert(unknown);
        }
        let mut unknown = whole.unwrap_or_else(|| unreachable!("an array has elements"));
        unknown.start = chosen_by_counter(&mut self.lowering.graph, &each, 0);
        if !histories.is_empty() {
            unknown.history = Some(chosen_by_counter(&mut self.lowering.graph, &histories, 0));
        }
        unknown.declared.name = name_of_row(name, shape, offset);
        Ok(unknown)
    }

    pub(in crate::model) fn is_array(&self, name: &Name) -> bool {
        let entry = self.lowering.scope.names.get(name.text.as_str());
        entry.is_some_and(|entry| matches!(entry.definition, NameDefinition::Array { .. }))
    }
}

/// `T[2]` for the elements `T[2][1]` and so on; `p` for those of a single row.
pub(super) fn name_of_row(name: &Name, shape: &ArrayShape, offset: u32) -> String {
    let mut indices = shape.indices(offset);
    indices.pop();
    format!("{}{}", name.text, brackets(&indices))
}

/// The named indices of an array at one of its elements.
pub(super) fn open_axes<'a>(axes: &'a [ArrayAxis], at: &[i64]) -> Vec<LoopIndex<'a>> {
    let named = axes.iter().zip(at).filter_map(|(axis, at)| Some((axis.index.as_ref()?, *at)));
    named.map(|(index, first)| LoopIndex { name: &index.text, first, count: 1 }).collect()
}

/// The expression selected by the counter, the first of them at `from`, by bisection.
fn chosen_by_counter(graph: &mut ExprGraph, each: &[ExprId], from: usize) -> ExprId {
    if let [only] = each {
        return *only;
    }
    let (left, right) = each.split_at(each.len() / 2);
    let from_right = from + left.len();
    let left_id = chosen_by_counter(graph, left, from);
    let right_id = chosen_by_counter(graph, right, from_right);
    if left_id == right_id {
        return left_id;
    }
    let counter = graph.symbol(Symbol::Counter);
    let bound = graph.constant(from_right as f64 - 0.5);
    let is_left = graph.intern(Node::Compare(Comparison::Less, counter, bound));
    graph.intern(Node::Select(is_left, left_id, right_id))
}

//! Equations of loops: one for all indices if they move by one, otherwise one for each.

use super::each::open;
use crate::diagnostics::{Diagnostics, ErrorReported};
use crate::model::Family;
use crate::model::expression::TypedExpr;
use crate::model::resolver::ModelResolver;
use crate::model::scope::{ArrayShape, IndexExtent, brackets};
use crate::syntax::ast::{Item, ItemKind, LoopCounter};

impl<'a> ModelResolver<'a> {
    /// The equations of a loop.
    pub(in crate::model) fn loop_(
        &mut self,
        counters: &'a [LoopCounter],
        items: &'a [Item],
        diagnostics: &mut Diagnostics,
    ) -> Result<(), ErrorReported> {
        let shape = self.lowering.scope.loops[self.next_loop].clone();
        self.next_loop += 1;
        let shape = shape?;
        for item in items {
            // Each item reports its own errors; the next is independent of them.
            let _: Result<(), ErrorReported> = match &item.kind {
                ItemKind::Equation { .. } => self.swept(counters, item, &shape, diagnostics),
                ItemKind::Let { .. } => Ok(()),
                _ => self.each(counters, item, &shape, diagnostics),
            };
            self.lowering.indices.clear();
        }
        Ok(())
    }

    /// An equation of a loop, as families along one of its indices if it moves by one.
    fn swept(
        &mut self,
        counters: &'a [LoopCounter],
        item: &'a Item,
        shape: &ArrayShape,
        diagnostics: &mut Diagnostics,
    ) -> Result<(), ErrorReported> {
        if shape.count() == Some(0) {
            // Only checked for errors; nothing is read.
            self.lowering.indices = open(counters, shape, 0, false);
            for index in &mut self.lowering.indices {
                index.count = 0;
            }
            return self.one(item, diagnostics).map(|_| ());
        }
        // Consecutive elements differ in the last index.
        if shape.row().count > 1 {
            self.lowering.indices = open(counters, shape, 0, true);
            if self.one(item, diagnostics)?.is_some() {
                return self.families(counters, item, shape, diagnostics);
            }
        }
        self.each(counters, item, shape, diagnostics)
    }

    /// A family along the last index for each value of the others.
    fn families(
        &mut self,
        counters: &'a [LoopCounter],
        item: &'a Item,
        shape: &ArrayShape,
        diagnostics: &mut Diagnostics,
    ) -> Result<(), ErrorReported> {
        let IndexExtent { lower, count } = shape.row();
        let Some(LoopCounter { index, .. }) = counters.last() else { return Ok(()) };
        for row in 0..shape.rows() {
            self.lowering.indices = open(counters, shape, row * count, true);
            let Some(mut equation) = self.one(item, diagnostics)? else {
                unreachable!("the index moves alike for all values of the others");
            };
            let mut outer = shape.indices(row * count);
            outer.pop();
            equation.label.push_str(&brackets(&outer));
            let index = index.text.clone();
            self.model.families.push(Family { equation, index, lower, count });
        }
        Ok(())
    }

    /// Checks `let`s of loops that nothing reads for errors.
    pub(in crate::model) fn unused_lets(&mut self, diagnostics: &mut Diagnostics) {
        for position in 0..self.lowering.scope.let_arrays.len() {
            let array = self.lowering.scope.let_arrays[position].clone();
            let Ok(shape) = &array.shape else { continue };
            let mut indices = open(array.counters, shape, 0, true);
            if shape.count() == Some(0) {
                for index in &mut indices {
                    index.count = 0;
                }
            }
            // Only the errors matter, not the result.
            let span = array.value.span;
            let _: Result<TypedExpr, ErrorReported> =
                self.lowering.open_let(&array, indices, span, diagnostics);
        }
    }
}

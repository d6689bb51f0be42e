//! Arrays of several indices as one list, the last index varying fastest.

use std::fmt::Write as _;

use super::whole::IndexExtent;
use crate::diagnostics::{Code, Diagnostic, Diagnostics, ErrorReported};
use crate::syntax::ast::{Expr, ExprKind};

/// The ranges of the indices of an array, the first outermost.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(in crate::model) struct ArrayShape {
    axes: Vec<IndexExtent>,
}

impl ArrayShape {
    pub(in crate::model) fn new(axes: Vec<IndexExtent>) -> Self {
        ArrayShape { axes }
    }

    pub(in crate::model) fn axes(&self) -> &[IndexExtent] {
        &self.axes
    }

    /// Number of elements, unless it overflows.
    pub(in crate::model) fn count(&self) -> Option<u32> {
        self.axes.iter().try_fold(1_u32, |product, axis| product.checked_mul(axis.count))
    }

    /// Distance between neighbours along an axis.
    pub(in crate::model) fn stride(&self, axis: usize) -> i64 {
        self.axes[axis + 1..].iter().map(|axis| i64::from(axis.count)).product()
    }

    /// The last axis, along which elements are consecutive: a row.
    pub(in crate::model) fn row(&self) -> IndexExtent {
        *self.axes.last().unwrap_or_else(|| unreachable!("an array has an axis"))
    }

    /// Number of rows.
    pub(in crate::model) fn rows(&self) -> u32 {
        self.axes[..self.axes.len() - 1].iter().map(|axis| axis.count).product()
    }

    /// The indices of the element at a position.
    pub(in crate::model) fn indices(&self, position: u32) -> Vec<i64> {
        let digit = |axis: usize| {
            let IndexExtent { lower, count } = self.axes[axis];
            lower + i64::from(position) / self.stride(axis) % i64::from(count.max(1))
        };
        (0..self.axes.len()).map(digit).collect()
    }

    /// The position of an element, if it exists.
    pub(in crate::model) fn position(&self, indices: &[i64]) -> Option<u32> {
        let mut position = 0;
        for (axis, (index, extent)) in indices.iter().zip(&self.axes).enumerate() {
            let along = index - extent.lower;
            if !(0..i64::from(extent.count)).contains(&along) {
                return None;
            }
            position += along * self.stride(axis);
        }
        (indices.len() == self.axes.len()).then(|| u32::try_from(position).ok())?
    }

    /// The indices of an element in brackets: `[2][3]`.
    pub(in crate::model) fn brackets(&self, position: u32) -> String {
        brackets(&self.indices(position))
    }

    /// Checks that lists of values have one for each index.
    pub(in crate::model) fn verify_list(
        &self,
        name: &str,
        values: &Expr,
        diagnostics: &mut Diagnostics,
    ) -> Result<(), ErrorReported> {
        self.verify_from(0, name, values, diagnostics)
    }

    fn verify_from(
        &self,
        axis: usize,
        name: &str,
        values: &Expr,
        diagnostics: &mut Diagnostics,
    ) -> Result<(), ErrorReported> {
        let ExprKind::List(all) = &values.kind else { return Ok(()) };
        let Some(IndexExtent { lower, count }) = self.axes.get(axis) else {
            let message = format!("one value of `{name}` is a list itself");
            return Err(diagnostics.error(
                Diagnostic::new(Code::ValueCount, values.span, message)
                    .about(name)
                    .help("write one value for each element"),
            ));
        };
        if all.len() != *count as usize {
            let upper = lower + i64::from(*count) - 1;
            let message = match axis {
                0 => format!(
                    "`{name}` runs from {lower} to {upper}, and here are {} values",
                    all.len()
                ),
                _ => format!(
                    "index {} of `{name}` runs from {lower} to {upper}, and here are {} values",
                    axis + 1,
                    all.len()
                ),
            };
            return Err(diagnostics.error(
                Diagnostic::new(Code::ValueCount, values.span, message)
                    .about(name)
                    .help(format!("write {count} values, or one for all without a comma")),
            ));
        }
        all.iter().try_for_each(|value| self.verify_from(axis + 1, name, value, diagnostics))
    }

    /// The value of one element in a list that [`Self::verify_list`] has checked.
    pub(in crate::model) fn value_at<'a>(&self, values: &'a Expr, position: u32) -> &'a Expr {
        let mut value = values;
        for (index, axis) in self.indices(position).into_iter().zip(&self.axes) {
            let ExprKind::List(all) = &value.kind else { break };
            let along = usize::try_from(index - axis.lower).unwrap_or(usize::MAX);
            let Some(of_index) = all.get(along) else { break };
            value = of_index;
        }
        value
    }
}

/// `[2][3]`
pub(in crate::model) fn brackets(indices: &[i64]) -> String {
    let mut text = String::new();
    for index in indices {
        let _ = write!(text, "[{index}]");
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn positions_and_indices_are_inverse() {
        let axis = |lower, count| IndexExtent { lower, count };
        let shape = ArrayShape::new(vec![axis(0, 2), axis(1, 3), axis(-1, 2)]);
        assert_eq!((shape.count(), shape.rows(), shape.stride(0)), (Some(12), 6, 6));
        for position in 0..12 {
            assert_eq!(shape.position(&shape.indices(position)), Some(position));
        }
        assert_eq!(shape.brackets(7), "[1][1][0]");
        assert_eq!(shape.position(&[1, 4, 0]), None);
        assert_eq!(shape.position(&[1, 1]), None);
    }
}

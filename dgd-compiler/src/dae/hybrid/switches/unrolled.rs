//! Loops whose rows jump are unrolled, so that each row has its own events.
//!
//! Where only slopes jump, a loop stays one: the control of the error sees corners, and sensitivities
//! go through them. They do not go through a jump that nothing locates: loops that are too long for that
//! are listed, so that runs leave sensitivities blank.

use super::steps;
use super::surfaces::{SurfaceKind, surfaces};
use crate::dae::hybrid::smoothness::{Passage, Sizes, passage};
use crate::dae::rates::at_passage;
use crate::dae::{Dae, Family};
use crate::expr::ExprId;
use crate::model::Model;

/// Longer loops stay as they are: the program grows with the rows.
const MOST_ROWS: u32 = 10_000;

/// Unrolls the loops in which a value jumps where an element, or anything else that differs from row
/// to row, passes a threshold.
pub(super) fn unroll(dae: &mut Dae, model: &Model) {
    let sizes = Sizes::of(dae, model);
    for family in std::mem::take(&mut dae.families) {
        if family.count == 1 || !jumps(dae, model, &sizes, family.rhs) {
            dae.families.push(family);
            continue;
        }
        if family.count > MOST_ROWS {
            dae.unlocated.push(family.equation.clone());
            dae.families.push(family);
            continue;
        }
        for row in 0..family.count {
            let rhs = at_passage(&mut dae.graph, family.rhs, row);
            dae.families.push(Family {
                first: family.first + row as usize,
                count: 1,
                rhs,
                lower: family.lower.map(|lower| lower + i64::from(row)),
                equation: family.equation.clone(),
                ..family
            });
        }
    }
}

/// Whether a row jumps at a surface of its own.
fn jumps(dae: &mut Dae, model: &Model, sizes: &Sizes, row: ExprId) -> bool {
    if steps::differ_by_row(dae, model, row) {
        return true;
    }
    let row = steps::with_switched_angles(dae, model, row);
    let found = surfaces(dae, model, &[row], SurfaceKind::OfRows);
    if found.is_empty() {
        return false;
    }
    let mut trial = dae.graph.clone();
    found
        .iter()
        .any(|surface| passage(&mut trial, sizes, row, surface.e, &surface.signs) == Passage::Jump)
}

//! Unrolls loops whose rows jump, so that each row has its own events, and loops of algebraic equations made of pieces.
//!
//! If only slopes of differential equations jump, a loop stays one: error control sees corners, and sensitivities pass
//! through them. They do not pass through a jump without an event: loops that are too long for unrolling are listed, so
//! that runs leave sensitivities blank.

use super::algebraic::{AlgebraicUnknowns, is_total};
use super::steps;
use super::surfaces::{SurfaceKind, surfaces};
use crate::dae::hybrid::smoothness::{Continuity, SymbolSizes, passage};
use crate::dae::rates::at_passage;
use crate::dae::{Dae, DaeFamily};
use crate::model::Model;

/// Longer loops stay as they are: the program grows with the rows.
const MOST_ROWS: u32 = 10_000;

/// Unrolls the loops in which a value jumps where an element, or anything else that differs from row to row, passes a
/// threshold, and the loops of algebraic equations in which a slope does.
pub(super) fn unroll(dae: &mut Dae, model: &Model) {
    if dae.families.is_empty() {
        return;
    }
    let sizes = SymbolSizes::estimate(dae, model);
    let algebraic = AlgebraicUnknowns::from_dae(dae);
    let passages: Vec<Option<Continuity>> = (0..dae.families.len())
        .map(|k| {
            (dae.families[k].count > 1)
                .then(|| passage_of_rows(dae, model, &sizes, &algebraic, k))
                .flatten()
        })
        .collect();
    for (family, passage) in std::mem::take(&mut dae.families).into_iter().zip(passages) {
        let Some(passage) = passage else {
            dae.families.push(family);
            continue;
        };
        if family.count > MOST_ROWS {
            if passage == Continuity::Jump {
                dae.unlocated.push(family.equation.clone());
            }
            dae.families.push(family);
            continue;
        }
        for row in 0..family.count {
            let rhs = at_passage(&mut dae.graph, family.rhs, row);
            dae.families.push(DaeFamily {
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

/// How rows of a family pass their own surfaces, if events are needed there.
fn passage_of_rows(
    dae: &mut Dae,
    model: &Model,
    sizes: &SymbolSizes,
    algebraic: &AlgebraicUnknowns,
    family: usize,
) -> Option<Continuity> {
    let DaeFamily { rhs: row, differential, .. } = dae.families[family];
    if steps::differ_by_row(dae, model, row) {
        return Some(Continuity::Jump);
    }
    let row = steps::with_switched_angles(dae, model, row);
    let candidates = surfaces(dae, model, &[row], SurfaceKind::OfRows);
    if candidates.is_empty() {
        return None;
    }
    let may_have_pieces = !differential && is_total(&dae.graph, row);
    let mut trial = dae.graph.clone();
    let acting = candidates.iter().filter_map(|surface| {
        let here = passage(&mut trial, sizes, row, surface.e, &surface.signs);
        let acts = match here {
            Continuity::Jump => true,
            Continuity::Corner => may_have_pieces && algebraic.is_read_by(dae, surface.e),
            Continuity::Smooth => false,
        };
        acts.then_some(here)
    });
    acting.max()
}

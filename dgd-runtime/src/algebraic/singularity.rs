//! Detects where algebraic equations stop determining their unknowns.

use super::{AlgebraicSystem, ROUNDING, mask};
use crate::linalg::{Factorisation, Pivot, Singular};
use crate::solved::SolvableSystem;
use crate::system::{EvaluationPoint, Pattern};

/// Corrections below this fraction of the tolerance end the iteration.
pub(super) const CONVERGED: f64 = 1e-4;
/// Relative pivots below this are zero to rounding.
const NOTHING: f64 = 1e-12;
/// Fraction of a size or a distance that counts as small.
const PART: f64 = 1e-2;
/// Smallest relative difference that is distinguishable from rounding.
const SEEN: f64 = 1e-9;
/// A pivot that falls below this fraction is on its way to zero.
const TENTH: f64 = 0.1;

impl<S: SolvableSystem> AlgebraicSystem<S> {
    /// The equation that makes ∂f_a/∂y_a practically singular, if any; `jacobian` was evaluated at `at`, and `work` is
    /// work space for others.
    ///
    /// The measure is the smallest pivot m, with unknowns in units of their sizes and equations in units of their
    /// largest term so far. S_a is S_d, known to about `atol`, over m: once m falls below atol^(2/3) times its largest
    /// value in this run, at most a third of the digits are left. If m continues to zero
    /// ([`AlgebraicSystem::vanishes_nearby`]), error control that insists on the other digits takes endless steps. An
    /// equation that merely became weak, such as that of a diode that closed, still determines its unknown.
    #[inline]
    pub(crate) fn singular_equation(
        &mut self,
        system: &S,
        at: EvaluationPoint<'_>,
        jacobian: &[f64],
        work: &mut [f64],
        sizes: &[f64],
        atol: f64,
    ) -> Option<usize> {
        match self.smallest_relative_pivot(&system.signature().jacobian, jacobian, sizes) {
            Err(Singular { row }) => Some(row),
            Ok(None) => None,
            Ok(Some(pivot)) => {
                self.strongest = self.strongest.max(pivot.magnitude);
                let least = vanishing(atol).max(atol.powf(2.0 / 3.0) * self.strongest);
                let is_weak = pivot.magnitude <= least;
                (is_weak && self.vanishes_nearby(system, at, pivot, work, sizes))
                    .then_some(pivot.row)
            }
        }
    }

    /// Whether the small pivot of the last factorisation vanishes nearby: whether the solution is about to reach a
    /// point at which an equation stops determining its unknown.
    ///
    /// The algebraic unknowns are moved along the least determined direction to where the pivot m would vanish if it
    /// were linear, and then as far again. For 0 = f − q|q| it vanishes there, and for any power of q up to the eighth
    /// it falls below a tenth; for an exponential it falls by at most e², and a pivot that does not depend on the
    /// unknowns does not change. So the test depends neither on the size of the pivot and its units nor on the
    /// tolerance.
    #[cold]
    fn vanishes_nearby(
        &mut self,
        system: &S,
        at: EvaluationPoint<'_>,
        pivot: Pivot,
        work: &mut [f64],
        sizes: &[f64],
    ) -> bool {
        if pivot.magnitude <= NOTHING {
            return true;
        }
        let y = at.y;
        let direction = self.correction.as_mut();
        direction.fill(0.0);
        direction[pivot.row] = 1.0;
        self.factorisation.solve(self.correction.as_mut());
        mask(self.correction.as_mut(), self.mass.as_ref());
        let direction = self.correction.as_mut();
        let longest = direction.iter().fold(0.0, |longest: f64, d| longest.max(d.abs()));
        if !longest.is_finite() || longest == 0.0 {
            return true;
        }
        // Where y is large relative to its size, the move must exceed its rounding.
        let mut large = 1.0_f64;
        for ((d, y), size) in direction.iter_mut().zip(y).zip(sizes) {
            *d /= longest;
            if d.abs() > PART {
                large = large.max(y.abs() / size);
            }
        }
        let little = (PART * PART * pivot.magnitude / self.strongest).max(SEEN * large);
        let ahead = self.pivot_at(system, at, little, work, sizes);
        let behind = self.pivot_at(system, at, -little, work, sizes);
        let slope = (ahead - behind) / (2.0 * little);
        let distance = -pivot.magnitude / slope;
        if distance.abs() > PART * large {
            return false;
        }
        // NaN compares false: an equation that is not finite there counts as not determining its unknown.
        let goes_on = |this: &mut Self, work: &mut [f64], times: f64| {
            this.pivot_at(system, at, times * distance, work, sizes) > TENTH * pivot.magnitude
        };
        !(goes_on(self, work, 1.0) && goes_on(self, work, 2.0))
    }

    /// The smallest relative pivot with the algebraic unknowns moved along the direction in `correction`, by a distance
    /// in units of their sizes; zero if there is none.
    fn pivot_at(
        &mut self,
        system: &S,
        at: EvaluationPoint<'_>,
        by: f64,
        work: &mut [f64],
        sizes: &[f64],
    ) -> f64 {
        let moved = self.trial.as_mut();
        for (((moved, y), size), d) in
            moved.iter_mut().zip(at.y).zip(sizes).zip(self.correction.as_ref())
        {
            *moved = y + by * size * d;
        }
        let point = EvaluationPoint { y: self.trial.as_ref(), ..at };
        let (slopes, f, dfdt) = (&self.zero_slopes, &mut self.f, &mut self.dfdt);
        system.linearize(point, slopes.as_ref(), f.as_mut(), work, dfdt.as_mut());
        match self.relative_pivot(&system.signature().jacobian, work, sizes) {
            Err(Singular { .. }) => 0.0,
            Ok(pivot) => pivot.map_or(f64::INFINITY, |pivot| pivot.magnitude),
        }
    }

    /// The equation that makes ∂f_a/∂y_a a thousand times weaker than it was, if any.
    pub(crate) fn weakened_equation(
        &mut self,
        pattern: &Pattern,
        jacobian: &[f64],
        sizes: &[f64],
    ) -> Option<usize> {
        match self.smallest_relative_pivot(pattern, jacobian, sizes) {
            Err(Singular { row }) => Some(row),
            Ok(pivot) => {
                let weak = |pivot: &Pivot| pivot.magnitude <= 1e-3 * self.strongest;
                pivot.filter(weak).map(|pivot| pivot.row)
            }
        }
    }

    /// The equation, if any, that makes ∂f_a/∂y_a singular to rounding, or to the accuracy to which 0 = f_a is solved
    /// with this tolerance.
    pub(crate) fn vanishing_equation(
        &mut self,
        system: &S,
        at: EvaluationPoint<'_>,
        jacobian: &[f64],
        work: &mut [f64],
        sizes: &[f64],
        atol: f64,
    ) -> Option<usize> {
        match self.smallest_relative_pivot(&system.signature().jacobian, jacobian, sizes) {
            Err(Singular { row }) => Some(row),
            Ok(pivot) => {
                let pivot = pivot.filter(|pivot| pivot.magnitude <= vanishing(atol))?;
                self.strongest = self.strongest.max(pivot.magnitude);
                self.vanishes_nearby(system, at, pivot, work, sizes).then_some(pivot.row)
            }
        }
    }

    /// Whether rounding of f_a moves an algebraic unknown by more than its tolerance: by ε over the
    /// relative pivot.
    pub(crate) fn is_lost_in_rounding(
        &mut self,
        pattern: &Pattern,
        jacobian: &[f64],
        sizes: &[f64],
        atol: f64,
    ) -> bool {
        match self.smallest_relative_pivot(pattern, jacobian, sizes) {
            Err(Singular { .. }) => true,
            Ok(pivot) => pivot.is_some_and(|pivot| pivot.magnitude * atol <= ROUNDING),
        }
    }

    #[inline]
    fn smallest_relative_pivot(
        &mut self,
        pattern: &Pattern,
        jacobian: &[f64],
        sizes: &[f64],
    ) -> Result<Option<Pivot>, Singular> {
        // Each row is scaled by its largest term so far; otherwise an equation with one term would always look regular.
        let row_sizes = self.row_sizes.as_mut();
        pattern.for_each(jacobian, |row, column, j| {
            row_sizes[row] = row_sizes[row].max((j * sizes[column]).abs());
        });
        self.relative_pivot(pattern, jacobian, sizes)
    }

    #[inline]
    fn relative_pivot(
        &mut self,
        pattern: &Pattern,
        jacobian: &[f64],
        sizes: &[f64],
    ) -> Result<Option<Pivot>, Singular> {
        let (mass, row_sizes) = (self.mass.as_ref(), self.row_sizes.as_ref());
        self.rows.as_mut().copy_from_slice(jacobian);
        pattern.for_each_mut(self.rows.as_mut(), |row, column, value| {
            let inside = mass[row] == 0.0 && mass[column] == 0.0 && row_sizes[row] > 0.0;
            *value = if inside { *value * sizes[column] / row_sizes[row] } else { 0.0 };
        });
        let rows = self.rows.as_ref();
        self.factorisation.factorise(1.0, |i| mass[i] != 0.0, pattern, rows, None)?;
        Ok(self.factorisation.smallest_pivot())
    }
}

/// Relative pivots below this are zero: at a double root, iteration down to [`CONVERGED`] leaves this much.
fn vanishing(atol: f64) -> f64 {
    (10.0 * CONVERGED * atol).max(NOTHING)
}

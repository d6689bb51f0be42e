//! Algebraic equations: solving them, how their unknowns depend on time and parameters, and which equation is at fault
//! if that fails.
//!
//! ```text
//!   0 = f_a(t, y_d, y_a),  y_d given:     −∂f_a/∂y_a δ = f_a,  y_a ← y_a + λ δ
//!   0 = g_a(t, y, S_d, S_a), S_d given:   −∂f_a/∂y_a S_a = ∂f_a/∂y_d S_d + ∂f_a/∂θ
//! ```
//!
//! λ is halved until the next correction with the same matrix is smaller than this one: a test that does not depend on
//! how equations are scaled (Deuflhard, Newton Methods for Nonlinear Problems, 2004, §3.3). Both systems are solved at
//! full size, with the identity in the rows of differential unknowns, so that one factorisation serves all sizes and
//! patterns.

pub(crate) mod domain;
mod newton;
mod pieces;
mod rates;
pub(crate) mod readings;
mod singularity;

use crate::linalg::{Factorisation, Singular};
use crate::solved::SolvableSystem;
use crate::system::{EvaluationPoint, Pattern, Signature, Storage};
pub(crate) use newton::CorrectionWeights;
pub(crate) use pieces::PieceAutomata;
pub(crate) use rates::UnknownRates;

/// Residuals below this fraction of the equation's terms are rounding errors of a few operations.
pub(crate) const ROUNDING: f64 = 4.0 * f64::EPSILON;

/// Inputs at the time of the equations. Those that act late may move with the unknowns.
pub(crate) trait InputsAt {
    fn evaluate(&mut self, y: &[f64]) -> &[f64];
}

impl InputsAt for &[f64] {
    #[inline]
    fn evaluate(&mut self, _: &[f64]) -> &[f64] {
        self
    }
}

/// The point at which algebraic equations are solved.
#[derive(Clone, Copy)]
pub(crate) struct AlgebraicPoint<'a, U = &'a [f64]> {
    pub(crate) t: f64,
    pub(crate) u: U,
    pub(crate) p: &'a [f64],
    pub(crate) z: &'a [f64],
}

/// The algebraic equations of a model and their Jacobian ∂f_a/∂y_a.
pub(crate) struct AlgebraicSystem<S: SolvableSystem> {
    /// 1 for a differential unknown, 0 for an algebraic one.
    pub(crate) mass: S::Vector,
    count: usize,
    pub(crate) factorisation: S::Factorisation,
    /// J with the rows of differential unknowns set to zero.
    pub(super) rows: S::Jacobian,
    pub(super) row_sizes: S::Vector,
    pub(super) f: S::Vector,
    pub(super) trial: S::Vector,
    pub(super) correction: S::Vector,
    pub(super) next: S::Vector,
    pub(super) dfdt: S::Vector,
    pub(super) zero_slopes: S::Inputs,
    /// The largest relative pivot of [`AlgebraicSystem::weakest`] so far.
    pub(super) strongest: f64,
}

impl<S: SolvableSystem> AlgebraicSystem<S> {
    pub(crate) fn new(system: &S) -> Self {
        let signature = system.signature();
        let n = signature.unknowns.len();
        let mut mass = S::Vector::zeros(n);
        signature.write_mass(mass.as_mut());
        // If no mode has algebraic unknowns, nothing is factorised.
        let is_explicit = Self::is_explicit(signature);
        let pattern = if is_explicit { &Pattern::EMPTY } else { &signature.jacobian };
        Self::with_mass(system, mass, pattern)
    }

    /// Whether no mode has algebraic unknowns.
    pub(crate) fn is_explicit(signature: &Signature) -> bool {
        signature.unknowns.n_algebraic() == 0 && signature.discrete.automata.is_empty()
    }

    /// All equations, as if all unknowns were algebraic: 0 = f for all of y.
    pub(crate) fn all(system: &S) -> Self {
        let signature = system.signature();
        let mass = S::Vector::zeros(signature.unknowns.len());
        Self::with_mass(system, mass, &signature.jacobian)
    }

    fn with_mass(system: &S, mass: S::Vector, pattern: &Pattern) -> Self {
        let signature = system.signature();
        let n = signature.unknowns.len();
        let count = mass.as_ref().iter().filter(|mass| **mass == 0.0).count();
        let zeros = || S::Vector::zeros(n);
        Self {
            mass,
            count,
            factorisation: S::Factorisation::new(n, pattern),
            rows: S::Jacobian::zeros(signature.jacobian.len()),
            row_sizes: zeros(),
            f: zeros(),
            trial: zeros(),
            correction: zeros(),
            next: zeros(),
            dfdt: zeros(),
            zero_slopes: S::Inputs::zeros(signature.n_u()),
            strongest: 0.0,
        }
    }

    /// Switches to the mass matrix of other modes, and forgets the sizes of the equations, which were those of the old
    /// modes.
    pub(crate) fn enter_modes(&mut self, mass: &[f64]) {
        self.mass.as_mut().copy_from_slice(mass);
        self.count = mass.iter().filter(|mass| **mass == 0.0).count();
        self.row_sizes.as_mut().fill(0.0);
        self.strongest = 0.0;
    }

    /// Whether all unknowns are differential.
    pub(crate) fn is_empty(&self) -> bool {
        !S::FEATURES.algebraic || self.count == 0
    }

    /// Whether f differs from `other` in an algebraic equation.
    pub(crate) fn differs(&self, f: &[f64], other: &[f64]) -> bool {
        let n = self.mass.as_ref().len().max(1);
        f.chunks_exact(n).zip(other.chunks_exact(n)).any(|(f, other)| {
            self.mass
                .as_ref()
                .iter()
                .zip(f.iter().zip(other))
                .any(|(m, (f, o))| *m == 0.0 && f != o)
        })
    }

    /// Sets the rows of differential unknowns to zero.
    pub(crate) fn keep_algebraic(&self, values: &mut [f64]) {
        mask(values, self.mass.as_ref());
    }

    /// Sets the rows of algebraic unknowns to zero, in one or several vectors.
    pub(crate) fn keep_differential(&self, values: &mut [f64]) {
        let n = self.mass.as_ref().len().max(1);
        for column in values.chunks_exact_mut(n) {
            for (value, mass) in column.iter_mut().zip(self.mass.as_ref()) {
                if *mass == 0.0 {
                    *value = 0.0;
                }
            }
        }
    }

    /// Factorises ⎡ I 0 ⎤ over ⎣ −∂f_a/∂y_d −∂f_a/∂y_a ⎦, with unknowns of these sizes.
    pub(crate) fn factorise(
        &mut self,
        pattern: &Pattern,
        jacobian: &[f64],
        sizes: &[f64],
    ) -> Result<(), Singular> {
        let mass = self.mass.as_ref();
        self.rows.as_mut().copy_from_slice(jacobian);
        pattern.for_each_mut(self.rows.as_mut(), |row, _, value| {
            if mass[row] != 0.0 {
                *value = 0.0;
            }
        });
        let (rows, sizes) = (self.rows.as_ref(), Some(sizes));
        self.factorisation.factorise(1.0, |i| mass[i] != 0.0, pattern, rows, sizes)
    }

    /// ẏ in place of `f`, from 0 = ∂f_a/∂y ẏ + df_a/dt with ẏ_d = f_d.
    pub(crate) fn rates(
        &mut self,
        pattern: &Pattern,
        jacobian: &[f64],
        f: &mut [f64],
        dfdt: &[f64],
        sizes: &[f64],
    ) -> Result<(), Singular> {
        if self.is_empty() {
            return Ok(());
        }
        self.factorise(pattern, jacobian, sizes)?;
        for ((f, dfdt), mass) in f.iter_mut().zip(dfdt).zip(self.mass.as_ref()) {
            if *mass == 0.0 {
                *f = *dfdt;
            }
        }
        // The rows of J that couple algebraic equations to ẏ_d are in the matrix.
        self.factorisation.solve(f);
        Ok(())
    }

    /// Solves 0 = g_a for the sensitivities of algebraic unknowns; those of differential unknowns
    /// are given, and the others in `s` overwritten. [`AlgebraicSystem::factorise`] comes first.
    pub(crate) fn make_sensitivities_consistent(
        &mut self,
        system: &S,
        at: EvaluationPoint<'_>,
        s: &mut [f64],
        g: &mut [f64],
    ) {
        // With S_a = 0, g_a = ∂f_a/∂y_d S_d + ∂f_a/∂θ.
        self.keep_differential(s);
        self.correct_sensitivities(system, at, s, g);
    }

    /// Corrects sensitivities of algebraic unknowns at values other than those of the factorisation; the corrections
    /// stay in `g`.
    pub(crate) fn correct_sensitivities(
        &mut self,
        system: &S,
        at: EvaluationPoint<'_>,
        s: &mut [f64],
        g: &mut [f64],
    ) {
        system.sensitivity_rhs(at, s, self.f.as_mut(), g);
        for column in g.chunks_exact_mut(self.mass.as_ref().len().max(1)) {
            mask(column, self.mass.as_ref());
        }
        self.factorisation.solve(g);
        add_scaled(s, 1.0, g);
    }

    /// Whether every residual of an algebraic equation in `f` is within the rounding of the equation's terms at `y`.
    pub(crate) fn is_rounding(
        &mut self,
        pattern: &Pattern,
        jacobian: &[f64],
        y: &[f64],
        f: &S::Vector,
    ) -> bool {
        is_rounding(f, &self.mass, &mut self.trial, pattern, jacobian, y)
    }
}

pub(super) fn is_rounding<V: Storage>(
    f: &V,
    mass: &V,
    terms: &mut V,
    pattern: &Pattern,
    jacobian: &[f64],
    y: &[f64],
) -> bool {
    let terms = terms.as_mut();
    terms.fill(0.0);
    add_terms(terms, pattern, jacobian, y);
    let mut rows = f.as_ref().iter().zip(terms).zip(mass.as_ref());
    rows.all(|((f, terms), mass)| *mass != 0.0 || f.abs() <= ROUNDING * *terms)
}

/// Adds the sizes of the equations' terms at `y`, to first order.
pub(crate) fn add_terms(terms: &mut [f64], pattern: &Pattern, jacobian: &[f64], y: &[f64]) {
    pattern.for_each(jacobian, |row, column, j| terms[row] += (j * y[column]).abs());
}

/// Sets the rows of differential unknowns to zero.
#[inline]
pub(super) fn mask(values: &mut [f64], mass: &[f64]) {
    for (value, mass) in values.iter_mut().zip(mass) {
        if *mass != 0.0 {
            *value = 0.0;
        }
    }
}

pub(super) fn add_scaled(y: &mut [f64], factor: f64, x: &[f64]) {
    for (y, x) in y.iter_mut().zip(x) {
        *y += factor * x;
    }
}

//! Consistent values: algebraic unknowns that fulfil their equations.
//!
//! ```text
//!   0 = f_a(t, y_d, y_a),  y_d given:     −∂f_a/∂y_a δ = f_a,  y_a ← y_a + λ δ
//!   0 = g_a(t, y, S_d, S_a), S_d given:   −∂f_a/∂y_a S_a = ∂f_a/∂y_d S_d + ∂f_a/∂θ
//! ```
//!
//! λ is halved until the next correction, by the same matrix, is the smaller for it: a test that
//! does not depend on how equations are scaled (Deuflhard, Newton Methods for Nonlinear Problems,
//! 2004, §3.3). Both systems are solved at full size, with the identity in the rows of differential
//! unknowns, so that one factorisation serves all sizes and patterns.

use crate::discrete::state_selection::select_states;
use crate::discrete::{choose_sides, choose_start_modes, discrete_numbers, waiting};
use crate::error::{InitialError, IntegrateError};
use crate::integrate::drive::Drive;
use crate::linalg::blocks::{blocks, is_singular};
use crate::linalg::norm::Tolerances;
use crate::linalg::{Factorisation, Pivot, Singular};
use crate::observe::readings::readings;
use crate::problem::{Options, Problem, unknown_sizes};
use crate::signal::Side;
use crate::system::{Pattern, Point, Signature, Storage, System};

/// Corrections below this part of the tolerance end the iteration.
const CONVERGED: f64 = 1e-4;
const MOST_ITERATIONS: usize = 100;
/// Residuals below this part of the equation's terms are rounding: a few operations on them.
pub(crate) const ROUNDING: f64 = 4.0 * f64::EPSILON;
/// The smallest damping tried, λ.
const LEAST_DAMPING: f64 = 1.0 / 4096.0;
/// Relative pivots below this are zero, to rounding.
const NOTHING: f64 = 1e-12;
/// What is far less: of a size, and of a distance.
const PART: f64 = 1e-2;
/// The part of a number that a difference needs to be told from rounding.
const SEEN: f64 = 1e-9;
/// What a pivot falls to, at the most, that goes to zero.
const TENTH: f64 = 0.1;
/// How often a guess at which the equations are singular is moved.
const MOST_NUDGES: u32 = 3;

/// A start that fulfils all equations.
#[derive(Debug, Clone, PartialEq)]
pub struct ConsistentStart {
    /// Unknowns.
    pub y: Vec<f64>,
    /// Their derivatives, those of algebraic unknowns included.
    pub ydot: Vec<f64>,
    /// Discrete numbers.
    pub z: Vec<f64>,
    /// Positions of the transitions whose conditions hold here: they act once these were false.
    pub waiting: Vec<usize>,
}

/// Start values at `t` that fulfil the algebraic equations, and the derivatives that go with them.
///
/// # Errors
///
/// [`IntegrateError::BadRequest`], [`IntegrateError::Inputs`] and [`IntegrateError::Initial`].
pub fn consistent_start<S: System>(
    problem: &Problem<'_, S>,
    t: f64,
    options: &Options,
) -> Result<ConsistentStart, IntegrateError> {
    options.verify().map_err(IntegrateError::BadRequest)?;
    problem.verify().map_err(IntegrateError::BadRequest)?;
    problem.inputs.cover(t, t).map_err(IntegrateError::Inputs)?;
    let system = problem.system;
    let signature = system.signature();
    let n = signature.unknowns.len();

    let inputs = problem.inputs_read().map_err(IntegrateError::Inputs)?;
    let segment = inputs.segment(inputs.segment_at(t, Side::Right));
    let read = Problem { inputs: &inputs, ..*problem };
    let tolerances = Tolerances { rtol: options.rtol, atol: options.atol };
    let mut drive = Drive::new(&read, segment, t, 0, tolerances);
    let mut y = S::Vector::zeros(n);
    let mut z = discrete_numbers(system, problem.p, t);
    let mut u = S::Inputs::zeros(signature.n_u());
    u.as_mut().copy_from_slice(drive.at(t, y.as_ref()));
    let at = Point { t, y: &[], u: u.as_ref(), p: problem.p, z: &z };
    start_values(problem, at, y.as_mut()).map_err(IntegrateError::Initial)?;
    let mut e = vec![0.0; signature.discrete.transitions().count()];
    let place = (t, y.as_ref(), u.as_ref(), problem.p);
    choose_start_modes(system, place, &mut e, &mut z);
    let at = Point { t, y: y.as_ref(), u: u.as_ref(), p: problem.p, z: &[] };
    select_states(system, at, &mut z, &mut e);
    choose_sides(system, place, &mut e, &mut z);
    let mut sizes = S::Vector::zeros(n);
    unknown_sizes(system, y.as_ref(), sizes.as_mut());

    let mut algebraic = Algebraic::new(system);
    let mut mass = S::Vector::zeros(n);
    let at = Point { t, y: &[], u: u.as_ref(), p: problem.p, z: &z };
    system.mass(at, mass.as_mut());
    algebraic.enter_modes(mass.as_ref());
    let mut jacobian = S::Jacobian::zeros(signature.jacobian.len());
    let at = AlgebraicPoint { t, u: drive.at(t, y.as_ref()), p: problem.p, z: &z };
    algebraic
        .make_consistent(system, at, y.as_mut(), jacobian.as_mut(), sizes.as_ref(), tolerances)
        .map_err(IntegrateError::Initial)?;

    let (mut f, mut dfdt) = (S::Vector::zeros(n), S::Vector::zeros(n));
    drive.begin_history(t, y.as_ref(), None, sizes.as_ref());
    let (u, udot) = drive.with_slope(t, y.as_ref());
    let at = Point { t, y: y.as_ref(), u, p: problem.p, z: &z };
    system.linearize(at, udot, f.as_mut(), jacobian.as_mut(), dfdt.as_mut());
    let waiting = waiting(system, at, &mut e);
    algebraic
        .rates(&signature.jacobian, jacobian.as_ref(), f.as_mut(), dfdt.as_ref())
        .map_err(|Singular { row }| algebraic.singular(system, at, row, jacobian.as_ref()))
        .map_err(IntegrateError::Initial)?;
    Ok(ConsistentStart { y: y.as_ref().to_vec(), ydot: f.as_ref().to_vec(), z, waiting })
}

/// Writes the model's start values, with replacements, into `y`.
pub fn start_values<S: System>(
    problem: &Problem<'_, S>,
    at: Point<'_>,
    y: &mut [f64],
) -> Result<(), InitialError> {
    problem.system.start(at, y);
    for &(i, value) in problem.start {
        y[i] = value;
    }
    match y.iter().position(|value| !value.is_finite()) {
        None => Ok(()),
        Some(i) => Err(InitialError::StartNotFinite {
            unknown: problem.system.signature().unknowns.name(i).to_string(),
            t: at.t,
        }),
    }
}

/// Where algebraic equations are solved.
#[derive(Clone, Copy)]
pub(crate) struct AlgebraicPoint<'a> {
    pub(crate) t: f64,
    pub(crate) u: &'a [f64],
    pub(crate) p: &'a [f64],
    pub(crate) z: &'a [f64],
}

/// The algebraic equations of a model and their Jacobian ∂f_a/∂y_a.
pub(crate) struct Algebraic<S: System> {
    /// 1 where the unknown is differential, 0 where it is algebraic.
    pub(crate) mass: S::Vector,
    count: usize,
    pub(crate) factorisation: S::Factorisation,
    /// J with the rows of differential unknowns set to zero.
    rows: S::Jacobian,
    row_sizes: S::Vector,
    f: S::Vector,
    trial: S::Vector,
    correction: S::Vector,
    next: S::Vector,
    dfdt: S::Vector,
    zero_slopes: S::Inputs,
    /// The largest relative pivot of [`Algebraic::weakest`] so far.
    strongest: f64,
}

impl<S: System> Algebraic<S> {
    pub(crate) fn new(system: &S) -> Self {
        let signature = system.signature();
        let n = signature.unknowns.len();
        let mut mass = S::Vector::zeros(n);
        signature.write_mass(mass.as_mut());
        // Without algebraic unknowns in any mode nothing is factorised.
        let is_explicit = Self::is_explicit(signature);
        let pattern = if is_explicit { &Pattern::EMPTY } else { &signature.jacobian };
        Self::with(system, mass, pattern)
    }

    /// Whether no mode has algebraic unknowns.
    pub(crate) fn is_explicit(signature: &Signature) -> bool {
        signature.unknowns.n_algebraic() == 0 && signature.discrete.automata.is_empty()
    }

    /// All equations, as if no unknown had a derivative: 0 = f for all of y.
    pub(crate) fn all(system: &S) -> Self {
        let signature = system.signature();
        let mass = S::Vector::zeros(signature.unknowns.len());
        Self::with(system, mass, &signature.jacobian)
    }

    fn with(system: &S, mass: S::Vector, pattern: &Pattern) -> Self {
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

    /// Takes over the mass matrix of other modes. What was learnt about the sizes of equations was
    /// learnt about others.
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

    /// Factorises ⎡ I 0 ⎤ over ⎣ −∂f_a/∂y_d −∂f_a/∂y_a ⎦.
    pub(crate) fn factorise(
        &mut self,
        pattern: &Pattern,
        jacobian: &[f64],
    ) -> Result<(), Singular> {
        let mass = self.mass.as_ref();
        self.rows.as_mut().copy_from_slice(jacobian);
        pattern.for_each_mut(self.rows.as_mut(), |row, _, value| {
            if mass[row] != 0.0 {
                *value = 0.0;
            }
        });
        self.factorisation.factorise(1.0, |i| mass[i] != 0.0, pattern, self.rows.as_ref())
    }

    /// ẏ in place of `f`, from 0 = ∂f_a/∂y ẏ + df_a/dt with ẏ_d = f_d.
    pub(crate) fn rates(
        &mut self,
        pattern: &Pattern,
        jacobian: &[f64],
        f: &mut [f64],
        dfdt: &[f64],
    ) -> Result<(), Singular> {
        if self.is_empty() {
            return Ok(());
        }
        self.factorise(pattern, jacobian)?;
        for ((f, dfdt), mass) in f.iter_mut().zip(dfdt).zip(self.mass.as_ref()) {
            if *mass == 0.0 {
                *f = *dfdt;
            }
        }
        // The rows of J that couple algebraic equations to ẏ_d are in the matrix.
        self.factorisation.solve(f);
        Ok(())
    }

    /// The equation that makes ∂f_a/∂y_a as good as singular, if one does; `jacobian` was taken at `at`, and
    /// `work` is space for others.
    ///
    /// The measure is the smallest pivot m, with unknowns in units of their sizes and equations in
    /// units of their largest term so far. S_a is S_d, known to about `atol`, over m: where m falls
    /// below atol^(2/3) of the largest it was in this run, no more than a third of the digits are
    /// left, and an error estimate that insists on the others takes steps without number, if m goes on
    /// to zero ([`Algebraic::vanishes_nearby`]). An equation that merely became weak, such as that of a
    /// diode that closed, still determines its unknown.
    #[inline]
    pub(crate) fn singular_equation(
        &mut self,
        system: &S,
        at: Point<'_>,
        (jacobian, work): (&[f64], &mut [f64]),
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

    /// Whether a small pivot, factorised last, is zero close to where it was found: whether the solution is
    /// about to meet a point at which an equation stops determining its unknown.
    ///
    /// The algebraic unknowns are moved along the direction in which they are determined least, to where
    /// the pivot m would be zero if it were linear, and once more as far. With 0 = f − q|q| it is zero
    /// there, and with any power of q up to the eighth less than a tenth; that of an exponential falls by
    /// e² at the most, and what does not depend on the unknowns stays as it is. So how small it is does not
    /// matter, in whatever units, nor does the tolerance.
    #[cold]
    fn vanishes_nearby(
        &mut self,
        system: &S,
        at: Point<'_>,
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
        // Where y is large for its size, what moves it has to be seen in it.
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
        // NaN compares false: an equation that is not finite there does not determine its unknown.
        let goes_on = |this: &mut Self, work: &mut [f64], times: f64| {
            this.pivot_at(system, at, times * distance, work, sizes) > TENTH * pivot.magnitude
        };
        !(goes_on(self, work, 1.0) && goes_on(self, work, 2.0))
    }

    /// The smallest relative pivot with the algebraic unknowns moved by so many sizes along the direction in
    /// `correction`; zero where there is none.
    fn pivot_at(
        &mut self,
        system: &S,
        at: Point<'_>,
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
        let at = Point { y: self.trial.as_ref(), ..at };
        let (slopes, f, dfdt) = (&self.zero_slopes, &mut self.f, &mut self.dfdt);
        system.linearize(at, slopes.as_ref(), f.as_mut(), work, dfdt.as_mut());
        match self.relative_pivot(&system.signature().jacobian, work, sizes) {
            Err(Singular { .. }) => 0.0,
            Ok(pivot) => pivot.map_or(f64::INFINITY, |pivot| pivot.magnitude),
        }
    }

    /// The equation that makes ∂f_a/∂y_a a thousand times weaker than it has been, if one does.
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

    /// The equation that makes ∂f_a/∂y_a singular to rounding, or to what a solution of 0 = f_a for
    /// unknowns with this tolerance makes of zero; if one does.
    pub(crate) fn vanishing_equation(
        &mut self,
        system: &S,
        at: Point<'_>,
        (jacobian, work): (&[f64], &mut [f64]),
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
        // Rows remember their largest term, or an equation of one term would always look regular.
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
        self.factorisation.factorise(1.0, |i| mass[i] != 0.0, pattern, self.rows.as_ref())?;
        Ok(self.factorisation.smallest_pivot())
    }

    /// Solves 0 = f_a for the algebraic unknowns, from the guess in `y`; `jacobian` is work space.
    pub(crate) fn make_consistent(
        &mut self,
        system: &S,
        at: AlgebraicPoint<'_>,
        y: &mut [f64],
        jacobian: &mut [f64],
        sizes: &[f64],
        tolerances: Tolerances,
    ) -> Result<(), InitialError> {
        if self.is_empty() {
            return Ok(());
        }
        self.solve(system, at, y, jacobian, sizes, tolerances)
    }

    /// The same, whether or not the type of models has algebraic unknowns.
    pub(crate) fn solve(
        &mut self,
        system: &S,
        at: AlgebraicPoint<'_>,
        y: &mut [f64],
        jacobian: &mut [f64],
        sizes: &[f64],
        tolerances: Tolerances,
    ) -> Result<(), InitialError> {
        self.solve_nudged(system, at, y, jacobian, (sizes, tolerances), MOST_NUDGES)
    }

    /// The same from a guess that is close: it is not left for another one where equations are singular.
    pub(crate) fn solve_nearby(
        &mut self,
        system: &S,
        at: AlgebraicPoint<'_>,
        y: &mut [f64],
        jacobian: &mut [f64],
        sizes: &[f64],
        tolerances: Tolerances,
    ) -> Result<(), InitialError> {
        self.solve_nudged(system, at, y, jacobian, (sizes, tolerances), 0)
    }

    fn solve_nudged(
        &mut self,
        system: &S,
        at: AlgebraicPoint<'_>,
        y: &mut [f64],
        jacobian: &mut [f64],
        (sizes, tolerances): (&[f64], Tolerances),
        most_nudges: u32,
    ) -> Result<(), InitialError> {
        let AlgebraicPoint { t, u, p, z } = at;
        let signature = system.signature();
        let pattern = &signature.jacobian;
        let equation = |row: usize| signature.equations.at(row).to_string();
        let mut nudges = 0;

        for iteration in 1..=MOST_ITERATIONS {
            system.linearize(
                Point { t, y, u, p, z },
                self.zero_slopes.as_ref(),
                self.f.as_mut(),
                jacobian,
                self.dfdt.as_mut(),
            );
            mask(self.f.as_mut(), self.mass.as_ref());
            let not_finite = self.f.as_ref().iter().position(|f| !f.is_finite()).or_else(|| {
                let mut entries = pattern.positions().zip(jacobian.iter());
                let mass = self.mass.as_ref();
                let found = entries.find(|((row, _), j)| mass[*row] == 0.0 && !j.is_finite());
                found.map(|((row, _), _)| row)
            });
            if let Some(row) = not_finite {
                let at = readings(system, Point { t, y, u, p, z }, row);
                return Err(InitialError::NotFinite { equation: equation(row), t, at });
            }
            if self.f.as_ref().iter().all(|f| *f == 0.0) {
                return Ok(());
            }

            // −∂f_a/∂y_a δ = f_a
            let factorised = self.factorise(pattern, jacobian);
            self.correction.as_mut().copy_from_slice(self.f.as_ref());
            let norm = if factorised.is_ok() {
                self.factorisation.solve(self.correction.as_mut());
                // What is given stays as it is, rounding of the elimination aside.
                mask(self.correction.as_mut(), self.mass.as_ref());
                tolerances.mean_square(self.correction.as_ref(), y, y, sizes)
            } else {
                f64::INFINITY
            };
            if !norm.is_finite() {
                if is_rounding(&self.f, &self.mass, &mut self.trial, pattern, jacobian, y) {
                    return Ok(());
                }
                if nudges == most_nudges {
                    let row = factorised.err().map_or(largest(self.f.as_ref()), |e| e.row);
                    return Err(self.singular(system, Point { t, y, u, p, z }, row, jacobian));
                }
                nudges += 1;
                self.nudge(y, sizes, nudges);
                continue;
            }
            if norm <= CONVERGED * CONVERGED {
                add_scaled(y, 1.0, self.correction.as_ref());
                return Ok(());
            }

            // λ is good when the next correction by this matrix is the smaller for it.
            let mut lambda = 1.0;
            while lambda >= LEAST_DAMPING {
                self.trial.as_mut().copy_from_slice(y);
                add_scaled(self.trial.as_mut(), lambda, self.correction.as_ref());
                let trial = self.trial.as_ref();
                system.rhs(Point { t, y: trial, u, p, z }, self.next.as_mut());
                mask(self.next.as_mut(), self.mass.as_ref());
                self.factorisation.solve(self.next.as_mut());
                let next = tolerances.mean_square(self.next.as_ref(), y, y, sizes);
                let contraction = 1.0 - 0.25 * lambda;
                if next <= contraction * contraction * norm {
                    break;
                }
                lambda *= 0.5;
            }
            if lambda >= LEAST_DAMPING {
                y.copy_from_slice(self.trial.as_ref());
            } else if is_rounding(&self.f, &self.mass, &mut self.trial, pattern, jacobian, y) {
                return Ok(());
            } else if nudges < most_nudges {
                nudges += 1;
                self.nudge(y, sizes, nudges);
            } else {
                let at = Point { t, y, u, p, z };
                let reached = (&*jacobian, iteration);
                return Err(self.not_converged(system, at, sizes, tolerances, reached));
            }
        }
        let at = Point { t, y, u, p, z };
        let reached = (&*jacobian, MOST_ITERATIONS);
        Err(self.not_converged(system, at, sizes, tolerances, reached))
    }

    /// Moves algebraic unknowns by their sizes: q|q| has no slope at a guess of zero, and hardly
    /// any near it.
    fn nudge(&self, y: &mut [f64], sizes: &[f64], times: u32) {
        for ((y, size), mass) in y.iter_mut().zip(sizes).zip(self.mass.as_ref()) {
            *y += (1.0 - mass) * size * f64::from(times);
        }
    }

    /// Solves 0 = g_a for the sensitivities of algebraic unknowns; those of differential unknowns
    /// are given, and the others in `s` overwritten. [`Algebraic::factorise`] comes first.
    pub(crate) fn make_sensitivities_consistent(
        &mut self,
        system: &S,
        at: Point<'_>,
        s: &mut [f64],
        g: &mut [f64],
    ) {
        // With S_a = 0, g_a = ∂f_a/∂y_d S_d + ∂f_a/∂θ.
        self.keep_differential(s);
        self.correct_sensitivities(system, at, s, g);
    }

    /// Corrects sensitivities of algebraic unknowns where other things are read than those that were factorised
    /// with; the corrections stay in `g`.
    pub(crate) fn correct_sensitivities(
        &mut self,
        system: &S,
        at: Point<'_>,
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

    /// Whether no residual of an algebraic equation in `f` is larger than the rounding of the
    /// equation's terms at `y`.
    pub(crate) fn is_rounding(
        &mut self,
        pattern: &Pattern,
        jacobian: &[f64],
        y: &[f64],
        f: &S::Vector,
    ) -> bool {
        is_rounding(f, &self.mass, &mut self.trial, pattern, jacobian, y)
    }

    fn not_converged(
        &self,
        system: &S,
        at: Point<'_>,
        sizes: &[f64],
        tolerances: Tolerances,
        (jacobian, iterations): (&[f64], usize),
    ) -> InitialError {
        let signature = system.signature();
        let Point { t, y, .. } = at;
        let row = self.first_unsolved(&signature.jacobian, jacobian, y);
        let correction = self.correction.as_ref();
        let relative = |i: usize| correction[i].abs() / tolerances.weight(y[i], sizes[i]);
        let unknown =
            (0..y.len()).max_by(|&i, &j| relative(i).total_cmp(&relative(j))).unwrap_or(0);
        InitialError::NotConverged {
            t,
            iterations,
            equation: signature.equations.at(row).to_string(),
            residual: self.f.as_ref()[row],
            unknown: signature.unknowns.name(unknown).to_string(),
            correction: correction[unknown],
            at: readings(system, at, row),
        }
    }
}

impl<S: System> Algebraic<S> {
    /// The equation that is furthest from being solved, in the first block with such equations:
    /// those of later blocks read unknowns of this one, and are not to blame.
    fn first_unsolved(&self, pattern: &Pattern, jacobian: &[f64], y: &[f64]) -> usize {
        let f = self.f.as_ref();
        let mut terms = vec![0.0; f.len()];
        add_terms(&mut terms, pattern, jacobian, y);
        let relative = |row: usize| f[row].abs() / terms[row].max(f64::MIN_POSITIVE);
        let unsolved = |block: &Vec<usize>| {
            let rows = block.iter().copied().filter(|row| f[*row].abs() > ROUNDING * terms[*row]);
            rows.max_by(|i, j| relative(*i).total_cmp(&relative(*j)))
        };
        let blocks = blocks(pattern, jacobian, self.mass.as_ref());
        blocks.iter().find_map(unsolved).unwrap_or_else(|| largest(f))
    }

    /// The block that is singular, by the equation in it with the largest residual; `row` where none
    /// is by itself.
    fn singular(&self, system: &S, at: Point<'_>, row: usize, jacobian: &[f64]) -> InitialError {
        let signature = system.signature();
        let pattern = &signature.jacobian;
        let f = self.f.as_ref();
        let blocks = blocks(pattern, jacobian, self.mass.as_ref());
        let block = blocks.into_iter().find(|block| is_singular(block, pattern, jacobian));
        let block = block.unwrap_or_else(|| vec![row]);
        let first = block.iter().copied().max_by(|i, j| f[*i].abs().total_cmp(&f[*j].abs()));
        let row = first.unwrap_or(row);
        let label = |row: usize| signature.equations.at(row).to_string();
        InitialError::Singular {
            equation: label(row),
            t: at.t,
            residual: f[row],
            together: block.into_iter().filter(|other| *other != row).map(label).collect(),
            at: readings(system, at, row),
        }
    }
}

/// Derivatives of all unknowns along a solution.
pub(crate) struct Rates<S: System> {
    algebraic: Algebraic<S>,
    jacobian: S::Jacobian,
    f: S::Vector,
    dfdt: S::Vector,
    mass: S::Vector,
}

impl<S: System> Rates<S> {
    pub(crate) fn new(system: &S) -> Self {
        let signature = system.signature();
        let n = signature.unknowns.len();
        Self {
            algebraic: Algebraic::new(system),
            jacobian: S::Jacobian::zeros(signature.jacobian.len()),
            f: S::Vector::zeros(n),
            dfdt: S::Vector::zeros(n),
            mass: S::Vector::zeros(n),
        }
    }

    /// ẏ at consistent values; `None` where algebraic unknowns are not determined.
    pub(crate) fn at(&mut self, system: &S, at: Point<'_>, udot: &[f64]) -> Option<&[f64]> {
        if !system.signature().discrete.automata.is_empty() {
            system.mass(at, self.mass.as_mut());
            self.algebraic.enter_modes(self.mass.as_ref());
        }
        let (f, jacobian) = (self.f.as_mut(), self.jacobian.as_mut());
        system.linearize(at, udot, f, jacobian, self.dfdt.as_mut());
        let pattern = &system.signature().jacobian;
        self.algebraic.rates(pattern, jacobian, f, self.dfdt.as_ref()).ok()?;
        Some(self.f.as_ref())
    }
}

/// Relative pivots below this are zero: corrections of [`CONVERGED`] leave that much of a double root.
fn vanishing(atol: f64) -> f64 {
    (10.0 * CONVERGED * atol).max(NOTHING)
}

fn is_rounding<V: Storage>(
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

/// Sizes of the equations' terms at `y`, to first order.
pub(crate) fn add_terms(terms: &mut [f64], pattern: &Pattern, jacobian: &[f64], y: &[f64]) {
    pattern.for_each(jacobian, |row, column, j| terms[row] += (j * y[column]).abs());
}

/// Sets the rows of differential unknowns to zero.
#[inline]
fn mask(values: &mut [f64], mass: &[f64]) {
    for (value, mass) in values.iter_mut().zip(mass) {
        if *mass != 0.0 {
            *value = 0.0;
        }
    }
}

fn largest(values: &[f64]) -> usize {
    (0..values.len()).max_by(|&i, &j| values[i].abs().total_cmp(&values[j].abs())).unwrap_or(0)
}

fn add_scaled(y: &mut [f64], factor: f64, x: &[f64]) {
    for (y, x) in y.iter_mut().zip(x) {
        *y += factor * x;
    }
}

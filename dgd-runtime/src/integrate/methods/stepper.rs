//! What steps of all families share: work space, the linearisation, and how a step is asked for.
//!
//! A stepper tries a step from (t, y) and gives y⁺ and S⁺, their local errors, and what lies between
//! (t, y) and (t + h, y⁺). Accepting or rejecting it is the caller's business.
//!
//! Families differ in what they need where a step starts, and in what they remember:
//!
//! | family | needs at (t, y) | remembers from step to step |
//! |---|---|---|
//! | Rosenbrock | f, J, df/dt; g, ∂g/∂y, dg/dt | nothing |
//! | explicit Runge–Kutta | – | slopes at the end of the step before |
//! | singly diagonally implicit Runge–Kutta | J | the same |
//! | backward differentiation | – | differences of earlier values, and a factorisation |
//! | Taylor series | the series | nothing |
//!
//! What is remembered holds along a smooth solution only: [`Stepper::restart`] forgets it.

use crate::integrate::drive::Drive;
use crate::integrate::methods::catalogue::MethodKind;
use crate::integrate::methods::multistep::bdf::History;
use crate::integrate::methods::rosenbrock::{dense_vectors, interpolate, interpolate_all};
use crate::integrate::methods::tableaux::MAX_STAGES;
use crate::integrate::methods::taylor::Expansion;
use crate::linalg::norm::Tolerances;
use crate::linalg::{Factorisation, Singular};
use crate::solution::Statistics;
use crate::system::{Point, Storage, System};

/// Work space of the unknowns.
pub(crate) struct Stepper<S: System> {
    pub(in crate::integrate) kind: MethodKind,
    pub(in crate::integrate) factorisation: S::Factorisation,
    /// f, ∂f/∂y and df/dt at the start of the step, as far as the family needs them.
    pub(crate) f: S::Vector,
    pub(crate) jacobian: S::Jacobian,
    pub(crate) dfdt: S::Vector,
    /// Yᵢ, or what it is sought from.
    pub(in crate::integrate) stage: S::Vector,
    /// f there.
    pub(crate) rhs: S::Vector,
    /// Increments, slopes or differences, by family.
    pub(in crate::integrate) k: [S::Vector; MAX_STAGES],
    pub(crate) y_new: S::Vector,
    /// Local error, where no vector of `k` is.
    pub(in crate::integrate) error: S::Vector,
    /// Of the dense output of Rosenbrock methods.
    dense: [S::Vector; 4],
    /// Size of the step tried last, and whether it has been shortened since.
    h: f64,
    is_cut: bool,
    /// Whether nothing is known of the solution before (t, y).
    fresh: bool,
    /// Whether `jacobian` was taken elsewhere than at the start of the step.
    pub(in crate::integrate) moved: bool,
    /// How fast Newton's method converged last.
    pub(in crate::integrate) eta: f64,
    /// Steps in a row that stability limited, and since then those that it did not.
    pub(in crate::integrate) stiff_steps: (u32, u32),
    pub(in crate::integrate) history: History,
    /// Taylor series at the start of the step.
    pub(in crate::integrate) expansion: Expansion,
}

/// Work space of the sensitivities.
pub(crate) struct Directions<S: System> {
    /// S at the start of the step.
    pub(crate) s: S::Sensitivity,
    pub(crate) s_new: S::Sensitivity,
    /// Sizes for tolerances: nominal of the unknown over nominal of the parameter.
    pub(crate) sizes: S::Sensitivity,
    /// g, ∂g/∂y and dg/dt at the start of the step.
    pub(crate) g: S::Sensitivity,
    pub(in crate::integrate) dgdy: S::SensitivityJacobian,
    pub(in crate::integrate) dgdt: S::Sensitivity,
    pub(in crate::integrate) stage: S::Sensitivity,
    pub(in crate::integrate) rhs: S::Sensitivity,
    /// What `k` is to the unknowns.
    pub(in crate::integrate) v: [S::Sensitivity; MAX_STAGES],
    pub(in crate::integrate) error: S::Sensitivity,
    dense: [S::Sensitivity; 4],
}

impl<S: System> Directions<S> {
    pub(crate) fn new(system: &S) -> Self {
        let signature = system.signature();
        let len = signature.unknowns.len() * signature.directions.len();
        let zeros = || S::Sensitivity::zeros(len);
        Self {
            s: zeros(),
            s_new: zeros(),
            sizes: zeros(),
            g: zeros(),
            dgdy: S::SensitivityJacobian::zeros(signature.sensitivity_jacobian.len()),
            dgdt: zeros(),
            stage: zeros(),
            rhs: zeros(),
            v: std::array::from_fn(|_| zeros()),
            error: zeros(),
            dense: std::array::from_fn(|_| zeros()),
        }
    }
}

/// Where a step starts.
pub(crate) struct Base<'a, S: System> {
    pub(crate) system: &'a S,
    pub(crate) p: &'a [f64],
    pub(crate) z: &'a [f64],
    /// 1 where the unknown is differential, 0 where it is algebraic.
    pub(crate) mass: &'a S::Vector,
    pub(crate) t: f64,
}

impl<S: System> Clone for Base<'_, S> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<S: System> Copy for Base<'_, S> {}

/// A step to try: from (t, y) by h, with what equations are solved to.
pub(crate) struct Trial<'a, S: System> {
    pub(crate) base: Base<'a, S>,
    pub(crate) y: &'a S::Vector,
    pub(crate) h: f64,
    pub(crate) sizes: &'a [f64],
    pub(crate) tolerances: Tolerances,
}

impl<S: System> Clone for Trial<'_, S> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<S: System> Copy for Trial<'_, S> {}

/// Evaluations of f that are not finite.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Spoilt {
    Equation(usize),
    Derivative(usize),
}

/// Why a step could not be tried to its end.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Failed {
    /// The matrix of the stages is singular.
    Singular { row: usize },
    /// Newton's method does not converge; the unknown moves most for its size.
    NotConverged { unknown: usize },
    /// An equation that is not finite, and the time of that.
    NotFinite { t: f64, spoilt: Spoilt },
    /// A step that reads itself does not become consistent with itself.
    Unsettled,
}

impl From<Singular> for Failed {
    fn from(Singular { row }: Singular) -> Self {
        Self::Singular { row }
    }
}

/// End of a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum At {
    Start,
    End,
}

impl<S: System> Stepper<S> {
    pub(crate) fn new(system: &S, kind: MethodKind) -> Self {
        let signature = system.signature();
        let n = signature.unknowns.len();
        let zeros = || S::Vector::zeros(n);
        Self {
            kind,
            factorisation: S::Factorisation::new(n, &signature.jacobian),
            f: zeros(),
            jacobian: S::Jacobian::zeros(signature.jacobian.len()),
            dfdt: zeros(),
            stage: zeros(),
            rhs: zeros(),
            k: std::array::from_fn(|_| zeros()),
            y_new: zeros(),
            error: zeros(),
            dense: std::array::from_fn(|_| zeros()),
            h: 0.0,
            is_cut: false,
            fresh: true,
            moved: false,
            eta: 1.0,
            stiff_steps: (0, 0),
            history: History::default(),
            expansion: Expansion::default(),
        }
    }

    /// Forgets what is known of the solution before (t, y): from here on it is another.
    #[inline]
    pub(crate) fn restart(&mut self) {
        self.fresh = true;
        self.history.is_resumed = false;
    }

    /// Whether slopes are to be given by [`Stepper::begin`] before a step is tried.
    #[inline]
    pub(crate) fn wants_slopes(&self) -> bool {
        self.fresh && !matches!(self.kind, MethodKind::Rosenbrock(_) | MethodKind::Taylor(_))
    }

    /// Whether a step is to be tried from a linearisation at (t, y).
    #[inline]
    pub(crate) fn wants_jacobian(&self) -> bool {
        matches!(self.kind, MethodKind::Rosenbrock(_) | MethodKind::Esdirk(_))
    }

    /// Whether a step is to be tried along the series at (t, y).
    #[inline]
    pub(crate) fn wants_series(&self) -> bool {
        matches!(self.kind, MethodKind::Taylor(_))
    }

    /// Whether a linearisation includes that of the sensitivities' equations.
    #[inline]
    pub(crate) fn wants_second_derivatives(&self) -> bool {
        matches!(self.kind, MethodKind::Rosenbrock(_))
    }

    #[inline]
    pub(crate) fn is_multistep(&self) -> bool {
        matches!(self.kind, MethodKind::Bdf(_))
    }

    /// Whether a method with several steps remembers no more than the slope where its solution begins.
    #[inline]
    pub(crate) fn is_at_beginning(&self) -> bool {
        self.history.order == 1 && self.history.equal_steps == 0
    }

    /// Whether equations are solved by iteration, to a part of the tolerance.
    #[inline]
    pub(crate) fn solves_equations(&self) -> bool {
        matches!(self.kind, MethodKind::Esdirk(_) | MethodKind::Bdf(_))
    }

    /// Whether algebraic unknowns can be solved for.
    #[inline]
    pub(crate) fn solves_algebraic(&self) -> bool {
        self.kind.is_implicit()
    }

    /// Evaluates everything that a step from (t, y) shares between its stages.
    #[inline]
    pub(crate) fn linearize(
        &mut self,
        base: Base<'_, S>,
        drive: &mut Drive<S>,
        y: &[f64],
        directions: Option<(&mut Directions<S>, At)>,
    ) {
        let (u, udot) = drive.with_slope(base.t, y);
        let at = Point { t: base.t, y, u, p: base.p, z: base.z };
        let (f, jacobian, dfdt) = (self.f.as_mut(), self.jacobian.as_mut(), self.dfdt.as_mut());
        match directions {
            None => base.system.linearize(at, udot, f, jacobian, dfdt),
            Some((directions, place)) => {
                let s = match place {
                    At::Start => &directions.s,
                    At::End => &directions.s_new,
                };
                base.system.sensitivity_linearize(
                    at,
                    udot,
                    s.as_ref(),
                    f,
                    jacobian,
                    dfdt,
                    directions.g.as_mut(),
                    directions.dgdy.as_mut(),
                    directions.dgdt.as_mut(),
                );
            }
        }
    }

    /// Takes the slopes at (t, y) that `f` and `g` hold, of a solution that begins there, for one
    /// step of size h.
    pub(crate) fn begin(&mut self, h: f64, directions: Option<&mut Directions<S>>) {
        self.fresh = false;
        self.eta = 1.0;
        self.stiff_steps = (0, 0);
        let (slot, scale) = match self.kind {
            MethodKind::Bdf(_) => (1, h),
            MethodKind::Rosenbrock(_)
            | MethodKind::Explicit(_)
            | MethodKind::Esdirk(_)
            | MethodKind::Taylor(_) => (0, 1.0),
        };
        self.history = History::beginning(h, self.history.is_resumed);
        let scaled = |out: &mut [f64], slopes: &[f64]| {
            for (out, slope) in out.iter_mut().zip(slopes) {
                *out = scale * slope;
            }
        };
        scaled(self.k[slot].as_mut(), self.f.as_ref());
        for k in &mut self.k[slot + 1..] {
            k.as_mut().fill(0.0);
        }
        if let Some(d) = directions {
            scaled(d.v[slot].as_mut(), d.g.as_ref());
            for v in &mut d.v[slot + 1..] {
                v.as_mut().fill(0.0);
            }
        }
    }

    /// Tries a step; gives y⁺ in `y_new` and S⁺ in `s_new`.
    #[inline]
    pub(crate) fn attempt(
        &mut self,
        trial: Trial<'_, S>,
        drive: &mut Drive<S>,
        directions: Option<&mut Directions<S>>,
        statistics: &mut Statistics,
    ) -> Result<(), Failed> {
        self.h = trial.h;
        self.is_cut = false;
        match self.kind {
            MethodKind::Rosenbrock(tableau) => {
                statistics.factorisations += 1;
                self.attempt_rosenbrock(tableau, trial, drive, directions)?;
                // The first stage is part of the linearisation.
                statistics.evaluations += tableau.stages() - 1;
                Ok(())
            }
            MethodKind::Explicit(tableau) => {
                self.attempt_explicit(tableau, trial, drive, directions, statistics);
                Ok(())
            }
            MethodKind::Esdirk(tableau) => {
                self.attempt_esdirk(tableau, trial, drive, directions, statistics)
            }
            MethodKind::Bdf(_) => self.attempt_bdf(trial, drive, directions, statistics),
            MethodKind::Taylor(_) => {
                self.attempt_taylor(trial, drive, directions);
                Ok(())
            }
        }
    }

    /// Takes note that the step tried last is accepted.
    #[inline]
    pub(crate) fn advance(&mut self, mass: &S::Vector, directions: Option<&mut Directions<S>>) {
        match self.kind {
            MethodKind::Rosenbrock(_) | MethodKind::Taylor(_) => {}
            MethodKind::Explicit(tableau) | MethodKind::Esdirk(tableau) => {
                tableau.advance(mass.as_ref(), &mut self.k);
                if let Some(d) = directions {
                    tableau.advance(mass.as_ref(), &mut d.v);
                }
            }
            // Values are no longer at equal distances.
            MethodKind::Bdf(_) if self.is_cut => self.restart(),
            MethodKind::Bdf(_) => self.advance_differences(directions),
        }
    }

    /// Shortens the step tried last to size h, for a method that remembers: its solution within the
    /// step is its dense output, which has its order.
    pub(in crate::integrate) fn shorten(
        &mut self,
        h: f64,
        y: &[f64],
        directions: Option<&mut Directions<S>>,
    ) {
        self.h = h;
        self.is_cut = true;
        let Self { history, k, stage, y_new, .. } = self;
        history.interpolate(h, y, k, stage.as_ref(), y_new.as_mut());
        if let Some(d) = directions {
            history.interpolate(h, d.s.as_ref(), &d.v, d.stage.as_ref(), d.s_new.as_mut());
        }
    }

    /// Local error of the step tried last.
    #[inline]
    pub(crate) fn local_error(&self) -> &[f64] {
        match self.kind {
            MethodKind::Rosenbrock(tableau) => self.k[tableau.stages() - 1].as_ref(),
            _ => self.error.as_ref(),
        }
    }

    /// Local error of the sensitivities of the step tried last.
    #[inline]
    pub(crate) fn sensitivity_error<'a>(&self, directions: &'a Directions<S>) -> &'a [f64] {
        match self.kind {
            MethodKind::Rosenbrock(tableau) => directions.v[tableau.stages() - 1].as_ref(),
            _ => directions.error.as_ref(),
        }
    }

    /// The first evaluation of the step tried last that is not finite, and its time.
    pub(crate) fn spoilt(
        &mut self,
        trial: Trial<'_, S>,
        drive: &mut Drive<S>,
        directions: Option<&mut Directions<S>>,
    ) -> Option<(f64, Spoilt)> {
        match self.kind {
            MethodKind::Rosenbrock(tableau) => {
                self.spoilt_rosenbrock(tableau, trial, drive, directions)
            }
            MethodKind::Explicit(tableau) => {
                self.spoilt_slope(tableau, trial, directions.as_deref())
            }
            MethodKind::Taylor(_) => self.spoilt_series(trial),
            // They say so themselves.
            MethodKind::Esdirk(_) | MethodKind::Bdf(_) => None,
        }
    }

    /// Prepares [`Stepper::interpolate`] for the step tried last.
    #[inline]
    pub(crate) fn prepare_dense(&mut self, y: &[f64], directions: Option<&mut Directions<S>>) {
        if let MethodKind::Rosenbrock(tableau) = self.kind {
            let stages = tableau.stages();
            let y_new = self.y_new.as_ref();
            dense_vectors(tableau, y, y_new, &self.k[..stages], &mut self.dense);
            if let Some(d) = directions {
                let (s, s_new) = (d.s.as_ref(), d.s_new.as_ref());
                dense_vectors(tableau, s, s_new, &d.v[..stages], &mut d.dense);
            }
        }
    }

    /// y at the fraction θ of the step tried last.
    #[inline]
    pub(crate) fn interpolate(&self, theta: f64, y: &[f64], out: &mut [f64]) {
        let h = self.h;
        match self.kind {
            MethodKind::Rosenbrock(_) => {
                interpolate(theta, y, &self.dense, out);
            }
            MethodKind::Explicit(tableau) | MethodKind::Esdirk(tableau) => {
                tableau.interpolate(theta, h, y, &self.k, out);
            }
            MethodKind::Bdf(_) => {
                self.history.interpolate(theta * h, y, &self.k, self.stage.as_ref(), out);
            }
            MethodKind::Taylor(_) => self.series_at(theta * h, y, out),
        }
    }

    /// Appends y at each of the `asked` times within the step tried last, from one time to the other;
    /// `row` is work space.
    #[inline]
    pub(crate) fn interpolate_all(
        &self,
        (from, to): (f64, f64),
        asked: &[f64],
        y: &S::Vector,
        row: &mut S::Vector,
        out: &mut Vec<f64>,
    ) {
        let per_h = 1.0 / (to - from);
        if let MethodKind::Rosenbrock(_) = self.kind {
            interpolate_all((from, per_h), asked, y, &self.dense, out);
            return;
        }
        for t in asked {
            self.interpolate((t - from) * per_h, y.as_ref(), row.as_mut());
            out.extend_from_slice(row.as_ref());
        }
    }

    /// Appends S at each of the `asked` times within the step tried last, from one time to the other;
    /// `row` is work space.
    #[inline]
    pub(crate) fn interpolate_all_sensitivities(
        &self,
        (from, to): (f64, f64),
        asked: &[f64],
        directions: &Directions<S>,
        row: &mut S::Sensitivity,
        out: &mut Vec<f64>,
    ) {
        let per_h = 1.0 / (to - from);
        if let MethodKind::Rosenbrock(_) = self.kind {
            let Directions { s, dense, .. } = directions;
            interpolate_all((from, per_h), asked, s, dense, out);
            return;
        }
        for t in asked {
            self.interpolate_sensitivities((t - from) * per_h, directions, row.as_mut());
            out.extend_from_slice(row.as_ref());
        }
    }

    /// Appends y at the fraction θ of the step tried last, of `chosen` unknowns only. `row` is work
    /// space.
    pub(crate) fn interpolate_chosen(
        &mut self,
        theta: f64,
        y: &[f64],
        chosen: &[usize],
        row: &mut [f64],
        out: &mut Vec<f64>,
    ) {
        if let MethodKind::Rosenbrock(tableau) = self.kind {
            let y_new = self.y_new.as_ref();
            out.extend(chosen.iter().map(|&i| {
                let k = self.k.each_ref().map(|k| [k.as_ref().get(i).copied().unwrap_or(0.0)]);
                let (mut dense, mut value) = ([[0.0]; 4], [0.0]);
                let stages = tableau.stages();
                dense_vectors(tableau, &[y[i]], &[y_new[i]], &k[..stages], &mut dense);
                interpolate(theta, &[y[i]], &dense, &mut value);
                value[0]
            }));
            return;
        }
        self.prepare_dense(y, None);
        self.interpolate(theta, y, row);
        out.extend(chosen.iter().map(|i| row[*i]));
    }

    /// S at the fraction θ of the step tried last.
    #[inline]
    pub(crate) fn interpolate_sensitivities(
        &self,
        theta: f64,
        directions: &Directions<S>,
        out: &mut [f64],
    ) {
        let h = self.h;
        let Directions { s, v, stage, dense, .. } = directions;
        match self.kind {
            MethodKind::Rosenbrock(_) => {
                interpolate(theta, s.as_ref(), dense, out);
            }
            MethodKind::Explicit(tableau) | MethodKind::Esdirk(tableau) => {
                tableau.interpolate(theta, h, s.as_ref(), v, out);
            }
            MethodKind::Bdf(_) => {
                self.history.interpolate(theta * h, s.as_ref(), v, stage.as_ref(), out);
            }
            MethodKind::Taylor(_) => self.sensitivity_series_at(theta * h, s.as_ref(), out),
        }
    }
}

#[cfg(test)]
mod tests;

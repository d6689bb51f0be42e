//! Saltation: how unknowns and sensitivities change at the instant of a mode change.
//!
//! The time t_e of the instant depends on the parameters, τ = dt_e/dθ:
//!
//! ```text
//!   a condition on time        τ from the condition itself
//!   e(t, y, u, p) passes zero  τ = −(∂e/∂y S⁻ + ∂e/∂θ) / ė,   ė = ∂e/∂y ẏ⁻ + ∂e/∂t + ∂e/∂u u̇
//!   inputs jump at a sample    τ = 0
//! ```
//!
//! With the total derivative D = d y(t_e)/dθ = S + ẏ τ of all unknowns just before,
//!
//! ```text
//!   kept:    y⁺ = y⁻,  D⁺ = D⁻
//!   reset:   y⁺ = r,   D⁺ = ∂r/∂y S⁻ + ∂r/∂θ + (∂r/∂y ẏ⁻ + ∂r/∂t + ∂r/∂u u̇) τ
//!   after:   S⁺ = D⁺ − ẏ⁺ τ where the unknown is differential, the others solve 0 = g_a
//! ```
//!
//! "Just before" is before the whole instant: an unknown that becomes differential in a transition
//! which a jump of an input triggers keeps the value it had before that jump. Where modes tie states
//! together, these jump (`jump.rs`).
//!
//! # Source
//!
//! Galán, Feehery and Barton, Parametric sensitivity functions for hybrid discrete/continuous
//! systems, Applied Numerical Mathematics 31 (1999) 17–47.

use crate::error::IntegrateError;
use crate::integrate::events::simultaneous::AT_ONCE;
use crate::integrate::events::transitions::SLIDING;
use crate::integrate::simulation::Simulation;
use crate::linalg::{Factorisation, Singular};
use crate::problem::Problem;
use crate::solution::{Solution, UndefinedCause, UndefinedSensitivity};
use crate::solved::SolvableSystem;
use crate::system::{Crossing, EvaluationPoint, Pattern, Signature};

/// Work space of an instant; matrices by columns, one for each direction.
pub(in crate::integrate) struct Saltation {
    /// τ.
    pub(in crate::integrate) tau: Vec<f64>,
    /// ẏ of all unknowns.
    ydot: Vec<f64>,
    /// y and D just before the instant; for unknowns that are differential in an intermediate mode, those in that mode.
    y_left: Vec<f64>,
    total_left: Vec<f64>,
    /// D.
    pub(in crate::integrate) total: Vec<f64>,
    mass: Vec<f64>,
    /// Whether unknowns had derivatives in the old modes.
    had_rate: Vec<bool>,
    /// Derivatives of the event functions e.
    of_events: RowDerivatives,
    r: Vec<f64>,
    /// Derivatives of r.
    of_resets: RowDerivatives,
    /// d/dθ of two rows.
    pub(in crate::integrate) rows: [Vec<f64>; 2],
}

/// Derivatives of rows: non-zeros of ∂/∂y and of ∂/∂θ at fixed unknowns, and ∂/∂t + ∂/∂u u̇.
struct RowDerivatives {
    unknowns: Vec<f64>,
    directions: Vec<f64>,
    time: Vec<f64>,
}

impl RowDerivatives {
    fn new(unknowns: &Pattern, directions: &Pattern, rows: usize) -> Self {
        Self {
            unknowns: vec![0.0; unknowns.len()],
            directions: vec![0.0; directions.len()],
            time: vec![0.0; rows],
        }
    }

    /// d/dθ of one row at fixed time, ∂/∂y S + ∂/∂θ, for each direction; `patterns` are those of ∂/∂y and ∂/∂θ.
    fn along_directions(
        &self,
        patterns: [&Pattern; 2],
        row: usize,
        s: &[f64],
        n: usize,
        out: &mut [f64],
    ) {
        let [unknowns, directions] = patterns;
        out.fill(0.0);
        for ((of, column), slope) in unknowns.positions().zip(&self.unknowns) {
            if of == row {
                for (out, s) in out.iter_mut().zip(s.chunks_exact(n)) {
                    *out += slope * s[column];
                }
            }
        }
        for ((of, j), slope) in directions.positions().zip(&self.directions) {
            if of == row {
                out[j] += slope;
            }
        }
    }
}

impl Saltation {
    pub(in crate::integrate) fn new(signature: &Signature, n_s: usize) -> Self {
        let discrete = &signature.discrete;
        let n = if discrete.is_empty() { 0 } else { signature.unknowns.len() };
        let n_s = if discrete.is_empty() { 0 } else { n_s };
        let n_e = discrete.transitions().count();
        let n_r = discrete.transitions().map(|(_, transition)| transition.resets.len()).sum();
        let zeros = |n: usize| vec![0.0; n];
        Self {
            tau: zeros(n_s),
            ydot: zeros(n),
            y_left: zeros(n),
            total_left: zeros(n * n_s),
            total: zeros(n * n_s),
            mass: zeros(n),
            had_rate: vec![false; n],
            of_events: RowDerivatives::new(
                &discrete.event_jacobian,
                &discrete.event_directions,
                n_e,
            ),
            r: zeros(n_r),
            of_resets: RowDerivatives::new(
                &discrete.reset_jacobian,
                &discrete.reset_directions,
                n_r,
            ),
            rows: [zeros(n_s), zeros(n_s)],
        }
    }

    /// Evaluates derivatives of event functions. Returns ∂e/∂t + ∂e/∂u u̇.
    pub(super) fn take_event_derivatives(
        &mut self,
        system: &impl SolvableSystem,
        at: EvaluationPoint<'_>,
        udot: &[f64],
    ) -> &[f64] {
        let RowDerivatives { unknowns, directions, time } = &mut self.of_events;
        system.event_derivatives(at, udot, directions, unknowns, time);
        time
    }

    /// ẏ of all unknowns.
    pub(in crate::integrate) fn ydot(&self) -> &[f64] {
        &self.ydot
    }

    /// ∂e/∂y, and ∂e/∂t + ∂e/∂u u̇.
    pub(in crate::integrate) fn dedy(&self) -> &[f64] {
        &self.of_events.unknowns
    }

    pub(in crate::integrate) fn dedt(&self) -> &[f64] {
        &self.of_events.time
    }

    /// Whether the time of the instant does not depend on parameters.
    fn is_fixed(&self) -> bool {
        self.tau.iter().all(|tau| *tau == 0.0)
    }
}

impl<S: SolvableSystem> Simulation<'_, S> {
    /// Begins the instant of a sample, at which inputs may jump.
    #[inline]
    pub(in crate::integrate) fn begin_sample(&mut self) {
        if S::FEATURES.events && self.discrete.has_transitions() {
            let saltation = &mut self.discrete.saltation;
            saltation.tau.fill(0.0);
            saltation.y_left.copy_from_slice(self.y.as_ref());
            if let Some(d) = &self.directions {
                saltation.total_left.copy_from_slice(d.s.as_ref());
            }
        }
    }

    /// Begins an instant with the derivatives τ of its time, which are already set.
    pub(in crate::integrate) fn begin_instant(&mut self, solution: &mut Solution) {
        self.take_totals(solution);
        let saltation = &mut self.discrete.saltation;
        saltation.y_left.copy_from_slice(self.y.as_ref());
        saltation.total_left.copy_from_slice(&saltation.total);
    }

    /// Begins the instant at which the event function of a transition passes zero.
    pub(in crate::integrate) fn begin_event(&mut self, k: usize, solution: &mut Solution) {
        if self.is_continuous(k) {
            self.discrete.saltation.tau.fill(0.0);
        } else if self.directions.is_some() && self.take_event_slopes(solution) {
            let (rate, size) = self.event_rate(k);
            let turned = match self.discrete.turned.take() {
                Some((turned, depth)) if turned == k => depth,
                _ => f64::INFINITY,
            };
            let depth = turned.min(self.depth(k, rate));
            let touches = depth <= self.tolerances.atol * size;
            if touches || rate == 0.0 || !rate.is_finite() {
                self.touch(k, solution);
            } else {
                self.set_time_of(k, rate);
            }
        }
        self.begin_instant(solution);
    }

    /// Ends sensitivities where a transition's threshold has been touched, if it has.
    pub(super) fn end_at_touch(&mut self, k: Option<usize>, solution: &mut Solution) {
        if let Some(k) = k
            && self.directions.is_some()
            && self.take_event_slopes(solution)
        {
            self.touch(k, solution);
        }
    }

    /// Ends sensitivities if the event function of the k-th transition, whose slopes have been taken, depends on the
    /// parameters: with others it would pass its threshold, or stay away from it.
    fn touch(&mut self, k: usize, solution: &mut Solution) {
        let mut tau = std::mem::take(&mut self.discrete.saltation.tau);
        self.event_along_directions(k, &mut tau);
        let depends = tau.iter().any(|tau| *tau != 0.0) && !self.touches_always(k, &tau);
        tau.fill(0.0);
        self.discrete.saltation.tau = tau;
        if depends {
            self.end_sensitivities_at_threshold(k, solution);
        }
    }

    /// Whether the event function of the k-th transition, with these derivatives d at the touch, touches its threshold
    /// for other parameters as well, as a square does: d vanishes where the rate ė does.
    ///
    /// ```text
    ///   d − ė Δd/Δė ≪ Δd,   Δ: from here to a point further along ẏ
    /// ```
    fn touches_always(&mut self, k: usize, d: &[f64]) -> bool {
        const FURTHER: f64 = 1e-3;
        const VANISHES: f64 = 1e-3;
        let (rate, _) = self.event_rate(k);
        let step = FURTHER * self.discrete.sampled;
        let t = self.t + step;
        let Problem { system, p, .. } = *self.problem;
        for (moved, (y, ydot)) in self
            .row
            .as_mut()
            .iter_mut()
            .zip(self.y.as_ref().iter().zip(self.discrete.saltation.ydot()))
        {
            *moved = y + step * ydot;
        }
        let (u, udot) = self.drive.with_slope(t, self.row.as_ref());
        let point = EvaluationPoint { t, y: self.row.as_ref(), u, p, z: &self.discrete.schedule.z };
        self.discrete.saltation.take_event_derivatives(system, point, udot);
        let (moved_rate, _) = self.event_rate(k);
        let mut moved = std::mem::take(&mut self.discrete.saltation.rows[0]);
        self.event_along_directions(k, &mut moved);
        let part = rate / (moved_rate - rate);
        let vanishes = d.iter().zip(&moved).all(|(d, moved)| {
            let change = moved - d;
            (d - part * change).abs() <= VANISHES * change.abs()
        });
        self.discrete.saltation.rows[0] = moved;
        vanishes
    }

    /// τ of the event function of the k-th transition, whose slopes have been taken.
    fn set_time_of(&mut self, k: usize, rate: f64) {
        let mut tau = std::mem::take(&mut self.discrete.saltation.tau);
        self.event_along_directions(k, &mut tau);
        for tau in &mut tau {
            *tau = -*tau / rate;
        }
        self.discrete.saltation.tau = tau;
    }

    /// ∂e/∂y S + ∂e/∂θ of the event function of the k-th transition, whose slopes have been taken, for each direction.
    pub(in crate::integrate) fn event_along_directions(&self, k: usize, out: &mut [f64]) {
        let Some(d) = &self.directions else { return };
        let discrete = &self.problem.system.signature().discrete;
        let patterns = [&discrete.event_jacobian, &discrete.event_directions];
        let Saltation { of_events, ydot, .. } = &self.discrete.saltation;
        of_events.along_directions(patterns, k, d.s.as_ref(), ydot.len().max(1), out);
    }

    /// Gives a transition within an instant the derivatives of its own time if the solution passes its threshold by
    /// itself just now, and not by a jump of this instant: rounding may take it past while something else happens.
    pub(in crate::integrate) fn follow_threshold(&mut self, k: usize, solution: &mut Solution) {
        if self.directions.is_none() || self.is_continuous(k) || !self.take_event_slopes(solution) {
            return;
        }
        let (rate, _) = self.event_rate(k);
        let passes = self.crossing(k).is_past(rate);
        if passes && (self.discrete.e[k] / rate).abs() <= self.at_once(AT_ONCE) {
            self.set_time_of(k, rate);
        }
    }

    /// Computes ∂e/∂θ, ∂e/∂y, and ∂e/∂t + ∂e/∂u u̇ of all event functions, and ẏ. Returns false if sensitivities are not
    /// wanted or unknowns have no slopes.
    pub(in crate::integrate) fn take_event_slopes(&mut self, solution: &mut Solution) -> bool {
        if !self.take_slopes(solution) {
            return false;
        }
        let Problem { system, p, .. } = *self.problem;
        let (u, udot) = self.drive.with_slope(self.t, self.y.as_ref());
        let point =
            EvaluationPoint { t: self.t, y: self.y.as_ref(), u, p, z: &self.discrete.schedule.z };
        self.discrete.saltation.take_event_derivatives(system, point, udot);
        true
    }

    /// ė = ∂e/∂y ẏ + ∂e/∂t + ∂e/∂u u̇, and the change of e if all unknowns changed by their sizes.
    pub(in crate::integrate) fn event_rate(&self, k: usize) -> (f64, f64) {
        let saltation = &self.discrete.saltation;
        let (mut rate, mut size) = (saltation.dedt()[k], 0.0_f64);
        let pattern = &self.problem.system.signature().discrete.event_jacobian;
        for ((row, column), slope) in pattern.positions().zip(saltation.dedy()) {
            if row == k {
                rate += slope * saltation.ydot[column];
                size += (slope * self.sizes.as_ref()[column]).abs();
            }
        }
        (rate, size)
    }

    /// The direction in which the event function of a transition passes its threshold.
    fn crossing(&self, k: usize) -> Crossing {
        let mut transitions = self.problem.system.signature().discrete.transitions();
        transitions.nth(k).map_or(Crossing::Rises, |(_, transition)| transition.crossing)
    }

    /// Whether ẏ is the same on both sides of a transition without resets: at corners, and where a solution stops
    /// sliding along a surface. Then S is continuous too, whatever τ is.
    pub(in crate::integrate) fn is_continuous(&self, k: usize) -> bool {
        let discrete = &self.problem.system.signature().discrete;
        discrete.transitions().nth(k).is_some_and(|(automaton, transition)| {
            let kind = discrete.automata[automaton].kind;
            kind.keeps_slopes() || (kind.has_surface() && transition.from == SLIDING)
        })
    }

    /// Computes ẏ of all unknowns. Returns false if sensitivities are not wanted or algebraic unknowns have no slope.
    ///
    /// ẏ_d = f_d and 0 = ∂f_a/∂y ẏ + ∂f_a/∂t + ∂f_a/∂u u̇.
    fn take_slopes(&mut self, solution: &mut Solution) -> bool {
        self.linearize_values();
        let ydot = self.discrete.saltation.ydot.as_mut_slice();
        ydot.copy_from_slice(self.stepper.f.as_ref());
        if self.algebraic.is_empty() {
            return true;
        }
        let pattern = &self.problem.system.signature().jacobian;
        let (jacobian, sizes) = (self.stepper.jacobian.as_ref(), self.sizes.as_ref());
        let factorised = self.algebraic.factorise(pattern, jacobian, sizes);
        solution.statistics.factorisations += 1;
        if let Err(Singular { row }) = factorised {
            self.end_sensitivities(self.t, row, solution);
            return false;
        }
        let mass = self.algebraic.mass.as_ref();
        for ((ydot, dfdt), mass) in ydot.iter_mut().zip(self.stepper.dfdt.as_ref()).zip(mass) {
            if *mass == 0.0 {
                *ydot = *dfdt;
            }
        }
        self.algebraic.factorisation.solve(ydot);
        true
    }

    /// D = S + ẏ τ at (t, y).
    fn take_totals(&mut self, solution: &mut Solution) {
        if self.directions.is_none() {
            return;
        }
        let is_fixed = self.discrete.saltation.is_fixed();
        if !is_fixed && !self.take_slopes(solution) {
            return;
        }
        let Some(d) = &self.directions else { return };
        let Saltation { tau, ydot, total, .. } = &mut self.discrete.saltation;
        total.copy_from_slice(d.s.as_ref());
        if !is_fixed {
            for (total, tau) in total.chunks_exact_mut(ydot.len().max(1)).zip(tau.iter()) {
                for (total, ydot) in total.iter_mut().zip(ydot.iter()) {
                    *total += ydot * tau;
                }
            }
        }
    }

    /// Sets new values and total derivatives of the unknowns that a transition resets; the others keep theirs.
    pub(in crate::integrate) fn reset(&mut self, k: usize, solution: &mut Solution) {
        self.take_totals(solution);
        let Problem { system, p, .. } = *self.problem;
        let discrete = &system.signature().discrete;
        let first: usize = discrete.transitions().take(k).map(|(_, t)| t.resets.len()).sum();
        let Some((_, transition)) = discrete.transitions().nth(k) else { return };
        if transition.resets.is_empty() {
            return;
        }
        let (u, udot) = self.drive.with_slope(self.t, self.y.as_ref());
        let point =
            EvaluationPoint { t: self.t, y: self.y.as_ref(), u, p, z: &self.discrete.schedule.z };
        let saltation = &mut self.discrete.saltation;
        system.resets(point, &mut saltation.r);
        if let Some(d) = &self.directions {
            let is_fixed = saltation.is_fixed();
            let Saltation { of_resets, ydot, tau, total, rows: [row, _], .. } = saltation;
            let RowDerivatives { unknowns, directions, time } = of_resets;
            system.reset_derivatives(point, udot, directions, unknowns, time);
            // ṙ replaces ∂r/∂t + ∂r/∂u u̇; it is not needed if the time is fixed.
            if !is_fixed {
                for ((row, column), slope) in discrete.reset_jacobian.positions().zip(&*unknowns) {
                    time[row] += slope * ydot[column];
                }
            }
            let n = ydot.len();
            let patterns = [&discrete.reset_jacobian, &discrete.reset_directions];
            for (q, unknown) in (first..).zip(transition.resets.iter()) {
                of_resets.along_directions(patterns, q, d.s.as_ref(), n.max(1), row);
                for (j, (tau, dr)) in tau.iter().zip(&*row).enumerate() {
                    let along = if *tau == 0.0 { 0.0 } else { of_resets.time[q] * tau };
                    total[j * n + unknown] = dr + along;
                }
            }
        }
        for (q, unknown) in (first..).zip(transition.resets.iter()) {
            self.y.as_mut()[*unknown] = saltation.r[q];
            // The value that it keeps when it becomes differential.
            saltation.y_left[*unknown] = saltation.r[q];
            for j in 0..saltation.tau.len() {
                let entry = j * saltation.ydot.len() + unknown;
                saltation.total_left[entry] = saltation.total[entry];
            }
        }
    }

    /// Applies the current discrete numbers: unknowns that become differential keep their values, or jump if
    /// `transition`, the one that has been made, ties them together; the algebraic ones are solved for, and sensitivities
    /// follow.
    pub(in crate::integrate) fn take_over(
        &mut self,
        transition: Option<usize>,
        solution: &mut Solution,
    ) -> Result<(), IntegrateError> {
        if self.discrete.has_transitions() {
            self.enter_modes(transition);
        }
        self.make_values_consistent()?;
        if transition.is_some() {
            self.tell_jumps(solution);
        }
        if self.directions.is_some() {
            self.linearize_values();
            let f = self.stepper.f.as_ref();
            let n = f.len().max(1);
            let Saltation { tau, total, .. } = &self.discrete.saltation;
            if let Some(d) = &mut self.directions {
                // S = D − f τ; algebraic rows are overwritten.
                let columns = d.s.as_mut().chunks_exact_mut(n).zip(total.chunks_exact(n));
                for ((s, total), tau) in columns.zip(tau) {
                    for ((s, total), f) in s.iter_mut().zip(total).zip(f) {
                        *s = if *tau == 0.0 { *total } else { total - f * tau };
                    }
                }
            }
            if !self.algebraic.is_empty() {
                self.make_sensitivities_consistent(solution);
            }
        }
        self.remember_states();
        Ok(())
    }

    /// Enters the current modes, which decide which unknowns have derivatives.
    fn enter_modes(&mut self, transition: Option<usize>) {
        let mut mass = std::mem::take(&mut self.discrete.saltation.mass);
        let mut had_rate = std::mem::take(&mut self.discrete.saltation.had_rate);
        for (i, had) in had_rate.iter_mut().enumerate() {
            *had = self.has_rate(i, self.algebraic.mass.as_ref());
        }
        self.take_mass(&mut mass);
        self.evaluate_jumps();
        self.keep_what_gets_a_derivative(&had_rate, &mass);
        if let Some(k) = transition {
            self.jump_onto_constraints(k, &had_rate);
        }
        if self.select_states() {
            self.take_mass(&mut mass);
        }
        self.algebraic.enter_modes(&mass);
        self.discrete.saltation.mass = mass;
        self.discrete.saltation.had_rate = had_rate;
    }

    /// The diagonal of M in the current modes.
    fn take_mass(&mut self, mass: &mut [f64]) {
        let Problem { system, p, .. } = *self.problem;
        let u = self.drive.evaluate(self.t, self.y.as_ref());
        system.mass(EvaluationPoint { t: self.t, y: &[], u, p, z: self.discrete.z() }, mass);
    }

    /// Whether an unknown has a derivative, as a state or because constraints determine it.
    fn has_rate(&self, i: usize, mass: &[f64]) -> bool {
        mass[i] != 0.0 || self.jumps.as_deref().is_some_and(|jumps| jumps.has_rate(i))
    }

    /// Unknowns that had no derivative in the old modes and have one now start from their values before the instant.
    fn keep_what_gets_a_derivative(&mut self, had_rate: &[bool], mass: &[f64]) {
        let n = mass.len();
        for (i, had) in had_rate.iter().enumerate() {
            if *had || !self.has_rate(i, mass) {
                continue;
            }
            let saltation = &mut self.discrete.saltation;
            self.y.as_mut()[i] = saltation.y_left[i];
            for j in 0..saltation.tau.len() {
                saltation.total[j * n + i] = saltation.total_left[j * n + i];
            }
        }
    }

    /// Remembers the unknowns with derivatives, so that later transitions of the instant keep them.
    fn remember_states(&mut self) {
        let n = self.y.as_ref().len();
        for i in 0..n {
            if self.has_rate(i, self.algebraic.mass.as_ref()) {
                let saltation = &mut self.discrete.saltation;
                saltation.y_left[i] = self.y.as_ref()[i];
                for j in 0..saltation.tau.len() {
                    saltation.total_left[j * n + i] = saltation.total[j * n + i];
                }
            }
        }
    }

    fn end_sensitivities_at_threshold(&mut self, k: usize, solution: &mut Solution) {
        self.directions = None;
        let discrete = &self.problem.system.signature().discrete;
        let automaton = discrete.transitions().nth(k).map(|(automaton, _)| automaton);
        let equation =
            automaton.map_or_else(String::new, |k| discrete.automata[k].name.to_string());
        let cause = UndefinedCause::Grazing;
        let (from, until) = (self.t, self.t);
        solution.undefined.push(UndefinedSensitivity { from, until, equation, cause });
    }
}
